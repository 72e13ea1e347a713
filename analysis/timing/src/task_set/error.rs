use crate::{Level, MachineError};

/// Why a file is not a valid task set. `mauve-diagnostics` has the message.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum TaskSetError {
    /// The text is not JSON, or not what is expected there: the error of the parser.
    Json(String),
    /// There is no `format`.
    NoFormat,
    /// The format is this one.
    OtherFormat(String),
    /// The unit is this one.
    OtherUnit(String),
    /// There is neither a deployment nor a component, or both.
    NoContent,
    /// The digest is not that of the content.
    OtherDigest,
    /// This text contains a control character.
    ControlCharacter(String),
    /// There are so many levels, more than [`MOST_LEVELS`](crate::MOST_LEVELS).
    TooManyLevels(usize),
    /// There are no levels.
    NoLevels,
    /// This level is there twice.
    RepeatedLevel(Level),
    /// A reason is for this level, which is not one of the levels.
    ReasonForOtherLevel(Level),
    /// There is no CPU.
    NoCpu,
    /// There are so many activities, more than [`MOST_ACTIVITIES`](super::MOST_ACTIVITIES).
    TooManyActivities(usize),
    /// There are so many operations, more than [`MOST_OPERATIONS`](super::MOST_OPERATIONS).
    TooManyOperations(usize),
    /// Two activities have this name.
    RepeatedActivity(String),
    /// The activity of this name has an error.
    OfActivity(String, Box<TaskSetError>),
    /// Other work of this name has an error.
    OfOther(String, Box<TaskSetError>),
    /// Two entries of other work have this name.
    RepeatedOther(String),
    /// The operation of this name has an error.
    OfOperation(String, Box<TaskSetError>),
    /// No activity has this name.
    NoActivity(String),
    /// The operation of this number is not an earlier one that the client executes.
    NoOperation(usize),
    /// This is no priority.
    NoPriority(u32),
    /// A period or a deadline is 0.
    NoPeriod,
    /// The deadline is later than the period.
    LateDeadline,
    /// The offset is not less than the period.
    LateOffset,
    /// An activity in the background has a state machine.
    BackgroundMachine,
    /// Something is unknown at this level, and no reason is given.
    NoReason(Unknown, Level),
    /// Two states have one name.
    RepeatedState,
    /// The initial state, which has this name, is not one of the states.
    NoInitialState(String),
    /// Two programs have one name.
    RepeatedProgram,
    /// An edge starts or ends at a state that is not there.
    NoState { edge: usize, state: String },
    /// An edge executes a program that is not there.
    NoProgram { edge: usize, program: String },
    /// The `first` of a state has a program that is not there.
    NoProgramOfState { state: String, program: String },
    /// The `first` of this edge exceeds the number of programs in that of its source.
    MoreFirst(usize),
    /// This edge has no cost.
    NoCost(usize),
    /// This edge costs less than what it executes.
    LowCost(usize),
    /// The edges make no state machine.
    Machine(MachineError),
    /// There are so many times for so many levels.
    OtherCount { of: Times, times: usize, levels: usize },
    /// The times fall from a level to a rarer one.
    FallingTimes(Times),
    /// There is a time where the overhead has none, or none where it has one; with that level.
    OtherLevels(Times, Option<Level>),
}

/// What must be known of an activity.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub enum Unknown {
    Times,
    Priority,
    PeriodOrDeadline,
    Cpu,
}

/// What has a time for each level.
#[derive(Clone, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub enum Times {
    Overhead,
    ComponentTime,
    Operation,
    /// The program of this name.
    Program(String),
    /// The edge of this number.
    Edge(usize),
}
