//! The language server over its standard streams.

mod addresses;
mod code_actions;
mod completion;
mod conflicts;
mod diagnostics;
mod disk;
mod generate;
mod histories;
mod initialize;
mod language_server;
mod marks;
mod measured;
mod message_packages;
mod navigation;
mod projects;
mod rename;
mod requests;
mod running;
mod session;
mod settings;
mod symbols;
mod text;
mod timing;
mod typing;
mod unwatched;

use std::path::{Path, PathBuf};

use mauve_tests::{Client, copy, models, scratch};
use serde_json::Value;

use crate::MAUVE;

/// A server for `folder` and a client with these capabilities. Returns the client and the server's capabilities.
fn start(folder: &Path, capabilities: &Value) -> (Client, Value) {
    let mut client = Client::start(MAUVE, &[]);
    let server = client.initialize(Some(folder), capabilities);
    (client, server["capabilities"].clone())
}

/// A server for the sample robot.
fn robot() -> Client {
    Client::of_folder(MAUVE, &models().join("p3dx"))
}

/// A copy of the sample robot in a folder of its own.
fn copied_robot(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    copy(&models().join("p3dx"), &folder);
    folder
}

/// Whether a hint shows no current figure.
fn is_unknown(hint: &str) -> bool {
    hint.starts_with(['?', '…'])
}
