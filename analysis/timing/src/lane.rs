//! One CPU, real or imaginary, with its tasks: what they ask for in a window.

use std::cell::Cell;
use std::cmp::Ordering;
use std::rc::Rc;

use crate::execution_bound::{BoundPiece, ExecutionBound};
use crate::paths::{MachinePaths, Requests};
use crate::utilisation::TaskShare;
use crate::{
    Arrivals, CpuRule, CycleMean, Demand, Method, NoBoundReason, Options, Priority, StateMachine, Task, Time,
    TraceBound, Utilisation,
};

/// A task of known demand, with what it may ask for. The lanes share it.
pub(crate) struct LaneMember<'a> {
    /// The index of the task.
    pub(crate) index: usize,
    pub(crate) task: &'a Task,
    pub(crate) period: u64,
    /// b, the greatest number of releases in a window of length T.
    burst: u64,
    pub(crate) jitter: u64,
    /// B, how long a lower priority that holds a lock delays a job.
    pub(crate) blocking: u64,
    /// The part of B by jobs in the background.
    pub(crate) background_blocking: u64,
    /// How often a job waits, at most.
    pub(crate) waits: u64,
    /// The nominal instant of the first release in the window, counted from J before its start. Less than the period; 0 for a
    /// window that may begin at any instant.
    pub(crate) delay: u64,
    pub(crate) machine: &'a StateMachine,
    pub(crate) share: TaskShare,
    curve: DemandCurve<'a>,
    /// What its jobs execute, if they wait, and the share of that.
    executed: Option<(DemandCurve<'a>, TaskShare)>,
    /// The response time by which the execution of its jobs may be late, where their waits do not count as execution. See
    /// [`Lane::count_waits_as_jitter`].
    pub(crate) late: Option<u64>,
    /// For [`Method::Ibf`], from its first use on.
    execution: Option<Box<ExecutionBound<'a>>>,
    /// For [`Method::Exact`], from their first use on.
    paths: Option<Box<MachinePaths>>,
    /// All tasks of its thread in their order, by their indices in all members; empty if the thread has no others.
    pub(crate) thread: Rc<[usize]>,
    /// The job whose release by data was asked for last, and that release.
    last_release: Cell<(u64, u64)>,
    interrupt: &'a dyn Fn(),
}

/// The demand M of one task.
enum DemandCurve<'a> {
    /// M(n) is n times this.
    Linear(u64),
    Trace(Box<TraceBound<'a>>),
}

impl DemandCurve<'_> {
    fn demand(&mut self, jobs: u64) -> Result<u64, NoBoundReason> {
        match self {
            DemandCurve::Linear(cost) => cost.checked_mul(jobs).ok_or(NoBoundReason::Overflow),
            DemandCurve::Trace(bound) => bound.demand(jobs).map(Time::as_nanos),
        }
    }

    fn greatest_cycle_mean(&self) -> CycleMean {
        match self {
            DemandCurve::Linear(cost) => CycleMean { cost: Time::from_nanos(*cost), length: 1 },
            DemandCurve::Trace(bound) => bound.greatest_cycle_mean(),
        }
    }
}

/// What a task of hp(i) contributes to a window.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Contribution {
    /// The number of jobs that it releases.
    pub(crate) jobs: u64,
    /// What they execute.
    pub(crate) time: u64,
    /// The longest window for which this holds.
    holds_until: u64,
    /// The longest window up to which `time` rises by at least 1 ns for each 1 ns; 0 if it does not.
    pub(crate) rises_until: u64,
}

impl<'a> LaneMember<'a> {
    /// `None` for a task of unknown demand.
    pub(crate) fn new(
        index: usize,
        task: &'a Task,
        method: Method,
        interrupt: &'a dyn Fn(),
    ) -> Option<LaneMember<'a>> {
        let Demand::Machine { machine, .. } = &task.demand else { return None };
        interrupt();
        let curve = match method {
            Method::Classic => DemandCurve::Linear(task.demand.own(method).unwrap_or_default().as_nanos()),
            Method::Psm | Method::Ibf | Method::Exact | Method::Best => {
                DemandCurve::Trace(Box::new(TraceBound::interruptible(machine, interrupt)))
            }
        };
        let executed = task.waits.as_ref().map(|waits| match &curve {
            DemandCurve::Linear(cost) => {
                let executed = waits.executed.greatest_cost().max(task.demand.whole().unwrap_or_default());
                DemandCurve::Linear(executed.as_nanos().min(*cost))
            }
            DemandCurve::Trace(_) => {
                DemandCurve::Trace(Box::new(TraceBound::interruptible(&waits.executed, interrupt)))
            }
        });
        let share = |curve: &DemandCurve<'_>| {
            let (mean, length) = task.mean_of_jobs(curve.greatest_cycle_mean())?;
            Some(TaskShare::new(mean, length))
        };
        Some(LaneMember {
            index,
            task,
            period: task.period?.as_nanos(),
            burst: task.burst(),
            jitter: task.jitter.as_nanos(),
            blocking: task.blocking.as_nanos(),
            background_blocking: task.background_blocking.as_nanos(),
            waits: task.waits.as_ref().and_then(|waits| waits.times).unwrap_or(0),
            delay: 0,
            machine,
            share: share(&curve)?,
            executed: executed.and_then(|executed| Some((share(&executed)?, executed))).map(|(a, b)| (b, a)),
            late: None,
            curve,
            execution: None,
            paths: None,
            thread: Rc::new([]),
            last_release: Cell::default(),
            interrupt,
        })
    }

    /// (n₀, c): see [`TraceBound::regularity`].
    pub(crate) fn regularity(&mut self) -> Option<(u64, u64)> {
        match &mut self.curve {
            DemandCurve::Linear(_) => Some((0, 1)),
            DemandCurve::Trace(bound) => bound.regularity(),
        }
    }

    /// M(`jobs`).
    pub(crate) fn demand(&mut self, jobs: u64) -> Result<u64, NoBoundReason> {
        self.curve.demand(jobs)
    }

    /// Returns by how much its execution may be late: its jitter, or its response time where its waits count as jitter.
    fn lateness(&self) -> u64 {
        self.late.map_or(self.jitter, |late| late.max(self.jitter))
    }

    /// Returns the share of a CPU that it takes from others.
    pub(crate) fn interfering_share(&self) -> TaskShare {
        match &self.executed {
            Some((_, share)) if self.late.is_some() => *share,
            _ => self.share,
        }
    }

    /// Returns the share of a CPU that it executes for, without waits.
    pub(crate) fn executed_share(&self) -> TaskShare {
        self.executed.as_ref().map_or(self.share, |(_, share)| *share)
    }

    /// Returns the earliest nominal release of a job of a window, from 1, counted from J before its start.
    pub(crate) fn release(&self, job: u64) -> Result<u64, NoBoundReason> {
        let by_distance = self.task.release_by_distance(job).ok_or(NoBoundReason::Overflow)?.as_nanos();
        let by_data = self.task.arrivals.as_ref().map_or(0, |it| self.release_by_data(it, job));
        by_distance.max(by_data).checked_add(self.delay).ok_or(NoBoundReason::Overflow)
    }

    /// A busy window asks for one job after the other, and for each several times.
    fn release_by_data(&self, arrivals: &Arrivals, job: u64) -> u64 {
        let (known, at) = self.last_release.get();
        let found = match job.checked_sub(known) {
            Some(0) => at,
            Some(1) if known > 0 => arrivals.release_after(job, at),
            _ => arrivals.release_of(job),
        };
        self.last_release.set((job, found));
        found
    }

    /// Returns the number of jobs that are released in a window: b·⌈(t + J − delay)/T⌉, or less where data releases them less often.
    pub(crate) fn jobs_released(&self, window: u64) -> Result<u64, NoBoundReason> {
        let jobs = self.jobs_by_distance(window)?;
        Ok(self.fewer_by_data(window, jobs).map_or(jobs, |it| it.0))
    }

    /// Returns how many jobs data releases in a window, and the longest window for which that holds, if they are fewer than `jobs`.
    fn fewer_by_data(&self, window: u64, jobs: u64) -> Option<(u64, u64)> {
        let (lateness, arrivals) = (self.lateness(), self.task.arrivals.as_ref()?);
        let (by_data, until) = arrivals.releases(window.checked_add(lateness)?);
        Some((by_data, until.saturating_sub(lateness))).filter(|_| by_data < jobs)
    }

    fn jobs_by_distance(&self, window: u64) -> Result<u64, NoBoundReason> {
        let since_first = window.checked_add(self.lateness()).ok_or(NoBoundReason::Overflow)?;
        let bursts = since_first.saturating_sub(self.delay).div_ceil(self.period);
        bursts.checked_mul(self.burst).ok_or(NoBoundReason::Overflow)
    }

    /// Returns an instant after `instant` before which no other job is released, in a window that begins at any instant.
    pub(crate) fn next_release_after(&self, instant: u64) -> Option<u64> {
        let window = instant.checked_add(1)?;
        let bursts = window.checked_add(self.jitter)?.div_ceil(self.period);
        let by_distance = bursts.checked_mul(self.period)?.checked_sub(self.jitter)?;
        let by_data = self.fewer_by_data(window, u64::MAX).map_or(u64::MAX, |it| it.1);
        Some(by_distance.min(by_data))
    }

    /// Returns the number of jobs that execute in a `window` if each of them ends within `response`, and for how long they do, if
    /// none executes for more than `most`. In n jobs, the first and the last one together have the part of the window and
    /// `response` that is not between the releases of these: so have n − 1, with T more.
    pub(crate) fn carried(
        &mut self,
        window: u64,
        response: u64,
        most: u64,
    ) -> Result<(u64, u64), NoBoundReason> {
        let length = window.checked_add(response).ok_or(NoBoundReason::Overflow)?;
        let bursts = length.div_ceil(self.period);
        let jobs = bursts.checked_mul(self.burst).ok_or(NoBoundReason::Overflow)?;
        let by_data = self.task.arrivals.as_ref().map(|it| it.releases(length).0).filter(|it| *it < jobs);
        let curve = self.executed.as_mut().map_or(&mut self.curve, |(executed, _)| executed);
        let mut demand = |jobs: u64| Ok(curve.demand(jobs)?.min(jobs.saturating_mul(most)));
        if let Some(jobs) = by_data.or(Some(jobs).filter(|_| self.burst > 1)) {
            return Ok((jobs, demand(jobs)?));
        }
        let rest = length - jobs.saturating_sub(1) * self.period;
        let mut clipped = |jobs: u64, rest: u64| {
            Ok(demand(jobs)?.min(demand(jobs.saturating_sub(2))?.saturating_add(rest)))
        };
        let fewer = clipped(jobs.saturating_sub(1), rest.saturating_add(self.period))?;
        Ok((jobs, clipped(jobs, rest)?.max(fewer)))
    }

    /// Returns for how long locks that lower priorities take during a job of `other`, a member of hp(i) or i, delay this member, i.
    fn blocking_by_job_of(&self, other: &LaneMember<'_>) -> u128 {
        let by_waits = u128::from(other.waits) * u128::from(self.blocking);
        let by_throttling = if other.task.is_throttling { self.background_blocking } else { 0 };
        by_waits.saturating_add(by_throttling.into())
    }

    /// See [`MachinePaths::requests`].
    pub(crate) fn requests(&mut self, jobs: u64) -> Option<Rc<Requests>> {
        let machine = self.machine;
        self.paths.get_or_insert_with(|| Box::new(MachinePaths::new(machine))).requests(jobs, self.interrupt)
    }

    /// Returns what the task contributes to a `window` > 0: M(n) for n = b·⌈(t + J − delay)/T⌉; with [`Method::Ibf`], what n jobs
    /// execute if the last one begins (n − 1)·T + delay − J after the start of the window. (In a burst, M(n).) If data releases fewer
    /// jobs, no more than M of these.
    pub(crate) fn contribution(
        &mut self,
        window: u64,
        method: Method,
    ) -> Result<Contribution, NoBoundReason> {
        let found = self.by_distance(window, method)?;
        let Some((jobs, until)) = self.fewer_by_data(window, found.jobs) else { return Ok(found) };
        let time = self.interfering_demand(jobs)?;
        // Up to there, what rises with the window is the less.
        let rises_until = found.rises_until.min(window.saturating_add(time.saturating_sub(found.time)));
        let holds_until = if time > found.time { found.holds_until.min(until) } else { until };
        Ok(Contribution { jobs, time: found.time.min(time), holds_until, rises_until })
    }

    /// M, or that of what it executes where its waits count as jitter.
    fn interfering_demand(&mut self, jobs: u64) -> Result<u64, NoBoundReason> {
        match &mut self.executed {
            Some((executed, _)) if self.late.is_some() => executed.demand(jobs),
            _ => self.curve.demand(jobs),
        }
    }

    fn by_distance(&mut self, window: u64, method: Method) -> Result<Contribution, NoBoundReason> {
        let jobs = self.jobs_by_distance(window)?;
        let lateness = self.lateness();
        // Instants are counted from J before the window, which is longer than J.
        let window_at = |instant: u64| instant - lateness;
        let bursts = jobs / self.burst;
        let next_release = window_at(bursts.saturating_mul(self.period).saturating_add(self.delay));
        if jobs == 0 {
            return Ok(Contribution { jobs, time: 0, holds_until: next_release, rises_until: 0 });
        }
        if method != Method::Ibf || self.burst > 1 {
            let time = self.interfering_demand(jobs)?;
            return Ok(Contribution { jobs, time, holds_until: next_release, rises_until: 0 });
        }
        let (machine, interrupt) = (self.machine, self.interrupt);
        let bound = self.execution.get_or_insert_with(|| Box::new(ExecutionBound::new(machine, interrupt)));
        let last_release = (jobs - 1).saturating_mul(self.period).saturating_add(self.delay);
        let since_release = window.saturating_add(self.jitter) - last_release;
        let BoundPiece { time, until, rises } = bound.execution(jobs, since_release)?;
        let until = until.map(|until| window_at(last_release.saturating_add(until)));
        let until = until.map_or(next_release, |until| until.min(next_release));
        Ok(match rises {
            true => Contribution { jobs, time, holds_until: window, rises_until: until },
            false => Contribution { jobs, time, holds_until: until, rises_until: 0 },
        })
    }
}

/// What the tasks of hp(i) contribute to a window: for each member, by its place.
///
/// In order of decreasing priority, windows only grow: hp(i) contains all tasks of higher priority and their hp, so
/// its fixed point is not less than theirs. So the counts of one task are a valid start for the next: they are below
/// its least fixed point, which the iteration reaches from there as well as from 0. (With [`Method::Ibf`], those of the first
/// job only.) Each count is stored with the longest window for which it holds, so a pass over the members needs comparisons
/// only.
pub(crate) struct JobCounts {
    /// The longest window for which `time` holds; of members not in hp(i), the longest there is.
    holds_until: Vec<u64>,
    /// 0 for members that are not in hp(i).
    jobs: Vec<u64>,
    time: Vec<u64>,
    /// Σ `time`. In 128 bits, so that the overflow of 64 bits does not depend on the order of the terms.
    total: u128,
    /// The number of members in hp(i).
    present: u64,
}

impl Clone for JobCounts {
    fn clone(&self) -> JobCounts {
        let mut copy = JobCounts::new(0);
        copy.clone_from(self);
        copy
    }

    /// Allocates nothing if there is room: a large group of equal priority copies its counts for each member.
    fn clone_from(&mut self, other: &JobCounts) {
        self.holds_until.clone_from(&other.holds_until);
        self.jobs.clone_from(&other.jobs);
        self.time.clone_from(&other.time);
        (self.total, self.present) = (other.total, other.present);
    }
}

impl JobCounts {
    pub(crate) fn total(&self) -> u128 {
        self.total
    }

    pub(crate) fn present(&self) -> u64 {
        self.present
    }

    /// Returns the place, the number of jobs, and the time of each member.
    pub(crate) fn contributions(&self) -> impl Iterator<Item = (usize, u64, u64)> {
        let of_place = |(place, (&jobs, &time))| (place, jobs, time);
        self.jobs.iter().zip(&self.time).enumerate().map(of_place).filter(|&(_, jobs, _)| jobs > 0)
    }

    pub(crate) fn new(members: usize) -> JobCounts {
        JobCounts {
            holds_until: vec![u64::MAX; members],
            jobs: vec![0; members],
            time: vec![0; members],
            total: 0,
            present: 0,
        }
    }

    /// Adds a member to hp(i), with what it contributes to every window.
    pub(crate) fn include(&mut self, place: usize, lane: &mut Members<'_, '_>, method: Method) {
        self.holds_until[place] = 0;
        self.present += 1;
        // What cannot be computed fails again in the next window.
        if let Ok(least) = lane.at(place).contribution(1, method) {
            self.holds_until[place] = least.holds_until;
            self.jobs[place] = least.jobs;
            self.time[place] = least.time;
            self.total += u128::from(least.time);
        }
    }

    pub(crate) fn exclude(&mut self, place: usize) {
        self.total -= u128::from(self.time[place]);
        self.holds_until[place] = u64::MAX;
        self.jobs[place] = 0;
        self.time[place] = 0;
        self.present -= 1;
    }

    /// Raises the counts to those of a window of length `window`. Returns the longest window up to which a contribution rises
    /// with it, or 0.
    pub(crate) fn raise(
        &mut self,
        window: u64,
        lane: &mut Members<'_, '_>,
        method: Method,
    ) -> Result<u64, NoBoundReason> {
        let mut rises_until = 0;
        let mut failure = None;
        for (place, holds_until) in self.holds_until.iter_mut().enumerate() {
            if *holds_until >= window {
                continue;
            }
            match lane.at(place).contribution(window, method) {
                Ok(found) => {
                    *holds_until = found.holds_until;
                    rises_until = rises_until.max(found.rises_until);
                    self.jobs[place] = found.jobs;
                    self.total += u128::from(found.time - self.time[place]);
                    self.time[place] = found.time;
                }
                // Continue: the reported failure must not depend on the order of the members.
                Err(reason) => failure = failure.max(Some(reason)),
            }
        }
        failure.map_or(Ok(rises_until), Err)
    }
}

/// The members of a lane: some of all.
pub(crate) struct Members<'l, 'a> {
    pub(crate) all: &'l mut [LaneMember<'a>],
    /// Indices into `all`, ascending.
    pub(crate) places: &'l [usize],
}

impl<'a> Members<'_, 'a> {
    pub(crate) fn at(&mut self, place: usize) -> &mut LaneMember<'a> {
        &mut self.all[self.places[place]]
    }

    pub(crate) fn get(&self, place: usize) -> &LaneMember<'a> {
        &self.all[self.places[place]]
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }
}

/// A job q of a busy window, from 1, and f(q).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct BusyJob {
    pub(crate) job: u64,
    pub(crate) length: u64,
}

/// The busy window of a task under one method.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct BusyWindow {
    /// f(1).
    pub(crate) first_job: u64,
    /// The job with the greatest response time.
    pub(crate) worst: BusyJob,
    /// The last job that was analysed.
    pub(crate) last: BusyJob,
    /// Whether the window ends after `last`; otherwise the responses repeat from there on.
    pub(crate) ends: bool,
}

/// The analysis of one CPU, or of linked CPUs as if they were one.
pub(crate) struct Lane<'l, 'a> {
    pub(crate) rule: CpuRule,
    pub(crate) members: Members<'l, 'a>,
    pub(crate) options: &'a Options,
    pub(crate) interrupt: &'a dyn Fn(),
    /// The number of members of all lanes, which share the budgets.
    pub(crate) members_of_all: u64,
    /// The instant at which the windows begin, and the clock that it is on; `None` for any. See [`Lane::begin_at`].
    pub(crate) start: Option<(u64, u32)>,
    /// The number of such instants that are analysed, which share the budgets.
    pub(crate) starts: u64,
    /// Whether to list the interference in windows of [`Method::Exact`].
    pub(crate) lists_interference: bool,
}

impl Lane<'_, '_> {
    pub(crate) fn priority(&self, place: usize) -> Priority {
        self.members.get(place).task.priority
    }

    /// Returns for how long jobs of lower priority that hold locks delay the member at `place` in a window with `jobs` jobs of it.
    ///
    /// In the window, a lower priority executes only to leave a lock that it took before: that is B, once. While the member or one
    /// of hp(i) waits, a lower priority may take a lock again: once more for each wait. While real-time tasks are throttled, so may
    /// the background: its part once more for each throttling. Where some of hp(i) may run on other CPUs, a lower priority may also
    /// take one between two jobs of the member.
    pub(crate) fn blocking(&self, place: usize, jobs: u64, window: u64) -> Result<u64, NoBoundReason> {
        let member = self.members.get(place);
        if member.blocking == 0 {
            return Ok(0);
        }
        let mut blocking = u128::from(member.blocking);
        let mut has_several_cpus = false;
        for other in (0..self.members.len()).filter(|&other| self.priority(other) >= member.task.priority) {
            let of_other = self.members.get(other);
            has_several_cpus |= !of_other.task.cpus().is_one();
            let of_job = member.blocking_by_job_of(of_other);
            if of_job > 0 {
                // Linux may end one throttling at once, and begin the next one at the end of its period.
                let is_throttling = of_other.task.is_throttling;
                let late = if is_throttling { of_other.machine.greatest_cost().as_nanos() } else { 0 };
                let window = window.checked_add(late).ok_or(NoBoundReason::Overflow)?;
                let jobs = if other == place { jobs } else { of_other.jobs_released(window)? };
                blocking = blocking.saturating_add(u128::from(jobs).saturating_mul(of_job));
            }
        }
        if has_several_cpus {
            let between = u128::from(jobs - 1).saturating_mul(u128::from(member.blocking));
            blocking = blocking.saturating_add(between);
        }
        u64::try_from(blocking).map_err(|_| NoBoundReason::Overflow)
    }

    /// Returns why no window of the member at `place` ends, or without its own jobs no first job, if the utilisation is 1 or more
    /// with what [`Lane::blocking`] adds for each job. (Or nearly 1.)
    pub(crate) fn overload_by_blocking(&self, place: usize, has_own: bool) -> Option<NoBoundReason> {
        let member = self.members.get(place);
        if member.blocking == 0 && member.background_blocking == 0 {
            return None;
        }
        let counts =
            |&other: &usize| (has_own || other != place) && self.priority(other) >= member.task.priority;
        let others = || (0..self.members.len()).filter(counts).map(|other| self.members.get(other));
        let is_own = |other: &LaneMember<'_>| other.index == member.index;
        let has_several_cpus = has_own && others().any(|it| !it.task.cpus().is_one());
        let between = |of: &LaneMember<'_>| if has_several_cpus && is_own(of) { member.blocking } else { 0 };
        let of_job = |of: &LaneMember<'_>| member.blocking_by_job_of(of).saturating_add(between(of).into());
        if others().all(|it| of_job(it) == 0) {
            return None;
        }
        let blocking = others().map(|it| -> Option<TaskShare> {
            let cost = Time::from_nanos(u64::try_from(of_job(it)).unwrap_or(u64::MAX));
            let (mean, length) = it.task.mean_of_jobs(CycleMean { cost, length: 1 })?;
            Some(TaskShare::new(mean, length))
        });
        let demand = others().map(|it| if is_own(it) { it.share } else { it.interfering_share() });
        let utilisation = Utilisation::sum(demand.chain(blocking.flatten()));
        let reason = if has_several_cpus { NoBoundReason::SeveralCpus } else { NoBoundReason::Waits };
        (utilisation.compare_roughly(None) != Some(Ordering::Less)).then_some(reason)
    }

    /// Whether lower priorities may have shorter windows than higher ones.
    pub(crate) fn has_blocking_or_late_members(&self) -> bool {
        (0..self.members.len())
            .map(|place| self.members.get(place))
            .any(|it| it.blocking > 0 || it.late.is_some())
    }

    /// Returns the tasks of hp(i) of the member at `place` whose waits count as jitter, with their response times.
    pub(crate) fn late_members(&self, place: usize) -> Vec<(usize, Time)> {
        let others = self.interfering(place).into_iter().map(|it| self.members.get(it));
        others.filter_map(|it| Some((it.index, Time::from_nanos(it.late?)))).collect()
    }

    /// Returns the places of hp(i) of the member at `place`, without the tasks of its own thread.
    pub(crate) fn interfering(&self, place: usize) -> Vec<usize> {
        let (own, thread) = (self.priority(place), &self.members.get(place).thread);
        let is_own = |other: usize| {
            other == place
                || self.members.places.get(other).is_some_and(|it| thread.binary_search(it).is_ok())
        };
        (0..self.members.len()).filter(|&other| self.priority(other) >= own && !is_own(other)).collect()
    }

    /// Returns the places of the other tasks in the thread of the member at `place`, each with the number of jobs that the thread
    /// executes before the end of this job of the member. Calls may be executed between two jobs.
    pub(crate) fn mates(&self, place: usize, job: u64) -> Vec<(usize, u64)> {
        let mut found = Vec::new();
        for member in self.members.get(place).thread.iter() {
            if let Ok(mate) = self.members.places.binary_search(member)
                && mate != place
            {
                let is_before = mate < place || self.members.get(mate).task.has_calls;
                found.push((mate, if is_before { job } else { job.saturating_sub(1) }));
            }
        }
        found
    }

    /// Returns what the thread of the member at `place` executes before the end of this job of the member; with `is_whole`, before
    /// the end of the period of this job. A job takes 1 ns at least, since jobs of higher priority delay it too.
    pub(crate) fn demand(&mut self, place: usize, job: u64, is_whole: bool) -> Result<u64, NoBoundReason> {
        let mut demand = self.members.at(place).demand(job)?.max(1);
        for (mate, jobs) in self.mates(place, job) {
            let jobs = if is_whole { job } else { jobs };
            let of_mate = self.members.at(mate).demand(jobs)?;
            demand = demand.checked_add(of_mate).ok_or(NoBoundReason::Overflow)?;
        }
        Ok(demand)
    }
}
