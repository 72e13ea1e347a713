//! Sees files change outside the client. Not every client tells, and none tells of a table or a model outside its
//! folders: the server looks for itself.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};

use super::main_loop::Event;

/// Whoever writes a file often does it in several steps: so long is waited for the next.
const QUIET: Duration = Duration::from_millis(10);

/// Watches the folders of the workspaces.
pub(crate) struct Watcher {
    /// None where the system gives none.
    watcher: Result<RecommendedWatcher, notify::Error>,
    watched: BTreeSet<PathBuf>,
}

impl Watcher {
    /// Watches nothing yet; what it will see goes to `events`.
    pub(crate) fn new(events: mpsc::Sender<Event>) -> Watcher {
        let (sender, seen) = mpsc::channel::<PathBuf>();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let Ok(event) = event else { return };
            let is_read = matches!(event.kind, EventKind::Access(kind)
                if kind != AccessKind::Close(AccessMode::Write));
            if !is_read {
                event.paths.into_iter().for_each(|path| drop(sender.send(path)));
            }
        });
        std::thread::spawn(move || {
            while let Ok(first) = seen.recv() {
                let mut paths = BTreeSet::from([first]);
                while let Ok(next) = seen.recv_timeout(QUIET) {
                    paths.insert(next);
                }
                if events.send(Event::Disk(paths)).is_err() {
                    return;
                }
            }
        });
        Watcher { watcher, watched: BTreeSet::new() }
    }

    /// A folder has come or gone: if it is there, it is another one than was watched.
    pub(crate) fn forget(&mut self, folder: &Path) {
        self.watched.remove(folder);
    }

    /// Watches these folders, each by itself, and no others.
    ///
    /// # Errors
    ///
    /// Why one of them cannot be watched; the others are.
    pub(crate) fn watch(&mut self, folders: &BTreeSet<PathBuf>) -> Result<(), String> {
        let watcher = self.watcher.as_mut().map_err(|error| error.to_string())?;
        let mut failed = None;
        for folder in self.watched.difference(folders) {
            // It may be gone already.
            let _ = watcher.unwatch(folder);
        }
        self.watched.retain(|folder| folders.contains(folder));
        for folder in folders {
            if self.watched.contains(folder) {
                continue;
            }
            match watcher.watch(folder, RecursiveMode::NonRecursive) {
                Ok(()) => {
                    self.watched.insert(folder.clone());
                }
                // It may come, or have gone.
                Err(_) if !folder.is_dir() => {}
                Err(error) => failed = Some(format!("{}: {error}", folder.display())),
            }
        }
        failed.map_or(Ok(()), Err)
    }
}
