//! `mauve wcrt --sensitivity`: how far each time may grow, and each period shrink.

use std::path::{Path, PathBuf};

use expect_test::expect;
use mauve_tests::{Run, mauve, models, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

const ROBOT: &str = "codel plan(): int\ncodel drive(): int\ncodel rest(): int\nshell S { }\n\
                     core P(S) { update = { plan(); } }\ncore D(S) { update = { drive(); } }\n\
                     core R(S) { update = { rest(); } }\n\
                     component Planner(S, P)\ncomponent Driver(S, D)\ncomponent Rest(S, R)\n\
                     architecture A { instance driver: Driver  instance planner: Planner  instance rest: Rest }\n\
                     deployment Robot {\n  architecture A\n  \
                     activity driver { priority = 2 period = DRIVER }\n  \
                     activity planner { priority = 1 period = 100 }\n  \
                     activity rest { priority = background }\n}\n";

/// A folder with the robot, the period of `driver` and the times of `plan` and `drive` in milliseconds.
fn robot(name: &str, period: &str, plan: &str, drive: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let times = format!("[codel]\nplan = {plan}\nrest = 1\n[program]\n\"Driver/update\" = {drive}\n");
    write(
        &folder,
        &[
            ("robot.mal", ROBOT.replace("DRIVER", period).as_str()),
            ("mauve.toml", "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n"),
            ("times.toml", times.as_str()),
        ],
    );
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["wcrt"], arguments].concat())
}

fn document(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"))
}

#[test]
fn tables_of_sensitivity() {
    let found = run(&robot("met", "30", "37", "20"), &["--sensitivity"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""));
    expect![[r#"
        Robot: response times in ms at 1e-4, method best
          instance  component  CPU    priority  period  WCET  first job  response / deadline
          driver    Driver       1           2      30    20         20  ✓ 20 / 30 ms                  ▰▰▰▰▱▱  67 %
          planner   Planner      1           1     100    37        117  ✗ CPU 1 overloaded (103.7 %)
          rest      Rest         1  background       —     —          —  – not real-time
          CPU 1 utilisation: 103.7 %
          planner: CPU 1 overloaded (103.7 % at priority ≥ 1)

        Robot: limits of each value, changed alone, in ms at 1e-4
          codel or program  time    at most  growth
          Driver/update       20  17.666666  -2.333334 (-12 %)  for the deadline of planner
          plan                37         30  -7 (-19 %)         for the deadline of planner
          rest                 1        any

          instance  period   at least  slack
          driver        30  32.333334     10  for the deadline of planner
          planner      100        117      —  for the deadline of planner
          rest           —        any      —
    "#]].assert_eq(&found.out);
    let found = run(&robot("met", "30", "27", "20"), &["--sensitivity"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#"
        Robot: response times in ms at 1e-4, method best
          instance  component  CPU    priority  period  WCET  response / deadline
          driver    Driver       1           2      30    20  ✓ 20 / 30 ms         ▰▰▰▰▱▱  67 %
          planner   Planner      1           1     100    27  ✓ 87 / 100 ms        ▰▰▰▰▰▱  87 %
          rest      Rest         1  background       —     —  – not real-time
          CPU 1 utilisation: 93.7 %

        Robot: limits of each value, changed alone, in ms at 1e-4
          codel or program  time  at most  growth
          Driver/update       20       21  +1 (+5.0 %)
          plan                27       30  +3 (+11 %)
          rest                 1      any

          instance  period  at least  slack
          driver        30        29     10
          planner      100        87     13
          rest           —       any      —
    "#]]
    .assert_eq(&found.out);
}

#[test]
fn a_limit_is_met_and_one_nanosecond_more_is_missed() {
    let found = run(&robot("now", "30", "10", "15"), &["--sensitivity", "--format", "json"]);
    let found = document(&found)["results"][0]["sensitivity"].clone();
    let times = found["times"].as_array().unwrap();
    let limit = |key: &str| {
        let of = times.iter().find(|it| it["key"] == key).unwrap();
        assert_eq!(of["limit"], "last", "{of}");
        of["at_most"].as_f64().unwrap()
    };
    let (plan, drive) = (limit("plan"), limit("Driver/update"));
    let period = found["activities"][0]["at_least"].as_f64().unwrap();
    let code = |name: &str, period: f64, plan: f64, drive: f64| {
        let text = |time: f64| format!("{time:.6}");
        run(&robot(name, &text(period), &text(plan), &text(drive)), &[]).code
    };
    assert_eq!([code("plan", 30.0, plan, 15.0), code("plan1", 30.0, plan + 1e-6, 15.0)], [0, 1]);
    assert_eq!([code("drive", 30.0, 10.0, drive), code("drive1", 30.0, 10.0, drive + 1e-6)], [0, 1]);
    assert_eq!([code("period", period, 10.0, 15.0), code("period1", period - 1e-6, 10.0, 15.0)], [0, 1]);
}

#[test]
fn documents_have_it_only_on_request() {
    let folder = robot("robot", "30", "27", "20");
    assert!(document(&run(&folder, &["--format", "json"]))["results"][0].get("sensitivity").is_none());
    let found = document(&run(&folder, &["--format", "json", "--sensitivity"]));
    expect![[r#"
        {
          "activities": [
            {
              "at_least": 29,
              "instance": "driver",
              "limit": "last",
              "period": 30,
              "slack": 10
            },
            {
              "at_least": 87,
              "instance": "planner",
              "limit": "last",
              "period": 100,
              "slack": 13
            },
            {
              "at_least": null,
              "instance": "rest",
              "limit": "any",
              "period": null,
              "slack": null
            }
          ],
          "times": [
            {
              "at_most": 21,
              "factor": 1.05,
              "key": "Driver/update",
              "limit": "last",
              "time": 20
            },
            {
              "at_most": 30,
              "factor": 1.1111111111111112,
              "key": "plan",
              "limit": "last",
              "time": 27
            },
            {
              "at_most": null,
              "factor": null,
              "key": "rest",
              "limit": "any",
              "time": 1
            }
          ]
        }
    "#]]
    .assert_eq(&format!("{:#}\n", found["results"][0]["sensitivity"]));
    expect![[r#"
        deployment,significance,method,kind,name,now_ms,limit_ms,factor,limit,slack_ms,unproved,root,remark
        Robot,1e-4,best,time,Driver/update,20,21,1.05,last,,,robot.mal,
        Robot,1e-4,best,time,plan,27,30,1.1111111111111112,last,,,robot.mal,
        Robot,1e-4,best,time,rest,1,,,any,,,robot.mal,
        Robot,1e-4,best,period,driver,30,29,0.9666666666666667,last,10,,robot.mal,
        Robot,1e-4,best,period,planner,100,87,0.87,last,13,,robot.mal,
        Robot,1e-4,best,period,rest,,,,any,,,robot.mal,
    "#]]
    .assert_eq(&run(&folder, &["--format", "csv", "--sensitivity"]).out);
}

#[test]
fn every_limit_of_the_sample_robot_is_proved() {
    let found = run(&models().join("p3dx"), &["--sensitivity", "--significance", "all", "--format", "json"]);
    let found = document(&found);
    let results = found["results"].as_array().unwrap();
    assert_eq!(results.len(), 7);
    for result in results {
        let limits = &result["sensitivity"];
        let times = limits["times"].as_array().unwrap();
        assert_eq!((times.len(), limits["activities"].as_array().unwrap().len()), (44, 10));
        for of in times.iter().filter(|it| it["limit"] == "last") {
            let grows = of["at_most"].as_f64() >= of["time"].as_f64();
            assert_eq!(of.get("unproved").is_none(), grows, "{of}");
        }
    }
    // At 1e-4 navigation has 3 ms left; in its window are ten jobs of the driver of the laser.
    let at = |key: &str| {
        let times = results[1]["sensitivity"]["times"].as_array().unwrap();
        times.iter().find(|it| it["key"] == key).unwrap()["at_most"].clone()
    };
    assert_eq!((at("navigation.astar"), at("drivers.hokuyo_sweep")), (296.into(), 41.3.into()));
}

#[test]
fn it_needs_a_model_and_no_explanation() {
    let folder = robot("robot", "30", "27", "20");
    let both = run(&folder, &["--sensitivity", "--explain", "driver"]);
    assert!(both.code == 2 && both.err.contains("cannot be used with"), "{both:?}");
    let set = run(&folder, &["Robot.json", "--sensitivity"]);
    assert_eq!((set.code, set.out.as_str()), (2, ""));
    assert!(set.err.contains("--sensitivity needs a model"), "{set:?}");
}

/// `drive` has 5 ms for its own 1 ms and the lock of another, which holds it for as long as it takes.
#[test]
fn a_codel_that_holds_a_lock_delays_others() {
    for (priority, limit) in [("1 period = 100", 4.0), ("background", 4.0)] {
        let folder = robot(&priority[..1], "5", "1", "1");
        let model = std::fs::read_to_string(folder.join("robot.mal")).unwrap();
        let model = model.replace(
            "planner { priority = 1 period = 100 }",
            &format!("planner {{ priority = {priority} }}"),
        );
        let lock = "[locks.bus]\ncodels = ['plan', 'drive']\nprotocol = 'ceiling'\n";
        let config = format!("timing.tables = ['times.toml']\nplatform.rt_throttling = false\n{lock}");
        write(
            &folder,
            &[
                ("robot.mal", model.as_str()),
                ("mauve.toml", &config),
                ("times.toml", "[codel]\nplan = 1\ndrive = 1\nrest = 1\n"),
            ],
        );
        let found = document(&run(&folder, &["--sensitivity", "--format", "json"]));
        let times = found["results"][0]["sensitivity"]["times"].as_array().unwrap();
        let plan = times.iter().find(|it| it["key"] == "plan").unwrap_or_else(|| panic!("{found}"));
        assert_eq!((plan["limit"].as_str(), plan["at_most"].as_f64()), (Some("last"), Some(limit)), "{plan}");
    }
}
