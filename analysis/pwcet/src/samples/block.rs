//! The blocks of a sample file. Each has a head, which is always read, and a body, which a reader can skip:
//!
//! ```text
//! kind u8 · length of the head u16 · length of the body u32 · head · CRC-32 of all this · body · CRC-32 of the body
//! ```
//!
//! Numbers are little-endian. A block without a body has no second checksum.

use std::io::{self, BufRead, Read, Write};

use super::error::{Damage, SamplesError};

/// The greatest body. A writer ends a block well below it.
pub(super) const LONGEST_BODY: usize = 1 << 20;

/// The greatest head: names of a program and an instance.
pub(super) const LONGEST_HEAD: usize = u16::MAX as usize;

/// The length of kind and lengths.
pub(super) const PREFIX: usize = 7;

/// What a block is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BlockKind {
    /// Declares the next series: its key and its instance.
    Series = 1,
    /// Begins a run: its source and its date.
    Begin = 2,
    /// Executions of one series.
    Data = 3,
    /// Ends a run, which is valid from then on: its summary.
    End = 4,
}

impl BlockKind {
    fn of(byte: u8) -> Option<BlockKind> {
        [BlockKind::Series, BlockKind::Begin, BlockKind::Data, BlockKind::End]
            .into_iter()
            .find(|kind| *kind as u8 == byte)
    }
}

/// The head of a block, and the length of its body.
#[derive(Debug)]
pub(super) struct SampleBlock {
    pub(super) kind: BlockKind,
    pub(super) head: Vec<u8>,
    pub(super) body: usize,
}

impl SampleBlock {
    /// The number of bytes in the file.
    pub(super) fn length(&self) -> u64 {
        let body = if self.body == 0 { 0 } else { self.body + 4 };
        (PREFIX + self.head.len() + 4 + body) as u64
    }

    /// The number of bytes from the begin of the block to the body.
    pub(super) fn body_offset(&self) -> u64 {
        (PREFIX + self.head.len() + 4) as u64
    }
}

/// Reads the head of the next block. Returns the damage if there is no valid head, which is also so at the end of a file.
pub(super) fn read_head(file: &mut impl BufRead) -> io::Result<Result<SampleBlock, Damage>> {
    let mut prefix = [0; PREFIX];
    if !read_all(file, &mut prefix)? {
        return Ok(Err(Damage::Truncated));
    }
    let [kind, h0, h1, b0, b1, b2, b3] = prefix;
    let head_length = usize::from(u16::from_le_bytes([h0, h1]));
    let body = u32::from_le_bytes([b0, b1, b2, b3]) as usize;
    let mut head = vec![0; head_length];
    let mut checksum = [0; 4];
    if !read_all(file, &mut head)? || !read_all(file, &mut checksum)? {
        return Ok(Err(Damage::Truncated));
    }
    let mut crc = crc32fast::Hasher::new();
    crc.update(&prefix);
    crc.update(&head);
    if crc.finalize() != u32::from_le_bytes(checksum) || body > LONGEST_BODY {
        return Ok(Err(Damage::Checksum));
    }
    let Some(kind) = BlockKind::of(kind) else { return Ok(Err(Damage::Content)) };
    Ok(Ok(SampleBlock { kind, head, body }))
}

/// Reads the body that begins here.
pub(super) fn read_body(file: &mut impl Read, length: usize) -> io::Result<Result<Vec<u8>, Damage>> {
    let mut body = vec![0; length.min(LONGEST_BODY)];
    let mut checksum = [0; 4];
    if !read_all(file, &mut body)? || !read_all(file, &mut checksum)? {
        return Ok(Err(Damage::Truncated));
    }
    let is_valid = crc32fast::hash(&body) == u32::from_le_bytes(checksum);
    Ok(if is_valid { Ok(body) } else { Err(Damage::Checksum) })
}

/// Writes a block; returns its length.
pub(super) fn write(
    file: &mut impl Write,
    kind: BlockKind,
    head: &[u8],
    body: &[u8],
) -> Result<u64, SamplesError> {
    let head_length = u16::try_from(head.len()).map_err(|_| SamplesError::LongName)?;
    let body_length = u32::try_from(body.len()).map_err(|_| SamplesError::LongName)?;
    let mut bytes = vec![kind as u8];
    bytes.extend(head_length.to_le_bytes());
    bytes.extend(body_length.to_le_bytes());
    bytes.extend(head);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    if !body.is_empty() {
        bytes.extend(body);
        bytes.extend(crc32fast::hash(body).to_le_bytes());
    }
    file.write_all(&bytes)?;
    Ok(bytes.len() as u64)
}

/// Fills `to`; returns whether the file had enough bytes.
fn read_all(file: &mut impl Read, to: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(to) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_zlib() {
        assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn a_block_is_read_as_it_was_written() {
        for body in [b"".as_slice(), b"body"] {
            let mut bytes = Vec::new();
            let length = write(&mut bytes, BlockKind::Data, b"head", body).unwrap();
            assert_eq!(length, bytes.len() as u64);
            let mut file = bytes.as_slice();
            let block = read_head(&mut file).unwrap().unwrap();
            assert_eq!(
                (block.kind, block.head.as_slice(), block.body),
                (BlockKind::Data, b"head".as_slice(), body.len())
            );
            assert_eq!(block.length(), length);
            assert_eq!(block.body_offset(), (bytes.len() - file.len()) as u64);
            if !body.is_empty() {
                assert_eq!(read_body(&mut file, block.body).unwrap(), Ok(body.to_vec()));
            }
            // Each changed bit is noticed.
            for bit in 0..bytes.len() * 8 {
                let mut damaged = bytes.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                let mut file = damaged.as_slice();
                let is_whole = match read_head(&mut file).unwrap() {
                    Ok(block) if block.body > 0 => read_body(&mut file, block.body).unwrap().is_ok(),
                    Ok(_) => true,
                    Err(_) => false,
                };
                assert!(!is_whole, "bit {bit}");
            }
        }
    }
}
