//! What `mauve check` accepts in CI: `[deployment.NAME] accept`, comments that suppress a diagnostic, and `[lints]`. None of
//! them changes a figure or a proof.

use mauve_tests::{Run, mauve, scratch, test_name, write};
use serde_json::{Value, json};

use crate::MAUVE;

const ROBOT: &str = "codel work(): int\nshell S { }\ncore K(S) { update = { work(); } }\ncomponent C(S, K)\n\
                     architecture A { instance front: C  instance back: C }\n\
                     deployment Sea {\n  architecture A\n  activity front { priority = 2 period = 10 deadline = 9 }\n  \
                     activity back { priority = 1 period = 10 deadline = 9 }\n}\n";

const TIMES: &str = "assume.codel = \"5 ms\"\nplatform.rt_throttling = false\n";

const ACCEPTED: &str = "deployment.Sea.accept = { back = \"measured by hand\" }\n";

fn run(name: &str, robot: &str, config: &str, arguments: &[&str]) -> Run {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    write(&folder, &[("robot.mal", robot), ("mauve.toml", config)]);
    mauve(MAUVE, &folder, arguments)
}

fn json_of(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap()
}

#[test]
fn a_limit_of_a_chain_that_is_not_proved_fails() {
    let robot = |otherwise: &str| {
        format!(
            "codel look(out n: int): bool\ncodel use(in n: int): void\nshell S {{ output port seen: int }}\n\
             shell T {{ input port goal: int }}\n\
             core C(S) {{ var n: int = 0  update = {{ if look(n) then {{ write(seen, n); }} else {{ {otherwise} }} }} }}\n\
             core E(T) {{ var n: int = 0  update = {{ read(goal, n); use(n); }} }}\ncomponent P(S, C)\ncomponent Q(T, E)\n\
             architecture A {{ instance a: P  instance b: Q  connection a.seen -> b.goal }}\ndeployment Sea {{\n\
             architecture A\n  activity a {{ priority = 2 period = 10 }}\n  activity b {{ priority = 1 period = 40 }}\n}}\n"
        )
    };
    let chain = |limit: &str| {
        format!("{}[chains.see]\nfrom = \"look\"\nto = \"use\"\n{limit}", TIMES.replace("5 ms", "1 ms"))
    };
    let (blocking, passing) = (robot(""), robot("write(seen, n);"));
    for (name, robot, config, code, part) in [
        ("no limit", &blocking, chain(""), 0, "all 2 deadlines are proved"),
        ("blocking", &blocking, chain("latency = \"1 s\"\n"), 1, "; the limit of the chain is not proved\n"),
        (
            "lowered",
            &blocking,
            chain("latency = \"1 s\"\n[lints]\nchain-broken = \"warn\"\n"),
            0,
            "; the limit of the chain is not proved\n",
        ),
        ("passing", &passing, chain("latency = \"1 s\"\n"), 0, "; the limit of the chain holds\n"),
        ("late", &passing, chain("latency = \"20 ms\"\n"), 1, "; the limit of the chain is not proved\n"),
    ] {
        let found = run(name, robot, &config, &["check"]);
        assert!(found.code == code && found.has(part), "{name}: {} {}{}", found.code, found.out, found.err);
    }
}

#[test]
fn an_accepted_deadline_is_shown_as_accepted_and_never_as_met() {
    let config = format!("{TIMES}{ACCEPTED}");
    assert_eq!(run("plain", ROBOT, TIMES, &["check"]).code, 1);
    let found = run("accepted", ROBOT, &config, &["check"]);
    for part in [
        "  ✗ 10 / 9 ms          ▰▰▰▰▰▰  112 %  accepted: measured by hand\n",
        ", 1 suppressed; 1 of 2 deadlines is not proved (1 accepted)\n",
    ] {
        assert!(found.out.contains(part), "{part} in {}", found.out);
    }
    assert!(found.code == 0 && !found.out.contains("deadline-missed"), "{}", found.out);
    // Nothing but the reason is new in the figures.
    let figures = |config: &str| json_of(&run("figures", ROBOT, config, &["check", "--format", "json"]));
    let mut with = figures(&config);
    assert_eq!(with["suppressed"][0]["by"], "mauve.toml");
    assert_eq!(with["suppressed"][0]["diagnostic"]["code"], "deadline-missed");
    let activity = &mut with["deployments"][0]["results"][0]["activities"][1];
    assert_eq!((&activity["status"], &activity["accepted"]), (&json!("missed"), &json!("measured by hand")));
    activity.as_object_mut().unwrap().remove("accepted");
    assert_eq!(with["deployments"], figures(TIMES)["deployments"]);
    assert_eq!(with["deployments"][0]["results"][0]["schedulable"], false);
    // `wcrt` answers whether everything is proved.
    assert_eq!(run("wcrt", ROBOT, &config, &["wcrt"]).code, 1);
    // An acceptance is for one activity, and not for errors.
    let other = format!("{TIMES}deployment.Sea.accept = {{ front = \"measured by hand\" }}\n");
    let found = run("other", ROBOT, &other, &["check"]);
    assert!(
        found.code == 1 && !found.out.contains("accepted"),
        "a met deadline needs no acceptance: {}",
        found.out
    );
    let broken = format!("{ROBOT}core L(S) {{ update = {{ work(1); }} }}\n");
    assert_eq!(run("broken", &broken, &config, &["check"]).code, 1);
    // One diagnostic reports an overloaded CPU: all its activities are accepted, or none.
    let overloaded = TIMES.replace("5 ms", "11 ms");
    let both =
        format!("{overloaded}deployment.Sea.accept = {{ front = \"measured\", back = \"measured\" }}\n");
    assert_eq!(run("overloaded", ROBOT, &format!("{overloaded}{ACCEPTED}"), &["check"]).code, 1);
    assert_eq!(run("overloaded", ROBOT, &both, &["check"]).code, 0);
    // What is not analysed is accepted in the same way.
    let untimed = "deployment.Sea.accept = { front = \"measured\", back = \"measured\" }\n";
    let found = run("untimed", ROBOT, untimed, &["check"]);
    assert_eq!(found.out.matches("  accepted: measured\n").count(), 2, "{}", found.out);
    assert_eq!(found.code, 0);
}

#[test]
fn a_comment_suppresses_the_diagnostics_of_its_code_on_one_line() {
    let allowed = ROBOT.replace(
        "  activity back",
        "  // mauve: allow(deadline-missed) the bench shows 8 ms\n  activity back",
    );
    let found = run("above", &allowed, TIMES, &["check"]);
    assert!(
        found.out.contains(
            "no errors, no warnings, 1 suppressed; 1 of 2 deadlines is not proved (1 message suppressed)\n"
        ),
        "{}",
        found.out
    );
    assert!(found.out.contains("✗ 10 / 9 ms  "), "{}", found.out);
    // A comment changes no proof; an acceptance and `[lints]` do.
    assert_eq!(found.code, 1, "{}", found.out);
    assert_eq!(run("accepted", &allowed, &format!("{TIMES}{ACCEPTED}"), &["check"]).code, 0);
    let lowered = format!("{TIMES}lints.deadline-missed = \"warn\"\n");
    assert_eq!(run("lowered", &allowed, &lowered, &["check"]).code, 0);
    // Not without a reason, and not for another code.
    for comment in ["// mauve: allow(deadline-missed)", "// mauve: allow(lost-write) the bench shows 8 ms"] {
        let robot = allowed.replace("// mauve: allow(deadline-missed) the bench shows 8 ms", comment);
        let found = run("without", &robot, TIMES, &["check"]);
        assert!(found.code == 1 && found.out.contains("warning[unused-allow]: "), "{}", found.out);
        assert!(found.out.contains("error[deadline-missed]: "), "{}", found.out);
    }
    // An error that is not shown prevents the proof all the same.
    let robot = format!(
        "{ROBOT}core L(S) {{ update = {{ work(1); }} }} // mauve: allow(argument-count) not used yet\n"
    )
    .replace("deadline = 9", "");
    let found = run("error", &robot, "assume.codel = \"1 ms\"\n", &["check"]);
    assert!(
        found
            .out
            .contains(", 1 suppressed (comments hide 1 error); 2 of 2 deadlines are met, but none is proved"),
        "{}",
        found.out
    );
    assert_eq!(found.code, 1);
}

#[test]
fn sarif_has_the_suppressed_results_with_the_reason() {
    let robot = format!("// mauve: allow(unused-codel) the next robot calls it\ncodel spare(): int\n{ROBOT}");
    let found = run("sarif", &robot, &format!("{TIMES}{ACCEPTED}"), &["check", "--format", "sarif"]);
    assert_eq!(found.code, 0);
    let log = json_of(&found);
    let results = log["runs"][0]["results"].as_array().unwrap();
    let of = |code: &str| results.iter().find(|it| it["ruleId"] == code).unwrap()["suppressions"].clone();
    let reason = |kind: &str, reason: &str| json!([{ "kind": kind, "justification": reason }]);
    assert_eq!(of("unused-codel"), reason("inSource", "the next robot calls it"));
    assert_eq!(of("deadline-missed"), reason("external", "measured by hand"));
    assert!(results.iter().all(|it| it["suppressions"].is_array()), "all results have them, or none");
    let plain = json_of(&run("plain", ROBOT, TIMES, &["check", "--format", "sarif"]));
    assert!(
        plain["runs"][0]["results"].as_array().unwrap().iter().all(|it| it.get("suppressions").is_none())
    );
}

#[test]
fn exit_codes_follow_lints() {
    for (config, code, shown) in [
        (format!("{TIMES}lints.deadline-missed = \"warn\"\n"), 0, "✗ 10 / 9 ms  "),
        (format!("{TIMES}lints.deadline-missed = \"allow\"\n"), 0, "✗ 10 / 9 ms  "),
        (format!("{TIMES}lints.deadline-missed = \"error\"\n"), 1, "✗ 10 / 9 ms  "),
        (format!("{TIMES}lints.missing-time = \"warn\"\n"), 1, "✗ 10 / 9 ms  "),
        (String::new(), 1, "  ? no time for work\n"),
        ("lints.missing-time = \"warn\"\n".to_owned(), 0, "  ? no time for work\n"),
        ("lints.missing-time = \"error\"\n".to_owned(), 1, "  ? no time for work\n"),
        ("lints.not-analysed = \"warn\"\n".to_owned(), 1, "  ? no time for work\n"),
    ] {
        let found = run("lints", ROBOT, &config, &["check"]);
        assert!(found.code == code && found.out.contains(shown), "{config}: {}", found.out);
        assert!(found.out.contains("not proved\n"), "{config}: {}", found.out);
    }
    let config = format!("{TIMES}lints.deadline-missed = \"warn\"\n");
    assert_eq!(run("denied", ROBOT, &config, &["check", "--deny", "deadline-missed"]).code, 1);
}

#[test]
fn many_hints_are_counted_unless_they_are_asked_for() {
    let unused: String = (0..4).map(|index| format!("codel spare{index}(): int\n")).collect();
    let found = run("folded", &unused, "", &["check"]);
    assert!(
        !found.out.contains("hint[") && found.out.contains(", 4 hints (--hints shows them); "),
        "{}",
        found.out
    );
    let found = run("shown", &unused, "", &["check", "--hints"]);
    assert_eq!(found.out.matches("hint[unused-codel]").count(), 4, "{}", found.out);
    let document = json_of(&run("json", &unused, "", &["check", "--format", "json"]));
    assert_eq!(document["diagnostics"].as_array().unwrap().len(), 4);
    let few: String = unused.lines().take(3).map(|line| format!("{line}\n")).collect();
    assert_eq!(run("few", &few, "", &["check"]).out.matches("hint[unused-codel]").count(), 3);
}

/// `back` takes 10 ms of its 9.
#[test]
fn an_acceptance_holds_until_its_ceiling() {
    let with = |name: &str, until: &str, config: &str| {
        let accept =
            format!("deployment.Sea.accept = {{ back = {{ until = '{until}', reason = 'measured' }} }}\n");
        run(name, ROBOT, &format!("{config}{accept}"), &["check"])
    };
    let found = with("equal", "10 ms", TIMES);
    assert!(found.code == 0 && found.out.contains(" 112 %  accepted: measured\n"), "{}", found.out);
    let found = with("above", "9.999 ms", TIMES);
    assert!(found.code == 1 && found.out.contains(" 112 %  accepted until 9.999 ms only\n"), "{}", found.out);
    assert!(found.out.contains("✗ 10 / 9 ms") && !found.out.contains("1 accepted"), "{}", found.out);
    assert!(found.out.contains("; accepted until 9.999 ms only, by mauve.toml"), "{}", found.out);
    // Without a bound, nothing says that it is at most the ceiling: overloaded, and without a time.
    let found = with("overloaded", "1 s", &TIMES.replace("5 ms", "6 ms"));
    assert!(found.code == 1 && found.out.contains("accepted until 1000 ms only"), "{}", found.out);
    let found = with("unknown", "1 s", "platform.rt_throttling = false\n");
    assert!(found.code == 1 && found.out.contains("accepted until 1000 ms only"), "{}", found.out);
}
