//! Mistakes put into random good models.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::PathBuf;

use mauve_model::diagnostics::{Severity, workspace_diagnostics};
use mauve_model::{Database, Workspace};
use mauve_tests::model::{Model, Written};
use mauve_tests::{Random, random_model};

/// Errors and warnings: code, file, what is marked, message.
fn noticed(written: &Written) -> Vec<(String, String, std::ops::Range<usize>, String)> {
    let db = Database::default();
    let texts = written.files.iter().map(|(path, text)| (PathBuf::from(path), text.clone()));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let found = workspace_diagnostics(&db, workspace);
    let found = found.iter().map(|it| &it.diagnostic).filter(|it| it.code.severity != Severity::Hint);
    found
        .map(|it| {
            let range = it.at.range(&db);
            let path = it.at.file(&db).path(&db).display().to_string();
            (it.code.name.to_owned(), path, range.start().into()..range.end().into(), it.message.clone())
        })
        .collect()
}

fn shown(written: &Written) -> String {
    written.files.iter().map(|(path, text)| format!("//- {path}\n{text}")).collect()
}

#[test]
fn random_models_have_no_error_and_no_warning() {
    for seed in 0..count() {
        let written = random_model(seed).written();
        let found = noticed(&written);
        assert!(found.is_empty(), "seed {seed}: {found:#?}\n{}", shown(&written));
    }
}

fn count() -> u64 {
    std::env::var("MAUVE_MODELS_COUNT").map_or(100, |it| it.parse().unwrap())
}
