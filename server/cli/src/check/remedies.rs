//! What `mauve check --fix` says about missed deadlines: other priorities, CPUs and periods are a choice, so it applies none.

use mauve_projects::analysis_document::Deployed;

/// Names the command for each deployment with a missed deadline, one line each.
pub(super) fn remedies(deployed: &[Deployed<'_>]) -> String {
    let is_missed = |it: &&Deployed<'_>| {
        let deadlines = it.reports.first().map(|(_, report)| report.deadlines());
        it.model().is_some() && deadlines.is_some_and(|it| it.met + it.unknown < it.all)
    };
    let said = |it: &Deployed<'_>| {
        format!("{}: `mauve tune` shows which priorities, CPUs and periods meet more deadlines\n", it.name)
    };
    deployed.iter().filter(is_missed).map(said).collect()
}
