//! Watches files for changes outside the client. Not every client reports them, and no client reports files outside
//! its folders.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};

use super::event::Event;

/// How long to wait for further events, and the maximum in total: programs often write a file in several steps.
const QUIET: Duration = Duration::from_millis(10);
const LONGEST: Duration = Duration::from_millis(100);

/// The maximum number of watched folders: the system has a limit for all programs together.
const MOST_FOLDERS: usize = 10_000;

/// The maximum number of folders that the main loop watches between two events: the thread of the system's events answers for each.
const MOST_AT_ONCE: usize = 100;

/// Watches the folders of the workspaces.
pub(crate) struct Watcher {
    /// An error if the system provides no watcher.
    watcher: Result<RecommendedWatcher, notify::Error>,
    watched: BTreeSet<PathBuf>,
    /// Those to be watched next.
    left: BTreeSet<PathBuf>,
    /// The watched ones that [`Watcher::watch_more`] has not returned yet.
    new: BTreeSet<PathBuf>,
}

impl Watcher {
    /// Creates a watcher without folders that sends changes to `events`.
    pub(crate) fn new(events: mpsc::Sender<Event>) -> Watcher {
        // `None` if events were missed.
        let (sender, seen) = mpsc::channel::<Option<PathBuf>>();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let say = |path| drop(sender.send(path));
            match event {
                Ok(event) if event.need_rescan() => say(None),
                Ok(event) => {
                    let is_read = matches!(event.kind, EventKind::Access(kind)
                        if kind != AccessKind::Close(AccessMode::Write));
                    if !is_read {
                        event.paths.into_iter().map(Some).for_each(say);
                    }
                }
                Err(_) => say(None),
            }
        });
        std::thread::spawn(move || {
            while let Ok(first) = seen.recv() {
                let begin = Instant::now();
                let mut paths = BTreeSet::from([first]);
                while begin.elapsed() < LONGEST
                    && let Ok(next) = seen.recv_timeout(QUIET)
                {
                    paths.insert(next);
                }
                let missed = paths.remove(&None);
                let event = Event::Disk { paths: paths.into_iter().flatten().collect(), missed };
                if events.send(event).is_err() {
                    return;
                }
            }
        });
        let (watched, left, new) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        Watcher { watcher, watched, left, new }
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
    /// # Errors
    ///
    /// Of those that cannot be watched, why the last cannot; the others are watched.
    pub(crate) fn watch_more(&mut self) -> (Option<BTreeSet<PathBuf>>, Result<(), String>) {
        let mut failed = Ok(());
        let watcher = match &mut self.watcher {
            Ok(watcher) => watcher,
            Err(error) => {
                self.left.clear();
                return (Some(BTreeSet::new()), Err(error.to_string()));
            }
        };
        for _ in 0..MOST_AT_ONCE {
            let Some(folder) = self.left.pop_first() else { break };
            if self.watched.len() >= MOST_FOLDERS {
                failed = Err(format!("there are more than {MOST_FOLDERS} folders"));
                self.left.clear();
                break;
            }
            match watcher.watch(&folder, RecursiveMode::NonRecursive) {
                Ok(()) => {
                    self.watched.insert(folder.clone());
                    self.new.insert(folder);
                }
                // The folder may be created later, or may be removed.
                Err(_) if !folder.is_dir() => {}
                Err(error) => failed = Err(format!("{}: {error}", folder.display())),
            }
        }
        (self.left.is_empty().then(|| std::mem::take(&mut self.new)), failed)
    }
}
