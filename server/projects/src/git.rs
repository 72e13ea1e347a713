//! Reads commits of a git repository, which may be a stranger's, and executes nothing that it names.
//!
//! `git` finds the objects, if they are the repository's own (`git_folder.rs`), and its own checks of who owns the repository hold
//! (`safe.directory`). Only commands that read objects are
//! started: none of them has hooks, filters or a text conversion. What the repository's configuration could start all the same is
//! disabled: the file system monitor, hooks, replaced objects, and the programs and remotes that would fetch the missing objects of a
//! partial clone. The configuration of the user and of the system is the user's own, and is read.

use std::ffi::OsStr;
use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

use mauve_pwcet::program::{command, program};

use crate::disk::is_hidden;
use crate::git_folder::folders_of_git;

/// Variables of git that only say where configuration of the user is, and how far the search for a repository goes. All others are
/// removed: within a hook of git, they name a repository and an index. [`hook`] says which of these count nevertheless.
const KEPT: [&str; 5] = [
    "GIT_CONFIG_GLOBAL",
    "GIT_CONFIG_SYSTEM",
    "GIT_CONFIG_NOSYSTEM",
    "GIT_CEILING_DIRECTORIES",
    "GIT_DISCOVERY_ACROSS_FILESYSTEM",
];

/// The maximum length of the line about an object.
const LONGEST_LINE: u64 = 1 << 10;

/// The longest time that git may take to find the repository of a stranger: a moment, unless it waits for a pipe.
const LONGEST_ANSWER: Duration = Duration::from_secs(10);

/// How errors of git begin that quote no file.
const SHOWN: [&str; 2] = ["fatal: not a git repository", "fatal: detected dubious ownership"];

/// The maximum number of entries of a commit: a few trees that name each other may have any number.
const MOST_ENTRIES: usize = 1 << 20;

/// The repository around a folder.
#[derive(Debug)]
pub struct Repository {
    git: PathBuf,
    folder: PathBuf,
    allows_outside: bool,
    /// Whether its folder may be a stranger's: errors of git may quote other files.
    is_checked: bool,
    /// Variables for a hook: of the repository, and of the folder with the objects that a push has brought.
    hook: Vec<(&'static str, PathBuf)>,
    /// The folder of git, and that with the objects.
    folders: [Option<PathBuf>; 2],
    /// The folder's path below the top of the repository; empty at the top.
    pub prefix: PathBuf,
}

/// An entry of a commit, by its path below the top.
#[derive(Debug, PartialEq, Eq)]
pub struct CommitEntry {
    /// Its path below the top.
    pub path: PathBuf,
    /// What it is.
    pub kind: CommitEntryKind,
    /// Of a submodule, its commit.
    pub object: String,
}

/// What an entry of a commit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommitEntryKind {
    /// A file.
    File,
    /// A symbolic link.
    Link,
    /// The commit of another repository.
    Submodule,
}

impl Repository {
    /// Returns the repository around a folder. Where it `allows_outside`, it may have objects of others.
    ///
    /// # Errors
    ///
    /// There is none, git refuses it, or there is no git, in words for the user.
    pub fn around(folder: &Path, allows_outside: bool) -> Result<Repository, String> {
        let git = program("git").ok_or("git is not installed: mauve needs it to read a revision")?;
        let (folder, prefix) = (folder.canonicalize().unwrap_or_else(|_| folder.to_owned()), PathBuf::new());
        let hook = hook(&folder);
        let is_checked = hook.is_empty() && !allows_outside;
        let folders = [None, None];
        let mut found = Repository { git, folder, allows_outside, is_checked, hook, folders, prefix };
        let refused = |why: String| {
            format!(
                "cannot read a revision: {why}: use `--allow-outside` if you have made this repository yourself"
            )
        };
        let checked = if is_checked { folders_of_git(&found.folder).map_err(refused)? } else { None };
        (found.folders, found.prefix) = found.place().map_err(|why| {
            let is_bare = ["HEAD", "objects", "refs"].iter().all(|it| found.folder.join(it).exists());
            let hint = "\nhelp: for a bare repository, name it by the variable GIT_DIR, as git does for hooks: `GIT_DIR=. mauve diff …`";
            format!(
                "cannot read a revision: `{}` is in no repository that git reads: {why}{}",
                found.folder.display(),
                if is_bare { hint } else { "" }
            )
        })?;
        if is_checked && checked.map(|it| it.map(Some)).as_ref() != Some(&found.folders) {
            let folder = found.folder.display();
            return Err(refused(format!("the `.git` around `{folder}` leads git elsewhere")));
        }
        Ok(found)
    }

    /// Returns the folder of git and that with the objects, and the folder's path below the top. Waits a moment only.
    fn place(&self) -> Result<([Option<PathBuf>; 2], PathBuf), String> {
        let questions = ["rev-parse", "--absolute-git-dir", "--git-common-dir", "--show-prefix"];
        let (mut child, mut output) = self.start(&questions, Stdio::piped())?;
        let begin = Instant::now();
        while child.try_wait().is_ok_and(|it| it.is_none()) {
            if begin.elapsed() > LONGEST_ANSWER {
                _ = child.kill().and_then(|()| child.wait());
                return Err("git gives no answer: its configuration may include a pipe".to_owned());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.succeeded(child.wait_with_output())?;
        let mut answer = Vec::new();
        output.read_to_end(&mut answer).map_err(|error| format!("cannot run git: {error}"))?;
        let answer = answer.strip_suffix(b"\n").unwrap_or(&answer);
        let mut lines = answer.splitn(3, |it| *it == b'\n').map(|it| Path::new(OsStr::from_bytes(it)));
        let mut folder = || self.folder.join(lines.next()?).canonicalize().ok();
        let folders = [folder(), folder()];
        Ok((folders, lines.next().unwrap_or(Path::new("")).components().collect()))
    }

    /// Returns the commit of a revision, as git understands its name; `None` if there is none.
    pub fn commit(&self, revision: &str) -> Option<String> {
        // No name of a commit begins with a dash: it would be an option.
        if revision.is_empty() || revision.starts_with('-') {
            return None;
        }
        let commit = format!("{revision}^{{commit}}");
        let found = self.ask(&["rev-parse", "--verify", "--quiet", "--end-of-options", &commit]).ok()?;
        Some(String::from_utf8(found).ok()?).filter(|it| is_object(it))
    }

    /// Returns the best common ancestor of two commits.
    ///
    /// # Errors
    ///
    /// They have none, in words for the user.
    pub fn merge_base(&self, commits: [&str; 2]) -> Result<String, String> {
        let [one, other] = commits;
        let found = self.ask(&["merge-base", one, other]).ok().and_then(|it| String::from_utf8(it).ok());
        found.filter(|it| is_object(it)).ok_or_else(|| {
            format!("the two revisions have no common ancestor{}", self.shallow_hint().unwrap_or_default())
        })
    }

    /// Returns the repository of a submodule, if it is checked out at its path, belongs to this one, and has the commit of the entry.
    pub fn submodule(&self, entry: &CommitEntry) -> Option<Repository> {
        let own = self.folder.canonicalize().ok()?;
        let top = own.ancestors().nth(self.prefix.components().count())?;
        // Elsewhere, `core.worktree` has placed the repository of a stranger.
        top.join(".git").symlink_metadata().ok()?;
        // It is nowhere behind a link.
        let folder = top.join(&entry.path).canonicalize().ok().filter(|it| *it == top.join(&entry.path))?;
        let found = Repository::around(&folder, self.allows_outside)
            .ok()
            .filter(|it| it.prefix.as_os_str().is_empty())?;
        let (inner, outer) = (found.folders[0].as_ref()?, self.folders[1].as_ref()?);
        let is_own = inner != outer && (inner.starts_with(outer) || inner.starts_with(&folder));
        (is_own && found.commit(&entry.object).as_ref() == Some(&entry.object)).then_some(found)
    }

    /// Returns what to do if the repository lacks the older commits, as in many CI jobs.
    pub fn shallow_hint(&self) -> Option<&'static str> {
        let is_shallow = self.ask(&["rev-parse", "--is-shallow-repository"]).is_ok_and(|it| it == b"true");
        is_shallow.then_some(
            ": this is a shallow clone, which lacks older commits (`git fetch --unshallow`; `fetch-depth: 0` in an action)",
        )
    }

    /// Returns the entries of a commit that are `wanted`. Paths that lead out of a folder or to hidden files are left out, unless they
    /// are rules of what to ignore, or the user has `named` the hidden folder.
    ///
    /// # Errors
    ///
    /// Objects are missing, in words for the user.
    pub fn entries(
        &self,
        commit: &str,
        named: &Path,
        wanted: &dyn Fn(&CommitEntry) -> bool,
    ) -> Result<Vec<CommitEntry>, String> {
        let failed = |why: String| format!("cannot read the files of commit {commit}: {why}");
        let arguments = ["ls-tree", "-r", "-z", "--full-tree", commit];
        let (child, output) = self.start(&arguments, Stdio::piped()).map_err(failed)?;
        let mut found = Vec::new();
        for (number, line) in output.split(b'\0').enumerate() {
            if number == MOST_ENTRIES {
                return Err(failed(format!("it has more than {MOST_ENTRIES} files")));
            }
            let line = line.map_err(|error| failed(error.to_string()))?;
            found.extend(entry(&line, named).filter(wanted));
        }
        // It ends at the first tree that it cannot read: what it says has room in the pipe until here.
        self.succeeded(child.wait_with_output()).map_err(failed)?;
        Ok(found)
    }

    /// Starts reading the contents of files.
    pub fn contents(&self) -> Result<Contents<'_>, String> {
        let (mut child, output) = self.start(&["cat-file", "--batch"], Stdio::null())?;
        let input = child.stdin.take().ok_or("git has no input")?;
        Ok(Contents { repository: self, _child: child, input, output })
    }

    /// Returns a short answer of git without its last line break.
    fn ask(&self, arguments: &[&str]) -> Result<Vec<u8>, String> {
        let mut answer = self.succeeded(self.command().args(arguments).stdin(Stdio::null()).output())?;
        if answer.last() == Some(&b'\n') {
            answer.pop();
        }
        Ok(answer)
    }

    fn start(&self, arguments: &[&str], errors: Stdio) -> Result<(Child, BufReader<ChildStdout>), String> {
        let child = self
            .command()
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(errors)
            .spawn();
        let mut child = child.map_err(|error| format!("cannot start `{}`: {error}", self.git.display()))?;
        let output = child.stdout.take().ok_or("git has no output")?;
        Ok((child, BufReader::new(output)))
    }

    /// Returns what git answers, or the first line of its errors, with what git says to do about a foreign owner.
    fn succeeded(&self, output: std::io::Result<Output>) -> Result<Vec<u8>, String> {
        let output = output.map_err(|error| format!("cannot run git: {error}"))?;
        if output.status.success() {
            return Ok(output.stdout);
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().find(|line| !line.is_empty()).unwrap_or("git failed");
        if self.is_checked && !SHOWN.iter().any(|it| line.starts_with(it)) {
            return Err("git cannot read it: `git fsck` there says why".to_owned());
        }
        let remedy = said.lines().map(str::trim).find(|line| line.contains("--add safe.directory"));
        let help =
            remedy.map_or_else(String::new, |it| format!("\nhelp: if you trust its owner, run `{it}`"));
        Err(line.trim_start_matches("fatal: ").to_owned() + &help)
    }

    fn command(&self) -> Command {
        let mut git = command(&self.git);
        let own = std::env::vars_os().map(|(name, _)| name);
        let foreign =
            own.filter(|it| it.as_bytes().starts_with(b"GIT_") && !KEPT.iter().any(|kept| it == kept));
        foreign.for_each(|name| _ = git.env_remove(name));
        git.envs([
            ("GIT_NO_LAZY_FETCH", "1"),
            // Of no protocol: older versions of git fetch missing objects nevertheless.
            ("GIT_ALLOW_PROTOCOL", ""),
            ("GIT_TERMINAL_PROMPT", "0"),
            ("GIT_OPTIONAL_LOCKS", "0"),
            ("LC_ALL", "C"),
        ]);
        git.envs(self.hook.iter().map(|(name, path)| (name, path)));
        git.arg("-C").arg(&self.folder).args(["--no-pager", "--no-replace-objects"]);
        for option in [
            "core.fsmonitor=false",
            "core.hooksPath=/dev/null",
            "protocol.allow=never",
            "safe.bareRepository=explicit",
        ] {
            git.args(["-c", option]);
        }
        git
    }
}

/// Returns the variables with which git starts a hook in the folder of its repository, such as `pre-receive`: `GIT_DIR` is this
/// folder, which is no work tree. Until a push is accepted, its objects are in a folder in `objects`. No project can set variables.
fn hook(folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let real = |name: &str| std::path::absolute(std::env::var_os(name)?).ok()?.canonicalize().ok();
    if real("GIT_DIR").as_deref() != Some(folder) || !folder.join("objects").is_dir() {
        return Vec::new();
    }
    let (repository, objects) = (("GIT_DIR", folder.to_owned()), folder.join("objects"));
    match real("GIT_QUARANTINE_PATH").filter(|it| it.parent() == Some(&objects)) {
        Some(new) => {
            vec![repository, ("GIT_OBJECT_DIRECTORY", new), ("GIT_ALTERNATE_OBJECT_DIRECTORIES", objects)]
        }
        None => vec![repository],
    }
}

/// The contents of files. Git is asked for one object after another; it answers with a line about the object, its bytes and a line break.
#[derive(Debug)]
pub struct Contents<'a> {
    repository: &'a Repository,
    _child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Contents<'_> {
    /// Returns the bytes of a file, or its size if that exceeds `longest`.
    ///
    /// # Errors
    ///
    /// The object is missing, in words for the user.
    pub fn read(&mut self, entry: &CommitEntry, longest: u64) -> Result<Result<Vec<u8>, u64>, String> {
        let object = &entry.object;
        let failed = |error: std::io::Error| error.to_string();
        writeln!(self.input, "{object}").and_then(|()| self.input.flush()).map_err(failed)?;
        let mut line = Vec::new();
        self.output.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(failed)?;
        let line = String::from_utf8_lossy(&line);
        let mut parts = line.split_whitespace().skip(1);
        let size =
            parts.next().filter(|kind| *kind == "blob").and_then(|_| parts.next()?.parse::<u64>().ok());
        let size =
            size.ok_or_else(|| format!("the repository does not have object {object} (a partial clone?)"))?;
        if size > longest {
            // Another git goes on, since this one writes all of it first.
            *self = self.repository.contents()?;
            return Ok(Err(size));
        }
        let mut bytes = vec![0; usize::try_from(size).unwrap_or_default() + 1];
        self.output.read_exact(&mut bytes).map_err(failed)?;
        bytes.pop();
        Ok(Ok(bytes))
    }
}

/// Returns whether this is the hexadecimal name of an object.
fn is_object(text: &str) -> bool {
    text.len() >= 40 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Reads `100644 blob OBJECT<TAB>PATH`.
fn entry(line: &[u8], named: &Path) -> Option<CommitEntry> {
    let tab = line.iter().position(|byte| *byte == b'\t')?;
    let (head, path) = line.split_at(tab);
    let path = Path::new(OsStr::from_bytes(path.get(1..)?));
    let mut head = std::str::from_utf8(head).ok()?.split(' ');
    let (mode, _, object) = (head.next()?, head.next()?, head.next()?);
    let kind = match mode {
        "120000" => CommitEntryKind::Link,
        "160000" => CommitEntryKind::Submodule,
        _ => CommitEntryKind::File,
    };
    (is_object(object) && is_within(path, named)).then(|| CommitEntry {
        path: path.to_owned(),
        kind,
        object: object.to_owned(),
    })
}

/// Returns whether each part of a path is a visible name: git itself writes no `..` and no `.git`, but an object can have it.
fn is_within(path: &Path, named: &Path) -> bool {
    let is_rule = path.file_name().is_some_and(|name| name == ".gitignore" || name == ".ignore");
    let visible = if is_rule { path.parent().unwrap_or(path) } else { path };
    let is_plain = path.components().all(|part| matches!(part, std::path::Component::Normal(_)));
    is_plain && !path.as_os_str().is_empty() && is_visible(visible, named)
}

/// Returns whether a path is visible from the top of a repository, or from a hidden folder that the user has named.
pub fn is_visible(path: &Path, named: &Path) -> bool {
    let is_git = path.iter().any(|part| part == ".git");
    !is_git && (!is_hidden(path) || path.strip_prefix(named).is_ok_and(|below| !is_hidden(below)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_that_lead_elsewhere_are_left_out() {
        let object = "a".repeat(40);
        for (path, is_taken) in [
            ("robot/a.mal", true),
            ("robot/.gitignore", true),
            ("a b\n.mal", true),
            ("../a.mal", false),
            ("robot/../../a.mal", false),
            ("/etc/a.mal", false),
            (".git/a.mal", false),
            (".git/.gitignore", false),
            ("", false),
        ] {
            let line = format!("100644 blob {object}\t{path}");
            assert_eq!(entry(line.as_bytes(), Path::new("")).is_some(), is_taken, "{path:?}");
        }
        for (path, is_taken) in
            [(".robot/a.mal", true), (".robot/.env/a.mal", false), (".git/a.mal", false), (".x/a.mal", false)]
        {
            let line = format!("100644 blob {object}\t{path}");
            let found = [".robot", ".git"].map(|named| entry(line.as_bytes(), Path::new(named)).is_some());
            assert_eq!(found, [is_taken, false], "{path:?}");
        }
        let entry = |line: &[u8]| entry(line, Path::new(""));
        assert_eq!(entry(b"100644 blob -option\ta.mal"), None);
        let link = format!("120000 blob {object}\ta.mal");
        assert_eq!(entry(link.as_bytes()).map(|it| it.kind), Some(CommitEntryKind::Link));
    }
}
