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
//! | `table_set.rs` | which timing tables count for a deployment |
//! | `timetable.rs` | timing tables, joined |
//! | `timetable/unknown_keys.rs` | unknown keys of timing tables, and the times that they may be for |
//! | `psm.rs` | behaviour + times: the periodic state machine of a component |
//! | `system.rs` | the activities of a deployment |
//! | `component_tables.rs` | which timing tables count for a component |
//! | `gateway.rs` | the gateway to ROS 2, an activity without a component |
//! | `sends.rs` | the calls that a component sends to its required operations |
//! | `served.rs` | the operations that activities execute for others |
//! | `task_set.rs` | a deployment at one level as `timing` analyses and simulates it, made of a model or of an exported file |
//! | `executions.rs` | how many executions may exceed their times, what a level supports, and the level that `required` chooses |
//! | `probability.rs` | how probable it is that an activity is late |
//! | `excesses.rs` | what jobs may take beyond the times of a level |
//! | `path_fold.rs` | what jobs execute, folded to a number or a distribution |
//! | `response.rs`, `report.rs` | its response times |
//! | `timing_facts.rs` | missed deadlines, overloaded CPUs |
//! | `missing_times.rs` | codels without a time, with the time that each may take |
//! | `what_if.rs` | other values in the activities of a deployment |
//! | `variants.rs` | a deployment with other values or times, analysed within a budget |
//! | `bisection.rs` | the bisection between values with which deadlines are proved and values with which they are not |
//! | `sensitivity.rs` | how far each time may grow, and each period shrink |
//! | `priorities.rs` | what may be wrong with the order of priorities |
//! | `triggers.rs` | activities that data never releases |
//! | `new_activity.rs` | values for an activity that is missing |
//! | `chains.rs` | how long data takes from sensors to actuators |
//! | `unblocked.rs` | what has to be assumed so that it gets there |
//! | `tune.rs`, `tune/` | the search for priorities, CPUs and periods of a whole deployment |
//! | `better_timing.rs` | the search for better priorities, CPUs and periods |
//! | `execution_times.rs` | the times of all codels and programs of a deployment at one level |
//! | `certificate.rs` | why deadlines are met, for an independent checker |
//! | `exported.rs` | task sets and state machines for files, made of models |
//! | `observed.rs` | a recording beside the model: which assumption of the analysis fails |
//! | `fact.rs`, `reason.rs` | errors, and reasons for a missing response time: names and figures |
//!
//! A timing table with an error, an activity without a priority, a core that is not analysed: where something unknown may
//! delay an activity, the activity is *not analysed* either, with the reason ([`Refusal`]).
//!
//! This crate knows no prose, no editor and no file system.

mod basis;
pub mod better_timing;
mod bisection;
mod certificate;
pub mod chains;
mod component_tables;
mod excesses;
mod execution_times;
mod executions;
mod exported;
mod fact;
mod gateway;
mod locks;
mod missing_times;
mod new_activity;
pub mod observed;
mod path_fold;
mod priorities;
mod probability;
mod psm;
mod reason;
mod report;
mod response;
mod sends;
mod sensitivity;
mod served;
mod serving;
mod system;
mod table_set;
mod task_set;
mod threads;
mod timetable;
mod timing_facts;
mod triggers;
pub mod tune;
pub mod unblocked;
mod variants;
mod what_if;

pub use basis::{Basis, Origin, basis_of, origin_of, record_of};
pub use certificate::{certificate_of, certificate_of_file};
pub use component_tables::{first_tables, tables_for, tables_in};
pub use execution_times::{ExecutionTimes, execution_times};
pub use executions::{Support, executions_of, required_facts, support};
pub use exported::{exported_component, psm_at, task_set_of};
pub use fact::{
    Budget, ChangedOrigin, DeadlineAndPriority, InterferenceReport, LackingLevel, Missed, MissingTime,
    Overload, Recorded, TimingFact, TimingFactKind, Unbounded,
};
pub use gateway::Gateway;
pub use locks::{DeclaredLock, DeclaredLocks, declared_locks};
pub use mauve_timing::Priority;
pub use missing_times::{budgets, missing_time_facts};
pub use new_activity::{NewActivity, missing_activities, new_activities};
pub use priorities::priority_facts;
pub use probability::{LaterThan, MissProbability, dependent_facts, distribution_of, probabilities_of};
pub use psm::{Psm, psm_in_thread, psm_of, worst_path};
pub use reason::{
    ActivityField, CallsReason, IncompleteTable, LockReason, NoSuchCpu, PREFIX_OF_TOPICS, PatternError,
    Prose, Reason, Refusal, Share, StrayEntry, TableFault, TableFilesError, TableLevels, ThreadReason, Timed,
    TooLong, UnknownPriority, UnusableTime, WrongProgram,
};
pub use report::{
    ActivityReport, CallsReport, CpuBudget, CpuPart, Deadlines, Footing, Query, Report, ReportBreakdown,
    level_shown,
};
pub use response::{facts_if, response_times, response_times_if, response_times_of};
pub use sensitivity::{
    ActivitySensitivity, ExecutedTime, Limit, Sensitivity, TimeSensitivity, executed_times, sensitivity,
    time_sensitivity,
};
pub use system::{ResolvedActivity, System, Trigger, system_of};
pub use table_set::{TableSet, all_tables_of, table_sets, tables_of, tables_of_host};
pub use task_set::DeployedTasks;
pub use threads::{
    DeclaredThread, DeclaredThreads, ThreadFile, declared_threads, is_throttled, place_of_thread,
    thread_facts, threads_in,
};
pub use timetable::{
    LONGEST_PATTERN, Lookup, TableFiles, Timetable, file_name, files_of, input_files, levels_of,
    levels_of_tables, observed_files, observed_in, observed_responses, pattern_of_path, table, table_facts,
    table_files, table_pattern, thread_files, timed_by, timetable_of,
};
pub use timing_facts::timing_facts;
pub use triggers::trigger_facts;
pub use what_if::{WhatIfField, in_threads};
