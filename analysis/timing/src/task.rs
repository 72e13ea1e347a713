//! The input and the result of the analysis: tasks and options, response times and their breakdown.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::arrivals::rate;
use crate::{Arrivals, CpuSet, CycleMean, Edge, MachineError, StateMachine, Time, Utilisation};

/// The priority of a task. A greater one is a higher priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Priority {
    /// Not real-time.
    Background,
    /// A real-time priority, 1 to 99; a greater number is a higher priority.
    RealTime(u32),
    /// Missing or unusable: analysed as the highest priority.
    #[default]
    Unknown,
}

impl Priority {
    /// Returns the number of a real-time priority.
    pub fn real_time(self) -> Option<u32> {
        if let Priority::RealTime(priority) = self { Some(priority) } else { None }
    }
}

/// In which order a thread executes the jobs of several tasks.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// A job of each in each period, in the order of the tasks, which are released together.
    #[default]
    List,
    /// Those that are released first: a queue. Its tasks have releases of their own.
    Fifo,
    /// Any order in which the thread never idles while a job is released. Its tasks have releases of their own.
    Any,
    /// In rounds: one job of each that has a released job, of periodic tasks first, otherwise in any order; then again. Its tasks have
    /// releases of their own.
    Rounds,
}

/// A periodic task: an activity of a deployment, or what delays the activities. What is unknown is analysed as the worst case.
#[derive(Clone, PartialEq, Eq, Hash, Debug, Default)]
pub struct Task {
    /// A name for readers of the result; the analysis ignores it.
    pub name: Arc<str>,
    /// Its priority.
    pub priority: Priority,
    /// T, the time between two releases.
    pub period: Option<Time>,
    /// D, counted from the release. The bounds do not depend on it.
    pub deadline: Option<Time>,
    /// J, the greatest delay of a release after its nominal instant; a response time counts from the nominal instant.
    pub jitter: Time,
    /// The greatest number of releases in any half-open window of length T; 0 counts as 1. With more than one, the task is
    /// sporadic, and its nominal instants are its releases without jitter.
    pub burst: u64,
    /// Whether T is the least distance of releases, not the exact one: data or an interrupt releases the task.
    pub is_sporadic: bool,
    /// The thread that executes its jobs, if it executes those of other tasks too: the tasks of the same number. No job of them
    /// preempts another. They have one priority and set of CPUs, and with [`Order::List`] one period, jitter and offset.
    pub thread: Option<u32>,
    /// The order of the jobs in the thread.
    pub order: Order,
    /// Whether a job that has begun has the highest priority of all activities until its end. The task runs on one CPU, and does not
    /// wait.
    pub is_not_preempted: bool,
    /// The part of the demand of such a job that it executes before it has begun: the wake-up of its thread.
    pub wake_up: Time,
    /// The nominal instant of a release modulo T, on the clock of number [`clock`](Self::clock); `None` if its phase is unknown.
    pub offset: Option<Time>,
    /// How often data releases it, where that is known from its writers: T and b hold all the same.
    /// [`Tasks::response_times`](crate::Tasks::response_times) computes it.
    pub arrivals: Option<Arc<Arrivals>>,
    /// The number of the clock that the offset counts on: only tasks of one number share a clock.
    pub clock: u32,
    /// The CPUs on which the task may run; `None` if unknown.
    pub cpus: Option<CpuSet>,
    /// The demand of its jobs. [`Demand::Unknown`] if any other property of the task is unusable.
    pub demand: Demand,
    /// What of the demand its jobs wait for, off the CPU; `None` if they do not wait.
    pub waits: Option<Arc<Waits>>,
    /// B, the time for which jobs of lower priority that hold a lock delay its jobs, once in a window and once more for each wait
    /// in it. [`Tasks::response_times`](crate::Tasks::response_times) computes it.
    pub blocking: Time,
    /// The part of B by jobs in the background: once more each time that Linux throttles real-time tasks.
    pub background_blocking: Time,
    /// Whether it stands for real-time throttling: meanwhile, jobs in the background execute, and may take locks.
    pub is_throttling: bool,
    /// Whether the demand contains calls of operations, which it may execute between two of its jobs.
    /// [`Tasks::response_times`](crate::Tasks::response_times) computes it.
    pub has_calls: bool,
}

/// The waits of a task: the time that its jobs spend off the CPU by their own will, for a device, for other threads, or asleep.
///
/// The [`Demand`] contains the waits: a job that waits delays tasks of lower priority no longer than one that executes instead.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Waits {
    /// The machine without the waits: the same states and edges, each with the time that it executes.
    pub executed: StateMachine,
    /// How often a job waits, at most; `None` if that is unknown.
    pub times: Option<u64>,
}

/// The demand of the jobs of a task.
#[derive(Clone, PartialEq, Eq, Hash, Debug, Default)]
pub enum Demand {
    /// Each job executes one edge of a state machine.
    Machine {
        /// The machine.
        machine: StateMachine,
        /// A declared execution time of each job, for [`Method::Classic`] only, which uses the maximum of it and the
        /// greatest edge.
        whole: Option<Time>,
    },
    /// An execution time is unknown: this task, and the tasks that it may delay, are not analysed.
    #[default]
    Unknown,
}

impl Demand {
    /// Returns the state machine, if the demand is known.
    pub fn machine(&self) -> Option<&StateMachine> {
        match self {
            Demand::Machine { machine, .. } => Some(machine),
            Demand::Unknown => None,
        }
    }

    /// Returns the declared execution time of each job.
    pub(crate) fn whole(&self) -> Option<Time> {
        if let Demand::Machine { whole, .. } = self { *whole } else { None }
    }

    pub(crate) fn own(&self, method: Method) -> Option<Time> {
        match (self, method) {
            (Demand::Unknown, _) => None,
            (Demand::Machine { machine, .. }, Method::Psm | Method::Ibf | Method::Exact | Method::Best) => {
                Some(machine.greatest_cost())
            }
            (Demand::Machine { machine, whole }, Method::Classic) => {
                Some(machine.greatest_cost().max(whole.unwrap_or_default()))
            }
        }
    }
}

impl Waits {
    /// Returns the demand of jobs that execute an edge of a machine and wait for a time of each edge, in their order, with their
    /// waits. `whole` is a declared execution time of each job.
    ///
    /// # Errors
    ///
    /// The times are too long for a machine.
    pub fn with_demand(
        executed: StateMachine,
        of_edges: &[Time],
        times: Option<u64>,
        whole: Option<Time>,
    ) -> Result<(Demand, Option<Arc<Waits>>), MachineError> {
        if of_edges.iter().all(|wait| *wait == Time::ZERO) {
            return Ok((Demand::Machine { machine: executed, whole }, None));
        }
        let with_wait = |(edge, wait): (&Edge, &Time)| {
            let cost = edge.cost.checked_add(*wait).ok_or(MachineError::TooLarge)?;
            Ok(Edge { cost, ..edge.clone() })
        };
        let edges: Result<Vec<Edge>, MachineError> =
            executed.edges().iter().zip(of_edges).map(with_wait).collect();
        let machine = StateMachine::new(executed.states(), edges?)?;
        let waits = Waits { executed, times };
        let whole = match whole {
            Some(whole) => Some(whole.checked_add(waits.greatest(&machine)).ok_or(MachineError::TooLarge)?),
            None => None,
        };
        Ok((Demand::Machine { machine, whole }, Some(Arc::new(waits))))
    }

    /// Returns the greatest time that a job waits: that of an edge of `machine`, the demand with the waits.
    pub fn greatest(&self, machine: &StateMachine) -> Time {
        let edges = machine.edges().iter().zip(self.executed.edges());
        let waits = edges.filter_map(|(with, without)| with.cost.checked_sub(without.cost));
        waits.max().unwrap_or_default()
    }
}

impl Task {
    /// Returns a task that executes `machine` on CPU 0, with its period as its deadline.
    ///
    /// ```
    /// use mauve_timing::*;
    ///
    /// let machine = StateMachine::single(Time::from_nanos(4));
    /// let laser = Task { name: "laser".into(), ..Task::new(2, Time::from_nanos(10), machine) };
    /// assert_eq!((laser.cpus, laser.deadline), (Some(CpuSet::of(0)), laser.period));
    /// ```
    pub fn new(priority: u32, period: Time, machine: StateMachine) -> Task {
        Task {
            priority: Priority::RealTime(priority),
            period: Some(period),
            deadline: Some(period),
            cpus: Some(CpuSet::of(0)),
            demand: Demand::Machine { machine, whole: None },
            ..Task::default()
        }
    }

    /// Returns the greatest execution time of one job, if the demand is known.
    pub fn greatest_cost(&self) -> Option<Time> {
        self.demand.machine().map(StateMachine::greatest_cost)
    }

    /// Returns how long a job of the greatest demand waits.
    pub fn wait(&self) -> Time {
        let (Some(machine), Some(waits)) = (self.demand.machine(), &self.waits) else { return Time::ZERO };
        let greatest = machine.greatest_edge();
        let cost = |machine: &StateMachine| machine.edges().get(greatest).map(|edge| edge.cost);
        let wait =
            cost(machine).zip(cost(&waits.executed)).and_then(|(with, without)| with.checked_sub(without));
        wait.unwrap_or_default()
    }

    /// Returns b, the greatest number of releases in a window of length T.
    pub fn burst(&self) -> u64 {
        self.burst.max(1)
    }

    /// Returns the nominal instant of its releases modulo T, if it is known: not if data or an interrupt releases it.
    pub(crate) fn instant(&self) -> Option<Time> {
        self.offset.filter(|_| self.is_periodic())
    }

    /// Whether one thread executes the jobs of both.
    pub fn shares_thread(&self, other: &Task) -> bool {
        self.is_mate(other) || self.is_queued_with(other)
    }

    /// Whether one thread executes the jobs of both in the order of their releases, or in any.
    pub fn is_queued_with(&self, other: &Task) -> bool {
        let is_of_thread = self.thread.is_some() && self.thread == other.thread;
        is_of_thread && self.order != Order::List && other.order != Order::List
    }

    /// Whether one thread executes a job of both in each period. Of tasks that the thread would not release together, it is not known.
    pub fn is_mate(&self, other: &Task) -> bool {
        let is_periodic = self.is_periodic() && other.is_periodic();
        let is_released_together = (self.period, self.jitter, self.offset, self.clock)
            == (other.period, other.jitter, other.offset, other.clock);
        let is_scheduled_alike = self.priority == other.priority && self.cpus == other.cpus;
        let is_list = self.order == Order::List && other.order == Order::List;
        let is_of_thread = self.thread.is_some() && self.thread == other.thread && is_list;
        is_of_thread && is_periodic && is_released_together && is_scheduled_alike
    }

    /// Returns the earliest nominal release of a job of a window, from 1, counted from that of the first one; `None` if it does not
    /// fit, or without a period.
    pub fn release_of(&self, job: u64) -> Option<Time> {
        let by_data = self.arrivals.as_ref().map(|it| Time::from_nanos(it.release_of(job)));
        Some(by_data.unwrap_or_default().max(self.release_by_distance(job)?))
    }

    /// The same, whatever data releases it.
    pub(crate) fn release_by_distance(&self, job: u64) -> Option<Time> {
        self.period?.checked_mul(job.saturating_sub(1) / self.burst())
    }

    /// Returns the long-run mean of jobs, from that of one job, and the time in which it counts. What does not fit is at least the whole
    /// CPU.
    pub(crate) fn mean_of_jobs(&self, mean: CycleMean) -> Option<(CycleMean, Time)> {
        let (jobs, length) = rate(self.period?.as_nanos(), self.burst(), self.arrivals.as_deref());
        let mean = match mean.cost.checked_mul(jobs) {
            Some(cost) => CycleMean { cost, ..mean },
            None => CycleMean { cost: Time::from_nanos(u64::MAX), length: 1 },
        };
        Some((mean, Time::from_nanos(length)))
    }

    /// Returns what its jobs execute: their demand without waits.
    pub fn executed(&self) -> Option<&StateMachine> {
        self.waits.as_ref().map(|waits| &waits.executed).or(self.demand.machine())
    }

    /// The same, if it also waits in calls that it executes for others, an unknown number of times. The time of a call counts as
    /// execution.
    pub fn waiting_in_calls(self) -> Task {
        let Some(executed) = self.executed().cloned() else { return self };
        Task { waits: Some(Arc::new(Waits { executed, times: None })), ..self }
    }

    /// Whether a clock releases it, each T after the one before. Otherwise T is the least distance only: it may never be released
    /// again.
    pub fn is_periodic(&self) -> bool {
        !self.is_sporadic && self.burst <= 1
    }

    /// Returns the CPUs on which it competes with real-time tasks: all if they are unknown, none in the background.
    pub(crate) fn cpus(&self) -> CpuSet {
        if self.priority == Priority::Background { CpuSet::NONE } else { self.cpus.unwrap_or(CpuSet::ALL) }
    }

    /// Whether the task can be analysed.
    pub(crate) fn is_known(&self) -> bool {
        self.demand != Demand::Unknown && !self.cpus().is_empty() && self.period > Some(Time::ZERO)
    }

    /// Whether it is a real-time task that cannot be analysed.
    pub(crate) fn is_unknown(&self) -> bool {
        self.priority != Priority::Background && !self.is_known()
    }
}

/// How the demand of several jobs is bounded.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// R⁻ of the paper: the demand of n jobs is n times the greatest one.
    Classic,
    /// R⁺ of the paper: the demand of n jobs is the maximum cost of a path of n edges. Never greater than with
    /// `Classic`.
    Psm,
    /// As `Psm`, but the last job of an interfering task contributes no more than the time since its release (Guan et al.,
    /// RTSS 2014). Never greater than with `Psm`.
    Ibf,
    /// The greatest response over all combinations of paths of the interfering machines (Stigge & Yi, 2015). Never greater than
    /// with `Ibf`; where its budget is exhausted, the bound so far.
    Exact,
    /// The best of these for each task that a small budget allows, which all tasks share: fast enough for every keystroke.
    /// With few tasks it is `Exact`, with very many `Psm`.
    Best,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Method::Classic => "classic",
            Method::Psm => "psm",
            Method::Ibf => "ibf",
            Method::Exact => "exact",
            Method::Best => "best",
        })
    }
}

/// The options of the analysis.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Options {
    /// How the demand of several jobs is bounded.
    pub method: Method,
    /// Uses a smaller budget: more tasks end as [`Bound::NoBound`]. For searches that analyse many variants.
    pub is_brief: bool,
}

/// The tasks that are counted in a response time.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum CpuRule {
    /// Those of higher or equal priority that may run on this CPU, of those on which the task may run the one with the least
    /// response time. For tasks on one CPU each, this is the usual rule.
    Cpu(u32),
    /// Those of higher or equal priority that share these CPUs, as if they were one: where tasks have different
    /// sets of several CPUs, Linux may let one wait while a CPU of its set runs a task of lower priority.
    Linked(CpuSet),
    /// Those of higher or equal priority that may run on one of these CPUs, all of which the task may use: it waits only while
    /// each of the CPUs executes one of them. For tasks with one set of several CPUs.
    Global(CpuSet),
}

impl CpuRule {
    /// Returns the CPUs; none for a task without a CPU.
    pub fn cpus(self) -> CpuSet {
        match self {
            CpuRule::Cpu(cpu) => CpuSet::of(cpu),
            CpuRule::Linked(cpus) | CpuRule::Global(cpus) => cpus,
        }
    }
}

/// The result of [`response_times`](crate::response_times).
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Analysis {
    /// One for each task, in the order of the tasks.
    pub responses: Vec<Response>,
    /// The CPUs of the tasks of known demand, ascending.
    pub cpus: Vec<CpuLoad>,
}

/// The utilisation of a CPU, or of several CPUs together that tasks may use alternatively.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct CpuLoad {
    /// The CPUs.
    pub cpus: CpuSet,
    /// Σ λ/T over their tasks of known demand, without waits; it may be up to the number of CPUs.
    pub utilisation: Utilisation,
    /// Whether all tasks are included; otherwise a task of unknown demand may run there, and `utilisation` is a lower
    /// bound.
    pub complete: bool,
}

/// The response time of one task. [`Breakdown`](crate::Breakdown) lists the interference in it.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Response {
    /// The greatest execution time of one job, M(1), if the demand is known.
    pub own: Option<Time>,
    /// The end of the first job of a window that starts with the release of all tasks (paper, eq. 20, not stopped at
    /// the deadline). It is a response time only while it is within the period. `None` if it does not exist (exactly:
    /// if the utilisation of hp(i) alone is at least 1), was not found, or the bound is one of [`CpuRule::Global`].
    pub first_job: Option<Time>,
    /// The response time.
    pub bound: Bound,
    /// The window of the response time, if there is one.
    pub window: Option<Window>,
    /// The method that gives the bound: the best of those up to [`Options::method`] that its budget allows.
    pub method: Method,
    /// Whether the budget of a better method was exhausted.
    pub is_exhausted: bool,
    /// The tasks that are counted.
    pub rule: CpuRule,
}

impl Response {
    /// Returns whether the `deadline` (from the release) is met. A response time equal to it meets it.
    pub fn status(&self, deadline: Option<Time>) -> Status {
        match self.bound {
            Bound::Response(time) if Some(time) <= deadline => Status::Met,
            Bound::Response(_) => Status::Missed,
            Bound::Unbounded { .. } => Status::Unbounded,
            Bound::NoBound(_) => Status::NoBound,
            Bound::NotAnalysed { .. } => Status::NotAnalysed,
            Bound::Background => Status::Background,
        }
    }
}

/// A bound on the response time, or the reason why there is none.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Bound {
    /// No job takes longer from its release to its end.
    Response(Time),
    /// This CPU is overloaded by the task and hp(i): the backlog may grow without bound.
    Unbounded {
        /// The number of the CPU.
        cpu: u32,
    },
    /// No bound was found, although one may exist.
    NoBound(NoBoundReason),
    /// The demand of the task, or of tasks that may delay it, is unknown.
    NotAnalysed {
        /// The tasks of unknown demand that may delay it, and the task itself if its demand is unknown. Ascending.
        because: Vec<usize>,
    },
    /// The task is in the background.
    Background,
}

/// Why no bound was found.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum NoBoundReason {
    /// The budget of steps is exhausted.
    Budget,
    /// A time exceeds 2⁶⁴ ns.
    Overflow,
    /// The utilisation by the task and hp(i) is exactly 1, and no end of the window was found.
    FullyLoaded,
    /// The utilisation by the task and those that may run on each of its CPUs is greater than 1, but some of them may
    /// run elsewhere.
    SeveralCpus,
    /// The utilisation by the task and hp(i) is greater than 1 if waits are counted as execution.
    Waits,
}

/// Whether a deadline is met.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
    /// The task is in the background, where nothing is to be proved.
    #[default]
    Background,
}

impl Status {
    /// `met`, `missed`, `unbounded`, `no-bound`, `not-analysed` or `background`.
    pub fn name(self) -> &'static str {
        match self {
            Status::Met => "met",
            Status::Missed => "missed",
            Status::Unbounded => "unbounded",
            Status::NoBound => "no-bound",
            Status::NotAnalysed => "not-analysed",
            Status::Background => "background",
        }
    }

    /// Returns whether the deadline is proved, or there is none to prove.
    pub fn is_met(self) -> bool {
        matches!(self, Status::Met | Status::Background)
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The interference of one task of hp(i) in a window.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Interference {
    /// The index of the task.
    pub task: usize,
    /// The number of jobs that it releases in the window.
    pub jobs: u64,
    /// Their demand, M(jobs).
    pub time: Time,
}

/// The part of a window whose releases count as interference.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum Counted {
    /// All of it.
    #[default]
    Whole,
    /// Of the tasks in the thread of the task, up to the release of the job, at this instant of the window: a queue.
    UntilRelease(Time),
    /// All of it, but of each other task in the thread of the task one job more than of the task, at most: rounds. It begins with a release of
    /// the task, and `late` has the response times of all that may be unfinished then.
    Rounds,
    /// Of the activities, up to the begin of the job, at this instant of the window: it is not preempted.
    UntilBegin(Time),
}

/// The window of a response time, which is `length` − `delay` − (`job` − 1) × period + jitter; with a queue, `length` + jitter − the
/// release.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Window {
    /// How the interference in it is counted: the simplest method that gives the length.
    pub method: Method,
    /// q, the job of the window with the greatest response time; from 1.
    pub job: u64,
    /// The demand of the q own jobs, M(q).
    pub own: Time,
    /// f(q), from the start of the window to the end of job q.
    pub length: Time,
    /// The instant at which the window begins, on [`clock`](Self::clock), less than the least common multiple of the periods of its
    /// tasks; `None` if the window may begin at any instant.
    pub start: Option<Time>,
    /// The number of the clock of `start`.
    pub clock: u32,
    /// The nominal release of the first own job is at `delay` − J after the start.
    pub delay: Time,
    /// Where the response time is later than the task's deadline: the successive values of the fixed-point iteration
    /// for `length`, from M(q) (paper, eq. 19–20); the last 32 at most. Otherwise empty.
    pub iterations: Vec<Time>,
    /// The part of `length` in which jobs of lower priority hold locks, or execute since they are not preempted.
    pub blocking: Time,
    /// Which interference counts.
    pub counted: Counted,
    /// The tasks whose waits are counted as jitter, not as execution, each with the response time by which their execution may be
    /// late.
    pub late: Vec<(usize, Time)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_methods() {
        let methods = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact, Method::Best];
        assert_eq!(methods.map(|it| it.to_string()), ["classic", "psm", "ibf", "exact", "best"]);
    }
}
