//! Reads a file that grows: complete lines only, until it is complete or the user ends the command.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// The time between two looks at the file.
const PAUSE: Duration = Duration::from_millis(200);

/// The number of bytes in one read.
const CHUNK: usize = 1 << 16;

/// A growing file.
pub(super) struct Follow {
    file: File,
    path: PathBuf,
    /// Its path when it is complete; none if only the user knows the end.
    complete: Option<PathBuf>,
    stop: Arc<AtomicBool>,
    /// What was read and not taken.
    buffer: Vec<u8>,
    /// How much of the buffer is complete lines.
    lines: usize,
    is_ended: bool,
}

impl Follow {
    pub(super) fn open(path: &Path, complete: Option<PathBuf>, stop: Arc<AtomicBool>) -> io::Result<Follow> {
        let file = File::open(path)?;
        let path = path.to_owned();
        Ok(Follow { file, path, complete, stop, buffer: Vec::new(), lines: 0, is_ended: false })
    }

    /// Reads more of the file, or waits for it.
    fn fill(&mut self) -> io::Result<()> {
        // Both are looked at before the file: what comes before them is read.
        let stops = self.stop.load(Ordering::Relaxed);
        let is_renamed = self.complete.is_some() && !self.path.exists();
        let before = self.buffer.len();
        self.file.by_ref().take(CHUNK as u64).read_to_end(&mut self.buffer)?;
        let read = self.buffer.get(before..).unwrap_or_default();
        if let Some(at) = read.iter().rposition(|byte| *byte == b'\n') {
            self.lines = before + at + 1;
        }
        if self.buffer.len() > before {
            return Ok(());
        }
        if is_renamed {
            if !self.complete.as_ref().is_some_and(|path| path.exists()) {
                return Err(io::Error::new(io::ErrorKind::NotFound, "the recording was removed"));
            }
            self.lines = self.buffer.len();
            self.is_ended = true;
        } else if stops {
            // The last line may lack digits.
            self.is_ended = true;
        } else {
            sleep(PAUSE);
        }
        Ok(())
    }
}

impl Read for Follow {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        // A line that does not end would fill the memory: the reader of lines refuses it.
        while self.lines == 0 && !self.is_ended && self.buffer.len() < 2 * CHUNK {
            self.fill()?;
        }
        let available = if self.buffer.len() >= 2 * CHUNK { self.buffer.len() } else { self.lines };
        let count = available.min(to.len());
        if let (Some(to), Some(from)) = (to.get_mut(..count), self.buffer.get(..count)) {
            to.copy_from_slice(from);
        }
        self.buffer.drain(..count);
        self.lines = self.lines.saturating_sub(count);
        Ok(count)
    }
}
