//! From the running robot to its response times: the sample robot, with codels that take known random times, is generated, built,
//! recorded by LTTng, imported, estimated and analysed; and a codel that becomes slower is found in a second recording.
//!
//! The robot runs on the virtual clock, and LTTng records that clock: another program that uses this computer's CPUs changes nothing,
//! and each run is the same.
//!
//! `tests/run` installs the tools; without them this test fails with a message.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_orocos::{Programs, packages_with_stubs, standalone};
use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};
use mauve_tests::{Recorder, files_in, models};
use mauve_timing::{Level, Table};
use serde_json::Value;

use crate::MAUVE;

/// The timing table of the robot.
const TABLE: &str = "timing/p3dx.toml";

/// The library that lets LTTng record the virtual clock.
const CLOCK: &str = "libvirtual_trace.so";

/// The part of a codel's time in the table of the robot that it takes at least, and that a mean execution takes more.
const LEAST: f64 = 0.2;
const MORE: f64 = 0.04;

/// Each codel takes a part of its time in the table and an exponential time more. The codel that the environment names takes ten times
/// as long.
const SPEND: &str = r#"#pragma once
#include <cstdlib>
#include <cstring>
#include <functional>
#include <random>
#include <string>

#include "context.hpp"
#include "timeline.hpp"

inline void spend(const char* codel, double least, double more) {
  // The robot is configured without activities.
  if (mauve::present_context() == nullptr) return;
  static thread_local std::mt19937_64 random(std::hash<std::string>()(codel));
  static const char* const slow = std::getenv("SLOW");
  double length = least + std::exponential_distribution<double>(1 / more)(random);
  if (slow != nullptr && std::strcmp(slow, codel) == 0) length *= 10;
  mauve::timeline().spend(*mauve::present_context()->worker, static_cast<mauve::Nanoseconds>(length));
}
"#;

/// The time of a codel at a level in nanoseconds.
fn time(table: &Table, level: Level, key: &str) -> Option<f64> {
    let entry = table.codels.iter().find(|it| it.key == key)?;
    Some(table.time(entry.value.as_ref()?, level)?.as_nanos() as f64)
}

/// Writes the packages of the robot with such codels, builds its program, and returns the path. It knows no execution times.
fn build_robot(folder: &Path, table: &Table) -> PathBuf {
    let db = Database::default();
    let texts = files_in(&models().join("p3dx"))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|it| it != "md"));
    let text_of = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).unwrap();
        if path.ends_with(TABLE) { text[..text.find("[codel]").unwrap()].to_owned() } else { text }
    };
    let workspace =
        Workspace::of_texts(&db, models().join("p3dx"), texts.map(|path| (path.clone(), text_of(&path))));
    let project = projects(&db, workspace)[0];
    let mut all = names_of(&db, project).all.iter();
    let deployment = *all.find(|it| it.kind(&db) == Kind::Deployment).unwrap();
    let mut packages = packages_with_stubs(&db, project, deployment).expect("a model without mistakes");
    packages.push(
        standalone(&db, project, Some(deployment), false, Programs::Whole).expect("a model without mistakes"),
    );
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
                    text.insert_str(0, "#include \"spend.hpp\"\n");
                }
            }
            files.push((format!("{}/{}", package.name, file.path), text));
        }
    }
    files.push(("spend.hpp".to_owned(), SPEND.to_owned()));
    mauve_tests::write(folder, &files);
    let built = folder.join("build");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(folder.join("standalone")).arg("-B").arg(&built);
    run(configure.args([
        format!("-DMAUVE_PACKAGES={}", folder.display()),
        format!("-DCMAKE_CXX_FLAGS=-I{} -I{}", runtime_sources().join("src").display(), folder.display()),
        // Others build each file by itself.
        "-DCMAKE_UNITY_BUILD=ON".to_owned(),
        "-DCMAKE_BUILD_TYPE=None".to_owned(),
        "-DMAUVE_TRACING=ON".to_owned(),
    ]));
    run(&mut build(&built));
    built.join("exploration-P3dxDeployment")
}

/// Builds the library that lets LTTng record the virtual clock, and returns the variables for its processes.
fn virtual_clock(folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let (library, clock) = (folder.join(CLOCK), folder.join("clock"));
    let runtime = runtime_sources();
    let mut compiler = Command::new(COMPILERS[0]);
    compiler.args(["-std=c++14", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", "-o"]).arg(&library);
    compiler.arg("-I").arg(runtime.join("src")).arg("-I").arg(runtime.join("include"));
    run(compiler.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/orocos/virtual_trace.cpp")));
    std::fs::write(&clock, [0; 8]).unwrap();
    std::fs::set_permissions(&clock, Permissions::from_mode(0o666)).unwrap();
    vec![
        ("VIRTUAL_CLOCK", clock),
        ("LTTNG_UST_CLOCK_PLUGIN", library.clone()),
        ("LTTNG_UST_GETCPU_PLUGIN", library),
        // No event is lost, however fast the clock is.
        ("LTTNG_UST_ALLOW_BLOCKING", PathBuf::from("1")),
    ]
}

/// Runs the robot for some seconds of the virtual clock, and returns its recording.
fn record(recorder: &mut Recorder, program: &Path, seconds: u32, slow: &str) -> PathBuf {
    recorder.record();
    let mut robot = recorder.command(program);
    robot.args(["--simulate-time", "--for", &format!("{seconds}s")]);
    let robot = robot.env("SLOW", slow).env("LD_PRELOAD", recorder.folder().join(CLOCK)).output().unwrap();
    let said = String::from_utf8_lossy(&robot.stderr);
    // 1 is a missed deadline: a codel may be slow.
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
    let mut recorder = Recorder::start_with(virtual_clock);
    let folder = recorder.folder().to_owned();
    let project = folder.join("p3dx");
    for path in files_in(&models().join("p3dx")) {
        let to = project.join(path.strip_prefix(models().join("p3dx")).unwrap());
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(&path, &to).unwrap();
    }

    let table = project.join(TABLE);
    let before = Table::parse(&std::fs::read_to_string(&table).unwrap());
    let program = build_robot(&folder, &before);

    let recording = record(&mut recorder, &program, 300, "");
    let imported = mauve(&folder, &["trace", "import", recording.to_str().unwrap(), "-o", "robot.samples"]);
    assert!(imported.status.success(), "{}", String::from_utf8_lossy(&imported.stderr));
    let estimated = mauve(&folder, &["pwcet", "robot.samples", "-o", "p3dx/timing/p3dx.toml", "--replace"]);
    assert!(matches!(estimated.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&estimated.stderr));

    // The bound of each measured codel is above the true quantile; all other times stay.
    let after = Table::parse(&std::fs::read_to_string(&table).unwrap());
    assert!(after.errors.is_empty() && after.levels == before.levels, "{:?}", after.errors);
    let level = after.levels[1];
    let measured: BTreeSet<&str> = after.measured.iter().map(|it| it.key.as_str()).collect();
    // All but those that run rarely.
    assert!(measured.len() >= 20, "{measured:?} {}", String::from_utf8_lossy(&estimated.stdout));
    for entry in &before.codels {
        let of = |table| time(table, level, &entry.key).expect("a time at each level");
        if measured.contains(entry.key.as_str()) {
            let quantile = of(&before) * (LEAST - MORE * level.as_f64().ln());
            assert!(of(&after) >= quantile, "{}: {} < {quantile}", entry.key, of(&after));
        } else {
            assert_eq!(of(&after), of(&before), "{}", entry.key);
        }
    }

    // The recording is as the model says, with the new times.
    let (found, document) = findings(&folder, &recording);
    assert!(found.is_empty(), "{found:#?}");
    let observed: BTreeMap<&str, &Value> = document["instances"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["instance"].as_str().unwrap(), it))
        .collect();
    assert!(observed["hokuyo"]["periods"].as_u64().unwrap() == 3000, "{observed:#?}");

    // 300 executions of a codel leave room for tails with which a CPU is overloaded at stricter levels.
    let analysed = mauve(&folder, &["wcrt", "p3dx", "--significance", "1e-3", "--format", "json"]);
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
    assert!(compared >= 8, "{observed:#?} {analysed:#}");

    let slow = record(&mut recorder, &program, 5, "kinematics.planar_distance");
    let (found, _) = findings(&folder, &slow);
    let of_slow =
        |it: &(String, String)| it.0 == "execution-time" && it.1.contains("`kinematics.planar_distance`");
    assert!(found.len() == 1 && found.iter().all(of_slow), "{found:#?}");
}
