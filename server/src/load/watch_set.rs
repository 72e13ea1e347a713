//! Where a file that comes, goes or becomes another may change a workspace.

use std::collections::{BTreeSet, VecDeque};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use globset::GlobMatcher;
use mauve_hir::is_model;

/// So many links on one way are followed.
const MOST_LINKS: usize = 16;

/// What was looked through and looked for while workspaces were loaded.
#[derive(Debug, Default)]
pub(crate) struct Surroundings {
    /// Folders that were looked through, behind all links once they are watched: whatever comes or goes in them may matter.
    folders: BTreeSet<PathBuf>,
    /// Paths elsewhere that matter by their names: what was looked for and not found, and folders and links on the way.
    awaited: BTreeSet<PathBuf>,
    /// Folders of messages that were read, behind all links once they are watched.
    messages: BTreeSet<PathBuf>,
    /// What tables are called.
    patterns: Vec<GlobMatcher>,
}

impl Surroundings {
    /// Whatever comes or goes in this folder may matter.
    pub(super) fn look_through(&mut self, folder: PathBuf) {
        self.folders.insert(folder);
    }

    /// Adds what was looked through and looked for another time.
    pub(super) fn extend(&mut self, other: Surroundings) {
        self.folders.extend(other.folders);
        self.awaited.extend(other.awaited);
        self.messages.extend(other.messages);
        self.patterns.extend(other.patterns);
    }

    /// Whatever message comes, goes or changes in this folder matters.
    pub(super) fn read_messages(&mut self, folder: PathBuf) {
        self.messages.insert(folder);
    }

    /// Files of such names matter, whatever their extension.
    pub(super) fn name(&mut self, pattern: GlobMatcher) {
        self.patterns.push(pattern);
    }

    /// Remembers that it matters whether `path` comes, goes, or becomes another, and every link on the way to it. Where its
    /// folder is not there, that is what is waited for.
    pub(super) fn await_path(&mut self, path: &Path) {
        if self.awaited.contains(path) {
            return;
        }
        let mut links = 0;
        // What is behind all links so far, and what is still to go.
        let mut here = PathBuf::new();
        let mut rest: VecDeque<OsString> = path.components().map(|part| part.as_os_str().into()).collect();
        while let Some(part) = rest.pop_front() {
            if part == ".." {
                here.pop();
                continue;
            }
            here.push(part);
            let target = match here.symlink_metadata() {
                Ok(data) if data.is_symlink() => here.read_link().ok(),
                Ok(_) if !rest.is_empty() => continue,
                _ => None,
            };
            self.awaited.insert(here.clone());
            links += 1;
            let Some(target) = target.filter(|_| links <= MOST_LINKS) else { return };
            here.pop();
            for part in target.components().rev() {
                rest.push_front(part.as_os_str().into());
            }
        }
    }

    /// The folders to be watched, behind all links. Whoever does not watch need not know them.
    pub(crate) fn watched(&mut self) -> BTreeSet<PathBuf> {
        // Any folder or link on the way may be another one tomorrow.
        let folders = std::mem::take(&mut self.folders);
        let on_the_way: BTreeSet<&Path> = folders.iter().flat_map(|folder| folder.ancestors()).collect();
        on_the_way.into_iter().for_each(|folder| self.await_path(folder));
        let behind_links = |folders: &BTreeSet<PathBuf>| {
            folders.iter().filter_map(|folder| folder.canonicalize().ok()).collect::<BTreeSet<PathBuf>>()
        };
        self.folders = behind_links(&folders);
        self.messages = behind_links(&self.messages);
        let awaited = self.awaited.iter().filter_map(|path| path.parent()).map(Path::to_owned);
        self.folders.iter().chain(&self.messages).cloned().chain(awaited).collect()
    }

    /// May the workspaces be others, now that something has happened at `path`, in a folder that is watched?
    pub(crate) fn matters(&self, path: &Path) -> bool {
        if self.awaited.contains(path) {
            return true;
        }
        let is_looked_through = path.parent().is_some_and(|folder| self.folders.contains(folder));
        // Tools write much beside models; but what is not there any more may have been anything.
        let is_other_file = std::fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
        let is_ours = is_model(path) || path.extension().is_some_and(|extension| extension == "toml");
        let is_ignoring = path.file_name().is_some_and(|name| name == ".gitignore" || name == ".ignore");
        let is_named = || self.patterns.iter().any(|pattern| pattern.is_match(path));
        let is_message = path.extension().is_some_and(|extension| extension == "msg")
            && path.parent().is_some_and(|folder| self.messages.contains(folder));
        is_message || is_looked_through && (!is_other_file || is_ours || is_ignoring || is_named())
    }
}
