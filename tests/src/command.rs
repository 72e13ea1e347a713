//! Runs the binary and reads what it says.

use std::path::Path;
use std::process::{Command, Stdio};

/// How a run of `mauve` ended.
#[derive(Debug)]
pub struct Run {
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
    /// The exit code; -1 where a signal ended it.
    pub code: i32,
}

/// Runs `mauve` (its path is the caller's `CARGO_BIN_EXE_mauve`) in `folder`.
pub fn mauve(binary: &str, folder: &Path, arguments: &[&str]) -> Run {
    let output = Command::new(binary)
        .args(arguments)
        .current_dir(folder)
        .env_remove("MAUVE_MODELS")
        .env_remove("ROS_PACKAGE_PATH")
        .env_remove("AMENT_PREFIX_PATH")
        .env_remove("CMAKE_PREFIX_PATH")
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{binary} does not run: {error}"));
    Run {
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
        code: output.status.code().unwrap_or(-1),
    }
}

/// A new empty folder below cargo's, which the next run with the same name makes anew.
pub fn scratch(target: &str, name: &str) -> std::path::PathBuf {
    let folder = Path::new(target).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder)
        .unwrap_or_else(|error| panic!("cannot make {}: {error}", folder.display()));
    folder
}

/// The same for the tests of a unit, which no one gives a folder: behind all links, and this process's alone.
pub fn own_scratch(name: &str) -> std::path::PathBuf {
    let name = format!("mauve-{}-{name}", std::process::id());
    let folder = scratch(&std::env::temp_dir().to_string_lossy(), &name);
    folder.canonicalize().unwrap_or_else(|error| panic!("cannot read {}: {error}", folder.display()))
}

/// Writes files, by their paths below `folder`.
pub fn write<S: AsRef<str>>(folder: &Path, files: &[(S, S)]) {
    for (path, text) in files {
        let path = folder.join(path.as_ref().trim_start_matches('/'));
        let written = std::fs::create_dir_all(path.parent().unwrap_or(folder))
            .and_then(|()| std::fs::write(&path, text.as_ref()));
        written.unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
    }
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) {
    let copied = std::fs::create_dir_all(to).and_then(|()| std::fs::read_dir(from)).and_then(|entries| {
        for entry in entries {
            let entry = entry?;
            let target = to.join(entry.file_name());
            if entry.path().is_dir() {
                copy(&entry.path(), &target);
            } else {
                std::fs::copy(entry.path(), target)?;
            }
        }
        Ok(())
    });
    copied.unwrap_or_else(|error| panic!("cannot copy {}: {error}", from.display()));
}
