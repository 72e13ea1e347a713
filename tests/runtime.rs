//! The runtime for Linux under load: with sanitizers, and with an eye on what threads of components must not do. Its virtual
//! clock, beside the simulation and the bounds of the analysis.
//!
//! `tests/run` installs what builds it; without that these tests fail with a message.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_tests::orocos::{COMPILERS, build, run, runtime_sources};
use mauve_tests::{scratch, search};
use mauve_timing::{
    Bound, CpuSet, Edge, Method, Options, Order, Random, Response, SimulationOptions, StateMachine, Tasks,
    Time,
};

/// Components in a ring, and the periods of each in a full search: a million in total.
const RING: (&str, u64) = ("100", 10_000);

/// The values that each source writes for components that data release.
const RELEASES: &str = "3000";

/// Builds the ring of components, and those that data release, with a sanitizer if there is one, and returns the folder of the programs.
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

/// Runs one of the programs: a fault of the components, or of a sanitizer, is a failure. Returns its errors.
fn faultless(program: &Path, arguments: &[&str], environment: &[(&str, &Path)]) -> String {
    let mut command = Command::new(program);
    let output = command.args(arguments).envs(environment.iter().copied()).output();
    let output = output.unwrap_or_else(|error| panic!("{command:?} does not run: {error}"));
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{out}\n{err}");
    assert!(out.ends_with(" 0 faults\n"), "{out}\n{err}");
    err
}

/// Runs the ring, and the components that data release.
fn all(folder: &Path, environment: &[(&str, &Path)]) -> [String; 2] {
    let periods = search::cases::<u64>("MAUVE_RING", RING.1).to_string();
    let ring = [RING.0, periods.as_str(), "0"];
    [("stress", &ring[..]), ("releases", &[RELEASES])]
        .map(|(program, arguments)| faultless(&folder.join(program), arguments, environment))
}

#[test]
fn orocos_runtime_has_no_race() {
    assert_eq!(all(&stress("thread", COMPILERS[0], "thread"), &[]), ["", ""]);
}

#[test]
fn orocos_runtime_has_no_invalid_access() {
    assert_eq!(all(&stress("address", COMPILERS[0], "address,undefined"), &[]), ["", ""]);
}

#[test]
fn orocos_runtime_neither_locks_nor_allocates() {
    let folder = stress("interposed", COMPILERS[1], "");
    for err in all(&folder, &[("LD_PRELOAD", &folder.join("libinterposer.so"))]) {
        assert!(err.starts_with("interposer: 0 allocations, 0 locks,"), "{err}");
    }
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
    /// The numbers of the tasks whose jobs write what releases it, if some do; whether it needs data of all; and how often in a period at
    /// most.
    sources: Vec<usize>,
    needs_all: bool,
    burst: u64,
    /// The number of the task whose thread executes it, if it shares one, and in which order.
    thread: Option<usize>,
    order: Order,
    is_not_preempted: bool,
}

/// Lets some tasks share threads, and jobs of others release some, with the priorities and the CPUs that they have. Jobs of some are not
/// preempted.
fn share_threads_and_release(random: &mut Random, tasks: &mut [Task]) {
    for index in 1..tasks.len() {
        let (before, rest) = tasks.split_at_mut(index);
        let (Some(last), Some(task)) = (before.last_mut(), rest.first_mut()) else { continue };
        match random.up_to(4) {
            4 if last.order != Order::List || last.thread.is_none() => {
                if last.order == Order::List {
                    last.order = if random.up_to(2) == 0 { Order::Any } else { Order::Fifo };
                }
                (task.thread, task.order) = (Some(last.thread.unwrap_or(index - 1)), last.order);
                (task.priority, task.cpus) = (last.priority, last.cpus);
                if random.up_to(1) == 0 && index > 1 {
                    (task.sources, task.burst) =
                        (vec![random.up_to(index as u64 - 2) as usize], 1 + random.up_to(2));
                }
            }
            0 if last.sources.is_empty() && last.order == Order::List => {
                let thread = Some(last.thread.unwrap_or(index - 1));
                let times = std::mem::take(&mut task.times);
                let (priority, cpus) = (last.priority, last.cpus);
                let (period, offset, sources) = (last.period, last.offset, Vec::new());
                *task = Task { period, offset, priority, cpus, times, thread, sources, ..*task };
            }
            1 => {
                task.sources =
                    (0..=random.up_to(1)).map(|_| random.up_to(index as u64 - 1) as usize).collect();
                task.sources.dedup();
                task.needs_all = random.up_to(1) == 0;
                task.burst = 1 + random.up_to(2);
            }
            _ => {}
        }
    }
    for index in 0..tasks.len() {
        let leader = tasks[index].thread.map(|leader| tasks[leader].is_not_preempted);
        let may_be = tasks[index].cpus.is_power_of_two();
        tasks[index].is_not_preempted = leader.unwrap_or(may_be && random.up_to(3) == 0);
    }
}

/// Lets one thread execute jobs of some tasks in the order of their releases, no two of which are at one instant.
fn queue_some(random: &mut Random, tasks: &mut [Task]) {
    let Some((first, rest)) = tasks.split_first_mut() else { return };
    for (index, task) in (1..).zip(rest).filter(|_| random.up_to(1) == 0) {
        (task.thread, task.order, task.is_not_preempted) = (Some(0), Order::Fifo, first.is_not_preempted);
        (task.priority, task.cpus, task.offset) = (first.priority, first.cpus, 7 * index % 50);
        (first.order, first.offset) = (Order::Fifo, 0);
    }
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
        Task {
            period,
            offset: from(0, 1) * from(0, period - 1),
            priority,
            cpus: mask,
            times,
            sources: Vec::new(),
            needs_all: false,
            burst: 1,
            thread: None,
            order: Order::List,
            is_not_preempted: false,
        }
    });
    tasks.collect()
}

/// The tasks as the analysis reads them.
fn activities(tasks: &[Task]) -> Tasks {
    let mates = |leader: usize| tasks.iter().any(|task| task.thread == Some(leader));
    let activity = |(index, task): (usize, &Task)| {
        let count = task.times.len() as u32;
        let edges = task.times.iter().zip(0..).map(|(time, source)| Edge {
            source,
            target: (source + 1) % count,
            cost: Time::from_nanos(*time),
        });
        let machine = StateMachine::new(count, edges.collect()).unwrap();
        let offset = task.sources.is_empty().then_some(Time::from_nanos(task.offset));
        let period = Time::from_nanos(task.period);
        mauve_timing::Task {
            offset,
            cpus: Some(CpuSet(task.cpus.into())),
            is_sporadic: !task.sources.is_empty(),
            burst: task.burst,
            thread: task.thread.or(mates(index).then_some(index)).map(|thread| thread as u32),
            order: task.order,
            is_not_preempted: task.is_not_preempted,
            ..mauve_timing::Task::new(task.priority, period, machine)
        }
    };
    Tasks::new(tasks.iter().enumerate().map(activity).collect())
}

/// The greatest response time of each task on the virtual clock.
fn on_the_virtual_clock(program: &Path, cpus: u64, tasks: &[Task]) -> Vec<Option<Time>> {
    let mut input = format!("{} {LAST_RELEASE}\n", (1 << cpus) - 1);
    for task in tasks {
        let Task { period, offset, priority, cpus, times, sources, needs_all, burst, .. } = task;
        let sources: Vec<String> = sources.iter().map(usize::to_string).collect();
        let sources = sources.join(if *needs_all { "&" } else { "," });
        let sources = if sources.is_empty() { "-1" } else { &sources };
        let thread = task.thread.map_or(-1, |task| task as i64);
        let queue = if task.order == Order::List { "" } else { "q" };
        let preempted = if task.is_not_preempted { "n" } else { "" };
        let _ = write!(
            input,
            "{period} {offset} {priority} {cpus} {burst} {sources} {thread}{queue}{preempted} {}",
            times.len()
        );
        times.iter().for_each(|time| input += &format!(" {time}"));
        input.push('\n');
    }
    let said = clock(program, &input);
    let response = |line: &str| {
        let (periods, response) = line.split_once(' ').unwrap();
        (periods != "0").then(|| Time::from_nanos(response.parse().unwrap()))
    };
    said.lines().map(response).collect()
}

fn bound(response: &Response) -> Option<Time> {
    if let Bound::Response(time) = response.bound { Some(time) } else { None }
}

/// The number of periods of each task, and its greatest response time.
fn clock(program: &Path, input: &str) -> String {
    let mut child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{input}");
    String::from_utf8(output.stdout).unwrap()
}

fn clock_program(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/orocos/clock");
    run(Command::new("cmake")
        .arg("-S")
        .arg(sources)
        .arg("-B")
        .arg(&folder)
        .arg(format!("-DRUNTIME={}", runtime_sources().display())));
    run(&mut build(&folder));
    folder.join("clock")
}

/// Releases by data, shared threads and late jobs, up to 100: each task is a line of the input, see `clock.cpp`.
#[test]
fn orocos_virtual_clock_releases_by_data_and_in_shared_threads() {
    let program = clock_program("releases");
    for (cpus, tasks, expected) in [
        // Data comes at 1, 11, 21, …: released at 1, 26, 51 and 76.
        (3, "10 0 2 1 -1 -1 -1 1 1\n25 0 1 2 1 0 -1 1 3", "10 1\n4 3\n"),
        // At 1, 11, 26, 36, 51, 61, 76 and 86: never more than two in 25.
        (3, "10 0 2 1 -1 -1 -1 1 1\n25 0 1 2 2 0 -1 1 3", "10 1\n8 3\n"),
        // Only the data that comes: at 1 and 61. On the writer's CPU with a higher priority, it preempts it.
        (1, "60 0 1 1 -1 -1 -1 1 1\n25 0 2 1 1 0 -1 1 3", "2 1\n2 3\n"),
        // A chain; the second gap is longer. Released at 1, 31, 61, 91 and then at 3, 43, 83.
        (1, "30 0 1 1 -1 -1 -1 1 1\n20 0 2 1 1 0 -1 1 2\n40 0 3 1 1 1 -1 1 1", "4 1\n4 2\n3 1\n"),
        // The second waits for the first, and the third for both.
        (1, "10 0 2 1 -1 -1 -1 1 2\n10 0 2 1 -1 -1 0 1 3\n10 0 2 1 -1 -1 0 2 1 2", "10 2\n10 5\n10 7\n"),
        // A late job delays the next ones, and none is dropped.
        (1, "5 0 1 1 -1 -1 -1 20 12 2 2 2 2 2 2 2 2 2 2 2 2 2 2 2 2 2 2 2", "20 12\n"),
        // Data during a late job releases the next one in its gap's end, which is before its begin.
        (3, "10 0 1 1 -1 -1 -1 1 1\n15 0 1 2 1 0 -1 2 20 1", "10 1\n7 20\n"),
        // Data comes at 1, 11, 21, … and at 6, 36, 66 and 96: any releases a job; all do when the second has come.
        (7, "10 0 2 1 -1 -1 -1 1 1\n30 5 1 2 -1 -1 -1 1 1\n5 0 1 4 1 0,1 -1 1 1", "10 1\n4 1\n14 1\n"),
        (7, "10 0 2 1 -1 -1 -1 1 1\n30 5 1 2 -1 -1 -1 1 1\n5 0 1 4 1 0&1 -1 1 1", "10 1\n4 1\n4 1\n"),
        // A gap of 20 delays those at 6, 11 and 21 to 21, …; all that comes in a gap is for its end.
        (7, "10 0 2 1 -1 -1 -1 1 1\n30 5 1 2 -1 -1 -1 1 1\n20 0 1 4 1 0,1 -1 1 1", "10 1\n4 1\n5 1\n"),
        // A queue: the releases at 0 in the order of the list, and that at 10 before the end of none of them.
        (1, "10 0 1 1 -1 -1 -1 1 2\n25 0 1 1 -1 -1 0q 1 4\n40 0 1 1 -1 -1 0q 1 5", "10 3\n4 6\n3 11\n"),
        // The one at 1, then that at 2, then that at 3, whatever the list says.
        (1, "50 3 1 1 -1 -1 -1 1 10\n50 1 1 1 -1 -1 0q 1 4\n50 2 1 1 -1 -1 0q 1 4", "2 16\n2 4\n2 7\n"),
        // Data comes at 3, after the release at 2; then at 1, before it.
        (
            3,
            "20 2 2 2 -1 -1 -1 1 1\n20 0 1 1 -1 -1 -1 1 5\n20 0 1 1 1 0 1q 1 2\n20 2 1 1 -1 -1 1q 1 3",
            "5 1\n5 5\n5 7\n5 6\n",
        ),
        (
            3,
            "20 0 2 2 -1 -1 -1 1 1\n20 0 1 1 -1 -1 -1 1 5\n20 0 1 1 1 0 1q 1 2\n20 2 1 1 -1 -1 1q 1 3",
            "5 1\n5 5\n5 6\n5 8\n",
        ),
        // Data at 1, 11, 21, …, two in 25: the release at 26, after the gap, is older than that at 27.
        (3, "10 0 2 2 -1 -1 -1 1 1\n50 27 1 1 -1 -1 -1 1 3\n25 0 1 1 2 0 1q 1 2", "10 1\n2 4\n8 2\n"),
        // A job that is not preempted delays the one of higher priority, which comes before the next job of the list.
        (1, "50 1 2 1 -1 -1 -1 1 1\n50 0 1 1 -1 -1 -1n 1 5\n50 0 1 1 -1 -1 1n 1 5", "2 5\n2 5\n2 11\n"),
        // The release at the end of a job comes before the next job, too.
        (1, "50 5 2 1 -1 -1 -1 1 1\n50 0 1 1 -1 -1 -1n 1 5\n50 0 1 1 -1 -1 1n 1 5", "2 1\n2 5\n2 11\n"),
    ] {
        assert_eq!(clock(&program, &format!("{cpus} 100\n{tasks}\n")), expected, "{tasks}");
    }
}

#[test]
fn orocos_virtual_clock_keeps_the_bounds_of_threads_and_of_releases_by_data() {
    let program = clock_program("bounds");
    let mut random = Random::new(2);
    let [mut shared, mut released, mut late, mut queued, mut raised] = [0; 5];
    for round in 0..400 {
        let (cpus, shares_cpus) = (1 + round % 3, round % 2 == 0);
        let mut tasks = tasks(&mut random, cpus, shares_cpus);
        share_threads_and_release(&mut random, &mut tasks);
        let options = Options { method: Method::Exact, is_brief: false };
        let responses = activities(&tasks).response_times(&options, &|| {}).responses;
        let bounds: Option<Vec<Time>> = responses.iter().map(bound).collect();
        let Some(bounds) = bounds else { continue };
        let found = on_the_virtual_clock(&program, cpus, &tasks);
        for (number, (found, bound)) in found.iter().zip(&bounds).enumerate() {
            let Some(found) = *found else { continue };
            assert!(found <= *bound, "round {round}, task {number}: {found} above {bound}");
            shared += usize::from(tasks[number].thread.is_some());
            released += usize::from(!tasks[number].sources.is_empty());
            late += usize::from(found > Time::from_nanos(tasks[number].period));
            queued += usize::from(tasks[number].order != Order::List);
            raised += usize::from(tasks[number].is_not_preempted);
        }
    }
    let counts = format!("{shared} {released} {late} {queued} {raised}");
    assert!(shared > 40 && released > 40 && late > 10 && queued > 40 && raised > 40, "{counts}");
}

#[test]
fn orocos_virtual_clock_schedules_as_the_simulation_and_keeps_the_bounds() {
    let program = clock_program("clock");
    let mut random = Random::new(1);
    let (mut equal, mut compared) = (0, 0);
    for round in 0..600 {
        let (cpus, shares_cpus) = (1 + round % 3, round % 2 == 0);
        let mut tasks = tasks(&mut random, cpus, shares_cpus);
        for task in tasks.iter_mut().filter(|_| !shares_cpus) {
            task.is_not_preempted = random.up_to(3) == 0;
        }
        if !shares_cpus && round % 4 == 1 {
            queue_some(&mut random, &mut tasks);
        }
        let set = activities(&tasks);
        let options = Options { method: Method::Exact, is_brief: false };
        let analysis = set.response_times(&options, &|| {});
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
