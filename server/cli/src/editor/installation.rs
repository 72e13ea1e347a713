//! Compares the files that an editor needs with the disk, and writes those that differ.
//!
//! Our files have a marked line, and our lines in files of the user stand between marked lines. A file without the mark is the
//! user's, and stays without `--force`. Nothing else says what is installed, so a run that was interrupted can be repeated.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use mauve_projects::destination::behind_links;
use mauve_projects::disk::{LONGEST, bytes_of};
use mauve_projects::folder::{Kind, above};
use mauve_projects::output::Output;
use mauve_projects::replace::{create, replace};

use super::embedded::Embedded;
use super::options::Options;
use super::{block, mark};

/// The files that an editor needs.
#[derive(Default)]
pub(super) struct Wanted {
    /// Files of our own, without their marks. Links in the folders above are resolved.
    pub(super) files: BTreeMap<PathBuf, String>,
    /// Files of the user, with our lines in them.
    pub(super) settings: Vec<Settings>,
    /// Settings of the user that cannot be combined with ours: nothing is installed.
    pub(super) refused: Vec<String>,
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

/// A configuration file of the user.
pub(super) struct Settings {
    path: PathBuf,
    /// The text on the disk; none if there is no file.
    old: Option<String>,
    /// The text without our lines.
    pub(super) rest: String,
    /// Our lines, and the offset in `rest` where they go.
    lines: Option<(usize, String)>,
}

impl Settings {
    /// Reads a configuration file, which may be a link.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is not UTF-8.
    pub(super) fn read(path: &Path) -> Result<Settings, String> {
        let path = behind_links(path)?;
        let old = match state(&path)? {
            State::Missing => None,
            State::File(bytes) => Some(String::from_utf8(bytes).map_err(|_| {
                format!("`{}` is not UTF-8: correct it first; nothing was written", path.display())
            })?),
            State::Other(kind) => return Err(format!("`{}` is {kind}; nothing was written", path.display())),
        };
        let rest = block::without(old.as_deref().unwrap_or_default())
            .map_err(|why| format!("`{}` {why}: correct it first; nothing was written", path.display()))?;
        Ok(Settings { path, old, rest, lines: None })
    }

    /// Puts our lines at an offset of `rest`: its end, or the end of a line that is not blank.
    pub(super) fn put(&mut self, at: usize, lines: String) {
        self.lines = Some((at, lines));
    }

    /// Returns the path for messages.
    pub(super) fn shown(&self) -> std::path::Display<'_> {
        self.path.display()
    }

    /// Returns the text with our lines.
    pub(super) fn text(&self) -> String {
        match &self.lines {
            Some((at, lines)) => block::insert(&self.rest, *at, lines),
            None => self.rest.clone(),
        }
    }
}

/// The state of a path.
enum State {
    Missing,
    File(Vec<u8>),
    /// In words: a link, a folder.
    Other(&'static str),
}

/// Writes the files that differ, or only lists them with `--dry-run`.
pub(super) fn install(wanted: Wanted, options: &Options) -> Result<Output, String> {
    // Each path with its new text, and whether it replaces another.
    let mut writes: Vec<(PathBuf, String, bool)> = Vec::new();
    let mut refused = wanted.refused;
    for (path, text) in wanted.files {
        let new = mark::marked(&path, &text);
        match state(&path)? {
            State::Missing => writes.push((path, new, false)),
            State::File(old) if old == new.as_bytes() => {}
            // A file with the same text counts as MAUVE's, even without the mark.
            State::File(old) if options.force || old == text.as_bytes() || mark::is_ours(&path, &old) => {
                writes.push((path, new, true));
            }
            State::File(_) => refused.push(format!(
                "`{}` exists, and mauve did not write it: rename it, or overwrite it with --force",
                path.display()
            )),
            State::Other(kind) => {
                refused.push(format!("`{}` is {kind}: remove or rename it", path.display()))
            }
        }
    }
    for settings in wanted.settings {
        let text = settings.text();
        if settings.old.as_deref().unwrap_or_default() != text {
            writes.push((settings.path, text, settings.old.is_some()));
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
    out.extend(wanted.notes.iter().map(|note| line("note", note)));
    if writes.is_empty() {
        out += "up to date: nothing was changed\n";
    }
    Ok(Output::escaped(out, 0))
}

fn failed(doing: &str, path: &Path) -> impl Fn(io::Error) -> String {
    move |error| format!("cannot {doing} `{}`: {error}", path.display())
}

/// Returns the state of a path, and does not follow links.
fn state(path: &Path) -> Result<State, String> {
    let found = above(path).and_then(|(folder, name)| Ok((folder.kind(name)?, folder, name)));
    let (kind, folder, name) = match found {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(State::Missing),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            return Ok(State::Other("below a file or a link"));
        }
        Err(error) => return Err(failed("read", path)(error)),
    };
    Ok(match kind {
        Kind::File => {
            let file = folder.open_read(name);
            State::File(file.and_then(|file| bytes_of(file, LONGEST)).map_err(failed("read", path))?)
        }
        Kind::Folder => State::Other("a folder"),
        Kind::Link => State::Other("a link"),
        Kind::Other => State::Other("not a file"),
    })
}
