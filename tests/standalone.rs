//! Deployments without Orocos: `mauve run` builds and runs the samples on the virtual clock and, where this user may, in real time.
//! Their response times are below their bounds; what goes wrong is said, and ends.
//!
//! `tests/run` installs CMake and the compilers; without them these tests fail with a message.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use mauve_tests::orocos::{RUNS_ONCE, build, run};
use mauve_tests::{files_in, models, scratch, write};
use serde_json::Value;

use crate::MAUVE;

pub(crate) fn folder(name: &str) -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &format!("programs/{name}"))
}

/// `mauve run` of a project, with a cache of this test.
pub(crate) fn mauve_run(project: &Path, cache: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(MAUVE);
    command.arg("run").arg(project).args(arguments).env("XDG_CACHE_HOME", cache).stdin(Stdio::null());
    command.envs(RUNS_ONCE).output().unwrap()
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A line of the table: instance, periods, response time, bound and verdict.
#[derive(Debug, PartialEq)]
struct Row {
    instance: String,
    periods: u64,
    response: f64,
    bound: Option<f64>,
    verdict: String,
}

fn rows(said: &str) -> Vec<Row> {
    let lines =
        said.lines().skip(2).take_while(|line| line.starts_with("  ") && line.matches("  ").count() > 5);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split("  ").map(str::trim).filter(|it| !it.is_empty()).collect();
        let [instance, _, _, _, periods, _, _, response, bound, _, verdict] = cells[..] else {
            panic!("{line}");
        };
        Row {
            instance: instance.to_owned(),
            periods: periods.parse().unwrap(),
            response: response.parse().unwrap(),
            bound: bound.parse().ok(),
            verdict: verdict.to_owned(),
        }
    };
    lines.map(row).collect()
}

/// Each instance has run, and has met its deadlines within its bound.
fn assert_within_bounds(said: &str, instances: usize) {
    let rows = rows(said);
    assert_eq!(rows.len(), instances, "{said}");
    for row in rows {
        assert!(row.periods > 0, "{said}");
        assert!(row.verdict == "background" || row.verdict == "✓ met", "{said}");
        assert!(row.bound.is_none_or(|bound| row.response <= bound), "{said}");
    }
}

/// The chains of the table: name, observed latency and bound, in ms.
fn latencies(said: &str) -> Vec<(String, Option<f64>, Option<f64>)> {
    let lines = said.lines().skip_while(|line| !line.starts_with("chains: ")).skip(2);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split("  ").map(str::trim).filter(|it| !it.is_empty()).collect();
        let [name, observed, _, bound, _, _] = cells[..] else { return None };
        Some((name.to_owned(), observed.parse().ok(), bound.parse().ok()))
    };
    lines.map_while(row).collect()
}

/// The chains and the connections of a recording.
fn checked(recording: &Path, project: &Path) -> Value {
    let mut check = Command::new(MAUVE);
    let found =
        check.args(["trace", "check", "--format", "json"]).arg(recording).arg(project).output().unwrap();
    serde_json::from_slice(&found.stdout).unwrap_or_else(|error| panic!("{error}: {}", text(&found.stderr)))
}

/// The samples, their instances, for how long they run, and a chain, if `mauve.toml` has none.
const CHAINS: [(&str, usize, &str, &str); 3] = [
    ("p3dx", 10, "300s", ""),
    (
        "shared_cpus",
        6,
        "30s",
        "[chains.map]\nfrom = \"guide.scan\"\nto = \"guide.update\"\nanswers = [\"guide.scan\"]\n",
    ),
    (
        "sorter",
        3,
        "30s",
        "[chains.see]\nfrom = \"sorter.expose\"\nto = \"camera.place\"\nanswers = [\"sorter.filter\"]\n",
    ),
];

#[test]
fn orocos_samples_keep_their_bounds_on_the_virtual_clock() {
    for (sample, instances, length, chain) in CHAINS {
        let cache = folder(sample);
        let (project, original) = (cache.join("project"), models().join(sample));
        for file in files_in(&original) {
            let mut text = fs::read_to_string(&file).unwrap();
            if file.ends_with("mauve.toml") {
                text = text + "\n" + chain;
            }
            write(&project, &[(file.strip_prefix(&original).unwrap().to_str().unwrap(), text.as_str())]);
        }
        let first = mauve_run(&project, &cache, &["--for", length, "--simulate-time"]);
        let (out, err) = (text(&first.stdout), text(&first.stderr));
        assert_eq!(first.status.code(), Some(0), "{out}\n{err}");
        assert_within_bounds(&out, instances);
        let trace = cache.join("trace");
        let arguments = ["--for", length, "--simulate-time", "--trace", trace.to_str().unwrap()];
        let second = mauve_run(&project, &cache, &arguments);
        assert_eq!(text(&second.stdout), out, "a run is the same each time");
        // The program follows data as `trace check` does.
        let chains = latencies(&out);
        let checked = checked(&trace, &project);
        for (name, observed, bound) in &chains {
            assert!(observed.zip(*bound).is_none_or(|(observed, bound)| observed <= bound), "{out}");
            let found =
                checked["chains"].as_array().unwrap().iter().find(|it| it["chain"] == **name).unwrap();
            let to_microseconds = |time: f64| (time * 1000.0).floor();
            assert_eq!(
                found["latency"].as_f64().map(to_microseconds),
                observed.map(|it| (it * 1000.0).round()),
                "{found}"
            );
            assert_eq!(
                found["bound"].as_f64().map(to_microseconds),
                bound.map(|it| (it * 1000.0).round()),
                "{found}"
            );
        }
        let [(_, Some(observed), Some(bound))] = chains[..] else { panic!("{out}") };
        println!("{sample}: {observed} of {bound} ms");
    }
}

/// A writer that is twice as fast as its reader, with a buffer between them.
const FULL: &str = "\
library full {
  codel shoot(out n: int): void
  codel show(in n: int): void
  shell CameraShell { output port frame: int }
  core CameraCore(CameraShell) { var n: int = 0  update = { shoot(n); write(frame, n); } }
  component Camera(CameraShell, CameraCore)
  shell ScreenShell { input port frame: int }
  core ScreenCore(ScreenShell) { var n: int = 0  update = { read(frame, n); show(n); } }
  component Screen(ScreenShell, ScreenCore)
  architecture Robot {
    instance camera: Camera  instance screen: Screen
    connection camera.frame -> [8] screen.frame
  }
  deployment Bench {
    architecture Robot
    activity camera { affinity = 1  priority = 20  period = 10 }
    activity screen { affinity = 1  priority = 10  period = 20 }
  }
}
";

#[test]
fn orocos_what_a_full_buffer_drops_is_counted() {
    let folder = folder("full");
    let observe = |name: &str, model: &str| {
        write(&folder, &[("robot.mal", model), ("mauve.toml", CONFIGURATION)]);
        let trace = folder.join(name);
        let arguments = ["--for", "2s", "--simulate-time", "--trace", trace.to_str().unwrap()];
        let output = mauve_run(&folder, &folder.join("cache"), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        checked(&trace, &folder)["connections"][0].clone()
    };
    let count = |found: &Value| ["written", "read", "unread"].map(|it| found[it].as_u64().unwrap());
    let slow = observe("slow", FULL);
    let [written, read, unread] = count(&slow);
    assert_eq!(
        (slow["connection"].as_str(), written, read),
        (Some("camera.frame -> screen.frame"), 200, 100)
    );
    // All but those that are in the buffer at the end.
    assert!((8..=9).contains(&(written - read - unread)), "{slow}");
    // An arrow leads from each write whose value was read to that read.
    let mut export = Command::new(MAUVE);
    let exported = export.args(["trace", "export"]).arg(folder.join("slow")).arg(&folder).output().unwrap();
    let exported: Value = serde_json::from_slice(&exported.stdout).unwrap();
    let ends = |phase: &str| -> BTreeMap<u64, (f64, u64)> {
        let events = exported["traceEvents"].as_array().unwrap().iter().filter(|it| it["ph"] == phase);
        let end = |it: &Value| (it["ts"].as_f64().unwrap(), it["tid"].as_u64().unwrap());
        events.map(|it| (it["id"].as_u64().unwrap(), end(it))).collect()
    };
    let (begins, ends) = (ends("s"), ends("f"));
    assert_eq!((begins.len(), ends.len()), (100, 100));
    for (id, (begin, writer)) in begins {
        let (end, reader) = ends[&id];
        assert!(begin <= end && end - begin <= 160_000.0 && writer != reader, "{id}: {begin} {end}");
    }
    let equal = observe("equal", &FULL.replace("period = 20", "period = 10"));
    assert_eq!(count(&equal), [200, 200, 0]);
}

/// Data releases a chain of instances, data at any and at all of two ports releases two, three share a thread, and the first job of
/// `planner` ends after its next release.
const RELEASES: &str = "\
library robot {
  codel look(): int
  codel find(in seen: int): int
  codel turn(in by: int): int
  codel watch(): int
  codel plan(): int
  codel join(in a: int, in b: int): int
  shell EyeShell { output port seen: int }
  core EyeCore(EyeShell) { update = { write(seen, look()); } }
  component Eye(EyeShell, EyeCore)
  shell FinderShell { input port seen: int  output port found: int }
  core FinderCore(FinderShell) { var last: int = 0  update = { read(seen, last); write(found, find(last)); } }
  component Finder(FinderShell, FinderCore)
  shell WheelShell { input port found: int }
  core WheelCore(WheelShell) { var last: int = 0  update = { read(found, last); turn(last); } }
  component Wheel(WheelShell, WheelCore)
  shell BothShell { input port seen: int  input port found: int }
  core BothCore(BothShell) { var a: int = 0  var b: int = 0  update = { read(seen, a); read(found, b); join(a, b); } }
  component Both(BothShell, BothCore)
  shell SideShell { }
  core SideCore(SideShell) { update = { watch(); } }
  component Side(SideShell, SideCore)
  core PlannerCore(SideShell) {
    statemachine {
      initial state Long { run = { plan(); } transition go to Short1 }
      state Short1 { transition go to Short2 }
      state Short2 { transition go to Long }
    }
  }
  component Planner(SideShell, PlannerCore)
  architecture Robot {
    instance left: Side  instance right: Side  instance back: Side
    instance planner: Planner  instance wheel: Wheel  instance finder: Finder  instance eye: Eye
    instance any_of: Both  instance all_of: Both
    connection eye.seen -> any_of.seen  connection finder.found -> any_of.found
    connection eye.seen -> all_of.seen  connection finder.found -> all_of.found
    connection eye.seen -> [4] finder.seen
    connection finder.found -> wheel.found
  }
  deployment Bench {
    architecture Robot
    activity eye { affinity = 1  priority = 30  period = 20 }
    activity finder { affinity = 1  priority = 20  trigger = seen  least = 30 }
    activity wheel { affinity = 1  priority = 40  trigger = found  least = 15  burst = 2  deadline = 20 }
    activity any_of { affinity = 1  priority = 48  trigger = any [seen, found]  least = 2 }
    activity all_of { affinity = 1  priority = 45  trigger = all [seen, found]  least = 2 }
    activity sides { affinity = 1  priority = 50  period = 10  instances = [right, left, back] }
    activity planner { affinity = 1  priority = 10  period = 30  deadline = 80 }
  }
}
";

const RELEASES_TIMES: &str = "unit = \"ms\"\n[codel]\n\"robot.look\" = 1\n\"robot.find\" = 3\n\"robot.turn\" = 1\n\
     \"robot.watch\" = 0.5\n\"robot.plan\" = 32\n\"robot.join\" = 0.1\n\
     [overhead]\ndispatch = 0.1\ncontext_switch = 0.05\n";

#[test]
fn orocos_releases_by_data_and_shared_threads_keep_their_bounds() {
    let folder = folder("releases");
    let configuration = "[timing]\ntables = \"times.toml\"\n[platform]\ncpus = 1\nrt_throttling = false\n";
    write(&folder, &[("robot.mal", RELEASES), ("mauve.toml", configuration), ("times.toml", RELEASES_TIMES)]);
    let trace = folder.join("trace");
    let arguments = ["--simulate-time", "--for", "30s", "--trace", trace.to_str().unwrap()];
    let ran = mauve_run(&folder, &folder.join("cache"), &arguments);
    let (out, err) = (text(&ran.stdout), text(&ran.stderr));
    assert_eq!((ran.status.code(), err.contains("error")), (Some(0), false), "{out}\n{err}");
    assert_within_bounds(&out, 9);
    let rows: BTreeMap<String, Row> = rows(&out).into_iter().map(|row| (row.instance.clone(), row)).collect();
    // Each value has a job of the finder, as far as the gap and the buffer allow: one in 30 ms. All of its values have one of the wheel.
    assert_eq!((rows["eye"].periods, rows["finder"].periods, rows["wheel"].periods), (1500, 1000, 1000));
    // Each value releases one of any, if no other comes within 2 ms; and each of the finder, which is the rarer one, one of all.
    assert!((2000..=2500).contains(&rows["any_of"].periods) && rows["all_of"].periods == 1000, "{out}");
    // The order of the list, and the thread wakes up once; and no job of the planner is dropped, although one of three ends after the next
    // release.
    assert_eq!(["right", "left", "back"].map(|it| rows[it].response), [0.7, 1.2, 1.7], "{out}");
    assert_eq!(["right", "left", "back"].map(|it| rows[it].bound), [0.7, 1.2, 1.7].map(Some), "{out}");
    assert!(rows["planner"].periods == 1000 && rows["planner"].response > 30.0, "{out}");
    let found = checked(&trace, &folder);
    assert_eq!(found["findings"].as_array().map(Vec::len), Some(0), "{found}");

    // With a longer gap in the model than in the robot, the releases are too early.
    write(&folder, &[("robot.mal", RELEASES.replace("least = 30", "least = 31").as_str())]);
    let found = checked(&trace, &folder);
    let kinds: Vec<&str> =
        found["findings"].as_array().unwrap().iter().filter_map(|it| it["code"].as_str()).collect();
    assert_eq!(kinds, ["gap"], "{found}");
}

/// One thread executes the jobs of three activities: of two clocks, and one that data releases. A job of `bus` is not preempted.
const QUEUE: &str = "\
library robot {
  codel look(): int
  codel feel(): int
  codel obey(in seen: int): int
  codel plan(): int
  codel send(): int
  shell EyeShell { output port seen: int }
  core EyeCore(EyeShell) { update = { write(seen, look()); } }
  component Eye(EyeShell, EyeCore)
  shell CommandShell { input port seen: int }
  core CommandCore(CommandShell) { var last: int = 0  update = { read(seen, last); obey(last); } }
  component Command(CommandShell, CommandCore)
  shell OtherShell { }
  core ImuCore(OtherShell) { update = { feel(); } }
  component Imu(OtherShell, ImuCore)
  core PlannerCore(OtherShell) { update = { plan(); } }
  component Planner(OtherShell, PlannerCore)
  core BusCore(OtherShell) { update = { send(); } }
  component Bus(OtherShell, BusCore)
  architecture Robot {
    instance eye: Eye  instance command: Command  instance imu: Imu  instance planner: Planner  instance bus: Bus
    connection eye.seen -> command.seen
  }
  deployment Bench {
    architecture Robot
    activity eye { affinity = 1  priority = 30  period = 10 }
    activity planner { affinity = 1  priority = 20  period = 40  thread = control }
    activity imu { affinity = 1  priority = 20  period = 8  deadline = 24  thread = control }
    activity command { affinity = 1  priority = 20  trigger = seen  least = 25  burst = 2  thread = control }
    activity bus { affinity = 1  priority = 10  period = 20  preemptive = false }
  }
}
";

const QUEUE_TIMES: &str = "unit = \"ms\"\n[codel]\n\"robot.look\" = 1\n\"robot.feel\" = 0.5\n\"robot.obey\" = 2\n\
     \"robot.plan\" = 6\n\"robot.send\" = 3\n[overhead]\ndispatch = 0.1\n";

#[test]
fn orocos_queues_keep_the_order_of_releases_and_jobs_are_not_preempted() {
    let folder = folder("queue");
    let configuration = "[timing]\ntables = \"times.toml\"\n[platform]\ncpus = 1\nrt_throttling = false\n";
    write(&folder, &[("robot.mal", QUEUE), ("mauve.toml", configuration), ("times.toml", QUEUE_TIMES)]);
    let trace = folder.join("trace");
    let arguments = ["--simulate-time", "--for", "10s", "--trace", trace.to_str().unwrap()];
    let ran = mauve_run(&folder, &folder.join("cache"), &arguments);
    let (out, err) = (text(&ran.stdout), text(&ran.stderr));
    assert_eq!((ran.status.code(), err.contains("error")), (Some(0), false), "{out}\n{err}");
    assert_within_bounds(&out, 5);
    let rows: BTreeMap<String, Row> = rows(&out).into_iter().map(|row| (row.instance.clone(), row)).collect();
    // Two values in 25 ms release a job of the command.
    let periods = ["eye", "planner", "imu", "command", "bus"].map(|it| rows[it].periods);
    assert_eq!(periods, [1000, 250, 1250, 800, 500], "{out}");
    let found = checked(&trace, &folder);
    assert_eq!(found["findings"].as_array().map(Vec::len), Some(0), "{found}");

    let recorded = fs::read_to_string(trace.join("periods.csv")).unwrap();
    let mut jobs: Vec<(u64, u64, u64, &str)> = Vec::new();
    for line in recorded.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [release, begin, end] = [1, 2, 3].map(|it| fields[it].parse().unwrap());
        jobs.push((begin, end, release, fields[0]));
    }
    jobs.sort_unstable();
    let queued: Vec<_> = jobs.iter().filter(|it| ["planner", "imu", "command"].contains(&it.3)).collect();
    for pair in queued.windows(2) {
        assert!(pair[0].2 <= pair[1].2 && pair[0].1 <= pair[1].0, "{pair:?}");
    }
    // The next job of any activity begins after its end, also of those that were released in the meantime.
    let followed = jobs.windows(2).filter(|pair| pair[0].3 == "bus");
    let delays = followed.filter(|pair| pair[0].1 <= pair[1].0 && pair[1].2 < pair[0].1).count();
    let preempted = jobs.windows(2).filter(|pair| pair[0].3 == "bus" && pair[1].0 < pair[0].1).count();
    assert!(delays > 0 && preempted == 0, "{delays} {preempted}");
}

/// A robot whose codels do what the environment says. Its deadlines are long, so that a virtual machine that pauses for a moment
/// meets them.
const ROBOT: &str = "\
library robot {
  codel look(): int
  codel turn(in by: int): int
  shell EyeShell { property gain: int [1; 9] = 2  output port seen: int }
  core EyeCore(EyeShell) { update = { write(seen, look()); } }
  component Eye(EyeShell, EyeCore)
  shell WheelShell { input port seen: int  provide stop(in now: int): int  require ask(in now: int): int }
  core WheelCore(WheelShell) {
    var last: int = 0
    handler asked: ask
    provide stop(in now: int): int = { return turn(now); }
    update = { read(seen, last); if (collect(asked, last) != not_ready) then { asked = send(ask, last); } else { } turn(last); }
  }
  component Wheel(WheelShell, WheelCore)
  architecture Robot {
    instance eye: Eye  instance left: Wheel  instance right: Wheel
    connection eye.seen -> [4] left.seen
    connection eye.seen -> right.seen
    operation left.stop -> right.ask
    operation right.stop -> left.ask
  }
  deployment Bench {
    architecture Robot
    activity eye { affinity = 1  priority = 30  period = 100 }
    activity left { affinity = 1  priority = 20  period = 100 }
    activity right { affinity = 1  priority = 10  period = 200 }
  }
}
";

const CONFIGURATION: &str = "[assume]\ncodel = \"1 ms\"\n[platform]\ncpus = 1\nrt_throttling = false\n";

const LOOK: &str = "\
#include <robot/robot-codels.hpp>

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace robot {

int look() {
  static int calls = 0;
  const char* const set = std::getenv(\"LOOK\");
  const std::string what = set == nullptr ? \"\" : set;
  if (++calls == 5 && what == \"throw\") throw std::runtime_error(\"it is dark\");
  if (calls == 5 && what == \"sleep\") sleep(1000);
  for (volatile int spins = 0; calls == 5 && what == \"spin\"; spins = spins + 1) {
  }
  if (calls == 5 && what == \"late\") usleep(160000);
  return calls;
}

}  // namespace robot
";

const TURN: &str = "\
#include <robot/robot-codels.hpp>

namespace robot {

int turn(int by) { return by + 1; }

}  // namespace robot
";

/// Flags of the user.
const FLAGS: &str = "-O1 -DNAMES='\"a,b\"'";

/// Generates the robot with the codels above, and builds its program. Returns the folder of the project and the program.
fn robot(folder: &Path) -> PathBuf {
    write(folder, &[("robot.mal", ROBOT), ("mauve.toml", CONFIGURATION)]);
    let codels = folder.join("src");
    run(Command::new(MAUVE).arg("generate").arg(folder).arg("--out").arg(&codels));
    write(&codels, &[("robot/src/codels/look.cpp", LOOK), ("robot/src/codels/turn.cpp", TURN)]);
    let mut command = Command::new(MAUVE);
    command
        .arg("run")
        .arg(folder)
        .args(["--build-only", "--codels", codels.to_str().unwrap()])
        .envs(RUNS_ONCE);
    let built = command.env("XDG_CACHE_HOME", folder.join("cache")).env("CXXFLAGS", FLAGS).output().unwrap();
    assert!(built.status.success(), "{}", text(&built.stderr));
    PathBuf::from(text(&built.stdout).trim())
}

/// Whether threads of this user may be real-time threads, on a CPU that activities may have for themselves.
pub(crate) fn has_real_time() -> bool {
    let probe = Command::new("chrt").args(["-f", "31", "true"]).stderr(Stdio::null()).status();
    probe.is_ok_and(|status| status.success())
}

/// Runs the program, which ends soon, whatever happens.
pub(crate) fn run_program(program: &Path, look: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
    let began = Instant::now();
    let mut command = Command::new(program);
    let output = command.args(arguments).env("LOOK", look).stdin(Stdio::null()).output().unwrap();
    assert!(began.elapsed() < Duration::from_secs(90), "{command:?}");
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn orocos_robot_without_orocos_says_what_goes_wrong() {
    let folder = folder("robot");
    let program = robot(&folder);
    let virtual_clock = ["--simulate-time", "--for", "1s"];
    let real =
        if has_real_time() { vec!["--for", "1s"] } else { vec!["--for", "1s", "--allow-non-realtime"] };

    let (code, out, err) = run_program(&program, "", &virtual_clock);
    assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
    assert_within_bounds(&out, 3);
    if has_real_time() {
        let (code, out, err) = run_program(&program, "", &real);
        assert_eq!(code, Some(0), "{out}\n{err}");
    }

    // A codel throws: its component ends, the others go on.
    for how in [&virtual_clock[..], &real] {
        let (code, out, err) = run_program(&program, "throw", how);
        assert_eq!(code, Some(1), "{out}\n{err}");
        assert!(err.contains("in updateHook(): it is dark"), "{err}");
        let rows = rows(&out);
        assert_eq!((rows[0].periods, rows[0].verdict.as_str()), (5, "✗ exception"), "{out}");
        assert!(rows[1].periods >= 8, "{out}");
    }

    // A codel is late in truth, which only the real clock knows.
    let (code, out, _) = run_program(&program, "late", &real);
    assert_eq!(code, Some(1), "{out}");
    assert!(rows(&out)[0].verdict.contains("missed"), "{out}");
    assert_eq!(run_program(&program, "late", &virtual_clock).0, Some(0));

    // A codel never returns: the robot ends all the same, and says which.
    for (look, how) in [("sleep", &virtual_clock[..]), ("spin", &real), ("sleep", &real)] {
        // The virtual clock waits for a minute for a codel, unless it is interrupted.
        let mut child = Command::new(&program)
            .args(how)
            .env("LOOK", look)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(1500));
        interrupt(child.id());
        let began = Instant::now();
        while child.try_wait().unwrap().is_none() {
            assert!(began.elapsed() < Duration::from_secs(20), "{look} {how:?} does not end");
            sleep(Duration::from_millis(20));
        }
        let output = child.wait_with_output().unwrap();
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("eye does not end its period: codel robot.look has not returned"), "{said}");
    }

    // Interrupted in the middle, it stops cleanly.
    let mut child = Command::new(&program).args(&real[2..]).stdout(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(700));
    interrupt(child.id());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

fn interrupt(process: u32) {
    run(Command::new("kill").args(["-INT", &process.to_string()]));
}

#[test]
fn orocos_programs_refuse_what_they_cannot_do() {
    let folder = folder("refusals");
    let program = robot(&folder);
    let refused = |arguments: &[&str], expected: &str| {
        let (code, out, err) = run_program(&program, "", arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(err.contains(expected), "{arguments:?}: {err}");
    };
    refused(&["--for", "10"], "--for takes a time with its unit");
    refused(&["--for", "-1s"], "--for takes a time with its unit");
    refused(&["--for"], "--for needs a value");
    refused(&["--live=yes"], "--live takes no value");
    refused(&["--fro", "1s"], "unknown option `--fro`");
    refused(&["--param", "eye.gain"], "--param takes INSTANCE.NAME=VALUE");
    let simulated = |parameter: &str, expected: &str| {
        refused(&["--simulate-time", "--for", "1s", "--param", parameter], expected);
    };
    simulated("ear.gain=1", "no instance ear in robot.Bench, which has eye, left, right");
    simulated("eye.gian=1", "eye has no property gian; it has gain");
    simulated("eye.gain=x", "property eye.gain cannot be `x`");
    simulated("eye.gain=10", "property gain is 10, and must be in [1; 9]");
    refused(&["--trace", "/proc/no", "--simulate-time"], "the folder /proc/no cannot be made");

    let trace = folder.join("trace");
    let arguments =
        ["--simulate-time", "--for", "1s", "--param", "eye.gain=9", "--trace", trace.to_str().unwrap()];
    let (code, out, err) = run_program(&program, "", &arguments);
    assert_eq!(code, Some(0), "{out}\n{err}");
    let recorded = fs::read_to_string(trace.join("executions.csv")).unwrap();
    let mut lines = recorded.lines();
    assert_eq!(
        lines.next(),
        Some("codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns,status,number")
    );
    assert_eq!(lines.next(), Some("(from tables),0,,,,,,,,"));
    let build = lines.next().unwrap_or_default();
    let flags = format!(" {}\",0,,,,,,,,", FLAGS.replace('"', "\"\""));
    assert!(build.starts_with("\"(build) ") && build.ends_with(&flags), "{build}");
    let looks: Vec<&str> = lines.filter(|line| line.starts_with("robot.look,1000000,eye,1000000,")).collect();
    assert_eq!(looks.len(), 10, "{recorded}");

    // A recording is not overwritten, by the program or before it is built; neither is what a power failure left.
    refused(&arguments, "executions.csv is a recording, which is not overwritten: name another folder");
    let left = folder.join("left");
    write(&left, &[("executions.csv.partial", "codel,execution_ns\nrobot.look,12")]);
    refused(
        &["--simulate-time", "--for", "1s", "--trace", left.to_str().unwrap()],
        "executions.csv.partial is a recording, which is not overwritten",
    );
    for (recording, file) in [(&trace, "executions.csv"), (&left, "executions.csv.partial")] {
        let arguments = ["--simulate-time", "--trace", recording.to_str().unwrap()];
        let refusal = mauve_run(&folder, &folder.join("no-cache"), &arguments);
        let expected = format!("has a recording, `{file}`, which is not overwritten: name another folder");
        assert_eq!(refusal.status.code(), Some(2));
        assert!(text(&refusal.stderr).contains(&expected), "{}", text(&refusal.stderr));
        assert!(!folder.join("no-cache").exists());
    }
    assert_eq!(fs::read_to_string(trace.join("executions.csv")).unwrap(), recorded);

    // Links and pipes lead nowhere; a folder that is one does not, either. Nothing is left of what was begun.
    let (mine, odd) = (folder.join("mine"), folder.join("odd"));
    write(&folder, &[("mine/file", "mine")]);
    for (name, target) in [
        ("executions.csv", "../../mine/file"),
        ("periods.csv", "../../mine/new"),
        ("executions.csv.partial", "../../mine/new"),
        ("periods.csv.partial", "../../mine/file"),
    ] {
        let linked = odd.join(name).join(name);
        fs::create_dir_all(linked.parent().unwrap()).unwrap();
        std::os::unix::fs::symlink(target, &linked).unwrap();
        let named = linked.parent().unwrap().to_str().unwrap();
        refused(
            &["--simulate-time", "--for", "1s", "--trace", named],
            "is a recording, which is not overwritten",
        );
        assert_eq!(fs::read_dir(named).unwrap().count(), 1, "{name}");
    }
    std::os::unix::fs::symlink(&mine, odd.join("link")).unwrap();
    refused(
        &["--simulate-time", "--trace", odd.join("link").to_str().unwrap()],
        "cannot be opened: it is a link or a file",
    );
    let piped = odd.join("piped");
    fs::create_dir(&piped).unwrap();
    run(Command::new("mkfifo").arg(piped.join("executions.csv.partial")));
    refused(
        &["--simulate-time", "--trace", piped.to_str().unwrap()],
        "executions.csv.partial is a recording",
    );
    assert_eq!(fs::read_dir(&mine).unwrap().count(), 1);
    assert_eq!(fs::read_to_string(mine.join("file")).unwrap(), "mine");

    // Two programs do not record into one folder. What one has left that was killed is data, and not a lock.
    let both = folder.join("both");
    let endless = ["--allow-non-realtime", "--trace", both.to_str().unwrap()];
    let mut first = Command::new(&program).args(endless).stdout(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !both.join("periods.csv.partial").exists() && begun.elapsed() < Duration::from_secs(60) {
        sleep(Duration::from_millis(10));
    }
    let holder = format!("process {}", first.id());
    refused(&endless, &format!("{holder} records into {}/: name another folder", both.display()));
    let second = mauve_run(&folder, &folder.join("no-cache"), &["--trace", both.to_str().unwrap()]);
    assert!(
        text(&second.stderr).contains(&format!("{holder} (`robot-Bench`) records into")),
        "{}",
        text(&second.stderr)
    );
    run(Command::new("kill").args(["-KILL", &first.id().to_string()]));
    first.wait().unwrap();
    refused(&endless, "executions.csv.partial is a recording, which is not overwritten");
    assert!(!left.join("periods.csv.partial").exists());
    let left = fs::read_to_string(left.join("executions.csv.partial")).unwrap();
    assert_eq!(left, "codel,execution_ns\nrobot.look,12");

    // The recording agrees with the model, and not with another one.
    let check = |expected: i32| {
        let mut check = Command::new(MAUVE);
        let check = check.args(["trace", "check", "--format", "json"]).arg(&trace).arg(&folder);
        let found = check.output().unwrap();
        assert_eq!(found.status.code(), Some(expected), "{}{}", text(&found.stdout), text(&found.stderr));
        let document: Value = serde_json::from_slice(&found.stdout).unwrap();
        assert_eq!(document["recording"]["releases"], true);
        assert_eq!(document["recording"]["measured"], false);
        let codes =
            document["findings"].as_array().unwrap().iter().map(|it| it["code"].as_str().unwrap().to_owned());
        codes.collect::<Vec<String>>()
    };
    assert_eq!(check(0), Vec::<String>::new());
    write(
        &folder,
        &[("robot.mal", &ROBOT.replace("priority = 20  period = 100", "priority = 21  period = 50"))],
    );
    assert_eq!(check(1), ["priority", "period"]);
    write(&folder, &[("robot.mal", ROBOT)]);

    // Codels that are out of date, and a build that fails.
    let codels = folder.join("src");
    write(&folder, &[("robot.mal", &ROBOT.replace("gain: int [1; 9]", "gain: int [1; 8]"))]);
    let cache = folder.join("cache");
    let refusal = mauve_run(&folder, &cache, &["--codels", codels.to_str().unwrap()]);
    assert_eq!(refusal.status.code(), Some(2));
    assert!(text(&refusal.stderr).contains("mauve generate"), "{}", text(&refusal.stderr));
    // The prototype in the user's file is left to the user.
    write(&folder, &[("robot.mal", &ROBOT.replace("turn(in by: int)", "turn(in by: double)"))]);
    let generate = || run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
    generate();
    let refusal = mauve_run(&folder, &cache, &["--codels", codels.to_str().unwrap()]);
    let said = text(&refusal.stderr);
    assert!(said.contains("write `robot/src/codels/turn.cpp` for its new prototype"), "{said}");
    write(&folder, &[("robot.mal", ROBOT)]);
    generate();
    write(&codels, &[("robot/src/codels/turn.cpp", &TURN.replace("return by", "return bye"))]);
    let failure = mauve_run(&folder, &cache, &["--codels", codels.to_str().unwrap()]);
    assert_eq!(failure.status.code(), Some(2));
    assert!(text(&failure.stderr).contains("turn.cpp"), "{}", text(&failure.stderr));
}

/// The folder follows the model as packages do, and they do not depend on it.
#[test]
fn the_standalone_folder_is_one_more_package() {
    let folder = folder("generated");
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", CONFIGURATION)]);
    let generate = |arguments: &[&str]| {
        let mut command = Command::new(MAUVE);
        let output = command.arg("generate").arg(&folder).args(arguments).output().unwrap();
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    };
    let [plain, both] = ["plain", "both"].map(|name| folder.join(name));
    let [plain_path, both_path] = [&plain, &both].map(|path| path.to_str().unwrap());
    assert_eq!(generate(&["--out", plain_path]).0, Some(0));
    assert_eq!(generate(&["--out", both_path, "--standalone"]).0, Some(0));
    let package = |out: &Path| {
        let read =
            |path: &PathBuf| (path.strip_prefix(out).unwrap().to_owned(), fs::read_to_string(path).unwrap());
        files_in(&out.join("robot")).iter().map(read).collect::<BTreeMap<_, _>>()
    };
    assert_eq!(package(&plain), package(&both));
    assert!(!plain.join("standalone").exists());

    let check = ["--out", both_path, "--standalone", "--check"];
    assert_eq!(generate(&check).0, Some(0));
    let main = both.join("standalone/robot-Bench.cpp");
    let written = fs::read_to_string(&main).unwrap();
    // The bounds are those of the model; a changed time is another program.
    write(&folder, &[("mauve.toml", &CONFIGURATION.replace("1 ms", "2 ms"))]);
    assert_eq!(generate(&check).0, Some(1));
    assert_eq!(generate(&["--out", both_path, "--standalone"]).0, Some(0));
    assert_ne!(fs::read_to_string(&main).unwrap(), written);

    // Without the option, the folder stays, and the report does not mention it.
    let (code, said) = generate(&["--out", both_path, "--check"]);
    assert!(code == Some(0) && !said.contains("standalone"), "{said}");
    assert!(main.exists());

    // A file that somebody has edited is not overwritten, and one that no deployment needs is removed.
    fs::write(&main, fs::read_to_string(&main).unwrap() + "// mine\n").unwrap();
    let (code, said) = generate(&["--out", both_path, "--standalone"]);
    assert!(code == Some(1) && said.contains("robot-Bench.cpp"), "{said}");
    assert_eq!(generate(&["--out", both_path, "--standalone", "--force"]).0, Some(0));
    write(&folder, &[("robot.mal", &ROBOT.replace("deployment Bench", "deployment Yard"))]);
    assert_eq!(generate(&["--out", both_path, "--standalone"]).0, Some(0));
    assert!(!main.exists() && both.join("standalone/robot-Yard.cpp").exists());
}

/// The generated folder is a project of CMake, with and without the headers of ROS.
#[test]
fn orocos_standalone_folder_builds_with_cmake() {
    let folder = folder("cmake");
    let model = "\
library robot {
  use sensor_msgs
  codel look(out scan: LaserScan): bool
  shell EyeShell { output port scan: LaserScan }
  core EyeCore(EyeShell) { var seen: LaserScan  update = { if (look(seen)) then { write(scan, seen); } else { } } }
  component Eye(EyeShell, EyeCore)
  architecture Robot { instance eye: Eye }
  deployment Bench { architecture Robot  activity eye { priority = 30  period = 20 } }
}
";
    write(&folder, &[("robot.mal", model), ("mauve.toml", CONFIGURATION)]);
    let out = folder.join("src");
    run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&out).arg("--standalone"));
    for (messages, expected) in [("ON", "Messages of ROS"), ("OFF", "Messages without ROS")] {
        let built = folder.join(messages);
        let mut configure = Command::new("cmake");
        configure.arg("-S").arg(out.join("standalone")).arg("-B").arg(&built);
        configure.args([
            format!("-DMAUVE_ROS_MESSAGES={messages}"),
            "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror".to_owned(),
        ]);
        let said = run(&mut configure);
        assert!(said.contains(expected), "{said}");
        run(&mut build(&built));
        let (code, out, err) =
            run_program(&built.join("robot-Bench"), "", &["--simulate-time", "--for", "1s"]);
        assert_eq!(code, Some(0), "{out}\n{err}");
    }
}
