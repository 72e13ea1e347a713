//! Executes all steps of a plan, or none.
//!
//! New texts are first written and synced to a staging folder next to the packages; replaced files are kept there
//! until the last step. If a step fails, all files are restored. Of a run that was killed the next one finds files of
//! two kinds, those that it would have written and those that the manifest knows, since manifests come last: it
//! writes the others.
//!
//! A folder may be exchanged for a link meanwhile. Each is opened once, without following any, and is held to
//! the end: what was checked is what is written to, and where something is put back.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_orocos::{Action, MANIFEST, PlanStep};

use super::out::{Out, is_name, no_path, not_a_file, not_a_folder};
use crate::destination::{leads_nowhere, not_read};
use crate::folder::{Folder, FolderEntryKind, Folders};
use crate::holder::holder;

/// The staging folder for new texts and replaced files.
const STAGING: &str = ".mauve-staging";

/// How long to wait for the lock of another run.
const PATIENCE: Duration = Duration::from_secs(10);

/// A folder of packages, locked by one run. Fields are dropped in order: the lock last.
pub struct Site {
    root: Folder,
    _made: MadeFolders,
    _lock: Option<File>,
}

/// Folders that were created for a site, the outermost first. They are removed again if they stay empty.
struct MadeFolders {
    folders: Folders,
    paths: Vec<PathBuf>,
}

impl Drop for MadeFolders {
    fn drop(&mut self) {
        remove_empty(&mut self.folders, self.paths.iter().rev().map(PathBuf::as_path));
    }
}

impl Site {
    /// Creates the folder if it does not exist, and waits until no other run writes to it.
    pub fn open(out: &Out) -> Result<Site, String> {
        if out.real.exists() && !out.real.is_dir() {
            return Err(not_a_folder(&out.shown));
        }
        let failed =
            |error: io::Error| format!("cannot create the folder `{}`: {error}", out.shown.display());
        let busy = |holder: Option<String>| {
            let (folder, other) = (out.shown.display(), holder.unwrap_or_else(|| "another mauve".to_owned()));
            format!("{other} writes to `{folder}`: wait for its end; nothing was written")
        };
        let start = Instant::now();
        loop {
            let top = Folder::top(&out.real).map_err(failed)?;
            let mut made = MadeFolders { folders: Folders::below(top), paths: Vec::new() };
            let patience = PATIENCE.saturating_sub(start.elapsed());
            let root = match made.folders.make(&out.real, &mut made.paths) {
                // A failed run has removed the folder in the meantime.
                Err(error) if error.kind() == ErrorKind::NotFound && !patience.is_zero() => continue,
                root => root.map_err(failed)?,
            };
            let lock = lock(&root, patience).map_err(|LockHeld(holder)| busy(holder))?;
            let site = Site { root, _made: made, _lock: lock };
            // The folder may have been replaced while this run waited for the lock.
            if Folder::open(&out.real).is_ok_and(|there| there.is(&site.root)) {
                return Ok(site);
            }
            if patience.is_zero() {
                return Err(busy(None));
            }
        }
    }

    /// Executes all steps, or none.
    ///
    /// # Errors
    ///
    /// The step that failed, as a message for the user; then nothing has changed.
    pub fn write(&self, steps: &[PlanStep]) -> Result<(), String> {
        if steps.is_empty() {
            // A run that was killed after its last step may have left copies there.
            if !self.holds_originals() {
                let _ = self.discard();
            }
            return Ok(());
        }
        let is_manifest = |step: &&PlanStep| step.path.ends_with(MANIFEST);
        let is_other = |step: &&PlanStep| !is_manifest(step);
        let ordered = steps.iter().filter(is_other).chain(steps.iter().filter(is_manifest));
        let target = |step| target(self.root.path(), step).map(|path| (step, path));
        let targets: Vec<(&PlanStep, PathBuf)> = ordered.map(target).collect::<Result<_, _>>()?;
        let kept = self.root.path().join(STAGING);
        if self.holds_originals() {
            return Err(format!(
                "an earlier run was interrupted, and the files that it replaced are in `{}`: restore those \
                 that you edited, then remove that folder; nothing was written",
                kept.display()
            ));
        }
        let mut run = failing(&kept, self.begin(&targets)).map_err(|error| self.given_up(&error))?;
        if let Err(error) = run.each(WritingRun::stage).and_then(|()| run.each(WritingRun::put)) {
            let lost: Vec<String> = run.undo().iter().map(|path| format!("`{}`", path.display())).collect();
            if !lost.is_empty() {
                let kept = kept.display();
                return Err(format!("{error}; {} could not be restored: see `{kept}`", lost.join(", ")));
            }
            return Err(self.given_up(&error));
        }
        let _ = self.discard();
        for (_, path) in targets.iter().filter(|(step, _)| step.action == Action::Remove) {
            let above = path.ancestors().skip(1).take_while(|above| *above != self.root.path());
            remove_empty(&mut run.folders, above);
        }
        Ok(())
    }

    fn begin<'a>(&self, targets: &'a [(&'a PlanStep, PathBuf)]) -> io::Result<WritingRun<'a>> {
        self.discard()?;
        if !self.root.make_folder(OsStr::new(STAGING))? {
            return Err(ErrorKind::AlreadyExists.into());
        }
        let staging = self.root.folder(OsStr::new(STAGING))?;
        Ok(WritingRun { folders: Folders::below(self.root.clone()), staging, targets, done: Vec::new() })
    }

    /// Removes the staging folder of a run that was undone. Returns the message for the user.
    fn given_up(&self, error: &str) -> String {
        let _ = self.discard();
        format!("{error}; nothing was changed")
    }

    /// Returns whether the staging folder holds replaced files of an interrupted run. A complete run leaves none.
    fn holds_originals(&self) -> bool {
        // The name of a new text is its number.
        let is_copy = |name: &OsString| name.as_encoded_bytes().iter().all(u8::is_ascii_digit);
        match self.root.kind(OsStr::new(STAGING)) {
            Ok(FolderEntryKind::Folder) => {
                let names = self.root.folder(OsStr::new(STAGING)).and_then(|staging| staging.names());
                names.is_ok_and(|names| !names.iter().all(is_copy))
            }
            Ok(_) => true,
            Err(_) => false,
        }
    }

    fn discard(&self) -> io::Result<()> {
        let staging = OsStr::new(STAGING);
        match self.root.kind(staging) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            _ => self.root.remove_all(staging),
        }
    }
}

/// The folder is locked by this process, if that is known.
struct LockHeld(Option<String>);

/// Locks a folder, if its file system supports locks. The folder itself is locked, so no lock file is left.
fn lock(folder: &Folder, patience: Duration) -> Result<Option<File>, LockHeld> {
    let Ok(file) = folder.as_file() else { return Ok(None) };
    let start = Instant::now();
    loop {
        match file.try_lock() {
            Err(fs::TryLockError::WouldBlock) if start.elapsed() >= patience => {
                return Err(LockHeld(holder(&file)));
            }
            Err(fs::TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
            _ => return Ok(Some(file)),
        }
    }
}

/// Removes folders up to the first that is not empty.
fn remove_empty<'a>(folders: &mut Folders, mut paths: impl Iterator<Item = &'a Path>) {
    let mut remove = |path: &Path| folders.above(path).and_then(|(folder, name)| folder.remove_folder(name));
    let _ = paths.find(|&path| remove(path).is_err());
}

/// Returns the path that a step writes, with links resolved, which is below the root. The write must not follow links
/// on this path: they would be new.
pub fn target(root: &Path, step: &PlanStep) -> Result<PathBuf, String> {
    let mut at = root.to_owned();
    // A package may not write to another package through a link.
    let mut within = root.to_owned();
    let mut parts = step.path.split('/').peekable();
    while let Some(part) = parts.next() {
        if !is_name(part) {
            return Err(no_path(&step.path));
        }
        at.push(part);
        let is_last = parts.peek().is_none();
        let data = match fs::symlink_metadata(&at) {
            Ok(data) => data,
            // The folders above were checked: nothing exists below.
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            Err(error) => return Err(not_read(&at, &error)),
        };
        let mut is_folder = data.is_dir();
        if data.is_symlink() {
            // A manifest is untrusted, and may list files of the user.
            if step.action == Action::Remove {
                let link = at.display();
                return Err(format!(
                    "`{link}` is a link, and the generator removes no files behind a link: remove the file \
                     yourself"
                ));
            }
            let real = at.canonicalize().map_err(|_| leads_nowhere(&at))?;
            if !real.starts_with(&within) {
                return Err(format!(
                    "`{}` is a link that leads out of `{}`, and nothing is written there: generate into the \
                     target folder, or replace the link by a folder",
                    at.display(),
                    within.display()
                ));
            }
            is_folder = real.is_dir();
            // A link to a file is replaced; its target is kept.
            if !is_last {
                at = real;
            }
        }
        match is_last {
            true if is_folder => return Err(not_a_file(&at)),
            false if !is_folder => return Err(not_a_folder(&at)),
            _ => {}
        }
        if within == *root && !is_last {
            within.clone_from(&at);
        }
    }
    Ok(at)
}

fn failing<T>(path: &Path, result: io::Result<T>) -> Result<T, String> {
    result.map_err(|error| format!("cannot write `{}`: {error}", path.display()))
}

struct WritingRun<'a> {
    folders: Folders,
    /// The folder with the new texts, named by the numbers of their steps, and the replaced files.
    staging: Folder,
    targets: &'a [(&'a PlanStep, PathBuf)],
    done: Vec<Done>,
}

enum Done {
    /// A folder was made.
    Made(PathBuf),
    /// A file was created.
    Created(PathBuf),
    /// A file was moved to the staging folder, under this name.
    Taken { path: PathBuf, old: OsString },
}

impl WritingRun<'_> {
    /// Calls a function for each step.
    fn each(&mut self, act: fn(&mut Self, &Action, &Path, usize) -> io::Result<()>) -> Result<(), String> {
        let targets = self.targets;
        let mut steps = targets.iter().enumerate();
        steps.try_for_each(|(number, (step, path))| failing(path, act(self, &step.action, path, number)))
    }

    /// Writes the new text of a file to the staging folder.
    fn stage(&mut self, action: &Action, path: &Path, number: usize) -> io::Result<()> {
        let (text, like) = match action {
            Action::Create(text) => (text, None),
            Action::Change(text) => (text, Some(self.permissions(path)?)),
            Action::Remove => return Ok(()),
        };
        let mut file = self.staging.create_new(number.to_string().as_ref(), like.as_ref())?;
        file.write_all(text.as_bytes())?;
        file.sync_all()
    }

    /// Returns the owner and the permissions of a file to replace. Fails for a read-only file, even in a writable folder.
    fn permissions(&mut self, path: &Path) -> io::Result<Metadata> {
        let (folder, name) = self.folders.above(path)?;
        if folder.kind(name)? != FolderEntryKind::Link {
            return folder.writable(name);
        }
        // The file that replaces a link has the permissions of the link's target.
        let real = path.canonicalize()?;
        let (folder, name) = self.folders.above(&real)?;
        folder.writable(name)
    }

    /// Moves the new text of a file to its path, and the old one to the staging folder.
    fn put(&mut self, action: &Action, path: &Path, number: usize) -> io::Result<()> {
        let [new, old] = [number.to_string(), format!("{number}.old")].map(OsString::from);
        match action {
            Action::Create(_) => {
                let mut made = Vec::new();
                let found = self.folders.make_above(path, &mut made);
                self.done.extend(made.into_iter().map(Done::Made));
                let (folder, name) = found?;
                self.staging.put_new(&new, &folder, name).map_err(|error| match error.kind() {
                    kind @ ErrorKind::AlreadyExists => {
                        io::Error::new(kind, "another program has written it in the meantime")
                    }
                    _ => error,
                })?;
                self.done.push(Done::Created(path.to_owned()));
            }
            Action::Change(_) => {
                let (folder, name) = self.folders.above(path)?;
                // A hard link keeps the path present all the time; some file systems do not support hard links.
                let linked = folder.hard_link(name, &self.staging, &old);
                linked.or_else(|_| folder.rename(name, &self.staging, &old))?;
                self.done.push(Done::Taken { path: path.to_owned(), old });
                self.staging.rename(&new, &folder, name)?;
            }
            Action::Remove => {
                let (folder, name) = self.folders.above(path)?;
                folder.rename(name, &self.staging, &old)?;
                self.done.push(Done::Taken { path: path.to_owned(), old: old.clone() });
                // No other process can replace it from here on.
                if self.staging.kind(&old)? != FolderEntryKind::File {
                    return Err(io::Error::other("it is no longer a file"));
                }
            }
        }
        Ok(())
    }

    /// Undoes all steps, the last one first. Returns the paths that could not be restored.
    fn undo(&mut self) -> Vec<PathBuf> {
        let mut lost = Vec::new();
        for done in std::mem::take(&mut self.done).into_iter().rev() {
            let (Done::Made(path) | Done::Created(path) | Done::Taken { path, .. }) = &done;
            let undone = self.folders.above(path).and_then(|(folder, name)| match &done {
                Done::Made(_) => folder.remove_folder(name),
                Done::Created(_) => folder.remove_file(name),
                Done::Taken { old, .. } => self.staging.rename(old, &folder, name),
            });
            if undone.is_err() {
                lost.push(path.clone());
            }
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, symlink};

    use super::*;

    fn scratch(name: &str) -> PathBuf {
        mauve_tests::own_scratch(&format!("write-{name}"))
    }

    fn step(path: &str, action: Action) -> PlanStep {
        PlanStep { path: path.to_owned(), action }
    }

    fn create(path: &str) -> PlanStep {
        step(path, Action::Create(format!("new {path}")))
    }

    fn open(folder: &Path) -> Site {
        Site::open(&Out::named(folder).unwrap()).unwrap()
    }

    /// Every file and folder, with its text, its inode and the time of its last change.
    fn everything(folder: &Path) -> Vec<(PathBuf, String, u64, i64)> {
        let mut found = Vec::new();
        let mut open = vec![folder.to_owned()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let data = path.symlink_metadata().unwrap();
                let text = fs::read_to_string(&path).unwrap_or_default();
                let time = if data.is_dir() { 0 } else { data.mtime_nsec() };
                found.push((path.clone(), text, data.ino(), time));
                open.extend(Some(path).filter(|_| data.is_dir()));
            }
        }
        found.sort();
        found
    }

    #[test]
    fn all_is_written_and_modes_are_kept() {
        let folder = scratch("all");
        fs::create_dir_all(folder.join("p/old")).unwrap();
        fs::write(folder.join("p/changed"), "old").unwrap();
        fs::set_permissions(folder.join("p/changed"), Permissions::from_mode(0o640)).unwrap();
        fs::write(folder.join("p/old/removed"), "old").unwrap();
        let site = open(&folder);
        let changed = step("p/changed", Action::Change("new".to_owned()));
        site.write(&[create("p/a/b"), changed, step("p/old/removed", Action::Remove)]).unwrap();
        let found: Vec<_> = everything(&folder).into_iter().map(|(path, text, ..)| (path, text)).collect();
        let expected = [("p", ""), ("p/a", ""), ("p/a/b", "new p/a/b"), ("p/changed", "new")];
        assert_eq!(found, expected.map(|(path, text)| (folder.join(path), text.to_owned())));
        assert_eq!(fs::metadata(folder.join("p/changed")).unwrap().permissions().mode() & 0o777, 0o640);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn copies_of_a_run_that_was_cut_off_go() {
        let folder = scratch("copies");
        fs::create_dir_all(folder.join(STAGING)).unwrap();
        fs::write(folder.join(STAGING).join("0"), "new").unwrap();
        open(&folder).write(&[]).unwrap();
        assert_eq!(everything(&folder), []);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_a_run_that_was_cut_off_put_aside_stays() {
        let folder = scratch("cut_off");
        let aside = folder.join(STAGING).join("0.old");
        fs::create_dir_all(folder.join(STAGING)).unwrap();
        fs::write(&aside, "mine").unwrap();
        let why = open(&folder).write(&[create("p/a")]).unwrap_err();
        assert!(why.contains("restore those that you edited"), "{why}");
        assert_eq!(fs::read_to_string(&aside).unwrap(), "mine");
        assert!(!folder.join("p").exists());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn whatever_step_fails_everything_is_as_it_was() {
        let folder = scratch("fails");
        fs::create_dir_all(folder.join("p/old")).unwrap();
        for path in ["p/changed", "p/old/removed", "p/there"] {
            fs::write(folder.join(path), path).unwrap();
        }
        // It was killed in the middle.
        let before = everything(&folder);
        fs::create_dir(folder.join(STAGING)).unwrap();
        fs::write(folder.join(STAGING).join("0"), "left").unwrap();
        let site = open(&folder);
        let good = [
            create("p/a/b/c"),
            step("p/changed", Action::Change("new".to_owned())),
            step("p/old/removed", Action::Remove),
        ];
        let bad = [
            create("p/there"),
            step("p/gone", Action::Remove),
            step("p/gone", Action::Change(String::new())),
            create("p/a/b/c/d"),
        ];
        for bad in bad {
            for at in 0..=good.len() {
                let mut steps = good.to_vec();
                steps.insert(at, bad.clone());
                let error = site.write(&steps).unwrap_err();
                assert!(error.ends_with("; nothing was changed"), "{error}");
                assert_eq!(everything(&folder), before, "{error}");
            }
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn nothing_is_written_outside() {
        let top = scratch("outside");
        for folder in ["out/p/deep", "out/q", "elsewhere"] {
            fs::create_dir_all(top.join(folder)).unwrap();
        }
        fs::write(top.join("elsewhere/file"), "theirs").unwrap();
        fs::write(top.join("out/q/file"), "q").unwrap();
        fs::write(top.join("out/p/plain"), "p").unwrap();
        symlink("../../elsewhere", top.join("out/p/folder")).unwrap();
        symlink("../../elsewhere/file", top.join("out/p/file")).unwrap();
        symlink("/nowhere", top.join("out/p/nowhere")).unwrap();
        symlink("../q", top.join("out/p/inside")).unwrap();
        fs::write(top.join("out/p/deep/file"), "deep").unwrap();
        symlink("deep", top.join("out/p/own")).unwrap();
        symlink("deep/file", top.join("out/p/inner")).unwrap();
        let before = everything(&top);
        let site = open(&top.join("out"));
        let change = |path: &str| step(path, Action::Change(String::new()));
        for (step, message) in [
            (create("p/folder/new"), "leads out of"),
            (change("p/folder/file"), "leads out of"),
            (change("p/file"), "leads out of"),
            (step("p/file", Action::Remove), "removes no files behind a link"),
            (step("p/inner", Action::Remove), "removes no files behind a link"),
            (step("p/own/file", Action::Remove), "removes no files behind a link"),
            (step("p/nowhere", Action::Remove), "removes no files behind a link"),
            (change("p/nowhere"), "leads nowhere"),
            (create("p/nowhere/new"), "leads nowhere"),
            (create("../elsewhere/new"), "not a path"),
            (create("/etc/new"), "not a path"),
            (create("p//new"), "not a path"),
            (create("p/plain/new"), "is not a folder"),
            (change("p/inside"), "leads out of"),
            (create("p/inside/new"), "leads out of"),
            (step("p/inside/file", Action::Remove), "removes no files behind a link"),
            (change("q"), "is a folder"),
        ] {
            let error = site.write(&[create("p/first"), step]).unwrap_err();
            assert!(error.contains(message), "{error}");
            assert_eq!(everything(&top), before);
        }
        site.write(&[create("p/own/new"), step("p/inner", Action::Change("mine".to_owned()))]).unwrap();
        assert_eq!(fs::read_to_string(top.join("out/p/deep/new")).unwrap(), "new p/own/new");
        assert_eq!(fs::read_to_string(top.join("out/p/deep/file")).unwrap(), "deep");
        assert_eq!(fs::read_to_string(top.join("out/p/inner")).unwrap(), "mine");
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_package_that_becomes_a_link_after_it_was_checked_is_not_followed() {
        let top = scratch("package");
        for (path, text) in [("out/p/src/old", "ours"), ("outside/src/old", "theirs")] {
            let path = top.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let site = open(&top.join("out"));
        let change = step("p/src/old", Action::Change("mine".to_owned()));
        let steps = [create("p/src/new"), create("p/deep/new"), change, step("p/src/old", Action::Remove)];
        let targets = steps.each_ref().map(|step| (step, target(site.root.path(), step).unwrap()));
        let exchange = || {
            fs::rename(top.join("out/p"), top.join("out/q")).unwrap();
            symlink("../outside", top.join("out/p")).unwrap();
        };
        exchange();
        let before = everything(&top);
        for one in &targets {
            let mut run = site.begin(std::slice::from_ref(one)).unwrap();
            let error = run.each(WritingRun::stage).and_then(|()| run.each(WritingRun::put)).unwrap_err();
            assert!(error.contains("is not a folder, or has become a link"), "{error}");
            assert_eq!(run.undo(), Vec::<PathBuf>::new());
            site.discard().unwrap();
            assert_eq!(everything(&top), before);
        }
        // In the middle of it, everything goes to the folder that it was, and is put back there.
        fs::remove_file(top.join("out/p")).unwrap();
        fs::rename(top.join("out/q"), top.join("out/p")).unwrap();
        let outside = everything(&top.join("outside"));
        let [new, _, change, _] = &targets;
        let both = [new.clone(), change.clone()];
        let mut run = site.begin(&both).unwrap();
        run.each(WritingRun::stage).unwrap();
        exchange();
        run.each(WritingRun::put).unwrap();
        assert_eq!(fs::read_to_string(top.join("out/q/src/old")).unwrap(), "mine");
        assert_eq!(fs::read_to_string(top.join("out/q/src/new")).unwrap(), "new p/src/new");
        assert_eq!(run.undo(), Vec::<PathBuf>::new());
        assert_eq!(fs::read_to_string(top.join("out/q/src/old")).unwrap(), "ours");
        assert!(!top.join("out/q/src/new").exists());
        assert_eq!(everything(&top.join("outside")), outside);
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_folder_that_becomes_a_link_after_it_was_checked_is_not_followed() {
        let top = scratch("root");
        for folder in ["out", "outside/p"] {
            fs::create_dir_all(top.join(folder)).unwrap();
        }
        let out = Out::named(&top.join("out")).unwrap();
        let inner = Out::named(&top.join("out/new/deep")).unwrap();
        let site = Site::open(&out).unwrap();
        fs::rename(top.join("out"), top.join("moved")).unwrap();
        symlink("outside", top.join("out")).unwrap();
        let before = everything(&top.join("outside"));
        for out in [&out, &inner] {
            let why = Site::open(out).err().unwrap();
            assert!(why.contains("is not a folder, or has become a link"), "{why}");
        }
        // Whoever has it open writes to what it was.
        site.write(&[create("p/new"), create("q/new")]).unwrap();
        assert_eq!(fs::read_to_string(top.join("moved/p/new")).unwrap(), "new p/new");
        assert_eq!(everything(&top.join("outside")), before);
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_folder_that_nothing_came_into_goes_again() {
        let top = scratch("empty");
        let site = open(&top.join("a/b"));
        assert!(top.join("a/b").is_dir());
        assert!(site.write(&[step("p/gone", Action::Remove)]).is_err());
        drop(site);
        assert_eq!(everything(&top), []);
        open(&top.join("a/b")).write(&[create("p/new")]).unwrap();
        assert!(top.join("a/b/p/new").is_file());
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn runs_wait_for_each_other() {
        let top = scratch("wait");
        let sites: Vec<_> = (0..8)
            .map(|_| {
                let folder = top.join("out");
                std::thread::spawn(move || {
                    let site = open(&folder);
                    site.write(&[create("p/a"), create("p/b")]).unwrap();
                    site.write(&[step("p/a", Action::Remove), step("p/b", Action::Remove)]).unwrap();
                })
            })
            .collect();
        sites.into_iter().for_each(|site| site.join().unwrap());
        let folder = Folder::open(&top).unwrap();
        let [site, other] = [&folder, &folder].map(|folder| lock(folder, Duration::from_millis(50)));
        assert!(site.is_ok() && other.is_err());
        fs::remove_dir_all(&top).unwrap();
    }
}
