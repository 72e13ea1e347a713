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

/// Runs a case of `ros2/peer.py` where nothing but a loopback is.
fn peer(case: &str) {
    let cache = std::env::var_os("MAUVE_TEST_CACHE").map_or_else(
        || PathBuf::from(std::env::var_os("HOME").unwrap()).join(".cache/mauve-tests"),
        PathBuf::from,
    );
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/ros2/peer.py");
    let mut command = Command::new("unshare");
    command.args(["--net", "sh", "-c", "ip link set lo up && exec \"$@\"", "peer"]);
    run(command.arg(cache.join("ros2/bin/python")).arg(script).arg(case).arg(rig()));
}

#[test]
fn ros2_samples_of_all_types_are_read_and_written() {
    peer("catalogue");
}

#[test]
fn ros2_topics_go_both_ways() {
    peer("both_ways");
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
