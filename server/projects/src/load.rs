//! Loads workspaces into the database. Only this module reads models from the disk.

mod folders;
mod other_language;
mod outdated;
mod packages;
mod search;
mod walk;
mod watch_set;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_hir::item_tree::Name;
use mauve_hir::{
    CONFIG_FILE, Database, File, ModelDb, OnDisk, Package, Problem, Workspace, config_file, config_of,
    include_candidates, is_model, named_packages, normalised,
};
use mauve_timing::{Level, digest_of};
use mauve_wcrt::{table, table_files, table_pattern};
use salsa::{Durability, Setter};

use crate::disk::{self, LONGEST, ProjectBoundary, is_hidden, text_of};
use folders::KnownFolders;
pub use other_language::is_of_another_language;
pub use outdated::is_outdated;
use packages::Places;
pub use walk::DiskSearch;
pub use walk::LONGEST_TOGETHER;
use walk::{Left, ReadText, Walk, Walked, Walks};
use watch_set::WatchSet;

/// Sets the inputs of a workspace that have changed, since setting an input cancels all queries.
macro_rules! set_changed {
    ($db:expr, $workspace:ident: $($input:ident = $set:ident($value:expr)),* $(,)?) => {
        $({
            let value = $value;
            if *$workspace.$input($db) != value {
                $workspace.$set($db).to(value);
            }
        })*
    };
}

/// The texts that were read, and the workspaces that they make up.
///
/// The command line loads once. The server loads again when a file is created or removed: other files keep their
/// salsa inputs, so only changes are analysed again.
#[derive(Default)]
pub struct Loader {
    /// By the path with links resolved, so that two paths to one file give one input.
    files: BTreeMap<PathBuf, File>,
    workspaces: BTreeMap<PathBuf, Workspace>,
    /// Files whose text comes from an editor instead of the disk.
    edited: BTreeSet<PathBuf>,
    /// Those of them that the disk did not have. When the file is created, links may lead to it.
    absent: BTreeSet<PathBuf>,
    watch_set: WatchSet,
    /// The files of the workspaces, and those of them that are configurations, whatever they are called.
    current: BTreeSet<PathBuf>,
    configs: BTreeSet<PathBuf>,
    /// The requested message packages; `None` if a package is not installed.
    packages: BTreeMap<Name, Option<Arc<Package>>>,
    /// The significance level that is shown in all present and future workspaces; see
    /// [`Workspace::significance`].
    significance: Option<Level>,
    walks: Walks,
    folders: KnownFolders,
    /// The files whose texts the next search reads again.
    unread: BTreeSet<PathBuf>,
    /// Whether the workspaces must be loaded after the next search, whatever it finds.
    is_load_due: bool,
    /// The files that are not read, since all of them exceed a limit together.
    cut: BTreeSet<PathBuf>,
    /// Whether files outside the projects may be read. See [`ProjectBoundary`].
    allows_outside: bool,
    named: Vec<PathBuf>,
    boundary: ProjectBoundary,
    /// Files outside the projects that were named and not read, by the path that names them.
    outside: BTreeMap<PathBuf, File>,
    /// The canonical paths of files that a project names and may not read from the disk. It may read their texts in an editor.
    refused: BTreeSet<PathBuf>,
    /// How many bytes may still be read.
    left: u64,
    /// The files that were read from the disk for the present workspaces, with their sizes in bytes.
    read: BTreeMap<PathBuf, (u64, File)>,
    /// Those of the workspaces before this load.
    before: BTreeMap<PathBuf, (u64, File)>,
    /// The texts that a search has read, by their canonical paths, as [`text_of`] returns them.
    texts: HashMap<PathBuf, ReadText>,
    /// What has changed since the search began: what it has found there may be outdated.
    touched: HashSet<PathBuf>,
    /// What has changed since then, and was not read again.
    noted: HashSet<PathBuf>,
}

/// The models of a folder that were requested.
#[derive(Default)]
struct Requested {
    all: bool,
    models: Vec<PathBuf>,
}

/// A path that the user named.
enum NamedPath {
    Model(PathBuf),
    /// A folder, or that of a configuration.
    Folder(PathBuf),
}

impl NamedPath {
    /// Classifies a path; `canonical` is the same path behind all links.
    fn new(path: &Path, canonical: PathBuf, is_file: bool) -> Result<NamedPath, String> {
        let is_config = canonical.ends_with(CONFIG_FILE);
        if is_file && !is_config {
            let what = format!("`{}` is not a model (*.mal), a {CONFIG_FILE} or a folder", path.display());
            let is_set = path.extension().is_some_and(|it| it == "csv" || it == "json");
            let hint = "; a task set has response times only: `mauve wcrt` and `mauve simulate` read it";
            return match is_model(&canonical) {
                true => Ok(NamedPath::Model(canonical)),
                false => Err(what + if is_set { hint } else { "" }),
            };
        }
        Ok(NamedPath::Folder(if is_config { parent(&canonical).to_owned() } else { canonical }))
    }
}

/// Whether files outside the project may be read: an option of each command that loads models.
#[derive(Debug, clap::Args)]
pub struct Outside {
    /// Also read files that models and mauve.toml name outside their repository and outside the given folders. Only
    /// for projects that you trust: messages may quote such files.
    #[arg(long)]
    pub allow_outside: bool,
}

/// Returns the workspaces that `paths` name.
///
/// # Errors
///
/// A path that does not exist or has no model in it, in words for the user.
pub fn load(db: &mut Database, paths: &[PathBuf], allows_outside: bool) -> Result<Vec<Workspace>, String> {
    loaded(Loader::new(allows_outside), db, paths)
}

/// Returns the workspaces of a model or a `mauve.toml` that has this text, whatever the disk has. It need not exist.
///
/// # Errors
///
/// As [`load`]; the file's folder does not exist.
pub fn load_with(
    db: &mut Database,
    file: &Path,
    text: &str,
    problem: Option<String>,
    allows_outside: bool,
) -> Result<Vec<Workspace>, String> {
    let shown = file.display();
    let path = std::path::absolute(file).map_err(|error| format!("`{shown}` is not a path: {error}"))?;
    if path.is_dir() {
        return Err(format!("`{shown}` is a folder: name a file"));
    }
    parent(&path)
        .canonicalize()
        .map_err(|error| format!("the folder of `{shown}` cannot be read: {error}"))?;
    let mut loader = Loader::new(allows_outside);
    loader.opened(db, &path, text, problem.map(Problem::Cut));
    loaded(loader, db, &[path])
}

fn loaded(mut loader: Loader, db: &mut Database, paths: &[PathBuf]) -> Result<Vec<Workspace>, String> {
    loop {
        if let Some(LoadedWorkspaces { workspaces, problems }) = loader.load(db, paths) {
            return problems.into_iter().next().map_or(Ok(workspaces), Err);
        }
        let mut search = loader.search();
        search.run(&|| false, &|_| {});
        loader.learn(db, search);
    }
}

/// What was loaded.
pub struct LoadedWorkspaces {
    /// The workspaces that the paths name.
    pub workspaces: Vec<Workspace>,
    /// Which paths do not exist or have no model in them, in words for the user.
    pub problems: Vec<String>,
}

/// Returns the canonical paths of the models that `paths` name or have in them, without those that a link in a folder leads
/// to elsewhere. Then the reasons why folders were not searched.
///
/// # Errors
///
/// A path that does not exist or has no model in it, in words for the user.
pub fn models_in(paths: &[PathBuf]) -> Result<(BTreeSet<PathBuf>, Vec<String>), String> {
    let (mut found, mut problems) = (BTreeSet::new(), Vec::new());
    for path in paths {
        let absolute =
            path.canonicalize().map_err(|error| format!("cannot read `{}`: {error}", path.display()))?;
        let beside =
            canonical_path(path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new(".")));
        if absolute.is_file() && !absolute.starts_with(beside) {
            let (path, absolute) = (path.display(), absolute.display());
            return Err(format!(
                "`{path}` is a link to a file outside the folder: name `{absolute}` instead"
            ));
        }
        let is_file = absolute.is_file();
        let folder = match NamedPath::new(path, absolute, is_file)? {
            NamedPath::Model(model) => {
                found.insert(model);
                continue;
            }
            NamedPath::Folder(folder) => folder,
        };
        let walk = Walk::Models { folder: folder.clone(), depth: None, is_own: false };
        let walked = walk.run(&mut KnownFolders::default(), &mut Left::default(), &|| false);
        problems.extend(walked.problems.iter().map(|(at, why)| format!("`{}`: {why}", at.display())));
        if walked.files.is_empty() && walked.problems.is_empty() {
            return Err(format!("no model (*.mal) in `{}`", path.display()));
        }
        let models = walked.files.iter().map(|model| canonical_path(model));
        found.extend(models.filter(|model| model.strip_prefix(&folder).is_ok_and(|below| !is_hidden(below))));
    }
    Ok((found, problems))
}

impl Loader {
    /// Creates a loader. Where it `allows_outside`, projects may read files outside their folders.
    pub fn new(allows_outside: bool) -> Loader {
        Loader { allows_outside, ..Loader::default() }
    }

    /// Returns a loader that has read nothing, with the options of this one.
    pub fn emptied(&self) -> Loader {
        Loader { significance: self.significance, ..Loader::new(self.allows_outside) }
    }

    /// The workspaces that `paths` name.
    ///
    /// A folder belongs to the workspace of the nearest `mauve.toml` above it; each `mauve.toml` below is a further
    /// workspace. A model is analysed as part of the projects that contain it.
    ///
    /// Returns `None` while a search is required.
    pub fn load(&mut self, db: &mut Database, paths: &[PathBuf]) -> Option<LoadedWorkspaces> {
        let before = std::mem::take(&mut self.watch_set);
        self.walks.asked.clear();
        self.packages.clear();
        self.left = LONGEST_TOGETHER;
        self.before = std::mem::take(&mut self.read);
        std::mem::take(&mut self.cut).iter().for_each(|path| _ = self.before.remove(path));
        self.absent.clear();
        self.refused.clear();
        self.named = paths.iter().map(|path| canonical_path(path)).collect();
        let mut problems = Vec::new();
        // The folders of the workspaces, in the order in which they were first named.
        let mut order: Vec<PathBuf> = Vec::new();
        let mut requests: BTreeMap<PathBuf, Requested> = BTreeMap::new();
        let mut add = |folder: PathBuf, model: Option<PathBuf>| {
            let requested = requests.entry(folder).or_insert_with_key(|folder| {
                order.push(folder.clone());
                Requested::default()
            });
            requested.all |= model.is_none();
            requested.models.extend(model);
        };
        // A folder or a model within one of these folders belongs to the outermost.
        let folders: Vec<PathBuf> = self.named.iter().filter(|path| path.is_dir()).cloned().collect();
        self.watch_set.tops.extend(folders.iter().map(|folder| parent(folder).to_owned()));
        for path in paths {
            let absolute = canonical_path(path);
            // A link on the way may lead elsewhere tomorrow.
            self.watch_set.add(path);
            if !self.edited.contains(&absolute)
                && let Err(error) = std::fs::metadata(&absolute)
            {
                problems.push(format!("cannot read `{}`: {error}", path.display()));
                continue;
            }
            let is_file = self.is_file(&absolute);
            let folder = match NamedPath::new(path, absolute, is_file) {
                Ok(NamedPath::Folder(folder)) => folder,
                Ok(NamedPath::Model(model)) => {
                    add(self.home(parent(&model), &folders), Some(model));
                    continue;
                }
                Err(problem) => {
                    problems.push(problem);
                    continue;
                }
            };
            let Some(found) = self.find(&folder, None, false) else { continue };
            let mut homes: BTreeSet<PathBuf> =
                found.configs.iter().filter_map(|it| Some(it.parent()?.to_owned())).collect();
            if found.files.iter().any(|model| owner(model, &homes).is_none()) {
                homes.insert(self.home(&folder, &folders));
            }
            if homes.is_empty() {
                let above = folder.ancestors().skip(1).find(|above| self.has_config(above));
                let above = above.map_or_else(String::new, |above| {
                    format!("; {CONFIG_FILE} is in `{}`: run the command there", above.display())
                });
                problems
                    .push(format!("no model (*.mal) and no {CONFIG_FILE} in `{}`{above}", path.display()));
            }
            homes.into_iter().for_each(|home| add(home, None));
        }
        // If there are too many files, those of open documents are read.
        let mut folders: Vec<&PathBuf> = order.iter().collect();
        folders.sort_by_key(|folder| requests[*folder].models.is_empty());
        let read = folders.iter().filter_map(|it| Some((*it, self.read(db, it, &requests[*it])?)));
        let read: HashMap<&PathBuf, Workspace> = read.collect();
        let workspaces: Vec<Workspace> =
            order.iter().filter_map(|folder| read.get(folder).copied()).collect();
        if self.walks.is_one_wanted() {
            // Until all walks are known, the old watch set stays in effect too, and what was read.
            self.watch_set.extend(before);
            let before = std::mem::take(&mut self.before);
            before.into_iter().for_each(|(path, read)| _ = self.read.entry(path).or_insert(read));
            return None;
        }
        let files = workspaces.iter().flat_map(|workspace| workspace.files(db).values());
        self.current = files.map(|file| file.path(db).clone()).collect();
        let configs = workspaces.iter().filter_map(|&workspace| config_file(db, workspace));
        self.configs = configs.map(|file| file.path(db).clone()).collect();
        Some(LoadedWorkspaces { workspaces, problems })
    }

    /// Drops the texts that a search has read, after the last load that needs them.
    pub fn forget_texts(&mut self) {
        self.texts = HashMap::new();
    }

    /// Returns whether a file belongs to the workspaces.
    pub fn has(&self, path: &Path) -> bool {
        self.current.contains(path)
    }

    /// Returns the files and folders whose changes may change the workspaces.
    pub fn watch_set(&mut self) -> &mut WatchSet {
        &mut self.watch_set
    }

    /// Returns the files that were read, the paths that were looked up, and the folders whose entries were.
    pub fn in_use(&self) -> BTreeSet<PathBuf> {
        let WatchSet { folders, below, message_folders, paths, .. } = &self.watch_set;
        self.read.keys().chain(paths).chain(folders).chain(below).chain(message_folders).cloned().collect()
    }

    /// Reads a changed file again. Returns whether that is sufficient: the file belongs to the workspaces, searches know it, it is not a
    /// link, and its text does not determine which files they have. Otherwise the workspaces must be loaded again.
    pub fn refreshed(&mut self, db: &mut Database, path: &Path) -> Option<bool> {
        let is_there = std::fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
        let is_known = self.has(path) && !self.folders.lacks(path);
        if !is_there || !is_known || self.absent.contains(path) || self.is_config(path) {
            return None;
        }
        let file = *self.files.get(path)?;
        let measured =
            |db: &Database| if is_model(path) { BTreeSet::new() } else { measured_files(db, file) };
        let before = measured(db);
        let is_changed = self.changed(db, path);
        let is_same = before == measured(db) && !(is_model(path) && is_foreign(db, file));
        self.is_load_due |= !is_same;
        is_same.then_some(is_changed)
    }

    /// Returns whether this is the configuration of a workspace, or would be if it existed.
    pub fn is_config(&self, path: &Path) -> bool {
        path.ends_with(CONFIG_FILE) || self.configs.contains(&canonical_path(path))
    }

    /// Sets the significance level that is shown; `None` selects the level of each `mauve.toml`. Returns whether the
    /// level has changed.
    pub fn set_significance(&mut self, db: &mut Database, level: Option<Level>) -> bool {
        if self.significance == level {
            return false;
        }
        self.significance = level;
        for workspace in self.workspaces.values() {
            workspace.set_significance(db).to(level);
        }
        true
    }

    /// Takes a file's text from an editor, until [`Loader::closed`].
    pub fn opened(&mut self, db: &mut Database, path: &Path, text: &str, problem: Option<Problem>) -> File {
        let canonical = canonical_path(path);
        let is_new = self.edited.insert(canonical.clone());
        if is_new && let Some(file) = self.files.get(&canonical) {
            // Edits are likely from now on, also if the text is that of the disk.
            file.set_text_with(db, text.into(), Durability::LOW);
        }
        put(db, &mut self.files, canonical, text, problem, Durability::LOW)
    }

    /// Returns whether a project names this file, and may not read it from the disk. It may read the text in an editor.
    pub fn is_refused(&self, path: &Path) -> bool {
        self.refused.contains(&canonical_path(path))
    }

    /// Returns the workspace of a text that is no file on the disk.
    pub fn alone(&mut self, db: &mut Database, file: File) -> Workspace {
        let path = file.path(db).clone();
        let workspace = match self.workspaces.get(&path) {
            Some(&workspace) => workspace,
            None => {
                let files = BTreeMap::from([(path.clone(), file)]);
                self.new_workspace(db, path, PathBuf::new(), files, vec![file])
            }
        };
        self.find_packages(db, workspace);
        workspace
    }

    fn new_workspace(
        &mut self,
        db: &Database,
        key: PathBuf,
        folder: PathBuf,
        files: BTreeMap<PathBuf, File>,
        only: Vec<File>,
    ) -> Workspace {
        let files = Arc::new(files);
        let workspace = Workspace::builder(folder, files, model_path(), only, Vec::new(), Arc::default())
            .significance(self.significance)
            .durability(Durability::HIGH)
            .new(db);
        self.workspaces.insert(key, workspace);
        workspace
    }

    /// The workspace of a folder, whose configuration is the only file in `files`, or absent.
    fn with_config(
        &mut self,
        db: &mut Database,
        folder: &Path,
        config: &Path,
        files: &BTreeMap<PathBuf, File>,
    ) -> Workspace {
        let Some(&workspace) = self.workspaces.get(folder) else {
            return self.new_workspace(db, folder.to_owned(), folder.to_owned(), files.clone(), Vec::new());
        };
        if workspace.files(db).get(config) != files.get(config) {
            let mut known = BTreeMap::clone(workspace.files(db));
            known.remove(config);
            known.extend(files.clone());
            workspace.set_files(db).to(Arc::new(known));
        }
        workspace
    }

    /// Reads the message packages that the models of a workspace name, where they are installed.
    fn find_packages(&mut self, db: &mut Database, workspace: Workspace) {
        let mut found = BTreeMap::new();
        for name in named_packages(db, workspace) {
            let package = self.packages.entry(name.clone()).or_insert_with(|| {
                let places = Places::of_environment();
                self.watch_set.message_folders.extend(places.folders(name));
                places.read(name).map(Arc::new)
            });
            found.extend(package.clone().map(|package| (name.clone(), package)));
        }
        set_changed!(db, workspace: packages = set_packages(Arc::new(found)));
    }

    /// Looks at the sample files and the sources that the tables name: at their sizes, and at the content of sources.
    fn find_measured(&mut self, db: &mut Database, workspace: Workspace) {
        let mut found = BTreeMap::new();
        let tables = table_files(db, workspace).files.clone();
        for (path, is_source) in tables.into_iter().flat_map(|table| measured_files(db, table)) {
            self.watch_set.add(&path);
            self.watch_set.folders.extend(path.parent().filter(|it| it.is_dir()).map(Path::to_owned));
            let canonical = canonical_path(&path);
            let data = canonical.metadata().ok().filter(std::fs::Metadata::is_file);
            let Some(data) = data.filter(|_| self.boundary.refusal(&canonical).is_none()) else { continue };
            let content = is_source.then(|| disk::read(&canonical, LONGEST).ok()).flatten();
            found.insert(path, OnDisk { length: data.len(), digest: content.map(|it| digest_of(&it)) });
        }
        set_changed!(db, workspace: measured_files = set_measured_files(Arc::new(found)));
    }

    /// Takes a file's text from the disk again, since the editor has closed it. Returns whether the workspaces must
    /// be loaded again, since a project may not read the file from the disk.
    pub fn closed(&mut self, db: &mut Database, file: File) -> bool {
        let canonical = file.path(db).clone();
        if self.edited.remove(&canonical) {
            // What was shown of no file is needed no more.
            let text = if canonical.is_absolute() { file.text(db).clone() } else { "".into() };
            file.set_text_with(db, text, Durability::HIGH);
        }
        self.changed(db, &canonical);
        !self.read.contains_key(&canonical) || self.refused.contains(&canonical)
    }

    /// Reads a file again that may have changed on the disk, if it was read before. Returns whether the text has
    /// changed.
    pub fn changed(&mut self, db: &mut Database, path: &Path) -> bool {
        let canonical = canonical_path(path);
        self.texts.remove(&canonical);
        self.touched.insert(canonical.clone());
        if self.edited.contains(&canonical) {
            return false;
        }
        // A file that only the editor provided is not read from the disk; neither are bytes beyond the limits.
        let Some((before, file)) = self.read.get(&canonical).copied() else { return false };
        let (mut text, mut problem) = text_of(&canonical);
        match (self.left + before).checked_sub(text.len() as u64) {
            Some(left) => {
                self.left = left;
                self.read.insert(canonical, (text.len() as u64, file));
            }
            None => {
                self.cut.insert(canonical.clone());
                text.clear();
                problem = Some("this file has grown too long, and is not read".to_owned());
            }
        }
        write(db, file, &text, problem.map(Problem::Cut), Durability::HIGH)
    }

    fn is_file(&self, canonical: &Path) -> bool {
        self.edited.contains(canonical) || canonical.is_file()
    }

    /// Returns whether a folder has a configuration, or a broken link or a folder named like one. Then the
    /// configurations above do not apply.
    fn has_config(&self, folder: &Path) -> bool {
        let config = folder.join(CONFIG_FILE);
        self.edited.contains(&config) || config.symlink_metadata().is_ok()
    }

    /// Returns the nearest folder above with a `mauve.toml`; without one, the outermost of `folders` that contains
    /// `folder`, or `folder` itself.
    fn home(&mut self, folder: &Path, folders: &[PathBuf]) -> PathBuf {
        for above in folder.ancestors() {
            self.watch_set.add(&above.join(CONFIG_FILE));
            if self.has_config(above) {
                return above.to_owned();
            }
        }
        let outermost = folder.ancestors().filter(|above| folders.iter().any(|it| it == above)).last();
        outermost.unwrap_or(folder).to_owned()
    }

    /// Returns the models and configurations below `folder`, its own or all; `None` while a walk through it is required.
    fn find(&mut self, folder: &Path, depth: Option<usize>, is_own: bool) -> Option<Walked> {
        let walk = |is_own| Walk::Models { folder: folder.to_owned(), depth, is_own };
        // All are its own where no other configuration is below.
        let own = folder.join(CONFIG_FILE);
        let is_all =
            self.walks.known.get(&walk(false)).is_some_and(|all| all.configs.iter().all(|it| *it == own));
        let mut found = self.walked(walk(is_own && !is_all))?;
        // Those that an editor has and has not saved yet.
        let new = self.edited.iter().filter(|path| depth.is_none() && path.starts_with(folder));
        let new = new.filter(|path| path.ends_with(CONFIG_FILE) && !path.exists());
        found.configs.extend(new.cloned());
        Some(found)
    }

    /// Returns the result of a walk, and watches its folders; `None` while the walk is required.
    fn walked(&mut self, walk: Walk) -> Option<Walked> {
        let walked = self.walks.walked(&walk)?;
        let folders = walked.folders.iter().cloned();
        match walk {
            Walk::Models { folder, .. } => {
                self.watch_set.roots.insert(folder);
                self.watch_set.below.extend(folders);
            }
            Walk::Tables { .. } => self.watch_set.folders.extend(folders),
        }
        let (files, configs, problems) =
            (walked.files.clone(), walked.configs.clone(), walked.problems.clone());
        Some(Walked { folders: Vec::new(), files, configs, problems })
    }

    /// Reads the workspace of `folder`: its models, its configuration, the tables that this names, and the files that the
    /// models include from other folders. Returns `None` while a walk is required.
    fn read(&mut self, db: &mut Database, folder: &Path, requested: &Requested) -> Option<Workspace> {
        self.boundary = ProjectBoundary::new(folder, &self.named, model_path(), self.allows_outside);
        self.watch_set.tops.insert(self.boundary.outermost(folder.parent().unwrap_or(folder)).to_owned());
        self.home(folder, &[]);
        for above in folder.ancestors() {
            self.watch_set.add(&above.join(".gitignore"));
            self.watch_set.add(&above.join(".ignore"));
        }
        let config = folder.join(CONFIG_FILE);
        // A single model is analysed together with the other models of its folder.
        let depth = if requested.all || self.has_config(folder) { None } else { Some(1) };
        let found = self.find(folder, depth, true)?;
        let inner: BTreeSet<PathBuf> = found
            .configs
            .iter()
            .filter_map(|config| Some(config.parent()?.to_owned()))
            .filter(|it| it != folder)
            .collect();
        let mut files = BTreeMap::new();
        if self.has_config(folder) {
            self.add(db, &mut files, &config);
        }
        let workspace = self.with_config(db, folder, &config, &files);
        let config = config_of(db, workspace).clone();
        // All walks that are required are collected.
        let tables: Vec<Option<Walked>> =
            config.all_patterns().map(|(pattern, _)| self.tables(folder, pattern)).collect();
        let tables = tables.into_iter().collect::<Option<Vec<Walked>>>()?;
        for path in found.files.iter().filter(|model| owner(model, &inner).is_none()) {
            self.add(db, &mut files, path);
            // The file was found by its extension, which the Meta Attack Language uses too.
            if files.get(path).is_some_and(|&file| is_foreign(db, file)) {
                files.remove(path);
            }
        }
        for (folder, why) in found.problems {
            // This placeholder represents the unread models of the folder.
            let path = folder.join("*.mal");
            let file = put(db, &mut self.files, path.clone(), "", Some(Problem::Cut(why)), Durability::HIGH);
            files.insert(path, file);
        }
        for path in &requested.models {
            self.add(db, &mut files, path);
        }
        for (root, _) in &config.roots {
            let root = normalised(&folder.join(root));
            self.watch_set.add(&root);
            if self.is_file(&root) {
                self.add(db, &mut files, &root);
            }
        }
        tables.iter().flat_map(|it| &it.files).for_each(|path| self.add(db, &mut files, path));
        let problems = tables.iter().flat_map(|it| &it.problems);
        let only = requested.models.iter().filter(|_| !requested.all);
        set_changed!(
            db, workspace:
            only = set_only(only.filter_map(|only| files.get(only).copied()).collect::<Vec<File>>()),
            unreadable = set_unreadable(
                problems.map(|(path, why)| format!("`{}`: {why}", path.display())).collect::<Vec<String>>()
            ),
        );
        let own: BTreeSet<PathBuf> = files.keys().cloned().collect();
        self.follow_includes(db, workspace, &mut files);
        let included: BTreeSet<PathBuf> = files.keys().filter(|path| !own.contains(*path)).cloned().collect();
        set_changed!(
            db, workspace:
            files = set_files(Arc::new(files)),
            included = set_included(Arc::new(included)),
        );
        self.find_packages(db, workspace);
        self.find_measured(db, workspace);
        Some(workspace)
    }

    /// Adds a file to a workspace, and reads it, since it may not have been watched until now.
    fn add(&mut self, db: &mut Database, files: &mut BTreeMap<PathBuf, File>, path: &Path) {
        if files.contains_key(path) {
            return;
        }
        let is_walked = self.folders.has_regular(path);
        let canonical = if is_walked { path.to_owned() } else { canonical_path(path) };
        if !is_walked {
            let folders = [path, &canonical].map(|path| path.parent().unwrap_or(path).to_owned());
            self.watch_set.folders.extend(folders);
        }
        if path != canonical {
            self.watch_set.add(path);
        }
        let refusal = self.boundary.refusal(&canonical);
        if refusal.is_some() {
            self.refused.insert(canonical.clone());
        }
        let file = match self.files.get(&canonical) {
            Some(&file) if self.edited.contains(&canonical) => {
                if !canonical.exists() {
                    self.absent.insert(canonical.clone());
                }
                // When the editor closes the file, it is read from the disk if the boundary permits that.
                if refusal.is_none() {
                    self.read.entry(canonical).or_insert((0, file));
                }
                file
            }
            _ => match refusal.filter(|_| is_walked || canonical.exists()) {
                // Such a file has no text, and is known by the path that leads to it.
                Some(why) => {
                    let problem = Some(Problem::Cut(why));
                    match self.outside.get(path).copied() {
                        Some(file) => {
                            write(db, file, "", problem, Durability::HIGH);
                            file
                        }
                        None => {
                            let file = File::outside(db, path.to_owned(), problem);
                            self.outside.insert(path.to_owned(), file);
                            file
                        }
                    }
                }
                None => self.read_file(db, canonical),
            },
        };
        files.insert(path.to_owned(), file);
    }

    /// Reads a permitted file once for all projects that contain it.
    fn read_file(&mut self, db: &mut Database, canonical: PathBuf) -> File {
        if let Some(&(_, file)) = self.read.get(&canonical) {
            return file;
        }
        let walked = self.texts.get(&canonical).cloned();
        if walked.is_none()
            && let Some(&(length, file)) = self.before.get(&canonical)
            && let Some(left) = self.left.checked_sub(length)
        {
            self.left = left;
            self.read.insert(canonical, (length, file));
            return file;
        }
        let (mut text, mut problem) = walked.unwrap_or_else(|| text_of(&canonical));
        match self.left.checked_sub(text.len() as u64) {
            Some(left) => self.left = left,
            None => {
                self.cut.insert(canonical.clone());
                text.clear();
                let most = LONGEST_TOGETHER >> 20;
                problem = Some(format!(
                    "the files of this project are larger than {most} MiB together: this file is not read"
                ));
            }
        }
        let file =
            put(db, &mut self.files, canonical.clone(), &text, problem.map(Problem::Cut), Durability::HIGH);
        self.read.insert(canonical, (text.len() as u64, file));
        file
    }

    fn follow_includes(
        &mut self,
        db: &mut Database,
        workspace: Workspace,
        files: &mut BTreeMap<PathBuf, File>,
    ) {
        let models = files.values().copied().filter(|file| is_model(file.path(db)));
        let mut seen: BTreeSet<PathBuf> = models.clone().map(|file| file.path(db).clone()).collect();
        let mut open: Vec<File> = models.collect();
        while let Some(file) = open.pop() {
            for include in file.outline(db).includes.clone().iter().flatten() {
                let candidates = include_candidates(db, workspace, file, include);
                let found = candidates.iter().position(|path| self.is_file(path));
                // A candidate that comes first may be created later.
                candidates
                    .iter()
                    .take(found.unwrap_or(candidates.len()))
                    .for_each(|path| self.watch_set.add(path));
                let Some(path) = found.and_then(|index| candidates.get(index)) else { continue };
                self.add(db, files, path);
                if let Some(&file) = files.get(path)
                    && seen.insert(file.path(db).clone())
                {
                    open.push(file);
                }
            }
        }
    }

    /// Returns the files that a pattern of `[timing] tables` names, whether they can be read or not, and the problems of
    /// folders; `None` while a walk is required.
    fn tables(&mut self, folder: &Path, pattern: &str) -> Option<Walked> {
        let Ok(glob) = table_pattern(folder, pattern) else { return Some(Walked::default()) };
        let is_fixed = |part: &std::path::Component<'_>| {
            !part.as_os_str().to_string_lossy().contains(['*', '?', '[', '{'])
        };
        let parts: Vec<_> = Path::new(pattern).components().collect();
        let fixed: PathBuf = parts.iter().take_while(|part| is_fixed(part)).collect();
        let from = normalised(&folder.join(&fixed));
        self.watch_set.add(&from);
        self.watch_set.patterns.push(glob.clone());
        if parts.iter().all(is_fixed) {
            let is_there = self.edited.contains(&from) || from.symlink_metadata().is_ok();
            let files = Some(from).filter(|_| is_there).into_iter().collect();
            return Some(Walked { files, ..Walked::default() });
        }
        let depth = parts.len() - fixed.components().count();
        let depth = if pattern.contains("**") { None } else { Some(depth) };
        let (folder, pattern) = (folder.to_owned(), pattern.to_owned());
        let boundary = self.boundary.clone();
        let mut found = self.walked(Walk::Tables { from, depth, folder, pattern, boundary })?;
        let new = self.edited.iter().filter(|path| !path.exists() && glob.is_match(path));
        found.files.extend(new.cloned());
        Some(found)
    }
}

/// Returns the files that the measurements of a table name, and whether each is the source of a codel.
fn measured_files(db: &dyn ModelDb, file: File) -> BTreeSet<(PathBuf, bool)> {
    let folder = parent(file.path(db));
    let records = table(db, file).measured.iter();
    let samples = records.clone().flat_map(|it| &it.files).map(|path| (path, false));
    let sources = records.filter_map(|it| it.source.as_ref()).map(|path| (path, true));
    samples.chain(sources).map(|(path, is_source)| (normalised(&folder.join(path)), is_source)).collect()
}

/// Returns whether a file is in the Meta Attack Language. Memoised, since each load of a workspace needs it.
#[salsa::tracked(returns(copy))]
fn is_foreign(db: &dyn ModelDb, file: File) -> bool {
    is_of_another_language(file.text(db))
}

fn model_path() -> Vec<PathBuf> {
    let Some(folders) = std::env::var_os("MAUVE_MODELS") else { return Vec::new() };
    std::env::split_paths(&folders).filter(|folder| !folder.as_os_str().is_empty()).collect()
}

fn owner<'a>(model: &Path, homes: &'a BTreeSet<PathBuf>) -> Option<&'a PathBuf> {
    model.ancestors().find_map(|above| homes.get(above))
}

fn parent(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new("/"))
}

/// Returns the file of this path with this text.
fn put(
    db: &mut Database,
    files: &mut BTreeMap<PathBuf, File>,
    path: PathBuf,
    text: &str,
    problem: Option<Problem>,
    durability: Durability,
) -> File {
    match files.get(&path) {
        Some(&file) => {
            write(db, file, text, problem, durability);
            file
        }
        None => {
            let file = File::with_durability(db, path.clone(), text.into(), problem, durability);
            files.insert(path, file);
            file
        }
    }
}

/// Sets a text if it has changed, since setting an input cancels all queries. Returns whether it has.
fn write(
    db: &mut Database,
    file: File,
    text: &str,
    problem: Option<Problem>,
    durability: Durability,
) -> bool {
    let (is_text, is_problem) = (**file.text(db) != *text, *file.problem(db) != problem);
    if is_text {
        file.set_text_with(db, text.into(), durability);
    }
    if is_problem {
        file.set_problem(db).to(problem);
    }
    is_text || is_problem
}

/// Returns the canonical path of a file, or of its folder and its name if the file does not exist.
pub fn canonical_path(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| {
        let folder = path.parent().and_then(|folder| folder.canonicalize().ok());
        folder.zip(path.file_name()).map_or_else(|| path.to_owned(), |(folder, name)| folder.join(name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_changes_after_it_was_read_ahead_is_read_again() {
        let top = mauve_tests::own_scratch("read-ahead").canonicalize().unwrap();
        for name in ["a", "b"] {
            std::fs::write(top.join(name).with_extension("mal"), "codel old(): int\n").unwrap();
        }
        let (mut db, mut loader) = (Database::default(), Loader::new(false));
        let searched = |loader: &mut Loader| {
            let mut search = loader.search();
            search.run(&|| false, &|_| {});
            search
        };
        let texts = |loader: &Loader, db: &Database| {
            ["a.mal", "b.mal"].map(|name| loader.files[&top.join(name)].text(db).to_string())
        };
        while loader.load(&mut db, std::slice::from_ref(&top)).is_none() {
            let search = searched(&mut loader);
            loader.learn(&db, search);
        }
        let old = "codel old(): int\n".to_owned();
        assert_eq!(texts(&loader, &db), [old.clone(), old.clone()]);
        let new = "codel new(): int\n".to_owned();
        // The folder was not watched until now.
        loader.distrust(|_| Some(false), &BTreeSet::new());
        let search = searched(&mut loader);
        std::fs::write(top.join("a.mal"), &new).unwrap();
        assert_eq!(loader.refreshed(&mut db, &top.join("a.mal")), Some(true));
        // The server was not told of this change yet.
        std::fs::write(top.join("b.mal"), &new).unwrap();
        assert_eq!(loader.learn(&db, search), (false, false));
        assert!(loader.load(&mut db, std::slice::from_ref(&top)).is_some());
        assert_eq!(texts(&loader, &db), [new.clone(), old]);
        // It is told of it among many others, which a search reads.
        assert!(loader.note(&top.join("b.mal"), false));
        let search = searched(&mut loader);
        assert_eq!(loader.learn(&db, search), (true, false));
        assert!(loader.load(&mut db, std::slice::from_ref(&top)).is_some());
        assert_eq!(texts(&loader, &db), [new.clone(), new]);
        std::fs::remove_dir_all(&top).unwrap();
    }
}
