//! What the files in use looked like. Not every file system tells of a change, and the system may refuse to watch: so their times and
//! sizes are compared. Only a file that looks different is read again.
//!
//! ```text
//! plan.toml      18 bytes, changed at 10:04:07.2   the same: nothing is read
//! times/         { plan.toml }                     { plan.toml, more.toml }: `more.toml` has changed
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use mauve_projects::disk::tells_no_changes;

/// The time between two looks that no message causes; where one takes long, so many times as long.
const POLL: Duration = Duration::from_secs(5);
const SHARE: u32 = 20;

/// Two changes within so many seconds may have the same time on some file systems.
const COARSE: u64 = 2;

/// What tells that a path has changed, without reading it: whether it is a folder, its device and number, its length, and when its
/// content and anything of it changed last, in seconds and nanoseconds.
type FileSignature = (bool, [u64; 2], u64, [i64; 4]);

fn signature(path: &Path) -> Option<FileSignature> {
    let it = path.symlink_metadata().ok()?;
    let times = [it.mtime(), it.mtime_nsec(), it.ctime(), it.ctime_nsec()];
    Some((it.is_dir(), [it.dev(), it.ino()], it.len(), times))
}

/// A path as it was when it was looked at; there may have been nothing.
#[derive(Debug)]
struct KnownPath {
    signature: Option<FileSignature>,
    /// Whether a further change may have given the same signature.
    is_young: bool,
    /// The names in a folder.
    names: BTreeSet<OsString>,
}

impl KnownPath {
    fn at(path: &Path) -> KnownPath {
        // In this order, the next look sees what changes in between.
        let signature = signature(path);
        let folder = signature.filter(|it| it.0).and_then(|_| std::fs::read_dir(path).ok());
        let names = folder.into_iter().flatten().flatten().map(|entry| entry.file_name()).collect();
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs();
        let is_young = signature.is_some_and(|(.., times)| times[2].abs_diff(now.cast_signed()) <= COARSE);
        KnownPath { signature, is_young, names }
    }

    /// Returns the device and the number of a folder, which another folder of its name does not have.
    fn folder(&self) -> Option<[u64; 2]> {
        self.signature.filter(|it| it.0).map(|it| it.1)
    }
}

/// The files and folders in use, as they were.
#[derive(Debug, Default)]
pub(super) struct Looks {
    known: BTreeMap<PathBuf, KnownPath>,
    /// Whether the system does not tell of all changes.
    polls: bool,
    /// When to look again without a message, where there are no events.
    due: Option<Instant>,
}

impl Looks {
    /// Looks at these paths from now on, and at no others. Some are not watched, if the system refuses that.
    pub(super) fn use_only(&mut self, paths: BTreeSet<PathBuf>, is_unwatched: bool) {
        self.known.retain(|path, _| paths.contains(path));
        for path in paths {
            self.known.entry(path).or_insert_with_key(|path| KnownPath::at(path));
        }
        let devices: BTreeMap<u64, &PathBuf> =
            self.known.iter().filter_map(|(path, known)| Some((known.signature?.1[0], path))).collect();
        self.polls = is_unwatched || devices.into_values().any(|path| tells_no_changes(path));
    }

    /// Returns for how long nothing is to be done without a message.
    pub(super) fn pause(&self) -> Duration {
        let pause = self.due.map_or(Duration::ZERO, |due| due.saturating_duration_since(Instant::now()));
        if self.polls { pause } else { Duration::MAX }
    }

    /// Notes a change that the system tells of: the next look does not return it again.
    pub(super) fn note(&mut self, path: &Path) {
        if let Some(known) = self.known.get_mut(path) {
            *known = KnownPath::at(path);
        }
        if let Some(name) = path.file_name()
            && let Some(around) = path.parent().and_then(|folder| self.known.get_mut(folder))
        {
            match path.symlink_metadata() {
                Ok(_) => around.names.insert(name.to_owned()),
                Err(_) => around.names.remove(name),
            };
        }
    }

    /// Looks at all. Returns what has changed since the last look: files, what is new in a folder and what is gone, and
    /// folders that others have replaced.
    pub(super) fn changed(&mut self) -> BTreeSet<PathBuf> {
        let begin = Instant::now();
        let mut changed = BTreeSet::new();
        for (path, known) in &mut self.known {
            // Where the system tells of all changes, it also tells of a second one within a short time.
            if signature(path) == known.signature && !(self.polls && known.is_young) {
                continue;
            }
            let before = std::mem::replace(known, KnownPath::at(path));
            if before.folder().is_some() && before.folder() == known.folder() {
                changed.extend(before.names.symmetric_difference(&known.names).map(|name| path.join(name)));
            } else {
                changed.insert(path.clone());
            }
        }
        self.due = Some(Instant::now() + POLL.max(SHARE * begin.elapsed()));
        changed
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_look_finds_what_no_event_told() {
        let top = mauve_tests::own_scratch("looks");
        let path = |name: &str| top.join(name);
        let paths = |names: &[&str]| names.iter().map(|name| path(name)).collect::<BTreeSet<PathBuf>>();
        for name in ["same", "longer", "rewritten", "replaced", "gone", "told"] {
            fs::write(path(name), "17").unwrap();
        }
        fs::create_dir(path("folder")).unwrap();
        let mut looks = Looks::default();
        let files = ["same", "longer", "rewritten", "replaced", "gone", "told", "to_come", "folder", ""];
        looks.use_only(paths(&files), false);
        assert_eq!((looks.changed(), looks.pause()), (BTreeSet::new(), Duration::MAX));

        fs::write(path("longer"), "170").unwrap();
        // A file with the length and the time of the one before.
        let time = fs::metadata(path("rewritten")).unwrap().modified().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        fs::write(path("rewritten"), "18").unwrap();
        fs::File::options().write(true).open(path("rewritten")).unwrap().set_modified(time).unwrap();
        fs::write(path("new"), "18").unwrap();
        fs::rename(path("new"), path("replaced")).unwrap();
        fs::remove_file(path("gone")).unwrap();
        fs::write(path("to_come"), "17").unwrap();
        fs::write(path("folder/file"), "17").unwrap();
        for name in ["told", "told_new"] {
            fs::write(path(name), "1").unwrap();
            looks.note(&path(name));
        }
        let changed = ["longer", "rewritten", "replaced", "gone", "to_come", "folder/file"];
        assert_eq!(looks.changed(), paths(&changed));
        assert_eq!(looks.changed(), BTreeSet::new());

        // Another folder takes its place.
        fs::rename(path("folder"), path("away")).unwrap();
        fs::create_dir(path("folder")).unwrap();
        assert_eq!(looks.changed(), paths(&["folder", "away"]));
        fs::remove_dir_all(top).unwrap();
    }

    #[test]
    fn where_nothing_tells_of_changes_a_new_file_is_looked_at_twice() {
        let top = mauve_tests::own_scratch("looks-young");
        fs::write(top.join("file"), "17").unwrap();
        let mut looks = Looks::default();
        looks.use_only(BTreeSet::from([top.join("file")]), true);
        // Another change at the same time would look the same.
        assert_eq!(looks.changed(), BTreeSet::from([top.join("file")]));
        assert!(looks.pause() <= POLL && !looks.pause().is_zero());
        looks.known.values_mut().for_each(|known| known.is_young = false);
        assert!(looks.changed().is_empty(), "its last change was long ago");
        fs::remove_dir_all(top).unwrap();
    }
}
