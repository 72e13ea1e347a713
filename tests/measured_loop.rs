//! From the running robot to its response times: the sample robot, with codels that take known random times, is generated, built,
//! recorded by LTTng, imported, estimated and analysed; and a codel that becomes slower is found in a second recording.
//!
//! `tests/run` installs the tools; without them this test fails with a message.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_orocos::{packages_with_stubs, standalone};
use mauve_tests::orocos::{build, run};
use mauve_tests::{Recorder, files_in, models};
use mauve_timing::{Level, Table};
use serde_json::Value;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");

/// The part of a codel's time in the table of the robot that it takes at least, and that a mean execution takes more.
const LEAST: f64 = 0.2;
const MORE: f64 = 0.04;

/// Each codel uses the CPU for a part of its time in the table and an exponential time more. The codel that the environment names takes
/// ten times as long.
const SPEND: &str = r#"#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <random>
#include <string>

inline void spend(const char* codel, double least, double more) {
  static thread_local std::mt19937_64 random(std::hash<std::string>()(codel));
  static const char* const slow = std::getenv("SLOW");
  double length = least + std::exponential_distribution<double>(1 / more)(random);
  if (slow != nullptr && std::strcmp(slow, codel) == 0) length *= 10;
  const auto now = [] {
    timespec used;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return used.tv_sec * 1e9 + used.tv_nsec;
  };
  for (const double end = now() + length; now() < end;) {
  }
}
"#;

/// The time of a codel at a level in nanoseconds.
fn time(table: &Table, level: Level, key: &str) -> Option<f64> {
    let entry = table.codels.iter().find(|it| it.key == key)?;
    Some(table.time(entry.value.as_ref()?, level)?.as_nanos() as f64)
}

/// Writes the packages of the robot with such codels, builds its program, and returns the path.
fn build_robot(folder: &Path, table: &Table) -> PathBuf {
    let db = Database::default();
    let texts = files_in(&models().join("p3dx"))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|it| it != "md"));
    let workspace = Workspace::of_texts(
        &db,
        models().join("p3dx"),
        texts.map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())),
    );
    let project = projects(&db, workspace)[0];
    let mut all = names_of(&db, project).all.iter();
    let deployment = *all.find(|it| it.kind(&db) == Kind::Deployment).unwrap();
    let mut packages = packages_with_stubs(&db, project, deployment).expect("a model without mistakes");
    packages.push(standalone(&db, project, Some(deployment)).expect("a model without mistakes"));
    let mut files = Vec::new();
    for package in &packages {
        for file in &package.files {
            let mut text = file.text.clone();
            if let Some(codel) = file.path.strip_prefix("src/codels/") {
                let key = format!("{}.{}", package.name, codel.trim_end_matches(".cpp"));
                if let Some(time) = time(table, table.levels[1], &key) {
                    let body = text.rfind(") {\n").expect("a function") + 4;
                    let (least, more) = (LEAST * time, MORE * time);
                    text.insert_str(body, &format!("  spend(\"{key}\", {least:?}, {more:?});\n"));
                    text.insert_str(0, SPEND);
                }
            }
            files.push((format!("{}/{}", package.name, file.path), text));
        }
    }
    mauve_tests::write(folder, &files);
    let built = folder.join("build");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(folder.join("standalone")).arg("-B").arg(&built);
    run(configure.args([format!("-DMAUVE_PACKAGES={}", folder.display()).as_str(), "-DMAUVE_TRACING=ON"]));
    run(build(&built).arg("-j2"));
    built.join("exploration-P3dxDeployment")
}

/// Runs the robot for some seconds, and returns its recording.
fn record(recorder: &mut Recorder, program: &Path, seconds: u32, slow: &str) -> PathBuf {
    recorder.record();
    let mut robot = recorder.real_time_command(program);
    let robot = robot.args(["--for", &format!("{seconds}s")]).env("SLOW", slow).output().unwrap();
    let said = String::from_utf8_lossy(&robot.stderr);
    // 1 is a missed deadline: this computer may have other work.
    assert!(matches!(robot.status.code(), Some(0 | 1)), "{}: {said}", robot.status);
    recorder.stop();
    recorder.output()
}

fn mauve(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(MAUVE).current_dir(folder).args(arguments).output().unwrap()
}

/// The findings of `mauve trace check`, as code and codel, and the whole document.
fn findings(folder: &Path, recording: &Path) -> (Vec<(String, String)>, Value) {
    let found = mauve(folder, &["trace", "check", "--format", "json", recording.to_str().unwrap(), "p3dx"]);
    assert!(matches!(found.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&found.stderr));
    let document: Value = serde_json::from_slice(&found.stdout).unwrap();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let findings = document["findings"].as_array().unwrap();
    (findings.iter().map(|it| (text(&it["code"]), text(&it["message"]))).collect(), document)
}

#[test]
fn orocos_measured_times_give_bounds_that_hold_and_a_slower_codel_is_found() {
    let mut recorder = Recorder::start();
    let folder = recorder.folder().to_owned();
    let project = folder.join("p3dx");
    for path in files_in(&models().join("p3dx")) {
        let to = project.join(path.strip_prefix(models().join("p3dx")).unwrap());
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(&path, &to).unwrap();
    }

    let table = project.join("timing/p3dx.toml");
    let before = Table::parse(&std::fs::read_to_string(&table).unwrap());
    let program = build_robot(&folder, &before);

    let recording = record(&mut recorder, &program, 23, "");
    let imported = mauve(&folder, &["trace", "import", recording.to_str().unwrap(), "-o", "robot.samples"]);
    assert!(imported.status.success(), "{}", String::from_utf8_lossy(&imported.stderr));
    let estimated = mauve(&folder, &["pwcet", "robot.samples", "-o", "p3dx/timing/p3dx.toml", "--replace"]);
    assert!(matches!(estimated.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&estimated.stderr));

    // The bound of each measured codel is above the true quantile; all other times stay.
    let after = Table::parse(&std::fs::read_to_string(&table).unwrap());
    assert!(after.errors.is_empty() && after.levels == before.levels, "{:?}", after.errors);
    let level = after.levels[1];
    let measured: BTreeSet<&str> = after.measured.iter().map(|it| it.key.as_str()).collect();
    // Those that run ten times in a second and more; the noise of this computer may give one of them no bound.
    assert!(measured.len() >= 3, "{measured:?} {}", String::from_utf8_lossy(&estimated.stdout));
    for entry in &before.codels {
        let of = |table| time(table, level, &entry.key).expect("a time at each level");
        if measured.contains(entry.key.as_str()) {
            let quantile = of(&before) * (LEAST - MORE * level.as_f64().ln());
            assert!(of(&after) >= quantile, "{}: {} < {quantile}", entry.key, of(&after));
        } else {
            assert_eq!(of(&after), of(&before), "{}", entry.key);
        }
    }

    // No response is above its bound, and no measured codel above its time. A time by hand may be too short on a noisy computer.
    let (found, document) = findings(&folder, &recording);
    let of = |code: &str, found: &[(String, String)]| -> Vec<String> {
        found.iter().filter(|it| it.0 == code).map(|it| it.1.clone()).collect()
    };
    let measured_too_short = |found: &[(String, String)]| {
        let too_short = of("execution-time", found);
        let is_measured = |it: &String| measured.iter().any(|key| it.contains(&format!("`{key}`")));
        too_short.into_iter().filter(is_measured).collect::<Vec<_>>()
    };
    assert!(measured_too_short(&found).is_empty(), "{found:#?}");
    for code in ["execution-of-period", "response", "path", "component", "unknown-codel", "unknown-program"] {
        assert!(of(code, &found).is_empty(), "{found:#?}");
    }
    let observed: BTreeMap<&str, &Value> = document["instances"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["instance"].as_str().unwrap(), it))
        .collect();
    assert!(observed["hokuyo"]["periods"].as_u64().unwrap() >= 200, "{observed:#?}");

    // 200 executions leave room for tails with which deadlines are missed. Here, the tail is known.
    let update = ["pwcet", "robot.samples", "-o", "p3dx/timing/p3dx.toml", "--tail", "exponential"];
    let estimated = mauve(&folder, &update);
    let analysed = mauve(&folder, &["wcrt", "p3dx", "--format", "json"]);
    let analysed: Value = serde_json::from_slice(&analysed.stdout).unwrap();
    let activities = analysed["results"][0]["activities"].as_array().unwrap();
    let mut compared = 0;
    for it in activities {
        let observed = &observed[it["instance"].as_str().unwrap()]["response"];
        if let Some((bound, observed)) = it["response"].as_f64().zip(observed.as_f64()) {
            assert!(observed <= bound, "{it} {observed}");
            compared += 1;
        }
    }
    assert!(compared >= 8, "{activities:#?} {}", String::from_utf8_lossy(&estimated.stdout));

    let slow = record(&mut recorder, &program, 5, "kinematics.planar_distance");
    let (found, _) = findings(&folder, &slow);
    let slow = "`kinematics.planar_distance`";
    assert!(of("execution-time", &found).iter().any(|it| it.contains(slow)), "{found:#?}");
    assert!(measured_too_short(&found).iter().all(|it| it.contains(slow)), "{found:#?}");
}
