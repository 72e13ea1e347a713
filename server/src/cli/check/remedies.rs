//! What `mauve check --fix` says about missed deadlines: other priorities, CPUs and periods are a choice, so it applies none.

use mauve_wcrt::better_timing::{BetterTiming, better_priorities};
use mauve_wcrt::response_times_if;

use crate::analysis_document::{Deployed, Origin};

/// Says for each deployment with a missed deadline whether other priorities meet all, and which command shows the change; one
/// line each.
pub(super) fn remedies(deployed: &[Deployed<'_>]) -> String {
    deployed.iter().filter_map(|it| Some(format!("{}: {}\n", it.name, remedy(it)?))).collect()
}

fn remedy(deployed: &Deployed<'_>) -> Option<&'static str> {
    let (db, of, Origin::Model(tables)) = (deployed.db, deployed.declared?, deployed.origin) else {
        return None;
    };
    let project = tables.project(db);
    let (query, report) = deployed.reports.first()?;
    let deadlines = report.deadlines();
    if deadlines.met + deadlines.unknown == deadlines.all {
        return None;
    }
    let found = better_priorities(db, project, of, *query);
    let is_solution = |it: &BetterTiming| match it {
        BetterTiming::Change(_, fields) => response_times_if(db, project, of, *query, fields).schedulable(),
        BetterTiming::NoPriorities(_) => false,
    };
    Some(if found.iter().any(is_solution) {
        "other priorities meet all deadlines: `mauve tune --priorities` shows them"
    } else if found.iter().any(|it| matches!(it, BetterTiming::NoPriorities(_))) {
        "no order of priorities meets all deadlines: `mauve tune --cpus` and `mauve tune --periods` show what else may"
    } else {
        "`mauve tune` shows which other priorities, CPUs or periods meet more deadlines"
    })
}
