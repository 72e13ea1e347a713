//! No data is older than a bound on a chain: small systems are executed in every way, one nanosecond after the other.
//!
//! The exploration shares no code with the crate: it knows of no release of a datum, only of values that were sampled before or
//! after a change, in variables, ports and buffers. A schedule chooses the phases, the delay of each release within the jitter, the
//! paths through the machines, the execution times, the order of tasks of equal priority, and the order of statements at one
//! instant on different CPUs. What a component does to data is found by trying its programs, too.
//!
//! | file | contents |
//! |---|---|
//! | `core.rs` | a component, and what it does to data |
//! | `system.rs` | a system, and the bounds for it |
//! | `explore.rs` | the exploration |
//! | `cases.rs` | systems whose times are known by hand |
//! | `random.rs` | random systems |
//! | `dortmund.rs` | larger chains, whose figures research code gave: `dortmund.csv` |
//!
//! `MAUVE_ORACLE_SYSTEMS=10000 cargo test --release -p mauve-timing --test main chains::` tries more systems.

mod cases;
mod core;
mod dortmund;
mod explore;
mod random;
mod system;
