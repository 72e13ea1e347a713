//! What a recording showed, beside what the model expects.

use mauve_timing::CpuSet;
use std::collections::BTreeMap;

use super::{EdgeCount, UnknownPath};

/// A greatest value, and when it was observed. Times are in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Greatest {
    /// The value.
    pub time: u64,
    /// The time of the end of the span.
    pub at: Option<u64>,
}

impl Greatest {
    /// Takes a value if it is greater.
    pub(super) fn raise(greatest: &mut Option<Greatest>, time: u64, at: Option<u64>) {
        if greatest.is_none_or(|greatest| greatest.time < time) {
            *greatest = Some(Greatest { time, at });
        }
    }
}

/// What another activity executed in a response time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interferer {
    /// The instance.
    pub instance: String,
    /// The number of its periods, and their execution time.
    pub jobs: u64,
    /// See `jobs`.
    pub execution: u64,
    /// The same in the bound; 0 if it does not count this instance.
    pub bound_jobs: u64,
    /// See `bound_jobs`.
    pub bound: u64,
}

/// Whether the codels of an instance waited.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Waited {
    /// The recording does not say it.
    #[default]
    Unknown,
    /// No codel did, or none longer than the tables say.
    Never,
    /// This codel waited longest: for so long.
    Codel(String, u64),
}

/// Something that the model and the recording do not agree on.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceFinding {
    /// The index of the instance in the deployment.
    pub instance: Option<usize>,
    /// What it is.
    pub kind: FindingKind,
    /// When it was first observed.
    pub at: Option<u64>,
    /// How often: periods, or executions.
    pub count: u64,
}

impl TraceFinding {
    /// Returns a finding about no instance.
    pub(super) fn of_all(kind: FindingKind, at: Option<u64>, count: u64) -> TraceFinding {
        TraceFinding { instance: None, kind, at, count }
    }
}

/// See [`TraceFinding`]. Times are in nanoseconds.
#[derive(Debug, Clone, PartialEq)]
pub enum FindingKind {
    /// The recording does not have the instance.
    NotObserved,
    /// No execution of the deployment was observed, so that nothing was compared.
    NothingObserved,
    /// A clock ran backwards at `count` executions.
    Clock,
    /// The priority of the thread; 0 without the real-time scheduler.
    Priority {
        /// That of the model; 0 in the background.
        expected: u32,
        /// That of the recording.
        observed: u32,
    },
    /// The CPUs that the thread may use.
    Cpus {
        /// Those of the model.
        expected: CpuSet,
        /// Those of the recording.
        observed: CpuSet,
    },
    /// Periods began on other CPUs.
    OtherCpu {
        /// Those of the model.
        expected: CpuSet,
        /// Those others.
        observed: CpuSet,
    },
    /// The instance executes the programs of another component.
    Component {
        /// That of the model.
        expected: String,
        /// That of the recording.
        observed: String,
    },
    /// The programs of a period are those of no edge.
    Path(UnknownPath),
    /// The component has no such program.
    UnknownProgram {
        /// Its key in a timing table.
        key: String,
    },
    /// The component does not call the codel.
    UnknownCodel {
        /// Its name.
        key: String,
        /// Whether another component of the deployment calls it.
        is_known: bool,
    },
    /// The deployment has no such instance.
    UnknownInstance {
        /// Its name.
        instance: String,
    },
    /// Executions exceeded a time of the tables more often than its level promises; `count` of them.
    ExecutionTime {
        /// The codel or program.
        key: String,
        /// The time.
        time: u64,
        /// Its level.
        level: f64,
        /// The number of all executions.
        executions: u64,
        /// The number that exceed it on average, if the time holds.
        expected: f64,
        /// The longest execution.
        greatest: u64,
    },
    /// Periods executed longer than the greatest edge, more often than the level promises.
    Execution {
        /// The greatest edge.
        own: u64,
        /// The longest execution.
        greatest: u64,
        /// The port of the instance that took longest, and for how long.
        port: Option<(String, u64)>,
    },
    /// A codel waited for something, longer than the tables say; in `count` of its executions.
    Wait {
        /// The codel.
        key: String,
        /// The wait in the tables.
        wait: Option<u64>,
        /// The number of all executions.
        executions: u64,
        /// The greatest time that nothing in the recording explains.
        greatest: u64,
    },
    /// The response time exceeds the bound, or, without a bound, the deadline.
    Response {
        /// R.
        bound: Option<u64>,
        /// D.
        deadline: Option<u64>,
        /// The greatest response time.
        response: u64,
        /// The execution time of this job.
        execution: u64,
        /// The greatest edge.
        own: Option<u64>,
        /// The others that executed, those first that exceed the bound most.
        interference: Vec<Interferer>,
        /// Whether a codel of the instance waited.
        waited: Waited,
    },
    /// The latency of a chain exceeds its bound, or, without a bound, its limit; `count` times.
    Chain {
        /// Its index in [`ExpectedDeployment::chains`](super::ExpectedDeployment::chains).
        chain: usize,
        /// The greatest latency that was observed.
        latency: u64,
        /// The bound or the limit.
        bound: u64,
    },
    /// Periods are missing; `count` of them.
    Skipped,
    /// So many periods have no place in time that the others say little; `count` of them.
    Untimed {
        /// The number of all periods.
        periods: u64,
    },
    /// Data released it before the end of a gap; `count` times.
    Gap {
        /// T.
        expected: u64,
        /// The number of releases that T may have.
        burst: u64,
        /// The least time that had one more.
        observed: u64,
    },
    /// The periods do not begin as often as the period says.
    Period {
        /// That of the model.
        expected: u64,
        /// The mean time between two begins.
        observed: u64,
    },
}

/// The periods with one scheduling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeenPeriods {
    /// Their number.
    pub periods: u64,
    /// The begin of the first.
    pub first: Option<u64>,
}

/// What was observed of an activity. Times are in nanoseconds.
#[derive(Debug, Clone, Default)]
pub struct ObservedInstance {
    /// Whether the recording has its name.
    pub is_observed: bool,
    /// The number of its periods.
    pub periods: u64,
    /// How many of them have no place in time.
    pub untimed: u64,
    /// The mean time from begin to begin.
    pub interval: Option<u64>,
    /// The greatest response time: a lower bound, where the recording does not have releases.
    pub response: Option<Greatest>,
    /// The greatest difference of the delays from release to begin.
    pub jitter: Option<u64>,
    /// The greatest execution time of a period.
    pub execution: Option<Greatest>,
    /// The greatest execution time of a period without that of its codels and its accesses to ports; none where the recording does
    /// not have them, or was slowed down by a tracer.
    pub overhead: Option<u64>,
    /// Times without periods, after which the instance was at work again, and the end of the first.
    pub pauses: u64,
    /// See `pauses`.
    pub first_pause: Option<u64>,
    /// The priorities of its thread.
    pub priorities: BTreeMap<u32, SeenPeriods>,
    /// The CPUs that its thread might use, a bit each.
    pub masks: BTreeMap<CpuSet, SeenPeriods>,
    /// The CPUs on which periods began.
    pub cpus: BTreeMap<u32, SeenPeriods>,
    /// How often each edge of its state machine was observed; empty if the recording does not have its programs.
    pub edges: Vec<EdgeCount>,
    /// The codels of its component without an execution.
    pub codels_not_observed: Vec<String>,
}

/// What was observed of a codel, or of a program or a port with a time of its own, in all instances.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObservedTime {
    /// Its key in a timing table.
    pub key: String,
    /// The time in the tables.
    pub time: Option<u64>,
    /// The number of executions.
    pub executions: u64,
    /// How many of them exceeded the time.
    pub exceeded: u64,
    /// How probable so many are, if each exceeds with the probability of the level.
    pub probability: f64,
    /// The level at which the executions contradict the tables most.
    pub worst: Option<Worst>,
    /// The greatest execution time; none without an execution.
    pub greatest: Option<Greatest>,
    /// The instance with the greatest execution time.
    pub instance: String,
}

/// The executions of a codel or program at one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// The level.
    pub level: f64,
    /// The time of that level.
    pub time: u64,
    /// How many executions exceeded it.
    pub exceeded: u64,
    /// How probable so many are, times the number of levels that are compared.
    pub probability: f64,
}

/// What was observed of a chain.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ObservedChain {
    /// The greatest latency, and the end of its effect.
    pub greatest: Option<Greatest>,
    /// How often a latency exceeded the bound, or without one the limit.
    pub late: u64,
    /// For each step, the most releases from a read to the write that carried it, at least: see [`ExpectedStep::releases`](super::ExpectedStep::releases).
    pub releases: Vec<u32>,
}

/// What was observed on a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ObservedConnection {
    /// The number of values that were written.
    pub written: u64,
    /// The number of values that were read.
    pub read: u64,
    /// The number of values that were overwritten unread, or dropped from a full buffer, between the first read and the last one.
    pub unread: u64,
}

/// A recording beside a model.
#[derive(Debug, Clone, Default)]
pub struct ObservedDeployment {
    /// In the order of [`ExpectedDeployment::instances`](super::ExpectedDeployment::instances).
    pub instances: Vec<ObservedInstance>,
    /// Sorted by key.
    pub times: Vec<ObservedTime>,
    /// In the order of [`ExpectedDeployment::chains`](super::ExpectedDeployment::chains).
    pub chains: Vec<ObservedChain>,
    /// In the order of [`ExpectedDeployment::connections`](super::ExpectedDeployment::connections).
    pub connections: Vec<ObservedConnection>,
    /// By instance, then those of none.
    pub findings: Vec<TraceFinding>,
    /// Whether the recording has periods, and the releases of all of them.
    pub has_periods: bool,
    /// See `has_periods`.
    pub has_releases: bool,
    /// Whether it has programs.
    pub has_programs: bool,
    /// Whether it has priorities and CPUs of threads.
    pub has_scheduling: bool,
    /// Whether it names instances.
    pub has_instances: bool,
    /// The CPU time that threads which are not instances used in a second, by name.
    pub work: BTreeMap<String, u64>,
}
