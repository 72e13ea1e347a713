//! Compares the files that an editor needs with the disk, and writes or removes them.
//!
//! A manifest in `~/.local/share/mauve/editors` has the digests of the installed files, the marked lines in files of the user,
//! and the folders that were created. It is written before the first file and removed after the last one, so a run that was
//! interrupted can be repeated. Files that have another digest are the user's.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::block;
use super::home::Home;
use crate::disk::{LONGEST, bytes_of};
use crate::folder::{Folder, Folders, Kind};
use crate::generate::behind_links;
use crate::output::Output;
use crate::replace::replace;

/// The files that an editor needs.
#[derive(Default)]
pub(super) struct Wanted {
    /// Files of our own. Links in the folders above are resolved.
    pub(super) files: BTreeMap<PathBuf, String>,
    /// Files of the user, with our lines in them.
    pub(super) settings: Vec<Settings>,
    /// Settings of the user that cannot be combined with ours: nothing is installed.
    pub(super) refused: Vec<String>,
    /// What the user may want to know after the installation.
    pub(super) notes: Vec<String>,
}

impl Wanted {
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
    found: Option<String>,
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
        Ok(Settings { path, old, rest: split.rest, found: split.block, lines: None })
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

/// The manifest, as JSON.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Manifest {
    /// Created folders.
    folders: BTreeSet<PathBuf>,
    /// The digests that a file may have: two while it is updated.
    files: BTreeMap<PathBuf, BTreeSet<String>>,
    /// The same for lines in files of the user.
    settings: BTreeMap<PathBuf, Lines>,
}

#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Lines {
    digests: BTreeSet<String>,
    /// Whether the file was created for these lines.
    created: bool,
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

/// The installation for one editor.
pub(super) struct Installation {
    manifest_path: PathBuf,
    manifest: Manifest,
    force: bool,
    dry_run: bool,
}

impl Installation {
    /// # Errors
    ///
    /// The manifest cannot be read.
    pub(super) fn open(
        home: &Home,
        editor: &str,
        force: bool,
        dry_run: bool,
    ) -> Result<Installation, String> {
        let folder = behind_links(&home.data.join("mauve/editors"))?;
        let manifest_path = folder.join(editor).with_extension("json");
        let manifest = read_manifest(&manifest_path)?.unwrap_or_default();
        Ok(Installation { manifest_path, manifest, force, dry_run })
    }

    /// Writes the files that differ, and removes those that an earlier version needed.
    pub(super) fn install(mut self, wanted: Wanted) -> Result<Output, String> {
        let mut report = Report { dry_run: self.dry_run, ..Report::default() };
        let (mut steps, mut refused) = (Vec::new(), wanted.refused);
        let mut next = Manifest::default();
        for (path, text) in wanted.files {
            let digest = digest(text.as_bytes());
            let known = self.manifest.files.get(&path);
            match state(&path)? {
                State::Missing => {
                    steps.push(Step::Write { path: path.clone(), text, replaces: false });
                }
                State::File(old) if old == text.as_bytes() => {}
                State::File(old) if self.may_change(known, &old) => {
                    steps.push(Step::Write { path: path.clone(), text, replaces: true });
                }
                State::File(_) => refused.push(in_the_way(&path, known.is_some())),
                State::Other(kind) => {
                    refused.push(format!("`{}` is {kind}: remove or rename it", path.display()));
                }
            }
            next.files.insert(path, BTreeSet::from([digest]));
        }
        for settings in wanted.settings {
            self.settle_settings(settings, &mut next, &mut steps, &mut refused);
        }
        if !refused.is_empty() {
            refused.iter().for_each(|why| report.line("refused", why));
            return Ok(report.finish("nothing was changed", 1));
        }
        let mut code = 0;
        for (path, digests) in &self.manifest.files {
            if !next.files.contains_key(path) {
                code |= self.remove(path, digests, &mut steps, &mut next, &mut report)?;
            }
        }
        let writes = steps.iter().filter_map(|step| match step {
            Step::Write { path, .. } => Some(path.as_path()),
            Step::Remove(_) => None,
        });
        next.folders = self.manifest.folders.clone();
        next.folders.extend(self.new_folders(writes.chain([self.manifest_path.as_path()]))?);
        if steps.is_empty() && next == self.manifest {
            wanted.notes.iter().for_each(|note| report.note(note));
            return Ok(report.finish("up to date: nothing was changed", code));
        }
        // An interrupted run leaves files with the old digests and files with the new ones.
        let old = std::mem::take(&mut self.manifest);
        self.manifest = next.clone();
        for (path, digests) in old.files {
            self.manifest.files.entry(path).or_default().extend(digests);
        }
        for (path, lines) in old.settings {
            self.manifest.settings.entry(path).or_default().digests.extend(lines.digests);
        }
        self.write_manifest()?;
        self.apply(&steps, &mut report)?;
        self.manifest = next;
        self.write_manifest()?;
        wanted.notes.iter().for_each(|note| report.note(note));
        Ok(report.finish("", code))
    }

    /// Removes the files that have not been edited since, and the folders that were created for them.
    pub(super) fn uninstall(mut self) -> Result<Output, String> {
        let mut report = Report { dry_run: self.dry_run, ..Report::default() };
        let (mut steps, mut next, mut code) = (Vec::new(), Manifest::default(), 0);
        for (path, digests) in &self.manifest.files {
            code |= self.remove(path, digests, &mut steps, &mut next, &mut report)?;
        }
        for (path, lines) in &self.manifest.settings {
            let settings = Settings::read(path)?;
            let Some(found) = &settings.found else { continue };
            if !self.may_change(Some(&lines.digests), found.as_bytes()) {
                report.line("kept", &format!("the lines of MAUVE in `{}`: {EDITED}", path.display()));
                next.settings.insert(path.clone(), lines.clone());
                code = 1;
            } else if lines.created && settings.rest.is_empty() {
                steps.push(Step::Remove(path.clone()));
            } else {
                let text = settings.rest;
                steps.push(Step::Write { path: settings.path, text, replaces: true });
            }
        }
        if self.manifest == Manifest::default() {
            return Ok(report.finish("not installed: nothing was changed", 0));
        }
        self.apply(&steps, &mut report)?;
        next.folders = self.manifest.folders.clone();
        let is_empty = next.files.is_empty() && next.settings.is_empty();
        self.manifest = next;
        if is_empty {
            if !self.dry_run {
                remove_file(&self.manifest_path)?;
            }
        } else {
            self.write_manifest()?;
        }
        let removed = steps.iter().filter_map(|step| match step {
            Step::Remove(path) => Some(path.as_path()),
            Step::Write { .. } => None,
        });
        let mut removed: BTreeSet<&Path> = removed.collect();
        removed.extend(is_empty.then_some(self.manifest_path.as_path()));
        // The inner folders first.
        for folder in self.manifest.folders.iter().rev() {
            let is_removed = match self.dry_run {
                true => has_only(folder, &removed),
                false => remove_folder(folder),
            };
            if is_removed {
                removed.insert(folder);
                report.done("removed", folder);
            }
        }
        Ok(report.finish("", code))
    }

    /// Adds the step for a file that is not needed any longer. Returns 1 if it was edited, and stays.
    fn remove(
        &self,
        path: &Path,
        digests: &BTreeSet<String>,
        steps: &mut Vec<Step>,
        next: &mut Manifest,
        report: &mut Report,
    ) -> Result<u8, String> {
        match state(path)? {
            State::Missing => {}
            State::File(old) if self.may_change(Some(digests), &old) => {
                steps.push(Step::Remove(path.to_owned()));
            }
            State::File(_) => {
                report.line("kept", &format!("`{}`: {EDITED}", path.display()));
                next.files.insert(path.to_owned(), digests.clone());
                return Ok(1);
            }
            State::Other(kind) => {
                report.line("kept", &format!("`{}`, which is {kind} now", path.display()));
                return Ok(1);
            }
        }
        Ok(0)
    }

    fn settle_settings(
        &self,
        settings: Settings,
        next: &mut Manifest,
        steps: &mut Vec<Step>,
        refused: &mut Vec<String>,
    ) {
        let known = self.manifest.settings.get(&settings.path);
        let text = settings.text();
        if let Some(found) = &settings.found
            && settings.old.as_ref() != Some(&text)
            && !self.may_change(known.map(|it| &it.digests), found.as_bytes())
        {
            let path = settings.path.display();
            refused.push(format!(
                "the lines between `# mauve: begin` and `# mauve: end` in `{path}` were edited: remove them, \
                 or use --force"
            ));
        }
        if let Some((_, lines)) = &settings.lines {
            let created = known.map_or(settings.old.is_none(), |it| it.created);
            let lines = Lines { digests: BTreeSet::from([digest(lines.as_bytes())]), created };
            next.settings.insert(settings.path.clone(), lines);
        }
        let replaces = settings.old.is_some();
        if settings.old.unwrap_or_default() != text {
            steps.push(Step::Write { path: settings.path, text, replaces });
        }
    }

    fn may_change(&self, known: Option<&BTreeSet<String>>, old: &[u8]) -> bool {
        self.force || known.is_some_and(|known| known.contains(&digest(old)))
    }

    /// Returns the folders above these files that do not exist, or that an installation for another editor created.
    fn new_folders<'a>(&self, files: impl Iterator<Item = &'a Path>) -> Result<BTreeSet<PathBuf>, String> {
        let mut created = BTreeSet::new();
        let beside = self.manifest_path.parent().and_then(|it| std::fs::read_dir(it).ok());
        for entry in beside.into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|it| it == "json") {
                created.extend(read_manifest(&entry.path())?.unwrap_or_default().folders);
            }
        }
        let above: BTreeSet<&Path> = files.flat_map(|path| path.ancestors().skip(1)).collect();
        let is_new = |folder: &Path| created.contains(folder) || folder.symlink_metadata().is_err();
        Ok(above.into_iter().filter(|folder| is_new(folder)).map(Path::to_owned).collect())
    }

    fn write_manifest(&self) -> Result<(), String> {
        if self.dry_run {
            return Ok(());
        }
        let text = serde_json::to_string_pretty(&self.manifest)
            .map_err(|error| format!("cannot write `{}`: {error}", self.manifest_path.display()))?;
        let replaces = matches!(state(&self.manifest_path)?, State::File(_));
        write(&self.manifest_path, &(text + "\n"), replaces)
    }

    fn apply(&self, steps: &[Step], report: &mut Report) -> Result<(), String> {
        for step in steps {
            let (path, done) = match step {
                Step::Write { path, replaces: true, .. } => (path, "changed"),
                Step::Write { path, .. } => (path, "wrote"),
                Step::Remove(path) => (path, "removed"),
            };
            if !self.dry_run {
                match step {
                    Step::Write { text, replaces, .. } => write(path, text, *replaces)?,
                    Step::Remove(_) => remove_file(path)?,
                }
            }
            report.done(done, path);
        }
        Ok(())
    }
}

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
    fn done(&mut self, done: &str, path: &Path) {
        let done = match (self.dry_run, done) {
            (false, done) => done.to_owned(),
            (true, "wrote") => "would write".to_owned(),
            (true, "changed") => "would change".to_owned(),
            (true, _) => "would remove".to_owned(),
        };
        self.text += &format!("{done} {}\n", path.display());
    }

    fn line(&mut self, label: &str, text: &str) {
        self.text += &format!("{label}: {text}\n");
    }

    fn note(&mut self, note: &str) {
        self.text += &format!("note: {note}\n");
    }

    fn finish(mut self, last: &str, code: u8) -> Output {
        if !last.is_empty() {
            self.text += &format!("{last}\n");
        }
        Output::escaped(self.text, code)
    }
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn failed(doing: &str, path: &Path) -> impl Fn(io::Error) -> String {
    move |error| format!("cannot {doing} `{}`: {error}", path.display())
}

/// Returns the state of a path, and does not follow links.
fn state(path: &Path) -> Result<State, String> {
    let mut folders = Folders::below(Folder::top(path).map_err(failed("read", path))?);
    let kind = match folders.kind(path) {
        Ok(kind) => kind,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(State::Missing),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            return Ok(State::Other("below a file or a link"));
        }
        Err(error) => return Err(failed("read", path)(error)),
    };
    Ok(match kind {
        Kind::File => {
            let file = folders.above(path).and_then(|(folder, name)| folder.open_read(name));
            State::File(file.and_then(|file| bytes_of(file, LONGEST)).map_err(failed("read", path))?)
        }
        Kind::Folder => State::Other("a folder"),
        Kind::Link => State::Other("a link"),
        Kind::Other => State::Other("not a file"),
    })
}

/// Reads a manifest; none if there is no file.
fn read_manifest(path: &Path) -> Result<Option<Manifest>, String> {
    match state(path)? {
        State::Missing => Ok(None),
        State::File(bytes) => serde_json::from_slice(&bytes).map(Some).map_err(|error| {
            format!("`{}` is damaged ({error}): remove it, then install with --force", path.display())
        }),
        State::Other(kind) => Err(format!("`{}` is {kind}: remove it", path.display())),
    }
}

/// Writes a file as a whole. A new file never replaces one that another process creates at the same time.
fn write(path: &Path, text: &str, replaces: bool) -> Result<(), String> {
    let written = match replaces {
        true => replace(path, text),
        false => create(path, text),
    };
    written.map_err(failed("write", path))
}

fn create(path: &Path, text: &str) -> io::Result<()> {
    let mut folders = Folders::below(Folder::top(path)?);
    let (folder, name) = folders.make_above(path, &mut Vec::new())?;
    let mut beside = std::ffi::OsString::from(".");
    beside.push(name);
    beside.push(format!(".{}.tmp", std::process::id()));
    let mut file: File = folder.create_new(&beside, None)?;
    let written = file.write_all(text.as_bytes()).and_then(|()| folder.put_new(&beside, &folder, name));
    // Where the file system has hard links, the file has two names.
    let _ = folder.remove_file(&beside);
    written
}

fn remove_file(path: &Path) -> Result<(), String> {
    let removed = Folder::top(path)
        .and_then(|top| Folders::below(top).above(path))
        .and_then(|(folder, name)| folder.remove_file(name));
    match removed {
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
    let removed = Folder::top(path)
        .and_then(|top| Folders::below(top).above(path))
        .and_then(|(folder, name)| folder.remove_folder(name));
    removed.is_ok()
}
