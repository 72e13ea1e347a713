//! Executes the scripts and launch files of deployments with Lua, roslaunch and xmllint.
//!
//! Orocos is not required. Required Debian packages: lua5.1, python3-roslaunch and libxml2-utils.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{Package, packages};
use mauve_tests::ops::{Call, Literal, run};
use mauve_tests::{models, random_model, scratch, texts_in, write};

fn generated(folder: PathBuf, texts: Vec<(PathBuf, String)>) -> Vec<Package> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, folder, texts);
    let [project] = projects(&db, workspace).as_slice() else { panic!("several projects") };
    packages(&db, *project, None).unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The packages of the models below a folder.
fn generated_from(folder: &Path) -> Vec<Package> {
    generated(folder.to_owned(), texts_in(folder))
}

/// A deployment with names and values that need escapes.
fn arm() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../analysis/orocos/tests/arm")
}

/// The scripts of the deployments in some packages: that for the deployer, and that in Lua.
fn scripts(packages: &[Package]) -> Vec<[String; 2]> {
    let files: Vec<_> = packages.iter().flat_map(|package| &package.files).collect();
    let ops = files.iter().filter_map(|file| Some((file.path.strip_suffix(".ops")?, &file.text)));
    let both = ops.map(|(path, ops)| {
        let lua = files.iter().find(|file| file.path == format!("{path}.lua")).expect(path);
        [ops.clone(), lua.text.clone()]
    });
    both.collect()
}

fn output(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|error| panic!("{command:?} does not run: {error}"))
}

/// Returns the calls of a Lua script to the substitute for RTT, and the message of its error.
fn run_lua(folder: &Path, script: &str, failing: &str) -> (Vec<Call>, Option<String>) {
    write(folder, &[("script.lua", script)]);
    let checked = output(Command::new("luac5.1").arg("-p").arg(folder.join("script.lua")));
    assert!(checked.status.success(), "{}\n{script}", String::from_utf8_lossy(&checked.stderr));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/deployer/?.lua");
    let mut command = Command::new("lua5.1");
    let done =
        output(command.arg("script.lua").current_dir(folder).env("LUA_PATH", path).env("FAILING", failing));
    let said = String::from_utf8(done.stderr).unwrap();
    let calls = String::from_utf8(done.stdout).unwrap().lines().map(call).collect();
    (calls, (!done.status.success()).then_some(said))
}

fn call(line: &str) -> Call {
    let mut fields = line.split('\t');
    let function = fields.next().unwrap().to_owned();
    let of = |field: &str| match field.split_at(1) {
        ("t", text) => {
            let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
            Literal::Text(String::from_utf8(text.as_bytes().chunks(2).map(byte).collect()).unwrap())
        }
        ("n", number) => Literal::Double(number.parse().unwrap()),
        ("b", value) => Literal::Bool(value == "true"),
        _ => panic!("{line}"),
    };
    Call { function, arguments: fields.map(of).collect() }
}

/// Returns the calls of a deployer script, with all numbers formatted as in Lua.
fn run_ops(script: &str, failing: &str) -> Vec<Call> {
    let fails = |call: &Call| format!("{} {}", call.function, call.text(0)) == failing;
    let mut calls = run(script, fails).unwrap_or_else(|why| panic!("{why}\n{script}"));
    for argument in calls.iter_mut().flat_map(|call| &mut call.arguments) {
        if let Literal::Int(number) = argument {
            *argument = Literal::Double((*number).into());
        }
    }
    calls
}

#[test]
fn orocos_lua_does_what_the_deployer_does() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "deployment_lua");
    let mut packages = vec![generated_from(&arm()), generated_from(&models().join("p3dx"))];
    packages.extend((0..30).map(|seed| generated("/".into(), random_model(seed).texts())));
    for [ops, lua] in packages.iter().flat_map(|packages| scripts(packages)) {
        let calls = run_ops(&ops, "");
        assert_eq!(run_lua(&folder, &lua, ""), (calls.clone(), None), "{ops}\n{lua}");
        let last = calls.iter().rfind(|call| call.function == "configure").unwrap().text(0);
        let failing = format!("configure {last}");
        let (calls, said) = run_lua(&folder, &lua, &failing);
        // Nothing starts, and who reads that is told why.
        for calls in [calls, run_ops(&ops, &failing)] {
            assert!(!calls.iter().any(|call| call.function == "start"), "{calls:?}");
        }
        assert!(said.is_some_and(|said| said.contains(&format!("Cannot configure {last}\nNothing runs."))));
    }
}

#[test]
fn orocos_lua_stops_where_something_fails() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "deployment_lua_fails");
    let [[ops, lua]] = scripts(&generated_from(&arm())).try_into().unwrap();
    let mut seen = 0;
    for call in run_ops(&ops, "") {
        if call.function == "set" {
            continue;
        }
        let (calls, said) = run_lua(&folder, &lua, &format!("{} {}", call.function, call.text(0)));
        assert!(said.is_some(), "{call:?}");
        let started: Vec<_> = calls.iter().filter(|it| it.function == "start").collect();
        assert!(call.function == "start" || started.is_empty(), "{started:?}");
        seen += 1;
    }
    assert!(seen > 15, "{seen}");
}

/// A folder with packages, and a substitute for `rtt_ros` whose launch file has the arguments of the real one.
fn ros_packages(name: &str, packages: &[Package]) -> PathBuf {
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
        let script = here(&format!("{package}/scripts/{deployment}.ops"));
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
    for [ops, lua] in scripts(&packages) {
        assert_eq!(run_lua(&folder, &lua, ""), (run_ops(&ops, ""), None));
    }
}
