//! Recorded traces, read in one pass and in constant memory: each execution of a period, a program or a codel, each access of a
//! port and each holding of a lock, where it ends.
//!
//! A trace is a folder that LTTng has written, which `babeltrace2` reads, or a file of executions. An execution is reported only
//! if it was recorded completely; what is dropped is counted in the [`Totals`].

mod babeltrace;
mod column;
mod csv;
mod cut;
mod error;
mod event;
mod lines;
mod names;
mod nesting;
mod observation;
mod reader;
mod ros2;
mod source;

use std::ops::ControlFlow;

pub use column::{Column, FileKind};
pub use error::{CsvProblem, TraceError};
pub use names::{NameId, SpanKind, SpanName, SpanNames, access_key, lock_of, port_of};
pub use observation::{Observation, SeenName, Wait};
pub use reader::TraceReader;
pub use ros2::{
    ROS2_LIBRARY, Ros2Callback, Ros2Graph, Ros2Group, Ros2Messages, Ros2Publisher, Ros2Release,
    ros2_identifier,
};
pub use source::Source;

/// The difference by which an execution time may exceed the elapsed time. Both clocks are read one after the other, and in
/// between the tracer may switch its buffer: differences of 0.2 ms were seen in recordings without an error.
const CLOCK_TOLERANCE: u64 = 1_000_000;

/// An execution, from its begin to its end. Times are in nanoseconds. Spans are reported in the order of their ends.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Span {
    /// What was executed.
    pub name: NameId,
    /// The thread; unknown in a file of executions.
    pub thread: Option<RecordedThread>,
    /// The CPU on which it began.
    pub cpu: Option<u32>,
    /// When it began: since the epoch in a trace of LTTng; by the clock of the program in a file of executions.
    pub begin: Option<u64>,
    /// When it ended.
    pub end: Option<u64>,
    /// The time from its begin to its end.
    pub elapsed: Option<u64>,
    /// The CPU time of its thread: without the time in which the thread was preempted.
    pub execution: u64,
    /// Of a period, when it was released. A trace of LTTng has it only where a message of ROS 2 was published then.
    pub release: Option<u64>,
    /// Of a period, how its thread was scheduled when it began.
    pub scheduling: Option<Scheduling>,
    /// Of a period, the CPU time of its thread since the end of the period before, without codels and accesses of ports; only in
    /// recordings of the runtime for Linux.
    pub overhead: Option<u64>,
    /// Of a codel, how often its thread gave up the CPU by its own will, other than to wait for a recorded lock. None in recordings of
    /// earlier versions.
    pub waits: Option<u64>,
    /// The time for which its thread waited for recorded locks.
    pub blocked: u64,
    /// What a read, a write or a codel came to. None in recordings of earlier versions.
    pub outcome: Option<Outcome>,
    /// Of a read and of a write, the number of the value among those that its port has written, from 1; a trace of LTTng does not have
    /// it.
    pub number: Option<u64>,
}

/// What a read or a write of a port, or a codel that returns a `bool`, came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Nothing was ever written.
    NoData,
    /// What was read before.
    OldData,
    /// A value that was not read before.
    NewData,
    /// A value was written.
    Written,
    /// A value was lost in a full buffer.
    Lost,
    /// The output has no connection.
    Unconnected,
    /// The codel returned `false`.
    False,
    /// The codel returned `true`.
    True,
}

impl Outcome {
    /// All outcomes, in the order of their numbers, with their names.
    const NAMES: [(Outcome, &'static str); 8] = [
        (Outcome::NoData, "no_data"),
        (Outcome::OldData, "old_data"),
        (Outcome::NewData, "new_data"),
        (Outcome::Written, "written"),
        (Outcome::Lost, "lost"),
        (Outcome::Unconnected, "unconnected"),
        (Outcome::False, "false"),
        (Outcome::True, "true"),
    ];

    fn of_name(name: &[u8]) -> Option<Outcome> {
        Outcome::NAMES.iter().find(|(_, it)| it.as_bytes() == name).map(|(outcome, _)| *outcome)
    }

    fn of_number(number: u64) -> Option<Outcome> {
        Outcome::NAMES.get(usize::try_from(number).ok()?).map(|(outcome, _)| *outcome)
    }
}

/// How a thread is scheduled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scheduling {
    /// The priority of the real-time scheduler; 0 without one.
    pub priority: u32,
    /// The CPUs that the thread may use, a bit each.
    pub cpus: u64,
}

/// A thread of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RecordedThread {
    /// The number of the host and of the process that the trace names, from 0.
    pub origin: u32,
    /// The system's number of the process, or 0 if the trace does not have it.
    pub process: u64,
    /// The system's number of the thread.
    pub thread: u64,
}

/// What a trace had, and what of it was not used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Totals {
    /// Events of generated packages, or lines of executions.
    pub events: u64,
    /// Events of other providers.
    pub foreign: u64,
    /// Spans that were reported.
    pub spans: u64,
    /// Ends at the start of the trace, of spans that began before it.
    pub cut_at_start: u64,
    /// Begins at the end of the trace, of spans that ended after it.
    pub cut_at_end: u64,
    /// Begins without their ends, and ends without their begins, elsewhere.
    pub unbalanced: u64,
    /// Discarded events, as far as the tracer has counted them.
    pub lost_events: u64,
    /// Reports of discarded events.
    pub losses: u64,
    /// Spans that were not used, since events were discarded between their begin and their end.
    pub dropped: u64,
    /// Spans that were not used, since a clock went backwards; in a file of executions, lines that are not in the order of time.
    pub clock_errors: u64,
    /// Spans with a longer execution than elapsed time, by more than the clocks can differ.
    pub suspicious: u64,
    /// Last lines of files that have no line feed, and streams of LTTng that `babeltrace2` could not read to their end: a power
    /// failure or a full disk has cut them. What follows the cut is not used.
    pub cuts: u64,
    /// The execution times are those of timing tables: they are not measured.
    pub is_from_tables: bool,
    /// The time of the first event.
    pub first: Option<u64>,
    /// The time of the last event.
    pub last: Option<u64>,
}

impl Totals {
    /// Returns all counts, in the order in which sample files have them.
    pub(crate) fn counts(&mut self) -> [&mut u64; 11] {
        [
            &mut self.events,
            &mut self.foreign,
            &mut self.spans,
            &mut self.cut_at_start,
            &mut self.cut_at_end,
            &mut self.unbalanced,
            &mut self.lost_events,
            &mut self.losses,
            &mut self.dropped,
            &mut self.clock_errors,
            &mut self.suspicious,
        ]
    }

    /// Adds what a later part of the same trace had.
    pub fn add(&mut self, later: &Totals) {
        let mut later = *later;
        for (sum, count) in self.counts().into_iter().zip(later.counts()) {
            *sum = sum.saturating_add(*count);
        }
        self.cuts = self.cuts.saturating_add(later.cuts);
        self.is_from_tables |= later.is_from_tables;
        self.first = self.first.or(later.first);
        self.last = later.last.or(self.last);
    }

    /// Returns how many spans were not reported.
    fn missing(&self) -> u64 {
        self.dropped.saturating_add(self.unbalanced).saturating_add(self.clock_errors)
    }

    fn at(&mut self, time: Option<u64>) {
        self.first = self.first.or(time);
        self.last = self.last.max(time);
    }
}

/// How much of a trace has been read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The number of events.
    pub events: u64,
    /// The number of bytes, and how many there are, if that is known.
    pub bytes: Option<(u64, u64)>,
}

/// Is called while a trace is read. `Break` ends the reading with [`TraceError::Stopped`].
pub trait Visitor {
    /// A span has ended.
    fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()>;

    /// Executions within this time, which ends where they began or later, may be missing: the tracer discarded events, or a
    /// recording is damaged. Is called before the spans that end after it, at most a few spans too late.
    fn lost(&mut self, begin: u64, end: u64) {
        let _ = (begin, end);
    }

    /// The execution times are those of timing tables: they are not measured. Is called before the first span.
    fn times_are_from_tables(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Threads of this name, which are not those of instances, used so much CPU time within this time.
    fn work(&mut self, thread: &str, cpu: u64, elapsed: u64) {
        let _ = (thread, cpu, elapsed);
    }

    /// The program of the recording was built so: with which compiler, for which processor, with which flags.
    fn built(&mut self, build: &str) {
        let _ = build;
    }

    /// Is called now and then.
    fn progress(&mut self, progress: Progress) -> ControlFlow<()> {
        let _ = progress;
        ControlFlow::Continue(())
    }
}

fn is_suspicious(execution: u64, elapsed: u64) -> bool {
    execution > elapsed.saturating_add(CLOCK_TOLERANCE)
}
