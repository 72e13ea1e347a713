//! Finds and reads message packages that are installed on this machine.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError};

use mauve_hir::{Message, Package, read_message};

/// Marker files that exclude their folder from the search.
const IGNORING: [&str; 3] = ["CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE"];

/// The maximum depth of the search below an entry of `ROS_PACKAGE_PATH`.
const DEEPEST: usize = 5;

/// The maximum number of searched folders.
const MOST_FOLDERS: usize = 20_000;

/// The maximum size of a `.msg` file, in bytes.
const LONGEST: u64 = 1 << 20;

/// The folders where packages may be installed.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// `ROS_PACKAGE_PATH`: folders with packages somewhere below them, or packages themselves.
    sources: Vec<PathBuf>,
    /// `AMENT_PREFIX_PATH` and `CMAKE_PREFIX_PATH`: folders with `share/PACKAGE`.
    prefixes: Vec<PathBuf>,
    /// The packages below each source, by the names of their folders: searched once, and only for packages that are
    /// not found at the top.
    below: Mutex<BTreeMap<PathBuf, BTreeMap<String, PathBuf>>>,
}

impl Places {
    /// Returns the places that the environment names, which are read once.
    pub(super) fn of_environment() -> &'static Places {
        static PLACES: LazyLock<Places> = LazyLock::new(|| {
            let sources = folders_of("ROS_PACKAGE_PATH");
            let prefixes = [folders_of("AMENT_PREFIX_PATH"), folders_of("CMAKE_PREFIX_PATH")].concat();
            Places::new(sources, prefixes)
        });
        &PLACES
    }

    fn new(sources: Vec<PathBuf>, prefixes: Vec<PathBuf>) -> Places {
        Places { sources: once(sources), prefixes: once(prefixes), ..Places::default() }
    }

    /// Returns the folders with the `.msg` files of a package, in order of precedence.
    ///
    /// There may be several, since generated messages are installed to another folder.
    pub(super) fn folders(&self, package: &str) -> Vec<PathBuf> {
        // A text that is not a name could lead out of these folders.
        if !is_name(package) {
            return Vec::new();
        }
        let sources = self.sources.iter().filter_map(|source| self.in_source(source, package));
        let shares = self.prefixes.iter().map(|prefix| prefix.join("share").join(package));
        let folders = sources.chain(shares).map(|folder| folder.join("msg"));
        once(folders.filter(|folder| folder.is_dir()).collect())
    }

    /// Searches the sources: later, nothing waits for that.
    pub(super) fn search(&self) {
        self.sources.iter().for_each(|source| _ = self.in_source(source, ""));
    }

    /// Returns a package if it is installed.
    pub(super) fn read(&self, package: &str) -> Option<Package> {
        let folders = self.folders(package);
        let mut found = Package { name: package.into(), messages: BTreeMap::new() };
        for path in folders.iter().flat_map(|folder| entries(folder)) {
            let name = path.file_stem().and_then(|name| name.to_str()).filter(|name| is_name(name));
            let is_message = path.extension().is_some_and(|extension| extension == "msg");
            if let Some(name) = name.filter(|name| is_message && !found.messages.contains_key(*name))
                && let Some(message) = message_in(&path)
            {
                found.messages.insert(name.into(), message);
            }
        }
        (!folders.is_empty()).then_some(found)
    }

    fn in_source(&self, source: &Path, package: &str) -> Option<PathBuf> {
        let at_the_top = source.join(package);
        if at_the_top.join("msg").is_dir() {
            return Some(at_the_top);
        }
        if source.ends_with(package) && source.join("msg").is_dir() {
            return Some(source.to_owned());
        }
        let mut below = self.below.lock().unwrap_or_else(PoisonError::into_inner);
        below.entry(source.to_owned()).or_insert_with(|| packages_below(source)).get(package).cloned()
    }
}

/// Returns the folders with a `package.xml` below a folder, by name; the nearest one of each name. Packages are not
/// nested.
fn packages_below(source: &Path) -> BTreeMap<String, PathBuf> {
    let mut found = BTreeMap::new();
    let mut open = VecDeque::from([(source.to_owned(), 0)]);
    let mut left = MOST_FOLDERS;
    while let Some((folder, depth)) = open.pop_front() {
        if IGNORING.iter().any(|name| folder.join(name).exists()) {
            continue;
        }
        if folder.join("package.xml").is_file() {
            if let Some(name) = folder.file_name().and_then(|name| name.to_str()) {
                found.entry(name.to_owned()).or_insert(folder);
            }
            continue;
        }
        if depth < DEEPEST {
            let is_hidden = |path: &PathBuf| {
                path.file_name().is_none_or(|name| name.as_encoded_bytes().starts_with(b"."))
            };
            let inner = entries(&folder).into_iter().filter(|path| !is_hidden(path) && path.is_dir());
            let inner: Vec<PathBuf> = inner.take(left).collect();
            left -= inner.len();
            open.extend(inner.into_iter().map(|inner| (inner, depth + 1)));
        }
    }
    found
}

/// Returns the entries of a folder, sorted by name; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

fn message_in(path: &Path) -> Option<Message> {
    let text = String::from_utf8(crate::disk::read(path, LONGEST).ok()?).ok()?;
    Some(Message { path: Some(path.to_owned()), ..read_message(&text) })
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Returns the folders that an environment variable lists. Ignores relative paths, which would depend on the current
/// folder.
fn folders_of(variable: &str) -> Vec<PathBuf> {
    let folders = std::env::var_os(variable).unwrap_or_default();
    std::env::split_paths(&folders).filter(|folder| folder.is_absolute()).collect()
}

fn once(paths: Vec<PathBuf>) -> Vec<PathBuf> {
    let mut seen = std::collections::BTreeSet::new();
    paths.into_iter().filter(|path| seen.insert(path.clone())).collect()
}
