//! Whether a repository is one that `git clone`, `git worktree` or `git submodule` makes: its objects and its configuration are its own.
//! The folder of a stranger, unpacked from an archive, could show commits of the user's other repositories, or texts in errors of git.
//!
//! | refused | since a stranger can write it | instead |
//! |---|---|---|
//! | a file `.git` that leads out of its folder | it names any repository | what it names leads back: `gitdir` of a worktree, which is in `worktrees` of the repository; `core.worktree` of a submodule |
//! | `commondir` in any other folder | it names any repository | |
//! | links in `.git` that lead out of it | to objects, refs or texts | |
//! | `objects/info/alternates` | also of `git clone --shared` and `--reference`: nothing leads back | |
//!
//! Runners of CI systems let `.git/config` include other files. These are not refused, but errors of git are not shown: they quote values.
//!
//! A user who has made such a repository says so with `--allow-outside`. What is refused is found without git, which reads the
//! configuration before anything else.

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

/// Returns whether the configuration of the repository around a folder includes other files, which errors of git would quote.
///
/// # Errors
///
/// Git may not read it, with the reason for the user.
pub(crate) fn has_includes(folder: &Path) -> Result<bool, String> {
    let own = "use `--allow-outside` if you have made this repository yourself";
    for top in folder.ancestors() {
        let inner = top.join(".git");
        let Ok(data) = inner.symlink_metadata() else { continue };
        let found = if data.is_dir() { in_folder(&inner, false) } else { in_file(top) };
        let has_includes = found.map_err(|why| format!("{why}: {own}"))?;
        // Git goes on above a folder that is no repository.
        if !data.is_dir() || ["HEAD", "objects", "refs"].iter().all(|it| inner.join(it).exists()) {
            return Ok(has_includes);
        }
    }
    Ok(false)
}

/// The same of a file `.git`, or a link, at the top of a repository. Git itself refuses one that leads to nothing.
fn in_file(top: &Path) -> Result<bool, String> {
    let file = top.join(".git");
    let named = match text(&file).as_deref().and_then(|it| it.strip_prefix("gitdir:")) {
        Some(named) => top.join(named.trim()).canonicalize(),
        None => file.canonicalize(),
    };
    let Ok(named) = named else { return Ok(false) };
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
    let has_includes = in_folder(&named, common.is_some())?;
    Ok(common.map_or(Ok(false), |it| in_folder(&it, false))? || has_includes)
}

/// The same of a folder of git.
fn in_folder(folder: &Path, is_worktree: bool) -> Result<bool, String> {
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
    let real = folder.canonicalize().map_err(|error| format!("`{}`: {error}", folder.display()))?;
    let mut open: Vec<PathBuf> = READ.iter().filter_map(|it| own(it)).collect();
    while let Some(path) = open.pop() {
        // What is not there, such as the target of a first `HEAD`, shows nothing.
        if path.is_symlink() && path.canonicalize().is_ok_and(|it| !it.starts_with(&real)) {
            return Err(format!("`{}` is a link out of its folder", path.display()));
        }
        if path.is_dir() && !path.is_symlink() {
            open.extend(
                std::fs::read_dir(&path).into_iter().flatten().filter_map(|it| Some(it.ok()?.path())),
            );
        }
    }
    let configs = ["config", "config.worktree"].map(|it| text(&folder.join(it)).unwrap_or_default());
    Ok(configs.iter().any(|it| it.to_ascii_lowercase().contains("[include")))
}

/// The text of a file of git; none if there is none.
fn text(path: &Path) -> Option<String> {
    Some(String::from_utf8_lossy(&read(path, LONGEST).ok()?).into_owned())
}
