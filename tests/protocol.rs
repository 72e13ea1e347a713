//! The server as the clients of pytest-lsp see it, which knows the specification: with what VS Code, Neovim and Emacs
//! announce, each message is looked at by `tests/protocol/`.
//!
//! `tests/run` installs pytest-lsp; without it these tests fail, and say so.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::MAUVE;

/// Runs the checks with a server; returns their output, and whether they succeeded.
fn run(server: &str, arguments: &[&str]) -> (String, bool) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/protocol/run");
    let output = Command::new(&path).arg(server).args(arguments).stdin(Stdio::null()).output();
    let output = output.unwrap_or_else(|error| panic!("{} does not run: {error}", path.display()));
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.success())
}

#[test]
fn protocol_every_message_is_as_the_client_understands_it() {
    let (said, fine) = run(MAUVE, &["-rP"]);
    println!("{said}");
    assert!(fine, "{said}");
}

#[test]
fn protocol_nothing_passes_without_a_server() {
    let (said, fine) = run("/no/such/server", &[]);
    assert!(!fine && said.contains("No such file or directory: '/no/such/server'"), "{said}");
    assert!(!said.contains(" passed"), "{said}");
}

#[test]
fn protocol_nothing_passes_with_another_program() {
    // `cat` runs, reads all messages, and echoes them.
    let (said, fine) = run("/bin/cat", &["-k", "initialize"]);
    assert!(!fine && !said.contains(" passed"), "{said}");
}
