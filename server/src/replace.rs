//! Writes files of the user as a whole: a reader gets the old text or the new one, and never a part. Links are not followed.

use std::ffi::{OsStr, OsString};
use std::fs::Permissions;
use std::io::{self, Write as _};
use std::path::Path;

use crate::folder::{Folder, Folders, above};

/// Replaces a file by a new one with this text and the permissions of the old one. `path` has no links.
///
/// # Errors
///
/// The file cannot be written, or the path leads through a link by now.
pub(crate) fn replace(path: &Path, text: &str) -> io::Result<()> {
    // The folder stays open: the path may lead to another one before the text is written.
    let (folder, name) = above(path)?;
    // Write permission for the folder does not permit to replace a read-only file.
    let permissions = folder.writable(name)?;
    write_beside(&folder, name, Some(&permissions), text, |new| folder.rename(new, &folder, name))
}

/// Creates a file, and the missing folders above it. `path` has no links.
///
/// # Errors
///
/// The file exists, even if another process creates it at the same time; it cannot be written.
pub(crate) fn create(path: &Path, text: &str) -> io::Result<()> {
    let (folder, name) = Folders::below(Folder::top(path)?).make_above(path, &mut Vec::new())?;
    write_beside(&folder, name, None, text, |new| folder.put_new(new, &folder, name))
}

/// Writes the text to a new file beside `name`, which `put` gives that name.
fn write_beside(
    folder: &Folder,
    name: &OsStr,
    permissions: Option<&Permissions>,
    text: &str,
    put: impl FnOnce(&OsStr) -> io::Result<()>,
) -> io::Result<()> {
    let mut beside = OsString::from(".");
    beside.push(name);
    beside.push(format!(".{}.tmp", std::process::id()));
    let mut file = folder.create_new(&beside, permissions)?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).and_then(|()| put(&beside));
    // Where the file system has hard links, a new file has two names.
    let _ = folder.remove_file(&beside);
    written
}

/// Writes a file, or replaces it: a reader gets the old text, none, or the new one.
pub(crate) fn put(path: &Path, text: &str) -> Result<(), String> {
    let written = match path.canonicalize() {
        Ok(real) => replace(&real, text),
        Err(_) => {
            let folder = folder_of(path).canonicalize();
            folder.and_then(|folder| create(&folder.join(path.file_name().unwrap_or_default()), text))
        }
    };
    written.map_err(|error| format!("cannot write `{}`: {error}", path.display()))
}

/// The folder of a file; of a bare name, the current one.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

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
}
