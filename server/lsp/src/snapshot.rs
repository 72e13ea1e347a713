//! The state that a worker reads: the database at the time when the worker started, and the data for the client's
//! terms.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use mauve_diagnostics::Finding;
use mauve_hir::{Database, File, Project, Workspace, is_model, parse, project_files};
use mauve_ide::EarlierFigures;
use mauve_projects::address::file_of;
use mauve_projects::load::{canonical_path, is_outdated};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::TableErrorKind;
use mauve_wcrt::table;
use salsa::Cancelled;
use tower_lsp::jsonrpc::{Error, ErrorCode, Result};
use tower_lsp::lsp_types::{
    Diagnostic, Location, Range, TextDocumentIdentifier, TextDocumentPositionParams, Url,
};

use super::capabilities::Capabilities;
use super::diagnostics::{self, ANOTHER_TEXT, DiagnosticStyle};
use super::outbox::Outbox;
use super::position::LineIndex;
use super::settings::Settings;
use super::tokens::Tokens;

/// An open document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Document {
    pub(crate) file: File,
    pub(crate) version: i32,
    /// Whether its text is the analysed one. It is not if the same file is open under another URI with a different
    /// text.
    pub(crate) is_analysed: bool,
}

/// A reader of the database. While one lives, no input can be set: it must not be kept, nor cross an `.await`.
pub(crate) struct Snapshot {
    pub(crate) db: Database,
    pub(crate) workspaces: Arc<[Workspace]>,
    /// The client's folders.
    pub(crate) folders: Arc<[PathBuf]>,
    /// The open documents, by the client's URIs.
    pub(crate) documents: Arc<BTreeMap<Url, Document>>,
    /// The URIs under which documents are open, by the URIs of their paths, where the two differ.
    pub(crate) other_uris: Arc<BTreeMap<Url, Url>>,
    pub(crate) capabilities: Capabilities,
    pub(crate) settings: Settings,
    /// What users are typing, by the URIs of the documents.
    pub(crate) typed: BTreeMap<Url, Range>,
    /// Whether no open document was changed since it was opened or saved.
    pub(crate) are_saved: bool,
    /// The figures of earlier texts, for hints.
    pub(crate) earlier: Arc<EarlierFigures>,
    /// The generation of the texts.
    pub(crate) generation: u64,
    /// Whether all needed files that are readable were read.
    pub(crate) is_complete: bool,
    /// Whether the user has stopped the analysis of this generation.
    pub(crate) is_stopped: bool,
    /// The semantic tokens that the client has received.
    pub(crate) tokens: Arc<Tokens>,
    /// The number of running jobs.
    pub(crate) running: Arc<AtomicUsize>,
    /// Whether the main loop only waits for events.
    pub(crate) is_settled: bool,
    /// Whether files may be missing, since a search of the folders has not ended.
    pub(crate) is_searching: bool,
    /// Whether only the projects of the open documents are loaded, since a search of the folders takes long.
    pub(crate) are_folders_late: bool,
    /// How many folders were searched.
    pub(crate) searched: u64,
    /// Why files are not watched, or what to do about it.
    pub(crate) unwatched: Option<Arc<str>>,
    /// The messages to send to the client.
    pub(crate) outbox: Arc<Outbox>,
}

impl Snapshot {
    /// Returns the file of a document and its lines; an error if it is neither open nor part of a workspace.
    pub(crate) fn file(&self, document: &TextDocumentIdentifier) -> Result<(File, LineIndex<'_>)> {
        let url = &document.uri;
        let file = match self.documents.get(url) {
            Some(document) if !document.is_analysed => return Err(Error::invalid_params(ANOTHER_TEXT)),
            Some(document) => Some(document.file),
            None => file_of(url).and_then(|path| self.known(path)),
        };
        let file =
            file.ok_or_else(|| Error::invalid_params(format!("`{url}` is neither open nor in a workspace")))?;
        Ok((file, self.lines(file)))
    }

    /// Returns what [`Snapshot::file`] does, and the offset of the position.
    pub(crate) fn at(&self, at: &TextDocumentPositionParams) -> Result<(File, LineIndex<'_>, TextSize)> {
        let (file, lines) = self.file(&at.text_document)?;
        Ok((file, lines, lines.offset(at.position)))
    }

    pub(crate) fn lines(&self, file: File) -> LineIndex<'_> {
        LineIndex::new(&self.db, file, self.capabilities.encoding)
    }

    /// Returns where a range of a file is; nothing where the file has no address.
    pub(crate) fn location(&self, file: File, range: TextRange) -> Option<Location> {
        Some(Location { uri: self.url(file)?, range: self.lines(file).range(range) })
    }

    /// Translates a diagnostic, with the URIs under which the client has related files open.
    pub(crate) fn diagnostic(&self, finding: &Finding<'_>) -> Diagnostic {
        let mut diagnostic = diagnostics::diagnostic(&self.db, self.diagnostic_style(), finding);
        self.use_open_uris(&mut diagnostic);
        diagnostic
    }

    /// Replaces the URIs of related locations by those under which the client has the files open.
    pub(crate) fn use_open_uris(&self, diagnostic: &mut Diagnostic) {
        for related in diagnostic.related_information.iter_mut().flatten() {
            if let Some(open) = self.other_uris.get(&related.location.uri) {
                related.location.uri = open.clone();
            }
        }
    }

    /// Returns how the client gets diagnostics.
    pub(crate) fn diagnostic_style(&self) -> DiagnosticStyle {
        let Capabilities { encoding, related, pages, .. } = self.capabilities;
        DiagnosticStyle { encoding, related, pages }
    }

    /// Returns the version of an open document.
    pub(crate) fn version(&self, url: &Url) -> Option<i32> {
        self.documents.get(url).map(|document| document.version)
    }

    /// Fails unless a document still has the version for which an action was offered: the ranges of the action belong to
    /// that version.
    pub(crate) fn unchanged(&self, document: &TextDocumentIdentifier, version: Option<i32>) -> Result<()> {
        if self.version(&document.uri) == version { Ok(()) } else { Err(Error::content_modified()) }
    }

    fn known(&self, path: PathBuf) -> Option<File> {
        let canonical = canonical_path(&path);
        self.workspaces.iter().find_map(|workspace| workspace.file(&self.db, &canonical))
    }

    /// Fails while a file is not read that the answer needs, since the answer would be one of another project, and where the
    /// user has stopped the analysis.
    pub(crate) fn complete(&self) -> Result<()> {
        if self.is_stopped {
            return Err(Error::request_cancelled());
        }
        if self.is_searching || !self.is_complete && self.is_outdated() {
            Err(Error::content_modified())
        } else {
            Ok(())
        }
    }

    /// Fails as well while other projects are not known that may use the same files.
    pub(crate) fn complete_everywhere(&self) -> Result<()> {
        if self.are_folders_late { Err(Error::content_modified()) } else { self.complete() }
    }

    /// Returns whether an included file exists and has not been read.
    pub(crate) fn is_outdated(&self) -> bool {
        let is_open =
            |path: &Path| self.documents.values().any(|document| document.file.path(&self.db) == path);
        self.workspaces.iter().any(|&workspace| is_outdated(&self.db, workspace, &is_open))
    }

    /// Returns whether an open text that the project depends on has syntax errors. The user may be typing: a client keeps
    /// the last drawing of a complete text.
    pub(crate) fn has_syntax_errors(&self, project: Project<'_>) -> bool {
        let db = &self.db;
        let models = project_files(db, project);
        self.documents.values().any(|&Document { file, .. }| match is_model(file.path(db)) {
            true => models.contains(&file) && !parse(db, file).errors().is_empty(),
            // `mauve.toml` and timing tables.
            false => {
                let errors = &table(db, file).errors;
                errors.iter().any(|error| {
                    matches!(error.kind, TableErrorKind::NotToml(_) | TableErrorKind::Conflict(_))
                })
            }
        })
    }

    /// Returns a URI under which the client has a file open, otherwise the URI of its path.
    pub(crate) fn url(&self, file: File) -> Option<Url> {
        let open = self.documents.iter().find(|(_, document)| document.file == file);
        open.map(|(url, _)| url.clone()).or_else(|| diagnostics::url_of(&self.db, file))
    }
}

/// Why a job has no result.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// An edit has made it outdated.
    Overtaken,
    /// The client has cancelled it.
    Cancelled,
    /// It panicked, which is a defect of the server.
    Panicked(String),
}

impl Failure {
    /// Returns what has happened, for the log.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Failure::Overtaken => "outdated",
            Failure::Cancelled => "cancelled",
            Failure::Panicked(_) => "failed",
        }
    }

    /// Returns the error to answer with.
    pub(crate) fn into_error(self) -> Error {
        match self {
            Failure::Overtaken => Error::content_modified(),
            Failure::Cancelled => Error::request_cancelled(),
            Failure::Panicked(message) => Error {
                code: ErrorCode::InternalError,
                message: format!("a defect of mauve: {message}").into(),
                data: None,
            },
        }
    }
}

/// The number of attempts of a job that waits for queries of other jobs which are cancelled.
const MOST_ATTEMPTS: usize = 100;

/// Runs `job`. Returns a [`Failure`] if it is cancelled or panics; a panic affects only its answer.
pub(crate) fn attempt<T>(mut job: impl FnMut() -> T) -> std::result::Result<T, Failure> {
    for _ in 0..MOST_ATTEMPTS {
        // An unwound query holds no lock: salsa supports unwinding.
        let payload = match catch_unwind(AssertUnwindSafe(&mut job)) {
            Ok(done) => return Ok(done),
            Err(payload) => payload,
        };
        match payload.downcast_ref::<Cancelled>() {
            Some(Cancelled::PendingWrite) => return Err(Failure::Overtaken),
            Some(Cancelled::Local) => return Err(Failure::Cancelled),
            // Another job computed the query that this job waited for, and was cancelled or panicked. This job
            // computes it now, and panics as well if the query does.
            Some(_) => {}
            None => return Err(Failure::Panicked(panic_message(&*payload))),
        }
    }
    Err(Failure::Overtaken)
}

/// Returns the message of a panic.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}
