//! Worst-case response times under preemptive fixed priorities (paper, eq. 19–20, and beyond one period).

use std::cmp::Ordering;
use std::collections::BTreeMap;

use crate::utilisation::Share;
use crate::{
    Analysis, Bound, CpuLoad, CycleMean, Demand, Method, NoBoundReason, Options, Response, StateMachine,
    Task, Time, TraceBound, Utilisation, Window,
};

/// Returns the worst-case response time of each of `tasks`: a bound that no schedule exceeds, or the reason why there
/// is none.
///
/// A task releases a job each `period` and executes it under preemptive fixed priorities; its clock may have any
/// phase. Late jobs of a task queue in order. hp(i) are the tasks of higher or equal priority on the CPU of i. A
/// half-open window of length t contains at most ⌈t/T⌉ releases, with a demand of at most M(⌈t/T⌉) ([`TraceBound`];
/// with [`Method::Classic`], n times the greatest cost).
///
/// The first job of a busy window, which begins with a simultaneous release of all tasks, ends at the least t > 0
/// with t = Mᵢ(1) + Σ over hp(i) of Mⱼ(⌈t/Tⱼ⌉), where Mᵢ(1) is at least 1 ns. If that is within the period, it is the
/// response time. Otherwise every job q of the window is analysed: f(q) is the least t with t = Mᵢ(q) + Σ Mⱼ(⌈t/Tⱼ⌉),
/// R = max f(q) − (q − 1)·T, up to the first q with f(q) ≤ q·T. (Where the CPU is loaded to exactly 100 %, there may
/// be no such q; then up to where f repeats.)
///
/// The order of `tasks` does not matter for any figure. `interrupt` is called now and then, at least once a task and
/// once for every pass over hp(i); it may unwind in order to cancel. Budgets are counted in steps, so that the same
/// tasks give the same figures everywhere.
///
/// In this version a task whose mask has several CPUs counts as one of unknown demand, as does one with a period of 0
/// or without a CPU.
///
/// ```
/// use mauve_timing::*;
///
/// let task = |name: &str, priority, period, cost| Task {
///     name: name.to_owned(),
///     priority,
///     period: Time::from_nanos(period),
///     deadline: Time::from_nanos(period),
///     jitter: Time::ZERO,
///     cpus: 1,
///     demand: Demand::Machine { machine: StateMachine::single(Time::from_nanos(cost)), whole: None },
/// };
/// let tasks = [task("laser", 2, 10, 4), task("pilot", 1, 30, 11)];
/// let options = Options { method: Method::Psm, horizon: None, is_brief: false };
/// let analysis = response_times(&tasks, &options, &|| ());
/// assert_eq!(analysis.responses[1].bound, Bound::Response(Time::from_nanos(19)));
/// ```
pub fn response_times(tasks: &[Task], options: &Options, interrupt: &dyn Fn()) -> Analysis {
    let unknown: Vec<usize> = (0..tasks.len()).filter(|&task| tasks[task].known().is_none()).collect();
    let mut responses: Vec<Response> = tasks
        .iter()
        .enumerate()
        .map(|(index, task)| {
            let in_the_way = |&other: &usize| {
                let other_task = &tasks[other];
                other == index || other_task.priority >= task.priority && other_task.cpus & task.cpus != 0
            };
            let because = unknown.iter().copied().filter(in_the_way).collect();
            Response {
                own: task.demand.own(options.method),
                first_job: None,
                // A task of known demand has one CPU, so one unknown task that may delay it is sufficient. All others
                // are analysed below.
                bound: Bound::NotAnalysed { because },
                window: None,
            }
        })
        .collect();

    let mut by_cpu: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (index, task) in tasks.iter().enumerate() {
        if let Some(cpu) = task.known() {
            by_cpu.entry(cpu).or_default().push(index);
        }
    }
    let mut cpus = Vec::with_capacity(by_cpu.len());
    for (&cpu, members) in &by_cpu {
        let mut walk = Walk::new(cpu, tasks, members, options, interrupt);
        cpus.push(CpuLoad {
            cpu,
            utilisation: Utilisation::sum(walk.members.iter().map(|member| member.share)),
            complete: !unknown.iter().any(|&task| tasks[task].cpus & (1 << cpu) != 0),
        });
        walk.analyse(
            |task| matches!(&responses[task].bound, Bound::NotAnalysed { because } if because.is_empty()),
        );
        for (task, response) in walk.results {
            responses[task] = response;
        }
    }
    Analysis { responses, cpus }
}

/// The budget of one task, in members of hp(i) that are visited.
const BUDGET: u64 = 1 << 23;

/// The budget of all tasks of a CPU, shared equally, so that the order of the tasks does not matter.
const BUDGET_OF_CPU: u64 = 1 << 28;

const BRIEF_BUDGET_OF_CPU: u64 = 1 << 17;

/// The minimum number of passes over all members for each task.
const FEWEST_PASSES: u64 = 16;

/// The maximum number of exact comparisons per CPU: the fractions have thousands of digits.
const MOST_EXACT: u32 = 8;

const KEPT_ITERATIONS: usize = 32;

struct Member<'a> {
    index: usize,
    task: &'a Task,
    period: u64,
    share: Share,
    curve: Curve<'a>,
}

/// The demand M of one task.
pub(crate) enum Curve<'a> {
    /// M(n) is n times this.
    Linear(u64),
    Trace(Box<TraceBound<'a>>),
}

impl<'a> Curve<'a> {
    pub(crate) fn new(
        task: &Task,
        machine: &'a StateMachine,
        method: Method,
        interrupt: &'a dyn Fn(),
    ) -> Curve<'a> {
        match method {
            Method::Classic => Curve::Linear(task.demand.own(method).unwrap_or_default().as_nanos()),
            Method::Psm | Method::Ibf | Method::Exact => {
                Curve::Trace(Box::new(TraceBound::interruptible(machine, interrupt)))
            }
        }
    }

    /// λ: see [`StateMachine::greatest_cycle_mean`].
    fn mean(&self) -> CycleMean {
        match self {
            Curve::Linear(cost) => CycleMean { cost: Time::from_nanos(*cost), length: 1 },
            Curve::Trace(bound) => bound.greatest_cycle_mean(),
        }
    }

    /// (n₀, c): see [`TraceBound::regularity`].
    fn regularity(&mut self) -> Option<(u64, u64)> {
        match self {
            Curve::Linear(_) => Some((0, 1)),
            Curve::Trace(bound) => bound.regularity(),
        }
    }

    pub(crate) fn demand(&mut self, jobs: u64) -> Result<u64, NoBoundReason> {
        match self {
            Curve::Linear(cost) => cost.checked_mul(jobs).ok_or(NoBoundReason::Overflow),
            Curve::Trace(bound) => bound.demand(jobs).map(Time::as_nanos),
        }
    }
}

/// The jobs that the tasks of hp(i) release in a window, and their demand: for each member, by its index.
///
/// In order of decreasing priority, windows only grow: hp(i) contains all tasks of higher priority and their hp, so
/// its fixed point is not less than theirs. So the counts of one task are a valid start for the next: they are below
/// its least fixed point, which the iteration reaches from there as well as from 0. Each count is stored with the
/// longest window for which it holds, so a pass over the members needs comparisons only.
struct Counts {
    /// The longest window in which `jobs` are released, jobs × T; of members not in hp(i), the longest there is.
    holds_until: Vec<u64>,
    /// 0 for members that are not in hp(i).
    jobs: Vec<u64>,
    time: Vec<u64>,
    /// Σ `time`. In 128 bits, so that the overflow of 64 bits does not depend on the order of the terms.
    total: u128,
    /// The number of members in hp(i).
    present: u64,
}

impl Clone for Counts {
    fn clone(&self) -> Counts {
        let mut copy = Counts::new(0);
        copy.clone_from(self);
        copy
    }

    /// Allocates nothing if there is room: a large group of equal priority copies its counts for each member.
    fn clone_from(&mut self, other: &Counts) {
        self.holds_until.clone_from(&other.holds_until);
        self.jobs.clone_from(&other.jobs);
        self.time.clone_from(&other.time);
        (self.total, self.present) = (other.total, other.present);
    }
}

impl Counts {
    fn new(members: usize) -> Counts {
        Counts {
            holds_until: vec![u64::MAX; members],
            jobs: vec![0; members],
            time: vec![0; members],
            total: 0,
            present: 0,
        }
    }

    /// Adds a member to hp(i), with the one job that every window has.
    fn include(&mut self, place: usize, period: u64, cost: u64) {
        self.holds_until[place] = period;
        self.jobs[place] = 1;
        self.time[place] = cost;
        self.total += u128::from(cost);
        self.present += 1;
    }

    fn exclude(&mut self, place: usize) {
        self.total -= u128::from(self.time[place]);
        self.holds_until[place] = u64::MAX;
        self.jobs[place] = 0;
        self.time[place] = 0;
        self.present -= 1;
    }

    /// Raises the counts to those of a window of length `window`. Returns whether any has changed.
    fn raise(&mut self, window: u64, members: &mut [Member]) -> Result<bool, NoBoundReason> {
        let mut has_changed = false;
        let mut failure = None;
        for (place, holds_until) in self.holds_until.iter_mut().enumerate() {
            if *holds_until >= window {
                continue;
            }
            let member = &mut members[place];
            let jobs = window.div_ceil(member.period);
            match member.curve.demand(jobs) {
                Ok(time) => {
                    *holds_until = jobs.saturating_mul(member.period);
                    self.jobs[place] = jobs;
                    self.total += u128::from(time - self.time[place]);
                    self.time[place] = time;
                    has_changed = true;
                }
                // Continue: the reported failure must not depend on the order of the members.
                Err(reason) => failure = failure.max(Some(reason)),
            }
        }
        failure.map_or(Ok(has_changed), Err)
    }
}

/// The analysis of one CPU.
struct Walk<'a> {
    cpu: u32,
    /// In the order of the tasks.
    members: Vec<Member<'a>>,
    options: &'a Options,
    interrupt: &'a dyn Fn(),
    exact_left: u32,
    results: Vec<(usize, Response)>,
}

impl<'a> Walk<'a> {
    fn new(
        cpu: u32,
        tasks: &'a [Task],
        members: &[usize],
        options: &'a Options,
        interrupt: &'a dyn Fn(),
    ) -> Walk<'a> {
        let mut walk = Walk {
            cpu,
            members: Vec::with_capacity(members.len()),
            options,
            interrupt,
            exact_left: MOST_EXACT,
            results: Vec::new(),
        };
        for &index in members {
            interrupt();
            let task = &tasks[index];
            let Demand::Machine { machine, .. } = &task.demand else { continue };
            let curve = Curve::new(task, machine, options.method, interrupt);
            let share = Share::new(curve.mean(), task.period);
            walk.members.push(Member { index, task, period: task.period.as_nanos(), share, curve });
        }
        walk
    }

    /// Analyses the tasks for which `is_wanted`, in order of decreasing priority.
    fn analyse(&mut self, is_wanted: impl Fn(usize) -> bool) {
        let mut places: Vec<usize> =
            (0..self.members.len()).filter(|&place| is_wanted(self.members[place].index)).collect();
        places.sort_by_key(|&place| std::cmp::Reverse(self.members[place].task.priority));
        let mut counts = Counts::new(self.members.len());
        // The utilisation of the tasks of higher or equal priority, and of those of higher priority.
        let mut utilisation = Utilisation::default();
        let mut load_above = Some(Ordering::Less);
        let priority = |walk: &Walk, place: usize| walk.members[place].task.priority;
        let mut rest = places.as_slice();
        while let Some(&first) = rest.first() {
            let size =
                rest.iter().take_while(|&&place| priority(self, place) == priority(self, first)).count();
            let (group, after) = rest.split_at(size);
            rest = after;
            for &place in group {
                utilisation.push(self.members[place].share);
            }
            let load = self.load(&utilisation, None, true);
            if let &[place] = group {
                let response = self.response(place, &mut counts, load_above, load);
                self.results.push((self.members[place].index, response));
                self.include(&mut counts, place);
            } else {
                let mut longest = 0;
                let mut all = counts.clone();
                let mut of_one = counts.clone();
                for &place in group {
                    self.include(&mut all, place);
                }
                // The whole group or none: the order within the group must not matter.
                let is_close = |&&place: &&usize| {
                    utilisation.compare_roughly(Some(&self.members[place].share)).is_none()
                };
                let close = group.iter().filter(is_close).count();
                let is_exact = u32::try_from(close).is_ok_and(|close| close <= self.exact_left);
                for &place in group {
                    of_one.clone_from(&all);
                    of_one.exclude(place);
                    let load_others = match load {
                        Some(Ordering::Less) => load,
                        _ => self.load(&utilisation, Some(place), is_exact),
                    };
                    let response = self.response(place, &mut of_one, load_others, load);
                    let window = response.window.as_ref().map(|window| window.length.as_nanos());
                    longest = longest.max(window.unwrap_or(0));
                    self.results.push((self.members[place].index, response));
                }
                // The start for the next group, which has the whole group in its hp, so its windows are not shorter.
                // (A demand that cannot be computed fails again there.)
                let _ = all.raise(longest, &mut self.members);
                counts = all;
            }
            load_above = load;
        }
    }

    fn include(&mut self, counts: &mut Counts, place: usize) {
        let member = &mut self.members[place];
        // M(1) is the greatest edge, so it can always be computed.
        let cost = member.curve.demand(1).unwrap_or(u64::MAX);
        counts.include(place, member.period, cost);
    }

    /// Compares a utilisation, optionally `without` that of one member, with 1. Returns `None` if the exact
    /// comparison is too expensive or not permitted.
    fn load(
        &mut self,
        utilisation: &Utilisation,
        without: Option<usize>,
        is_exact: bool,
    ) -> Option<Ordering> {
        let share = without.map(|place| self.members[place].share);
        if let Some(load) = utilisation.compare_roughly(share.as_ref()) {
            return Some(load);
        }
        self.exact_left = self.exact_left.checked_sub(1).filter(|_| is_exact)?;
        let others = share.map(|share| utilisation.without(&share));
        Some(others.as_ref().unwrap_or(utilisation).compare_with_one())
    }

    fn budget(&self) -> u64 {
        let members = (self.members.len() as u64).max(1);
        let of_cpu = if self.options.is_brief { BRIEF_BUDGET_OF_CPU } else { BUDGET_OF_CPU };
        (of_cpu / members).max(FEWEST_PASSES * members).min(BUDGET)
    }

    /// Returns the response of the member at `place`, starting from `counts` of hp(i) below its fixed point.
    ///
    /// `load_hp` compares the utilisation of hp(i) with 1, `load` that of hp(i) and the task itself; see [`Walk::load`].
    fn response(
        &mut self,
        place: usize,
        counts: &mut Counts,
        load_hp: Option<Ordering>,
        load: Option<Ordering>,
    ) -> Response {
        let own = self.own(place, 1).unwrap_or(u64::MAX);
        let mut response = Response {
            own: Some(Time::from_nanos(own)),
            first_job: None,
            bound: Bound::Unbounded { cpu: self.cpu },
            window: None,
        };
        let mut budget = self.budget();
        // M(n) ≥ λ·n, since λ is the limit of M(n)/n and M is subadditive. So where hp(i) has a utilisation of 1 or
        // more, Σ Mⱼ(⌈t/Tⱼ⌉) ≥ t, and no t is its own demand or more plus at least 1 ns: no first job ends. Where it is
        // less than 1, the demand grows more slowly than t, and one does.
        let first_job = match load_hp {
            Some(Ordering::Less) => self.fixed_point(place, 1, counts, &mut budget),
            Some(_) => Err(NoBoundReason::FullyLoaded),
            None => Err(NoBoundReason::Budget),
        };
        match first_job {
            Ok(length) if length <= self.members[place].period => {
                // Every job ends before the next one of this task is released, so no window has two of them, and this
                // length bounds them all. (The utilisation U of hp(i) and i is at most 1 then, so that this cannot hide
                // an overload. With t the length, t ≤ T: t ≥ Mᵢ(1) + Σ Mⱼ(⌈t/Tⱼ⌉) ≥ λᵢ·t/T + Σ λⱼ·t/Tⱼ = U·t.)
                response.first_job = Some(Time::from_nanos(length));
                self.conclude(&mut response, place, BusyJob { job: 1, length }, counts);
            }
            Ok(length) => {
                response.first_job = Some(Time::from_nanos(length));
                let busiest = match load {
                    Some(Ordering::Greater) => None,
                    // At a utilisation of less than 1, the window ends.
                    Some(load) => {
                        let last = if load == Ordering::Equal { self.last_job(place, counts) } else { None };
                        Some(self.busiest_job(place, length, last, counts, &mut budget))
                    }
                    None => Some(Err(NoBoundReason::Budget)),
                };
                match busiest {
                    Some(Ok(busiest)) => self.conclude(&mut response, place, busiest, counts),
                    Some(Err(reason)) => response.bound = no_bound(reason, load),
                    None => {}
                }
            }
            Err(_) if load == Some(Ordering::Greater) => {}
            Err(reason) => response.bound = no_bound(reason, load),
        }
        if let Some(horizon) = self.options.horizon {
            self.truncate(&mut response, place, horizon, counts);
        }
        response
    }

    fn own(&mut self, place: usize, jobs: u64) -> Result<u64, NoBoundReason> {
        self.members[place].curve.demand(jobs)
    }

    /// Computes f(q) for q = `jobs` by fixed-point iteration: raises `counts` until the window is as long as the
    /// demand.
    fn fixed_point(
        &mut self,
        place: usize,
        jobs: u64,
        counts: &mut Counts,
        budget: &mut u64,
    ) -> Result<u64, NoBoundReason> {
        // A job without demand is preempted by jobs of higher priority too, so its demand is 1 ns.
        let own = self.own(place, jobs)?.max(1);
        loop {
            (self.interrupt)();
            *budget = budget.checked_sub(counts.present + 1).ok_or(NoBoundReason::Budget)?;
            let window =
                u64::try_from(u128::from(own) + counts.total).map_err(|_| NoBoundReason::Overflow)?;
            if !counts.raise(window, &mut self.members)? {
                return Ok(window);
            }
        }
    }

    /// At a utilisation of 1 for hp(i) and i: returns the job up to which an unfinished window contains all response
    /// times. `None` if that job is not found.
    ///
    /// Let Mⱼ(n + cⱼ) = Mⱼ(n) + cⱼ·λⱼ for n ≥ nⱼ, and so for i, and let H be a common multiple of all cⱼ·Tⱼ and cᵢ·Tᵢ,
    /// and L = H/Tᵢ. While the window lasts, f(q) > (q − 1)·Tᵢ. So for (q − 1)·Tᵢ ≥ nⱼ·Tⱼ and q ≥ nᵢ, both sides of
    /// t = Mᵢ(q) + Σ Mⱼ(⌈t/Tⱼ⌉) grow by H, since Σ λ/T = 1, when t grows by H and q by L: f(q + L) = f(q) + H. Job q + L
    /// responds as q does, and ends the window if and only if q does.
    fn last_job(&mut self, place: usize, counts: &Counts) -> Option<u64> {
        let own_period = self.members[place].period;
        let mut first_regular = 1u64;
        let mut lap = 1u64;
        for (other, member) in self.members.iter_mut().enumerate() {
            if other != place && counts.jobs[other] == 0 {
                continue;
            }
            (self.interrupt)();
            let (start, length) = member.curve.regularity()?;
            let start =
                if other == place { start } else { start.checked_mul(member.period)?.div_ceil(own_period) };
            first_regular = first_regular.max(start.checked_add(1)?);
            lap = least_common_multiple(lap, length.checked_mul(member.period)?)?;
        }
        first_regular.checked_add(lap / own_period)
    }

    /// Returns the job of the busy window with the greatest response time. The first job ends at `first`, after the
    /// next release. Jobs after `last` are not analysed.
    fn busiest_job(
        &mut self,
        place: usize,
        first: u64,
        last: Option<u64>,
        counts: &mut Counts,
        budget: &mut u64,
    ) -> Result<BusyJob, NoBoundReason> {
        let period = self.members[place].period;
        let mut greatest = BusyJob { job: 1, length: first };
        let mut greatest_response = first;
        let mut job = 1u64;
        let mut length = first;
        // The release of the job after this one.
        let mut next_release = period;
        while length > next_release && last.is_none_or(|last| job < last) {
            job += 1;
            length = self.fixed_point(place, job, counts, budget)?;
            // The job ends after its release, since the window is longer than that.
            let response = length.saturating_sub(next_release);
            if response > greatest_response {
                greatest_response = response;
                greatest = BusyJob { job, length };
            }
            next_release = next_release.checked_add(period).ok_or(NoBoundReason::Overflow)?;
        }
        Ok(greatest)
    }

    fn conclude(&mut self, response: &mut Response, place: usize, busiest: BusyJob, counts: &Counts) {
        let BusyJob { job, length } = busiest;
        let period = self.members[place].period;
        let own = self.own(place, job);
        let released = period.checked_mul(job - 1);
        let (Ok(own), Some(time)) = (own, released.and_then(|released| length.checked_sub(released))) else {
            // Both were computed before.
            response.bound = Bound::NoBound(NoBoundReason::Overflow);
            return;
        };
        let time = Time::from_nanos(time);
        let iterations =
            if time > self.members[place].task.deadline { self.iterations(own, counts, None) } else { None };
        response.bound = Bound::Response(time);
        response.window = Some(Window {
            job,
            own: Time::from_nanos(own),
            length: Time::from_nanos(length),
            iterations: iterations.unwrap_or_default(),
        });
    }

    /// Returns the last values of the fixed-point iteration of the paper, eq. 19–20, from `own` on, with the tasks of
    /// hp(i) in `counts`. `None` if it exceeds the budget or 64 bits.
    fn iterations(&mut self, own: u64, counts: &Counts, horizon: Option<Time>) -> Option<Vec<Time>> {
        let own = own.max(1);
        let mut budget = self.budget();
        let mut window = own;
        let mut values = std::collections::VecDeque::with_capacity(KEPT_ITERATIONS);
        loop {
            (self.interrupt)();
            if values.len() == KEPT_ITERATIONS {
                values.pop_front();
            }
            values.push_back(Time::from_nanos(window));
            budget = budget.checked_sub(counts.present + 1)?;
            let mut demand = u128::from(own);
            for (member, _) in self.members.iter_mut().zip(&counts.jobs).filter(|&(_, &jobs)| jobs > 0) {
                let jobs = jobs_released(window, member.period, horizon);
                demand += u128::from(member.curve.demand(jobs).ok()?);
            }
            let demand = u64::try_from(demand).ok()?;
            if demand == window {
                return Some(values.into());
            }
            window = demand;
        }
    }

    /// Replaces the first job's end by that under the horizon of the paper.
    fn truncate(&mut self, response: &mut Response, place: usize, horizon: Time, counts: &Counts) {
        let own = self.own(place, 1).unwrap_or(u64::MAX);
        let iterations = self.iterations(own, counts, Some(horizon)).unwrap_or_default();
        response.first_job = iterations.last().copied();
    }
}

/// A job q of a busy window, from 1, and f(q).
#[derive(Clone, Copy)]
struct BusyJob {
    job: u64,
    length: u64,
}

/// Returns the least common multiple, or `None` on overflow; both numbers are greater than 0.
fn least_common_multiple(a: u64, b: u64) -> Option<u64> {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1)).checked_mul(b)
}

/// Returns the number of jobs that are released in a window, up to the horizon.
pub(crate) fn jobs_released(window: u64, period: u64, horizon: Option<Time>) -> u64 {
    horizon.map_or(window, |horizon| window.min(horizon.as_nanos())).div_ceil(period)
}

fn no_bound(reason: NoBoundReason, load: Option<Ordering>) -> Bound {
    let is_full = reason == NoBoundReason::Budget && load == Some(Ordering::Equal);
    Bound::NoBound(if is_full { NoBoundReason::FullyLoaded } else { reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{brute_force_cycle_mean, machine, machines};
    use crate::{Breakdown, Edge, Interference, Status};
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    const PSM: Options = Options { method: Method::Psm, horizon: None, is_brief: false };
    const CLASSIC: Options = Options { method: Method::Classic, horizon: None, is_brief: false };

    fn task(name: &str, priority: u32, period: u64, machine: StateMachine) -> Task {
        Task {
            name: name.to_owned(),
            priority,
            period: Time::from_nanos(period),
            deadline: Time::from_nanos(period),
            jitter: Time::ZERO,
            cpus: 1,
            demand: Demand::Machine { machine, whole: None },
        }
    }

    fn single(name: &str, priority: u32, period: u64, cost: u64) -> Task {
        task(name, priority, period, StateMachine::single(Time::from_nanos(cost)))
    }

    fn unknown(name: &str, priority: u32, cpus: u64) -> Task {
        Task { demand: Demand::Unknown, cpus, ..single(name, priority, 10, 0) }
    }

    fn analyse(tasks: &[Task], options: Options) -> Analysis {
        response_times(tasks, &options, &|| ())
    }

    fn interference(tasks: &[Task], options: Options, of: usize, response: &Response) -> Vec<Interference> {
        Breakdown::new(tasks, &options, &|| ()).of(of, response.window.as_ref(), response.first_job)
    }

    fn show(tasks: &[Task], options: Options) -> String {
        let analysis = analyse(tasks, options);
        let mut lines = String::new();
        for (index, (task, response)) in tasks.iter().zip(&analysis.responses).enumerate() {
            let own = response.own.map_or("?".to_owned(), |own| own.as_nanos().to_string());
            lines.push_str(&format!("{}: own {own}", task.name));
            if let Some(first_job) = response.first_job {
                lines.push_str(&format!(", first job {}", first_job.as_nanos()));
            }
            let bound = match &response.bound {
                Bound::Response(time) => format!(", response {}", time.as_nanos()),
                Bound::Unbounded { cpu } => format!(", unbounded on {cpu}"),
                Bound::NoBound(reason) => format!(", no bound: {reason:?}"),
                Bound::NotAnalysed { because } => {
                    let names: Vec<&str> = because.iter().map(|&task| tasks[task].name.as_str()).collect();
                    format!(", not analysed because of {}", names.join(" "))
                }
            };
            lines.push_str(&format!("{bound} ({})", response.status(task.deadline)));
            for part in interference(tasks, options, index, response) {
                let name = &tasks[part.task].name;
                lines.push_str(&format!(", {name} {} jobs {}", part.jobs, part.time.as_nanos()));
            }
            if let Some(window) = &response.window {
                let (own, length) = (window.own.as_nanos(), window.length.as_nanos());
                lines.push_str(&format!(", window of {} jobs {own} in {length}", window.job));
                let iterations: Vec<u64> = window.iterations.iter().map(|time| time.as_nanos()).collect();
                if !iterations.is_empty() {
                    lines.push_str(&format!(" {iterations:?}"));
                }
            }
            lines.push('\n');
        }
        for load in &analysis.cpus {
            let complete = if load.complete { "" } else { " at least" };
            lines.push_str(&format!("cpu {}{complete} {:.3}\n", load.cpu, load.utilisation.as_f64()));
        }
        lines
    }

    fn check(tasks: &[Task], options: Options, expected: Expect) {
        expected.assert_eq(&show(tasks, options));
    }

    #[test]
    fn within_the_period() {
        let tasks = [single("low", 1, 30, 11), single("high", 3, 10, 4)];
        check(
            &tasks,
            PSM,
            expect![[r#"
            low: own 11, first job 19, response 19 (met), high 2 jobs 8, window of 1 jobs 11 in 19
            high: own 4, first job 4, response 4 (met), window of 1 jobs 4 in 4
            cpu 0 0.767
        "#]],
        );
    }

    #[test]
    fn the_worst_job_of_the_window() {
        // Lehoczky, RTSS 1990, example 2: the first of several jobs.
        check(
            &[single("high", 2, 100, 52), single("low", 1, 140, 52)],
            PSM,
            expect![[r#"
            high: own 52, first job 52, response 52 (met), window of 1 jobs 52 in 52
            low: own 52, first job 156, response 156 (missed), high 2 jobs 104, window of 1 jobs 52 in 156 [52, 104, 156]
            cpu 0 0.891
        "#]],
        );
        // Example 1: the fifth of seven, though the first is late as well.
        check(
            &[single("high", 2, 70, 26), single("low", 1, 100, 62)],
            PSM,
            expect![[r#"
            high: own 26, first job 26, response 26 (met), window of 1 jobs 26 in 26
            low: own 62, first job 114, response 118 (missed), high 8 jobs 208, window of 5 jobs 310 in 518 [310, 440, 492, 518]
            cpu 0 0.991
        "#]],
        );
    }

    #[test]
    fn a_heavy_edge_that_cannot_repeat() {
        let plan = machine(2, &[(0, 0, 1), (0, 1, 9), (1, 0, 1)]);
        let tasks = [task("plan", 2, 10, plan), single("drive", 1, 40, 4)];
        check(
            &tasks,
            PSM,
            expect![[r#"
            plan: own 9, first job 9, response 9 (met), window of 1 jobs 9 in 9
            drive: own 4, first job 14, response 14 (met), plan 2 jobs 10, window of 1 jobs 4 in 14
            cpu 0 0.600
        "#]],
        );
        check(
            &tasks,
            CLASSIC,
            expect![[r#"
            plan: own 9, first job 9, response 9 (met), window of 1 jobs 9 in 9
            drive: own 4, first job 40, response 40 (met), plan 4 jobs 36, window of 1 jobs 4 in 40
            cpu 0 1.000
        "#]],
        );
    }

    #[test]
    fn equal_priorities_delay_each_other() {
        check(
            &[single("a", 1, 10, 3), single("b", 1, 10, 3), single("c", 1, 20, 2)],
            PSM,
            expect![[r#"
            a: own 3, first job 8, response 8 (met), b 1 jobs 3, c 1 jobs 2, window of 1 jobs 3 in 8
            b: own 3, first job 8, response 8 (met), a 1 jobs 3, c 1 jobs 2, window of 1 jobs 3 in 8
            c: own 2, first job 8, response 8 (met), a 1 jobs 3, b 1 jobs 3, window of 1 jobs 2 in 8
            cpu 0 0.700
        "#]],
        );
    }

    #[test]
    fn exactly_full() {
        // Each of the jobs ends 1 late: the window does not end, and no job takes longer than 4.
        check(
            &[task("alone", 1, 3, machine(2, &[(0, 0, 3), (0, 1, 4), (1, 0, 2), (1, 1, 1)]))],
            PSM,
            expect![[r#"
                alone: own 4, first job 4, response 4 (missed), window of 1 jobs 4 in 4 [4]
                cpu 0 1.000
            "#]],
        );
        // The sum is 1, and the first job of what is below never ends.
        check(
            &[single("all", 2, 5, 5), single("none", 1, 5, 0)],
            PSM,
            expect![[r#"
            all: own 5, first job 5, response 5 (met), window of 1 jobs 5 in 5
            none: own 0, no bound: FullyLoaded (no-bound)
            cpu 0 1.000
        "#]],
        );
        // The first job is 2 late, and so are all that follow.
        let late = machine(2, &[(0, 1, 4), (1, 1, 2)]);
        check(
            &[single("half", 2, 4, 2), task("late", 1, 4, late)],
            PSM,
            expect![[r#"
                half: own 2, first job 2, response 2 (met), window of 1 jobs 2 in 2
                late: own 4, first job 8, response 8 (missed), half 2 jobs 4, window of 1 jobs 4 in 8 [4, 6, 8]
                cpu 0 1.000
            "#]],
        );
    }

    #[test]
    fn more_than_full() {
        let tasks = [
            single("half", 3, 10, 5),
            single("more", 2, 10, 6),
            single("below", 1, 100, 1),
            Task { cpus: 2, ..single("elsewhere", 0, 100, 1) },
        ];
        check(
            &tasks,
            PSM,
            expect![[r#"
            half: own 5, first job 5, response 5 (met), window of 1 jobs 5 in 5
            more: own 6, first job 16, unbounded on 0 (unbounded), half 2 jobs 10
            below: own 1, unbounded on 0 (unbounded)
            elsewhere: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
            cpu 0 1.110
            cpu 1 0.010
        "#]],
        );
        let all = |task: &Task| Task { priority: 1, ..task.clone() };
        check(
            &tasks.iter().map(all).collect::<Vec<_>>(),
            PSM,
            expect![[r#"
            half: own 5, first job 18, unbounded on 0 (unbounded), more 2 jobs 12, below 1 jobs 1
            more: own 6, first job 17, unbounded on 0 (unbounded), half 2 jobs 10, below 1 jobs 1
            below: own 1, unbounded on 0 (unbounded)
            elsewhere: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
            cpu 0 1.110
            cpu 1 0.010
        "#]],
        );
    }

    #[test]
    fn nothing_to_execute() {
        check(
            &[single("a", 1, 10, 0)],
            PSM,
            expect![[r#"
            a: own 0, first job 1, response 1 (met), window of 1 jobs 0 in 1
            cpu 0 0.000
        "#]],
        );
        check(
            &[single("high", 2, 10, 4), single("low", 1, 10, 0)],
            PSM,
            expect![[r#"
            high: own 4, first job 4, response 4 (met), window of 1 jobs 4 in 4
            low: own 0, first job 5, response 5 (met), high 1 jobs 4, window of 1 jobs 0 in 5
            cpu 0 0.400
        "#]],
        );
        check(&[], PSM, expect![[""]]);
    }

    #[test]
    fn unknown_demand() {
        let tasks = [
            single("above", 5, 10, 1),
            unknown("lost", 4, 1),
            single("equal", 4, 10, 1),
            Task { cpus: 2, ..single("elsewhere", 1, 10, 1) },
            unknown("lower", 3, 1),
            single("below", 2, 10, 1),
        ];
        check(
            &tasks,
            PSM,
            expect![[r#"
            above: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
            lost: own ?, not analysed because of lost (not-analysed)
            equal: own 1, not analysed because of lost (not-analysed)
            elsewhere: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
            lower: own ?, not analysed because of lost lower (not-analysed)
            below: own 1, not analysed because of lost lower (not-analysed)
            cpu 0 at least 0.300
            cpu 1 0.100
        "#]],
        );
    }

    #[test]
    fn what_counts_as_unknown() {
        let tasks = [
            Task { cpus: 3, ..single("two", 3, 10, 1) },
            Task { cpus: 0, ..single("none", 3, 10, 1) },
            single("never", 3, 0, 1),
            Task { cpus: 2, ..single("one", 1, 10, 1) },
            Task { cpus: 4, ..single("other", 1, 10, 1) },
        ];
        check(
            &tasks,
            PSM,
            expect![[r#"
            two: own 1, not analysed because of two never (not-analysed)
            none: own 1, not analysed because of none (not-analysed)
            never: own 1, not analysed because of two never (not-analysed)
            one: own 1, not analysed because of two (not-analysed)
            other: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
            cpu 1 at least 0.100
            cpu 2 0.100
        "#]],
        );
    }

    #[test]
    fn a_declared_time_is_for_the_classic_method() {
        let declared = |cost, whole| Task {
            demand: Demand::Machine {
                machine: StateMachine::single(Time::from_nanos(cost)),
                whole: Some(Time::from_nanos(whole)),
            },
            ..single("a", 1, 10, 0)
        };
        check(
            &[declared(3, 4)],
            PSM,
            expect![[r#"
            a: own 3, first job 3, response 3 (met), window of 1 jobs 3 in 3
            cpu 0 0.300
        "#]],
        );
        check(
            &[declared(3, 4)],
            CLASSIC,
            expect![[r#"
            a: own 4, first job 4, response 4 (met), window of 1 jobs 4 in 4
            cpu 0 0.400
        "#]],
        );
        check(
            &[declared(3, 2)],
            CLASSIC,
            expect![[r#"
            a: own 3, first job 3, response 3 (met), window of 1 jobs 3 in 3
            cpu 0 0.300
        "#]],
        );
    }

    #[test]
    fn a_horizon_cuts_the_first_job_only() {
        let tasks = [single("high", 2, 10, 9), single("low", 1, 100, 20), single("none", 0, 10, 10)];
        let options = Options { method: Method::Psm, horizon: Some(Time::from_nanos(25)), is_brief: false };
        check(
            &tasks,
            options,
            expect![[r#"
            high: own 9, first job 9, response 9 (met), window of 1 jobs 9 in 9
            low: own 20, first job 47, unbounded on 0 (unbounded), high 3 jobs 27
            none: own 10, first job 57, unbounded on 0 (unbounded), high 3 jobs 27, low 1 jobs 20
            cpu 0 2.100
        "#]],
        );
    }

    #[test]
    fn times_that_do_not_fit() {
        let huge = u64::MAX / 2 + 1;
        let tasks =
            [single("a", 3, u64::MAX, huge), single("b", 2, u64::MAX, huge - 2), single("c", 1, u64::MAX, 2)];
        let found = analyse(&tasks, PSM);
        assert_eq!(found.responses[1].bound, Bound::Response(Time::from_nanos(u64::MAX - 1)));
        assert_eq!(found.responses[2].bound, Bound::Unbounded { cpu: 0 });
        // λ of b is 0, so the load is less than 1, but a leaves too little for its first job.
        let quarter = u64::MAX / 4 + 1;
        let once = machine(2, &[(0, 1, 4096), (1, 1, 0)]);
        let tasks = [
            single("a", 3, quarter, quarter - 1024),
            task("b", 2, quarter, once),
            single("c", 2, u64::MAX, 1),
            single("d", 1, u64::MAX, 1),
        ];
        let found = analyse(&tasks, PSM);
        for response in &found.responses[1..] {
            assert_eq!(response.bound, Bound::NoBound(NoBoundReason::Overflow));
        }
    }

    #[test]
    fn a_search_ends() {
        // One part in 10¹² is left, so the first job of `low` takes 10⁷ jobs of `high`.
        let period = 1_000_000_000_000;
        let tasks = [single("high", 2, period, period - 1), single("low", 1, u64::MAX, 10_000_000)];
        check(
            &tasks,
            PSM,
            expect![[r#"
            high: own 999999999999, first job 999999999999, response 999999999999 (met), window of 1 jobs 999999999999 in 999999999999
            low: own 10000000, no bound: Budget (no-bound)
            cpu 0 1.000
        "#]],
        );
    }

    #[test]
    fn an_interrupt_may_unwind() {
        let tasks = [single("high", 2, 10, 4), single("low", 1, 30, 11)];
        let calls = std::cell::Cell::new(0);
        let unwound = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            response_times(&tasks, &PSM, &|| {
                calls.set(calls.get() + 1);
                assert!(calls.get() < 4, "cancelled");
            })
        }));
        assert!(unwound.is_err());
    }

    /// The definition: every t from 1 on, every job from the first, M by the recurrence, rationals by common
    /// denominator.
    mod plain {
        use super::*;

        pub(super) struct Found {
            pub(super) first_job: Option<u64>,
            pub(super) bound: Bound,
            pub(super) window: Option<(u64, u64, u64)>,
        }

        /// Windows are followed up to here.
        pub(super) const LONGEST: u64 = 3000;

        /// M(0), M(1), …
        fn demands(task: &Task, method: Method) -> Vec<u64> {
            let Demand::Machine { machine, whole } = &task.demand else { panic!("known") };
            if method == Method::Classic {
                let cost = machine.greatest_cost().max(whole.unwrap_or_default()).as_nanos();
                return (0..=LONGEST).map(|jobs| jobs * cost).collect();
            }
            let mut current = vec![0; machine.states() as usize];
            let mut demands = vec![0];
            for _ in 0..LONGEST {
                let mut next = vec![0; current.len()];
                for edge in machine.edges() {
                    let total = edge.cost.as_nanos() + current[edge.target as usize];
                    next[edge.source as usize] = total.max(next[edge.source as usize]);
                }
                current = next;
                demands.push(current.iter().copied().max().unwrap());
            }
            demands
        }

        fn load(tasks: &[&Task], method: Method) -> Ordering {
            let mean = |task: &&Task| {
                let Demand::Machine { machine, whole } = &task.demand else { panic!("known") };
                let (cost, length) = match method {
                    Method::Classic => (machine.greatest_cost().max(whole.unwrap_or_default()).as_nanos(), 1),
                    _ => brute_force_cycle_mean(machine),
                };
                (u128::from(cost), u128::from(length * task.period.as_nanos()))
            };
            let means: Vec<(u128, u128)> = tasks.iter().map(mean).collect();
            let denominator: u128 = means.iter().map(|mean| mean.1).product();
            let numerator: u128 = means.iter().map(|mean| mean.0 * (denominator / mean.1)).sum();
            numerator.cmp(&denominator)
        }

        /// `None` where a window that may end is too long.
        pub(super) fn response(tasks: &[Task], index: usize, method: Method) -> Option<Found> {
            let task = &tasks[index];
            let is_known = |task: &Task| {
                task.cpus.count_ones() == 1 && task.period > Time::ZERO && task.demand != Demand::Unknown
            };
            let at_least_as_urgent = |other: &usize| {
                *other != index
                    && tasks[*other].priority >= task.priority
                    && tasks[*other].cpus & task.cpus != 0
            };
            let because: Vec<usize> = (0..tasks.len())
                .filter(|other| *other == index || at_least_as_urgent(other))
                .filter(|&other| !is_known(&tasks[other]))
                .collect();
            if !because.is_empty() {
                return Some(Found { first_job: None, bound: Bound::NotAnalysed { because }, window: None });
            }
            let hp: Vec<&Task> =
                (0..tasks.len()).filter(at_least_as_urgent).map(|other| &tasks[other]).collect();
            let all: Vec<&Task> = hp.iter().copied().chain([task]).collect();
            let (load_hp, load_all) = (load(&hp, method), load(&all, method));
            let own = demands(task, method);
            let others: Vec<(u64, Vec<u64>)> =
                hp.iter().map(|other| (other.period.as_nanos(), demands(other, method))).collect();
            let end_of = |job: u64, from: u64| {
                (from..LONGEST).find(|&length| {
                    let interference =
                        others.iter().map(|(period, demands)| demands[length.div_ceil(*period) as usize]);
                    own[job as usize].max(1) + interference.sum::<u64>() == length
                })
            };
            let unbounded = Bound::Unbounded { cpu: task.cpus.trailing_zeros() };
            let fully_loaded = Bound::NoBound(NoBoundReason::FullyLoaded);
            if load_hp != Ordering::Less {
                let bound = if load_all == Ordering::Greater { unbounded } else { fully_loaded };
                return Some(Found { first_job: None, bound, window: None });
            }
            let first_job = end_of(1, 1)?;
            if load_all == Ordering::Greater {
                return Some(Found { first_job: Some(first_job), bound: unbounded, window: None });
            }
            let period = task.period.as_nanos();
            let (mut worst, mut worst_response) = ((1, first_job), first_job);
            let (mut job, mut length) = (1, first_job);
            while length > job * period {
                job += 1;
                length = match end_of(job, length) {
                    Some(length) => length,
                    // It may never end. What has been seen is compared with.
                    None if load_all == Ordering::Equal => break,
                    None => return None,
                };
                if length - (job - 1) * period > worst_response {
                    (worst, worst_response) = ((job, length), length - (job - 1) * period);
                }
            }
            let (job, length) = worst;
            Some(Found {
                first_job: Some(first_job),
                bound: Bound::Response(Time::from_nanos(worst_response)),
                window: Some((job, own[job as usize], length)),
            })
        }
    }

    fn demands() -> impl Strategy<Value = Demand> {
        let known = (machines(4, 7), proptest::option::of(0..8u64))
            .prop_map(|(machine, whole)| Demand::Machine { machine, whole: whole.map(Time::from_nanos) });
        prop_oneof![12 => known, 1 => Just(Demand::Unknown)]
    }

    prop_compose! {
        fn any_task()(
            priority in 0..4u32,
            period in 1..16u64,
            deadline in 1..20u64,
            cpus in prop_oneof![20 => Just(1u64), 4 => Just(2u64), 1 => Just(3u64), 1 => Just(0u64)],
            demand in demands(),
        ) -> Task {
            Task {
                name: String::new(),
                priority,
                period: Time::from_nanos(period),
                deadline: Time::from_nanos(deadline),
                jitter: Time::ZERO,
                cpus,
                demand,
            }
        }
    }

    fn any_tasks() -> impl Strategy<Value = Vec<Task>> {
        proptest::collection::vec(any_task(), 1..6)
    }

    /// Costs of at least 1 ns, so that multiplying all times changes nothing else.
    fn known_tasks() -> impl Strategy<Value = Vec<Task>> {
        let task = (0..4u32, 1..30u64, machines(4, 7)).prop_map(|(priority, period, machine)| {
            let edges = machine.edges().iter().map(|edge| Edge {
                cost: edge.cost.checked_add(Time::from_nanos(1)).unwrap(),
                ..edge.clone()
            });
            task("", priority, period, StateMachine::new(machine.states(), edges.collect()).unwrap())
        });
        proptest::collection::vec(task, 1..6)
    }

    /// Infinite where there is no bound.
    fn bound(response: &Response) -> u64 {
        match response.bound {
            Bound::Response(time) => time.as_nanos(),
            _ => u64::MAX,
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1500))]

        #[test]
        fn equals_the_definition(tasks in any_tasks(), is_psm: bool) {
            let options = if is_psm { PSM } else { CLASSIC };
            let analysis = analyse(&tasks, options);
            for (index, response) in analysis.responses.iter().enumerate() {
                let Some(expected) = plain::response(&tasks, index, options.method) else { continue };
                if response.window.as_ref().is_some_and(|window| window.length.as_nanos() >= plain::LONGEST) {
                    continue;
                }
                prop_assert_eq!(&response.bound, &expected.bound);
                prop_assert_eq!(response.first_job.map(Time::as_nanos), expected.first_job);
                let window = response.window.as_ref();
                let found = window.map(|window| (window.job, window.own.as_nanos(), window.length.as_nanos()));
                prop_assert_eq!(found, expected.window);
                // The story adds up.
                let parts = interference(&tasks, options, index, response);
                let interference: u64 = parts.iter().map(|part| part.time.as_nanos()).sum();
                if let Some(window) = window {
                    prop_assert_eq!(window.own.as_nanos().max(1) + interference, window.length.as_nanos());
                    if response.status(tasks[index].deadline) == Status::Missed {
                        prop_assert_eq!(window.iterations.last(), Some(&window.length));
                    }
                } else if let Some(first_job) = response.first_job {
                    let own = response.own.unwrap().as_nanos();
                    prop_assert_eq!(own.max(1) + interference, first_job.as_nanos());
                } else {
                    prop_assert!(parts.is_empty());
                }
            }
        }

        #[test]
        fn the_order_of_the_tasks_does_not_matter(
            (tasks, shuffled) in any_tasks().prop_flat_map(|tasks| {
                let order: Vec<usize> = (0..tasks.len()).collect();
                (Just(tasks), Just(order).prop_shuffle())
            }),
            horizon in proptest::option::of((0..40u64).prop_map(Time::from_nanos)),
            is_psm: bool,
        ) {
            let options = Options { method: if is_psm { Method::Psm } else { Method::Classic }, horizon, is_brief: false };
            let straight = analyse(&tasks, options);
            let other_tasks: Vec<Task> = shuffled.iter().map(|&task| tasks[task].clone()).collect();
            let other = analyse(&other_tasks, options);
            prop_assert_eq!(&straight.cpus, &other.cpus);
            for (place, &task) in shuffled.iter().enumerate() {
                let mut response = other.responses[place].clone();
                if let Bound::NotAnalysed { because } = &mut response.bound {
                    because.iter_mut().for_each(|task| *task = shuffled[*task]);
                    because.sort_unstable();
                }
                let of_straight = &straight.responses[task];
                prop_assert_eq!(of_straight, &response);
                let mut parts = interference(&other_tasks, options, place, &response);
                parts.iter_mut().for_each(|part| part.task = shuffled[part.task]);
                parts.sort_unstable_by_key(|part| part.task);
                prop_assert_eq!(interference(&tasks, options, task, of_straight), parts);
            }
        }

        #[test]
        fn a_brief_analysis_gives_no_other_bound(tasks in known_tasks()) {
            let brief = analyse(&tasks, Options { is_brief: true, ..PSM });
            for (brief, full) in brief.responses.iter().zip(analyse(&tasks, PSM).responses) {
                if !matches!(brief.bound, Bound::NoBound(_)) {
                    prop_assert_eq!(&brief.bound, &full.bound);
                }
            }
        }

        #[test]
        fn the_unit_of_time_does_not_matter(tasks in known_tasks(), factor in 1..1_000_000_000u64) {
            let scale = |time: Time| time.checked_mul(factor).unwrap();
            let scaled: Vec<Task> = tasks
                .iter()
                .map(|task| {
                    let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
                    let edges =
                        machine.edges().iter().map(|edge| Edge { cost: scale(edge.cost), ..edge.clone() });
                    let machine = StateMachine::new(machine.states(), edges.collect()).unwrap();
                    Task {
                        period: scale(task.period),
                        demand: Demand::Machine { machine, whole: None },
                        ..task.clone()
                    }
                })
                .collect();
            for (small, large) in analyse(&tasks, PSM).responses.iter().zip(&analyse(&scaled, PSM).responses) {
                prop_assert_eq!(small.first_job.map(scale), large.first_job);
                match small.bound {
                    Bound::Response(time) => prop_assert_eq!(&large.bound, &Bound::Response(scale(time))),
                    _ => prop_assert_eq!(&small.bound, &large.bound),
                }
            }
        }

        #[test]
        fn longer_shorter_and_more_urgent(tasks in known_tasks(), changed: prop::sample::Index, by in 1..5u64) {
            let changed = changed.index(tasks.len());
            let before = analyse(&tasks, PSM);
            let with = |change: &dyn Fn(&mut Task)| {
                let mut tasks = tasks.clone();
                change(&mut tasks[changed]);
                analyse(&tasks, PSM)
            };
            let all_no_lower = |after: &Analysis| {
                before.responses.iter().zip(&after.responses).all(|(before, after)| bound(before) <= bound(after))
            };
            let with_longer_edge = with(&|task| {
                let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
                let mut edges = machine.edges().to_vec();
                edges[0].cost = edges[0].cost.checked_add(Time::from_nanos(by)).unwrap();
                let machine = StateMachine::new(machine.states(), edges).unwrap();
                task.demand = Demand::Machine { machine, whole: None };
            });
            prop_assert!(all_no_lower(&with_longer_edge));
            let with_shorter_period = with(&|task| {
                task.period = Time::from_nanos(task.period.as_nanos().saturating_sub(by).max(1));
            });
            prop_assert!(all_no_lower(&with_shorter_period));
            // More urgent: not later itself, and the others not earlier.
            let after = with(&|task| task.priority += by as u32);
            for (index, (before, after)) in before.responses.iter().zip(&after.responses).enumerate() {
                if index == changed {
                    prop_assert!(bound(before) >= bound(after));
                } else {
                    prop_assert!(bound(before) <= bound(after));
                }
            }
        }

        #[test]
        fn psm_is_never_above_classic(tasks in any_tasks()) {
            let (psm, classic) = (analyse(&tasks, PSM), analyse(&tasks, CLASSIC));
            for (psm, classic) in psm.responses.iter().zip(&classic.responses) {
                prop_assert!(bound(psm) <= bound(classic));
            }
        }
    }
}
