//! Whether `mauve check` fails, and what it says about the deadlines.

use mauve_diagnostics::{
    Finding, Suppression, code_named, is_lowered, is_missing_proof, missing_proof, supported,
};
use mauve_hir::{Config, config_of};
use mauve_projects::analysis_document::{Deployed, Proved};
use mauve_wcrt::chains::{ChainReport, chains_of};
use mauve_wcrt::{ActivityReport, Basis, Report};

use crate::text::counted;

/// The findings that are not shown, each with the reason.
pub(crate) type Suppressed<'db> = [(Finding<'db>, Suppression)];

/// Returns whether a deadline of these deployments, or the limit of a chain, has to be proved, and is not.
///
/// A missing proof does not count if `mauve.toml` accepts it with a reason, or if `[lints]` lowers its code. A comment hides
/// the message only. While the project has errors, nothing is proved, and nothing of this applies.
pub(crate) fn is_proof_missing(deployed: &[Deployed<'_>]) -> bool {
    deployed.iter().any(|it| {
        let none = Config::default();
        let config = it.model().map_or(&none, |(project, _)| config_of(it.db, project.workspace(it.db)));
        let fails = |activity: &ActivityReport<'_>| {
            missing_proof(activity)
                .is_some_and(|code| !is_lowered(config, code) && it.acceptance(activity).is_none())
        };
        let is_empty = |it: &Report<'_>| it.activities.is_empty() && !it.not_analysed.is_empty();
        let mut all = it.reports.iter().map(|(_, report)| report);
        it.errors > 0
            || all.any(|report| is_empty(report) || report.activities.iter().any(fails))
            || code_named("chain-broken").is_some_and(|code| !is_lowered(config, code))
                && limited(it).iter().any(|chain| chain.latency.is_none())
    })
}

/// Returns the chains with a limit, over all levels.
fn limited<'db>(deployed: &Deployed<'db>) -> Vec<&'db ChainReport<'db>> {
    let (db, Some((project, of))) = (deployed.db, deployed.model()) else { return Vec::new() };
    if config_of(db, project.workspace(db)).chains.iter().all(|it| it.latency.is_none()) {
        return Vec::new();
    }
    let all = deployed.reports.iter().flat_map(|(query, _)| &chains_of(db, project, of, *query).all);
    all.filter(|chain| chain.limit.is_some()).collect()
}

/// Says how many limits of chains hold; nothing without any.
pub(crate) fn limits(deployed: &[Deployed<'_>]) -> String {
    let all: Vec<_> = deployed.iter().flat_map(limited).collect();
    let is_open = |it: &&&ChainReport<'_>| !it.is_within_limit();
    match (all.len(), all.iter().filter(is_open).count()) {
        (0, _) => String::new(),
        (1, 0) => "; the limit of the chain holds".to_owned(),
        (1, _) => "; the limit of the chain is not proved".to_owned(),
        (all, 0) => format!("; all {all} limits of chains hold"),
        (all, 1) => format!("; 1 of {all} limits of chains is not proved"),
        (all, open) => format!("; {open} of {all} limits of chains are not proved"),
    }
}

/// Says what the level supports, of the deployment with the most executions that may exceed their times; nothing where no time
/// depends on a level.
pub(crate) fn supports(deployed: &[Deployed<'_>]) -> String {
    let all = deployed.iter().flat_map(|it| it.supports().into_iter().map(move |support| (it.name, support)));
    let worst = all.max_by(|(_, a), (_, b)| a.exceedances_per_hour().total_cmp(&b.exceedances_per_hour()));
    let name = |name: &str| if deployed.len() > 1 { format!("{name}: ") } else { String::new() };
    worst.map_or_else(String::new, |(of, support)| format!("; {}{}", name(of), supported(support)))
}

/// Says what a proof depends on: `, if the 24 execution times hold and no codel waits`.
fn conditions(deployed: &[Deployed<'_>]) -> String {
    let mut all = Basis::default();
    deployed.iter().filter_map(Deployed::basis).for_each(|basis| all.add(basis));
    conditions_of(&all)
}

/// The same for what figures depend on.
pub(crate) fn conditions_of(all: &Basis) -> String {
    if all.times == 0 {
        return String::new();
    }
    let times = match all.times {
        1 => "the execution time holds".to_owned(),
        several => format!("the {several} execution times hold"),
    };
    let waits = if all.waits == 0 { "no codel waits" } else { "no codel waits longer than written" };
    let mut more = match all.ports.len() {
        0 => Vec::new(),
        1 => vec!["1 large port costs nothing".to_owned()],
        several => vec![format!("{several} large ports cost nothing")],
    };
    if all.gateways > 0 {
        more.push("the gateway waits for no lock of Cyclone DDS".to_owned());
    }
    match more.pop() {
        None => format!(", if {times} and {waits}"),
        Some(last) => {
            let rest: String = more.iter().map(|it| format!(", {it}")).collect();
            format!(", if {times}, {waits}{rest}, and {last}")
        }
    }
}

/// Says how many deadlines are proved, and how many messages about the others are accepted or hidden by comments.
pub(crate) fn deadlines(deployed: &[Deployed<'_>], suppressed: &Suppressed<'_>) -> String {
    let Proved { all, met, proved } = Proved::of(deployed);
    let conditions = conditions(deployed);
    let is_hidden = |(finding, why): &&(Finding<'_>, Suppression)| {
        matches!(why, Suppression::Comment(_)) && is_missing_proof(finding.diagnostic.code)
    };
    let accepted = match deployed.iter().map(Deployed::accepted_count).sum() {
        0 => None,
        count => Some(format!("{count} accepted")),
    };
    let hidden = match suppressed.iter().filter(is_hidden).count() {
        0 => None,
        count => Some(format!("{} suppressed", counted(count, "message"))),
    };
    let notes: Vec<String> = accepted.into_iter().chain(hidden).collect();
    let notes = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join(", ")) };
    match (deployed, all - proved) {
        ([], _) => "no deployment, so no response times".to_owned(),
        _ if all == 0 => "no deadlines".to_owned(),
        _ if proved < met && all == 1 => {
            "the deadline is met, but not proved: fix the errors first".to_owned()
        }
        _ if proved < met => {
            let verb = if met == 1 { "is" } else { "are" };
            let proved = match proved {
                0 => "none is".to_owned(),
                1 => "only 1 is".to_owned(),
                several => format!("only {several} are"),
            };
            format!("{met} of {all} deadlines {verb} met, but {proved} proved: fix the errors first")
        }
        (_, 0) if all == 1 => format!("the deadline is proved{conditions}"),
        (_, 0) => format!("all {all} deadlines are proved{conditions}"),
        _ if all == 1 => format!("the deadline is not proved{notes}"),
        (_, 1) => format!("1 of {all} deadlines is not proved{notes}"),
        (_, open) => format!("{open} of {all} deadlines are not proved{notes}"),
    }
}
