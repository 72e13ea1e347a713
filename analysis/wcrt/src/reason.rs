//! Why something is not analysed, or has no response time: names and figures. The messages are in `mauve-diagnostics`.

#![allow(missing_docs, reason = "the documentation of an item says what its fields are")]

pub use mauve_syntax::keywords::ActivityField;
use mauve_timing::{CpuSet, Level, MachineError, NoBoundReason, ObservedErrorKind, TableErrorKind, Time};

use mauve_hir::fact;
use mauve_hir::item_tree::Name;
use mauve_hir::ros2_files::FileProblemKind;
use mauve_hir::{Decl, File, Location, MistakeKind, ModelDb, ProgramId, Project};

/// The maximal number of errors that are named as reasons; the diagnostics have all errors.
pub(crate) const MOST_REASONS: usize = 8;

/// Why something is not analysed, or has no response time, and the location of the reason; none in an exported file.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Refusal<'db> {
    pub reason: Reason<'db>,
    pub at: Option<Location<'db>>,
}

impl<'db> Refusal<'db> {
    pub(crate) fn new(reason: Reason<'db>, at: Location<'db>) -> Refusal<'db> {
        Refusal { reason, at: Some(at) }
    }

    /// Returns the refusal for an error in the model.
    pub(crate) fn of_model(fact::ModelRefusal { reason, at }: &fact::ModelRefusal<'db>) -> Refusal<'db> {
        Refusal::new(Reason::Model(reason.clone()), at.clone())
    }
}

/// A reason.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Reason<'db> {
    /// The model has an error, or refers to something incomplete.
    Model(fact::ModelReason<'db>),
    /// This architecture or deployment has that error.
    ErrorIn(Decl<'db>, fact::ModelReason<'db>),
    /// An exported file states it in these words.
    Stated(String),

    /// A deployment has a syntax error: an activity may be missing in it.
    DamagedDeployment(Decl<'db>),
    /// Two deployments of one library have this name.
    DeclaredTwice(Decl<'db>),
    /// The architecture of a deployment is unknown.
    NoArchitecture(Decl<'db>),
    /// An architecture imports itself.
    ImportsItself(Decl<'db>),
    /// A file cannot be read for this problem, or has a syntax error: a declaration may be missing.
    DamagedFile { file: File, problem: Option<String> },
    /// The timing tables are incomplete: every time may be longer.
    IncompleteTables(IncompleteTable),

    /// An activity names an instance that the architecture does not have.
    NoSuchInstance { architecture: Decl<'db>, instance: Name },
    /// An instance has two activities.
    SecondActivity(Name),
    /// An instance has no activity.
    NoActivity,
    /// The instance of an activity is unknown.
    UnknownInstance,
    /// Several instances have the name of this one.
    SeveralInstances,
    /// The shell of a component is unknown in this project.
    UnknownShell { project: Project<'db>, component: Decl<'db> },
    /// The core of a component is unknown in this project.
    UnknownCore { project: Project<'db>, component: Decl<'db> },
    /// The component of an instance is unknown in this project.
    UnknownComponent { project: Project<'db>, instance: Name },
    /// An activity has a syntax error.
    DamagedActivity,
    /// An activity has a field that no activity has: it may be a misspelt one.
    UnknownField(Name),
    /// The activity of this instance has a field twice.
    SecondField { field: ActivityField, instance: Name },
    /// An activity lacks a field.
    NoField(ActivityField),
    /// The value of a field has a syntax error.
    DamagedField(ActivityField),
    /// The value of a field cannot be used.
    UnusableField(ActivityField),
    /// An affinity names a CPU that `mauve.toml` does not have.
    NoSuchCpu(NoSuchCpu),
    /// The calls of operations that an activity executes are not known, or have no bound.
    Calls(CallsReason),
    /// An activity provides operations, and the connections are unknown.
    MayServe,
    /// A lock delays an activity for an unknown time.
    Lock(LockReason),

    /// A declaration has a syntax error.
    Damaged(Decl<'db>),
    /// The core of a component is for another shell.
    CoreOfOtherShell(Decl<'db>),
    /// A feature of a shell of this project may be missing.
    IncompleteShell { project: Project<'db>, shell: Decl<'db> },
    /// No table has a time for a codel.
    NoTime(Decl<'db>),
    /// No table has a time for this key of a topic.
    NoTopicTime(String),
    /// Threads of the middleware of the gateway to ROS 2, whose time is unknown, have a higher priority on one of its CPUs.
    Middleware(u32),
    /// The thread of an activity in a file of `[platform] threads`, or one that may delay it.
    Thread(ThreadReason),
    /// The number of the CPUs of a host is unknown, or there are too many.
    CpusOfHost(Name),
    /// No host has its instance.
    NoHost,
    /// Its host does not have a CPU that it names.
    NoCpuOfHost,
    /// The instances of its activity are on several hosts.
    SeveralHosts,
    /// The entry of a time in a table cannot be used.
    Table(UnusableTime<'db>),
    /// The entry of the time of a component, which the classic method needs, cannot be used.
    ComponentTime(UnusableTime<'db>),
    /// The overhead has no time at a level, for which this table has none.
    NoOverhead { level: Level, table: TableLevels },
    /// A time exceeds the maximal representable time.
    TooLong(TooLong),
    /// The states and edges of a component do not form a state machine.
    NoMachine(MachineError),

    /// Activities that may delay this one are not analysed: the index of the first, and the instances, each once. With
    /// their unknown property if they seem to have a lower priority.
    DelayedBy { first: usize, instances: Vec<Name>, unknown_priority: Option<UnknownPriority> },
    /// This CPU is overloaded by the activities of this priority or a higher one: their utilisation.
    Overloaded { cpu: CpuSet, named: Name, priority: u32, utilisation: Share },
    /// The search for a bound ended without one.
    NoBound(NoBoundReason),
}

impl Reason<'_> {
    /// Returns whether a diagnostic of its own reports the reason.
    pub(crate) fn is_reported(&self) -> bool {
        match self {
            Reason::Lock(why) => {
                matches!(why, LockReason::UnknownCodel { .. } | LockReason::Undeclared { .. })
            }
            Reason::Thread(why) => matches!(why, ThreadReason::NoActivity { .. }),
            Reason::NoTopicTime(_) | Reason::Middleware(_) => false,
            Reason::CpusOfHost(_) | Reason::SeveralHosts => false,
            Reason::ComponentTime(_) | Reason::NoMachine(_) | Reason::Calls(_) | Reason::TooLong(_) => false,
            _ => true,
        }
    }
}

/// Why the calls of operations that an activity executes are not known, or have no bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CallsReason {
    /// The client is not analysed.
    NotAnalysed { operation: Name, client: Name },
    /// The client is in the background or has no period: it may send any number of calls.
    ClientWithoutPeriod { operation: Name, client: Name },
    /// Their number depends on response times without a bound: that of the client, or its own.
    NoResponse { operation: Name, client: Name },
    /// Data releases the provider: any number of calls may wait for that.
    ReleasedByData { operation: Name, client: Name },
    /// An operation sends calls, over others or directly, that execute it again.
    Ring(Name),
    /// Operations that send calls to others: too many chains of calls.
    ManyChains,
}

/// Why a lock delays an activity for an unknown time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LockReason {
    /// An unknown codel takes the lock: it may be any.
    UnknownCodel { lock: Name, codel: String },
    /// The activity executes a codel that takes two locks, in an unknown order: it may wait for one that it holds the other for.
    TwoLocks { codel: String, locks: [Name; 2] },
    /// The activity executes a codel that takes two locks. While Linux throttles, this activity in the background may take one of them.
    TakenWhileThrottled { codel: String, locks: [Name; 2], by: Name },
    /// The activity executes a codel that waits while it holds the lock.
    WaitsWithLock { codel: String, lock: Name },
    /// This activity of lower priority, `holder`, holds the lock for an unknown time. The `holder` may wait for a lock of
    /// `because`; `None` where its own time is unknown.
    UnknownTime { lock: Name, holder: Name, because: Option<Name> },
    /// The users of the lock run on several CPUs.
    SeveralCpus { lock: Name },
    /// The activity may move to the CPU of the lock while an activity of lower priority holds it.
    Migrates { lock: Name },
    /// The activity executes a codel that takes the lock, as a recording showed, and no section declares that.
    Undeclared { codel: String, lock: Name },
    /// The lock has no protocol, and these activities preempt the holder; any process does if the holder is in the background.
    Inversion { lock: Name, holder: Name, between: Vec<Name> },
    /// This activity waits an unknown number of times, and meanwhile a lower priority may take the lock.
    UnknownWaits { lock: Name, waiting: Name },
    /// The jobs of this activity of lower priority are not preempted, and for how long, or how often, they delay the activity is unknown.
    NotPreempted { holder: Name },
}

/// A share of a CPU, for a message: the analysis itself compares exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share(pub f64);

/// A share is computed, and never NaN.
impl Eq for Share {}

/// The CPUs that an affinity names, and those that `mauve.toml` has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoSuchCpu {
    pub named: CpuSet,
    pub available: CpuSet,
}

/// The times that can exceed 2⁶⁴ ns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TooLong {
    /// Dispatch and context switches.
    Overhead,
    /// An edge, at this program.
    Edge(ProgramId),
    /// A program.
    Program,
}

/// The reason why the written priority of an activity, or of several, counts as unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UnknownPriority {
    /// Its instance has two activities.
    TwoActivities,
    /// Several instances have its name.
    SeveralInstances,
    /// It has no period: the priority may be a mistyped period.
    PriorityAsPeriod,
    /// The affinity may be a mistyped priority.
    AffinityAsPriority,
    /// Its affinity names no CPU, and may be a mistyped priority.
    NoSuchCpu,
    /// Its host is not known, or the CPUs of that are not.
    NoHost,
    /// One activity has no valid priority.
    One,
    /// Several activities have no valid priority.
    Several,
    /// Several activities have no valid priority or CPU.
    SeveralOrCpus,
}

/// The subject of an entry of a timing table.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Timed<'db> {
    /// A codel.
    Codel(Decl<'db>),
    /// A program of a component, by the key behind `Component/`.
    Program(Decl<'db>, ProgramId),
    /// All programs of a component, for the classic method.
    Component(Decl<'db>),
    /// A wait of a codel.
    Wait(Decl<'db>),
    /// A read or a write of a port of a component.
    Access(Decl<'db>, Name),
    /// A sample that the gateway to ROS 2 moves, at `INSTANCE.PORT`.
    Topic(Name),
}

/// What the keys of the times of topics begin with.
pub const PREFIX_OF_TOPICS: &str = "ros2.";

impl Timed<'_> {
    /// Returns its key in a timing table.
    pub fn key(&self, db: &dyn ModelDb) -> String {
        match self {
            Timed::Codel(of) | Timed::Component(of) | Timed::Wait(of) => of.qualified(db),
            Timed::Access(component, port) => format!("{}.{port}", component.qualified(db)),
            Timed::Topic(topic) => format!("{PREFIX_OF_TOPICS}{topic}"),
            Timed::Program(component, program) => format!("{}/{program}", component.qualified(db)),
        }
    }
}

/// Why the entry of a time cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum UnusableTime<'db> {
    /// It has no entry, and that of an unknown key may be its own.
    Stray(StrayEntry, Timed<'db>),
    /// The key of an entry that may be its own is ambiguous.
    AmbiguousKey(StrayEntry),
    /// An entry for a program that the component does not have may be that of any of its programs.
    WrongProgram(StrayEntry, WrongProgram<'db>),
    /// Two entries are for it, in these tables.
    TwoTimes(Timed<'db>, [File; 2]),
    /// A recording showed this time, which is longer than that of its entry.
    Refuted(Timed<'db>, Time),
    /// Its entry in this table has an error.
    Damaged(Timed<'db>, File),
    /// It has no time at a level.
    OtherLevels(Timed<'db>, Level, TableLevels),
}

/// An entry of a table whose key is unknown or ambiguous.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct StrayEntry {
    pub key: String,
    pub table: File,
}

/// The key of a program, after `Component/`, that the component does not have or, if `is_repeated`, has several times.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct WrongProgram<'db> {
    pub component: Decl<'db>,
    pub program: ProgramId,
    pub is_repeated: bool,
}

/// A table in which some time depends on the level, and its levels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableLevels {
    pub table: File,
    pub levels: Vec<Level>,
}

/// Why the timing tables are incomplete: the error of a table, or of `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IncompleteTable {
    pub file: File,
    pub error: TableFault,
}

/// Why the files of `[platform] threads` do not say with which priority an activity is executed, or what delays it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ThreadReason {
    /// This thread, or this timer of it, may delay it, and no activity says what it executes.
    NoActivity { id: Name, timer: Option<Name>, file: File },
    /// Its policy is `SCHED_DEADLINE`.
    Deadline,
    /// Its policy is `SCHED_RR`, and another thread has this priority.
    SharedRoundRobin(u32),
    /// Two threads have its id.
    Repeated,
}

/// An error that leaves every time unknown. It has no location: a comment in a table changes no time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TableFault {
    /// The configuration has this error.
    Configuration(MistakeKind),
    /// A section of the configuration names the tables of a deployment that does not exist.
    UnknownDeployment(String),
    /// A section of the configuration names the tables of several deployments.
    AmbiguousDeployment(String),
    /// The configuration names missing tables.
    Files(TableFilesError),
    /// The table cannot be read, for this reason.
    Unreadable(String),
    /// The table has this error.
    Invalid(TableErrorKind),
    /// The file of threads has this error.
    Threads(FileProblemKind),
    /// The file of threads counts on a throttling of real-time threads that is not analysed.
    Throttling,
    /// This table already has the overhead.
    SecondOverhead(File),
    /// This key is not that of a program.
    NoProgramKey(String),
    /// That table already has this key.
    Repeated(String, File),
    /// The number of unknown keys exceeds the limit.
    ManyUnknownKeys(usize),
    /// This key is one of `[overhead]`, whose header is missing.
    OfOverhead(String),
    /// The file of `[timing] observed` has this error.
    Observed(ObservedErrorKind),
}

/// An error in a list of tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TableFilesError {
    /// This pattern is invalid.
    Pattern(String, PatternError),
    /// There is no file of this name.
    NoSuchFile(String),
    /// A table cannot be read.
    Unreadable(String),
    /// A folder cannot be read.
    NotAllKnown(String),
}

/// The reason why a text is not a pattern of tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PatternError {
    /// It has alternatives.
    Choice,
    /// It is longer than a path.
    TooLong,
    /// It has this error.
    Invalid(String),
}

/// Returns the message of a reason, for exported files.
pub type Prose = for<'db> fn(&'db dyn ModelDb, &Reason<'db>) -> String;
