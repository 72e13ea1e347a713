//! From models and timing tables to response times: periodic state machines, task sets, and what other values would give.
//!
//! ```text
//! mauve.toml → tables → timetable ──────────────┐
//! behaviour of a core (mauve-hir) ──────────────┼→ psm ─┐
//! deployment → system (its activities) ─────────┴───────┴→ task set → response times
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `timetable.rs` | the timing tables, joined |
//! | `psm.rs` | behaviour + times: the periodic state machine of a component |
//! | `system.rs` | a deployment's activities |
//! | `what_if.rs` | a deployment with other values in its activities: what if? |
//! | `priorities.rs` | the order of priorities, and what may be better about it |
//! | `response.rs` | response times, and what a codel without a time may take |
//! | `better_timing.rs` | the search for better priorities, CPUs and periods |
//! | `exported.rs` | task sets and state machines that stand alone, made of models and analysed as these are |
//! | `fact.rs`, `reason.rs` | what is wrong, and why something has no response time: names and figures |
//!
//! A timing table with an error, an activity without a priority, a core that is not analysed: whatever may delay others and is
//! not known makes them *not analysed* too, with the reason ([`Refusal`]).
//!
//! This crate knows no prose, no editor and no file system.

pub mod better_timing;
mod exported;
mod fact;
mod priorities;
mod psm;
mod reason;
mod response;
mod system;
mod timetable;
mod what_if;

pub use exported::{exported_component, psm_at, response_times_of, task_set_of};
pub use fact::{
    Budget, DeadlineAndPriority, Expected, InterferenceReport, Missed, MissingTime, NoTime, TimingFact,
    TimingFactKind,
};
pub use priorities::priority_facts;
pub use psm::{Psm, PsmEdge, Refused, psm_of, worst_path};
pub use reason::{
    ActivityField, Doubt, IncompleteTable, NoSuchCpu, PatternError, Prose, Reason, Refusal, Share,
    StrayEntry, TableFault, TableFilesError, TableLevels, Timed, TooLong, Unknown, UnusableTime,
    WrongProgram,
};
pub use response::{
    ActivityReport, CpuReport, Deadlines, Query, Report, Verdict, budgets, facts_if, level_shown,
    response_times, response_times_if, timing_facts,
};
pub use system::{Priority, Row, System, mask, system_of};
pub use timetable::{
    LONGEST_PATTERN, Lookup, TableFiles, Timetable, file_name, pattern_of_path, table, table_facts,
    table_files, table_pattern, timetable_of,
};
pub use what_if::SupposedField;
