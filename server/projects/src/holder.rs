//! Which process has locked a file, for the message to who has to wait.

use std::fs::{File, read_to_string};
use std::os::unix::fs::MetadataExt as _;

/// Returns the process that has locked a file or a folder, such as ``process 1234 (`mauve`)``. Linux says it; none elsewhere.
pub fn holder(file: &File) -> Option<String> {
    let inode = format!(":{}", file.metadata().ok()?.ino());
    // `1: FLOCK  ADVISORY  WRITE 1234 08:01:131 0 EOF`; the number of the device is not the one of every file system.
    let process = read_to_string("/proc/locks").ok()?.lines().find_map(|line| {
        let [_, _, _, _, process, locked, ..] = line.split_whitespace().collect::<Vec<&str>>()[..] else {
            return None;
        };
        (locked.ends_with(&inode) && process != "0").then(|| process.to_owned())
    })?;
    let name = read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
    Some(format!("process {process} (`{}`)", name.trim()))
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    #[test]
    fn the_process_that_has_locked_a_file() {
        let folder = mauve_tests::own_scratch("holder");
        let (file, other) = (File::create(folder.join("file")).unwrap(), File::open(&folder).unwrap());
        assert_eq!(holder(&file), None);
        file.lock().unwrap();
        let found = holder(&File::open(folder.join("file")).unwrap()).unwrap();
        assert!(found.starts_with(&format!("process {} (`", std::process::id())), "{found}");
        assert_eq!(holder(&other), None);
        drop(file);
        assert_eq!(holder(&File::open(folder.join("file")).unwrap()), None);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
