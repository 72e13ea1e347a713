//! Task sets as files: what a deployment runs, for people who have no model, and as `mauve generate` exports it of one.
//!
//! One form in three notations. CSV has a line for each task:
//!
//! ```
//! use mauve_timing::task_set::{Notation, TaskSet};
//! use mauve_timing::{Level, Method};
//!
//! let set = TaskSet::parse("name,period,time,priority\nlaser,100,43,10\npilot,50,5,20\n", Notation::Csv).unwrap();
//! let at = set.at(Level::TEN_TO_MINUS_FOUR, Method::Psm).unwrap();
//! assert_eq!(&*at.activities()[1].name, "pilot");
//! ```
//!
//! JSON and TOML have the same names. In place of a `time`, a task may have a `machine`, a list of edges:
//!
//! ```
//! # use mauve_timing::task_set::{Notation, TaskSet};
//! let text = r#"
//! levels = [1e-3, 1e-6]   # each list of times has one for each of them
//! [[task]]
//! name = "pilot"
//! period = 50
//! priority = 20
//! machine = [
//!   { from = "Idle", to = "Idle", time = 1 },
//!   { from = "Idle", to = "Busy", time = [7, 9], name = "go" },
//!   { from = "Busy", to = "Idle", time = 1 },
//! ]
//! "#;
//! assert!(TaskSet::parse(text, Notation::Toml).is_ok());
//! ```
//!
//! A response time is a safety claim. So a task without one of the four fields is refused, unless its `not_analysed` says why:
//! then it counts as the worst case, and what it may delay is not analysed either. No key is ignored.

mod error;
mod layout;
mod notation;
mod number;
mod reader;

use std::collections::{BTreeMap, HashSet};

use serde::{Deserialize, Serialize};

pub use self::error::TaskSetError;
pub use self::notation::Notation;
pub use self::number::{Number, Numbers};
use crate::{Level, Method, Needs, Order, Protocol, Unit};

/// What a deployment runs, as its file has it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a task set")]
pub struct TaskSet {
    /// Who made the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub generated: Option<String>,
    /// The name of the deployment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The section that names its own timing tables, such as `Sea`; none for the general ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<String>,
    /// The unit of all times.
    #[serde(default)]
    pub unit: Unit,
    /// The significance levels: every list of times has one for each, in their order. Empty where every time holds at every
    /// level.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<Level>,
    /// The level that `mauve wcrt` shows without `--significance`. Default: the first of `levels`, or 1e-4 without `levels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub significance: Option<Level>,
    /// The number of CPUs; if it is left out, there are those that tasks name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpus: Option<Number>,
    /// Whether Linux reserves 50 ms of each second for non-real-time tasks. Default: the analysis assumes that it does not, and
    /// lists this as an assumption.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rt_throttling: Option<bool>,
    /// Why nothing of it can be analysed: a task or a time may be missing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_analysed: Vec<String>,
    /// The tasks, in the order of the deployment.
    pub task: Vec<TaskEntry>,
    /// Real-time work that is not in the model, such as an interrupt thread: it interferes, and has no deadline.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other: Vec<TaskEntry>,
    /// The locks that tasks take.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lock: Vec<LockEntry>,
    /// The operations that take time. One that sends calls is before those that it sends them to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operation: Vec<OperationEntry>,
    /// The tasks that data releases, with its writers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trigger: Vec<TriggerEntry>,
}

/// A task of a file.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a task", default)]
pub struct TaskEntry {
    /// Its name; no two have the same.
    pub name: String,
    /// The name of its component.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub component: String,
    /// T.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period: Option<Number>,
    /// Whether T is the least distance of releases only: data or an interrupt releases the task.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub sporadic: bool,
    /// The greatest number of releases in any window of length T; 1, if it is left out. With more, the task is sporadic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub burst: Option<Number>,
    /// The thread that executes its jobs and those of the other tasks with this thread.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thread: Option<String>,
    /// The order of the jobs in the thread: `list`, one of each task in a period, in the order of the tasks, if it is left out; or
    /// `fifo`, `any` or `rounds`, with which each task has releases of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<Order>,
    /// Whether a job may be preempted; it may, if it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preemptive: Option<bool>,
    /// The part of `time` before a job that may not be preempted has begun: the wake-up of its thread.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wake_up: Option<Numbers>,
    /// D; the period, if it is left out.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "number::known")]
    pub deadline: Option<Number>,
    /// J, the greatest delay of a release.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "number::known")]
    pub jitter: Option<Number>,
    /// The offset of its releases in the period, less than the period, if its clock is synchronised.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<Number>,
    /// The number of the clock that the offset counts on; 0, if it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<Number>,
    /// 1 to 99, or `background`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<Number>,
    /// The CPUs that it may use, numbered from 1; all, if they are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpus: Option<Numbers>,
    /// The greatest execution time of a job.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<Numbers>,
    /// The greatest time that a job waits off the CPU by its own will, in addition to `time`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wait: Option<Numbers>,
    /// How often a job waits, at most; unknown, if it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waits: Option<Number>,
    /// The edges of a state machine, in place of `time`. Each job executes one edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<Vec<EdgeEntry>>,
    /// The initial state of the machine; that of the first edge, if it is left out. Only simulations begin there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<String>,
    /// A declared time of each job, for [`Method::Classic`] only, which uses the maximum of it and the greatest edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classic_time: Option<Numbers>,
    /// The codels whose time is assumed, with it.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub assumed: BTreeMap<String, Number>,
    /// Why it cannot be analysed. Then the other fields may be missing: they are unknown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_analysed: Vec<NotAnalysed>,
}

/// What one job of a task may execute.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an edge")]
pub struct EdgeEntry {
    /// The state at its start.
    pub from: String,
    /// The state at its end.
    pub to: String,
    /// The greatest execution time of the job.
    pub time: Numbers,
    /// The greatest time that the job waits, in addition to `time`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wait: Option<Numbers>,
    /// The transition that fires; none where the machine stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// An operation that a task executes for a client, which sends calls to it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an operation")]
pub struct OperationEntry {
    /// Its name.
    pub name: String,
    /// The task that executes it.
    pub provider: String,
    /// The task that sends the calls.
    pub client: String,
    /// The greatest number of calls that one job of the client sends, or one execution of the operation `during`.
    pub sends: u64,
    /// So many successive jobs of the client send no more calls than one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<u64>,
    /// The greatest number of calls that the client sends when it starts, before its first job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starting: Option<u64>,
    /// The greatest number of these calls that have been sent and not executed, if the client waits for the end of a call before the
    /// next one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pending: Option<u64>,
    /// The number of the operation that sends the calls, an earlier one that the client executes, from 0; none for a job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub during: Option<usize>,
    /// The execution time of one call, with its waits.
    pub time: Numbers,
    /// Whether the provider waits while it executes a call.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub waits: bool,
}

/// Who writes the data that releases a task.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a trigger")]
pub struct TriggerEntry {
    /// The name of the task, which is sporadic.
    pub task: String,
    /// Whether a job needs data at `any` or at `all` of the ports, or `each` datum releases a job of its own.
    #[serde(default)]
    pub needs: Needs,
    /// The writers of each port, which keeps no more than one value.
    pub ports: Vec<Vec<WriterEntry>>,
}

/// A task that writes a port.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a writer")]
pub struct WriterEntry {
    /// Its name.
    pub task: String,
    /// The greatest number of writes in one job.
    pub writes: u64,
}

/// A lock that tasks take.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a lock")]
pub struct LockEntry {
    /// Its name.
    pub name: String,
    /// How a job that holds it is kept from being preempted.
    pub protocol: Protocol,
    /// The tasks that take it.
    pub user: Vec<LockUserEntry>,
}

/// A task that takes a lock.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a user of a lock")]
pub struct LockUserEntry {
    /// Its name.
    pub task: String,
    /// For how long a job executes while it holds the lock, at most; unknown, if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<Numbers>,
}

/// Why something cannot be analysed.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a reason")]
pub struct NotAnalysed {
    /// In words for the user.
    pub reason: String,
    /// Where that is so: `None` is at every level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<Vec<Level>>,
    /// Is that so for [`Method::Classic`] only?
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub classic_only: bool,
}

impl NotAnalysed {
    /// Does it hold at this level, by this method?
    pub fn holds(&self, level: Level, method: Method) -> bool {
        self.levels.as_ref().is_none_or(|levels| levels.contains(&level))
            && (!self.classic_only || method == Method::Classic)
    }
}

/// A task set has no more operations.
pub const MOST_OPERATIONS: usize = 1 << 16;

/// A task set has no more tasks: what they tell of each other grows with the square.
pub const MOST_TASKS: usize = 2896;

impl TaskSet {
    /// Returns the level that `mauve wcrt` shows without `--significance`.
    pub fn level(&self) -> Level {
        self.significance.or(self.levels.first().copied()).unwrap_or(Level::TEN_TO_MINUS_FOUR)
    }
}

impl TaskEntry {
    /// Returns the names of the states by number; `update` without a machine.
    pub fn states(&self) -> Vec<&str> {
        let Some(edges) = &self.machine else { return vec!["update"] };
        let mut seen = HashSet::new();
        edges.iter().map(|edge| edge.from.as_str()).filter(|state| seen.insert(*state)).collect()
    }
}

#[cfg(test)]
mod tests;
