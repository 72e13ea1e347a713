//! The task set of a certificate: which tasks delay which, what their jobs demand, and the calls that they execute.

use std::collections::{BTreeMap, BTreeSet};

use crate::certificate::{CertifiedMachine, CertifiedOperation, CertifiedSystem, CertifiedTask, Claim};
use crate::demand::{Checks, TaskDemand, WorkLeft};

const MOST_TASKS: usize = 4096;

/// A task, as the checks need it.
pub(crate) struct CheckedTask<'c> {
    pub(crate) task: &'c CertifiedTask,
    pub(crate) period: u64,
    pub(crate) burst: u64,
    /// 0 in the background; the priority plus 1; the highest if it is unknown.
    pub(crate) rank: u64,
    /// With what it may inherit from users of a lock on other CPUs.
    pub(crate) raised: u64,
    /// The CPUs on which it may run, by bit.
    pub(crate) cpus: u128,
    /// What a job demands, with its waits and the calls that it executes; none if that is unknown.
    pub(crate) demand: Option<TaskDemand<'c>>,
    /// How often a job waits at most.
    pub(crate) waits: u64,
    pub(crate) has_calls: bool,
    pub(crate) has_locks: bool,
    /// The tasks of its thread, with itself; only itself without one.
    pub(crate) thread: Vec<usize>,
    /// B, and the part by the background each time that tasks are throttled; or why locks leave it without a bound.
    pub(crate) blocking: Checks<(u64, u64)>,
}

pub(crate) struct CheckedTasks<'c> {
    pub(crate) all: Vec<CheckedTask<'c>>,
    pub(crate) claims: BTreeMap<usize, &'c Claim>,
    pub(crate) work: &'c WorkLeft,
}

impl CheckedTask<'_> {
    pub(crate) fn is_pinned(&self) -> bool {
        self.cpus.is_power_of_two()
    }

    pub(crate) fn is_known(&self) -> bool {
        self.demand.is_some() && self.rank > 0 && self.period > 0 && self.blocking.is_ok()
    }

    /// Whether it delays a task of this rank on some of these CPUs.
    pub(crate) fn delays(&self, rank: u64, cpus: u128) -> bool {
        self.raised >= rank && self.cpus & cpus != 0
    }
}

impl<'c> CheckedTasks<'c> {
    pub(crate) fn new(system: &'c CertifiedSystem, work: &'c WorkLeft) -> Checks<CheckedTasks<'c>> {
        let number = system.tasks.len();
        let mut names = BTreeSet::new();
        let is_new = |it: &CertifiedTask| !it.is_activity || names.insert(it.name.clone());
        if number > MOST_TASKS || !system.tasks.iter().all(is_new) {
            return Err(format!("more than {MOST_TASKS} tasks, or two activities of one name"));
        }
        let mut claims = BTreeMap::new();
        for claim in &system.claims {
            if claim.task >= number || claims.insert(claim.task, claim).is_some() {
                return Err(format!("task {} has two claims, or does not exist", claim.task));
            }
        }
        let all = (0..number).map(|index| member(system, index, work)).collect::<Checks<Vec<_>>>()?;
        let mut tasks = CheckedTasks { all, claims, work };
        tasks.enter_blocking(&system.locks)?;
        system.operations.iter().try_for_each(|it| tasks.check_calls(it))?;
        Ok(tasks)
    }

    /// R, as it is claimed. Claims may rely on each other: until the first job that ends late, all jobs keep to them, so that
    /// each claim holds for that job too.
    pub(crate) fn response(&self, task: usize) -> Checks<u64> {
        let of = self.claims.get(&task).map(|claim| claim.response);
        of.ok_or_else(|| format!("relies on the response time of {}, which has no claim", self.name(task)))
    }

    pub(crate) fn name(&self, task: usize) -> String {
        self.all.get(task).map_or_else(|| format!("task {task}"), |it| format!("`{}`", it.task.name))
    }

    /// Returns the CPUs that tasks of this rank and above link to `cpus`, and how many sets of several CPUs they have.
    pub(crate) fn linked(&self, mut cpus: u128, least: u64) -> (u128, usize) {
        loop {
            let linked = || self.all.iter().filter(|it| it.delays(least, cpus)).map(|it| it.cpus);
            let all = linked().fold(cpus, |all, it| all | it);
            if all == cpus {
                let several = linked().filter(|it| !it.is_power_of_two());
                return (cpus, several.collect::<BTreeSet<u128>>().len());
            }
            cpus = all;
        }
    }

    /// Whether the CPUs of a task have to be analysed as if they were one: Linux may let a task wait beside one of lower
    /// priority where tasks have different sets of several CPUs.
    pub(crate) fn is_as_one(&self, task: usize) -> bool {
        let of = &self.all[task];
        self.linked(of.cpus, 1).1 > 1 && self.linked(of.cpus, of.raised).1 > 0
    }

    /// Checks how many calls of an operation a job of the provider executes: those that are sent from R before the job to the end of
    /// its period, by jobs that end R later; or those that are pending at most, and those that are sent in its period.
    fn check_calls(&self, of: &CertifiedOperation) -> Checks<()> {
        let (Some(provider), Some(client)) = (self.all.get(of.provider), self.all.get(of.client)) else {
            return Err("an operation of a task that does not exist".to_owned());
        };
        let Some(calls) = of.calls else { return Ok(()) };
        let what = format!("calls of {} by {}", self.name(of.provider), self.name(of.client));
        if provider.task.sporadic || provider.burst > 1 || provider.period == 0 || client.period == 0 {
            return Err(format!("{what}: nothing bounds when they are executed"));
        }
        let own = [self.response(of.client)?, provider.period].map(u128::from).iter().sum::<u128>();
        let sent_in = |window: u128| {
            let jobs = u128::div_ceil(window, client.period.into()).saturating_mul(client.burst.into());
            u128::from(of.sends).saturating_mul(jobs.div_ceil(of.every.max(1).into()))
        };
        if of.pending.is_some_and(|it| u128::from(calls) >= sent_in(own).saturating_add(it.into())) {
            return Ok(());
        }
        self.work.spend(provider.thread.len())?;
        let mut of_thread = 0;
        for it in &provider.thread {
            of_thread = of_thread.max(self.response(*it)?);
        }
        let least = sent_in(own.saturating_add(of_thread.into())).saturating_add(of.starting.into());
        match u128::from(calls) >= least {
            true => Ok(()),
            false => Err(format!("{what}: {calls} for each job, but {least} may be sent")),
        }
    }
}

fn member<'c>(system: &'c CertifiedSystem, index: usize, work: &WorkLeft) -> Checks<CheckedTask<'c>> {
    let task = &system.tasks[index];
    let rank = match task.priority {
        _ if !task.is_real_time => 0,
        priority => priority.map_or(u64::MAX, |it| it.saturating_add(1)),
    };
    let cpus = task.cpus.as_deref().map_or(Some(u128::MAX), mask).filter(|cpus| *cpus != 0);
    let cpus = cpus.ok_or_else(|| format!("`{}` has no CPU, or one that does not exist", task.name))?;
    // The calls that it executes in each job; none if they are not known.
    let operations = || system.operations.iter().filter(|it| it.provider == index && it.time > 0);
    let extra = operations().try_fold(0u64, |sum, it| sum.checked_add(it.time.checked_mul(it.calls?)?));
    // On unknown CPUs, it may delay others in more ways than by its demand.
    let extra = extra.filter(|_| task.cpus.is_some());
    let demand =
        task.machine.as_ref().zip(extra).map(|(of, extra)| TaskDemand::new(of, extra, work)).transpose()?;
    // An edge that waits does so once at least.
    let least = |of: &CertifiedMachine| of.edges.iter().any(|edge| edge.3 > 0).into();
    let waits = |of: &CertifiedMachine| of.waits.unwrap_or(u64::MAX).max(least(of));
    let is_mate = |of: &CertifiedTask| task.thread.is_some() && task.thread == of.thread;
    let thread = (0..system.tasks.len()).filter(|it| *it == index || is_mate(&system.tasks[*it]));
    let thread: Vec<usize> = thread.collect();
    let released = |of: &CertifiedTask| (of.period, of.jitter, of.is_real_time, of.priority, of.cpus.clone());
    let is_alike = |of: &CertifiedTask| released(of) == released(task) && !of.sporadic && of.burst <= 1;
    if thread.len() > 1 && !thread.iter().all(|it| is_alike(&system.tasks[*it])) {
        return Err(format!("the tasks in the thread of `{}` differ", task.name));
    }
    Ok(CheckedTask {
        task,
        period: task.period.unwrap_or(0),
        burst: task.burst.max(1),
        rank,
        raised: rank,
        cpus,
        demand,
        waits: task.machine.as_ref().map_or(u64::MAX, waits),
        has_calls: operations().next().is_some(),
        has_locks: false,
        thread,
        blocking: Ok((0, 0)),
    })
}

/// Returns CPUs by bit; none if one does not exist.
pub(crate) fn mask(cpus: &[u32]) -> Option<u128> {
    cpus.iter().try_fold(0, |all, cpu| (*cpu < u128::BITS).then(|| all | 1 << cpu))
}
