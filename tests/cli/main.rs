//! The command line, in one program, since a program for each subject costs a minute of linking.
//!
//! Tests run at the same time: each has a folder of its own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod acceptance;
mod bad_input;
mod clocks;
mod command_line;
mod deployment_tables;
#[cfg(unix)]
mod editor;
mod first_steps;
mod fixes;
mod graph;
#[cfg(unix)]
mod hostile;
mod pwcet;
mod release;
mod robot;
mod samples;
mod sensitivity;
mod simulate;
mod task_sets;
mod trace_check;
mod trace_import;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
