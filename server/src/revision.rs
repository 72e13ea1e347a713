//! Loads the workspaces of a commit: its models, configurations and tables are written into a private folder, loaded from there as from
//! any folder, and removed at once. So a commit is analysed as its files would be, and the working folder is not touched.

use std::fs::{DirBuilder, File, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use mauve_hir::{CONFIG_FILE, Database, Workspace, config_of, is_model};
use mauve_wcrt::table_pattern;

use crate::disk::LONGEST;
use crate::git::{Contents, Entry, EntryKind, Repository};
use crate::load::{LONGEST_TOGETHER, load};

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
    let entries = repository.entries(commit, &|it| is_wanted(&it.path) || is_submodule(it))?;
    let top = copy.top.clone();
    let named = |why: String| why.replace(&format!("{}/", top.display()), &format!("{name}:"));
    if !entries.iter().any(|entry| entry.path.starts_with(path) && is_project(&entry.path)) {
        return Ok(Loaded { workspaces: Vec::new(), top, left_out: Vec::new() });
    }
    copy.write(&entries).map_err(&named)?;
    let paths = [top.join(path)];
    let mut workspaces = load(db, &paths, false).map_err(&named)?;
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

/// A private folder with files of a commit, which is removed when it is dropped.
struct Copy {
    top: PathBuf,
    contents: Contents,
    left: u64,
    left_out: Vec<String>,
}

impl Copy {
    fn new(contents: Contents) -> std::io::Result<Copy> {
        let parent = std::env::temp_dir().canonicalize()?;
        let time = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let top = parent.join(format!("mauve-revision-{}-{time}", std::process::id()));
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
            match entry.kind {
                EntryKind::File => {
                    let written = self.write_file(entry);
                    written.map_err(|why| format!("cannot read `{path}` of the revision: {why}"))?;
                }
                EntryKind::Link => self.left_out.push(format!("`{path}` is a link, and is not followed")),
                EntryKind::Submodule => {
                    self.left_out.push(format!("`{path}` is a submodule, and is not read"))
                }
            }
        }
        Ok(())
    }

    fn write_file(&mut self, entry: &Entry) -> Result<(), String> {
        let bytes = self.contents.read(entry, LONGEST)?;
        let path = self.top.join(&entry.path);
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
        let _ = std::fs::remove_dir_all(&self.top);
    }
}
