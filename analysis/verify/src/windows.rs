//! The response time of a task on one CPU, or on CPUs that count as one: its busy window.
//!
//! A busy window begins when neither the task nor one that delays it has unfinished work. In its first t, each of the latter is
//! released at most n = b·⌈(t + J)/T⌉ times. So job q of the task has ended at every t > 0 that is not less than the *demand*: M(q) of
//! the task itself, the demand of n jobs of each of the others, and the blocking. This is checked for each job until one ends before
//! the next one is released. The times may be any that satisfy it: no search is repeated.

use crate::certificate::Claim;
use crate::demand::Checks;
use crate::tasks::{CheckedTask, CheckedTasks, mask};

/// What is checked for one claim.
struct ClaimWindow<'t, 'c> {
    tasks: &'t CheckedTasks<'c>,
    claim: &'t Claim,
    of: &'t CheckedTask<'c>,
    /// The task, its thread, and the tasks that delay it.
    everyone: Vec<usize>,
}

pub(crate) fn check_window(tasks: &CheckedTasks<'_>, claim: &Claim) -> Checks<()> {
    let of = &tasks.all[claim.task];
    let cpus = match claim.cpu {
        Some(cpu) => mask(&[cpu]).filter(|it| it & of.cpus != 0 && !tasks.is_as_one(claim.task)),
        None => Some(tasks.linked(of.cpus, of.raised).0),
    };
    let cpus = cpus.ok_or("the CPU of the claim is none of its own, or sets of several CPUs differ")?;
    let delays = |index: &usize| *index == claim.task || tasks.all[*index].delays(of.raised, cpus);
    let everyone: Vec<usize> = (0..tasks.all.len()).filter(delays).collect();
    if let Some(unknown) = everyone.iter().find(|it| !tasks.all[**it].is_known()) {
        return Err(format!("{} delays it, and its demand is unknown", tasks.name(*unknown)));
    }
    ClaimWindow { tasks, claim, of, everyone }.check()
}

impl ClaimWindow<'_, '_> {
    fn check(&self) -> Checks<()> {
        let (jitter, response) = (u128::from(self.of.task.jitter), self.claim.response);
        let release = |job: u64| u128::from((job - 1) / self.of.burst) * u128::from(self.of.period);
        for (job, &end) in (1..).zip(&self.claim.ends) {
            let demand = self.demand(job, false, end)?;
            if end == 0 || demand > u128::from(end) {
                let up_to = format!("up to then, {demand} ns are demanded");
                return Err(format!("job {job} has not ended after {end} ns: {up_to}"));
            }
            let after = (u128::from(end) + jitter).saturating_sub(release(job));
            if after > u128::from(response) {
                return Err(format!("job {job} ends {after} ns after its release, not {response}"));
            }
        }
        let ends = &self.claim.ends;
        let (last, end) = (ends.len() as u64, self.claim.closes.or(ends.last().copied()).unwrap_or(0));
        let next = release(last + 1);
        if last == 0 || self.demand(last, true, end)? > u128::from(end) || u128::from(end) + jitter > next {
            let open = format!("the window is open after job {last}");
            return Err(format!("{open}: {end} ns, and the next release is at {next} ns"));
        }
        Ok(())
    }

    /// What has to be executed in `end` so that this job of the task ends; with `whole`, that of all of its thread.
    fn demand(&self, job: u64, whole: bool, end: u64) -> Checks<u128> {
        let mut sum = self.blocking(job, end)?;
        for &index in &self.everyone {
            let of = &self.tasks.all[index];
            let is_own = self.of.thread.contains(&index);
            // Its thread executes the tasks in their order, and calls when they come.
            let is_before = index <= self.claim.task || whole || of.has_calls;
            let jobs = if is_own { job - u64::from(!is_before) } else { self.jobs(index, end)? };
            let mut last = u128::MAX;
            if !is_own && of.burst == 1 {
                // No job executes for longer than since its release.
                let since = u128::from(end) + u128::from(of.task.jitter);
                last = since - u128::from(jobs.saturating_sub(1)) * u128::from(of.period);
            }
            let demand = of.demand.as_ref().ok_or("its demand is unknown")?;
            let demand = demand.of_jobs(jobs, last, self.tasks.work)?;
            // The job itself takes 1 ns at least: one that does nothing waits too.
            sum = sum.saturating_add(demand.max((index == self.claim.task).into()));
        }
        Ok(sum)
    }

    /// B once, and once more for each wait in the window, in which another job may take a lock; and for each further job, if a
    /// task may run on another CPU meanwhile. The part by the background once more for each throttling.
    fn blocking(&self, job: u64, end: u64) -> Checks<u128> {
        let (blocking, in_background) = self.of.blocking.clone()?;
        if blocking == 0 {
            return Ok(0);
        }
        let (mut times, mut throttled) = (1u128, 0u128);
        for &index in &self.everyone {
            let jobs = if index == self.claim.task { job } else { self.jobs(index, end)? };
            let of = &self.tasks.all[index];
            times = times.saturating_add(u128::from(jobs).saturating_mul(of.waits.into()));
            if of.task.throttling {
                // One may end at once, and the next one begin at the end of its period.
                let edges = of.task.machine.iter().flat_map(|machine| &machine.edges);
                let longest = edges.map(|edge| edge.2).max().unwrap_or(0);
                let jobs = self.jobs(index, end.saturating_add(longest))?;
                throttled = throttled.saturating_add(jobs.into());
            }
        }
        if !self.everyone.iter().all(|it| self.tasks.all[*it].is_pinned()) {
            times = times.saturating_add((job - 1).into());
        }
        let by_throttling = throttled.saturating_mul(in_background.into());
        Ok(times.saturating_mul(blocking.into()).saturating_add(by_throttling))
    }

    /// The most releases of a task in the first `end`.
    fn jobs(&self, index: usize, end: u64) -> Checks<u64> {
        let of = &self.tasks.all[index];
        let since = u128::from(end) + u128::from(of.task.jitter);
        let jobs = since.div_ceil(of.period.into()).saturating_mul(of.burst.into());
        u64::try_from(jobs).map_err(|_| "too many jobs".to_owned())
    }
}
