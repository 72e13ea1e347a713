//! Conflicts that git has left in files: what an editor and the command line say, and that git still finds its markers.

use std::path::{Path, PathBuf};

use mauve_tests::{Client, mauve, scratch, test_name, write};
use serde_json::{Value, json};

use super::{MAUVE, start};

const MODEL: &str = "codel f(): int\ncodel g(): int\nshell S {}\ncore K(S) {\n  update = { f(); }\n}\n\
    core L(S) {\n  update = { g(); }\n}\ncomponent C(S, K)\ncomponent E(S, L)\n\
    architecture A {\n  instance a: C\n  instance b: E\n}\n\
    deployment D {\n  architecture A\n  activity a { affinity = 1  priority = 5  period = 10 }\n  \
    activity b { affinity = 2  priority = 4  period = 10 }\n}\n";

const CONFIG: &str = "[timing]\ntables = [\"t.toml\"]\n[platform]\ncpus = 2\nrt_throttling = false\n";

fn git(folder: &Path, arguments: &[&str]) -> String {
    String::from_utf8_lossy(&mauve_tests::git(folder, arguments).stdout).into_owned()
}

/// A repository in the middle of a merge whose branches have changed the same lines of two files.
fn merged(name: &str, style: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let commit = |branch: &[&str], model: &str, table: &str| {
        git(&folder, branch);
        write(&folder, &[("robot.mal", model), ("t.toml", table), ("mauve.toml", CONFIG)]);
        git(&folder, &["add", "."]);
        git(&folder, &["commit", "-qm", "models"]);
    };
    let table = |f: u32| format!("[codel]\nf = {f}\ng = 2\n");
    commit(&["init", "-qb", "main"], MODEL, &table(1));
    let theirs = MODEL
        .replace("update = { f(); }", "update = {  f(); f(); }")
        .replace("component E(S, L)", "component E( S,L )");
    commit(&["checkout", "-qb", "other"], &theirs, &table(3));
    let ours = MODEL
        .replace("update = { f(); }", "update = {f();g();}")
        .replace("component E(S, L)", "component  E(S, L)");
    git(&folder, &["checkout", "-q", "main"]);
    commit(&["status"], &ours, &table(4));
    git(&folder, &["-c", &format!("merge.conflictStyle={style}"), "merge", "-q", "other"]);
    folder
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn git_finds_its_markers_after_formatting() {
    for style in ["merge", "diff3", "zdiff3"] {
        let folder = merged(style, style);
        let before = text(&folder, "robot.mal");
        assert_eq!(before.matches("<<<<<<< HEAD\n").count(), 2, "{before}");
        let untidy = before.replace("component C(S, K)", "component  C( S,K )");
        write(&folder, &[("robot.mal", untidy.as_str())]);
        assert_eq!(mauve(MAUVE, &folder, &["fmt"]).code, 0);
        assert_eq!(text(&folder, "robot.mal"), before, "{style}");
        let marked = before.lines().filter(|it| {
            ["<<<<<<<", "|||||||", "=======", ">>>>>>>"].iter().any(|sign| it.starts_with(sign))
        });
        let found = git(&folder, &["diff", "--check", "HEAD", "--", "robot.mal"]);
        assert_eq!(found.matches("leftover conflict marker").count(), marked.count(), "{found}");
        let found = mauve(MAUVE, &folder, &["check", "--format", "json"]);
        let found: Value = serde_json::from_str(&found.out).unwrap();
        let messages: Vec<&str> = found["diagnostics"]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| it["message"].as_str().unwrap())
            .collect();
        let names = "unresolved merge conflict between `HEAD` and `other`: ";
        assert!(messages.len() == 3 && messages.iter().all(|it| it.starts_with(names)), "{messages:?}");
    }
}

#[test]
fn a_conflict_is_resolved_in_an_editor() {
    let folder = merged("editor", "merge");
    write(&folder, &[("t.toml", "[codel]\nf = 1\ng = 2\n")]);
    let colours = json!({"requests": {"full": true}, "tokenTypes": ["class", "interface"], "tokenModifiers": [], "formats": ["relative"]});
    let capabilities = json!({
        "workspace": {"inlayHint": {"refreshSupport": true}},
        "textDocument": {"semanticTokens": colours, "documentSymbol": {"hierarchicalDocumentSymbolSupport": true},
            "publishDiagnostics": {"versionSupport": true}},
    });
    let (mut client, _) = start(&folder, &capabilities);
    let mut robot = client.open_file(&folder.join("robot.mal"));
    assert_eq!(client.codes(&robot), ["syntax-error", "syntax-error"]);
    for activity in ["activity a", "activity b"] {
        let hint = client.hint(&robot, activity);
        assert!(hint.contains("merge conflict"), "{hint}");
    }
    // Every request has an answer, also between the markers.
    let of = json!({"uri": robot.uri});
    let ask = |client: &mut Client, method: &str, more: Value| {
        let mut params = json!({"textDocument": of});
        params.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        client.call(&format!("textDocument/{method}"), params).unwrap()
    };
    let symbols = ask(&mut client, "documentSymbol", json!({})).to_string();
    assert!(symbols.contains("\"name\":\"K\"") && symbols.contains("\"name\":\"S\""), "{symbols}");
    assert!(!ask(&mut client, "semanticTokens/full", json!({}))["data"].as_array().unwrap().is_empty());
    assert!(!ask(&mut client, "foldingRange", json!({})).as_array().unwrap().is_empty());
    for at in ["<<<<<<< HEAD", "{f();g();}", "=======", "f(); f(); }", ">>>>>>> other"] {
        let at = robot.text.find(at).unwrap() + 2;
        let position = robot.position(at);
        ask(&mut client, "selectionRange", json!({"positions": [position]}));
        ask(&mut client, "documentHighlight", json!({"position": position}));
        ask(
            &mut client,
            "codeAction",
            json!({"range": {"start": position, "end": position}, "context": {"diagnostics": []}}),
        );
        let is_other = robot.text[..at].rfind("=======") > robot.text[..at].rfind("<<<<<<<");
        if is_other {
            assert!(ask(&mut client, "hover", json!({"position": position})).is_null());
            let found = ask(&mut client, "completion", json!({"position": position}));
            assert!(
                found.is_null() || found["items"].as_array().is_some_and(Vec::is_empty) || found == json!([]),
                "{found}"
            );
        }
    }
    // As an editor accepts the present text, and then the other one.
    for (start, end) in
        [("<<<<<<< HEAD\ncomponent  E", "component  E"), ("=======\ncomponent E( S,L )\n>>>>>>> other\n", "")]
    {
        client.edit(&mut robot, start, end);
    }
    client.edit(&mut robot, "<<<<<<< HEAD\n  update = {f();g();}\n=======\n", "");
    let found = client.codes(&robot);
    assert_eq!(found, ["syntax-error"], "one marker is left");
    client.edit(&mut robot, ">>>>>>> other\n", "");
    assert!(client.codes(&robot).is_empty());
    let hint = client.hint(&robot, "activity a");
    assert!(hint.contains("2 / 10 ms"), "{hint}");
}

#[test]
fn configurations_and_tables_say_conflict() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let region =
        |ours: &str, theirs: &str| format!("<<<<<<< HEAD\r\n{ours}=======\r\n{theirs}>>>>>>> other\r\n");
    let table = format!(
        "[codel]\r\n{}g = 2\r\n{}",
        region("f = 1\r\n", "f = 3\r\n"),
        region("", "[wait]\r\nf = 1\r\n")
    );
    let config = CONFIG.replace("cpus = 2\n", &region("cpus = 2\r\n", "cpus = 4\r\n"));
    for (files, conflicts) in [
        ([("robot.mal", MODEL), ("mauve.toml", CONFIG), ("t.toml", table.as_str())], 2),
        ([("robot.mal", MODEL), ("mauve.toml", config.as_str()), ("t.toml", "[codel]\nf = 1\ng = 2\n")], 1),
    ] {
        write(&folder, &files);
        let found = mauve(MAUVE, &folder, &["check"]);
        assert_eq!(found.out.matches("error[").count(), conflicts, "{}", found.out);
        let names = "]: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts";
        assert_eq!(found.out.matches(names).count(), conflicts, "{}", found.out);
        assert!(found.out.contains("  ? ") && found.code == 1, "{}", found.out);
    }
}
