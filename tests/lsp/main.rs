//! The language server over its standard streams, in one program, since a program for each subject costs a minute of linking.
//!
//! Tests run at the same time: each has a server and a folder of its own.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod code_actions;
mod completion;
mod diagnostics;
#[cfg(unix)]
mod disk;
mod generate;
#[cfg(unix)]
mod histories;
mod language_server;
mod message_packages;
mod navigation;
mod rename;
mod requests;
mod session;
mod settings;
mod symbols;
mod text;
mod timing;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
