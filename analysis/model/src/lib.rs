//! What MAUVE models mean: from syntax trees to names, state machines, task sets, response times and diagnostics.
//!
//! Everything here is a query of a salsa database ([`Database`]): asked again after an edit, only what the edit touched
//! is computed again. One keystroke goes this way, and each arrow stops where nothing changed:
//!
//! ```text
//! text → parse → item tree (no places) → declarations → names ─┐
//!                     └→ data of a declaration ────────────────┼→ behaviour of a core ─┐       (typing of a core → its checks)
//! mauve.toml → config → tables → timetable ─────────────────────────────────────────────┼→ psm ─┐
//!                                        └→ system (a deployment's activities) ─────────────────┴→ response times
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `db.rs` | the inputs: files and workspaces; and the last trees, from which the next are made |
//! | `item_tree.rs`, `lower.rs` | what a file declares, without places; and where its parts stand: only what an edit touches is read again |
//! | `source.rs` | declarations, their data, and [`Place`]s |
//! | `project.rs`, `config.rs` | roots, includes, `mauve.toml` |
//! | `names.rs` | what a name means; the features of a shell |
//! | `messages.rs` | message packages: `.msg` texts, the catalogue that is built in, what a type's name means |
//! | `types.rs`, `values.rs` | types and what fits where; constants, computed as the generated C++ would |
//! | `typing.rs` | the types of a core's programs, and what each name in them stands for |
//! | `flow.rs` | how values flow through a core's states: what is read too early, written and lost, never executed |
//! | `builtin.rs` | the functions that every program can call |
//! | `behaviour.rs`, `behaviour/program.rs` | a core's states and edges; what its programs cost |
//! | `timetable.rs` | the timing tables, joined |
//! | `program_id.rs` | which program of a component: its key in timing tables |
//! | `psm.rs` | behaviour + times: the periodic state machine of a component |
//! | `flat.rs` | an architecture with all that it imports |
//! | `system.rs` | a deployment's activities |
//! | `supposed.rs` | a deployment with other values in its activities: what if? |
//! | `settings.rs`, `wiring.rs`, `urgency.rs` | values of properties; what connections carry and what is left open; priorities |
//! | `declared.rs` | names and types as they are declared, and what nothing uses |
//! | `check.rs` | what is wrong in a declaration, of all these |
//! | `fact.rs` | what can be wrong, and why something is not analysed |
//! | `size.rs` | whether a project is too large to be analysed |
//! | `skeleton.rs` | the definition of an operation that is still to be written |
//! | `timing_fact.rs`, `timing_reason.rs` | what is wrong with a deployment and its times; why something is not analysed |
//! | `response.rs` | response times, and what a codel without a time may take |
//! | `exported.rs` | task sets and state machines that stand alone, made of models and analysed as these are |
//! | `diagnostics/` | a file for each diagnostic: its page, its message, its fixes |
//!
//! Nothing is analysed that rests on an error, where something may have been lost: a syntax error in a program, a name that
//! means nothing, a missing argument, a table with an error, all make the activities that they touch *not analysed*, with
//! the reason ([`Refusal`]), and with them whatever they may delay.
//!
//! This crate knows no editor, no protocol and no file system.

mod behaviour;
mod body;
mod builtin;
mod check;
mod config;
mod configured;
mod cost;
mod db;
mod declared;
pub mod diagnostics;
mod exported;
pub mod fact;
mod flat;
mod flow;
mod graph;
mod infer;
pub mod item_tree;
mod lower;
mod messages;
mod names;
mod program_id;
mod project;
mod psm;
mod resolve;
mod response;
mod semantics;
mod settings;
mod size;
mod skeleton;
mod source;
mod supposed;
mod system;
mod timetable;
mod timing_fact;
mod timing_reason;
mod types;
mod urgency;
mod values;
mod wiring;

pub use behaviour::{Behaviour, Cost, Edge, TimedProgram, behaviour_of};
pub use body::{
    Body, BodyId, Code, CoreScope, InitialValues, OperationHead, ProgramIn, SharedVariable, statements,
};
pub use builtin::{Builtin, Operand};
pub use check::declaration_facts;
pub use config::{Chain, Config, ExternalType, Maintainer, Mistake, keys as config_keys};
pub use db::{Database, File, ModelDb, Problem, Trees, Workspace, normalised};
pub use diagnostics::{PROSE, cpu_names, diagnostics_if, reasons_of, timing_reason, unusable_time};
pub use exported::{exported_component, psm_at, response_times_of, task_set_of};
pub use flat::{Flat, FlatInstance, Link, flat_of};
pub use infer::{
    CoreInference, HiddenName, Inference, Problem as NameProblem, ReportedProblem, Shared, Signature,
    VariableKind, VariableOf, expression_types, inference_of, inference_of_core, returns,
};
pub use lower::{DECLARATIONS, DeclarationMap, SourceMap};
pub use messages::{
    BUILT_IN_TYPES, Message, MessageConstant, MessageField, Package, catalogue, message_of, named_packages,
    package, read_message, used_packages,
};
pub use names::{FeatureOf, Features, Names, Unresolved, core_of, features_of, names_of, shell_of, similar};
pub use program_id::{ProgramId, ProgramKey};
pub use project::{
    CONFIG_FILE, Project, config_file, config_of, external_types, include_candidates, includes, is_model,
    project_files, projects,
};
pub use psm::{Psm, PsmEdge, Refused, psm_of, worst_path};
pub use resolve::{Binding, CallError, Callee, ResolvedCall, Resolver, Scope, VariableId};
pub use response::{
    ActivityReport, Budget, CpuReport, Deadlines, InterferenceReport, MissingTime, Query, Report, Verdict,
    budgets, facts_if, level_shown, missing_times, response_times, response_times_if,
};
pub use semantics::{Semantics, VisibleScope};
pub use settings::{ValueInEffect, values_in_effect, values_of_shell};
pub use skeleton::operation_skeleton;
pub use source::{
    Decl, Declarations, Place, architecture, codel, component, core, data, declaration_at, declaration_map,
    declarations, deployment, item_tree_of, parse, shell, source_map,
};
pub use supposed::SupposedField;
pub use system::{Priority, Row, System, mask, system_of};
pub use timetable::{
    Lookup, TableFiles, Timetable, pattern_of_path, table, table_files, table_pattern, timetable_of,
};
pub use timing_fact::{Expected, Missed, NoTime, TimingFact, TimingFactKind, Urgency};
pub use timing_reason::{
    ActivityField, Doubt, LostTable, NoSuchCpu, PatternError, Prose, Reason, Refusal as TimingRefusal, Share,
    StrayEntry, TableFault, TableFilesError, TableLevels, Timed, TooLong, Unknown, UnusableTime,
    WrongProgram,
};
pub use types::{C_TYPES, Integer, LANGUAGE_TYPES, Type, built_in_type, type_of};
pub use urgency::before_its_time;
pub use values::Value;
