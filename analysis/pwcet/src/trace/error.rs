//! Why a trace cannot be read.

use std::path::{Path, PathBuf};

use super::column::{Column, FileKind};

/// Why a trace cannot be read.
#[derive(Debug)]
pub enum TraceError {
    /// A file cannot be read.
    Io {
        /// Its path.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The trace cannot be read further.
    Reading(std::io::Error),
    /// A folder has neither executions nor metadata of LTTng.
    NotATrace,
    /// A file of executions is not complete.
    Unfinished(PathBuf),
    /// No chunk of a session is complete.
    Recording,
    /// The program `babeltrace2` is not installed.
    NoBabeltrace,
    /// `babeltrace2` failed, with these last messages.
    Babeltrace(String),
    /// `babeltrace2` has printed a line that is not an event.
    Malformed {
        /// The number of the line, from 1.
        line: u64,
        /// Its beginning.
        text: String,
    },
    /// A line is longer than 64 KiB.
    LongLine(u64),
    /// Events have no thread: the session lacks the context `vtid`.
    NoThread,
    /// The trace has no event of a generated package, but others.
    NoEvents {
        /// How many others.
        foreign: u64,
    },
    /// More names than can be of one robot.
    TooManyNames,
    /// A file of executions or of periods has an error.
    Csv {
        /// Which of both.
        file: FileKind,
        /// The number of the line, from 1.
        line: u64,
        /// The error.
        problem: CsvProblem,
    },
    /// A [`Visitor`](super::Visitor) has ended the reading.
    Stopped,
}

impl TraceError {
    pub(super) fn io(path: &Path, error: std::io::Error) -> TraceError {
        TraceError::Io { path: path.to_owned(), error }
    }
}

/// An error in a line of a file of executions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CsvProblem {
    /// A line has another number of fields than the header: a value with a comma would be another value.
    Fields {
        /// That of the header.
        expected: usize,
        /// That of the line.
        found: usize,
    },
    /// A period has a time that is later than its end.
    AfterEnd(Column),
    /// The file is empty.
    NoHeader,
    /// The file is compressed with gzip.
    Compressed,
    /// The file is in UTF-16.
    Utf16,
    /// Lines end in a carriage return only.
    CarriageReturns,
    /// Fields are separated by another character than a comma.
    Separator(char),
    /// The header lacks a column.
    MissingColumn(Column),
    /// The header has a column twice.
    RepeatedColumn(Column),
    /// A line lacks a value.
    Missing(Column),
    /// A value is not a time in nanoseconds.
    Number(Column, String),
    /// A quote is missing.
    Quotes,
    /// A name is not UTF-8.
    NotUtf8,
}
