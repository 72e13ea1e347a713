//! A robot with topics of ROS 2, `ros2/rig`, beside programs of other implementations of DDS, in a network of its own.
//!
//! `tests/run` installs what they need; without that these tests fail with a message.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};

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
