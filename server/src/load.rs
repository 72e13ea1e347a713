//! From paths to workspaces in the database: the only place that reads models from the disk.

mod packages;
mod surroundings;

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ignore::WalkBuilder;
use mauve_model::item_tree::Name;
use mauve_model::{
    CONFIG_FILE, DECLARATIONS, Database, File, ModelDb, Package, Problem, Workspace, config_file, config_of,
    include_candidates, includes, is_model, item_tree_of, named_packages, normalised, table_pattern,
};
use mauve_timing::Level;
use salsa::Setter;

use packages::Places;
use surroundings::Surroundings;

/// Folders that hold what tools made.
const MADE_BY_TOOLS: [&str; 4] = ["build", "devel", "install", "log"];

/// A file that is longer is not read.
pub(crate) const LONGEST: u64 = 1 << 28;

/// The texts that were read, and the workspaces that they make up.
///
/// The command line loads once. The server loads again whenever a file comes or goes: what is there already keeps its
/// inputs, so that nothing is analysed again but what changed.
#[derive(Default)]
pub(crate) struct Loader {
    /// By the path behind all links, so that two ways to one file give one file.
    files: BTreeMap<PathBuf, File>,
    /// By their folders.
    workspaces: BTreeMap<PathBuf, Workspace>,
    /// Files whose text is an editor's, whatever the disk has.
    edited: BTreeSet<PathBuf>,
    /// Where files may come and go.
    surroundings: Surroundings,
    /// The files of the workspaces, and those of them that are configurations, whatever they are called.
    current: BTreeSet<PathBuf>,
    configs: BTreeSet<PathBuf>,
    /// The message packages that were asked for, where they are installed.
    packages: BTreeMap<Name, Option<Arc<Package>>>,
    /// The significance level that is shown in all workspaces, those that are yet to come too; see
    /// [`Workspace::significance`].
    significance: Option<Level>,
}

/// What is to be read of a folder.
#[derive(Default)]
struct Asked {
    /// All of its models, and not only those below?
    whole: bool,
    /// Models that were named.
    models: Vec<PathBuf>,
    /// What is in it, where that was looked for already.
    found: Option<Found>,
}

/// The workspaces that `paths` name, the current folder without any.
///
/// # Errors
///
/// A path that does not exist or has no model in it, in words for the user.
pub(crate) fn load(db: &mut Database, paths: &[PathBuf]) -> Result<Vec<Workspace>, String> {
    let here = [PathBuf::from(".")];
    let paths = if paths.is_empty() { &here[..] } else { paths };
    let (workspaces, problems) = Loader::default().load(db, paths);
    match problems.into_iter().next() {
        Some(problem) => Err(problem),
        None => Ok(workspaces),
    }
}

/// The models that `paths` name or have in them, by the path behind all links and in its order; those of the current folder
/// without any. What a link in a folder leads to elsewhere is not in it.
///
/// # Errors
///
/// A path that does not exist or has no model in it, in words for the user.
pub(crate) fn models_in(paths: &[PathBuf]) -> Result<BTreeSet<PathBuf>, String> {
    let here = [PathBuf::from(".")];
    let paths = if paths.is_empty() { &here[..] } else { paths };
    let mut found = BTreeSet::new();
    for path in paths {
        let absolute =
            path.canonicalize().map_err(|error| format!("cannot read `{}`: {error}", path.display()))?;
        let is_config = absolute.ends_with(CONFIG_FILE);
        if absolute.is_file() && !is_config {
            if !is_model(&absolute) {
                let path = path.display();
                return Err(format!("`{path}` is no model (*.mal), no {CONFIG_FILE} and no folder"));
            }
            found.insert(absolute);
            continue;
        }
        let folder = if is_config { absolute.parent().unwrap_or(Path::new("/")) } else { &absolute };
        let models = Loader::default().find(folder, None).models;
        if models.is_empty() {
            return Err(format!("no model (*.mal) in `{}`", path.display()));
        }
        found.extend(models.iter().map(|model| place(model)).filter(|model| model.starts_with(folder)));
    }
    Ok(found)
}

impl Loader {
    /// The workspaces that `paths` name; and which paths do not exist or have no model in them, in words for the user.
    ///
    /// A folder is the workspace of the nearest `mauve.toml` above it, and there is one more for each `mauve.toml` below.
    /// A model is seen as part of the projects that have it.
    pub(crate) fn load(&mut self, db: &mut Database, paths: &[PathBuf]) -> (Vec<Workspace>, Vec<String>) {
        self.surroundings = Surroundings::default();
        self.packages.clear();
        let mut problems = Vec::new();
        let mut asked: Vec<(PathBuf, Asked)> = Vec::new();
        let mut index: BTreeMap<PathBuf, usize> = BTreeMap::new();
        let mut of_folder = |asked: &mut Vec<(PathBuf, Asked)>, folder: PathBuf| {
            *index.entry(folder.clone()).or_insert_with(|| {
                asked.push((folder, Asked::default()));
                asked.len() - 1
            })
        };
        // A folder or a model within one of these folders belongs to the outermost.
        let folders: Vec<PathBuf> =
            paths.iter().map(|path| place(path)).filter(|path| path.is_dir()).collect();
        for path in paths {
            let absolute = place(path);
            // A link on the way may lead elsewhere tomorrow.
            self.surroundings.await_path(path);
            if !self.edited.contains(&absolute)
                && let Err(error) = std::fs::metadata(&absolute)
            {
                problems.push(format!("cannot read `{}`: {error}", path.display()));
                continue;
            }
            let is_config = absolute.ends_with(CONFIG_FILE);
            if self.is_file(&absolute) && !is_config {
                if !is_model(&absolute) {
                    let path = path.display();
                    problems.push(format!("`{path}` is no model (*.mal), no {CONFIG_FILE} and no folder"));
                    continue;
                }
                let folder = self.home(absolute.parent().unwrap_or(Path::new("/")), &folders);
                let at = of_folder(&mut asked, folder);
                asked[at].1.models.push(absolute);
                continue;
            }
            let folder =
                if is_config { absolute.parent().unwrap_or(Path::new("/")).to_owned() } else { absolute };
            let found = self.find(&folder, None);
            let mut homes: BTreeSet<PathBuf> =
                found.configs.iter().filter_map(|it| Some(it.parent()?.to_owned())).collect();
            if found.models.iter().any(|model| owner(model, &homes).is_none()) {
                homes.insert(self.home(&folder, &folders));
            }
            if homes.is_empty() {
                problems.push(format!("no model (*.mal) and no {CONFIG_FILE} in `{}`", path.display()));
            }
            let mut found = Some(found);
            for home in homes {
                let is_looked_for = home == folder;
                let at = of_folder(&mut asked, home);
                asked[at].1.whole = true;
                if is_looked_for {
                    asked[at].1.found = found.take();
                }
            }
        }
        let read = asked.into_iter().map(|(folder, asked)| self.read(db, &folder, asked));
        let workspaces: Vec<Workspace> = read.collect();
        let files = workspaces.iter().flat_map(|workspace| workspace.files(db).values());
        self.current = files.map(|file| file.path(db).clone()).collect();
        let configs = workspaces.iter().filter_map(|&workspace| config_file(db, workspace));
        self.configs = configs.map(|file| file.path(db).clone()).collect();
        (workspaces, problems)
    }

    /// Where files may come and go.
    pub(crate) fn surroundings(&mut self) -> &mut Surroundings {
        &mut self.surroundings
    }

    /// Reads a file again that something has happened to. Says whether that is all: it is one of the workspaces and no link
    /// to one, and which files those have does not rest on its text. Otherwise they are to be loaded again.
    pub(crate) fn refreshed(&mut self, db: &mut Database, path: &Path) -> Option<bool> {
        let is_there = std::fs::symlink_metadata(path).is_ok_and(|data| data.is_file());
        if !is_there || !self.current.contains(path) || self.is_config(path) {
            return None;
        }
        let is_changed = self.changed(db, path);
        let file = self.files.get(path)?;
        (!is_model(path) || !is_foreign(db, *file)).then_some(is_changed)
    }

    /// Is this the configuration of a workspace, or of one to be?
    pub(crate) fn is_config(&self, path: &Path) -> bool {
        path.ends_with(CONFIG_FILE) || self.configs.contains(&place(path))
    }

    /// Shows everything at this significance level from now on, or at that of each `mauve.toml`. Says whether it was
    /// another one before.
    pub(crate) fn set_significance(&mut self, db: &mut Database, level: Option<Level>) -> bool {
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
    pub(crate) fn opened(
        &mut self,
        db: &mut Database,
        path: &Path,
        text: &str,
        problem: Option<Problem>,
    ) -> File {
        let place = place(path);
        self.edited.insert(place.clone());
        self.put(db, place, text, problem)
    }

    /// The file at `place` with this text.
    fn put(&mut self, db: &mut Database, place: PathBuf, text: &str, problem: Option<Problem>) -> File {
        match self.files.get(&place) {
            Some(&file) => {
                write(db, file, text, problem);
                file
            }
            None => {
                let file = File::new(db, place.clone(), text.into(), problem);
                self.files.insert(place, file);
                file
            }
        }
    }

    /// The workspace of a text that is no file on the disk.
    pub(crate) fn alone(&mut self, db: &mut Database, file: File) -> Workspace {
        let path = file.path(db).clone();
        let workspace = *self.workspaces.entry(path.clone()).or_insert_with(|| {
            let files = Arc::new(BTreeMap::from([(path, file)]));
            Workspace::builder(PathBuf::new(), files, model_path(), vec![file], Vec::new(), Arc::default())
                .significance(self.significance)
                .new(db)
        });
        self.find_packages(db, workspace);
        workspace
    }

    /// Reads the message packages that the models of a workspace name, where they are installed.
    fn find_packages(&mut self, db: &mut Database, workspace: Workspace) {
        let mut found = BTreeMap::new();
        for name in named_packages(db, workspace) {
            let package = self.packages.entry(name.clone()).or_insert_with(|| {
                let places = Places::of_environment();
                for folder in places.folders(name) {
                    self.surroundings.read_messages(folder);
                }
                places.read(name).map(Arc::new)
            });
            found.extend(package.clone().map(|package| (name.clone(), package)));
        }
        if **workspace.packages(db) != found {
            workspace.set_packages(db).to(Arc::new(found));
        }
    }

    /// Takes a file's text from the disk again.
    pub(crate) fn closed(&mut self, db: &mut Database, file: File) {
        let place = file.path(db).clone();
        self.edited.remove(&place);
        self.changed(db, &place);
    }

    /// Reads a file again that may have changed on the disk, if it was read before. Says whether it is another one now.
    pub(crate) fn changed(&mut self, db: &mut Database, path: &Path) -> bool {
        let place = place(path);
        if self.edited.contains(&place) {
            return false;
        }
        self.files.get(&place).copied().is_some_and(|file| {
            let (text, problem) = text_of(&place);
            write(db, file, &text, problem.map(Problem::Cut))
        })
    }

    fn is_file(&self, place: &Path) -> bool {
        self.edited.contains(place) || place.is_file()
    }

    /// Has a folder a configuration, or a link that leads nowhere or a folder in its place? Then the configuration of a
    /// folder above does not count.
    fn has_config(&self, folder: &Path) -> bool {
        let config = folder.join(CONFIG_FILE);
        self.edited.contains(&config) || config.symlink_metadata().is_ok()
    }

    /// The folder whose `mauve.toml` is the nearest above; without any, the outermost of `folders` that has it, or `folder`
    /// itself.
    fn home(&mut self, folder: &Path, folders: &[PathBuf]) -> PathBuf {
        for above in folder.ancestors() {
            self.surroundings.await_path(&above.join(CONFIG_FILE));
            if self.has_config(above) {
                return above.to_owned();
            }
        }
        let outermost = folder.ancestors().filter(|above| folders.iter().any(|it| it == above)).last();
        outermost.unwrap_or(folder).to_owned()
    }

    /// The models and configurations below `folder`, without what tools made and what `.gitignore` names.
    fn find(&mut self, folder: &Path, depth: Option<usize>) -> Found {
        let mut found = Found { models: Vec::new(), configs: Vec::new() };
        let made = |name: &std::ffi::OsStr| MADE_BY_TOOLS.iter().any(|made| name == *made);
        let walk = WalkBuilder::new(folder)
            .require_git(false)
            .max_depth(depth)
            .sort_by_file_path(Path::cmp)
            .filter_entry(move |entry| {
                entry.depth() == 0 || !made(entry.file_name()) || entry.path().is_file()
            })
            .build();
        for entry in walk.flatten() {
            let path = entry.path();
            // A link that leads nowhere is read as well: that it cannot be is said.
            let is_text = path.is_file() || entry.path_is_symlink() && !path.exists();
            if path.ends_with(CONFIG_FILE) && entry.depth() > 0 {
                found.configs.push(path.to_owned());
            } else if entry.file_type().is_some_and(|kind| kind.is_dir()) {
                self.surroundings.look_through(path.to_owned());
            } else if is_model(path) && is_text {
                found.models.push(path.to_owned());
            }
        }
        // Those that an editor has and has not saved yet.
        let new = self.edited.iter().filter(|path| depth.is_none() && path.starts_with(folder));
        let new = new.filter(|path| path.ends_with(CONFIG_FILE) && !path.exists());
        found.configs.extend(new.cloned());
        found
    }

    /// Reads the workspace of `folder`: its models, its configuration, the tables that this names, and whatever the
    /// models include from elsewhere.
    fn read(&mut self, db: &mut Database, folder: &Path, asked: Asked) -> Workspace {
        self.home(folder, &[]);
        for above in folder.ancestors() {
            self.surroundings.await_path(&above.join(".gitignore"));
            self.surroundings.await_path(&above.join(".ignore"));
        }
        let config = folder.join(CONFIG_FILE);
        // A model by itself is seen together with what stands beside it.
        let depth = if asked.whole || self.has_config(folder) { None } else { Some(1) };
        let found = asked.found.unwrap_or_else(|| self.find(folder, depth));
        let inner: BTreeSet<PathBuf> = found
            .configs
            .iter()
            .filter_map(|config| Some(config.parent()?.to_owned()))
            .filter(|it| it != folder)
            .collect();
        let mut files = BTreeMap::new();
        for path in found.models.iter().filter(|model| owner(model, &inner).is_none()) {
            self.add(db, &mut files, path);
            // Nobody names it: it may be of the other language that has this extension.
            if files.get(path).is_some_and(|&file| is_foreign(db, file)) {
                files.remove(path);
            }
        }
        for path in &asked.models {
            self.add(db, &mut files, path);
        }
        if self.has_config(folder) {
            self.add(db, &mut files, &config);
        }
        let only: Vec<File> = match asked.whole {
            true => Vec::new(),
            false => asked.models.iter().filter_map(|only| files.get(only).copied()).collect(),
        };
        let workspace = match self.workspaces.get(folder) {
            Some(&workspace) => {
                if workspace.files(db).get(&config) != files.get(&config) {
                    workspace.set_files(db).to(Arc::new(files.clone()));
                }
                if *workspace.only(db) != only {
                    workspace.set_only(db).to(only);
                }
                workspace
            }
            None => {
                let known = Arc::new(files.clone());
                let workspace = Workspace::builder(
                    folder.to_owned(),
                    known,
                    model_path(),
                    only,
                    Vec::new(),
                    Arc::default(),
                )
                .significance(self.significance)
                .new(db);
                self.workspaces.insert(folder.to_owned(), workspace);
                workspace
            }
        };
        let config = config_of(db, workspace).clone();
        for (root, _) in &config.roots {
            let root = normalised(&folder.join(root));
            self.surroundings.await_path(&root);
            if self.is_file(&root) {
                self.add(db, &mut files, &root);
            }
        }
        let mut unreadable = Vec::new();
        for (pattern, _) in &config.tables {
            for path in self.tables(folder, pattern, &mut unreadable) {
                self.add(db, &mut files, &path);
            }
        }
        let own: BTreeSet<PathBuf> = files.keys().cloned().collect();
        self.follow_includes(db, workspace, &mut files);
        let included: BTreeSet<PathBuf> = files.keys().filter(|path| !own.contains(*path)).cloned().collect();
        if **workspace.files(db) != files {
            workspace.set_files(db).to(Arc::new(files));
        }
        if **workspace.included(db) != included {
            workspace.set_included(db).to(Arc::new(included));
        }
        if *workspace.unreadable(db) != unreadable {
            workspace.set_unreadable(db).to(unreadable);
        }
        self.find_packages(db, workspace);
        workspace
    }

    /// Adds a file to those of a workspace, and reads it: nobody may have watched it until now.
    fn add(&mut self, db: &mut Database, files: &mut BTreeMap<PathBuf, File>, path: &Path) {
        if files.contains_key(path) {
            return;
        }
        let place = place(path);
        for path in [path, &place] {
            self.surroundings.look_through(path.parent().unwrap_or(path).to_owned());
        }
        if path != place {
            self.surroundings.await_path(path);
        }
        let file = match self.files.get(&place) {
            Some(&file) if self.edited.contains(&place) => file,
            _ => {
                let (text, problem) = text_of(&place);
                self.put(db, place, &text, problem.map(Problem::Cut))
            }
        };
        files.insert(path.to_owned(), file);
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
            for include in item_tree_of(db, file).includes.clone().iter().flatten() {
                let candidates = include_candidates(db, workspace, file, include);
                let found = candidates.iter().position(|path| self.is_file(path));
                // A nearer one may come.
                candidates
                    .iter()
                    .take(found.unwrap_or(candidates.len()))
                    .for_each(|path| self.surroundings.await_path(path));
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

    /// The files that a pattern of `[timing] tables` names, whether they can be read or not; and what kept some folder
    /// from being looked into.
    fn tables(&mut self, folder: &Path, pattern: &str, unreadable: &mut Vec<String>) -> Vec<PathBuf> {
        let Ok(glob) = table_pattern(folder, pattern) else { return Vec::new() };
        let is_fixed = |part: &std::path::Component<'_>| {
            !part.as_os_str().to_string_lossy().contains(['*', '?', '[', '{'])
        };
        let parts: Vec<_> = Path::new(pattern).components().collect();
        let fixed: PathBuf = parts.iter().take_while(|part| is_fixed(part)).collect();
        let from = normalised(&folder.join(&fixed));
        self.surroundings.await_path(&from);
        self.surroundings.name(glob.clone());
        if parts.iter().all(is_fixed) {
            let is_there = self.edited.contains(&from) || from.symlink_metadata().is_ok();
            return if is_there { vec![from] } else { Vec::new() };
        }
        let depth = parts.len() - fixed.components().count();
        // What the configuration names is read, whatever `.gitignore` says, and wherever a link leads.
        let walk = WalkBuilder::new(&from)
            .standard_filters(false)
            .follow_links(true)
            .max_depth(if pattern.contains("**") { None } else { Some(depth) })
            .sort_by_file_path(Path::cmp)
            .build();
        let mut found = Vec::new();
        for entry in walk {
            match entry {
                Ok(entry) if entry.path().is_dir() => {
                    self.surroundings.look_through(entry.into_path());
                }
                Ok(entry) => found.push(entry.into_path()),
                Err(error) => match path_of(&error) {
                    // A link that leads nowhere is a table that cannot be read.
                    Some(path) if !path.is_dir() && path.symlink_metadata().is_ok() => {
                        found.push(path.to_owned())
                    }
                    _ if from.exists() => unreadable.push(error.to_string()),
                    _ => {}
                },
            }
        }
        found.extend(self.edited.iter().filter(|path| !path.exists()).cloned());
        found.retain(|path| glob.is_match(path));
        found
    }
}

/// Are the files of this workspace to be looked for again, since a text has changed? Then a model includes a file that was not
/// read, names such a message package, or no longer includes one that was. `is_open` tells which files an editor has, be they
/// on the disk or not.
pub(crate) fn is_outdated(db: &dyn ModelDb, workspace: Workspace, is_open: &dyn Fn(&Path) -> bool) -> bool {
    let is_read = |name: &Name| workspace.packages(db).contains_key(name);
    let mut unread = named_packages(db, workspace).iter().filter(|name| !is_read(name));
    if unread.any(|name| !Places::of_environment().folders(name).is_empty()) {
        return true;
    }
    // A text that is no file on the disk stands nowhere: it includes nothing.
    if workspace.folder(db).as_os_str().is_empty() {
        return false;
    }
    has_left(db, workspace) || nearer(db, workspace).iter().any(|path| path.is_file() || is_open(path))
}

/// Is there a file that was read for an include, and that no model includes any more?
#[salsa::tracked(returns(copy))]
fn has_left(db: &dyn ModelDb, workspace: Workspace) -> bool {
    let (known, included) = (workspace.files(db), workspace.included(db));
    if included.is_empty() {
        return false;
    }
    let own = known.iter().filter(|(path, file)| !included.contains(*path) && is_model(file.path(db)));
    let mut open: Vec<File> = own.map(|(_, file)| *file).collect();
    let mut seen: HashSet<File> = open.iter().copied().collect();
    while let Some(file) = open.pop() {
        let new = includes(db, workspace, file).iter().flatten().filter(|file| seen.insert(**file));
        open.extend(new.copied().collect::<Vec<_>>());
    }
    included.iter().any(|path| known.get(path).is_some_and(|file| !seen.contains(file)))
}

/// Where files may be that a workspace includes, before those that it takes: where there are none, usually nowhere.
#[salsa::tracked(returns(ref))]
fn nearer(db: &dyn ModelDb, workspace: Workspace) -> Vec<PathBuf> {
    let known = workspace.files(db);
    let files = known.values().filter(|file| file.path(db).extension().is_none_or(|it| it != "toml"));
    let includes =
        files.flat_map(|&file| item_tree_of(db, file).includes.iter().flatten().map(move |it| (file, it)));
    let nearer = includes.flat_map(|(file, include)| {
        let candidates = include_candidates(db, workspace, file, include);
        candidates.into_iter().take_while(|path| !known.contains_key(path))
    });
    nearer.collect()
}

/// Is a file one of the other language that has this extension? Asked whenever workspaces are loaded, so it is remembered.
#[salsa::tracked(returns(copy))]
fn is_foreign(db: &dyn ModelDb, file: File) -> bool {
    is_of_another_language(file.text(db))
}

/// Is a `.mal` text one of the Meta Attack Language? Its files begin with `#id: "…"`, `category X {`, `associations {`, behind
/// comments and includes; and no line of them begins a declaration of ours, which would be left out with the rest.
pub(crate) fn is_of_another_language(text: &str) -> bool {
    let is_declaration = |line: &str| {
        let mut words = line.split_whitespace();
        // That language has includes, too.
        let is_ours = |word: &str| DECLARATIONS.contains(&word) && word != "include";
        words.next().is_some_and(is_ours) && words.next().is_some()
    };
    if text.lines().any(is_declaration) {
        return false;
    }
    let lexed = mauve_syntax::lex(text);
    let tokens = (0..lexed.len()).filter(|&index| !lexed.kind(index).is_trivia());
    let mut tokens = tokens.filter_map(|index| text.get(lexed.range(index))).peekable();
    while tokens.next_if_eq(&"include").is_some() {
        tokens.next_if(|path| path.starts_with('"'));
    }
    let is_name = |word: &str| word.starts_with(char::is_alphabetic);
    match (tokens.next(), tokens.next(), tokens.next(), tokens.next()) {
        (Some("#"), Some(name), Some(":"), Some(value)) => is_name(name) && value.starts_with('"'),
        (Some("category"), Some(name), Some("{"), _) => is_name(name),
        (Some("associations"), Some("{"), ..) => true,
        _ => false,
    }
}

/// `MAUVE_MODELS`.
fn model_path() -> Vec<PathBuf> {
    let Some(folders) = std::env::var_os("MAUVE_MODELS") else { return Vec::new() };
    std::env::split_paths(&folders).filter(|folder| !folder.as_os_str().is_empty()).collect()
}

fn owner<'a>(model: &Path, homes: &'a BTreeSet<PathBuf>) -> Option<&'a PathBuf> {
    model.ancestors().find_map(|above| homes.get(above))
}

struct Found {
    models: Vec<PathBuf>,
    configs: Vec<PathBuf>,
}

/// Sets a text, where it is another: setting ends whatever is being computed. Says whether it was.
fn write(db: &mut Database, file: File, text: &str, problem: Option<Problem>) -> bool {
    let (is_text, is_problem) = (**file.text(db) != *text, *file.problem(db) != problem);
    if is_text {
        file.set_text(db).to(text.into());
    }
    if is_problem {
        file.set_problem(db).to(problem);
    }
    is_text || is_problem
}

/// The path behind all links. A file that is not on the disk yet, or not any more, stands in a folder that is.
pub(crate) fn place(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| {
        let folder = path.parent().and_then(|folder| folder.canonicalize().ok());
        folder.zip(path.file_name()).map_or_else(|| path.to_owned(), |(folder, name)| folder.join(name))
    })
}

/// The text of a file up to where it stops being UTF-8, and why it is not all of it.
pub(crate) fn text_of(path: &Path) -> (String, Option<String>) {
    match std::fs::metadata(path) {
        Err(error) => return (String::new(), Some(format!("cannot be read: {error}"))),
        Ok(data) if !data.is_file() => return (String::new(), Some("this is not a file".to_owned())),
        Ok(data) if data.len() > LONGEST => {
            return (
                String::new(),
                Some(format!("this file is longer than {LONGEST} bytes, and is not read")),
            );
        }
        Ok(_) => {}
    }
    match std::fs::read(path) {
        Err(error) => (String::new(), Some(format!("cannot be read: {error}"))),
        Ok(bytes) => match String::from_utf8(bytes) {
            Ok(text) => (text, None),
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let mut bytes = error.into_bytes();
                bytes.truncate(valid);
                let text = String::from_utf8(bytes).unwrap_or_default();
                (text, Some(format!("this is not UTF-8 text from byte {valid} on, and is not read further")))
            }
        },
    }
}

fn path_of(error: &ignore::Error) -> Option<&Path> {
    match error {
        ignore::Error::WithPath { path, .. } => Some(path),
        ignore::Error::WithDepth { err, .. } | ignore::Error::WithLineNumber { err, .. } => path_of(err),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_language_of_this_extension_is_known_by_its_beginning() {
        for text in [
            "#id: \"org.example.lang\"\n#version: \"1.0.0\"\ncategory System { asset Host { } }",
            "// a comment\ninclude \"core.mal\"\n#version: \"1.0.0\"\n",
            "category System {",
            "/* c */ associations { Host [a] * <-- }",
        ] {
            assert!(is_of_another_language(text), "{text}");
        }
        for text in [
            "",
            "include \"a.mal\"",
            "library a { }",
            "# a comment of another kind\ncodel f(): int",
            "category",
            "codel category(): int",
            "category Drivers",
            "# TODO: shorten",
            "#id: \"a\"\ndeployment D { architecture A }",
            "category System { }\n  component K(S, C)",
        ] {
            assert!(!is_of_another_language(text), "{text}");
        }
    }
}
