//! Builds of `mauve run`, with a `cmake` and a compiler that only tell how they were started.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use mauve_tests::{scratch, test_name, write};

use crate::MAUVE;

const ROBOT: &str = "\
library l {
  codel f(in a: int): int
  shell S { }
  core K(S) { var v: int = 0  update = { v = f(v); } }
  component C(S, K)
}
architecture A { instance a: l.C }
deployment D { architecture A  activity a { affinity = 1  priority = 2  period = 10 } }
";

/// A project, with programs in `bin` and a home of its own.
struct Bench(PathBuf);

impl Bench {
    fn new(name: &str) -> Bench {
        let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("builds-{}-{name}", test_name()));
        let bench = Bench(folder.canonicalize().unwrap());
        write(&bench.0, &[("robot.mal", ROBOT)]);
        bench.program("bin/cmake", "");
        bench.program("bin/make", "");
        bench.program("bin/c++", "cat \"$0.version\"");
        write(&bench.0, &[("bin/c++.version", "c++ 1")]);
        bench
    }

    fn program(&self, path: &str, script: &str) {
        write(&self.0, &[(path, format!("#!/bin/sh\n{script}\n").as_str())]);
        fs::set_permissions(self.0.join(path), fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn command(&self, environment: &[(&str, &str)]) -> Command {
        let mut command = Command::new(MAUVE);
        command
            .args(["run", "robot.mal", "--build-only"])
            .current_dir(&self.0)
            .env_clear()
            .env("HOME", &self.0);
        command.env("PATH", format!("{}:/usr/bin:/bin", self.0.join("bin").display()));
        command.envs(environment.iter().copied());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// The path of the program that would be built.
    fn built(&self, environment: &[(&str, &str)]) -> String {
        let output = self.command(environment).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    fn text(&self, path: &str) -> Option<String> {
        fs::read_to_string(self.0.join(path)).ok()
    }

    /// The processes of a build that has begun.
    fn processes(&self) -> Vec<String> {
        wait("the build begins", || self.text("processes").filter(|text| text.lines().count() == 3))
            .lines()
            .map(str::to_owned)
            .collect()
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn wait<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "{what}: it does not");
        sleep(Duration::from_millis(20));
    }
}

/// A zombie does nothing more.
fn is_alive(process: &str) -> bool {
    let state = fs::read_to_string(format!("/proc/{process}/stat"));
    state.is_ok_and(|text| !text.rsplit(')').next().unwrap().trim().starts_with('Z'))
}

#[test]
fn other_compilers_and_flags_are_another_build() {
    let bench = Bench::new("key");
    let same = bench.built(&[]);
    assert!(same.contains("/.cache/mauve/run/"), "{same}");
    for environment in [&[][..], &[("CMAKE_BUILD_PARALLEL_LEVEL", "3")], &[("LANG", "C")]] {
        assert_eq!(bench.built(environment), same, "{environment:?}");
    }
    write(&bench.0, &[("tools/chain.cmake", "a")]);
    bench.program("tools/c++", "echo other");
    let (chain, other) = (bench.0.join("tools/chain.cmake"), bench.0.join("tools/c++"));
    let (chain, other) = (chain.to_str().unwrap(), other.to_str().unwrap());
    let mut all = vec![same];
    for environment in [
        &[("CXXFLAGS", "-O0")][..],
        &[("CXXFLAGS", "-O1")],
        &[("CFLAGS", "-O0")],
        &[("CPPFLAGS", "-DA")],
        &[("LDFLAGS", "-O0")],
        &[("CXX", other)],
        &[("CC", other)],
        &[("CPLUS_INCLUDE_PATH", "/a")],
        &[("CMAKE_BUILD_TYPE", "Debug")],
        &[("CMAKE_GENERATOR", "Ninja")],
        &[("CMAKE_PREFIX_PATH", "/a")],
        &[("CMAKE_TOOLCHAIN_FILE", chain)],
        &[("CMAKE_PREFIX_PATH", "/a"), ("CXXFLAGS", "-O0")],
    ] {
        all.push(bench.built(environment));
    }
    // Another file of the same name, and another compiler.
    write(&bench.0, &[("tools/chain.cmake", "b"), ("bin/c++.version", "c++ 2")]);
    all.push(bench.built(&[("CMAKE_TOOLCHAIN_FILE", chain)]));
    all.push(bench.built(&[]));
    let count = all.len();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), count, "{all:#?}");
}

#[test]
fn programs_of_the_current_folder_are_not_started() {
    let bench = Bench::new("path");
    for program in ["cmake", "make", "c++", "g++", "cc", "tools/c++"] {
        bench.program(program, "echo \"$0\" >>obeyed");
    }
    bench.program("bin/cmake", "echo \"$PATH\" >path");
    let bin = bench.0.join("bin").display().to_string();
    for path in [format!(":{bin}"), format!("{bin}:"), format!(".:tools:{bin}::../x:/usr/bin")] {
        bench.built(&[("PATH", &path)]);
        let absolute = if path.ends_with("/usr/bin") { format!("{bin}:/usr/bin") } else { bin.clone() };
        // CMake, and what it starts, find no others.
        assert_eq!(bench.text("path").unwrap().trim(), absolute);
    }
    let output = bench.command(&[("PATH", ":.:tools")]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("does not find on PATH: CMake, a C++ compiler, make;"),
        "{}",
        said(&output)
    );
    assert_eq!(bench.text("obeyed"), None);
}

/// Begins a build that does not end, of three processes. The last one is deaf to signals that it can ignore.
fn endless(name: &str, is_deaf: bool) -> (Bench, Child) {
    let bench = Bench::new(name);
    let deaf = if is_deaf { "trap '' TERM HUP INT; " } else { "" };
    bench.program(
        "bin/cmake",
        &format!(
            "[ \"$1\" = --build ] || exit 0\ncd {}\necho $$ >>processes\n\
             (sh -c '{deaf}echo $$ >>processes; while :; do sleep 1; done' & echo $! >>processes; wait)\n",
            bench.0.display()
        ),
    );
    let child = bench.command(&[]).spawn().unwrap();
    (bench, child)
}

fn send(signal: &str, process: u32) {
    let sent = Command::new("kill").args([signal, &process.to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn a_signal_ends_a_build_before_its_lock_is_free() {
    std::thread::scope(|scope| {
        for (signal, is_deaf) in [("-TERM", false), ("-INT", false), ("-HUP", false), ("-TERM", true)] {
            scope.spawn(move || {
                let (bench, child) = endless(&format!("{signal}{is_deaf}"), is_deaf);
                let processes = bench.processes();
                assert!(processes.iter().all(|it| is_alive(it)), "{signal}");
                send(signal, child.id());
                let output = child.wait_with_output().unwrap();
                let alive: Vec<&String> = processes.iter().filter(|it| is_alive(it)).collect();
                alive.iter().for_each(|it| send("-KILL", it.parse().unwrap()));
                assert!(alive.is_empty(), "{signal}: {alive:?} of the build are left");
                assert_eq!(output.status.code(), Some(2), "{signal}");
                assert!(said(&output).contains("was ended by a signal: nothing runs"), "{}", said(&output));
                // The next run builds there.
                bench.program("bin/cmake", "");
                bench.built(&[]);
            });
        }
    });
}

#[test]
fn a_second_build_says_who_has_the_folder() {
    let (bench, child) = endless("second", false);
    bench.processes();
    let output = bench.command(&[]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let expected = format!("process {} (`mauve`) writes to `", child.id());
    assert!(said(&output).contains(&expected), "{}", said(&output));
    send("-TERM", child.id());
    child.wait_with_output().unwrap();
}

/// A signal that is ignored, as by `nohup`, does not end a build.
#[test]
fn an_ignored_signal_ends_no_build() {
    let bench = Bench::new("ignored");
    bench.program(
        "bin/cmake",
        &format!("cd {}; touch begun; while [ ! -e end ]; do sleep 0.1; done", bench.0.display()),
    );
    let mut command = Command::new("/bin/sh");
    let command = command.args(["-c", &format!("trap '' HUP; exec '{MAUVE}' run robot.mal --build-only")]);
    command.current_dir(&bench.0).env_clear().env("HOME", &bench.0);
    command.env("PATH", format!("{}:/usr/bin:/bin", bench.0.join("bin").display()));
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait("the build begins", || bench.text("begun"));
    send("-HUP", child.id());
    sleep(Duration::from_millis(200));
    write(&bench.0, &[("end", "")]);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(bench.0.join(".cache/mauve/run").is_dir());
}

/// CPUs that this computer lacks are refused before anything is built.
#[test]
fn missing_cpus_are_refused_before_the_build() {
    let bench = Bench::new("cpus");
    write(&bench.0, &[("robot.mal", &ROBOT.replace("affinity = 1", "cpus = [1, 128]"))]);
    bench.program("bin/cmake", "touch built");
    let mut command = Command::new(MAUVE);
    command.args(["run", "robot.mal"]).current_dir(&bench.0).env("HOME", &bench.0);
    command.env("PATH", format!("{}:/usr/bin:/bin", bench.0.join("bin").display()));
    let output = command.output().unwrap();
    let refused = "programs on this computer may not use CPU 128 of the deployment";
    assert!(output.status.code() == Some(2) && said(&output).contains(refused), "{}", said(&output));
    assert_eq!(bench.text("built"), None);
}
