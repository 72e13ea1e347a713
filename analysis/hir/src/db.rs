//! The database: what is given from outside, and nothing else. Everything that is computed is a query of its own module.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mauve_syntax::Parse;
use mauve_timing::Level;
use rustc_hash::FxHashMap;

use crate::item_tree::{ItemTree, Name};
use crate::lower::{Known, SourceMap, lower};
use crate::msg::Package;

/// A text: a model, a timing table or a `mauve.toml`.
#[salsa::input(debug)]
pub struct File {
    /// Where it is, absolute.
    #[returns(ref)]
    pub path: PathBuf,
    /// What is in it; as far as it is UTF-8.
    #[returns(ref)]
    pub text: Arc<str>,
    /// Why the text is not all of it, or not what is in it.
    #[returns(ref)]
    pub problem: Option<Problem>,
    /// The file is outside of the project and was not read: its text is empty.
    #[default]
    #[returns(copy)]
    pub is_outside: bool,
}

/// What is wrong with the text of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Problem {
    /// It ends too early: the file cannot be read from there on, or is no UTF-8.
    Cut(String),
    /// Any of it may be another: a change was lost.
    Unknown(String),
}

impl Problem {
    /// In words for the user.
    pub fn message(&self) -> &str {
        match self {
            Problem::Cut(message) | Problem::Unknown(message) => message,
        }
    }
}

/// A folder with models in it, and the files that they need.
#[salsa::input(debug)]
pub struct Workspace {
    /// The folder, absolute; its `mauve.toml` is the configuration.
    #[returns(ref)]
    pub folder: PathBuf,
    /// Every file known, by every path that leads to it (two, where there are links).
    #[returns(ref)]
    pub files: Arc<BTreeMap<PathBuf, File>>,
    /// `MAUVE_MODELS`: where includes are looked for after the including file's own folder.
    #[returns(ref)]
    pub model_path: Vec<PathBuf>,
    /// Only the projects that have one of these are looked at: the files named on the command line. None: all are.
    #[returns(ref)]
    pub only: Vec<File>,
    /// Folders that the configuration names for tables, and that cannot be read: why.
    #[returns(ref)]
    pub unreadable: Vec<String>,
    /// The message packages that were found on this machine, of those that the models name.
    #[returns(ref)]
    pub packages: Arc<BTreeMap<Name, Arc<Package>>>,
    /// Those of the files that are there only because others include them.
    #[default]
    #[returns(ref)]
    pub included: Arc<BTreeSet<PathBuf>>,
    /// The significance level that is shown, where whoever looks has chosen one; otherwise it is that of `mauve.toml`.
    #[default]
    pub significance: Option<Level>,
}

/// What every query runs on.
#[salsa::db]
pub trait ModelDb: salsa::Database {
    /// The last tree of each file.
    fn trees(&self) -> &Trees;
}

/// The last tree of each file and what was read from it, beside the database: from it the tree of the edited text is made.
/// It is no input of any query, and need not be: it changes when an answer is there, never what it is.
#[derive(Clone, Default)]
pub struct Trees {
    parsed: OfFiles<(Arc<str>, Parse)>,
    read: OfFiles<Arc<Known>>,
}

type OfFiles<T> = Arc<Mutex<FxHashMap<File, T>>>;

impl Trees {
    pub(crate) fn parse(&self, file: File, text: &Arc<str>) -> Parse {
        // Locked while a tree is taken or put, not while one is made or freed: no panic can leave half of one.
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
        let lock = || self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().get(&file).cloned().unwrap_or_default();
        let (tree, map, read) = lower(&parse.file(), parse.errors().is_empty(), &known);
        let replaced = lock().insert(file, Arc::new(read));
        drop(replaced);
        (tree, map)
    }
}

/// The one implementation of [`ModelDb`].
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
    /// A workspace of these texts, by their absolute paths.
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

    /// The file at `path`.
    pub fn file(self, db: &dyn ModelDb, path: &Path) -> Option<File> {
        self.files(db).get(path).copied()
    }
}

impl Database {
    /// A database that notes which queries it executes, for tests and for `mauve analysis-stats`.
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

    /// The queries executed since the last call, by name, in order; empty without [`Database::with_log`].
    pub fn take_log(&self) -> Vec<String> {
        let Some(executed) = &self.executed else { return Vec::new() };
        let Ok(mut log) = executed.lock() else { return Vec::new() };
        let name = |key: String| key.split('(').next().unwrap_or_default().to_owned();
        std::mem::take(&mut *log).into_iter().map(name).collect()
    }
}

/// `path` without `.` and `..`, by its text alone: links are not followed.
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
