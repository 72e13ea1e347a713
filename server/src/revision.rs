//! Loads the workspaces of a commit: its models, configurations and tables are written into a private folder, loaded from there as from
//! any folder, and removed at once. So a commit is analysed as its files would be, and the working folder is not touched.

use std::ffi::OsString;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::Write as _;
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use mauve_hir::{CONFIG_FILE, Database, Workspace, config_of, is_model, normalised};
use mauve_wcrt::table_pattern;

use crate::disk::{LONGEST, is_hidden};
use crate::git::{Contents, Entry, EntryKind, Repository};
use crate::load::{LONGEST_TOGETHER, load};
use crate::signals::on_signal;

/// The workspaces of a commit.
#[derive(Debug)]
pub(crate) struct Loaded {
    pub(crate) workspaces: Vec<Workspace>,
    /// The folder that stood for the top of the repository: paths of the workspaces begin with it.
    pub(crate) top: PathBuf,
    /// What was not read, in words for the user.
    pub(crate) left_out: Vec<String>,
}

/// Loads what `path`, below the top of the repository, has in a commit: no workspaces where the commit has no model and no
/// configuration there. `name` is how the user calls the commit.
///
/// # Errors
///
/// Files cannot be read, in words for the user.
pub(crate) fn load_commit(
    db: &mut Database,
    repository: &Repository,
    (name, commit): (&str, &str),
    path: &Path,
) -> Result<Loaded, String> {
    let mut copy = Copy::new(repository.contents()?)
        .map_err(|error| format!("cannot make a folder in `{}`: {error}", std::env::temp_dir().display()))?;
    let is_project = |path: &Path| is_model(path) || path.ends_with(CONFIG_FILE);
    let is_wanted = |path: &Path| {
        let is_table = path.extension().is_some_and(|extension| extension == "toml");
        let is_rule = path.ends_with(".gitignore") || path.ends_with(".ignore");
        is_project(path) || is_table || is_rule
    };
    let is_submodule = |it: &Entry| it.kind == EntryKind::Submodule && it.path.starts_with(path);
    let mut entries = repository.entries(commit, &|it| is_wanted(&it.path) || is_submodule(it))?;
    let top = copy.top.clone();
    let named = |why: String| why.replace(&format!("{}/", top.display()), &format!("{name}:"));
    let has_project = entries.iter().any(|it| it.path.starts_with(path) && is_project(&it.path));
    entries.retain(|it| has_project || is_submodule(it));
    copy.write(&entries).map_err(&named)?;
    let paths = [top.join(path)];
    let mut workspaces = Vec::new();
    if has_project {
        workspaces = load(db, &paths, false).map_err(&named)?;
    } else {
        let place =
            if path.as_os_str().is_empty() { String::new() } else { format!(" in `{}`", path.display()) };
        copy.left_out.push(format!("there is no model and no mauve.toml{place}"));
    }
    // Only the configurations say which other files are tables.
    let patterns = workspaces.iter().flat_map(|&workspace| {
        let folder = workspace.folder(db).clone();
        let all = config_of(db, workspace).all_times();
        all.filter_map(|(pattern, _)| table_pattern(&folder, pattern).ok()).collect::<Vec<_>>()
    });
    let patterns: Vec<_> = patterns.collect();
    let is_other =
        |it: &Entry| !is_wanted(&it.path) && patterns.iter().any(|glob| glob.is_match(top.join(&it.path)));
    let tables = if patterns.is_empty() { Vec::new() } else { repository.entries(commit, &is_other)? };
    if !tables.is_empty() {
        copy.write(&tables).map_err(&named)?;
        workspaces = load(db, &paths, false).map_err(&named)?;
    }
    if let Some(other) = workspaces.iter().map(|it| it.folder(db)).find(|it| !it.starts_with(&top)) {
        return Err(format!(
            "`{}` applies to the files of {name}: remove it",
            other.join(CONFIG_FILE).display()
        ));
    }
    let left_out = std::mem::take(&mut copy.left_out);
    Ok(Loaded { workspaces, top, left_out })
}

/// How the name of a private folder begins.
const PREFIX: &str = "mauve-revision-";

/// Returns the private folder around a folder, if there is one.
pub(crate) fn copy_of(folder: &Path) -> Option<String> {
    let is_copy = |it: &&Path| it.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX));
    Some(folder.ancestors().find(is_copy)?.display().to_string())
}

/// The maximum number of bytes of the target of a link.
const LONGEST_LINK: u64 = 4096;

/// The private folder that is not removed yet: there is one at a time. A signal removes it too.
static COPY: Mutex<Option<PathBuf>> = Mutex::new(None);

fn remove_copy() {
    let copy = COPY.lock().ok().and_then(|mut it| it.take());
    copy.iter().for_each(|it| _ = std::fs::remove_dir_all(it));
}

/// A private folder with files of a commit, which is removed when it is dropped.
struct Copy<'a> {
    top: PathBuf,
    contents: Contents<'a>,
    left: u64,
    left_out: Vec<String>,
}

impl<'a> Copy<'a> {
    fn new(contents: Contents<'a>) -> std::io::Result<Copy<'a>> {
        let parent = std::env::temp_dir().canonicalize()?;
        let time = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let top = parent.join(format!("{PREFIX}{}-{time}", std::process::id()));
        // Without signals, a folder may stay: it is private.
        _ = on_signal(|| {
            remove_copy();
            std::process::exit(130);
        });
        COPY.lock().iter_mut().for_each(|it| **it = Some(top.clone()));
        // It must be new: another user could have made one.
        DirBuilder::new().mode(0o700).create(&top)?;
        let copy = Copy { top, contents, left: LONGEST_TOGETHER, left_out: Vec::new() };
        // So that it is a repository: its projects may read all of it, and nothing around it.
        std::fs::create_dir(copy.top.join(".git"))?;
        Ok(copy)
    }

    fn write(&mut self, entries: &[Entry]) -> Result<(), String> {
        for entry in entries {
            let path = entry.path.display();
            let written = match entry.kind {
                EntryKind::File => self.write_file(entry).map(|()| None),
                EntryKind::Link => self.write_link(entry).map(|is_below| {
                    (!is_below).then_some("is a link out of the repository, and is not followed")
                }),
                EntryKind::Submodule => Ok(Some("is a submodule, and is not read")),
            };
            let left_out = written.map_err(|why| format!("cannot read `{path}` of the revision: {why}"))?;
            self.left_out.extend(left_out.map(|why| format!("`{path}` {why}")));
        }
        Ok(())
    }

    /// Makes a link whose target is visible below the top, and returns whether it is: the loader checks where it leads indeed.
    fn write_link(&mut self, entry: &Entry) -> Result<bool, String> {
        let Ok(target) = self.contents.read(entry, LONGEST_LINK)? else { return Ok(false) };
        let (path, target) = (self.path_of(entry)?, PathBuf::from(OsString::from_vec(target)));
        let end = normalised(&path.parent().unwrap_or(&self.top).join(&target));
        let is_below = end.strip_prefix(&self.top).is_ok_and(|it| !is_hidden(it));
        if target.is_absolute() || !is_below {
            return Ok(false);
        }
        let made = std::fs::create_dir_all(path.parent().unwrap_or(&self.top))
            .and_then(|()| std::os::unix::fs::symlink(&target, &path));
        made.map(|()| true).map_err(|error| error.to_string())
    }

    /// Returns where an entry is written: never through a link.
    fn path_of(&self, entry: &Entry) -> Result<PathBuf, String> {
        let path = self.top.join(&entry.path);
        let folders = path.ancestors().skip(1).take_while(|it| it.starts_with(&self.top));
        let mut links = folders.filter(|it| it.symlink_metadata().is_ok_and(|it| it.is_symlink()));
        match links.next() {
            Some(_) => Err("one of its folders is a link".to_owned()),
            None => Ok(path),
        }
    }

    fn write_file(&mut self, entry: &Entry) -> Result<(), String> {
        let bytes = self.contents.read(entry, LONGEST)?;
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

impl Drop for Copy<'_> {
    fn drop(&mut self) {
        remove_copy();
    }
}
