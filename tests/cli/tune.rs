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
    let rows = found["activities"].as_array().unwrap().iter();
    rows.map(|it| (it["instance"].as_str().unwrap().to_owned(), it["response"].clone())).collect()
}

#[test]
fn a_drone_without_priorities_and_cpus_meets_all_deadlines_after_one_command() {
    let folder = drone();
    assert_eq!(mauve(MAUVE, &folder, &["wcrt"]).code, 1);
    let found = run(&folder, &["--priorities", "--cpus"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    expect![[r#""#]].assert_eq(&found.out);
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
    expect![[r#""#]].assert_eq(&found.out);
    // Priorities alone do not help.
    let found = run(&folder, &["--priorities", "--significance", "1e-5", "--apply"]);
    assert_eq!(found.code, 1);
    expect![[r#""#]].assert_eq(&found.out);
}

#[test]
fn what_cannot_be_tuned_is_said() {
    let folder = drone();
    let found = run(&folder, &["--cpus", "--pin", "moters"]);
    assert_eq!((found.code, found.out.as_str()), (2, ""));
    expect![[r#""#]].assert_eq(&found.err);
    let times = fs::read_to_string(folder.join("times.toml")).unwrap();
    fs::write(folder.join("times.toml"), times.replace("\"uav.detect\" = 30\n", "")).unwrap();
    let found = run(&folder, &["--cpus"]);
    assert_eq!((found.code, found.out.as_str()), (1, ""));
    expect![[r#""#]].assert_eq(&found.err);
    assert_eq!(run(&folder, &[]).code, 2);
}
