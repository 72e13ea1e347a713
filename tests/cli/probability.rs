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
        "p3dx_driver      3.6e-5    2.1e-9  comonotone     1e-9",
        "hokuyo           1.5e-4    4.1e-9  independent    1e-8",
        "navigation       2.9e-4    8.1e-8  independent    1e-4",
        "gmapping         7.2e-4    2.1e-7  comonotone     1e-7",
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
    let distribution = of("hokuyo")["distribution"].as_array().unwrap();
    assert!((8..=12).contains(&distribution.len()), "{distribution:?}");
    let at = distribution.iter().find(|it| it["response_ms"] == 100.0).unwrap();
    assert_eq!(
        (&at["per_hour"], &at["per_job"]),
        (&of("hokuyo")["miss_per_hour"], &of("hokuyo")["miss_per_job"])
    );
    let hours = distribution.iter().map(|it| it["per_hour"].as_f64().unwrap());
    assert!(hours.is_sorted_by(|one, next| one >= next), "{distribution:?}");
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
        ">a job that responds later, in an hour<",
        ">one job, and the one before it ended within its period<",
        ">a job that responds later, in an hour, by the levels of the tables alone<",
        "70 ms at 1e-4",
        "data-level=\"0\"",
    ] {
        assert!(found.out.contains(part), "{part} in {}", found.out);
    }
    assert!(!found.out.contains("observed"), "{}", found.out);
    let found = run(&["wcrt", "p3dx", "--format", "svg"]);
    assert_eq!((found.code, found.err.as_str()), (2, "mauve: --format svg needs --probability\n"));
    let found = run(&["wcrt", "p3dx", "--probability=pilot", "--format", "svg"]);
    assert!(found.code == 2 && found.err.contains("no activity has a probability"), "{}", found.err);
    let csv = run(&["wcrt", "p3dx", "--probability=hokuyo", "--format", "csv"]).out;
    assert!(csv.lines().count() == 2 && csv.contains("\nP3dxDeployment,hokuyo,1.4"), "{csv}");
}

/// From a recording with releases to the drawing: of 200 jobs, two respond in 8 ms, the others in 4.
#[test]
fn observed_response_times_are_drawn() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "probability_observed");
    let model = "codel plan(): int\nshell S { }\ncore C(S) { update = { plan(); } }\ncomponent Pilot(S, C)\n\
                 architecture A { instance pilot: Pilot }\n\
                 deployment D { architecture A activity pilot { priority = 1 period = 10 affinity = 1 } }\n";
    let job = |number: u64| {
        let (begin, time) = (number * 10_000_000, if number % 100 == 7 { 8_000_000 } else { 4_000_000 });
        let end = begin + time;
        (format!("plan,{time},pilot,{time},{end},0\n"), format!("pilot,{begin},{begin},{end},{time}\n"))
    };
    let (executions, periods): (Vec<String>, Vec<String>) = (1..=200).map(job).unzip();
    let executions = format!("codel,execution_ns,instance,elapsed_ns,time_ns,waits\n{}", executions.concat());
    let periods = format!("instance,release_ns,begin_ns,end_ns,execution_ns\n{}", periods.concat());
    mauve_tests::write(
        &folder,
        &[
            ("m.mal", model),
            ("mauve.toml", "timing.tables = [\"t.toml\"]\ntiming.observed = [\"robot.observed.toml\"]\n"),
            ("t.toml", "levels = [1e-3, 1e-4, 1e-6]\ncodel.plan = [5, 8.5, 12]\n"),
            ("rec/executions.csv", &executions),
            ("rec/periods.csv", &periods),
        ],
    );
    let run = mauve(MAUVE, &folder, &["trace", "import", "rec", "-o", "robot.samples"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""), "{}", run.out);
    let observed = std::fs::read_to_string(folder.join("robot.observed.toml")).unwrap();
    let expected = "[response.pilot]\nexecutions = 200\ngreatest = 8\nlater = [";
    assert!(observed.contains(expected), "{observed}");
    let drawing = mauve(MAUVE, &folder, &["wcrt", "--probability", "--format", "svg"]);
    assert_eq!((drawing.code, drawing.err.as_str()), (0, ""));
    for part in [">observed: at most this share of 200 jobs<", "<path class=\"seen\" d=\"M92 56H"] {
        assert!(drawing.out.contains(part), "{part} in {}", drawing.out);
    }
}
