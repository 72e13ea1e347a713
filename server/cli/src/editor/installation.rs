//! Compares the files that an editor needs with the disk, and writes or removes them.
//!
//! Our files have a marked line, and our lines in files of the user stand between marked lines. The marks have digests: what was
//! edited since is the user's, and stays without `--force`. Nothing else says what is installed, so a run that was interrupted
//! can be repeated.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use mauve_projects::destination::behind_links;
use mauve_projects::disk::{LONGEST, bytes_of};
use mauve_projects::folder::{Kind, above};
use mauve_projects::output::Output;
use mauve_projects::replace::{create, replace};

use super::embedded::Embedded;
use super::home::Home;
use super::{block, mark};

/// The files that an editor needs.
#[derive(Default)]
pub(super) struct Wanted {
    /// Files of our own, without their marks. Links in the folders above are resolved.
    pub(super) files: BTreeMap<PathBuf, String>,
    /// Folders that have only files for this editor: marked files of an earlier version may be there.
    pub(super) folders: Vec<PathBuf>,
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
        let mut wanted = Wanted { folders: vec![folder.to_owned()], ..Wanted::default() };
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
    /// Whether our lines were edited, if the text has them.
    is_edited: Option<bool>,
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
        let split = block::split(old.as_deref().unwrap_or_default())
            .map_err(|why| format!("`{}` {why}: correct it first; nothing was written", path.display()))?;
        Ok(Settings { path, old, rest: split.rest, is_edited: split.is_edited, lines: None })
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

enum Step {
    Write { path: PathBuf, text: String, replaces: bool },
    Remove(PathBuf),
}

/// How to install, or to uninstall.
pub(super) struct Installation<'a> {
    pub(super) home: &'a Home,
    pub(super) force: bool,
    pub(super) dry_run: bool,
}

impl Installation<'_> {
    /// Writes the files that differ, and removes those that an earlier version needed.
    pub(super) fn install(&self, wanted: Wanted) -> Result<Output, String> {
        let mut report = Report { dry_run: self.dry_run, ..Report::default() };
        let (mut steps, mut refused, mut code) = (Vec::new(), wanted.refused, 0);
        for (path, text) in &wanted.files {
            let new = mark::marked(path, text);
            let replaces = match state(path)? {
                State::Missing => false,
                State::File(old) if old == new.as_bytes() => continue,
                State::File(old) => {
                    match mark::is_edited(path, &old) {
                        _ if self.force || old == text.as_bytes() => {}
                        Some(false) => {}
                        found => refused.push(in_the_way(path, found.is_some())),
                    }
                    true
                }
                State::Other(kind) => {
                    refused.push(format!("`{}` is {kind}: remove or rename it", path.display()));
                    continue;
                }
            };
            steps.push(Step::Write { path: path.clone(), text: new, replaces });
        }
        for settings in wanted.settings {
            let text = settings.text();
            if settings.old.as_deref().unwrap_or_default() == text {
                continue;
            }
            if settings.is_edited == Some(true) && !self.force {
                refused.push(format!(
                    "the lines between `# mauve: begin` and `# mauve: end` in `{}` were edited: remove them, or use --force",
                    settings.path.display()
                ));
            }
            steps.push(Step::Write { path: settings.path, text, replaces: settings.old.is_some() });
        }
        if !refused.is_empty() {
            refused.iter().for_each(|why| report.line("refused", why));
            return Ok(report.finish("nothing was changed", 1));
        }
        for (path, is_edited) in installed(&wanted.folders, BTreeMap::new())? {
            if !wanted.files.contains_key(&path) {
                code |= self.remove(path, is_edited, &mut steps, &mut report);
            }
        }
        self.apply(&steps, &mut report)?;
        wanted.notes.iter().for_each(|note| report.line("note", note));
        Ok(report.finish(if steps.is_empty() { "up to date: nothing was changed" } else { "" }, code))
    }

    /// Removes the files and lines that have not been edited since, and the folders that are empty then.
    pub(super) fn uninstall(&self, wanted: Wanted) -> Result<Output, String> {
        let mut report = Report { dry_run: self.dry_run, ..Report::default() };
        let (mut steps, mut code) = (Vec::new(), 0);
        for (path, is_edited) in installed(&wanted.folders, wanted.files)? {
            code |= self.remove(path, is_edited, &mut steps, &mut report);
        }
        for settings in wanted.settings {
            match settings.is_edited {
                None => {}
                Some(true) if !self.force => {
                    let path = settings.path.display();
                    report.line("kept", &format!("the lines of MAUVE in `{path}`: {EDITED}"));
                    code = 1;
                }
                Some(_) if settings.rest.is_empty() => steps.push(Step::Remove(settings.path)),
                Some(_) => {
                    steps.push(Step::Write { path: settings.path, text: settings.rest, replaces: true });
                }
            }
        }
        if steps.is_empty() && code == 0 {
            return Ok(report.finish("not installed: nothing was changed", 0));
        }
        self.apply(&steps, &mut report)?;
        let removed = steps.iter().filter_map(|step| match step {
            Step::Remove(path) => Some(path.as_path()),
            Step::Write { .. } => None,
        });
        let mut removed: BTreeSet<&Path> = removed.collect();
        let above: BTreeSet<&Path> = removed.iter().flat_map(|path| path.ancestors().skip(1)).collect();
        // The inner folders first.
        for folder in above.into_iter().rev().filter(|folder| self.home.has(folder)) {
            let is_removed = match self.dry_run {
                true => has_only(folder, &removed),
                false => remove_folder(folder),
            };
            if is_removed {
                removed.insert(folder);
                report.done(REMOVED, folder);
            }
        }
        Ok(report.finish("", code))
    }

    /// Adds the step for an installed file that is to go. Returns 1 if it was edited, and stays.
    fn remove(&self, path: PathBuf, is_edited: bool, steps: &mut Vec<Step>, report: &mut Report) -> u8 {
        if is_edited && !self.force {
            report.line("kept", &format!("`{}`: {EDITED}", path.display()));
            return 1;
        }
        steps.push(Step::Remove(path));
        0
    }

    fn apply(&self, steps: &[Step], report: &mut Report) -> Result<(), String> {
        for step in steps {
            let (path, done) = match step {
                Step::Write { path, replaces: true, .. } => (path, ["changed", "would change"]),
                Step::Write { path, .. } => (path, ["wrote", "would write"]),
                Step::Remove(path) => (path, REMOVED),
            };
            if !self.dry_run {
                match step {
                    Step::Write { text, replaces, .. } => {
                        let write = if *replaces { replace } else { create };
                        write(path, text).map_err(failed("write", path))?;
                    }
                    Step::Remove(_) => remove_file(path)?,
                }
            }
            report.done(done, path);
        }
        Ok(())
    }
}

const REMOVED: [&str; 2] = ["removed", "would remove"];
const EDITED: &str = "edited since its installation; remove it by hand, or use --force";

fn in_the_way(path: &Path, is_known: bool) -> String {
    let path = path.display();
    match is_known {
        true => format!("`{path}` was edited since its installation: rename it, or use --force"),
        false => {
            format!("`{path}` exists, and mauve did not write it: rename it, or overwrite it with --force")
        }
    }
}

/// The lines for the user.
#[derive(Default)]
struct Report {
    text: String,
    dry_run: bool,
}

impl Report {
    fn done(&mut self, [done, would_be]: [&str; 2], path: &Path) {
        let done = if self.dry_run { would_be } else { done };
        self.text += &format!("{done} {}\n", path.display());
    }

    fn line(&mut self, label: &str, text: &str) {
        self.text += &format!("{label}: {text}\n");
    }

    fn finish(mut self, last: &str, code: u8) -> Output {
        if !last.is_empty() {
            self.text += &format!("{last}\n");
        }
        Output::escaped(self.text, code)
    }
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

/// Returns those of `files`, and of the files in these folders, that have a mark, and whether they were edited. Follows no links.
fn installed(
    folders: &[PathBuf],
    files: BTreeMap<PathBuf, String>,
) -> Result<BTreeMap<PathBuf, bool>, String> {
    let mut paths: BTreeSet<PathBuf> = files.into_keys().collect();
    let mut open = folders.to_vec();
    while let Some(folder) = open.pop() {
        let is_folder = |path: &Path| path.symlink_metadata().is_ok_and(|it| it.is_dir());
        if !is_folder(&folder) {
            continue;
        }
        for entry in std::fs::read_dir(&folder).map_err(failed("read", &folder))? {
            let path = entry.map_err(failed("read", &folder))?.path();
            if is_folder(&path) {
                open.push(path);
            } else {
                paths.insert(path);
            }
        }
    }
    let is_edited = |path: PathBuf| match state(&path).ok()? {
        State::File(bytes) => mark::is_edited(&path, &bytes).map(|is_edited| (path, is_edited)),
        State::Missing | State::Other(_) => None,
    };
    Ok(paths.into_iter().filter_map(is_edited).collect())
}

fn remove_file(path: &Path) -> Result<(), String> {
    match above(path).and_then(|(folder, name)| folder.remove_file(name)) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed.map_err(failed("remove", path)),
    }
}

/// Returns whether a folder exists, and has no other entries than these.
fn has_only(folder: &Path, removed: &BTreeSet<&Path>) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.into_iter().all(|entry| entry.is_ok_and(|entry| removed.contains(entry.path().as_path())))
}

/// Removes a folder if it is empty.
fn remove_folder(path: &Path) -> bool {
    above(path).and_then(|(folder, name)| folder.remove_folder(name)).is_ok()
}
