//! Runs `babeltrace2`, which reads the common trace format of LTTng, and reads its output.
//!
//! It prints events on standard output and what the tracer discarded on standard error:
//!
//! ```text
//! WARNING: Tracer discarded 3373 events between [1795402574.190796936] and [1795402574.193434324] in trace "…
//! WARNING: Tracer may have discarded events between [1795402709.882030348] and [1795402709.882030348] in trace "…
//! WARNING: Tracer discarded 2 packets (unknown time range) in trace "…
//! ```
//!
//! It prints such a message before the first event after the begin of the range, and standard error has no buffer. So when a part
//! of the output has arrived, the messages that concern it have been written. Standard error is a file and not a pipe: a pipe
//! that is full would block `babeltrace2` while this reader waits for standard output.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Child, ChildStdout, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use super::error::TraceError;
use super::event::{number, time};
use super::nesting::LostTime;
use crate::program::{command, program};

/// Its name: the one of the paths in `PATH`.
const PROGRAM: &str = "babeltrace2";

/// The number of bytes of its messages that an error has.
const MOST_SAID: usize = 2000;

/// A discarded part of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lost {
    /// The number of events, if the tracer has counted them.
    pub(super) events: Option<u64>,
    /// When, if that is known.
    pub(super) gap: Option<LostTime>,
}

/// A running `babeltrace2`: its standard output.
pub(super) struct Babeltrace {
    child: Child,
    output: ChildStdout,
    messages: File,
    /// The last part of a message that is not complete.
    begun: Vec<u8>,
    /// The last messages that are not about discarded events.
    said: String,
    /// Discarded parts that the caller has not taken.
    pub(super) lost: Vec<Lost>,
}

impl Babeltrace {
    /// Starts to read a folder.
    pub(super) fn start(folder: &Path) -> Result<Babeltrace, TraceError> {
        // A path that begins with `-` is not an option.
        let folder = folder.canonicalize().map_err(|error| TraceError::io(folder, error))?;
        let (writer, messages) = temporary().map_err(|error| TraceError::io(&std::env::temp_dir(), error))?;
        let mut command = command(program(PROGRAM).ok_or(TraceError::NoBabeltrace)?);
        command
            .args(["--color=never", "--no-delta", "--clock-seconds", "--fields=trace:hostname,trace:vpid"])
            .arg(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(writer);
        // Ctrl-C ends the recording, and not the reader of what was recorded.
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|error| TraceError::io(Path::new(PROGRAM), error))?;
        let Some(output) = child.stdout.take() else { return Err(TraceError::NoBabeltrace) };
        Ok(Babeltrace { child, output, messages, begun: Vec::new(), said: String::new(), lost: Vec::new() })
    }

    /// Waits for the end, after the output has been read.
    ///
    /// # Errors
    ///
    /// `babeltrace2` could not read the trace.
    pub(super) fn finish(&mut self) -> Result<(), TraceError> {
        let status = self.child.wait().map_err(|error| TraceError::io(Path::new(PROGRAM), error))?;
        self.read_messages().map_err(|error| TraceError::io(Path::new(PROGRAM), error))?;
        match status.success() {
            true => Ok(()),
            false => Err(TraceError::Babeltrace(std::mem::take(&mut self.said))),
        }
    }

    fn read_messages(&mut self) -> std::io::Result<()> {
        let mut part = [0; 8192];
        loop {
            let count = self.messages.read(&mut part)?;
            if count == 0 {
                return Ok(());
            }
            for byte in part.iter().take(count) {
                match byte {
                    b'\n' => self.message(),
                    _ if self.begun.len() < MOST_SAID => self.begun.push(*byte),
                    _ => {}
                }
            }
        }
    }

    fn message(&mut self) {
        match lost(&self.begun) {
            Some(lost) => self.lost.push(lost),
            None => {
                self.said += &String::from_utf8_lossy(&self.begun);
                self.said.push('\n');
                // Its last messages have the cause.
                let excess = self.said.len().saturating_sub(MOST_SAID);
                let excess = (excess..self.said.len()).find(|at| self.said.is_char_boundary(*at));
                self.said.drain(..excess.unwrap_or(0));
            }
        }
        self.begun.clear();
    }
}

impl Read for Babeltrace {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        let count = self.output.read(to)?;
        self.read_messages()?;
        Ok(count)
    }
}

impl Drop for Babeltrace {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads a message about discarded events or packets; none if it is another message.
fn lost(message: &[u8]) -> Option<Lost> {
    let message = message.strip_prefix(b"WARNING: Tracer ")?;
    let (events, rest) = match message.strip_prefix(b"may have ") {
        Some(rest) => (None, rest),
        None => {
            let rest = message.strip_prefix(b"discarded ")?;
            let (count, rest) = rest.split_at_checked(rest.iter().position(|byte| *byte == b' ')?)?;
            // How many events a packet has is unknown.
            let is_events = rest.starts_with(b" event");
            (number(count).filter(|_| is_events), rest)
        }
    };
    let range = || {
        let begin = rest.windows(2).position(|it| it == b" [")?;
        let (begin, rest) = time(rest.get(begin + 2..)?)?;
        let (end, _) = time(rest.strip_prefix(b"] and [")?)?;
        Some(LostTime { begin, end })
    };
    Some(Lost { events, gap: range() })
}

/// Makes a file without a name, to be written by another process and read by this one.
fn temporary() -> std::io::Result<(File, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = std::env::temp_dir().join(format!("mauve-trace-{}-{number}.txt", std::process::id()));
    let mut writer = OpenOptions::new();
    writer.append(true).create_new(true);
    std::os::unix::fs::OpenOptionsExt::mode(&mut writer, 0o600);
    let writer = match writer.open(&path) {
        // Of an earlier process with the same number.
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            std::fs::remove_file(&path)?;
            writer.open(&path)?
        }
        writer => writer?,
    };
    let reader = File::open(&path);
    // Systems that do not remove an open file keep this small one.
    let _ = std::fs::remove_file(&path);
    let mut reader = reader?;
    reader.seek(SeekFrom::Start(0))?;
    Ok((writer, reader))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_about_discarded_events_are_read() {
        let gap = Some(LostTime { begin: 5_000_000_001, end: 6_000_000_000 });
        for (message, expected) in [
            (
                "WARNING: Tracer discarded 1 event between [5.000000001] and [6.000000000] in trace \"a [b\" (no UUID) …",
                Some(Lost { events: Some(1), gap }),
            ),
            (
                "WARNING: Tracer may have discarded events between [5.000000001] and [6.000000000] in trace",
                Some(Lost { events: None, gap }),
            ),
            (
                "WARNING: Tracer discarded 2 packets between [5.000000001] and [6.000000000] in",
                Some(Lost { events: None, gap }),
            ),
            (
                "WARNING: Tracer discarded 7 events (unknown time range) in trace \"a\"",
                Some(Lost { events: Some(7), gap: None }),
            ),
            ("WARNING: something else", None),
            ("", None),
        ] {
            assert_eq!(lost(message.as_bytes()), expected, "{message}");
        }
    }
}
