//! The one thread that owns the database. Events come in the client's order; all that is there is taken before anything is
//! analysed, so that a burst of edits costs one analysis. Then a worker checks everything, and what it found is published
//! if nothing has changed meanwhile.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};

use mauve_model::{CONFIG_FILE, Database, Workspace, is_model};
use tokio::runtime::Handle;
use tokio::sync::watch;
use tower_lsp::lsp_types::{DidChangeTextDocumentParams, DidSaveTextDocumentParams, TextDocumentItem, Url};

use super::capabilities::Capabilities;
use super::check::{Checked, check};
use super::documents::Documents;
use super::publisher::Publisher;
use super::snapshot::{Document, Failure, Snapshot, attempt};
use super::watcher::Watcher;
use crate::load::Loader;

/// What the main loop is told.
pub(crate) enum Event {
    /// The client's first words.
    Initialize { capabilities: Capabilities, folders: Vec<Url> },
    /// The client knows what the server can do: now it may be spoken to.
    Initialized,
    /// A text is the client's from now on.
    Opened(TextDocumentItem),
    /// It has changed.
    Changed(DidChangeTextDocumentParams),
    /// A change came that could not be read; of this text, or of any.
    Lost(Option<Url>),
    /// It was written to the disk.
    Saved(DidSaveTextDocumentParams),
    /// It is the disk's again.
    Closed(Url),
    /// Files that have come, gone or changed.
    Disk(BTreeSet<PathBuf>),
    /// The client's folders have changed.
    Folders { added: Vec<Url>, removed: Vec<Url> },
    /// Something to compute.
    Job(Box<dyn FnOnce(Snapshot) + Send>),
    /// An edit has overtaken a request for inlay hints.
    HintsOwed,
    /// A worker has checked everything as it was at this generation.
    Checked(u64, Result<Checked, Failure>),
}

/// After so many attempts in a row to read what is missing, what is there is shown.
const MOST_RELOADS: u32 = 3;

/// The state of the server.
pub(crate) struct MainLoop {
    db: Database,
    loader: Loader,
    documents: Documents,
    /// The client's folders.
    folders: Vec<PathBuf>,
    capabilities: Arc<Capabilities>,
    workspaces: Arc<[Workspace]>,
    shared_documents: Arc<BTreeMap<Url, Document>>,
    /// Files or folders have come or gone: the workspaces are to be looked for again.
    reload: bool,
    reloads: u32,
    /// Something has changed since the last check.
    changed: bool,
    /// Counts the states that are checked.
    generation: u64,
    hints_owed: bool,
    is_initialized: bool,
    publisher: Publisher,
    watcher: Watcher,
    sender: mpsc::Sender<Event>,
    workers: Handle,
    running: Arc<AtomicUsize>,
    /// Is a check running? For a client that shows progress.
    busy: watch::Sender<bool>,
}

impl MainLoop {
    /// A server that knows nothing yet. Its own workers report to `sender`.
    pub(crate) fn new(
        sender: mpsc::Sender<Event>,
        workers: Handle,
        publisher: Publisher,
        busy: watch::Sender<bool>,
    ) -> MainLoop {
        MainLoop {
            db: Database::default(),
            loader: Loader::default(),
            documents: Documents::default(),
            folders: Vec::new(),
            capabilities: Arc::new(Capabilities::of(&Default::default())),
            workspaces: Arc::new([]),
            shared_documents: Arc::default(),
            reload: false,
            reloads: 0,
            changed: false,
            generation: 0,
            hints_owed: false,
            is_initialized: false,
            publisher,
            watcher: Watcher::new(sender.clone()),
            sender,
            workers,
            running: Arc::default(),
            busy,
        }
    }

    /// Runs until nobody can send events any more.
    pub(crate) fn run(mut self, events: &mpsc::Receiver<Event>) {
        while let Ok(event) = events.recv() {
            self.handle(event);
            while let Ok(event) = events.try_recv() {
                self.handle(event);
            }
            self.settle();
            if self.changed && self.is_initialized {
                self.changed = false;
                self.start_check();
            }
        }
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Initialize { capabilities, folders } => {
                self.capabilities = Arc::new(capabilities);
                self.folders = folders.iter().filter_map(|url| url.to_file_path().ok()).collect();
                self.reload = true;
            }
            Event::Initialized => {
                self.is_initialized = true;
                self.changed = true;
            }
            Event::Opened(document) => {
                // Not every client says so.
                self.is_initialized = true;
                let uri = document.uri.clone();
                self.documents.open(document);
                // It may be part of no workspace yet; and a project without roots has one more.
                self.reload = true;
                self.touched(&uri);
            }
            Event::Changed(params) => {
                let uri = &params.text_document.uri;
                let encoding = self.capabilities.encoding;
                self.documents.change(uri, params.text_document.version, &params.content_changes, encoding);
                self.touched(uri);
            }
            Event::Lost(uri) => {
                let all: Vec<Url> = self.documents.0.keys().cloned().collect();
                for uri in uri.map_or(all, |uri| vec![uri]) {
                    self.documents.lost(&uri);
                    self.touched(&uri);
                }
            }
            Event::Saved(params) => {
                self.documents.saved(&params.text_document.uri, params.text);
                self.touched(&params.text_document.uri);
            }
            Event::Closed(uri) => {
                if self.documents.0.remove(&uri).is_some()
                    && let Some(document) = self.shared_documents.get(&uri)
                {
                    self.loader.closed(&mut self.db, document.file);
                    self.reload = true;
                    self.changed = true;
                }
            }
            Event::Disk(paths) => self.disk(&paths),
            Event::Folders { added, removed } => {
                let paths = |urls: Vec<Url>| urls.into_iter().filter_map(|url| url.to_file_path().ok());
                let removed: BTreeSet<PathBuf> = paths(removed).collect();
                self.folders.retain(|folder| !removed.contains(folder));
                self.folders.extend(paths(added));
                self.reload = true;
            }
            Event::Job(job) => {
                self.settle();
                let snapshot = self.snapshot();
                self.spawn(move || job(snapshot));
            }
            Event::HintsOwed => {
                self.hints_owed = true;
                self.changed = true;
            }
            Event::Checked(generation, checked) => self.checked(generation, checked),
        }
    }

    /// A text was touched: it is to be checked, even where it is the same, since the client waits for its version.
    fn touched(&mut self, uri: &Url) {
        self.changed = true;
        let config = self.documents.0.get(uri).filter(|open| open.dirty);
        self.reload |=
            config.is_some_and(|open| open.path.file_name().is_some_and(|name| name == CONFIG_FILE));
    }

    /// Looks at files that may have changed outside the client.
    fn disk(&mut self, paths: &BTreeSet<PathBuf>) {
        for path in paths {
            self.watcher.forget(path);
            let is_known = self.loader.file(path).is_some();
            let is_there = self.loader.changed(&mut self.db, path);
            let is_ours = is_model(path) || path.extension().is_some_and(|extension| extension == "toml");
            let is_config = path.file_name().is_some_and(|name| name == CONFIG_FILE);
            // Something that was not there, or is not any more.
            let comes_or_goes = is_known != is_there || (!is_known && (is_ours || path.is_dir()));
            let goes = !path.exists() && (is_ours || self.loader.folders().contains(path));
            self.reload |= comes_or_goes || is_config || goes;
            self.changed |= is_known;
        }
    }

    /// Gives what has changed to the database, which ends whatever reads it.
    fn settle(&mut self) {
        let mut is_new = self.shared_documents.len() != self.documents.0.len();
        let mut shared = BTreeMap::new();
        for (uri, open) in &mut self.documents.0 {
            let known = self.shared_documents.get(uri).copied();
            let file = match known.filter(|_| !open.dirty) {
                Some(document) => document.file,
                None => self.loader.opened(&mut self.db, &open.path, &open.text, open.problem.clone()),
            };
            open.dirty = false;
            let document = Document { file, version: open.version };
            is_new |= known != Some(document);
            shared.insert(uri.clone(), document);
        }
        if is_new {
            self.shared_documents = Arc::new(shared);
            self.changed = true;
        }
        if std::mem::take(&mut self.reload) {
            self.load();
            self.changed = true;
        }
    }

    fn load(&mut self) {
        let begin = std::time::Instant::now();
        let mut paths = self.folders.clone();
        let mut alone = Vec::new();
        for (uri, open) in &self.documents.0 {
            let is_config = open.path.file_name().is_some_and(|name| name == CONFIG_FILE);
            match (open.is_file, self.shared_documents.get(uri)) {
                (true, _) if is_model(&open.path) || is_config => paths.push(open.path.clone()),
                (false, Some(document)) => alone.push(document.file),
                _ => {}
            }
        }
        let (mut workspaces, problems) = self.loader.load(&mut self.db, &paths);
        for problem in problems {
            tracing::info!("{problem}");
        }
        let alone: Vec<Workspace> = alone.into_iter().map(|file| self.loader.alone(&self.db, file)).collect();
        workspaces.extend(alone);
        self.workspaces = workspaces.into();
        if let Err(error) = self.watcher.watch(self.loader.folders()) {
            self.publisher.warn(format!(
                "Files that change outside the editor may not be noticed: {error}. Restart the server after such a change."
            ));
        }
        tracing::debug!("{} workspaces loaded in {:?}", self.workspaces.len(), begin.elapsed());
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot {
            db: self.db.clone(),
            workspaces: Arc::clone(&self.workspaces),
            documents: Arc::clone(&self.shared_documents),
            capabilities: Arc::clone(&self.capabilities),
            running: Arc::clone(&self.running),
        }
    }

    fn spawn(&self, job: impl FnOnce() + Send + 'static) {
        let running = Arc::clone(&self.running);
        running.fetch_add(1, Ordering::SeqCst);
        self.workers.spawn_blocking(move || {
            // Jobs catch their panics themselves: this is for what comes behind.
            let _ = catch_unwind(AssertUnwindSafe(job));
            running.fetch_sub(1, Ordering::SeqCst);
        });
    }

    fn start_check(&mut self) {
        self.generation += 1;
        self.busy.send_replace(self.capabilities.progress);
        let (generation, snapshot, sender) = (self.generation, self.snapshot(), self.sender.clone());
        self.spawn(move || {
            let checked = attempt(|| check(&snapshot));
            drop(snapshot);
            let _ = sender.send(Event::Checked(generation, checked));
        });
    }

    fn checked(&mut self, generation: u64, checked: Result<Checked, Failure>) {
        if generation != self.generation || self.changed {
            return;
        }
        self.busy.send_replace(false);
        match checked {
            Ok(Checked::Outdated) if self.reloads < MOST_RELOADS => {
                self.reloads += 1;
                self.reload = true;
            }
            Ok(Checked::Outdated) => {
                tracing::error!("an included file cannot be read");
                self.reloads = 0;
            }
            Ok(Checked::Found { diagnostics, hints }) => {
                self.reloads = 0;
                let changed = self.publisher.publish(diagnostics, hints);
                if (changed || std::mem::take(&mut self.hints_owed)) && self.capabilities.hint_refresh {
                    self.publisher.refresh_hints();
                }
            }
            Err(Failure::Panicked(message)) => {
                let open =
                    self.shared_documents.iter().map(|(uri, document)| (uri.clone(), document.version));
                self.publisher.panicked(open.collect(), &message);
            }
            // What ended it is followed by another check; if not, it is due now.
            Err(Failure::Overtaken | Failure::Cancelled) => self.changed = true,
        }
    }
}
