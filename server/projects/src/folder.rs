//! Handles of open folders. Between the check of a path and its use, another process can replace a folder by a link.
//! So all operations below a folder start from its handle, and open folder after folder without following links.

use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use {
    rustix::fs::{
        AtFlags, Dir, FileType, Mode, OFlags, RawMode, fstat, linkat, mkdirat, open, openat, renameat,
        statat, unlinkat,
    },
    rustix::io::Errno,
    std::os::fd::OwnedFd,
    std::os::unix::ffi::OsStrExt as _,
    std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, fchown},
    std::sync::Arc,
};

/// An open folder. Names in it are single path components.
#[derive(Debug, Clone)]
pub struct Folder {
    handle: Arc<OwnedFd>,
    /// The path with links resolved when the folder was opened.
    path: PathBuf,
}

/// The kind of a directory entry; links are not followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FolderEntryKind {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// A device, a pipe or a socket.
    Other,
}

impl Folder {
    /// Opens a folder by its path with links resolved.
    ///
    /// # Errors
    ///
    /// The folder cannot be opened, or a component of the path has become a link.
    pub fn open(real: &Path) -> io::Result<Folder> {
        Folders::below(Folder::top(real)?).folder(real)
    }

    /// Returns the path at which the folder was opened, for messages and to find paths below it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves a file to an unused name in another folder. Never replaces a file, even if another process creates one
    /// at the same time.
    pub fn put_new(&self, from: &OsStr, to: &Folder, name: &OsStr) -> io::Result<()> {
        // Some file systems have no hard links.
        match self.hard_link(from, to, name) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => self.rename_new(from, to, name),
            done => done,
        }
    }

    /// Moves a file to a name that was unused just before: some systems cannot do both atomically.
    fn rename_to_free(&self, from: &OsStr, to: &Folder, name: &OsStr) -> io::Result<()> {
        match to.kind(name) {
            Err(error) if error.kind() == ErrorKind::NotFound => self.rename(from, to, name),
            Err(error) => Err(error),
            Ok(_) => Err(ErrorKind::AlreadyExists.into()),
        }
    }

    /// Removes a folder with the files in it. Fails if it contains folders.
    pub fn remove_all(&self, name: &OsStr) -> io::Result<()> {
        let folder = self.folder(name)?;
        for inner in folder.names()? {
            folder.remove_file(&inner)?;
        }
        self.remove_folder(name)
    }
}

/// The maximum number of folders that are held open, since a process may have a limited number of files. Further
/// folders are reopened each time.
const MOST_HELD: usize = 128;

/// The folders below a folder, by their paths. Each is opened once and held open, so all operations refer to the same
/// folder, even if another one replaces it at its path.
#[derive(Debug)]
pub struct Folders {
    top: Folder,
    held: HashMap<PathBuf, Folder>,
}

impl Folders {
    /// Creates a cache of open folders below `top`; at first, only `top` is open.
    pub fn below(top: Folder) -> Folders {
        Folders { top, held: HashMap::new() }
    }

    /// Returns a folder by a path that begins with the path of the top folder.
    pub fn folder(&mut self, path: &Path) -> io::Result<Folder> {
        self.walk(path, &mut |above: &Folder, name: &OsStr| above.folder(name))
    }

    /// Returns a folder, and creates missing folders; adds these to `made`, the outermost first.
    pub fn make(&mut self, path: &Path, made: &mut Vec<PathBuf>) -> io::Result<Folder> {
        self.walk(path, &mut |above: &Folder, name: &OsStr| match above.folder(name) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                if above.make_folder(name)? {
                    made.push(above.path.join(name));
                }
                above.folder(name)
            }
            found => found,
        })
    }

    /// Returns the parent folder of a path, and the name in it.
    pub fn above<'a>(&mut self, path: &'a Path) -> io::Result<(Folder, &'a OsStr)> {
        let (above, name) = split(path)?;
        Ok((self.folder(above)?, name))
    }

    /// Returns the parent folder of a path and the name in it, and creates missing folders.
    pub fn make_above<'a>(
        &mut self,
        path: &'a Path,
        made: &mut Vec<PathBuf>,
    ) -> io::Result<(Folder, &'a OsStr)> {
        let (above, name) = split(path)?;
        Ok((self.make(above, made)?, name))
    }

    /// Returns the kind of the entry at a path.
    pub fn kind(&mut self, path: &Path) -> io::Result<FolderEntryKind> {
        if path == self.top.path() {
            return Ok(FolderEntryKind::Folder);
        }
        let (folder, name) = self.above(path)?;
        folder.kind(name)
    }

    fn walk(
        &mut self,
        path: &Path,
        next: &mut dyn FnMut(&Folder, &OsStr) -> io::Result<Folder>,
    ) -> io::Result<Folder> {
        if path == self.top.path() {
            return Ok(self.top.clone());
        }
        if let Some(known) = self.held.get(path) {
            return Ok(known.clone());
        }
        let (above, name) = split(path)?;
        let above = self.walk(above, next)?;
        let found = next(&above, name)?;
        if self.held.len() < MOST_HELD {
            self.held.insert(path.to_owned(), found.clone());
        }
        Ok(found)
    }
}

/// Returns the parent folder of a path with links resolved, and the name in it.
pub fn above(real: &Path) -> io::Result<(Folder, &OsStr)> {
    Folders::below(Folder::top(real)?).above(real)
}

/// Opens a regular file for reading by its path with links resolved.
pub fn open_file(real: &Path) -> io::Result<File> {
    above(real).and_then(|(folder, name)| folder.open_read(name))
}

fn split(path: &Path) -> io::Result<(&Path, &OsStr)> {
    let parts = path.parent().zip(path.file_name());
    let outside = || format!("`{}` is not in the folder", path.display());
    parts.ok_or_else(|| io::Error::new(ErrorKind::InvalidInput, outside()))
}

fn top_of(path: &Path) -> PathBuf {
    path.ancestors().last().unwrap_or(path).to_owned()
}

fn no_folder(path: &Path) -> io::Error {
    let what = format!("`{}` is not a folder, or has become a link", path.display());
    io::Error::new(ErrorKind::NotADirectory, what)
}

fn no_file() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it is not a file, or has become a link")
}

/// The flags for opening folders. With `O_PATH`, folders need not be readable.
fn as_folder() -> OFlags {
    #[cfg(target_os = "linux")]
    let access = OFlags::PATH;
    #[cfg(not(target_os = "linux"))]
    let access = OFlags::RDONLY;
    access | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC
}

impl Folder {
    /// Opens the root of the file system of a path.
    pub fn top(path: &Path) -> io::Result<Folder> {
        let path = top_of(path);
        let handle = open(&path, as_folder(), Mode::empty())?;
        Ok(Folder { handle: Arc::new(handle), path })
    }

    /// Opens a folder in this folder.
    pub fn folder(&self, name: &OsStr) -> io::Result<Folder> {
        let path = self.path.join(name);
        match openat(&self.handle, name, as_folder(), Mode::empty()) {
            Ok(handle) => Ok(Folder { handle: Arc::new(handle), path }),
            Err(Errno::NOTDIR | Errno::LOOP) => Err(no_folder(&path)),
            Err(error) => Err(error.into()),
        }
    }

    /// Creates a folder in this folder; returns false if the name exists.
    pub fn make_folder(&self, name: &OsStr) -> io::Result<bool> {
        match mkdirat(&self.handle, name, Mode::from_raw_mode(0o777)) {
            Ok(()) => Ok(true),
            Err(Errno::EXIST) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Creates a file in this folder with its final permissions, so that no other user can read it in the meantime; `like` another
    /// file also with the owner and the group of that one, as far as this process may give it away.
    pub fn create_new(&self, name: &OsStr, like: Option<&Metadata>) -> io::Result<File> {
        let mode = like.map_or(0o666, |like| like.mode() & 0o700);
        let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let file = File::from(openat(&self.handle, name, flags, Mode::from_raw_mode(mode as RawMode))?);
        if let Some(like) = like {
            let own = file.metadata()?;
            if (own.uid(), own.gid()) != (like.uid(), like.gid()) {
                let _ = fchown(&file, Some(like.uid()), Some(like.gid()));
            }
            // Adds the permissions that the umask has removed.
            file.set_permissions(Permissions::from_mode(like.mode() & 0o7777))?;
        }
        Ok(file)
    }

    /// Returns the kind of the entry with a name.
    pub fn kind(&self, name: &OsStr) -> io::Result<FolderEntryKind> {
        let data = statat(&self.handle, name, AtFlags::SYMLINK_NOFOLLOW)?;
        Ok(match FileType::from_raw_mode(data.st_mode) {
            FileType::RegularFile => FolderEntryKind::File,
            FileType::Directory => FolderEntryKind::Folder,
            FileType::Symlink => FolderEntryKind::Link,
            _ => FolderEntryKind::Other,
        })
    }

    /// Opens a regular file in this folder for reading. Does not block on a pipe.
    pub fn open_read(&self, name: &OsStr) -> io::Result<File> {
        self.file(name, OFlags::RDONLY)
    }

    /// Opens a regular file in this folder for writing.
    pub fn open_write(&self, name: &OsStr) -> io::Result<File> {
        self.file(name, OFlags::WRONLY)
    }

    /// Returns the owner, the permissions and more of a writable file in this folder.
    ///
    /// # Errors
    ///
    /// Fails if the file is read-only.
    pub fn writable(&self, name: &OsStr) -> io::Result<Metadata> {
        self.open_write(name)?.metadata()
    }

    fn file(&self, name: &OsStr, access: OFlags) -> io::Result<File> {
        let flags = access | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let file = match openat(&self.handle, name, flags, Mode::empty()) {
            Ok(handle) => File::from(handle),
            Err(Errno::LOOP) => return Err(no_file()),
            Err(error) => return Err(error.into()),
        };
        if file.metadata()?.is_file() { Ok(file) } else { Err(no_file()) }
    }

    /// Moves a file to another folder, and replaces a file of that name.
    pub fn rename(&self, from: &OsStr, to: &Folder, name: &OsStr) -> io::Result<()> {
        Ok(renameat(&self.handle, from, &to.handle, name)?)
    }

    /// Creates a hard link to a file, or to a symbolic link itself.
    pub fn hard_link(&self, from: &OsStr, to: &Folder, name: &OsStr) -> io::Result<()> {
        Ok(linkat(&self.handle, from, &to.handle, name, AtFlags::empty())?)
    }

    /// Moves a file to an unused name.
    fn rename_new(&self, from: &OsStr, to: &Folder, name: &OsStr) -> io::Result<()> {
        #[cfg(target_os = "linux")]
        {
            let flags = rustix::fs::RenameFlags::NOREPLACE;
            match rustix::fs::renameat_with(&self.handle, from, &to.handle, name, flags) {
                // Not every file system supports this flag.
                Err(Errno::INVAL | Errno::NOSYS) => {}
                done => return Ok(done?),
            }
        }
        self.rename_to_free(from, to, name)
    }

    /// Removes a file, or a symbolic link itself, from this folder.
    pub fn remove_file(&self, name: &OsStr) -> io::Result<()> {
        Ok(unlinkat(&self.handle, name, AtFlags::empty())?)
    }

    /// Removes an empty folder from this folder.
    pub fn remove_folder(&self, name: &OsStr) -> io::Result<()> {
        Ok(unlinkat(&self.handle, name, AtFlags::REMOVEDIR)?)
    }

    /// Returns the names of all entries.
    pub fn names(&self) -> io::Result<Vec<OsString>> {
        let mut names = Vec::new();
        for entry in Dir::new(self.readable()?)? {
            let name = OsStr::from_bytes(entry?.file_name().to_bytes()).to_owned();
            if name != "." && name != ".." {
                names.push(name);
            }
        }
        Ok(names)
    }

    /// Opens the folder itself as a file, which can be locked.
    pub fn as_file(&self) -> io::Result<File> {
        self.readable().map(File::from)
    }

    fn readable(&self) -> io::Result<OwnedFd> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(openat(&self.handle, ".", flags, Mode::empty())?)
    }

    /// Returns whether two handles refer to the same folder.
    pub fn is(&self, other: &Folder) -> bool {
        let [own, others] =
            [self, other].map(|it| fstat(&it.handle).map(|data| (data.st_dev, data.st_ino)).ok());
        own.is_some() && own == others
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{MetadataExt as _, symlink};
    use std::process::Command;

    use super::*;

    fn scratch(name: &str) -> PathBuf {
        mauve_tests::own_scratch(&format!("folder-{name}"))
    }

    fn name(text: &str) -> &OsStr {
        OsStr::new(text)
    }

    #[test]
    fn no_part_of_a_path_is_a_link() {
        let top = scratch("links");
        fs::create_dir_all(top.join("real/deep")).unwrap();
        fs::write(top.join("real/deep/file"), "text").unwrap();
        symlink("real", top.join("link")).unwrap();
        symlink("file", top.join("real/deep/inner")).unwrap();
        assert!(Folder::open(&top.join("real/deep")).is_ok());
        assert!(open_file(&top.join("real/deep/file")).is_ok());
        for path in ["link", "link/deep", "real/deep/file", "real/deep/inner"] {
            assert_eq!(Folder::open(&top.join(path)).unwrap_err().kind(), ErrorKind::NotADirectory, "{path}");
        }
        for path in ["link/deep/file", "real/deep/inner", "real/deep"] {
            assert!(open_file(&top.join(path)).is_err(), "{path}");
        }
        for path in ["nothing", "real/../real", "real/.."] {
            assert!(Folder::open(&top.join(path)).is_err(), "{path}");
        }
        let mut made = Vec::new();
        let mut folders = Folders::below(Folder::open(&top).unwrap());
        assert!(folders.make(&top.join("link/new"), &mut made).is_err());
        assert!(folders.folder(&std::env::temp_dir()).is_err(), "it is not below");
        folders.make(&top.join("real/new/deep"), &mut made).unwrap();
        assert_eq!(made, [top.join("real/new"), top.join("real/new/deep")]);
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_folder_that_is_held_is_the_same_under_another_name() {
        let top = scratch("held");
        fs::create_dir_all(top.join("a/b")).unwrap();
        let mut folders = Folders::below(Folder::open(&top).unwrap());
        let (folder, _) = folders.above(&top.join("a/b/c")).unwrap();
        fs::rename(top.join("a"), top.join("moved")).unwrap();
        fs::create_dir_all(top.join("a/b")).unwrap();
        let path = top.join("a/b/c");
        let (again, end) = folders.above(&path).unwrap();
        assert!(again.is(&folder) && !again.is(&Folder::open(&top.join("a/b")).unwrap()));
        again.create_new(end, None).unwrap();
        assert!(top.join("moved/b/c").is_file() && !top.join("a/b/c").exists());
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_new_file_has_its_permissions_before_its_content() {
        let top = scratch("permissions");
        let folder = Folder::open(&top).unwrap();
        fs::write(top.join("old"), "old").unwrap();
        for mode in [0o600, 0o640, 0o666, 0o777, 0o200] {
            fs::set_permissions(top.join("old"), Permissions::from_mode(mode)).unwrap();
            let like = folder.writable(name("old")).unwrap();
            let file = folder.create_new(name("new"), Some(&like)).unwrap();
            let data = file.metadata().unwrap();
            assert_eq!((data.mode() & 0o7777, data.len()), (mode, 0));
            assert_eq!(
                folder.create_new(name("new"), None).unwrap_err().kind(),
                ErrorKind::AlreadyExists,
                "another user owns it, so it is not opened"
            );
            folder.remove_file(name("new")).unwrap();
        }
        let file = folder.create_new(name("new"), None).unwrap();
        // What others make here has them, too.
        fs::write(top.join("other"), "").unwrap();
        assert_eq!(file.metadata().unwrap().mode(), fs::metadata(top.join("other")).unwrap().mode());
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn only_files_are_opened_and_nothing_is_waited_for() {
        let top = scratch("kinds");
        let folder = Folder::open(&top).unwrap();
        fs::write(top.join("file"), "").unwrap();
        fs::create_dir(top.join("folder")).unwrap();
        symlink("file", top.join("link")).unwrap();
        assert!(Command::new("mkfifo").arg(top.join("pipe")).status().unwrap().success());
        for (path, kind) in [
            ("file", FolderEntryKind::File),
            ("folder", FolderEntryKind::Folder),
            ("link", FolderEntryKind::Link),
            ("pipe", FolderEntryKind::Other),
        ] {
            assert_eq!(folder.kind(name(path)).unwrap(), kind);
            let is_file = kind == FolderEntryKind::File;
            assert_eq!(folder.open_read(name(path)).is_ok(), is_file, "{path}");
            assert_eq!(folder.writable(name(path)).is_ok(), is_file, "{path}");
        }
        let mut names = folder.names().unwrap();
        names.sort();
        assert_eq!(names, ["file", "folder", "link", "pipe"]);
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn nothing_takes_the_place_of_a_file_that_is_there() {
        let top = scratch("new");
        let folder = Folder::open(&top).unwrap();
        fs::write(top.join("theirs"), "theirs").unwrap();
        fs::write(top.join("ours"), "ours").unwrap();
        symlink("/nowhere", top.join("link")).unwrap();
        for taken in ["theirs", "link"] {
            for put in [Folder::put_new, Folder::rename_new] {
                let error = put(&folder, name("ours"), &folder, name(taken)).unwrap_err();
                assert_eq!(error.kind(), ErrorKind::AlreadyExists);
            }
        }
        assert_eq!(fs::read_to_string(top.join("theirs")).unwrap(), "theirs");
        folder.put_new(name("ours"), &folder, name("linked")).unwrap();
        folder.rename_new(name("ours"), &folder, name("renamed")).unwrap();
        assert!(!top.join("ours").exists());
        assert_eq!(fs::read_to_string(top.join("linked")).unwrap(), "ours");
        assert_eq!(fs::read_to_string(top.join("renamed")).unwrap(), "ours");
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn only_files_are_removed_with_their_folder() {
        let top = scratch("remove");
        let folder = Folder::open(&top).unwrap();
        fs::create_dir_all(top.join("flat")).unwrap();
        fs::create_dir_all(top.join("deep/folder")).unwrap();
        fs::write(top.join("theirs"), "theirs").unwrap();
        symlink("../theirs", top.join("flat/link")).unwrap();
        fs::write(top.join("flat/file"), "").unwrap();
        fs::write(top.join("deep/folder/file"), "").unwrap();
        symlink("deep", top.join("link")).unwrap();
        folder.remove_all(name("flat")).unwrap();
        assert!(folder.remove_all(name("deep")).is_err());
        assert!(folder.remove_all(name("link")).is_err());
        assert!(!top.join("flat").exists() && top.join("theirs").exists());
        assert!(top.join("deep/folder/file").exists());
        fs::remove_dir_all(&top).unwrap();
    }
}
