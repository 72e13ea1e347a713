//! `mauve trace check`: schedules of the simulation, written as recordings, agree with the model; with a fault, exactly that one is
//! found.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_tests::{Run, mauve, models, own_scratch, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

/// The packages of the components of the sample robot.
const PACKAGES: [(&str, &str); 10] = [
    ("p3dx_driver", "drivers"),
    ("hokuyo", "drivers"),
    ("teleop", "drivers"),
    ("switch", "motion"),
    ("guidance", "motion"),
    ("control", "motion"),
    ("pose", "localisation"),
    ("gmapping", "localisation"),
    ("navigation", "navigation"),
    ("exploration", "exploration"),
];

/// A period of a recording. Times are in nanoseconds.
#[derive(Debug, Clone)]
struct Period {
    instance: String,
    component: String,
    release: i64,
    begin: i64,
    end: i64,
    execution: i64,
    priority: i64,
    cpus: i64,
    /// The CPU where it began, from 0.
    cpu: u32,
    programs: Vec<String>,
    codels: Vec<(String, i64)>,
}

fn nanoseconds(time: &Value) -> i64 {
    (time.as_f64().unwrap() * 1e6).round() as i64
}

/// Simulates the sample robot; returns its complete jobs, in the order of their ends.
fn simulated(seed: u64) -> Vec<Period> {
    let run = mauve(
        MAUVE,
        &models(),
        &["simulate", "p3dx", "--format", "json", "--for", "20s", "--seed", &seed.to_string()],
    );
    let document: Value = serde_json::from_str(&run.out).unwrap();
    let of_instance: BTreeMap<&str, &Value> = document["activities"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["instance"].as_str().unwrap(), it))
        .collect();
    let packages: BTreeMap<&str, &str> = PACKAGES.into();
    let mut slices: BTreeMap<(&str, u64), Vec<&Value>> = BTreeMap::new();
    for slice in document["slices"].as_array().unwrap() {
        let key = (slice["instance"].as_str().unwrap(), slice["job"].as_u64().unwrap());
        slices.entry(key).or_default().push(slice);
    }
    let mut found = Vec::new();
    for job in document["jobs"].as_array().unwrap() {
        let instance = job["instance"].as_str().unwrap();
        let Some(slices) = slices.get(&(instance, job["job"].as_u64().unwrap())) else { continue };
        if job["end"].is_null() {
            continue;
        }
        let activity = of_instance[instance];
        let names = slices[0]["programs"].as_array().unwrap();
        found.push(Period {
            instance: instance.to_owned(),
            component: format!("{}.{}", packages[instance], activity["component"].as_str().unwrap()),
            release: nanoseconds(&job["nominal"]),
            begin: nanoseconds(&slices[0]["start"]),
            end: nanoseconds(&job["end"]),
            execution: slices.iter().map(|it| nanoseconds(&it["end"]) - nanoseconds(&it["start"])).sum(),
            priority: activity["priority"].as_i64().unwrap(),
            cpus: activity["affinity"].as_i64().unwrap(),
            cpu: activity["affinity"].as_i64().unwrap().trailing_zeros(),
            programs: names.iter().map(|it| it.as_str().unwrap().to_owned()).collect(),
            codels: Vec::new(),
        });
    }
    // The simulation leaves out what runs in the background.
    found.push(Period {
        instance: "exploration".to_owned(),
        component: "exploration.Exploration".to_owned(),
        release: 0,
        begin: 5,
        end: 6,
        execution: 1,
        priority: 0,
        cpus: 3,
        cpu: 0,
        programs: ["Choosing.run", "Choosing.chosen.guard", "Choosing.finished.guard"]
            .map(str::to_owned)
            .into(),
        codels: Vec::new(),
    });
    found.sort_by_key(|it| it.end);
    found
}

/// What a recording has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Has {
    Everything,
    /// As a recording of LTTng.
    NoReleases,
    /// As a recording of an earlier version.
    NeitherReleasesNorScheduling,
}

/// Writes a recording, and compares it with the sample robot.
fn check(name: &str, periods: &[Period], has: Has) -> (Run, Value) {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}_{name}", test_name()));
    let mut executions = "codel,execution_ns,instance,elapsed_ns,time_ns,order\n".to_owned();
    let mut lines = match has {
        Has::Everything => "instance,begin_ns,end_ns,execution_ns,order,release_ns,priority,cpus,cpu\n",
        Has::NoReleases => "instance,begin_ns,end_ns,execution_ns,order,unknown,priority,cpus,cpu\n",
        Has::NeitherReleasesNorScheduling => "instance,begin_ns,end_ns,execution_ns,order,unknown,x,y,z\n",
    }
    .to_owned();
    let mut order = 0;
    // An arbitrary epoch.
    let epoch = 1_795_402_383_000_000_000_i64;
    for it in periods {
        let (instance, component) = (&it.instance, &it.component);
        for program in &it.programs {
            let _ = writeln!(executions, "{component}/{program},0,{instance},0,{},{order}", epoch + it.begin);
            order += 1;
        }
        for (codel, time) in &it.codels {
            let _ =
                writeln!(executions, "{codel},{time},{instance},{time},{},{order}", epoch + it.begin + time);
            order += 1;
        }
        let _ = writeln!(
            lines,
            "{instance},{},{},{},{order},{},{},{},{}",
            epoch + it.begin,
            epoch + it.end,
            it.execution,
            epoch + it.release,
            it.priority,
            it.cpus,
            it.cpu
        );
        order += 1;
    }
    write(&folder, &[("trace/executions.csv", executions.as_str()), ("trace/periods.csv", lines.as_str())]);
    let model = models().join("p3dx");
    let model = model.to_str().unwrap();
    let json = mauve(MAUVE, &folder, &["trace", "check", "trace", model, "--format", "json"]);
    let document = serde_json::from_str(&json.out).unwrap_or_else(|why| panic!("{why}: {json:?}"));
    let table = mauve(MAUVE, &folder, &["trace", "check", "trace", model]);
    assert_eq!((table.code, table.err.as_str()), (json.code, json.err.as_str()));
    (table, document)
}

/// Returns the instances and codes of the findings.
fn codes(document: &Value) -> Vec<(String, String)> {
    let findings = document["findings"].as_array().unwrap().iter();
    let text = |value: &Value| value.as_str().unwrap_or("—").to_owned();
    findings.map(|it| (text(&it["instance"]), text(&it["code"]))).collect()
}

fn expect(name: &str, periods: &[Period], has: Has, expected: &[(&str, &str)], message: &str) {
    let (table, document) = check(name, periods, has);
    let found = codes(&document);
    let expected: Vec<(String, String)> =
        expected.iter().map(|(one, other)| ((*one).to_owned(), (*other).to_owned())).collect();
    assert_eq!(found, expected, "{name}, {has:?}: {}", table.out);
    assert_eq!(table.code, i32::from(!found.is_empty()));
    assert!(table.has(message), "{name}, {has:?}: {}", table.out);
}

#[test]
fn schedules_of_the_model_agree_with_it() {
    for seed in 1..=3 {
        let periods = simulated(seed);
        for has in [Has::Everything, Has::NoReleases, Has::NeitherReleasesNorScheduling] {
            expect(
                &format!("{seed}"),
                &periods,
                has,
                &[],
                "✓ nothing in the recording contradicts the model",
            );
        }
        // Observed responses are exact with releases, and lower bounds without.
        let (_, exact) = check("exact", &periods, Has::Everything);
        let (_, bounds) = check("bounds", &periods, Has::NoReleases);
        let all = |document: &Value| document["instances"].as_array().unwrap().clone();
        for (exact, bound) in all(&exact).iter().zip(all(&bounds)) {
            let Some(true_response) = exact["response"].as_f64() else { continue };
            let name = exact["instance"].as_str().unwrap();
            let jobs = periods.iter().filter(|it| it.instance == name);
            let longest = jobs.map(|it| it.end - it.release).max().unwrap();
            assert_eq!((true_response * 1e6).round() as i64, longest, "{name}");
            let bound = bound["response"].as_f64().unwrap();
            // Rounding of the document, of 1 ns.
            assert!(bound <= true_response + 1e-5 && bound > 0.0, "{name}: {bound} {true_response}");
        }
    }
}

#[test]
fn each_fault_is_found() {
    let clean = simulated(1);
    let with = |change: &dyn Fn(usize, &mut Period)| {
        let mut periods = clean.clone();
        let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
        for it in &mut periods {
            let number = numbers.entry(it.instance.clone()).or_default();
            change(*number, it);
            *number += 1;
        }
        periods.sort_by_key(|it| it.end);
        periods
    };
    for has in [Has::Everything, Has::NoReleases] {
        let fault = |name: &str, expected: &[(&str, &str)], message: &str, periods: Vec<Period>| {
            expect(name, &periods, has, expected, message);
        };
        // (a) Priorities and CPUs.
        fault(
            "priority",
            &[("pose", "priority")],
            "`pose` has no real-time priority instead of priority 7 in 3 periods",
            with(&|number, it| {
                if it.instance == "pose" && number < 3 {
                    it.priority = 0;
                }
            }),
        );
        fault(
            "cpus",
            &[("gmapping", "cpus")],
            "`gmapping` may use CPU 1 instead of CPU 2 in 20 periods",
            with(&|_, it| {
                if it.instance == "gmapping" {
                    it.cpus = 1;
                }
            }),
        );
        let is_known = has != Has::NeitherReleasesNorScheduling;
        let other: &[(&str, &str)] = if is_known { &[("pose", "other-cpu")] } else { &[] };
        fault(
            "other-cpu",
            other,
            if is_known {
                "`pose` began 2 periods on CPUs 3 and 4, and the deployment gives it CPU 1"
            } else {
                ""
            },
            with(&|number, it| {
                if it.instance == "pose" && number < 2 {
                    it.cpu = 2 + number as u32;
                }
            }),
        );
        // (b) Transitions.
        fault(
            "path",
            &[("navigation", "path")],
            "executed no program in 1 period",
            with(&|number, it| {
                if it.instance == "navigation" && number == 5 {
                    it.programs.clear();
                }
            }),
        );
        fault(
            "program",
            &[("pose", "unknown-program")],
            "`pose` executed `localisation.Pose/Turbo.run`",
            with(&|number, it| {
                if it.instance == "pose" && number == 5 {
                    it.programs.push("Turbo.run".to_owned());
                }
            }),
        );
        // (c) An execution time.
        fault(
            "codel",
            &[("—", "execution-time")],
            "`drivers.hokuyo_sweep` exceeded its time of 41.00 ms in 1 of 1 executions",
            with(&|number, it| {
                if it.instance == "hokuyo" && number == 5 {
                    it.codels.push(("drivers.hokuyo_sweep".to_owned(), 41_000_001));
                }
            }),
        );
        fault(
            "codel_of_other",
            &[("pose", "unknown-codel")],
            "`pose` executed the codel `drivers.hokuyo_sweep`",
            with(&|number, it| {
                if it.instance == "pose" && number == 5 {
                    it.codels.push(("drivers.hokuyo_sweep".to_owned(), 1));
                }
            }),
        );
        // At a stricter level than that of the analysis, and against a time that holds at each level.
        let run = |key: &'static str, instance: &'static str, time: i64| {
            with(&move |number, it| {
                if it.instance == instance {
                    it.codels.push((key.to_owned(), if number == 5 { time } else { 1 }));
                }
            })
        };
        fault(
            "strict",
            &[("—", "execution-time")],
            "`drivers.aria_loop` exceeded its time of 54.00 ms in 1 of 200 executions; at 1e-9",
            run("drivers.aria_loop", "p3dx_driver", 60_000_000),
        );
        fault("rare", &[], "✓ as often as expected", run("drivers.aria_loop", "p3dx_driver", 9_500_000));
        fault(
            "always",
            &[("—", "execution-time")],
            "`drivers.aria_odometry` exceeded its time of 600.0 µs in 1 of 200 executions; at 1e-9",
            run("drivers.aria_odometry", "p3dx_driver", 800_000),
        );
        // (d) A response time: as rare as the times of the analysis may be exceeded,
        fault(
            "rare_response",
            &[],
            "✓ nothing in the recording contradicts the model",
            with(&|number, it| {
                if it.instance == "p3dx_driver" && number == 5 {
                    (it.end, it.execution) = (it.begin + 11_000_000, 11_000_000);
                }
            }),
        );
        // of its own execution, and of another activity.
        fault(
            "response",
            &[("p3dx_driver", "response")],
            "it executed 60 ms, longer than the 10 ms of the model",
            with(&|number, it| {
                if it.instance == "p3dx_driver" && number == 5 {
                    (it.end, it.execution) = (it.begin + 60_000_000, 60_000_000);
                }
            }),
        );
        fault(
            "waiting",
            &[("p3dx_driver", "response")],
            "no activity of the recording explains",
            with(&|number, it| {
                if it.instance == "gmapping" || it.instance == "p3dx_driver" && number == 5 {
                    let wait = if it.instance == "gmapping" { 0 } else { 80_000_000 };
                    it.end += wait;
                    it.begin += wait;
                }
            }),
        );
        // (e) Activations.
        let without = |instance: &str, numbers: std::ops::Range<usize>| {
            let mut number = 0;
            let mut periods = clean.clone();
            periods.retain(|it| {
                let is_it = it.instance == instance;
                number += usize::from(is_it);
                !is_it || !numbers.contains(&(number - 1))
            });
            periods
        };
        fault("skipped", &[("pose", "skipped")], "`pose` skipped 2 periods", without("pose", 7..9));
        // Where releases are recorded, nothing explains a pause.
        match has {
            Has::Everything => {
                let skipped = [("pose", "skipped")];
                fault("paused", &skipped, "`pose` skipped 13 periods", without("pose", 7..20));
            }
            _ => fault("paused", &[], "`pose` paused once", without("pose", 7..50)),
        }
        fault(
            "period",
            &[("p3dx_driver", "period")],
            "`p3dx_driver` begins a period each 50 ms on average, and the deployment says 100 ms",
            with(&|number, it| {
                if it.instance == "p3dx_driver" {
                    let earlier = number as i64 * 50_000_000;
                    it.release -= earlier;
                    it.begin = it.release;
                    it.end = it.begin + it.execution;
                }
            }),
        );
        // (f) Names.
        fault(
            "renamed",
            &[("pose", "not-observed"), ("—", "unknown-instance")],
            "the recording has `pose2`",
            with(&|_, it| {
                if it.instance == "pose" {
                    it.instance = "pose2".to_owned();
                }
            }),
        );
        fault(
            "missing",
            &[("teleop", "not-observed")],
            "`teleop` is not in the recording",
            without("teleop", 0..9999),
        );
        fault(
            "component",
            &[("pose", "component")],
            "`pose` executes programs of `localisation.OldPose`, and the model deploys `localisation.Pose`",
            with(&|_, it| {
                if it.instance == "pose" {
                    it.component = "localisation.OldPose".to_owned();
                }
            }),
        );
    }
}

/// Of a recording of ROS 2, where only callbacks are seen.
#[test]
fn what_has_no_codel_in_the_background_is_not_missed() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let robot = |background: &str| {
        let model = format!(
            "codel work(): int
shell S {{ }}
core Work(S) {{ update = {{ work(); }} }}
core Idle(S) {{ update = {{ }} }}
component Worker(S, Work)
component Outside(S, {background})
architecture A {{ instance a: Worker  instance outside: Outside }}
deployment D {{ architecture A  activity a {{ priority = 1  period = 10 }}  activity outside {{ priority = background }} }}
"
        );
        let recording = "instance,begin_ns,end_ns,execution_ns,order\na,10000000,11000000,1000000,0\na,20000000,21000000,1000000,1\n";
        let config = "assume.codel = \"2 ms\"\n";
        write(
            &folder,
            &[("m.mal", model.as_str()), ("mauve.toml", config), ("trace/periods.csv", recording)],
        );
        write(&folder, &[("trace/executions.csv", "codel,execution_ns,instance,elapsed_ns,time_ns,order\n")]);
        mauve(MAUVE, &folder, &["trace", "check", "trace", "."])
    };
    let silent = robot("Idle");
    assert!(!silent.has("is not in the recording"), "{silent:?}");
    let missing = robot("Work");
    assert!(missing.has("`outside` is not in the recording"), "{missing:?}");
}

#[test]
fn interference_is_named() {
    // hokuyo executes twice as long as modelled, and delays pose beyond its bound of 57 ms.
    let mut periods = simulated(1);
    let release = periods.iter().find(|it| it.instance == "pose").unwrap().release;
    for it in &mut periods {
        if it.instance == "hokuyo" && (it.begin - release) / 100_000_000 == 5 {
            (it.begin, it.execution) = (release + 500_000_001, 90_000_000);
            it.end = it.begin + it.execution;
            it.release = it.release.min(it.begin);
        }
        if it.instance == "pose" && it.release == release + 500_000_000 {
            it.begin = release + 591_000_000;
            it.end = it.begin + it.execution;
        }
    }
    periods.sort_by_key(|it| it.end);
    let (table, document) = check("long", &periods, Has::Everything);
    let found = codes(&document);
    assert!(found.contains(&("pose".to_owned(), "response".to_owned())), "{}", table.out);
    let message = "`hokuyo` executed 90.00 ms in 1 period, and the bound counts 43.00 ms in 1 period";
    assert!(table.has(message), "{}", table.out);
}

/// A deployment of two components with a port, and their times.
const DRIVER: &str = "library arm {
  codel read_state(): int
  codel solve(in n: int): int
  shell DriverShell { output port state: int }
  core DriverCore(DriverShell) { update = { write(state, read_state()); } }
  component Driver(DriverShell, DriverCore)
  shell SolverShell { input port state: int }
  core SolverCore(SolverShell) { var n: int = 0  update = { read(state, n); solve(n); } }
  component Solver(SolverShell, SolverCore)
  architecture A { instance driver: Driver  instance solver: Solver  connection driver.state -> solver.state }
  deployment D {
    architecture A
    activity driver { priority = 90  period = 10  affinity = 1 }
    activity solver { priority = 10  period = 10  affinity = 1 }
  }
}
";

const DRIVER_TIMES: &str = "unit = \"ms\"\n[codel]\n\"arm.read_state\" = 0.2\n\"arm.solve\" = 2\n";

/// A recording: in each period the driver executes for 0.1 ms, waits for 2 ms, and writes for 0.3 ms; then the solver executes, and
/// is preempted in some periods.
fn recorded_waits(folder: &std::path::Path) {
    let mut executions = "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns\n".to_owned();
    let mut periods = "instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order\n".to_owned();
    for number in 0..200_u64 {
        let (release, order) = ((number + 1) * 10_000_000, 10 * number);
        let _ =
            writeln!(executions, "arm.read_state,100000,driver,2100000,{},{order},1,", release + 2_100_000);
        let _ = writeln!(
            executions,
            "(access) arm.Driver.state,300000,driver,300000,{},{},,",
            release + 2_400_000,
            order + 1
        );
        let _ = writeln!(
            periods,
            "driver,{release},{release},{},400000,90,1,0,{}",
            release + 2_400_000,
            order + 2
        );
        // Before the driver has ended, the solver has begun.
        let (begin, end) = (release + 500_000, release + 4_000_000);
        let _ = writeln!(executions, "arm.solve,1500000,solver,{},{end},{},0,", end - begin, order + 3);
        let _ = writeln!(periods, "solver,{release},{begin},{end},1500000,10,1,0,{}", order + 4);
    }
    let _ = writeln!(executions, "(work) pool,100000000,,2000000000,3000000000,9999,,");
    write(folder, &[("rec/executions.csv", executions.as_str()), ("rec/periods.csv", periods.as_str())]);
}

#[test]
fn waits_and_ports_are_told_from_preemption() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    recorded_waits(&folder);
    let check = |times: &str| {
        let configuration =
            "[timing]\ntables = [\"times.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n";
        write(&folder, &[("arm.mal", DRIVER), ("times.toml", times), ("mauve.toml", configuration)]);
        let json = mauve(MAUVE, &folder, &["trace", "check", "rec", ".", "--format", "json"]);
        let document: Value = serde_json::from_str(&json.out).unwrap_or_else(|why| panic!("{why}: {json:?}"));
        (mauve(MAUVE, &folder, &["trace", "check", "rec", "."]), document)
    };
    let of = |instance: &str, code: &str| (instance.to_owned(), code.to_owned());

    let (table, document) = check(DRIVER_TIMES);
    let found = codes(&document);
    for expected in [of("driver", "wait"), of("driver", "execution-of-period"), of("driver", "response")] {
        assert!(found.contains(&expected), "{expected:?}: {}", table.out);
    }
    // The solver was off the CPU for 2 ms, and did not wait.
    assert!(!found.contains(&of("solver", "wait")), "{}", table.out);
    for expected in [
        "`arm.read_state` waited for something in 200 of 200 executions in `driver`, for up to 2.000 ms, which no table has; in a \
         timing table in ms, [wait] \"arm.read_state\" = 2",
        "its port `arm.Driver.state` took up to 300.0 µs; in a timing table in ms, [access] \"arm.Driver.state\" = 0.3",
        "codel `arm.read_state` waited for up to 2.000 ms",
        "note: threads named `pool`, which are not instances, used 50.00 ms of CPU time in each second",
    ] {
        assert!(table.has(expected), "{expected}: {}", table.out);
    }

    // With these lines in the table, the driver is as modelled; a shorter wait or access is not.
    let complete = |wait: &str, access: &str| {
        check(&format!(
            "{DRIVER_TIMES}[wait]\n\"arm.read_state\" = {wait}\n[access]\n\"arm.Driver.state\" = {access}\n"
        ))
    };
    let (table, document) = complete("2", "0.3");
    assert!(!codes(&document).iter().any(|(instance, _)| instance == "driver"), "{}", table.out);
    assert!(table.has("port arm.Driver.state  "), "{}", table.out);
    let (table, document) = complete("1.9", "0.3");
    assert!(codes(&document).contains(&of("driver", "wait")), "{}", table.out);
    assert!(table.has("for up to 2.000 ms, and the tables have 1.900 ms;"), "{}", table.out);
    let (table, document) = complete("2", "0.2");
    assert!(codes(&document).contains(&of("—", "execution-time")), "{}", table.out);
    assert!(
        table.has("port `arm.Driver.state` exceeded its time of 200.0 µs in 200 of 200"),
        "{}",
        table.out
    );
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder: PathBuf = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(
        &folder,
        &[("codels.csv", "codel,execution_ns\nlocalisation.odometry_pose,5\n"), ("empty/a.txt", "")],
    );
    let model = models().join("p3dx");
    let model = model.to_str().unwrap();
    let run = mauve(MAUVE, &folder, &["trace", "check", "codels.csv", model]);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    assert!(run.out.contains("note: periods are not in the trace"), "{}", run.out);
    assert!(run.out.contains("note: instances are not in the trace"), "{}", run.out);
    for (arguments, message) in [
        (&["missing", model][..], "cannot read `missing`"),
        (&["empty", model], "`empty` is not a trace"),
        (&["codels.csv", model, "--deployment", "Nope"], "no deployment `Nope`"),
        (&["codels.csv", model, "--significance", "2"], "expected a number between 0 and 1"),
    ] {
        let run = mauve(MAUVE, &folder, &[&["trace", "check"], arguments].concat());
        assert_eq!((run.code, run.out.as_str()), (2, ""), "{arguments:?}");
        assert!(run.err.contains(message), "{arguments:?}: {}", run.err);
    }
}

#[test]
fn periods_without_a_place_in_time_are_a_finding() {
    let mut periods = simulated(1);
    periods.reverse();
    let (table, document) = check("reversed", &periods, Has::Everything);
    assert!(codes(&document).contains(&("pose".to_owned(), "untimed".to_owned())), "{}", table.out);
    assert!(table.code == 1 && !table.out.contains("✓ nothing"), "{}", table.out);
}

/// Recordings are often kept in the folder of the project.
#[test]
fn a_project_with_recordings_is_a_model() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    mauve_tests::copy(&models().join("p3dx"), &folder.join("robot"));
    let codels = "codel,execution_ns\nlocalisation.odometry_pose,5\n";
    write(&folder, &[("robot/old/ust/metadata", ""), ("robot/codels.csv", codels), ("codels.csv", codels)]);
    let run = mauve(MAUVE, &folder, &["trace", "check", "robot/codels.csv", "robot"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""), "{}", run.out);
    let twice = mauve(MAUVE, &folder, &["trace", "check", "codels.csv", "./codels.csv", "robot"]);
    assert!(twice.code == 2 && twice.err.contains("is given twice"), "{}", twice.err);
}

#[test]
fn extreme_times_are_exported() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let model = models().join("p3dx");
    let late = i64::MAX as u64;
    for times in [[0, 0, late], [1, 2, late], [late - 1, late - 1, late], [0, late, late]] {
        let [release, begin, end] = times;
        let periods = format!(
            "instance,release_ns,begin_ns,end_ns,execution_ns\npose,{release},{begin},{end},{late}\npose,1,2,3,4\n"
        );
        let executions = format!("codel,execution_ns,time_ns\nlocalisation.odometry_pose,{late},{end}\n");
        write(
            &folder,
            &[("trace/executions.csv", executions.as_str()), ("trace/periods.csv", periods.as_str())],
        );
        for command in ["export", "check"] {
            let run = mauve(MAUVE, &folder, &["trace", command, "trace", model.to_str().unwrap()]);
            assert!(run.code < 2, "{times:?}: {}", run.err);
        }
    }
}

#[test]
fn a_recording_is_exported_for_viewers() {
    let periods = simulated(2);
    check("export", &periods, Has::Everything);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{}_export", test_name()));
    let model = models().join("p3dx");
    let arguments = ["trace", "export", "trace", model.to_str().unwrap(), "--output", "trace.json"];
    let run = mauve(MAUVE, &folder, &arguments);
    assert_eq!((run.code, run.out.as_str(), run.err.as_str()), (0, "", ""));
    let text = std::fs::read_to_string(folder.join("trace.json")).unwrap();
    assert_eq!(mauve(MAUVE, &folder, &arguments[..4]).out, text);
    // Again, but never in the place of another file.
    assert_eq!(mauve(MAUVE, &folder, &arguments).code, 0);
    let before = std::fs::read(folder.join("trace/executions.csv")).unwrap();
    let over = [&arguments[..5], &["trace/executions.csv"]].concat();
    let run = mauve(MAUVE, &folder, &over);
    assert!(run.code == 2 && run.err.contains("is not overwritten"), "{}", run.err);
    assert_eq!(std::fs::read(folder.join("trace/executions.csv")).unwrap(), before);
    let document: Value = serde_json::from_str(&text).unwrap();
    let events = document["traceEvents"].as_array().unwrap();
    let of = |category: &str| events.iter().filter(|it| it["cat"] == category).collect::<Vec<&Value>>();
    assert_eq!(of("period").len(), periods.len());
    assert_eq!(of("program").len(), periods.iter().map(|it| it.programs.len()).sum::<usize>());
    // All but that in the background have a release, and a bound that is not exceeded.
    assert_eq!(of("release").len(), periods.len() - 1);
    assert_eq!(of("bound").len(), periods.len() - 1);
    assert_eq!((of("bound exceeded").len(), of("deadline missed").len()), (0, 0));
    for it in of("period").into_iter().filter(|it| it["args"]["bound_ms"].is_number()) {
        assert!(it["args"]["response_ms"].as_f64() <= it["args"]["bound_ms"].as_f64(), "{it}");
    }
    // Each thread with an event has a name, and slices of one thread are apart or within each other.
    let key = |it: &Value| (it["pid"].as_u64().unwrap(), it["tid"].as_u64().unwrap());
    let named: Vec<(u64, u64)> = events.iter().filter(|it| it["name"] == "thread_name").map(key).collect();
    let mut bounds: BTreeMap<(u64, u64), Vec<(f64, f64)>> = BTreeMap::new();
    for it in events.iter().filter(|it| it["ph"] == "X") {
        assert!(named.contains(&key(it)), "{it}");
        if it["cat"] == "bound" {
            let begin = it["ts"].as_f64().unwrap();
            bounds.entry(key(it)).or_default().push((begin, begin + it["dur"].as_f64().unwrap()));
        }
    }
    for of_thread in bounds.values() {
        assert!(of_thread.windows(2).all(|two| two[0].1 <= two[1].0 + 1e-3));
    }
}

/// The slices of an export, as title, begin and end in milliseconds after the begin of the recording, and whether they are cut.
fn slices(text: &str) -> Vec<(String, i64, i64, bool)> {
    let document: Value = serde_json::from_str(text).unwrap();
    let events = document["traceEvents"].as_array().unwrap().iter().filter(|it| it["ph"] == "X");
    let all = events.map(|it| {
        let [ts, dur] = ["ts", "dur"].map(|key| (it[key].as_f64().unwrap() / 1e3).round() as i64);
        (it["name"].as_str().unwrap().to_owned(), ts - 1000, ts - 1000 + dur, it["args"]["cut"].is_string())
    });
    all.collect()
}

#[test]
fn a_part_of_a_recording_is_exported_with_its_edges_cut() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test_name());
    // A codel of 10 ms begins each 100 ms; one lasts from 250 to 950 ms.
    let codel =
        |at: u64| format!("nav.plan,10000000,pilot,10000000,{}\n", (at * 100 + 10 + 5000) * 1_000_000);
    let long = "nav.map,1000,pilot,700000000,5950000000\n";
    let lines: String = (0..10).map(codel).chain([long.to_owned()]).chain((10..20).map(codel)).collect();
    let recording = format!("codel,execution_ns,instance,elapsed_ns,time_ns\n{lines}");
    write(&folder, &[("rec.csv", recording.as_str()), ("robot.mal", "library nav { codel plan(): int }\n")]);
    let export = |arguments: &[&str]| {
        let all = [&["trace", "export", "rec.csv", "robot.mal"], arguments].concat();
        mauve(MAUVE, &folder, &all)
    };
    let plan = |at: i64| ("nav.plan".to_owned(), at * 100, at * 100 + 10, false);
    assert_eq!(slices(&export(&[]).out).len(), 21);
    let part = slices(&export(&["--from", "305 ms", "--to", "700 ms"]).out);
    let cut = |name: &str, begin: i64, end: i64| (name.to_owned(), begin, end, true);
    assert_eq!(part, [cut("nav.plan", 305, 310), plan(4), plan(5), plan(6), cut("nav.map", 305, 700)]);
    // Each edge has a mark, and nothing is outside.
    let text = export(&["--from", "305 ms", "--to", "700 ms"]).out;
    assert_eq!(text.matches("\"name\":\"cut\"").count(), 3, "{text}");
    let end = slices(&export(&["--from", "1.85 s"]).out);
    assert_eq!(end, [plan(19)]);
    let run = export(&["--from", "2 s", "--to", "1 s"]);
    assert!(run.code == 2 && run.err.contains("--from is not before --to"), "{}", run.err);
}

/// A recording is read until all instances are behind the exported part: a line far behind it that cannot be read is no matter then.
#[test]
fn an_export_ends_when_all_instances_are_behind_it() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(&folder, &TWO);
    let recording = |periods_of_b: &[(u64, u64)], end: &str| {
        let ms = |time: u64| time * 1_000_000;
        let all = (0..20).map(|at| ("a", 10 * at, 10 * at + 2));
        let mut all: Vec<_> = all.chain(periods_of_b.iter().map(|&(begin, end)| ("b", begin, end))).collect();
        all.sort_by_key(|it| it.2);
        let (mut codels, mut periods) = (
            "codel,execution_ns,instance,elapsed_ns,time_ns,order\n".to_owned(),
            "instance,begin_ns,end_ns,execution_ns,order\n".to_owned(),
        );
        for (order, (instance, begin, end)) in all.into_iter().enumerate() {
            let (codel, elapsed) = (if instance == "a" { "f" } else { "g" }, ms(end - begin));
            codels += &format!("{codel},{elapsed},{instance},{elapsed},{},{}\n", ms(1000 + end), 2 * order);
            periods +=
                &format!("{instance},{},{},{elapsed},{}\n", ms(1000 + begin), ms(1000 + end), 2 * order + 1);
        }
        codels += end;
        write(&folder, &[("rec/executions.csv", codels.as_str()), ("rec/periods.csv", periods.as_str())]);
    };
    let export = || mauve(MAUVE, &folder, &["trace", "export", "rec", "robot.mal", "--to", "55 ms"]);
    // `b` goes on until 130 ms.
    let of_b = [(3, 4), (45, 130), (132, 133), (141, 142)];
    recording(&of_b, "");
    let whole = export();
    let cut = ("g".to_owned(), 45, 55, true);
    assert!(whole.code == 0 && slices(&whole.out).contains(&cut), "{:?}", slices(&whole.out));
    recording(&of_b, "f,many,a,,,\n");
    assert_eq!(export().out, whole.out);
    // Nothing says that `b` is behind it.
    recording(&of_b[..2], "f,many,a,,,\n");
    let run = export();
    assert!(run.code == 2 && run.err.contains("line 24") && run.err.contains("many"), "{}", run.err);
}

#[test]
fn of_a_long_recording_no_part_is_written() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let line = |at: u64| format!("nav.plan,1000,pilot,1000,{}\n", (at + 1) * 1_000_000);
    let recording = format!(
        "codel,execution_ns,instance,elapsed_ns,time_ns\n{}",
        (0..30_000).map(line).collect::<String>()
    );
    write(&folder, &[("rec.csv", recording.as_str()), ("robot.mal", "library nav { codel plan(): int }\n")]);
    let export = |arguments: &[&str]| {
        let all = [&["trace", "export", "rec.csv", "robot.mal", "-o", "trace.json"], arguments].concat();
        mauve(MAUVE, &folder, &all)
    };
    let run = export(&["--limit", "1"]);
    assert!(run.code == 2 && run.err.contains("viewers do not open more: --from 10s"), "{}", run.err);
    assert!(!folder.join("trace.json").exists());
    // Two seconds of thirty are small enough.
    let run = export(&["--limit", "1", "--from", "10 s", "--to", "12 s"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(
        (2000..=2002).contains(&slices(&std::fs::read_to_string(folder.join("trace.json")).unwrap()).len())
    );
}

/// `drivers.aria_loop` takes 7 ms at 1e-3 and 9 ms at 1e-4, the level of the robot.
#[test]
fn times_from_tables_are_compared_at_their_level_only() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let model = models().join("p3dx");
    for (first, execution, is_fine) in [
        ("", 9_000_000, false),
        ("(from tables),0\n", 9_000_000, true),
        // Of a program that was built with other tables.
        ("(from tables),0\n", 9_100_000, false),
    ] {
        let lines = format!("drivers.aria_loop,{execution}\n").repeat(100);
        let text = format!("codel,execution_ns\n{first}{lines}");
        write(&folder, &[("codels.csv", text.as_str())]);
        let run = mauve(MAUVE, &folder, &["trace", "check", "codels.csv", model.to_str().unwrap()]);
        assert_eq!(run.code, i32::from(!is_fine), "{first}{execution}: {}", run.out);
        assert_eq!(run.out.contains("were not measured"), !first.is_empty(), "{}", run.out);
        assert_eq!(run.out.contains("`drivers.aria_loop` exceeded its time"), !is_fine, "{}", run.out);
    }
}

const TWO: [(&str, &str); 3] = [
    (
        "robot.mal",
        "codel f(): void  codel g(): void
shell S { }
core K(S) { update = { f(); } }  core L(S) { update = { g(); } }
component C(S, K)  component E(S, L)
architecture A { instance a: C  instance b: E }
deployment D { architecture A  activity a { priority = 2  period = 10 }  activity b { priority = 1  period = 10 } }
",
    ),
    ("mauve.toml", "timing.tables = [\"t.toml\"]\n"),
    ("t.toml", "codel.f = 1\ncodel.g = 1\n"),
];

const EXECUTIONS: &str = "codel,execution_ns,elapsed_ns,time_ns,order\n";

/// Compares a recording with [`TWO`]: the code, the findings, the text and standard error.
fn beside_two(name: &str, files: &[(&str, &str)], path: &str) -> (i32, Vec<String>, String) {
    let folder = own_scratch(&format!("trace-check-{name}"));
    write(&folder, &TWO);
    write(&folder, files);
    // The text of what LTTng records, instead of babeltrace2.
    let command = "chmod +x babeltrace2; PATH=\"$PWD:$PATH\" exec \"$0\" trace check \"$@\"";
    let run = |format: &str| {
        let arguments = ["-c", command, MAUVE, path, ".", "--format", format];
        mauve("/bin/sh", &folder, &arguments)
    };
    let (table, json) = (run("table"), run("json"));
    assert_eq!(table.code, json.code, "{}{}", table.err, json.err);
    let document: Value = serde_json::from_str(&json.out).unwrap_or_default();
    let findings = document["findings"].as_array().into_iter().flatten();
    let codes = findings.map(|it| it["code"].as_str().unwrap().to_owned()).collect();
    (table.code, codes, table.out + &table.err)
}

/// An event of a codel in the text of babeltrace2.
fn codel_event(time: u64, codel: &str, phase: u32, cpu: u64) -> String {
    format!(
        "echo '[7.{time:09}] vm mauve_x:codel: {{ cpu_id = 0 }}, {{ vtid = 1 }}, {{ instance = \"a\", codel = \"{codel}\", phase = {phase}, cpu_ns = {cpu} }}'\n"
    )
}

/// A name, the files, the recording, the codes of its findings, and a part of the text.
type Recorded<'a> = (&'a str, &'a [(&'a str, &'a str)], &'a str, &'a [&'a str], &'a str);

/// Nothing that was observed is no agreement, whatever the reason.
#[test]
fn nothing_observed_is_a_finding() {
    let lttng = |events: &[String]| format!("#!/bin/sh\n{}", events.concat());
    let backwards: Vec<String> =
        (0..10).map(|it| codel_event(1000 - 10 * it, "f", it as u32 % 2, 100 + it)).collect();
    let begins: Vec<String> = (0..10).map(|it| codel_event(10 * it, "f", 0, 100 + it)).collect();
    let ends: Vec<String> = (0..10).map(|it| codel_event(10 * it, "f", 1, 100 + it)).collect();
    let (backwards, begins, ends) = (lttng(&backwards), lttng(&begins), lttng(&ends));
    let periods = "instance,release_ns,begin_ns,end_ns,execution_ns\n";
    let both = [("rec/executions.csv", EXECUTIONS), ("rec/periods.csv", periods)];
    let of_lttng =
        |text| [("trace/metadata", "/* CTF 1.8 */\n"), ("trace/channel_0", "x"), ("babeltrace2", text)];
    let all: [Recorded<'_>; 5] = [
        (
            "header",
            &[("e.csv", EXECUTIONS)],
            "e.csv",
            &["nothing-observed"],
            ": 0 events were read, with 0 complete",
        ),
        ("headers", &both, "rec", &["nothing-observed"], ": 0 events were read, with 0 complete"),
        (
            "backwards",
            &of_lttng(&backwards),
            "trace",
            &["nothing-observed", "clock"],
            ": 10 events were read, with 0 complete executions; not used: 5 where a clock ran backwards; ",
        ),
        (
            "begins",
            &of_lttng(&begins),
            "trace",
            &["nothing-observed"],
            "not used: 10 not ended in the recording",
        ),
        ("ends", &of_lttng(&ends), "trace", &["nothing-observed"], "not used: 10 begun before the recording"),
    ];
    for (name, files, path, codes, said) in all {
        let (code, found, text) = beside_two(name, files, path);
        assert_eq!((code, found), (1, codes.iter().map(|it| (*it).to_owned()).collect()), "{name}: {text}");
        let shown = Run { out: text.clone(), err: String::new(), code };
        assert!(text.contains("  ✗ no execution of D was observed") && shown.has(said), "{name}: {text}");
        assert!(!text.contains('✓'), "{name}: {text}");
    }
}

/// A part is no whole: what was never observed is in the line with the verdict, and a clock that ran backwards is a finding.
#[test]
fn a_part_of_the_codels_is_said_to_be_a_part() {
    let lines = format!("{EXECUTIONS}f,100,200,1000,0\nf,100,200,2000,1\n");
    let (code, found, text) = beside_two("part", &[("e.csv", &lines)], "e.csv");
    assert_eq!((code, found.len()), (0, 0), "{text}");
    assert!(
        text.contains("✓ no execution contradicts the model; 1 of 2 codels were never observed, "),
        "{text}"
    );
    let lines = format!("{EXECUTIONS}f,100,200,9000,0\nf,100,200,2000,1\n");
    let (code, found, text) = beside_two("order", &[("e.csv", &lines)], "e.csv");
    assert_eq!((code, found), (1, vec!["clock".to_owned()]), "{text}");
    assert!(text.contains("✗ a clock ran backwards at 1 execution, "), "{text}");
}

/// `a` takes 0.3 ms more than its codel and its port, `b` 0.01 ms: the line for the table says what is proved with it.
#[test]
fn an_overhead_is_advised_and_tried() {
    let folder = own_scratch("trace-check-overhead");
    let model = "codel f(): int
shell S { output port out: int }
core K(S) { update = { write(out, f()); } }
component C(S, K)
architecture A { instance a: C  instance b: C }
deployment D {
  architecture A
  activity a { priority = 2  period = 10  deadline = 2.5 }
  activity b { priority = 1  period = 10  deadline = 4.5 }
}
";
    let executions = "codel,execution_ns,instance,elapsed_ns,time_ns,order
f,1900000,a,1900000,2000000,0
(access) C.out,100000,a,100000,2200000,1
f,1990000,b,1990000,4290000,3
f,1900000,a,1900000,12000000,5
";
    let periods = "instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order
a,0,0,2300000,2300000,2,1,0,2
b,0,2300000,4300000,2000000,1,1,0,4
a,10000000,10000000,12000000,1950000,2,1,0,6
";
    write(
        &folder,
        &[
            ("robot.mal", model),
            ("mauve.toml", "[timing]\ntables = [\"t.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n"),
            ("t.toml", "unit = \"us\"\n[codel]\nf = 2000\n[overhead]\ncontext_switch = 5\n"),
            ("rec/executions.csv", executions),
            ("rec/periods.csv", periods),
        ],
    );
    let check = || mauve(MAUVE, &folder, &["trace", "check", "rec", "."]);
    let found = check();
    let said = "  overhead: a period took at most 0.3 ms in `a`, 0.01 ms in `b` besides its codels and ports; the tables have 0.01 ms
    for `t.toml`: [overhead] dispatch = 290
    with it, 1 of 2 deadlines are proved (2 now)
";
    assert!(found.out.ends_with(said), "{}{}", found.out, found.err);
    let document = mauve(MAUVE, &folder, &["trace", "check", "rec", ".", "--format", "json"]).out;
    let document: Value = serde_json::from_str(&document).unwrap();
    assert_eq!(document["instances"][0]["overhead"], 0.3);
    // What was tried is what the user gets.
    write(
        &folder,
        &[("t.toml", "unit = \"us\"\n[codel]\nf = 2000\n[overhead]\ncontext_switch = 5\ndispatch = 290\n")],
    );
    assert!(!check().out.contains("overhead:"), "{}", check().out);
    let responses = || {
        let wcrt = mauve(MAUVE, &folder, &["wcrt", "--format", "json"]).out;
        let wcrt: Value = serde_json::from_str(&wcrt).unwrap();
        [0, 1].map(|index: usize| wcrt["results"][0]["activities"][index]["response"].as_f64())
    };
    assert_eq!(responses(), [Some(2.3), Some(4.6)]);

    // A thread of both wakes up once: 0.3 and 0.01 ms together, in a time of 0.01 ms for both.
    let [of_a, of_b] = [
        "  activity a { priority = 2  period = 10  deadline = 2.5 }\n",
        "  activity b { priority = 1  period = 10  deadline = 4.5 }\n",
    ];
    let thread = "  activity t { instances = [a, b]  priority = 2  period = 10  deadline = 4.305 }\n";
    let shared = model.replace(of_a, thread).replace(of_b, "");
    let table = "unit = \"us\"\n[codel]\nf = 2000\n[overhead]\ncontext_switch = 5\n";
    write(&folder, &[("robot.mal", shared.as_str()), ("t.toml", table)]);
    assert_eq!(responses(), [Some(2.01), Some(4.01)]);
    let said = "  overhead: a period took at most 0.31 ms in `b`, 0.3 ms in `a` besides its codels and ports; the tables have 0.01 ms
    for `t.toml`: [overhead] dispatch = 300
    with it, 1 of 2 deadlines are proved (2 now)
";
    let found = check();
    assert!(found.out.ends_with(said), "{}{}", found.out, found.err);
    write(&folder, &[("t.toml", format!("{table}dispatch = 300\n").as_str())]);
    assert_eq!(responses(), [Some(2.31), Some(4.31)]);
    let found = check();
    assert!(!found.out.contains("overhead:") && !found.out.contains("executed longer"), "{}", found.out);
}
