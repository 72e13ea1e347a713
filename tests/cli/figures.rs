//! A response time beside its deadline has one form in all that people read: `✓ 53 / 100 ms`. The forms that it had before are in no
//! output of a command and in no message. Slack is a figure in explanations and in `--sensitivity` only.

use std::path::Path;
use std::sync::LazyLock;

use mauve_tests::{mauve, models, scratch, sources, write};
use regex_automata::meta::Regex;

use crate::MAUVE;

/// Patterns of other forms, where `N` is a number or its place in a format.
const OTHERS: &[&str] = &[
    r"N( ms)?( of)? slack\b",
    r"\bslack( of)? N",
    r"\bR N",
    r"[+−]N ms",
    r"N( ms)? > N( ms)?",
    r"N ms late\b",
    r"✓ met *$",
    r"✗ (missed|late|not-analysed) *$",
];

static REGEXES: LazyLock<Vec<Regex>> = LazyLock::new(|| {
    let number = r"(?:\d[\d.]*|\{[^{}]*\})";
    OTHERS.iter().map(|it| Regex::new(&it.replace('N', number)).unwrap()).collect()
});

/// Returns the lines with another form.
fn found(text: &str) -> Vec<String> {
    let is_other = |line: &&str| REGEXES.iter().any(|other| other.is_match(*line));
    text.lines().filter(is_other).map(str::to_owned).collect()
}

const ROBOT: &str = "codel work(): int\nshell S { }\ncore K(S) { update = { work(); } }\ncomponent C(S, K)\n\
                     architecture A { instance front: C  instance back: C }\n\
                     deployment Sea {\n  architecture A\n  activity front { priority = 2 period = 10 deadline = 9 }\n  \
                     activity back { priority = 1 period = 10 deadline = 9 }\n}\n";

#[test]
fn no_command_prints_another_form() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "figures");
    let project = |name: &str, config: &str| {
        let config = format!("{config}platform.rt_throttling = false\n");
        write(&folder.join(name), &[("robot.mal", ROBOT), ("mauve.toml", config.as_str())]);
        folder.join(name)
    };
    let sample = models().join("p3dx");
    let met = project("met", "assume.codel = \"4 ms\"\n");
    let missed = project("missed", "assume.codel = \"5 ms\"\n");
    let overloaded = project("overloaded", "assume.codel = \"6 ms\"\n");
    let incomplete = project("incomplete", "");
    let mut wrong = Vec::new();
    let mut run = |at: &Path, arguments: &[&str]| {
        let run = mauve(MAUVE, at, arguments);
        assert!(run.code < 2, "{arguments:?}: {}", run.err);
        for line in found(&(run.out + &run.err).replace(", slack ", ", ")) {
            wrong.push(format!("mauve {}: {line}", arguments.join(" ")));
        }
    };
    for (project, instance) in [
        (&sample, "navigation"),
        (&met, "back"),
        (&missed, "back"),
        (&overloaded, "back"),
        (&incomplete, "back"),
    ] {
        run(project, &["check"]);
        run(project, &["check", "--format", "sarif"]);
        run(project, &["wcrt"]);
        run(project, &["wcrt", "--explain", instance]);
        run(project, &["wcrt", "--set", &format!("{instance}.priority=3")]);
        run(project, &["chains"]);
        run(project, &["simulate"]);
        run(project, &["simulate", "--format", "text"]);
    }
    run(&sample, &["wcrt", "--significance", "all"]);
    run(&missed, &["tune", "--priorities"]);
    run(&folder, &["diff", "met", "overloaded"]);
    run(&folder, &["diff", "met", "missed", "--format", "markdown"]);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_message_has_another_form() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut wrong = Vec::new();
    for folder in [
        "analysis/diagnostics/src",
        "analysis/ide/src",
        "server/cli/src",
        "server/lsp/src",
        "server/projects/src",
    ] {
        let files = mauve_tests::files_in(&root.join(folder));
        // Slack is a figure there.
        let has_slack = ["hover", "explanation", "sensitivity"];
        let is_read = |path: &&std::path::PathBuf| {
            let path = path.to_string_lossy();
            path.ends_with(".rs") && !has_slack.iter().any(|it| path.contains(it))
        };
        for path in files.iter().filter(is_read) {
            let text = std::fs::read_to_string(path).unwrap();
            for (line, literal) in sources::literals(sources::without_tests(&text)) {
                wrong
                    .extend(found(&literal).into_iter().map(|it| format!("{}:{line}: {it}", path.display())));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn other_forms_are_found() {
    for text in [
        "3 ms slack",
        "≤ 100 ms, 47 ms slack",
        "slack 47",
        "R 63 → 3",
        "+47 ms",
        "✗ −13 ms",
        "13 ms late",
        "63 > 50 ms",
        "response time 63 ms > 50 ms",
        "{} ms late",
        "{response} > {deadline} ms",
        "  997      3  ✓ met",
        "✗ missed",
    ] {
        assert_eq!(found(text), [text]);
    }
    for text in ["✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %", "✓ 53 → 47 / 100 ms", "✗ ≤ 526 / 500 ms", "✗ 1 late"]
    {
        assert_eq!(found(text), [] as [&str; 0]);
    }
}
