//! A text on standard input, as linters in editors give it.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use mauve_tests::{copy, models, scratch, write};
use serde_json::Value;

use crate::MAUVE;

/// Runs `mauve` in a folder with a text; returns the exit code and what it writes.
fn run(folder: &Path, arguments: &[&str], text: &[u8]) -> (Option<i32>, String, String) {
    let mut process = Command::new(MAUVE)
        .args(arguments)
        .current_dir(folder)
        .env_remove("MAUVE_MODELS")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that refuses its arguments reads nothing.
    let _ = process.stdin.take().unwrap().write_all(text);
    let output = process.wait_with_output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn checked(folder: &Path, file: &str, text: &str) -> (Option<i32>, Vec<(String, String)>) {
    let arguments = ["check", "-", "--stdin-path", file, "--format", "json"];
    let (code, out, err) = run(folder, &arguments, text.as_bytes());
    assert_eq!(err, "");
    let found: Value = serde_json::from_str(&out).unwrap();
    let found =
        found["diagnostics"].as_array().unwrap().iter().filter(|it| it["severity"] != "hint").map(|it| {
            let file = it["file"].as_str().unwrap().strip_prefix(folder.to_str().unwrap()).unwrap();
            (file.to_owned(), it["code"].as_str().unwrap().to_owned())
        });
    (code, found.collect())
}

#[test]
fn a_text_stands_for_a_file_of_its_project() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "stdin_check").canonicalize().unwrap();
    copy(&models().join("p3dx"), &folder);
    let deployment = std::fs::read_to_string(folder.join("deployment.mal")).unwrap();
    assert_eq!(checked(&folder, "deployment.mal", &deployment), (Some(0), vec![]));
    let wrong = deployment.replacen("deadline = 1000", "deadline = 700", 1);
    let missed = vec![("/deployment.mal".to_owned(), "deadline-missed".to_owned())];
    let absolute = folder.join("deployment.mal");
    for name in ["deployment.mal", "./components/../deployment.mal", absolute.to_str().unwrap()] {
        assert_eq!(checked(&folder, name, &wrong), (Some(1), missed.clone()), "{name}");
    }
    // An included file: what it breaks elsewhere is told, too.
    let (code, found) = checked(&folder, "navigation_architecture.mal", "// Nothing is left.\n");
    assert_eq!(code, Some(1));
    assert!(found.iter().any(|(file, _)| file == "/exploration_architecture.mal"), "{found:?}");
    // The configuration.
    let config = std::fs::read_to_string(folder.join("mauve.toml")).unwrap();
    let (code, found) = checked(&folder, "mauve.toml", &format!("{config}\n[lint]\nx = 1\n"));
    assert_eq!(code, Some(1));
    assert!(found.iter().any(|(file, _)| file == "/mauve.toml"), "{found:?}");
    // Nothing was written; people see the text that was given.
    assert_eq!(std::fs::read_to_string(folder.join("deployment.mal")).unwrap(), deployment);
    let (code, out, _) = run(&folder, &["check", "-", "--stdin-path=deployment.mal"], wrong.as_bytes());
    assert_eq!(code, Some(1));
    assert!(out.contains("deadline = 700") && out.contains("--> deployment.mal:"), "{out}");
}

#[test]
fn a_text_stands_for_a_file_that_is_not_yet_there() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "stdin_new").canonicalize().unwrap();
    write(&folder, &[("mauve.toml", ""), ("a.mal", "include \"new.mal\"\nuse parts\n")]);
    let new = "library parts { codel f(: int }\n";
    let (code, found) = checked(&folder, "new.mal", new);
    assert_eq!((code, found[0].clone()), (Some(1), ("/new.mal".to_owned(), "syntax-error".to_owned())));
    assert!(found.iter().all(|(_, code)| code != "unresolved-include"), "{found:?}");
    assert!(!folder.join("new.mal").exists());
}

#[test]
fn a_text_on_standard_input_needs_a_place() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "stdin_bad").canonicalize().unwrap();
    write(&folder, &[("a.mal", "codel f(): int\n"), ("notes.txt", "")]);
    for (arguments, said) in [
        (["check", "-"].as_slice(), "--stdin-path"),
        (&["check", "a.mal", "--stdin-path", "a.mal"], "--stdin-path"),
        (&["check", "-", "a.mal", "--stdin-path", "a.mal"], "cannot be combined"),
        (&["check", "-", "--stdin-path", "notes.txt"], "is not a model"),
        (&["check", "-", "--stdin-path", "no/such/folder/a.mal"], "no/such/folder"),
        (&["check", "-", "--stdin-path", "."], "`.`"),
        (&["check", "-", "--stdin-path", "a.mal", "--fix"], "--fix"),
        (&["check", "-", "--stdin-path", "a.mal", "--diff"], "--diff"),
    ] {
        let (code, out, err) = run(&folder, arguments, b"codel f(): int\n");
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(err.contains(said), "{arguments:?}: {err}");
    }
    // As in a file: what is no text is an error in it.
    let arguments = ["check", "-", "--stdin-path", "a.mal"];
    let (code, out, _) = run(&folder, &arguments, b"codel f(): int\n\xff");
    assert_eq!(code, Some(1));
    assert!(out.contains("is not UTF-8 text from byte 15 on"), "{out}");
}
