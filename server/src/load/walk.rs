//! Walks through folders on the disk, whose size is unknown: bounded, cancellable, and without the database, so that
//! a server can walk on a separate thread while edits are handled.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::DirEntry;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use globset::GlobMatcher;
use ignore::Match;
use ignore::gitignore::{Gitignore, GitignoreBuilder};
use mauve_hir::{CONFIG_FILE, is_model};
use mauve_wcrt::table_pattern;

use super::packages::Places;
use crate::disk::{Boundary, LONGEST, is_hidden, is_made_up, read, text_of};

/// The maximum size of all files of the workspaces together, in bytes; further files are not read.
pub(super) const LONGEST_TOGETHER: u64 = 2 * LONGEST;

const MADE_BY_TOOLS: [&str; 4] = ["build", "devel", "install", "log"];

/// The maximum numbers of files and folders that are searched for models, and for all tables.
const MOST_FOR_MODELS: usize = 200_000;
const MOST_FOR_TABLES: usize = 20_000;

/// The maximal depth of folders of models.
const DEEPEST: usize = 100;

/// The maximal length of a `.gitignore`, and of all of them together: a pattern takes much more memory than its text.
const LONGEST_IGNORE: u64 = 1 << 16;
const MOST_IGNORED: u64 = 1 << 20;

/// The remaining numbers of files and folders that may be searched, and of bytes that may be read ahead.
#[derive(Debug)]
pub(crate) struct Left {
    models: usize,
    tables: usize,
    ignored: u64,
    bytes: u64,
}

impl Default for Left {
    fn default() -> Left {
        Left {
            models: MOST_FOR_MODELS,
            tables: MOST_FOR_TABLES,
            ignored: MOST_IGNORED,
            bytes: LONGEST_TOGETHER,
        }
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
        boundary: Boundary,
    },
}

/// The result of a walk.
#[derive(Debug, Clone, Default)]
pub(crate) struct Walked {
    /// All searched folders.
    pub(super) folders: Vec<PathBuf>,
    /// The models or tables, including unreadable ones.
    pub(super) files: Vec<PathBuf>,
    /// The configurations, including that of the first folder.
    pub(super) configs: Vec<PathBuf>,
    /// The folders that were not searched, and why.
    pub(super) problems: Vec<(PathBuf, String)>,
    /// The regular files among the models and configurations, canonical.
    pub(super) regular: Vec<PathBuf>,
    /// The texts of these files, where they were read ahead.
    pub(super) texts: Vec<(PathBuf, Text)>,
}

/// The text of a file, and the reason if it is incomplete.
pub(super) type Text = (String, Option<String>);

impl Walked {
    /// Returns the number of files that [`Walked::read_ahead`] reads.
    pub(crate) fn to_read(&self) -> usize {
        self.regular.len()
    }

    /// Reads the models and configurations that a server will need, as long as `left` allows it.
    pub(crate) fn read_ahead(&mut self, left: &mut Left, is_cancelled: &dyn Fn() -> bool) {
        Places::of_environment().search();
        for path in std::mem::take(&mut self.regular) {
            if is_cancelled() {
                return;
            }
            let text = text_of(&path);
            let Some(bytes) = left.bytes.checked_sub(text.0.len() as u64) else { return };
            left.bytes = bytes;
            self.texts.push((path, text));
        }
    }
}

/// The results of walks.
#[derive(Debug, Default)]
pub(super) struct Walks {
    known: BTreeMap<Walk, Walked>,
    /// The requested walks since the last reset.
    asked: BTreeSet<Walk>,
}

impl Walks {
    /// Requests a walk, and returns its result if it is known.
    pub(super) fn walked(&mut self, walk: &Walk) -> Option<&Walked> {
        self.asked.insert(walk.clone());
        self.known(walk)
    }

    /// Returns the requested walks without a result.
    pub(super) fn wanted(&self) -> Vec<Walk> {
        self.asked.iter().filter(|walk| !self.known.contains_key(*walk)).cloned().collect()
    }

    pub(super) fn learn(&mut self, walk: Walk, walked: Walked) {
        self.known.insert(walk, walked);
    }

    /// Discards all results, and returns the requested walks.
    pub(super) fn reset(&mut self) -> Vec<Walk> {
        self.known.clear();
        std::mem::take(&mut self.asked).into_iter().collect()
    }

    /// Returns the result of a walk, if it is known.
    pub(super) fn known(&self, walk: &Walk) -> Option<&Walked> {
        self.known.get(walk)
    }
}

impl Walk {
    /// Searches the disk until `is_cancelled`; a cancelled walk is incomplete. Subtracts from `left`, the limits of a
    /// caller that runs several walks.
    pub(crate) fn run(&self, left: &mut Left, is_cancelled: &dyn Fn() -> bool) -> Walked {
        match self {
            Walk::Models { folder, depth, is_own } => {
                let (found, (everywhere, _)) = (Walked::default(), Gitignore::global());
                let (is_own, device) = (*is_own, device_of(folder));
                let (elsewhere, is_cut) = (Vec::new(), false);
                let models =
                    Models { found, left, is_cancelled, everywhere, is_own, device, elsewhere, is_cut };
                models.walk(folder, *depth)
            }
            Walk::Tables { from, depth, folder, pattern, boundary } => {
                let Ok(glob) = table_pattern(folder, pattern) else { return Walked::default() };
                let (found, around) = (Walked::default(), Vec::new());
                let mut tables = Tables { found, left, is_cancelled, glob, boundary, around };
                if from.exists() {
                    tables.entry(from.clone(), depth.unwrap_or(usize::MAX));
                }
                tables.found
            }
        }
    }
}

/// The files with ignore rules; the first one has precedence.
const IGNORING: [&str; 2] = [".ignore", ".gitignore"];

/// The ignore rules of a folder and of those above, in the order of [`IGNORING`].
struct Rules {
    own: [Gitignore; 2],
    /// Whether a repository begins here: the Git rules of folders above do not apply in it.
    is_repository: bool,
    above: Option<Rc<Rules>>,
}

impl Rules {
    fn ignores(&self, path: &Path, is_folder: bool) -> bool {
        for kind in 0..IGNORING.len() {
            let mut rules = Some(self);
            while let Some(here) = rules {
                match here.own.get(kind).map(|own| own.matched(path, is_folder)) {
                    Some(Match::Ignore(_)) => return true,
                    Some(Match::Whitelist(_)) => return false,
                    _ => {}
                }
                let ends = here.is_repository && IGNORING.get(kind) == Some(&".gitignore");
                rules = here.above.as_deref().filter(|_| !ends);
            }
        }
        false
    }
}

struct Models<'a> {
    found: Walked,
    left: &'a mut Left,
    is_cancelled: &'a dyn Fn() -> bool,
    /// The user's global Git ignore rules.
    everywhere: Gitignore,
    /// Whether the files of a nested configuration are excluded.
    is_own: bool,
    /// The file system of the first folder, and the folders on others.
    device: Option<u64>,
    elsewhere: Vec<PathBuf>,
    /// Whether there were too many files and folders.
    is_cut: bool,
}

impl Models<'_> {
    fn walk(mut self, folder: &Path, depth: Option<usize>) -> Walked {
        let mut above: Vec<&Path> = folder.ancestors().skip(1).collect();
        above.reverse();
        let mut rules = None;
        for folder in above {
            // If the rules there cannot be read, this folder is searched.
            rules = Some(Rc::new(self.rules(folder, rules).unwrap_or_else(|(_, above)| Rules {
                own: [Gitignore::empty(), Gitignore::empty()],
                is_repository: false,
                above,
            })));
        }
        self.folder(folder, depth.unwrap_or(DEEPEST), depth.is_none(), 0, rules);
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

    /// Reads a folder and `deeper` levels below; an unlimited walk reports where it stops early.
    fn folder(&mut self, folder: &Path, deeper: usize, is_all: bool, depth: usize, above: Option<Rc<Rules>>) {
        let problem = |why: String| (folder.to_owned(), why);
        let rules = match self.rules(folder, above) {
            Ok(rules) => Rc::new(rules),
            Err((why, _)) => return self.found.problems.push(problem(why)),
        };
        let entries = match entries(folder) {
            Ok(entries) => entries,
            Err(why) => return self.found.problems.push(problem(why)),
        };
        if self.is_own && depth > 0 && entries.iter().any(|entry| entry.file_name() == CONFIG_FILE) {
            self.found.configs.push(folder.join(CONFIG_FILE));
            return;
        }
        self.found.folders.push(folder.to_owned());
        for entry in entries {
            if (self.is_cancelled)() {
                return;
            }
            // The walk reports this at its end.
            let Some(left) = self.left.models.checked_sub(1) else {
                self.is_cut = true;
                return;
            };
            self.left.models = left;
            let (path, name) = (entry.path(), entry.file_name());
            let is_regular = entry.file_type().is_ok_and(|kind| kind.is_file());
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let is_hidden = is_hidden(Path::new(&name));
            if is_hidden
                || rules.ignores(&path, is_folder)
                || self.everywhere.matched(&path, is_folder).is_ignore()
            {
                continue;
            }
            if is_regular && (name == CONFIG_FILE || is_model(&path)) {
                self.found.regular.push(path.clone());
            }
            if name == CONFIG_FILE {
                self.found.configs.push(path);
            } else if is_folder {
                match deeper.checked_sub(1) {
                    _ if MADE_BY_TOOLS.iter().any(|made| name == *made) || is_made_up(&path) => {}
                    _ if is_all && device_of(&path) != self.device => self.elsewhere.push(path),
                    Some(deeper) if deeper > 0 => {
                        self.folder(&path, deeper, is_all, depth + 1, Some(Rc::clone(&rules)));
                    }
                    _ if is_all => {
                        let why =
                            format!("this folder is more than {DEEPEST} folders deep, and is not searched");
                        self.found.problems.push((path, why));
                    }
                    _ => {}
                }
            } else if is_model(&path) && !path.is_dir() {
                // Includes unreadable files, pipes and broken links, which are reported.
                self.found.files.push(path);
            }
        }
    }

    /// Returns the ignore rules of a folder, or why they are unknown.
    fn rules(
        &mut self,
        folder: &Path,
        above: Option<Rc<Rules>>,
    ) -> Result<Rules, (String, Option<Rc<Rules>>)> {
        let mut own = [Gitignore::empty(), Gitignore::empty()];
        for (name, own) in IGNORING.iter().zip(&mut own) {
            let path = folder.join(name);
            let bytes = match read(&path, LONGEST_IGNORE.min(self.left.ignored)) {
                Ok(bytes) => bytes,
                // A missing file or a broken link has no rules.
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => {
                    let why = format!("this folder is not searched: cannot read its `{name}`: {error}");
                    return Err((why, above));
                }
            };
            self.left.ignored -= bytes.len() as u64;
            let mut rules = GitignoreBuilder::new(folder);
            for line in String::from_utf8_lossy(&bytes).lines() {
                // An invalid line is no rule.
                let _ = rules.add_line(None, line);
            }
            *own = rules.build().unwrap_or_else(|_| Gitignore::empty());
        }
        let is_repository = folder.join(".git").symlink_metadata().is_ok();
        Ok(Rules { own, is_repository, above })
    }
}

/// Returns the number of the file system of a folder.
fn device_of(folder: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt as _;
    folder.symlink_metadata().ok().map(|data| data.dev())
}

/// Returns the entries of a folder, sorted by name; why there are none if it cannot be read.
fn entries(folder: &Path) -> Result<Vec<DirEntry>, String> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries = entries.map_err(|error| format!("cannot read this folder: {error}"))?;
    entries.sort_by_key(DirEntry::file_name);
    Ok(entries)
}

/// The search for the files of a pattern. Tables that the configuration names are read even if `.gitignore` ignores them or a
/// link leads to them.
struct Tables<'a> {
    found: Walked,
    left: &'a mut Left,
    is_cancelled: &'a dyn Fn() -> bool,
    glob: GlobMatcher,
    boundary: &'a Boundary,
    /// The folders around the present one, with links resolved.
    around: Vec<PathBuf>,
}

impl Tables<'_> {
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

    fn walked(folder: &Path, left: &mut Left, device: Option<u64>) -> Walked {
        let (found, everywhere) = (Walked::default(), Gitignore::empty());
        let (is_cancelled, is_own, elsewhere, is_cut) = (&|| false, false, Vec::new(), false);
        Models { found, left, is_cancelled, everywhere, is_own, device, elsewhere, is_cut }.walk(folder, None)
    }

    #[test]
    fn a_walk_stays_on_its_file_system_and_says_so_once() {
        let top = scratch("device", &["", "one", "two", "two/three"]);
        let all = walked(&top, &mut Left::default(), device_of(&top));
        assert_eq!((all.files.len(), all.problems.len()), (4, 0));
        let some = walked(&top, &mut Left::default(), Some(u64::MAX));
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
        let mut left = Left { models: 6, ..Left::default() };
        let some = walked(&top, &mut left, device_of(&top));
        let why = "there are more than 200000 files and folders: open a smaller folder".to_owned();
        assert_eq!((some.files.len(), some.problems), (3, vec![(top.clone(), why)]));
        std::fs::remove_dir_all(top).unwrap();
    }
}
