//! The folder for files that MAUVE can write again.

use std::path::PathBuf;

/// Returns MAUVE's folder in the user's cache, which may not exist; none if the environment names no folder. As the specification
/// of `XDG_CACHE_HOME` says, a relative path is ignored.
pub fn cache_folder() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")));
    Some(cache?.join("mauve"))
}
