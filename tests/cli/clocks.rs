//! Synchronised clocks: response times in the windows that begin at actual releases.

use serde_json::Value;

use super::command_line::run_in;

/// `late` is released 5 ms after `early`, which takes 4 ms; `free` has any phase.
fn model(clocks: &'static str) -> [(&'static str, &'static str); 3] {
    let robot = "codel four(): int\ncodel one(): int\nshell S { }\ncore K(S) { update = { four(); } }\n\
                 core L(S) { update = { one(); } }\ncomponent C(S, K)\ncomponent E(S, L)\n\
                 architecture A { instance early: C  instance late: C  instance free: E }\ndeployment D { architecture A\n\
                 activity free { priority = 3 period = 40 }\nactivity early { priority = 2 period = 10 }\n\
                 activity late { priority = 1 period = 20 deadline = 6 offset = 5 } }\n";
    [("robot.mal", robot), ("mauve.toml", clocks), ("t.toml", "[codel]\nfour = 4\none = 1\n")]
}

const SYNCHRONISED: &str = "timing.tables = [\"t.toml\"]\nplatform.rt_throttling = false\nclocks.synchronised = [\"early\", \"late\"]\n";
const FREE: &str = "timing.tables = [\"t.toml\"]\nplatform.rt_throttling = false\n";

fn wcrt(name: &str, clocks: &'static str, arguments: &[&str]) -> Value {
    let arguments = [&["wcrt", "--format", "json"], arguments].concat();
    let document: Value = serde_json::from_str(&run_in(name, &model(clocks), &arguments).out).unwrap();
    document["results"][0].clone()
}

#[test]
fn an_offset_makes_a_response_time_shorter() {
    let response = |name, clocks| wcrt(name, clocks, &[])["activities"][2].clone();
    let any = response("clocks-free", FREE);
    assert_eq!(
        (&any["response"], &any["status"], &any["window"]),
        (&9.into(), &"missed".into(), &Value::Null)
    );
    let known = response("clocks", SYNCHRONISED);
    assert_eq!((&known["response"], &known["status"]), (&5.into(), &"met".into()));
    assert_eq!(known["window"], serde_json::json!({"job": 1, "own": 4, "length": 5, "start": 5, "delay": 0}));
}

#[test]
fn the_explanation_says_where_the_window_begins() {
    let explained = run_in("clocks", &model(SYNCHRONISED), &["wcrt", "--explain", "late"]).out;
    for part in [
        "- assumes synchronised clocks\n",
        "- the busy window begins 5 ms after the instant that the synchronised clocks share\n",
        "own time              1  1 × 4 ms  4 ms  ████████████████\nfree                  3  1 × 1 ms  1 ms  ████\n",
    ] {
        assert!(explained.contains(part), "{part} in {explained}");
    }
    assert!(!explained.contains("early"), "{explained}");
    for (name, clocks, is_assumed) in [("clocks", SYNCHRONISED, true), ("clocks-free", FREE, false)] {
        let table = run_in(name, &model(clocks), &["wcrt"]).out;
        assert_eq!(
            table.contains("\n  assumes that the clocks which mauve.toml names are synchronised\n"),
            is_assumed
        );
    }
}

#[test]
fn a_simulation_keeps_the_offsets() {
    let simulated =
        run_in("clocks", &model(SYNCHRONISED), &["simulate", "--for", "1s", "--format", "json"]).out;
    let document: Value = serde_json::from_str(&simulated).unwrap();
    let activities = document["activities"].as_array().unwrap();
    let greatest =
        |name: &str| activities.iter().find(|it| it["instance"] == name).unwrap()["greatest"].as_f64();
    assert!(greatest("late").unwrap() <= 5.0, "{document}");
}

#[test]
fn other_periods_are_proved_for_any_offsets() {
    let found = wcrt("clocks", SYNCHRONISED, &["--sensitivity"])["sensitivity"].clone();
    for (place, period) in [(0, 40), (1, 10), (2, 20)] {
        let of = &found["activities"][place];
        assert_eq!((&of["at_least"], &of["limit"]), (&period.into(), &"proved".into()), "{of}");
    }
    // A nanosecond more, and the job that is released at 5 has not ended at 10.
    assert_eq!((&found["times"][1]["at_most"], &found["times"][1]["limit"]), (&4.into(), &"last".into()));
}
