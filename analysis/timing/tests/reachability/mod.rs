//! No schedule is later than a bound: small systems are executed in every way, one nanosecond after the other.
//!
//! Nothing here knows of critical instants, request bounds or busy windows: the exploration shares no code with the
//! crate, and only compares the greatest response times that it finds with the bounds. A schedule chooses the
//! phases and the initial states of the machines, their paths, the order of tasks of equal priority, the CPUs (see
//! `scheduler.rs`), the delay of each release within the jitter, the instants at which a job sends calls, waits, or takes and
//! leaves a lock, and, in some systems, jobs that end early. A job executes for 1 ns at least. A response counts from the nominal release.
//!
//! | file | contents |
//! |---|---|
//! | `system.rs` | a system, as the text of a test and as the input of the analyser, and its bounds |
//! | `scheduler.rs` | the tasks that may execute at the same time |
//! | `explore.rs` | the exploration |
//! | `suspended.rs` | the exploration of systems with waits and locks |
//! | `queued.rs` | the exploration of threads with a queue, and of jobs that are not preempted |
//! | `cases.rs` | systems whose greatest response times are known by hand |
//! | `random.rs` | random systems |
//!
//! `MAUVE_ORACLE_SYSTEMS=100000 cargo test --release -p mauve-timing --test main reachability::` tries more systems.

mod cases;
mod explore;
mod queued;
pub(crate) mod random;
mod scheduler;
mod suspended;
pub(crate) mod system;
