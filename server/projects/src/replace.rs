//! Writes the files that the user names: as a whole, so that a reader gets the old text or the new one, and never a part. Only a file
//! with hard links, or of an owner to whom no new file can be given, is written in place. All outputs go through this file or, below a
//! folder of packages, through `generate/write.rs`; `destination.rs` says through which links.

use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::{FileExt as _, FileTypeExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

use crate::destination::{destination, is_device};
use crate::disk::MARK;
use crate::folder::{Folder, Folders, above};

/// Replaces the text of a file, which keeps its owner, its permissions, its hard links and its byte order mark. `path` has no
/// links.
///
/// # Errors
///
/// The file cannot be written, or the path leads through a link by now.
pub fn replace(path: &Path, text: &str) -> io::Result<()> {
    // The folder stays open: the path may lead to another one before the text is written.
    let (folder, name) = above(path)?;
    // Write permission for the folder does not permit to replace a read-only file.
    let old = folder.writable(name)?;
    let mut start = [0; MARK.len()];
    let is_marked = folder.open_read(name).and_then(|mut old| old.read_exact(&mut start)).is_ok()
        && start == *MARK.as_bytes()
        && !text.starts_with(MARK);
    let text = if is_marked { &format!("{MARK}{text}") } else { text };
    write_beside(&folder, name, Some(&old), |mut file| file.write_all(text.as_bytes()))
}

/// Creates a file, and the missing folders above it. `path` has no links.
///
/// # Errors
///
/// The file exists, even if another process creates it at the same time; it cannot be written.
pub fn create(path: &Path, text: &str) -> io::Result<()> {
    let (folder, name) = Folders::below(Folder::top(path)?).make_above(path, &mut Vec::new())?;
    write_beside(&folder, name, None, |mut file| file.write_all(text.as_bytes()))
}

/// Writes a new file beside `name`, which then gets that name; it replaces an `old` file of that name.
fn write_beside(
    folder: &Folder,
    name: &OsStr,
    old: Option<&Metadata>,
    write: impl FnOnce(&File) -> io::Result<()>,
) -> io::Result<()> {
    let mut beside = OsString::from(".");
    beside.push(name);
    beside.push(format!(".{}.tmp", std::process::id()));
    let file = folder.create_new(&beside, old)?;
    let written = write(&file).and_then(|()| file.sync_all()).and_then(|()| match old {
        Some(old) if !file.metadata().is_ok_and(|new| can_replace(&new, old)) => {
            copy_into(folder, &beside, name)
        }
        Some(_) => folder.rename(&beside, folder, name),
        None => folder.put_new(&beside, folder, name),
    });
    // Where the file system has hard links, a new file has two names.
    let _ = folder.remove_file(&beside);
    written
}

/// Whether nothing but the text of a file is lost if a new one gets its name: other names keep the old text.
fn can_replace(new: &Metadata, old: &Metadata) -> bool {
    old.nlink() <= 1 && (new.uid(), new.gid()) == (old.uid(), old.gid())
}

/// Writes the text of the file `from` over that of the file `to`. If the disk is full, `to` has its old text afterwards.
fn copy_into(folder: &Folder, from: &OsStr, to: &OsStr) -> io::Result<()> {
    let [mut new, mut old] = [Vec::new(), Vec::new()];
    folder.open_read(from)?.read_to_end(&mut new)?;
    folder.open_read(to)?.read_to_end(&mut old)?;
    let file = folder.open_write(to)?;
    let write = |text: &[u8]| {
        // First what makes the file longer: to overwrite the rest, no more room is needed.
        let (start, end) = text.split_at(text.len().min(old.len()));
        file.write_all_at(end, old.len() as u64)?;
        file.write_all_at(start, 0)?;
        file.set_len(text.len() as u64)?;
        file.sync_all()
    };
    write(&new).inspect_err(|_| drop(write(&old)))
}

/// Writes a file that the user has named, or replaces it: a reader gets the old text, none, or the new one.
pub fn put(path: &Path, text: &str) -> Result<(), String> {
    put_with(path, |mut file| file.write_all(text.as_bytes()))
}

/// The same, part by part.
pub fn put_with(path: &Path, write: impl FnOnce(&File) -> io::Result<()>) -> Result<(), String> {
    let failed = |error| format!("cannot write `{}`: {error}", path.display());
    if let Some(stream) = stream(path).map_err(failed)? {
        return write(&stream).map_err(failed);
    }
    let real = destination(path)?;
    let written = above(&real).and_then(|(folder, name)| match folder.kind(name) {
        Err(error) if error.kind() == ErrorKind::NotFound => write_beside(&folder, name, None, write),
        _ => write_beside(&folder, name, Some(&folder.writable(name)?), write),
    });
    written.map_err(failed)
}

/// Opens a file to which lines are added, such as a log. If it is new, only the user may read it, from the first moment on: it may
/// have his models. One that is there keeps its permissions.
pub fn append_private(path: &Path) -> Result<File, String> {
    let failed = |error| format!("`{}` cannot be written: {error}", path.display());
    if let Some(stream) = stream(path).map_err(failed)? {
        return Ok(stream);
    }
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
    let mut options = OpenOptions::new();
    options.create(true).append(true).mode(0o600).custom_flags(flags);
    options.open(destination(path)?).map_err(failed)
}

/// Opens what is no file, and is written as it is: a device, such as `/dev/stdout`, or a pipe. Does not wait for a process that reads it.
fn stream(path: &Path) -> io::Result<Option<File>> {
    let is_pipe = path.symlink_metadata().is_ok_and(|data| data.file_type().is_fifo());
    if !is_pipe && !is_device(path) {
        return Ok(None);
    }
    let file = OpenOptions::new().append(true).custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(Some(file))
}

/// The folder of a file; of a bare name, the current one.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{PermissionsExt as _, chown, symlink};

    use super::*;

    #[test]
    fn a_new_file_has_the_permissions_of_the_old_one() {
        let folder = mauve_tests::own_scratch("replace");
        let path = folder.join("a.mal");
        for mode in [0o600, 0o640, 0o644] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            replace(&path, "new").unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
            assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        }
        // Somebody has put something where the new file is to be.
        let beside = folder.join(format!(".a.mal.{}.tmp", std::process::id()));
        symlink(folder.join("elsewhere"), &beside).unwrap();
        assert!(replace(&path, "newer").is_err());
        assert!(fs::read_to_string(&path).unwrap() == "new" && !folder.join("elsewhere").exists());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn other_names_of_a_file_have_the_new_text() {
        let folder = mauve_tests::own_scratch("hard-links");
        let [path, other] = ["a.mal", "b.mal"].map(|name| folder.join(name));
        fs::write(&path, "old").unwrap();
        fs::hard_link(&path, &other).unwrap();
        for text in ["a longer text", "short", ""] {
            replace(&path, text).unwrap();
            put(&path, text).unwrap();
            assert_eq!(fs::read_to_string(&other).unwrap(), text);
            assert_eq!((fs::metadata(&path).unwrap().nlink(), folder.read_dir().unwrap().count()), (2, 2));
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_keeps_its_owner_and_its_group() {
        let folder = mauve_tests::own_scratch("owner");
        let path = folder.join("a.mal");
        fs::write(&path, "old").unwrap();
        if chown(&path, Some(1234), Some(4321)).is_err() {
            eprintln!("skipped: only root gives a file away");
            return;
        }
        fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
        let inode = fs::metadata(&path).unwrap().ino();
        replace(&path, "new").unwrap();
        let data = fs::metadata(&path).unwrap();
        assert_eq!((data.uid(), data.gid(), data.mode() & 0o7777), (1234, 4321, 0o640));
        assert_ne!(data.ino(), inode, "a reader gets the whole old text, or the whole new one");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_log_is_the_users_alone_and_no_link() {
        let folder = mauve_tests::own_scratch("append");
        let path = folder.join("log");
        let mode = |file: File| file.metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(append_private(&path).unwrap()), 0o600);
        fs::set_permissions(&path, Permissions::from_mode(0o644)).unwrap();
        append_private(&path).unwrap().write_all(b"a").unwrap();
        append_private(&path).unwrap().write_all(b"b").unwrap();
        assert_eq!(mode(append_private(&path).unwrap()), 0o644);
        assert_eq!(fs::read_to_string(&path).unwrap(), "ab");
        fs::write(folder.join("mauve.toml"), "").unwrap();
        symlink("log", folder.join("link")).unwrap();
        let why = append_private(&folder.join("link")).unwrap_err();
        assert!(why.contains("is a link"), "{why}");
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A pipe that no process reads is an error, and nothing is waited for; one that is read gets the text.
    #[test]
    fn pipes_and_devices_are_written_as_they_are() {
        let folder = mauve_tests::own_scratch("streams");
        let pipe = folder.join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(put(&pipe, "text").is_err() && append_private(&pipe).is_err());
        let copy = File::create(folder.join("copy")).unwrap();
        let mut reader = std::process::Command::new("cat").arg(&pipe).stdout(copy).spawn().unwrap();
        let long = "text".repeat(100_000);
        // The reader opens the pipe at some time.
        let ends = std::time::Instant::now() + std::time::Duration::from_secs(60);
        while put(&pipe, &long).is_err() && std::time::Instant::now() < ends {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(reader.wait().unwrap().success());
        assert_eq!(fs::read_to_string(folder.join("copy")).unwrap(), long);
        put(Path::new("/dev/null"), &long).unwrap();
        symlink("pipe", folder.join("link")).unwrap();
        assert!(put(&folder.join("link"), "text").is_err());
        fs::remove_dir_all(&folder).unwrap();
    }
}
