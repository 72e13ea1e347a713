use crate::{Level, MachineError, TimeError, Unit};

/// Why a file is not a valid task set. `mauve-diagnostics` has the message.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum TaskSetError {
    /// The text is not in its notation, a key is unknown, or a value is of another kind: the error of the parser.
    Syntax { message: String, line: usize },
    /// The file is of this format, which earlier versions wrote.
    EarlierFormat(String),
    /// No line of a table has the names of its columns.
    NoHeader,
    /// A table has the names of its columns, in this line, and no task.
    NoTasks { line: usize },
    /// A line of a table has more cells than the header, or two of one name.
    WrongColumns { line: usize },
    /// An entry of this section and of this name has an error.
    Of { section: &'static str, name: String, error: Box<TaskSetError> },
    /// The entry of this number in a section has no name.
    NoName { section: &'static str, number: usize },
    /// There are no times at this level, which is not one of those.
    NoLevel { level: Level, levels: Vec<Level> },
    /// There are more of these than allowed.
    TooMany { what: &'static str, count: usize, most: usize },
    /// Two of these have one name.
    Repeated(&'static str, String),
    /// This text contains a control character.
    ControlCharacter(String),
    /// This key is missing, or its time at this level, and no reason is given.
    Missing { key: &'static str, level: Level },
    /// There are a time and a state machine.
    TimeAndMachine,
    /// The value of this key is not a time.
    InvalidTime { key: &'static str, text: String, unit: Unit, error: TimeError },
    /// The value of this key is a fraction of more than 15 digits.
    ManyDigits(&'static str),
    /// The value of this key is not greater than 0.
    Zero(&'static str),
    /// The value of this key is not a whole number, or less than this.
    NoCount { key: &'static str, text: String, least: u32 },
    /// The task has this key, which only a periodic one may have.
    NotPeriodic(&'static str),
    /// The value of this key is not that of the first task in the same thread.
    OtherInThread { key: &'static str, thread: String },
    /// The offset is not less than the period.
    LateOffset,
    /// This is no priority.
    NoPriority(String),
    /// This is not the number of a CPU.
    NoCpu(String),
    /// There are so many times for so many levels.
    OtherCount { key: &'static str, times: usize, levels: usize },
    /// The times fall from a level to a rarer one.
    FallingTimes(&'static str),
    /// A reason is for this level, which is not one of the levels.
    ReasonForOtherLevel(Level),
    /// No edge of the machine begins at this state.
    NoState(String),
    /// The edges make no state machine.
    Machine(MachineError),
    /// No task has this name.
    NoTask(String),
    /// The operation of this number is not an earlier one that the client executes.
    NoOperation(usize),
}

impl TaskSetError {
    /// The same as an error of an entry.
    pub(super) fn of(self, section: &'static str, name: &str) -> TaskSetError {
        TaskSetError::Of { section, name: name.to_owned(), error: Box::new(self) }
    }
}
