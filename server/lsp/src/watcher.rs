//! Watches files for changes outside the client. Not every client reports them, and no client reports files outside
//! its folders. Where the system does not report them either, a thread looks at the files in use, see [`Looks`]: when a document is
//! opened or saved, when the editor gets the focus, while the user types, and regularly where that is known.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode};
use notify::{ErrorKind, EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};

use super::event::LoopEvent;
use super::looks::Looks;

/// How long to wait for further events, and the maximum in total: programs often write a file in several steps.
const QUIET: Duration = Duration::from_millis(10);
const LONGEST: Duration = Duration::from_millis(100);

/// The maximum number of watched folders: the system has a limit for all programs together.
const MOST_FOLDERS: usize = 10_000;

/// The maximum number of folders that the main loop watches between two events: the thread of the system's events answers for each.
const MOST_AT_ONCE: usize = 100;

/// The time between two looks at the files in use while the user types.
pub(crate) const TYPING: Duration = Duration::from_secs(5);

/// The system's error where all instances of inotify are taken.
const TAKEN: i32 = rustix::io::Errno::MFILE.raw_os_error();

/// What the thread of the watcher is told.
enum WatcherMessage {
    /// The system says that this was created, removed or changed.
    Path(PathBuf),
    /// Events were missed.
    Missed,
    /// These files and folders are in use from now on, and whether the system refuses to watch some. The sender is dropped when they
    /// have been looked at.
    InUse(BTreeSet<PathBuf>, bool, mpsc::Sender<()>),
    /// Looks at what is in use.
    Look,
}

/// Watches the folders of the workspaces.
pub(crate) struct Watcher {
    /// An error if the system provides no watcher.
    watcher: Result<RecommendedWatcher, notify::Error>,
    watched: BTreeSet<PathBuf>,
    /// Those to be watched next.
    left: BTreeSet<PathBuf>,
    /// The watched ones that [`Watcher::watch_more`] has not returned yet.
    new: BTreeSet<PathBuf>,
    /// Why not all of the folders so far are watched.
    failed: Option<Arc<str>>,
    /// The same of all when none was left, in a few words: why, or what to do.
    pub(crate) failure: Option<Arc<str>>,
    thread: mpsc::Sender<WatcherMessage>,
    last_look: Instant,
    /// Ends when the files in use have been looked at: what is read from then on is at least as new.
    pub(crate) looked: Option<mpsc::Receiver<()>>,
}

impl Watcher {
    /// Creates a watcher without folders that sends changes to `events`.
    pub(crate) fn new(events: mpsc::Sender<LoopEvent>) -> Watcher {
        let (thread, seen) = mpsc::channel::<WatcherMessage>();
        let sender = thread.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let say = |seen| drop(sender.send(seen));
            match event {
                Ok(event) if event.need_rescan() => say(WatcherMessage::Missed),
                Ok(event) => {
                    let is_read = matches!(event.kind, EventKind::Access(kind)
                        if kind != AccessKind::Close(AccessMode::Write));
                    if !is_read {
                        event.paths.into_iter().map(WatcherMessage::Path).for_each(say);
                    }
                }
                Err(_) => say(WatcherMessage::Missed),
            }
        });
        std::thread::spawn(move || {
            let mut looks = Looks::default();
            while tell(&seen, &mut looks, &events) {}
        });
        let (watched, left, new) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        let (failed, failure, last_look, looked) = (None, None, Instant::now(), None);
        Watcher { watcher, watched, left, new, failed, failure, thread, last_look, looked }
    }

    /// Looks at the files in use, unless the last look was less than this `pause` ago.
    pub(crate) fn look(&mut self, pause: Duration) {
        if self.last_look.elapsed() >= pause {
            self.last_look = Instant::now();
            let _ = self.thread.send(WatcherMessage::Look);
        }
    }

    /// Sets the files and folders in use.
    pub(crate) fn use_only(&mut self, paths: BTreeSet<PathBuf>) {
        let (done, looked) = mpsc::channel();
        self.looked = Some(looked);
        let _ = self.thread.send(WatcherMessage::InUse(paths, self.failure.is_some(), done));
    }

    /// Forgets a changed folder and those in it, which may have been replaced. Returns whether one of them was
    /// watched: then they must be watched again.
    pub(crate) fn forget(&mut self, folder: &Path) -> bool {
        // In this order, the folders in a folder follow it.
        let from = self.watched.range(folder.to_owned()..);
        let gone: Vec<PathBuf> = from.take_while(|watched| watched.starts_with(folder)).cloned().collect();
        for folder in &gone {
            let _ = self.watcher.as_mut().map(|watcher| watcher.unwatch(folder));
            self.watched.remove(folder);
            self.new.remove(folder);
        }
        !gone.is_empty()
    }

    /// Returns whether a folder is watched.
    pub(crate) fn watches(&self, folder: &Path) -> bool {
        self.watched.contains(folder)
    }

    /// Has [`Watcher::watch_more`] watch these folders, without those in them, and no others.
    pub(crate) fn watch_only(&mut self, folders: BTreeSet<PathBuf>) {
        for folder in self.watched.difference(&folders) {
            // The folder may already be removed.
            let _ = self.watcher.as_mut().map(|watcher| watcher.unwatch(folder));
        }
        self.watched.retain(|folder| folders.contains(folder));
        self.new.retain(|folder| folders.contains(folder));
        self.left = folders.into_iter().filter(|folder| !self.watched.contains(folder)).collect();
    }

    /// Whether folders are left for [`Watcher::watch_more`].
    pub(crate) fn has_left(&self) -> bool {
        !self.left.is_empty()
    }

    /// Watches some of the folders that are left. Returns all that are new when none is left, and `None` before.
    ///
    /// The others are watched where one cannot be, see [`Watcher::failure`].
    pub(crate) fn watch_more(&mut self) -> Option<BTreeSet<PathBuf>> {
        for _ in 0..MOST_AT_ONCE {
            let Some(folder) = self.left.pop_first() else { break };
            let why = match &mut self.watcher {
                Err(error) => words(error),
                Ok(_) if self.watched.len() >= MOST_FOLDERS => {
                    format!("there are more than {MOST_FOLDERS} folders")
                }
                Ok(watcher) => match watcher.watch(&folder, RecursiveMode::NonRecursive) {
                    Ok(()) => {
                        self.watched.insert(folder.clone());
                        self.new.insert(folder);
                        continue;
                    }
                    // The folder may be created later, or may be removed.
                    Err(_) if !folder.is_dir() => continue,
                    Err(error) => words(&error),
                },
            };
            self.failed = Some(why.into());
        }
        self.left.is_empty().then(|| {
            self.failure = self.failed.take();
            std::mem::take(&mut self.new)
        })
    }
}

/// Returns in a few words why something is not watched, or what to do.
fn words(error: &notify::Error) -> String {
    match &error.kind {
        ErrorKind::MaxFilesWatch => "raise fs.inotify.max_user_watches".to_owned(),
        ErrorKind::Io(it) if it.raw_os_error() == Some(TAKEN) => {
            "raise fs.inotify.max_user_instances".to_owned()
        }
        _ => error.to_string(),
    }
}

/// Waits for changes, and sends changes in quick succession as one event. Returns false once all senders of changes are gone.
fn tell(seen: &mpsc::Receiver<WatcherMessage>, looks: &mut Looks, events: &mpsc::Sender<LoopEvent>) -> bool {
    let (mut paths, mut missed, mut is_look) = (BTreeSet::new(), false, false);
    let mut next = seen.recv_timeout(looks.pause());
    let begin = Instant::now();
    while let Ok(seen_now) = next {
        match seen_now {
            WatcherMessage::Path(path) => _ = paths.insert(path),
            WatcherMessage::Missed => missed = true,
            WatcherMessage::InUse(paths, is_unwatched, _looked) => looks.use_only(paths, is_unwatched),
            WatcherMessage::Look => is_look = true,
        }
        next =
            if begin.elapsed() < LONGEST { seen.recv_timeout(QUIET) } else { Err(RecvTimeoutError::Timeout) };
    }
    // Before they are read.
    paths.iter().for_each(|path| looks.note(path));
    if is_look || looks.pause().is_zero() {
        paths.extend(looks.changed());
    }
    let is_told = !missed && paths.is_empty() || events.send(LoopEvent::Disk { paths, missed }).is_ok();
    is_told && !matches!(next, Err(RecvTimeoutError::Disconnected))
}
