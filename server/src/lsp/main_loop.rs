//! The one thread that owns the database. Events come in the client's order; all that is there is taken before anything is
//! analysed, so that a burst of edits costs one analysis. Then a worker checks everything, and what it found is published
//! if nothing has changed meanwhile.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Instant;

use mauve_hir::{CONFIG_FILE, Database, File, Problem, Workspace, is_model};
use mauve_timing::Level;
use salsa::Database as _;
use tokio::runtime::Handle;
use tokio::sync::watch;
use tower_lsp::lsp_types::{DidChangeTextDocumentParams, DidSaveTextDocumentParams, TextDocumentItem, Url};

use super::capabilities::Capabilities;
use super::check::{Checked, check};
use super::documents::Documents;
use super::publisher::{Publisher, Refresh};
use super::pulls::Given;
use super::settings::Settings;
use super::snapshot::{Document, Failure, Snapshot, attempt};
use super::tokens::Tokens;
use super::watcher::Watcher;
use crate::load::{Left, Loaded, Loader, Walk, Walked, place};

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
    /// Something came that could not be understood; about this text, open or not, or about any.
    Lost(Option<Url>),
    /// Something that the user is told once.
    Warn(String),
    /// It was written to the disk.
    Saved(DidSaveTextDocumentParams),
    /// It is the disk's again.
    Closed(Url),
    /// These folders were looked through, unless that was called off; none: it has failed.
    Walked(Arc<AtomicBool>, Option<Vec<(Walk, Walked)>>),
    /// Files that have come, gone or changed; and perhaps more, which nobody can name.
    Disk { paths: BTreeSet<PathBuf>, missed: bool },
    /// The client's folders have changed.
    Folders { added: Vec<Url>, removed: Vec<Url> },
    /// The significance level that is shown from now on; none: that of each `mauve.toml`.
    Significance(Option<Level>),
    /// What the user has set in his editor, and what was wrong with it.
    Configured(Settings, Vec<String>),
    /// Something to compute.
    Job(Job),
    /// The user does not want to wait for the analysis that is running.
    Stop,
    /// A handler panicked: its request had an error for an answer, and the user is told once.
    Defect(String),
    /// The client asks what is wrong, in a file or in all.
    Pulled(Option<Url>),
    /// It was told so.
    Diagnosed(BTreeMap<Url, Given>),
    /// It was not.
    Undiagnosed(Url),
    /// The client was given the inlay hints or code lenses of this generation; none, where an edit has overtaken its question.
    Hinted(Option<u64>),
    /// An edit has overtaken its question for the colours of this text in this version.
    Uncoloured(Url, i32),
    /// A worker has checked everything as it was at this generation.
    Checked(u64, Result<Checked, Failure>),
}

/// Something to compute.
pub(crate) type Job = Box<dyn FnOnce(Snapshot) + Send>;

/// After so many attempts in a row to read what is missing, what is there is shown.
const MOST_RELOADS: u32 = 3;

/// So often folders are read again that nobody watched while they were read.
const MOST_PASSES: u32 = 3;

/// The state of the server.
pub(crate) struct MainLoop {
    db: Database,
    loader: Loader,
    documents: Documents,
    /// The client's folders.
    folders: Vec<PathBuf>,
    settings: Settings,
    capabilities: Capabilities,
    workspaces: Arc<[Workspace]>,
    shared_documents: Arc<BTreeMap<Url, Document>>,
    /// Open texts that no folder of the client has: opening them has changed the workspaces, closing them will.
    strays: BTreeSet<Url>,
    /// Files or folders have come or gone: the workspaces are to be looked for again.
    reload: bool,
    /// The workspaces could not be loaded the last time.
    failed: bool,
    /// Another thread is looking through folders: set to call that off.
    walking: Option<Arc<AtomicBool>>,
    /// What is to be computed once it is done.
    waiting: Vec<Job>,
    /// How often in a row folders were read again that nobody had watched.
    passes: u32,
    /// How often in a row a check has found that something was to be read first.
    reloads: u32,
    /// A check is due.
    check: bool,
    /// The generation of which a check is running.
    checking: Option<u64>,
    /// Counts the states of what the client and the disk have.
    generation: u64,
    /// The one of which a check has found that everything is read that is needed, or can be.
    complete: Option<u64>,
    /// The one that the user does not want to be analysed.
    stopped: Option<u64>,
    /// The one of which the diagnostics were published last.
    published: Option<u64>,
    /// Others of which the client was given inlay hints since.
    hinted: BTreeSet<u64>,
    /// What the client was given of the colours of names.
    tokens: Arc<Tokens>,
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
    /// A server that knows nothing yet. Its own workers report to `sender`. Where it `allows_outside`, projects may read
    /// what is none of theirs.
    pub(crate) fn new(
        sender: mpsc::Sender<Event>,
        workers: Handle,
        publisher: Publisher,
        busy: watch::Sender<bool>,
        allows_outside: bool,
    ) -> MainLoop {
        MainLoop {
            db: Database::default(),
            loader: Loader::deferred(allows_outside),
            documents: Documents::default(),
            folders: Vec::new(),
            settings: Settings::default(),
            capabilities: Capabilities::default(),
            workspaces: Arc::new([]),
            shared_documents: Arc::default(),
            strays: BTreeSet::new(),
            reload: false,
            failed: false,
            walking: None,
            waiting: Vec::new(),
            passes: 0,
            reloads: 0,
            check: false,
            checking: None,
            generation: 0,
            complete: None,
            stopped: None,
            published: None,
            hinted: BTreeSet::new(),
            tokens: Arc::default(),
            is_initialized: false,
            publisher,
            watcher: Watcher::new(sender.clone()),
            sender,
            workers,
            running: Arc::default(),
            busy,
        }
    }

    /// Runs as long as the process.
    pub(crate) fn run(mut self, events: &mpsc::Receiver<Event>) {
        while let Ok(event) = events.recv() {
            self.handle(event);
            while let Ok(event) = events.try_recv() {
                self.handle(event);
            }
            self.settle();
            // A newly watched folder is read again at once: no event need follow that would have it read.
            for _ in 0..MOST_PASSES {
                if self.reload && self.walking.is_none() {
                    self.settle();
                }
            }
            // What could not be loaded is not checked: nothing is known of it.
            let is_loaded = !self.reload && !self.failed && self.walking.is_none();
            if self.is_initialized && is_loaded && std::mem::take(&mut self.check) {
                self.start_check();
            }
        }
    }

    fn handle(&mut self, event: Event) {
        let is_news = matches!(
            event,
            Event::Opened(_)
                | Event::Changed(_)
                | Event::Saved(_)
                | Event::Closed(_)
                | Event::Disk { .. }
                | Event::Folders { .. }
        );
        // What could not be loaded is tried again when something has happened.
        self.reload |= is_news && std::mem::take(&mut self.failed);
        match event {
            Event::Initialize { capabilities, folders } => {
                self.capabilities = capabilities;
                if capabilities.pull_diagnostics {
                    self.publisher.pull();
                }
                self.folders = folders.iter().filter_map(|url| url.to_file_path().ok()).collect();
                self.reload = true;
            }
            Event::Initialized => {
                self.is_initialized = true;
                self.check = true;
            }
            Event::Opened(document) => {
                // Not every client says so.
                self.is_initialized = true;
                let uri = document.uri.clone();
                self.documents.open(document);
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
            Event::Warn(message) => self.publisher.warn(&message),
            Event::Saved(params) => {
                self.documents.saved(&params.text_document.uri, params.text);
                self.touched(&params.text_document.uri);
            }
            Event::Closed(uri) => self.closed(&self.documents.address(&uri).unwrap_or(uri)),
            Event::Disk { paths, missed } => {
                if missed {
                    // The folders that are watched may be gone.
                    self.watcher.forget_all();
                    self.reload = true;
                }
                self.disk(&paths);
            }
            Event::Folders { added, removed } => {
                let paths = |urls: Vec<Url>| urls.into_iter().filter_map(|url| url.to_file_path().ok());
                let removed: BTreeSet<PathBuf> = paths(removed).collect();
                self.folders.retain(|folder| !removed.contains(folder));
                self.folders.extend(paths(added));
                self.reload = true;
                if let Some(walking) = self.walking.take() {
                    walking.store(true, Ordering::Relaxed);
                }
            }
            Event::Significance(level) => {
                if self.loader.set_significance(&mut self.db, level) {
                    self.stir();
                }
            }
            Event::Configured(settings, problems) => self.configured(settings, problems),
            Event::Job(job) => {
                self.settle();
                match self.walking {
                    Some(_) => self.waiting.push(job),
                    None => self.start(job),
                }
            }
            Event::Walked(walking, walked) => self.walked(&walking, walked),
            Event::Stop => self.stop(),
            Event::Defect(message) => self.publisher.defect(&message),
            Event::Pulled(about) => {
                let version = |url: &Url| self.documents.get(url).map(|open| open.version);
                self.publisher.asked(about.map(|url| (url.clone(), version(&url))));
            }
            Event::Diagnosed(given) => self.publisher.answered(|pulls| pulls.answered(given)),
            Event::Undiagnosed(url) => self.publisher.answered(|pulls| pulls.lost(&url)),
            Event::Hinted(generation) => self.hinted(generation),
            Event::Uncoloured(uri, version) => self.uncoloured(&uri, version),
            Event::Checked(generation, checked) => {
                self.settle();
                self.checked(generation, checked);
            }
        }
    }

    /// A text was touched: it is to be checked, even where it is the same, since the client waits for its version.
    fn touched(&mut self, uri: &Url) {
        self.check = true;
        let dirty = self.documents.get(uri).filter(|open| open.dirty.is_some());
        self.reload |= dirty.is_some_and(|open| self.loader.is_config(&open.path));
    }

    fn closed(&mut self, uri: &Url) {
        // The client may have forgotten its diagnostics.
        self.publisher.forget(uri);
        self.tokens.closed(uri);
        self.reload |= self.strays.remove(uri);
        let Some(document) =
            self.documents.0.remove(uri).and_then(|_| self.shared_documents.get(uri).copied())
        else {
            return;
        };
        // The same file may be open by another address: then that one's text counts.
        let mut is_open = false;
        for (other, known) in self.shared_documents.iter() {
            if let Some(open) = self.documents.0.get_mut(other).filter(|_| known.file == document.file) {
                open.dirty = Some(Instant::now());
                is_open = true;
            }
        }
        if !is_open {
            self.reload |= self.loader.closed(&mut self.db, document.file);
            self.reload |= !document.file.path(&self.db).is_file()
                || self.loader.is_config(document.file.path(&self.db));
        }
        self.stir();
    }

    /// Looks at what may have changed outside the client.
    fn disk(&mut self, paths: &BTreeSet<PathBuf>) {
        for path in paths {
            self.reload |= self.watcher.forget(path);
            match self.loader.refreshed(&mut self.db, path) {
                Some(true) => self.stir(),
                Some(false) => {}
                None => self.reload |= self.loader.surroundings().matters(path),
            }
        }
    }

    /// Gives what has changed to the database, which ends whatever reads it.
    fn settle(&mut self) {
        if self.reload {
            self.find_again();
        }
        self.settle_documents();
        if self.reload && self.walking.is_none() {
            self.stir();
            self.reload = false;
            match self.loader.reset_walks() {
                walks if walks.is_empty() => self.reload_now(),
                walks => self.walk(walks),
            }
        }
        self.start_waiting();
    }

    fn settle_documents(&mut self) {
        let mut dirty: Vec<(Instant, &Url)> =
            self.documents.0.iter().filter_map(|(uri, open)| Some((open.dirty?, uri))).collect();
        // Of two addresses of one file, the one that was changed last counts.
        dirty.sort();
        let mut written: BTreeMap<Url, File> = BTreeMap::new();
        let unknown = if dirty.is_empty() { BTreeMap::new() } else { self.documents.unknown() };
        for uri in dirty.into_iter().map(|(_, uri)| uri) {
            if let Some(open) = self.documents.0.get(uri) {
                let problem = unknown.get(&place(&open.path)).cloned().map(Problem::Unknown);
                let file = self.loader.opened(&mut self.db, &open.path, &open.text, problem);
                written.insert(uri.clone(), file);
            }
        }
        let is_new = !written.is_empty() || self.shared_documents.len() != self.documents.0.len();
        let mut shared = BTreeMap::new();
        for (uri, open) in &mut self.documents.0 {
            open.dirty = None;
            let known = self.shared_documents.get(uri).map(|document| document.file);
            let Some(file) = written.get(uri).copied().or(known) else { continue };
            let is_analysed = **file.text(&self.db) == *open.text;
            shared.insert(uri.clone(), Document { file, version: open.version, is_analysed });
            if known.is_none() && !is_in_a_folder(&self.db, &self.workspaces, file) {
                // What is loaded once the folders are looked through has it.
                self.reload |= self.strays.insert(uri.clone()) && self.walking.is_none();
            }
            // Behind a link that has become another one.
            self.reload |= known.is_some_and(|known| known != file);
        }
        if is_new {
            self.shared_documents = Arc::new(shared);
            self.stir();
        }
    }

    /// Looks through folders on a thread of its own: nobody knows how many there are, and how slow the disk is.
    fn walk(&mut self, walks: Vec<Walk>) {
        let cancelled = Arc::new(AtomicBool::new(false));
        self.walking = Some(Arc::clone(&cancelled));
        let sender = self.sender.clone();
        let walk = move || {
            let is_cancelled = || cancelled.load(Ordering::Relaxed);
            let run = || {
                let mut left = Left::default();
                let walked = walks.into_iter().map(|walk| {
                    let walked = walk.run(&mut left, &is_cancelled);
                    (walk, walked)
                });
                walked.collect()
            };
            let walked = catch_unwind(AssertUnwindSafe(run)).ok();
            let _ = sender.send(Event::Walked(cancelled, walked));
        };
        // Not one of the workers: all of them may be busy with what is outdated.
        if let Err(error) = std::thread::Builder::new().name("walk".to_owned()).spawn(walk) {
            self.walking = None;
            self.reload = true;
            self.publisher.warn(&format!("The folders cannot be looked through: {error}."));
        }
    }

    /// Takes what was found in folders; then what has waited for it is computed, before they are looked through again.
    fn walked(&mut self, walking: &Arc<AtomicBool>, walked: Option<Vec<(Walk, Walked)>>) {
        if !self.walking.as_ref().is_some_and(|it| Arc::ptr_eq(it, walking)) {
            return;
        }
        self.walking = None;
        self.stir();
        match walked {
            Some(walked) => {
                walked.into_iter().for_each(|(walk, walked)| self.loader.learn(walk, walked));
                self.reload_now();
            }
            None => {
                self.workspaces = Arc::new([]);
                self.failed = true;
                self.panicked("the folders could not be looked through");
            }
        }
        self.settle_documents();
        self.start_waiting();
    }

    /// What waits for folders to be looked through is computed, if nothing is to be waited for any more.
    fn start_waiting(&mut self) {
        if self.walking.is_none() {
            std::mem::take(&mut self.waiting).into_iter().for_each(|job| self.start(job));
        }
    }

    fn start(&self, job: Job) {
        let snapshot = self.snapshot();
        self.spawn(move || job(snapshot));
    }

    fn reload_now(&mut self) {
        match self.load() {
            Ok(wanted) if wanted.is_empty() => {}
            Ok(wanted) => self.walk(wanted),
            Err(Failure::Panicked(message)) => {
                // Nothing is known until something happens, and it succeeds.
                self.workspaces = Arc::new([]);
                self.failed = true;
                self.panicked(&message);
            }
            Err(Failure::Overtaken | Failure::Cancelled) => self.reload = true,
        }
    }

    /// Behind a link that has become another one, an open text is that of another file.
    fn find_again(&mut self) {
        let known = |uri| self.shared_documents.get(uri).map(|document| document.file);
        let files = self.documents.0.iter().filter(|(_, open)| open.is_file);
        let files = files.filter_map(|(uri, open)| Some((known(uri)?, open)));
        let left: Vec<File> = files
            .filter(|(file, open)| place(&open.path) != *file.path(&self.db))
            .map(|(file, _)| file)
            .collect();
        for &file in &left {
            self.reload |= self.loader.closed(&mut self.db, file);
        }
        for (uri, document) in
            self.shared_documents.iter().filter(|(_, document)| left.contains(&document.file))
        {
            if let Some(open) = self.documents.0.get_mut(uri) {
                open.dirty.get_or_insert(Instant::now());
            }
            tracing::debug!("{uri} is not {} any more", document.file.path(&self.db).display());
        }
    }

    /// The state is another one from here on.
    fn stir(&mut self) {
        self.generation += 1;
        self.check = true;
    }

    fn configured(&mut self, settings: Settings, problems: Vec<String>) {
        let before = std::mem::replace(&mut self.settings, settings);
        // A level that was chosen since stays until another one is set.
        if before.significance != settings.significance {
            self.loader.set_significance(&mut self.db, settings.significance);
        }
        if before != settings {
            self.stir();
        }
        problems.iter().for_each(|problem| self.publisher.warn(problem));
    }

    /// Ends whatever is computed. Nothing is known then, and that is said, until the next edit.
    fn stop(&mut self) {
        if *self.busy.borrow() {
            self.db.trigger_cancellation();
            self.stir();
            self.stopped = Some(self.generation);
        }
    }

    /// Loads the workspaces anew. Gives what is to be looked through first.
    fn load(&mut self) -> Result<Vec<Walk>, Failure> {
        let begin = Instant::now();
        let folders: Vec<PathBuf> = self.folders.iter().map(|folder| place(folder)).collect();
        let mut paths = self.folders.clone();
        let (mut elsewhere, mut alone) = (Vec::new(), Vec::new());
        for (uri, open) in &self.documents.0 {
            match (open.is_file, self.shared_documents.get(uri)) {
                (true, document) if is_model(&open.path) || open.path.ends_with(CONFIG_FILE) => {
                    let is_within = |folder: &PathBuf| place(&open.path).starts_with(folder);
                    match document.filter(|_| !folders.iter().any(is_within)) {
                        Some(document) => elsewhere.push((document.file, open.path.clone())),
                        None => paths.push(open.path.clone()),
                    }
                }
                (false, Some(document)) => alone.push(document.file),
                _ => {}
            }
        }
        // What is read rests on queries, and they on what anybody has written.
        let mut loaded = match attempt(|| self.loader.load(&mut self.db, &paths))? {
            Ok(loaded) => loaded,
            Err(wanted) => return Ok(wanted),
        };
        // A text that the models in the folders include is a part of their projects, and no project by itself.
        let is_stray = |(file, _): &&(File, PathBuf)| !is_in_a_folder(&self.db, &loaded.workspaces, *file);
        let strays: Vec<PathBuf> = elsewhere.iter().filter(is_stray).map(|(_, path)| path.clone()).collect();
        if !strays.is_empty() {
            let all = [paths.as_slice(), strays.as_slice()].concat();
            loaded = match attempt(|| self.loader.load(&mut self.db, &all))? {
                Ok(loaded) => loaded,
                Err(wanted) => return Ok(wanted),
            };
        }
        let Loaded { mut workspaces, problems } = loaded;
        problems.iter().for_each(|problem| tracing::info!("{problem}"));
        workspaces.extend(alone.iter().map(|&file| self.loader.alone(&mut self.db, file)));
        self.workspaces = workspaces.into();
        // What was written before a folder was watched was perhaps not read.
        match self.watcher.watch(&self.loader.surroundings().watched()) {
            Ok(is_new) if is_new && self.passes < MOST_PASSES => {
                self.passes += 1;
                self.reload = true;
            }
            Ok(_) => self.passes = 0,
            Err(error) => self.publisher.warn(&format!(
                "Files that change outside the editor may not be noticed: {error}. Restart the server after such a change."
            )),
        }
        // Where a folder was taken away, the open texts in it are there only because they are open.
        let is_stray = |document: &Document| !is_in_a_folder(&self.db, &self.workspaces, document.file);
        let strays = self.shared_documents.iter().filter(|(_, document)| is_stray(document));
        self.strays.extend(strays.map(|(uri, _)| uri.clone()));
        tracing::debug!("{} workspaces loaded in {:?}", self.workspaces.len(), begin.elapsed());
        Ok(Vec::new())
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot {
            db: self.db.clone(),
            workspaces: Arc::clone(&self.workspaces),
            folders: self.folders.clone().into(),
            documents: Arc::clone(&self.shared_documents),
            capabilities: self.capabilities,
            settings: self.settings,
            generation: self.generation,
            is_complete: self.complete == Some(self.generation),
            is_stopped: self.stopped == Some(self.generation),
            tokens: Arc::clone(&self.tokens),
            running: Arc::clone(&self.running),
            is_settled: self.is_settled(),
            outbox: self.publisher.outbox(),
        }
    }

    /// Does the main loop wait for nothing but events? What cannot be loaded is not checked.
    fn is_settled(&self) -> bool {
        let is_checked = !self.check || self.failed || !self.is_initialized;
        is_checked && !self.reload && self.walking.is_none() && self.checking.is_none()
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
        self.busy.send_replace(self.capabilities.progress);
        let (generation, snapshot, sender) = (self.generation, self.snapshot(), self.sender.clone());
        self.checking = Some(generation);
        self.spawn(move || {
            let checked = attempt(|| check(&snapshot));
            drop(snapshot);
            let _ = sender.send(Event::Checked(generation, checked));
        });
    }

    fn checked(&mut self, generation: u64, checked: Result<Checked, Failure>) {
        self.checking = self.checking.filter(|&checking| checking != generation);
        if generation != self.generation {
            return;
        }
        self.busy.send_replace(false);
        match checked {
            Ok(checked) if checked.is_outdated && self.reloads < MOST_RELOADS => {
                self.reloads += 1;
                self.reload = true;
            }
            Ok(Checked { is_outdated, diagnostics, ids, hints, meanings }) => {
                if is_outdated {
                    tracing::error!("a file that is included cannot be read");
                }
                self.complete = Some(generation);
                self.reloads = 0;
                self.published = Some(generation);
                let others = std::mem::take(&mut self.hinted);
                let is_another = self.publisher.publish(diagnostics, &ids, hints);
                // What is shown of a state that is not analysed any more is to go.
                let is_another = is_another || self.stopped == Some(generation);
                if is_another || others.iter().any(|hinted| *hinted != generation) {
                    self.refresh_hints();
                }
                if self.tokens.is_outdated(&meanings) && self.capabilities.token_refresh {
                    self.publisher.refresh(Refresh::Tokens);
                }
            }
            Err(Failure::Panicked(message)) => self.panicked(&message),
            // What ended it is followed by another check; if not, it is due now.
            Err(Failure::Overtaken | Failure::Cancelled) => self.check = true,
        }
    }

    /// The check that is to come has the client ask again; if there is none to come, it is now. A text that is another one
    /// since, it asks about by itself.
    fn uncoloured(&mut self, uri: &Url, version: i32) {
        if self.documents.get(uri).is_none_or(|open| open.version != version) {
            return;
        }
        self.tokens.lost(uri, version);
        if self.published == Some(self.generation) && self.capabilities.token_refresh {
            self.publisher.refresh(Refresh::Tokens);
        }
    }

    /// Sees to it that the client does not keep hints of another state than the last.
    fn hinted(&mut self, generation: Option<u64>) {
        if generation.is_none() || generation != self.published {
            self.hinted.insert(generation.unwrap_or(u64::MAX));
            // The check that is to come looks at it; if there is none to come, it is now.
            if self.published == Some(self.generation) {
                self.hinted.clear();
                self.refresh_hints();
            }
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

/// Does a workspace of the client's folders have this file?
fn is_in_a_folder(db: &Database, workspaces: &[Workspace], file: File) -> bool {
    let whole = workspaces.iter().filter(|workspace| workspace.only(db).is_empty());
    whole.into_iter().any(|workspace| workspace.files(db).values().any(|known| *known == file))
}
