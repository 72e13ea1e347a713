//! The runtime for Linux under load: with sanitizers, and with an eye on what threads of components must not do.
//!
//! `tests/run` installs what builds it; without that these tests fail with a message.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};
use mauve_tests::scratch;

/// Components in a ring, and the periods of each: a million in total.
const RING: [&str; 2] = ["100", "10000"];

/// Builds the ring of components, with a sanitizer if there is one, and returns the folder of the programs.
fn stress(name: &str, compiler: &str, sanitizer: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("stress_{name}"));
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/orocos/stress");
    run(Command::new("cmake").arg("-S").arg(sources).arg("-B").arg(&folder).args([
        format!("-DRUNTIME={}", runtime_sources().display()),
        format!("-DSANITIZER={sanitizer}"),
        format!("-DCMAKE_CXX_COMPILER={compiler}"),
        "-DCMAKE_CXX_FLAGS=-Werror".to_owned(),
    ]));
    run(build(&folder).arg("-j2"));
    folder
}

/// Runs it: a fault of the components, or of a sanitizer, is a failure.
fn ring(folder: &Path, environment: &[(&str, &Path)]) -> (String, String) {
    let mut command = Command::new(folder.join("stress"));
    let output =
        command.args(RING).arg("0").envs(environment.iter().copied()).output().unwrap_or_else(|error| {
            panic!("{command:?} does not run: {error}");
        });
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{out}\n{err}");
    assert!(out.starts_with("1000000 periods, ") && out.ends_with(" 0 faults\n"), "{out}\n{err}");
    (out, err)
}

#[test]
fn orocos_runtime_has_no_race() {
    let (_, err) = ring(&stress("thread", COMPILERS[0], "thread"), &[]);
    assert_eq!(err, "");
}

#[test]
fn orocos_runtime_has_no_invalid_access() {
    let (_, err) = ring(&stress("address", COMPILERS[0], "address,undefined"), &[]);
    assert_eq!(err, "");
}

#[test]
fn orocos_runtime_neither_locks_nor_allocates() {
    let folder = stress("interposed", COMPILERS[1], "");
    let (_, err) = ring(&folder, &[("LD_PRELOAD", &folder.join("libinterposer.so"))]);
    assert!(err.starts_with("interposer: 0 allocations, 0 locks,"), "{err}");
}
