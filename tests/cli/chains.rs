//! `mauve chains`: how long data takes from sensors to actuators, or why there is no bound.

use std::path::{Path, PathBuf};

use expect_test::expect;
use mauve_tests::{Run, mauve, models, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

const ROBOT: &str = "
codel look(out scan: int): void
codel plan(in scan: int): int
codel drive(in order: int): void
shell Eye { output port scan: int }
shell Brain { input port scan: int  output port order: int }
shell Wheels { input port order: int }
core EyeCore(Eye) { var seen: int; update = { look(seen); write(scan, seen); } }
core BrainCore(Brain) { var seen: int; update = { read(scan, seen); write(order, plan(seen)); } }
core WheelsCore(Wheels) { var wanted: int; update = { read(order, wanted); drive(wanted); } }
component Camera(Eye, EyeCore)
component Planner(Brain, BrainCore)
component Base(Wheels, WheelsCore)
architecture A {
  instance camera: Camera  instance planner: Planner  instance base: Base
  connection camera.scan -> planner.scan  connection planner.order -> base.order
}
deployment Robot {
  architecture A
  activity camera { priority = 3 period = 10 affinity = 1 }
  activity planner { priority = 2 period = 20 affinity = 2 }
  activity base { PRIORITY affinity = 4 }
}
";

/// A folder with the robot, what `base` has, and more in `mauve.toml`.
fn robot(name: &str, base: &str, config: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let config = format!("timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n{config}");
    let times = "[codel]\nlook = 1\nplan = 2\ndrive = 3\n";
    let model = ROBOT.replace("PRIORITY", base);
    write(&folder, &[("robot.mal", model.as_str()), ("mauve.toml", config.as_str()), ("times.toml", times)]);
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["chains"], arguments].concat())
}

const PERIODIC: &str = "priority = 1 period = 30";

#[test]
fn a_row_for_each_chain() {
    let chains = "[chains.steer]\nfrom = 'look'\nto = 'drive'\nlatency = '70 ms'\n\
                  [chains.see]\nfrom = 'camera'\nto = 'planner'\nlatency = '30 ms'\n";
    let folder = robot("limits", PERIODIC, chains);
    let found = run(&folder, &[]);
    assert_eq!((found.code, found.err.as_str()), (1, ""), "one is late");
    expect![[r#"
        Robot: latency of chains in ms at 1e-4
          chain                      age at write  latency / limit
          see                                  13  ✗ ≤ 33 / 30 ms   ▰▰▰▰▰▰   110 %
          steer                                36  ! ≤ 66 / 70 ms   ▰▰▰▰▰▱  94.3 %
          camera.scan -> base.drive            36  ≤ 66 ms
          no data takes longer, if the 3 execution times hold and no codel waits
    "#]]
    .assert_eq(&found.out);
    // As for a missed deadline, the code is generated: it may run all the same.
    let generated = mauve(MAUVE, &folder, &["generate", "--out", "out"]);
    assert_eq!(generated.code, 0, "{}", generated.out);
    let found = run(&folder, &["--chain", "steer"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#"
        Robot: latency of chains in ms at 1e-4
          chain  age at write  latency / limit
          steer            36  ! ≤ 66 / 70 ms   ▰▰▰▰▰▱  94.3 %

                                       wait  buffer  periods  run  sum
          camera                         10       0        0    1   11
          camera.scan -> planner.scan    20       0        0    2   22
          planner.order -> base.order    30       0        0    3   33
          steer                                                     66
          no data takes longer, if the 3 execution times hold and no codel waits
    "#]]
    .assert_eq(&found.out);
    let found = run(&folder, &["--format", "csv", "--significance", "1e-3"]);
    expect![[r#"
        deployment,significance,chain,from,to,latency_ms,age_at_write_ms,limit_ms,status,reasons,root
        Robot,1e-3,see,camera.look,planner.plan,33,13,30,late,,robot.mal
        Robot,1e-3,steer,camera.look,base.drive,66,36,70,met,,robot.mal
        Robot,1e-3,camera.scan -> base.drive,camera.scan,base.drive,66,36,,bounded,,robot.mal
    "#]]
    .assert_eq(&found.out);
    let wrong = run(&folder, &["--chain", "sterr"]);
    assert_eq!((wrong.code, wrong.out.as_str()), (2, ""));
    assert_eq!(wrong.err, "mauve: no chain `sterr`; did you mean `steer`?\n");
    let wrong = run(&folder, &["--deployment", "Boat"]);
    assert_eq!((wrong.code, wrong.err.as_str()), (2, "mauve: no deployment `Boat`: there is Robot\n"));
}

#[test]
fn a_chain_without_a_bound_has_its_reason() {
    let folder = robot("background", "priority = background", "");
    let found = run(&folder, &[]);
    assert_eq!((found.code, found.err.as_str()), (0, ""), "no limit is declared");
    expect![[r#"
        Robot: latency of chains in ms at 1e-4
          chain                      age at write  latency / limit
          camera.scan -> base.drive             —  ? `base` is in the background
    "#]]
    .assert_eq(&found.out);
    let limited = robot(
        "limited",
        "priority = background",
        "[chains.c]\nfrom = 'look'\nto = 'drive'\nlatency = '1 s'\n",
    );
    assert_eq!(run(&limited, &[]).code, 1);
}

#[test]
fn the_document_of_the_sample() {
    let found = run(&models().join("p3dx"), &["--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    let all = document["chains"].as_array().unwrap();
    let avoid = &all[0];
    assert_eq!((avoid["name"].as_str(), avoid["latency"].as_u64()), (Some("avoid"), Some(526)));
    assert_eq!((avoid["status"].as_str(), avoid["limit"].as_u64()), (Some("met"), Some(600)));
    let hops = avoid["hops"].as_array().unwrap();
    let parts = ["wait", "periods", "buffer", "run"];
    let sum: f64 = hops.iter().flat_map(|it| parts.map(|part| it[part].as_f64().unwrap())).sum();
    assert_eq!((hops.len(), sum), (4, 526.0));
    assert_eq!(hops[1]["connection"], "hokuyo.scan -> guidance.scan");
    for chain in all {
        let has_reasons = !chain["reasons"].as_array().unwrap().is_empty();
        assert_eq!(chain["latency"].is_null(), has_reasons, "{chain}");
    }
}

/// The data of a chain is not kept by a base that writes what it remembers after newer data: as the editor's hover, the table and the
/// document say so.
#[test]
fn an_effect_that_may_show_older_data_is_named() {
    let folder = robot("keeps", PERIODIC, "");
    let found = run(&folder, &["--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    assert!(document["chains"][0]["not_lasting"].is_null(), "{}", found.out);
    let older = ROBOT
        .replace("var wanted: int; update", "var wanted: int; var last: int = 0; update")
        .replace("drive(wanted); }", "drive(wanted); drive(last); last = wanted; }")
        .replace("PRIORITY", PERIODIC);
    write(&folder, &[("robot.mal", older.as_str())]);
    let found = run(&folder, &[]);
    let said = "  camera.scan -> base.drive: base may overwrite the effect: update writes older data\n";
    assert!(found.out.contains(said) && found.code == 0, "{}", found.out);
    let document: Value = serde_json::from_str(&run(&folder, &["--format", "json"]).out).unwrap();
    let chain = &document["chains"][0];
    assert_eq!(chain["not_lasting"], "base may overwrite the effect: update writes older data");
    assert!(chain["latency"].is_number());
}

/// What `mauve check` says of a chain without a latency: where, and what to do.
#[test]
fn a_broken_chain_has_its_place_and_its_remedy() {
    let plan = "update = { read(scan, seen); if (seen > 5) then { write(order, plan(seen)); } else { } }";
    let model = ROBOT
        .replace("update = { read(scan, seen); write(order, plan(seen)); }", plan)
        .replace("PRIORITY", PERIODIC);
    let folder = robot("condition", PERIODIC, "[chains.steer]\nfrom = 'look'\nto = 'drive'\n");
    write(&folder, &[("robot.mal", &model)]);
    let found = run(&folder, &["--chain", "steer"]).out;
    assert!(found.contains("\n    robot.mal:9: `planner` may skip the write here: `seen > 5`\n"), "{found}");
    let remedy =
        "pass what the condition tests to the codel as a parameter, or write the data on both branches";
    assert!(found.contains(&format!("\n  help: {remedy}\n")), "{found}");
    let checked = mauve(MAUVE, &folder, &["check"]).out;
    assert!(checked.contains(&format!("a condition is not known; {remedy}")), "{checked}");
    // Without a name, only the first reason of each chain is shown.
    assert!(run(&folder, &[]).out.contains("\n  `mauve chains --chain steer` says where, and what to do\n"));
}

/// The latency of a network is an assumption of the chains that cross it only.
#[test]
fn a_link_that_no_chain_crosses_is_not_assumed() {
    let config = "ros2 = { discovery = 'subnet', gateway = { priority = 20, period = '5 ms', cpus = [4] } }
        host.eyes = { activities = ['camera'], cpus = 4 }
        host.head = { activities = ['planner', 'base'], cpus = 4 }
        link.'eyes-head'.latency = '2 ms'
        chains.steer = { from = 'look', to = 'drive' }
        chains.move = { from = 'plan', to = 'drive' }\n";
    let folder = robot("hosts", PERIODIC, config);
    let times = "[codel]\nlook = 1\nplan = 2\ndrive = 3\n[access]\n\"ros2.camera.scan\" = 0.1\n\"ros2.planner.scan\" = 0.1\n";
    write(&folder, &[("times.toml", times)]);
    let said = |chain: &str| run(&folder, &["--chain", chain]).out;
    let assumed = "assumption: between eyes and head";
    assert!(said("steer").contains(assumed), "{}", said("steer"));
    assert!(
        said("move").contains("no data takes longer") && !said("move").contains(assumed),
        "{}",
        said("move")
    );
}

#[test]
fn a_late_chain_names_throttling() {
    let chain = "[chains.steer]\nfrom = 'look'\nto = 'drive'\nlatency = '30 ms'\n";
    let folder = robot("throttled", PERIODIC, chain);
    let named = "; real-time throttling is in the response times: set `kernel.sched_rt_runtime_us=-1`";
    let found = mauve(MAUVE, &folder, &["check"]).out;
    assert!(found.contains("chain `steer` is too slow") && !found.contains(named), "{found}");
    let config = std::fs::read_to_string(folder.join("mauve.toml")).unwrap().replace("= false", "= true");
    write(&folder, &[("mauve.toml", &config)]);
    let found = mauve(MAUVE, &folder, &["check"]).out;
    assert!(found.contains(named), "{found}");
}
