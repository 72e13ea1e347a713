//! What MAUVE models mean, without times: from syntax trees to names, types, behaviours and facts.
//!
//! Everything here is a query of a salsa database ([`Database`]): after an edit, only what the edit touched is computed
//! again. One keystroke goes this way, and each arrow stops where nothing changed:
//!
//! ```text
//! text → parse → item tree (no locations) → declarations → names ─┐
//!                     └→ data of a declaration → bodies ──────────┼→ inference of a body → costs of a body ─┐
//! mauve.toml → config ────────────────────────────────────────────┘                 behaviour of a core ◀──┘
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `db.rs` | the inputs: files and workspaces; and the last trees, from which the next are made |
//! | `item_tree.rs`, `lower.rs` | what a file declares, without locations; and the source map: only what an edit touches is read again |
//! | `source.rs`, `lines.rs` | declarations, their data, and [`Location`]s; the lines of a file |
//! | `project.rs`, `config.rs` | roots, includes, `mauve.toml` |
//! | `completeness.rs` | whether all of something is known |
//! | `names.rs`, `features.rs` | what the name of a declaration refers to; the features of a shell |
//! | `body.rs` | the bodies of a core: what is read apart from the rest of it |
//! | `resolve.rs`, `builtin.rs` | what the names and the calls in programs refer to: the only place that decides it |
//! | `infer.rs` | bindings, callees and types, body by body |
//! | `semantics.rs` | from a position to a meaning: the door for editors |
//! | `cost.rs`, `behaviour.rs` | what programs cost, by codels; a core's states and edges |
//! | `flow.rs` | how values flow through a core's states: what is read too early, overwritten before it is read, never executed |
//! | `program_id.rs` | the identity of a program, and its key in timing tables |
//! | `types.rs`, `values.rs` | types and what fits where; constants, computed as the generated C++ would |
//! | `msg.rs`, `messages.rs` | message packages: `.msg` texts; the built-in catalogue, what the name of a type refers to |
//! | `flat.rs`, `link.rs` | an architecture with all that it imports; a connection in it |
//! | `settings.rs`, `wiring.rs` | values of properties; what connections carry and what is left open |
//! | `declared.rs`, `configured.rs` | names and types as they are declared, and what nothing uses; what `mauve.toml` names |
//! | `check.rs`, `fact.rs`, `severity.rs` | what is wrong with a declaration, as facts |
//! | `size.rs` | whether a project is too large to be analysed |
//! | `skeleton.rs` | the definition of an operation that is still to be written |
//! | `graph.rs` | reachability and order in graphs |
//!
//! Nothing is analysed that depends on an error: a syntax error in a program, an unresolved name,
//! a missing argument make the core that has them *not analysed*, with the reason ([`fact::Refusal`]).
//!
//! This crate knows no execution times, no prose, no editor and no file system.

mod behaviour;
mod body;
mod builtin;
mod check;
mod completeness;
mod config;
mod configured;
mod cost;
mod db;
mod declared;
pub mod fact;
mod features;
mod flat;
mod flow;
mod graph;
mod infer;
pub mod item_tree;
mod lines;
mod link;
mod lower;
mod messages;
mod msg;
mod names;
mod program_id;
mod project;
mod resolve;
mod semantics;
mod settings;
mod severity;
mod size;
mod skeleton;
mod source;
mod types;
mod values;
mod wiring;

pub use behaviour::{Behaviour, Edge, TimedProgram, behaviour_of};
pub use body::{
    Body, BodyId, Code, CoreScope, InitialValues, OperationHead, ProgramIn, SharedVariable, statements,
};
pub use builtin::{Builtin, Operand};
pub use check::not_checked;
pub use check::{declaration_facts, errors_in, project_facts};
pub use completeness::Completeness;
pub use config::{
    Chain, Config, ExpectedValue, ExternalType, Maintainer, Mistake, MistakeKind, keys as config_keys,
};
pub use configured::check as check_configuration;
pub use cost::{Cost, operations_in};
pub use db::{Database, File, ModelDb, Problem, Trees, Workspace, normalised};
pub use features::{FeatureOf, Features, bases_of, core_of, features_of, is_core_for, shell_of};
pub use flat::{Flat, FlatInstance, deployed, first_target_of, flat_of, target_of};
pub use infer::{
    CoreInference, Inference, NameProblem, Shared, Uses, VariableKind, VariableOf, inference_of_core,
    returns, uses_of,
};
pub use lines::{file_and_line, line_index, line_of};
pub use link::Link;
pub use lower::{DeclarationMap, SourceMap};
pub use messages::{catalogue, message_of, named_packages, package, used_packages};
pub use msg::{BUILT_IN_TYPES, Message, MessageConstant, MessageField, Package, read_message};
pub use names::{Names, Unresolved, file_outside, names_of, similar};
pub use program_id::{ProgramId, ProgramKey};
pub use project::{
    CONFIG_FILE, Platform, Project, all_roots, config_file, config_of, external_types, include_candidates,
    include_rings, includes, is_model, platform_of, project_files, projects, root_file,
};
pub use resolve::{Binding, CallError, Callee, ResolvedCall, Resolver, Scope, VariableId};
pub use semantics::{
    FeaturesByName, LikelyCallee, Semantics, VisibleScope, likely_declaration, likely_features_of,
    likely_shell_of,
};
pub use settings::{ValueInEffect, values_in_effect, values_of_shell};
pub use severity::Severity;
pub use size::too_large;
pub use skeleton::operation_skeleton;
pub use source::{
    CoreInterface, Decl, Declarations, Location, architecture, codel, component, core, core_interface, data,
    declaration_at, declaration_map, declarations, deployment, item_tree_of, parse, shell, source_map,
};
pub use types::{C_TYPES, Integer, LANGUAGE_TYPES, Signature, Type, built_in_type, type_of};
pub use values::{Value, whole_number};
