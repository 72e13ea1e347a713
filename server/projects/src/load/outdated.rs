//! Finds workspaces whose files must be searched again after an edit: their models include or name other files.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use mauve_hir::item_tree::Name;
use mauve_hir::{File, ModelDb, Workspace, closure, include_candidates, includes, is_model, named_packages};

use super::packages::Places;

/// Returns whether the files of this workspace must be searched again after a change of a text: a model includes a
/// file or names a message package that was not read, or no longer includes a file that was. `is_open` returns
/// whether an editor has a file open.
pub fn is_outdated(db: &dyn ModelDb, workspace: Workspace, is_open: &dyn Fn(&Path) -> bool) -> bool {
    let is_read = |name: &Name| workspace.packages(db).contains_key(name);
    let mut unread = named_packages(db, workspace).iter().filter(|name| !is_read(name));
    if unread.any(|name| !Places::of_environment().folders(name).is_empty()) {
        return true;
    }
    // A text without a file has no folder, so its includes resolve to no file.
    if workspace.folder(db).as_os_str().is_empty() {
        return false;
    }
    has_left(db, workspace) || nearer(db, workspace).iter().any(|path| path.is_file() || is_open(path))
}

/// Returns whether a file was read for an include that no longer exists.
#[salsa::tracked(returns(copy))]
fn has_left(db: &dyn ModelDb, workspace: Workspace) -> bool {
    let (known, included) = (workspace.files(db), workspace.included(db));
    if included.is_empty() {
        return false;
    }
    let own = known.iter().filter(|(path, file)| !included.contains(*path) && is_model(file.path(db)));
    let included_by = |file| includes(db, workspace, file).iter().flatten().copied();
    let seen: HashSet<File> = closure(own.map(|(_, file)| *file), included_by).into_iter().collect();
    included.iter().any(|path| known.get(path).is_some_and(|file| !seen.contains(file)))
}

/// Returns the paths that would take precedence over the included files of a workspace if files existed there.
#[salsa::tracked(returns(ref))]
fn nearer(db: &dyn ModelDb, workspace: Workspace) -> Vec<PathBuf> {
    let known = workspace.files(db);
    let files = known.values().filter(|file| file.path(db).extension().is_none_or(|it| it != "toml"));
    let includes =
        files.flat_map(|&file| file.outline(db).includes.iter().flatten().map(move |it| (file, it)));
    let nearer = includes.flat_map(|(file, include)| {
        let candidates = include_candidates(db, workspace, file, include);
        candidates.into_iter().take_while(|path| !known.contains_key(path))
    });
    nearer.collect()
}
