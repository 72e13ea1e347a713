//! Robots whose codels wait, share a lock, pass large values and use another thread: what the report, a recording, the file beside the
//! samples and the check say, and that the robot keeps its bounds with the lines that they print.
//!
//! `tests/run` installs CMake and the compilers; without them these tests fail with a message.

use std::path::Path;
use std::process::Command;

use mauve_tests::orocos::run;
use mauve_tests::write;
use mauve_timing::{Observed, Table};

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
    assert!(out.contains("    [wait]\n    \"robot.grab\" = { time = "), "{out}");
    assert!(!out.contains("codel robot.take of taker waited for something"), "{out}");
    assert!(out.contains("threads named a \"pool\", 1, which are not instances, used "), "{out}");
    // The overhead of a period is one figure, of the program and of its recording.
    let dispatch = out.lines().find_map(|line| line.split_once("[overhead] dispatch = ")).unwrap().1;
    let checked = mauve(&folder, &["trace", "check", "rec"]).1;
    assert!(
        checked.contains(&format!("for `times.toml`: [overhead] dispatch = {dispatch}\n")),
        "{out}{checked}"
    );

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
    assert!((of("robot.grab").times, of("robot.take").times) == (1, 0), "{remembered}");
    assert!(held("robot.hold").greatest >= 5_000_000, "{remembered}");
    assert_eq!(held("robot.hold").executions, of("robot.hold").executions);
    assert_eq!(held("robot.take").executions, of("robot.take").executions + 1, "{remembered}");
    assert!(observed.work["a \"pool\", 1"].greatest > 1_000_000, "{remembered}");
    let ports: Vec<(&str, u64)> =
        observed.accesses.iter().map(|(key, it)| (key.as_str(), it.executions)).collect();
    assert_eq!(ports, [("robot.Grabber.taken", 40), ("robot.Taker.taken", of("robot.take").executions)]);

    // In real time, one of many jobs of `taker` begins while the other has the lock.
    let executions = std::fs::read_to_string(recording.join("executions.csv")).unwrap();
    let waited_for_the_lock = |line: &&str| {
        line.starts_with("robot.take,") && line.split(',').nth(7).is_some_and(|it| !it.is_empty())
    };
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

const GUIDE: &str = "\
library guide {
  use sensor_msgs
  codel grab(out image: Image): bool
  codel look(in image: Image): int
  codel steer(): int
  codel plan(): int
  shell CameraShell { output port frame: Image }
  core CameraCore(CameraShell) { var image: Image  update = { if grab(image) then { write(frame, image); } else { } } }
  component Camera(CameraShell, CameraCore)
  shell TrackerShell { input port frame: Image }
  core TrackerCore(TrackerShell) { var image: Image  update = { if read(frame, image) == new_data then { look(image); } else { } } }
  component Tracker(TrackerShell, TrackerCore)
  shell WheelsShell { }
  core WheelsCore(WheelsShell) { update = { steer(); } }
  component Wheels(WheelsShell, WheelsCore)
  shell PlannerShell { }
  core PlannerCore(PlannerShell) { update = { plan(); } }
  component Planner(PlannerShell, PlannerCore)
  architecture Guide {
    instance camera: Camera
    instance wheels: Wheels
    instance tracker: Tracker
    instance planner: Planner
    connection camera.frame -> tracker.frame
  }
  deployment Bench {
    architecture Guide
    activity camera { affinity = 1  priority = 30  period = 400 }
    activity wheels { affinity = 1  priority = 25  period = 300 }
    activity tracker { affinity = 1  priority = 20  period = 600 }
    activity planner { affinity = 1  priority = 10  period = 600 }
  }
}
";

const GUIDE_TIMES: &str = "unit = \"ms\"\n[codel]\n\"guide.grab\" = 30\n\"guide.look\" = 30\n\"guide.steer\" = 10\n\"guide.plan\" = 10\n";

const GUIDE_CODELS: [(&str, &str); 4] = [
    (
        "grab",
        "\
#include <guide/guide-codels.hpp>

#include <unistd.h>

namespace guide {

bool grab(::sensor_msgs::Image& image) {
  usleep(2000);
  image.data.assign(1000000, 1);
  usleep(1000);
  return true;
}

}  // namespace guide
",
    ),
    (
        "look",
        "\
#include <guide/guide-codels.hpp>
#include <guide/guide-lock.hpp>

#include <mutex>

namespace guide {

MauveLock bus(\"bus\");

int look(const ::sensor_msgs::Image& image) {
  const std::lock_guard<MauveLock> held(bus);
  int sum = 0;
  for (const auto it : image.data) sum += it;
  return sum;
}

}  // namespace guide
",
    ),
    (
        "steer",
        "\
#include <guide/guide-codels.hpp>
#include <guide/guide-lock.hpp>

#include <mutex>

namespace guide {

extern MauveLock bus;

int steer() {
  const std::lock_guard<MauveLock> held(bus);
  return 1;
}

}  // namespace guide
",
    ),
    // The end of the program must not wait for the thread that waits for work.
    (
        "plan",
        "\
#include <guide/guide-codels.hpp>

#include <condition_variable>
#include <ctime>
#include <mutex>
#include <thread>

#include <pthread.h>

namespace guide {

static std::mutex mutex;
static std::condition_variable has_work;
static int jobs = 0;

static double used() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * 1e3 + now.tv_nsec / 1e6;
}

static void work() {
  pthread_setname_np(pthread_self(), \"pool\");
  std::unique_lock<std::mutex> held(mutex);
  while (true) {
    has_work.wait(held, [] { return jobs > 0; });
    --jobs;
    held.unlock();
    const double before = used();
    while (used() - before < 2) {
    }
    held.lock();
  }
}

int plan() {
  static bool has_pool = [] {
    std::thread(work).detach();
    return true;
  }();
  const std::lock_guard<std::mutex> held(mutex);
  ++jobs;
  has_work.notify_one();
  return has_pool ? 1 : 0;
}

}  // namespace guide
",
    ),
];

/// A section that a command has printed, with its header.
fn section(out: &str, header: &str) -> String {
    let lines = out.lines().skip_while(|line| *line != header).enumerate();
    let its = lines.take_while(|(at, line)| *at == 0 || line.contains(" = ") && !line.starts_with('['));
    its.map(|(_, line)| format!("{line}\n")).collect()
}

#[test]
fn orocos_the_printed_lines_mend_what_a_recording_refutes() {
    let folder = folder("guide");
    let write_all = |times: &str, configuration: &str| {
        write(&folder, &[("robot.mal", GUIDE), ("mauve.toml", configuration), ("times.toml", times)]);
    };
    write_all(GUIDE_TIMES, CONFIGURATION);
    let (code, out, err) = mauve(&folder, &["check"]);
    assert!(code == 0 && out.contains("all 4 deadlines are proved, if"), "{out}{err}");

    let run_for = |recording: &str| {
        let codels = folder.join("src");
        run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
        for (name, source) in GUIDE_CODELS {
            write(&codels, &[(format!("guide/src/codels/{name}.cpp"), source.to_owned())]);
        }
        let arguments = ["--build-only", "--codels", codels.to_str().unwrap()];
        let built = mauve_run(&folder, &folder.join("cache"), &arguments);
        assert!(built.status.success(), "{}", text(&built.stderr));
        let recording = folder.join(recording);
        let recorded = ["--for", "3s", "--trace", recording.to_str().unwrap(), "--allow-non-realtime"];
        let arguments = &recorded[..if has_real_time() { 4 } else { 5 }];
        run_program(Path::new(text(&built.stdout).trim()), "", arguments)
    };
    let (code, out, err) = run_for("rec");
    assert!(code == Some(0) || code == Some(1), "{out}{err}");
    assert!(err.contains("a static object of a codel does not end"), "{err}");
    let (code, out, err) = mauve(&folder, &["trace", "import", "rec", "-o", "r.samples"]);
    assert_eq!(code, 0, "{out}{err}");

    // Without the lines, all four are errors.
    let observed = "under [timing]:\nobserved = [\"r.observed.toml\"]\n";
    assert!(out.ends_with(observed), "{out}");
    let configuration = CONFIGURATION.replace("[platform]", "observed = [\"r.observed.toml\"]\n[platform]");
    write_all(GUIDE_TIMES, &configuration);
    let (code, said, err) = mauve(&folder, &["check"]);
    assert_eq!(code, 1, "{said}{err}");
    for error in [
        "error[waiting-codel]: codel `guide.grab` waited for ",
        "error[refuted-time]: an access to port `Camera.frame` took ",
        "error[undeclared-lock]: codel `guide.look` takes the lock `bus`",
        "error[undeclared-lock]: codel `guide.steer` takes the lock `bus`",
        "error[work-elsewhere]: threads named `pool`",
    ] {
        assert!(said.contains(error), "{error}\n{said}");
    }

    // With them, none is.
    let [waits, accesses, lock, other] =
        ["[wait]", "[access]", "[locks.bus]", "[[platform.other]]"].map(|header| section(&out, header));
    let written = |waits: &str| format!("{GUIDE_TIMES}{waits}{accesses}");
    let configuration = format!("{configuration}{lock}{other}");
    write_all(&written(&waits), &configuration);
    let (code, said, err) = mauve(&folder, &["check"]);
    assert!(
        code == 0 && said.contains("all 4 deadlines are proved, if"),
        "{configuration}{waits}{said}{err}"
    );

    // To wait more often than written is an error, too.
    let once = "[wait]\n\"guide.grab\" = { time = 60, waits = 1 }\n";
    assert!(waits.contains(", waits = 2 }"), "{waits}");
    write_all(&written(once), &configuration);
    let (code, said, _) = mauve(&folder, &["check"]);
    assert!(
        code == 1 && said.contains("codel `guide.grab` waited 2 times in one execution, 1 written"),
        "{said}"
    );

    // The robot keeps these bounds. They have a reserve, as a virtual machine may pause.
    write_all(&written(&once.replace("waits = 1", "waits = 2")), &configuration);
    let (code, out, err) = run_for("again");
    assert!(!has_real_time() || code == Some(0) && !out.contains("above its bound"), "{out}{err}");
    // What the table has is not proposed again, unless it was too short.
    assert!(!out.contains("[wait]") || out.contains("   # replaces 60\n"), "{out}");
}

/// Two instances of one component, whose names scripts reserve, wait longer than their bound.
const TWINS: &str = "library twins {
  codel nap(): int
  shell S { }
  core C(S) { update = { nap(); } }
  component Twin(S, C)
  architecture A { instance local: Twin  instance global: Twin }
  deployment D {
    architecture A
    activity local { affinity = 1  priority = 20  period = 50 }
    activity global { affinity = 1  priority = 10  period = 50 }
  }
}
";

const NAP: &str = "#include <twins/twins-codels.hpp>

#include <unistd.h>

namespace twins {

int nap() {
  usleep(30000);
  return 0;
}

}  // namespace twins
";

/// `mauve run` and `mauve trace check` name one cause, by the names of the model; what is printed can be pasted.
#[test]
fn orocos_a_run_and_its_recording_say_the_same() {
    let folder = folder("twins");
    let configuration = "timing.tables = [\"times.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n";
    write(
        &folder,
        &[("twins.mal", TWINS), ("mauve.toml", configuration), ("times.toml", "[codel]\nnap = 1\n")],
    );
    let codels = folder.join("src");
    run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
    write(&codels, &[("twins/src/codels/nap.cpp", NAP)]);
    let built =
        mauve_run(&folder, &folder.join("cache"), &["--build-only", "--codels", codels.to_str().unwrap()]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    let program = text(&built.stdout);
    let recording = folder.join("rec");
    let real_time: &[&str] = if has_real_time() { &[] } else { &["--allow-non-realtime"] };
    let run_with = |arguments: &[&str]| {
        let all = [&["--for", "1s"], arguments, real_time].concat();
        run_program(Path::new(program.trim()), "", &all).1
    };
    let cause = "codel `twins.nap` waited for up to 3";
    let alone = run_with(&[]);
    for name in ["local", "global"] {
        let line = alone.lines().find(|line| line.contains(&format!("  {name} responded after "))).unwrap();
        assert!(line.contains(cause), "{alone}");
    }
    let recorded = run_with(&["--trace", recording.to_str().unwrap()]);
    let hint = format!("`mauve trace check {}` says why", recording.display());
    assert_eq!(recorded.matches(&hint).count(), 2, "{recorded}");

    // One line for the codel of both, as a table reads it.
    let printed: String = recorded
        .lines()
        .filter_map(|line| line.strip_prefix("    "))
        .map(|line| format!("{line}\n"))
        .collect();
    let table = Table::parse(&printed);
    assert!(table.errors.is_empty() && table.waits.len() == 1, "{printed}: {:?}", table.errors);
    assert_eq!((table.waits[0].key.as_str(), table.waits[0].waits), ("twins.nap", Some(1)), "{printed}");

    let (code, checked, err) = mauve(&folder, &["trace", "check", "rec"]);
    assert_eq!((code, err.as_str()), (1, ""), "{checked}");
    assert!(checked.contains(cause) && !checked.contains("is not in the recording"), "{checked}");
    // Orocos and earlier versions record the names of scripts.
    for file in ["executions.csv", "periods.csv"] {
        let path = recording.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("local") && !text.contains("local_"), "{text}");
        std::fs::write(path, text.replace("local", "local_").replace("global", "global_")).unwrap();
    }
    assert_eq!(mauve(&folder, &["trace", "check", "rec"]), (1, checked, String::new()));
}

/// Codels of `motion` and `arm` share a lock, as the page of generated code says.
const SHARED: &str = "library arm {
  codel grab(): int
  shell S { }
  core C(S) { update = { grab(); } }
  component Arm(S, C)
}
library motion {
  codel brake(): int
  shell S { }
  core C(S) { update = { brake(); } }
  component Motion(S, C)
}
library robot {
  use arm
  use motion
  architecture A { instance arm: Arm  instance motion: Motion }
  deployment D {
    architecture A
    activity arm { affinity = 1  priority = 20  period = 10 }
    activity motion { affinity = 1  priority = 10  period = 20 }
  }
}
";

#[test]
fn orocos_codels_of_two_libraries_share_a_lock() {
    let folder = folder("shared-lock");
    let lock = "[locks.bus]\ncodels = [\"motion.brake\", \"arm.grab\"]\nprotocol = \"inheritance\"\n";
    let times = "[codel]\n\"motion.brake\" = 1\n\"arm.grab\" = 1\n";
    let configuration = format!("{CONFIGURATION}{lock}");
    write(&folder, &[("robot.mal", SHARED), ("mauve.toml", &configuration), ("times.toml", times)]);
    let codels = folder.join("src");
    run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
    let page = include_str!("spec/generated-code.md");
    let recipe = page.split_once("**Codels of two libraries**").unwrap().1;
    let blocks: Vec<&str> = recipe.split("```\n").skip(1).step_by(2).take(3).collect();
    let [header, link, used] = blocks[..] else { panic!("{recipe}") };
    let (include, held) = used.split_once("\n\n").unwrap();
    let codel = |library: &str, codel: &str, before: &str, taken: &str| {
        format!(
            "#include <{library}/{library}-codels.hpp>\n#include <mutex>\n{include}\nnamespace {library} {{\n{before}int {codel}() {{\n  \
             {taken}\n  return 1;\n}}\n}}\n"
        )
    };
    write(
        &codels,
        &[
            ("motion/include/motion/bus.hpp", header),
            ("arm/user.cmake", link),
            ("arm/src/codels/grab.cpp", &codel("arm", "grab", "", held)),
            ("motion/src/codels/brake.cpp", &codel("motion", "brake", "MauveLock bus(\"bus\");\n", held)),
        ],
    );
    let arguments = ["--build-only", "--codels", codels.to_str().unwrap()];
    let built = mauve_run(&folder, &folder.join("cache"), &arguments);
    assert!(built.status.success(), "{}", text(&built.stderr));
    let recording = folder.join("rec");
    let recorded = ["--for", "1s", "--trace", recording.to_str().unwrap(), "--allow-non-realtime"];
    let arguments = &recorded[..if has_real_time() { 4 } else { 5 }];
    let (code, out, err) = run_program(Path::new(text(&built.stdout).trim()), "", arguments);
    assert!(code == Some(0) || code == Some(1), "{out}{err}");
    let executions = std::fs::read_to_string(recording.join("executions.csv")).unwrap();
    for codel in ["arm.grab", "motion.brake"] {
        let key = format!("(lock bus) {codel},");
        assert!(executions.lines().any(|line| line.starts_with(&key)), "{key}\n{executions}");
    }
}
