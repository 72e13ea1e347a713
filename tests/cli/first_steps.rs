//! The first commands of a new user: `mauve new`, `psm` without a component, `explain all`.

use std::path::PathBuf;

use mauve_tests::{mauve, scratch, test_name};
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
