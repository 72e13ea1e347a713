//! Walks through folders on the disk, whose size is unknown: bounded, cancellable, and without the database, so that
//! a server can walk on a separate thread while edits are handled.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use globset::GlobMatcher;
use ignore::gitignore::Gitignore;
use mauve_hir::{CONFIG_FILE, is_model};
use mauve_wcrt::table_pattern;

use super::folders::{KnownFolders, Rules, device_of, entries};
use super::packages::Places;
use crate::disk::{LONGEST, ProjectBoundary, is_hidden, text_of};

/// The maximum size of all files of the workspaces together, in bytes; further files are not read.
pub const LONGEST_TOGETHER: u64 = 2 * LONGEST;

/// The maximum numbers of files and folders that are searched for models, and for all tables.
const MOST_FOR_MODELS: usize = 200_000;
const MOST_FOR_TABLES: usize = 20_000;

/// The maximal depth of folders of models.
const DEEPEST: usize = 100;

/// The remaining numbers of files and folders that may be searched, and of bytes that may be read ahead.
#[derive(Debug)]
pub(crate) struct Left {
    /// For walks through whole folders.
    all: usize,
    /// For walks that exclude the files of nested configurations.
    own: usize,
    tables: usize,
    bytes: u64,
}

impl Default for Left {
    fn default() -> Left {
        Left { all: MOST_FOR_MODELS, own: MOST_FOR_MODELS, tables: MOST_FOR_TABLES, bytes: LONGEST_TOGETHER }
    }
}

/// A search on the disk.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Walk {
    /// The models and configurations below a folder, except generated files and those that `.gitignore` names.
    Models {
        folder: PathBuf,
        depth: Option<usize>,
        /// Whether the files of a nested configuration are excluded.
        is_own: bool,
    },
    /// The files that match a pattern of `[timing] tables`.
    Tables {
        /// The folder before the first wildcard of the pattern.
        from: PathBuf,
        depth: Option<usize>,
        /// The configuration's folder, and the pattern.
        folder: PathBuf,
        pattern: String,
        boundary: ProjectBoundary,
    },
}

/// The result of a walk.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Walked {
    /// All searched folders.
    pub(super) folders: Vec<PathBuf>,
    /// The models or tables, including unreadable ones.
    pub(super) files: Vec<PathBuf>,
    /// The configurations, including that of the first folder.
    pub(super) configs: Vec<PathBuf>,
    /// The folders that were not searched, and why.
    pub(super) problems: Vec<(PathBuf, String)>,
}

/// The text of a file, and the reason if it is incomplete.
pub(super) type ReadText = (String, Option<String>);

/// What a thread is to search, and then what it has found.
#[derive(Debug, Default)]
pub struct DiskSearch {
    pub(super) walks: Vec<Walk>,
    /// What is known of the folders.
    pub(super) folders: KnownFolders,
    /// The files that are to be read again.
    pub(super) unread: BTreeSet<PathBuf>,
    pub(super) found: Vec<(Walk, Walked)>,
    /// The texts of the files that are new, and of those to be read again.
    pub(super) texts: Vec<(PathBuf, ReadText)>,
}

impl DiskSearch {
    /// Whether it looks through a whole folder of the client.
    #[cfg(debug_assertions)]
    pub fn is_whole(&self) -> bool {
        self.walks.iter().any(|walk| matches!(walk, Walk::Models { is_own: false, .. }))
    }

    /// Searches until `is_cancelled`, and reads the files that a server will need; says to `report` how many.
    pub fn run(&mut self, is_cancelled: &dyn Fn() -> bool, report: &dyn Fn(usize)) {
        let mut left = Left::default();
        for walk in std::mem::take(&mut self.walks) {
            let walked = walk.run(&mut self.folders, &mut left, is_cancelled);
            self.found.push((walk, walked));
        }
        Places::of_environment().search();
        self.unread.append(&mut self.folders.new);
        report(self.unread.len());
        while let Some(path) = self.unread.pop_first() {
            if is_cancelled() {
                return;
            }
            let text = text_of(&path);
            let Some(bytes) = left.bytes.checked_sub(text.0.len() as u64) else {
                self.unread.insert(path);
                return;
            };
            left.bytes = bytes;
            self.texts.push((path, text));
        }
    }
}

/// The results of walks.
#[derive(Debug, Default)]
pub(super) struct Walks {
    pub(super) known: BTreeMap<Walk, Walked>,
    /// The walks that the last load requested.
    pub(super) asked: BTreeSet<Walk>,
}

impl Walks {
    /// Requests a walk, and returns its result if it is known.
    pub(super) fn walked(&mut self, walk: &Walk) -> Option<&Walked> {
        self.asked.insert(walk.clone());
        self.known.get(walk)
    }

    /// Returns whether a requested walk has no result.
    pub(super) fn is_one_wanted(&self) -> bool {
        self.asked.iter().any(|walk| !self.known.contains_key(walk))
    }

    /// Takes the result of a walk. Returns whether it differs from the result before.
    pub(super) fn learn(&mut self, walk: Walk, walked: Walked) -> bool {
        self.known.get(&walk) != Some(&walked) && {
            self.known.insert(walk, walked);
            true
        }
    }

    /// Returns the requested walks whose results may have changed, those for tables only if these `may_have`; the nearest projects
    /// first: what is around them may have so many files that none would be left for them.
    pub(super) fn repeated(&mut self, may_tables_have: bool) -> Vec<Walk> {
        self.known.retain(|walk, _| self.asked.contains(walk));
        let is_known = |walk: &&Walk| matches!(walk, Walk::Tables { .. }) && self.known.contains_key(*walk);
        let all = self.asked.iter().filter(|walk| may_tables_have || !is_known(walk));
        let mut all: Vec<Walk> = all.cloned().collect();
        all.sort_by_key(|walk| Reverse(walk.first().components().count()));
        // A first walk through a whole folder may take long: it has a search of its own, behind those of projects.
        let is_first = |walk: &Walk| {
            matches!(walk, Walk::Models { is_own: false, .. }) && !self.known.contains_key(walk)
        };
        if all.iter().any(|walk| !is_first(walk) && !self.known.contains_key(walk)) {
            all.retain(|walk| !is_first(walk));
        }
        all
    }
}

impl Walk {
    /// Returns the folder where it begins.
    fn first(&self) -> &Path {
        match self {
            Walk::Models { folder, .. } => folder,
            Walk::Tables { from, .. } => from,
        }
    }

    /// Searches the disk until `is_cancelled`; a cancelled walk is incomplete. Subtracts from `left`, the limits of a
    /// caller that runs several walks.
    pub(super) fn run(
        &self,
        folders: &mut KnownFolders,
        left: &mut Left,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Walked {
        match self {
            Walk::Models { folder, depth, is_own } => {
                let (found, (everywhere, _)) = (Walked::default(), Gitignore::global());
                let left = if *is_own { &mut left.own } else { &mut left.all };
                let (elsewhere, is_cut) = (Vec::new(), false);
                let models = ModelWalk { found, folders, left, is_cancelled, everywhere, elsewhere, is_cut };
                models.walk(folder, *depth, *is_own, device_of(folder))
            }
            Walk::Tables { from, depth, folder, pattern, boundary } => {
                let Ok(glob) = table_pattern(folder, pattern) else { return Walked::default() };
                let (found, around) = (Walked::default(), Vec::new());
                let mut tables = TableWalk { found, left, is_cancelled, glob, boundary, around };
                if from.exists() {
                    tables.entry(from.clone(), depth.unwrap_or(usize::MAX));
                }
                tables.found
            }
        }
    }
}

struct ModelWalk<'a> {
    found: Walked,
    folders: &'a mut KnownFolders,
    /// The remaining number of files and folders.
    left: &'a mut usize,
    is_cancelled: &'a dyn Fn() -> bool,
    /// The user's global Git ignore rules.
    everywhere: Gitignore,
    /// The folders on other file systems.
    elsewhere: Vec<PathBuf>,
    /// Whether there were too many files and folders.
    is_cut: bool,
}

/// A folder that is to be searched.
struct PendingFolder {
    path: PathBuf,
    /// The number of levels below, and of those above up to the first folder.
    deeper: usize,
    depth: usize,
    above: Option<Arc<Rules>>,
}

impl ModelWalk<'_> {
    fn walk(mut self, folder: &Path, depth: Option<usize>, is_own: bool, device: Option<u64>) -> Walked {
        let mut around: Vec<&Path> = folder.ancestors().skip(1).collect();
        around.reverse();
        let mut above = None;
        for folder in around {
            above = Some(self.folders.rules_of(folder, above));
        }
        let first =
            PendingFolder { path: folder.to_owned(), deeper: depth.unwrap_or(DEEPEST), depth: 0, above };
        // The folders that are near are searched first: there may be too many.
        let mut open = VecDeque::from([first]);
        while let Some(next) = open.pop_front() {
            if (self.is_cancelled)() {
                break;
            }
            self.folder(next, (depth.is_none(), is_own), device, &mut open);
        }
        let mut left_out = Vec::new();
        if self.is_cut {
            left_out.push(format!(
                "there are more than {MOST_FOR_MODELS} files and folders: open a smaller folder"
            ));
        }
        if let [first, rest @ ..] = self.elsewhere.as_slice() {
            let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
            left_out.push(format!(
                "folders on other file systems are not searched, `{}`{more}: open them as well",
                first.display()
            ));
        }
        if !left_out.is_empty() {
            self.found.problems.push((folder.to_owned(), left_out.join("; ")));
        }
        self.found
    }

    /// Searches a folder, and opens those in it; an unlimited walk reports where it stops early, and one `is_own` excludes the
    /// files of a nested configuration.
    fn folder(
        &mut self,
        next: PendingFolder,
        (is_all, is_own): (bool, bool),
        device: Option<u64>,
        open: &mut VecDeque<PendingFolder>,
    ) {
        let PendingFolder { path, deeper, depth, above } = next;
        // The walk reports this at its end.
        if *self.left == 0 {
            self.is_cut = true;
            return;
        }
        let folder = match self.folders.get(&path, above, &self.everywhere) {
            Ok(folder) => folder,
            Err(why) => return self.found.problems.push((path, why)),
        };
        if is_own && depth > 0 && folder.has_config {
            self.found.configs.push(path.join(CONFIG_FILE));
            return;
        }
        *self.left = self.left.saturating_sub(folder.entries);
        self.found.configs.extend(folder.is_config_found.then(|| path.join(CONFIG_FILE)));
        self.found.folders.push(path);
        self.found.files.extend(folder.regular.iter().filter(|file| is_model(file)).cloned());
        // Includes unreadable files, pipes and broken links, which are reported.
        self.found.files.extend(folder.special.iter().filter(|path| !path.is_dir()).cloned());
        for (path, on) in &folder.folders {
            match deeper.checked_sub(1) {
                _ if is_all && *on != device => self.elsewhere.push(path.clone()),
                Some(deeper) if deeper > 0 => {
                    let (path, above) = (path.clone(), Some(Arc::clone(&folder.rules)));
                    open.push_back(PendingFolder { path, deeper, depth: depth + 1, above });
                }
                _ if is_all => {
                    let why = format!("this folder is more than {DEEPEST} folders deep, and is not searched");
                    self.found.problems.push((path.clone(), why));
                }
                _ => {}
            }
        }
    }
}

/// The search for the files of a pattern. Tables that the configuration names are read even if `.gitignore` ignores them or a
/// link leads to them.
struct TableWalk<'a> {
    found: Walked,
    left: &'a mut Left,
    is_cancelled: &'a dyn Fn() -> bool,
    glob: GlobMatcher,
    boundary: &'a ProjectBoundary,
    /// The folders around the present one, with links resolved.
    around: Vec<PathBuf>,
}

impl TableWalk<'_> {
    /// Looks at a file or a folder, and at `deeper` levels below. Returns whether the search goes on.
    fn entry(&mut self, path: PathBuf, deeper: usize) -> bool {
        if (self.is_cancelled)() {
            return false;
        }
        let Some(left) = self.left.tables.checked_sub(1) else {
            let why = format!(
                "patterns search at most {MOST_FOR_TABLES} files and folders, and there are more: name \
                 smaller folders"
            );
            let first = self.found.folders.first().cloned().unwrap_or(path);
            self.found.problems.push((first, why));
            return false;
        };
        self.left.tables = left;
        if path.is_dir() {
            return self.folder(path, deeper);
        }
        // A broken link is a table that cannot be read.
        self.found.files.extend(Some(path).filter(|path| self.glob.is_match(path)));
        true
    }

    fn folder(&mut self, path: PathBuf, deeper: usize) -> bool {
        let real = path.canonicalize().unwrap_or_else(|_| path.clone());
        let is_around = self.around.contains(&real);
        let refusal = is_around.then(|| "this link leads to a folder around it".to_owned());
        if let Some(why) = refusal.or_else(|| self.boundary.refusal(&real)) {
            self.found.problems.push((path, why));
            return true;
        }
        self.found.folders.push(path.clone());
        let Some(deeper) = deeper.checked_sub(1) else { return true };
        let entries = match entries(&path) {
            Ok(entries) => entries,
            Err(why) => {
                self.found.problems.push((path, why));
                return true;
            }
        };
        self.around.push(real);
        // As in a shell, a star does not match hidden names.
        let mut shown = entries.iter().filter(|entry| !is_hidden(Path::new(&entry.file_name())));
        let goes_on = shown.all(|entry| self.entry(entry.path(), deeper));
        self.around.pop();
        goes_on
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str, folders: &[&str]) -> PathBuf {
        let top = mauve_tests::own_scratch(&format!("walk-{name}"));
        for folder in folders {
            std::fs::create_dir_all(top.join(folder)).unwrap();
            std::fs::write(top.join(folder).join("a.mal"), "codel f(): int\n").unwrap();
        }
        top
    }

    fn walked(folder: &Path, mut left: usize, device: Option<u64>) -> Walked {
        let (found, folders, everywhere) =
            (Walked::default(), &mut KnownFolders::default(), Gitignore::empty());
        let (left, is_cancelled, elsewhere, is_cut) = (&mut left, &|| false, Vec::new(), false);
        let models = ModelWalk { found, folders, left, is_cancelled, everywhere, elsewhere, is_cut };
        models.walk(folder, None, false, device)
    }

    #[test]
    fn a_walk_stays_on_its_file_system_and_says_so_once() {
        let top = scratch("device", &["", "one", "two", "two/three"]);
        let all = walked(&top, MOST_FOR_MODELS, device_of(&top));
        assert_eq!((all.files.len(), all.problems.len()), (4, 0));
        let some = walked(&top, MOST_FOR_MODELS, Some(u64::MAX));
        assert_eq!(some.files, [top.join("a.mal")]);
        let one = top.join("one");
        let why = format!(
            "folders on other file systems are not searched, `{}` and 1 more: open them as well",
            one.display()
        );
        assert_eq!(some.problems, [(top.clone(), why)]);
        std::fs::remove_dir_all(top).unwrap();
    }

    #[test]
    fn a_walk_that_ends_early_says_so_once() {
        let top = scratch("bound", &["", "one", "one/two", "one/two/three"]);
        let some = walked(&top, 6, device_of(&top));
        let why = "there are more than 200000 files and folders: open a smaller folder".to_owned();
        assert_eq!((some.files.len(), some.problems), (3, vec![(top.clone(), why)]));
        std::fs::remove_dir_all(top).unwrap();
    }
}
