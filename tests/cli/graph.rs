//! `mauve graph`.

use std::fmt::Write as _;

use mauve_tests::{Run, mauve, models};
use serde_json::Value;

use super::command_line::run_in;
use crate::MAUVE;

fn graph(arguments: &[&str]) -> Run {
    mauve(MAUVE, &models(), &[&["graph"], arguments].concat())
}

#[test]
fn the_robot_in_all_forms() {
    let text = graph(&["p3dx"]);
    assert_eq!(text.code, 0, "{}", text.err);
    assert!(text.out.starts_with("P3dxDeployment at 1e-4: "), "{}", text.out);
    assert!(text.out.contains("│ ! 997 / 1000 ms · 29.4 %"), "{}", text.out);
    let svg = graph(&["p3dx", "--format", "svg"]).out;
    assert!(svg.starts_with("<svg ") && svg.contains("prefers-color-scheme: dark"), "{svg}");
    assert!(graph(&["p3dx", "--format", "dot"]).out.starts_with("digraph "));
    let json: Value = serde_json::from_str(&graph(&["p3dx", "--format", "json"]).out).unwrap();
    let nodes = json["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), 10);
    let navigation = nodes.iter().find(|node| node["instance"] == "navigation").unwrap();
    assert_eq!((&navigation["response"], &navigation["priority"]), (&997.into(), &2.into()));
    assert!(
        navigation["place"].as_str().unwrap().starts_with("navigation_architecture.mal:"),
        "{navigation}"
    );
    assert!(navigation.get("location").is_none());
    // The figures are those of the analysis.
    let wcrt = mauve(MAUVE, &models(), &["wcrt", "p3dx", "--format", "json"]).out;
    let wcrt: Value = serde_json::from_str(&wcrt).unwrap();
    for activity in wcrt["results"][0]["activities"].as_array().unwrap() {
        let node = nodes.iter().find(|node| node["instance"] == activity["instance"]).unwrap();
        assert_eq!((&node["response"], &node["status"]), (&activity["response"], &activity["status"]));
    }
}

/// `tests/pictures/make` makes them.
#[test]
fn the_pictures_of_the_documents_are_current() {
    for (picture, arguments) in [
        ("architecture", &["graph", "p3dx"][..]),
        ("state_machine", &["psm", "p3dx", "Navigation"]),
        ("schedule", &["simulate", "p3dx", "--worst", "navigation"]),
    ] {
        let drawn = mauve(MAUVE, &models(), &[arguments, &["--format", "svg"]].concat()).out;
        let path = models().join(format!("../pictures/{picture}.svg"));
        let kept = std::fs::read_to_string(&path).unwrap();
        assert!(drawn == kept, "{} is not what `mauve {}` draws", path.display(), arguments.join(" "));
    }
}

#[test]
fn the_budget_of_each_cpu() {
    let text = graph(&["p3dx", "--cpus"]);
    assert_eq!(text.code, 0, "{}", text.err);
    assert!(text.out.contains("! CPU 1: 99.4 % used, 0.6 % left\n  hokuyo        43.0 %  █"), "{}", text.out);
    assert!(text.out.contains("✓ CPU 2: 78.9 % used, 21.1 % left\n"), "{}", text.out);
    let svg = graph(&["p3dx", "--cpus", "--format", "svg"]).out;
    assert!(svg.starts_with("<svg ") && svg.contains("<title>hokuyo: 43.0 % ✓ 53 / 100 ms</title>"), "{svg}");
    let json: Value = serde_json::from_str(&graph(&["p3dx", "--cpus", "--format", "json"]).out).unwrap();
    for cpu in json["cpus"].as_array().unwrap() {
        let shares = cpu["parts"].as_array().unwrap().iter().map(|part| part["share"].as_f64().unwrap());
        assert!((shares.sum::<f64>() - cpu["utilisation"].as_f64().unwrap()).abs() < 1e-9, "{cpu}");
    }
    assert_eq!(graph(&["p3dx", "--cpus", "--format", "dot"]).code, 2);
    assert_eq!(graph(&["p3dx", "--cpus", "--architecture", "A"]).code, 2);
}

#[test]
fn an_architecture_has_no_times() {
    let found = graph(&["p3dx", "--architecture", "ExplorationP3dxArchitecture"]);
    assert_eq!(found.code, 0, "{}", found.err);
    assert!(
        found.out.starts_with("ExplorationP3dxArchitecture\n") && !found.out.contains('✓'),
        "{}",
        found.out
    );
    let level = graph(&["p3dx", "--significance", "1e-6"]);
    assert!(level.out.starts_with("P3dxDeployment at 1e-6: "), "{}", level.out);
}

#[test]
fn what_cannot_be_shown_is_refused() {
    for (arguments, message) in [
        (&["p3dx", "--deployment", "Sea"][..], "no deployment `Sea`: there is exploration.P3dxDeployment"),
        (&["p3dx", "--architecture", "Sea"], "no architecture `Sea`: there is "),
        (&["p3dx", "--significance", "2"], "expected a number between 0 and 1"),
        (&["p3dx", "--architecture", "A", "--deployment", "B"], "cannot be used with"),
        (&["missing"], "missing"),
    ] {
        let found = graph(arguments);
        assert!(found.code == 2 && found.err.contains(message), "{arguments:?}: {}", found.err);
        assert_eq!(found.out, "", "{arguments:?}");
    }
    let none = run_in("none", &[("a.mal", "codel f(): int\n")], &["graph"]);
    assert!(
        none.code == 2 && none.err.contains("no deployment and no architecture in these models"),
        "{}",
        none.err
    );
    let several = [("a.mal", "architecture A { }\narchitecture B { }\n")];
    let found = run_in("several", &several, &["graph"]);
    assert!(found.code == 2 && found.err.contains("choose one with --architecture: A, B"), "{}", found.err);
    // What is unknown is said, and is not left out silently.
    let broken = [("a.mal", "architecture A { instance x: Missing  connection x.a -> y.b }\n")];
    let found = run_in("broken", &broken, &["graph"]);
    assert!(found.code == 1 && found.err.contains("error"), "{}", found.err);
    assert!(found.out.contains("│ x: Missing │"), "{}", found.out);
}

/// Each state has a way on, a way back to the first state, and one to a state far away: 10,000 transitions.
fn many_transitions(states: usize) -> String {
    let mut text = "codel f(): int\nshell S { }\ncore C(S) { statemachine {\n".to_owned();
    for state in 0..states {
        let initial = if state == 0 { "initial " } else { "" };
        let targets = [(state + 1) % states, 0, (state * 37 + 11) % states];
        let _ = write!(text, "{initial}state s{state} {{ run = {{ f(); }}");
        for (index, target) in targets.into_iter().enumerate() {
            let _ = write!(text, " transition t{index} if (f() > {index}) to s{target}");
        }
        text += " }\n";
    }
    text + "} }\ncomponent K(S, C)\n"
}

/// Each instance is connected with two others.
fn many_connections(instances: usize) -> String {
    let mut text = "shell S { input port a: int  input port c: int  output port b: int }\ncodel f(): void\n\
                    core C(S) { update = { f(); } }\ncomponent K(S, C)\narchitecture A {\n"
        .to_owned();
    for instance in 0..instances {
        let _ = writeln!(text, "  instance i{instance}: K");
    }
    for instance in 1..instances {
        let _ = writeln!(text, "  connection i{}.b -> i{instance}.a", instance - 1);
        let _ = writeln!(text, "  connection i{}.b -> i{instance}.c", (instance * 37 + 11) % instances);
    }
    text + "}\n"
}

/// What is too large for a picture says so in the picture, with its size and what to do instead; before, it took minutes.
#[test]
fn a_drawing_that_no_one_can_read_says_so() {
    let (machine, graph) = (many_transitions(3_400), many_connections(5_000));
    let files = [
        ("machine.mal", machine.as_str()),
        ("graph.mal", &graph),
        ("mauve.toml", "[assume]\ncodel = \"0.001 ms\"\n"),
    ];
    let all = [
        ("psm", "machine.mal", "3400 states and "),
        ("graph", "graph.mal", "5000 instances and 9998 connections"),
    ];
    for (command, path, size) in all {
        for format in ["svg", "text"] {
            let run = run_in("large", &files, &[command, path, "--format", format]);
            assert_eq!(run.code, 0, "{}", run.err);
            assert!(run.out.contains(&format!("too large to draw: {size}")), "{}", run.out);
            assert!(run.out.contains(&format!("`mauve {command} --format dot`")), "{}", run.out);
            assert!(run.out.len() < 10_000, "{} bytes", run.out.len());
        }
        let dot = run_in("large", &files, &[command, path, "--format", "dot"]);
        assert!(dot.out.starts_with("digraph ") && dot.out.lines().count() > 10_000, "{}", dot.err);
    }
}
