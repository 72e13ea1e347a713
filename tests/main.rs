//! What users see, end to end: one program, a module for each subject. Tests run at the same time, each in a folder of its own.
//!
//! | module | what it tests |
//! |---|---|
//! | [`alone`] | `mauve measure` |
//! | [`cli`] | the command line |
//! | [`deployment_scripts`] | a script and launch files, executed by Lua, roslaunch and xmllint |
//! | [`documents`] | the README and the tutorial, followed in an empty home folder |
//! | [`editors`] | real Neovim, Helix, Emacs and VS Code |
//! | [`generate`] | `mauve generate` on real folders |
//! | [`generate_races`] | the same, while somebody exchanges its folders for links |
//! | [`generated_code`] | builds of generated packages, as a user builds them |
//! | [`generated_machines`] | random components, compared with an interpreter of their models |
//! | [`habits`] | what other programs do to a project while somebody types |
//! | [`import`] | callbacks of ROS 2 that LTTng records, as a project |
//! | [`lsp`] | the language server over its standard streams |
//! | [`measured_loop`] | from a recorded robot to its response times |
//! | [`orocos_deployer`] | a deployment in the deployer of a real Orocos |
//! | [`protocol`] | the messages of the server, as pytest-lsp sees them |
//! | [`ros2`] | a robot with topics beside programs of other implementations of DDS |
//! | [`rtt_conformance`] | the observed behaviour of RTT, on the runtime for Linux |
//! | [`runtime`] | the runtime with sanitizers, its locks, its virtual clock |
//! | [`soak`] | a long session of random edits, files and requests |
//! | [`standalone`] | `mauve run`, on the virtual clock and in real time |
//! | [`tracing`] | a robot that LTTng records |
//! | [`waits`] | robots whose codels wait, share a lock, pass large values and use other threads |

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking"
)]

#[cfg(target_os = "linux")]
mod alone;
mod cli;
mod deployment_scripts;
mod documents;
mod editors;
mod generate;
mod generate_races;
mod generated_code;
mod generated_machines;
mod habits;
#[cfg(target_os = "linux")]
mod import;
mod lsp;
#[cfg(target_os = "linux")]
mod measured_loop;
#[cfg(target_os = "linux")]
mod orocos_deployer;
mod protocol;
#[cfg(target_os = "linux")]
mod ros2;
mod rtt_conformance;
#[cfg(target_os = "linux")]
mod runtime;
mod soak;
#[cfg(target_os = "linux")]
mod standalone;
#[cfg(target_os = "linux")]
mod tracing;
#[cfg(target_os = "linux")]
mod waits;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
