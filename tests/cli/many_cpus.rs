//! Computers with several CPUs that each activity may use, up to 128.

use std::fmt::Write as _;

use serde_json::Value;

use super::command_line::run_in;

/// Returns a project with activities of these fields, execution times in ms and CPUs.
fn project(activities: &[(&str, u32)], cpus: u32) -> [(&'static str, String); 3] {
    let (mut declarations, mut instances, mut deployed) = (String::new(), String::new(), String::new());
    let config =
        format!("timing.tables = [\"times.toml\"]\nplatform = {{ cpus = {cpus}, rt_throttling = false }}\n");
    let mut times = "unit = \"ms\"\n[codel]\n".to_owned();
    for (number, (fields, time)) in activities.iter().enumerate() {
        let _ = writeln!(declarations, "codel work{number}(): int");
        let _ = writeln!(declarations, "core K{number}(S) {{ update = {{ work{number}(); }} }}");
        let _ = writeln!(declarations, "component C{number}(S, K{number})");
        let _ = writeln!(instances, "  instance a{number}: C{number}");
        let _ = writeln!(deployed, "  activity a{number} {{ {fields} }}");
        let _ = writeln!(times, "work{number} = {time}");
    }
    let model = format!(
        "shell S {{ }}\n{declarations}architecture A {{\n{instances}}}\ndeployment D {{\n  architecture A\n{deployed}}}\n"
    );
    [("robot.mal", model), ("mauve.toml", config), ("times.toml", times)]
}

fn run(name: &str, activities: &[(&str, u32)], cpus: u32, arguments: &[&str]) -> mauve_tests::Run {
    let project = project(activities, cpus);
    run_in(name, &project.each_ref().map(|(path, text)| (*path, text.as_str())), arguments)
}

fn activities(out: &str) -> Vec<Value> {
    let document: Value = serde_json::from_str(out).unwrap();
    document["results"][0]["activities"].as_array().unwrap().clone()
}

#[test]
fn two_activities_on_two_cpus_do_not_delay_each_other() {
    let two = [("priority = 50  period = 10", 6), ("priority = 49  period = 10  affinity = 0", 6)];
    let found = run("two", &two, 2, &["wcrt", "--format", "json"]);
    let found: Vec<_> = activities(&found.out).iter().map(|it| it["response"].as_f64()).collect();
    assert_eq!(found, [Some(6.0), Some(6.0)]);
}

#[test]
fn what_delays_an_activity_on_all_cpus() {
    let four = [
        ("priority = 50  period = 4  affinity = 3", 1),
        ("priority = 49  period = 5  affinity = 3", 1),
        ("priority = 48  period = 9  affinity = 3", 3),
        ("priority = 47  period = 18  affinity = 3", 9),
    ];
    let found = run("four", &four, 2, &["wcrt", "--format", "json"]);
    let all = activities(&found.out);
    let responses: Vec<_> = all.iter().map(|it| it["response"].as_f64().unwrap()).collect();
    assert_eq!(responses, [1.0, 1.0, 4.0, 14.5]);
    assert_eq!(all[3]["waits_for_all_cpus"], true);
    let parts = all[3]["interference"].as_array().unwrap().iter();
    let sum: f64 = parts.map(|it| it["time"].as_f64().unwrap()).sum();
    assert_eq!(9.0 + sum / 2.0, 14.5);
    let explained = run("explained", &four, 2, &["wcrt", "--explain", "a3"]).out;
    for part in [
        "on CPUs 1 and 2: it waits only while each of them executes an activity of higher or equal priority",
        "on several CPUs at once                        −5.5 ms\n",
    ] {
        assert!(explained.contains(part), "{explained}");
    }
    let worst = run("worst", &four, 2, &["simulate", "--worst", "a3"]);
    assert_eq!(worst.code, 0, "{}{}", worst.out, worst.err);
}

#[test]
fn ninety_six_cpus() {
    let all = format!("priority = 3  period = 10  affinity = {:#x}", u128::MAX >> 32);
    let last = format!("priority = 2  period = 20  affinity = {}", 1_u128 << 95);
    let activities_of = [(all.as_str(), 4), (last.as_str(), 5), ("priority = 1  period = 10", 6)];
    let found = run("wcrt", &activities_of, 96, &["wcrt"]);
    assert_eq!(found.code, 0, "{}{}", found.out, found.err);
    assert!(found.out.contains("CPUs 1 to 96"), "{}", found.out);
    let json = run("json", &activities_of, 96, &["wcrt", "--format", "json"]);
    let json = activities(&json.out);
    let responses: Vec<_> = json.iter().map(|it| it["response"].as_f64().unwrap()).collect();
    assert_eq!(responses, [4.0, 9.0, 6.0]);
    assert_eq!(json[1]["affinity"], "0x800000000000000000000000");
    let simulated = run("simulate", &activities_of, 96, &["simulate", "--format", "svg"]);
    assert_eq!(simulated.code, 0, "{}{}", simulated.out, simulated.err);
    let beyond = run("beyond", &[("priority = 1  period = 10  affinity = 8", 1)], 2, &["check"]);
    assert!(beyond.out.contains("affinity names CPU 4, and mauve.toml has CPUs 1 and 2"), "{}", beyond.out);
}
