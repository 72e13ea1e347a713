//! `mauve check --fix` and `--diff`: what is applied, what is left to the user, and which files are written.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::{Run, mauve, scratch, search, test_name, write};
use serde_json::Value;

use crate::MAUVE;

fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    write(&folder, files);
    folder
}

fn check(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["check"], arguments].concat())
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// Three mechanical mistakes; one of them is seen once the first is fixed.
const MISTAKES: &str = "codel measure(): int\r\nshell S { output port p: int }\r\ncore K(S): {\r\n  var n: int = 0;\r\n  update = { n = maesure(); if n > 0 then { write(p, n); } }\r\n}\r\ncomponent C(S, K)\r\n";

const FIXED: &str = "codel measure(): int\r\nshell S { output port p: int }\r\ncore K(S) {\r\n  var n: int = 0;\r\n  update = { n = measure(); if n > 0 then { write(p, n); } else { } }\r\n}\r\ncomponent C(S, K)\r\n";

#[test]
fn all_mechanical_fixes_are_applied_and_the_rest_is_reported() {
    let folder = folder("mistakes", &[("robot.mal", MISTAKES)]);
    let shown = check(&folder, &["--diff"]);
    assert_eq!((shown.code, shown.err.as_str()), (1, ""), "{}", shown.out);
    for line in [
        "--- a/robot.mal\n+++ b/robot.mal\n@@ ",
        "\n-core K(S): {\r\n",
        "\n+core K(S) {\r\n",
        "n = measure();",
    ] {
        assert!(shown.out.contains(line), "{line} in {}", shown.out);
    }
    assert_eq!(text(&folder, "robot.mal"), MISTAKES, "--diff writes nothing");
    let fixed = check(&folder, &["--fix"]);
    assert_eq!((fixed.code, fixed.err.as_str()), (0, ""), "{}", fixed.out);
    assert!(fixed.out.starts_with("3 fixes applied in robot.mal\n"), "{}", fixed.out);
    assert_eq!(text(&folder, "robot.mal"), FIXED);
    let again = check(&folder, &["--fix"]);
    assert!(again.code == 0 && again.out.starts_with("nothing to fix\n"), "{}", again.out);
    let shown = check(&folder, &["--diff"]);
    assert_eq!((shown.code, shown.out.as_str()), (0, ""));
}

/// What `git apply` makes of a patch is what the command itself writes, to the byte.
#[test]
fn git_applies_each_patch() {
    let mistakes = MISTAKES.replace('\r', "");
    let models = [
        ("plain", mistakes.clone()),
        ("crlf", MISTAKES.to_owned()),
        ("mixed", mistakes.replace("int\n", "int\r\n")),
        ("lone-cr", mistakes.replace("0;\n  ", "0;\r\n\r  \r").replace("core", "\r\rcore")),
        ("cr-at-the-end", format!("{mistakes}\r")),
        ("no-line-break", mistakes.trim_end().to_owned()),
        ("no-line-break-crlf", MISTAKES.trim_end().to_owned()),
        ("one-line", mistakes.replace('\n', " ").trim_end().to_owned()),
        ("byte-order-mark", format!("\u{feff}{mistakes}")),
        // A terminal and a job would obey these, were they not in a file or a pipe.
        (
            "obeyed",
            mistakes
                .replace("int\n", "int // \u{1b}[31m \u{202e} ##vso[x\n::error::y\n")
                .replace("::error", "// ::error"),
        ),
    ];
    let names = ["robot.mal", "a/b/robot.mal", "a b.mal", "\u{e9}\u{202e}.mal", "q\"\\.mal"];
    let all = models.iter().map(|it| ("robot.mal", it)).chain(names.map(|name| (name, &models[0])));
    for (name, (kind, model)) in all {
        let files = [(name, model.as_str())];
        check_patch(&format!("{name}-{kind}"), &files, name, &["check"], "--fix");
    }
    for (kind, line) in [("lf", "\n"), ("crlf", "\r\n"), ("cr", "\n\r \r")] {
        let library = "codel f(): void\ncodel g(): void\nshell S { }\ncore K(S) { update = { f(); } }\ncore L(S) { update = { g(); } }\n\
                       component X(S, K)\ncomponent Y(S, L)\narchitecture A { instance x: X instance y: Y }\n";
        let model = format!(
            "include \"lib.mal\"{line}deployment D {{ architecture A{line}  activity x {{ affinity = 1 priority = 5{line} \
             period = 50 deadline = 10 }}{line}  activity y {{ affinity = 1 priority = 9 period = 20 }}{line}}}"
        );
        let config = "project.root = \"main.mal\"\ntiming.tables = [\"t.toml\"]\nplatform.cpus = 1\nplatform.rt_throttling = false\n";
        let files = [
            ("main.mal", &*model),
            ("lib.mal", library),
            ("t.toml", "codel.f = 5\ncodel.g = 8\n"),
            ("mauve.toml", config),
        ];
        check_patch(&format!("tune-{kind}"), &files, "main.mal", &["tune", "--priorities"], "--apply");
    }
}

fn check_patch(place: &str, files: &[(&str, &str)], changed: &str, command: &[&str], apply: &str) {
    let place = place.replace(|it: char| !it.is_ascii_alphanumeric(), "-");
    let [patched, written] = ["patched", "written"].map(|it| folder(&format!("{place}-{it}"), files));
    let ran = |folder: &Path, option: &str| {
        std::process::Command::new(MAUVE).args(command).arg(option).current_dir(folder).output().unwrap()
    };
    let patch = ran(&patched, "--diff").stdout;
    assert!(!patch.is_empty(), "{place}");
    fs::write(patched.join("patch"), &patch).unwrap();
    mauve_tests::git(&patched, &["init", "--quiet"]);
    let applied = mauve_tests::git(&patched, &["apply", "patch"]);
    let patch = String::from_utf8_lossy(&patch);
    assert!(applied.status.success(), "{place}: {}\n{patch}", String::from_utf8_lossy(&applied.stderr));
    ran(&written, apply);
    let [found, expected] = [&patched, &written].map(|it| fs::read(it.join(changed)).unwrap());
    assert!(found == expected, "{place}: {found:?} {expected:?}\n{patch}");
    assert_ne!(String::from_utf8_lossy(&found), files[0].1, "{place}");
}

#[test]
fn what_needs_a_choice_is_left_to_the_user() {
    for model in [
        // Two names are as similar.
        "codel plan1(): int\ncodel plan2(): int\nshell S { }\ncore K(S) { update = { plan(); } }\n",
        // Something is deleted.
        "shell S { }\ncore K(S) { var old: int = 3; update = { } }\n",
        // A value is invented.
        "shell S { }\ncore K(S) { update = { } }\ncomponent C(S, K)\narchitecture A { instance a: C }\n\
         deployment D { architecture A  activity a { priority = 1 } }\n",
        // The field would be set twice.
        "shell S { }\ncore K(S) { update = { } }\ncomponent C(S, K)\narchitecture A { instance a: C }\n\
         deployment D { architecture A  activity a { priority = 1 period = 10 perido = 5 } }\n",
    ] {
        let folder = folder("choice", &[("robot.mal", model)]);
        let fixed = check(&folder, &["--fix"]);
        assert!(fixed.out.starts_with("nothing to fix\n"), "{}", fixed.out);
        assert_eq!(text(&folder, "robot.mal"), model);
    }
}

#[test]
fn what_would_meet_a_missed_deadline_is_said() {
    let model = |late: &str, deadline: u32| {
        format!(
            "codel work(): int\nshell S {{ }}\ncore K(S) {{ update = {{ work(); }} }}\ncomponent C(S, K)\n\
             architecture A {{ instance a: C  instance b: C }}\n\
             deployment D {{ architecture A  activity a {{ priority = 2 period = 100 }}\n\
             activity b {{ priority = {late} period = 100 deadline = {deadline} }} }}\n"
        )
    };
    let said = |model: String| {
        let config = "[assume]\ncodel = \"30 ms\"\n[platform]\ncpus = 1\nrt_throttling = false\n";
        let folder = folder("late", &[("robot.mal", &model), ("mauve.toml", config)]);
        let fixed = check(&folder, &["--fix"]);
        assert_eq!(text(&folder, "robot.mal"), model);
        fixed.out.lines().take(2).map(|line| format!("{line}\n")).collect::<String>()
    };
    let missed = said(model("1", 40));
    let remedy =
        "nothing to fix\nD: `mauve tune` shows which priorities, CPUs and periods meet more deadlines\n";
    assert_eq!(missed, remedy);
    let met = said(model("3", 40));
    assert!(met.starts_with("nothing to fix\n") && !met.contains("tune"), "{met}");
}

#[test]
fn only_files_in_the_named_paths_are_written() {
    let part = "codel sense(): int\nshell S { }\ncore K(S): { update = { sense(); } }\n";
    let root = "include \"../other/part.mal\"\ncore L(S): { update = { } }\n";
    let folder = folder("named", &[(".git/HEAD", ""), ("robot/robot.mal", root), ("other/part.mal", part)]);
    let fixed = check(&folder, &["--fix", "robot"]);
    assert!(fixed.out.starts_with("1 fix applied in robot/robot.mal\n"), "{}", fixed.out);
    assert!(fixed.out.contains("header-colon") && text(&folder, "other/part.mal") == part, "{}", fixed.out);
    std::os::unix::fs::symlink("../other/part.mal", folder.join("robot/linked.mal")).unwrap();
    check(&folder, &["--fix", "robot"]);
    assert_eq!(text(&folder, "other/part.mal"), part, "a link leads out of the folder");
    let fixed = check(&folder, &["--fix", "."]);
    assert!(fixed.out.contains("other/part.mal"), "{}", fixed.out);
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder("read-only", &[("robot.mal", MISTAKES)]);
    fs::set_permissions(folder.join("robot.mal"), fs::Permissions::from_mode(0o444)).unwrap();
    if fs::OpenOptions::new().write(true).open(folder.join("robot.mal")).is_ok() {
        return; // Root may write everything.
    }
    let fixed = check(&folder, &["--fix"]);
    assert!(fixed.code == 2 && fixed.err.contains("`robot.mal` cannot be written"), "{fixed:?}");
    assert_eq!(text(&folder, "robot.mal"), MISTAKES);
}

#[test]
fn the_edits_of_a_fix_are_in_json() {
    let folder = folder("json", &[("robot.mal", "shell S { }\ncore K(S): { update = { } }\n")]);
    let found = check(&folder, &["--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    let diagnostics = document["diagnostics"].as_array().unwrap();
    let colon = diagnostics.iter().find(|it| it["code"] == "header-colon").unwrap();
    assert_eq!(colon["fixes"], serde_json::json!(["Remove the colon"]));
    let range =
        serde_json::json!({ "start": { "line": 2, "column": 10 }, "end": { "line": 2, "column": 11 } });
    let change = serde_json::json!({ "file": folder.canonicalize().unwrap().join("robot.mal"), "range": range, "text": "" });
    let edits = serde_json::json!([{ "title": "Remove the colon", "changes": [change] }]);
    assert_eq!(colon["edits"], edits);
    assert!(document.get("fixed").is_none());
    let fixed = check(&folder, &["--format", "json", "--fix"]);
    let document: Value = serde_json::from_str(&fixed.out).unwrap();
    assert_eq!(document["fixed"], 1);
}

#[test]
fn fixes_of_all_mistakes_add_no_error_and_a_second_run_changes_nothing() {
    // The errors, by their codes and messages.
    let errors = |folder: &Path| -> BTreeMap<String, usize> {
        let found = check(folder, &["--format", "json"]);
        let document: Value = serde_json::from_str(&found.out).unwrap();
        let all = document["diagnostics"].as_array().unwrap();
        let is_of_text = |it: &&Value| it["severity"] == "error" && it["code"] != "deadline-missed";
        let mut counts = BTreeMap::new();
        for it in all.iter().filter(is_of_text) {
            *counts.entry(format!("{} {}", it["code"], it["message"])).or_default() += 1;
        }
        counts
    };
    let mut applied = 0;
    let models = mauve_tests::models_of_pages();
    let mistakes = models.iter().filter(|(name, _)| name.starts_with("mistakes/")).enumerate();
    let searched: Vec<_> = mistakes.filter(|(number, _)| search::is_searched(*number)).collect();
    for (_, (name, model)) in &searched {
        let files = mauve_tests::fixture(model);
        let files: Vec<(&str, &str)> =
            files.iter().map(|(path, text)| (path.as_str(), text.as_str())).collect();
        let folder = folder("mistake", &files);
        let before = errors(&folder);
        let fixed = check(&folder, &["--fix"]);
        assert!(fixed.code < 2 && fixed.err.is_empty(), "{name}: {fixed:?}");
        let after = errors(&folder);
        let texts = mauve_tests::all_texts_in(&folder);
        let is_old = |(error, count): (&String, &usize)| before.get(error).is_some_and(|old| old >= count);
        assert!(after.iter().all(is_old), "{name}: {before:?}, then {after:?}: {texts:#?}");
        applied += u64::from(!fixed.out.starts_with("nothing to fix"));
        check(&folder, &["--fix"]);
        assert_eq!(mauve_tests::all_texts_in(&folder), texts, "{name}");
    }
    assert!(
        applied > search::share(100),
        "{applied} of {} mistakes are fixed without asking",
        searched.len()
    );
}

#[test]
fn no_fix_accepts_a_deadline_that_nobody_accepted() {
    let model = "codel f(): int\nshell S { }\ncore K(S) { update = { f(); } }\ncomponent P(S, K)\n\
                 architecture A { instance motor1: P }\n\
                 deployment D { architecture A  activity motor1 { priority = 1 period = 10 } }\n";
    let config = "assume.codel = \"20 ms\"\n[deployment.D]\naccept = { motor3 = \"measured by hand\" }\n";
    let folder = folder("accept", &[("robot.mal", model), ("mauve.toml", config)]);
    assert_eq!(check(&folder, &["--fix"]).code, 1);
    assert_eq!(text(&folder, "mauve.toml"), config);
}
