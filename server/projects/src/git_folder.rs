//! Whether a repository is one that `git clone`, `git worktree` or `git submodule` makes: its objects and its configuration are its own.
//! The folder of a stranger, unpacked from an archive, could show commits of the user's other repositories, or texts in errors of git.
//!
//! | refused | since a stranger can write it | instead |
//! |---|---|---|
//! | a file `.git` that leads out of its folder | it names any repository | what it names leads back: `gitdir` of a worktree, which is in `worktrees` of the repository; `core.worktree` of a submodule |
//! | `commondir` in any other folder | it names any repository | |
//! | links in `.git` that lead out of it | to objects, refs or texts | |
//! | pipes and folders that cannot be listed | git waits for one, and finds files in the other | |
//! | `objects/info/alternates` | also of `git clone --shared` and `--reference`: nothing leads back | |
//!
//! Runners of CI systems let `.git/config` include other files. These are not refused, but errors of git are not shown, since they
//! quote values, and git gets a limit of time, since it waits for a pipe that is included.
//!
//! A user who has made such a repository says so with `--allow-outside`. What is refused is found without git, which reads the
//! configuration before anything else. Then git has to name the same folders: a byte may mean more to it than to this module.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::disk::{LONGEST, read};

/// What git reads in its folder, besides hooks, which are never executed.
const READ: [&str; 10] = [
    "HEAD",
    "config",
    "config.worktree",
    "logs",
    "objects",
    "packed-refs",
    "refs",
    "reftable",
    "shallow",
    "info",
];

/// Returns the folder in which git keeps the repository around `folder`, and the folder that all its worktrees share. Returns none if
/// `folder` is in no repository.
///
/// # Errors
///
/// Git may not read it, with the reason for the user.
pub(crate) fn folders_of_git(folder: &Path) -> Result<Option<[PathBuf; 2]>, String> {
    for top in folder.ancestors() {
        let inner = top.join(".git");
        let Ok(data) = inner.symlink_metadata() else { continue };
        if !data.is_dir() {
            return in_file(top);
        }
        check(&inner, false)?;
        // Git goes on above a folder that is no repository.
        if ["HEAD", "objects", "refs"].iter().all(|it| inner.join(it).symlink_metadata().is_ok()) {
            return Ok(Some([inner.clone(), inner]));
        }
    }
    Ok(None)
}

/// The same of a file `.git`, or a link, at the top of a repository. Git itself refuses one that leads to nothing.
fn in_file(top: &Path) -> Result<Option<[PathBuf; 2]>, String> {
    let file = top.join(".git");
    let named = match text(&file).as_deref().and_then(|it| it.strip_prefix("gitdir:")) {
        Some(named) => top.join(named.trim()).canonicalize(),
        None => file.canonicalize(),
    };
    let Ok(named) = named else { return Ok(None) };
    let leads_to = |from: &Path, to: &str, end: &Path| from.join(to).canonicalize().is_ok_and(|it| it == end);
    let common = text(&named.join("commondir")).and_then(|it| named.join(it.trim()).canonicalize().ok());
    let is_worktree = text(&named.join("gitdir")).is_some_and(|it| leads_to(&named, it.trim(), &file));
    let common = common.filter(|it| is_worktree && named.parent() == Some(&it.join("worktrees")));
    let config = text(&named.join("config")).unwrap_or_default();
    let mut keys = config.lines().filter_map(|line| line.split_once('='));
    let is_submodule =
        keys.any(|(key, it)| key.trim() == "worktree" && leads_to(&named, it.trim().trim_matches('"'), top));
    if common.is_none() && !is_submodule && !named.starts_with(top) {
        return Err(format!("`{}` leads to `{}`, which does not lead back", file.display(), named.display()));
    }
    check(&named, common.is_some())?;
    common.iter().try_for_each(|it| check(it, false))?;
    Ok(Some([named.clone(), common.unwrap_or(named)]))
}

/// Checks that a folder of git leads nowhere else.
fn check(folder: &Path, is_worktree: bool) -> Result<(), String> {
    let own = |name: &str| Some(folder.join(name)).filter(|it| it.symlink_metadata().is_ok());
    if let Some(path) = own("commondir").filter(|_| !is_worktree) {
        return Err(format!("`{}` names another repository", path.display()));
    }
    if let Some(path) = own("objects/info/alternates") {
        return Err(format!(
            "`{}` names objects of another repository, as `git clone --shared` and `--reference` do; `git repack -a -d` \
             copies them, and the file can be deleted",
            path.display()
        ));
    }
    let cannot = |path: &Path, error: std::io::Error| format!("`{}`: {error}", path.display());
    let real = folder.canonicalize().map_err(|error| cannot(folder, error))?;
    let mut open: Vec<PathBuf> = READ.iter().filter_map(|it| own(it)).collect();
    let mut followed = BTreeSet::new();
    while let Some(path) = open.pop() {
        let data = path.symlink_metadata().map_err(|error| cannot(&path, error))?;
        if data.is_symlink() {
            // What is not there, such as the target of a first `HEAD`, shows nothing.
            let Ok(end) = path.canonicalize() else { continue };
            if !end.starts_with(&real) {
                return Err(format!("`{}` is a link out of its folder", path.display()));
            }
            open.extend(followed.insert(end.clone()).then_some(end));
        } else if data.is_dir() {
            // Git opens files by their names where they cannot be listed.
            let entries = std::fs::read_dir(&path).map_err(|error| cannot(&path, error))?;
            open.extend(entries.filter_map(|it| Some(it.ok()?.path())));
        } else if !data.is_file() {
            return Err(format!("`{}` is a pipe or a device", path.display()));
        }
    }
    Ok(())
}

/// The text of a file of git; none if there is none.
fn text(path: &Path) -> Option<String> {
    Some(String::from_utf8_lossy(&read(path, LONGEST).ok()?).into_owned())
}
