//! Replaces files of the user as a whole: a reader gets the old text or the new one, and never a part.

use std::io::Write as _;
use std::path::Path;

use crate::folder::Folder;

/// Replaces a file by a new one with this text and the permissions of the old one. `path` has no links.
///
/// # Errors
///
/// The file cannot be written, or the path leads through a link by now.
pub(crate) fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    let name = path.file_name().unwrap_or_default();
    // The folder stays open: the path may lead to another one before the text is written.
    let folder = Folder::open(path.parent().unwrap_or(path))?;
    // Write permission for the folder does not permit to replace a read-only file.
    let permissions = folder.writable(name)?;
    let mut beside = std::ffi::OsString::from(".");
    beside.push(name);
    beside.push(format!(".{}.tmp", std::process::id()));
    let mut file = folder.create_new(&beside, Some(&permissions))?;
    let written = file
        .write_all(text.as_bytes())
        .and_then(|()| file.sync_all())
        .and_then(|()| folder.rename(&beside, &folder, name));
    if written.is_err() {
        let _ = folder.remove_file(&beside);
    }
    written
}

#[cfg(test)]
#[cfg(unix)]
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
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
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
