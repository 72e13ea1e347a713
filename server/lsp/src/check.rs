//! Computes the diagnostics for the client, which are published after each change, and whether its hints and tokens are outdated.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_diagnostics::{Extent, Finding, Severity, checked_files, extent_of, findings_of};
use mauve_hir::{Decl, File, ModelDb, Project, Workspace, is_model};
use mauve_ide::EarlierFigures;
use tower_lsp::lsp_types::{NumberOrString, TextDocumentIdentifier, Url};

use super::diagnostics::{self, DiagnosticStyle, url_of};
use super::items::{DiagnosticsByFile, Items, OfFile};
use super::snapshot::{Document, Snapshot};
use super::typing::without_typed;

/// The result of a check.
pub(crate) struct CheckedDiagnostics {
    /// Whether an included file exists and has not been read. Then the result is not published.
    pub(crate) is_outdated: bool,
    /// Whether diagnostics wait until the user pauses.
    pub(crate) do_some_wait: bool,
    /// The diagnostics of each open file, and of each other file that has any, with the checked version.
    pub(crate) diagnostics: DiagnosticsByFile,
}

/// What the hints and the tokens of the open files are now.
pub(crate) struct ComparedHints {
    /// The figures of the texts, and earlier ones where the texts have none.
    pub(crate) figures: EarlierFigures,
    /// For each open file, a hash of its inlay hints without their positions.
    pub(crate) hints: BTreeMap<Url, u64>,
    /// For each open file, a hash of its code lenses without their positions.
    pub(crate) lenses: BTreeMap<Url, u64>,
    /// For each open file with semantic tokens, its version and a hash of the tokens.
    pub(crate) meanings: BTreeMap<Url, (i32, u64)>,
}

/// Gives `found` the diagnostics that each of these open documents has by itself: a user who opens it sees them before the whole
/// project is analysed. Nothing while included files are not read.
pub(crate) fn look(snapshot: &Snapshot, documents: &[Url], mut found: impl FnMut(DiagnosticsByFile)) {
    let db = &snapshot.db;
    if documents.is_empty() || snapshot.is_stopped || snapshot.is_outdated() {
        return;
    }
    let analysed = documents.iter().filter_map(|url| Some((url, snapshot.documents.get(url)?)));
    for (url, Document { file, version, .. }) in analysed.filter(|(_, document)| document.is_analysed) {
        let containing = snapshot.workspaces.iter().filter(|it| checked_files(db, **it).contains(file));
        let style = snapshot.diagnostic_style();
        let items = containing.map(|&it| translated(db, it, *file, Extent::First, style).clone());
        let items = with_open_uris(snapshot, merged(items.collect()));
        let own = DiagnosticsByFile::from([(url.clone(), (Some(*version), items))]);
        found(without_waiting(snapshot, own).0);
    }
}

/// Returns the diagnostics of each open file, and of each other file that has any, without those that wait until the user pauses; and
/// whether there are some.
pub(crate) fn shown(snapshot: &Snapshot) -> (DiagnosticsByFile, bool) {
    without_waiting(snapshot, found(snapshot))
}

/// Returns the diagnostics without those that wait until the user pauses, and whether there are some.
fn without_waiting(snapshot: &Snapshot, mut found: DiagnosticsByFile) -> (DiagnosticsByFile, bool) {
    let mut do_some_wait = false;
    for (url, typed) in &snapshot.typed {
        let Some((_, items)) = found.get_mut(url) else { continue };
        let (shown, do_wait) = without_typed(std::mem::take(items), *typed);
        *items = shown;
        do_some_wait |= do_wait;
    }
    (found, do_some_wait)
}

fn found(snapshot: &Snapshot) -> DiagnosticsByFile {
    let db = &snapshot.db;
    let documents = snapshot.documents.iter();
    let of_document = |(url, document): (&Url, &Document)| {
        let items = of_document(snapshot, document);
        (url.clone(), (Some(document.version), items.unwrap_or_default()))
    };
    let mut found: DiagnosticsByFile = documents.clone().map(of_document).collect();
    if snapshot.is_stopped {
        return found;
    }
    let mut files: HashMap<File, Vec<Items>> = HashMap::new();
    for &workspace in snapshot.workspaces.iter() {
        for &file in checked_files(db, workspace) {
            let extent = extent_of(db, workspace, file);
            let items = translated(db, workspace, file, extent, snapshot.diagnostic_style());
            if !items.is_empty() {
                files.entry(file).or_default().push(items.clone());
            }
        }
    }
    let mut open: HashMap<File, Vec<(&Url, &Document)>> = HashMap::new();
    documents.for_each(|(url, document)| open.entry(document.file).or_default().push((url, document)));
    for (file, items) in files {
        let items = with_open_uris(snapshot, merged(items));
        match open.get(&file) {
            Some(documents) => {
                for (url, document) in documents.iter().filter(|(_, document)| document.is_analysed) {
                    found.insert((*url).clone(), (Some(document.version), items.clone()));
                }
            }
            None => found.extend(url_of(db, file).map(|url| (url, (None, items)))),
        }
    }
    found
}

/// The maximum number of diagnostics of one severity that are shown for a file: more make clients slow.
const MOST: usize = 1000;

/// Returns the diagnostics in a file of a workspace. salsa keeps them, so that an edit translates those of the files that it
/// concerns.
#[salsa::tracked]
fn translated(
    db: &dyn ModelDb,
    workspace: Workspace,
    file: File,
    extent: Extent,
    style: DiagnosticStyle,
) -> Items {
    let mut counts: BTreeMap<Severity, usize> = BTreeMap::new();
    let shown = findings_of(db, workspace, file, extent).shown.iter().filter(|finding| {
        let count = counts.entry(finding.severity).or_default();
        *count += 1;
        *count <= MOST
    });
    let shown: Vec<&Finding<'_>> = shown.collect();
    let more = counts.into_iter().filter(|(_, count)| *count > MOST);
    let more = more.map(|(severity, count)| diagnostics::more(severity, count - MOST));
    Items::of(shown.into_iter().map(|finding| diagnostics::diagnostic(db, style, finding)).chain(more))
}

/// Returns the diagnostics of a file that is in several workspaces, each once.
fn merged(mut of_workspaces: Vec<Items>) -> Items {
    if of_workspaces.len() == 1 {
        return of_workspaces.pop().unwrap_or_default();
    }
    let mut seen = HashSet::new();
    let all = of_workspaces.iter().flat_map(Items::list);
    let first = all.filter(|diagnostic| {
        let code = match &diagnostic.code {
            Some(NumberOrString::String(code)) => code.clone(),
            _ => String::new(),
        };
        let start = diagnostic.range.start;
        seen.insert((start.line, start.character, code, diagnostic.message.clone()))
    });
    Items::of(first)
}

/// Replaces the URIs of related locations by those under which the client has the files open.
fn with_open_uris(snapshot: &Snapshot, items: Items) -> Items {
    if snapshot.other_uris.is_empty() {
        return items;
    }
    let mut list = items.list();
    list.iter_mut().for_each(|diagnostic| snapshot.use_open_uris(diagnostic));
    Items::of(list)
}

/// Returns the diagnostics of one file, or `None` if it is in no workspace.
pub(crate) fn diagnostics_of(snapshot: &Snapshot, url: &Url) -> Option<(Url, OfFile)> {
    let document = snapshot.documents.get(url);
    let mut items = document.and_then(|document| of_document(snapshot, document));
    if !snapshot.is_stopped && document.is_none_or(|document| document.is_analysed) {
        let (file, _) = snapshot.file(&TextDocumentIdentifier::new(url.clone())).ok()?;
        let style = snapshot.diagnostic_style();
        let workspaces = snapshot.workspaces.iter();
        let of_workspaces = workspaces.map(|&workspace| {
            let extent = extent_of(&snapshot.db, workspace, file);
            translated(&snapshot.db, workspace, file, extent, style).clone()
        });
        items = Some(with_open_uris(snapshot, merged(of_workspaces.collect())));
    }
    let mut items = items.unwrap_or_default();
    if let Some(typed) = snapshot.typed.get(url) {
        items = without_typed(items, *typed).0;
    }
    Some((url.clone(), (document.map(|document| document.version), items)))
}

/// Returns the diagnostics about the state of an open document.
fn of_document(snapshot: &Snapshot, document: &Document) -> Option<Items> {
    match document.is_analysed {
        _ if snapshot.is_stopped => Some(Items::of([diagnostics::stopped()])),
        true => None,
        false => Some(Items::of([diagnostics::another_text()])),
    }
}

/// Computes the diagnostics of all files.
pub(crate) fn check(snapshot: &Snapshot) -> CheckedDiagnostics {
    let is_outdated = snapshot.is_outdated();
    let (diagnostics, do_some_wait) = shown(snapshot);
    // Computed in advance, so that they are ready when the main loop publishes them.
    if snapshot.capabilities.pull_diagnostics {
        diagnostics.values().for_each(|(_, items)| _ = items.id());
    }
    CheckedDiagnostics { is_outdated, do_some_wait, diagnostics }
}

/// Computes what the hints and the tokens of the open files are.
pub(crate) fn compare(snapshot: &Snapshot) -> ComparedHints {
    let db = &snapshot.db;
    let (mut hints, mut lenses) = (BTreeMap::new(), BTreeMap::new());
    let models = snapshot.documents.iter().filter(|(_, document)| is_model(document.file.path(db)));
    let models: Vec<(&Url, &Document)> = models.filter(|_| !snapshot.is_stopped).collect();
    let options = snapshot.settings.hints;
    let files = models.iter().map(|(_, document)| (document.file, snapshot.project(document.file)));
    let files: Vec<(File, Option<Project<'_>>)> = files.collect();
    let is_table = |document: &Document| !is_model(document.file.path(db));
    let tables: Vec<(&Url, &Document)> =
        snapshot.documents.iter().filter(|(_, it)| !snapshot.is_stopped && is_table(it)).collect();
    let deployments: Vec<(Project<'_>, Decl<'_>)> = tables
        .iter()
        .flat_map(|(_, it)| mauve_ide::deployments_with_threads(db, &snapshot.answering(it.file), it.file))
        .collect();
    let figures = snapshot.earlier.updated(db, &files, &deployments, options, snapshot.are_saved);
    for ((url, document), (_, project)) in models.into_iter().zip(&files) {
        let hash = project.map_or(0, |it| mauve_ide::hash_of_hints(db, it, document.file, options, &figures));
        hints.insert(url.clone(), hash);
        if snapshot.capabilities.lens_refresh && snapshot.settings.lenses {
            let mut hasher = DefaultHasher::new();
            let titles = snapshot.lenses(document.file).into_iter().map(|lens| lens.title);
            titles.for_each(|title| title.hash(&mut hasher));
            lenses.insert(url.clone(), hasher.finish());
        }
        // Computed in advance, so that the first request is fast.
        mauve_hir::line_index(db, document.file);
    }
    for (url, document) in tables {
        let projects = snapshot.answering(document.file);
        let hash = mauve_ide::hash_of_table(db, &projects, document.file, options, &figures);
        hints.insert(url.clone(), hash);
    }
    let meaning = |url: Url| {
        let document = snapshot.documents.get(&url)?;
        Some((url, (document.version, snapshot.meanings(document.file))))
    };
    let meanings = snapshot.tokens.asked().into_iter().filter_map(meaning).collect();
    ComparedHints { figures, hints, lenses, meanings }
}
