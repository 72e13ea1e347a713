//! The activities of a deployment at one level: the common form of a model and an exported
//! file. Unknown properties are analysed as the worst case: an unknown priority is the highest, an unknown affinity
//! is every CPU.

use crate::task_set::{self, Called, NotAnalysed, Other, Priority, TaskSet};
use crate::{Breakdown, Demand, Method, Options, StateMachine, Task, Time};

/// An activity of a deployment, at one level.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Activity {
    /// A name for readers of the result; the analysis ignores it.
    pub name: String,
    /// Its priority.
    pub priority: Priority,
    /// T.
    pub period: Option<Time>,
    /// D.
    pub deadline: Option<Time>,
    /// J, the greatest delay of a release.
    pub jitter: Time,
    /// The offset of its releases in the period, counted from the instant that all synchronised clocks share; `None` if its
    /// phase is unknown.
    pub offset: Option<Time>,
    /// The CPUs that it may use, one bit for each; `None` if unknown.
    pub cpus: Option<u64>,
    /// The demand of its jobs. [`Demand::Unknown`] if any other property of the activity is unusable.
    pub demand: Demand,
}

/// An operation that one activity executes for another: in its own thread, at the start of its next period or between two
/// periods.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Operation {
    /// The index of the activity that executes it.
    pub provider: usize,
    /// The index of the activity that sends it.
    pub client: usize,
    /// The greatest number of calls that a job of the client sends; if `during`, that one execution of that operation sends.
    pub sends: u64,
    /// The execution time of one call.
    pub time: Time,
    /// The operation that sends the calls, executed by the client: the index of an earlier one.
    pub during: Option<usize>,
}

/// The activities of a deployment, at one level.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ActivitySet {
    /// In the order of the deployment.
    pub activities: Vec<Activity>,
    /// The connected operations that cost time.
    pub operations: Vec<Operation>,
    /// Real-time work that is not in the model.
    pub others: Vec<Other>,
    /// Whether Linux keeps some time from real-time tasks.
    pub throttled: bool,
}

/// The tasks of an [`ActivitySet`]: those of the real-time activities, other real-time work, then real-time throttling.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct SetTasks {
    pub(crate) tasks: Vec<Task>,
    /// The number of each task's activity. Ascending; other work has the numbers behind those of the activities, then
    /// throttling.
    numbers: Vec<usize>,
}

impl SetTasks {
    pub(crate) fn tasks(&self) -> &[Task] {
        &self.tasks
    }

    /// Returns a breakdown of the response times of the tasks; see [`SetTasks::task`].
    pub fn breakdown<'a>(&'a self, options: &'a Options, interrupt: &'a dyn Fn()) -> Breakdown<'a> {
        Breakdown::new(&self.tasks, options, interrupt)
    }

    /// Returns the task of an activity; none in the background.
    pub fn task(&self, activity: usize) -> Option<usize> {
        self.numbers.binary_search(&activity).ok()
    }

    /// Returns the activity of a task; for other work and real-time throttling, a number behind those of the activities.
    pub fn activity(&self, task: usize) -> usize {
        self.numbers.get(task).copied().unwrap_or(usize::MAX)
    }

    /// Returns the name of a task that is no activity: other work ([`Other::shown`]), or [`THROTTLING`].
    pub fn name(&self, task: usize) -> &str {
        self.tasks.get(task).map_or("", |task| &task.name)
    }
}

/// Linux keeps real-time tasks from the CPU for this long in each period, unless it is told otherwise
/// (`kernel.sched_rt_runtime_us`, `kernel.sched_rt_period_us`).
pub(crate) const THROTTLED: Time = Time::from_nanos(50_000_000);
pub(crate) const THROTTLING_PERIOD: Time = Time::from_nanos(1_000_000_000);

impl ActivitySet {
    /// Returns the name of what has this number in an analysis or in a schedule: an activity, other work ([`Other::shown`]), or
    /// [`THROTTLING`].
    pub fn name(&self, number: usize) -> String {
        match (self.activities.get(number), self.other(number)) {
            (Some(activity), _) => activity.name.clone(),
            (None, Some(other)) => other.shown(),
            (None, None) => THROTTLING.to_owned(),
        }
    }

    /// Returns the other work that has this number, which is behind those of the activities.
    pub fn other(&self, number: usize) -> Option<&Other> {
        self.others.get(number.checked_sub(self.activities.len())?)
    }

    pub(crate) fn tasks(&self) -> SetTasks {
        let real_time = |(_, activity): &(usize, &Activity)| activity.priority != Priority::Background;
        let activities = self.activities.iter().enumerate().filter(real_time);
        let (mut numbers, mut tasks): (Vec<usize>, Vec<Task>) =
            activities.map(|(index, it)| (index, it.task())).unzip();
        let mut next = self.activities.len()..;
        numbers.extend(next.by_ref().take(self.others.len()));
        tasks.extend(self.others.iter().map(Other::task));
        if self.throttled {
            let throttling = throttling(&tasks);
            numbers.extend(next.take(throttling.len()));
            tasks.extend(throttling);
        }
        SetTasks { tasks, numbers }
    }
}

impl TaskSet {
    /// The activities at the level of this number, by a method.
    pub fn activities_at(&self, column: usize, method: Method) -> ActivitySet {
        let level = self.levels.get(column);
        // Of a level that there is not, nothing is known.
        let is_refused = |reason: &NotAnalysed| level.is_none_or(|level| reason.holds(*level, method));
        let activity = |it: &task_set::Activity| {
            let machine = it.machine.as_ref().filter(|_| !it.not_analysed.iter().any(is_refused));
            let whole = machine.and_then(|machine| machine.component_time.get(column).copied().flatten());
            let machine = machine.and_then(|machine| machine.state_machine(column));
            Activity {
                name: it.instance.clone(),
                priority: it.priority,
                period: it.period,
                deadline: it.deadline,
                jitter: it.jitter,
                offset: it.offset,
                cpus: it.affinity,
                demand: machine.map_or(Demand::Unknown, |machine| Demand::Machine { machine, whole }),
            }
        };
        let activities = self.activities.iter().map(activity).collect();
        let others = self.other.clone();
        let number = |name: &String| self.activities.iter().position(|activity| activity.instance == *name);
        let operation = |it: &Called| {
            Some(Operation {
                provider: number(&it.provider)?,
                client: number(&it.client)?,
                sends: it.sends,
                time: it.time.get(column).copied()?,
                during: it.during,
            })
        };
        ActivitySet {
            activities,
            operations: self.operations.iter().filter_map(operation).collect(),
            others,
            throttled: self.rt_throttling == Some(true),
        }
    }
}

impl Activity {
    fn task(&self) -> Task {
        let priority = match self.priority {
            Priority::RealTime(priority) => priority,
            Priority::Background | Priority::Unknown => u32::MAX,
        };
        Task {
            // Its number identifies it.
            name: String::new(),
            priority,
            period: self.period.unwrap_or_default(),
            deadline: self.deadline.unwrap_or_default(),
            jitter: self.jitter,
            offset: self.offset,
            cpus: self.cpus.unwrap_or(u64::MAX),
            demand: self.demand.clone(),
        }
    }
}

impl Other {
    /// Returns its name with an addition that no name of an instance has: `network interrupt (platform)`.
    pub fn shown(&self) -> String {
        format!("{} (platform)", self.name)
    }

    fn task(&self) -> Task {
        Task {
            name: self.shown(),
            priority: self.priority,
            period: self.period,
            deadline: self.period,
            jitter: self.jitter,
            offset: None,
            cpus: self.cpus,
            demand: Demand::Machine { machine: StateMachine::single(self.time), whole: None },
        }
    }
}

/// The name of the task that stands for real-time throttling among the interference: no instance has a space in its name.
pub const THROTTLING: &str = "real-time throttling";

/// One task for each CPU, with the highest priority: what throttling takes.
fn throttling(tasks: &[Task]) -> Vec<Task> {
    let cpus =
        tasks.iter().filter(|task| task.demand != Demand::Unknown).fold(0, |all, task| all | task.cpus);
    (0..64)
        .filter(|bit| cpus & (1 << bit) != 0)
        .map(|bit| Task {
            name: THROTTLING.to_owned(),
            priority: u32::MAX,
            period: THROTTLING_PERIOD,
            deadline: THROTTLING_PERIOD,
            jitter: Time::ZERO,
            offset: None,
            cpus: 1 << bit,
            demand: Demand::Machine { machine: StateMachine::single(THROTTLED), whole: None },
        })
        .collect()
}
