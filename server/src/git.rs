//! Reads commits of a git repository, which may be a stranger's, and executes nothing that it names.
//!
//! `git` finds the objects, and its own checks of who owns the repository hold (`safe.directory`). Only commands that read objects are
//! started: none of them has hooks, filters or a text conversion. What the repository's configuration could start all the same is
//! disabled: the file system monitor, hooks, replaced objects, and the programs and remotes that would fetch the missing objects of a
//! partial clone. The configuration of the user and of the system is the user's own, and is read.

use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;

use mauve_pwcet::program::{command, program};

use crate::disk::at_most;

/// Variables of git that only say where configuration of the user is, and how far the search for a repository goes. All others are
/// removed: within a hook of git, they name a repository and an index.
const KEPT: [&str; 5] = [
    "GIT_CONFIG_GLOBAL",
    "GIT_CONFIG_SYSTEM",
    "GIT_CONFIG_NOSYSTEM",
    "GIT_CEILING_DIRECTORIES",
    "GIT_DISCOVERY_ACROSS_FILESYSTEM",
];

/// The maximum number of bytes that a short answer of git has.
const LONGEST_ANSWER: u64 = 1 << 20;

/// The maximum number of entries of a commit: a few trees that name each other may have any number.
const MOST_ENTRIES: usize = 1 << 20;

/// The repository around a folder.
#[derive(Debug)]
pub(crate) struct Repository {
    git: PathBuf,
    folder: PathBuf,
    /// The folder's path below the top of the repository; empty at the top.
    pub(crate) prefix: PathBuf,
}

/// An entry of a commit, by its path below the top.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) path: PathBuf,
    pub(crate) kind: EntryKind,
    object: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EntryKind {
    File,
    Link,
    Submodule,
}

impl Repository {
    /// Returns the repository around a folder.
    ///
    /// # Errors
    ///
    /// There is none, git refuses it, or there is no git, in words for the user.
    pub(crate) fn around(folder: &Path) -> Result<Repository, String> {
        let git = program("git").ok_or("git is not installed: mauve needs it to read a revision")?;
        let mut found = Repository { git, folder: folder.to_owned(), prefix: PathBuf::new() };
        let prefix = found.ask(&["rev-parse", "--show-prefix"]).map_err(|why| {
            format!(
                "cannot read a revision: `{}` is in no repository that git reads: {why}",
                folder.display()
            )
        })?;
        found.prefix = PathBuf::from(std::ffi::OsStr::from_bytes(&prefix)).components().collect();
        Ok(found)
    }

    /// Returns the commit of a revision, as git understands its name; `None` if there is none.
    pub(crate) fn commit(&self, revision: &str) -> Option<String> {
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
    pub(crate) fn merge_base(&self, commits: [&str; 2]) -> Result<String, String> {
        let [one, other] = commits;
        let found = self.ask(&["merge-base", one, other]).ok().and_then(|it| String::from_utf8(it).ok());
        found.filter(|it| is_object(it)).ok_or_else(|| {
            format!("the two revisions have no common ancestor{}", self.shallow_hint().unwrap_or_default())
        })
    }

    /// Returns what to do if the repository lacks the older commits, as in many CI jobs.
    pub(crate) fn shallow_hint(&self) -> Option<&'static str> {
        let is_shallow = self.ask(&["rev-parse", "--is-shallow-repository"]).is_ok_and(|it| it == b"true");
        is_shallow.then_some(
            ": this is a shallow clone, which lacks older commits (`git fetch --unshallow`; `fetch-depth: 0` in an action)",
        )
    }

    /// Returns the entries of a commit that are `wanted`. Paths that lead out of a folder or to hidden files are left out, unless they
    /// are rules of what to ignore.
    ///
    /// # Errors
    ///
    /// Objects are missing, in words for the user.
    pub(crate) fn entries(
        &self,
        commit: &str,
        wanted: &dyn Fn(&Entry) -> bool,
    ) -> Result<Vec<Entry>, String> {
        let failed = |why: String| format!("cannot read the files of commit {commit}: {why}");
        let mut child =
            self.start(&["ls-tree", "-r", "-z", "--full-tree", commit], Stdio::null()).map_err(failed)?;
        let output = child.output.take().ok_or_else(|| failed("git has no output".to_owned()))?;
        let mut found = Vec::new();
        for (number, line) in BufReader::new(output).split(b'\0').enumerate() {
            if number == MOST_ENTRIES {
                return Err(failed(format!("it has more than {MOST_ENTRIES} files")));
            }
            let line = line.map_err(|error| failed(error.to_string()))?;
            found.extend(entry(&line).filter(wanted));
        }
        child.finish().map_err(failed)?;
        Ok(found)
    }

    /// Starts reading the contents of files.
    pub(crate) fn contents(&self) -> Result<Contents, String> {
        Ok(Contents { sizes: self.objects("--batch-check")?, bytes: self.objects("--batch")? })
    }

    fn objects(&self, mode: &str) -> Result<Objects, String> {
        let mut child = self.start(&["cat-file", mode], Stdio::piped())?;
        let pipes = child.child.stdin.take().zip(child.output.take());
        let (input, output) = pipes.ok_or("git has no input or output")?;
        Ok(Objects { _child: child, input, output: BufReader::new(output) })
    }

    /// Returns a short answer of git without its last line break.
    fn ask(&self, arguments: &[&str]) -> Result<Vec<u8>, String> {
        let mut child = self.start(arguments, Stdio::null())?;
        let output = child.output.take().ok_or("git has no output")?;
        let mut answer = at_most(LONGEST_ANSWER, output).map_err(|error| error.to_string())?;
        child.finish()?;
        if answer.last() == Some(&b'\n') {
            answer.pop();
        }
        Ok(answer)
    }

    fn start(&self, arguments: &[&str], input: Stdio) -> Result<Running, String> {
        let child = self.command().args(arguments).stdin(input).spawn();
        let mut child = child.map_err(|error| format!("cannot start `{}`: {error}", self.git.display()))?;
        let output = child.stdout.take();
        let errors = child.stderr.take().map(|errors| std::thread::spawn(move || beginning(errors)));
        Ok(Running { child, output, errors })
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
        git.arg("-C").arg(&self.folder).args(["--no-pager", "--no-replace-objects"]);
        for option in [
            "core.fsmonitor=false",
            "core.hooksPath=/dev/null",
            "protocol.allow=never",
            "safe.bareRepository=explicit",
        ] {
            git.args(["-c", option]);
        }
        git.stdout(Stdio::piped()).stderr(Stdio::piped());
        git
    }
}

/// A git that runs, until this is dropped.
#[derive(Debug)]
struct Running {
    child: Child,
    output: Option<ChildStdout>,
    /// Reads what it says on standard error: a full pipe would block it.
    errors: Option<JoinHandle<Vec<u8>>>,
}

impl Running {
    /// Waits for the end, once its output is read.
    fn finish(mut self) -> Result<(), String> {
        let status = self.child.wait().map_err(|error| error.to_string())?;
        if status.success() {
            return Ok(());
        }
        let said = self.errors.take().and_then(|errors| errors.join().ok()).unwrap_or_default();
        let said = String::from_utf8_lossy(&said).into_owned();
        let line = said.lines().find(|line| !line.is_empty()).unwrap_or("git failed");
        Err(line.trim_start_matches("fatal: ").to_owned())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the beginning of a stream, and reads all of it.
fn beginning(mut stream: impl Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = stream.by_ref().take(LONGEST_ANSWER).read_to_end(&mut bytes);
    let _ = std::io::copy(&mut stream, &mut std::io::sink());
    bytes
}

/// A git that answers a line about each object that it is asked for.
#[derive(Debug)]
struct Objects {
    _child: Running,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Objects {
    /// Returns the size of a file's object.
    fn size(&mut self, object: &str) -> Result<u64, String> {
        let mut line = Vec::new();
        let asked = writeln!(self.input, "{object}").and_then(|()| self.input.flush());
        let answered =
            asked.and_then(|()| self.output.by_ref().take(LONGEST_ANSWER).read_until(b'\n', &mut line));
        answered.map_err(|error| error.to_string())?;
        let line = String::from_utf8_lossy(&line);
        let mut parts = line.split_whitespace().skip(1);
        let size = parts.next().filter(|kind| *kind == "blob").and_then(|_| parts.next()?.parse().ok());
        size.ok_or_else(|| format!("the repository does not have object {object} (a partial clone?)"))
    }
}

/// The contents of files.
#[derive(Debug)]
pub(crate) struct Contents {
    sizes: Objects,
    bytes: Objects,
}

impl Contents {
    /// Returns the bytes of a file, or its size if that exceeds `longest`.
    ///
    /// # Errors
    ///
    /// The object is missing, in words for the user.
    pub(crate) fn read(&mut self, entry: &Entry, longest: u64) -> Result<Result<Vec<u8>, u64>, String> {
        let size = self.sizes.size(&entry.object)?;
        if size > longest {
            return Ok(Err(size));
        }
        // The same line comes before the bytes, and a line break after them.
        if self.bytes.size(&entry.object)? != size {
            return Err(format!("object {} has two sizes", entry.object));
        }
        let mut bytes = vec![0; usize::try_from(size).unwrap_or_default() + 1];
        self.bytes.output.read_exact(&mut bytes).map_err(|error| error.to_string())?;
        bytes.pop();
        Ok(Ok(bytes))
    }
}

/// Returns whether this is the hexadecimal name of an object.
fn is_object(text: &str) -> bool {
    text.len() >= 40 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Reads `100644 blob OBJECT<TAB>PATH`.
fn entry(line: &[u8]) -> Option<Entry> {
    let tab = line.iter().position(|byte| *byte == b'\t')?;
    let (head, path) = line.split_at(tab);
    let path = Path::new(std::ffi::OsStr::from_bytes(path.get(1..)?));
    let mut head = std::str::from_utf8(head).ok()?.split(' ');
    let (mode, _, object) = (head.next()?, head.next()?, head.next()?);
    let kind = match mode {
        "120000" => EntryKind::Link,
        "160000" => EntryKind::Submodule,
        _ => EntryKind::File,
    };
    (is_object(object) && is_within(path)).then(|| Entry {
        path: path.to_owned(),
        kind,
        object: object.to_owned(),
    })
}

/// Returns whether each part of a path is a visible name: git itself writes no `..` and no `.git`, but an object can have it.
fn is_within(path: &Path) -> bool {
    let is_rule = path.file_name().is_some_and(|name| name == ".gitignore" || name == ".ignore");
    let visible = if is_rule { path.parent().unwrap_or(path) } else { path };
    let is_plain = path.components().all(|part| matches!(part, std::path::Component::Normal(_)));
    is_plain && !path.as_os_str().is_empty() && !crate::disk::is_hidden(visible)
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
            assert_eq!(entry(line.as_bytes()).is_some(), is_taken, "{path:?}");
        }
        assert_eq!(entry(b"100644 blob -option\ta.mal"), None);
        let link = format!("120000 blob {object}\ta.mal");
        assert_eq!(entry(link.as_bytes()).map(|it| it.kind), Some(EntryKind::Link));
    }
}
