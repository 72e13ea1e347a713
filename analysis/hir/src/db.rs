//! The database and its inputs. The queries are in the modules that compute them.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mauve_syntax::Parse;
use mauve_timing::Level;
use rustc_hash::FxHashMap;

use crate::item_tree::{ItemTree, Name};
use crate::lower::{LoweredNodes, SourceMap, lower};
use crate::msg::Package;

/// A text file: a model, a timing table or a `mauve.toml`.
#[salsa::input(debug)]
pub struct File {
    /// The absolute path.
    #[returns(ref)]
    pub path: PathBuf,
    /// The content, up to the first byte that is not UTF-8.
    #[returns(ref)]
    pub text: Arc<str>,
    /// Why the text differs from the content of the file.
    #[returns(ref)]
    pub problem: Option<Problem>,
    /// Whether the file is outside the workspace and was not read; its text is then empty.
    #[default]
    #[returns(copy)]
    pub is_outside: bool,
}

/// Why the text of a file is not its content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Problem {
    /// The text is truncated: the remainder is unreadable or not UTF-8.
    Cut(String),
    /// The text is outdated: a change could not be applied.
    Unknown(String),
}

impl Problem {
    /// Returns the reason, for the user.
    pub fn message(&self) -> &str {
        match self {
            Problem::Cut(message) | Problem::Unknown(message) => message,
        }
    }
}

/// A folder with models, and the files that they need.
#[salsa::input(debug)]
pub struct Workspace {
    /// The absolute path of the folder; its `mauve.toml` is the configuration.
    #[returns(ref)]
    pub folder: PathBuf,
    /// All files, by each path that leads to them (symbolic links give several).
    #[returns(ref)]
    pub files: Arc<BTreeMap<PathBuf, File>>,
    /// `MAUVE_MODELS`: the folders for includes, searched after the folder of the including file.
    #[returns(ref)]
    pub model_path: Vec<PathBuf>,
    /// The files named on the command line: queries return only the projects that contain one of them. Empty for all.
    #[returns(ref)]
    pub only: Vec<File>,
    /// For each unreadable folder of tables in the configuration, the reason.
    #[returns(ref)]
    pub unreadable: Vec<String>,
    /// The message packages that the models name and that this machine has.
    #[returns(ref)]
    pub packages: Arc<BTreeMap<Name, Arc<Package>>>,
    /// The files that are loaded only because other files include them.
    #[default]
    #[returns(ref)]
    pub included: Arc<BTreeSet<PathBuf>>,
    /// The displayed significance level, if the user selected one; otherwise `mauve.toml` gives it.
    #[default]
    pub significance: Option<Level>,
}

/// The database that queries run on.
#[salsa::db]
pub trait ModelDb: salsa::Database {
    /// Returns the previous tree of each file.
    fn trees(&self) -> &Trees;
}

/// The previous tree of each file and its lowered nodes, for incremental parsing and lowering. The cache is not an input of
/// any query: it changes only the time that a query takes, never its result.
#[derive(Clone, Default)]
pub struct Trees {
    parsed: ByFile<(Arc<str>, Parse)>,
    lowered: ByFile<Arc<LoweredNodes>>,
}

type ByFile<T> = Arc<Mutex<FxHashMap<File, T>>>;

impl Trees {
    pub(crate) fn parse(&self, file: File, text: &Arc<str>) -> Parse {
        // The lock is held only for the map's operations, not while a tree is parsed or freed: a panic leaves no partial entry.
        let lock = || self.parsed.lock().unwrap_or_else(PoisonError::into_inner);
        let previous = lock().get(&file).cloned();
        let parse = match &previous {
            Some((old, parse)) => parse.reparse(old, text),
            None => mauve_syntax::parse(text),
        };
        let replaced = lock().insert(file, (text.clone(), parse.clone()));
        drop(replaced);
        parse
    }

    pub(crate) fn lower(&self, file: File, parse: &Parse) -> (ItemTree, SourceMap) {
        let lock = || self.lowered.lock().unwrap_or_else(PoisonError::into_inner);
        let previous = lock().get(&file).cloned().unwrap_or_default();
        let (tree, map, lowered) = lower(&parse.file(), !parse.errors().is_empty(), &previous);
        let replaced = lock().insert(file, Arc::new(lowered));
        drop(replaced);
        (tree, map)
    }
}

/// The implementation of [`ModelDb`].
#[salsa::db]
#[derive(Clone, Default)]
pub struct Database {
    storage: salsa::Storage<Self>,
    executed: Option<Arc<Mutex<Vec<String>>>>,
    trees: Trees,
}

#[salsa::db]
impl salsa::Database for Database {}

#[salsa::db]
impl ModelDb for Database {
    fn trees(&self) -> &Trees {
        &self.trees
    }
}

impl Workspace {
    /// Returns a workspace of `texts`, by their absolute paths.
    ///
    /// ```
    /// use mauve_hir::{Database, Workspace, projects};
    /// let db = Database::default();
    /// let files = [("/robot/a.mal".into(), "codel f(): int".to_owned())];
    /// let workspace = Workspace::of_texts(&db, "/robot".into(), files);
    /// assert_eq!(projects(&db, workspace).len(), 1);
    /// ```
    pub fn of_texts(
        db: &dyn ModelDb,
        folder: PathBuf,
        texts: impl IntoIterator<Item = (PathBuf, String)>,
    ) -> Workspace {
        let file = |(path, text): (PathBuf, String)| (path.clone(), File::new(db, path, text.into(), None));
        Workspace::new(
            db,
            folder,
            Arc::new(texts.into_iter().map(file).collect()),
            Vec::new(),
            Vec::new(),
            Vec::new(),
            Arc::default(),
        )
    }

    /// Returns the file at `path`.
    pub fn file(self, db: &dyn ModelDb, path: &Path) -> Option<File> {
        self.files(db).get(path).copied()
    }
}

impl Database {
    /// Returns a database that logs the queries that it executes, for tests and for `mauve analysis-stats`.
    pub fn with_log() -> Database {
        let executed: Arc<Mutex<Vec<String>>> = Arc::default();
        let log = executed.clone();
        let storage = salsa::Storage::new(Some(Box::new(move |event: salsa::Event| {
            if let salsa::EventKind::WillExecute { database_key } = event.kind
                && let Ok(mut log) = log.lock()
            {
                log.push(format!("{database_key:?}"));
            }
        })));
        Database { storage, executed: Some(executed), trees: Trees::default() }
    }

    /// Returns the names of the queries executed since the last call, in order; empty without [`Database::with_log`].
    pub fn take_log(&self) -> Vec<String> {
        let Some(executed) = &self.executed else { return Vec::new() };
        let Ok(mut log) = executed.lock() else { return Vec::new() };
        let name = |key: String| key.split('(').next().unwrap_or_default().to_owned();
        std::mem::take(&mut *log).into_iter().map(name).collect()
    }
}

/// Returns `path` without `.` and `..`. Symbolic links are not followed.
///
/// ```
/// use std::path::{Path, PathBuf};
/// assert_eq!(mauve_hir::normalised(Path::new("/a/b/../c/./d.mal")), PathBuf::from("/a/c/d.mal"));
/// ```
pub fn normalised(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}
