//! What has changed on the disk is searched on a thread; [`Loader`] notes the changes, and takes what the search finds.

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use mauve_hir::{Database, Problem};

use super::walk::{DiskSearch, Walk};
use super::{Loader, canonical_path};

impl Loader {
    /// Has the next search look through this folder, for a later load.
    pub fn foresee(&mut self, folder: &Path) {
        let folder = canonical_path(folder);
        self.walks.asked.insert(Walk::Models { folder, depth: None, is_own: false });
    }

    /// Begins a search of what has changed.
    pub fn search(&mut self) -> DiskSearch {
        (self.touched, self.noted) = (HashSet::new(), HashSet::new());
        let (walks, unread) = (self.walks.repeated(self.is_load_due), self.unread.clone());
        DiskSearch { walks, folders: self.folders.clone(), unread, ..DiskSearch::default() }
    }

    /// Takes the result of a search. Returns whether the workspaces must be loaded again, and whether another search is due.
    pub fn learn(&mut self, db: &Database, search: DiskSearch) -> (bool, bool) {
        let DiskSearch { folders, found, texts, unread, .. } = search;
        self.folders = folders;
        let mut is_due = std::mem::take(&mut self.is_load_due);
        for (walk, walked) in found {
            is_due |= self.walks.learn(walk, walked);
        }
        self.unread.retain(|path| self.noted.contains(path) || unread.contains(path));
        for (path, (text, problem)) in texts {
            let file = self.read.get(&path).map(|(_, file)| *file);
            let is_known = file.is_some_and(|file| {
                **file.text(db) == *text && *file.problem(db) == problem.clone().map(Problem::Cut)
            });
            if !is_known && !self.edited.contains(&path) && !self.touched.contains(&path) {
                is_due |= file.is_some();
                self.texts.insert(path, (text, problem));
            }
        }
        let (touched, noted) = (std::mem::take(&mut self.touched), std::mem::take(&mut self.noted));
        let again = touched.iter().filter(|path| match noted.contains(*path) {
            true => self.note(path, false),
            false => self.folders.note(path),
        });
        let again = again.count() > 0 || !unread.is_empty();
        (is_due, again)
    }

    /// Notes that `path` was created, removed or changed; a watched folder was, if it `is_replaced`. Returns whether a search
    /// must find out what that changes.
    pub fn note(&mut self, path: &Path, is_replaced: bool) -> bool {
        self.touched.insert(path.to_owned());
        self.noted.insert(path.to_owned());
        self.texts.remove(path);
        let is_read = self.read.contains_key(path);
        if is_read {
            self.unread.insert(path.to_owned());
        }
        let is_load_due = is_replaced || self.watch_set.has(path);
        self.is_load_due |= is_load_due;
        self.folders.note(path) || is_read || is_load_due
    }

    /// Notes that anything may have changed.
    pub fn note_all(&mut self) {
        self.folders.forget(Path::new("/"));
        self.unread.extend(self.read.keys().cloned());
        self.is_load_due = true;
    }

    /// Has the next search read again what may have changed after it was read and before it was watched. `is_watched` returns whether
    /// a folder was watched before, and nothing for one that is not watched now. These folders are `new`.
    pub fn distrust(&mut self, is_watched: impl Fn(&Path) -> Option<bool>, new: &BTreeSet<PathBuf>) {
        self.is_load_due |= new.iter().any(|folder| !self.watch_set.is_only_searched(folder));
        self.folders.distrust(&is_watched);
        let read = self.read.keys().filter(|path| path.parent().and_then(&is_watched) != Some(true));
        let read: Vec<PathBuf> = read.cloned().collect();
        // A search that runs meanwhile does not know of it.
        self.noted.extend(read.iter().cloned());
        self.touched.extend(new.iter().cloned());
        self.unread.extend(read);
    }

    /// Returns how many folders were searched.
    pub fn searched(&self) -> u64 {
        self.folders.count
    }
}
