use std::ops::Range;

use toml::de::DeValue;

use crate::{Level, Time, TimeError, Unit};

/// An error in a table. `mauve-diagnostics` has the message.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct TableError {
    /// Where, in bytes.
    pub span: Range<usize>,
    /// What is wrong.
    pub kind: TableErrorKind,
}

/// The kinds of errors in a table.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum TableErrorKind {
    /// The text is not TOML: the error of the parser.
    NotToml(String),
    /// A region that git has marked because it could not merge the texts of these names.
    Conflict([String; 2]),
    /// A section or a key at the top has an unknown name.
    UnknownKey(String),
    /// A number stands at the top, before the header of its section.
    NoSection(String),
    /// A section has a value of another kind.
    NotASection { name: String, found: TomlKind },
    /// The unit is not a string.
    UnitOfKind(TomlKind),
    /// The unit has an unknown name.
    UnknownUnit(String),
    /// The levels are not an array.
    LevelsOfKind(TomlKind),
    /// There are so many levels, more than [`MOST_LEVELS`](crate::MOST_LEVELS).
    TooManyLevels(usize),
    /// The array repeats this level.
    RepeatedLevel(Level),
    /// An item of the array is not a probability between 0 and 1.
    NotALevel,
    /// A key of `[overhead]` has an unknown name.
    UnknownOverhead(String),
    /// A record of `[measured]` has a key with an unknown name.
    UnknownMeasured(String),
    /// A record of `[measured]` lacks this key.
    MissingMeasured(&'static str),
    /// This record of `[measured]`, or its value of this key, has a value of another kind.
    MeasuredOfKind { key: String, found: TomlKind },
    /// The overhead falls from a level to a rarer one.
    FallingOverhead,
    /// The time of an entry falls from a level to a rarer one; with the two times.
    FallingTime { key: String, before: (Time, Level), after: (Time, Level) },
    /// The times of all entries fall from a level to a rarer one.
    AllFalling,
    /// Two entries have this key.
    RepeatedKey(String),
    /// The number of waits of an entry is not a whole number greater than 0.
    NoNumberOfWaits,
    /// An entry is an empty table.
    NoTime(String),
    /// This key, `unit` or `levels`, is in a section, where it is the key of an entry.
    BelowSection(String),
    /// An entry has so many times, and the table has no levels.
    NoLevels { times: usize },
    /// An entry has another number of times than the table has levels.
    OtherCount { times: usize, levels: usize },
    /// A time is a string with a unit, such as `"5 ms"`.
    TimeWithUnit { text: String, unit: Unit },
    /// A time has another kind than a number.
    TimeOfKind { found: TomlKind, unit: Unit },
    /// This number is not a time.
    InvalidTime { text: String, unit: Unit, error: TimeError },
}

/// The kinds of values in TOML; an integer and a float are both a number.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[allow(missing_docs, reason = "the names are those of TOML")]
pub enum TomlKind {
    String,
    Number,
    Boolean,
    Datetime,
    Array,
    Table,
}

impl TomlKind {
    pub(crate) fn of(value: &DeValue) -> TomlKind {
        match value {
            DeValue::String(_) => TomlKind::String,
            DeValue::Integer(_) | DeValue::Float(_) => TomlKind::Number,
            DeValue::Boolean(_) => TomlKind::Boolean,
            DeValue::Datetime(_) => TomlKind::Datetime,
            DeValue::Array(_) => TomlKind::Array,
            DeValue::Table(_) => TomlKind::Table,
        }
    }
}
