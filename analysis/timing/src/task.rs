//! What the analysis is asked, and what it answers: tasks and options, response times and where they come from.

use std::fmt;

use crate::{StateMachine, Time, Utilisation};

/// A periodic task.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Task {
    /// For those who read the result; the analysis does not look at it.
    pub name: String,
    /// Greater is more urgent.
    pub priority: u32,
    /// T, the time between two releases; greater than 0.
    pub period: Time,
    /// D, counted from the release. The bounds do not depend on it.
    pub deadline: Time,
    /// The CPUs on which the task may run: bit n for CPU n; not 0.
    pub cpus: u64,
    /// What a job executes.
    pub demand: Demand,
}

/// What the jobs of a task execute.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Demand {
    /// One edge of a state machine for each job.
    Machine {
        /// The machine.
        machine: StateMachine,
        /// A declared time of any one job, for [`Method::Classic`] only: that uses the greater of it and the greatest
        /// edge.
        whole: Option<Time>,
    },
    /// An execution time is missing: this task, and what it may delay, is not analysed.
    Unknown,
}

impl Demand {
    pub(crate) fn own(&self, method: Method) -> Option<Time> {
        match (self, method) {
            (Demand::Unknown, _) => None,
            (Demand::Machine { machine, .. }, Method::Psm) => Some(machine.greatest_cost()),
            (Demand::Machine { machine, whole }, Method::Classic) => {
                Some(machine.greatest_cost().max(whole.unwrap_or_default()))
            }
        }
    }
}

impl Task {
    /// The CPU of a task that can be analysed: its demand is known, and it has one CPU.
    pub(crate) fn known(&self) -> Option<u32> {
        let is_known =
            self.demand != Demand::Unknown && self.cpus.is_power_of_two() && self.period > Time::ZERO;
        is_known.then(|| self.cpus.trailing_zeros())
    }
}

/// How the demand of several jobs is bounded.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Method {
    /// R⁻ of the paper: n jobs ask for n times the greatest one.
    Classic,
    /// R⁺ of the paper: n jobs ask for what a path of n edges costs at most. Never above `Classic`.
    Psm,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Method::Classic => "classic",
            Method::Psm => "psm",
        })
    }
}

/// How to analyse.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Options {
    /// How the demand of several jobs is bounded.
    pub method: Method,
    /// Unsafe, for comparison with the paper only: in [`Response::first_job`], interfering tasks execute nothing after
    /// the jobs of this time, Mⱼ(min(n, ⌈H/Tⱼ⌉)). [`Response::bound`] does not depend on it.
    pub horizon: Option<Time>,
    /// Uses a smaller budget: more tasks end as [`Bound::NoBound`]. For searches that analyse many variants.
    pub is_brief: bool,
}

/// The result of [`response_times`](crate::response_times).
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Analysis {
    /// One for each task, in the order of the tasks.
    pub responses: Vec<Response>,
    /// The CPUs of the tasks of known demand, ascending.
    pub cpus: Vec<CpuLoad>,
}

/// How much the tasks of a CPU ask of it in the long run.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct CpuLoad {
    /// The number of the CPU: of its bit in [`Task::cpus`].
    pub cpu: u32,
    /// Σ λ/T over its tasks of known demand.
    pub utilisation: Utilisation,
    /// Whether these are all; otherwise a task of unknown demand may run there, and `utilisation` is a lower bound.
    pub complete: bool,
}

impl CpuLoad {
    /// Returns the bit of the CPU in [`Task::cpus`].
    pub fn mask(&self) -> u64 {
        1 << self.cpu
    }
}

/// The response time of one task, and where it comes from.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Response {
    /// The greatest cost of one job, M(1), where the demand is known.
    pub own: Option<Time>,
    /// The end of the first job of a window that starts with the release of all tasks (paper, eq. 20, not stopped at
    /// the deadline). It is a response time only while it is within the period. `None` where it does not exist
    /// (exactly: where the tasks of hp(i) alone ask for the whole CPU), and where it was not found.
    pub first_job: Option<Time>,
    /// The response time.
    pub bound: Bound,
    /// What each task of hp(i) executes in the window that gives the response time; where there is no response time, in
    /// that of `first_job`; where there is none of these either, nothing. In the order of the tasks.
    pub interference: Vec<Interference>,
    /// The window that gives the response time, where there is one.
    pub window: Option<Window>,
}

impl Response {
    /// Whether the `deadline` (from the release) is kept. A response time equal to it is in time.
    pub fn status(&self, deadline: Time) -> Status {
        match self.bound {
            Bound::Response(time) if time <= deadline => Status::Met,
            Bound::Response(_) => Status::Missed,
            Bound::Unbounded { .. } => Status::Unbounded,
            Bound::NoBound(_) => Status::NoBound,
            Bound::NotAnalysed { .. } => Status::NotAnalysed,
        }
    }
}

/// A bound of the response time, or why there is none.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Bound {
    /// No job takes longer from its release to its end.
    Response(Time),
    /// The task and those of hp(i) ask for more than the whole of this CPU: work may pile up for ever.
    Unbounded {
        /// The number of the CPU.
        cpu: u32,
    },
    /// None was found. There may be one.
    NoBound(NoBoundReason),
    /// The demand of tasks that may delay this one is unknown.
    NotAnalysed {
        /// The tasks of unknown demand that are at least as urgent and may run on the same CPU; the task itself, where
        /// its own demand is unknown. Ascending.
        because: Vec<usize>,
    },
}

/// Why no bound was found.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum NoBoundReason {
    /// The counted budget was used up.
    Budget,
    /// A time exceeds 2⁶⁴ ns.
    Overflow,
    /// The task and those of hp(i) ask for exactly the whole CPU, and no end of the window was found.
    FullyLoaded,
}

/// Whether a deadline is kept.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Status {
    /// Every job ends at its deadline or before.
    Met,
    /// The bound is later than the deadline.
    Missed,
    /// See [`Bound::Unbounded`].
    Unbounded,
    /// See [`Bound::NoBound`].
    NoBound,
    /// See [`Bound::NotAnalysed`].
    NotAnalysed,
}

impl Status {
    /// `met`, `missed`, `unbounded`, `no-bound` or `not-analysed`.
    pub fn name(self) -> &'static str {
        match self {
            Status::Met => "met",
            Status::Missed => "missed",
            Status::Unbounded => "unbounded",
            Status::NoBound => "no-bound",
            Status::NotAnalysed => "not-analysed",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What one task of hp(i) executes in a window.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Interference {
    /// The index of the task.
    pub task: usize,
    /// How many jobs it releases in the window.
    pub jobs: u64,
    /// Their demand, M(jobs).
    pub time: Time,
}

/// Where a response time comes from: it is `length` − (`job` − 1) × period.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Window {
    /// q, the job of the window that responds last; from 1.
    pub job: u64,
    /// The demand of the q own jobs, M(q).
    pub own: Time,
    /// f(q), from the start of the window to the end of job q.
    pub length: Time,
    /// Where the response time is later than the task's deadline: the successive values of the fixed-point iteration
    /// for `length`, from M(q) (paper, eq. 19–20); the last 32 at most. Otherwise empty.
    pub iterations: Vec<Time>,
}
