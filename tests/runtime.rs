//! The runtime for Linux under load: with sanitizers, and with an eye on what threads of components must not do. Its virtual
//! clock, beside the simulation and the bounds of the analysis.
//!
//! `tests/run` installs what builds it; without that these tests fail with a message.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};
use mauve_tests::scratch;
use mauve_timing::{
    Bound, CpuSet, Edge, Method, Options, Random, Response, SimulationOptions, StateMachine, Tasks, Time,
};

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
    run(&mut build(&folder));
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

/// Releases until here, in ns: three times the least common multiple of all periods and sequences of times.
const LAST_RELEASE: u64 = 9_000;

/// A task of a random set.
struct Task {
    period: u64,
    offset: u64,
    priority: u32,
    cpus: u64,
    /// The times of its jobs, again and again.
    times: Vec<u64>,
}

/// Random tasks with different priorities. If they do not share their CPUs, each uses one of them only.
fn tasks(random: &mut Random, cpus: u64, shares_cpus: bool) -> Vec<Task> {
    let mut from = |least: u64, greatest: u64| least + random.up_to(greatest - least);
    let count = from(2, 5) * cpus;
    let mut priorities: Vec<u32> = (1..=count as u32).collect();
    for last in (1..priorities.len()).rev() {
        priorities.swap(last, from(0, last as u64) as usize);
    }
    let tasks = priorities.into_iter().map(|priority| {
        let period = [50, 100, 200, 250, 500][from(0, 4) as usize];
        let greatest = 3 * period * cpus / (2 * count);
        let times = (0..from(1, 3)).map(|_| from(0, greatest)).collect();
        let mask = if shares_cpus { from(1, (1 << cpus) - 1) } else { 1 << from(0, cpus - 1) };
        Task { period, offset: from(0, 1) * from(0, period - 1), priority, cpus: mask, times }
    });
    tasks.collect()
}

/// The tasks as the analysis reads them.
fn activities(tasks: &[Task]) -> Tasks {
    let activity = |task: &Task| {
        let count = task.times.len() as u32;
        let edges = task.times.iter().zip(0..).map(|(time, source)| Edge {
            source,
            target: (source + 1) % count,
            cost: Time::from_nanos(*time),
        });
        let machine = StateMachine::new(count, edges.collect()).unwrap();
        let offset = Some(Time::from_nanos(task.offset));
        let period = Time::from_nanos(task.period);
        mauve_timing::Task {
            offset,
            cpus: Some(CpuSet(task.cpus.into())),
            ..mauve_timing::Task::new(task.priority, period, machine)
        }
    };
    Tasks::new(tasks.iter().map(activity).collect())
}

/// The greatest response time of each task on the virtual clock.
fn on_the_virtual_clock(program: &Path, cpus: u64, tasks: &[Task]) -> Vec<Option<Time>> {
    let mut input = format!("{} {LAST_RELEASE}\n", (1 << cpus) - 1);
    for Task { period, offset, priority, cpus, times } in tasks {
        let _ = write!(input, "{period} {offset} {priority} {cpus} {}", times.len());
        times.iter().for_each(|time| input += &format!(" {time}"));
        input.push('\n');
    }
    let mut child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{input}");
    let said = String::from_utf8(output.stdout).unwrap();
    let response = |line: &str| {
        let (periods, response) = line.split_once(' ').unwrap();
        (periods != "0").then(|| Time::from_nanos(response.parse().unwrap()))
    };
    said.lines().map(response).collect()
}

#[test]
fn orocos_virtual_clock_schedules_as_the_simulation_and_keeps_the_bounds() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "clock");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/orocos/clock");
    run(Command::new("cmake")
        .arg("-S")
        .arg(sources)
        .arg("-B")
        .arg(&folder)
        .arg(format!("-DRUNTIME={}", runtime_sources().display())));
    run(&mut build(&folder));
    let program = folder.join("clock");
    let mut random = Random::new(1);
    let (mut equal, mut compared) = (0, 0);
    for round in 0..600 {
        let (cpus, shares_cpus) = (1 + round % 3, round % 2 == 0);
        let tasks = tasks(&mut random, cpus, shares_cpus);
        let set = activities(&tasks);
        let options = Options { method: Method::Exact, horizon: None, is_brief: false };
        let analysis = set.response_times(&options, &|| {});
        let bound = |it: &Response| if let Bound::Response(time) = it.bound { Some(time) } else { None };
        // Without bounds, late jobs may queue for ever.
        let bounds: Option<Vec<Time>> = analysis.responses.iter().map(bound).collect();
        let Some(bounds) = bounds else { continue };
        let found = on_the_virtual_clock(&program, cpus, &tasks);
        // The clock ends when all released jobs have ended: the simulation, somewhat before and somewhat after that.
        let [before, after] = [1, 2].map(|times| {
            let options = SimulationOptions {
                least_time: 100,
                initial_states: vec![Some(0); tasks.len()],
                ..SimulationOptions::new(1, Time::from_nanos(times * LAST_RELEASE))
            };
            set.simulate(&options, &|| {}).statistics
        });
        for (number, (found, bound)) in found.iter().zip(&bounds).enumerate() {
            let found = found.unwrap();
            let [before, after] = [&before, &after].map(|it| it[number].unwrap().greatest);
            compared += 1;
            equal += usize::from(before == after);
            let place = format!("round {round}, task {number}");
            assert!(found <= *bound, "{place}: {found} above {bound}");
            assert!(shares_cpus || (before <= Some(found) && Some(found) <= after), "{place}: {found}");
        }
    }
    assert!(compared > 1000 && 10 * equal > 9 * compared, "{equal} of {compared}");
}
