//! Computes all diagnostics for the client; they are published after each change.

use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_diagnostics::{Severity, diagnostics_of_file, workspace_diagnostics};
use mauve_hir::{File, is_model};
use mauve_ide::{CodeLens, LensKind};
use mauve_syntax::{TextRange, TextSize};
use tower_lsp::lsp_types::{Diagnostic, TextDocumentIdentifier, Url};

use super::pulls::ResultId;
use super::snapshot::{Document, Snapshot};
use super::to_proto;

/// The result of a check.
pub(crate) struct Checked {
    /// Whether an included file exists and has not been read. Then the result is not published.
    pub(crate) is_outdated: bool,
    /// The diagnostics of each open file, and of each other file that has any, with the checked version.
    pub(crate) diagnostics: Found,
    /// Their result ids, for a client that pulls diagnostics.
    pub(crate) ids: BTreeMap<Url, ResultId>,
    /// For each open file, a hash of its inlay hints and code lenses without their positions.
    pub(crate) hints: BTreeMap<Url, u64>,
    /// For each open file with semantic tokens, its version and a hash of the tokens.
    pub(crate) meanings: BTreeMap<Url, (i32, u64)>,
}

/// Returns the result id of a file's diagnostics: a hash.
pub(crate) fn result_id(diagnostics: &[Diagnostic]) -> ResultId {
    let mut hasher = DefaultHasher::new();
    // Serialising plain data never fails.
    serde_json::to_string(diagnostics).unwrap_or_default().hash(&mut hasher);
    hasher.finish()
}

/// The version of a file, if it is open, and its diagnostics.
pub(crate) type OfFile = (Option<i32>, Vec<Diagnostic>);

/// The versions and diagnostics of several files.
pub(crate) type Found = BTreeMap<Url, OfFile>;

/// Returns the diagnostics of each open file, and of each other file that has any.
pub(crate) fn diagnostics(snapshot: &Snapshot) -> Found {
    let db = &snapshot.db;
    let mut found: Found = snapshot
        .documents
        .iter()
        .map(|(url, document)| (url.clone(), (Some(document.version), of_document(snapshot, document))))
        .collect();
    if snapshot.is_stopped {
        return found;
    }
    let mut counts: HashMap<File, BTreeMap<Severity, usize>> = HashMap::new();
    for &workspace in snapshot.workspaces.iter() {
        for finding in workspace_diagnostics(db, workspace) {
            let file = finding.diagnostic.at.file(db);
            let count = counts.entry(file).or_default().entry(finding.severity).or_default();
            *count += 1;
            if *count > MOST {
                continue;
            }
            let diagnostic = to_proto::diagnostic(snapshot, &finding);
            for url in snapshot.urls(file) {
                if snapshot.documents.get(&url).is_none_or(|document| document.is_analysed) {
                    add(&mut found.entry(url).or_default().1, diagnostic.clone());
                }
            }
        }
    }
    for (file, counts) in counts.into_iter().filter(|(_, counts)| counts.values().any(|count| *count > MOST))
    {
        for url in snapshot.urls(file) {
            if let Some((_, found)) = found.get_mut(&url).filter(|(_, found)| !found.is_empty()) {
                found.extend(more_than_most(&counts));
            }
        }
    }
    found
}

/// The maximum number of diagnostics of one severity that are shown for a file: more make clients slow.
const MOST: usize = 1000;

fn more_than_most(counts: &BTreeMap<Severity, usize>) -> impl Iterator<Item = Diagnostic> {
    let more = counts.iter().filter(|(_, count)| **count > MOST);
    more.map(|(severity, count)| to_proto::more(*severity, count - MOST))
}

/// Returns the diagnostics of one file, or `None` if it is in no workspace.
pub(crate) fn diagnostics_of(snapshot: &Snapshot, url: &Url) -> Option<(Url, OfFile)> {
    let document = snapshot.documents.get(url);
    let mut found = document.map_or_else(Vec::new, |document| of_document(snapshot, document));
    if !snapshot.is_stopped && document.is_none_or(|document| document.is_analysed) {
        let (file, _) = snapshot.file(&TextDocumentIdentifier::new(url.clone())).ok()?;
        let mut counts: BTreeMap<Severity, usize> = BTreeMap::new();
        for &workspace in snapshot.workspaces.iter() {
            for finding in diagnostics_of_file(&snapshot.db, workspace, file) {
                let count = counts.entry(finding.severity).or_default();
                *count += 1;
                if *count <= MOST {
                    add(&mut found, to_proto::diagnostic(snapshot, &finding));
                }
            }
        }
        found.extend(more_than_most(&counts));
    }
    Some((url.clone(), (document.map(|document| document.version), found)))
}

/// Returns the diagnostics about the state of an open document.
fn of_document(snapshot: &Snapshot, document: &Document) -> Vec<Diagnostic> {
    match document.is_analysed {
        _ if snapshot.is_stopped => vec![to_proto::stopped()],
        true => Vec::new(),
        false => vec![to_proto::another_text()],
    }
}

/// Adds a diagnostic, unless another workspace with the same file has added it.
fn add(found: &mut Vec<Diagnostic>, diagnostic: Diagnostic) {
    if !found.contains(&diagnostic) {
        found.push(diagnostic);
    }
}

/// Computes the diagnostics of all files.
pub(crate) fn check(snapshot: &Snapshot) -> Checked {
    let db = &snapshot.db;
    let is_outdated = snapshot.is_outdated();
    let diagnostics = diagnostics(snapshot);
    let ids = diagnostics.iter().filter(|_| snapshot.capabilities.pull_diagnostics);
    let ids = ids.map(|(url, (_, found))| (url.clone(), result_id(found))).collect();
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
        let is_found_out = |lens: &CodeLens| matches!(lens.kind, LensKind::Deadlines | LensKind::Instances);
        for lens in lenses.into_iter().flatten().filter(is_found_out) {
            if let Some(lens) = mauve_ide::resolve_code_lens(db, &snapshot.workspaces, document.file, lens) {
                lens.title.hash(&mut hasher);
            }
        }
        // Computed in advance, so that the first request is fast.
        mauve_hir::line_index(db, document.file);
        hints.insert(url.clone(), hasher.finish());
    }
    let meaning = |url: Url| {
        let document = snapshot.documents.get(&url)?;
        let meanings = mauve_ide::meanings_of_names(db, &snapshot.workspaces, document.file);
        Some((url, (document.version, meanings)))
    };
    let meanings = snapshot.tokens.asked().into_iter().filter_map(meaning).collect();
    Checked { is_outdated, diagnostics, ids, hints, meanings }
}
