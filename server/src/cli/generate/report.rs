//! What `mauve generate` says: for people, and as one document.

use std::path::Path;

use mauve_hir::normalised;
use mauve_orocos::{Action, ChangedCodel, MANIFEST, Plan, Step};
use serde::Serialize;

use crate::cli::text::{counted, shown};
use crate::generate::{Generated, Out};
use crate::json::object;

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
    fn package(step: &Step) -> &str {
        step.path.split('/').next().unwrap_or_default()
    }
    let is_created = |step: &Step| matches!(step.action, Action::Create(_));
    let mut text = String::new();
    for steps in plan.steps.chunk_by(|a, b| package(a) == package(b)) {
        let has_manifest = steps.iter().any(|step| step.path.ends_with(MANIFEST));
        if let [first, ..] = steps
            && has_manifest
            && steps.iter().all(is_created)
        {
            let files = counted(steps.len(), "file");
            text += &line(done(&first.action, doing), &format!("{} ({files})", path(package(first))));
            continue;
        }
        // What was edited is said below.
        for step in steps.iter().filter(|step| doing == Doing::Done || !plan.edited.contains(&step.path)) {
            text += &line(done(&step.action, doing), &path(&step.path));
        }
    }
    text
}

fn done(action: &Action, doing: Doing) -> &'static str {
    match (action, doing) {
        (Action::Create(_), Doing::Done) => "created",
        (Action::Change(_), Doing::Done) => "changed",
        (Action::Remove, Doing::Done) => "removed",
        (Action::Create(_), _) => "to be created",
        (Action::Change(_), _) => "to be changed",
        (Action::Remove, _) => "to be removed",
    }
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
    let count = |is_such: fn(&Action) -> bool| plan.steps.iter().filter(|step| is_such(&step.action)).count();
    let counts = [
        (count(|action| matches!(action, Action::Create(_))), "created"),
        (count(|action| matches!(action, Action::Change(_))), "changed"),
        (count(|action| *action == Action::Remove), "removed"),
    ];
    let to_be = if doing == Doing::Done { "" } else { "to be " };
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> =
        counts.map(|(it, done)| format!("{} {to_be}{done}", counted(it, "file"))).collect();
    let files = if counts.is_empty() { format!("nothing {to_be}changed") } else { counts.join(", ") };
    match plan.changed_codels.len() {
        0 => files,
        1 => format!("{files}; the prototype of 1 codel has changed"),
        several => format!("{files}; the prototypes of {several} codels have changed"),
    }
}

/// The prototypes of a codel as a unified diff.
fn prototypes(codel: &ChangedCodel, path: &str) -> String {
    let lines =
        |sign: char, text: &str| -> String { text.lines().map(|line| format!("{sign}{line}\n")).collect() };
    let range = |text: &str| match text.lines().count() {
        0 => "0,0".to_owned(),
        1 => "1".to_owned(),
        several => format!("1,{several}"),
    };
    format!(
        "--- {path}\n+++ {path}.new\n@@ -{} +{} @@\n{}{}",
        range(&codel.before),
        range(&codel.now),
        lines('-', &codel.before),
        lines('+', &codel.now),
    )
}

/// Returns the steps of a plan; paths are relative to `out`.
pub(super) fn document(it: &Generated) -> impl Serialize + use<> {
    let Generated { out: Out { shown: out, .. }, packages, plan, left_packages, .. } = it;
    let steps = |is_such: fn(&Action) -> bool| -> Vec<String> {
        plan.steps.iter().filter(|step| is_such(&step.action)).map(|step| step.path.clone()).collect()
    };
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
        created: steps(|action| matches!(action, Action::Create(_))),
        changed: steps(|action| matches!(action, Action::Change(_))),
        removed: steps(|action| *action == Action::Remove),
        edited: plan.edited.clone(),
        changed_codels: changed_codels.collect::<Vec<_>>(),
        left_codels: plan.left_codels.clone(),
        left_files: plan.left_files.clone(),
        left_packages: left_packages.clone(),
    }
}
