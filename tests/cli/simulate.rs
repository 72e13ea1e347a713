//! `mauve simulate`: schedules of models and of task sets.

use std::collections::{BTreeMap, BTreeSet};

use expect_test::expect;
use mauve_tests::{Run, mauve, models, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

fn run(arguments: &[&str]) -> Run {
    mauve(MAUVE, &models(), &[&["simulate"], arguments].concat())
}

fn document(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"))
}

#[test]
fn the_schedule_of_the_sample_robot() {
    let found = run(&["p3dx", "--for", "10s", "--seed", "7"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#"
        P3dxDeployment: simulated response times in ms, 10000 ms at 1e-4, seed 7
          instance         CPU    priority  period  jobs  average  greatest  of bound  late  bound / deadline
          p3dx_driver        1          10     100   100    7.725     9.989    99.9 %     0  ✓ 10 / 100 ms
          hokuyo             1           9     100    99   31.785    42.987    81.1 %     0  ✓ 53 / 100 ms
          switch             1           8     100   100    1.690     6.528    11.7 %     0  ✓ 56 / 100 ms
          pose               1           7     100   100    0.765     0.988     1.7 %     0  ✓ 57 / 100 ms
          guidance           1           6     100   100    1.093     2.772     4.6 %     0  ✓ 60 / 100 ms
          control            1           5     100   100    2.327     2.998     4.8 %     0  ✓ 63 / 100 ms
          teleop             1           4     100   100    4.668     9.061    12.9 %     0  ✓ 70 / 100 ms
          navigation         1           2    1000     9  114.106   558.023    56.0 %     0  ! 997 / 1000 ms
          gmapping           2           3    1000    10  159.082   735.221    93.2 %     0  ✓ 789 / 1000 ms
          exploration  1 and 2  background       —     —        —         —         —     —  – not real-time
          a simulation shows some of the possible schedules: only the bounds hold for all
    "#]]
    .assert_eq(&found.out);
    assert_eq!(run(&["p3dx", "--for", "10000 ms", "--seed", "7"]).out, found.out);
    assert_ne!(run(&["p3dx", "--for", "10s", "--seed", "8"]).out, found.out);
}

#[test]
fn a_length_may_be_in_minutes_and_hours() {
    let lines = |length: &str| run(&["p3dx", "--for", length, "--seed", "7"]).out;
    let minute = lines("60s");
    assert!(minute.contains(", 60000 ms at 1e-4"), "{minute}");
    for other in ["1min", "1 min", "1m", "60000ms"] {
        assert_eq!(lines(other), minute, "{other}");
    }
    assert!(lines("0.05h").contains(", 180000 ms at 1e-4"));
    for wrong in ["min", "1.2.3min", "1 minute", "99999999999999999999h", "1e9m"] {
        let found = run(&["p3dx", "--for", wrong]);
        assert!(found.code == 2 && found.err.contains("expected a time such as 10s or 5min"), "{found:?}");
    }
}

#[test]
fn the_critical_instant_of_the_sample_robot_reaches_the_bounds() {
    let found = run(&["p3dx", "--simultaneous", "--full-times", "--format", "json", "--for", "20s"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    let document = document(&found);
    assert_eq!((&document["deployment"], &document["unit"]), (&"P3dxDeployment".into(), &"ms".into()));
    assert_eq!(
        (&document["significance"], &document["end"], &document["seed"]),
        (&1e-4.into(), &20000.into(), &1.into())
    );
    let activities = document["activities"].as_array().unwrap();
    let reached =
        activities.iter().filter(|it| !it["bound"].is_null() && it["bound"] == it["greatest"]).count();
    assert!(reached >= 5, "{document:#}");
    for activity in activities {
        assert!(activity["greatest"].as_f64() <= activity["bound"].as_f64(), "{activity}");
    }
    assert_eq!(activities[9]["instance"], "exploration");
    assert_eq!((&activities[9]["status"], &activities[9]["jobs"]), (&"background".into(), &Value::Null));
    // The first job of the highest priority, in both lists.
    assert_eq!(
        document["jobs"][0],
        serde_json::json!({
            "instance": "p3dx_driver", "job": 1, "nominal": 0, "release": 0, "deadline": 100, "end": 10, "missed": false,
        })
    );
    let slices = document["slices"].as_array().unwrap();
    let first = slices.iter().find(|slice| slice["instance"] == "p3dx_driver").unwrap();
    assert_eq!(
        *first,
        serde_json::json!({
            "instance": "p3dx_driver", "job": 1, "cpu": 1, "start": 0, "end": 10, "source": "update",
            "transition": null, "target": "update", "programs": ["update"], "operation": null, "client": null,
        })
    );
}

#[test]
fn a_missed_deadline() {
    let found = run(&["p3dx", "--significance", "1e-6", "--for", "20s", "--full-times", "--simultaneous"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""), "{}", found.out);
    let navigation = found.out.lines().find(|line| line.contains("navigation")).unwrap();
    assert!(navigation.contains("  9  ✗ CPU 1 overloaded"), "{navigation}");
    let found = run(&["p3dx", "--significance", "1e-6", "--for", "20s", "--full-times", "--format", "json"]);
    let document = document(&found);
    let misses = document["jobs"].as_array().unwrap().iter().filter(|job| job["missed"] == true).count();
    let navigation =
        document["activities"].as_array().unwrap().iter().find(|it| it["instance"] == "navigation");
    let navigation = navigation.unwrap();
    assert_eq!((&navigation["status"], &navigation["misses"]), (&"missed".into(), &misses.into()));
    assert_eq!((found.code, misses > 0), (1, true));
}

#[test]
fn the_worst_case_of_an_instance() {
    let found = run(&["sorter", "--worst", "monitor"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#"
        Sorter: simulated response times in ms, 40 ms at 1e-4, seed 1
          instance  CPU  priority  period  jobs  average  greatest  of bound  late  bound / deadline
          camera      1        30      10     4    5.500     7.000   100.0 %     0  ✓ 7 / 10 ms
          planner     1        20      20     2   12.500    18.000   100.0 %     0  ✓ 18 / 20 ms
          monitor     1        10      40     1   28.000    28.000   100.0 %     0  ! 28 / 30 ms
          job 1 of monitor: ! 28 / 30 ms, which is its bound
    "#]]
    .assert_eq(&found.out);
    let json = document(&run(&["p3dx", "--worst", "navigation", "--format", "json"]));
    assert_eq!(
        json["worst"],
        serde_json::json!({"instance": "navigation", "job": 1, "bound": 997, "response": 997})
    );
    // It is in the schedule.
    let mut jobs = json["jobs"].as_array().unwrap().iter();
    assert_eq!(jobs.find(|job| job["instance"] == "navigation").unwrap()["end"], 997);
    let svg = run(&["sorter", "--worst", "monitor", "--format", "svg"]);
    assert!(svg.out.contains("Sorter at 1e-4: job 1 of monitor: ! 28 / 30 ms, which is its bound"));
    // The calls of clients are at random.
    let found = run(&["shared_cpus", "--worst", "map"]);
    assert!(found.out.contains(" ms; no later schedule is known, its bound is 22 ms\n"), "{}", found.out);
}

#[test]
fn a_gantt_chart() {
    let found = run(&["p3dx", "--format", "svg"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    assert!(found.out.starts_with("<svg ") && found.out.ends_with("</svg>\n"));
    assert!(found.out.contains("P3dxDeployment at 1e-4: a simulated schedule, seed 1"));
    let found = run(&["p3dx", "--worst", "teleop", "--format", "text"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    assert!(found.out.contains("job 1 of teleop: ✓ 70 / 100 ms, which is its bound; times in ms\n"));
    let of_teleop = found.out.lines().find(|line| line.starts_with("  teleop")).unwrap();
    // A column is a millisecond: it waits for 63, then executes for 7.
    let (waits, executes) = (of_teleop.matches('·').count(), of_teleop.matches('█').count());
    assert_eq!((waits, executes), (63, 7), "{}", found.out);
}

#[test]
fn trace_events_are_the_schedule() {
    let arguments = ["p3dx", "--significance", "1e-8", "--for", "3s", "--full-times", "--simultaneous"];
    let of_events = run(&[&arguments[..], &["--format", "perfetto"]].concat());
    let schedule = document(&run(&[&arguments[..], &["--format", "json"]].concat()));
    assert_eq!((of_events.code, of_events.err.as_str()), (1, ""));
    let events = document(&of_events);
    let events = events["traceEvents"].as_array().unwrap();
    let of_phase = |phase: &str| events.iter().filter(|event| event["ph"] == phase).collect::<Vec<_>>();
    let mut processes = BTreeMap::new();
    let mut threads = BTreeMap::new();
    for event in of_phase("M") {
        let place = (event["pid"].as_u64().unwrap(), event["tid"].as_u64());
        let name = event["args"]["name"].as_str().unwrap_or_default().to_owned();
        match event["name"].as_str().unwrap() {
            "process_name" => drop(processes.insert(place.0, name)),
            "thread_name" => drop(threads.insert(place, name)),
            _ => {}
        }
    }
    assert_eq!(processes.into_values().collect::<Vec<_>>(), ["CPU 1", "CPU 2"]);
    let numbers: BTreeSet<_> = threads.keys().map(|(_, tid)| tid).collect();
    assert_eq!((threads.len(), numbers.len()), (9, 9));
    let micros = |time: &Value| (time.as_f64().unwrap() * 1e3).round();
    let shown = |event: &&Value| {
        let place = (event["pid"].as_u64().unwrap(), event["tid"].as_u64());
        let (start, length) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
        let name = event["name"].as_str().unwrap();
        format!("{} {name} {start} {length}", threads[&place].split(' ').next().unwrap())
    };
    let expected = |slice: &Value| {
        let (start, end) = (micros(&slice["start"]), micros(&slice["end"]));
        let name = slice["source"].as_str().unwrap();
        format!("{} {name} {start} {}", slice["instance"].as_str().unwrap(), end - start)
    };
    let found: Vec<String> = of_phase("X").iter().map(shown).collect();
    let expected: Vec<String> = schedule["slices"].as_array().unwrap().iter().map(expected).collect();
    assert_eq!(found, expected);
    let instants = of_phase("i");
    let jobs = schedule["jobs"].as_array().unwrap();
    let named = |name: &str| instants.iter().filter(|event| event["name"] == name).count();
    assert_eq!(named("release"), jobs.len());
    assert_eq!(named("deadline missed"), jobs.iter().filter(|job| job["missed"] == true).count());
    // Microseconds with three decimals.
    assert!(of_events.out.contains("\"ts\":29000.000,\"dur\":46000.000,"), "{}", of_events.out);
}

const UNKNOWN: [(&str, &str); 2] = [
    (
        "robot.mal",
        "codel work(): int\ncodel rest(): int\nshell S { }\ncore K(S) { update = { work(); } }\n\
         core L(S) { update = { rest(); } }\ncomponent C(S, K)\ncomponent E(S, L)\n\
         architecture A { instance front: C  instance back: E }\n\
         deployment D {\n  architecture A\n  activity front { priority = 2 period = 10 }\n  \
         activity back { priority = 1 period = 10 }\n}\narchitecture B { instance only: E }\n\
         deployment F { architecture B  activity only { priority = 1 period = 10 } }\n",
    ),
    ("times.toml", "codel.work = 5\n"),
];

#[test]
fn activities_that_are_not_analysed_are_named() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(&folder, &UNKNOWN);
    write(&folder, &[("mauve.toml", "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n")]);
    let simulate = |arguments: &[&str]| mauve(MAUVE, &folder, &[&["simulate"], arguments].concat());
    let found = simulate(&["--deployment", "D"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    assert!(found.out.contains("  back is not simulated, and may delay others: "), "{}", found.out);
    let json = document(&simulate(&["--deployment", "D", "--format", "json"]));
    assert_eq!(json["activities"][1]["status"], "not-simulated");
    assert_eq!(json["activities"][1]["reasons"].as_array().unwrap().len(), 1, "{json:#}");
    // Nothing of the other can be simulated.
    let found = simulate(&["--deployment", "F"]);
    assert_eq!(found.code, 1);
    assert!(found.err.contains("no activity of F can be simulated"), "{}", found.err);
    // Both, where the format has a place for them.
    let both = document(&simulate(&["--format", "json"]));
    assert_eq!((&both[0]["deployment"], &both[1]["deployment"]), (&"D".into(), &"F".into()));
    for format in ["svg", "perfetto"] {
        let found = simulate(&["--format", format]);
        assert_eq!((found.code, found.out.as_str()), (2, ""));
        assert!(found.err.contains("choose it with --deployment: D, F"), "{}", found.err);
    }
}

#[test]
fn what_is_too_long_ends_early() {
    let found = run(&["p3dx", "--format", "svg", "--for", "100000s"]);
    assert_eq!(found.code, 0);
    assert!(found.err.contains(" instead of 100000000 ms: it is too long for this format"), "{}", found.err);
}

#[test]
fn wrong_usage() {
    for (arguments, message) in [
        (&["p3dx", "--for", "0s"][..], "expected a time greater than 0"),
        (&["p3dx", "--worst", "x"], "no deployment here has an activity `x`; `mauve wcrt` lists them"),
        (
            &["p3dx", "--worst", "exploration"],
            "`exploration` has no response time in P3dxDeployment: `mauve wcrt` says why",
        ),
        (&["p3dx", "--for", "12"], "expected a time such as 10s"),
        (&["p3dx", "--significance", "2"], "a number between 0 and 1"),
        (&["p3dx", "--deployment", "P3dx"], "no deployment `P3dx`: there is exploration.P3dxDeployment"),
        (&["p3dx", "--seed", "-1"], "unexpected argument '-1'"),
        (&["nothing.json"], "cannot read `nothing.json`"),
        (&["nothing.mal"], "cannot read `nothing.mal`"),
    ] {
        let found = run(arguments);
        assert_eq!((found.code, found.out.as_str()), (2, ""), "{arguments:?}: {}", found.err);
        assert!(found.err.contains(message), "{arguments:?}: {}", found.err);
    }
}
