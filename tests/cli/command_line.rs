//! The command line: what each command prints, and how it ends.

use mauve_tests::{Run, mauve, models, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

fn run(arguments: &[&str]) -> Run {
    mauve(MAUVE, &models(), arguments)
}

/// In a folder of the test's own.
pub(crate) fn run_in(name: &str, files: &[(&str, &str)], arguments: &[&str]) -> Run {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    write(&folder, files);
    mauve(MAUVE, &folder, arguments)
}

const LATE: [(&str, &str); 2] = [
    (
        "robot.mal",
        "codel work(): int\nshell S { }\ncore K(S) { update = { work(); } }\ncomponent C(S, K)\n\
         architecture A { instance front: C  instance back: C }\n\
         deployment D {\n  architecture A\n  activity front { priority = 2 period = 10 deadline = 9 }\n  \
         activity back { priority = 1 period = 10 deadline = 9 }\n}\n",
    ),
    ("mauve.toml", "assume.codel = \"5 ms\"\n"),
];

#[test]
fn the_version_is_the_same_everywhere() {
    let version = run(&["--version"]);
    assert_eq!(version.out, format!("mauve {}\n", env!("CARGO_PKG_VERSION")));
    for arguments in [["lsp", "--version"], ["lsp", "-V"]] {
        let found = run(&arguments);
        assert_eq!((found.code, &found.out), (0, &version.out));
    }
}

#[test]
fn check_shows_the_sample_without_a_fault() {
    let found = run(&["check", "p3dx"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""), "{}", found.out);
    assert!(
        found.has("no errors, no warnings")
            && found.has(
                "; all 9 deadlines are proved, if the 35 execution times hold and no codel waits; at 1e-4, about 16 executions an \
                 hour may exceed their times; the limit of the chain holds\n"
            ),
        "{}",
        found.out
    );
    assert!(
        found.out.contains(
            "navigation   Navigation         1           2    1000   297  ! 997 / 1000 ms      ▰▰▰▰▰▱  99.7 %"
        ),
        "{}",
        found.out
    );
    // A part of the project means what it means in the project; several parts are one project.
    let part = run(&["check", "p3dx/components/switch.mal"]);
    assert_eq!((part.code, &part.out), (found.code, &found.out));
    let parts = run(&["check", "p3dx/components/switch.mal", "p3dx/exploration.mal"]);
    assert_eq!((parts.code, &parts.out), (found.code, &found.out));
}

#[test]
fn check_as_json_and_for_people_say_the_same() {
    let found = run_in("late", &LATE, &["check", "--format", "json"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""));
    let document: Value = serde_json::from_str(&found.out).unwrap();
    assert_eq!((&document["errors"], &document["warnings"]), (&1.into(), &0.into()));
    let diagnostic = &document["diagnostics"][0];
    assert_eq!(diagnostic["code"], "deadline-missed");
    assert_eq!(diagnostic["severity"], "error");
    assert_eq!(
        diagnostic["message"],
        "`back` misses its deadline: ✗ 10 / 9 ms; largest interference: `front`, 5 ms (1 job)"
    );
    assert!(diagnostic["file"].as_str().unwrap().ends_with("/robot.mal"));
    let place = |line: u64, column: u64| serde_json::json!({ "line": line, "column": column });
    assert_eq!(diagnostic["range"], serde_json::json!({ "start": place(9, 12), "end": place(9, 16) }));
    let analysed = &document["deployments"][0];
    assert_eq!(
        (&analysed["deployment"], &analysed["results"][0]["schedulable"]),
        (&"D".into(), &false.into())
    );
    let shown = run_in("late", &LATE, &["check"]);
    assert_eq!(shown.code, 1);
    assert!(
        shown.out.contains("error[deadline-missed]: `back` misses its deadline: ✗ 10 / 9 ms"),
        "{}",
        shown.out
    );
    assert!(shown.out.contains("robot.mal:9:12"), "{}", shown.out);
    assert!(shown.out.contains("1 error, no warnings; 1 of 2 deadlines is not proved\n"), "{}", shown.out);
    assert!(!shown.out.contains('\u{1b}'), "colours only on a terminal");
}

/// Everything that a finding may have: related places, fixes that are named and fixes that the message quotes.
const MANY: [(&str, &str); 2] = [
    (
        "a folder/rö:bot.mal",
        "codel work(): int\nshell S { output port p: int }\n\
         core K(S) {\n  var n: int = 0\n  /* 😀é */ update = { n = wrk(); if n > 0 then { write(p, n); } }\n}\n\
         component C(S, K)\narchitecture A { instance front: C  instance back: C }\n\
         deployment D {\n  architecture A\n  activity front { priority = 2 period = 10 deadline = 12 }\n  \
         activity back { priority = 2 period = 10 }\n}\n",
    ),
    ("a folder/mauve.toml", "assume.codel = \"1 ms\"\nplatform.rt_throttling = false\n"),
];

#[test]
fn people_see_related_places_and_every_fix_once() {
    let found = run_in("many", &MANY, &["check"]);
    for part in [
        "error[unresolved-codel]: no codel or operation `wrk`; did you mean `work`?\n",
        "hint[missing-else]: this `if` has no `else`\n",
        "help: Write `else { }`\n",
        "hint[deadline-exceeds-period]: ",
        "help: Set the deadline to the period\n",
        "warning[equal-priorities]: ",
        "- the priority of `front`\n",
        "1 error, 1 warning, 2 hints; ",
    ] {
        assert!(found.out.contains(part), "{part} in {}", found.out);
    }
    assert!(!found.out.contains("Change to"), "the message says it: {}", found.out);
}

#[test]
fn a_related_place_in_another_file_has_its_path() {
    let files = [
        (
            "a.mal",
            "include \"b.mal\"\narchitecture A { instance p: P }\ndeployment D { architecture A  activity p { priority = 1 period = 10 } }\n",
        ),
        (
            "b.mal",
            "codel g(): int\ncodel f(): int\nshell S { }\ncore C(S) { update = { f(); g(); } }\ncomponent P(S, C)\n",
        ),
        ("mauve.toml", "timing.tables = [\"t.toml\"]\n"),
        ("t.toml", "codel.g = 1\n"),
    ];
    let found = run_in("two_files", &files, &["check"]);
    assert!(found.out.contains(" --> b.mal:2:7\n") && found.out.contains(" --> a.mal:3:"), "{}", found.out);
}

#[test]
fn what_is_denied_is_an_error() {
    let files = [("a.mal", "shell S { }\ncore K(S) { update = { if true then { } } }\n")];
    let plain = run_in("deny", &files, &["check"]);
    assert_eq!(plain.code, 0, "{}", plain.out);
    for denied in ["missing-else", "lost-write,missing-else"] {
        let found = run_in("deny", &files, &["check", "--deny", denied]);
        assert_eq!(found.code, 1);
        assert!(
            found.out.contains("error[missing-else]: ") && found.out.contains("1 error, "),
            "{}",
            found.out
        );
    }
    let found = run_in("deny", &files, &["check", "--deny", "warnings"]);
    assert_eq!((found.code, &found.out), (0, &plain.out), "a hint is no warning");
    // What mauve.toml says comes first: `warn` makes a warning of a hint, and nothing brings back what it allows.
    let lints = |severity| [files[0], ("mauve.toml", severity)];
    let warned = lints("lints.missing-else = \"warn\"\n");
    let found = run_in("deny-warned", &warned, &["check", "--deny", "warnings", "--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    let counts = ["errors", "warnings", "hints"].map(|count| document[count].as_u64().unwrap());
    assert_eq!((found.code, counts[..2].to_vec()), (1, vec![1, 0]), "{}", found.out);
    let allowed = lints("lints.missing-else = \"allow\"\n");
    let found = run_in("deny-allowed", &allowed, &["check", "--deny", "missing-else", "--deny", "warnings"]);
    assert_eq!(found.code, 0, "{}", found.out);
}

/// The schema of SARIF requires addresses as in RFC 3986.
#[test]
fn addresses_in_sarif_have_no_signs_that_an_address_may_not_have() {
    let name = "[a] ^b|c/d\\{e}`%41é:.mal";
    let found = run_in("sarif-signs", &[(name, "codel f(): int\n")], &["check", "--format", "sarif"]);
    let log: Value = serde_json::from_str(&found.out).unwrap();
    let at = &log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"];
    let uri = "%5Ba%5D%20%5Eb%7Cc/d%5C%7Be%7D%60%2541%C3%A9%3A.mal";
    assert_eq!(at, &serde_json::json!({ "uri": uri, "uriBaseId": "%SRCROOT%" }));
}

#[test]
fn sarif_has_what_the_standard_asks_for() {
    let found = run_in("sarif", &MANY, &["check", "--format", "sarif", "--deny", "equal-priorities"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""));
    let log: Value = serde_json::from_str(&found.out).unwrap();
    let run = &log["runs"][0];
    assert_eq!((&log["version"], &run["tool"]["driver"]["name"]), (&"2.1.0".into(), &"mauve".into()));
    let root = run["originalUriBaseIds"]["%SRCROOT%"]["uri"].as_str().unwrap();
    assert!(root.starts_with("file:///") && root.ends_with("-sarif/"), "{root}");
    let rules = run["tool"]["driver"]["rules"].as_array().unwrap();
    let results = run["results"].as_array().unwrap();
    for result in results {
        let rule = &rules[result["ruleIndex"].as_u64().unwrap() as usize];
        assert_eq!(rule["id"], result["ruleId"]);
        assert!(["error", "warning", "note"].contains(&result["level"].as_str().unwrap()));
        let uri = &result["locations"][0]["physicalLocation"]["artifactLocation"];
        let expected = serde_json::json!({ "uri": "a%20folder/r%C3%B6%3Abot.mal", "uriBaseId": "%SRCROOT%" });
        assert_eq!(uri, &expected);
    }
    let result = |code: &str| results.iter().find(|it| it["ruleId"] == code).unwrap();
    let denied = result("equal-priorities");
    assert_eq!(denied["level"], "error");
    assert_eq!(
        rules[denied["ruleIndex"].as_u64().unwrap() as usize]["defaultConfiguration"]["level"],
        "warning"
    );
    assert!(!denied["relatedLocations"][0]["message"]["text"].as_str().unwrap().is_empty());
    // Behind `/* 😀é */`, which is ten columns of UTF-16 and nine characters.
    let typo = result("unresolved-codel");
    let region = serde_json::json!({ "startLine": 5, "startColumn": 28, "endLine": 5, "endColumn": 31 });
    assert_eq!(run["columnKind"], "utf16CodeUnits");
    assert_eq!(typo["locations"][0]["physicalLocation"]["region"], region);
    let replacement = &typo["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(
        (&replacement["deletedRegion"], &replacement["insertedContent"]["text"]),
        (&region, &"work".into())
    );
    // An insertion replaces nothing; braces are doubled in messages only.
    let inserted = &result("missing-else")["fixes"][0];
    assert_eq!(inserted["description"]["text"], "Write `else {{ }}`");
    let replacement = &inserted["artifactChanges"][0]["replacements"][0];
    assert_eq!(replacement["insertedContent"]["text"], " else { }");
    assert_eq!(replacement["deletedRegion"]["startColumn"], replacement["deletedRegion"]["endColumn"]);
}

#[test]
fn columns_count_characters() {
    let files = [("a.mal", "/* é */ codel f(: int\n")];
    let found = run_in("columns", &files, &["check", "--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    assert_eq!(document["diagnostics"][0]["range"]["start"]["column"], 17);
}

#[test]
fn check_and_wcrt_exit_with_1_unless_every_deadline_is_proved() {
    assert_eq!(run(&["wcrt", "p3dx"]).code, 0);
    assert_eq!(run(&["wcrt", "p3dx", "--significance", "1e-5"]).code, 1);
    assert_eq!(run_in("late", &LATE, &["wcrt"]).code, 1);
    // Not analysed is not proved, and a model with errors says so.
    let untimed = [("robot.mal", LATE[0].1)];
    assert_eq!(run_in("untimed", &untimed, &["wcrt"]).code, 1);
    let checked = run_in("untimed", &untimed, &["check"]);
    assert!(checked.out.contains("no errors, 1 warning; 2 of 2 deadlines are not proved"), "{}", checked.out);
    assert_eq!(checked.code, 1);
    // Without a deployment there is nothing to prove.
    let library = [("shells.mal", "shell S { }\n")];
    assert_eq!(run_in("library", &library, &["check"]).code, 0);
    assert_eq!(run_in("library", &library, &["wcrt"]).code, 2);
    let broken = [
        ("robot.mal", LATE[0].1),
        ("mauve.toml", "assume.codel = \"1 ms\"\n"),
        ("b.mal", "include \"robot.mal\"\ncodel g("),
    ];
    let found = run_in("broken", &broken, &["wcrt"]);
    assert_eq!(found.code, 1);
    assert!(found.err.contains("the project has 1 error"), "{}", found.err);
    // Why there is no deployment may be one.
    let rootless = [("robot.mal", LATE[0].1), ("mauve.toml", "[project]\nroot = \"robt.mal\"\n")];
    let found = run_in("rootless", &rootless, &["wcrt"]);
    assert_eq!(found.code, 2);
    assert!(
        found.err.contains("nothing to analyse; the project has 1 error (`mauve check` shows it)"),
        "{}",
        found.err
    );
}

/// A core with an error, which nothing deploys.
const UNUSED: &str = "core Spare(S) { update = { work(1); } }\n";

#[test]
fn nothing_is_proved_while_there_is_an_error() {
    let robot =
        |text: &str| [("robot.mal", text.to_owned()), ("mauve.toml", "assume.codel = \"1 ms\"\n".to_owned())];
    let run = |name: &str, text: &str, arguments: &[&str]| {
        let files = robot(text);
        let files: Vec<(&str, &str)> = files.iter().map(|(path, text)| (*path, text.as_str())).collect();
        run_in(name, &files, arguments)
    };
    let fine = run("proved", LATE[0].1, &["check"]);
    assert!(
        fine.out.contains("; all 2 deadlines are proved, if the execution time holds and no codel waits"),
        "{}",
        fine.out
    );
    // Some figures rest on nothing that is wrong: they are met.
    let text = format!("{}{UNUSED}", LATE[0].1);
    let found = run("unproved", &text, &["check"]);
    assert!(
        found.out.contains("; 2 of 2 deadlines are met, but none is proved: fix the errors first\n"),
        "{}",
        found.out
    );
    assert_eq!((found.out.matches("  ✓ ").count(), found.code), (2, 1));
    let found = run("unproved", &text, &["wcrt"]);
    let said = "mauve: the project has 1 error (`mauve check` shows it)\n";
    assert_eq!((found.err.as_str(), found.code), (said, 1));
    assert!(found.out.contains("\n  not proved: the project has 1 error\n"), "{}", found.out);
    let document = run("unproved", &text, &["wcrt", "--format", "json"]);
    let document: Value = serde_json::from_str(&document.out).unwrap();
    assert_eq!((&document["errors"], &document["results"][0]["schedulable"]), (&1.into(), &false.into()));
    let csv = run("unproved", &text, &["wcrt", "--format", "csv"]);
    let remark = ",not proved: the project has errors";
    assert_eq!(csv.out.lines().filter(|line| line.ends_with(remark)).count(), 2, "{}", csv.out);
    // Nor is anything where mauve.toml lowers the error, or hides it.
    for (severity, counted) in [
        ("warn", "no errors, 1 warning, 1 hint ([lints] lowers 1 error)"),
        ("allow", "no errors, no warnings, 1 hint ([lints] hides 1 error)"),
    ] {
        let config = format!("assume.codel = \"1 ms\"\nlints.argument-count = \"{severity}\"\n");
        let files = [("robot.mal", text.as_str()), ("mauve.toml", config.as_str())];
        let found = run_in("lowered", &files, &["check"]);
        let end = format!("{counted}; 2 of 2 deadlines are met, but none is proved: fix the errors first\n");
        assert!(found.has(&end), "{}", found.out);
        assert_eq!(found.code, 1);
        assert_eq!(run_in("lowered", &files, &["wcrt"]).code, 1);
    }
    // Others do.
    let found = run("refused", &LATE[0].1.replacen("work();", "work(1);", 1), &["check"]);
    assert!(
        found.out.contains("deadlines are not proved") && !found.out.contains("are proved"),
        "{}",
        found.out
    );
}

/// What stands in a folder is read, or said not to be.
#[test]
fn nothing_that_stands_in_a_folder_is_passed_over() {
    let text = LATE[0].1;
    // A comment of another language is no other language.
    let found =
        run_in("foreign", &[("robot.mal", &*format!("# TODO: shorten\n{text}")), LATE[1]], &["check"]);
    assert!(
        found.out.contains("syntax-error") && found.out.contains("2 of 2 deadlines are not proved"),
        "{}",
        found.out
    );
    assert_eq!(found.code, 1);
    // A configuration that leads nowhere is not that of the folder above.
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), "passed-over");
    let check = |folder: &str| mauve(MAUVE, &top.join(folder), &["check"]);
    let link = |target: &str, link: &str| std::os::unix::fs::symlink(target, top.join(link)).unwrap();
    let short = "assume.codel = \"1 ms\"\n";
    write(&top, &[("mauve.toml", short), ("in/robot.mal", text)]);
    assert!(check("in").out.contains("all 2 deadlines are proved"), "{}", check("in").out);
    link("/nowhere/mauve.toml", "in/mauve.toml");
    let found = check("in");
    assert!(
        found.out.contains("cannot be read") && found.out.contains("2 of 2 deadlines are not proved"),
        "{}",
        found.out
    );
    assert_eq!(found.code, 1);
    // A model that stands elsewhere is analysed by its link, and one that stands nowhere is an error.
    write(&top, &[("linked/mauve.toml", LATE[1].1), (".git/HEAD", "")]);
    link("../in/robot.mal", "linked/robot.mal");
    assert!(check("linked").out.contains("deadline-missed"), "{}", check("linked").out);
    link("/nowhere/robot.mal", "linked/other.mal");
    assert!(check("linked").out.contains("unreadable-file"), "{}", check("linked").out);
}

#[test]
fn a_reason_is_said_once_and_where_it_stands() {
    let text = LATE[0].1.replacen("work();", "work(1);", 1);
    let files = [("robot.mal", text.as_str()), ("mauve.toml", "assume.codel = \"1 ms\"\n")];
    let table = run_in("reasons", &files, &["wcrt", "--significance", "1e-3,1e-4"]);
    let reason = "`work` takes no arguments, found 1 (robot.mal:";
    assert_eq!(table.out.matches(reason).count(), 2, "{}", table.out);
    let csv = run_in("reasons", &files, &["wcrt", "--format", "csv"]);
    let remark = "\"`work` takes no arguments, found 1; not proved: the project has errors\"";
    assert!(csv.out.contains(remark), "{}", csv.out);
    // What nothing at all is analysed for is no reason of each.
    let files =
        [("robot.mal", LATE[0].1), ("mauve.toml", "timing.tables = [\"t.toml\"]\n"), ("t.toml", "[codel\n")];
    let table = run_in("reasons", &files, &["wcrt"]);
    assert_eq!(table.out.matches("t.toml: not TOML").count(), 1, "{}", table.out);
    assert!(table.out.contains("\n  nothing is analysed: t.toml: "), "{}", table.out);
}

#[test]
fn wcrt_as_csv_and_explained() {
    let found = run(&["wcrt", "p3dx", "--format", "csv"]);
    assert_eq!(found.out.lines().count(), 11);
    assert!(
        found.out.contains("P3dxDeployment,1e-4,exact,navigation,Navigation,1,2,1000,1000,297,997,997,met,,p3dx/exploration.mal,,\n"),
        "{}",
        found.out
    );
    let explained = run(&["wcrt", "p3dx", "--explain", "navigation"]);
    for part in [
        "costliest period: 297 ms",
        "navigation.astar 293 ms",
        "hokuyo                9  10 × 43 ms  430 ms  ",
    ] {
        assert!(explained.out.contains(part), "{part} in {}", explained.out);
    }
    let missed = run_in("late", &LATE, &["wcrt", "--explain", "back"]);
    assert!(
        missed.out.contains(
            "- fixed-point iteration 2 exceeds the deadline, 9 ms after the start of the busy window: 5 ms → 10 ms\n"
        ),
        "{}",
        missed.out
    );
    // The fifth job is the latest (Lehoczky 1990): its deadline is 500 ms after the window began.
    let late = [
        (
            "robot.mal",
            "codel f(): int\ncodel g(): int\nshell S { }\ncore K(S) { update = { f(); } }\n\
             core L(S) { update = { g(); } }\ncomponent C(S, K)\ncomponent E(S, L)\n\
             architecture A { instance a: C  instance b: E }\ndeployment D { architecture A\n\
             activity a { priority = 2 period = 70 }\nactivity b { priority = 1 period = 100 } }\n",
        ),
        ("mauve.toml", "timing.tables = [\"t.toml\"]\n"),
        ("t.toml", "[codel]\nf = 26\ng = 62\n"),
    ];
    let explained = run_in("late-job", &late, &["wcrt", "--explain", "b"]);
    for part in [
        "b: ✗ 118 / 100 ms ▰▰▰▰▰▰ 118 %, missed by 18 ms at 1e-4\n",
        "- component E, period 100 ms, deadline 100 ms, method exact\n",
        "job 5 of the busy window has the largest response time: it ends 518 ms after",
        "iteration 4 exceeds the deadline, 500 ms after the start of the busy window: 310 ms → 440 ms → 492 ms → 518 ms\n",
    ] {
        assert!(explained.has(part), "{part} in {}", explained.out);
    }
    let checked = run_in("late-job", &late, &["check"]);
    let message = "`b` misses its deadline: ✗ 118 / 100 ms; largest interference: `a`, 208 ms (8 jobs) in the busy window of 518 ms, 5 jobs of `b`";
    assert!(checked.out.contains(message), "{}", checked.out);
}

#[test]
fn what_is_assumed_is_shown_wherever_it_is_used() {
    for (arguments, shown) in [
        (&["check"][..], "  front and back: assumed 5 ms for work\n"),
        (&["wcrt", "--explain", "front"], "- update 5 ms: work 5 ms (assumed)\n"),
        (&["wcrt", "--format", "json"], "\"codel\": \"work\""),
        (&["wcrt", "--format", "csv"], "met,work,"),
        (&["psm", "C"], "some of them assumed"),
    ] {
        let found = run_in("late", &LATE, arguments);
        assert!(found.out.contains(shown), "{arguments:?}: {}", found.out);
    }
}

#[test]
fn levels_that_a_table_lacks_are_named() {
    let files = [
        LATE[0],
        ("mauve.toml", "timing.tables = [\"*.toml\"]\n"),
        ("a.toml", "levels = [1e-3, 1e-4]\n[codel]\nwork = [1, 2]\n"),
        ("b.toml", "levels = [1e-3]\n[program]\n\"C/update\" = [3]\n"),
    ];
    let found = run_in("levels", &files, &["wcrt", "--significance", "all"]);
    assert_eq!(found.err, "mauve: 1e-4 is left out: b.toml does not have it\n");
    assert!(found.out.contains("D: response times in ms at 1e-3,"), "{}", found.out);
}

#[test]
#[cfg(target_os = "linux")]
fn a_result_that_cannot_be_written_is_no_success() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut command = std::process::Command::new(MAUVE);
    let output = command.args(["wcrt", "p3dx"]).current_dir(models()).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("cannot write the result"), "{message}");
}

#[test]
fn what_does_not_exist_is_said_and_exits_with_2() {
    for (arguments, message) in [
        (&["check", "nothing.mal"][..], "cannot read `nothing.mal`"),
        (
            &["wcrt", "p3dx", "--deployment", "P3dx"],
            "no deployment `P3dx`: there is exploration.P3dxDeployment",
        ),
        (&["wcrt", "p3dx", "--explain", "navigaton"], "no instance `navigaton`; did you mean `navigation`?"),
        (&["wcrt", "p3dx", "--significance", "2"], "`2` is not a significance level"),
        (&["simulate", "p3dx", "--for", "0ms"], "expected a time greater than 0"),
        (&["simulate", "p3dx", "--for", "12"], "expected a time such as 10s"),
        (&["wcrt", "p3dx", "--method", "fastest"], "invalid value 'fastest'"),
        (&["psm", "p3dx", "Navigaton"], "no component `Navigaton`; did you mean `Navigation`?"),
        (
            &["check", "p3dx", "--deny", "deadline-mised"],
            "no diagnostic `deadline-mised`; did you mean `deadline-missed`?",
        ),
        (&["check", "p3dx", "--deny", "errors"], "no diagnostic `errors`"),
        (&["schema", "toml"], "invalid value 'toml'"),
        (&["explain", "deadline-mised"], "no diagnostic `deadline-mised`; did you mean `deadline-missed`?"),
        (&["parse", "nothing.mal"], "cannot be read"),
        (&["wcrt", "p3dx", "--explain", "hokuyo", "--format", "json"], "cannot be used with"),
        (&["frobnicate"], "unrecognized subcommand"),
    ] {
        let found = run(arguments);
        assert_eq!(found.code, 2, "{arguments:?}: {}{}", found.out, found.err);
        assert!(found.err.contains(message), "{arguments:?}: {}", found.err);
        assert_eq!(found.out, "", "{arguments:?}");
    }
    let empty = run_in("empty", &[("notes.txt", "")], &["check"]);
    assert_eq!(empty.code, 2);
    assert!(empty.err.contains("no model (*.mal)"), "{}", empty.err);
    let above = run_in("above", &[("mauve.toml", ""), ("notes/notes.txt", "")], &["check", "notes"]);
    assert!(above.code == 2 && above.err.contains("; mauve.toml is in `"), "{}", above.err);
}

#[test]
fn psm_in_all_forms() {
    let json: Value =
        serde_json::from_str(&run(&["psm", "p3dx", "Navigation", "--format", "json"]).out).unwrap();
    let planning: Vec<&Value> =
        json["edges"].as_array().unwrap().iter().filter(|edge| edge["source"] == "Planning").collect();
    // It plans again only without a path, which is then neither simplified nor followed.
    let times: Vec<f64> = planning.iter().map(|edge| edge["time"].as_f64().unwrap()).collect();
    assert_eq!(times, [297.0, 297.0, 294.1, 294.1], "{planning:?}");
    let others = json["edges"].as_array().unwrap().iter().filter(|edge| edge["source"] != "Planning");
    assert!(others.into_iter().all(|edge| edge["time"].as_f64().unwrap() < 3.0));
    assert!(run(&["psm", "p3dx", "Navigation"]).out.starts_with("digraph \"Navigation\" {\n"));
    assert!(run(&["psm", "p3dx", "Navigation", "--format", "svg"]).out.starts_with("<svg "));
    assert!(run(&["psm", "p3dx", "Navigation", "--format", "text"]).out.contains("│ > Waiting ├"));
}

#[test]
fn parse_shows_the_tree_and_loses_nothing() {
    let files = [("a.mal", "codel f(): int // the end\n")];
    let found = run_in("parse", &files, &["parse", "a.mal"]);
    assert_eq!(found.code, 0);
    assert!(
        found.out.starts_with("SOURCE_FILE@0..26\n  CODEL@0..14\n    CODEL_KW@0..5 \"codel\"\n"),
        "{}",
        found.out
    );
    assert!(found.out.contains("COMMENT@15..25 \"// the end\""), "{}", found.out);
    assert_eq!(run_in("parse", &[("a.mal", "codel f(")], &["parse", "a.mal"]).code, 1);
}

#[test]
fn a_new_project_shows_response_times_at_once() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "new");
    let made = mauve(MAUVE, &folder, &["new", "robot"]);
    assert_eq!(made.code, 0, "{}", made.err);
    let checked = mauve(MAUVE, &folder, &["check", "robot"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert!(
        checked.out.contains("no errors, no warnings") && checked.out.matches("  ✓ ").count() == 2,
        "{}",
        checked.out
    );
    let again = mauve(MAUVE, &folder, &["new", "robot"]);
    assert_eq!(again.code, 2);
    assert!(again.err.contains("is not empty: nothing was written"), "{}", again.err);
}

#[test]
fn pages_completions_and_measurements() {
    assert!(run(&["explain", "missing-time"]).out.starts_with("# missing-time\n"));
    assert!(run(&["explain", "all"]).out.lines().count() > 30);
    for shell in ["bash", "zsh", "fish"] {
        assert!(run(&["completions", shell]).out.contains("wcrt"), "{shell}");
    }
    for (of, title) in [
        ("mauve.toml", "mauve.toml"),
        ("table", "A timing table"),
        ("task-set", "A task set or a state machine of MAUVE"),
    ] {
        let schema: Value = serde_json::from_str(&run(&["schema", of]).out).unwrap();
        assert_eq!(schema["title"], title);
    }
    let stats = run(&["analysis-stats", "p3dx"]);
    for part in ["parse", "names", "behaviours", "types", "response times", "checks", "memory"] {
        assert!(stats.out.lines().any(|line| line.starts_with(part)), "{part} in {}", stats.out);
    }
}

/// What `cyclictest` and `rtla` measured can be pasted: the entries are valid, and delay the activities.
#[test]
fn a_computer_is_checked_and_its_measurements_are_read() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "platform");
    let noise = "    Operating System Noise\nduration: 0 00:01:00 | time is in us\nCPU Period Runtime Noise\n  0 #60 60000000 1031 99.99802 1000 60 0 0 5 0 1\n";
    write(
        &folder,
        &[
            ("noise.txt", noise),
            ("latency.txt", "# Total: 000100000\n# Max Latencies: 00500\n"),
            ("other.txt", "hello\n"),
            ("kernel/proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
            ("kernel/proc/sys/kernel/sched_rt_period_us", "1000000\n"),
        ],
    );
    let run = |arguments: &[&str]| mauve(MAUVE, &folder, arguments);
    let found = run(&["platform", "import", "noise.txt", "latency.txt"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    let (platform, table) = found.out.split_once("# For a timing table with unit = \"ms\"").unwrap();
    let model = "codel f(): int  shell S { }  core K(S) { update = { f(); } }  component C(S, K)
        architecture A { instance a: C }  deployment D { architecture A  activity a { priority = 1  period = 10  affinity = 1 } }";
    let config = format!("[timing]\ntables = [\"t.toml\"]\n[platform]\ncpus = 1\n{platform}");
    let table = format!("codel.f = 2\n#{table}");
    write(&folder, &[("robot/a.mal", model), ("robot/mauve.toml", &config), ("robot/t.toml", &table)]);
    let wcrt = run(&["wcrt", "robot", "--format", "json"]);
    let document: Value = serde_json::from_str(&wcrt.out).unwrap();
    // 2 ms, 0.5 ms until it begins, and the noise of two samples.
    assert_eq!(document["results"][0]["activities"][0]["response"], 4.5, "{}{}", wcrt.out, wcrt.err);

    let refused = run(&["platform", "import", "noise.txt", "other.txt"]);
    assert!(
        refused.code == 2 && refused.err.contains("cannot read `other.txt`: it is none of"),
        "{}",
        refused.err
    );

    let checked = run(&["platform", "check", "--root", "kernel"]);
    assert_eq!(checked.code, 1);
    let line = checked.out.lines().find(|line| line.starts_with("bad")).unwrap();
    assert!(
        line.contains("throttling   real-time threads get 950 ms of each 1000 ms: run `sysctl"),
        "{line}"
    );
    let json = run(&["platform", "check", "--root", "kernel", "--format", "json"]);
    let document: Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(document["checks"][1]["state"], "bad");
}

#[test]
fn workspaces_roots_and_model_paths() {
    // Two configurations below the folder are two workspaces; a library elsewhere is found along MAUVE_MODELS.
    let library = "library shared { codel f(): int  shell S { }  core K(S) { update = { f(); } }  component C(S, K) }\n";
    let robot = "include \"shared.mal\"\narchitecture A { instance a: shared.C }\ndeployment D { architecture A  activity a { priority = 1 period = 10 } }\n";
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "workspaces");
    let assume = "assume.codel = \"2 ms\"\n";
    write(
        &folder,
        &[
            ("lib/shared.mal", library),
            ("one/robot.mal", robot),
            ("one/mauve.toml", assume),
            ("two/robot.mal", robot),
            ("two/mauve.toml", "assume.codel = \"3 ms\"\n"),
            ("two/build/made.mal", "this is no model"),
            ("two/.gitignore", "scratch/\n"),
            ("two/scratch/a.mal", "nor is this"),
        ],
    );
    let output = std::process::Command::new(MAUVE)
        .args(["wcrt", "one", "two", "--format", "csv"])
        .env("MAUVE_MODELS", format!(":{}:/nothing", folder.join("lib").display()))
        .current_dir(&folder)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}{}", String::from_utf8_lossy(&output.stderr));
    for row in ["2,2,2,met,shared.f,one/robot.mal", "3,3,3,met,shared.f,two/robot.mal"] {
        assert!(text.contains(row), "{text}");
    }
    let without = mauve(MAUVE, &folder, &["check", "one"]);
    assert_eq!(without.code, 1);
    assert!(without.out.contains("unresolved-include"), "{}", without.out);
}

#[test]
fn fmt_writes_what_changes_and_says_so() {
    let (untidy, tidy) = ("shell S{input port a:int}", "shell S { input port a: int }\n");
    let files = [
        ("robot/a.mal", untidy),
        ("robot/b.mal", tidy),
        ("robot/deep/c.mal", "include \"../../elsewhere.mal\"\nuse  a\r\n"),
        ("robot/foreign.mal", "#id:  \"org.example\"\ncategory  System { }\n"),
        ("robot/mauve.toml", "project.root = \"a.mal\"\n"),
        ("robot/build/made.mal", untidy),
        ("elsewhere.mal", untidy),
    ];
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "fmt");
    write(&folder, &files);
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap();
    let run = |arguments: &[&str]| mauve(MAUVE, &folder, arguments);

    let checked = run(&["fmt", "--check", "robot"]);
    let expected = "robot/a.mal:1\n  - shell S{input port a:int}\n  + shell S { input port a: int }\n\
                    robot/deep/c.mal:2\n  - use  a\n  + use a\n2 files to be formatted, 1 unchanged\n";
    assert_eq!((checked.code, checked.out.as_str(), checked.err.as_str()), (1, expected, ""));
    assert_eq!(read("robot/a.mal"), untidy);

    let done = run(&["fmt", "robot/mauve.toml"]);
    let expected = "robot/a.mal\nrobot/deep/c.mal\n2 files formatted, 1 unchanged\n";
    assert_eq!((done.code, done.out.as_str(), done.err.as_str()), (0, expected, ""));
    assert_eq!(read("robot/a.mal"), tidy);
    assert_eq!(read("robot/deep/c.mal"), "include \"../../elsewhere.mal\"\nuse a\n");
    for (path, text) in &files[3..] {
        assert_eq!(read(path), *text, "{path}");
    }
    let names = std::fs::read_dir(folder.join("robot")).unwrap().count();
    assert_eq!(names, 6, "nothing is left beside the files");

    let again = run(&["fmt", "robot", "robot/a.mal"]);
    assert_eq!((again.code, again.out.as_str()), (0, "no files formatted, 3 unchanged\n"));
    assert_eq!(run(&["fmt", "--check", "robot"]).code, 0);
}

#[test]
fn fmt_leaves_alone_what_it_cannot_read_or_write() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "fmt-problems");
    write(&folder, &[("a.mal", "use  a"), ("broken.mal", "shell  S {\n  input  port\n}\nuse  b\n")]);
    let binary = b"use  a\n\xff\xfe";
    std::fs::write(folder.join("binary.mal"), binary).unwrap();
    let run = |arguments: &[&str]| mauve(MAUVE, &folder, arguments);
    let found = run(&["fmt"]);
    assert_eq!(
        (found.code, found.out.as_str()),
        (2, "a.mal\nbroken.mal\n2 files formatted, 0 unchanged, 1 with syntax errors\n")
    );
    assert!(found.err.contains("`binary.mal`: this file is not UTF-8 text from byte 7 on"), "{}", found.err);
    assert!(found.err.contains("`broken.mal` has 1 syntax error: the text around"), "{}", found.err);
    assert_eq!(std::fs::read(folder.join("binary.mal")).unwrap(), binary);
    let broken = std::fs::read_to_string(folder.join("broken.mal")).unwrap();
    assert_eq!(broken, "shell S {\n  input port\n}\nuse b\n");
    for (arguments, message) in [
        (&["fmt", "nowhere"][..], "cannot read `nowhere`"),
        (&["fmt", "-", "a.mal"], "`-` is standard input, and cannot be combined with other paths"),
    ] {
        let found = run(arguments);
        assert_eq!((found.code, found.out.as_str()), (2, ""));
        assert!(found.err.contains(message), "{}", found.err);
    }
}

#[test]
fn fmt_says_what_it_cannot_format() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "fmt-errors");
    let run = |arguments: &[&str]| mauve(MAUVE, &folder, arguments);
    write(&folder, &[("a b.mal", "codel f(: int\n"), ("good.mal", "codel f(): int\n")]);
    let said = "`a b.mal` has 1 syntax error: the text around them cannot be formatted\nhelp: `mauve check 'a b.mal'` shows them";
    let found = run(&["fmt", "--check"]);
    assert!(found.code == 1 && found.err.contains(said), "{found:?}");
    assert_eq!(found.out, "no files to be formatted, 1 unchanged, 1 with syntax errors\n");
    // Without `--check`, the rest is formatted.
    let found = run(&["fmt"]);
    assert!(found.code == 0 && found.err.contains("the text around them is not changed"), "{found:?}");
    assert_eq!(run(&["fmt", "--check", "good.mal"]).code, 0);
}

#[test]
fn fmt_keeps_permissions_and_links() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "fmt-links");
    write(&folder, &[("robot/a.mal", "use  a"), ("outside.mal", "use  b"), ("named.mal", "use  c")]);
    std::fs::set_permissions(folder.join("robot/a.mal"), PermissionsExt::from_mode(0o640)).unwrap();
    symlink(folder.join("outside.mal"), folder.join("robot/link.mal")).unwrap();
    symlink(folder.join("named.mal"), folder.join("by_name.mal")).unwrap();
    let found = mauve(MAUVE, &folder, &["fmt", "robot", "by_name.mal"]);
    assert_eq!(
        (found.code, found.out.as_str()),
        (0, "named.mal\nrobot/a.mal\n2 files formatted, 0 unchanged\n")
    );
    let data = std::fs::metadata(folder.join("robot/a.mal")).unwrap();
    assert_eq!(data.permissions().mode() & 0o777, 0o640);
    assert!(folder.join("by_name.mal").is_symlink() && folder.join("robot/link.mal").is_symlink());
    assert_eq!(std::fs::read_to_string(folder.join("outside.mal")).unwrap(), "use  b");
    assert_eq!(std::fs::read_to_string(folder.join("named.mal")).unwrap(), "use c\n");
}

#[test]
fn fmt_of_standard_input() {
    use std::io::Write as _;
    use std::process::{Command, Stdio};
    let run = |arguments: &[&str], text: &[u8]| {
        let mut process = Command::new(MAUVE)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        process.stdin.take().unwrap().write_all(text).unwrap();
        let output = process.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    assert_eq!(
        run(&["fmt", "-"], b"use  a // \x1b[1mbold"),
        (Some(0), "use a // \u{1b}[1mbold\n".to_owned())
    );
    let expected = "standard input:1\n  - use  a\n  + use a\n".to_owned();
    assert_eq!(run(&["fmt", "-", "--check"], b"use  a"), (Some(1), expected));
    assert_eq!(run(&["fmt", "-", "--check"], b"use a\n"), (Some(0), String::new()));
    assert_eq!(run(&["fmt", "-"], b"\xff"), (Some(2), String::new()));
}

#[test]
fn the_sample_and_new_projects_are_formatted() {
    let found = run(&["fmt", "--check"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""), "{}", found.out);
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "fmt-new");
    let made = mauve(MAUVE, &folder, &["new", "robot"]);
    assert_eq!(made.code, 0);
    let found = mauve(MAUVE, &folder, &["fmt", "--check", "robot"]);
    assert_eq!((found.code, found.out.as_str()), (0, "no files to be formatted, 1 unchanged\n"));
}
