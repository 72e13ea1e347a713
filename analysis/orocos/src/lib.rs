//! From models to Orocos packages: C++ components with their tracing, scripts, launch files, exported analyses.
//!
//! Everything here is pure: [`packages`] gives the files of each package and writes none. A package is made for each
//! library of a project, in the order in which they are built:
//!
//! | file | makes |
//! |---|---|
//! | `package.rs` | a package's files, from the modules below |
//! | `generated_file.rs` | packages and their files: whose they are, and how the generator recognises its own |
//! | `library.rs` | which packages there are, what is in each, what each needs |
//! | `component.rs`, `component/` | the class of each component |
//! | `cpp_name.rs` | names that C++, RTT and its scripts can have |
//! | `cpp_type.rs` | C++ types and the headers that declare them |
//! | `escape.rs` | texts of a model, as literals of the languages that are generated |
//! | `task.rs` | what all components of a package have in common |
//! | `trace.rs` | the tracing of what components execute, by LTTng-UST |
//! | `origin.rs` | what generated comments say of the model |
//! | `template.rs`, `../templates` | the files that differ little from package to package |
//! | `codels.rs` | the headers of types and codels, and the stubs that the user completes |
//! | `build.rs` | `package.xml`, `CMakeLists.txt`, and what the components of a library have in common |
//! | `deployment.rs` | a deployment with all names and values resolved |
//! | `script.rs`, `launch.rs` | its script and its launch file |
//! | `standalone.rs`, `standalone/` | programs of the deployments, which need no Orocos |
//! | `runtime.rs` | the files of the runtime that these programs use in place of Orocos |
//! | `stubs.rs` | packages that run before their codels are written |
//! | `export.rs` | what the analysis reads, as JSON: state machines and task sets |
//! | `plan.rs` | what is written, changed and removed, and what is the user's |
//! | `manifest.rs` | what the generator wrote into a package the last time |
//! | `prototype.rs` | whether a file of the user's defines what a codel is declared as |
//!
//! Nothing is generated from a model with errors ([`problems`]): what is generated from the others compiles. Names and texts
//! of a model go through `cpp_name.rs` and `escape.rs` on their way out, so that no model can break out of its place.
//!
//! This crate knows no file system, no editor and no protocol. What prevents generation is a [`ProblemKind`] or a
//! [`PlanError`], and no text: `server` writes the messages.

mod build;
mod codels;
mod component;
mod cpp_name;
mod cpp_type;
mod deployment;
mod escape;
mod export;
mod generated_file;
mod launch;
mod library;
mod manifest;
mod origin;
mod package;
mod plan;
mod prototype;
mod runtime;
mod script;
mod standalone;
mod stubs;
mod task;
mod template;
mod trace;
mod type_hash;

pub use codels::is_empty_stub;
pub use cpp_name::task_name;
pub use generated_file::{FileOwner, GeneratedFile, GeneratedPackage, STANDALONE};
pub use library::{Artifact, GenerationProblem, ProblemKind, configuration_problems, problems};
pub use manifest::{MANIFEST, ManifestError};
pub use package::{packages, ros2_packages};
pub use plan::{Action, ChangedCodel, Plan, PlanError, PlanStep, plan};
pub use standalone::{InputProblem, MEASURE, Programs, Shape, measuring, record_inputs, standalone};
pub use stubs::packages_with_stubs;
