//! The response time of a task that may use each of m CPUs.
//!
//! Suppose that a job has not ended L after its release. Then it has waited for more than y = L − C, while all m CPUs executed tasks
//! that delay it: Σ min(W, y') ≥ m·y' for each y' up to y and a bit more, with W for what each of them executes in L. So it is enough
//! that this is false at y + 1, and no more than equality at y: between two integers, the sum is convex.
//!
//! Each job of another task ends within its R. So jobs of at most L + R execute in L, and at the ends of that less than whole ones. L may
//! begin at the first instant from which on all CPUs are busy: then at most m − 1 tasks have a job of before, but those that may be not
//! ready for another reason than a CPU. And no job executes for longer, while the task waits, than m − 1 CPUs execute others in R.

use crate::certificate::{Claim, Rule};
use crate::demand::Check;
use crate::tasks::{Member, Tasks};

/// Above this number of tasks, all of a job counts.
const MOST_FOR_OVERLAP: usize = 48;

pub(crate) struct Global<'t, 'c> {
    tasks: &'t Tasks<'c>,
    claim: &'c Claim,
    cpus: u128,
    /// Those that delay it, each with the most that one of its jobs executes meanwhile.
    others: Vec<(usize, u128)>,
}

impl<'t, 'c> Global<'t, 'c> {
    pub(crate) fn new(tasks: &'t Tasks<'c>, claim: &'c Claim) -> Check<Global<'t, 'c>> {
        let of = &tasks.all[claim.task];
        let (cpus, refuse) = (of.cpus, |why: &str| Err(why.to_owned()));
        let listed = match &claim.rule {
            Rule::Global(listed) => {
                listed.iter().try_fold(0, |all, cpu| Some(all | 1u128.checked_shl(*cpu)?))
            }
            _ => None,
        };
        if of.is_pinned() || listed != Some(cpus) {
            return refuse("the CPUs of the claim are not those of the task");
        }
        let fits =
            |it: &Member<'_>| it.cpus == cpus || it.cpus & cpus == 0 || it.is_pinned() && it.rank != u64::MAX;
        if !tasks.all.iter().all(fits) {
            return refuse("another task may use some of its CPUs, and others, or all of one");
        }
        if of.task.thread.is_some() || of.burst > 1 || of.has_calls || of.blocking != Ok(0) {
            return refuse("its jobs may be delayed by more than those that execute");
        }
        let delays = |it: &usize| *it != claim.task && tasks.all[*it].delays(of.raised, cpus);
        let others: Vec<(usize, u128)> =
            (0..tasks.all.len()).filter(delays).map(|it| (it, u128::MAX)).collect();
        if others.iter().any(|it| !tasks.all[it.0].is_known()) {
            return refuse("the demand of a task that delays it is unknown");
        }
        let mut found = Global { tasks, claim, cpus, others };
        found.limit_jobs()?;
        Ok(found)
    }

    pub(crate) fn check(&self) -> Check<()> {
        let of = &self.tasks.all[self.claim.task];
        let length = match self.claim.windows.as_slice() {
            [window] if window.start.is_none() && window.ends.len() == 1 => window.ends[0],
            _ => return Err("it has not one window with one job".to_owned()),
        };
        let own = of.demand.as_ref().ok_or("its demand is unknown")?.of_jobs(1)?.max(1);
        let ends = u128::from(length) + u128::from(of.task.jitter);
        if ends > u128::from(self.claim.response) || ends > u128::from(of.period) {
            let [response, period] = [self.claim.response, of.period];
            return Err(format!(
                "it ends after {ends} ns, and R is {response} ns, the next release at {period} ns"
            ));
        }
        let waited = u128::from(length).checked_sub(own).ok_or("the window is shorter than the job")?;
        let work = self.work(length)?;
        let cpus = u128::from(self.cpus.count_ones());
        let (here, next) = (self.total(&work, waited), self.total(&work, waited + 1));
        if here > cpus * waited || next >= cpus * (waited + 1) {
            return Err(format!(
                "it may wait for more than {waited} ns: others execute for {next} ns in {length} ns, on {cpus} CPUs"
            ));
        }
        Ok(())
    }

    /// R of another task; none if it may execute at any time.
    fn response(&self, index: usize) -> Option<u64> {
        self.tasks.response(index).ok().filter(|_| !self.tasks.all[index].has_calls)
    }

    fn limit_jobs(&mut self) -> Check<()> {
        if self.others.len() > MOST_FOR_OVERLAP {
            return Ok(());
        }
        let mut limits = Vec::new();
        for &(index, _) in &self.others {
            let Some(length) = self.response(index) else {
                limits.push(u128::MAX);
                continue;
            };
            let mut work = Vec::new();
            for &(other, _) in self.others.iter().filter(|it| it.0 != index) {
                work.push(self.carried(other, length, u128::MAX)?);
            }
            limits.push(executed_at_once(work, self.cpus.count_ones() - 1));
        }
        self.others.iter_mut().zip(limits).for_each(|(it, limit)| it.1 = limit);
        Ok(())
    }

    /// What the jobs of a task execute in a window with what is left of those before, none of them for more than `most`.
    fn carried(&self, index: usize, window: u64, most: u128) -> Check<u128> {
        let of = &self.tasks.all[index];
        let Some(response) = self.response(index) else { return Ok(u128::MAX) };
        let (length, period) = (u128::from(window) + u128::from(response), u128::from(of.period));
        let bursts = length.div_ceil(period);
        let curve = of.executed.as_ref().ok_or("its demand is unknown")?;
        let demand = |jobs: u128| {
            let number = u64::try_from(jobs).map_err(|_| "too many jobs")?;
            Check::Ok(curve.of_jobs(number)?.min(jobs.saturating_mul(most)))
        };
        if of.burst > 1 {
            return demand(bursts.saturating_mul(u128::from(of.burst)));
        }
        // The first and the last one execute for no longer than what of the length is not between their releases.
        let clipped = |jobs: u128, rest: u128| {
            Check::Ok(demand(jobs)?.min(demand(jobs.saturating_sub(2))?.saturating_add(rest)))
        };
        let rest = length - bursts.saturating_sub(1) * period;
        Ok(clipped(bursts, rest)?.max(clipped(bursts.saturating_sub(1), rest + period)?))
    }

    /// What each of the others executes in a window without what is left of a job before, and with that.
    fn work(&self, window: u64) -> Check<Vec<(u128, u128)>> {
        let rank = self.tasks.all[self.claim.task].raised;
        let mut work = Vec::new();
        for &(index, most) in &self.others {
            let of = &self.tasks.all[index];
            let with = self.carried(index, window, most)?;
            let always = of.waits
                || of.task.thread.is_some()
                || of.blocking != Ok(0)
                || of.has_calls
                || of.cpus != self.cpus
                || of.raised == rank;
            if always {
                work.push((with, with));
                continue;
            }
            let since = u128::from(window) + u128::from(of.task.jitter);
            let bursts = since.div_ceil(u128::from(of.period));
            let jobs =
                u64::try_from(bursts.saturating_mul(u128::from(of.burst))).map_err(|_| "too many jobs")?;
            let demand = of.demand.as_ref().ok_or("its demand is unknown")?;
            let without = match of.burst {
                1 => demand.of_jobs_until(jobs, since - (bursts - 1) * u128::from(of.period))?,
                _ => demand.of_jobs(jobs)?,
            };
            work.push((without.min(u128::from(jobs).saturating_mul(most)), with));
        }
        Ok(work)
    }

    /// The most that executes while the task waits for `waited`.
    fn total(&self, work: &[(u128, u128)], waited: u128) -> u128 {
        let sum = work.iter().fold(0u128, |sum, it| sum.saturating_add(it.0.min(waited)));
        let mut carried: Vec<u128> =
            work.iter().map(|it| it.1.min(waited).saturating_sub(it.0.min(waited))).collect();
        carried.sort_unstable_by(|a, b| b.cmp(a));
        let carried = carried.iter().take(self.cpus.count_ones() as usize - 1);
        carried.fold(sum, |sum, it| sum.saturating_add(*it))
    }
}

/// For how long so many CPUs execute tasks at once that execute for these times, at most.
fn executed_at_once(mut work: Vec<u128>, cpus: u32) -> u128 {
    work.sort_unstable();
    let sums = (0..cpus).map(|greatest| {
        let others = work.len().saturating_sub(greatest as usize);
        let sum = work.iter().take(others).fold(0u128, |sum, it| sum.saturating_add(*it));
        sum.div_ceil(u128::from(cpus - greatest))
    });
    sums.min().unwrap_or(u128::MAX)
}
