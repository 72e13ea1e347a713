//! What a path of a trace is: a file of executions, the folder of `mauve run --trace`, or a folder of LTTng.

use std::path::{Path, PathBuf};

use super::error::TraceError;

/// The file in a folder of `mauve run --trace`.
const EXECUTIONS: &str = "executions.csv";

/// The file beside it, which is complete if that is; recordings of earlier versions have none.
const PERIODS: &str = "periods.csv";

/// The end of its name until it is complete.
const PARTIAL: &str = ".partial";

/// LTTng writes its metadata at most at `archives/CHUNK/ust/pid/PROCESS/metadata`, or below a host and a session.
const DEEPEST: usize = 10;

/// A trace that can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A file of executions, or the folder of `mauve run --trace`.
    Csv {
        /// The file of executions.
        executions: PathBuf,
        /// The file of periods.
        periods: Option<PathBuf>,
    },
    /// A folder that LTTng has written.
    Ctf {
        /// Folders of the common trace format, in the order of time.
        chunks: Vec<PathBuf>,
        /// Whether a later chunk is still being recorded.
        is_recording: bool,
    },
}

impl Source {
    /// Returns what a path is.
    ///
    /// # Errors
    ///
    /// The path cannot be read, is not a trace, or is a file of executions that a program is still writing.
    pub fn of(path: &Path) -> Result<Source, TraceError> {
        let metadata = path.metadata().map_err(|error| TraceError::io(path, error))?;
        if !metadata.is_dir() {
            return match path.to_string_lossy().ends_with(PARTIAL) {
                true => Err(TraceError::Unfinished(path.to_owned())),
                false => Ok(Source::Csv { executions: path.to_owned(), periods: None }),
            };
        }
        let complete = path.join(EXECUTIONS);
        // Beside it, a complete file is of an earlier recording.
        let partial = path.join(format!("{EXECUTIONS}{PARTIAL}"));
        if partial.is_file() {
            return Err(TraceError::Unfinished(partial));
        }
        if complete.is_file() {
            let periods = Some(path.join(PERIODS)).filter(|it| it.is_file());
            return Ok(Source::Csv { executions: complete, periods });
        }
        let (chunks, is_recording) = chunks(path)?;
        if !chunks.is_empty() || is_recording {
            return Ok(Source::Ctf { chunks, is_recording });
        }
        match has_metadata(path, DEEPEST)? {
            true => Ok(Source::Ctf { chunks: vec![path.to_owned()], is_recording: false }),
            false => Err(TraceError::NotATrace),
        }
    }
}

/// Returns the complete chunks of a session with rotation, and whether a later one is being recorded.
///
/// ```text
/// archives/20261123T025748+0000-20261123T025749+0000-0    complete: LTTng moves it here at the end
/// 20261123T025750+0000-2                                  being recorded
/// ```
fn chunks(session: &Path) -> Result<(Vec<PathBuf>, bool), TraceError> {
    let mut found: Vec<(u64, PathBuf)> = Vec::new();
    let archives = session.join("archives");
    if !archives.is_dir() {
        return Ok((Vec::new(), false));
    }
    for entry in entries(&archives)? {
        if let Some((_, number)) = chunk(&entry).filter(|(times, _)| *times == 2)
            && has_metadata(&entry, DEEPEST)?
        {
            found.push((number, entry));
        }
    }
    found.sort();
    let is_open = |entry: &PathBuf| chunk(entry).is_some_and(|(times, _)| times == 1);
    let is_recording = entries(session)?.iter().any(is_open);
    Ok((found.into_iter().map(|(_, path)| path).collect(), is_recording))
}

/// Returns how many times the name of a chunk has, and its number: `TIME-NUMBER` or `TIME-TIME-NUMBER`.
fn chunk(path: &Path) -> Option<(usize, u64)> {
    let name = path.file_name()?.to_str()?;
    let (times, number) = name.rsplit_once('-')?;
    // `20261123T025748+0000`, or with a time zone behind UTC.
    let is_time =
        |text: &str| text.len() == 20 && text.bytes().all(|it| it.is_ascii_digit() || b"T+-".contains(&it));
    let count = match times.len() {
        20 => 1,
        41 => 2,
        _ => return None,
    };
    let first = times.get(..20)?;
    let last = times.get(times.len() - 20..)?;
    (is_time(first) && is_time(last)).then_some((count, number.parse().ok()?))
}

/// Returns whether there is a file `metadata` below a folder. Follows no links.
fn has_metadata(folder: &Path, depth: usize) -> Result<bool, TraceError> {
    let mut folders = Vec::new();
    for entry in entries(folder)? {
        let Ok(kind) = entry.symlink_metadata() else { continue };
        if kind.is_file() && entry.file_name().is_some_and(|name| name == "metadata") {
            return Ok(true);
        }
        if kind.is_dir() {
            folders.push(entry);
        }
    }
    for folder in folders {
        if depth > 0 && has_metadata(&folder, depth - 1)? {
            return Ok(true);
        }
    }
    Ok(false)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, TraceError> {
    let all = std::fs::read_dir(folder).and_then(|entries| {
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<PathBuf>>>()
    });
    all.map_err(|error| TraceError::io(folder, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str, files: &[&str]) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("mauve-source-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        for file in files {
            let path = folder.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        folder
    }

    #[test]
    fn a_folder_of_the_runtime_is_its_file() {
        let run = folder("run", &["executions.csv"]);
        assert_eq!(
            Source::of(&run).unwrap(),
            Source::Csv { executions: run.join("executions.csv"), periods: None }
        );
        let open = folder("open", &["executions.csv.partial"]);
        let partial = open.join("executions.csv.partial");
        for path in [&open, &partial] {
            assert!(matches!(Source::of(path), Err(TraceError::Unfinished(it)) if it == partial));
        }
        for folder in [run, open] {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }

    #[test]
    fn a_session_is_its_chunks_in_the_order_of_time() {
        let session = folder(
            "session",
            &[
                "archives/20261123T025748+0000-20261123T025749+0000-9/ust/uid/1/64-bit/metadata",
                "archives/20261123T025749+0000-20261123T025750+0000-10/ust/uid/1/64-bit/metadata",
                "archives/20261123T025750+0000-20261123T025751+0000-11/ust/x",
                "archives/other/metadata",
                "20261123T025751+0000-12/ust/uid/1/64-bit/metadata",
            ],
        );
        let archives = session.join("archives");
        let chunks = vec![
            archives.join("20261123T025748+0000-20261123T025749+0000-9"),
            archives.join("20261123T025749+0000-20261123T025750+0000-10"),
        ];
        assert_eq!(Source::of(&session).unwrap(), Source::Ctf { chunks, is_recording: true });
        // A chunk is a trace, too.
        let chunk = archives.join("20261123T025748+0000-20261123T025749+0000-9");
        let one = Source::Ctf { chunks: vec![chunk.clone()], is_recording: false };
        assert_eq!(Source::of(&chunk).unwrap(), one);
        std::fs::remove_dir_all(session).unwrap();
    }

    #[test]
    fn other_paths_are_not_traces() {
        let other = folder("other", &["a/b.txt"]);
        assert!(matches!(Source::of(&other), Err(TraceError::NotATrace)));
        assert!(matches!(Source::of(&other.join("c")), Err(TraceError::Io { .. })));
        std::fs::remove_dir_all(other).unwrap();
    }
}
