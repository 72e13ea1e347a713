//! Worst-case response times of periodic tasks that are state machines.
//!
//! A task of a robot is rarely the same every period: it waits, then plans once for long, then drives. Its code is a
//! state machine that takes one edge per period, and an edge that must leave its state cannot come again at once. This
//! crate bounds what any n consecutive periods of such a machine can ask for, and from that the response times of tasks
//! under preemptive fixed priorities on each CPU, after "the paper": N. Gobillot, C. Lesire, D. Doose, "A Design and
//! Analysis Methodology for Component-Based Real-Time Architectures of Autonomous Systems", Journal of Intelligent &
//! Robotic Systems 96, 2019, section 5.
//!
//! A response time is a safety claim. What is reported as [`Bound::Response`] is never exceeded: all arithmetic is in
//! integer nanoseconds and checked, shares of a CPU are compared as exact fractions, and where a time does not fit or a
//! search takes too many steps (counted, never timed), the result is that no bound was found. Nothing here panics.
//!
//! The crate is pure mathematics. It must never know where tasks come from: no syntax of models, no files, no editor, no
//! clock, no thread. Whoever calls it turns models into [`StateMachine`]s and [`Task`]s, and results into words. To
//! cancel, the function given to [`response_times`] unwinds.
//!
//! | file | what is in it |
//! |---|---|
//! | `time.rs` | [`Time`]: nanoseconds, read exactly from decimal text |
//! | `level.rs` | [`Level`]: how probable it is that a time is exceeded |
//! | `table.rs` | [`Table`]: execution times by codel, program and component, in TOML |
//! | `toml_key.rs` | the form in which keys of TOML files are declared: those of tables, and of `mauve.toml` |
//! | `observed.rs` | [`Observed`]: what recordings of a robot showed, in TOML |
//! | `cpu_set.rs` | [`CpuSet`]: up to 128 CPUs |
//! | `machine.rs` | [`StateMachine`]: states and edges, one edge a period |
//! | `cycle_mean.rs` | λ, what a machine asks for in the long run |
//! | `trace_bound.rs` | [`TraceBound`]: M(n), what n consecutive periods ask for at most |
//! | `utilisation.rs` | [`Utilisation`]: Σ λ/T, compared with 1 exactly |
//! | `task_set.rs` | [`task_set`]: what a deployment runs, as a file in JSON |
//! | `chain.rs` | [`Tasks::latency`]: how long data takes through several tasks |
//! | `transaction.rs` | [`Tasks::steps_apart`]: chains that end before they start again, whose steps do not delay each other |
//! | `trigger.rs` | [`Tasks::greatest_distance`]: when data releases tasks, and how far apart |
//! | `write_time.rs` | [`Tasks::write_times`]: how long after its release a task has written |
//! | `task.rs` | [`Task`] and [`Response`]: what the analysis is asked and answers |
//! | `execution_bound.rs` | what n jobs execute at most, if the last one has not long been released |
//! | `paths.rs` | paths through a machine, and the totals of their edges |
//! | `exact.rs` | the search over combinations of paths |
//! | `lane.rs` | one CPU, or linked CPUs as one: its tasks, and what they ask for in a window |
//! | `global.rs` | tasks that may use each of several CPUs |
//! | `lane_analysis.rs` | the analysis of one CPU |
//! | `lateness.rs` | [`lateness`]: how probable a late job is |
//! | `synchronised.rs` | the windows that begin at the releases of synchronised clocks |
//! | `waits.rs` | waits as jitter |
//! | `lock.rs` | [`Lock`]: its users, and what it may do to a task |
//! | `locks.rs` | for how long lower priorities delay the users of locks |
//! | `queue.rs` | threads that execute jobs in the order of their releases |
//! | `rounds.rs` | threads that execute one job of each task in a round |
//! | `not_preempted.rs` | jobs that are not preempted once they have begun |
//! | `arrivals.rs` | how often data releases tasks, from what their writers do |
//! | `releases.rs` | this for each task of a set |
//! | `operations.rs` | the calls of operations that jobs execute for others, and the rounds in which they and response times are found |
//! | `tasks.rs` | [`Tasks`]: what a deployment runs at one level |
//! | `set_analysis.rs` | [`SetAnalysis`]: its response times |
//! | `response_time.rs` | [`response_times`]: the analysis |
//! | `simulation.rs` | [`Tasks::simulate`]: one of the possible schedules, at random |
//! | `worst_case.rs` | [`Tasks::worst_case`]: the schedule behind a response time |
//! | `longest_way.rs` | [`Tasks::longest_way`]: a schedule in which data takes long along a chain |
//! | `certificate.rs` | [`Tasks::certificate`]: why deadlines are met, for an independent checker |
//! | `breakdown.rs` | [`Breakdown`]: the interference in a response time, by task |
//!
//! The tests compare each of these with its definition on small random inputs. Beside them, `tests/reachability/` runs
//! small systems in every possible way and finds nothing above a bound, `tests/chains/` finds no data above one,
//! `tests/literature.rs` compares with an independent implementation, and `tests/robot.rs` has the figures of the paper. `benches/`
//! measures.

mod arrivals;
mod breakdown;
mod certificate;
mod chain;
mod cpu_set;
mod cycle_mean;
mod exact;
mod execution_bound;
mod global;
mod lane;
mod lane_analysis;
mod lateness;
mod level;
mod lock;
mod locks;
mod longest_way;
mod machine;
mod not_preempted;
mod observed;
mod operations;
mod paths;
mod queue;
mod releases;
mod response_time;
mod rounds;
mod set_analysis;
mod simulation;
mod synchronised;
mod table;
mod task;
pub mod task_set;
mod tasks;
#[cfg(test)]
mod testing;
mod time;
pub mod toml_key;
mod trace_bound;
mod transaction;
mod trigger;
mod utilisation;
mod waits;
mod worst_case;
mod write_time;

pub use arrivals::{Arrivals, Needs};
pub use breakdown::Breakdown;
pub use chain::{ChainBuffer, ChainLatency, ChainPart, ChainRule, ChainStep, NoLatency};
pub use cpu_set::{CpuSet, sharing_cpus};
pub use cycle_mean::CycleMean;

pub use lateness::{Excess, Executions, Lateness, NoLateness, lateness};
pub use level::{Level, MOST_LEVELS};
pub use lock::{Blocking, Lock, LockUser, Protocol};
pub use longest_way::{Pass, Way};
pub use machine::{Edge, MachineError, StateMachine};
pub use observed::{
    LEAST_WAIT, LEAST_WORK, Observed, ObservedError, ObservedErrorKind, ObservedTimes, Recording,
    UNSUSPICIOUS,
};
pub use response_time::response_times;
pub use set_analysis::SetAnalysis;
pub use simulation::{
    Calls, Executed, Job, LeftOut, Random, Schedule, Script, ScriptedTask, SimulationOptions, Slice,
    Statistics,
};
pub use table::error::{TableError, TableErrorKind, TomlKind};
pub use table::measured::digest_of;
pub use table::update::{
    KeptEntry, UpdateError, Updated, assumed_entry, entry_for, existing as entry_of_key, unit_in,
    update as update_table, with_dispatch, with_time,
};
pub use table::{
    DEPENDENT, EXTRAPOLATED, Entry, KeyPart, Measured, Overhead, Table, TableSection, Times,
    extrapolated_from, keys as table_keys,
};
pub use task::{
    Analysis, Bound, Counted, CpuLoad, CpuRule, Demand, Interference, Method, NoBoundReason, Options, Order,
    Priority, Response, Status, Task, Waits, Window,
};
pub use tasks::{PortWriter, THROTTLING, TaskKind, TaskOperation, TaskTrigger, Tasks, name_of_other};
pub use time::{Rounding, Time, TimeError, Unit, greatest_common_divisor};
pub use trace_bound::{TraceBound, worst_trace};
pub use trigger::{ChainRelease, Distance, TriggerWriter, Triggers};
pub use utilisation::Utilisation;
pub use worst_case::{NoWorstCase, WorstCase};
pub use write_time::ChainWrite;
