//! The database and its inputs. The queries are in the modules that compute them.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mauve_syntax::Parse;
use mauve_timing::Level;
use rustc_hash::FxHashMap;
use salsa::{Database as _, DatabaseKeyIndex, Durability, Setter as _};

use crate::item_tree::{ItemTree, Name, Outline};
use crate::lower::{LoweredNodes, lower};
use crate::msg::Package;
use crate::ranges::SourceMap;
use crate::ros2_files::{KeptYaml, ThreadsFile};

/// A text file: a model, a timing table or a `mauve.toml`.
///
/// Its outline is an input of its own, of high durability: after an edit that leaves it as it is, salsa does not verify the
/// queries that depend on outlines only, such as the names of a project. Only [`File::set_text`] sets the two, so that they
/// always agree.
#[salsa::input(debug, constructor = with_outline)]
pub struct File {
    /// The absolute path.
    #[returns(ref)]
    pub path: PathBuf,
    #[returns(ref)]
    content: Arc<str>,
    /// The declarations without their content; those of a table or a configuration are unknown.
    #[returns(ref)]
    own_outline: Arc<Outline>,
    /// Why the text differs from the content of the file.
    #[returns(ref)]
    pub problem: Option<Problem>,
    /// Whether the file is outside the workspace and was not read; its text is then empty.
    #[default]
    #[returns(copy)]
    pub is_outside: bool,
}

impl File {
    /// Creates a file that is likely to be edited.
    pub fn new(db: &dyn ModelDb, path: PathBuf, text: Arc<str>, problem: Option<Problem>) -> File {
        File::with_durability(db, path, text, problem, Durability::LOW)
    }

    /// Creates a file. The durability of its text is low if edits are likely.
    pub fn with_durability(
        db: &dyn ModelDb,
        path: PathBuf,
        text: Arc<str>,
        problem: Option<Problem>,
        durability: Durability,
    ) -> File {
        File::after(db, path, text, problem, durability, None)
    }

    /// Creates a copy of the file with another text in another database. It shares the tree of what the texts have in common.
    pub fn copied(self, db: &dyn ModelDb, to: &dyn ModelDb, text: Arc<str>) -> File {
        let previous = lock(&db.trees().models).get(&self).cloned();
        let (path, problem) = (self.path(db).clone(), self.problem(db).clone());
        File::after(to, path, text, problem, Durability::LOW, previous.as_ref())
    }

    fn after(
        db: &dyn ModelDb,
        path: PathBuf,
        text: Arc<str>,
        problem: Option<Problem>,
        durability: Durability,
        previous: Option<&KeptText>,
    ) -> File {
        let kept = has_outline(&path).then(|| KeptText::new(text.clone(), previous));
        let outline = kept.as_ref().map_or_else(Outline::unknown, KeptText::outline);
        let file = File::builder(path, text, outline, problem)
            .durability(Durability::HIGH)
            .content_durability(durability)
            .new(db);
        if let Some(kept) = kept {
            db.trees().keep(file, kept);
        }
        file
    }

    /// Returns the content, up to the first byte that is not UTF-8.
    pub fn text(self, db: &dyn ModelDb) -> &Arc<str> {
        self.content(db)
    }

    /// Creates a file outside the workspace that is not read, because of a problem.
    pub fn outside(db: &dyn ModelDb, path: PathBuf, problem: Option<Problem>) -> File {
        File::builder(path, Arc::default(), Arc::default(), problem)
            .is_outside(true)
            .durability(Durability::HIGH)
            .new(db)
    }

    /// Returns the declarations without their content; unknown for a table or a configuration.
    pub fn outline(self, db: &dyn ModelDb) -> &Arc<Outline> {
        self.own_outline(db)
    }

    /// Sets the text of a file that is likely to be edited again, which cancels all queries.
    pub fn set_text(self, db: &mut dyn ModelDb, text: Arc<str>) {
        self.set_text_with(db, text, Durability::LOW);
    }

    /// Sets the text, which cancels all queries. The durability is low if further edits are likely.
    pub fn set_text_with(self, db: &mut dyn ModelDb, text: Arc<str>, durability: Durability) {
        if has_outline(self.path(db)) {
            let outline = db.trees().kept(self, &text).outline();
            if *self.own_outline(db) != outline {
                self.set_own_outline(db).with_durability(Durability::HIGH).to(outline);
            }
        }
        self.set_content(db).with_durability(durability).to(text);
    }
}

/// Returns whether a file of this path may be a model: no project includes other files, and a project that includes them is
/// incomplete.
pub(crate) fn has_outline(path: &Path) -> bool {
    path.extension().is_none_or(|extension| !["toml", "yaml", "yml"].iter().any(|it| extension == *it))
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
    /// The other files that timing tables name: sample files, and sources of codels. Those that do not exist are missing.
    #[default]
    #[returns(ref)]
    pub measured_files: Arc<BTreeMap<PathBuf, OnDisk>>,
    /// The displayed significance level, if the user selected one; otherwise `mauve.toml` gives it.
    #[default]
    pub significance: Option<Level>,
}

/// A file whose content is not analysed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnDisk {
    /// Its size in bytes.
    pub length: u64,
    /// The [digest](mauve_timing::digest_of) of its content; `None` if only its size matters.
    pub digest: Option<String>,
}

/// The database that queries run on.
#[salsa::db]
pub trait ModelDb: salsa::Database {
    /// Returns the previous tree of each file.
    fn trees(&self) -> &Trees;

    /// Notes that a query has lowered or executed so many nodes of programs, for tests of what an edit costs.
    fn note_nodes(&self, nodes: usize);
}

/// The newest tree of each model with its lowered nodes, and of each YAML file, for incremental parsing and lowering. The cache is not
/// an input of any query: it changes only the time that a query takes, never its result.
#[derive(Clone, Default)]
pub struct Trees {
    models: Arc<Mutex<FxHashMap<File, KeptText>>>,
    yamls: Arc<Mutex<FxHashMap<File, KeptYaml>>>,
}

/// What is kept of a text.
#[derive(Clone)]
pub(crate) struct KeptText {
    text: Arc<str>,
    pub(crate) parse: Parse,
    pub(crate) lowered: Arc<(ItemTree, SourceMap)>,
    nodes: Arc<LoweredNodes>,
}

impl KeptText {
    /// Parses and lowers a text, and reuses what the previous one has in common with it.
    fn new(text: Arc<str>, previous: Option<&KeptText>) -> KeptText {
        if let Some(kept) = previous.filter(|kept| Arc::ptr_eq(&kept.text, &text)) {
            return kept.clone();
        }
        let parse = match previous {
            Some(kept) => kept.parse.reparse(&kept.text, &text),
            None => mauve_syntax::parse(&text),
        };
        let nodes = previous.map(|kept| kept.nodes.clone()).unwrap_or_default();
        let (tree, map, nodes) = lower(&parse.file(), parse.errors(), &nodes);
        KeptText { text, parse, lowered: Arc::new((tree, map)), nodes: Arc::new(nodes) }
    }

    fn outline(&self) -> Arc<Outline> {
        self.lowered.0.outline.clone()
    }
}

impl Trees {
    /// Returns the tree of this text of a file, and its lowered nodes.
    pub(crate) fn kept(&self, file: File, text: &Arc<str>) -> KeptText {
        let previous = lock(&self.models).get(&file).cloned();
        let kept = KeptText::new(text.clone(), previous.as_ref());
        self.keep(file, kept.clone());
        kept
    }

    fn keep(&self, file: File, kept: KeptText) {
        let replaced = lock(&self.models).insert(file, kept);
        // The lock is not held while a tree is freed.
        drop(replaced);
    }

    /// Reads this text of a `threads.yaml`.
    pub fn read_threads(&self, file: File, text: &Arc<str>) -> ThreadsFile {
        let previous = lock(&self.yamls).remove(&file);
        let kept = KeptYaml::new(text.clone(), previous);
        let read = kept.threads();
        lock(&self.yamls).insert(file, kept);
        read
    }
}

/// The lock is held only for the map's operations, not while a text is parsed: a panic leaves no partial entry.
fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The implementation of [`ModelDb`].
#[salsa::db]
#[derive(Clone, Default)]
pub struct Database {
    storage: salsa::Storage<Self>,
    log: Option<Arc<Mutex<Keys>>>,
    trees: Trees,
}

#[salsa::db]
impl salsa::Database for Database {}

#[salsa::db]
impl ModelDb for Database {
    fn trees(&self) -> &Trees {
        &self.trees
    }

    fn note_nodes(&self, nodes: usize) {
        if let Some(Ok(mut log)) = self.log.as_ref().map(|log| log.lock()) {
            log.nodes += nodes;
        }
    }
}

impl Workspace {
    /// Returns a workspace of `texts`, by their absolute paths. Sample files and C++ sources are not analysed.
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
        let texts: Vec<(PathBuf, String)> = texts.into_iter().collect();
        let is_other = |path: &Path| path.extension().is_some_and(|it| it == "samples" || it == "cpp");
        let others = texts.iter().filter(|(path, _)| is_other(path));
        let others = others.map(|(path, text)| {
            let digest = Some(mauve_timing::digest_of(text.as_bytes()));
            (path.clone(), OnDisk { length: text.len() as u64, digest })
        });
        let others: BTreeMap<PathBuf, OnDisk> = others.collect();
        let file = |(path, text): (PathBuf, String)| (path.clone(), File::new(db, path, text.into(), None));
        let files = Arc::new(texts.into_iter().filter(|(path, _)| !is_other(path)).map(file).collect());
        Workspace::builder(folder, files, Vec::new(), Vec::new(), Vec::new(), Arc::default())
            .measured_files(Arc::new(others))
            .durability(Durability::HIGH)
            .new(db)
    }

    /// Returns the file at `path`.
    pub fn file(self, db: &dyn ModelDb, path: &Path) -> Option<File> {
        self.files(db).get(path).copied()
    }
}

/// The log of a database, by the names of the queries.
#[derive(Debug, Default)]
pub struct Log {
    /// The executed queries, in order.
    pub executed: Vec<String>,
    /// The queries whose results salsa has verified to be unchanged, in order.
    pub verified: Vec<String>,
    /// How many nodes of programs were lowered or executed.
    pub nodes: usize,
}

/// A [`Log`] in the making.
#[derive(Default)]
struct Keys {
    executed: Vec<DatabaseKeyIndex>,
    verified: Vec<DatabaseKeyIndex>,
    nodes: usize,
}

impl Database {
    /// Returns a database that logs its queries, for tests.
    pub fn with_log() -> Database {
        let log: Arc<Mutex<Keys>> = Arc::default();
        let kept = log.clone();
        let storage = salsa::Storage::new(Some(Box::new(move |event: salsa::Event| {
            let Ok(mut log) = log.lock() else { return };
            match event.kind {
                salsa::EventKind::WillExecute { database_key } => log.executed.push(database_key),
                salsa::EventKind::DidValidateMemoizedValue { database_key } => {
                    log.verified.push(database_key)
                }
                _ => {}
            }
        })));
        Database { storage, log: Some(kept), trees: Trees::default() }
    }

    /// Returns the log since the last call; empty without [`Database::with_log`].
    pub fn take_log(&self) -> Log {
        let Some(log) = &self.log else { return Log::default() };
        let keys = log.lock().map(|mut log| std::mem::take(&mut *log)).unwrap_or_default();
        let names = |keys: Vec<DatabaseKeyIndex>| {
            let name =
                |key: DatabaseKeyIndex| self.ingredient_debug_name(key.ingredient_index()).into_owned();
            keys.into_iter().map(name).collect()
        };
        Log { executed: names(keys.executed), verified: names(keys.verified), nodes: keys.nodes }
    }
}

/// Returns the relative path from a folder to a path, by their texts.
///
/// ```
/// let path = mauve_hir::relative_path("/a/b".as_ref(), "/a/c/d.mal".as_ref());
/// assert_eq!(path, std::path::Path::new("../c/d.mal"));
/// ```
pub fn relative_path(folder: &Path, path: &Path) -> PathBuf {
    let common = folder.components().zip(path.components()).take_while(|(one, other)| one == other).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
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
