//! A recording of LTTng that a power failure cut: the complete packets of its streams.
//!
//! `babeltrace2` refuses a folder with a stream whose last packet is longer than its file, and prints no event of it. So it gets a
//! folder that has the complete packets only. Each packet of LTTng has its size at the same place, behind its header and three
//! numbers of its context (`lttng-ust/src/common/ringbuffer-clients/metadata-template.h` and `template.h`):
//!
//! ```text
//! 0 magic  4 uuid  20 stream_id  24 stream_instance_id │ 32 timestamp_begin  40 timestamp_end  48 content_size  56 packet_size
//! ```

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// The first bytes of a packet, as a number in the byte order of the recorder.
const MAGIC: u32 = 0xC1FC_1FC1;

/// The length of a packet up to its size.
const HEADER: usize = 64;

/// A folder of LTTng has its streams at most so many folders below.
const DEEPEST: usize = 8;

/// A folder with the complete packets, which is removed at the end.
pub(super) struct Complete(PathBuf);

impl Complete {
    /// Returns a folder with the complete packets of a recording; `None` if no stream of it is cut.
    pub(super) fn of(recording: &Path) -> io::Result<Option<Complete>> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("mauve-trace-{}-{number}", std::process::id()));
        std::fs::create_dir(&folder)?;
        let complete = Complete(folder);
        let is_cut = fill(&recording.canonicalize()?, &complete.0, DEEPEST)?;
        Ok(is_cut.then_some(complete))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Complete {
    fn drop(&mut self) {
        // The user's folder for temporary files may be removed by others.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Fills a folder, and returns whether a stream was cut. The indices of packets, which `babeltrace2` does not need, are left out.
fn fill(from: &Path, to: &Path, depth: usize) -> io::Result<bool> {
    let mut is_cut = false;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let (name, kind) = (entry.file_name(), entry.file_type()?);
        let (from, to) = (entry.path(), to.join(&name));
        if kind.is_dir() && depth > 0 && name != "index" {
            std::fs::create_dir(&to)?;
            is_cut |= fill(&from, &to, depth - 1)?;
        } else if kind.is_file() {
            match complete_bytes(&from)? {
                None => std::os::unix::fs::symlink(&from, &to)?,
                Some(length) => {
                    is_cut = true;
                    // A stream without a packet is no stream.
                    if length > 0 {
                        io::copy(&mut File::open(&from)?.take(length), &mut File::create_new(&to)?)?;
                    }
                }
            }
        }
    }
    Ok(is_cut)
}

/// Returns the length of the complete packets, if the last one is cut; `None` of any other file.
fn complete_bytes(path: &Path) -> io::Result<Option<u64>> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut at = 0;
    while at < length {
        let mut header = Vec::with_capacity(HEADER);
        file.seek(SeekFrom::Start(at))?;
        file.by_ref().take(HEADER as u64).read_to_end(&mut header)?;
        let size = match packet_size(&header) {
            Some(size) => size,
            // A packet that is cut in its header; at the begin of a file, perhaps another file.
            None if at > 0 && header.len() < HEADER => return Ok(Some(at)),
            None => return Ok(None),
        };
        match at.checked_add(size).filter(|end| *end <= length) {
            Some(end) => at = end,
            None => return Ok(Some(at)),
        }
    }
    Ok(None)
}

/// Returns the size of a packet in bytes; `None` if it has no header of LTTng.
fn packet_size(header: &[u8]) -> Option<u64> {
    let magic: [u8; 4] = header.get(..4)?.try_into().ok()?;
    let bits: [u8; 8] = header.get(56..HEADER)?.try_into().ok()?;
    let bits = match () {
        () if u32::from_le_bytes(magic) == MAGIC => u64::from_le_bytes(bits),
        () if u32::from_be_bytes(magic) == MAGIC => u64::from_be_bytes(bits),
        () => return None,
    };
    Some(bits / 8).filter(|bytes| *bytes >= HEADER as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet of so many bytes.
    fn packet(size: u64, fill: u8, is_little: bool) -> Vec<u8> {
        let mut bytes = vec![fill; size as usize];
        let bits = size * 8;
        bytes[..4].copy_from_slice(&if is_little { MAGIC.to_le_bytes() } else { MAGIC.to_be_bytes() });
        bytes[56..64].copy_from_slice(&if is_little { bits.to_le_bytes() } else { bits.to_be_bytes() });
        bytes
    }

    #[test]
    fn complete_packets_stay() {
        let path = std::env::temp_dir().join(format!("mauve-cut-{}", std::process::id()));
        for is_little in [true, false] {
            let bytes = [packet(100, 1, is_little), packet(300, 2, is_little)].concat();
            for length in 0..=bytes.len() {
                std::fs::write(&path, &bytes[..length]).unwrap();
                let expected = match length {
                    // Too short to be known as a stream.
                    0..64 | 100 | 400 => None,
                    64..100 => Some(0),
                    _ => Some(100),
                };
                assert_eq!(complete_bytes(&path).unwrap(), expected, "{length}");
            }
        }
        // No stream, and hostile sizes.
        let zero = [packet(100, 0, true), vec![0; 200]].concat();
        let mut endless = packet(100, 0, true);
        endless[56..64].copy_from_slice(&[0xff; 8]);
        for (bytes, expected) in
            [(b"/* CTF 1.8 */".to_vec(), None), (vec![0; 500], None), (zero, None), (endless, Some(0))]
        {
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(complete_bytes(&path).unwrap(), expected);
        }
        std::fs::remove_file(&path).unwrap();
    }
}
