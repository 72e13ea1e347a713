//! The programs of other people that this crate and the server start, such as `babeltrace2` and `cmake`.
//!
//! They are found in the absolute folders of `PATH` only, and get these folders as their `PATH`. An empty or relative folder is one of
//! the current folder, which may be the project of a stranger with a `cmake` of its own.

use std::env::{join_paths, split_paths, var_os};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the path of a program, if it is on `PATH`.
pub fn program(name: impl AsRef<Path>) -> Option<PathBuf> {
    let path = var_os("PATH").unwrap_or_default();
    absolute_folders(&path).map(|folder| folder.join(&name)).find(|path| is_executable(path))
}

/// Returns the command that starts a program of this path.
pub fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    let path = var_os("PATH").unwrap_or_default();
    match join_paths(absolute_folders(&path)).ok().filter(|path| !path.is_empty()) {
        Some(path) => command.env("PATH", path),
        // An empty one is the current folder; without one, the system has its own.
        None => command.env_remove("PATH"),
    };
    command
}

fn absolute_folders(path: &OsStr) -> impl Iterator<Item = PathBuf> {
    split_paths(path).filter(|folder| folder.is_absolute())
}

fn is_executable(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    path.metadata().is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_absolute_folders_are_searched() {
        for (path, expected) in
            [("", ""), (":/usr/bin:", "/usr/bin"), ("bin:/a::./b:../c:/d e:.", "/a:/d e"), (".", "")]
        {
            let found: Vec<PathBuf> = absolute_folders(OsStr::new(path)).collect();
            let expected: Vec<&str> = expected.split(':').filter(|it| !it.is_empty()).collect();
            assert!(
                found.iter().map(PathBuf::as_path).eq(expected.into_iter().map(Path::new)),
                "{path}: {found:?}"
            );
        }
        assert!(program("sh").is_some_and(|path| path.is_absolute()));
        assert_eq!(program("/bin/sh"), Some(PathBuf::from("/bin/sh")));
        assert_eq!(program("Cargo.toml"), None);
    }
}
