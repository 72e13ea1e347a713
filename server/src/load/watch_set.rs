//! The files and folders whose changes may change a workspace.

use std::collections::{BTreeSet, VecDeque};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use globset::GlobMatcher;
use mauve_hir::is_model;

/// Maximum number of links in a path that are followed.
const MOST_LINKS: usize = 16;

/// What was read and looked up while the workspaces were loaded.
#[derive(Debug, Default)]
pub(crate) struct WatchSet {
    /// Folders whose entries matter, canonical once they are watched.
    pub(super) folders: BTreeSet<PathBuf>,
    /// Folders whose messages matter, canonical once they are watched.
    pub(super) message_folders: BTreeSet<PathBuf>,
    /// The patterns of the timing tables in these folders.
    pub(super) patterns: Vec<GlobMatcher>,
    /// Single paths that matter: what was looked up in other folders, and the links on the way there.
    paths: BTreeSet<PathBuf>,
}

impl WatchSet {
    /// Adds the paths of another set.
    pub(super) fn extend(&mut self, other: WatchSet) {
        self.folders.extend(other.folders);
        self.message_folders.extend(other.message_folders);
        self.patterns.extend(other.patterns);
        self.paths.extend(other.paths);
    }

    /// Adds `path` and every link on the way to it; its first missing folder if there is one.
    pub(super) fn add(&mut self, path: &Path) {
        if self.paths.contains(path) {
            return;
        }
        let mut links = 0;
        // The canonical path so far, and the components that remain.
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
            self.paths.insert(here.clone());
            links += 1;
            let Some(target) = target.filter(|_| links <= MOST_LINKS) else { return };
            here.pop();
            for part in target.components().rev() {
                rest.push_front(part.as_os_str().into());
            }
        }
    }

    /// Returns the folders to watch, canonical.
    pub(crate) fn folders_to_watch(&mut self) -> BTreeSet<PathBuf> {
        // Each folder and link on the way may be replaced.
        let folders = std::mem::take(&mut self.folders);
        let on_the_way: BTreeSet<&Path> = folders.iter().flat_map(|folder| folder.ancestors()).collect();
        on_the_way.into_iter().for_each(|folder| self.add(folder));
        let canonical = |folders: &BTreeSet<PathBuf>| {
            folders.iter().filter_map(|folder| folder.canonicalize().ok()).collect::<BTreeSet<PathBuf>>()
        };
        self.folders = canonical(&folders);
        self.message_folders = canonical(&self.message_folders);
        let parents = self.paths.iter().filter_map(|path| path.parent()).map(Path::to_owned);
        self.folders.iter().chain(&self.message_folders).cloned().chain(parents).collect()
    }

    /// Returns whether a change of `path`, which is in a watched folder, may change a workspace.
    pub(crate) fn has(&self, path: &Path) -> bool {
        if self.paths.contains(path) {
            return true;
        }
        let is_in = |folders: &BTreeSet<PathBuf>| path.parent().is_some_and(|it| folders.contains(it));
        let has_extension = |extension: &str| path.extension().is_some_and(|it| it == extension);
        if has_extension("msg") && is_in(&self.message_folders) {
            return true;
        }
        // Tools write many other files beside models. A path that is no file may have been a model, or a folder of models.
        let is_file = std::fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
        let is_ignoring = path.file_name().is_some_and(|name| name == ".gitignore" || name == ".ignore");
        let is_table = || self.patterns.iter().any(|pattern| pattern.is_match(path));
        is_in(&self.folders)
            && (!is_file || is_model(path) || has_extension("toml") || is_ignoring || is_table())
    }
}
