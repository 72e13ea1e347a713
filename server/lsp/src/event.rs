//! The messages to the main loop.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use mauve_hir::File;
use mauve_ide::EarlierFigures;
use mauve_projects::load::DiskSearch;
use mauve_syntax::TextRange;
use mauve_timing::Level;
use tower_lsp::lsp_types::{DidChangeTextDocumentParams, DidSaveTextDocumentParams, TextDocumentItem, Url};

use super::answering::Answering;
use super::capabilities::Capabilities;
use super::check::{CheckedDiagnostics, ComparedHints};
use super::items::DiagnosticsByFile;
use super::pulls::GivenResult;
use super::settings::Settings;
use super::snapshot::{Failure, Snapshot};

/// A message to the main loop.
pub(crate) enum LoopEvent {
    Initialize {
        capabilities: Capabilities,
        folders: Vec<PathBuf>,
    },
    /// The client sent `initialized`: the server may send messages.
    Initialized,
    /// The client opened a document: its text replaces the text on the disk.
    Opened(TextDocumentItem),
    Changed(DidChangeTextDocumentParams),
    /// A message about this document, open or not, was not understood, so its text is unknown; without one, all texts are.
    TextUnknown(Option<Url>),
    /// Shows a warning to the user, once.
    Warn(String),
    Saved(DidSaveTextDocumentParams),
    /// The user has turned to the editor.
    Focused,
    /// The client closed a document: the text on the disk is in effect again.
    Closed(Url),
    /// A search has ended, without a result if it panicked. The flag tells it from others.
    Searched(Arc<AtomicBool>, Option<DiskSearch>),
    /// The search with this flag takes long, if it has not ended.
    LongSearch(Arc<AtomicBool>),
    /// These files were created, removed or changed, and perhaps others whose events were `missed`.
    Disk {
        paths: BTreeSet<PathBuf>,
        missed: bool,
    },
    Folders {
        added: Vec<PathBuf>,
        removed: Vec<PathBuf>,
    },
    /// Shows everything at this significance level; without one, at that of each `mauve.toml`.
    Significance(Option<Level>),
    /// The user's settings, and the errors in them.
    Configured(Settings, Vec<String>),
    Job(RequestJob),
    /// Reads and analyses all files again.
    Reload,
    /// The time has passed after which the texts are to be checked again.
    TimePassed,
    Stop,
    /// For tests: a defect of the main loop.
    #[cfg(debug_assertions)]
    Panic,
    /// A handler panicked, and its request was answered with an error: shows that to the user, once.
    Defect(String),
    /// The client requested the diagnostics of a file, or of all.
    DiagnosticsRequested(Option<Url>),
    /// That request was answered with these.
    DiagnosticsGiven(BTreeMap<Url, GivenResult>),
    /// The request for the diagnostics of this file was not answered.
    DiagnosticsNotGiven(Url),
    /// The client was given the inlay hints or code lenses of this generation; none if changes cancelled the request.
    HintsGiven(Option<u64>),
    /// Hints of this generation showed these figures, which were in none before.
    FiguresShown(u64, EarlierFigures),
    /// Hints of this generation were given for a part of a timing table, without all limits.
    LimitsMissing(u64, (File, TextRange)),
    /// These limits were found, or a change cancelled the search.
    LimitsSearched(Result<(), Failure>),
    /// Changes cancelled the request for the semantic tokens of this version of a document.
    TokensCancelled(Url, i32),
    /// A check of this generation begins with these diagnostics of documents that have none yet.
    Looked(u64, DiagnosticsByFile),
    /// A check of this generation found diagnostics.
    Checked(u64, Result<CheckedDiagnostics, Failure>),
    /// It also computed what the hints and tokens are.
    Compared(u64, Result<ComparedHints, Failure>),
}

impl LoopEvent {
    /// Whether the client or the disk has changed something, after which a load that panicked is tried again.
    pub(crate) fn is_change(&self) -> bool {
        matches!(
            self,
            LoopEvent::Opened(_)
                | LoopEvent::Changed(_)
                | LoopEvent::Saved(_)
                | LoopEvent::Closed(_)
                | LoopEvent::Disk { .. }
                | LoopEvent::Folders { .. }
        )
    }

    /// The document whose text it changes.
    pub(crate) fn document(&self) -> Option<&Url> {
        match self {
            LoopEvent::Opened(document) => Some(&document.uri),
            LoopEvent::Changed(params) => Some(&params.text_document.uri),
            LoopEvent::Saved(params) => Some(&params.text_document.uri),
            _ => None,
        }
    }
}

/// Something to compute for a request.
pub(crate) struct RequestJob {
    pub(crate) request: Arc<Answering>,
    /// Is given no snapshot where the document of the request has another text than when the request came.
    pub(crate) work: Box<dyn FnOnce(Option<Snapshot>) + Send>,
}
