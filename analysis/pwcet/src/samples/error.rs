//! Why samples cannot be read or written.

use std::io;

/// Why a sample file cannot be read or written.
#[derive(Debug)]
pub enum SamplesError {
    /// The file cannot be read or written.
    Io(io::Error),
    /// The file is not a sample file.
    NotSamples,
    /// The file has no byte.
    Empty,
    /// The file has a later version of the format.
    LaterVersion,
    /// The file is damaged at this offset.
    Damaged {
        /// In bytes from the begin of the file.
        offset: u64,
        /// How.
        damage: Damage,
    },
    /// Another process writes the file.
    Locked,
    /// The same executions were imported before.
    Duplicate {
        /// The index of the [`Run`](super::Run) that has them.
        run: usize,
    },
    /// Some of the executions were imported before: the trace is a part of that one, or that one of it.
    Overlap {
        /// The index of the [`Run`](super::Run) that has them.
        run: usize,
    },
    /// Another file has a run of this file.
    Repeated {
        /// The index of the [`Run`](super::Run) in this file.
        run: usize,
    },
    /// A name is too long.
    LongName,
    /// More runs or series than a file may have.
    TooMany,
    /// No series has this number.
    UnknownSeries,
}

impl From<io::Error> for SamplesError {
    fn from(error: io::Error) -> SamplesError {
        SamplesError::Io(error)
    }
}

/// What is wrong with a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Damage {
    /// The file ends within it.
    Truncated,
    /// Its checksum is wrong.
    Checksum,
    /// Its content is not valid.
    Content,
}
