//! What `mauve generate` says: for people, and as one document.

use std::path::Path;

use mauve_hir::normalised;
use mauve_orocos::{Action, ChangedCodel, MANIFEST, Plan, PlanStep};
use mauve_projects::generate::{Generated, Out};
use mauve_projects::json::object;
use serde::Serialize;
use similar::TextDiff;

use crate::text::{counted, shown};

/// What becomes of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Doing {
    Done,
    Checked,
    Refused,
}

/// What was done in a folder, or is to be done, for people.
pub(super) fn report(it: &Generated, doing: Doing) -> String {
    let Generated { out: Out { shown: out, .. }, packages, plan, .. } = it;
    let here = std::env::current_dir().unwrap_or_default();
    let out = shown(&normalised(&here.join(out)), &here);
    let path = |path: &str| Path::new(&out).join(path).display().to_string();
    let mut text = match doing {
        Doing::Refused => String::new(),
        _ => files(plan, doing, &path),
    };
    if doing != Doing::Done {
        plan.edited.iter().for_each(|it| text += &line("edited", &path(it)));
    }
    plan.changed_codels.iter().for_each(|codel| text += &prototypes(codel, &path(&codel.path)));
    it.left().for_each(|(left, why)| text += &format!("{}: {why}\n", path(left)));
    if !text.is_empty() {
        text.push('\n');
    }
    if packages.is_empty() {
        return text + "nothing to generate: no codel, component or deployment\n";
    }
    let out = if out.is_empty() { "." } else { out.as_str() };
    text + &format!("{} in {}: {}\n", counted(packages.len(), "package"), out, summary(plan, doing))
}

fn line(what: &str, path: &str) -> String {
    format!("{what:<13} {path}\n")
}

/// A line for each file that was written, or is to be; one for all files of a new package.
fn files(plan: &Plan, doing: Doing, path: &dyn Fn(&str) -> String) -> String {
    fn package(step: &PlanStep) -> &str {
        step.path.split('/').next().unwrap_or_default()
    }
    let is_created = |step: &PlanStep| matches!(step.action, Action::Create(_));
    let mut text = String::new();
    for steps in plan.steps.chunk_by(|a, b| package(a) == package(b)) {
        let has_manifest = steps.iter().any(|step| step.path.ends_with(MANIFEST));
        if let [first, ..] = steps
            && has_manifest
            && steps.iter().all(is_created)
        {
            let files = counted(steps.len(), "file");
            text += &line(&done(&first.action, doing), &format!("{} ({files})", path(package(first))));
            continue;
        }
        // What was edited is said below.
        for step in steps.iter().filter(|step| doing == Doing::Done || !plan.edited.contains(&step.path)) {
            text += &line(&done(&step.action, doing), &path(&step.path));
        }
    }
    text
}

/// `created`, `to be created`
fn done(action: &Action, doing: Doing) -> String {
    format!("{}{}d", to_be(doing), action.name())
}

fn to_be(doing: Doing) -> &'static str {
    if doing == Doing::Done { "" } else { "to be " }
}

/// `2 files created, 1 changed; the prototype of 1 codel has changed`
fn summary(plan: &Plan, doing: Doing) -> String {
    if doing != Doing::Done && !plan.edited.is_empty() {
        let (edited, them) = match plan.edited.len() {
            1 => {
                ("1 generated file was edited, or was not written by the generator".to_owned(), "its changes")
            }
            several => (
                format!("{several} generated files were edited, or were not written by the generator"),
                "their changes",
            ),
        };
        let nothing =
            if doing == Doing::Checked { "nothing would be written" } else { "nothing was written" };
        return format!(
            "{edited}, so {nothing}: move {them} to src/codels or to the models, or overwrite them with \
             `--force`"
        );
    }
    let to_be = to_be(doing);
    let counted = |action: &str| match paths(plan, action).len() {
        0 => None,
        count => Some(format!("{} {to_be}{action}d", counted(count, "file"))),
    };
    let counts: Vec<String> = ["create", "change", "remove"].into_iter().filter_map(counted).collect();
    let files = if counts.is_empty() { format!("nothing {to_be}changed") } else { counts.join(", ") };
    match plan.changed_codels.len() {
        0 => files,
        1 => format!("{files}; the prototype of 1 codel has changed"),
        several => format!("{files}; the prototypes of {several} codels have changed"),
    }
}

/// Returns the paths of the steps with this action.
fn paths(plan: &Plan, action: &str) -> Vec<String> {
    plan.steps.iter().filter(|step| step.action.name() == action).map(|step| step.path.clone()).collect()
}

/// The prototypes of a codel as a unified diff.
fn prototypes(codel: &ChangedCodel, path: &str) -> String {
    let diff = TextDiff::from_lines(&codel.before, &codel.now);
    diff.unified_diff().missing_newline_hint(false).header(path, &format!("{path}.new")).to_string()
}

/// Returns the steps of a plan; paths are relative to `out`.
pub(super) fn document(it: &Generated) -> impl Serialize + use<> {
    let Generated { out: Out { shown: out, .. }, packages, plan, left_packages, .. } = it;
    let changed_codels = plan.changed_codels.iter().map(|it| {
        object! {
            file: it.path.clone(),
            // Null if the former prototype is unknown.
            before: Some(it.before.clone()).filter(|before| !before.is_empty()),
            now: it.now.clone(),
        }
    });
    object! {
        out: out.canonicalize().unwrap_or_else(|_| out.clone()),
        packages: packages.iter().map(|package| package.name.clone()).collect::<Vec<_>>(),
        created: paths(plan, "create"),
        changed: paths(plan, "change"),
        removed: paths(plan, "remove"),
        edited: plan.edited.clone(),
        changed_codels: changed_codels.collect::<Vec<_>>(),
        left_codels: plan.left_codels.clone(),
        left_files: plan.left_files.clone(),
        left_packages: left_packages.clone(),
    }
}
