//! `mauve wcrt --probability`, and the level that `required` chooses.

use mauve_tests::{Run, mauve, models};
use serde_json::Value;

use crate::MAUVE;

fn run(arguments: &[&str]) -> Run {
    mauve(MAUVE, &models(), arguments)
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&run(arguments).out).unwrap()
}

#[test]
fn the_sample_is_late_at_most_as_probably_as_its_levels_say() {
    let found = run(&["wcrt", "p3dx", "--probability"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""));
    // 36,000 executions an hour of `aria_loop` at 1e-9; and two codels each second at 1e-7.
    for row in [
        "p3dx_driver      3.6e-5         —  comonotone     1e-9",
        "hokuyo           1.5e-4    4.1e-9  independent    1e-8",
        "navigation       2.9e-4    8.1e-8  independent    1e-4",
        "gmapping         7.2e-4         —  comonotone     1e-7",
    ] {
        assert!(found.out.contains(row), "{row} in {}", found.out);
    }
    let document = json(&["wcrt", "p3dx", "--probability", "--format", "json"]);
    assert_eq!(document["support"]["words"], "at 1e-4, about 16 executions an hour may exceed their times");
    let activities = document["results"][0]["activities"].as_array().unwrap();
    let of = |name: &str| &activities.iter().find(|it| it["instance"] == name).unwrap()["probability"];
    assert_eq!((of("hokuyo")["rule"].as_str(), of("exploration")), (Some("independent"), &Value::Null));
    let hour = of("hokuyo")["miss_per_hour"].as_f64().unwrap();
    // 72,000 executions may take any time with 1e-9; with 1e-8, the deadline is still met.
    assert!((72_000.0 * 1e-9..72_000.0 * 1e-8).contains(&hour), "{hour}");
    assert_eq!(of("hokuyo")["conditions"][0], "the hour begins without unfinished jobs");
    // Without the option, no probability is computed.
    let document = json(&["wcrt", "p3dx", "--format", "json"]);
    assert!(document["results"][0]["activities"][0].get("probability").is_none());
    assert_eq!(document["support"]["level"], 1e-4);
}

#[test]
fn the_curve_has_the_levels_and_the_deadline() {
    let found = run(&["wcrt", "p3dx", "--probability=teleop", "--format", "svg"]);
    assert_eq!(found.code, 0, "{}", found.err);
    for part in [
        "teleop of P3dxDeployment: late at most 9.4e-4 times an hour",
        ">deadline<",
        "70 ms at 1e-4",
        "data-level=\"0\"",
    ] {
        assert!(found.out.contains(part), "{part} in {}", found.out);
    }
    let found = run(&["wcrt", "p3dx", "--format", "svg"]);
    assert_eq!((found.code, found.err.as_str()), (2, "mauve: --format svg needs --probability\n"));
    let found = run(&["wcrt", "p3dx", "--probability=pilot", "--format", "svg"]);
    assert!(found.code == 2 && found.err.contains("no activity has a probability"), "{}", found.err);
    let csv = run(&["wcrt", "p3dx", "--probability=hokuyo", "--format", "csv"]).out;
    assert!(csv.lines().count() == 2 && csv.contains("\nP3dxDeployment,hokuyo,1.4"), "{csv}");
}
