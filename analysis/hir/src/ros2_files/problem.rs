//! What is wrong in a file of ROS 2, as facts with their places.

use std::ops::Range;

/// A fact about a file of ROS 2 that its user should know.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct FileProblem {
    /// The kind of the problem.
    pub kind: FileProblemKind,
    /// Its place, in bytes.
    pub range: Range<usize>,
}

/// What is wrong in a file of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum FileProblemKind {
    /// The text is not YAML: the message of the parser. The text behind it is not read.
    Syntax(String),
    /// The file has too many values, or they are nested too deep. The text behind it is not read.
    TooLarge,
    /// A second document: readers disagree whether it counts.
    SecondDocument,
    /// A character that only some readers take for the end of a line, such as a carriage return without a line feed.
    UncertainLines,
    /// A mapping has a key twice: readers disagree on which one counts.
    RepeatedKey(String),
    /// A merge key (`<<`), an alias or a collection as a key: readers disagree on the keys of the mapping.
    UncertainKeys,
    /// An alias in a file of parameters: its reader refuses the file.
    Alias,
    /// A mapping, or a list, is a value of another kind.
    WrongKind {
        /// The key, or the name of the list.
        key: String,
        /// Its expected value.
        expected: ExpectedValue,
    },
    /// A required key is missing.
    MissingKey(&'static str),
    /// An unknown key: its reader ignores it.
    UnknownKey(String),
    /// A section of settings that are not read here, such as those of kernel threads.
    UnreadSection(&'static str),
    /// Another entry has the same id, or the same name.
    RepeatedId(String),
    /// The id is not one that an executor generates: no callback group has it.
    UnusualId(String),
    /// A thread has both a `name` and an `id`: each version of the reader knows one of them.
    NameAndId,
    /// The nice value is in `priority`: newer versions of the reader want it in `nice`.
    NiceInPriority,
    /// Linux refuses the parameters of `SCHED_DEADLINE`: they must be 1024 ≤ runtime ≤ deadline ≤ period.
    InvalidDeadline,
    /// The priority is in `thread_priority` and not in `async_parameters.thread_priority`: newer versions ignore it.
    DeprecatedPriority,
    /// `params_file`: the parameters in that file are unknown.
    ParametersElsewhere,
}

/// A kind of values.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum ExpectedValue {
    /// A mapping.
    Mapping,
    /// A list.
    List,
    /// A text that is not empty.
    Text,
    /// `true` or `false`.
    Bool,
    /// An integer in this range, in decimal digits without leading zeros: versions of readers disagree on others.
    Integer(i64, i64),
    /// A list of CPUs, from 0 to 127.
    Cpus,
    /// One of these words.
    OneOf(&'static [&'static str]),
}

impl FileProblemKind {
    /// Returns whether the reader of the file may refuse the file, or read other values than those that are read here.
    pub fn is_error(&self) -> bool {
        !matches!(
            self,
            FileProblemKind::UnknownKey(_)
                | FileProblemKind::UnreadSection(_)
                | FileProblemKind::UnusualId(_)
                | FileProblemKind::NiceInPriority
                | FileProblemKind::DeprecatedPriority
        )
    }
}
