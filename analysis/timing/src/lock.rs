//! A lock that several tasks take, and what it may do to each of them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Time;

/// How a job that holds a lock is kept from being preempted.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// It inherits the priority of the jobs that wait for the lock (`PTHREAD_PRIO_INHERIT`).
    Inheritance,
    /// It has the highest priority of all users of the lock (`PTHREAD_PRIO_PROTECT`).
    Ceiling,
    /// It keeps its priority (`std::mutex`).
    None,
}

impl Protocol {
    /// All protocols.
    pub const ALL: [Protocol; 3] = [Protocol::Inheritance, Protocol::Ceiling, Protocol::None];

    /// `inheritance`, `ceiling` or `none`.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Inheritance => "inheritance",
            Protocol::Ceiling => "ceiling",
            Protocol::None => "none",
        }
    }
}

/// A lock that jobs of several tasks take.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Lock {
    /// Its name for readers of the result.
    pub name: Arc<str>,
    /// Its protocol.
    pub protocol: Protocol,
    /// The tasks that may take it, each once.
    pub users: Vec<LockUser>,
}

/// A task that may take a lock.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct LockUser {
    /// The index of the task.
    pub task: usize,
    /// For how long it executes while it holds the lock, at most; with a ceiling, while it holds this lock or others with a ceiling that
    /// is no lower, without a gap. Meanwhile it does not wait. `None` if that is unknown, as for a task of unknown demand.
    pub held: Option<Time>,
}

/// What locks do to a task.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Blocking {
    /// Jobs of lower priority delay it for this long, once in a window and once more for each wait in it; 0 without locks. The
    /// second time is the part of those in the background, which delay it once more each time that real-time tasks are throttled.
    Time(Time, Time),
    /// The time for which this task may hold this lock (an index into [`Tasks::locks`](crate::Tasks::locks)) is unknown.
    UnknownTime {
        /// The lock.
        lock: usize,
        /// The task.
        holder: usize,
        /// The task of unknown demand, or with a lock that it holds for an unknown time, which it may have to wait for: itself, or
        /// one that shares locks with it, directly or through others.
        because: usize,
    },
    /// The task uses this lock, whose users do not all run on one CPU.
    SeveralCpus {
        /// The lock.
        lock: usize,
    },
    /// It may run on several CPUs, and a task of lower priority may hold this lock on one of them.
    Migrates {
        /// The lock.
        lock: usize,
    },
    /// The task waits for this lock, which has no protocol, while others preempt the task that holds it.
    Inversion {
        /// The lock.
        lock: usize,
        /// The task of lower priority that holds the lock.
        holder: usize,
        /// The tasks that preempt the holder; empty if it is in the background, where any other process does.
        between: Vec<usize>,
    },
    /// While this task waits, one of lower priority may take this lock again: how often is unknown.
    UnknownWaits {
        /// The lock.
        lock: usize,
        /// The task that waits.
        waiting: usize,
    },
    /// The jobs of this task of lower priority are not preempted, and how long or how often they delay the task is unknown.
    NotPreempted {
        /// The task of lower priority.
        holder: usize,
    },
}

impl Blocking {
    /// Whether the time is known.
    pub(crate) fn is_time(&self) -> bool {
        matches!(self, Blocking::Time(..))
    }
}
