//! From paths on the command line to workspaces in the database: the only place that reads models from the disk.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ignore::WalkBuilder;
use mauve_model::{
    CONFIG_FILE, Database, File, ModelDb, Workspace, config_of, include_candidates, is_model, item_tree_of,
    normalised, table_pattern,
};
use salsa::Setter;

/// Folders that hold what tools made.
const MADE_BY_TOOLS: [&str; 4] = ["build", "devel", "install", "log"];

/// A file that is longer is not read.
const LONGEST: u64 = 1 << 28;

/// The workspaces that `paths` name, the current folder without any.
///
/// A folder is the workspace of the nearest `mauve.toml` above it, and there is one more for each `mauve.toml` below.
/// A model is seen as part of the projects that have it.
///
/// # Errors
///
/// A path that does not exist or has no model in it, in words for the user.
pub(crate) fn load(db: &mut Database, paths: &[PathBuf]) -> Result<Vec<Workspace>, String> {
    let here = [PathBuf::from(".")];
    let paths = if paths.is_empty() { &here[..] } else { paths };
    let mut loaded = Vec::new();
    let mut seen = BTreeSet::new();
    let mut single: Vec<(PathBuf, PathBuf)> = Vec::new();
    for path in paths {
        let absolute =
            path.canonicalize().map_err(|error| format!("cannot read `{}`: {error}", path.display()))?;
        let is_config = absolute.file_name().is_some_and(|name| name == CONFIG_FILE);
        if absolute.is_file() && !is_config {
            if !is_model(&absolute) {
                let path = path.display();
                return Err(format!("`{path}` is no model (*.mal), no {CONFIG_FILE} and no folder"));
            }
            let folder = absolute.parent().unwrap_or(Path::new("/"));
            single.push((home(folder), absolute));
            continue;
        }
        let folder =
            if is_config { absolute.parent().unwrap_or(Path::new("/")).to_owned() } else { absolute };
        let found = find(&folder);
        let mut homes: BTreeSet<PathBuf> =
            found.configs.iter().filter_map(|it| Some(it.parent()?.to_owned())).collect();
        if found.models.iter().any(|model| owner(model, &homes).is_none()) {
            homes.insert(home(&folder));
        }
        if homes.is_empty() {
            return Err(format!("no model (*.mal) and no {CONFIG_FILE} in `{}`", path.display()));
        }
        for home in homes {
            if seen.insert(home.clone()) {
                loaded.push(read(db, &home, &[]));
            }
        }
    }
    // Several models of one folder are one workspace, or part of one that is read already.
    single.sort();
    for group in single.chunk_by(|(home, _), (other, _)| home == other) {
        if let Some((home, _)) = group.first()
            && !seen.contains(home)
        {
            let paths: Vec<&Path> = group.iter().map(|(_, path)| path.as_path()).collect();
            loaded.push(read(db, home, &paths));
        }
    }
    Ok(loaded)
}

/// The folder whose `mauve.toml` is the nearest above; `folder` itself without any.
fn home(folder: &Path) -> PathBuf {
    let with_config = folder.ancestors().find(|above| above.join(CONFIG_FILE).is_file());
    with_config.unwrap_or(folder).to_owned()
}

fn owner<'a>(model: &Path, homes: &'a BTreeSet<PathBuf>) -> Option<&'a PathBuf> {
    model.ancestors().find_map(|above| homes.get(above))
}

struct Found {
    models: Vec<PathBuf>,
    configs: Vec<PathBuf>,
}

/// The models and configurations below `folder`, without what tools made and what `.gitignore` names.
fn find(folder: &Path) -> Found {
    let mut found = Found { models: Vec::new(), configs: Vec::new() };
    let made = |name: &std::ffi::OsStr| MADE_BY_TOOLS.iter().any(|made| name == *made);
    let walk = WalkBuilder::new(folder)
        .require_git(false)
        .sort_by_file_path(Path::cmp)
        .filter_entry(move |entry| entry.depth() == 0 || !made(entry.file_name()) || entry.path().is_file())
        .build();
    for entry in walk.flatten() {
        let path = entry.path();
        if !path.is_file() {
            continue;
        }
        if is_model(path) {
            found.models.push(path.to_owned());
        } else if path.file_name().is_some_and(|name| name == CONFIG_FILE) {
            found.configs.push(path.to_owned());
        }
    }
    found
}

/// Reads the workspace of `folder`: its models, its configuration, the tables that this names, and whatever the models
/// include from elsewhere.
fn read(db: &mut Database, folder: &Path, only: &[&Path]) -> Workspace {
    let found = find(folder);
    let inner: BTreeSet<PathBuf> = found
        .configs
        .iter()
        .filter_map(|config| Some(config.parent()?.to_owned()))
        .filter(|it| it != folder)
        .collect();
    let mut reader = Reader { files: BTreeMap::new(), by_place: BTreeMap::new() };
    let own = found.models.iter().filter(|model| owner(model, &inner).is_none());
    for path in own.map(PathBuf::as_path).chain(only.iter().copied()) {
        reader.add(db, path);
    }
    let config = folder.join(CONFIG_FILE);
    if config.is_file() {
        reader.add(db, &config);
    }
    let model_path: Vec<PathBuf> = std::env::var_os("MAUVE_MODELS")
        .map(|folders| {
            std::env::split_paths(&folders).filter(|folder| !folder.as_os_str().is_empty()).collect()
        })
        .unwrap_or_default();
    let only_roots: Vec<File> = only.iter().filter_map(|only| reader.files.get(*only).copied()).collect();
    let files = Arc::new(reader.files.clone());
    let workspace = Workspace::new(db, folder.to_owned(), files, model_path, only_roots, Vec::new());
    let config = config_of(db, workspace).clone();
    for (root, _) in &config.roots {
        reader.add_if_there(db, &normalised(&folder.join(root)));
    }
    let mut unreadable = Vec::new();
    for (pattern, _) in &config.tables {
        for path in tables(folder, pattern, &mut unreadable) {
            reader.add(db, &path);
        }
    }
    reader.follow_includes(db, workspace);
    workspace.set_files(db).to(Arc::new(reader.files));
    workspace.set_unreadable(db).to(unreadable);
    workspace
}

struct Reader {
    files: BTreeMap<PathBuf, File>,
    /// By the path behind all links, so that two ways to one file give one file.
    by_place: BTreeMap<PathBuf, File>,
}

impl Reader {
    fn add_if_there(&mut self, db: &Database, path: &Path) {
        if path.is_file() {
            self.add(db, path);
        }
    }

    fn add(&mut self, db: &Database, path: &Path) {
        if self.files.contains_key(path) {
            return;
        }
        let place = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let file = *self.by_place.entry(place.clone()).or_insert_with(|| read_file(db, place));
        self.files.insert(path.to_owned(), file);
    }

    fn follow_includes(&mut self, db: &Database, workspace: Workspace) {
        let mut open: Vec<File> =
            self.by_place.values().copied().filter(|file| is_model(file.path(db))).collect();
        let mut seen: BTreeSet<PathBuf> = open.iter().map(|file| file.path(db).clone()).collect();
        while let Some(file) = open.pop() {
            for include in item_tree_of(db, file).includes.iter().flatten() {
                let candidates = include_candidates(db, workspace, file, include);
                let Some(path) = candidates.iter().find(|path| path.is_file()) else { continue };
                self.add(db, path);
                if let Some(&file) = self.files.get(path)
                    && seen.insert(file.path(db).clone())
                {
                    open.push(file);
                }
            }
        }
    }
}

/// Reads a file, as much of it as is text.
fn read_file(db: &dyn ModelDb, path: PathBuf) -> File {
    let (text, problem) = text_of(&path);
    File::new(db, path, text.into(), problem)
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

/// The files that a pattern of `[timing] tables` names, whether they can be read or not; and what kept some folder from
/// being looked into.
fn tables(folder: &Path, pattern: &str, unreadable: &mut Vec<String>) -> Vec<PathBuf> {
    let Ok(glob) = table_pattern(folder, pattern) else { return Vec::new() };
    let is_fixed = |part: &std::path::Component<'_>| {
        !part.as_os_str().to_string_lossy().contains(['*', '?', '[', '{', '\\'])
    };
    let parts: Vec<_> = Path::new(pattern).components().collect();
    let fixed: PathBuf = parts.iter().take_while(|part| is_fixed(part)).collect();
    let from = normalised(&folder.join(&fixed));
    if parts.iter().all(is_fixed) {
        return if from.symlink_metadata().is_ok() { vec![from] } else { Vec::new() };
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
            Ok(entry) if entry.path().is_dir() => {}
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
    found.retain(|path| glob.is_match(path));
    found
}

fn path_of(error: &ignore::Error) -> Option<&Path> {
    match error {
        ignore::Error::WithPath { path, .. } => Some(path),
        ignore::Error::WithDepth { err, .. } | ignore::Error::WithLineNumber { err, .. } => path_of(err),
        _ => None,
    }
}
