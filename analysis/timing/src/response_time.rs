//! Worst-case response times under preemptive fixed priorities (paper, eq. 19–20, and beyond one period).

use std::collections::HashSet;
use std::rc::Rc;

use crate::lane::{Lane, LaneMember, Members};
use crate::{
    Analysis, Bound, CpuLoad, CpuRule, CpuSet, Options, Priority, Response, Task, Time, Utilisation,
};

/// Returns the worst-case response time of each of `tasks`: a bound that no schedule exceeds, or the reason why there
/// is none.
///
/// A task releases a job each `period`, at most its `jitter` later than nominally, and executes it under preemptive fixed
/// priorities; its clock may have any phase, unless it has an `offset`. Late jobs of a task queue in order. A sporadic task
/// releases at most `burst` jobs in any window of its period.
///
/// **One CPU.** hp(i) are the tasks of higher or equal priority on the CPU of i. A half-open window of length t contains at most
/// ⌈(t + J)/T⌉ releases, with a demand of at most M(⌈(t + J)/T⌉) ([`TraceBound`](crate::TraceBound); with
/// [`Method::Classic`](crate::Method::Classic), n times the greatest cost). The first job of a busy window, which begins with a
/// simultaneous release of all tasks, ends at the least t > 0 with t = Mᵢ(1) + Σ over hp(i) of Mⱼ(⌈(t + Jⱼ)/Tⱼ⌉), where Mᵢ(1) is
/// at least 1 ns. If Jᵢ + t is within the period, it is the response time. Otherwise every job q of the window is analysed: f(q)
/// is the least t with t = Mᵢ(q) + Σ Mⱼ(⌈(t + Jⱼ)/Tⱼ⌉), R = Jᵢ + max f(q) − (q − 1)·T, up to the first q with f(q) + Jᵢ ≤ q·T.
/// (Where the CPU is loaded to exactly 100 %, there may be no such q; then up to where f repeats.) The better methods replace
/// Mⱼ: see [`Method`](crate::Method).
///
/// **Bursts.** With at most b releases in a window of T, n jobs are b·⌈(t + J)/T⌉, and the release of job q is ⌊(q − 1)/b⌋·T
/// after the start of the window.
///
/// **Threads.** Where a thread executes a job of several tasks in each period, one after another, job q of i ends when the thread has
/// executed q jobs of i and of those before it, and q − 1 of those after it: f(q) counts these in place of what the tasks of
/// the thread would demand in the window. The window ends when the whole period has ended before the next one.
///
/// **Synchronised clocks.** The windows of a task with an [`offset`](Task::offset), and of those that tasks with an offset delay,
/// begin at the actual releases of these tasks, if two of them are on the CPU: the greatest of the responses that are found in
/// these windows. If the releases are too many, the windows begin with a simultaneous release of all, which bounds them.
///
/// **Several CPUs.** A task that may use several CPUs has the least of the response times that it would have on each of them,
/// with all tasks of higher or equal priority that may run on that CPU. (From the last instant at which none of these had
/// unfinished work, at every instant at least one of them executes: if one waits, the CPU executes another.) This needs a
/// scheduler that lets no task wait while a CPU of its set runs a task of lower priority. On Linux that is so if all sets of
/// several CPUs that share CPUs, directly or over others, are equal. Otherwise, the task is analysed on one imaginary CPU with
/// all tasks of higher or equal priority that share CPUs with it, directly or over others: at every instant with unfinished
/// work, one of these executes. Where all sets are equal, the task may have a lesser bound, as it waits only while each of its CPUs
/// executes one of hp(i): see `global.rs`. [`Response::rule`] says which.
///
/// The order of `tasks` does not matter for any figure. `interrupt` is called now and then, at least once a task and
/// once for every pass over hp(i); it may unwind in order to cancel. Budgets are counted in steps, so that the same
/// tasks give the same figures everywhere.
///
/// A task without a period or a CPU counts as one of unknown demand. A task is analysed if one of its CPUs has no task of unknown
/// demand and higher or equal priority. Tasks in the background are not analysed, and delay no other.
///
/// ```
/// use mauve_timing::*;
///
/// let task = |priority, period, cost| {
///     Task::new(priority, Time::from_nanos(period), StateMachine::single(Time::from_nanos(cost)))
/// };
/// let (laser, pilot) = (task(2, 10, 4), task(1, 30, 11));
/// let options = Options { method: Method::Exact, is_brief: false };
/// let analysis = response_times(&[laser, pilot], &options, &|| ());
/// assert_eq!(analysis.responses[1].bound, Bound::Response(Time::from_nanos(19)));
/// ```
pub fn response_times(tasks: &[Task], options: &Options, interrupt: &dyn Fn()) -> Analysis {
    let mut lanes = Lanes::new(tasks, options, interrupt);
    let mut best: Vec<Option<Response>> = tasks.iter().map(|_| None).collect();
    for plan in 0..lanes.plans.len() {
        let wanted = lanes.wanted(plan);
        let mut lane = lanes.lane(plan);
        let mut found = lane.analyse(|member| wanted.binary_search(&member.index).is_ok());
        lane.synchronise(&mut found);
        lane.queue_in_order(&mut found);
        lane.execute_in_rounds(&mut found);
        lane.begin_once(&mut found);
        lane.count_waits_as_jitter(&mut found);
        for found in found {
            let of_task = &mut best[found.task];
            *of_task = Some(better(of_task.take(), found.response));
        }
    }
    lanes.use_all_cpus(&mut best);
    let Lanes { members, unknown, linked, .. } = lanes;
    let not_analysed = |index: usize| {
        let task = &tasks[index];
        let scope = linked[index].unwrap_or(task.cpus());
        let delays = |&other: &usize| {
            other == index || tasks[other].priority >= task.priority && tasks[other].cpus().meets(scope)
        };
        Response {
            own: task.demand.own(options.method),
            first_job: None,
            bound: match task.priority {
                Priority::Background => Bound::Background,
                _ => Bound::NotAnalysed { because: unknown.iter().copied().filter(delays).collect() },
            },
            window: None,
            method: options.method,
            is_exhausted: false,
            rule: linked[index]
                .map_or(CpuRule::Cpu(task.cpus().first().unwrap_or(CpuSet::MOST)), CpuRule::Linked),
        }
    };
    let responses = best.into_iter().enumerate();
    let responses = responses.map(|(index, best)| {
        let task = &tasks[index];
        // A CPU with a task of unknown demand may be the one on which the deadline is met: it is not missed for sure.
        let may_be_met = |best: &Response| {
            best.status(task.deadline) != crate::Status::Met
                && unknown.iter().any(|&other| {
                    tasks[other].priority >= task.priority && tasks[other].cpus().meets(task.cpus())
                })
        };
        best.filter(|best| !may_be_met(best)).unwrap_or_else(|| not_analysed(index))
    });
    Analysis { responses: responses.collect(), cpus: loads(tasks, &members, &unknown) }
}

/// The tasks of an analysis, and the lanes that they are in.
pub(crate) struct Lanes<'a> {
    pub(crate) tasks: &'a [Task],
    pub(crate) options: &'a Options,
    pub(crate) interrupt: &'a dyn Fn(),
    /// One for each task that can be analysed, in their order.
    pub(crate) members: Vec<LaneMember<'a>>,
    /// The other real-time tasks.
    pub(crate) unknown: Vec<usize>,
    /// See [`linked_cpus`].
    linked: Vec<Option<CpuSet>>,
    plans: Vec<LanePlan>,
}

impl<'a> Lanes<'a> {
    pub(crate) fn new(tasks: &'a [Task], options: &'a Options, interrupt: &'a dyn Fn()) -> Lanes<'a> {
        let member =
            |(index, task): (usize, &'a Task)| LaneMember::new(index, task, options.method, interrupt);
        let known = tasks.iter().enumerate().filter(|(_, task)| task.is_known());
        let mut members: Vec<LaneMember<'a>> = known.filter_map(member).collect();
        for thread in threads(&members) {
            thread.iter().for_each(|&member| members[member].thread = Rc::clone(&thread));
        }
        let unknown: Vec<usize> = (0..tasks.len()).filter(|&task| tasks[task].is_unknown()).collect();
        let linked = linked_cpus(tasks);
        let plans = plans(tasks, &members, &unknown, &linked);
        Lanes { tasks, options, interrupt, members, unknown, linked, plans }
    }

    /// Returns the tasks that are analysed in a lane, ascending.
    pub(crate) fn wanted(&self, plan: usize) -> Vec<usize> {
        let tasks = self.plans[plan].members.iter().map(|&member| self.members[member].index);
        tasks.filter(|&task| self.wants(plan, task)).collect()
    }

    /// Returns whether a task in a lane is analysed there.
    pub(crate) fn wants(&self, plan: usize, task: usize) -> bool {
        self.plans[plan].wants(self.tasks, &self.linked, task)
    }

    /// Returns the lane in which this rule counts the tasks for task `of`, and the place of the task.
    pub(crate) fn find(&self, of: usize, rule: CpuRule) -> Option<(usize, usize)> {
        let member = self.members.binary_search_by_key(&of, |member| member.index).ok()?;
        let priority = self.tasks[of].priority;
        let is_it = |plan: &LanePlan| match rule {
            // One of the CPUs.
            CpuRule::Global(_) => plan.members.binary_search(&member).is_ok(),
            _ => plan.rule == rule && plan.priority.is_none_or(|of_plan| of_plan == priority),
        };
        let plan = self.plans.iter().position(is_it)?;
        Some((plan, self.plans[plan].members.binary_search(&member).ok()?))
    }

    pub(crate) fn lane(&mut self, plan: usize) -> Lane<'_, 'a> {
        Lane {
            rule: self.plans[plan].rule,
            members_of_all: self.plans.iter().map(|plan| plan.members.len() as u64).sum(),
            members: Members { all: &mut self.members, places: &self.plans[plan].members },
            options: self.options,
            interrupt: self.interrupt,
            start: None,
            starts: 1,
            lists_interference: false,
        }
    }
}

/// Returns, for each task that is analysed on linked CPUs, these: those that tasks of higher or equal priority link to its own,
/// where one of these may use several CPUs, and tasks of any priority have different sets of several CPUs there.
pub(crate) fn linked_cpus(tasks: &[Task]) -> Vec<Option<CpuSet>> {
    let mixed = linked(tasks.iter().map(Task::cpus)).filter(|group| group.is_mixed);
    let mixed: CpuSet = mixed.map(|group| group.cpus).collect();
    let mut by_priority: Vec<usize> =
        (0..tasks.len()).filter(|&task| tasks[task].cpus().meets(mixed)).collect();
    by_priority.sort_by_key(|&task| std::cmp::Reverse(tasks[task].priority));
    let mut groups: Vec<LinkedCpus> = Vec::new();
    let mut found = vec![None; tasks.len()];
    for level in by_priority.chunk_by(|&a, &b| tasks[a].priority == tasks[b].priority) {
        level.iter().for_each(|&task| link(&mut groups, tasks[task].cpus()));
        for &task in level {
            let group = groups.iter().find(|group| group.cpus.meets(tasks[task].cpus()));
            found[task] = group.filter(|group| group.several.is_some()).map(|group| group.cpus);
        }
    }
    found
}

/// CPUs that tasks link.
pub(crate) struct LinkedCpus {
    pub(crate) cpus: CpuSet,
    /// The set of several CPUs that a task has; that of any, if they differ.
    several: Option<CpuSet>,
    /// Whether tasks have different sets of several CPUs.
    is_mixed: bool,
}

/// Returns the CPUs that these sets link.
pub(crate) fn linked(sets: impl Iterator<Item = CpuSet>) -> impl Iterator<Item = LinkedCpus> {
    let mut groups = Vec::new();
    sets.for_each(|cpus| link(&mut groups, cpus));
    groups.into_iter()
}

/// Links the CPUs of a task.
fn link(groups: &mut Vec<LinkedCpus>, cpus: CpuSet) {
    let several = Some(cpus).filter(|cpus| cpus.len() > 1);
    let mut linked = LinkedCpus { cpus, several, is_mixed: false };
    groups.retain(|group| {
        let is_separate = !group.cpus.meets(linked.cpus);
        if !is_separate {
            let differs = group.several.zip(linked.several).is_some_and(|(one, other)| one != other);
            linked.is_mixed |= group.is_mixed || differs;
            linked.several = linked.several.or(group.several);
            linked.cpus |= group.cpus;
        }
        is_separate
    });
    groups.push(linked);
}

/// Returns the threads that execute the jobs of several members, each with these in their order.
fn threads(members: &[LaneMember<'_>]) -> Vec<Rc<[usize]>> {
    let mut threads: Vec<Vec<usize>> = Vec::new();
    for (index, member) in members.iter().enumerate().filter(|(_, member)| member.task.thread.is_some()) {
        let is_it = |thread: &&mut Vec<usize>| {
            thread.first().is_some_and(|first| members[*first].task.is_mate(member.task))
        };
        match threads.iter_mut().find(is_it) {
            Some(thread) => thread.push(index),
            None => threads.push(vec![index]),
        }
    }
    threads.into_iter().filter(|thread| thread.len() > 1).map(Rc::from).collect()
}

/// The tasks of one lane.
struct LanePlan {
    rule: CpuRule,
    /// Indices into the members, ascending.
    members: Vec<usize>,
    /// Tasks of this priority or a lower one are not analysed, as one of unknown demand may delay them.
    unknown: Option<Priority>,
    /// For [`CpuRule::Linked`]: the only priority that is analysed.
    priority: Option<Priority>,
}

impl LanePlan {
    fn new<'t>(
        members: &[LaneMember<'_>],
        unknown: impl Iterator<Item = &'t Task>,
        rule: CpuRule,
        priority: Option<Priority>,
    ) -> LanePlan {
        let is_in = |task: &Task| {
            task.cpus().meets(rule.cpus()) && priority.is_none_or(|least| task.priority >= least)
        };
        LanePlan {
            rule,
            members: (0..members.len()).filter(|&member| is_in(members[member].task)).collect(),
            unknown: unknown.filter(|task| is_in(task)).map(|task| task.priority).max(),
            priority,
        }
    }

    fn wants(&self, tasks: &[Task], linked: &[Option<CpuSet>], task: usize) -> bool {
        let priority = tasks[task].priority;
        let has_rule = match self.rule {
            CpuRule::Cpu(_) => linked[task].is_none(),
            CpuRule::Linked(cpus) => linked[task] == Some(cpus) && self.priority == Some(priority),
            CpuRule::Global(_) => false,
        };
        has_rule && self.unknown.is_none_or(|unknown| priority > unknown)
    }
}

/// Returns the lanes: one for each CPU, and one for each priority of tasks on linked CPUs. CPUs with the same tasks have one lane.
fn plans(
    tasks: &[Task],
    members: &[LaneMember<'_>],
    unknown: &[usize],
    linked: &[Option<CpuSet>],
) -> Vec<LanePlan> {
    let unknown = || unknown.iter().map(|&task| &tasks[task]);
    let used: CpuSet = members.iter().map(|member| member.task.cpus()).collect();
    let mut plans: Vec<LanePlan> = Vec::new();
    let mut seen = HashSet::new();
    for cpu in used.iter() {
        let plan = LanePlan::new(members, unknown(), CpuRule::Cpu(cpu), None);
        if seen.insert((plan.members.clone(), plan.unknown)) {
            plans.push(plan);
        }
    }
    let mut of_linked: Vec<(CpuSet, Priority)> =
        tasks.iter().zip(linked).filter_map(|(task, linked)| Some(((*linked)?, task.priority))).collect();
    of_linked.sort_unstable();
    of_linked.dedup();
    let of_linked = of_linked.into_iter();
    plans
        .extend(of_linked.map(|(cpus, priority)| {
            LanePlan::new(members, unknown(), CpuRule::Linked(cpus), Some(priority))
        }));
    plans
}

/// Returns the better of the responses of a task in two lanes.
pub(crate) fn better(one: Option<Response>, other: Response) -> Response {
    let Some(one) = one else { return other };
    match (&one.bound, &other.bound) {
        (Bound::Response(a), Bound::Response(b)) if b < a => other,
        (Bound::Response(_), _) => one,
        (_, Bound::Response(_)) => other,
        (a, b) => {
            // The reason must not depend on the order.
            let reason =
                |bound: &Bound| if let Bound::NoBound(reason) = bound { Some(*reason) } else { None };
            let bound = if reason(b) > reason(a) { b.clone() } else { a.clone() };
            let later = |first_job: Option<Time>| (first_job.is_none(), first_job);
            let earlier = if later(other.first_job) < later(one.first_job) { other } else { one };
            Response { bound, ..earlier }
        }
    }
}

/// Returns the utilisation of each CPU, or of the CPUs together that tasks of known demand link.
fn loads(tasks: &[Task], members: &[LaneMember<'_>], unknown: &[usize]) -> Vec<CpuLoad> {
    let groups = linked(members.iter().map(|member| member.task.cpus()));
    let mut groups: Vec<CpuSet> = groups.map(|group| group.cpus).collect();
    groups.sort_unstable_by_key(|group| group.first());
    let load = |cpus: CpuSet| CpuLoad {
        cpus,
        utilisation: Utilisation::sum(
            members.iter().filter(|member| member.task.cpus().meets(cpus)).map(LaneMember::executed_share),
        ),
        complete: !unknown.iter().any(|&task| tasks[task].cpus().meets(cpus)),
    };
    groups.into_iter().map(load).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, brute_force_cycle_mean, machine, machines};
    use crate::{Breakdown, Demand, Edge, Interference, Method, NoBoundReason, StateMachine, Status, Time};
    use expect_test::{Expect, expect};
    use proptest::prelude::*;
    use std::cmp::Ordering;

    const PSM: Options = Options { method: Method::Psm, is_brief: false };
    const CLASSIC: Options = Options { method: Method::Classic, is_brief: false };

    fn task(name: &str, priority: u32, period: u64, machine: StateMachine) -> Task {
        Task { name: name.into(), ..testing::task(priority, period, machine) }
    }

    fn single(name: &str, priority: u32, period: u64, cost: u64) -> Task {
        task(name, priority, period, StateMachine::single(Time::from_nanos(cost)))
    }

    fn unknown(name: &str, priority: u32, cpus: u128) -> Task {
        Task { demand: Demand::Unknown, cpus: Some(CpuSet(cpus)), ..single(name, priority, 10, 0) }
    }

    fn analyse(tasks: &[Task], options: Options) -> Analysis {
        response_times(tasks, &options, &|| ())
    }

    /// With edges that are longer than the period, the window of one task by [`Method::Ibf`] may be longer than that of the next.
    #[test]
    fn a_window_of_higher_priority_that_is_longer() {
        let tasks = [
            single("j", 3, 20, 2),
            task("i", 2, 6, machine(3, &[(0, 1, 11), (1, 2, 0), (2, 0, 1), (0, 2, 8), (2, 1, 2)])),
            single("k", 1, 1000, 1),
        ];
        let found = |method| bound(&analyse(&tasks, Options { method, ..PSM }).responses[2]);
        assert_eq!([Method::Psm, Method::Ibf].map(found), [48, 16]);
    }

    /// With a jitter of eleven days, a window has millions of jobs. The analysis ends soon after a response of 256 deadlines.
    #[test]
    fn a_hopeless_response_takes_few_passes() {
        let late = |it: u64| {
            let jitter = Time::from_nanos(1_000_000_000_000_000);
            Task { jitter, ..single("late", it as u32, 10_000_000 * it, 100_000) }
        };
        let tasks: Vec<Task> = (1..=20).map(late).collect();
        let passes = std::cell::Cell::new(0);
        response_times(&tasks, &PSM, &|| passes.set(passes.get() + 1));
        assert!(passes.get() < 1_000_000, "{}", passes.get());
    }

    /// The examples that separate the methods: the request bound combines paths that no run combines.
    #[test]
    fn methods_that_differ() {
        let hp = machine(3, &[(0, 0, 1), (1, 1, 2), (2, 2, 1), (0, 1, 0), (1, 2, 3), (2, 0, 1)]);
        let tasks = [task("hp", 2, 4, hp), single("lp", 1, 8, 2)];
        let found = |tasks: &[Task]| {
            [Method::Psm, Method::Ibf, Method::Exact].map(|method| {
                let response = analyse(tasks, Options { method, ..PSM }).responses.swap_remove(1);
                (bound(&response), response.method)
            })
        };
        assert_eq!(found(&tasks), [(7, Method::Psm), (6, Method::Ibf), (6, Method::Exact)]);
        let hp = machine(3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]);
        let tasks = [task("hp", 2, 3, hp), single("lp", 1, 5, 1)];
        assert_eq!(found(&tasks), [(10, Method::Psm), (9, Method::Ibf), (8, Method::Exact)]);
    }

    fn interference(tasks: &[Task], options: Options, of: usize, response: &Response) -> Vec<Interference> {
        Breakdown::new(tasks, &options, &|| ()).of(
            of,
            response.rule,
            response.window.as_ref(),
            response.first_job,
        )
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
                    let names: Vec<&str> = because.iter().map(|&task| &*tasks[task].name).collect();
                    format!(", not analysed because of {}", names.join(" "))
                }
                Bound::Background => panic!("real-time"),
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
            let cpus: Vec<String> = load.cpus.iter().map(|cpu| cpu.to_string()).collect();
            lines.push_str(&format!("cpu {}{complete} {:.3}\n", cpus.join("+"), load.utilisation.as_f64()));
        }
        lines
    }

    fn check(tasks: &[Task], options: Options, expected: Expect) {
        expected.assert_eq(&show(tasks, options));
    }

    #[test]
    fn responses_within_the_period() {
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
    fn a_utilisation_of_one_has_a_bound() {
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
    fn an_overloaded_cpu_has_no_bound() {
        let tasks = [
            single("half", 3, 10, 5),
            single("more", 2, 10, 6),
            single("below", 1, 100, 1),
            Task { cpus: Some(CpuSet(2)), ..single("elsewhere", 0, 100, 1) },
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
        let all = |task: &Task| Task { priority: Priority::RealTime(1), ..task.clone() };
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
    fn tasks_below_an_unknown_demand_have_no_bound() {
        let tasks = [
            single("above", 5, 10, 1),
            unknown("lost", 4, 1),
            single("equal", 4, 10, 1),
            Task { cpus: Some(CpuSet(2)), ..single("elsewhere", 1, 10, 1) },
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
            Task { cpus: Some(CpuSet(3)), ..single("two", 3, 10, 1) },
            Task { cpus: Some(CpuSet(0)), ..single("none", 3, 10, 1) },
            single("never", 3, 0, 1),
            Task { cpus: Some(CpuSet(2)), ..single("one", 1, 10, 1) },
            Task { cpus: Some(CpuSet(4)), ..single("other", 1, 10, 1) },
        ];
        check(
            &tasks,
            PSM,
            expect![[r#"
                two: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
                none: own 1, not analysed because of none (not-analysed)
                never: own 1, not analysed because of never (not-analysed)
                one: own 1, first job 2, response 2 (met), two 1 jobs 1, window of 1 jobs 1 in 2
                other: own 1, first job 1, response 1 (met), window of 1 jobs 1 in 1
                cpu 0+1 at least 0.200
                cpu 2 0.100
            "#]],
        );
    }

    #[test]
    fn the_first_of_equal_cpus_is_reported() {
        let on = |cpus, task: Task| Task { cpus: Some(CpuSet(cpus)), ..task };
        let rule_and_bound = |tasks: &[Task]| {
            let found = analyse(tasks, PSM).responses.swap_remove(0);
            (found.rule, found.bound)
        };
        let two = on(3, single("two", 1, 10, 0));
        let tasks = [two.clone(), on(1, single("a", 2, 10, 4)), on(2, single("b", 2, 10, 4))];
        assert_eq!(rule_and_bound(&tasks), (CpuRule::Cpu(0), Bound::Response(Time::from_nanos(5))));
        // One CPU is full, and the other is overloaded.
        let no_bound = Bound::NoBound(NoBoundReason::SeveralCpus);
        let tasks = [two.clone(), on(1, single("a", 2, 10, 10)), on(2, single("b", 2, 10, 11))];
        assert_eq!(rule_and_bound(&tasks), (CpuRule::Cpu(0), no_bound.clone()));
        let tasks = [two, on(1, single("a", 2, 10, 11)), on(2, single("b", 2, 10, 10))];
        assert_eq!(rule_and_bound(&tasks), (CpuRule::Cpu(0), no_bound));
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
    fn a_long_search_ends_without_a_bound() {
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
    /// denominator, the linked CPUs step by step.
    mod plain {
        use super::*;

        #[derive(Clone)]
        pub(super) struct Found {
            pub(super) first_job: Option<u64>,
            pub(super) bound: Bound,
            /// The job, its demand, and its end.
            pub(super) window: Option<(u64, u64, u64)>,
        }

        /// Windows are followed up to here.
        pub(super) const LONGEST: u64 = 3000;

        /// M(0), M(1), …
        fn demands(task: &Task, method: Method) -> Vec<u64> {
            let Demand::Machine { machine, whole } = &task.demand else { panic!("known") };
            if method == Method::Classic {
                let cost = machine.greatest_cost().max(whole.unwrap_or_default()).as_nanos();
                return (0..=2 * LONGEST).map(|jobs| jobs * cost).collect();
            }
            let mut current = vec![0; machine.states() as usize];
            let mut demands = vec![0];
            for _ in 0..2 * LONGEST {
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
                (u128::from(cost), u128::from(length * task.period.unwrap().as_nanos()))
            };
            let means: Vec<(u128, u128)> = tasks.iter().map(mean).collect();
            let denominator: u128 = means.iter().map(|mean| mean.1).product();
            let numerator: u128 = means.iter().map(|mean| mean.0 * (denominator / mean.1)).sum();
            numerator.cmp(&denominator)
        }

        fn is_known(task: &Task) -> bool {
            !task.cpus().is_empty() && task.period > Some(Time::ZERO) && task.demand != Demand::Unknown
        }

        /// The CPUs that tasks of at least the priority link to those of `task`, if these have sets of several CPUs, and all
        /// tasks that are linked have different ones.
        pub(super) fn linked(tasks: &[Task], task: &Task) -> Option<CpuSet> {
            let linked = |priority: Priority| {
                let above = || tasks.iter().filter(move |other| other.priority >= priority);
                let mut cpus = task.cpus();
                while let Some(more) =
                    above().find(|other| other.cpus().meets(cpus) && !(other.cpus() - cpus).is_empty())
                {
                    cpus |= more.cpus();
                }
                let several = above().map(|other| other.cpus()).filter(|it| it.meets(cpus) && it.len() > 1);
                (cpus, several.collect::<std::collections::BTreeSet<CpuSet>>().len())
            };
            let (cpus, several) = linked(task.priority);
            (several > 0 && linked(Priority::RealTime(0)).1 > 1).then_some(cpus)
        }

        /// `None` where a window that may end is too long.
        pub(super) fn response(tasks: &[Task], index: usize, method: Method) -> Option<Found> {
            let task = &tasks[index];
            let linked = linked(tasks, task);
            let at_least_as_urgent = |scope: CpuSet| {
                let is_in = move |other: &usize| {
                    *other != index
                        && tasks[*other].priority >= task.priority
                        && tasks[*other].cpus().meets(scope)
                };
                (0..tasks.len()).filter(is_in)
            };
            let unknown = |scope: CpuSet| -> Vec<usize> {
                let others =
                    at_least_as_urgent(scope).chain([index]).filter(|&other| !is_known(&tasks[other]));
                let mut unknown: Vec<usize> = others.collect();
                unknown.sort_unstable();
                unknown
            };
            let scopes: Vec<CpuSet> = linked.map_or_else(|| task.cpus().each().collect(), |cpus| vec![cpus]);
            let clean: Vec<CpuSet> = scopes.into_iter().filter(|&scope| unknown(scope).is_empty()).collect();
            let because = unknown(linked.unwrap_or(task.cpus()));
            let not_analysed = Found {
                first_job: None,
                bound: Bound::NotAnalysed { because: because.clone() },
                window: None,
            };
            if clean.is_empty() {
                return Some(not_analysed);
            }
            let mut found = Vec::new();
            for scope in clean {
                let hp: Vec<&Task> = at_least_as_urgent(scope).map(|other| &tasks[other]).collect();
                found.push(on_one_cpu(task, &hp, method, scope)?);
            }
            let first_job = found.iter().filter_map(|it| it.first_job).min();
            let least = |it: &&Found| matches!(it.bound, Bound::Response(_));
            let time = |it: &&Found| if let Bound::Response(time) = it.bound { time } else { panic!() };
            let least = found.iter().filter(least).min_by_key(time);
            // A CPU with unknown demand may meet a deadline that the others miss.
            if !because.is_empty() && least.is_none_or(|it| Some(time(&it)) > task.deadline) {
                return Some(not_analysed);
            }
            if let Some(least) = least {
                return Some(least.clone());
            }
            let worst = found.into_iter().max_by_key(|it| match it.bound {
                Bound::NoBound(reason) => Some(reason),
                _ => None,
            });
            worst.map(|it| Found { first_job, ..it })
        }

        fn on_one_cpu(task: &Task, hp: &[&Task], method: Method, scope: CpuSet) -> Option<Found> {
            let all: Vec<&Task> = hp.iter().copied().chain([task]).collect();
            let (load_hp, load_all) = (load(hp, method), load(&all, method));
            let own = demands(task, method);
            let others: Vec<(&&Task, Vec<u64>)> =
                hp.iter().map(|other| (other, demands(other, method))).collect();
            let end_of = |job: u64, from: u64| {
                (from..LONGEST).find(|&length| {
                    let interference = others.iter().map(|(other, demands)| {
                        demands[(length + other.jitter.as_nanos()).div_ceil(other.period.unwrap().as_nanos())
                            as usize]
                    });
                    own[job as usize].max(1) + interference.sum::<u64>() == length
                })
            };
            let several_cpus = all.iter().any(|task| task.cpus().len() > 1);
            let overloaded = match several_cpus {
                true => Bound::NoBound(NoBoundReason::SeveralCpus),
                false => Bound::Unbounded { cpu: scope.first().unwrap() },
            };
            let fully_loaded = Bound::NoBound(NoBoundReason::FullyLoaded);
            if load_hp != Ordering::Less {
                let bound = if load_all == Ordering::Greater { overloaded } else { fully_loaded };
                return Some(Found { first_job: None, bound, window: None });
            }
            let first_job = end_of(1, 1)?;
            if load_all == Ordering::Greater {
                return Some(Found { first_job: Some(first_job), bound: overloaded, window: None });
            }
            let (period, jitter) = (task.period.unwrap().as_nanos(), task.jitter.as_nanos());
            let (mut worst, mut worst_response) = ((1, first_job), first_job + jitter);
            let (mut job, mut length) = (1, first_job);
            while length + jitter > job * period {
                job += 1;
                length = match end_of(job, length) {
                    Some(length) => length,
                    // It may never end. What has been seen is compared with.
                    None if load_all == Ordering::Equal => break,
                    None => return None,
                };
                let response = (length + jitter).saturating_sub((job - 1) * period);
                if response > worst_response {
                    (worst, worst_response) = ((job, length), response);
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

    /// The number of paths that [`response_by_all_paths`] combines.
    fn number_of_combinations(hp: &[Task], longest: u64) -> u64 {
        let paths = |task: &Task| {
            let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
            let mut from = vec![1u64; machine.states() as usize];
            for _ in 0..(longest + task.jitter.as_nanos()).div_ceil(task.period.unwrap().as_nanos()) {
                let mut next = vec![0u64; from.len()];
                for edge in machine.edges() {
                    let number = &mut next[edge.source as usize];
                    *number = number.saturating_add(from[edge.target as usize]);
                }
                from = next;
            }
            from.into_iter().fold(0, u64::saturating_add)
        };
        hp.iter().map(paths).fold(1, u64::saturating_mul)
    }

    /// All combinations of paths of the interfering tasks on one CPU, one by one: the greatest response over all of them.
    fn response_by_all_paths(task: &Task, hp: &[Task], longest: u64, jobs: u64) -> u64 {
        fn paths(machine: &StateMachine, state: u32, jobs: u64) -> Vec<Vec<u64>> {
            if jobs == 0 {
                return vec![vec![0]];
            }
            let edges = machine.edges().iter().filter(|edge| edge.source == state);
            let with_edge = |edge: &Edge| {
                let rest = paths(machine, edge.target, jobs - 1);
                let cost = edge.cost.as_nanos();
                rest.into_iter()
                    .map(move |rest| {
                        std::iter::once(0)
                            .chain(rest.iter().map(move |total| total + cost))
                            .collect::<Vec<u64>>()
                    })
                    .collect::<Vec<_>>()
            };
            edges.flat_map(with_edge).collect()
        }
        let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
        let own = |jobs: u64| {
            (0..machine.states())
                .map(|state| testing::brute_force_demand(machine, state, jobs))
                .max()
                .unwrap()
        };
        let mut combinations: Vec<Vec<Vec<u64>>> = vec![Vec::new()];
        let mut of_tasks = Vec::new();
        for other in hp {
            let Demand::Machine { machine, .. } = &other.demand else { panic!("known") };
            let jobs = (longest + other.jitter.as_nanos()).div_ceil(other.period.unwrap().as_nanos());
            let mut all: Vec<Vec<u64>> =
                (0..machine.states()).flat_map(|state| paths(machine, state, jobs)).collect();
            all.sort_unstable();
            all.dedup();
            of_tasks.push((other.period.unwrap().as_nanos(), other.jitter.as_nanos()));
            combinations = combinations
                .iter()
                .flat_map(|chosen| all.iter().map(move |path| [chosen.clone(), vec![path.clone()]].concat()))
                .collect();
        }
        let mut greatest = 0;
        for chosen in combinations {
            for job in 1..=jobs {
                let end = (1..).find(|&length: &u64| {
                    let demand = chosen.iter().zip(&of_tasks).map(|(path, (period, jitter))| {
                        path[(((length + jitter).div_ceil(*period)) as usize).min(path.len() - 1)]
                    });
                    own(job).max(1) + demand.sum::<u64>() <= length
                });
                let (end, released) =
                    (end.unwrap() + task.jitter.as_nanos(), (job - 1) * task.period.unwrap().as_nanos());
                greatest = greatest.max(end.saturating_sub(released));
                if end <= job * task.period.unwrap().as_nanos() {
                    break;
                }
            }
        }
        greatest
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
            jitter in prop_oneof![3 => Just(0u64), 1 => 1..20u64],
            cpus in prop_oneof![20 => Just(1u128), 4 => Just(2u128), 4 => Just(3u128), 1 => Just(0u128), 2 => 1..8u128],
            demand in demands(),
        ) -> Task {
            Task {
                priority: Priority::RealTime(priority),
                period: Some(Time::from_nanos(period)),
                deadline: Some(Time::from_nanos(deadline)),
                jitter: Time::from_nanos(jitter),
                cpus: Some(CpuSet(cpus)),
                demand,
                ..Task::default()
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
                // The explorations of schedules check what is less on all CPUs.
                if let CpuRule::Global(_) = response.rule {
                    let of_one = if let Bound::Response(time) = expected.bound { time.as_nanos() } else { u64::MAX };
                    prop_assert!(bound(response) < of_one);
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
            is_psm: bool,
        ) {
            let method = if is_psm { Method::Psm } else { Method::Classic };
            let options = Options { method, is_brief: false };
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
                let mut renamed = response.clone();
                if let Some(window) = &mut renamed.window {
                    window.late.iter_mut().for_each(|(task, _)| *task = shuffled[*task]);
                    window.late.sort_unstable();
                }
                prop_assert_eq!(of_straight, &renamed);
                let mut parts = interference(&other_tasks, options, place, &response);
                parts.iter_mut().for_each(|part| part.task = shuffled[part.task]);
                parts.sort_unstable_by_key(|part| part.task);
                prop_assert_eq!(interference(&tasks, options, task, of_straight), parts);
            }
        }

        #[test]
        fn the_order_of_the_tasks_does_not_matter_for_paths(
            (tasks, shuffled) in any_tasks().prop_flat_map(|tasks| {
                let order: Vec<usize> = (0..tasks.len()).collect();
                (Just(tasks), Just(order).prop_shuffle())
            }),
            is_brief: bool,
        ) {
            let options = Options { method: Method::Best, is_brief };
            let straight = analyse(&tasks, options);
            let other_tasks: Vec<Task> = shuffled.iter().map(|&task| tasks[task].clone()).collect();
            let other = analyse(&other_tasks, options);
            for (place, &task) in shuffled.iter().enumerate() {
                let (one, other) = (&straight.responses[task], &other.responses[place]);
                prop_assert_eq!(bound(one), bound(other));
                prop_assert_eq!((one.method, one.is_exhausted), (other.method, other.is_exhausted));
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
                        period: task.period.map(scale),
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
                let period = task.period.unwrap().as_nanos();
                task.period = Some(Time::from_nanos(period.saturating_sub(by).max(1)));
            });
            prop_assert!(all_no_lower(&with_shorter_period));
            // More urgent: not later itself, and the others not earlier.
            let after = with(&|task| {
                task.priority = Priority::RealTime(task.priority.real_time().unwrap() + by as u32);
            });
            for (index, (before, after)) in before.responses.iter().zip(&after.responses).enumerate() {
                if index == changed {
                    prop_assert!(bound(before) >= bound(after));
                } else {
                    prop_assert!(bound(before) <= bound(after));
                }
            }
        }

        /// A thread delays its tasks no more than equal priorities would, and the others as much.
        #[test]
        fn a_thread_is_no_worse_than_equal_priorities(
            tasks in any_tasks(),
            mates in 2..4usize,
            method in prop::sample::select(&[Method::Classic, Method::Psm, Method::Ibf][..]),
        ) {
            let on_one_cpu = tasks.into_iter().filter(|task| task.cpus().is_one()).collect();
            let thread = testing::with_thread(on_one_cpu, mates, 1);
            let alone: Vec<Task> = thread.iter().map(|it| Task { thread: None, ..it.clone() }).collect();
            let found = [thread, alone].map(|tasks| analyse(&tasks, Options { method, ..PSM }).responses);
            for (index, (thread, alone)) in found[0].iter().zip(&found[1]).enumerate() {
                prop_assert!(bound(thread) <= bound(alone));
                prop_assert!(index < mates || bound(thread) == bound(alone));
            }
        }

        #[test]
        fn each_method_is_never_above_the_one_before(
            tasks in any_tasks(),
            mates in 0..4usize,
            burst in 1..4u64,
        ) {
            let tasks = testing::with_thread(tasks, mates, burst);
            let methods = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact];
            let found = methods.map(|method| analyse(&tasks, Options { method, ..PSM }));
            for (before, after) in found.iter().zip(&found[1..]) {
                for (before, after) in before.responses.iter().zip(&after.responses) {
                    prop_assert!(bound(after) <= bound(before));
                }
            }
        }

        #[test]
        fn the_story_of_each_method_adds_up(tasks in any_tasks(), mates in 0..4usize, burst in 1..4u64) {
            let tasks = testing::with_thread(tasks, mates, burst);
            for method in [Method::Ibf, Method::Exact, Method::Best] {
                let options = Options { method, ..PSM };
                for (index, response) in analyse(&tasks, options).responses.iter().enumerate() {
                    let Some(window) = &response.window else { continue };
                    let parts = interference(&tasks, options, index, response);
                    let interference: u64 = parts.iter().map(|part| part.time.as_nanos()).sum();
                    let cpus = match response.rule {
                        CpuRule::Global(cpus) => u64::from(cpus.len()),
                        _ => 1,
                    };
                    let own = window.own.as_nanos().max(1);
                    prop_assert!(own + interference / cpus <= window.length.as_nanos());
                    prop_assert!(cpus > 1 || own + interference == window.length.as_nanos());
                    let released = tasks[index].release_of(window.job).unwrap().as_nanos();
                    let end = window.length.as_nanos() + tasks[index].jitter.as_nanos();
                    prop_assert_eq!(bound(response), end - released);
                }
            }
        }

        #[test]
        fn exact_equals_the_greatest_of_all_combinations(
            hp in proptest::collection::vec((2..7u64, 0..4u64, machines(3, 5)), 1..3),
            own in (2..12u64, 0..4u64, machines(2, 4)),
        ) {
            let of = |priority, (period, jitter, machine): (u64, u64, StateMachine)| Task {
                jitter: Time::from_nanos(jitter),
                ..task("", priority, period, machine)
            };
            let tasks: Vec<Task> = hp.into_iter().map(|hp| of(2, hp)).chain([of(1, own)]).collect();
            let index = tasks.len() - 1;
            let psm = analyse(&tasks, PSM).responses.swap_remove(index);
            // Where the window is not too long for all combinations.
            let Some(window) = psm.window.filter(|window| window.length.as_nanos() <= 14) else { return Ok(()) };
            let exact = analyse(&tasks, Options { method: Method::Exact, ..PSM }).responses.swap_remove(index);
            let longest = window.length.as_nanos() + 12;
            let is_short = number_of_combinations(&tasks[..index], longest) < 100_000;
            if is_short && exact.method == Method::Exact && !exact.is_exhausted {
                let expected = response_by_all_paths(&tasks[index], &tasks[..index], longest, window.job + 4);
                prop_assert_eq!(bound(&exact), expected);
            }
        }
    }
}
