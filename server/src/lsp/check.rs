//! Everything that is wrong, in the client's terms: what is published after each change.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_model::diagnostics::workspace_diagnostics;
use mauve_model::is_model;
use mauve_syntax::{TextRange, TextSize};
use tower_lsp::lsp_types::{Diagnostic, Url};

use super::position::line_index;
use super::pulls::ResultId;
use super::snapshot::Snapshot;
use super::to_proto;

/// What a worker found.
pub(crate) struct Checked {
    /// Is a file included that is there and has not been read? Then the rest is not to be shown before it is.
    pub(crate) is_outdated: bool,
    /// For each file with a diagnostic and each open one, with the version that was checked.
    pub(crate) diagnostics: BTreeMap<Url, (Option<i32>, Vec<Diagnostic>)>,
    /// For each open file, what its inlay hints and code lenses say, wherever they stand.
    pub(crate) hints: BTreeMap<Url, u64>,
    /// For each open file of which the client colours names, its version and what stands for their meaning.
    pub(crate) meanings: BTreeMap<Url, (i32, u64)>,
}

/// What stands for the diagnostics of a file: other ones have another.
pub(crate) fn result_id(diagnostics: &[Diagnostic]) -> ResultId {
    let mut hasher = DefaultHasher::new();
    // They are plain data of the protocol: this never fails.
    serde_json::to_string(diagnostics).unwrap_or_default().hash(&mut hasher);
    hasher.finish()
}

/// For each file with a diagnostic and each open one, its version and what is wrong in it.
pub(crate) fn diagnostics(snapshot: &Snapshot) -> BTreeMap<Url, (Option<i32>, Vec<Diagnostic>)> {
    let db = &snapshot.db;
    let mut diagnostics: BTreeMap<Url, (Option<i32>, Vec<Diagnostic>)> = BTreeMap::new();
    let nothing = || if snapshot.is_stopped { vec![to_proto::stopped()] } else { Vec::new() };
    for (url, document) in snapshot.documents.iter() {
        diagnostics.insert(url.clone(), (Some(document.version), nothing()));
    }
    if snapshot.is_stopped {
        return diagnostics;
    }
    for &workspace in snapshot.workspaces.iter() {
        for finding in workspace_diagnostics(db, workspace) {
            let diagnostic = to_proto::diagnostic(snapshot, &finding);
            for url in snapshot.urls(finding.diagnostic.at.file(db)) {
                let (_, found) = diagnostics.entry(url).or_default();
                // A file that several workspaces have is right or wrong once.
                if !found.contains(&diagnostic) {
                    found.push(diagnostic.clone());
                }
            }
        }
    }
    for (url, document) in snapshot.documents.iter().filter(|(_, document)| !document.is_analysed) {
        diagnostics.insert(url.clone(), (Some(document.version), vec![to_proto::another_text()]));
    }
    diagnostics
}

/// Checks everything as it is.
pub(crate) fn check(snapshot: &Snapshot) -> Checked {
    let db = &snapshot.db;
    let is_outdated = snapshot.is_outdated();
    let diagnostics = diagnostics(snapshot);
    let mut hints = BTreeMap::new();
    let models = snapshot.documents.iter().filter(|(_, document)| is_model(document.file.path(db)));
    for (url, document) in models.filter(|_| !snapshot.is_stopped) {
        let mut hasher = DefaultHasher::new();
        let all = TextRange::up_to(TextSize::of(&**document.file.text(db)));
        let kinds = snapshot.settings.hints;
        for hint in mauve_ide::inlay_hints(db, &snapshot.workspaces, document.file, all, kinds) {
            hint.label.hash(&mut hasher);
        }
        let is_lens_shown = snapshot.capabilities.lens_refresh && snapshot.settings.lenses;
        let lenses = is_lens_shown.then(|| mauve_ide::code_lenses(db, &snapshot.workspaces, document.file));
        for lens in lenses.into_iter().flatten() {
            if let Some(lens) = mauve_ide::resolve_code_lens(db, &snapshot.workspaces, document.file, lens) {
                lens.title.hash(&mut hasher);
            }
        }
        // So that the first request for it is quick.
        line_index(db, document.file);
        hints.insert(url.clone(), hasher.finish());
    }
    let meaning = |url: Url| {
        let document = snapshot.documents.get(&url)?;
        let meanings = mauve_ide::meanings_of_names(db, &snapshot.workspaces, document.file);
        Some((url, (document.version, meanings)))
    };
    let meanings = snapshot.tokens.asked().into_iter().filter_map(meaning).collect();
    Checked { is_outdated, diagnostics, hints, meanings }
}
