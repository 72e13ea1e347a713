//! Executes the script of a deployment with Lua, and launch files with roslaunch and xmllint.
//!
//! Orocos is not required. Required Debian packages: lua5.1, python3-roslaunch and libxml2-utils.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{GeneratedPackage, packages};
use mauve_tests::deployer::{Argument, run};
use mauve_tests::{models, scratch, texts_in, write};

fn generated(folder: PathBuf, texts: Vec<(PathBuf, String)>) -> Vec<GeneratedPackage> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, folder, texts);
    let [project] = projects(&db, workspace).as_slice() else { panic!("several projects") };
    packages(&db, *project, None).unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The packages of the models below a folder.
fn generated_from(folder: &Path) -> Vec<GeneratedPackage> {
    generated(folder.to_owned(), texts_in(folder))
}

/// A deployment with names and values that need escapes.
fn arm() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../analysis/orocos/tests/arm")
}

/// The script of the only deployment in some packages.
fn script(packages: &[GeneratedPackage]) -> &str {
    let files = packages.iter().flat_map(|package| &package.files);
    let scripts: Vec<_> = files.filter(|file| file.path.starts_with("scripts/")).collect();
    let [script] = scripts[..] else { panic!("{scripts:?}") };
    &script.text
}

fn output(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|error| panic!("{command:?} does not run: {error}"))
}

#[test]
fn orocos_scripts_say_what_failed() {
    let packages = generated_from(&arm());
    let script = script(&packages);
    for (failing, says) in [
        ("import arm", "Cannot import package arm: build it, and source its workspace\nNothing runs."),
        ("load last_3", "Cannot load last_3, a arm::Gripper: rebuild its package\nNothing runs."),
        ("getProperty arm.start_", "Cannot set start_ of arm: "),
        ("set arm", "Cannot set label of arm: "),
        ("connect arm.done_", "Cannot connect arm.done_ and mal_true_hand.told\nNothing runs."),
        (
            "connectOperations mal_true_hand.grip",
            "Cannot connect mal_true_hand.grip and last_3.grip\nNothing runs.",
        ),
        ("setActivity arm", "Cannot create the activity of arm\nNothing runs."),
        ("setCpuAffinity arm", "Cannot set the CPU affinity of arm: do these CPUs exist?\nNothing runs."),
        ("mauve_runs_as arm", "Cannot start arm\nNothing runs."),
        ("stream arm.goal", "Cannot create topic arm/goal: is roscore running?\nNothing runs."),
        ("configure arm", "Cannot configure arm\nNothing runs."),
        ("start last_3", "Cannot start last_3\nNothing runs."),
    ] {
        let (calls, error) = run(script, failing);
        assert!(error.as_ref().is_some_and(|error| error.contains(says)), "{failing}: {error:?}");
        // Components that have started are stopped again.
        let count = |function: &str| calls.iter().filter(|call| call.function == function).count();
        let is_started = failing.starts_with("start");
        assert_eq!((count("start"), count("stop")), if is_started { (2, 1) } else { (0, 0) }, "{failing}");
    }
}

/// Data releases `b`. The last instance of a shared thread has it, executes the others in the order of the list, starts after them
/// and stops before them; here it also provides an operation to one of them.
#[test]
fn orocos_scripts_have_releases_by_data_and_shared_threads() {
    let model = "shell S { input port heard: int  output port told: int }\ncore K(S) { update = { write(told, 1); } }\ncomponent C(S, K)\n\
         shell GiverShell { provide ask(): int }\ncore GiverCore(GiverShell) { provide ask(): int = { return 1; }  update = { } }\n\
         component Giver(GiverShell, GiverCore)\n\
         shell TakerShell { require ask(): int }\ncore TakerCore(TakerShell) { update = { } }\n\
         component Taker(TakerShell, TakerCore)\n\
         shell BothShell { input port heard: int  input port seen: int }\ncore BothCore(BothShell) { update = { } }\n\
         component Both(BothShell, BothCore)\n\
         architecture A { instance giver: Giver  instance a: C  instance b: C  instance taker: Taker  instance c: Both\n\
         connection a.told -> [4] b.heard  connection a.told -> c.heard  connection b.told -> c.seen\n\
         operation giver.ask -> taker.ask }\n\
         deployment D { architecture A\n\
         activity all { instances = [taker, a, giver]  priority = 2  period = 10  affinity = 1 }\n\
         activity b { priority = 3  trigger = heard  least = 30  burst = 2  affinity = 1 }\n\
         activity c { priority = 4  trigger = all [heard, seen]  least = 20  affinity = 1  preemptive = false } }\n";
    let files = vec![("/robot.mal".into(), model.to_owned())];
    let packages = generated("/".into(), files);
    let (calls, error) = run(script(&packages), "");
    assert_eq!(error, None);
    let of = |functions: &[&str]| -> Vec<String> {
        let calls = calls.iter().filter(|call| functions.contains(&call.function.as_str()));
        let shown = |argument: &Argument| match argument {
            Argument::Text(text) => text.clone(),
            Argument::Number(number) => number.to_string(),
            Argument::Bool(value) => value.to_string(),
        };
        let line = |arguments: &[Argument]| arguments.iter().map(shown).collect::<Vec<_>>().join(" ");
        calls.map(|call| format!("{} {}", call.function, line(&call.arguments))).collect()
    };
    assert_eq!(
        of(&["mauve_released_by", "connect"]),
        [
            "mauve_released_by b heard 0.03 2 false",
            "mauve_released_by c heard 0.02 1 true",
            "mauve_released_by c seen 0.02 1 true",
            "connect a.told b.heard CIRCULAR_BUFFER 4",
            "connect a.told c.heard DATA 0",
            "connect b.told c.seen DATA 0",
        ]
    );
    assert_eq!(
        of(&[
            "setActivity",
            "setMasterSlaveActivity",
            "mauve_executes",
            "setCpuAffinity",
            "mauve_runs_as",
            "mauve_is_not_preempted"
        ]),
        [
            "setActivity giver 0.01 2 ORO_SCHED_RT",
            "setCpuAffinity giver 1",
            "setMasterSlaveActivity giver taker",
            "mauve_executes giver taker",
            "setMasterSlaveActivity giver a",
            "mauve_executes giver a",
            "mauve_runs_as taker 2 1",
            "mauve_runs_as a 2 1",
            "mauve_runs_as giver 2 1",
            "setActivity b 0 3 ORO_SCHED_RT",
            "setCpuAffinity b 1",
            "mauve_runs_as b 3 1",
            "setActivity c 0 4 ORO_SCHED_RT",
            "setCpuAffinity c 1",
            "mauve_is_not_preempted c",
            "mauve_runs_as c 4 1",
        ]
    );
    assert_eq!(of(&["start"]), ["start a", "start b", "start taker", "start giver", "start c"]);
    for (failing, says) in [
        ("mauve_released_by b", "Cannot let data release b\nNothing runs."),
        ("setMasterSlaveActivity giver", "Cannot execute taker in the thread of giver\nNothing runs."),
        ("mauve_is_not_preempted c", "Cannot give c the highest priority\nNothing runs."),
    ] {
        let (_, error) = run(script(&packages), failing);
        assert!(error.as_ref().is_some_and(|error| error.contains(says)), "{failing}: {error:?}");
    }
}

/// Orocos would execute the jobs in another order than the analysis.
#[test]
fn orocos_scripts_refuse_a_queue() {
    let model = "shell S { }\ncore K(S) { update = { } }\ncomponent C(S, K)\n\
         architecture A { instance a: C  instance b: C }\n\
         deployment D { architecture A\n\
         activity a { priority = 2  period = 10  thread = both  affinity = 1 }\n\
         activity b { priority = 2  period = 15  thread = both  affinity = 1 } }\n";
    let packages = generated("/".into(), vec![("/robot.mal".into(), model.to_owned())]);
    let (calls, error) = run(script(&packages), "");
    assert_eq!(calls, []);
    let error = error.unwrap_or_default();
    assert!(
        error.contains("Cannot execute a, b in the order of their releases: no thread of Orocos does."),
        "{error}"
    );
}

/// A folder with packages, and a substitute for `rtt_ros` whose launch file has the arguments of the real one.
fn ros_packages(name: &str, packages: &[GeneratedPackage]) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    let manifest = |name: &str| {
        format!(
            "<package><name>{name}</name><version>0.0.0</version><description>For tests</description>\
             <maintainer email=\"nobody@example.org\">Nobody</maintainer><license>MIT</license></package>\n"
        )
    };
    let launch = r#"<launch>
  <arg name="LOG_LEVEL" default="info"/>
  <arg name="DEPLOYER_ARGS" default=""/>
  <node name="deployer" pkg="rtt_ros" type="deployer" args="-l $(arg LOG_LEVEL) $(arg DEPLOYER_ARGS) --"/>
</launch>
"#;
    write(&folder, &[("rtt_ros/package.xml", manifest("rtt_ros").as_str())]);
    write(&folder, &[("rtt_ros/launch/deployer.launch", launch), ("rtt_ros/deployer", "#!/bin/sh\n")]);
    let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(folder.join("rtt_ros/deployer"), executable).unwrap();
    for package in packages {
        // Its own, where it has one.
        write(&folder.join(&package.name), &[("package.xml", manifest(&package.name).as_str())]);
        for file in &package.files {
            write(&folder.join(&package.name), &[(&file.path, &file.text)]);
        }
    }
    folder
}

/// Returns the output of roslaunch for a launch file.
fn roslaunch(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new("roslaunch");
    command.args(arguments).current_dir(folder).env("ROS_PACKAGE_PATH", folder);
    command.env("HOME", folder).env("ROS_HOME", folder.join("home")).env("EVIL", "evil");
    let done = output(&mut command);
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

#[test]
fn orocos_launch_files_start_the_deployer_with_the_script() {
    for (name, models, package, deployment) in [
        ("deployment_launch_arm", arm(), "arm", "D"),
        ("deployment_launch_p3dx", models().join("p3dx"), "exploration", "P3dxDeployment"),
    ] {
        let folder = ros_packages(name, &generated_from(&models));
        let launch = folder.join(format!("{package}/launch/{deployment}.launch"));
        let launch = launch.to_str().unwrap();
        let here = |path: &str| folder.join(path).display().to_string();
        let files = roslaunch(&folder, &["--files", launch]);
        let read = BTreeSet::from([launch.to_owned(), here("rtt_ros/launch/deployer.launch")]);
        assert_eq!(files.lines().map(str::to_owned).collect::<BTreeSet<_>>(), read);
        assert_eq!(roslaunch(&folder, &["--nodes", launch]), "/deployer\n");
        let started = roslaunch(&folder, &["--args", "/deployer", launch]);
        let script = here(&format!("{package}/scripts/{deployment}.lua"));
        let expected = format!("{} -l info -s {script} -- __name:=deployer", here("rtt_ros/deployer"));
        assert!(started.contains(&expected), "{started}");
        // The deployer receives the arguments of the launch line; topics are in the namespace.
        let said = [
            "namespace:=/left",
            "start:=false",
            "values:=/v",
            "allow_non_realtime:=true",
            "log_level:=debug",
        ];
        let started = roslaunch(&folder, &[&["--args", "/left/deployer", launch], said.as_slice()].concat());
        let expected = "ROS_NAMESPACE=\"/left\" MAUVE_START=\"false\" MAUVE_VALUES=\"/v\" MAUVE_ALLOW_NON_REALTIME=\"true\"";
        assert!(started.contains(expected) && started.contains(" -l debug "), "{started}");
        assert!(Path::new(&script).exists());
        let checked = output(Command::new("xmllint").args(["--noout", launch]));
        assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    }
}

#[test]
fn orocos_nothing_of_a_model_is_substituted_in_a_launch_file() {
    let model = std::fs::read_to_string(arm().join("robot.mal")).unwrap();
    let config = std::fs::read_to_string(arm().join("mauve.toml")).unwrap();
    // Names are names of C++; the name of a file is what can hold anything.
    let path = "/a--$(env EVIL)${EVIL}--->&<\n\u{1}\u{fffe}-.mal".to_owned();
    let packages = generated("/".into(), vec![(path.into(), model), ("/mauve.toml".into(), config)]);
    let folder = ros_packages("deployment_launch_hostile", &packages);
    let launch = folder.join("arm/launch/D.launch");
    let text = std::fs::read_to_string(&launch).unwrap();
    assert!(text.contains("$(env EVIL)"), "it is only said where the model stands: {text}");
    let launch = launch.to_str().unwrap();
    assert!(!roslaunch(&folder, &["--args", "/deployer", launch]).contains("evil"));
    let checked = output(Command::new("xmllint").args(["--noout", launch]));
    assert!(checked.status.success(), "{}\n{text}", String::from_utf8_lossy(&checked.stderr));
    assert_eq!(run(script(&packages), "").1, None);
}
