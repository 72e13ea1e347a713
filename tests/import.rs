//! Records a program with the events of ROS 2, imports it, and compares the project with what the program says.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_pwcet::samples::Samples;
use mauve_tests::orocos::{COMPILERS, run};
use mauve_tests::{Recorder, mauve, own_scratch, write};
use serde_json::Value;

const BINARY: &str = env!("CARGO_BIN_EXE_mauve");

/// What CARET writes of a path through both nodes.
const PATHS: &str = "named_paths:
- path_name: reach
  node_chain:
  - node_name: /arm/eye
    publish_topic_name: /arm/seen
    subscribe_topic_name: UNDEFINED
  - node_name: /hand
    publish_topic_name: UNDEFINED
    subscribe_topic_name: /arm/seen
";

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/import").join(name)
}

/// Returns the executions in the order of the program, by its names.
fn executions(out: &str) -> BTreeMap<String, Vec<u64>> {
    let mut all: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for line in out.lines() {
        let (name, time) = line.split_once(' ').unwrap();
        all.entry(name.to_owned()).or_default().push(time.parse().unwrap());
    }
    all
}

/// Begins to record the program, which is not started.
fn begin_to_record() -> (Recorder, PathBuf) {
    let mut recorder = Recorder::start();
    let program = recorder.folder().join("callbacks");
    let mut compile = Command::new(COMPILERS[0]);
    compile.args(["-std=c++14", "-Wall", "-Wextra", "-Werror"]).arg(format!("-I{}", source("").display()));
    compile.arg(source("callbacks.cpp")).arg("-o").arg(&program).args(["-llttng-ust", "-ldl", "-pthread"]);
    run(&mut compile);
    recorder.record_events("ros2*", &["vpid", "vtid", "procname"]);
    (recorder, program)
}

/// Records the program. Returns the recorder, whose only session it is, and what the program said.
pub(crate) fn record_callbacks() -> (Recorder, String) {
    let (recorder, program) = begin_to_record();
    let said = run(&mut recorder.command(&program));
    recorder.stop();
    (recorder, said)
}

/// Writes times of an idle computer into a project of the recording: what a busy one records may miss a deadline.
pub(crate) fn replace_recorded_times(project: &Path) {
    let edit = |name: &str, edit: &dyn Fn(&str) -> String| {
        let path = project.join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, edit(&text)).unwrap();
    };
    for (name, before, value) in [
        ("timing.toml", "arm_eye_timer_20ms\" = ", "2100"),
        ("timing.toml", "hand_on_arm_seen\" = ", "3100"),
        ("system.mal", "trigger = arm_seen  least = ", "17"),
        ("system.mal", "jitter = ", "0.1"),
        ("mauve.toml", "cpus = ", "2"),
    ] {
        let is_end = |it: char| !it.is_ascii_digit() && it != '.';
        edit(name, &|text| {
            let (begin, rest) = text.split_once(before).unwrap_or_else(|| panic!("no `{before}` in {text}"));
            let replaced = |rest: &str| format!("{before}{value}{}", &rest[rest.find(is_end).unwrap()..]);
            begin.to_owned() + &rest.split(before).map(replaced).collect::<String>()
        });
    }
    edit("mauve.toml", &|text| text.replace("observed = ", "# observed = "));
}

#[test]
fn orocos_callbacks_that_were_recorded_are_a_project() {
    let (recorder, said) = record_callbacks();
    let (folder, said) = (recorder.folder().to_owned(), executions(&said));
    let recording = recorder.output();
    write(&folder, &[("architecture.yaml", PATHS)]);
    let of = recording.display().to_string();
    let import = || mauve(BINARY, &folder, &["import", &of, "architecture.yaml", "-o", "robot"]);
    let first = import();
    assert_eq!(first.code, 0, "{first:?}");
    for expected in [
        "arm_eye_timer_20ms  timer, 20.00 ms          40",
        "hand_on_arm_seen    /arm/seen                40",
        "2 callbacks in 2 nodes, 80 executions; 1 of timers",
        "times are elapsed ones",
        "not proved",
        "wrote robot/system.mal",
    ] {
        assert!(first.has(expected), "{expected}: {first:?}");
    }

    // The program measures within the events: the difference is what they cost, and preemption between them.
    let mut samples = Samples::open(&folder.join("robot/recorded.samples")).unwrap();
    for (name, callback) in [("eye", "arm_eye_timer_20ms"), ("hand", "hand_on_arm_seen")] {
        let series = samples.series().iter().find(|it| it.instance == callback).unwrap().clone();
        assert_eq!(series.key, format!("ros.{callback}"));
        let recorded = samples.executions(series.id).unwrap();
        let recorded: Vec<u64> = recorded.iter().map(|it| it.execution).collect();
        let differences: Vec<u64> = said[name]
            .iter()
            .zip(&recorded)
            .map(|(said, recorded)| recorded.checked_sub(*said).expect("an execution is too short"))
            .collect();
        assert_eq!((differences.len(), recorded.len()), (40, 40));
        assert!(*differences.iter().min().unwrap() < 100_000, "{differences:?}");
        let table = std::fs::read_to_string(folder.join("robot/timing.toml")).unwrap();
        let greatest = recorded.iter().max().unwrap();
        assert!(table.contains(&format!("\"ros.{callback}\" = {}.", greatest / 1000)), "{table}");
    }

    // What was recorded is within the bounds. A computer that is too busy has none.
    let compared = || {
        let trace = ["trace", "check", "--deployment", "Isolated", "--format", "json", &of, "robot"];
        let trace = mauve(BINARY, &folder, &trace);
        serde_json::from_str::<Value>(&trace.out).unwrap()
    };
    let checked = compared();
    for instance in checked["instances"].as_array().unwrap() {
        let [response, bound] = ["response", "bound"].map(|it| instance[it].as_f64());
        assert!(bound.is_none_or(|bound| response.unwrap() <= bound), "{checked:#}");
    }

    replace_recorded_times(&folder.join("robot"));

    // With a priority for each thread, everything is proved, if the times hold.
    let check = mauve(BINARY, &folder, &["check", "robot"]);
    assert_eq!(check.code, 0, "{check:?}");
    assert!(check.has("arm_eye_timer_20ms  ArmEyeTimer20ms") && !check.has("not real-time"), "{check:?}");
    assert!(check.has("all 2 deadlines are proved, if the"), "{check:?}");
    let tune = ["tune", "--priorities", "--cpus", "--deployment", "Isolated", "robot"];
    let tune = mauve(BINARY, &folder, &tune);
    assert!(tune.has("2 of 2 deadlines met"), "{tune:?}");
    let chains = mauve(BINARY, &folder, &["chains", "--deployment", "Isolated", "robot"]);
    assert!(chains.has("\n  reach") && chains.has("≤ "), "{chains:?}");

    // The messages lay there for 3 ms, which the deployment does not say any more.
    let checked = compared();
    let [eye, hand] = [0, 1].map(|it| &checked["instances"][it]);
    assert_eq!(
        (&eye["instance"], &eye["periods"]),
        (&"arm_eye_timer_20ms".into(), &40.into()),
        "{checked:#}"
    );
    assert_eq!(
        (&hand["instance"], &hand["periods"]),
        (&"hand_on_arm_seen".into(), &40.into()),
        "{checked:#}"
    );
    let [response, execution] = ["response", "execution"].map(|it| hand[it].as_f64().unwrap());
    assert!(response > execution + 2.9 && hand["verdict"] == "fails", "{checked:#}");
    // The timer's are not recorded.
    assert_eq!(eye["response_is_lower_bound"], true);

    // Its functions cannot be executed alone.
    let pwcet = mauve(BINARY, &folder, &["pwcet", "robot/recorded.samples"]);
    assert!(pwcet.has("mauve import RECORDING -o DIR") && !pwcet.has("mauve measure"), "{pwcet:?}");

    // What is edited is kept, and the same executions are not counted twice.
    let model = folder.join("robot/system.mal");
    let edited = std::fs::read_to_string(&model).unwrap().replace("period = 20", "period = 25");
    std::fs::write(&model, &edited).unwrap();
    let second = import();
    assert_eq!(second.code, 2, "{second:?}");
    assert!(second.has("kept robot/system.mal") && second.err.contains("was imported into"), "{second:?}");
    assert_eq!(std::fs::read_to_string(&model).unwrap(), edited);
    assert_eq!(Samples::open(&folder.join("robot/recorded.samples")).unwrap().runs().len(), 1);
}

#[test]
fn orocos_a_session_is_imported_while_it_is_recorded() {
    let (recorder, program) = begin_to_record();
    let (session, folder) = (recorder.output().display().to_string(), recorder.folder());
    let import = || mauve(BINARY, folder, &["trace", "import", &session, "-o", "robot.samples"]);
    run(&mut recorder.command(&program));
    recorder.rotate();
    let first = import();
    assert!(first.code == 0 && first.err.contains("LTTng still records"), "{first:?}");
    assert!(first.has("ros.hand_on_arm_seen") && first.has("1 run"), "{first:?}");
    run(&mut recorder.command(&program));
    recorder.end();
    let second = import();
    assert!(second.code == 0 && second.err.contains("1 chunk was imported before"), "{second:?}");
    assert_eq!(Samples::open(&folder.join("robot.samples")).unwrap().runs().len(), 2);
}

#[test]
fn a_controllers_file_alone_is_a_project() {
    let folder = own_scratch("controllers");
    let controllers = "controller_manager:
  ros__parameters:
    update_rate: 500
    cpu_affinity: [1]
    joints: { type: broadcasters/Joints }
    planner: { type: arm_controllers/Planner }
planner:
  ros__parameters: { update_rate: 50, is_async: true, async_parameters: { thread_priority: 40, cpu_affinity: [1] } }
";
    write(&folder, &[("robot/controllers.yaml", controllers)]);
    let import = mauve(BINARY, &folder, &["import", "robot/controllers.yaml", "-o", "robot"]);
    assert!(import.code == 0 && import.has("wrote robot/system.mal"), "{import:?}");
    assert!(import.has("not known: the times") && !import.has("executions"), "{import:?}");
    let config = std::fs::read_to_string(folder.join("robot/mauve.toml")).unwrap();
    let config = config + "[assume]\ncodel = \"0.1 ms\"\n";
    write(&folder, &[("robot/mauve.toml", config.as_str())]);
    // Read, one controller and write take 0.3 ms. They delay the planner, which begins up to a cycle late.
    let check = mauve(BINARY, &folder, &["check", "robot"]);
    assert!(check.code == 0 && check.has("0.3 / 2 ms") && check.has("2.4 / 19 ms"), "{check:?}");
    // A controller that is added is not in the model; nor is one that leaves its own thread.
    let planner = "    planner: { type: arm_controllers/Planner }\n";
    let added = controllers.replace(planner, &format!("{planner}    grip-per: {{ type: x/Y }}\n"));
    for (text, codel) in [
        (added, "no activity of Isolated has `grip_per_update` of this thread"),
        (controllers.replace("is_async: true", "is_async: false"), "has `planner_update` of this thread"),
    ] {
        write(&folder, &[("robot/controllers.yaml", text.as_str())]);
        let check = mauve(BINARY, &folder, &["check", "robot"]);
        assert!(check.code == 1 && check.has(codel) && !check.has("0.3 / 2 ms"), "{check:?}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_is_no_part_of_a_system_of_ros_2_is_refused() {
    let folder = own_scratch("import");
    std::fs::create_dir_all(folder.join("empty")).unwrap();
    let manager = "controller_manager: { ros__parameters: { joints: { type: broadcasters/Joints } } }\n";
    let other = "[project]\n";
    write(&folder, &[("map.yaml", "image: map.pgm\n"), ("c.yaml", manager), ("other/mauve.toml", other)]);
    for (arguments, why) in [
        (&["empty", "-o", "robot"][..], "empty"),
        (&["map.yaml", "c.yaml", "-o", "robot"], "`map.yaml` has no `callback_groups`"),
        (&["c.yaml", "-o", "other"], "`other` has another project"),
    ] {
        let refused = mauve(BINARY, &folder, &[&["import"], arguments].concat());
        assert_eq!(refused.code, 2, "{refused:?}");
        assert!(refused.err.contains(why) && !folder.join("robot").exists(), "{refused:?}");
    }
    assert!(!folder.join("other/system.mal").exists());
    // Each command that is proposed finds the file.
    let run = |arguments: &[&str]| mauve(BINARY, &folder, arguments);
    let import = run(&["import", "c.yaml", "c.yaml", "-o", "robot"]);
    assert!(import.has("Next: mauve check --allow-outside robot;"), "{import:?}");
    let check = run(&["check", "--allow-outside", "robot"]);
    assert!(check.has("3 codels have no time"), "{check:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}
