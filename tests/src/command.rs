//! Runs the binary and reads its output.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

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

impl Run {
    /// Returns whether standard output has this text, in whichever lines.
    pub fn has(&self, text: &str) -> bool {
        let in_a_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        in_a_line(&self.out).contains(&in_a_line(text))
    }
}

/// Runs git in `folder`, with no configuration but that of the repository.
///
/// # Panics
///
/// There is no git.
pub fn git(folder: &Path, arguments: &[&str]) -> Output {
    Command::new("git")
        .args(["-c", "user.name=robot", "-c", "user.email=robot@localhost"])
        .args(["-c", "commit.gpgSign=false", "-c", "core.autocrlf=false"])
        .args(arguments)
        .current_dir(folder)
        .env("GIT_CONFIG_GLOBAL", "/dev/null")
        .env("GIT_CONFIG_NOSYSTEM", "1")
        .output()
        .unwrap_or_else(|error| panic!("git does not run: {error}"))
}

/// Makes an empty folder below cargo's. A later call with the same name empties it.
///
/// # Panics
///
/// Another test of this run has the folder: tests run at the same time, each in a process or a thread of its own.
pub fn scratch(target: &str, name: &str) -> PathBuf {
    let folder = Path::new(target).join(name);
    let run = std::env::var("NEXTEST_RUN_ID").unwrap_or_else(|_| std::process::id().to_string());
    let owner = format!("{run} {}", std::thread::current().name().unwrap_or_default());
    let owner_file = Path::new(target).join(format!(".{}.owner", name.replace('/', "-")));
    let other = std::fs::read_to_string(&owner_file).unwrap_or_default();
    let is_other = other != owner && other.split(' ').next() == Some(&run);
    assert!(!is_other, "another test has {}: {other}", folder.display());
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&owner_file, owner))
        .unwrap_or_else(|error| panic!("cannot make {}: {error}", folder.display()));
    folder
}

/// The same for the tests of a unit, which no one gives a folder: behind all links, and this process's alone.
pub fn own_scratch(name: &str) -> PathBuf {
    let name = format!("mauve-{}-{name}", std::process::id());
    let folder = scratch(&std::env::temp_dir().to_string_lossy(), &name);
    folder.canonicalize().unwrap_or_else(|error| panic!("cannot read {}: {error}", folder.display()))
}

/// Returns a name for folders of the running test: tests run at the same time, each in a thread of its name.
pub fn test_name() -> String {
    std::thread::current().name().unwrap_or_default().replace("::", "-")
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
