//! Files that hold what only the user may read, such as his models.

use std::fs::OpenOptions;

/// Options with which a new file is readable by the user only, from the first moment on. One that is there keeps its permissions.
pub(crate) fn private() -> OpenOptions {
    use std::os::unix::fs::OpenOptionsExt as _;
    let mut options = OpenOptions::new();
    options.mode(0o600);
    options
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn a_new_file_is_the_users_alone() {
        let path = std::env::temp_dir().join(format!("mauve-private-{}", std::process::id()));
        let _ = fs::remove_file(&path);
        let file = private().create(true).append(true).open(&path).unwrap();
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let file = private().create(true).append(true).open(&path).unwrap();
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o644);
        fs::remove_file(&path).unwrap();
    }
}
