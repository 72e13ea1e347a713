//! The lines of a stream, in one buffer: no allocation per line, and a bound on the length of a line.

use std::io::{BufRead as _, BufReader, Read};

use super::error::TraceError;

/// The greatest length of a line in bytes. A recorded event has about 200.
pub(super) const LONGEST_LINE: usize = 1 << 16;

/// The number of bytes in one read.
const CHUNK: usize = 1 << 18;

/// Splits a stream into lines.
pub(super) struct TraceLines<R> {
    source: BufReader<R>,
    line: Vec<u8>,
    number: u64,
    bytes: u64,
    is_complete: bool,
}

impl<R: Read> TraceLines<R> {
    pub(super) fn new(source: R) -> TraceLines<R> {
        let source = BufReader::with_capacity(CHUNK, source);
        TraceLines { source, line: Vec::new(), number: 0, bytes: 0, is_complete: true }
    }

    /// The line that was read last, without its line feed; the begin of one that is too long.
    pub(super) fn line(&self) -> &[u8] {
        &self.line
    }

    /// Returns whether the line that was read last has a line feed. Without one, it may be the begin of a longer line.
    pub(super) fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Reads the next line. Returns whether there is one; the last one needs no line feed.
    pub(super) fn advance(&mut self) -> Result<bool, TraceError> {
        self.line.clear();
        let mut bounded = self.source.by_ref().take(LONGEST_LINE as u64 + 1);
        let count = bounded.read_until(b'\n', &mut self.line).map_err(TraceError::Reading)?;
        if count == 0 {
            return Ok(false);
        }
        self.number += 1;
        self.bytes += count as u64;
        self.is_complete = self.line.pop_if(|last| *last == b'\n').is_some();
        match self.line.len() {
            0..=LONGEST_LINE => Ok(true),
            _ => Err(TraceError::LongLine(self.number)),
        }
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
        self.source.get_mut()
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
            let mut lines = TraceLines::new(Slow(text.as_bytes(), at_once));
            let mut found = Vec::new();
            while lines.advance().unwrap() {
                found.push(String::from_utf8(lines.line().to_vec()).unwrap());
            }
            prop_assert_eq!(found, text.split_terminator('\n').collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_line_without_end_is_an_error_and_needs_little_memory() {
        let mut lines = TraceLines::new(std::io::repeat(b'x').take(1 << 30));
        assert!(matches!(lines.advance(), Err(TraceError::LongLine(1))));
        let long = [b"a\n".as_slice(), &[b'x'; LONGEST_LINE + 1], b"\n"].concat();
        let mut lines = TraceLines::new(long.as_slice());
        assert!(lines.advance().unwrap());
        assert_eq!(lines.line(), b"a");
        assert!(matches!(lines.advance(), Err(TraceError::LongLine(2))));
    }
}
