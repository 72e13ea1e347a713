//! What users see, end to end: the binary in one program of tests, since each program costs a minute of linking.
//!
//! Tests run at the same time, each in a process and a folder of its own. `tests/README.md` says what each module needs.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking"
)]

mod cli;
mod deployment_scripts;
#[cfg(unix)]
mod documents;
mod editors;
#[cfg(unix)]
mod generate;
#[cfg(unix)]
mod generate_races;
mod generated_code;
mod generated_machines;
mod lsp;
#[cfg(target_os = "linux")]
mod measured_loop;
#[cfg(target_os = "linux")]
mod orocos_deployer;
mod protocol;
mod rtt_conformance;
#[cfg(target_os = "linux")]
mod runtime;
#[cfg(unix)]
mod soak;
#[cfg(target_os = "linux")]
mod standalone;
#[cfg(target_os = "linux")]
mod tracing;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
