//! Walks through folders on the disk, which nobody knows the size of: bounded, cancellable, and apart from the database, so
//! that a server can walk on another thread than the one that edits wait for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use ignore::{DirEntry, WalkBuilder};
use mauve_model::{CONFIG_FILE, is_model, table_pattern};

use crate::disk::Boundary;

/// Folders that hold what tools made.
const MADE_BY_TOOLS: [&str; 4] = ["build", "devel", "install", "log"];

/// So many files and folders are looked at for models, and for the tables of one pattern.
const MOST_FOR_MODELS: usize = 500_000;
const MOST_FOR_TABLES: usize = 20_000;

/// A `.gitignore` that is longer is not read.
const LONGEST_IGNORE: u64 = 1 << 16;

/// What is to be looked for on the disk.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Walk {
    /// The models and configurations below a folder, without what tools made and what `.gitignore` names.
    Models { folder: PathBuf, depth: Option<usize> },
    /// The files that a pattern of `[timing] tables` names.
    Tables {
        /// Where the pattern begins to be one.
        from: PathBuf,
        depth: Option<usize>,
        /// The configuration's folder, and the pattern.
        folder: PathBuf,
        pattern: String,
        boundary: Boundary,
    },
}

/// What was found.
#[derive(Debug, Clone, Default)]
pub(crate) struct Walked {
    /// All folders that were looked through.
    pub(super) folders: Vec<PathBuf>,
    /// Models or tables, whether they can be read or not.
    pub(super) files: Vec<PathBuf>,
    /// Below the first folder.
    pub(super) configs: Vec<PathBuf>,
    /// What was not looked through, and why.
    pub(super) problems: Vec<(PathBuf, String)>,
}

/// What is known of the disk.
#[derive(Debug, Default)]
pub(super) struct Walks {
    known: BTreeMap<Walk, Arc<Walked>>,
    /// Asked for since everything was forgotten.
    asked: BTreeSet<Walk>,
    /// Is somebody else to walk?
    pub(super) is_told: bool,
}

impl Walks {
    /// What is found there; nothing where somebody else is to walk, and has not yet.
    pub(super) fn walked(&mut self, walk: Walk) -> Option<Arc<Walked>> {
        self.asked.insert(walk.clone());
        if let Some(known) = self.known.get(&walk) {
            return Some(known.clone());
        }
        if self.is_told {
            return None;
        }
        let walked = Arc::new(walk.run(&|| false));
        self.known.insert(walk, walked.clone());
        Some(walked)
    }

    /// What was asked for and is not known.
    pub(super) fn wanted(&self) -> Vec<Walk> {
        self.asked.iter().filter(|walk| !self.known.contains_key(*walk)).cloned().collect()
    }

    pub(super) fn learn(&mut self, walk: Walk, walked: Walked) {
        self.known.insert(walk, walked.into());
    }

    /// Forgets everything; gives what was asked for.
    pub(super) fn forget(&mut self) -> Vec<Walk> {
        self.known.clear();
        std::mem::take(&mut self.asked).into_iter().collect()
    }
}

impl Walk {
    /// Looks at the disk until `is_cancelled`: what is found then is not all.
    pub(crate) fn run(&self, is_cancelled: &dyn Fn() -> bool) -> Walked {
        match self {
            Walk::Models { folder, depth } => models(folder, *depth, is_cancelled),
            Walk::Tables { from, depth, folder, pattern, boundary } => {
                tables(from, *depth, folder, pattern, boundary, is_cancelled)
            }
        }
    }
}

type Problems = Arc<Mutex<Vec<(PathBuf, String)>>>;

fn note(problems: &Problems, path: &Path, why: String) {
    problems.lock().unwrap_or_else(PoisonError::into_inner).push((path.to_owned(), why));
}

fn models(folder: &Path, depth: Option<usize>, is_cancelled: &dyn Fn() -> bool) -> Walked {
    let mut found = Walked::default();
    let problems = Problems::default();
    let made = |name: &std::ffi::OsStr| MADE_BY_TOOLS.iter().any(|made| name == *made);
    let noted = problems.clone();
    let is_wanted = move |entry: &DirEntry| {
        let is_folder = entry.file_type().is_some_and(|kind| kind.is_dir());
        if entry.depth() > 0 && is_folder && made(entry.file_name()) {
            return false;
        }
        // It is read before what stands beside it.
        let bad = if is_folder { bad_ignore(entry.path()) } else { None };
        bad.is_none_or(|why| {
            note(&noted, entry.path(), why);
            false
        })
    };
    let bad_above = folder.ancestors().skip(1).any(|above| bad_ignore(above).is_some());
    let walk = WalkBuilder::new(folder)
        .require_git(false)
        .git_exclude(false)
        .parents(!bad_above)
        .max_depth(depth)
        .sort_by_file_path(Path::cmp)
        .filter_entry(is_wanted)
        .build();
    for (number, entry) in walk.enumerate() {
        if is_cancelled() {
            break;
        }
        if number >= MOST_FOR_MODELS {
            let why =
                format!("there are more than {MOST_FOR_MODELS} files and folders: open a smaller folder");
            note(&problems, folder, why);
            break;
        }
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                if let Some(path) = path_of(&error).filter(|path| path.is_dir()) {
                    note(&problems, path, cannot_be_read(&error));
                }
                continue;
            }
        };
        let path = entry.path();
        // A link that leads nowhere is read as well: that it cannot be is said.
        let is_text = || path.is_file() || entry.path_is_symlink() && !path.exists();
        if path.ends_with(CONFIG_FILE) && entry.depth() > 0 {
            found.configs.push(path.to_owned());
        } else if entry.file_type().is_some_and(|kind| kind.is_dir()) {
            found.folders.push(path.to_owned());
        } else if is_model(path) && is_text() {
            found.files.push(path.to_owned());
        }
    }
    found.problems = std::mem::take(&mut *problems.lock().unwrap_or_else(PoisonError::into_inner));
    found
}

/// Why the files of a folder that name what is to be ignored cannot be read: whoever reads them trusts them.
fn bad_ignore(folder: &Path) -> Option<String> {
    [".gitignore", ".ignore"].iter().find_map(|name| {
        let path = folder.join(name);
        // Nothing there, or a link that leads nowhere, ignores nothing.
        let data = std::fs::metadata(&path).ok()?;
        let real = path.canonicalize().ok()?;
        let is_good = data.is_file() && data.len() <= LONGEST_IGNORE && !crate::disk::is_made_up(&real);
        (!is_good).then(|| format!("this folder is not looked through: its `{name}` is no file, or longer than {LONGEST_IGNORE} bytes"))
    })
}

fn tables(
    from: &Path,
    depth: Option<usize>,
    folder: &Path,
    pattern: &str,
    boundary: &Boundary,
    is_cancelled: &dyn Fn() -> bool,
) -> Walked {
    let mut found = Walked::default();
    let Ok(glob) = table_pattern(folder, pattern) else { return found };
    if let Some(why) = from.canonicalize().ok().and_then(|real| boundary.refusal(&real)) {
        found.problems.push((from.to_owned(), why));
        return found;
    }
    let problems = Problems::default();
    let (noted, allowed) = (problems.clone(), boundary.clone());
    let is_within = move |entry: &DirEntry| {
        if !entry.path_is_symlink() || !entry.path().is_dir() {
            return true;
        }
        let refusal = entry.path().canonicalize().ok().and_then(|real| allowed.refusal(&real));
        refusal.is_none_or(|why| {
            note(&noted, entry.path(), why);
            false
        })
    };
    // What the configuration names is read, whatever `.gitignore` says, and wherever a link in the project leads.
    let walk = WalkBuilder::new(from)
        .standard_filters(false)
        .follow_links(true)
        .max_depth(depth)
        .sort_by_file_path(Path::cmp)
        .filter_entry(is_within)
        .build();
    for (number, entry) in walk.enumerate() {
        if is_cancelled() {
            break;
        }
        if number >= MOST_FOR_TABLES {
            let why = format!(
                "more than {MOST_FOR_TABLES} files and folders stand below it: name a smaller folder"
            );
            note(&problems, from, why);
            break;
        }
        match entry {
            Ok(entry) if entry.path().is_dir() => found.folders.push(entry.into_path()),
            Ok(entry) => found.files.extend(Some(entry.into_path()).filter(|path| glob.is_match(path))),
            Err(error) => match path_of(&error) {
                // A link that leads nowhere is a table that cannot be read.
                Some(path) if !path.is_dir() && path.symlink_metadata().is_ok() => {
                    found.files.extend(Some(path.to_owned()).filter(|path| glob.is_match(path)));
                }
                path if from.exists() => {
                    let path = path.unwrap_or(from).to_owned();
                    note(&problems, &path, cannot_be_read(&error));
                }
                _ => {}
            },
        }
    }
    found.problems = std::mem::take(&mut *problems.lock().unwrap_or_else(PoisonError::into_inner));
    found
}

/// The path stands beside it already.
fn cannot_be_read(error: &ignore::Error) -> String {
    match error.io_error() {
        Some(why) => format!("this folder cannot be read: {why}"),
        None => error.to_string(),
    }
}

fn path_of(error: &ignore::Error) -> Option<&Path> {
    match error {
        ignore::Error::WithPath { path, .. } => Some(path),
        ignore::Error::WithDepth { err, .. } | ignore::Error::WithLineNumber { err, .. } => path_of(err),
        _ => None,
    }
}
