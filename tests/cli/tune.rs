//! `mauve tune`: from a deployment that misses deadlines, or has no priorities and CPUs yet, to one that meets all of them.

use std::fs;
use std::path::{Path, PathBuf};

use expect_test::expect;
use mauve_tests::{Run, copy, mauve, models, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

fn folder(name: &str) -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()))
}

/// The drone without priorities and CPUs.
fn drone() -> PathBuf {
    let folder = folder("drone");
    write(
        &folder,
        &[
            ("uav.mal", include_str!("tune/uav.mal")),
            ("mauve.toml", include_str!("tune/mauve.toml")),
            ("times.toml", include_str!("tune/times.toml")),
        ],
    );
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["tune"], arguments].concat())
}

fn document(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"))
}

/// The response times that `mauve wcrt` computes.
fn responses(folder: &Path) -> Vec<(String, Value)> {
    let found = mauve(MAUVE, folder, &["wcrt", "--format", "json"]);
    let found: Value = serde_json::from_str(&found.out).unwrap();
    let rows = found["results"][0]["activities"].as_array().unwrap().iter();
    rows.map(|it| (it["instance"].as_str().unwrap().to_owned(), it["response"].clone())).collect()
}

#[test]
fn a_drone_without_priorities_and_cpus_meets_all_deadlines_after_one_command() {
    let folder = drone();
    assert_eq!(mauve(MAUVE, &folder, &["wcrt"]).code, 1);
    let found = run(&folder, &["--priorities", "--cpus"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    assert!(found.out.starts_with("uav.Flight at 1e-4: 0 → 13 of 13 deadlines met\n"), "{}", found.out);
    let found = run(&folder, &["--priorities", "--cpus", "--diff"]);
    expect![[r#"
        --- uav.mal
        +++ uav.mal
        @@ -109,24 +109,26 @@
             architecture Drone
         
             // Four milliseconds: the inner loop.
        -    activity imu       { period = 4 }
        -    activity estimator { period = 4 }
        -    activity attitude  { period = 4 }
        -    activity motors    { period = 4  deadline = 3 }
        +    activity imu       { affinity = 1 priority = 12 period = 4 }
        +    activity estimator { affinity = 2 priority = 11 period = 4 }
        +    activity attitude  { affinity = 2 priority = 10 period = 4 }
        +    activity motors    { affinity = 1 priority = 13 period = 4  deadline = 3 }
         
        -    activity baro      { period = 20 }
        -    activity gps       { period = 100 }
        -    activity guidance  { period = 20 }
        +    activity baro      { affinity = 2 priority = 9 period = 20 }
        +    activity gps       { affinity = 2 priority = 5 period = 100 }
        +    activity guidance  { affinity = 1 priority = 8 period = 20 }
         
             // Vision
        -    activity camera    { period = 33 }
        -    activity odometry  { period = 66 }
        -    activity detector  { period = 100 }
        -    activity planner   { period = 200 }
        +    activity camera    { affinity = 2 priority = 7 period = 33 }
        +    activity odometry  { affinity = 2 priority = 6 period = 66 }
        +    activity detector  { affinity = 1 priority = 4 period = 100 }
        +    activity planner   { affinity = 1 priority = 2 period = 200 }
         
        -    activity telemetry { period = 100 }
        +    activity telemetry { affinity = 1 priority = 3 period = 100 }
             activity logger {
               // Its card is slow now and then.
        +      affinity = 2
        +      priority = 1
               period = 250
             }
           }
    "#]]
    .assert_eq(&found.out);
    assert_eq!(fs::read_to_string(folder.join("uav.mal")).unwrap(), include_str!("tune/uav.mal"));
    // What is promised is what the analysis of the written text says.
    let promised = document(&run(&folder, &["--priorities", "--cpus", "--format", "json"]));
    let applied = run(&folder, &["--priorities", "--cpus", "--apply"]);
    assert_eq!(applied.code, 0);
    assert!(applied.out.ends_with("\nwritten: uav.mal\n"), "{}", applied.out);
    let rows = promised["comparison"]["activities"].as_array().unwrap().iter();
    let promised: Vec<(String, Value)> =
        rows.map(|it| (it["name"].as_str().unwrap().to_owned(), it["after"]["time"].clone())).collect();
    assert_eq!(responses(&folder), promised);
    assert_eq!(mauve(MAUVE, &folder, &["check"]).code, 0);
    // Then nothing is left to do.
    let again = run(&folder, &["--priorities", "--cpus", "--diff"]);
    assert_eq!((again.code, again.out.as_str()), (0, ""));
    // More room, and shorter periods.
    for options in [&["--slack", "--cpus"][..], &["--latency"], &["--periods"]] {
        let better = document(&run(&folder, &[options, &["--format", "json"]].concat()));
        assert_eq!(better["met"], true, "{options:?}: {better}");
        assert_ne!(better["values"].as_array().unwrap().len(), 0, "{options:?}: {better}");
    }
}

#[test]
fn an_activity_of_the_sample_robot_moves_to_the_other_cpu() {
    let folder = folder("p3dx");
    copy(&models().join("p3dx"), &folder);
    let found = run(&folder, &["--priorities", "--cpus", "--significance", "1e-5", "--diff"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#"
        --- deployment.mal
        +++ deployment.mal
        @@ -5,7 +5,7 @@
             architecture ExplorationP3dxArchitecture
         
             // The base's micro-controller sends a packet every 100 ms, so all motion activities have this period.
        -    activity p3dx_driver { affinity = 1  priority = 10  period = 100   deadline = 100 }
        +    activity p3dx_driver { affinity = 2  priority = 10  period = 100   deadline = 100 }
             activity hokuyo      { affinity = 1  priority = 9   period = 100   deadline = 100 }
             activity switch      { affinity = 1  priority = 8   period = 100   deadline = 100 }
             activity pose        { affinity = 1  priority = 7   period = 100   deadline = 100 }
    "#]].assert_eq(&found.out);
    // Priorities alone do not help.
    let found = run(&folder, &["--priorities", "--significance", "1e-5", "--apply"]);
    assert_eq!(found.code, 1);
    expect![[r#"
        exploration.P3dxDeployment at 1e-5: 8 of 9 deadlines met, as before
          nothing changes

        no order of priorities meets every deadline: `p3dx_driver`, `hokuyo`, `switch`, `guidance`, `control`, `teleop` and `navigation` cannot be scheduled together (no fewer activities are such a set). Each of these alone would be enough:
          `p3dx_driver` takes at most 9.3 ms instead of 11 ms, or has a period of at least 125 ms instead of 100 ms
          `hokuyo` takes at most 42.3 ms instead of 44 ms, or has a period of at least 109 ms instead of 100 ms
          `switch` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `guidance` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `control` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `teleop` takes at most 5.3 ms instead of 7 ms, or has a period of at least 143 ms instead of 100 ms
          `navigation` takes at most 280 ms instead of 297 ms, or has a period of at least 1089 ms instead of 1000 ms

        nothing is written
    "#]].assert_eq(&found.out);
}

#[test]
fn what_cannot_be_tuned_is_said() {
    let folder = drone();
    let found = run(&folder, &["--cpus", "--pin", "moters"]);
    assert_eq!((found.code, found.out.as_str()), (2, ""));
    expect![[r#"
        mauve: --pin moters: no activity of this name; did you mean `motors`?
    "#]]
    .assert_eq(&found.err);
    let times = fs::read_to_string(folder.join("times.toml")).unwrap();
    fs::write(folder.join("times.toml"), times.replace("\"uav.detect\" = 30\n", "")).unwrap();
    let found = run(&folder, &["--cpus"]);
    assert_eq!((found.code, found.out.as_str()), (1, ""));
    expect![[r#"
        mauve: Flight cannot be tuned, because its activities are not analysed with any values:
          `detector`: no time for codel `uav.detect`
    "#]]
    .assert_eq(&found.err);
    assert_eq!(run(&folder, &[]).code, 2);
}
