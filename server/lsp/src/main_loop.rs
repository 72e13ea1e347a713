//! The one thread that owns the database. Events arrive in the client's order. The loop handles all waiting events
//! before it starts an analysis, so a burst of edits causes one analysis. Then a worker checks all files, and its
//! result is published if nothing has changed in the meantime.

mod restart;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use mauve_hir::{CONFIG_FILE, Database, File, Problem, Workspace, is_model};
use mauve_ide::EarlierFigures;
use mauve_projects::address::Home;
use mauve_projects::load::{DiskSearch, LoadedWorkspaces, Loader, canonical_path, is_of_another_language};
use mauve_syntax::TextRange;
use salsa::Database as _;
use salsa::plumbing::current_revision;
use tokio::runtime::Handle;
use tokio::sync::watch;
use tower_lsp::lsp_types::{
    DidChangeTextDocumentParams, TextDocumentItem, Url, VersionedTextDocumentIdentifier,
};

use super::capabilities::Capabilities;
use super::check::{CheckedDiagnostics, ComparedHints, check, compare, look};
use super::diagnostics::url_of;
use super::documents::{Documents, OpenDocument};
use super::event::{LoopEvent, RequestJob};
use super::handlers::inlay_hints::search_limits;
use super::outbox::Refresh;
use super::progress::{self, ServerWork};
use super::publisher::{Publisher, replace};
use super::settings::Settings;
use super::snapshot::{Document, Failure, Snapshot, attempt, panic_message};
use super::staleness::Staleness;
use super::tokens::Tokens;
use super::typing;
use super::watcher::{TYPING, Watcher};

/// The maximum number of changed files that are read on this thread.
const MOST_REFRESHED: usize = 20;

/// How long a search may take before requests are answered without its result.
const LONG_SEARCH: Duration = Duration::from_secs(1);

/// The state of the server.
pub(crate) struct MainLoop {
    db: Database,
    loader: Loader,
    documents: Documents,
    /// The document whose text an event is changing.
    changing: Option<Url>,
    folders: Vec<PathBuf>,
    /// Whether a first search of the folders takes long, as of a whole disk: the projects of the open documents are loaded before.
    are_folders_late: bool,
    settings: Settings,
    capabilities: Capabilities,
    workspaces: Arc<[Workspace]>,
    shared_documents: Arc<BTreeMap<Url, Document>>,
    /// See [`Snapshot::other_uris`].
    other_uris: Arc<BTreeMap<Url, Url>>,
    /// Open documents outside the client's folders: opening and closing them changes the workspaces.
    strays: BTreeSet<Url>,
    /// The open documents that are in another language, and part of no workspace for that reason.
    foreign: HashSet<File>,
    staleness: Staleness,
    /// The figures of earlier texts, for hints.
    earlier: Arc<EarlierFigures>,
    /// Jobs that wait for the end of a search.
    waiting: Vec<RequestJob>,
    /// The semantic tokens that the client has received.
    tokens: Arc<Tokens>,
    publisher: Publisher,
    watcher: Watcher,
    sender: mpsc::Sender<LoopEvent>,
    workers: Handle,
    running: Arc<AtomicUsize>,
    /// What may take long, for the progress report.
    work: watch::Sender<ServerWork>,
    /// The beginning of the last check.
    check_began: Instant,
}

impl MainLoop {
    /// Creates a server without workspaces. Its workers report to `sender`. If it `allows_outside`, projects may read
    /// files outside their folders.
    pub(crate) fn new(
        sender: mpsc::Sender<LoopEvent>,
        workers: Handle,
        publisher: Publisher,
        work: watch::Sender<ServerWork>,
        allows_outside: bool,
    ) -> MainLoop {
        MainLoop {
            db: Database::default(),
            loader: Loader::new(allows_outside),
            documents: Documents::default(),
            changing: None,
            folders: Vec::new(),
            are_folders_late: false,
            settings: Settings::default(),
            capabilities: Capabilities::default(),
            workspaces: Arc::new([]),
            shared_documents: Arc::default(),
            other_uris: Arc::default(),
            strays: BTreeSet::new(),
            foreign: HashSet::new(),
            staleness: Staleness::default(),
            earlier: Arc::default(),
            waiting: Vec::new(),
            tokens: Arc::default(),
            publisher,
            watcher: Watcher::new(sender.clone()),
            sender,
            workers,
            running: Arc::default(),
            work,
            check_began: Instant::now(),
        }
    }

    /// Runs as long as the process. After a panic, begins again; returns the message of a second panic.
    pub(crate) fn run(mut self, events: &mpsc::Receiver<LoopEvent>) -> Option<String> {
        let mut first: Option<String> = None;
        loop {
            let served = catch_unwind(AssertUnwindSafe(|| {
                if let Some(message) = &first {
                    self.restart(message);
                }
                self.serve(events);
            }));
            let message = panic_message(&*served.err()?);
            if first.is_some() {
                return Some(message);
            }
            first = Some(message);
        }
    }

    fn serve(&mut self, events: &mpsc::Receiver<LoopEvent>) {
        loop {
            while let Ok(event) = events.try_recv() {
                self.handle(event);
            }
            self.apply_changes();
            if self.staleness.begin_check() {
                self.start_check();
            }
            self.note_work();
            if self.watcher.has_left() {
                self.watch_more();
                continue;
            }
            let event = match self.staleness.pause(Instant::now()) {
                Some(pause) => events.recv_timeout(pause),
                None => events.recv().map_err(RecvTimeoutError::from),
            };
            match event {
                Ok(event) => self.handle(event),
                // The search that is due begins.
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Notes for the progress report what is being done between events.
    fn note_work(&self) {
        if self.staleness.is_searching() {
            // The thread that searches reports what it does.
            return;
        }
        let files = self.workspaces.iter().map(|workspace| workspace.files(&self.db).len()).sum();
        self.report(if self.staleness.is_checking() {
            ServerWork::Analysing(files)
        } else {
            ServerWork::Nothing
        });
    }

    /// Reports work to a client that shows progress.
    fn report(&self, work: ServerWork) {
        progress::report(&self.work, if self.capabilities.progress { work } else { ServerWork::Nothing });
    }

    fn handle(&mut self, event: LoopEvent) {
        if event.is_change() {
            self.staleness.note_change();
        }
        self.changing = event.document().cloned();
        match event {
            LoopEvent::Initialize { capabilities, folders } => self.initialize(capabilities, folders),
            LoopEvent::Initialized => {
                self.staleness.allow_checks();
                self.staleness.request_check();
            }
            LoopEvent::Opened(document) => self.opened(document),
            LoopEvent::Changed(params) => self.changed(params),
            LoopEvent::Focused => self.watcher.look(Duration::ZERO),
            LoopEvent::TextUnknown(uri) => self.text_unknown(uri),
            LoopEvent::Warn(message) => self.publisher.warn(&message),
            LoopEvent::Saved(params) => {
                self.watcher.look(Duration::ZERO);
                self.documents.saved(&params.text_document.uri, params.text);
                self.touched(&params.text_document.uri);
            }
            LoopEvent::Closed(uri) => self.closed(&self.documents.address(&uri).unwrap_or(uri)),
            LoopEvent::Disk { paths, missed } => self.disk(&paths, missed),
            LoopEvent::Folders { added, removed } => self.folders_changed(added, &removed),
            LoopEvent::Significance(level) => {
                if self.loader.set_significance(&mut self.db, level) {
                    self.staleness.bump_generation();
                }
            }
            LoopEvent::Configured(settings, problems) => self.configured(settings, problems),
            LoopEvent::Job(job) => {
                self.apply_changes();
                match job.request.is_current(&self.documents) && self.is_awaited() {
                    true => self.waiting.push(job),
                    false => self.start(job),
                }
            }
            LoopEvent::Searched(flag, search) => self.searched(&flag, search),
            LoopEvent::Reload => self.reload(),
            LoopEvent::TimePassed => self.staleness.request_check(),
            LoopEvent::LongSearch(flag) => self.staleness.lengthen_search(&flag),
            LoopEvent::Stop => self.stop(),
            #[cfg(debug_assertions)]
            #[allow(clippy::panic, reason = "that is what it is for")]
            LoopEvent::Panic => panic!("asked for"),
            LoopEvent::Defect(message) => self.publisher.defect(&message),
            LoopEvent::DiagnosticsRequested(about) => {
                let version = |url: &Url| self.documents.get(url).map(|open| open.version);
                self.publisher.asked(about.map(|url| (url.clone(), version(&url))));
            }
            LoopEvent::DiagnosticsGiven(given) => self.publisher.answered(|pulls| pulls.answered(given)),
            LoopEvent::DiagnosticsNotGiven(url) => self.publisher.answered(|pulls| pulls.lost(&url)),
            LoopEvent::HintsGiven(generation) => {
                if self.staleness.hints_given(generation) {
                    self.refresh_hints();
                }
            }
            LoopEvent::FiguresShown(generation, figures) => {
                // A comparison of a newer generation does not know them.
                if generation == self.staleness.generation() {
                    Arc::make_mut(&mut self.earlier).add(figures);
                }
            }
            LoopEvent::LimitsMissing(generation, part) => {
                self.apply_changes();
                match generation == self.staleness.generation() {
                    true => self.search_limits(part),
                    false => self.publisher.refresh(Refresh::Hints),
                }
            }
            LoopEvent::LimitsSearched(Err(Failure::Panicked(message))) => self.panicked(&message),
            // After a change, the client gets the limits of other texts.
            LoopEvent::LimitsSearched(_) => self.publisher.refresh(Refresh::Hints),
            LoopEvent::TokensCancelled(uri, version) => self.tokens_cancelled(&uri, version),
            LoopEvent::Looked(generation, found) => {
                self.apply_changes();
                if generation == self.staleness.generation() {
                    self.publisher.publish_first(found);
                }
            }
            LoopEvent::Checked(generation, checked) => {
                self.apply_changes();
                self.checked(generation, checked);
            }
            LoopEvent::Compared(generation, compared) => {
                self.apply_changes();
                if generation == self.staleness.generation() {
                    self.compared(compared);
                }
                // salsa frees replaced results when an input is set; now, no key waits for that. It would wait for a snapshot.
                if Arc::strong_count(&self.workspaces) == 1 {
                    self.db.trigger_lru_eviction();
                }
            }
        }
        self.changing = None;
    }

    fn initialize(&mut self, capabilities: Capabilities, folders: Vec<PathBuf>) {
        self.capabilities = capabilities;
        if capabilities.pull_diagnostics {
            self.publisher.pull();
        }
        self.folders = folders;
        self.staleness.outdate_workspaces();
    }

    fn folders_changed(&mut self, added: Vec<PathBuf>, removed: &[PathBuf]) {
        self.folders.retain(|folder| !removed.contains(folder));
        self.folders.extend(added);
        self.staleness.restart_load();
    }

    fn opened(&mut self, document: TextDocumentItem) {
        // Not every client sends `initialized`.
        self.staleness.allow_checks();
        self.watcher.look(Duration::ZERO);
        let uri = document.uri.clone();
        self.documents.open(document);
        self.touched(&uri);
    }

    fn changed(&mut self, params: DidChangeTextDocumentParams) {
        let DidChangeTextDocumentParams { text_document, content_changes } = params;
        let VersionedTextDocumentIdentifier { uri, version } = text_document;
        self.watcher.look(TYPING);
        self.documents.change(&uri, version, content_changes, self.capabilities.encoding);
        self.touched(&uri);
    }

    fn text_unknown(&mut self, uri: Option<Url>) {
        let all = || self.documents.0.keys().cloned().collect();
        for uri in uri.map_or_else(all, |uri| vec![uri]) {
            self.documents.lost(&uri);
            self.touched(&uri);
        }
    }

    /// Requests a check after a message about a document, even if its text is the same: the client waits for the version.
    fn touched(&mut self, uri: &Url) {
        self.staleness.request_check();
        let dirty = self.documents.get(uri).filter(|open| open.is_dirty);
        if dirty.is_some_and(|open| self.loader.is_config(&open.path)) {
            self.staleness.outdate_workspaces();
        }
    }

    fn closed(&mut self, uri: &Url) {
        // The client may have forgotten its diagnostics.
        self.publisher.forget(uri);
        self.tokens.closed(uri);
        if self.strays.remove(uri) {
            self.staleness.outdate_workspaces();
        }
        let Some((open, document)) =
            self.documents.0.remove(uri).zip(self.shared_documents.get(uri).copied())
        else {
            return;
        };
        // The same file may be open under another URI: then that text is in effect.
        let mut is_open = false;
        for (other, known) in self.shared_documents.iter() {
            if let Some(open) = self.documents.0.get_mut(other).filter(|_| known.file == document.file) {
                open.is_dirty = true;
                is_open = true;
            }
        }
        if !is_open {
            let is_outdated = self.loader.closed(&mut self.db, document.file);
            let path = document.file.path(&self.db);
            let is_outdated = is_outdated || !path.is_file() || self.loader.is_config(path);
            if is_outdated && open.home != Home::Elsewhere {
                self.staleness.outdate_workspaces();
            }
        }
        self.staleness.bump_generation();
    }

    fn disk(&mut self, paths: &BTreeSet<PathBuf>, missed: bool) {
        if missed {
            // Any folder that is watched may be gone.
            self.watcher.forget(Path::new("/"));
            self.loader.note_all();
            self.staleness.restart_load();
        }
        // Many files are read by a search, on its thread.
        let are_many = paths.len() > MOST_REFRESHED;
        for path in paths {
            let refreshed = if are_many { None } else { self.loader.refreshed(&mut self.db, path) };
            match refreshed {
                Some(true) => self.staleness.bump_generation(),
                Some(false) => {}
                // A folder that was replaced is watched again.
                None if self.loader.note(path, self.watcher.forget(path)) => self.staleness.request_search(),
                None => {}
            }
        }
    }

    /// Writes all changes to the database, which cancels the workers that read it.
    fn apply_changes(&mut self) {
        if self.staleness.is_outdated() {
            self.close_moved_documents();
        }
        self.apply_documents();
        let is_late = self.workspaces.is_empty() && self.staleness.is_load_late();
        if is_late && !self.are_folders_late && !self.documents.0.is_empty() {
            self.are_folders_late = true;
            self.staleness.restart_load();
        }
        if self.staleness.begin_load() {
            self.load();
        }
        if let Some(flag) = self.staleness.begin_search(Instant::now()) {
            self.search(flag);
        }
        self.start_waiting();
    }

    fn apply_documents(&mut self) {
        let mut dirty = self.documents.0.iter().filter(|(_, open)| open.is_dirty);
        if dirty.any(|(uri, open)| self.left_by(uri, open).is_some()) {
            self.close_moved_documents();
        }
        let dirty = self.documents.0.iter().filter(|(_, open)| open.is_dirty);
        let dirty: Vec<Url> = dirty.map(|(uri, _)| uri.clone()).collect();
        if dirty.is_empty() && self.shared_documents.len() == self.documents.0.len() {
            return;
        }
        let unknown = self.documents.unknown();
        let mut written: BTreeMap<Url, File> = BTreeMap::new();
        for uri in dirty {
            if let Some(open) = self.documents.0.get(&uri) {
                let file = write(&mut self.loader, &mut self.db, open, &unknown);
                written.insert(uri, file);
            }
        }
        for open in newest_of_several(&self.documents, &self.shared_documents, &written) {
            write(&mut self.loader, &mut self.db, open, &unknown);
        }
        let changed: HashSet<File> = written.values().copied().collect();
        let mut shared = BTreeMap::new();
        for (uri, open) in &mut self.documents.0 {
            open.is_dirty = false;
            let before = self.shared_documents.get(uri).copied();
            let known = before.map(|document| document.file);
            let Some(file) = written.get(uri).copied().or(known) else { continue };
            let is_analysed = match before.filter(|_| !changed.contains(&file)) {
                Some(before) => before.is_analysed,
                None => open.text.is(file.text(&self.db)),
            };
            shared.insert(uri.clone(), Document { file, version: open.version, is_analysed });
            let is_new_stray = known.is_none()
                && open.home != Home::Elsewhere
                && !is_in_a_folder(&self.db, &self.workspaces, file)
                && self.strays.insert(uri.clone());
            let is_permitted = known.is_none() && self.loader.is_refused(&open.path);
            let is_other_language = open.home != Home::Elsewhere
                && changed.contains(&file)
                && is_foreign(&open.path, file.text(&self.db)) != self.foreign.contains(&file);
            // A link in the path may lead to another file now.
            let is_moved = known.is_some_and(|known| known != file);
            if is_new_stray || is_permitted || is_moved || is_other_language {
                self.staleness.outdate_workspaces();
            }
        }
        let is_known = |(uri, document): (&Url, &Document)| {
            self.shared_documents.get(uri).is_some_and(|known| known.file == document.file)
        };
        // An edit changes no address.
        if shared.len() != self.shared_documents.len() || !shared.iter().all(is_known) {
            let addresses =
                |(uri, document): (&Url, &Document)| Some((url_of(&self.db, document.file)?, uri.clone()));
            let all = shared.iter().filter_map(addresses);
            self.other_uris = Arc::new(all.filter(|(of_path, _)| !shared.contains_key(of_path)).collect());
        }
        self.shared_documents = Arc::new(shared);
        self.staleness.bump_generation();
    }

    /// Searches folders on a separate thread: their number and the speed of the disk are unknown.
    fn search(&mut self, flag: Arc<AtomicBool>) {
        let mut search = self.loader.search();
        let (late, sender, work) = (self.sender.clone(), self.sender.clone(), self.work.clone());
        let long = LoopEvent::LongSearch(Arc::clone(&flag));
        self.workers.spawn(async move {
            tokio::time::sleep(LONG_SEARCH).await;
            let _ = late.send(long);
        });
        self.report(ServerWork::Searching);
        let is_reported = self.capabilities.progress;
        let looked = self.watcher.looked.take();
        let run = move || {
            // The watcher looks at the files before the search reads them, and then drops the sender.
            let _ = looked.map(|looked| looked.recv_timeout(LONG_SEARCH));
            let is_cancelled = || flag.load(Ordering::Relaxed);
            #[cfg(debug_assertions)]
            hold(&search, &is_cancelled);
            let report = |files| {
                if is_reported && files > 0 && !is_cancelled() {
                    progress::report(&work, ServerWork::Reading(files));
                }
            };
            let run = catch_unwind(AssertUnwindSafe(|| search.run(&is_cancelled, &report)));
            let _ = sender.send(LoopEvent::Searched(flag, run.ok().map(|()| search)));
        };
        // No worker is used: all of them may be busy with cancelled jobs.
        if let Err(error) = std::thread::Builder::new().name("search".to_owned()).spawn(run) {
            self.staleness.restart_load();
            self.publisher.warn(&format!("The folders cannot be searched: {error}."));
        }
    }

    /// Takes the result of a search, and loads the workspaces if something has changed. Then starts the jobs that waited for
    /// it, before another search begins.
    fn searched(&mut self, flag: &Arc<AtomicBool>, search: Option<DiskSearch>) {
        // What is loaded depends on the texts: those that came since the last event are among them.
        self.apply_documents();
        let begin = Instant::now();
        let are_folders_late = self.are_folders_late && !self.staleness.is_loaded();
        if !self.staleness.end_search(flag, begin) {
            return;
        }
        self.are_folders_late = are_folders_late;
        match search {
            Some(search) => {
                let (is_changed, is_again) = self.loader.learn(&self.db, search);
                if is_changed {
                    self.staleness.outdate_workspaces();
                }
                if is_again {
                    self.staleness.request_search();
                }
                if self.staleness.begin_load() {
                    self.load();
                }
            }
            None => self.load_failed("the folders could not be searched"),
        }
        self.staleness.note_cost(begin.elapsed());
        self.apply_documents();
        self.start_waiting();
    }

    fn start_waiting(&mut self) {
        if !self.is_awaited() {
            std::mem::take(&mut self.waiting).into_iter().for_each(|job| self.start(job));
        }
    }

    fn start(&self, RequestJob { request, work }: RequestJob) {
        let snapshot = request.is_current(&self.documents).then(|| self.snapshot());
        self.spawn(move || work(snapshot));
    }

    /// Loads the workspaces, or requests the search that this requires.
    fn load(&mut self) {
        let before = (current_revision(&self.db), Arc::clone(&self.workspaces));
        match self.load_workspaces() {
            Ok(true) => {}
            Ok(false) => self.staleness.await_search(),
            Err(Failure::Panicked(message)) => self.load_failed(&message),
            Err(Failure::Overtaken | Failure::Cancelled) => self.staleness.outdate_workspaces(),
        }
        // A running check of what has not changed goes on.
        if before != (current_revision(&self.db), Arc::clone(&self.workspaces)) {
            self.staleness.bump_generation();
        }
    }

    /// Publishes that loading panicked: no workspace is known until a change, after which loading succeeds.
    fn load_failed(&mut self, message: &str) {
        self.workspaces = Arc::new([]);
        self.staleness.fail_load();
        self.panicked(message);
    }

    /// Returns the file of a document, if the path of the document leads to another one now.
    fn left_by(&self, uri: &Url, open: &OpenDocument) -> Option<File> {
        let file = self.shared_documents.get(uri).filter(|_| open.home == Home::File)?.file;
        (canonical_path(&open.path) != *file.path(&self.db)).then_some(file)
    }

    /// Closes the files of documents whose path leads to another file now, through a link that has changed.
    fn close_moved_documents(&mut self) {
        let left: Vec<File> =
            self.documents.0.iter().filter_map(|(uri, open)| self.left_by(uri, open)).collect();
        for &file in &left {
            if self.loader.closed(&mut self.db, file) {
                self.staleness.outdate_workspaces();
            }
        }
        for (uri, document) in
            self.shared_documents.iter().filter(|(_, document)| left.contains(&document.file))
        {
            if let Some(open) = self.documents.0.get_mut(uri) {
                open.is_dirty = true;
            }
            tracing::debug!("{uri} is no longer {}", document.file.path(&self.db).display());
        }
    }

    fn configured(&mut self, settings: Settings, problems: Vec<String>) {
        let before = std::mem::replace(&mut self.settings, settings);
        // A level that was chosen since stays until another one is set.
        if before.significance != settings.significance {
            self.loader.set_significance(&mut self.db, settings.significance);
        }
        if before != settings {
            self.staleness.bump_generation();
        }
        problems.iter().for_each(|problem| self.publisher.warn(problem));
    }

    /// Cancels all computations. Until the next change, diagnostics say that the analysis was stopped.
    fn stop(&mut self) {
        if *self.work.borrow() != ServerWork::Nothing {
            self.db.trigger_cancellation();
            self.staleness.stop();
        }
    }

    /// Loads the workspaces. Returns false if a search is required first.
    fn load_workspaces(&mut self) -> Result<bool, Failure> {
        let begin = Instant::now();
        let mut paths = if self.are_folders_late { Vec::new() } else { self.folders.clone() };
        let folders: Vec<PathBuf> = paths.iter().map(|folder| canonical_path(folder)).collect();
        let (mut elsewhere, mut alone) = (Vec::new(), Vec::new());
        self.foreign.clear();
        for (uri, open) in &self.documents.0 {
            if is_foreign(&open.path, &open.text.text()) {
                self.foreign.extend(self.shared_documents.get(uri).map(|document| document.file));
                continue;
            }
            match (open.home, self.shared_documents.get(uri)) {
                (Home::File, document) if is_model(&open.path) || open.path.ends_with(CONFIG_FILE) => {
                    let is_within = |folder: &PathBuf| canonical_path(&open.path).starts_with(folder);
                    match document.filter(|_| !folders.iter().any(is_within)) {
                        Some(document) => elsewhere.push((document.file, open.path.clone())),
                        None => paths.push(open.path.clone()),
                    }
                }
                (Home::Itself, Some(document)) if is_model(&open.path) => alone.push(document.file),
                _ => {}
            }
        }
        // Loading runs queries on untrusted texts, which may panic.
        let Some(mut loaded) = attempt(|| self.loader.load(&mut self.db, &paths))? else { return Ok(false) };
        // A text that the models in the folders include is a part of their projects, and no project by itself.
        let is_stray = |(file, _): &&(File, PathBuf)| !is_in_a_folder(&self.db, &loaded.workspaces, *file);
        let strays: Vec<PathBuf> = elsewhere.iter().filter(is_stray).map(|(_, path)| path.clone()).collect();
        if !strays.is_empty() {
            let all = [paths.as_slice(), strays.as_slice()].concat();
            let Some(all) = attempt(|| self.loader.load(&mut self.db, &all))? else { return Ok(false) };
            loaded = all;
        }
        if self.are_folders_late {
            self.folders.iter().for_each(|folder| self.loader.foresee(folder));
            self.staleness.request_search();
        }
        self.loader.forget_texts();
        let LoadedWorkspaces { mut workspaces, problems } = loaded;
        problems.iter().for_each(|problem| tracing::info!("{problem}"));
        workspaces.extend(alone.iter().map(|&file| self.loader.alone(&mut self.db, file)));
        self.workspaces = workspaces.into();
        self.watcher.watch_only(self.loader.watch_set().folders_to_watch());
        self.watch_more();
        // Open documents of a removed folder stay, because they are open.
        let is_stray = |document: &Document| !is_in_a_folder(&self.db, &self.workspaces, document.file);
        let strays = self.shared_documents.iter().filter(|(_, document)| is_stray(document));
        let is_elsewhere = |uri| self.documents.get(uri).is_some_and(|open| open.home == Home::Elsewhere);
        let strays = strays.filter(|(uri, _)| !is_elsewhere(uri));
        self.strays.extend(strays.map(|(uri, _)| uri.clone()));
        tracing::debug!("{} workspaces loaded in {:?}", self.workspaces.len(), begin.elapsed());
        Ok(true)
    }

    /// Watches some of the folders of the workspaces; the others after the events that wait.
    fn watch_more(&mut self) {
        let Some(new) = self.watcher.watch_more() else { return };
        self.watcher.use_only(self.loader.in_use());
        if let Some(failure) = &self.watcher.failure {
            self.publisher.warn(&format!(
                "Files are not watched: {failure}. Changes outside the editor are noticed some seconds later."
            ));
        }
        let watcher = &self.watcher;
        self.loader.distrust(|folder| watcher.watches(folder).then(|| !new.contains(folder)), &new);
        // Perhaps no event follows. Files in unwatched folders were read before the watcher looked at them: they are read again.
        if !new.is_empty() || self.watcher.failure.is_some() {
            self.staleness.request_search();
        }
    }

    /// Whether requests wait for a search.
    fn is_awaited(&self) -> bool {
        self.staleness.is_awaited() && !(self.are_folders_late && self.staleness.is_loaded())
    }

    fn snapshot(&self) -> Snapshot {
        let are_folders_late = self.are_folders_late && self.staleness.is_loaded();
        Snapshot {
            db: self.db.clone(),
            workspaces: Arc::clone(&self.workspaces),
            folders: self.folders.clone().into(),
            documents: Arc::clone(&self.shared_documents),
            other_uris: Arc::clone(&self.other_uris),
            capabilities: self.capabilities,
            settings: self.settings,
            typed: typing::typed_in(&self.documents),
            are_saved: self.documents.0.values().all(|open| open.is_saved || open.home == Home::Elsewhere),
            earlier: Arc::clone(&self.earlier),
            generation: self.staleness.generation(),
            is_complete: self.staleness.is_published(),
            is_stopped: self.staleness.is_stopped(),
            tokens: Arc::clone(&self.tokens),
            running: Arc::clone(&self.running),
            is_settled: self.staleness.is_settled(),
            is_searching: self.staleness.are_files_missing() && !are_folders_late,
            are_folders_late,
            searched: self.loader.searched(),
            unwatched: self.watcher.failure.clone(),
            outbox: Arc::clone(&self.publisher.outbox),
        }
    }

    fn spawn(&self, job: impl FnOnce() + Send + 'static) {
        let running = Arc::clone(&self.running);
        running.fetch_add(1, Ordering::SeqCst);
        self.workers.spawn_blocking(move || {
            // Jobs catch their own panics: this catches panics in the code around them.
            let _ = catch_unwind(AssertUnwindSafe(job));
            running.fetch_sub(1, Ordering::SeqCst);
        });
    }

    fn start_check(&mut self) {
        let (generation, snapshot, sender) =
            (self.staleness.generation(), self.snapshot(), self.sender.clone());
        self.check_began = Instant::now();
        let new = self.publisher.without_diagnostics(self.shared_documents.keys());
        self.spawn(move || {
            // A look that a change cancels is followed by a check that is cancelled too.
            let _ = attempt(|| {
                look(&snapshot, &new, |found| _ = sender.send(LoopEvent::Looked(generation, found)));
            });
            let checked = attempt(|| check(&snapshot));
            let is_published = checked.as_ref().is_ok_and(|checked| !checked.is_outdated);
            let _ = sender.send(LoopEvent::Checked(generation, checked));
            // Diagnostics do not wait for it.
            if is_published {
                let compared = attempt(|| compare(&snapshot));
                drop(snapshot);
                let _ = sender.send(LoopEvent::Compared(generation, compared));
            }
        });
    }

    fn checked(&mut self, generation: u64, checked: Result<CheckedDiagnostics, Failure>) {
        self.staleness.note_cost(self.check_began.elapsed());
        if !self.staleness.end_check(generation) {
            return;
        }
        let outcome = checked.as_ref().map_or_else(Failure::name, |_| "done");
        tracing::debug!("check of generation {generation}: {outcome}, {:.1?}", self.check_began.elapsed());
        match checked {
            Ok(checked) => self.publish(checked),
            Err(Failure::Panicked(message)) => self.panicked(&message),
            // A check that a change cancelled is of an older generation. Any other is repeated.
            Err(Failure::Overtaken | Failure::Cancelled) => self.staleness.request_check(),
        }
    }

    /// Publishes a check of the current generation, unless the workspaces are to be loaded again first.
    fn publish(&mut self, checked: CheckedDiagnostics) {
        let CheckedDiagnostics { is_outdated, do_some_wait, diagnostics } = checked;
        if is_outdated {
            if self.staleness.load_for_check() {
                return;
            }
            tracing::error!("a file that is included cannot be read");
        }
        self.publisher.publish(diagnostics);
        if do_some_wait {
            self.check_after(typing::PAUSE);
        }
        // The hints of an outdated generation are not compared.
        if self.staleness.publish() || is_outdated {
            self.refresh_hints();
        }
    }

    /// Requests refreshes of hints and tokens that differ from the client's.
    fn compared(&mut self, compared: Result<ComparedHints, Failure>) {
        let ComparedHints { figures, hints, lenses, meanings } = match compared {
            Ok(compared) => compared,
            Err(Failure::Panicked(message)) => return self.panicked(&message),
            Err(Failure::Overtaken | Failure::Cancelled) => return self.staleness.request_check(),
        };
        self.staleness.compare();
        if let Some(due) = figures.reasons_due() {
            self.check_after(due);
        }
        self.earlier = Arc::new(figures);
        if replace(&mut self.publisher.hints, hints) && self.capabilities.hint_refresh {
            self.publisher.refresh(Refresh::Hints);
        }
        if replace(&mut self.publisher.lenses, lenses) && self.capabilities.lens_refresh {
            self.publisher.refresh(Refresh::Lenses);
        }
        if self.tokens.is_outdated(&meanings) && self.capabilities.token_refresh {
            self.publisher.refresh(Refresh::Tokens);
        }
    }

    /// Searches limits that hints of a timing table lack.
    fn search_limits(&self, part: (File, TextRange)) {
        let (snapshot, sender) = (self.snapshot(), self.sender.clone());
        self.spawn(move || {
            let searched = attempt(|| search_limits(&snapshot, part));
            drop(snapshot);
            let _ = sender.send(LoopEvent::LimitsSearched(searched));
        });
    }

    /// Has the current texts checked again after a while, since hints and diagnostics depend on the time since the last edit.
    fn check_after(&self, due: Duration) {
        let sender = self.sender.clone();
        self.workers.spawn(async move {
            tokio::time::sleep(due).await;
            let _ = sender.send(LoopEvent::TimePassed);
        });
    }

    /// Requests a token refresh when changes cancelled the client's request for this version of a document. The
    /// next check does so if one is to come. About a newer version the client asks by itself.
    fn tokens_cancelled(&mut self, uri: &Url, version: i32) {
        if self.documents.get(uri).is_none_or(|open| open.version != version) {
            return;
        }
        self.tokens.lost(uri, version);
        if self.staleness.is_published() && self.capabilities.token_refresh {
            self.publisher.refresh(Refresh::Tokens);
        }
    }

    fn refresh_hints(&self) {
        if self.capabilities.hint_refresh {
            self.publisher.refresh(Refresh::Hints);
        }
        if self.capabilities.lens_refresh {
            self.publisher.refresh(Refresh::Lenses);
        }
    }

    fn panicked(&mut self, message: &str) {
        let open = self.shared_documents.iter().map(|(uri, document)| (uri.clone(), document.version));
        self.publisher.panicked(open.collect(), message);
        self.refresh_hints();
    }
}

/// Returns whether a document is in another language with the extension of models: then it is part of no workspace, unless a
/// model or a configuration names it.
fn is_foreign(path: &Path, text: &str) -> bool {
    is_model(path) && is_of_another_language(text)
}

/// Writes the text of a document to the database.
fn write(
    loader: &mut Loader,
    db: &mut Database,
    open: &OpenDocument,
    unknown: &BTreeMap<PathBuf, String>,
) -> File {
    let problem = unknown.get(&canonical_path(&open.path)).cloned().map(Problem::Unknown);
    loader.opened(db, &open.path, &open.text.text(), problem)
}

/// Returns the newest text of each of the `written` files that is open under several URIs: that text is analysed.
fn newest_of_several<'a>(
    documents: &'a Documents,
    known: &BTreeMap<Url, Document>,
    written: &BTreeMap<Url, File>,
) -> Vec<&'a OpenDocument> {
    let is_written: HashSet<&File> = written.values().collect();
    let mut open_as: HashMap<&File, Vec<&OpenDocument>> = HashMap::new();
    for (uri, open) in &documents.0 {
        let file = written.get(uri).or_else(|| known.get(uri).map(|document| &document.file));
        if let Some(file) = file.filter(|file| is_written.contains(file)) {
            open_as.entry(file).or_default().push(open);
        }
    }
    let several = open_as.into_values().filter(|all| all.len() > 1);
    several.filter_map(|all| all.into_iter().max_by_key(|open| open.changed)).collect()
}

/// For tests: waits while the file exists that this variable names; if it has a text, only with searches through whole folders.
#[cfg(debug_assertions)]
fn hold(search: &DiskSearch, is_cancelled: &dyn Fn() -> bool) {
    let Some(path) = std::env::var_os("MAUVE_DEBUG_HOLD") else { return };
    let is_held = |text: Vec<u8>| text.is_empty() || search.is_whole();
    while std::fs::read(&path).is_ok_and(is_held) && !is_cancelled() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Returns whether a workspace in the client's folders contains this file.
fn is_in_a_folder(db: &Database, workspaces: &[Workspace], file: File) -> bool {
    let whole = workspaces.iter().filter(|workspace| workspace.only(db).is_empty());
    whole.into_iter().any(|workspace| workspace.files(db).values().any(|known| *known == file))
}
