//! What a deployment runs at one level: its activities, and what else delays them.

use crate::{CpuSet, Demand, Lock, Needs, Priority, StateMachine, Task, Time};

/// An operation that one activity executes for another: in its own thread, at the start of its next period or between two
/// periods.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct TaskOperation {
    /// The index of the activity that executes it.
    pub provider: usize,
    /// The index of the activity that sends it.
    pub client: usize,
    /// The greatest number of calls that a job of the client sends; if `during`, that one execution of that operation sends.
    pub sends: u64,
    /// So many successive jobs of the client send no more calls than one; 0 and 1 are the same.
    pub every: u64,
    /// The greatest number of calls that the client sends when it starts, before its first job.
    pub starting: u64,
    /// The greatest number of these calls that have been sent and not executed, if the client bounds it.
    pub pending: Option<u64>,
    /// The execution time of one call, with its waits: see [`Task::waiting_in_calls`].
    pub time: Time,
    /// The operation that sends the calls, executed by the client: the index of an earlier one.
    pub during: Option<usize>,
}

/// The ports whose data releases a task.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct TaskTrigger {
    /// The index of the task.
    pub task: usize,
    /// Which of the ports need new data.
    pub needs: Needs,
    /// The writers of each port; none where it is not known what they write, or where it waits in a buffer.
    pub ports: Vec<Option<Vec<PortWriter>>>,
}

/// A task that writes a port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PortWriter {
    /// Its index.
    pub task: usize,
    /// The most writes in one of its jobs.
    pub writes: u64,
}

/// The tasks of a deployment at one level: those of its activities, of other real-time work, and of real-time throttling. So an
/// activity and its task have one index; [`Tasks::kind`] says which task is what.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Tasks {
    pub(crate) all: Vec<Task>,
    pub(crate) activities: usize,
    pub(crate) others: usize,
    /// The connected operations that cost time.
    pub operations: Vec<TaskOperation>,
    /// The locks that the tasks take.
    pub locks: Vec<Lock>,
    /// Who writes the data that releases tasks, as far as that is known.
    pub triggers: Vec<TaskTrigger>,
}

/// What a task of a deployment is.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum TaskKind {
    /// An activity, possibly in the background.
    #[default]
    Activity,
    /// Real-time work that is not in the model.
    Other,
    /// The time that Linux keeps from real-time tasks on one CPU.
    Throttling,
}

/// The name of the task that stands for real-time throttling among the interference: no instance has a space in its name.
pub const THROTTLING: &str = "real-time throttling";

/// Linux keeps real-time tasks from the CPU for this long in each period, unless it is told otherwise
/// (`kernel.sched_rt_runtime_us`, `kernel.sched_rt_period_us`).
pub(crate) const THROTTLED: Time = Time::from_nanos(50_000_000);
const THROTTLING_PERIOD: Time = Time::from_nanos(1_000_000_000);

impl Tasks {
    /// Creates the tasks of activities, in the order of their deployment.
    pub fn new(activities: Vec<Task>) -> Tasks {
        Tasks { activities: activities.len(), all: activities, ..Tasks::default() }
    }

    /// Adds other real-time work, and throttling where Linux keeps some time from real-time tasks.
    pub fn with_platform(mut self, others: Vec<Task>, is_throttled: bool) -> Tasks {
        self.others = others.len();
        self.all.extend(others);
        if is_throttled {
            let known = self.all.iter().filter(|task| task.demand != Demand::Unknown);
            let cpus: CpuSet = known.map(Task::cpus).collect();
            self.all.extend(cpus.each().map(throttling));
        }
        self
    }

    /// Returns what the task of this index is.
    pub fn kind(&self, task: usize) -> TaskKind {
        match task {
            _ if task < self.activities => TaskKind::Activity,
            _ if task < self.activities + self.others => TaskKind::Other,
            _ => TaskKind::Throttling,
        }
    }

    /// Returns the tasks of the activities.
    pub fn activities(&self) -> &[Task] {
        &self.all[..self.activities]
    }

    /// The same, to change them. The CPUs that are throttled stay as they are.
    pub fn activities_mut(&mut self) -> &mut [Task] {
        &mut self.all[..self.activities]
    }

    /// Makes unknown what a task does: what its jobs demand, and for how long they hold locks. Whatever it may delay has no bound then.
    pub fn refuse(&mut self, task: usize) {
        if let Some(task) = self.all.get_mut(task) {
            task.demand = Demand::Unknown;
        }
        let users = self.locks.iter_mut().flat_map(|lock| &mut lock.users);
        users.filter(|user| user.task == task).for_each(|user| user.held = None);
    }

    /// Returns the tasks of other real-time work.
    pub fn others(&self) -> &[Task] {
        &self.all[self.activities..self.activities + self.others]
    }

    /// Returns all tasks.
    pub fn all(&self) -> &[Task] {
        &self.all
    }

    /// Returns the name of a task among others: that of an instance, of other work as in [`name_of_other`], or [`THROTTLING`].
    pub fn name(&self, task: usize) -> String {
        let name = self.all.get(task).map_or("", |task| &task.name);
        if self.kind(task) == TaskKind::Other { name_of_other(name) } else { name.to_owned() }
    }
}

/// Returns the name of other work with an addition that no name of an instance has: `network interrupt (platform)`.
pub fn name_of_other(name: &str) -> String {
    format!("{name} (platform)")
}

/// The task with the highest priority on a CPU: what throttling takes.
fn throttling(cpu: CpuSet) -> Task {
    let task = Task::new(0, THROTTLING_PERIOD, StateMachine::single(THROTTLED));
    let (name, priority) = (THROTTLING.into(), Priority::Unknown);
    Task { name, priority, cpus: Some(cpu), is_throttling: true, ..task }
}
