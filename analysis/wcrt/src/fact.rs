//! Facts about errors in a deployment, its priorities, its timing tables and its response times: names, figures and
//! locations. The messages, severities and fixes are in `mauve-diagnostics`.

#![allow(missing_docs, reason = "the documentation of an item says what its fields are")]

use mauve_timing::{CpuSet, Level, TableSection, Time};

use crate::reason::{ActivityField, NoSuchCpu, Refusal, Share, TableFault, TableLevels, Timed, WrongProgram};
use crate::table_set::TableSet;
use mauve_hir::fact::FactKind;
use mauve_hir::item_tree::{Kind, Name, SourceId};
use mauve_hir::ros2_files::FileProblemKind;
use mauve_hir::{Decl, File, InvalidValue, Location};

/// A fact, with its location.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct TimingFact<'db> {
    pub at: Location<'db>,
    pub kind: TimingFactKind<'db>,
}

impl<'db> TimingFact<'db> {
    pub(crate) fn new(at: Location<'db>, kind: TimingFactKind<'db>) -> TimingFact<'db> {
        TimingFact { at, kind }
    }
}

/// What has changed since times were measured.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum ChangedOrigin {
    /// The sample files, as the table names them: runs were added or removed.
    Samples(Vec<String>),
    /// The source of the codel, as the table names it.
    Source(String),
}

/// The kind of a fact. Each variant belongs to one code.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum TimingFactKind<'db> {
    /// A deployment has no `architecture`.
    NoTarget,
    /// A deployment has a second `architecture`.
    SecondTarget,
    /// A name is unresolved: the architecture of a deployment, or the instance of an activity.
    Unresolved(FactKind<'db>),
    /// An instance has two activities, or is in a list twice; or two activities have this name.
    DuplicateActivity { instance: Name, first: Location<'db>, in_list: bool },
    /// An instance has no activity.
    MissingActivity { of: Decl<'db>, instance: Name },
    /// An activity has a field twice.
    DuplicateField { of: Decl<'db>, id: SourceId, field: ActivityField, instance: Name, first: Location<'db> },
    /// No activity has a field of this name. With the field of a similar name, if the activity does not have it yet.
    UnknownField { name: Name, near: Option<ActivityField> },
    /// An activity has no priority. With a free priority on its CPU, and the location of its period.
    MissingPriority { of: Decl<'db>, activity: (Name, SourceId), free: u32, period: Option<SourceId> },
    /// An activity has no period. With the location of the value of its priority.
    MissingPeriod { of: Decl<'db>, activity: (Name, SourceId), priority: Option<SourceId>, has_trigger: bool },
    /// An activity has a field beside another one that excludes it. With the location of its name.
    ConflictingFields {
        of: Decl<'db>,
        id: SourceId,
        field: ActivityField,
        other: ActivityField,
        first: Location<'db>,
    },
    /// An activity has a field without the other one that it belongs to. With the location of its name.
    FieldWithoutOther { of: Decl<'db>, id: SourceId, field: ActivityField },
    /// The readers of a file of threads ignore what is there, or disagree on it.
    ThreadFile(FileProblemKind),
    /// No activity of a deployment has a thread, or this timer of it, or the codel of a controller in it.
    ThreadWithoutActivity { of: Decl<'db>, id: Name, timer: Option<Name>, has_priority: bool },
    /// The first activity in the thread of an activity has another value of a field.
    OtherInThread { thread: Name, field: ActivityField, first: Location<'db> },
    /// A field has an invalid value.
    InvalidField(ActivityField, InvalidValue),
    /// A background activity has a field that has an effect on real-time activities only. With the location of the field's name.
    BackgroundField { of: Decl<'db>, id: SourceId, field: ActivityField, instance: Name },
    /// An activity has an offset, and its clock is not synchronised: this instance is not, otherwise its period is not a whole
    /// number of nanoseconds. With the location of the field's name.
    NotSynchronised { of: Decl<'db>, id: SourceId, activity: Name, instance: Option<Name> },
    /// An affinity names a CPU that does not exist.
    NoSuchCpu(NoSuchCpu),
    /// A deadline is later than the period. With the period as written, and its location.
    DeadlineExceedsPeriod { deadline: Time, period: Time, written: Name, period_at: Location<'db> },
    /// Several activities have one priority on one CPU: this one, and the others with the locations of their priorities.
    EqualPriorities { instance: Name, priority: u32, others: Vec<(Name, Location<'db>)> },
    /// The priority of an activity is out of order: another one on its CPU has a longer deadline and a higher priority, or a
    /// shorter deadline and a lower priority. With a free priority that puts it in order.
    NotDeadlineMonotonic {
        activity: DeadlineAndPriority,
        other: DeadlineAndPriority,
        other_at: Location<'db>,
        free: Option<u32>,
    },
    /// A component runs before another one of the same period that writes its input.
    StaleData { reader: Name, writer: Name, port: Name, writer_at: Location<'db> },
    /// Data at this port releases an activity, and nobody writes it; with the output that is connected to it.
    NeverTriggered { instance: Name, port: Name, writer: Option<(Name, Name)> },
    /// Data at this port releases an activity, whose core never reads it.
    TriggerNotRead { instance: Name, port: Name },

    /// A table has an error.
    InvalidTable(TableFault),
    /// A table repeats a time.
    RepeatedTime { key: String, first: Location<'db> },
    /// A key is unknown. With a similar name, and the full key that can replace it.
    UnknownTimingKey { kind: Kind, key: String, near: Option<Name>, fixed: Option<String> },
    /// Several keys name a library that no model declares. With a similar library that has all of the names, and the
    /// locations of the library's name in the keys.
    UnknownTimingLibrary { library: Name, keys: usize, near: Option<Name>, written: Vec<Location<'db>> },
    /// A key belongs to another section.
    WrongTableSection { key: String, section: TableSection },
    /// A component does not have a program, or has several with this key.
    UnknownProgram { program: WrongProgram<'db>, near: Option<Name>, fixed: Option<String> },
    /// A component does not have a port of this name. With a similar name, and the full key that can replace it.
    UnknownTimedPort { component: Decl<'db>, port: Name, near: Option<Name>, fixed: Option<String> },
    /// A key begins with `ros2.`, and no deployment has a topic of this name, `INSTANCE.PORT`. With a similar one, the full key that
    /// can replace it, and all topics.
    UnknownTopic { topic: Name, near: Option<Name>, fixed: Option<String>, known: Vec<Name> },
    /// A lock of `mauve.toml`, or without one `[timing] dependent`, names a codel that no model declares. With a similar key.
    UnknownConfiguredCodel { lock: Option<Name>, codel: String, near: Option<Name> },
    /// A key is ambiguous. With the first definition.
    AmbiguousTimingKey { key: String, first: Decl<'db> },

    /// A recording contradicts the tables or `mauve.toml`.
    Recorded(Recorded<'db>),
    /// Activities of a deployment read or write these ports, whose values are large or of variable size, and no table has a time for
    /// that.
    UnmeasuredAccess { ports: Vec<String> },
    /// The times of a key are older than what they were measured from.
    OutdatedMeasurement { key: String, changed: ChangedOrigin },
    /// A measurement has warnings, in words.
    DoubtfulMeasurement { key: String, warnings: Vec<String> },

    /// The tables of a deployment have no level that is rare enough for `required`.
    LackingLevel { deployment: Decl<'db>, lacking: LackingLevel },
    /// A table has no times at the level of the report.
    NoTimesAtLevel(Level, TableLevels),
    /// No codel has a time in these tables: the number of codels without one, and the other deployments that execute some of
    /// them.
    NoTimes { tables: TableSet<'db>, codels: usize, others: Vec<Decl<'db>> },
    /// A codel has no time. With its possible time.
    MissingTime(MissingTime<'db>, Option<Budget<'db>>),
    /// A CPU is overloaded: the response times of some of its activities are unbounded.
    Overloaded(Overload<'db>),
    /// Real-time work may take all time of the CPUs of a background activity.
    StarvedBackground { instance: Name, cpus: Name },
    /// A deadline is not proved.
    DeadlineMissed { instance: Name, deadline: Time, missed: Missed<'db> },
    /// An activity is not analysed for reasons that no other fact reports.
    NotAnalysed { instance: Name, reasons: Vec<Refusal<'db>> },
}

/// The tables have no level that is rare enough for `required`.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct LackingLevel {
    /// A level that is, a power of ten.
    pub needed: Level,
    /// The number of executions in the mission whose times depend on the level.
    pub executions: u64,
    /// A table without such a level.
    pub table: TableLevels,
}

/// What a recording showed that contradicts the tables or `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Recorded<'db> {
    /// A recording showed a longer time than an entry has, or than none.
    RefutedTime { of: Timed<'db>, observed: Time, written: Time, file: File },
    /// A recording showed that a codel waited, longer than its entry says. Whether it is known that it waited, and was not
    /// preempted by what the recording does not have.
    WaitingCodel { codel: String, wait: Time, written: Option<Time>, is_known: bool, file: File },
    /// A recording showed that a codel waited, for no longer than [`mauve_timing::LEAST_WAIT`], and no table has its wait.
    BriefWait { codel: String, wait: Time, executions: u64, file: File },
    /// A recording showed that a codel waited more often than its entry says.
    WaitsOften { codel: String, times: u64, written: u64, file: File },
    /// A recording showed that a codel takes a lock, and no section of `mauve.toml` declares that, or for a shorter time.
    UndeclaredLock { lock: String, codel: String, held: Time, declared: Option<Time> },
    /// A recording showed CPU time of threads that are not instances, in each second.
    WorkElsewhere { thread: String, per_second: Time },
}

/// The instance of an activity, its priority and its deadline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeadlineAndPriority {
    pub instance: Name,
    pub priority: u32,
    pub deadline: Time,
}

/// An overloaded CPU, with the activity that contributes most. Its location is that of this activity if it alone overloads the CPU,
/// otherwise that of the activity without a bound that has the highest priority.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Overload<'db> {
    /// The CPU, as its bit, and its name.
    pub cpu: CpuSet,
    pub named: Name,
    /// The highest priority of an activity without a bound, and the utilisation by all of this priority or a higher one.
    pub priority: u32,
    pub utilisation: Share,
    /// The activity with the greatest utilisation among those.
    pub greatest: Name,
    pub share: Option<Share>,
    /// If that activity alone overloads the CPU: the greatest time of one of its jobs, and its period.
    pub alone: Option<(Time, Time)>,
    /// The entry of a timing table with the greatest time of that activity.
    pub table: Option<Location<'db>>,
    /// The activities without a bound.
    pub unbounded: Vec<Unbounded<'db>>,
}

/// An activity without a bound on an overloaded CPU.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Unbounded<'db> {
    pub instance: Name,
    pub at: Location<'db>,
    /// The greatest time of one of its jobs and its deadline, where that time alone exceeds the deadline: without the overload,
    /// the activity misses it too.
    pub alone: Option<(Time, Time)>,
}

/// The reason why a deadline is not proved.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Missed<'db> {
    /// The execution time of the activity alone exceeds it, with the time that its codels wait, which is a part of `own`.
    Alone { own: Time, wait: Time },
    /// The response time exceeds it. With the greatest interference, the time for which lower priorities hold locks, and, if a
    /// later job of a busy window has the latest response, the number and the end of that job.
    Late { response: Time, heaviest: Option<InterferenceReport>, blocking: Time, window: Option<(u64, Time)> },
    /// The response time is unknown or unbounded.
    NoBound(Vec<Refusal<'db>>),
}

/// The interference of one activity in another one's window: the number of jobs released there, and their demand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InterferenceReport {
    pub instance: Name,
    pub jobs: u64,
    pub time: Time,
}

/// The possible time of a codel without one: the greatest time with which a brief analysis proves every deadline of the
/// deployment if the other codels without a time take 0. A large deployment may get none.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Budget<'db> {
    pub codel: Decl<'db>,
    /// The longest time with which it misses no deadline. `None` if an activity that executes it misses its deadline even with 0.
    pub time: Option<Time>,
    /// Whether other deadlines are missed with any time of it.
    pub further: bool,
    /// Whether no other codel lacks a time: otherwise the time is only an upper limit.
    pub alone: bool,
}

/// A codel without a time, whether a table has one at other levels, and the activities that execute the codel, by their
/// instances.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct MissingTime<'db> {
    pub tables: TableSet<'db>,
    pub codel: Decl<'db>,
    pub at_other_levels: bool,
    pub users: Vec<(Name, Location<'db>)>,
}
