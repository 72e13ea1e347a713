//! The first commands of a new user: `mauve new`, `psm` without a component, `explain all`.

use std::path::PathBuf;

use mauve_tests::{mauve, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

/// Returns a folder with the project that `mauve new robot` makes.
fn new_project() -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let made = mauve(MAUVE, &folder, &["new", "robot"]);
    assert_eq!((made.code, made.err.as_str()), (0, ""));
    assert!(made.out.ends_with("\nNext: mauve check robot\n"), "{}", made.out);
    folder
}

#[test]
fn a_new_project_meets_its_deadlines_and_has_no_diagnostics() {
    let checked = mauve(MAUVE, &new_project(), &["check", "robot", "--format", "json"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    let document: Value = serde_json::from_str(&checked.out).unwrap();
    assert_eq!(document["diagnostics"], Value::Array(Vec::new()));
    let activities = document["deployments"][0]["results"][0]["activities"].as_array().unwrap();
    let figures: Vec<_> =
        activities.iter().map(|it| (it["instance"].as_str(), it["response"].as_u64())).collect();
    assert_eq!(figures, [(Some("laser"), Some(12)), (Some("pilot"), Some(43))]);
}

#[test]
fn a_new_project_becomes_one_package() {
    let folder = new_project();
    let made = mauve(MAUVE, &folder, &["generate", "robot"]);
    assert_eq!((made.code, made.err.as_str()), (0, ""));
    assert!(made.out.contains("1 package in robot/generated: "), "{}", made.out);
    assert!(folder.join("robot/generated/robot/scripts/Onboard.lua").exists());
    // The generated files do not change what is analysed.
    assert_eq!(mauve(MAUVE, &folder, &["check", "robot"]).code, 0);
    assert_eq!(mauve(MAUVE, &folder, &["generate", "robot", "--check"]).code, 0);
}

#[test]
fn psm_without_a_component_lists_them() {
    let folder = new_project();
    let expected = "  component  states  edges  execution time in ms\n\
                    \u{20} Laser           1      1                    12\n\
                    \u{20} Pilot           2      4                    31\n";
    let found = mauve(MAUVE, &folder, &["psm", "robot"]);
    assert_eq!((found.out.as_str(), found.code), (expected, 0), "{}", found.err);
    assert_eq!(mauve(MAUVE, &folder.join("robot"), &["psm"]).out, expected);
    let found = mauve(MAUVE, &folder, &["psm", "robot", "--format", "json"]);
    let document: Value = serde_json::from_str(&found.out).unwrap();
    assert_eq!(document["components"][1]["component"], "Pilot");
    let found = mauve(MAUVE, &folder, &["psm", "robot", "Pilott"]);
    assert_eq!(
        (found.code, found.err.trim_end()),
        (2, "mauve: no component `Pilott`; did you mean `Pilot`?")
    );
    let found = mauve(MAUVE, &folder.join("robot"), &["psm", "Pilot"]);
    assert!(found.out.starts_with("digraph \"Pilot\""), "{}", found.out);
}

#[test]
fn psm_draws_the_only_component() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let model = "codel work(): int\nshell S { }\ncore K(S) { update = { work(); } }\ncomponent Only(S, K)\n";
    write(&folder, &[("robot.mal", model), ("mauve.toml", "assume.codel = \"5 ms\"\n")]);
    assert!(mauve(MAUVE, &folder, &["psm"]).out.starts_with("digraph \"Only\""));
    // Without a time, the component is listed with the reason.
    write(
        &folder,
        &[
            (
                "two.mal",
                "codel rest(): int\nshell T { }\ncore L(T) { update = { rest(); } }\ncomponent Two(T, L)\n",
            ),
            ("mauve.toml", ""),
        ],
    );
    let found = mauve(MAUVE, &folder, &["psm"]);
    assert_eq!(found.code, 0);
    assert!(found.out.contains("  Only            —      —                     —\n"), "{}", found.out);
    assert!(found.out.contains("\n  Two: "), "{}", found.out);
}

#[test]
fn explain_all_has_one_line_per_code() {
    let list = mauve(MAUVE, &scratch(env!("CARGO_TARGET_TMPDIR"), &test_name()), &["explain", "all"]).out;
    assert!(list.lines().all(|line| line.chars().count() <= 120), "{list}");
    let line = list.lines().find(|line| line.starts_with("missing-activity ")).unwrap();
    assert!(
        line.contains("  error    Every instance of the deployed architecture needs an activity"),
        "{line}"
    );
}

/// Two projects in a folder have a component of the same name.
#[test]
fn a_component_of_several_projects_is_chosen_with_its_path() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    for project in ["one", "two"] {
        let made = mauve(MAUVE, &folder, &["new", project]);
        assert_eq!(made.code, 0, "{}", made.err);
    }
    let of = |arguments: &[&str]| mauve(MAUVE, &folder, arguments);
    let list = of(&["psm"]);
    for project in ["one/", "two/"] {
        assert!(list.out.contains(&folder.join(project).display().to_string()), "{}", list.out);
    }
    let document: Value = serde_json::from_str(&of(&["psm", "--format", "json"]).out).unwrap();
    let names = document["components"].as_array().unwrap().iter().map(|it| it["component"].as_str().unwrap());
    assert!(
        names.clone().any(|name| name.ends_with("Pilot")) && names.clone().all(|name| !name.contains('/'))
    );
    let several = of(&["psm", "Pilot"]);
    assert!(
        several.code == 2 && several.err.contains("several components are called `Pilot`"),
        "{several:?}"
    );
    assert_eq!(of(&["psm", "one", "Pilot"]).code, 0);
}
