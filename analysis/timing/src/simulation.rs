//! Simulated schedules of [`Tasks`]: preemptive fixed priorities, in integer nanoseconds.
//!
//! A simulation shows one of many possible schedules. It proves nothing about the others: a response time that it never
//! shows may still occur. It never exceeds a bound, which is what `tests/simulation.rs` checks.
//!
//! What is simulated:
//!
//! - **Releases**: every period from the [offset](Task::offset) on its clock, or where there is none from a random phase, or from 0
//!   ([`SimulationOptions::simultaneous`]); each is late by a random time up to the jitter, and their order is kept. A sporadic
//!   task is released at random distances, often the least ones. A task of [`Tasks::triggers`] whose writers are all known and
//!   simulated is released when they write: each of their jobs as often as any may, at random instants of its execution.
//! - **Jobs**: a job takes a random edge of its state, and a random part of the cost of that edge. Late jobs queue: each starts
//!   after the end of the earlier one. A thread of several tasks executes a job of each in a period, one after another; or, with
//!   another [`Order`](crate::Order), the job that was released first, or any.
//! - **Scheduling**: as `SCHED_FIFO` does. A ready activity never waits while a CPU of its mask is idle or executes an activity
//!   of lower priority. Activities of equal priority do not preempt each other. An activity keeps its CPU where it can.
//! - **Not preempted**: from the instant at which it first has a CPU, such a job has the highest priority.
//! - **Operations**: a job of the client sends a random number of calls, up to [`TaskOperation::sends`](crate::TaskOperation::sends),
//!   at random instants of its execution. [`Calls`] says when the provider executes them.
//! - **Waits**: a job waits at random instants of its execution, in all for a random part of the wait of its edge; nothing in the
//!   schedule shows that.
//! - **Locks**: a job takes one of its locks at a random instant, or none, and executes for a random part of the time for which it
//!   may hold it until it leaves it, with the priority that the [`Protocol`](crate::Protocol) gives it.
//! - **Throttling**: as in the analysis, an activity of the highest priority on each CPU, always with its full execution time.
//!
//! Left out are activities that the analysis does not know (of unknown demand, priority or CPUs, without a period), and those in
//! the background, which never delay the others. [`Schedule::left_out`] lists them.

mod engine;
mod random;

pub use self::random::Random;

use std::sync::Arc;

use crate::time::least_common_multiple;
use crate::{Arrivals, Priority, Task, Tasks, Time};

/// The options of a simulation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SimulationOptions {
    /// Determines all random choices. Those of an activity depend on the seed and its index only, not on the others:
    /// after a change of a priority, all jobs still take the same paths.
    pub seed: u64,
    /// The end of the simulation, which starts at 0. At most 2⁶³ ns are simulated.
    pub length: Time,
    /// Releases the first jobs of all activities without an offset at 0, otherwise each at a random instant of its first period.
    pub simultaneous: bool,
    /// The state at the start of each activity's first job, by the index of the activity; random where there is none.
    pub initial_states: Vec<Option<u32>>,
    /// The least execution time of a job or a call, in percent of the greatest; from 100 on, all take the greatest.
    pub least_time: u32,
    /// The probability that a job takes the edge of greatest cost of its state, in percent; the others take any edge of
    /// their state, each with the same probability.
    pub heavy: u32,
    /// When providers execute calls.
    pub calls: Calls,
    /// Whether the schedule is kept, otherwise only the statistics.
    pub keeps_schedule: bool,
    /// The simulation ends early after this number of events. A job has at least two: its release and its end.
    pub most_events: u64,
    /// Releases and paths that are not random. See [`Tasks::worst_case`].
    pub script: Option<Script>,
}

impl SimulationOptions {
    /// Whether the task of this index is simulated: see [`Script::tasks`].
    fn has_part(&self, task: usize) -> bool {
        self.script.as_ref().is_none_or(|script| matches!(script.tasks.get(task), Some(Some(_))))
    }

    /// Returns the nominal release of a task of this period at an offset of a clock: each clock but the first one begins anywhere.
    fn release_at(&self, offset: Time, period: u64, clock: u32) -> u64 {
        release_at(offset, period, clock, Some(self.seed).filter(|_| !self.simultaneous))
    }

    /// Returns the instant before which nothing is released.
    fn not_before(&self) -> u64 {
        self.script.as_ref().map_or(0, |script| script.start.as_nanos())
    }
}

/// Returns the first nominal release at an offset of a clock, which begins at a random instant with a seed, otherwise at 0.
pub(crate) fn release_at(offset: Time, period: u64, clock: u32, seed: Option<u64>) -> u64 {
    const LATEST: u64 = 1 << 40;
    let any = seed.map_or(0, |seed| Random::new(seed.wrapping_add(u64::from(clock))).up_to(LATEST));
    let begin = if clock == 0 { 0 } else { any % period };
    let offset = offset.as_nanos() % period;
    offset.checked_add(begin).map_or(offset, |release| release % period)
}

/// Releases and paths of a simulation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Script {
    /// Jobs with an earlier nominal release are released at this instant.
    pub start: Time,
    /// By the index of the task. The others are left out.
    pub tasks: Vec<Option<ScriptedTask>>,
    /// The index of an activity that waits for all of equal priority, also for those that become ready later.
    pub last: usize,
}

/// The releases and the path of a task.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ScriptedTask {
    /// The nominal release of its first job. No job is later than nominally, except at the start of the script.
    pub first: Time,
    /// The edges of its first jobs, by their indices. Each takes the full execution time, then waits for the full time, and takes no
    /// lock; the edges of the jobs after them are random.
    pub edges: Vec<usize>,
    /// How often data releases it.
    pub arrivals: Option<Arc<Arrivals>>,
}

/// When a provider executes the pending calls of its operations.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Calls {
    /// At the start of its next job.
    AtJobs,
    /// At once if it has no unfinished job, otherwise after the current job.
    BetweenJobs,
}

impl SimulationOptions {
    /// Random phases, uniform paths, at least half of each execution time; the schedule is kept.
    pub fn new(seed: u64, length: Time) -> SimulationOptions {
        SimulationOptions {
            seed,
            length,
            simultaneous: false,
            initial_states: Vec::new(),
            least_time: 50,
            heavy: 0,
            calls: Calls::AtJobs,
            keeps_schedule: true,
            most_events: 1 << 40,
            script: None,
        }
    }
}

/// The result of a simulation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Schedule {
    /// The instant where the simulation ended: the requested one, unless the number of events was exhausted.
    pub end: Time,
    /// Of each activity; none for those that are left out.
    pub statistics: Vec<Option<Statistics>>,
    /// The activities that are not simulated, ascending, with the reason.
    pub left_out: Vec<(usize, LeftOut)>,
    /// What the CPUs executed, by start and CPU.
    pub slices: Vec<Slice>,
    /// The released jobs, by their release and activity.
    pub jobs: Vec<Job>,
}

/// The jobs of an activity.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Statistics {
    /// The number of jobs that ended.
    pub jobs: u64,
    /// The number of released jobs that did not end.
    pub unfinished: u64,
    /// The number of jobs that did not end at their deadline or before; also unfinished ones.
    pub misses: u64,
    /// The greatest response time; none without a job that ended.
    pub greatest: Option<Time>,
    /// The average response time, rounded down; none without a job that ended.
    pub average: Option<Time>,
}

/// Why an activity is not simulated.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum LeftOut {
    /// It is in the background: it never delays the others.
    Background,
    /// The analysis does not know its demand, its period, its priority or its CPUs. It may delay others, so that real response
    /// times may be greater than those of the simulation.
    Unknown,
    /// It has no part in the [`Script`].
    Unscripted,
}

/// An uninterrupted execution on one CPU.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Slice {
    /// The index of the activity, or of another task: see [`Tasks::kind`].
    pub activity: usize,
    /// The number of the job, from 1; of a call between two jobs, that of the next.
    pub job: u64,
    /// The number of the CPU.
    pub cpu: u32,
    /// Its start.
    pub start: Time,
    /// Its end; equal to the start where the execution time of a job is 0.
    pub end: Time,
    /// The executed part of the job.
    pub executed: Executed,
}

/// A part of a job.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Executed {
    /// The edge of the state machine with this index.
    Edge(usize),
    /// A call of the operation with this index of [`Tasks::operations`].
    Operation(usize),
}

/// A job that was released.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Job {
    /// The index of the activity.
    pub activity: usize,
    /// From 1.
    pub number: u64,
    /// The nominal instant of the release. The response time and the deadline count from it.
    pub nominal: Time,
    /// The instant of the release: at most the jitter later.
    pub release: Time,
    /// The instant of the deadline.
    pub deadline: Time,
    /// Its end, if it ended.
    pub end: Option<Time>,
    /// Whether it did not end at its deadline or before. A job whose deadline is after the end of the simulation is no miss.
    pub is_missed: bool,
}

impl Tasks {
    /// Returns a length for simulations that are shown: the hyperperiod or ten times the longest period, whichever is less,
    /// but no more than `most_jobs` jobs. Zero where no activity can be simulated.
    pub fn length_to_show(&self, most_jobs: u64) -> Time {
        let simulated = self.activities().iter().filter(|activity| activity.is_simulated());
        let periods: Vec<(u64, u64)> =
            simulated.filter_map(|it| Some((it.period?.as_nanos(), it.burst()))).collect();
        let longest = periods.iter().map(|(period, _)| *period).max().unwrap_or_default();
        let hyperperiod = periods.iter().try_fold(1, |all, (period, _)| least_common_multiple(all, *period));
        let length = hyperperiod.unwrap_or(u64::MAX).min(longest.saturating_mul(10));
        let of_task = |length: u64, (period, burst): &(u64, u64)| {
            u128::from(length.div_ceil(*period)) * u128::from(*burst)
        };
        let jobs = |length: u64| periods.iter().map(|it| of_task(length, it)).sum::<u128>();
        if jobs(length) <= u128::from(most_jobs) {
            return Time::from_nanos(length);
        }
        let (mut short, mut long) = (0, length);
        while long - short > 1 {
            let middle = short + (long - short) / 2;
            if jobs(middle) <= u128::from(most_jobs) {
                short = middle;
            } else {
                long = middle;
            }
        }
        Time::from_nanos(short)
    }
}

impl Task {
    /// Returns whether the analysis knows everything that a simulation needs.
    fn is_simulated(&self) -> bool {
        matches!(self.priority, Priority::RealTime(_)) && self.cpus.is_some() && self.is_known()
    }

    fn left_out(&self) -> LeftOut {
        match self.priority {
            Priority::Background => LeftOut::Background,
            Priority::RealTime(_) if self.is_simulated() => LeftOut::Unscripted,
            Priority::RealTime(_) | Priority::Unknown => LeftOut::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::tasks::THROTTLED;
    use crate::testing::{self, machine};
    use crate::{CpuSet, Demand, Lock, LockUser, Protocol, StateMachine, TaskOperation, Waits};
    use expect_test::{Expect, expect};

    fn activity(priority: u32, period: u64, cpus: u128, machine: StateMachine) -> Task {
        Task { cpus: Some(CpuSet(cpus)), ..testing::task(priority, period, machine) }
    }

    fn simple(priority: u32, period: u64, cpus: u128, cost: u64) -> Task {
        activity(priority, period, cpus, StateMachine::single(Time::from_nanos(cost)))
    }

    fn set(activities: Vec<Task>) -> Tasks {
        Tasks::new(activities)
    }

    /// All released at 0, with full execution times.
    fn worst(length: u64) -> SimulationOptions {
        SimulationOptions {
            simultaneous: true,
            least_time: 100,
            ..SimulationOptions::new(1, Time::from_nanos(length))
        }
    }

    /// The slices as `activity.job@cpu start-end`, then the jobs that are late or unfinished.
    fn shown(schedule: &Schedule) -> String {
        let mut out = String::new();
        for it in &schedule.slices {
            let executed = match it.executed {
                Executed::Edge(edge) => format!("edge {edge}"),
                Executed::Operation(operation) => format!("operation {operation}"),
            };
            let (start, end) = (it.start.as_nanos(), it.end.as_nanos());
            let _ = writeln!(out, "{}.{}@{} {start}-{end} {executed}", it.activity, it.job, it.cpu);
        }
        for job in &schedule.jobs {
            let what = match (job.is_missed, job.end) {
                (false, Some(_)) => continue,
                (true, _) => "late",
                (false, None) => "unfinished",
            };
            let _ = writeln!(out, "{}.{} {what}", job.activity, job.number);
        }
        out
    }

    fn check(set: &Tasks, options: &SimulationOptions, expected: Expect) {
        expected.assert_eq(&shown(&set.simulate(options, &|| ())));
    }

    #[test]
    fn a_job_is_preempted_and_continues() {
        let set = set(vec![simple(1, 12, 1, 5), simple(2, 4, 1, 2)]);
        check(
            &set,
            &worst(12),
            expect![[r#"
                1.1@0 0-2 edge 0
                0.1@0 2-4 edge 0
                1.2@0 4-6 edge 0
                0.1@0 6-8 edge 0
                1.3@0 8-10 edge 0
                0.1@0 10-11 edge 0
            "#]],
        );
        let schedule = set.simulate(&worst(12), &|| ());
        let statistics = Statistics {
            jobs: 1,
            unfinished: 0,
            misses: 0,
            greatest: Some(Time::from_nanos(11)),
            average: Some(Time::from_nanos(11)),
        };
        assert_eq!(schedule.statistics[0], Some(statistics));
        assert_eq!(schedule.end.as_nanos(), 12);
    }

    #[test]
    fn late_jobs_queue() {
        // The first edge takes longer than a period, and the next jobs catch up.
        let heavy = machine(2, &[(0, 1, 13), (1, 1, 1)]);
        let set = set(vec![activity(1, 5, 1, heavy)]);
        let options = SimulationOptions { initial_states: vec![Some(0)], ..worst(22) };
        check(
            &set,
            &options,
            expect![[r#"
                0.1@0 0-13 edge 0
                0.2@0 13-14 edge 1
                0.3@0 14-15 edge 1
                0.4@0 15-16 edge 1
                0.5@0 20-21 edge 1
                0.1 late
                0.2 late
            "#]],
        );
        let statistics = set.simulate(&options, &|| ()).statistics[0].unwrap();
        assert_eq!((statistics.jobs, statistics.misses, statistics.unfinished), (5, 2, 0));
        assert_eq!(statistics.average, Some(Time::from_nanos((13 + 9 + 5 + 1 + 1) / 5)));
    }

    #[test]
    fn unfinished_jobs_are_late_once_their_deadline_is_over() {
        let set = set(vec![simple(2, 4, 1, 4), simple(1, 4, 1, 1)]);
        for (length, misses) in [(4, 0), (5, 1), (8, 1), (9, 2), (13, 3)] {
            let schedule = set.simulate(&worst(length), &|| ());
            assert_eq!(schedule.statistics[1].unwrap().misses, misses, "{length}");
            assert_eq!(schedule.jobs.iter().filter(|job| job.is_missed).count() as u64, misses, "{length}");
        }
    }

    fn waiting(task: Task, wait: u64, times: u64) -> Task {
        let machine = task.demand.machine().unwrap().clone();
        let (demand, waits) =
            Waits::with_demand(machine, &[Time::from_nanos(wait)], Some(times), None).unwrap();
        Task { demand, waits, ..task }
    }

    #[test]
    fn a_job_that_waits_leaves_its_cpu() {
        let set = set(vec![waiting(simple(2, 20, 1, 4), 6, 1), simple(1, 20, 1, 5)]);
        check(
            &set,
            &worst(20),
            expect![[r#"
                0.1@0 0-2 edge 0
                1.1@0 2-7 edge 0
                0.1@0 8-10 edge 0
            "#]],
        );
        // What a job that executes nothing waits for is its response.
        let set = Tasks::new(vec![waiting(simple(1, 10, 1, 0), 6, 2)]);
        let statistics = set.simulate(&worst(40), &|| ()).statistics[0].unwrap();
        assert_eq!((statistics.jobs, statistics.greatest), (4, Some(Time::from_nanos(6))));
    }

    /// The first task is released while the last one holds a lock, and the second one soon after that.
    fn with_lock(protocol: Protocol) -> Tasks {
        let mut tasks = vec![simple(3, 40, 1, 2), simple(2, 40, 1, 5), simple(1, 40, 1, 6)];
        for (task, offset) in tasks.iter_mut().zip([2, 3, 0]) {
            task.offset = Some(Time::from_nanos(offset));
        }
        let users = [(0, 2), (2, 6)];
        let users = users.map(|(task, held)| LockUser { task, held: Some(Time::from_nanos(held)) }).to_vec();
        Tasks { locks: vec![Lock { name: "lock".into(), protocol, users }], ..Tasks::new(tasks) }
    }

    #[test]
    fn a_job_that_holds_a_lock_has_the_priority_of_its_protocol() {
        // The greatest responses over random instants of the locks. With a ceiling, the last task preempts the second one as well.
        let greatest = |protocol| {
            let set = with_lock(protocol);
            let of_seed = |seed| {
                let schedule = set.simulate(&SimulationOptions { seed, ..worst(40) }, &|| ());
                [0, 1, 2].map(|task: usize| schedule.statistics[task].unwrap().greatest.unwrap().as_nanos())
            };
            (0..100).map(of_seed).reduce(|a, b| [0, 1, 2].map(|task| a[task].max(b[task]))).unwrap()
        };
        // The first task waits until 6, from 2 on, and the second one follows at 8.
        assert_eq!(greatest(Protocol::Inheritance), [6, 10, 13]);
        assert_eq!(greatest(Protocol::Ceiling), [6, 10, 13]);
        // The second task delays the last one, which delays the first one.
        assert_eq!(greatest(Protocol::None), [11, 6, 13]);
    }

    #[test]
    fn equal_priorities_take_turns_in_the_order_of_their_releases() {
        let set = set(vec![simple(1, 10, 1, 3), simple(1, 5, 1, 2)]);
        check(
            &set,
            &worst(10),
            expect![[r#"
                0.1@0 0-3 edge 0
                1.1@0 3-5 edge 0
                1.2@0 5-7 edge 0
            "#]],
        );
    }

    #[test]
    fn jobs_move_between_their_cpus() {
        // 0 may use both CPUs, and moves where a higher priority takes its own.
        let set = set(vec![simple(1, 20, 0b11, 9), simple(3, 8, 0b01, 2), simple(2, 10, 0b10, 3)]);
        check(
            &set,
            &worst(20),
            expect![[r#"
                1.1@0 0-2 edge 0
                2.1@1 0-3 edge 0
                0.1@0 2-8 edge 0
                1.2@0 8-10 edge 0
                0.1@1 8-10 edge 0
                0.1@0 10-11 edge 0
                2.2@1 10-13 edge 0
                1.3@0 16-18 edge 0
            "#]],
        );
    }

    #[test]
    fn each_of_the_most_cpus_has_a_task() {
        let set = set((0..CpuSet::MOST).map(|cpu| simple(1, 20, 1 << cpu, 9)).collect());
        let schedule = set.simulate(&worst(20), &|| ());
        let ends = schedule.jobs.iter().filter(|job| job.end == Some(Time::from_nanos(9)));
        assert_eq!(ends.count(), 128);
    }

    #[test]
    fn jobs_without_a_cost_take_no_time() {
        let set = set(vec![simple(1, 10, 1, 0), simple(2, 5, 1, 2)]);
        check(
            &set,
            &worst(10),
            expect![[r#"
                1.1@0 0-2 edge 0
                0.1@0 2-2 edge 0
                1.2@0 5-7 edge 0
            "#]],
        );
    }

    #[test]
    fn calls_are_executed_by_the_provider() {
        let mut set = set(vec![simple(2, 10, 1, 1), simple(1, 10, 1, 6)]);
        set.operations = vec![TaskOperation {
            provider: 0,
            client: 1,
            sends: 1,
            time: Time::from_nanos(2),
            ..TaskOperation::default()
        }];
        let options = SimulationOptions { seed: 5, ..worst(20) };
        check(
            &set,
            &options,
            expect![[r#"
                0.1@0 0-1 edge 0
                1.1@0 1-7 edge 0
                0.2@0 10-12 operation 0
                0.2@0 12-13 edge 0
                1.2@0 13-19 edge 0
            "#]],
        );
        check(
            &set,
            &SimulationOptions { calls: Calls::BetweenJobs, ..options },
            expect![[r#"
                0.1@0 0-1 edge 0
                1.1@0 1-6 edge 0
                0.2@0 6-8 operation 0
                1.1@0 8-9 edge 0
                0.2@0 10-11 edge 0
                1.2@0 11-17 edge 0
            "#]],
        );
    }

    #[test]
    fn throttling_is_an_activity_of_the_highest_priority() {
        let second = 1_000_000_000;
        let set = set(vec![simple(99, second, 0b100, second / 2)]).with_platform(Vec::new(), true);
        check(
            &set,
            &worst(second),
            expect![[r#"
                1.1@2 0-50000000 edge 0
                0.1@2 50000000-550000000 edge 0
            "#]],
        );
        let shorter = SimulationOptions { least_time: 0, ..worst(second) };
        assert_eq!(set.simulate(&shorter, &|| ()).slices[0].end, THROTTLED);
    }

    #[test]
    fn releases_are_late_in_order() {
        let mut late = simple(1, 5, 1, 1);
        late.jitter = Time::from_nanos(12);
        let schedule = set(vec![late]).simulate(&worst(200), &|| ());
        let delays: Vec<u64> =
            schedule.jobs.iter().map(|job| job.release.as_nanos() - job.nominal.as_nanos()).collect();
        assert!(
            delays.iter().all(|delay| *delay <= 12) && delays.iter().any(|delay| *delay > 5),
            "{delays:?}"
        );
        assert!(schedule.jobs.is_sorted_by_key(|job| (job.release, job.number)));
        let response = |job: &Job| Some(job.end?.as_nanos() - job.nominal.as_nanos());
        let greatest = schedule.jobs.iter().filter_map(response).max();
        assert_eq!(schedule.statistics[0].unwrap().greatest.map(Time::as_nanos), greatest);
    }

    #[test]
    fn activities_that_cannot_be_simulated_are_named() {
        let background = Task { priority: Priority::Background, ..simple(1, 5, 1, 1) };
        let unknown = Task { demand: Demand::Unknown, ..simple(1, 5, 1, 1) };
        let aperiodic = Task { period: None, ..simple(1, 5, 1, 1) };
        let everywhere = Task { cpus: None, ..simple(1, 5, 1, 1) };
        let any_priority = Task { priority: Priority::Unknown, ..simple(1, 5, 1, 1) };
        let set = set(vec![background, unknown, simple(1, 5, 1, 1), aperiodic, everywhere, any_priority]);
        let schedule = set.simulate(&worst(10), &|| ());
        let reasons =
            [LeftOut::Background, LeftOut::Unknown, LeftOut::Unknown, LeftOut::Unknown, LeftOut::Unknown];
        assert_eq!(schedule.left_out, [0, 1, 3, 4, 5].into_iter().zip(reasons).collect::<Vec<_>>());
        assert_eq!(schedule.jobs.len(), 2);
        // Those that a script does not name, unless they cannot be simulated at all.
        let tasks = vec![None; set.activities().len()];
        let script = Script { start: Time::ZERO, tasks, last: 2 };
        let schedule = set.simulate(&SimulationOptions { script: Some(script), ..worst(10) }, &|| ());
        let unscripted = schedule.left_out.iter().filter(|(_, why)| *why == LeftOut::Unscripted);
        assert_eq!((unscripted.count(), schedule.jobs.len()), (1, 0));
        let stopped = Task { period: Some(Time::ZERO), ..simple(1, 5, 1, 1) };
        let nowhere = Task { cpus: Some(CpuSet::NONE), ..simple(1, 5, 1, 1) };
        let never = Tasks::new(vec![stopped, nowhere]);
        let left_out = [0, 1].map(|index| (index, LeftOut::Unknown));
        assert_eq!(never.simulate(&worst(10), &|| ()).left_out, left_out);
        let nothing = Tasks::default();
        assert_eq!(nothing.simulate(&worst(10), &|| ()).end.as_nanos(), 10);
        assert_eq!(nothing.length_to_show(10), Time::ZERO);
    }

    #[test]
    fn a_simulation_ends_after_its_events_and_before_the_longest_time() {
        let set = set(vec![simple(1, 10, 1, 4)]);
        let schedule = set.simulate(&SimulationOptions { most_events: 3, ..worst(1000) }, &|| ());
        assert_eq!((schedule.end.as_nanos(), schedule.jobs.len()), (10, 2));
        let long = simple(1, u64::MAX, u128::MAX, u64::MAX);
        let all = Tasks::new(vec![long.clone(), long]);
        for simultaneous in [false, true] {
            let schedule = all.simulate(&SimulationOptions { simultaneous, ..worst(u64::MAX) }, &|| ());
            assert_eq!(schedule.end.as_nanos(), 1 << 63);
            assert!(schedule.statistics.iter().all(|it| it.is_some_and(|it| it.jobs == 0)));
        }
    }

    #[test]
    fn the_statistics_do_not_depend_on_the_schedule_being_kept() {
        let heavy = machine(2, &[(0, 1, 3), (1, 1, 1), (1, 0, 4), (0, 0, 2)]);
        let set = set(vec![activity(1, 11, 1, heavy.clone()), activity(2, 7, 1, heavy)]);
        let options = SimulationOptions::new(5, Time::from_nanos(5000));
        let kept = set.simulate(&options, &|| ());
        assert_eq!(kept, set.simulate(&options, &|| ()));
        let brief = set.simulate(&SimulationOptions { keeps_schedule: false, ..options.clone() }, &|| ());
        assert_eq!(brief, Schedule { slices: Vec::new(), jobs: Vec::new(), ..kept.clone() });
        assert_ne!(kept, set.simulate(&SimulationOptions { seed: 6, ..options }, &|| ()));
    }

    #[test]
    fn an_activity_makes_its_own_choices() {
        let choices = machine(2, &[(0, 1, 3), (1, 1, 1), (1, 0, 4), (0, 0, 2)]);
        let path = |priority: u32| {
            let set =
                set(vec![activity(2, 20, 1, choices.clone()), activity(priority, 30, 1, choices.clone())]);
            let schedule = set.simulate(&SimulationOptions::new(3, Time::from_nanos(3000)), &|| ());
            let mut of_first: Vec<(u64, Executed)> = schedule
                .slices
                .iter()
                .filter(|slice| slice.activity == 0)
                .map(|slice| (slice.job, slice.executed))
                .collect();
            of_first.dedup();
            of_first
        };
        assert_eq!(path(1), path(3));
    }

    #[test]
    fn the_share_of_heavy_paths() {
        let choices = machine(1, &[(0, 0, 1), (0, 0, 2), (0, 0, 3)]);
        let set = set(vec![activity(1, 10, 1, choices)]);
        let count = |heavy: u32| {
            let options = SimulationOptions { heavy, ..worst(10_000) };
            let slices = set.simulate(&options, &|| ()).slices;
            slices.iter().filter(|slice| slice.executed == Executed::Edge(2)).count()
        };
        assert_eq!(count(100), 1000);
        assert!((280..390).contains(&count(0)) && (600..740).contains(&count(50)));
    }

    #[test]
    fn the_shown_length_is_the_hyperperiod_or_a_bounded_part() {
        let of = |periods: &[u64], most: u64| {
            let set = set(periods.iter().map(|period| simple(1, *period, 1, 1)).collect());
            set.length_to_show(most).as_nanos()
        };
        assert_eq!(of(&[100, 1000, 40], 1000), 1000);
        // No multiple within ten periods; too many jobs; too few for one of each.
        assert_eq!(of(&[97, 1009], 1000), 10090);
        assert_eq!(of(&[100, 1000], 6), 500);
        assert_eq!(of(&[100, 1000], 1), 0);
        assert_eq!(of(&[u64::MAX, u64::MAX - 1], 100), u64::MAX);
    }

    fn nominal_releases(schedule: &Schedule) -> Vec<u64> {
        schedule.jobs.iter().map(|job| job.nominal.as_nanos()).collect()
    }

    #[test]
    fn offsets_and_the_ends_of_a_simulation() {
        let with_offset = |offset| Task { offset: Some(Time::from_nanos(offset)), ..simple(1, 10, 1, 5) };
        let released = |offset, length| {
            nominal_releases(&set(vec![with_offset(offset)]).simulate(&worst(length), &|| ()))
        };
        assert_eq!(released(3, 20), [3, 13]);
        // One longer than the period counts modulo the period.
        assert_eq!(released(13, 20), [3, 13]);
        // Nothing is released at the end, but a job may end there.
        assert_eq!((released(3, 3), released(3, 13)), (vec![], vec![3]));
        let schedule = set(vec![with_offset(0)]).simulate(&worst(5), &|| ());
        assert_eq!(schedule.jobs[0].end, Some(Time::from_nanos(5)));
        // Any phase is less than the period.
        for seed in 0..20 {
            let options = SimulationOptions::new(seed, Time::from_nanos(3));
            let schedule = set(vec![simple(1, 1, 1, 0)]).simulate(&options, &|| ());
            assert_eq!(nominal_releases(&schedule), [0, 1, 2]);
        }
    }

    #[test]
    fn without_a_period_nothing_is_simulated() {
        let schedule = set(vec![simple(1, 0, 1, 1)]).simulate(&worst(10), &|| ());
        assert_eq!(schedule.left_out, [(0, LeftOut::Unknown)]);
    }

    #[test]
    fn each_cpu_has_its_own_activities() {
        let set = set(vec![simple(1, 10, 1, 3), simple(2, 10, 4, 4), simple(3, 10, 2, 5)]);
        check(
            &set,
            &worst(10),
            expect![[r#"
                0.1@0 0-3 edge 0
                2.1@1 0-5 edge 0
                1.1@2 0-4 edge 0
            "#]],
        );
    }

    #[test]
    fn the_end_of_a_job_starts_another_on_its_cpu() {
        let set = set(vec![simple(1, 10, 1, 3), simple(2, 10, 2, 4), simple(1, 10, 2, 2)]);
        check(
            &set,
            &worst(10),
            expect![[r#"
                0.1@0 0-3 edge 0
                1.1@1 0-4 edge 0
                2.1@1 4-6 edge 0
            "#]],
        );
    }

    #[test]
    fn execution_times_are_within_their_range() {
        let options = SimulationOptions { least_time: 50, ..worst(100_000) };
        let slices = set(vec![simple(1, 200, 1, 100)]).simulate(&options, &|| ()).slices;
        let times: Vec<u64> = slices.iter().map(|it| it.end.as_nanos() - it.start.as_nanos()).collect();
        assert_eq!((times.iter().min(), times.iter().max()), (Some(&50), Some(&100)));
    }

    #[test]
    fn a_long_simulation_can_be_interrupted() {
        let calls = std::cell::Cell::new(0);
        let options = SimulationOptions { most_events: 140_000, keeps_schedule: false, ..worst(1 << 40) };
        set(vec![simple(1, 10, 1, 1)]).simulate(&options, &|| calls.set(calls.get() + 1));
        assert_eq!(calls.get(), 2);
    }

    #[test]
    fn an_initial_state_that_does_not_exist_is_any() {
        let ring = machine(2, &[(0, 1, 1), (1, 0, 2)]);
        let first = |state: u32| {
            let options = SimulationOptions { initial_states: vec![Some(state)], ..worst(10) };
            set(vec![activity(1, 10, 1, ring.clone())]).simulate(&options, &|| ()).slices[0].executed
        };
        assert_eq!([0, 1].map(first), [Executed::Edge(0), Executed::Edge(1)]);
        assert!(matches!(first(2), Executed::Edge(_)));
    }

    #[test]
    fn heavy_paths_are_not_always_taken() {
        let set = set(vec![activity(1, 10, 1, machine(1, &[(0, 0, 1), (0, 0, 2)]))]);
        let slices = set.simulate(&SimulationOptions { heavy: 99, ..worst(10_000) }, &|| ()).slices;
        let light = slices.iter().filter(|slice| slice.executed == Executed::Edge(0)).count();
        assert!((1..20).contains(&light), "{light}");
    }

    #[test]
    fn every_release_may_be_late() {
        let late = Task { jitter: Time::from_nanos(50), ..simple(1, 100, 1, 1) };
        let schedule = set(vec![late]).simulate(&worst(10_000), &|| ());
        let is_late = |job: &&Job| job.release > job.nominal;
        assert!(schedule.jobs.iter().filter(is_late).count() > 90);
    }

    #[test]
    fn jobs_are_those_of_activities() {
        let set = set(vec![simple(1, 10, 1, 3)]).with_platform(vec![simple(50, 5, 1, 1)], false);
        let schedule = set.simulate(&worst(20), &|| ());
        assert_eq!(schedule.jobs.iter().map(|job| job.activity).collect::<Vec<_>>(), [0, 0]);
    }

    #[test]
    fn statistics_of_unfinished_jobs() {
        let statistics = |length: u64| {
            let schedule = set(vec![simple(1, 10, 1, 12)]).simulate(&worst(length), &|| ());
            let it = schedule.statistics[0].unwrap();
            (it.jobs, it.unfinished, it.misses)
        };
        assert_eq!([10, 11, 25].map(statistics), [(0, 1, 0), (0, 2, 1), (2, 1, 2)]);
    }

    #[test]
    fn an_activity_returns_to_its_cpu_if_that_is_idle() {
        check(
            &set(vec![simple(2, 10, 3, 3), simple(1, 15, 3, 2)]),
            &worst(18),
            expect![[r#"
            0.1@0 0-3 edge 0
            1.1@1 0-2 edge 0
            0.2@0 10-13 edge 0
            1.2@1 15-17 edge 0
        "#]],
        );
    }

    #[test]
    fn an_activity_preempts_the_one_of_lowest_priority() {
        let at = |offset, activity: Task| Task { offset: Some(Time::from_nanos(offset)), ..activity };
        // On CPU 1, and not on CPU 0.
        check(
            &set(vec![simple(2, 20, 3, 6), simple(1, 20, 3, 6), at(2, simple(3, 20, 3, 3))]),
            &worst(20),
            expect![[r#"
                0.1@0 0-6 edge 0
                1.1@1 0-2 edge 0
                2.1@1 2-5 edge 0
                1.1@1 5-9 edge 0
            "#]],
        );
        // Both CPUs execute an activity of the lowest priority: the one that became ready last is preempted.
        check(
            &set(vec![simple(1, 20, 3, 6), at(1, simple(1, 20, 3, 6)), at(2, simple(3, 20, 3, 3))]),
            &worst(20),
            expect![[r#"
                0.1@0 0-6 edge 0
                1.1@1 1-2 edge 0
                2.1@1 2-5 edge 0
                1.1@1 5-10 edge 0
            "#]],
        );
    }

    #[test]
    fn calls_that_arrive_during_a_job_wait() {
        let mut set = set(vec![simple(2, 100, 1, 10), simple(1, 40, 2, 15)]);
        let time = Time::from_nanos(8);
        set.operations =
            vec![TaskOperation { provider: 0, client: 1, sends: 3, time, ..TaskOperation::default() }];
        let of_provider = |calls: Calls| {
            let mut schedule = set.simulate(&SimulationOptions { calls, ..worst(310) }, &|| ());
            schedule.slices.retain(|slice| slice.activity == 0);
            shown(&Schedule { jobs: Vec::new(), ..schedule })
        };
        expect![[r#"
            0.1@0 0-10 edge 0
            0.2@0 100-108 operation 0
            0.2@0 108-116 operation 0
            0.2@0 116-124 operation 0
            0.2@0 124-132 operation 0
            0.2@0 132-140 operation 0
            0.2@0 140-148 operation 0
            0.2@0 148-158 edge 0
            0.3@0 200-208 operation 0
            0.3@0 208-216 operation 0
            0.3@0 216-224 operation 0
            0.3@0 224-234 edge 0
            0.4@0 300-308 operation 0
            0.4@0 308-310 operation 0
        "#]]
        .assert_eq(&of_provider(Calls::AtJobs));
        expect![[r#"
            0.1@0 0-10 edge 0
            0.2@0 10-18 operation 0
            0.2@0 18-26 operation 0
            0.2@0 42-50 operation 0
            0.2@0 50-58 operation 0
            0.2@0 58-66 operation 0
            0.2@0 86-94 operation 0
            0.2@0 100-110 edge 0
            0.3@0 123-131 operation 0
            0.3@0 166-174 operation 0
            0.3@0 174-182 operation 0
            0.3@0 200-210 edge 0
            0.4@0 211-219 operation 0
            0.4@0 246-254 operation 0
            0.4@0 254-262 operation 0
            0.4@0 285-293 operation 0
            0.4@0 293-301 operation 0
            0.4@0 301-310 edge 0
        "#]]
        .assert_eq(&of_provider(Calls::BetweenJobs));
    }
}
