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
pub struct WatchSet {
    /// Folders whose entries matter, canonical once they are watched.
    pub(super) folders: BTreeSet<PathBuf>,
    /// The folders where the search for models begins, and all that it has found, canonical. What changes in them is for
    /// [`super::folders::KnownFolders::note`] to judge.
    pub(super) roots: BTreeSet<PathBuf>,
    pub(super) below: BTreeSet<PathBuf>,
    /// The outermost folders that belong to the projects: of their own ancestors, none is watched.
    pub(super) tops: BTreeSet<PathBuf>,
    /// Folders whose messages matter, canonical once they are watched.
    pub(super) message_folders: BTreeSet<PathBuf>,
    /// The patterns of the timing tables in these folders.
    pub(super) patterns: Vec<GlobMatcher>,
    /// Single paths that matter: what was looked up in other folders, and the links on the way there.
    pub(super) paths: BTreeSet<PathBuf>,
    /// Those of them that are links.
    links: BTreeSet<PathBuf>,
}

impl WatchSet {
    /// Adds the paths of another set.
    pub(super) fn extend(&mut self, other: WatchSet) {
        self.folders.extend(other.folders);
        self.roots.extend(other.roots);
        self.below.extend(other.below);
        self.tops.extend(other.tops);
        self.message_folders.extend(other.message_folders);
        self.patterns.extend(other.patterns);
        self.paths.extend(other.paths);
        self.links.extend(other.links);
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
            self.links.insert(here.clone());
            here.pop();
            for part in target.components().rev() {
                rest.push_front(part.as_os_str().into());
            }
        }
    }

    /// Returns the folders to watch, canonical.
    ///
    /// Each folder and link on the way to them may be replaced, which the folder around it tells. Folders outside the projects
    /// are watched only where a link is in them or something was looked up: every program writes in `/tmp`.
    pub fn folders_to_watch(&mut self) -> BTreeSet<PathBuf> {
        let folders = std::mem::take(&mut self.folders);
        let (tops, roots) = (std::mem::take(&mut self.tops), std::mem::take(&mut self.roots));
        let is_within = |path: &Path| tops.iter().any(|top| path.starts_with(top));
        let is_near = |folder: &&Path| folder.parent().is_some_and(is_within);
        let on_the_way: BTreeSet<&Path> = folders
            .iter()
            .chain(&roots)
            .flat_map(|folder| std::iter::once(folder.as_path()).chain(folder.ancestors().filter(is_near)))
            .collect();
        on_the_way.into_iter().for_each(|folder| self.add(folder));
        let canonical = |folders: &BTreeSet<PathBuf>| {
            folders.iter().filter_map(|folder| folder.canonicalize().ok()).collect::<BTreeSet<PathBuf>>()
        };
        self.folders = canonical(&folders);
        self.message_folders = canonical(&self.message_folders);
        let elsewhere = self.folders.iter().filter(|folder| !is_within(folder));
        let around: BTreeSet<&Path> = elsewhere.filter_map(|folder| folder.parent()).collect();
        let outermost = around.iter().copied().chain(tops.iter().map(PathBuf::as_path));
        let far: BTreeSet<&Path> = outermost.flat_map(|folder| folder.ancestors().skip(1)).collect();
        let is_far = |folder: &Path| far.contains(folder) && !around.contains(folder) && !is_within(folder);
        let parents = self.paths.iter().filter_map(|path| Some((path, path.parent()?)));
        let parents = parents.filter(|(path, parent)| self.links.contains(*path) || !is_far(parent));
        let parents = parents.map(|(_, parent)| parent.to_owned());
        let folders = self.folders.iter().chain(&self.below).chain(&self.message_folders);
        let folders = folders.cloned().chain(parents).collect();
        (self.tops, self.roots) = (tops, roots);
        folders
    }

    /// Returns whether a watched folder matters for its models and configurations only.
    pub(super) fn is_only_searched(&self, folder: &Path) -> bool {
        self.below.contains(folder)
            && !self.folders.contains(folder)
            && !self.message_folders.contains(folder)
    }

    /// Returns whether a change of `path`, which is in a watched folder, may change a workspace, apart from the models and
    /// configurations that it has.
    pub fn has(&self, path: &Path) -> bool {
        let is_in = |folders: &BTreeSet<PathBuf>| path.parent().is_some_and(|it| folders.contains(it));
        if self.paths.contains(path) || is_in(&self.below) && path.ends_with(".git") {
            return true;
        }
        let has_extension = |extension: &str| path.extension().is_some_and(|it| it == extension);
        if has_extension("msg") && is_in(&self.message_folders) {
            return true;
        }
        // Tools write many other files beside models. A path that is no file may have been a model, or a folder of models.
        let is_file = std::fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
        let is_table = || self.patterns.iter().any(|pattern| pattern.is_match(path));
        is_in(&self.folders) && (!is_file || is_model(path) || has_extension("toml") || is_table())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folders_around_a_project_are_watched_and_those_around_them_are_not() {
        let top = mauve_tests::own_scratch("watch-set").canonicalize().unwrap();
        for folder in ["far/home/robot/sub", "far/other/models", "far/target"] {
            std::fs::create_dir_all(top.join(folder)).unwrap();
        }
        std::os::unix::fs::symlink(top.join("far/target"), top.join("link")).unwrap();
        let robot = top.join("far/home/robot");
        let mut set = WatchSet::default();
        set.tops.insert(top.join("far/home"));
        set.folders.extend([top.join("far/other/models"), top.join("link")]);
        set.roots.insert(robot.clone());
        set.below.extend([robot.clone(), robot.join("sub")]);
        robot.ancestors().for_each(|above| set.add(&above.join("mauve.toml")));
        let watched = set.folders_to_watch();
        for (folder, is_watched) in [
            ("far/home/robot/sub", true),
            ("far/home/robot", true),
            ("far/home", true),
            ("far/other/models", true),
            ("far/other", true),
            ("far/target", true),
            // It is around a folder.
            ("far", true),
            // A link is in it.
            ("", true),
        ] {
            assert_eq!(watched.contains(&top.join(folder)), is_watched, "{folder}");
        }
        assert!(top.ancestors().skip(1).all(|above| !watched.contains(above)), "{watched:?}");
        for (path, is_judged) in [
            ("far/home/robot", true),
            ("far/home/robot/mauve.toml", true),
            ("far/home/robot/sub/.git", true),
            ("far/other/models/new.mal", true),
            // The search judges these.
            ("far/home/robot/sub", false),
            ("far/home/robot/sub/new.mal", false),
        ] {
            assert_eq!(set.has(&top.join(path)), is_judged, "{path}");
        }
        std::fs::remove_dir_all(top).unwrap();
    }
}
