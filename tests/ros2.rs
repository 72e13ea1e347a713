//! A robot with topics of ROS 2, `ros2/rig`, beside programs of other implementations of DDS, in a network of its own.
//!
//! `tests/run` installs what they need; without that these tests fail with a message.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};
use serde_json::Value;

use crate::standalone::has_real_time;

/// Builds the robot and its peers once for all tests, and returns their folder.
fn rig() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2_rig");
    std::fs::create_dir_all(&folder).unwrap();
    // Tests are processes: the first builds it, and the others wait.
    let lock = File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/ros2/rig");
    run(Command::new("cmake").arg("-S").arg(sources).arg("-B").arg(&folder).args([
        format!("-DRUNTIME={}", runtime_sources().display()),
        format!("-DCMAKE_CXX_COMPILER={}", COMPILERS[0]),
    ]));
    run(&mut build(&folder));
    folder
}

/// Runs a case of `ros2/peer.py` beside the robot where nothing but a loopback is.
fn peer(case: &str) {
    peer_beside(case, &rig());
}

/// The same beside the program `robot` of a folder.
fn peer_beside(case: &str, folder: &Path) {
    let cache = std::env::var_os("MAUVE_TEST_CACHE").map_or_else(
        || PathBuf::from(std::env::var_os("HOME").unwrap()).join(".cache/mauve-tests"),
        PathBuf::from,
    );
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/ros2/peer.py");
    let mut command = Command::new("unshare");
    command.args(["--net", "sh", "-c", "ip link set lo up && exec \"$@\"", "peer"]);
    run(command.arg(cache.join("ros2/bin/python")).arg(script).arg(case).arg(folder));
}

#[test]
fn ros2_samples_of_all_types_are_read_and_written() {
    peer("catalogue");
}

#[test]
fn ros2_topics_go_both_ways() {
    peer("both_ways");
}

const MODEL: &str = "
library rig {
  use geometry_msgs use sensor_msgs
  shell PilotShell {
    input port goal: Twist  input port scan: LaserScan  output port twist: Twist  output port speed: double
  }
  core PilotCore(PilotShell) {
    var seen: Twist; var ranges: LaserScan;
    update = {
      if (read(goal, seen) == new_data) then { write(twist, seen); } else { }
      read(scan, ranges);
      write(speed, 1.5);
    }
  }
  component Pilot(PilotShell, PilotCore)
  architecture Robot { instance pilot: Pilot }
  deployment Base { architecture Robot  activity pilot { priority = 10  period = 10 } }
}
";

const CONFIGURATION: &str = "
[ros2]
namespace = \"/rig\"
gateway = { priority = 20, period = \"2 ms\" }
[ros2.topics]
\"pilot.goal\" = { name = \"/cmd_vel\", depth = 4 }
\"pilot.scan\" = \"/scan\"
\"pilot.speed\" = \"/speed\"
";

#[test]
fn ros2_a_model_becomes_a_program_with_topics() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "ros2_program");
    mauve_tests::write(&folder, &[("robot.mal", MODEL), ("mauve.toml", CONFIGURATION)]);
    let built = Command::new(crate::MAUVE)
        .args(["run", "--ros2", "--build-only"])
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .current_dir(&folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{said}");
    let program = String::from_utf8(built.stdout).unwrap();
    std::os::unix::fs::symlink(program.trim(), folder.join("robot")).unwrap();
    peer_beside("generated", &folder);
}

/// The headers of ROS 2 for the messages of `MODEL`: with a mark in the types.
fn headers_of_ros2(prefix: &Path) {
    let messages = [
        ("builtin_interfaces", "time", "Time", "", "std::int32_t sec = 0; std::uint32_t nanosec = 0;"),
        (
            "std_msgs",
            "header",
            "Header",
            "builtin_interfaces/msg/time.hpp",
            "builtin_interfaces::msg::Time stamp; std::string frame_id;",
        ),
        ("std_msgs", "float64", "Float64", "", "double data = 0;"),
        ("geometry_msgs", "vector3", "Vector3", "", "double x = 0, y = 0, z = 0;"),
        (
            "geometry_msgs",
            "twist",
            "Twist",
            "geometry_msgs/msg/vector3.hpp",
            "geometry_msgs::msg::Vector3 linear, angular;",
        ),
        (
            "sensor_msgs",
            "laser_scan",
            "LaserScan",
            "std_msgs/msg/header.hpp",
            "std_msgs::msg::Header header; float angle_min = 0, angle_max = 0, angle_increment = 0, time_increment = 0, \
             scan_time = 0, range_min = 0, range_max = 0; std::vector<float> ranges, intensities;",
        ),
    ];
    for (package, file, name, included, fields) in messages {
        let include = if included.is_empty() { String::new() } else { format!("#include <{included}>\n") };
        let text = format!(
            "#pragma once\n#include <cstdint>\n#include <string>\n#include <vector>\n{include}namespace {package} {{ namespace msg {{\n\
             template <class Allocator> struct {name}_ {{ enum {{ of_ros2 }}; {fields} }};\nusing {name} = {name}_<std::allocator<void>>;\n}} }}\n"
        );
        mauve_tests::write(prefix, &[(&format!("include/{package}/{package}/msg/{file}.hpp"), &text)]);
    }
}

#[test]
fn ros2_a_model_becomes_a_package_for_colcon() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "ros2_package");
    let model =
        MODEL.replace("shell PilotShell", "codel look(in scan: LaserScan): double\n  shell PilotShell");
    let model = model.replace("write(speed, 1.5)", "write(speed, look(ranges))");
    mauve_tests::write(&folder, &[("robot.mal", &model), ("mauve.toml", CONFIGURATION)]);
    let out = folder.join("src");
    let generate = || {
        Command::new(crate::MAUVE).args(["generate", "--ros2", "src"]).current_dir(&folder).output().unwrap()
    };
    let said = generate();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    headers_of_ros2(&folder.join("ros2"));
    run(Command::new("python3").args(["-m", "py_compile"]).arg(out.join("standalone/launch/Base.launch.py")));
    let installed = |name: &str, prefix: &str| {
        let [build_folder, install] =
            [format!("build_{name}"), format!("install_{name}")].map(|it| folder.join(it));
        run(Command::new("cmake")
            .arg("-S")
            .arg(out.join("standalone"))
            .arg("-B")
            .arg(&build_folder)
            .args([
                format!("-DCMAKE_INSTALL_PREFIX={}", install.display()),
                format!("-DCMAKE_CXX_COMPILER={}", COMPILERS[0]),
            ])
            .env("AMENT_PREFIX_PATH", prefix));
        run(&mut build(&build_folder));
        run(Command::new("cmake").arg("--install").arg(&build_folder));
        let files = [
            "lib/rig_ros2/rig-Base",
            "lib/rig_ros2/libmauve-rtt.so",
            "share/rig_ros2/package.xml",
            "share/rig_ros2/launch/Base.launch.py",
            "share/ament_index/resource_index/packages/rig_ros2",
        ];
        for file in files {
            assert!(install.join(file).is_file(), "{file}");
        }
        // It finds its libraries where it is installed.
        std::fs::remove_dir_all(build_folder).unwrap();
        run(Command::new(install.join("lib/rig_ros2/rig-Base")).arg("--help"));
    };
    installed("plain", "");
    let codel = out.join("rig/src/codels/look.cpp");
    let stub = std::fs::read_to_string(&codel).unwrap();
    std::fs::write(
        &codel,
        format!("{stub}\nstatic_assert(sensor_msgs::msg::LaserScan::of_ros2 == 0, \"\");\n"),
    )
    .unwrap();
    installed("sourced", folder.join("ros2").to_str().unwrap());

    // What is missing is said.
    mauve_tests::write(&folder, &[("mauve.toml", "")]);
    let said = generate();
    let text = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(said.status.code() == Some(2) && text.contains("write `[ros2]` with a `gateway`"), "{text}");
}

/// A camera on one host; a tracker and a controller on another host use its images. The deadlines are long: a virtual machine meets them
/// although it pauses for a moment.
const TWO_HOSTS: &str = "
library rig {
  use geometry_msgs
  codel shoot(): Point
  codel track(in frame: Point): Point
  codel steer(in target: Point): double
  shell CameraShell { output port frame: Point }
  core CameraCore(CameraShell) { update = { write(frame, shoot()); } }
  component Camera(CameraShell, CameraCore)
  shell TrackerShell { input port frame: Point  output port target: Point }
  core TrackerCore(TrackerShell) {
    var seen: Point;
    update = { if (read(frame, seen) == new_data) then { write(target, track(seen)); } else { } }
  }
  component Tracker(TrackerShell, TrackerCore)
  shell ControllerShell { input port target: Point  output port speed: double }
  core ControllerCore(ControllerShell) {
    var seen: Point;
    update = { if (read(target, seen) == new_data) then { write(speed, steer(seen)); } else { } }
  }
  component Controller(ControllerShell, ControllerCore)
  architecture Robot {
    instance camera: Camera  instance tracker: Tracker  instance controller: Controller
    connection camera.frame -> [4] tracker.frame
    connection tracker.target -> controller.target
  }
  deployment Base {
    architecture Robot
    activity camera { priority = 30  period = 40  deadline = 40 }
    activity tracker { priority = 30  period = 20  deadline = 20 }
    activity controller { priority = 20  period = 40  deadline = 40 }
  }
}
";

const HOSTS: &str = "
[assume]
codel = \"300 us\"
[ros2]
discovery = \"subnet\"
namespace = \"/rig\"
gateway = { priority = 10, period = \"4 ms\" }
[host.brain]
cpus = 1
activities = [\"tracker\", \"controller\"]
[host.eyes]
cpus = 1
activities = [\"camera\"]
[link.\"eyes-brain\"]
latency = \"2 ms\"
[chains.sight]
from = \"camera.frame\"
to = \"tracker.frame\"
";

/// A sample is its number, and the time at which it was made: all network namespaces of a computer have one monotonic clock.
const SHOOT: &str = "
#include <rig/rig-codels.hpp>
#include <time.h>
namespace rig {
geometry_msgs::Point shoot() {
  static double number = 0;
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  geometry_msgs::Point frame;
  frame.x = ++number;
  frame.y = now.tv_sec * 1e9 + now.tv_nsec;
  return frame;
}
}
";

/// Writes the numbers and the ages in ns of samples.
const TRACK: &str = "
#include <rig/rig-codels.hpp>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
namespace rig {
geometry_msgs::Point track(const geometry_msgs::Point& frame) {
  static FILE* const ages = fopen(getenv(\"AGES\"), \"w\");
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  fprintf(ages, \"%.0f %.0f\\n\", frame.x, now.tv_sec * 1e9 + now.tv_nsec - frame.y);
  fflush(ages);
  return frame;
}
}
";

/// Returns the greatest age that data of `camera.frame` had when `tracker` used it.
fn observed_age(folder: &Path) -> Duration {
    let ages = std::fs::read_to_string(folder.join("ages")).unwrap();
    let ages = ages.lines().filter_map(|it| it.split_once(' ')?.1.parse().ok());
    Duration::from_nanos(ages.max().unwrap())
}

/// Returns the bound of the analysis for it: the latency of the chain, without what passes until the camera makes an image.
fn bound_of_age(folder: &Path) -> Duration {
    let chains = ["chains", "--format", "json", "--chain", "sight"];
    let shown = Command::new(crate::MAUVE).args(chains).arg(folder).output().unwrap();
    let shown: Value = serde_json::from_slice(&shown.stdout).unwrap();
    let chain = &shown["chains"][0];
    let ms = chain["latency"].as_f64().unwrap() - chain["hops"][0]["wait"].as_f64().unwrap();
    Duration::from_secs_f64(ms / 1e3)
}

#[test]
fn ros2_a_run_names_one_of_the_hosts() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "ros2_named_hosts");
    mauve_tests::write(&folder, &[("robot.mal", TWO_HOSTS), ("mauve.toml", HOSTS)]);
    let refusal = |arguments: &[&str]| {
        let refused =
            Command::new(crate::MAUVE).arg("run").args(arguments).current_dir(&folder).output().unwrap();
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(refused.stderr).unwrap()
    };
    assert_eq!(
        [refusal(&[]), refusal(&["--simulate-time"]), refusal(&["--host", "eye"])],
        [
            "mauve: `rig.Base` runs on hosts brain, eyes: name one of them, such as `--host brain`\n",
            "mauve: `rig.Base` runs on hosts brain, eyes: name one of them, such as `--host brain`\n",
            "mauve: there is no host `eye`: `rig.Base` runs on brain, eyes; did you mean `eyes`?\n",
        ]
    );
    mauve_tests::write(&folder, &[("mauve.toml", "")]);
    assert_eq!(
        refusal(&["--host", "eyes"]),
        "mauve: there is no host `eyes`: the robot has one computer; omit --host, or write `[host.eyes]` into mauve.toml\n"
    );
}

#[test]
fn ros2_each_of_two_hosts_goes_on_without_the_other() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "ros2_hosts");
    mauve_tests::write(&folder, &[("robot.mal", TWO_HOSTS), ("mauve.toml", HOSTS)]);
    let codels = folder.join("src");
    run(Command::new(crate::MAUVE).arg("generate").arg(&folder).arg("--out").arg(&codels));
    let files = [("rig/src/codels/shoot.cpp", SHOOT), ("rig/src/codels/track.cpp", TRACK)];
    mauve_tests::write(&codels, &files);
    let program = |host: &str| {
        let mut command = Command::new(crate::MAUVE);
        command.arg("run").arg(&folder).args(["--build-only", "--host", host]).arg("--codels").arg(&codels);
        let built = command.env("XDG_CACHE_HOME", folder.join("cache")).output().unwrap();
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        PathBuf::from(String::from_utf8(built.stdout).unwrap().trim())
    };
    let mut command = Command::new("unshare");
    command.args(["--net", "--pid", "--fork", "--kill-child", "--mount-proc", "python3"]);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/ros2/hosts.py"));
    command.arg(&folder).arg(program("eyes")).arg(program("brain"));
    run(command.args((!has_real_time()).then_some("--allow-non-realtime")));
    let observed = observed_age(&folder);
    eprintln!("camera.frame is at most {observed:?} old when tracker uses it");
    let bound = bound_of_age(&folder);
    assert!(observed <= bound, "{observed:?} > {bound:?}");
}

#[test]
fn ros2_topics_go_both_ways_with_fast_dds() {
    peer("fast");
}

#[test]
fn ros2_strangers_stop_no_robot() {
    peer("strangers");
}

#[test]
fn ros2_threads_are_scheduled_and_neither_lock_nor_allocate_in_a_flood() {
    peer("scheduling");
}

#[test]
fn ros2_packets_that_nobody_can_read_stop_no_activity() {
    peer("junk");
}

#[test]
fn ros2_robot_starts_with_all_topics_or_not_at_all() {
    peer("refusals");
}
