//! Compares the files that an editor needs with the disk, and writes those that differ.
//!
//! Our files have a marked line. A file without the mark is the user's, and stays without `--force`; settings of the user always stay.
//! Nothing else says what is installed, so a run that was interrupted can be repeated.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use mauve_projects::disk::{LONGEST, bytes_of};
use mauve_projects::folder::{FolderEntryKind, above};
use mauve_projects::output::Output;
use mauve_projects::replace::{create, replace};

use super::embedded::Embedded;
use super::mark;
use super::options::InstallOptions;

/// The files that an editor needs.
#[derive(Default)]
pub(super) struct Wanted {
    /// Files of our own, without their marks. Links in the folders above are resolved.
    pub(super) files: BTreeMap<PathBuf, String>,
    /// Files that the user may have.
    pub(super) settings: Vec<SettingsFile>,
    /// What the user may want to know after the installation.
    pub(super) notes: Vec<String>,
}

impl Wanted {
    /// What needs a folder with these files, whose links are resolved by now.
    pub(super) fn in_folder(folder: &Path, files: &[Embedded]) -> Wanted {
        let mut wanted = Wanted::default();
        wanted.add_all(folder, files);
        wanted
    }

    /// Adds files of our own in a folder.
    pub(super) fn add_all(&mut self, folder: &Path, files: &[Embedded]) {
        self.files.extend(files.iter().map(|(path, text)| (folder.join(path), (*text).to_owned())));
    }

    /// Adds a file of our own in a folder, whose links are resolved by now.
    pub(super) fn add(&mut self, folder: &Path, path: &str, text: impl Into<String>) {
        self.files.insert(folder.join(path), text.into());
    }
}

/// A configuration file of the user. It is written where there is none, and never changed.
pub(super) struct SettingsFile {
    /// Links in it are resolved.
    pub(super) path: PathBuf,
    pub(super) text: String,
}

impl SettingsFile {
    /// Returns whether a file of the user has each of our lines, in any order.
    fn are_in(&self, file: &[u8]) -> bool {
        let file = String::from_utf8_lossy(file);
        let mut lines = self.text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
        lines.all(|line| file.lines().any(|it| it.trim() == line))
    }
}

/// The state of a path.
enum PathState {
    Missing,
    File(Vec<u8>),
    /// In words: a link, a folder.
    Other(&'static str),
}

/// Writes the files that differ, or only lists them with `--dry-run`.
pub(super) fn install(wanted: Wanted, options: &InstallOptions) -> Result<Output, String> {
    // Each path with its new text, and whether it replaces another.
    let mut writes: Vec<(PathBuf, String, bool)> = Vec::new();
    let (mut refused, mut notes) = (Vec::new(), wanted.notes);
    for (path, text) in wanted.files {
        let new = mark::marked(&path, &text);
        match state(&path)? {
            PathState::Missing => writes.push((path, new, false)),
            PathState::File(old) if old == new.as_bytes() => {}
            // A file with the same text counts as MAUVE's, even without the mark.
            PathState::File(old) if options.force || old == text.as_bytes() || mark::is_ours(&path, &old) => {
                writes.push((path, new, true));
            }
            PathState::File(_) => refused.push(format!(
                "`{}` exists, and mauve did not write it: rename it, or overwrite it with --force",
                path.display()
            )),
            PathState::Other(kind) => {
                refused.push(format!("`{}` is {kind}: remove or rename it", path.display()))
            }
        }
    }
    for settings in wanted.settings {
        match state(&settings.path)? {
            PathState::Missing => writes.push((settings.path, settings.text, false)),
            PathState::File(old) if settings.are_in(&old) => {}
            PathState::File(_) => notes.push(format!(
                "`{}` is yours, and stays as it is; add these lines to it:\n{}",
                settings.path.display(),
                settings.text.trim_end()
            )),
            PathState::Other(kind) => {
                refused.push(format!("`{}` is {kind}: remove or rename it", settings.path.display()))
            }
        }
    }
    let line = |label: &str, text: &String| format!("{label}: {text}\n");
    if !refused.is_empty() {
        let refused: String = refused.iter().map(|why| line("refused", why)).collect();
        return Ok(Output::escaped(format!("{refused}nothing was changed\n"), 1));
    }
    let mut out = String::new();
    for (path, text, replaces) in &writes {
        if !options.dry_run {
            let write = if *replaces { replace } else { create };
            write(path, text).map_err(failed("write", path))?;
        }
        let done = match (replaces, options.dry_run) {
            (true, false) => "changed",
            (true, true) => "would change",
            (false, false) => "wrote",
            (false, true) => "would write",
        };
        out += &format!("{done} {}\n", path.display());
    }
    out.extend(notes.iter().map(|note| line("note", note)));
    if writes.is_empty() {
        out += "up to date: nothing was changed\n";
    }
    Ok(Output::escaped(out, 0))
}

fn failed(doing: &str, path: &Path) -> impl Fn(io::Error) -> String {
    move |error| format!("cannot {doing} `{}`: {error}", path.display())
}

/// Returns the state of a path, and does not follow links.
fn state(path: &Path) -> Result<PathState, String> {
    let found = above(path).and_then(|(folder, name)| Ok((folder.kind(name)?, folder, name)));
    let (kind, folder, name) = match found {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(PathState::Missing),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            return Ok(PathState::Other("below a file or a link"));
        }
        Err(error) => return Err(failed("read", path)(error)),
    };
    Ok(match kind {
        FolderEntryKind::File => {
            let file = folder.open_read(name);
            PathState::File(file.and_then(|file| bytes_of(file, LONGEST)).map_err(failed("read", path))?)
        }
        FolderEntryKind::Folder => PathState::Other("a folder"),
        FolderEntryKind::Link => PathState::Other("a link"),
        FolderEntryKind::Other => PathState::Other("not a file"),
    })
}
