//! A fixture's verdicts and machines as text.

use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_diagnostics::{Severity, timing_reason, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects};
use mauve_timing::{Level, Method};
use mauve_wcrt::{Query, first_tables, psm_of, response_times};

pub(crate) const LEVEL: Level = Level::TEN_TO_MINUS_FOUR;

pub(crate) fn workspace(db: &Database, fixture: &str) -> Workspace {
    let texts = mauve_tests::fixture(fixture).into_iter().map(|(path, text)| (PathBuf::from(path), text));
    Workspace::of_texts(db, "/".into(), texts)
}

/// The deployments of all projects.
pub(crate) fn deployments<'db>(db: &'db Database, workspace: Workspace) -> Vec<(Project<'db>, Decl<'db>)> {
    let of = |&project: &Project<'db>| -> Vec<_> {
        let all = names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment);
        all.map(|&decl| (project, decl)).collect()
    };
    projects(db, workspace).iter().flat_map(of).collect()
}

/// A line for each activity of each deployment: its response time, or why it has none.
pub(crate) fn verdicts(fixture: &str) -> String {
    verdicts_with(fixture, Method::Psm, LEVEL)
}

pub(crate) fn verdicts_with(fixture: &str, method: Method, level: Level) -> String {
    let db = Database::default();
    verdicts_in(&db, workspace(&db, fixture), method, level)
}

pub(crate) fn verdicts_in(db: &Database, workspace: Workspace, method: Method, level: Level) -> String {
    let mut out = String::new();
    for (project, decl) in deployments(db, workspace) {
        let query = Query { level, method };
        for activity in &response_times(db, project, decl, query).activities {
            let _ = write!(out, "{} {}", activity.instance, activity.verdict.name());
            if let Some(response) = activity.response {
                let _ = write!(out, " {response}");
            }
            let reasons: Vec<String> =
                activity.reasons.iter().map(|it| timing_reason(db, &it.reason)).collect();
            out += &if reasons.is_empty() { "\n".to_owned() } else { format!(": {}\n", reasons.join("; ")) };
        }
    }
    out
}

/// A line for each edge of a component's machine in the text, with its longest time.
pub(crate) fn machine(fixture: &str, component: &str) -> String {
    let db = Database::default();
    machine_in(&db, workspace(&db, fixture), component)
}

pub(crate) fn machine_in(db: &Database, workspace: Workspace, component: &str) -> String {
    let project = projects(db, workspace)[0];
    let decl = names_of(db, project).anywhere(Kind::Component, component)[0];
    let mut out = String::new();
    match psm_of(db, first_tables(db, project, decl), decl, LEVEL) {
        Ok(psm) => {
            for (time, edge) in psm.longest_times().zip(&psm.edges.all) {
                let Some(time) = time else { continue };
                let name = edge.transition.as_ref().map_or("stay", |name| name.as_str());
                let _ = writeln!(out, "{} {name} {}: {time}", psm.state(edge.source), psm.state(edge.target));
            }
        }
        Err(refusals) => {
            for refusal in refusals {
                let _ = writeln!(out, "refused: {}", timing_reason(db, &refusal.reason));
            }
        }
    }
    out
}

/// A line for each diagnostic but hints: file, text that it marks, code, message.
pub(crate) fn diagnostics(fixture: &str) -> String {
    let db = Database::default();
    diagnostics_in(&db, workspace(&db, fixture))
}

pub(crate) fn diagnostics_in(db: &Database, workspace: Workspace) -> String {
    let mut out = String::new();
    let findings = workspace_diagnostics(db, workspace);
    for finding in findings.iter().filter(|finding| finding.severity != Severity::Hint) {
        let diagnostic = &finding.diagnostic;
        let file = diagnostic.at.file(db);
        let range = diagnostic.at.range(db);
        let text = &file.text(db)[usize::from(range.start())..usize::from(range.end())];
        let _ = writeln!(
            out,
            "{} {text:?} {}: {}",
            file.path(db).display(),
            diagnostic.code.name,
            diagnostic.message
        );
    }
    out
}

/// The models, tables and configuration of the sample robot.
pub(crate) fn sample() -> Vec<(PathBuf, String)> {
    mauve_tests::texts_in(&mauve_tests::models().join("p3dx"))
}
