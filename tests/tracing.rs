//! Traces a robot: builds its generated packages, runs it with real threads, records it with LTTng, reads the trace
//! with babeltrace2, and compares it with the records of the codels.
//!
//! `tests/run` installs the tools; without them these tests fail with a message.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::packages;
use mauve_pwcet::samples::{SampleSeries, Samples};
use mauve_tests::orocos::{COMPILERS, build, configure, run};
use mauve_tests::{Recorder, Span, scratch, spans};
use mauve_timing::Observed;
use serde_json::Value;

/// Which program says that it has which number: its component, state, transition and kind.
const PROGRAMS: [(u64, &str); 19] = [
    (1, "sensors.Source - - configure"),
    (2, "sensors.Source - - start"),
    (3, "sensors.Source - - update"),
    (4, "sensors.Source - - stop"),
    (5, "sensors.Source - - cleanup"),
    (6, "sensors.Source - reset operation"),
    (10, "motion.Pilot Waiting - entry"),
    (11, "motion.Pilot Waiting - run"),
    (12, "motion.Pilot Waiting got guard"),
    (13, "motion.Pilot Waiting got effect"),
    (14, "motion.Pilot Waiting - handle"),
    (15, "motion.Pilot Waiting - exit"),
    (20, "motion.Pilot Moving - entry"),
    (21, "motion.Pilot Moving - run"),
    (22, "motion.Pilot Moving lost guard"),
    (23, "motion.Pilot Moving done guard"),
    (24, "motion.Pilot Moving done effect"),
    (25, "motion.Pilot Moving - handle"),
    (26, "motion.Pilot Moving - exit"),
];

/// Of the robot's own folder.
fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/tracing").join(name)
}

/// Generates the packages, puts the codels into them, and builds and installs one after the other.
fn build_robot(folder: &Path, options: &[&str]) {
    let model = std::fs::read_to_string(source("robot.mal")).unwrap();
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), [(PathBuf::from("/robot.mal"), model)]);
    let prefix = folder.join("prefix");
    for package in packages(&db, projects(&db, workspace)[0], None).expect("a model without mistakes") {
        let codel = |path: &str| {
            let name = path.strip_prefix("src/codels/")?;
            Some(std::fs::read_to_string(source(name)).unwrap())
        };
        let file = |path: String, text| (format!("{}/{path}", package.name), codel(&path).unwrap_or(text));
        let files = package.files.iter().map(|it| file(it.path.clone(), it.text.clone()));
        mauve_tests::write(folder, &files.collect::<Vec<_>>());
        let built = folder.join("build").join(&package.name);
        let mut configuration = configure(&folder.join(&package.name), &built, COMPILERS[0], &[&prefix]);
        configuration.arg(format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()));
        configuration
            .args(["-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror", "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror"]);
        run(configuration.arg("-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON").args(options));
        run(build(&built).args(["--target", "install"]));
    }
}

/// The record of a codel: the thread that called it, its name, its argument or CPU time.
type Call = (u64, String, u64);

/// Runs the robot, on one CPU with a program that wants it too, until all of its programs have run.
fn run_robot(recorder: &Recorder) -> Vec<Call> {
    let folder = recorder.folder();
    let built = folder.join("build/deployer");
    run(&mut configure(&source(""), &built, COMPILERS[0], &[]));
    run(&mut build(&built));

    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim();
    let cpu = allowed.split([',', '-']).next().unwrap();
    let mut competitor = recorder.command("taskset");
    competitor.args(["-c", cpu, "sh", "-c", "while :; do :; done"]);
    let mut competitor = competitor.spawn().unwrap();

    let library =
        |it: &str| folder.join(format!("prefix/lib/orocos/gnulinux/{it}/lib{it}-components-gnulinux.so"));
    let mut robot = recorder.command("taskset");
    robot
        .args(["-c", cpu, "timeout", "120", "build/deployer/deployer"])
        .arg(library("sensors"))
        .arg(library("motion"));
    let mut robot = robot.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut calls: Vec<Call> = Vec::new();
    // Two of them run when it is stopped.
    let mut left: BTreeSet<u64> = PROGRAMS.iter().map(|(number, _)| *number).collect();
    for line in BufReader::new(robot.stdout.take().unwrap()).lines() {
        let line = line.unwrap();
        let words: Vec<&str> = line.split(' ').collect();
        let [thread, codel, value] = words[..] else { panic!("the robot says {line}") };
        let value = value.parse().unwrap();
        if codel == "mark" && left.remove(&value) && left == BTreeSet::from([4, 5]) {
            robot.stdin.take().unwrap().write_all(b"stop\n").unwrap();
        }
        calls.push((thread.parse().unwrap(), codel.to_owned(), value));
    }
    let ended = robot.wait().unwrap();
    competitor.kill().unwrap();
    competitor.wait().unwrap();
    assert!(ended.success() && left.is_empty(), "{ended}, and {left:?} did not run");
    calls
}

/// Returns the key in a timing table of the codel or program of a span; none for a period.
fn key(span: &Span) -> Option<String> {
    let field = |name| span.begin.field(name);
    let of_program = |component| match (field("state"), field("transition"), field("program")) {
        ("-", operation, "operation") => format!("{component}/{operation}"),
        ("-", "-", hook) => format!("{component}/{hook}"),
        (state, "-", method) => format!("{component}/{state}.{method}"),
        (state, transition, kind) => format!("{component}/{state}.{transition}.{kind}"),
    };
    match span.begin.name.as_str() {
        "codel" => Some(field("codel").to_owned()),
        "program" => Some(of_program(field("component"))),
        "access" => Some(format!("(access) {}", field("port"))),
        _ => None,
    }
}

/// Imports a recording; returns the execution times of each codel and program, by key and instance.
fn imported(recording: &Path, folder: &Path) -> BTreeMap<(String, String), Vec<u64>> {
    let path = folder.join("robot.samples");
    let mut import = Command::new(env!("CARGO_BIN_EXE_mauve"));
    let import = import.args(["trace", "import"]).arg(recording).arg("--output").arg(&path).output().unwrap();
    let said = String::from_utf8_lossy(&import.stderr);
    assert!(import.status.success() && said.is_empty(), "{said}");
    let mut samples = Samples::open(&path).unwrap();
    let series = samples.series().to_vec();
    let times = |it: &SampleSeries| {
        let all = samples.executions(it.id).unwrap();
        ((it.key.clone(), it.instance.clone()), all.iter().map(|it| it.execution).collect())
    };
    series.iter().map(times).collect()
}

/// Returns the program of a span, as in [`PROGRAMS`].
fn program(span: &Span) -> String {
    ["component", "state", "transition", "program"].map(|field| span.begin.field(field)).join(" ")
}

/// The deployment that `tests/tracing/deployer.cpp` should start, with other priorities.
const DEPLOYMENT: &str = "
library robot {
  use sensors
  use motion
  architecture Robot {
    instance source: Source
    instance pilot: Pilot
    connection source.value -> pilot.value
    operation source.reset -> pilot.reset
  }
  deployment Bench {
    architecture Robot
    activity source { affinity = 1  priority = 5  period = 60 }
    activity pilot { affinity = 1  priority = 4  period = 20 }
  }
}
";

/// Compares a recording with the model: the document of `mauve trace check`.
fn checked(recording: &Path, folder: &Path) -> Value {
    let model = std::fs::read_to_string(source("robot.mal")).unwrap() + DEPLOYMENT;
    let table = "unit = \"ms\"\ncodel.\"probe.mark\" = 100\ncodel.\"probe.work\" = 1\n";
    let configuration = "[timing]\ntables = [\"times.toml\"]\n";
    mauve_tests::write(
        &folder.join("model"),
        &[("robot.mal", model.as_str()), ("times.toml", table), ("mauve.toml", configuration)],
    );
    let mut check = Command::new(env!("CARGO_BIN_EXE_mauve"));
    let check = check.args(["trace", "check", "--format", "json"]).arg(recording).arg(folder.join("model"));
    let found = check.output().unwrap();
    assert_eq!(found.status.code(), Some(1), "{}", String::from_utf8_lossy(&found.stderr));
    serde_json::from_slice(&found.stdout).unwrap()
}

#[test]
fn orocos_trace_of_a_robot_has_all_that_ran_and_how_long() {
    let mut recorder = Recorder::start();
    build_robot(recorder.folder(), &["-DMAUVE_TRACING=ON"]);
    recorder.record();
    let calls = run_robot(&recorder);
    let all = spans(&recorder.stop()).unwrap_or_else(|error| panic!("{error}"));

    // `mauve trace import` has the same execution times, in the order in which the executions ended.
    let mut expected: BTreeMap<(String, String), Vec<u64>> = BTreeMap::new();
    let mut in_order: Vec<&Span> = all.iter().collect();
    in_order.sort_by_key(|span| span.begin.time + span.elapsed);
    for span in in_order {
        if let Some(key) = key(span) {
            expected.entry((key, span.begin.field("instance").to_owned())).or_default().push(span.cpu);
        }
    }
    assert_eq!(imported(&recorder.output(), recorder.folder()), expected);

    // The operation sleeps in `mark`, and `work` is preempted.
    let text = std::fs::read_to_string(recorder.folder().join("robot.observed.toml")).unwrap();
    let (observed, errors) = Observed::parse(&text);
    assert_eq!(errors, []);
    let [mark, work] = ["probe.mark", "probe.work"].map(|codel| &observed.codels[codel]);
    assert!(mark.is_wait_known && (60_000_000..1_000_000_000).contains(&mark.wait), "{text}");
    assert!(work.is_wait_known && work.wait < 9_000_000, "{text}");
    assert_eq!(observed.accesses.len(), 2, "{text}");

    // `mauve trace check`: the threads have no real-time priority, and `work` takes longer than its time. What else is found
    // depends on the computer, but no program, state, codel or CPU is another one.
    let checked = checked(&recorder.output(), recorder.folder());
    let findings: Vec<&Value> = checked["findings"].as_array().unwrap().iter().collect();
    let has = |instance: Value, code: &str| {
        findings.iter().any(|it| it["instance"] == instance && it["code"] == code)
    };
    assert!(has("source".into(), "priority") && has("pilot".into(), "priority"), "{findings:#?}");
    assert!(has(Value::Null, "execution-time"), "{findings:#?}");
    assert!(has("source".into(), "wait"), "{findings:#?}");
    let timing =
        ["priority", "execution-time", "execution-of-period", "response", "skipped", "period", "wait"];
    let others = findings.iter().filter(|it| !timing.contains(&it["code"].as_str().unwrap()));
    assert_eq!(others.collect::<Vec<_>>(), Vec::<&&Value>::new());
    for instance in checked["instances"].as_array().unwrap() {
        let name = instance["instance"].as_str().unwrap();
        let periods =
            all.iter().filter(|it| it.begin.name == "component" && it.begin.field("instance") == name);
        assert_eq!(instance["periods"], periods.count(), "{instance:#}");
        assert!(instance["edges"].as_array().unwrap().iter().any(|it| it["observed"].as_u64() > Some(0)));
        assert_eq!(instance["response_is_lower_bound"], true);
    }

    let threads: BTreeSet<u64> = calls.iter().map(|(thread, ..)| *thread).collect();
    // That of each component, and that of the deployer, which configures and starts them.
    assert_eq!(threads.len(), 3);
    let programs: BTreeMap<u64, &str> = PROGRAMS.into();
    // The longest execution of each program and codel.
    let mut longest: BTreeMap<String, u64> = BTreeMap::new();
    let mut ports: BTreeSet<String> = BTreeSet::new();
    for thread in threads {
        let called = calls.iter().filter(|(of, ..)| *of == thread);
        let mut called = called.map(|(_, codel, value)| (codel.as_str(), *value));
        let mut open: Vec<&Span> = Vec::new();
        for span in all.iter().filter(|span| span.begin.thread == thread) {
            open.truncate(span.depth);
            let around = open.last();
            match span.begin.name.as_str() {
                "component" => assert!(around.is_none(), "{span:?}"),
                "program" => {
                    let instance = if program(span).starts_with("motion.Pilot") { "pilot" } else { "source" };
                    assert_eq!(span.begin.field("instance"), instance);
                    assert!(around.is_none_or(|it| it.begin.name == "component"), "{span:?} in {around:?}");
                    let time = longest.entry(program(span)).or_default();
                    *time = span.cpu.max(*time);
                }
                "access" => {
                    let port = span.begin.field("port");
                    let expected = match port {
                        "sensors.Source.value" => programs[&3],
                        "motion.Pilot.value" => programs[&11],
                        _ => panic!("{span:?}"),
                    };
                    assert_eq!(program(around.expect("it is executed in a program")), expected);
                    ports.insert(port.to_owned());
                }
                // In the order in which the codels themselves say that they ran, each in its own program.
                _ => {
                    let program = program(around.expect("it is called in a program"));
                    let codel = span.begin.field("codel");
                    match called.next().unwrap_or_else(|| panic!("no codel says {span:?}")) {
                        ("mark", number) => {
                            assert_eq!((codel, program.as_str()), ("probe.mark", programs[&number]));
                        }
                        (_, cpu) => {
                            assert_eq!((codel, program.as_str()), ("probe.work", programs[&21]));
                            // Not the time in which it was preempted: that is 10 ms at least.
                            assert!((cpu..cpu + 5_000_000).contains(&span.cpu), "{span:?} used {cpu}");
                            assert!(span.elapsed > span.cpu + 9_000_000, "{span:?}");
                        }
                    }
                    let time = longest.entry(codel.to_owned()).or_default();
                    *time = span.cpu.max(*time);
                }
            }
            open.push(span);
        }
        assert_eq!(called.next(), None, "not all codels that ran are in the trace");
    }
    assert_eq!(ports.len(), 2);
    let measured: BTreeSet<&str> = longest.keys().map(String::as_str).collect();
    let expected: BTreeSet<&str> = programs.into_values().chain(["probe.mark", "probe.work"]).collect();
    assert_eq!(measured, expected);
    // The program that works takes as long as its work, and the others next to nothing.
    let work = longest["probe.work"];
    assert!(longest["motion.Pilot Moving - run"] >= work && work >= 10_000_000, "{longest:?}");
    assert!(longest["motion.Pilot Moving - handle"] < 5_000_000, "{longest:?}");
    // Each period of a component is one span around all of its programs.
    let periods = all.iter().filter(|span| span.begin.name == "component").count();
    let runs =
        calls.iter().filter(|(_, codel, value)| codel == "mark" && [3, 11, 21].contains(value)).count();
    assert_eq!(periods, runs);
    assert!(all.iter().filter(|span| span.begin.name == "program").all(|span| {
        let is_periodic =
            ["update", "run", "handle", "exit", "guard", "effect"].contains(&span.begin.field("program"));
        !is_periodic || span.depth == 1
    }));
}

#[test]
fn orocos_packages_without_tracing_know_nothing_of_it() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "tracing_off");
    build_robot(&folder, &["-DCMAKE_BUILD_TYPE=Debug"]);
    let mut objects = Command::new("find");
    objects.arg(folder.join("build")).args(["-name", "*.o", "-o", "-name", "*.so"]);
    let objects = run(&mut objects);
    // Two codels, two components, and the three libraries of them.
    assert_eq!(objects.lines().count(), 7, "{objects}");
    for object in objects.lines() {
        let symbols = run(Command::new("nm").arg("-a").arg(object)).to_lowercase();
        assert!(symbols.lines().count() > 5, "{object}: {symbols}");
        // Those of RTT's own trace points, and of what all components have in common, are others.
        let symbols: Vec<&str> = symbols.lines().filter(|it| !it.contains("orocos_rtt")).collect();
        for word in ["mauve_trace", "mauve_sensors", "mauve_motion", "span", "lttng"] {
            assert!(!symbols.iter().any(|symbol| symbol.contains(word)), "{object}: {word}: {symbols:#?}");
        }
    }
}

/// A trace in the common trace format: two packets of events of the codels `f` and `g`, 1000 events each.
fn recorded_packets() -> (String, Vec<u8>) {
    let metadata = r#"/* CTF 1.8 */
typealias integer { size = 8; align = 8; signed = false; } := uint8_t;
typealias integer { size = 32; align = 8; signed = false; } := uint32_t;
typealias integer { size = 64; align = 8; signed = false; } := uint64_t;
trace { major = 1; minor = 8; uuid = "00000000-0000-0000-0000-000000000000"; byte_order = le; packet.header := struct { uint32_t magic; uint8_t uuid[16]; uint32_t stream_id; uint64_t stream_instance_id; }; };
env { hostname = "vm"; };
clock { name = monotonic; freq = 1000000000; offset = 0; };
typealias integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; } := uint64_clock_t;
stream {
  id = 0;
  packet.context := struct { uint64_clock_t timestamp_begin; uint64_clock_t timestamp_end; uint64_t content_size; uint64_t packet_size; uint32_t cpu_id; };
  event.header := struct { uint32_t id; uint64_clock_t timestamp; };
  event.context := struct { uint32_t vtid; };
};
event {
  name = "mauve_x:codel"; id = 0; stream_id = 0;
  fields := struct { string instance; string codel; uint8_t phase; uint64_t cpu_ns; };
};
"#;
    let mut stream = Vec::new();
    for packet in 0..2_u64 {
        let mut events = Vec::new();
        let time = |event: u64| (packet * 1000 + event) * 1000 + 1;
        for event in 0..1000 {
            events.extend(0_u32.to_le_bytes());
            events.extend(time(event).to_le_bytes());
            events.extend(7_u32.to_le_bytes());
            events.extend(if event % 4 < 2 { *b"a\0f\0" } else { *b"a\0g\0" });
            events.push((event % 2) as u8);
            events.extend((time(event) / 2).to_le_bytes());
        }
        let bits = (32 + 36 + events.len() as u64) * 8;
        stream.extend(0xC1FC_1FC1_u32.to_le_bytes());
        stream.extend([0; 28]);
        for number in [time(0), time(999), bits, bits] {
            stream.extend(number.to_le_bytes());
        }
        stream.extend(0_u32.to_le_bytes());
        stream.extend(events);
    }
    (metadata.to_owned(), stream)
}

/// A power failure cuts a stream in a packet: `babeltrace2` refuses it, and the packets before it are used.
#[test]
fn a_cut_stream_is_read_up_to_the_cut() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "tracing-cut");
    let (metadata, stream) = recorded_packets();
    let import = |name: &str, length: usize| {
        mauve_tests::write(&folder, &[(format!("{name}/metadata"), metadata.clone())]);
        std::fs::write(folder.join(name).join("stream_0"), &stream[..length]).unwrap();
        let samples = format!("{name}.samples");
        mauve_tests::mauve(crate::MAUVE, &folder, &["trace", "import", name, "-o", &samples])
    };
    let whole = import("whole", stream.len());
    assert!(
        whole.code == 0 && whole.err.is_empty() && whole.out.contains("imported 1000 executions"),
        "{whole:?}"
    );
    let cut = import("cut", stream.len() * 3 / 4);
    assert_eq!(cut.code, 0, "{cut:?}");
    assert!(cut.err.contains("`cut` was cut, such as by a power failure"), "{}", cut.err);
    let mut samples = Samples::open(folder.join("cut.samples").as_path()).unwrap();
    let ids: Vec<_> = samples.series().iter().map(|it| it.id).collect();
    let times: Vec<u64> =
        ids.into_iter().flat_map(|id| samples.executions(id).unwrap()).map(|it| it.execution).collect();
    // The first packet.
    assert!(times.len() == 500 && times.iter().all(|time| *time == 500), "{times:?}");
    // Nothing before the cut.
    let nothing = import("nothing", 20);
    assert!(nothing.code == 2 && nothing.err.contains("babeltrace2 cannot read"), "{nothing:?}");
}
