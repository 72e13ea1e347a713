//! Writes all that a plan says, or nothing.
//!
//! New texts are written to a folder beside the packages first, and are on the disk before the first of them takes its
//! place; what was there is kept until the last one has. When anything fails, everything is put back. Of a run that was
//! killed the next one finds files of two kinds, those that it would have written and those that the manifest knows,
//! since manifests come last: it writes the others.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_orocos::{Action, MANIFEST, Step};

use super::{leads_nowhere, not_a_file, not_a_folder};

/// Where new texts wait, and old ones.
const STAGING: &str = ".mauve-staging";

/// Another run has so long to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// A folder of packages, for one run alone.
pub(crate) struct Site {
    /// Behind all links.
    root: PathBuf,
    /// Folders that were made for it, the outermost first: they go again where nothing is put into them.
    made: Vec<PathBuf>,
    /// Held as long as this is open.
    lock: Option<File>,
}

impl Drop for Site {
    fn drop(&mut self) {
        remove_empty(self.made.iter().rev());
        drop(self.lock.take());
    }
}

impl Site {
    /// Makes the folder where there is none, and waits until no other run is at work in it.
    ///
    /// # Errors
    ///
    /// Why there can be no such folder, in words for the user.
    pub(crate) fn open(folder: &Path) -> Result<Site, String> {
        if folder.exists() && !folder.is_dir() {
            return Err(not_a_folder(folder));
        }
        let failed = |error: io::Error| format!("the folder `{}` cannot be made: {error}", folder.display());
        let start = Instant::now();
        loop {
            let mut site = Site { root: PathBuf::new(), made: Vec::new(), lock: None };
            let patience = PATIENCE.saturating_sub(start.elapsed());
            let made = make_folder(folder, &mut site.made).and_then(|()| folder.canonicalize());
            site.root = match made {
                // A run that failed took it away meanwhile.
                Err(error) if error.kind() == ErrorKind::NotFound && !patience.is_zero() => continue,
                made => made.map_err(failed)?,
            };
            site.lock = lock(&site.root, patience).map_err(|Busy| {
                format!("another `mauve generate` is at work in `{}`: nothing was written", folder.display())
            })?;
            if is_locked(site.lock.as_ref(), &site.root) {
                return Ok(site);
            }
        }
    }

    /// Does all steps, or none of them.
    ///
    /// # Errors
    ///
    /// What failed, in words for the user; everything is as it was then.
    pub(crate) fn write(&self, steps: &[Step]) -> Result<(), String> {
        if steps.is_empty() {
            return Ok(());
        }
        let is_manifest = |step: &&Step| step.path.ends_with(MANIFEST);
        let is_other = |step: &&Step| !is_manifest(step);
        let ordered = steps.iter().filter(is_other).chain(steps.iter().filter(is_manifest));
        let target = |step| target(&self.root, step).map(|path| (step, path));
        let targets: Vec<(&Step, PathBuf)> = ordered.map(target).collect::<Result<_, _>>()?;
        let mut undo = Undo::default();
        let staging = self.root.join(STAGING);
        if holds_originals(&staging) {
            return Err(format!(
                "a run was cut off, and what it had put aside is in `{}`: put back what is yours, then remove that \
                 folder; nothing was written",
                staging.display()
            ));
        }
        let written = failing(&staging, discard(&staging).and_then(|()| fs::create_dir(&staging)))
            .and_then(|()| stage(&targets, &staging))
            .and_then(|()| put(&targets, &staging, &mut undo));
        if let Err(error) = written {
            let lost: Vec<String> = undo.all().iter().map(|path| format!("`{}`", path.display())).collect();
            if !lost.is_empty() {
                let kept = staging.display();
                return Err(format!("{error}; {} could not be put back: see `{kept}`", lost.join(", ")));
            }
            let _ = discard(&staging);
            return Err(format!("{error}; nothing was changed"));
        }
        let _ = discard(&staging);
        for (_, path) in targets.iter().filter(|(step, _)| step.action == Action::Remove) {
            remove_empty(path.ancestors().skip(1).take_while(|above| *above != self.root));
        }
        Ok(())
    }
}

/// Somebody else has the lock.
struct Busy;

/// Keeps others out of a folder, as far as its file system knows how. The folder itself is locked, so that nothing is left.
#[cfg(unix)]
fn lock(folder: &Path, patience: Duration) -> Result<Option<File>, Busy> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    let start = Instant::now();
    loop {
        match file.try_lock() {
            Err(fs::TryLockError::WouldBlock) if start.elapsed() >= patience => return Err(Busy),
            Err(fs::TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
            _ => return Ok(Some(file)),
        }
    }
}

/// Is this the folder that was locked, and not another one by now?
#[cfg(unix)]
fn is_locked(lock: Option<&File>, folder: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let [locked, there] = [lock.and_then(|lock| lock.metadata().ok()), fs::metadata(folder).ok()]
        .map(|data| data.map(|data| (data.dev(), data.ino())));
    there.is_some() && (lock.is_none() || locked == there)
}

/// Folders cannot be locked here: two runs at once may give each other's files, and the next one mends it.
#[cfg(not(unix))]
fn lock(_: &Path, _: Duration) -> Result<Option<File>, Busy> {
    Ok(None)
}

#[cfg(not(unix))]
fn is_locked(_: Option<&File>, _: &Path) -> bool {
    true
}

/// Makes a folder, and those above; `made` gets them, the outermost first.
fn make_folder(folder: &Path, made: &mut Vec<PathBuf>) -> io::Result<()> {
    if folder.is_dir() || folder.as_os_str().is_empty() {
        return Ok(());
    }
    if let Some(above) = folder.parent() {
        make_folder(above, made)?;
    }
    match fs::create_dir(folder) {
        Ok(()) => made.push(folder.to_owned()),
        // Another run was faster.
        Err(_) if folder.is_dir() => {}
        Err(error) => return Err(error),
    }
    Ok(())
}

/// Removes folders up to the first that is not empty.
fn remove_empty(mut folders: impl Iterator<Item = impl AsRef<Path>>) {
    let _ = folders.find(|folder| fs::remove_dir(folder).is_err());
}

/// Is there anything in it that may be nowhere else? A run that comes to its end leaves nothing.
fn holds_originals(staging: &Path) -> bool {
    let is_original = |name: &std::ffi::OsStr| Path::new(name).extension().is_some_and(|end| end == "old");
    let mut entries = fs::read_dir(staging).into_iter().flatten().flatten();
    entries.any(|entry| is_original(&entry.file_name()))
}

/// Removes what a run has put aside.
fn discard(staging: &Path) -> io::Result<()> {
    match fs::symlink_metadata(staging) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Ok(data) if data.is_dir() => fs::remove_dir_all(staging),
        _ => fs::remove_file(staging),
    }
}

/// Where a step writes: below the root, whatever links there are.
///
/// # Errors
///
/// What stands in its way, in words for the user.
pub(crate) fn target(root: &Path, step: &Step) -> Result<PathBuf, String> {
    let mut at = root.to_owned();
    // A package writes in itself alone: what links to its neighbour is not of it.
    let mut within = root.to_owned();
    let mut parts = step.path.split('/').peekable();
    while let Some(part) = parts.next() {
        if matches!(part, "" | "." | "..") || part.contains(['\\', ':']) {
            return Err(format!("{:?} is no path of a generated file", step.path));
        }
        at.push(part);
        let is_last = parts.peek().is_none();
        let data = match fs::symlink_metadata(&at) {
            Ok(data) => data,
            // What stands above was looked at: there is nothing.
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            Err(error) => return Err(format!("`{}` cannot be read: {error}", at.display())),
        };
        let mut is_folder = data.is_dir();
        if data.is_symlink() {
            let real = at.canonicalize().map_err(|_| leads_nowhere(&at))?;
            if !real.starts_with(&within) {
                return Err(format!(
                    "`{}` is a link that leads out of `{}`, and nothing is written there: generate into the folder that \
                     is meant, or put a folder in the place of the link",
                    at.display(),
                    within.display()
                ));
            }
            is_folder = real.is_dir();
            // A link to a file is replaced, and what it leads to stays.
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

/// Says which path an error is about.
fn failing<T>(path: &Path, result: io::Result<T>) -> Result<T, String> {
    result.map_err(|error| format!("`{}` cannot be written: {error}", path.display()))
}

/// Writes the new texts to the disk, each under its number.
fn stage(targets: &[(&Step, PathBuf)], staging: &Path) -> Result<(), String> {
    for (number, (step, path)) in targets.iter().enumerate() {
        let (Action::Create(text) | Action::Change(text)) = &step.action else { continue };
        let staged = || -> io::Result<()> {
            let mut file = File::create_new(staging.join(number.to_string()))?;
            if let Action::Change(_) = step.action {
                // A folder that may be written to is no leave to replace a file that may not.
                fs::OpenOptions::new().write(true).open(path)?;
                file.set_permissions(fs::metadata(path)?.permissions())?;
            }
            file.write_all(text.as_bytes())?;
            file.sync_all()
        };
        failing(path, staged())?;
    }
    Ok(())
}

/// Puts everything in its place.
fn put(targets: &[(&Step, PathBuf)], staging: &Path, undo: &mut Undo) -> Result<(), String> {
    for (number, (step, path)) in targets.iter().enumerate() {
        let [new, old] = [number.to_string(), format!("{number}.old")].map(|name| staging.join(name));
        failing(path, put_one(&step.action, path, &new, &old, undo))?;
    }
    Ok(())
}

fn put_one(action: &Action, path: &Path, new: &Path, old: &Path, undo: &mut Undo) -> io::Result<()> {
    match action {
        Action::Create(_) => {
            let folder = path.parent().unwrap_or(path);
            let mut made = Vec::new();
            let is_made = make_folder(folder, &mut made);
            undo.0.extend(made.into_iter().map(Done::Made));
            is_made?;
            // A link takes nobody's place, whoever writes at the same time; some file systems have none.
            match fs::hard_link(new, path) {
                Ok(()) => {}
                Err(_) if path.symlink_metadata().is_ok() => {
                    return Err(io::Error::new(ErrorKind::AlreadyExists, "somebody else wrote it meanwhile"));
                }
                Err(_) => fs::rename(new, path)?,
            }
            undo.0.push(Done::Created(path.to_owned()));
        }
        Action::Change(_) => {
            // So that it is never missing; some file systems have no such links.
            fs::hard_link(path, old).or_else(|_| fs::rename(path, old))?;
            undo.0.push(Done::Taken { path: path.to_owned(), old: old.to_owned() });
            fs::rename(new, path)?;
        }
        Action::Remove => {
            fs::rename(path, old)?;
            undo.0.push(Done::Taken { path: path.to_owned(), old: old.to_owned() });
        }
    }
    Ok(())
}

/// What was done until now.
#[derive(Default)]
struct Undo(Vec<Done>);

enum Done {
    /// A folder was made.
    Made(PathBuf),
    /// A file was put where none was.
    Created(PathBuf),
    /// A file was put aside.
    Taken { path: PathBuf, old: PathBuf },
}

impl Undo {
    /// Puts everything back, the last thing first. Gives what could not be.
    fn all(self) -> Vec<PathBuf> {
        let mut lost = Vec::new();
        for done in self.0.into_iter().rev() {
            let (path, result) = match done {
                Done::Made(path) => (path.clone(), fs::remove_dir(path)),
                Done::Created(path) => (path.clone(), fs::remove_file(path)),
                Done::Taken { path, old } => (path.clone(), fs::rename(old, path)),
            };
            if result.is_err() {
                lost.push(path);
            }
        }
        lost
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, symlink};

    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("mauve-write-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder.canonicalize().unwrap()
    }

    fn step(path: &str, action: Action) -> Step {
        Step { path: path.to_owned(), action }
    }

    fn create(path: &str) -> Step {
        step(path, Action::Create(format!("new {path}")))
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
        fs::set_permissions(folder.join("p/changed"), fs::Permissions::from_mode(0o640)).unwrap();
        fs::write(folder.join("p/old/removed"), "old").unwrap();
        let site = Site::open(&folder).unwrap();
        let changed = step("p/changed", Action::Change("new".to_owned()));
        site.write(&[create("p/a/b"), changed, step("p/old/removed", Action::Remove)]).unwrap();
        let found: Vec<_> = everything(&folder).into_iter().map(|(path, text, ..)| (path, text)).collect();
        let expected = [("p", ""), ("p/a", ""), ("p/a/b", "new p/a/b"), ("p/changed", "new")];
        assert_eq!(found, expected.map(|(path, text)| (folder.join(path), text.to_owned())));
        assert_eq!(fs::metadata(folder.join("p/changed")).unwrap().permissions().mode() & 0o777, 0o640);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_a_run_that_was_cut_off_put_aside_stays() {
        let folder = scratch("cut_off");
        let aside = folder.join(STAGING).join("0.old");
        fs::create_dir_all(folder.join(STAGING)).unwrap();
        fs::write(&aside, "mine").unwrap();
        let why = Site::open(&folder).unwrap().write(&[create("p/a")]).unwrap_err();
        assert!(why.contains("put back what is yours"), "{why}");
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
        let site = Site::open(&folder).unwrap();
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
        let site = Site::open(&top.join("out")).unwrap();
        let change = |path: &str| step(path, Action::Change(String::new()));
        for (step, message) in [
            (create("p/folder/new"), "leads out of"),
            (change("p/folder/file"), "leads out of"),
            (change("p/file"), "leads out of"),
            (step("p/file", Action::Remove), "leads out of"),
            (change("p/nowhere"), "leads nowhere"),
            (create("p/nowhere/new"), "leads nowhere"),
            (create("../elsewhere/new"), "no path"),
            (create("/etc/new"), "no path"),
            (create("p//new"), "no path"),
            (create("p/plain/new"), "is no folder"),
            (change("p/inside"), "leads out of"),
            (step("p/inside/file", Action::Remove), "leads out of"),
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
    fn a_folder_that_nothing_came_into_goes_again() {
        let top = scratch("empty");
        let site = Site::open(&top.join("a/b")).unwrap();
        assert!(top.join("a/b").is_dir());
        assert!(site.write(&[step("p/gone", Action::Remove)]).is_err());
        drop(site);
        assert_eq!(everything(&top), []);
        Site::open(&top.join("a/b")).unwrap().write(&[create("p/new")]).unwrap();
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
                    let site = Site::open(&folder).unwrap();
                    site.write(&[create("p/a"), create("p/b")]).unwrap();
                    site.write(&[step("p/a", Action::Remove), step("p/b", Action::Remove)]).unwrap();
                })
            })
            .collect();
        sites.into_iter().for_each(|site| site.join().unwrap());
        let [site, other] = [&top, &top].map(|folder| lock(folder, Duration::from_millis(50)));
        assert!(site.is_ok() && other.is_err());
        fs::remove_dir_all(&top).unwrap();
    }
}
