//! The analysis of tasks on one CPU, real or imaginary: the fixed points of paper, eq. 19–20, and beyond one period.

use std::cmp::{Ordering, Reverse};

use crate::exact;
use crate::lane::{BusyJob, BusyWindow, JobCounts, Lane, LaneMember};
use crate::time::least_common_multiple;
use crate::utilisation::TaskShare;
use crate::{Bound, Counted, CpuRule, Method, NoBoundReason, Response, Time, Utilisation, Window};

/// The budget of one task, in members of hp(i) that are visited.
const BUDGET: u64 = 1 << 23;

/// The budget of all tasks, shared equally, so that their order does not matter.
const BUDGET_OF_ALL: u64 = 1 << 28;

const BRIEF_BUDGET_OF_ALL: u64 = 1 << 17;

/// A response after so many deadlines is hopeless: what is left of the budget is little then.
const HOPELESS: u64 = 256;
const BUDGET_IF_HOPELESS: u64 = 1 << 15;

/// The budget of all tasks for [`Method::Exact`], shared equally, in visited members and values of request functions:
/// about 0.5 s.
const BUDGET_OF_PATHS: u64 = 1 << 28;

/// The same for [`Method::Best`]: about 3 ms.
const SMALL_BUDGET_OF_PATHS: u64 = 1 << 20;

/// The maximum part of one task.
const MOST_FOR_PATHS: u64 = 1 << 16;

const BRIEF_FOR_PATHS: u64 = 1 << 10;

/// The maximum number of members of all lanes for which [`Method::Best`] is better than [`Method::Psm`].
pub(crate) const MOST_TIGHTENED: u64 = 256;

/// The minimum number of passes over all members for each task.
const FEWEST_PASSES: u64 = 16;

/// The maximum number of exact comparisons per lane: the fractions have thousands of digits.
pub(crate) const MOST_EXACT: u32 = 8;

const KEPT_ITERATIONS: usize = 32;

/// The result of a lane for one task.
pub(crate) struct LaneResponse {
    /// The index of the task.
    pub(crate) task: usize,
    /// Its place in the lane.
    pub(crate) place: usize,
    pub(crate) response: Response,
    /// Its busy window, if that was found.
    pub(crate) busy: Option<BusyWindow>,
    /// With [`Lane::lists_interference`], for a window of [`Method::Exact`]: places, numbers of jobs, and times.
    pub(crate) interference: Vec<(usize, u64, u64)>,
    /// With [`Lane::lists_interference`], for the combination of paths that [`Method::Exact`] found: see [`exact::Exact::totals`].
    pub(crate) totals: Vec<(usize, Vec<u64>)>,
}

/// The latest job of a window in which only a part of the interference counts.
#[derive(Clone, Copy)]
pub(crate) struct LateJob {
    /// q.
    pub(crate) job: u64,
    /// f(q).
    pub(crate) length: u64,
    /// The response time.
    pub(crate) time: u64,
    /// What counts.
    pub(crate) counted: Counted,
}

/// What is known of hp(i) of one member, i.
#[derive(Clone, Copy)]
pub(crate) struct HigherLoad {
    /// The utilisation of hp(i), compared with 1; `None` if the exact comparison is too expensive.
    pub(crate) others: Option<Ordering>,
    /// The same with i.
    pub(crate) all: Option<Ordering>,
    /// Whether one of them, or i, may run elsewhere.
    pub(crate) several_cpus: bool,
}

impl HigherLoad {
    /// For tasks whose windows are known to end.
    const BELOW_ONE: HigherLoad =
        HigherLoad { others: Some(Ordering::Less), all: Some(Ordering::Less), several_cpus: false };
}

impl<'a> Lane<'_, 'a> {
    /// Analyses the tasks for which `is_wanted`.
    pub(crate) fn analyse(&mut self, is_wanted: impl Fn(&LaneMember<'_>) -> bool) -> Vec<LaneResponse> {
        let wanted: Vec<bool> =
            (0..self.members.len()).map(|place| is_wanted(self.members.get(place))).collect();
        let places = self.by_priority(&wanted);
        let loads = match self.start {
            None => self.loads(&places),
            Some(_) => vec![HigherLoad::BELOW_ONE; self.members.len()],
        };
        let by_jobs = if self.options.method == Method::Classic { Method::Classic } else { Method::Psm };
        let mut found: Vec<Option<LaneResponse>> = wanted.iter().map(|_| None).collect();
        self.walk(&places, &wanted, by_jobs, &mut |lane, place, counts| {
            let of_place = lane.by_jobs(place, counts, by_jobs, loads[place]);
            let length = of_place.busy.map(|busy| busy.worst.length);
            found[place] = Some(of_place);
            length
        });
        let of_paths = |budget: u64| (budget / self.members_of_all.max(1)).min(MOST_FOR_PATHS) / self.starts;
        let (is_tightened, paths) = match self.options.method {
            Method::Classic | Method::Psm => (false, None),
            Method::Ibf => (true, None),
            Method::Exact => (true, Some(of_paths(BUDGET_OF_PATHS))),
            Method::Best if self.members_of_all <= MOST_TIGHTENED => {
                (true, Some(of_paths(SMALL_BUDGET_OF_PATHS)))
            }
            Method::Best => {
                let found = found.iter_mut().flatten().filter(|found| found.busy.is_some());
                found.for_each(|found| found.response.is_exhausted = true);
                (false, None)
            }
        };
        if is_tightened {
            self.walk(&places, &wanted, Method::Ibf, &mut |lane, place, counts| {
                let found = found[place].as_mut()?;
                // Without a window by jobs, there is none by a better method.
                let by_jobs = found.busy?;
                let ends = Some(by_jobs).filter(|busy| busy.ends);
                match ends.and_then(|by_jobs| lane.by_execution(place, counts, by_jobs)) {
                    Some(busy) => lane.conclude(found, place, busy, Method::Ibf),
                    None => found.response.is_exhausted = true,
                }
                Some(0)
            });
        }
        if let Some(budget) = paths {
            let budget = if self.options.is_brief { budget.min(BRIEF_FOR_PATHS) } else { budget };
            for (place, found) in found.iter_mut().enumerate() {
                let Some(found) = found else { continue };
                if let Some(bound) = found.busy.filter(|busy| busy.ends) {
                    self.by_paths(found, place, bound, budget);
                }
            }
        }
        found.into_iter().flatten().collect()
    }

    /// Returns the members by decreasing priority, without those of lower priority than all that are wanted: they do not matter.
    pub(crate) fn by_priority(&self, wanted: &[bool]) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.members.len()).collect();
        places.sort_by_key(|&place| Reverse(self.priority(place)));
        let least = places.iter().rev().find(|&&place| wanted[place]).map(|&place| self.priority(place));
        places.retain(|&place| least.is_some_and(|least| self.priority(place) >= least));
        places
    }

    /// Calls `solve` for the wanted ones of `places`, in order of decreasing priority, with counts of hp(i) below its fixed
    /// point. The result of `solve` is the length of a window that no lower priority has a shorter one than.
    pub(crate) fn walk(
        &mut self,
        places: &[usize],
        wanted: &[bool],
        method: Method,
        solve: &mut dyn FnMut(&mut Self, usize, &mut JobCounts) -> Option<u64>,
    ) {
        let mut counts = JobCounts::new(self.members.len());
        let mut of_one = JobCounts::new(0);
        // A window that begins at one instant may end before the window of a higher priority, whose own job is released later;
        // and so may one without the blocking of the higher priority, or in which the waits of its jobs do not count.
        let windows_grow = self.start.is_none() && !self.has_blocking_or_late_members();
        let groups: Vec<&[usize]> = places.chunk_by(|&a, &b| self.priority(a) == self.priority(b)).collect();
        for group in groups {
            if let (&[place], true) = (group, windows_grow) {
                if wanted[place] {
                    solve(self, place, &mut counts);
                }
                counts.include(place, &mut self.members, method);
                continue;
            }
            for &place in group {
                counts.include(place, &mut self.members, method);
            }
            let mut longest = 0;
            for &place in group.iter().filter(|&&place| wanted[place]) {
                of_one.clone_from(&counts);
                of_one.exclude(place);
                self.mates(place, 1).into_iter().for_each(|(mate, _)| of_one.exclude(mate));
                let length = solve(self, place, &mut of_one).unwrap_or(0);
                if windows_grow {
                    longest = longest.max(length);
                } else {
                    // What it contributes to others may be less than before: see `Lane::count_waits_as_jitter`.
                    counts.exclude(place);
                    counts.include(place, &mut self.members, method);
                }
            }
            // The start for the next group, which has the whole group in its hp, so its windows are not shorter.
            // (What cannot be computed fails again there.)
            let _ = counts.raise(longest, &mut self.members, method);
        }
    }

    /// Compares utilisations with 1. The result is by place.
    fn loads(&self, places: &[usize]) -> Vec<HigherLoad> {
        let share = |place: usize| self.members.get(place).share;
        let mut exact_left = MOST_EXACT;
        let unknown = HigherLoad { others: None, all: None, several_cpus: true };
        let mut loads = vec![unknown; self.members.len()];
        // Of the tasks of higher or equal priority, and of those of higher priority.
        let mut utilisation = Utilisation::default();
        let mut above = Some(Ordering::Less);
        let mut several_cpus = matches!(self.rule, CpuRule::Linked(_));
        for group in places.chunk_by(|&a, &b| self.priority(a) == self.priority(b)) {
            for &place in group {
                utilisation.push(share(place));
                several_cpus |= !self.members.get(place).task.cpus().is_one();
            }
            let all = compare(&utilisation, None, &mut exact_left);
            // The whole group or none: the order within the group must not matter.
            let is_close = |&&place: &&usize| utilisation.compare_roughly(Some(&share(place))).is_none();
            let close = group.iter().filter(is_close).count();
            let mut of_group = u32::try_from(close).ok().filter(|&close| close <= exact_left).unwrap_or(0);
            let permitted = of_group;
            for &place in group {
                let others = match (all, group.len()) {
                    (_, 1) => above,
                    (Some(Ordering::Less), _) => all,
                    _ => compare(&utilisation, Some(&share(place)), &mut of_group),
                };
                loads[place] = HigherLoad { others, all, several_cpus };
            }
            exact_left -= permitted - of_group;
            above = all;
        }
        loads
    }

    pub(crate) fn budget(&self) -> u64 {
        let members = (self.members.len() as u64).max(1);
        let of_all = if self.options.is_brief { BRIEF_BUDGET_OF_ALL } else { BUDGET_OF_ALL };
        (of_all / self.members_of_all.max(members) / self.starts).max(FEWEST_PASSES * members).min(BUDGET)
    }

    /// Returns the response of the member at `place` by the demand of n jobs, starting from `counts` of hp(i) below its fixed
    /// point.
    pub(crate) fn by_jobs(
        &mut self,
        place: usize,
        counts: &mut JobCounts,
        method: Method,
        load: HigherLoad,
    ) -> LaneResponse {
        let overloaded = match self.rule {
            CpuRule::Cpu(_) if !self.is_overloaded_without_waits(place) => {
                Bound::NoBound(NoBoundReason::Waits)
            }
            CpuRule::Cpu(cpu) if !load.several_cpus => Bound::Unbounded { cpu },
            CpuRule::Cpu(_) | CpuRule::Linked(_) | CpuRule::Global(_) => {
                Bound::NoBound(NoBoundReason::SeveralCpus)
            }
        };
        let mut budget = self.budget();
        let member = self.members.at(place);
        let (jitter, second_release) = (member.jitter, member.release(2).unwrap_or(u64::MAX));
        let has_mates = !member.thread.is_empty();
        let response = Response {
            own: member.demand(1).ok().map(Time::from_nanos),
            first_job: None,
            bound: overloaded.clone(),
            window: None,
            method,
            is_exhausted: false,
            rule: self.rule,
        };
        let mut found = LaneResponse {
            task: member.index,
            place,
            response,
            busy: None,
            interference: Vec::new(),
            totals: Vec::new(),
        };
        // M(n) ≥ λ·n, since λ is the limit of M(n)/n and M is subadditive. So where hp(i) has a utilisation of 1 or
        // more, Σ Mⱼ(⌈t/Tⱼ⌉) ≥ t, and no t is its own demand or more plus at least 1 ns: no first job ends. Where it is
        // less than 1, the demand grows more slowly than t, and one does.
        let first_job = match (load.others, self.overload_by_blocking(place, false)) {
            (_, Some(reason)) => Err(reason),
            (Some(Ordering::Less), None) => self.fixed_point(place, 1, counts, method, &mut budget),
            (Some(_), None) => Err(NoBoundReason::FullyLoaded),
            (None, None) => Err(NoBoundReason::Budget),
        };
        let first_job = match first_job {
            Ok(first_job) => first_job,
            Err(reason) => {
                let is_overloaded = load.all == Some(Ordering::Greater);
                found.response.bound = if is_overloaded { overloaded } else { no_bound(reason, load.all) };
                return found;
            }
        };
        found.response.first_job = Some(Time::from_nanos(first_job));
        // If every job ends before the next one of this task is released, no window has two of them, and this length bounds
        // them all. (The utilisation U of hp(i) and i is at most 1 then, so that this cannot hide an overload. With t the
        // length, t ≤ T: t ≥ Mᵢ(1) + Σ Mⱼ(⌈t/Tⱼ⌉) ≥ λᵢ·t/T + Σ λⱼ·t/Tⱼ = U·t.)
        let has_one_job =
            !has_mates && first_job.checked_add(jitter).is_some_and(|end| end <= second_release);
        let overload = self.overload_by_blocking(place, true);
        let busy = match load.all {
            _ if has_one_job => Some(self.busy(place, counts, method, first_job, None, &mut budget)),
            Some(Ordering::Greater) => None,
            _ if overload.is_some() => overload.map(Err),
            // At a utilisation of less than 1, the window ends.
            Some(Ordering::Less) => Some(self.busy(place, counts, method, first_job, None, &mut budget)),
            Some(Ordering::Equal) => {
                let last = self.last_job(place);
                Some(self.busy(place, counts, method, first_job, last, &mut budget))
            }
            None => Some(Err(NoBoundReason::Budget)),
        };
        match busy {
            Some(Ok(busy)) => self.conclude(&mut found, place, busy, method),
            Some(Err(reason)) => found.response.bound = no_bound(reason, load.all),
            None => {}
        }
        found
    }

    /// Whether the utilisation by the member at `place` and hp(i) may exceed 1 if waits are not counted.
    fn is_overloaded_without_waits(&self, place: usize) -> bool {
        let priority = self.priority(place);
        let members = || (0..self.members.len()).filter(|&it| self.priority(it) >= priority);
        if members().all(|it| self.members.get(it).task.waits.is_none()) {
            return true;
        }
        let utilisation = Utilisation::sum(members().map(|it| self.members.get(it).executed_share()));
        utilisation.compare_roughly(None) == Some(Ordering::Greater)
    }

    /// Returns the busy window by what jobs execute at most; its jobs are some of those of `by_jobs`.
    fn by_execution(
        &mut self,
        place: usize,
        counts: &mut JobCounts,
        by_jobs: BusyWindow,
    ) -> Option<BusyWindow> {
        let mut budget = self.budget();
        let first_job = self.fixed_point(place, 1, counts, Method::Ibf, &mut budget).ok()?;
        let last = Some(by_jobs.last.job);
        // Tasks of lower priority start with the counts of the first job. Those of later jobs may be above their least fixed point:
        // a long last job of this task contributes all of itself here, and to others what it executes in the window.
        let mut counts = counts.clone();
        // The window ends: no f(q) is greater than by the demand of n jobs.
        self.busy(place, &mut counts, Method::Ibf, first_job, last, &mut budget).ok()
    }

    /// Enters the busy window by paths.
    fn by_paths(&mut self, found: &mut LaneResponse, place: usize, bound: BusyWindow, budget: u64) {
        match exact::busy_window(self, place, bound, budget) {
            Ok(exact) => {
                let (known, method) = (found.response.bound.clone(), found.response.method);
                self.conclude(found, place, exact.busy, Method::Exact);
                found.totals = exact.totals;
                if found.response.bound != known {
                    found.interference = exact.contributions;
                }
                found.response.is_exhausted = !exact.is_complete;
                if !exact.is_complete && found.response.bound == known {
                    found.response.method = method;
                }
            }
            Err(_) => found.response.is_exhausted = true,
        }
    }

    /// Computes f(q) for q = `jobs` by fixed-point iteration: raises `counts` until the window is as long as the
    /// demand. Where a contribution rises with the window, the demand stays ahead of the window: the iteration goes to the end
    /// of the rise at once.
    fn fixed_point(
        &mut self,
        place: usize,
        jobs: u64,
        counts: &mut JobCounts,
        method: Method,
        budget: &mut u64,
    ) -> Result<u64, NoBoundReason> {
        let own = self.demand(place, jobs, false)?;
        self.window(place, jobs, own, counts, method, budget)
    }

    /// The same for jobs that demand `own` together, 1 ns at least.
    pub(crate) fn window(
        &mut self,
        place: usize,
        jobs: u64,
        own: u64,
        counts: &mut JobCounts,
        method: Method,
        budget: &mut u64,
    ) -> Result<u64, NoBoundReason> {
        let demand = |lane: &Self, counts: &JobCounts, window: u64| {
            let blocking = lane.blocking(place, jobs, window)?;
            let demand = u128::from(own) + counts.total() + u128::from(blocking);
            u64::try_from(demand).map_err(|_| NoBoundReason::Overflow)
        };
        let mut window = demand(self, counts, 1)?;
        let hopeless = self.hopeless(place, jobs);
        loop {
            (self.interrupt)();
            if window > hopeless {
                *budget = (*budget).min(BUDGET_IF_HOPELESS);
            }
            *budget = budget.checked_sub(counts.present() + 1).ok_or(NoBoundReason::Budget)?;
            let rises_until = counts.raise(window, &mut self.members, method)?;
            let next = demand(self, counts, window)?;
            if next <= window {
                return Ok(window);
            }
            window = next.max(rises_until);
        }
    }

    /// Returns the length of the window at whose end the response of this job is after [`HOPELESS`] deadlines.
    fn hopeless(&self, place: usize, job: u64) -> u64 {
        let member = self.members.get(place);
        let deadline = member.task.deadline.map_or(u64::MAX, Time::as_nanos);
        let release = member.release(job).unwrap_or(u64::MAX).saturating_sub(member.jitter);
        release.saturating_add(deadline.max(member.period).saturating_mul(HOPELESS))
    }

    /// At a utilisation of 1 for hp(i) and i: returns the job up to which an unfinished window contains all response
    /// times. `None` if that job is not found.
    ///
    /// Let Mⱼ(n + cⱼ) = Mⱼ(n) + cⱼ·λⱼ for n ≥ nⱼ, and so for i, and let H be a common multiple of all cⱼ·Tⱼ and cᵢ·Tᵢ,
    /// and L = H/Tᵢ. While the window lasts, f(q) + Jᵢ > (q − 1)·Tᵢ. So for (q − 1)·Tᵢ − Jᵢ ≥ nⱼ·Tⱼ and q ≥ nᵢ, both sides of
    /// t = Mᵢ(q) + Σ Mⱼ(⌈(t + Jⱼ)/Tⱼ⌉) grow by H, since Σ λ/T = 1, when t grows by H and q by L: f(q + L) = f(q) + H. Job q + L
    /// responds as q does, and ends the window if and only if q does. In bursts, L = b·H/Tᵢ, and what depends on (q − 1)·Tᵢ is so for
    /// ⌊(q − 1)/b⌋·Tᵢ. The tasks of the thread of i count by q, as i does.
    ///
    /// With waits, blocking grows with the window: no job repeats then. Those that count as jitter have another demand, and what data
    /// releases has other distances.
    fn last_job(&mut self, place: usize) -> Option<u64> {
        let member = self.members.get(place);
        if self.blocking(place, 2, 1) != Ok(member.blocking) || !self.late_members(place).is_empty() {
            return None;
        }
        let (own_period, own_jitter, burst) = (member.period, member.jitter, member.task.burst());
        let mut first_regular = 1u64;
        let mut lap = 1u64;
        let thread = self.mates(place, 1).into_iter().map(|(mate, _)| (mate, true)).chain([(place, true)]);
        let others = self.interfering(place).into_iter().map(|other| (other, false));
        for (other, is_of_thread) in thread.chain(others) {
            (self.interrupt)();
            let member = self.members.at(other);
            if member.task.arrivals.is_some() {
                return None;
            }
            let (start, length) = member.regularity()?;
            let start = match is_of_thread {
                true => start,
                false => {
                    let since = start.checked_mul(member.period)?.checked_add(own_jitter)?;
                    since.div_ceil(own_period).checked_mul(burst)?
                }
            };
            first_regular = first_regular.max(start.checked_add(1)?);
            lap = least_common_multiple(lap, length.checked_mul(member.period)?)?;
        }
        first_regular.checked_add((lap / own_period).checked_mul(burst)?)
    }

    /// Returns the busy window whose first job ends at `first_job`. Jobs after `last` are not analysed.
    fn busy(
        &mut self,
        place: usize,
        counts: &mut JobCounts,
        method: Method,
        first_job: u64,
        last: Option<u64>,
        budget: &mut u64,
    ) -> Result<BusyWindow, NoBoundReason> {
        let member = self.members.get(place);
        let (jitter, has_mates) = (member.jitter, !member.thread.is_empty());
        let mut job = BusyJob { job: 1, length: first_job };
        let mut worst = job;
        // From the nominal release of the job, which is counted from J before the window. A window may end
        // before a later job is released. The response of that job counts as 0, so it never replaces that of job 1.
        let response = |length: u64, release: u64| length.saturating_add(jitter).saturating_sub(release);
        let mut worst_response = response(first_job, member.release(1)?);
        loop {
            let next_release = self.members.get(place).release(job.job + 1)?;
            // Of a thread, all jobs of the period have ended.
            let end = match has_mates {
                true => {
                    let whole = self.demand(place, job.job, true)?;
                    self.window(place, job.job, whole, counts, method, budget)?
                }
                false => job.length,
            };
            let ends = end.checked_add(jitter).ok_or(NoBoundReason::Overflow)? <= next_release;
            if ends || last.is_some_and(|last| job.job >= last) {
                return Ok(BusyWindow { first_job, worst, last: job, ends });
            }
            let length = self.fixed_point(place, job.job + 1, counts, method, budget)?;
            job = BusyJob { job: job.job + 1, length };
            let response = response(length, next_release);
            if response > worst_response {
                (worst, worst_response) = (job, response);
            }
        }
    }

    /// Enters a busy window, unless the response time in it is not less than what is known. The bound of `method` is `busy`.
    fn conclude(&mut self, found: &mut LaneResponse, place: usize, busy: BusyWindow, method: Method) {
        let BusyJob { job, length } = busy.worst;
        let member = self.members.at(place);
        let released = member.release(job).ok();
        let response = released.and_then(|it| Some(length.checked_add(member.jitter)?.saturating_sub(it)));
        let delay = Time::from_nanos(member.delay);
        let (Ok(own), Some(time)) = (member.demand(job), response) else {
            found.response.bound = Bound::NoBound(NoBoundReason::Overflow);
            return;
        };
        let (time, deadline) = (Time::from_nanos(time), member.task.deadline);
        found.response.method = method;
        found.busy = Some(busy);
        let first_job = Time::from_nanos(busy.first_job);
        found.response.first_job = found.response.first_job.map(|known| known.min(first_job));
        if matches!(found.response.bound, Bound::Response(known) if known <= time) {
            return;
        }
        let has_iterations = Some(time) > deadline && method != Method::Exact;
        let iterations = if has_iterations { self.iterations(place, job, method) } else { None };
        found.response.bound = Bound::Response(time);
        found.response.window = Some(Window {
            method,
            job,
            own: Time::from_nanos(own),
            length: Time::from_nanos(length),
            start: self.start.map(|(start, _)| Time::from_nanos(start)),
            clock: self.start.map_or(0, |(_, clock)| clock),
            delay,
            iterations: iterations.unwrap_or_default(),
            blocking: Time::from_nanos(self.blocking(place, job, length).unwrap_or_default()),
            counted: Counted::Whole,
            late: self.late_members(place),
        });
    }

    /// Enters a job of a window that begins at any instant, unless its response time is not less than what is known.
    pub(crate) fn enter_late_job(
        &mut self,
        found: &mut LaneResponse,
        late: LateJob,
        method: Method,
    ) -> Result<(), NoBoundReason> {
        let LateJob { job, length, time, counted } = late;
        let time = Time::from_nanos(time);
        if matches!(found.response.bound, Bound::Response(known) if known <= time) {
            return Ok(());
        }
        let window = Window {
            method,
            job,
            own: Time::from_nanos(self.members.at(found.place).demand(job)?),
            length: Time::from_nanos(length),
            start: None,
            clock: 0,
            delay: Time::ZERO,
            iterations: Vec::new(),
            blocking: Time::from_nanos(self.blocking(found.place, job, length)?),
            counted,
            late: Vec::new(),
        };
        found.response.method = method;
        (found.response.bound, found.response.window) = (Bound::Response(time), Some(window));
        Ok(())
    }

    /// Returns the last values of the fixed-point iteration of the paper, eq. 19–20, from the demand of its own jobs on. `None` if it
    /// exceeds the budget or 64 bits.
    fn iterations(&mut self, place: usize, job: u64, method: Method) -> Option<Vec<Time>> {
        let own = self.demand(place, job, false).ok()?;
        let interfering = self.interfering(place);
        let mut budget = self.budget();
        let mut window = own;
        let mut values = std::collections::VecDeque::with_capacity(KEPT_ITERATIONS);
        loop {
            (self.interrupt)();
            if values.len() == KEPT_ITERATIONS {
                values.pop_front();
            }
            values.push_back(Time::from_nanos(window));
            let mut demand = u128::from(own) + u128::from(self.blocking(place, job, window).ok()?);
            let mut rises_until = 0;
            for &other in &interfering {
                budget = budget.checked_sub(1)?;
                let found = self.members.at(other).contribution(window, method).ok()?;
                demand += u128::from(found.time);
                rises_until = rises_until.max(found.rises_until);
            }
            let demand = u64::try_from(demand).ok()?;
            if demand == window {
                return Some(values.into());
            }
            window = demand.max(rises_until);
        }
    }
}

/// Compares a utilisation, optionally `without` one of its shares, with 1. Returns `None` if the exact comparison is too
/// expensive: `exact_left` is the number of those that may be made.
pub(crate) fn compare(
    utilisation: &Utilisation,
    without: Option<&TaskShare>,
    exact_left: &mut u32,
) -> Option<Ordering> {
    if let Some(load) = utilisation.compare_roughly(without) {
        return Some(load);
    }
    *exact_left = exact_left.checked_sub(1)?;
    let others = without.map(|share| utilisation.without(share));
    Some(others.as_ref().unwrap_or(utilisation).compare_with_one())
}

fn no_bound(reason: NoBoundReason, load: Option<Ordering>) -> Bound {
    let is_full = reason == NoBoundReason::Budget && load == Some(Ordering::Equal);
    Bound::NoBound(if is_full { NoBoundReason::FullyLoaded } else { reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response_time::Lanes;
    use crate::testing::{machine, simple, task};
    use crate::{CpuSet, Options, Priority, StateMachine, Task, Waits, response_times};

    fn analyse(tasks: &[Task], method: Method) -> Vec<Response> {
        response_times(tasks, &Options { method, is_brief: false }, &|| ()).responses
    }

    fn response(time: u64) -> Bound {
        Bound::Response(Time::from_nanos(time))
    }

    /// A machine whose first `jobs` jobs cost `first` each, and all later ones `later`.
    fn at_first(jobs: u32, first: u64, later: u64) -> StateMachine {
        let mut edges: Vec<_> = (0..jobs).map(|job| (job, job + 1, first)).collect();
        edges.push((jobs, jobs, later));
        machine(jobs + 1, &edges)
    }

    #[test]
    fn at_full_load_a_later_job_may_be_the_worst() {
        // Each of six jobs ends 1 later than the one before, and the window does not end.
        let found = analyse(&[task(1, 4, at_first(6, 5, 4))], Method::Psm).swap_remove(0);
        assert_eq!((found.bound, found.window.unwrap().job), (response(10), 6));
        // Here, the task of higher priority delays the first jobs.
        let tasks = [task(2, 4, at_first(6, 3, 2)), simple(1, 4, 2)];
        let found = analyse(&tasks, Method::Psm).swap_remove(1);
        assert_eq!((found.bound, found.window.unwrap().job), (response(16), 3));
    }

    #[test]
    fn at_full_load_waits_as_jitter_have_no_bound() {
        // Each job executes and waits for 3 together. Without its waits, the first six execute for longer than the later ones: the
        // fourth and fifth job of the other task respond in 18, the second one in 13.
        let waits: Vec<Time> = [0, 0, 0, 0, 0, 0, 1].map(Time::from_nanos).to_vec();
        let (demand, waits) = Waits::with_demand(at_first(6, 3, 2), &waits, Some(1), None).unwrap();
        let waiting = Task { demand, waits, ..simple(2, 8, 3) };
        let found = analyse(&[waiting, simple(1, 8, 6)], Method::Psm).swap_remove(1);
        assert_eq!(found.bound, Bound::NoBound(NoBoundReason::Waits));
    }

    #[test]
    fn equal_priorities_that_wait() {
        // With waits as jitter, the bound of the first task falls to a part of what it was, and then that of the second one.
        let waiting = |period, cost, wait| {
            let machine = StateMachine::single(Time::from_nanos(cost));
            let (demand, waits) =
                Waits::with_demand(machine, &[Time::from_nanos(wait)], Some(1), None).unwrap();
            Task { demand, waits, ..simple(1, period, cost) }
        };
        let tasks = [waiting(8, 1, 1), waiting(8, 1, 1), waiting(100, 1, 39)];
        let found = analyse(&tasks, Method::Psm);
        assert_eq!((&found[0].bound, &found[1].bound), (&response(5), &response(5)));
    }

    #[test]
    fn the_last_job_is_one_lap_after_all_demands_are_regular() {
        // From 4900 jobs on, the second state gains more than the first path is ahead.
        let slow_start = machine(3, &[(0, 2, 5000), (2, 2, 100), (1, 1, 101)]);
        let mut tasks = [simple(1, 5, 1), task(2, 3, slow_start.clone()), simple(0, 7, 1)];
        tasks[0].jitter = Time::from_nanos(2);
        let last_job = |tasks: &[Task]| {
            let options = Options { method: Method::Psm, is_brief: false };
            let mut lanes = Lanes::new(tasks, &options, &|| ());
            lanes.lane(0).last_job(0)
        };
        // Job 2942 of the task is released at 14705 or later, and job 4901 of the other at 14700; the lap is 15.
        assert_eq!(last_job(&tasks), Some(2942 + 3));
        // The same machine for the task itself: its job 4901, and a lap of 15.
        tasks.swap(0, 1);
        (tasks[0].priority, tasks[1].priority) = (Priority::RealTime(1), Priority::RealTime(2));
        assert_eq!(last_job(&tasks), Some(4901 + 5));
        // Periods whose common multiple does not fit.
        tasks[0].period = Some(Time::from_nanos(u64::MAX));
        tasks[1].period = Some(Time::from_nanos(u64::MAX - 1));
        assert_eq!(last_job(&tasks), None);
    }

    #[test]
    fn equal_priorities_whose_shares_are_nearly_one() {
        // 1/3 is rounded, and the shares of the first three tasks are 1 less one part in 2⁶².
        let period = 3 << 61;
        let third = period / 3;
        let tasks = [third, third, third - 1, 1].map(|cost| simple(1, period, cost));
        for found in analyse(&tasks, Method::Psm) {
            assert_eq!(found.bound, response(period));
        }
    }

    #[test]
    fn the_best_method_depends_on_the_number_of_tasks() {
        let hp = machine(3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]);
        let mut tasks = vec![task(2, 3, hp), simple(1, 5, 1)];
        let elsewhere = || Task { cpus: Some(CpuSet(2)), ..simple(1, 1000, 1) };
        tasks.resize_with(256, elsewhere);
        let found = analyse(&tasks, Method::Best).swap_remove(1);
        assert_eq!((found.bound, found.method, found.is_exhausted), (response(8), Method::Exact, false));
        tasks.push(elsewhere());
        let found = analyse(&tasks, Method::Best).swap_remove(1);
        assert_eq!((found.bound, found.method, found.is_exhausted), (response(10), Method::Psm, true));
    }

    /// 1/3 is rounded: three tasks whose shares are 1 less one part in 2⁶² and a half.
    const PERIOD: u64 = 3 << 61;

    fn nearly_one(priority: u32) -> Vec<Task> {
        [PERIOD / 3, PERIOD / 3, PERIOD / 3 - 1].map(|cost| simple(priority, PERIOD, cost)).to_vec()
    }

    fn idle(priorities: impl Iterator<Item = u32>) -> impl Iterator<Item = Task> {
        priorities.map(|priority| simple(priority, PERIOD, 0))
    }

    #[test]
    fn few_utilisations_are_compared_exactly() {
        let bounds = |tasks: &[Task]| -> Vec<Bound> {
            analyse(tasks, Method::Psm).into_iter().map(|found| found.bound).skip(3).collect()
        };
        let budget = Bound::NoBound(NoBoundReason::Budget);
        // The eighth of the lower priorities is the last that is compared. The ninth needs no comparison of all: it has one job.
        let mut tasks = nearly_one(20);
        tasks.extend(idle((9..20).rev()));
        let expected = [vec![response(PERIOD); 8], vec![budget.clone(); 3]].concat();
        assert_eq!(bounds(&tasks), expected);
        // Equal priorities whose utilisation is less than 1 need one comparison, however many they are.
        for equal in [3, 20] {
            let mut tasks = nearly_one(20);
            tasks.extend(idle(std::iter::repeat_n(20, equal).chain((9..20).rev())));
            let expected = [vec![response(PERIOD); equal + 8], vec![budget.clone(); 3]].concat();
            assert_eq!(bounds(&tasks), expected);
        }
        // At a utilisation of 1, those without whose share it is nearly 1 need one each.
        let mut tasks = nearly_one(20);
        tasks.push(simple(20, PERIOD, 1));
        tasks.extend(idle((9..20).rev()));
        let full = Bound::NoBound(NoBoundReason::FullyLoaded);
        let expected = [vec![response(PERIOD)], vec![full.clone(); 7], vec![budget; 4]].concat();
        assert_eq!(bounds(&tasks), expected);
        // Shares that are not rounded need none.
        let mut tasks = vec![simple(21, 4, 1), simple(20, 4, 1), simple(20, 2, 1)];
        tasks.extend(idle((0..20).rev()));
        assert_eq!(bounds(&tasks), vec![full; 20]);
    }

    #[test]
    fn a_full_load_whose_demand_never_repeats_has_no_bound() {
        // One job that is longer, then a ring that is longer than any period that is searched.
        let states = 300;
        let mut edges: Vec<_> = (0..states).map(|state| (state, (state + 1) % states, 2)).collect();
        (edges[0].2, edges[1].2) = (3, 1);
        edges.push((states, 0, 4));
        let found = analyse(&[task(1, 2, machine(states + 1, &edges))], Method::Psm).swap_remove(0);
        assert_eq!(found.bound, Bound::NoBound(NoBoundReason::FullyLoaded));
    }
}
