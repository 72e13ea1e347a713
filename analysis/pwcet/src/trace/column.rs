//! The files of `mauve run --trace`, and their columns.

/// The number of columns that are read.
pub(super) const COLUMNS: usize = 17;

/// A column that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// `codel`: the key of a codel or of a program in a timing table.
    Codel,
    /// `execution_ns`: the CPU time of the execution.
    Execution,
    /// `instance`: the instance that executed it.
    Instance,
    /// `elapsed_ns`: the time from the begin to the end.
    Elapsed,
    /// `time_ns`: the time of the end.
    Time,
    /// `order`: the number of the line among those of both files.
    Order,
    /// `release_ns`: the time of the release of a period.
    Release,
    /// `begin_ns`: the time of its begin.
    Begin,
    /// `end_ns`: the time of its end.
    End,
    /// `priority`: the real-time priority of its thread, or 0.
    Priority,
    /// `cpus`: the CPUs that its thread might use, a bit each.
    Cpus,
    /// `cpu`: the number of the CPU where it began.
    Cpu,
    /// `waits`: how often the thread waited by its own will, other than for a recorded lock.
    Waits,
    /// `blocked_ns`: the time for which it waited for recorded locks.
    Blocked,
    /// `status`: what a read, a write or a codel came to.
    Status,
    /// `number`: the number of the value, among those that its port has written.
    Number,
    /// `overhead_ns`: the CPU time of its thread since the end of the period before, without codels and accesses of ports.
    Overhead,
}

impl Column {
    /// All columns, in their order, with their names in a header.
    pub(super) const NAMES: [(Column, &'static str); COLUMNS] = [
        (Column::Codel, "codel"),
        (Column::Execution, "execution_ns"),
        (Column::Instance, "instance"),
        (Column::Elapsed, "elapsed_ns"),
        (Column::Time, "time_ns"),
        (Column::Order, "order"),
        (Column::Release, "release_ns"),
        (Column::Begin, "begin_ns"),
        (Column::End, "end_ns"),
        (Column::Priority, "priority"),
        (Column::Cpus, "cpus"),
        (Column::Cpu, "cpu"),
        (Column::Waits, "waits"),
        (Column::Blocked, "blocked_ns"),
        (Column::Status, "status"),
        (Column::Number, "number"),
        (Column::Overhead, "overhead_ns"),
    ];

    /// Returns the name in a header.
    pub fn name(self) -> &'static str {
        Column::NAMES[self as usize].1
    }
}

/// Which file in a folder of `mauve run --trace`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Executions of codels and programs.
    Executions,
    /// Periods.
    Periods,
}

impl FileKind {
    /// Returns the columns that the file must have.
    pub fn required(self) -> &'static [Column] {
        match self {
            FileKind::Executions => &[Column::Codel, Column::Execution],
            FileKind::Periods => &[Column::Instance, Column::Begin, Column::End, Column::Execution],
        }
    }
}
