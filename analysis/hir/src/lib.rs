//! The semantic model of MAUVE, without times: lowers syntax trees to names, types, behaviours and facts.
//!
//! All results are queries of a salsa database ([`Database`]): after an edit, salsa recomputes only the queries whose
//! inputs changed. A keystroke passes through these queries; each arrow stops if its result is unchanged:
//!
//! ```text
//! text → parse → item tree (no locations) → declarations → names ─┐
//!                     └→ data of a declaration → bodies ──────────┼→ inference of a body → costs of a body ─┐
//! mauve.toml → config ────────────────────────────────────────────┘                 behaviour of a core ◀──┘
//! ```
//!
//! | file | contents |
//! |---|---|
//! | `db.rs` | the inputs: files and workspaces; the previous trees, for incremental parsing and lowering |
//! | `item_tree.rs`, `lower.rs` | the declarations of a file, without locations; incremental lowering |
//! | `ranges.rs` | the ranges of the elements of a declaration |
//! | `source.rs`, `lines.rs` | declarations, their data, and [`Location`]s; line numbers |
//! | `project.rs` | roots, includes |
//! | `config.rs`, `config/` | `mauve.toml`: its content, its keys, its reader |
//! | `activity_field.rs` | the fields of an activity: their values, defaults and meanings |
//! | `completeness.rs` | whether a list of items, or a program, is complete |
//! | `names.rs`, `features.rs` | resolution of the names of declarations; the features of a shell |
//! | `body.rs` | the bodies of a core: the units of inference |
//! | `resolve.rs`, `builtin.rs` | resolution of the names and the calls in programs, and nowhere else |
//! | `infer.rs`, `infer/` | bindings, callees and types of each body |
//! | `semantics.rs` | resolution at a position of a text, for editors |
//! | `structure.rs` | a core without its programs: what an edit of a program does not change |
//! | `program_graph.rs` | each program as nodes in the order of execution: what costs, values and passages are computed from |
//! | `cost.rs`, `behaviour.rs` | the demand of programs, as calls of codels; the states and edges of a core |
//! | `flow.rs`, `flow/` | data flow through the states of a core: read before assignment, lost writes, unreachable code |
//! | `passage.rs`, `passage/` | how data passes through a core: its flow graph, and a search along all paths |
//! | `pending_calls.rs` | the calls of required operations that are pending at most |
//! | `product.rs`, `product/` | the states of a core together with the values of its small variables, and what its programs do to these |
//! | `program_id.rs` | the identity of a program, and its key in timing tables |
//! | `types.rs`, `values.rs` | types and assignability; constant evaluation with the semantics of the generated C++ |
//! | `msg.rs`, `messages.rs` | message packages: `.msg` texts; the built-in catalogue, resolution of type names |
//! | `ros2.rs`, `ros2/`, `ros2_fact.rs` | the topics of ROS 2 of a deployment, and the hosts of its instances |
//! | `ros2_files.rs`, `ros2_files/` | files of ROS 2 with the settings of threads and controllers: values with places, and edits |
//! | `hosts.rs` | the CPUs of several computers, in one set |
//! | `flat.rs`, `link.rs` | an architecture with its imports; a connection of it |
//! | `settings.rs`, `wiring.rs` | values of properties; types and directions of connections, unconnected features |
//! | `declared.rs`, `configured.rs` | checks of declared names and types, unused declarations; checks of `mauve.toml` |
//! | `check.rs`, `fact.rs`, `severity.rs` | the facts of a declaration: errors, warnings and hints |
//! | `size.rs` | the limit on the size of a project |
//! | `skeleton.rs` | the skeleton of a missing operation definition |
//! | `graph.rs` | reachability and topological order |
//!
//! A core with an error (a syntax error in a program, an unresolved name, a missing argument) is *not analysed*;
//! [`fact::ModelRefusal`] holds the reason.
//!
//! This crate depends on no execution times, messages, editors or file systems.

mod activity_field;
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
mod hosts;
mod infer;
pub mod item_tree;
mod lines;
mod link;
mod lower;
mod messages;
mod msg;
mod names;
mod passage;
mod pending_calls;
mod product;
mod program_graph;
mod program_id;
mod project;
mod ranges;
mod resolve;
mod ros2;
mod ros2_fact;
pub mod ros2_files;
mod semantics;
mod settings;
mod severity;
mod size;
mod skeleton;
mod source;
mod structure;
mod types;
mod value_size;
mod values;
mod wiring;

pub use activity_field::{
    ACTIVITY_FIELDS, DEPENDENT_FIELDS, EXCLUSIVE_FIELDS, FieldEntry, FieldKind, FieldValue, GREATEST_BURST,
    InvalidValue, NoTime, PERIODS, PLACES, field_entry, number, same_fields, similar_field,
};
pub use behaviour::{Behaviour, Edges, PeriodEdge, TimedProgram, behaviour_of};
pub use body::{ProgramIn, ScopedCode, statements};
pub use builtin::{Builtin, Operand};
pub use check::{declaration_facts, errors_in, not_checked, project_facts};
pub use completeness::Completeness;
pub use config::{
    Acceptance, Chain, Config, CpuSetConfig, DeploymentConfig, DeploymentTables, ExternalType, GatewayConfig,
    HostConfig, LinkConfig, Located, Maintainer, Mistake, MistakeKind, Required, Ros2Config, TopicConfig,
    keys as config_keys, toml_key,
};
pub use configured::{
    OwnerOfTables, accepted, check as check_configuration, owner_of_tables, required_of, section_with_tables,
};
pub use cost::{Cost, CostGraph, CostOf, Execution, fold};
pub use db::{Database, File, Log, ModelDb, OnDisk, Problem, Trees, Workspace, normalised, relative_path};
pub use declared::unused_facts;
pub use features::{
    FeatureOf, Features, Implementation, bases_of, core_of, features_of, is_core_for, shell_of,
};
pub use flat::{Flat, FlatInstance, deployed, first_target_of, flat_of, target_of};
pub use graph::closure;
pub use hosts::{Host, Hosts, hosts_of};
pub use infer::{CoreInference, Uses, VariableKind, VariableOf, inference_of_core, returns, uses_of};
pub use lines::{file_and_line, line_index, line_of};
pub use link::Link;
pub use messages::{
    catalogue, catalogue_of, message_of, named_packages, package, ros2_catalogue, used_packages,
};
pub use msg::{
    BUILT_IN_TYPES, FieldParts, Message, MessageConstant, MessageField, MessageSize, Package, read_message,
};
pub use names::{
    Names, Unresolved, file_outside, incomplete_file, names_of, resolve_path, resolve_type, similar,
};
pub use passage::{
    Assumption, Overwrite, Passage, PassageEnd, Passages, Skip, SkipCause, Written, passages_of,
};
pub use pending_calls::pending_calls_of;
pub use product::{Product, ProductEdge, ProductState, product_of};
pub use program_id::{ProgramId, ProgramKey};
pub use project::{
    CONFIG_FILE, Platform, Project, all_roots, config_file, config_of, external_types, file_groups,
    files_in_group, include_candidates, include_rings, includes, is_model, platform_of, project_files,
    projects, root_file,
};
pub use ranges::{DeclarationMap, SourceMap};
pub use resolve::{Binding, Callee, VariableId};
pub use ros2::{Ros2, Topic, TopicOrigin, TopicType, ros2_of};
pub use semantics::{
    FeaturesByName, LikelyCallee, Semantics, VisibleScope, likely_declaration, likely_features_of,
    likely_shell_of,
};
pub use settings::{ValueInEffect, values_in_architecture, values_in_effect, values_of_shell};
pub use severity::Severity;
pub use size::too_large;
pub use skeleton::operation_skeleton;
pub use source::{
    CoreInterface, Decl, Declarations, Location, architecture, codel, component, core, core_interface, data,
    declaration_at, declaration_map, declarations, deployment, item_tree_of, node_around, parse, shell,
    source_map,
};
pub use structure::structure_of;
pub use types::{C_TYPES, Integer, LANGUAGE_TYPES, Signature, Type, built_in_type, type_of};
pub use value_size::value_size;
pub use values::{Value, whole_number};
