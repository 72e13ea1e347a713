//! The task set of a certificate: which tasks delay which, what their jobs demand, and the calls that they execute.

use std::collections::BTreeMap;

use crate::certificate::{Claim, Kind, Operation, Priority, System, Task};
use crate::demand::{Check, Curve, Work};

const MOST_TASKS: usize = 4096;
const MOST_CPUS: u32 = 128;

/// A task, as the checks need it.
pub(crate) struct Member<'c> {
    pub(crate) task: &'c Task,
    pub(crate) period: u64,
    pub(crate) burst: u64,
    pub(crate) deadline: Option<u64>,
    /// 0 in the background; the priority plus 1; the highest if it is unknown.
    pub(crate) rank: u64,
    /// With what it may inherit from users of a lock on other CPUs.
    pub(crate) raised: u64,
    /// The CPUs on which it may run, by bit; none in the background.
    pub(crate) cpus: u128,
    /// What a job demands, with its waits; none if that is unknown.
    pub(crate) demand: Option<Curve<'c>>,
    /// What a job executes.
    pub(crate) executed: Option<Curve<'c>>,
    /// Whether its jobs wait, and how often at most.
    pub(crate) waits: bool,
    pub(crate) times_waiting: u64,
    /// The instant of its releases on its clock.
    pub(crate) offset: Option<u64>,
    pub(crate) has_calls: bool,
    /// The tasks of its thread, with itself; only itself without one.
    pub(crate) thread: Vec<usize>,
    /// B, or why locks leave it without a bound.
    pub(crate) blocking: Check<u64>,
}

pub(crate) struct Tasks<'c> {
    pub(crate) all: Vec<Member<'c>>,
    pub(crate) claims: BTreeMap<usize, &'c Claim>,
    pub(crate) work: &'c Work,
}

impl Member<'_> {
    pub(crate) fn is_pinned(&self) -> bool {
        self.cpus.is_power_of_two()
    }

    pub(crate) fn is_known(&self) -> bool {
        self.demand.is_some() && self.cpus != 0 && self.period > 0 && self.blocking.is_ok()
    }

    /// Whether it delays a task of this rank on some of these CPUs.
    pub(crate) fn delays(&self, rank: u64, cpus: u128) -> bool {
        self.raised >= rank && self.cpus & cpus != 0
    }
}

impl<'c> Tasks<'c> {
    pub(crate) fn new(system: &'c System, work: &'c Work) -> Check<Tasks<'c>> {
        if system.tasks.len() > MOST_TASKS {
            return Err(format!("more than {MOST_TASKS} tasks"));
        }
        let mut claims = BTreeMap::new();
        for claim in &system.claims {
            if claim.task >= system.tasks.len() || claims.insert(claim.task, claim).is_some() {
                return Err(format!("task {} has two claims, or does not exist", claim.task));
            }
        }
        let all = system.tasks.iter().enumerate();
        let all = all.map(|(index, _)| member(system, index, work)).collect::<Check<Vec<_>>>()?;
        let mut tasks = Tasks { all, claims, work };
        for (index, it) in tasks.all.iter().enumerate() {
            let of_thread = |other: &Member<'_>| other.task.thread == it.task.thread;
            let mates = tasks.all.iter().filter(|other| of_thread(other)).count();
            if it.task.thread.is_some() && mates != it.thread.len() {
                return Err(format!("the tasks in the thread of {} differ", tasks.name(index)));
            }
            if it.task.kind == Kind::Throttling && (it.rank != u64::MAX || !it.is_pinned()) {
                return Err("throttling has the highest priority, on one CPU".to_owned());
            }
        }
        let of_thread = |index: usize| tasks.all[index].thread.iter().any(|it| tasks.all[*it].has_calls);
        let moved: Vec<bool> = (0..tasks.all.len()).map(of_thread).collect();
        tasks.all.iter_mut().zip(moved).filter(|it| it.1).for_each(|(it, _)| it.offset = None);
        tasks.enter_blocking(&system.locks)?;
        for operation in &system.operations {
            tasks.check_calls(operation, &system.operations)?;
        }
        Ok(tasks)
    }

    /// R, as it is claimed. Claims may rely on each other: until the first job that ends late, all jobs keep to them, so that
    /// each claim holds for that job too.
    pub(crate) fn response(&self, task: usize) -> Check<u64> {
        let of = self.claims.get(&task).map(|claim| claim.response);
        of.ok_or_else(|| format!("relies on the response time of {}, which has no claim", self.name(task)))
    }

    pub(crate) fn name(&self, task: usize) -> String {
        self.all.get(task).map_or_else(|| format!("task {task}"), |it| format!("`{}`", it.task.name))
    }

    /// Returns the CPUs that these tasks link to `cpus`, and their sets of several CPUs.
    fn linked(&self, mut cpus: u128, least: u64) -> (u128, Vec<u128>) {
        loop {
            let before = cpus;
            let linked = || self.all.iter().filter(|it| it.delays(least, before));
            cpus = linked().fold(cpus, |cpus, it| cpus | it.cpus);
            if cpus == before {
                let mut several: Vec<u128> =
                    linked().map(|it| it.cpus).filter(|it| !it.is_power_of_two()).collect();
                several.sort_unstable();
                several.dedup();
                return (cpus, several);
            }
        }
    }

    /// Returns the CPUs on which a task has to be analysed as if they were one: Linux may let a task wait beside one of lower
    /// priority where tasks have different sets of several CPUs.
    pub(crate) fn as_one(&self, task: usize) -> Option<u128> {
        let of = &self.all[task];
        if self.linked(of.cpus, 1).1.len() < 2 {
            return None;
        }
        let (cpus, several) = self.linked(of.cpus, of.raised);
        (!several.is_empty()).then_some(cpus)
    }

    /// Whether the tasks that delay `task` on these CPUs may run on no others.
    pub(crate) fn is_closed(&self, cpus: u128, task: usize) -> bool {
        self.linked(cpus, self.all[task].raised).0 == cpus
    }

    /// Checks how many calls of an operation a job of the provider executes.
    fn check_calls(&self, of: &Operation, all: &[Operation]) -> Check<()> {
        let (Some(provider), Some(client)) = (self.all.get(of.provider), self.all.get(of.client)) else {
            return Err("an operation of a task that does not exist".to_owned());
        };
        let Some(calls) = of.calls else { return Ok(()) };
        let what = format!("calls of {} by {}", self.name(of.provider), self.name(of.client));
        if provider.task.sporadic || provider.burst > 1 || provider.period == 0 || client.period == 0 {
            return Err(format!("{what}: nothing bounds when they are executed"));
        }
        let of_thread = provider.thread.iter().map(|it| self.response(*it)).collect::<Check<Vec<u64>>>()?;
        let of_provider = of_thread.into_iter().max().unwrap_or(0);
        let window =
            u128::from(self.response(of.client)?) + u128::from(of_provider) + u128::from(provider.period);
        let jobs = window.div_ceil(u128::from(client.period)).saturating_mul(u128::from(client.burst));
        let sends = match of.during {
            None => u128::from(of.sends),
            Some(during) => {
                // An earlier one, that the client executes.
                let index = all.iter().position(|it| std::ptr::eq(it, of)).unwrap_or(0);
                let earlier = all.get(during).filter(|it| during < index && it.provider == of.client);
                let calls = earlier
                    .and_then(|it| it.calls)
                    .ok_or_else(|| format!("{what}: sent by unknown calls"))?;
                u128::from(of.sends).saturating_mul(u128::from(calls))
            }
        };
        let least = sends.saturating_mul(jobs);
        match u128::from(calls) >= least {
            true => Ok(()),
            false => Err(format!("{what}: {calls} for each job, but {least} may be sent")),
        }
    }
}

fn member<'c>(system: &'c System, index: usize, work: &'c Work) -> Check<Member<'c>> {
    let task = &system.tasks[index];
    let rank = rank_of(&task.priority);
    let of_cpu = |cpu: &u32| 1u128.checked_shl(*cpu).filter(|_| *cpu < MOST_CPUS);
    let cpus = match &task.cpus {
        _ if rank == 0 => 0,
        Some(cpus) => cpus.iter().try_fold(0, |all, cpu| Some(all | of_cpu(cpu)?)).ok_or("no such CPU")?,
        None => u128::MAX,
    };
    // The calls that it executes in each job; none if they are not known.
    let executes = |it: &&Operation| it.provider == index && it.time > 0 && rank > 0;
    let operations = || system.operations.iter().filter(executes);
    let of_calls = operations().try_fold(0u64, |sum, it| sum.checked_add(it.time.checked_mul(it.calls?)?));
    let machine = task.machine.as_ref().zip(of_calls);
    let curve = |waits| machine.map(|(of, extra)| Curve::new(of, waits, extra, work)).transpose();
    let waits = task.machine.as_ref().is_some_and(|of| of.edges.iter().any(|edge| edge.3 > 0));
    let is_periodic = |of: &Task| !of.sporadic && of.burst <= 1;
    let is_mate = |(other, of): &(usize, &Task)| {
        let alike = task.thread.is_some()
            && (task.thread, task.period, task.jitter, task.offset)
                == (of.thread, of.period, of.jitter, of.offset)
            && (task.clock, &task.cpus) == (of.clock, &of.cpus)
            && rank_of(&task.priority) == rank_of(&of.priority);
        *other == index || alike && is_periodic(task) && is_periodic(of)
    };
    let times_waiting = task.machine.as_ref().and_then(|it| it.waits);
    if waits && times_waiting == Some(0) {
        return Err(format!("`{}` waits, and not even once", task.name));
    }
    if rank > 0 && cpus == 0 {
        return Err(format!("`{}` has no CPU", task.name));
    }
    Ok(Member {
        task,
        period: task.period.unwrap_or(0),
        burst: task.burst.max(1),
        deadline: task.deadline,
        rank,
        raised: rank,
        cpus,
        demand: curve(true)?,
        executed: curve(false)?,
        waits,
        times_waiting: if waits { times_waiting.unwrap_or(0) } else { 0 },
        offset: task.offset.filter(|_| is_periodic(task)),
        has_calls: operations().next().is_some(),
        thread: system.tasks.iter().enumerate().filter(is_mate).map(|(index, _)| index).collect(),
        blocking: Ok(0),
    })
}

fn rank_of(priority: &Priority) -> u64 {
    match priority {
        Priority::Background => 0,
        Priority::RealTime(priority) => u64::from(*priority) + 1,
        Priority::Highest => u64::MAX,
    }
}
