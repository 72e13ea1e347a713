//! Runs real editors: Neovim without a screen, Helix and Emacs in a terminal, and the workbench of VS Code in a browser. The
//! scripts in `tests/editors/` drive them and list their checks.
//!
//! `tests/run` installs the editors; without them these tests fail with a message.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::MAUVE;

/// Runs a script of `tests/editors/`; returns its output, and whether it succeeded.
fn run(script: &str, arguments: &[&str]) -> (String, bool) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/editors").join(script);
    let output = Command::new(&path).args(arguments).stdin(Stdio::null()).output();
    let output = output.unwrap_or_else(|error| panic!("{} does not run: {error}", path.display()));
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.success())
}

#[test]
fn neovim_shows_response_times_and_warnings() {
    let (said, fine) = run("nvim/run", &[MAUVE]);
    println!("{said}");
    assert!(fine, "{said}");
}

#[test]
fn neovim_shows_nothing_without_a_server() {
    let (said, fine) = run("nvim/run", &["/no/such/server"]);
    assert!(!fine && said.contains("FAILED"), "{said}");
}

#[test]
fn helix_shows_response_times_and_warnings() {
    let (said, fine) = run("helix/run", &[MAUVE]);
    println!("{said}");
    assert!(fine, "{said}");
}

#[test]
fn helix_shows_nothing_without_a_server() {
    let (said, fine) = run("helix/run", &[MAUVE, "/no/such/server"]);
    assert!(!fine && said.contains("FAILED  the screen does not show: ! 997 / 1000"), "{said}");
}

#[test]
fn emacs_shows_response_times_and_warnings() {
    let (said, fine) = run("emacs/run", &[MAUVE]);
    println!("{said}");
    assert!(fine, "{said}");
}

#[test]
fn emacs_shows_nothing_without_a_server() {
    let (said, fine) = run("emacs/run", &[MAUVE, "/no/such/server"]);
    let is_explained = said.contains("mauve: cannot run \"mauve\": install it, or set");
    assert!(
        !fine && is_explained && said.contains("FAILED  the screen does not show: ! 997 / 1000"),
        "{said}"
    );
}

#[test]
fn vscode_shows_response_times_and_warnings() {
    let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("vscode.png");
    let (said, fine) = run("vscode/run", &[MAUVE, &picture.display().to_string()]);
    println!("{said}a picture of it is {}", picture.display());
    assert!(fine, "{said}");
}

#[test]
fn vscode_extension_passes_its_own_tests() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../editors/vscode");
    let output =
        Command::new("npm").args(["test", "--silent"]).current_dir(folder).stdin(Stdio::null()).output();
    let output = output.unwrap_or_else(|error| panic!("npm does not run: {error}"));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
}
