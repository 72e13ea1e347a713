//! The lines of a stream, in one buffer: no allocation per line, and a bound on the length of a line.

use std::io::{ErrorKind, Read};
use std::ops::Range;

use super::error::TraceError;

/// The greatest length of a line in bytes. A recorded event has about 200.
pub(super) const LONGEST_LINE: usize = 1 << 16;

/// The number of bytes in one read.
const CHUNK: usize = 1 << 18;

/// Splits a stream into lines.
pub(super) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    begin: usize,
    end: usize,
    line: Range<usize>,
    number: u64,
    bytes: u64,
    is_ended: bool,
    is_complete: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Lines<R> {
        let buffer = vec![0; CHUNK + LONGEST_LINE];
        Lines {
            source,
            buffer,
            begin: 0,
            end: 0,
            line: 0..0,
            number: 0,
            bytes: 0,
            is_ended: false,
            is_complete: true,
        }
    }

    /// The line that was read last, without its line feed.
    pub(super) fn line(&self) -> &[u8] {
        self.buffer.get(self.line.clone()).unwrap_or_default()
    }

    /// Returns whether the line that was read last has a line feed. Without one, it may be the begin of a longer line.
    pub(super) fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Reads the next line. Returns whether there is one; the last one needs no line feed.
    pub(super) fn advance(&mut self) -> Result<bool, TraceError> {
        let mut searched = 0;
        let end = loop {
            let rest = self.buffer.get(self.begin + searched..self.end).unwrap_or_default();
            if let Some(at) = memchr::memchr(b'\n', rest) {
                break self.begin + searched + at;
            }
            searched = self.end - self.begin;
            if searched > LONGEST_LINE {
                return Err(TraceError::LongLine(self.number + 1));
            }
            if self.is_ended {
                if searched == 0 {
                    return Ok(false);
                }
                self.is_complete = false;
                break self.end;
            }
            self.fill().map_err(TraceError::Reading)?;
        };
        if end - self.begin > LONGEST_LINE {
            return Err(TraceError::LongLine(self.number + 1));
        }
        self.line = self.begin..end;
        self.bytes += (end + 1 - self.begin) as u64;
        self.begin = (end + 1).min(self.end);
        self.number += 1;
        Ok(true)
    }

    /// The begin of what follows that line.
    pub(super) fn begin(&self) -> &[u8] {
        self.buffer.get(self.begin..self.end).unwrap_or_default()
    }

    /// The number of the line that was returned last, from 1.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// The number of bytes in the lines that were returned.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn source(&mut self) -> &mut R {
        &mut self.source
    }

    fn fill(&mut self) -> std::io::Result<()> {
        self.buffer.copy_within(self.begin..self.end, 0);
        self.end -= self.begin;
        self.begin = 0;
        let free = self.buffer.get_mut(self.end..).unwrap_or_default();
        let read = loop {
            match self.source.read(free) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => break read?,
            }
        };
        self.is_ended = read == 0;
        self.end += read;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A source that gives a few bytes at once.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
            let count = self.1.min(self.0.len()).min(to.len());
            to[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    proptest! {
        #[test]
        fn lines_are_those_of_the_text(text in "[ab\n]{0,60}", at_once in 1_usize..20) {
            let mut lines = Lines::new(Slow(text.as_bytes(), at_once));
            let mut found = Vec::new();
            while lines.advance().unwrap() {
                found.push(String::from_utf8(lines.line().to_vec()).unwrap());
            }
            prop_assert_eq!(found, text.split_terminator('\n').collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_line_without_end_is_an_error_and_needs_little_memory() {
        let mut lines = Lines::new(std::io::repeat(b'x').take(1 << 30));
        assert!(matches!(lines.advance(), Err(TraceError::LongLine(1))));
        let long = [b"a\n".as_slice(), &[b'x'; LONGEST_LINE + 1], b"\n"].concat();
        let mut lines = Lines::new(long.as_slice());
        assert!(lines.advance().unwrap());
        assert_eq!(lines.line(), b"a");
        assert!(matches!(lines.advance(), Err(TraceError::LongLine(2))));
    }
}
