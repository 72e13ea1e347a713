//! Reads files of untrusted projects. Only regular files are read, each up to a maximum size, and no files of the
//! kernel's virtual file systems (`/proc/self/pagemap` has no end). [`ProjectBoundary`] decides which files belong to a
//! project.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// The maximum size of a file, in bytes: an analysis needs about a hundred times as much memory.
pub const LONGEST: u64 = 16 << 20;

/// The byte order mark, which says that a file is UTF-8. It is no part of the text: it has no column.
pub const MARK: &str = "\u{feff}";

/// What a file begins with that stands for one that Git LFS stores elsewhere.
const LFS_POINTER: &str = "version https://git-lfs.github.com/spec/";

/// The mount points of virtual file systems.
const MADE_UP: [&str; 3] = ["/proc", "/sys", "/dev"];

/// A mount point below these that holds regular files, in memory.
const MEMORY: &str = "/dev/shm";

/// The folders from which files of a project may be read, with links resolved.
///
/// Files elsewhere may be private, and messages quote texts, so they are not read even if a model or a `mauve.toml`
/// names them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct ProjectBoundary {
    /// The outermost of the folders around the project.
    project: PathBuf,
    folders: BTreeSet<PathBuf>,
    /// Whether the user has allowed reading all files.
    is_open: bool,
}

impl ProjectBoundary {
    /// What the project of `folder` may read: the folder itself, the repository around it, what the user `named` around it
    /// and in it, and the folders of `others`.
    pub fn new<'a>(
        folder: &Path,
        named: impl IntoIterator<Item = &'a PathBuf>,
        others: impl IntoIterator<Item = PathBuf>,
        is_open: bool,
    ) -> ProjectBoundary {
        let repository = folder.ancestors().find(|above| is_repository(above, folder));
        let named: Vec<&PathBuf> = named.into_iter().collect();
        let around = named.iter().filter(|named| folder.starts_with(named)).map(|named| named.as_path());
        let around: Vec<&Path> = around.chain(repository).chain([folder]).collect();
        // The outermost: others are most often in it.
        let project = around.iter().min_by_key(|folder| folder.components().count());
        let project = project.map(|folder| folder.to_path_buf()).unwrap_or_default();
        let within = named.iter().filter(|named| named.starts_with(folder)).map(|named| named.to_path_buf());
        let others = others.into_iter().filter_map(|other| other.canonicalize().ok());
        let around = around.iter().map(|folder| folder.to_path_buf());
        ProjectBoundary { project, folders: around.chain(within).chain(others).collect(), is_open }
    }

    /// Returns the outermost of the folders around the project and `folder`, which is above it as well.
    pub fn outermost<'a>(&'a self, folder: &'a Path) -> &'a Path {
        if folder.starts_with(&self.project) { &self.project } else { folder }
    }

    /// Returns whether a path with links resolved belongs to the project. Hidden files do not: `.git` and `.env` may
    /// contain secrets.
    fn has(&self, real: &Path) -> bool {
        self.folders.iter().any(|folder| real.strip_prefix(folder).is_ok_and(|path| !is_hidden(path)))
    }

    /// Returns why the file at `real`, a path with links resolved, may not be read; `None` if it may.
    pub fn refusal(&self, real: &Path) -> Option<String> {
        if self.is_open || self.has(real) {
            return None;
        }
        let why = match self.folders.iter().any(|folder| real.starts_with(folder)) {
            true => "is hidden".to_owned(),
            false => format!("is outside of `{}`", self.project.display()),
        };
        Some(format!(
            "`{}` {why}, and is not read: use `--allow-outside` if this project may read your other files",
            real.display()
        ))
    }
}

/// Returns whether `above` is a repository that a trusted user owns. In a world-writable folder such as `/tmp`,
/// another user could create a repository that encloses all projects below.
fn is_repository(above: &Path, folder: &Path) -> bool {
    let Ok(data) = above.join(".git").symlink_metadata() else { return false };
    let owner = folder.metadata().map(|data| data.uid());
    let trusted = [Some(0), Some(rustix::process::geteuid().as_raw()), owner.ok()];
    trusted.contains(&Some(data.uid()))
}

/// Is something on this path hidden, such as `.git`?
pub fn is_hidden(path: &Path) -> bool {
    path.iter().any(|part| part.as_encoded_bytes().starts_with(b".") && part != ".." && part != ".")
}

/// The bytes of a file, `longest` at most.
///
/// # Errors
///
/// Those of the file system; it is no regular file, or one of the kernel's; it is longer.
pub fn read(path: &Path, longest: u64) -> io::Result<Vec<u8>> {
    read_real(&path.canonicalize()?, longest)
}

/// The same for a path that is behind all links: one that has become a link since is not followed.
fn read_real(real: &Path, longest: u64) -> io::Result<Vec<u8>> {
    if is_made_up(real) {
        return Err(io::Error::other("this file belongs to the kernel, and is not text"));
    }
    bytes_of(open(real)?, longest)
}

/// The same for a file that is open.
pub fn bytes_of(file: File, longest: u64) -> io::Result<Vec<u8>> {
    if !file.metadata()?.is_file() || is_of_the_kernel(&file) {
        return Err(io::Error::other("this is not a file"));
    }
    // The reported length of a file is not reliable.
    at_most(longest, file)
}

/// Reads all that there is, if it is no longer than this.
pub fn at_most(longest: u64, input: impl io::Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(longest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > longest {
        return Err(io::Error::other(format!("this file is longer than {longest} bytes, and is not read")));
    }
    Ok(bytes)
}

/// Returns whether a file begins with a byte order mark.
pub fn has_mark(path: &Path) -> bool {
    let mut start = [0; MARK.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *MARK.as_bytes()
}

/// Returns the text of a file without its byte order mark, as an editor shows it, up to the first byte that is not UTF-8,
/// and the reason if the text is incomplete. The path must have its links resolved.
///
/// [`replace`](crate::replace::replace) writes the mark again.
pub fn text_of(real: &Path) -> (String, Option<String>) {
    text_in(read_real(real, LONGEST))
}

/// The same for bytes that were read, or for the reason why they were not.
pub fn text_in(bytes: io::Result<Vec<u8>>) -> (String, Option<String>) {
    let unmarked = |text: String| text.strip_prefix(MARK).map(str::to_owned).unwrap_or(text);
    match bytes.map(String::from_utf8) {
        Err(error) => (String::new(), Some(format!("cannot be read: {error}"))),
        Ok(Ok(text)) if text.starts_with(LFS_POINTER) => (
            String::new(),
            Some("this file is only a pointer to one that Git LFS stores: run `git lfs pull`".to_owned()),
        ),
        Ok(Ok(text)) => (unmarked(text), None),
        Ok(Err(error)) => {
            let valid = error.utf8_error().valid_up_to();
            let mut bytes = error.into_bytes();
            bytes.truncate(valid);
            let text = unmarked(String::from_utf8(bytes).unwrap_or_default());
            (text, Some(format!("this file is not UTF-8 text from byte {valid} on, and is read up to there")))
        }
    }
}

/// Returns whether a path leads to a virtual file system. Such file systems may be mounted anywhere, so `open` checks
/// the file as well.
pub fn is_made_up(real: &Path) -> bool {
    MADE_UP.iter().any(|folder| real.starts_with(folder)) && !real.starts_with(MEMORY)
}

/// Opens a file without following a link anywhere on its path: in one call where the system has it, else folder by folder.
fn open(real: &Path) -> io::Result<File> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, Mode, OFlags, ResolveFlags, openat2};
        use rustix::io::Errno;
        // Without this flag, opening a pipe or a device blocks, if the file has become one.
        let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::NOFOLLOW;
        match openat2(CWD, real, flags, Mode::empty(), ResolveFlags::NO_SYMLINKS) {
            // An old kernel or a container without this system call.
            Err(Errno::NOSYS | Errno::PERM) => {}
            opened => return Ok(File::from(opened?)),
        }
    }
    crate::folder::open_file(real)
}

#[cfg(target_os = "linux")]
fn is_of_the_kernel(file: &File) -> bool {
    // proc, sysfs, debugfs, tracefs, securityfs, cgroup and cgroup2, devpts, bpf, efivarfs: `statfs(2)`.
    const KERNEL: [u64; 10] = [
        0x9fa0, 0x62656572, 0x64626720, 0x74726163, 0x73636673, 0x0027e0eb, 0x63677270, 0x1cd1, 0xcafe4a11,
        0xde5e81e4,
    ];
    rustix::fs::fstatfs(file).is_ok_and(|it| KERNEL.contains(&(it.f_type as u64 & 0xffff_ffff)))
}

#[cfg(not(target_os = "linux"))]
fn is_of_the_kernel(_: &File) -> bool {
    false
}

/// Returns whether a path is on a file system where others may change files without an event: that of a network, of a container
/// or of another system around this one.
#[cfg(target_os = "linux")]
pub fn tells_no_changes(path: &Path) -> bool {
    // NFS, SMB, CIFS, SMB2, overlayfs, 9p (WSL), FUSE and virtiofs, Ceph, AFS, vboxsf: `statfs(2)`.
    const FAR: [u64; 10] = [
        0x6969, 0x517b, 0xff534d42, 0xfe534d42, 0x794c7630, 0x01021997, 0x65735546, 0x00c36400, 0x5346414f,
        0x786f4256,
    ];
    rustix::fs::statfs(path).is_ok_and(|it| FAR.contains(&(it.f_type as u64 & 0xffff_ffff)))
}

#[cfg(not(target_os = "linux"))]
pub fn tells_no_changes(_: &Path) -> bool {
    false
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        mauve_tests::own_scratch(&format!("disk-{name}"))
    }

    #[test]
    fn only_regular_files_of_a_bounded_length_are_read() {
        let folder = scratch("read");
        std::fs::write(folder.join("a"), "12345").unwrap();
        assert_eq!(read(&folder.join("a"), 5).unwrap(), b"12345");
        let why = |path: &Path| read(path, 4).unwrap_err().to_string();
        assert_eq!(why(&folder.join("a")), "this file is longer than 4 bytes, and is not read");
        assert_eq!(why(&folder), "this is not a file");
        for made_up in ["/proc/self/pagemap", "/proc/self/environ", "/dev/zero", "/sys/kernel/notes"] {
            let link = folder.join("link");
            std::os::unix::fs::symlink(made_up, &link).unwrap();
            assert_eq!(why(&link), "this file belongs to the kernel, and is not text", "{made_up}");
            std::fs::remove_file(link).unwrap();
        }
        let pipe = folder.join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
        assert_eq!(why(&pipe), "this is not a file");
        std::os::unix::fs::symlink(folder.join("a"), folder.join("b")).unwrap();
        assert!(read_real(&folder.join("b"), 9).is_err(), "it has become a link");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn files_of_the_kernel_are_known_wherever_they_are_mounted() {
        let file = File::open("/proc/self/status").unwrap();
        assert!(is_of_the_kernel(&file) && !is_of_the_kernel(&File::open("/etc/passwd").unwrap()));
    }

    #[test]
    fn a_boundary_is_the_repository_and_what_was_named() {
        let top = scratch("boundary");
        for folder in ["repo/.git", "repo/robot", "repo/common", "elsewhere", "models"] {
            std::fs::create_dir_all(top.join(folder)).unwrap();
        }
        let robot = top.join("repo/robot");
        let boundary = ProjectBoundary::new(&robot, [&top.join("elsewhere")], [top.join("models")], false);
        for (path, is_within) in [
            ("repo/robot/a.mal", true),
            ("repo/common/a.mal", true),
            ("models/a.mal", true),
            ("elsewhere/a.mal", false),
            ("a.mal", false),
            ("repository/a.mal", false),
            ("repo/.git/config", false),
            ("repo/robot/.env", false),
        ] {
            assert_eq!(boundary.refusal(&top.join(path)).is_none(), is_within, "{path}");
        }
        assert_eq!(ProjectBoundary::new(&robot, [], [], true).refusal(Path::new("/etc/passwd")), None);
        let named = ProjectBoundary::new(&robot, [&top], [], false);
        assert!(named.has(&top.join("elsewhere/a.mal")), "a folder that was named encloses it");
        std::fs::remove_dir_all(top).unwrap();
    }
}
