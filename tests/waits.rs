//! A robot whose codels wait, share a lock and use another thread: what its report, a recording and the file beside the samples say.
//!
//! `tests/run` installs CMake and the compilers; without them these tests fail with a message.

use std::path::Path;
use std::process::Command;

use mauve_tests::orocos::run;
use mauve_tests::write;
use mauve_timing::Observed;

use crate::MAUVE;
use crate::standalone::{folder, has_real_time, mauve_run, run_program, text};

/// In the middle of a job of `holder`, jobs of `taker` begin.
const ROBOT: &str = "\
library robot {
  codel take(): int
  codel hold(): int
  codel grab(): int
  shell TakerShell { output port taken: int }
  core TakerCore(TakerShell) { update = { write(taken, take()); } }
  component Taker(TakerShell, TakerCore)
  shell GrabberShell { input port taken: int }
  core GrabberCore(GrabberShell) { var n: int = 0  update = { read(taken, n); grab(); } }
  component Grabber(GrabberShell, GrabberCore)
  shell HolderShell { }
  core HolderCore(HolderShell) { update = { hold(); } }
  component Holder(HolderShell, HolderCore)
  architecture Robot {
    instance taker: Taker
    instance grabber: Grabber
    instance holder: Holder
    connection taker.taken -> grabber.taken
  }
  deployment Bench {
    architecture Robot
    activity taker { affinity = 1  priority = 30  period = 7 }
    activity grabber { affinity = 1  priority = 20  period = 50 }
    activity holder { affinity = 1  priority = 10  period = 20 }
  }
}
";

const CONFIGURATION: &str =
    "[timing]\ntables = [\"times.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n";

const TIMES: &str =
    "unit = \"ms\"\n[codel]\n\"robot.take\" = 0.5\n\"robot.hold\" = 8\n\"robot.grab\" = 0.5\n";

const TAKE: &str = "\
#include <robot/robot-codels.hpp>
#include <robot/robot-lock.hpp>

#include <mutex>
#include <system_error>

namespace robot {

extern MauveLock bus;

int take() {
  // A thread may not have a lock twice.
  static bool is_refused = [] {
    const std::lock_guard<MauveLock> held(bus);
    try {
      bus.lock();
    } catch (const std::system_error&) {
      return true;
    }
    return false;
  }();
  const std::lock_guard<MauveLock> held(bus);
  return is_refused ? 1 : 0;
}

}  // namespace robot
";

const HOLD: &str = "\
#include <robot/robot-codels.hpp>
#include <robot/robot-lock.hpp>

#include <mutex>

#include <time.h>

namespace robot {

MauveLock bus(\"bus\");

static double used() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * 1e3 + now.tv_nsec / 1e6;
}

int hold() {
  const std::lock_guard<MauveLock> held(bus);
  const double before = used();
  while (used() - before < 5) {
  }
  return 0;
}

}  // namespace robot
";

const GRAB: &str = "\
#include <robot/robot-codels.hpp>

#include <chrono>
#include <thread>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

namespace robot {

static void work() {
  pthread_setname_np(pthread_self(), \"a \\\"pool\\\", 1\");
  const sched_param none = {};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
  while (true) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    while (std::chrono::steady_clock::now() < end) {
    }
    usleep(10000);
  }
}

int grab() {
  static bool has_pool = [] {
    std::thread(work).detach();
    return true;
  }();
  usleep(3000);
  return has_pool ? 0 : 1;
}

}  // namespace robot
";

fn mauve(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(MAUVE).args(arguments).current_dir(folder).output().unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn orocos_a_recording_tells_waits_locks_ports_and_work_elsewhere() {
    let folder = folder("waits");
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", CONFIGURATION), ("times.toml", TIMES)]);
    let codels = folder.join("src");
    run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
    let sources = [("take", TAKE), ("hold", HOLD), ("grab", GRAB)];
    for (name, source) in sources {
        write(&codels, &[(format!("robot/src/codels/{name}.cpp"), source.to_owned())]);
    }
    let built =
        mauve_run(&folder, &folder.join("cache"), &["--build-only", "--codels", codels.to_str().unwrap()]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    let program = text(&built.stdout);
    let recording = folder.join("rec");
    let recorded = ["--for", "2s", "--trace", recording.to_str().unwrap(), "--allow-non-realtime"];
    let arguments = &recorded[..if has_real_time() { 4 } else { 5 }];

    let (code, out, err) = run_program(Path::new(program.trim()), "", arguments);
    assert!(code == Some(0) || code == Some(1), "{out}{err}");
    assert!(out.contains("codel robot.grab of grabber waited for something in 40 executions"), "{out}");
    assert!(out.contains("    [wait]\n    \"robot.grab\" = "), "{out}");
    assert!(!out.contains("codel robot.take of taker waited for something"), "{out}");
    assert!(out.contains("threads named a \"pool\", 1, which are no instances, used "), "{out}");

    let configured = CONFIGURATION.replace("[platform]", "observed = [\"r.observed.toml\"]\n[platform]");
    write(&folder, &[("mauve.toml", configured.as_str())]);
    let (code, out, err) = mauve(&folder, &["trace", "import", "rec", "-o", "r.samples"]);
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.contains("[wait]\n\"robot.grab\" = ") && !out.contains("\"robot.take\" ="), "{out}");
    assert!(out.ends_with("`r.observed.toml` has what was observed\n"), "{out}");
    let remembered = std::fs::read_to_string(folder.join("r.observed.toml")).unwrap();
    let (observed, errors) = Observed::parse(&remembered);
    assert_eq!(errors, [], "{remembered}");
    let of = |codel: &str| &observed.codels[codel];
    assert_eq!((of("robot.grab").executions, of("robot.grab").is_wait_known), (40, true), "{remembered}");
    assert!((3_000_000..500_000_000).contains(&of("robot.grab").wait), "{remembered}");
    // To wait for a lock that the recording has is no wait of the codel.
    assert_eq!((of("robot.take").wait, of("robot.take").is_wait_known), (0, true), "{remembered}");
    let held = |codel: &str| observed.locks[&("bus".to_owned(), codel.to_owned())].clone();
    assert!(held("robot.hold").greatest >= 5_000_000, "{remembered}");
    assert_eq!(held("robot.hold").executions, of("robot.hold").executions);
    assert_eq!(held("robot.take").executions, of("robot.take").executions + 1, "{remembered}");
    assert!(observed.work["a \"pool\", 1"].per_second > 1_000_000, "{remembered}");
    let ports: Vec<(&str, u64)> =
        observed.accesses.iter().map(|(key, it)| (key.as_str(), it.executions)).collect();
    assert_eq!(ports, [("robot.Grabber.taken", 40), ("robot.Taker.taken", of("robot.take").executions)]);

    // In real time, one of many jobs of `taker` begins while the other has the lock.
    let executions = std::fs::read_to_string(recording.join("executions.csv")).unwrap();
    let waited_for_the_lock = |line: &&str| line.starts_with("robot.take,") && !line.ends_with(',');
    assert!(!has_real_time() || executions.lines().any(|line| waited_for_the_lock(&line)), "{executions}");

    // The same recording counts once, also in another sample file.
    let (code, _, err) = mauve(&folder, &["trace", "import", "rec", "-o", "again.samples"]);
    assert_eq!(code, 0, "{err}");
    std::fs::copy(folder.join("r.observed.toml"), folder.join("again.observed.toml")).unwrap();
    std::fs::remove_file(folder.join("again.samples")).unwrap();
    assert_eq!(mauve(&folder, &["trace", "import", "rec", "-o", "again.samples"]).0, 0);
    assert_eq!(std::fs::read_to_string(folder.join("again.observed.toml")).unwrap(), remembered);

    // A file that somebody damaged stays as it is.
    std::fs::write(folder.join("again.observed.toml"), "unit = \"ms\"\n[codel.x]\nexecutions = 1\n").unwrap();
    std::fs::remove_file(folder.join("again.samples")).unwrap();
    let (code, _, err) = mauve(&folder, &["trace", "import", "rec", "-o", "again.samples"]);
    assert_eq!(code, 2);
    assert!(err.contains("`again.observed.toml`, line 2, is not as this command writes it"), "{err}");
}
