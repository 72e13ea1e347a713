//! Pictures of chains: bars, the chain in the architecture, and the longest way of data that a search finds.

use std::path::PathBuf;

use mauve_tests::{Run, copy, mauve, models, scratch, test_name};
use serde_json::{Value, json};

use crate::MAUVE;

/// The sample robot, whose chain is late.
fn robot() -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    copy(&models().join("p3dx"), &folder);
    let config = folder.join("mauve.toml");
    let text = std::fs::read_to_string(&config).unwrap();
    std::fs::write(config, text.replace("latency = \"600 ms\"", "latency = \"500 ms\"")).unwrap();
    folder
}

fn run(arguments: &[&str]) -> Run {
    mauve(MAUVE, &robot(), arguments)
}

#[test]
fn a_bar_for_each_chain() {
    let found = run(&["chains", "--chain", "avoid", "--format", "text"]);
    assert_eq!((found.code, found.err.as_str()), (1, ""));
    expect_test::expect![[r#"
        P3dxDeployment at 1e-4: latency of chains

        avoid: ✗ ≤ 526 / 500 ms
          hokuyo      ░░░░░░░░░░░░ 100 ms
          guidance                ░░░░░░░░░░░███████ 160 ms
          switch                                    ░░░░░░░░░░░░██████ 156 ms
          p3dx_driver                                                 ░░░░░░░░░░░█ 110 ms

        ░ waits for a release  ▓ in the buffer  ▒ periods before the write  █ runs until the write
    "#]]
    .assert_eq(&found.out);
    let svg = run(&["chains", "--format", "svg"]).out;
    let place = "data-hop=\"1\" data-place=\"exploration_architecture.mal:";
    for part in
        ["✗ ≤ 526 / 500 ms", "limit 500 ms", "class=\"overrun\"", "? no bound", "and 2 more reasons", place]
    {
        assert!(svg.contains(part), "{part} in {svg}");
    }
}

#[test]
fn a_chain_in_the_architecture() {
    let lit = |chain: &str| {
        let json: Value =
            serde_json::from_str(&run(&["graph", "--chain", chain, "--format", "json"]).out).unwrap();
        let of = |list: &str, name: &str| -> Vec<String> {
            let all = json[list].as_array().unwrap().iter().filter(|it| it["lit"] == true);
            all.map(|it| it[name].as_str().unwrap().to_owned()).collect()
        };
        (of("nodes", "instance"), of("edges", "sourceFeature"))
    };
    let (mut nodes, mut edges) = lit("avoid");
    nodes.sort();
    edges.sort();
    assert_eq!(nodes, ["guidance", "hokuyo", "p3dx_driver", "switch"]);
    assert_eq!(edges, ["command", "command", "scan"]);
    let svg = run(&["graph", "--chain", "avoid", "--format", "svg"]).out;
    assert_eq!(
        (svg.matches("passed\" data-instance").count(), svg.matches("class=\"link worst\"").count()),
        (4, 3)
    );
    assert!(run(&["graph", "--chain", "avoid"]).out.contains("│ » hokuyo: Hokuyo"));
    let found = run(&["graph", "--chain", "x"]);
    assert_eq!(found.code, 2);
    assert!(found.err.contains("no chain `x` in P3dxDeployment: `mauve chains` lists them"), "{}", found.err);
}

#[test]
fn the_longest_way_of_data() {
    let found = run(&["simulate", "--worst-chain", "avoid"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    let way = found.out.split_once("  avoid: ").unwrap().1;
    expect_test::expect![[r#"
        the longest way found takes 459.593 ms of at most 526 ms, of 624 schedules
          instance     arrives  read by job  written by job  written
          hokuyo             0            6               6      143
          guidance         143            7               7      260
          switch           260            9               9      360
          p3dx_driver      360           10              10  459.593
    "#]]
    .assert_eq(way);
    assert_eq!(run(&["simulate", "--worst-chain", "avoid", "--seed", "1"]).out, found.out);

    let json: Value =
        serde_json::from_str(&run(&["simulate", "--worst-chain", "avoid", "--format", "json"]).out).unwrap();
    let way = &json["way"];
    assert_eq!((&way["chain"], &way["bound"]), (&json!("avoid"), &json!(526)));
    let latency = way["latency"].as_f64().unwrap();
    assert!(latency > 400.0 && latency <= 526.0, "{way}");
    // The jobs are in the schedule, and data arrives where the one before was written.
    let passes = way["passes"].as_array().unwrap();
    for (pass, next) in passes.iter().zip(&passes[1..]) {
        let job = |number: &Value| {
            json["jobs"]
                .as_array()
                .unwrap()
                .iter()
                .find(|it| it["instance"] == pass["instance"] && it["job"] == *number)
                .unwrap()
        };
        assert_eq!((&job(&pass["writes"])["end"], &next["arrival"]), (&pass["write"], &pass["write"]));
        assert!(job(&pass["reads"])["end"].as_f64() > pass["arrival"].as_f64());
    }

    let svg = run(&["simulate", "--worst-chain", "avoid", "--format", "svg"]).out;
    assert_eq!(svg.matches("class=\"mark worst\"").count(), 4);
    let text = run(&["simulate", "--worst-chain", "avoid", "--format", "text"]).out;
    assert_eq!((text.matches('●').count(), text.matches('◆').count()), (5, 5), "{text}");
    let events = run(&["simulate", "--worst-chain", "avoid", "--format", "perfetto"]).out;
    let events: Value = serde_json::from_str(&events).unwrap();
    let events = events["traceEvents"].as_array().unwrap();
    let ends = |phase: &str| events.iter().filter(|it| it["ph"] == phase && it["name"] == "avoid").count();
    assert_eq!(ends("s"), ends("f"));
    assert!(ends("s") >= 3);
    // Each end is in a slice of its thread.
    for end in events.iter().filter(|it| it["cat"] == "data") {
        let is_around = |it: &&Value| {
            let [ts, dur, at] = [&it["ts"], &it["dur"], &end["ts"]].map(|it| it.as_f64().unwrap_or_default());
            it["ph"] == "X" && it["tid"] == end["tid"] && it["pid"] == end["pid"] && ts <= at && at < ts + dur
        };
        assert!(events.iter().any(|it| is_around(&it)), "{end}");
    }
}

#[test]
fn chains_without_a_way() {
    for (arguments, why) in [
        (
            &["simulate", "--worst-chain", "x"][..],
            "no chain `x` in P3dxDeployment: `mauve chains` lists them",
        ),
        (
            &["simulate", "--worst-chain", "hokuyo.scan -> gmapping.slam_match"],
            "the chain `hokuyo.scan -> gmapping.slam_match` has no latency in P3dxDeployment: `mauve chains` says why",
        ),
        (&["simulate", "--worst-chain", "avoid", "--worst", "teleop"], "cannot be used with"),
        (
            &["graph", "--chain", "avoid", "--architecture", "ExplorationP3dxArchitecture"],
            "cannot be used with",
        ),
    ] {
        let found = run(arguments);
        assert_eq!((found.code, found.out.as_str()), (2, ""), "{arguments:?}");
        assert!(found.err.contains(why), "{}", found.err);
    }
}
