//! Whether `mauve check` fails, and what it says about the deadlines.

use std::collections::BTreeSet;

use mauve_diagnostics::{Code, Diagnostic, Finding, Suppression, is_lowered, missing_proof};
use mauve_hir::{Config, config_of};
use mauve_timing::Status;
use mauve_wcrt::{ActivityReport, Report, Verdict};

use crate::analysis_document::{Deployed, Origin, Proved};

/// The findings that are not shown, each with the reason.
pub(super) type Suppressed<'db> = [(Finding<'db>, Suppression)];

/// Returns whether a deadline of these deployments has to be proved, and is not.
///
/// A missing proof does not count if `mauve.toml` accepts it with a reason, if `[lints]` lowers its code, or if a comment
/// suppresses its diagnostic. While the project has errors, nothing is proved, and nothing of this applies.
pub(super) fn is_proof_missing(deployed: &[Deployed<'_>], suppressed: &Suppressed<'_>) -> bool {
    deployed.iter().any(|it| {
        let config = match it.origin {
            Origin::Model(project) => config_of(it.db, project.workspace(it.db)),
            Origin::File { .. } => &Config::default(),
        };
        let fails = |activity: &ActivityReport<'_>| {
            missing_proof(activity).is_some_and(|code| {
                let is_suppressed = suppressed.iter().any(|(it, _)| reports(&it.diagnostic, code, activity));
                !is_suppressed && !is_lowered(config, code) && it.acceptance(activity).is_none()
            })
        };
        let is_empty = |it: &Report<'_>| it.activities.is_empty() && !it.not_analysed.is_empty();
        let mut all = it.reports.iter().map(|(_, report)| report);
        it.errors > 0 || all.any(|report| is_empty(report) || report.activities.iter().any(fails))
    })
}

/// Returns whether a diagnostic of this code is about the activity. One diagnostic reports all activities of an overloaded CPU.
fn reports(diagnostic: &Diagnostic<'_>, code: &Code, activity: &ActivityReport<'_>) -> bool {
    let is_unbounded = activity.verdict == Verdict::RealTime(Status::Unbounded);
    let related = diagnostic.related.iter().map(|(at, _)| at).filter(|_| is_unbounded);
    diagnostic.code == code && related.chain([&diagnostic.at]).any(|at| Some(at) == activity.at.as_ref())
}

/// Says how many deadlines are proved.
pub(super) fn deadlines(deployed: &[Deployed<'_>]) -> String {
    let Proved { all, met, proved } = Proved::of(deployed);
    let assumed: BTreeSet<&str> = deployed.iter().flat_map(Deployed::assumed).collect();
    let assuming = match assumed.len() {
        0 => String::new(),
        1 => ", assuming the time of 1 codel".to_owned(),
        several => format!(", assuming the times of {several} codels"),
    };
    let accepted = match deployed.iter().map(Deployed::accepted_count).sum() {
        0 => String::new(),
        count => format!(" ({count} accepted)"),
    };
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
        (_, 0) if all == 1 => format!("the deadline is proved{assuming}"),
        (_, 0) => format!("all {all} deadlines are proved{assuming}"),
        _ if all == 1 => format!("the deadline is not proved{accepted}"),
        (_, 1) => format!("1 of {all} deadlines is not proved{accepted}"),
        (_, open) => format!("{open} of {all} deadlines are not proved{accepted}"),
    }
}
