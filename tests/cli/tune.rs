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
        --- a/uav.mal
        +++ b/uav.mal
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
        --- a/deployment.mal
        +++ b/deployment.mal
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

        no priority assignment meets every deadline: `p3dx_driver`, `hokuyo`, `switch`, `guidance`, `control`, `teleop` and
        `navigation` cannot be scheduled together (no fewer activities are such a set). Each of these alone would be enough:
          `p3dx_driver` takes at most 9.3 ms instead of 11 ms, or has a period of at least 125 ms instead of 100 ms
          `hokuyo` takes at most 42.3 ms instead of 44 ms, or has a period of at least 109 ms instead of 100 ms
          `switch` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `guidance` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `control` takes at most 1.3 ms instead of 3 ms, or has a period of at least 250 ms instead of 100 ms
          `teleop` takes at most 5.3 ms instead of 7 ms, or has a period of at least 143 ms instead of 100 ms
          `navigation` takes at most 280 ms instead of 297 ms, or has a period of at least 1089 ms instead of 1000 ms

        nothing is written; `--partly` gives up deadlines, and writes values with which all others are met
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

/// Two robots with one deployment: the arm, and the same on a stand that has slower or faster codels and may have another program.
fn arms(deployment: &str, [arm, stand]: [&str; 2], of_stand: &str) -> PathBuf {
    let folder = folder("arms");
    let library = "codel hold(): void\ncodel grip(): void\ncodel show(): void\nshell Empty { }
        core Holds(Empty) { update = { hold(); } }\ncore Grips(Empty) { update = { grip(); } }
        core Shows(Empty) { update = { show(); } }
        component Holder(Empty, Holds) component Gripper(Empty, Grips) component Panel(Empty, Shows)
        architecture Arm { instance holder: Holder instance gripper: Gripper instance panel: Panel }\n";
    let root = |include: &str, others: &str| {
        (
            format!("include \"{include}\"\n"),
            format!(
                "project.root = \"robot.mal\"\ntiming.tables = [\"times.toml\"]\n[platform]\ncpus = 2\nrt_throttling = false\n{others}"
            ),
        )
    };
    let (arm_model, arm_config) = root("activities.mal", "");
    let (stand_model, stand_config) = root("../activities.mal", of_stand);
    let times = |times: &str| format!("unit = \"ms\"\n[codel]\n{times}\n");
    write(
        &folder,
        &[
            ("parts.mal", library),
            ("activities.mal", &format!("include \"parts.mal\"\n{deployment}")),
            ("robot.mal", &arm_model),
            ("mauve.toml", &arm_config),
            ("times.toml", &times(arm)),
            ("stand/robot.mal", &stand_model),
            ("stand/mauve.toml", &stand_config),
            ("stand/times.toml", &times(stand)),
        ],
    );
    folder
}

const ACTIVITIES: &str = "deployment Workshop { architecture Arm
  activity holder { affinity = 1 priority = 3 period = 40 deadline = 20 }
  activity gripper { affinity = 1 priority = 8 period = 40 deadline = 30 }
  activity panel { affinity = 1 priority = 1 period = 400 }
}
";

/// A program on the second CPU of the stand.
const CAMERA: &str = "[[platform.other]]\nname = \"camera\"\npriority = 80\ncpus = [2]\nperiod = \"80 ms\"\ntime = \"70 ms\"\n";

/// Returns the activities of the projects in `folder`, each with whether its deadline is met.
fn met(folder: &Path) -> Vec<(String, bool)> {
    let found = mauve(MAUVE, folder, &["wcrt", "--format", "json"]);
    let found: Value = serde_json::from_str(&found.out).unwrap_or_else(|why| panic!("{why}: {found:?}"));
    let mut all = Vec::new();
    let deployments = found.as_array().cloned().unwrap_or_else(|| vec![found.clone()]);
    for (index, of) in deployments.iter().enumerate() {
        for it in of["results"][0]["activities"].as_array().unwrap() {
            all.push((format!("{index} {}", it["instance"]), it["status"] == "met"));
        }
    }
    all
}

#[test]
fn values_that_another_project_cannot_have_are_not_written() {
    let folder = arms(ACTIVITIES, ["hold = 22\ngrip = 25\nshow = 1", "hold = 4\ngrip = 6\nshow = 1"], CAMERA);
    let text = || fs::read_to_string(folder.join("activities.mal")).unwrap();
    let before = text();
    write(&folder, &[("activities.mal", &before.replace("deadline = 20", "deadline = 30"))]);
    let (before, met_before) = (text(), met(&folder));
    let found = run(&folder, &["--cpus", "--apply"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""));
    expect![[r#"
        Workshop of robot.mal at 1e-4: 1 → 3 of 3 deadlines met
          activity  before                        after
          holder    ✗ CPU 1 overloaded (117.5 %)  ✓ 22 / 30 ms   met now
          gripper   ✓ 25 / 30 ms                  ✓ 25 / 30 ms   CPU 1 → 2
          panel     ✗ CPU 1 overloaded (117.8 %)  ✓ 23 / 400 ms  met now
          CPU 1 utilisation: 117.8 % → 55.2 %
          CPU 2 utilisation: – → 62.5 %

        --- a/activities.mal
        +++ b/activities.mal
        @@ -1,6 +1,6 @@
         include "parts.mal"
         deployment Workshop { architecture Arm
           activity holder { affinity = 1 priority = 3 period = 40 deadline = 30 }
        -  activity gripper { affinity = 1 priority = 8 period = 40 deadline = 30 }
        +  activity gripper { affinity = 2 priority = 8 period = 40 deadline = 30 }
           activity panel { affinity = 1 priority = 1 period = 400 }
         }

        Workshop of stand/robot.mal at 1e-4: 3 → 2 of 3 deadlines met
          activity  before         after
          holder    ✓ 10 / 30 ms   ✓ 4 / 30 ms                   earlier
          gripper   ✓ 6 / 30 ms    ✗ CPU 2 overloaded (102.5 %)  no longer met; CPU 1 → 2
          panel     ✓ 11 / 400 ms  ✓ 5 / 400 ms                  earlier
          CPU 1 utilisation: 25.2 % → 10.2 %
          CPU 2 utilisation: 87.5 % → 102.5 %

        these values are not written: `stand/robot.mal` has the deployment too, and there `gripper` would not be met any more

        Workshop of stand/robot.mal at 1e-4: 3 of 3 deadlines met, as before
          nothing changes

        nothing is written
    "#]].assert_eq(&found.out);
    assert_eq!((text(), met(&folder)), (before, met_before));
    let found = document(&run(&folder, &["--cpus", "--format", "json"]));
    assert_eq!(found[0]["met"], false);
    assert!(
        found[0]["refused"][0].as_str().unwrap().contains("there `gripper` would not be met any more"),
        "{found}"
    );
    assert_eq!(found[1]["met"], true);
    let diff = run(&folder, &["--cpus", "--diff"]);
    assert_eq!((diff.code, diff.out.as_str()), (1, ""));
    assert!(diff.err.contains("`stand/robot.mal` has the deployment too, and there "), "{diff:?}");
    // The stand has no second CPU.
    let config = fs::read_to_string(folder.join("stand/mauve.toml")).unwrap();
    let config = config.replace(CAMERA, "").replace("cpus = 2", "cpus = 1");
    write(&folder, &[("stand/mauve.toml", &config)]);
    let found = run(&folder, &["--cpus", "--apply"]);
    assert_eq!(found.code, 1);
    let why = "these values are not written: `stand/robot.mal` has the deployment too, and there affinity names CPU 2, and mauve.toml has \
               CPU 1";
    assert!(found.has(why), "{}", found.out);
}

#[test]
fn values_that_all_projects_can_have_are_written_once() {
    let other = ACTIVITIES.replace("deadline = 20", "deadline = 30");
    let both = format!("{other}{}", other.replace("Workshop", "Other"));
    let folder = arms(&both, ["hold = 22\ngrip = 25\nshow = 1", "hold = 4\ngrip = 6\nshow = 1"], "");
    let found = run(&folder, &["--cpus", "--apply"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""), "{}", found.out);
    assert!(found.out.contains("these are the figures with the values for `robot.mal`"), "{}", found.out);
    assert!(found.out.ends_with("\nwritten: activities.mal\n"), "{}", found.out);
    assert!(met(&folder).iter().all(|(_, is_met)| *is_met), "{:?}", met(&folder));
}

#[test]
fn after_tuning_nothing_is_missed_that_was_met_in_any_project() {
    let (mut written, mut refused) = (0, 0);
    for seed in 0..30_u64 {
        let mut state = seed * 2_654_435_761 + 12_345;
        let mut below = |limit: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % limit
        };
        let mut deployment = "deployment Workshop { architecture Arm\n".to_owned();
        for name in ["holder", "gripper", "panel"] {
            let (period, deadline) = (20 + 10 * below(5), 10 + 5 * below(8));
            deployment += &format!(
                "  activity {name} {{ affinity = {} priority = {} period = {period} deadline = {} }}\n",
                1 + below(2),
                1 + below(9),
                deadline.min(period)
            );
        }
        let mut times =
            || format!("hold = {}\ngrip = {}\nshow = {}", 1 + below(20), 1 + below(20), 1 + below(10));
        let times = [times(), times()];
        let other = CAMERA.replace("70 ms", &format!("{} ms", 1 + below(70)));
        let other = if below(2) == 0 { "" } else { &other };
        let folder = arms(&(deployment + "}\n"), times.each_ref().map(String::as_str), other);
        let before = met(&folder);
        let aim = [&["--cpus"][..], &["--priorities"], &["--slack"], &["--periods"]][below(4) as usize];
        let found = run(&folder, &[aim, &["--apply"]].concat());
        let after = met(&folder);
        let is_no_worse = before.iter().zip(&after).all(|((_, before), (_, after))| !before || *after);
        assert!(is_no_worse, "{seed}: {before:?} {after:?} {found:?}");
        let is_refused = found.out.contains("these values are not written");
        let is_met = after.iter().all(|(_, is_met)| *is_met) && !is_refused;
        assert_eq!(found.code == 0, is_met, "{seed}: {after:?} {found:?}");
        written += usize::from(found.out.contains("\nwritten: "));
        refused += usize::from(is_refused);
    }
    assert!(written > 3 && refused > 3, "{written} written, {refused} refused");
}

/// Twelve activities with the priorities in the order of the text; the sixth executes longer than its deadline.
fn twelve(of_sixth: &str) -> PathBuf {
    let folder = folder("twelve");
    let each = |of: &dyn Fn(usize) -> String| (0..12).map(of).collect::<String>();
    let model = each(&|i| format!("codel f{i}(): int\n"))
        + "shell S { }\n"
        + &each(&|i| format!("core C{i}(S) {{ update = {{ f{i}(); }} }}\ncomponent K{i}(S, C{i})\n"))
        + &format!("architecture A {{ {} }}\n", each(&|i| format!("instance a{i}: K{i} ")))
        + "deployment D {\n  architecture A\n"
        + &each(&|i| {
            format!("  activity a{i} {{ priority = {} period = {} }} // {i}\n", i + 1, 10 * (i + 1))
        })
        + "}\n";
    let times = each(&|i| format!("f{i} = {}\n", if i == 5 { of_sixth } else { "0.3" }));
    write(
        &folder,
        &[
            ("m.mal", &model),
            ("mauve.toml", "timing.tables = [\"t.toml\"]\nplatform.rt_throttling = false\n"),
            ("t.toml", &format!("unit = \"ms\"\n[codel]\n{times}")),
        ],
    );
    folder
}

#[test]
fn where_one_of_twelve_cannot_be_met_the_others_are_with_partly() {
    let folder = twelve("70");
    let before = fs::read_to_string(folder.join("m.mal")).unwrap();
    let refused = run(&folder, &["--priorities", "--apply"]);
    assert_eq!(refused.code, 1);
    expect![[r#"
        D at 1e-4: 6 of 12 deadlines met, as before
          nothing changes

        no priority assignment meets every deadline: `a5` misses its deadline even if no other thread delays it. Each of these
        alone would be enough:
          `a5` takes at most 54 ms instead of 70 ms, or has a period of at least 77.8 ms instead of 60 ms

        nothing is written; `--partly` gives up deadlines, and writes values with which all others are met
    "#]].assert_eq(&refused.out);
    assert_eq!(fs::read_to_string(folder.join("m.mal")).unwrap(), before);
    let partly = document(&run(&folder, &["--priorities", "--partly", "--format", "json"]));
    assert_eq!((&partly["met"], &partly["given_up"]), (&Value::Bool(false), &serde_json::json!(["a5"])));
    let written = run(&folder, &["--priorities", "--partly", "--apply"]);
    assert_eq!(written.code, 1, "a deadline is missed all the same");
    assert!(
        written.out.ends_with("all other deadlines are met; that of `a5` is given up.\n\nwritten: m.mal\n"),
        "{}",
        written.out
    );
    let late: Vec<String> = met(&folder).into_iter().filter(|it| !it.1).map(|it| it.0).collect();
    assert_eq!(late, ["0 \"a5\""]);
    // With an execution time that fits, nothing is given up.
    let folder = twelve("50");
    let found = document(&run(&folder, &["--priorities", "--partly", "--format", "json"]));
    assert_eq!((&found["met"], &found["given_up"]), (&Value::Bool(true), &Value::Null));
}

/// A thread has one priority, and each of its activities a deadline.
#[test]
fn all_late_activities_of_a_thread_are_given_up() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let model = "codel work(): int
shell S { }
core Work(S) { update = { work(); } }
component Worker(S, Work)
architecture A { instance a: Worker  instance b: Worker  instance c: Worker  instance d: Worker }
deployment D {
  architecture A
  activity a { thread = t  priority = 1  period = 100  deadline = 5 }
  activity b { thread = t  priority = 1  period = 100  deadline = 50 }
  activity c { thread = t  priority = 1  period = 100  deadline = 6 }
  activity d { priority = 2  period = 100 }
}
";
    write(&folder, &[("m.mal", model), ("mauve.toml", "assume.codel = \"10 ms\"\n")]);
    let found = document(&run(&folder, &["--priorities", "--partly", "--format", "json"]));
    assert_eq!(found["given_up"], serde_json::json!(["a", "c"]));
    let said = run(&folder, &["--priorities", "--partly"]);
    assert!(said.has("all other deadlines are met; those of `a` and `c` are given up."), "{said:?}");
}

#[test]
fn other_periods_leave_comments_and_deadlines_that_differ() {
    let folder = twelve("2");
    let model = fs::read_to_string(folder.join("m.mal")).unwrap();
    let model = model.replace("period = 10 }", "period = 10 /* of the base */ deadline = 8 }");
    let model = model
        .replace("period = 20 }", "deadline = 20 /* as the period */\n  period = 20 // of the camera\n }");
    fs::write(folder.join("m.mal"), model).unwrap();
    let found = run(&folder, &["--periods", "--pin", "a5", "--diff"]);
    assert_eq!(found.code, 0);
    expect![[r#"
        --- a/m.mal
        +++ b/m.mal
        @@ -38,18 +38,18 @@
         architecture A { instance a0: K0 instance a1: K1 instance a2: K2 instance a3: K3 instance a4: K4 instance a5: K5 instance a6: K6 instance a7: K7 instance a8: K8 instance a9: K9 instance a10: K10 instance a11: K11  }
         deployment D {
           architecture A
        -  activity a0 { priority = 1 period = 10 /* of the base */ deadline = 8 } // 0
        -  activity a1 { priority = 2 deadline = 20 /* as the period */
        -  period = 20 // of the camera
        +  activity a0 { priority = 1 period = 8 /* of the base */ deadline = 8 } // 0
        +  activity a1 { priority = 2 deadline = 5.1 /* as the period */
        +  period = 5.1 // of the camera
          } // 1
        -  activity a2 { priority = 3 period = 30 } // 2
        -  activity a3 { priority = 4 period = 40 } // 3
        -  activity a4 { priority = 5 period = 50 } // 4
        +  activity a2 { priority = 3 period = 5 } // 2
        +  activity a3 { priority = 4 period = 5 } // 3
        +  activity a4 { priority = 5 period = 5 } // 4
           activity a5 { priority = 6 period = 60 } // 5
        -  activity a6 { priority = 7 period = 70 } // 6
        -  activity a7 { priority = 8 period = 80 } // 7
        -  activity a8 { priority = 9 period = 90 } // 8
        -  activity a9 { priority = 10 period = 100 } // 9
        -  activity a10 { priority = 11 period = 110 } // 10
        -  activity a11 { priority = 12 period = 120 } // 11
        +  activity a6 { priority = 7 period = 5 } // 6
        +  activity a7 { priority = 8 period = 5 } // 7
        +  activity a8 { priority = 9 period = 5 } // 8
        +  activity a9 { priority = 10 period = 5 } // 9
        +  activity a10 { priority = 11 period = 8 } // 10
        +  activity a11 { priority = 12 period = 8 } // 11
         }
    "#]].assert_eq(&found.out);
}

/// Ten activities on one CPU; one waits, and the orders are too many to analyse all. `first` has this deadline.
fn ten(name: &str, deadline: u32) -> PathBuf {
    let folder = folder(name);
    let names: Vec<String> =
        ["first", "second", "c", "d", "e", "f", "g", "h", "i", "j"].map(str::to_owned).into();
    let each = |of: &dyn Fn(&String) -> String| names.iter().map(of).collect::<String>();
    let model = format!(
        "{}shell S {{}}\n{}architecture A {{\n{}}}\ndeployment D {{\n  architecture A\n{}}}\n",
        each(&|it| format!("codel do_{it}(): void\n")),
        each(&|it| format!("core K{it}(S) {{ update = {{ do_{it}(); }} }}\ncomponent C{it}(S, K{it})\n")),
        each(&|it| format!("  instance {it}: C{it}\n")),
        each(&|it| {
            let fields = if it == "first" { format!("deadline = {deadline}  ") } else { String::new() };
            format!("  activity {it} {{ {fields}affinity = 1  priority = 1  period = 400 }}\n")
        }),
    );
    let times = format!("[codel]\n{}[wait]\ndo_first = 20\n", each(&|it| format!("do_{it} = 10\n")));
    let config = "timing.tables = [\"times.toml\"]\nplatform = { cpus = 1, rt_throttling = false }\n";
    write(&folder, &[("robot.mal", &*model), ("times.toml", &*times), ("mauve.toml", config)]);
    folder
}

/// No order makes an execution shorter than the deadline, however many orders there are.
#[test]
fn an_activity_that_is_late_alone_is_a_proof() {
    let found = run(&ten("late-alone", 29), &["--priorities"]);
    let said = "no priority assignment meets every deadline: `first` misses its deadline even if no other thread delays it";
    assert!(found.out.contains(said), "{}", found.out);
}

/// A codel that waits may execute for a shorter time as any other.
#[test]
fn a_shorter_time_of_a_codel_that_waits_is_found() {
    let folder = ten("late-wait", 29);
    let found = run(&folder, &["--priorities"]);
    assert!(found.out.contains("\n  `first` takes at most 9 ms instead of 10 ms"), "{}", found.out);
    let tried = mauve(MAUVE, &folder, &["wcrt", "--set", "first.priority=99", "--set", "do_first=9ms"]);
    assert!(tried.out.contains("29 / 29 ms"), "{}", tried.out);
}
