//! Loads the workspaces of a commit: its models, configurations and tables are written into a private folder, loaded from there as from
//! any folder, and removed at once. So a commit is analysed as its files would be, and the working folder is not touched.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::Write as _;
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use mauve_hir::{CONFIG_FILE, Database, Workspace, config_of, is_model, normalised};
use mauve_wcrt::table_pattern;
use rustix::io::Errno;
use rustix::process::{Pid, geteuid, test_kill_process};

use crate::disk::{LONGEST, is_hidden};
use crate::git::{CommitEntry, CommitEntryKind, Contents, Repository, is_visible};
use crate::load::{LONGEST_TOGETHER, load};
use crate::signals::on_signal;

/// The workspaces of a commit.
#[derive(Debug)]
pub struct LoadedCommit {
    /// The workspaces.
    pub workspaces: Vec<Workspace>,
    /// The folder that stood for the top of the repository: paths of the workspaces begin with it.
    pub top: PathBuf,
    /// The links and submodules that were not read, by their paths below the top, with the reasons for the user.
    pub left_out: BTreeMap<PathBuf, String>,
}

/// Loads what `path`, below the top of the repository, has in a commit: no workspaces where the commit has no model and no
/// configuration there. Submodules are read where their commits are at hand. `name` is how the user calls the commit.
///
/// # Errors
///
/// Files cannot be read, in words for the user.
pub fn load_commit(
    db: &mut Database,
    repository: &Repository,
    (name, commit): (&str, &str),
    path: &Path,
) -> Result<LoadedCommit, String> {
    // The innermost hidden folder that the user has named, as for a path on the disk.
    let named = path.ancestors().find(|it| it.file_name().is_some_and(|name| is_hidden(Path::new(name))));
    let mut copy = Copy::new(named.unwrap_or(Path::new("")))
        .map_err(|error| format!("cannot make a folder in `{}`: {error}", std::env::temp_dir().display()))?;
    let is_project = |path: &Path| is_model(path) || path.ends_with(CONFIG_FILE);
    let is_wanted = |path: &Path| {
        let is_table = path.extension().is_some_and(|extension| extension == "toml");
        let is_rule = path.ends_with(".gitignore") || path.ends_with(".ignore");
        is_project(path) || is_table || is_rule
    };
    let top = copy.top.clone();
    let named = |why: String| why.replace(&format!("{}/", top.display()), &format!("{name}:"));
    let written = copy.write(repository, commit, Path::new(""), &is_wanted).map_err(&named)?;
    let paths = [top.join(path)];
    let mut workspaces = Vec::new();
    if written.iter().any(|it| it.starts_with(path) && is_project(it)) {
        workspaces = load(db, &paths, false).map_err(&named)?;
    }
    // Only the configurations say which other files are tables.
    let patterns = workspaces.iter().flat_map(|&workspace| {
        let folder = workspace.folder(db).clone();
        let all = config_of(db, workspace).all_patterns();
        all.filter_map(|(pattern, _)| table_pattern(&folder, pattern).ok()).collect::<Vec<_>>()
    });
    let patterns: Vec<_> = patterns.collect();
    let is_other = |path: &Path| !is_wanted(path) && patterns.iter().any(|it| it.is_match(top.join(path)));
    if !patterns.is_empty()
        && !copy.write(repository, commit, Path::new(""), &is_other).map_err(&named)?.is_empty()
    {
        workspaces = load(db, &paths, false).map_err(&named)?;
    }
    if let Some(other) = workspaces.iter().map(|it| it.folder(db)).find(|it| !it.starts_with(&top)) {
        return Err(format!(
            "`{}` applies to the files of {name}: remove it",
            other.join(CONFIG_FILE).display()
        ));
    }
    let mut left_out = std::mem::take(&mut copy.left_out);
    // A link to what was not read was not either.
    for (link, end) in &copy.links {
        let why = left_out.iter().find(|(path, _)| end.starts_with(path)).map(|(_, why)| why.clone());
        left_out.extend(why.map(|why| (link.clone(), why)));
    }
    Ok(LoadedCommit { workspaces, top, left_out })
}

/// How the name of a private folder begins.
const PREFIX: &str = "mauve-revision-";

/// Returns the private folder around a folder, if there is one.
pub fn copy_of(folder: &Path) -> Option<String> {
    let is_copy = |it: &&Path| it.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX));
    Some(folder.ancestors().find(is_copy)?.display().to_string())
}

/// The maximum number of bytes of the target of a link.
const LONGEST_LINK: u64 = 4096;

/// The private folder that is not removed yet: there is one at a time. A signal removes it too. Who writes in it holds the lock:
/// nothing is written any more while the folder is removed, nor afterwards.
static COPY: Mutex<Option<PathBuf>> = Mutex::new(None);

fn copy_to_write() -> MutexGuard<'static, Option<PathBuf>> {
    COPY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the private folder. Nobody writes until the lock is dropped.
fn remove_copy() -> MutexGuard<'static, Option<PathBuf>> {
    let mut copy = copy_to_write();
    copy.take().iter().for_each(|it| _ = std::fs::remove_dir_all(it));
    copy
}

/// Removes the private folders of this user's processes that have ended without removing them, such as by `kill -9`.
fn sweep(parent: &Path) {
    let is_left = |path: &Path| {
        let (process, time) = path.file_name()?.to_str()?.strip_prefix(PREFIX)?.split_once('-')?;
        time.parse::<u128>().ok()?;
        let has_ended = test_kill_process(Pid::from_raw(process.parse().ok()?)?) == Err(Errno::SRCH);
        let data = path.symlink_metadata().ok()?;
        let is_own = data.is_dir() && data.uid() == geteuid().as_raw();
        // The processes of another container have other numbers, and hold the lock.
        (has_ended && is_own && File::open(path).ok()?.try_lock().is_ok()).then_some(())
    };
    let folders = std::fs::read_dir(parent).into_iter().flatten().filter_map(|it| Some(it.ok()?.path()));
    folders.filter(|it| is_left(it).is_some()).for_each(|it| _ = std::fs::remove_dir_all(it));
}

/// A private folder with files of a commit, which is removed when it is dropped.
struct Copy {
    top: PathBuf,
    /// It is locked while the process lives.
    _folder: File,
    /// The hidden folder that the user has named; empty without one.
    named: PathBuf,
    left: u64,
    left_out: BTreeMap<PathBuf, String>,
    /// The links, with their targets.
    links: BTreeMap<PathBuf, PathBuf>,
}

impl Copy {
    fn new(named: &Path) -> std::io::Result<Copy> {
        let parent = std::env::temp_dir().canonicalize()?;
        sweep(&parent);
        let time = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let top = parent.join(format!("{PREFIX}{}-{time}", std::process::id()));
        // Without signals, a folder may stay: it is private.
        _ = on_signal(|| {
            let _lock = remove_copy();
            std::process::exit(130);
        });
        let mut copy = copy_to_write();
        // It must be new: another user could have made one.
        DirBuilder::new().mode(0o700).create(&top)?;
        *copy = Some(top.clone());
        let folder = File::open(&top)?;
        _ = folder.try_lock();
        // So that it is a repository: its projects may read all of it, and nothing around it.
        std::fs::create_dir(top.join(".git"))?;
        let (named, left_out, links) = (named.to_owned(), BTreeMap::new(), BTreeMap::new());
        Ok(Copy { top, _folder: folder, named, left: LONGEST_TOGETHER, left_out, links })
    }

    /// Writes the files of a commit that are `wanted`, and all links, into the folder `below` the top. Returns the paths of the files.
    fn write(
        &mut self,
        repository: &Repository,
        commit: &str,
        below: &Path,
        wanted: &dyn Fn(&Path) -> bool,
    ) -> Result<Vec<PathBuf>, String> {
        // Another pass may have written the links.
        let is_wanted = |it: &CommitEntry| match (it.kind, below.join(&it.path)) {
            (CommitEntryKind::File, path) => wanted(&path),
            (_, path) => !self.links.contains_key(&path),
        };
        let named = self.named.strip_prefix(below).unwrap_or(Path::new(""));
        let (entries, mut contents) =
            (repository.entries(commit, named, &is_wanted)?, repository.contents()?);
        let mut all = Vec::new();
        for mut entry in entries {
            let inner =
                if entry.kind == CommitEntryKind::Submodule { repository.submodule(&entry) } else { None };
            entry.path = below.join(&entry.path);
            let left_out = match (entry.kind, inner) {
                (CommitEntryKind::File, _) => {
                    all.push(entry.path.clone());
                    self.write_file(&mut contents, &entry).map(|()| None)
                }
                (CommitEntryKind::Link, _) => self.write_link(&mut contents, &entry),
                (_, Some(inner)) => {
                    all.extend(self.write(&inner, &entry.object, &entry.path, wanted)?);
                    Ok(None)
                }
                (CommitEntryKind::Submodule, None) => Ok(Some(format!(
                    "is a submodule whose commit is not here, and is not read: run `git submodule update --init`, or \
                     `git fetch origin {}` in it",
                    entry.object
                ))),
            };
            let path = entry.path.display();
            let left_out = left_out.map_err(|why| format!("cannot read `{path}` of the revision: {why}"))?;
            self.left_out.extend(left_out.map(|why| (entry.path.clone(), format!("`{path}` {why}"))));
        }
        Ok(all)
    }

    /// Makes a link whose target is visible below the top; otherwise says that it is not followed. The loader checks where it leads
    /// indeed.
    fn write_link(
        &mut self,
        contents: &mut Contents<'_>,
        entry: &CommitEntry,
    ) -> Result<Option<String>, String> {
        let out = || Ok(Some("is a link out of the repository, and is not followed".to_owned()));
        let Ok(target) = contents.read(entry, LONGEST_LINK)? else { return out() };
        let (path, target) = (self.path_of(entry)?, PathBuf::from(OsString::from_vec(target)));
        let end = normalised(&path.parent().unwrap_or(&self.top).join(&target));
        let Some(end) = end.strip_prefix(&self.top).ok().filter(|it| is_visible(it, &self.named)) else {
            return out();
        };
        if target.is_absolute() {
            return out();
        }
        self.links.insert(entry.path.clone(), end.to_owned());
        let _writing = copy_to_write();
        let made = std::fs::create_dir_all(path.parent().unwrap_or(&self.top))
            .and_then(|()| std::os::unix::fs::symlink(&target, &path));
        made.map(|()| None).map_err(|error| error.to_string())
    }

    /// Returns where an entry is written: never through a link.
    fn path_of(&self, entry: &CommitEntry) -> Result<PathBuf, String> {
        let path = self.top.join(&entry.path);
        let folders = path.ancestors().skip(1).take_while(|it| it.starts_with(&self.top));
        let mut links = folders.filter(|it| it.symlink_metadata().is_ok_and(|it| it.is_symlink()));
        match links.next() {
            Some(_) => Err("one of its folders is a link".to_owned()),
            None => Ok(path),
        }
    }

    fn write_file(&mut self, contents: &mut Contents<'_>, entry: &CommitEntry) -> Result<(), String> {
        let bytes = contents.read(entry, LONGEST)?;
        let _writing = copy_to_write();
        let path = self.path_of(entry)?;
        let make = || -> std::io::Result<File> {
            std::fs::create_dir_all(path.parent().unwrap_or(&self.top))?;
            OpenOptions::new().write(true).create_new(true).mode(0o600).open(&path)
        };
        let mut file = make().map_err(|error| error.to_string())?;
        let written = match bytes {
            Ok(bytes) => {
                let left = self.left.checked_sub(bytes.len() as u64);
                self.left = left.ok_or_else(|| {
                    format!("the models and tables are larger than {} MiB together", LONGEST_TOGETHER >> 20)
                })?;
                file.write_all(&bytes)
            }
            // It has this length and no content: the loader says that it is too long.
            Err(length) => file.set_len(length.min(LONGEST + 1)),
        };
        written.map_err(|error| error.to_string())
    }
}

impl Drop for Copy {
    fn drop(&mut self) {
        drop(remove_copy());
    }
}
