//! `mauve wcrt --set`: figures with other values, beside the present ones.

use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use mauve_tests::{Run, mauve, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

const ROBOT: &str = "library drivers {
  codel look(): int
  codel plan(): int
}
shell S { }
core L(S) { update = { look(); } }
core P(S) { update = { plan(); } }
component Eye(S, L)
component Brain(S, P)
architecture A { instance eye: Eye  instance brain: Brain }
deployment Robot {
  architecture A
  activity eye { priority = 2 period = 20 }
  activity brain { affinity = 1 priority = 1 rate = 10 Hz deadline = 50 }
}
";

fn robot(times: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let config = "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\nplatform.cpus = 2\n";
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", config), ("times.toml", times)]);
    folder
}

const TIMES: &str =
    "unit = \"us\"\nlevels = [1e-3, 1e-4]\n[codel]\n\"drivers.look\" = [5000, 6000]\ndrivers.plan = 30000\n";

fn run(folder: &Path, values: &[&str]) -> Run {
    let mut arguments = vec!["wcrt"];
    values.iter().for_each(|it| arguments.extend(["--set", it]));
    mauve(MAUVE, folder, &arguments)
}

fn check(values: &[&str], expected: Expect) {
    let folder = robot(TIMES);
    let texts = |folder: &Path| {
        ["robot.mal", "mauve.toml", "times.toml"].map(|it| std::fs::read_to_string(folder.join(it)).unwrap())
    };
    let before = texts(&folder);
    let found = run(&folder, &[values, &["eye.priority=2"]].concat());
    expected.assert_eq(&format!("{}{}exit {}\n", found.out, found.err, found.code));
    assert_eq!(texts(&folder), before, "no file is written");
}

#[test]
fn several_values_count_together() {
    check(
        &["eye.period=10ms", "plan=12ms", "brain.cpus=2"],
        expect![[r#"
            Robot at 1e-4: 2 of 2 deadlines met, as before
              activity  before        after
              eye       ✓ 6 / 20 ms   ✓ 6 / 10 ms   tightened; period 20 ms → 10 ms
              brain     ! 48 / 50 ms  ✓ 30 / 50 ms  earlier; CPU 1 → 2
              CPUs 1 and 2 utilisation: 60.0 % of 200 % → 72.0 % of 200 %
              execution times: drivers.plan 30 → 12 ms
            exit 0
        "#]],
    );
    check(
        &["brain.deadline = 36 ms", "brain.period=50", "drivers.look = 7500us"],
        expect![[r#"
            Robot at 1e-4: 2 → 1 of 2 deadlines met
              activity  before        after
              eye       ✓ 6 / 20 ms   ✓ 7.5 / 20 ms   later
              brain     ! 48 / 50 ms  ✗ 52.5 / 36 ms  no longer met; period 100 ms → 50 ms; deadline 50 ms → 36 ms
              CPUs 1 and 2 utilisation: 60.0 % of 200 % → 97.5 % of 200 %
              execution times: drivers.look 6 → 7.5 ms
            exit 1
        "#]],
    );
    check(
        &[],
        expect![[r#"
        Robot at 1e-4: 2 of 2 deadlines met, as before
          nothing changes
        exit 0
    "#]],
    );
}

#[test]
fn a_value_that_cannot_be_is_refused() {
    for value in [
        "eye.period=0",
        "eye.priority=high",
        "eye.perio=3",
        "plan=3",
        "plan",
        "eye.cpus=[7]",
        "a } b=1",
        "look=-1ms",
    ] {
        let found = run(&robot(TIMES), &[value]);
        assert_eq!((found.code, found.out.as_str()), (2, ""), "{value}");
    }
    let said = |value: &str| run(&robot(TIMES), &[value]).err;
    expect![[r#"
        mauve: --set `eye.perio` is neither a field of an activity of Robot nor a time that it executes; did you mean `eye.period`?
        mauve: --set `eye.priority=high`: invalid priority: expected a whole number from 1 to 99, or `background`
        mauve: --set `plan=3`: a time needs its unit, as in 12ms: unknown unit of time: write ns, us, ms or s after the number
        mauve: --set `drivers.lok` is neither a field of an activity of Robot nor a time that it executes; did you mean `drivers.look`?
        mauve: --set `eye.cpus=[7]`: affinity names CPU 7, and mauve.toml has CPUs 1 and 2
    "#]].assert_eq(
        &["eye.perio=3", "eye.priority=high", "plan=3", "drivers.lok=3ms", "eye.cpus=[7]"].map(said).concat(),
    );
}

/// What `--set` promises is what comes out of the text with these values.
#[test]
fn the_figures_are_those_of_the_changed_texts() {
    let folder = robot(TIMES);
    let document = |out: &str| serde_json::from_str::<Value>(out).unwrap();
    let arguments = ["wcrt", "--set", "eye.period=8", "--set", "plan=21ms", "--format", "json"];
    let promised = document(&mauve(MAUVE, &folder, &arguments).out);
    write(
        &folder,
        &[
            ("robot.mal", ROBOT.replace("period = 20", "period = 8").as_str()),
            ("times.toml", TIMES.replace("30000", "21000").as_str()),
        ],
    );
    let found = document(&mauve(MAUVE, &folder, &["wcrt", "--format", "json"]).out);
    let activities = found["results"][0]["activities"].as_array().unwrap();
    assert_eq!(activities.len(), 2);
    for (index, it) in activities.iter().enumerate() {
        let after = &promised["activities"][index]["after"];
        assert_eq!((&after["time"], &after["status"]), (&it["response"], &it["status"]), "{promised}");
    }
    assert_ne!(promised["activities"][1]["after"]["time"], promised["activities"][1]["before"]["time"]);
}
