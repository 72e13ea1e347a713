//! Message packages that are installed: where they are found, which messages they have, and what is passed over.

use std::path::{Path, PathBuf};
use std::time::Duration;

use mauve_tests::{Client, Text, scratch, wait_for_watcher, write};
use serde_json::json;

use crate::MAUVE;

/// A scratch folder with a model that uses `arm_msgs` and has a port of its type `Grip`, and with these files.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), name);
    write(&folder, &[("robot/a.mal", "use arm_msgs\nshell S { input port p: Grip }\n")]);
    write(&folder, files);
    folder
}

/// A server for the model, with variables of the environment that list folders in `folder`.
fn open(folder: &Path, environment: &[(&str, &[&str])]) -> (Client, Text) {
    let list = |folders: &[&str]| {
        let folders = folders.iter().map(|it| folder.join(it).display().to_string());
        folders.collect::<Vec<_>>().join(":")
    };
    let environment: Vec<(&str, String)> =
        environment.iter().map(|(variable, folders)| (*variable, list(folders))).collect();
    let environment: Vec<(&str, &str)> = environment.iter().map(|(name, list)| (*name, &**list)).collect();
    let mut client = Client::start_where(MAUVE, &[], &environment);
    client.initialize(Some(&folder.join("robot")), &json!({}));
    let text = client.open_file(&folder.join("robot/a.mal"));
    (client, text)
}

/// What a hover on `place` shows; nothing, where there is none.
fn shown(client: &mut Client, text: &Text, place: &str) -> String {
    loop {
        match client.call("textDocument/hover", text.at(place)) {
            Ok(hover) => return hover["contents"]["value"].as_str().unwrap_or_default().to_owned(),
            // A file that was read meanwhile has overtaken it.
            Err(error) => assert_eq!(error["code"], -32801),
        }
    }
}

/// What is shown of the type `Grip` of the model in `folder`.
fn grip(folder: &Path, environment: &[(&str, &[&str])]) -> String {
    let (mut client, text) = open(folder, environment);
    shown(&mut client, &text, "Grip")
}

#[test]
fn packages_are_found_below_prefixes() {
    let files = [
        ("ros/share/arm_msgs/msg/Grip.msg", "float64 force # in newton"),
        ("overlay/share/arm_msgs/msg/Grip.msg", "float64[2] forces"),
        ("overlay/share/other/msg/Grip.msg", "int8 other"),
    ];
    let folder = folder("packages_prefix", &files);
    for variable in ["AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"] {
        let found = grip(&folder, &[(variable, &["nothing", "ros", "overlay"])]);
        assert!(found.contains("# arm_msgs/Grip\nfloat64 force\n"), "{found}");
        assert!(found.contains("ros/share/arm_msgs/msg/Grip.msg"), "{found}");
        // The first one wins.
        let found = grip(&folder, &[(variable, &["overlay", "ros"])]);
        assert!(found.contains("# arm_msgs/Grip\nfloat64[2] forces\n"), "{found}");
    }
    assert_eq!(grip(&folder, &[]), "");
}

#[test]
fn packages_are_found_along_the_package_path() {
    let grip_in = |name: &str, path: &str, more: &[(&str, &str)], entry: &str| {
        let folder = folder(&format!("packages_{name}"), more);
        write(&folder, &[(format!("{path}/msg/Grip.msg"), "int8 force".to_owned())]);
        grip(&folder, &[("ROS_PACKAGE_PATH", &[entry])])
    };
    let package = "src/stacks/arm/arm_msgs";
    let manifest = ("src/stacks/arm/arm_msgs/package.xml", "");
    for found in [
        grip_in("top", "src/arm_msgs", &[], "src"),
        grip_in("itself", "src/arm_msgs", &[], "src/arm_msgs"),
        grip_in("below", package, &[manifest], "src"),
    ] {
        assert!(found.contains("int8 force"), "{found}");
    }
    for found in [
        // Without a manifest it is no package.
        grip_in("no_manifest", package, &[], "src"),
        grip_in("ignored", package, &[manifest, ("src/stacks/CATKIN_IGNORE", "")], "src"),
        grip_in("in_package", package, &[manifest, ("src/stacks/package.xml", "")], "src"),
        grip_in("hidden", "src/.arm/arm_msgs", &[("src/.arm/arm_msgs/package.xml", "")], "src"),
        grip_in("deep", "src/1/2/3/4/5/arm_msgs", &[("src/1/2/3/4/5/arm_msgs/package.xml", "")], "src"),
    ] {
        assert_eq!(found, "");
    }
}

#[test]
fn messages_that_are_made_elsewhere_are_of_the_same_package() {
    let files = [
        ("src/arm_msgs/msg/Grip.msg", "Finger[] fingers"),
        ("devel/share/arm_msgs/msg/GripGoal.msg", "float64 goal"),
    ];
    let folder = folder("packages_merged", &files);
    write(&folder, &[("robot/a.mal", "use arm_msgs codel f(in g: Grip, in goal: GripGoal): int")]);
    let environment: [(&str, &[&str]); 2] =
        [("CMAKE_PREFIX_PATH", &["devel"]), ("ROS_PACKAGE_PATH", &["src"])];
    let (mut client, text) = open(&folder, &environment);
    assert!(shown(&mut client, &text, "Grip,").contains("Finger[] fingers"));
    assert!(shown(&mut client, &text, "GripGoal").contains("float64 goal"));
}

#[test]
fn an_installed_package_replaces_the_one_that_is_built_in() {
    let files = [
        ("ros/share/std_msgs/msg/Mine.msg", "int8 mine"),
        ("robot/a.mal", "use std_msgs use geometry_msgs codel f(in a: Mine, in b: String, in c: Pose): int"),
    ];
    let folder = folder("packages_replaced", &files);
    let (mut client, text) = open(&folder, &[("AMENT_PREFIX_PATH", &["ros"])]);
    assert!(shown(&mut client, &text, "Mine").contains("int8 mine"));
    assert_eq!(shown(&mut client, &text, "String"), "");
    assert!(shown(&mut client, &text, "Pose").contains("built-in definition"));
}

#[test]
fn what_cannot_be_read_is_passed_over() {
    let files = [
        ("ros/share/arm_msgs/msg/Grip.msg", "int8 force\n\0\u{7}?\nint8 more"),
        ("ros/share/msg/Grip.msg", "int8 no"),
    ];
    let folder = folder("packages_unreadable", &files);
    let messages = folder.join("ros/share/arm_msgs/msg");
    std::fs::write(messages.join("Latin.msg"), b"int8 x # \xe9\n").unwrap();
    std::fs::write(messages.join("Long.msg"), "int8 x\n".repeat(200_000)).unwrap();
    std::fs::create_dir(messages.join("Folder.msg")).unwrap();
    let model =
        "codel f(in a: arm_msgs.Latin, in b: arm_msgs.Long, in c: arm_msgs.Folder, in d: arm_msgs.Grip): int";
    write(&folder, &[("robot/a.mal", model)]);
    let (mut client, text) =
        open(&folder, &[("AMENT_PREFIX_PATH", &["ros", "ros/share/arm_msgs/msg/Grip.msg"])]);
    for name in ["Latin", "Long", "Folder"] {
        assert_eq!(shown(&mut client, &text, name), "", "{name}");
    }
    assert!(shown(&mut client, &text, "Grip").contains("int8 force\nint8 more\n"));
}

#[test]
fn a_package_that_is_named_by_an_edit_is_read() {
    let files = [
        ("ros/share/arm_msgs/msg/Grip.msg", "int8 force"),
        ("ros/share/leg_msgs/msg/Step.msg", "int8 length"),
    ];
    let folder = folder("packages_edited", &files);
    let (mut client, mut text) = open(&folder, &[("AMENT_PREFIX_PATH", &["ros"])]);
    client.edit(&mut text, "p: Grip", "p: leg_msgs::Step");
    client.diagnostics(&text);
    assert!(shown(&mut client, &text, "Step").contains("int8 length"));
    client.edit(&mut text, "use arm_msgs", "use leg_msgs");
    client.edit(&mut text, "leg_msgs::Step", "Step");
    client.diagnostics(&text);
    assert!(shown(&mut client, &text, "Step").contains("int8 length"));
}

#[test]
fn a_text_that_is_no_file_uses_what_is_installed() {
    let folder = folder("packages_alone", &[("ros/share/arm_msgs/msg/Grip.msg", "int8 force")]);
    let ros = folder.join("ros").display().to_string();
    let mut client = Client::start_where(MAUVE, &[], &[("AMENT_PREFIX_PATH", &ros)]);
    client.initialize(None, &json!({}));
    let text = client.open_at("untitled:Untitled-1", "use arm_msgs codel f(in g: Grip): int");
    client.diagnostics(&text);
    assert!(shown(&mut client, &text, "Grip").contains("int8 force"));
}

#[test]
fn a_message_that_changes_is_read_again() {
    let folder = folder("packages_change", &[("ros/share/arm_msgs/msg/Grip.msg", "float64 force")]);
    let (mut client, text) = open(&folder, &[("AMENT_PREFIX_PATH", &["ros"])]);
    assert!(shown(&mut client, &text, "Grip").contains("float64 force\n"));
    write(&folder, &[("ros/share/arm_msgs/msg/Grip.msg", "float64 torque")]);
    wait_for(&mut client, &text, "float64 torque\n");
    std::fs::remove_file(folder.join("ros/share/arm_msgs/msg/Grip.msg")).unwrap();
    wait_for(&mut client, &text, "");
}

/// Waits until the type `Grip` shows something with this in it; with nothing, until it shows nothing.
fn wait_for(client: &mut Client, text: &Text, expected: &str) {
    let found = wait_for_watcher(Duration::from_secs(20), || {
        let found = shown(client, text, "Grip");
        let is_it = if expected.is_empty() { found.is_empty() } else { found.contains(expected) };
        if is_it { Ok(()) } else { Err(found) }
    });
    found.unwrap();
}
