//! `mauve check --fix` and `--diff`: applies the mechanical fixes of the diagnostics.
//!
//! A round applies the fixes that do not overlap; the next round has the others, and what the first one revealed. A fix after
//! which the models have more errors than before is left out. All rounds take place in memory: a file is written once, and
//! only a file that `mauve fmt` would write with the same arguments.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use mauve_diagnostics::{errors_of_text, workspace_diagnostics};
use mauve_hir::{Database, File, Workspace};
use mauve_ide::Change;
use mauve_projects::harmless::harmless;
use mauve_projects::load::models_in;

use crate::edited_files::EditedFiles;

/// The maximum number of rounds.
const MOST_ROUNDS: usize = 20;

/// The maximum number of trials that look for fixes after which there are more errors.
const MOST_TRIALS: usize = 200;

/// What the fixes did.
pub(super) struct Fixed {
    /// The number of applied fixes.
    pub(super) fixes: usize,
    pub(super) files: EditedFiles,
}

/// Applies all mechanical fixes to the texts of `db`, and writes no file.
///
/// # Errors
///
/// One of the paths cannot be read.
pub(super) fn fix(db: &mut Database, workspaces: &[Workspace], paths: &[PathBuf]) -> Result<Fixed, String> {
    let (writable, _) = models_in(paths)?;
    let mut before: BTreeMap<PathBuf, (File, Arc<str>)> = BTreeMap::new();
    let mut fixes = 0;
    let mut trials = MOST_TRIALS;
    let mut all = changes(db, workspaces, &writable);
    let mut left = (errors_of_text(db, workspaces), all.len());
    for _ in 0..MOST_ROUNDS {
        let good = without_more_errors(db, workspaces, left.0, &all, &mut trials);
        let (change, count) = joined(&good);
        if count == 0 {
            break;
        }
        let texts = apply(db, &change);
        all = changes(db, workspaces, &writable);
        let now = (errors_of_text(db, workspaces), all.len());
        if now >= left {
            // The fixes have more errors together than alone, or do not have the effect that they are offered for.
            restore(db, &texts);
            break;
        }
        left = now;
        fixes += count;
        for (file, text) in texts {
            before.entry(file.path(db).clone()).or_insert((file, text));
        }
    }
    let files = before.into_iter().map(|(path, (file, old))| (path, old, file.text(db).clone()));
    Ok(Fixed { fixes, files: EditedFiles(files.filter(|(_, old, new)| old != new).collect()) })
}

/// Returns the changes of the mechanical fixes, in the order of the diagnostics.
fn changes(db: &Database, workspaces: &[Workspace], writable: &BTreeSet<PathBuf>) -> Vec<Change> {
    let may_write =
        |file: File| file.problem(db).is_none() && !file.is_outside(db) && writable.contains(file.path(db));
    let mut found = Vec::new();
    for &workspace in workspaces {
        for finding in workspace_diagnostics(db, workspace) {
            let Some(fix) = finding.diagnostic.mechanical_fix(db, workspace) else { continue };
            let Some(change) = Change::of_fix(db, fix) else { continue };
            if change.files.iter().all(|of| may_write(of.file)) {
                found.push(change.with_line_ends(db));
            }
        }
    }
    found
}

/// Returns the changes after which there are at most as many errors as before: where there are more after all of them, looks for
/// the cause in both halves.
fn without_more_errors(
    db: &mut Database,
    workspaces: &[Workspace],
    most: usize,
    changes: &[Change],
    trials: &mut usize,
) -> Vec<Change> {
    let (change, count) = joined(changes);
    let Some(left) = trials.checked_sub(1).filter(|_| count > 0) else { return Vec::new() };
    *trials = left;
    let texts = apply(db, &change);
    let has_more = errors_of_text(db, workspaces) > most;
    restore(db, &texts);
    match changes.split_at_checked(changes.len() / 2) {
        _ if !has_more => changes.to_vec(),
        Some((first, second)) if !first.is_empty() => {
            let mut good = without_more_errors(db, workspaces, most, first, trials);
            good.extend(without_more_errors(db, workspaces, most, second, trials));
            good
        }
        _ => Vec::new(),
    }
}

/// Joins the changes that do not overlap those before them. Returns their number too.
fn joined(changes: &[Change]) -> (Change, usize) {
    let mut all = Change::default();
    let count = changes.iter().filter(|change| all.join((*change).clone())).count();
    (all, count)
}

/// Applies a change. Returns the texts before it.
fn apply(db: &mut Database, change: &Change) -> Vec<(File, Arc<str>)> {
    let files = change.files.iter().map(|of| of.file);
    let texts: Vec<(File, Arc<str>, String)> =
        files.map(|file| (file, file.text(db).clone(), change.applied(db, file))).collect();
    let set = |(file, old, new): (File, Arc<str>, String)| {
        file.set_text(db, new.into());
        (file, old)
    };
    texts.into_iter().map(set).collect()
}

fn restore(db: &mut Database, texts: &[(File, Arc<str>)]) {
    for (file, text) in texts {
        file.set_text(db, text.clone());
    }
}

/// Says what was fixed, on a line of its own.
pub(super) fn said(fixes: usize, files: &[String]) -> String {
    let count = if fixes == 1 { "1 fix".to_owned() } else { format!("{fixes} fixes") };
    match files {
        [] => "nothing to fix\n".to_owned(),
        files => harmless(&format!("{} applied in {}\n", count, files.join(", "))),
    }
}
