//! The tasks that may execute at the same time, by the tasks that are ready.

use super::system::{System, Task};

/// For each set of ready tasks (one bit for each), the sets of tasks that may execute.
///
/// A task executes on one CPU of its mask at a time, and a CPU executes one task. What else holds depends on the *group*
/// of a task: the tasks that share CPUs with it, directly or through others.
///
/// - Where the group has one or two CPUs, or all its masks of several CPUs are equal: no ready task waits while a CPU of
///   its mask is idle or executes a task of lower priority.
/// - Otherwise Linux may leave a task waiting for longer, and CPUs idle. For each priority, among the tasks of this
///   priority or a higher one that share CPUs (directly or through others of these): if any is ready, at least one
///   executes.
pub(crate) struct Scheduler {
    choices: Vec<Vec<u8>>,
}

impl Scheduler {
    pub(crate) fn new(system: &System) -> Scheduler {
        let tasks = &system.tasks;
        let all = (1u8 << tasks.len()) - 1;
        let has_order = tasks_where(tasks, |place| {
            let group = group_of(tasks, all, place);
            is_orderly(tasks, group)
        });
        let mut others: Vec<u8> = Vec::new();
        for priority in tasks.iter().map(|task| task.priority) {
            let above = tasks_where(tasks, |place| tasks[place].priority >= priority) & !has_order;
            others.extend(members(above).map(|place| group_of(tasks, above, place)));
        }
        others.sort_unstable();
        others.dedup();
        let cpus = tasks.iter().fold(0, |cpus, task| cpus | task.cpus);
        let choices = (0..=all).map(|ready| {
            let mut choices = Vec::new();
            let mut assignment = Assignment { tasks, ready, has_order, groups: &others, on_cpu: Vec::new() };
            assignment.extend(cpus, 0, &mut choices);
            choices.sort_unstable();
            choices.dedup();
            choices
        });
        Scheduler { choices: choices.collect() }
    }

    /// Returns the sets of tasks that may execute while those of `ready` are ready.
    pub(crate) fn choices(&self, ready: u8) -> &[u8] {
        &self.choices[usize::from(ready)]
    }
}

/// Whether no task of the system can be left waiting for longer than priorities and masks demand.
pub(crate) fn keeps_priorities(system: &System) -> bool {
    let tasks = &system.tasks;
    let all = (1 << tasks.len()) - 1;
    (0..tasks.len()).all(|place| is_orderly(tasks, group_of(tasks, all, place)))
}

fn is_orderly(tasks: &[Task], group: u8) -> bool {
    let cpus = members(group).fold(0, |cpus, place| cpus | tasks[place].cpus);
    let mut masks = members(group).map(|place| tasks[place].cpus).filter(|cpus| !cpus.is_power_of_two());
    let first = masks.next();
    cpus.count_ones() <= 2 || masks.all(|cpus| Some(cpus) == first)
}

fn members(set: u8) -> impl Iterator<Item = usize> {
    (0..8).filter(move |place| set >> place & 1 == 1)
}

fn tasks_where(tasks: &[Task], holds: impl Fn(usize) -> bool) -> u8 {
    (0..tasks.len()).filter(|&place| holds(place)).fold(0, |set, place| set | 1 << place)
}

/// Returns the tasks `among` those given that share CPUs with `place`, directly or through others of them.
fn group_of(tasks: &[Task], among: u8, place: usize) -> u8 {
    let mut cpus = tasks[place].cpus;
    loop {
        let group = tasks_where(tasks, |other| among >> other & 1 == 1 && tasks[other].cpus & cpus != 0);
        let wider = members(group).fold(cpus, |cpus, other| cpus | tasks[other].cpus);
        if wider == cpus {
            return group;
        }
        cpus = wider;
    }
}

/// A choice of a task, or none, for some of the CPUs.
struct Assignment<'a> {
    tasks: &'a [Task],
    ready: u8,
    /// The tasks that do not wait while a CPU of their masks is idle or executes a task of lower priority.
    has_order: u8,
    /// The groups of the others.
    groups: &'a [u8],
    on_cpu: Vec<Option<usize>>,
}

impl Assignment<'_> {
    /// Adds the executing tasks of every valid assignment of `cpu` and the CPUs after it.
    fn extend(&mut self, cpus: u64, executing: u8, choices: &mut Vec<u8>) {
        let cpu = self.on_cpu.len();
        if cpus >> cpu == 0 {
            if self.is_valid(executing) {
                choices.push(executing);
            }
            return;
        }
        self.on_cpu.push(None);
        self.extend(cpus, executing, choices);
        for place in members(self.ready & !executing) {
            if self.tasks[place].cpus >> cpu & 1 == 1 {
                self.on_cpu[cpu] = Some(place);
                self.extend(cpus, executing | 1 << place, choices);
            }
        }
        self.on_cpu.pop();
    }

    fn is_valid(&self, executing: u8) -> bool {
        let keeps_busy = |group: &u8| group & self.ready == 0 || group & executing != 0;
        self.groups.iter().all(keeps_busy)
            && members(self.ready & self.has_order & !executing).all(|waiting| self.may_wait(waiting))
    }

    fn may_wait(&self, waiting: usize) -> bool {
        let task = &self.tasks[waiting];
        let is_busy =
            |on_cpu: &Option<usize>| on_cpu.is_some_and(|other| self.tasks[other].priority >= task.priority);
        let mut cpus = self.on_cpu.iter().enumerate().filter(|(cpu, _)| task.cpus >> cpu & 1 == 1);
        cpus.all(|(_, on_cpu)| is_busy(on_cpu))
    }
}
