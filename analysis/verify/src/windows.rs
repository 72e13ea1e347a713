//! The response time of a task on one CPU, or on CPUs that count as one: its busy windows.
//!
//! A busy window begins when neither the task nor one that delays it has unfinished work. In its first t, each of the latter is
//! released at most n = b·⌈(t + J − d)/T⌉ times, where d is 0, or for synchronised clocks the time until its next release. So job
//! q of the task has ended at every t > 0 that is not less than the *demand*: M(q) of the task itself, the demand of n jobs of each of
//! the others, and the blocking. This is checked for each job until one ends before the next one is released. The times may
//! be any that satisfy it: no search is repeated.
//!
//! **Full load.** Let all demands have closed forms with c and K, let H be a multiple of all c·T, and Σ K·b·H/(c·T) ≤ H. Then what
//! holds for job q at t holds for job q + b·H/T at t + H. So jobs up to q + b·H/T are enough, if the closed forms
//! hold from the jobs of q on.

use std::collections::{BTreeMap, BTreeSet};

use crate::certificate::{Claim, Method, Rule, Window};
use crate::demand::Check;
use crate::tasks::Tasks;

/// What is checked for one claim on one CPU.
pub(crate) struct Windows<'t, 'c> {
    pub(crate) tasks: &'t Tasks<'c>,
    pub(crate) claim: &'c Claim,
    /// The tasks that delay it, without those of its thread.
    pub(crate) others: Vec<usize>,
    /// Also its thread.
    everyone: Vec<usize>,
}

/// The greatest response: the window's start, the job, and its end.
type Greatest = Option<(u128, Option<u64>, u64)>;

impl<'t, 'c> Windows<'t, 'c> {
    pub(crate) fn new(tasks: &'t Tasks<'c>, claim: &'c Claim) -> Check<Windows<'t, 'c>> {
        let of = &tasks.all[claim.task];
        let cpus = match &claim.rule {
            Rule::Cpu(cpu) => {
                let cpu = 1u128.checked_shl(*cpu).filter(|cpu| of.cpus & cpu != 0);
                match tasks.as_one(claim.task) {
                    None => cpu.ok_or("the CPU of the claim is none of its own")?,
                    Some(_) => {
                        return Err("sets of several CPUs differ: one CPU alone proves nothing".to_owned());
                    }
                }
            }
            Rule::Linked(cpus) | Rule::Global(cpus) => {
                let cpu = |cpu: &u32| 1u128.checked_shl(*cpu).ok_or("no such CPU");
                let cpus = cpus.iter().try_fold(0, |all, it| cpu(it).map(|it| all | it))?;
                if of.cpus & !cpus != 0 || !tasks.is_closed(cpus, claim.task) {
                    return Err(
                        "a task that delays it may run on more CPUs than those of the claim".to_owned()
                    );
                }
                cpus
            }
        };
        let delays = |index: &usize| *index == claim.task || tasks.all[*index].delays(of.raised, cpus);
        let everyone: Vec<usize> = (0..tasks.all.len()).filter(delays).collect();
        if let Some(unknown) = everyone.iter().find(|it| !tasks.all[**it].is_known()) {
            let reason = tasks.all[*unknown].blocking.as_ref().err().cloned().unwrap_or_default();
            return Err(format!("{} delays it, and its demand is unknown. {reason}", tasks.name(*unknown)));
        }
        let others = everyone.iter().copied().filter(|it| !of.thread.contains(it)).collect();
        let windows = Windows { tasks, claim, others, everyone };
        windows.check_late()?;
        Ok(windows)
    }

    /// Checks whether waits may count as jitter.
    fn check_late(&self) -> Check<()> {
        if self.claim.late.is_empty() {
            return Ok(());
        }
        if self.claim.late.len() > self.others.len() {
            return Err("more tasks are late than delay it".to_owned());
        }
        let alone = |index: &usize| self.tasks.all[*index].task.thread.is_none();
        let cpu = self.tasks.all[self.claim.task].cpus;
        // Of any priority.
        let is_on_one = self.tasks.all.iter().all(|it| it.cpus & cpu == 0 || it.is_pinned());
        let is_late = |it: &usize| self.others.contains(it) && alone(it);
        let is_possible = is_on_one
            && matches!(self.claim.rule, Rule::Cpu(_))
            && alone(&self.claim.task)
            && self.claim.late.iter().all(is_late)
            && self.claim.method == Method::Psm
            && self.claim.clock.is_none();
        if is_possible { Ok(()) } else { Err("its waits must not count as jitter".to_owned()) }
    }

    /// Checks all windows, and the list of what executes in the worst one.
    pub(crate) fn check(&self) -> Check<()> {
        let mut greatest: Greatest = None;
        let mut windows: BTreeMap<Option<u64>, &Window> = BTreeMap::new();
        for window in &self.claim.windows {
            self.check_window(window, &mut greatest)?;
            windows.insert(window.start, window);
        }
        let needed = match self.claim.clock {
            None => BTreeSet::from([None]),
            Some(clock) => self.starts(clock)?,
        };
        if let Some(start) = needed.iter().find(|start| !windows.contains_key(start)) {
            let at = start.map_or_else(|| "at any instant".to_owned(), |start| format!("at {start} ns"));
            return Err(format!("the window that begins {at} is missing"));
        }
        let (_, start, end) = greatest.ok_or("it has no window")?;
        self.check_interference(start, end)
    }

    fn check_window(&self, window: &Window, greatest: &mut Greatest) -> Check<()> {
        let of = &self.tasks.all[self.claim.task];
        let delay = self.delay(self.claim.task, window.start);
        let jitter = u128::from(of.task.jitter);
        let release = |job: u64| u128::from((job - 1) / of.burst) * u128::from(of.period) + u128::from(delay);
        for (job, &end) in (1..).zip(&window.ends) {
            let demand = self.demand(job, false, end, window.start)?;
            if end == 0 || demand > u128::from(end) {
                return Err(format!(
                    "job {job} has not ended after {end} ns: up to then, {demand} ns are demanded"
                ));
            }
            let response = (u128::from(end) + jitter).saturating_sub(release(job));
            if response > u128::from(self.claim.response) {
                return Err(format!(
                    "job {job} ends {response} ns after its release, not {}",
                    self.claim.response
                ));
            }
            if greatest.is_none_or(|(most, ..)| response > most) {
                *greatest = Some((response, window.start, end));
            }
        }
        let (last, last_end) = (window.ends.len() as u64, window.ends.last().copied().unwrap_or(0));
        if let (Some(repeats), true) = (window.repeats, last > 0) {
            return self.check_repeats(window, repeats);
        }
        let end = window.closes.unwrap_or(last_end);
        let demand = if last > 0 { self.demand(last, true, end, window.start)? } else { u128::MAX };
        if demand > u128::from(end) || u128::from(end) + jitter > release(last + 1) {
            let next = release(last + 1);
            return Err(format!(
                "the window is open after job {last}: {end} ns, and the next release is at {next} ns"
            ));
        }
        Ok(())
    }

    /// Checks that from job `from` on, all repeats `after` this time.
    fn check_repeats(&self, window: &Window, (from, after): (u64, u64)) -> Check<()> {
        let of = &self.tasks.all[self.claim.task];
        let refuse = |why: &str| Err(format!("the window does not end, and need not repeat: {why}"));
        let Some(&end) = from.checked_sub(1).and_then(|it| window.ends.get(usize::try_from(it).ok()?)) else {
            return refuse("its lap begins after all jobs");
        };
        let grows = |it: &usize| self.tasks.all[*it].times_waiting > 0 || !self.tasks.all[*it].is_pinned();
        let blocks = of.blocking != Ok(0) && self.everyone.iter().any(grows);
        if self.claim.method != Method::Psm || !self.claim.late.is_empty() || blocks {
            return refuse("its demand may grow otherwise");
        }
        if after == 0 || !window.ends.is_sorted() {
            return refuse("its lap has no length, or its jobs do not end in order");
        }
        let lap = u128::from(after / of.period) * u128::from(of.burst);
        if u128::from(from - 1) + lap > window.ends.len() as u128 {
            return refuse("the lap is longer than the listed jobs");
        }
        let mut demand = 0u128;
        for &index in &self.everyone {
            let it = &self.tasks.all[index];
            let jobs = match of.thread.contains(&index) {
                true => from - 1,
                false => self.jobs(index, end, window.start)?,
            };
            let Some((start, period, gain)) = it.demand.as_ref().and_then(|it| it.regularity()) else {
                return refuse("a demand has no closed form");
            };
            let length = u128::from(period) * u128::from(it.period);
            if jobs < start || u128::from(after) % length != 0 {
                return refuse("a demand is not regular there");
            }
            let bursts = u128::from(after) / length * u128::from(it.burst);
            demand = demand.saturating_add(bursts.saturating_mul(u128::from(gain)));
        }
        if demand > u128::from(after) { refuse("more is demanded than there is time") } else { Ok(()) }
    }

    /// What has to be executed in `end` so that this job of the task ends; with `whole`, that of all of its thread.
    pub(crate) fn demand(&self, job: u64, whole: bool, end: u64, start: Option<u64>) -> Check<u128> {
        let mut sum = self.own(job, whole)?.saturating_add(self.blocking(job, end, start)?);
        for &other in &self.others {
            sum = sum.saturating_add(self.executed(other, end, start)?.1);
        }
        Ok(sum)
    }

    /// The demand of the first jobs of the task, and what its thread executes before the end of the last one of them.
    pub(crate) fn own(&self, job: u64, whole: bool) -> Check<u128> {
        let task = self.claim.task;
        let mut sum = 0u128;
        for &mate in &self.tasks.all[task].thread {
            let is_before = mate <= task || whole || self.tasks.all[mate].has_calls;
            let jobs = if is_before { job } else { job - 1 };
            let demand = self.of_jobs(mate, jobs, true)?;
            sum = sum.saturating_add(if mate == task { demand.max(1) } else { demand });
        }
        Ok(sum)
    }

    /// B once, and once more for each wait in the window, in which another job may take a lock; and for each further job, if a
    /// task may run on another CPU meanwhile.
    pub(crate) fn blocking(&self, job: u64, end: u64, start: Option<u64>) -> Check<u128> {
        let blocking = self.tasks.all[self.claim.task].blocking.clone()?;
        if blocking == 0 {
            return Ok(0);
        }
        let mut times = 1u128;
        for &index in &self.everyone {
            let jobs = if index == self.claim.task { job } else { self.jobs(index, end, start)? };
            let waits = u128::from(self.tasks.all[index].times_waiting);
            times = times.saturating_add(u128::from(jobs).saturating_mul(waits));
        }
        if !self.everyone.iter().all(|it| self.tasks.all[*it].is_pinned()) {
            times = times.saturating_add(u128::from(job - 1));
        }
        Ok(times.saturating_mul(u128::from(blocking)))
    }

    fn of_jobs(&self, index: usize, jobs: u64, with_waits: bool) -> Check<u128> {
        let of = &self.tasks.all[index];
        let curve = if with_waits { &of.demand } else { &of.executed };
        curve.as_ref().ok_or("its demand is unknown")?.of_jobs(jobs)
    }

    fn jobs(&self, index: usize, end: u64, start: Option<u64>) -> Check<u64> {
        let of = &self.tasks.all[index];
        let is_late = self.claim.late.contains(&index);
        let late = if is_late { self.tasks.response(index)?.max(of.task.jitter) } else { of.task.jitter };
        let since = (u128::from(end) + u128::from(late)).saturating_sub(u128::from(self.delay(index, start)));
        let jobs = since.div_ceil(u128::from(of.period)).saturating_mul(u128::from(of.burst));
        u64::try_from(jobs).map_err(|_| "too many jobs".to_owned())
    }

    /// What a task that delays it executes in the first `end` of the window: the number of jobs, and the time.
    fn executed(&self, index: usize, end: u64, start: Option<u64>) -> Check<(u64, u128)> {
        let of = &self.tasks.all[index];
        let jobs = self.jobs(index, end, start)?;
        let is_late = self.claim.late.contains(&index);
        let time = match self.claim.method {
            Method::Ibf if of.burst == 1 && jobs > 0 => {
                let release =
                    u128::from(jobs - 1) * u128::from(of.period) + u128::from(self.delay(index, start));
                let since = (u128::from(end) + u128::from(of.task.jitter)).saturating_sub(release);
                of.demand.as_ref().ok_or("its demand is unknown")?.of_jobs_until(jobs, since)?
            }
            _ => self.of_jobs(index, jobs, !is_late)?,
        };
        Ok((jobs, time))
    }

    fn check_interference(&self, start: Option<u64>, end: u64) -> Check<()> {
        let mut expected = Vec::new();
        for &other in &self.others {
            let (jobs, time) = self.executed(other, end, start)?;
            expected.push((other, jobs, time));
        }
        expected.retain(|it| it.1 > 0);
        let mut listed =
            self.claim.interference.iter().map(|&(task, jobs, time)| (task, jobs, u128::from(time)));
        match expected.iter().find(|it| listed.next() != Some(**it)) {
            None if listed.next().is_none() => Ok(()),
            None => Err("a task is listed that does not delay it".to_owned()),
            Some(&(task, jobs, time)) => {
                let name = self.tasks.name(task);
                Err(format!(
                    "{jobs} jobs of {name} with {time} ns are in its longest window, and not in the list"
                ))
            }
        }
    }

    /// The time from the start of a window, or J before it, to the first nominal release of a task.
    fn delay(&self, index: usize, start: Option<u64>) -> u64 {
        let of = &self.tasks.all[index];
        let clock = self.claim.clock == Some(of.task.clock);
        let (Some(start), Some(last), true) = (start, self.last_release(index), clock) else { return 0 };
        let before = start % of.period;
        if last >= before { last - before } else { last + (of.period - before) }
    }

    /// The latest instant, modulo T, at which a job is released after a nominal instant.
    fn last_release(&self, index: usize) -> Option<u64> {
        let of = &self.tasks.all[index];
        let latest = u128::from(of.offset?) + u128::from(of.task.jitter);
        Some((latest % u128::from(of.period)) as u64)
    }

    /// The instants at which windows may begin: the latest releases of the tasks with this clock. Any other may be moved to the
    /// next of these, and each job ends as late or later.
    fn starts(&self, clock: u32) -> Check<BTreeSet<Option<u64>>> {
        let is_of = |index: &&usize| {
            let of = &self.tasks.all[**index];
            of.offset.is_some() && of.task.clock == clock
        };
        let of_clock: Vec<usize> = self.everyone.iter().filter(is_of).copied().collect();
        if of_clock.is_empty() {
            return Err("no task has this clock".to_owned());
        }
        let period = |index: &usize| self.tasks.all[*index].period;
        let common = of_clock.iter().map(period).try_fold(1u64, common_multiple);
        let common = common.ok_or("the releases of the clock never repeat")?;
        let mut starts = BTreeSet::new();
        for index in &of_clock {
            if common / period(index) > self.claim.windows.len() as u64 {
                return Err("it has fewer windows than its clock has releases".to_owned());
            }
            self.tasks.work.spend(common / period(index))?;
            let first = self.last_release(*index).unwrap_or(0);
            starts.extend((0..common / period(index)).map(|lap| Some(first + lap * period(index))));
        }
        Ok(starts)
    }
}

fn common_multiple(a: u64, b: u64) -> Option<u64> {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1)).checked_mul(b)
}
