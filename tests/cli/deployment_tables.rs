//! Deployments with their own timing tables: `[timing.deployment.NAME]`.

use std::path::Path;

use mauve_tests::{Run, mauve, scratch, test_name, write};
use serde_json::{Value, json};

use crate::MAUVE;

/// Two deployments of one robot, on two computers.
const ROBOT: &str = "library land {
  codel work(): int
  shell S { }
  core K(S) { update = { work(); } }
  component C(S, K)
  architecture A { instance arm: C }
  deployment Land { architecture A  activity arm { priority = 1  period = 10 } }
}
library marine {
  use land
  deployment Sea { architecture A  activity arm { priority = 1  period = 10 } }
}
";

const CONFIG: &str = "[platform]\nrt_throttling = false\n[timing]\ntables = [\"land.toml\"]\n";

const SEA: &str = "[timing.deployment.Sea]\ntables = [\"sea/*.toml\"]\n";

const LAND_TIMES: &str = "[codel]\n\"land.work\" = 2\n";
const SEA_TIMES: &str = "[codel]\n\"land.work\" = 11\n[overhead]\ndispatch = 0.5\n";

fn run(name: &str, config: &str, arguments: &[&str]) -> Run {
    run_with(name, ROBOT, config, SEA_TIMES, arguments)
}

fn run_with(name: &str, robot: &str, config: &str, sea: &str, arguments: &[&str]) -> Run {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let files = [("robot.mal", robot), ("mauve.toml", config), ("land.toml", LAND_TIMES)];
    write(&folder, &files);
    if !sea.is_empty() {
        std::fs::create_dir_all(folder.join("sea")).unwrap();
        write(&folder, &[("sea/arm.toml", sea)]);
    }
    mauve(MAUVE, &folder, arguments)
}

/// Returns the name of each deployment with its tables and the response time of its activity.
fn responses(run: &Run) -> Vec<(Value, Value, Value)> {
    let found: Value = serde_json::from_str(&run.out).unwrap_or_else(|_| panic!("{run:?}"));
    let of = |it: &Value| {
        let activity = &it["results"][0]["activities"][0];
        (it["deployment"].clone(), it["times"].clone(), activity["response"].clone())
    };
    found.as_array().unwrap().iter().map(of).collect()
}

const JSON: [&str; 3] = ["wcrt", "--format", "json"];

#[test]
fn each_deployment_has_the_times_of_its_tables() {
    let both = format!("{CONFIG}{SEA}");
    let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), json!("Sea"), Value::Null)];
    assert_eq!(responses(&run("both", &both, &JSON)), expected);
    let shorter = SEA_TIMES.replace("11", "7");
    let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), json!("Sea"), json!(7.5))];
    assert_eq!(responses(&run_with("shorter", ROBOT, &both, &shorter, &JSON)), expected);
    // By the qualified name, which comes first.
    let qualified = format!("{CONFIG}{}", SEA.replace("Sea", "\"marine.Sea\""));
    let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), json!("marine.Sea"), json!(7.5))];
    assert_eq!(responses(&run_with("qualified", ROBOT, &qualified, &shorter, &JSON)), expected);
    // Without the section.
    let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), Value::Null, json!(2))];
    assert_eq!(responses(&run("neither", CONFIG, &JSON)), expected);
}

#[test]
fn every_report_names_the_tables() {
    let both = format!("{CONFIG}{SEA}");
    let line = |number: usize, arguments: &[&str]| {
        let out = run(&arguments.join("-"), &both, arguments).out;
        out.lines().nth(number).unwrap_or_default().to_owned()
    };
    let heading = |arguments: &[&str]| line(0, arguments);
    assert_eq!(
        heading(&["wcrt", "--deployment", "Sea"]),
        "Sea: response times in ms at 1e-4, method best, times of Sea"
    );
    assert_eq!(heading(&["wcrt", "--deployment", "Land"]), "Land: response times in ms at 1e-4, method best");
    let explained = line(0, &["wcrt", "--deployment", "Sea", "--explain", "arm"]);
    assert!(explained.starts_with("arm: ") && explained.ends_with(", times of Sea"), "{explained}");
    let csv = run("csv", &both, &["wcrt", "--format", "csv"]).out;
    assert!(csv.lines().nth(2).is_some_and(|line| line.contains("times of Sea")), "{csv}");
    let simulated = heading(&["simulate", "--deployment", "Sea", "--for", "100ms"]);
    assert!(simulated.ends_with(", times of Sea"), "{simulated}");
    let machine = run("psm", &both, &["psm", "C"]);
    assert!(machine.out.contains("C at 1e-4: execution times"), "{machine:?}");
    assert!(machine.err.contains("`C` has other timing tables in marine.Sea: "), "{machine:?}");
    let machine = run("psm-of-sea", &both, &["psm", "C", "--deployment", "Sea"]);
    assert!(machine.out.contains("C at 1e-4, times of Sea: execution times"), "{machine:?}");
    let list = ROBOT.replacen("component C", "component B(S, K)\n  component C", 1);
    let list = run_with("list", &list, &both, SEA_TIMES, &["psm", "--deployment", "Sea"]);
    assert!(list.out.contains("C, times of Sea"), "{list:?}");
    let found = run("check", &both, &["check"]);
    assert!(found.out.contains("Sea: response times in ms at 1e-4, method best, times of Sea"), "{found:?}");
}

#[test]
fn a_host_has_the_times_of_its_tables() {
    let robot = ROBOT.replace("instance arm: C", "instance arm: C  instance leg: C").replace(
        "deployment Land { architecture A ",
        "deployment Land { architecture A  activity leg { priority = 1  period = 20  cpus = [2] } ",
    );
    let robot = robot.split("library marine").next().unwrap();
    let hosts = "[host.body]\nactivities = [\"arm\"]\ncpus = 1\n[host.feet]\nactivities = [\"leg\"]\ncpus = 2\ntables = [\"sea/*.toml\"]\n";
    let run = |name: &str, arguments: &[&str]| {
        run_with(name, robot, &format!("{CONFIG}{hosts}"), SEA_TIMES, arguments)
    };
    let machine = run("psm", &["psm", "C", "--deployment", "Land"]);
    assert!(machine.out.contains("C at 1e-4: execution times"), "{machine:?}");
    let option = "`C` has other timing tables in land.Land on host feet: `--deployment land.Land --host feet` shows them";
    assert!(machine.err.contains(option), "{machine:?}");
    let of_feet = run("psm-of-feet", &["psm", "C", "--deployment", "land.Land", "--host", "feet"]);
    assert!(of_feet.out.contains("C at 1e-4, times of host feet: execution times"), "{of_feet:?}");
    assert!(of_feet.err.contains("`--deployment land.Land --host body`"), "{of_feet:?}");
    let wrong = run("psm-of-foot", &["psm", "C", "--deployment", "Land", "--host", "feets"]);
    assert!(wrong.code == 2 && wrong.err.contains("did you mean `feet`?"), "{wrong:?}");
    // The CPUs are those of the host: a bit each.
    let csv = run("csv", &["wcrt", "--format", "csv"]).out;
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|it| *it == name).unwrap();
    let mut found: Vec<[&str; 4]> = rows[1..]
        .iter()
        .map(|row| ["instance", "affinity", "response_ms", "host"].map(|name| row[column(name)]))
        .collect();
    found.sort_unstable();
    assert_eq!(found, [["arm", "1", "2", "body"], ["leg", "2", "11.5", "feet"]]);
}

#[test]
fn a_time_is_never_taken_from_other_tables() {
    // The general tables have the codel, and Sea's do not.
    let both = format!("{CONFIG}{SEA}");
    for (name, config, sea, message) in [
        (
            "other-codel",
            both.as_str(),
            "[overhead]\ndispatch = 1\n",
            "no execution times in the tables of Sea",
        ),
        ("no-tables", &format!("{CONFIG}[timing.deployment.Sea]\ntables = []\n"), "", "in the tables of Sea"),
        ("no-file", &both, "", "no file matches `sea/*.toml`"),
        ("broken", &both, "[codel\n", "not TOML"),
    ] {
        let found = responses(&run_with(name, ROBOT, config, sea, &JSON));
        let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), json!("Sea"), Value::Null)];
        assert_eq!(found, expected, "{name}");
        let checked = run_with(&format!("{name}-check"), ROBOT, config, sea, &["check"]);
        assert!(checked.code == 1 || name == "other-codel" || name == "no-tables", "{name}: {checked:?}");
        assert!(checked.out.contains(message), "{name}: {checked:?}");
    }
}

#[test]
fn a_section_whose_deployment_is_unclear_leaves_its_times_unknown() {
    let not_analysed = |name: &str, robot: &str, config: &str, message: &str, expected: [Option<i32>; 2]| {
        let found = run_with(name, robot, config, &SEA_TIMES.replace("11", "7"), &JSON);
        let found: Vec<Value> = responses(&found).into_iter().map(|(.., response)| response).collect();
        assert_eq!(found, expected.map(|it| json!(it)), "{name}");
        let checked = run_with(&format!("{name}-check"), robot, config, SEA_TIMES, &["check"]);
        assert!(checked.code == 1 && checked.out.contains(message), "{name}: {checked:?}");
    };
    // A misspelt name may be that of any deployment without a section.
    let misspelt = format!("{CONFIG}{}", SEA.replace("Sea", "Sae"));
    not_analysed("misspelt", ROBOT, &misspelt, "no deployment `Sae`; did you mean `Sea`?", [None, None]);
    let two = ROBOT.replace("Land", "Sea");
    let ambiguous = format!("{CONFIG}{SEA}");
    let message = "deployment `Sea` is ambiguous, `land.Sea` and `marine.Sea`: name each in a library with the library before it";
    not_analysed("ambiguous", &two, &ambiguous, message, [None, None]);
    let psm = run_with(
        "psm",
        &two,
        &format!("{CONFIG}{}", SEA.replace("Sea", "\"marine.Sea\"")),
        SEA_TIMES,
        &["psm", "C", "--deployment", "Sea"],
    );
    assert!(psm.err.contains("several deployments `Sea` have different timing tables"), "{psm:?}");
    // With one of them by its qualified name, the other one is clear.
    let clear = format!("{CONFIG}{SEA}[timing.deployment.\"land.Sea\"]\ntables = \"land.toml\"\n");
    let found = responses(&run_with("clear", &two, &clear, "[codel]\n\"land.work\" = 7\n", &JSON));
    let expected = [(json!("Sea"), json!("land.Sea"), json!(2)), (json!("Sea"), json!("Sea"), json!(7))];
    assert_eq!(found, expected);
    let second = format!("{CONFIG}{SEA}{}", SEA.replace("Sea", "\"marine.Sea\""));
    let message = "deployment `marine.Sea` has its timing tables in a section by its qualified name";
    let found = run_with("second", ROBOT, &second, SEA_TIMES, &["check"]);
    assert!(found.code == 1 && found.out.contains(message), "{found:?}");
    // Without the key, the tables of the deployment are unknown.
    let empty = format!("{CONFIG}[timing.deployment.Sea]\n");
    not_analysed("empty", ROBOT, &empty, "[timing.deployment.Sea] has no `tables`: add it", [None, None]);
}

#[test]
fn several_sections_may_name_one_table() {
    let shared = format!("{CONFIG}[timing.deployment.Sea]\ntables = \"l*.toml\"\n");
    let found = run("shared", &shared, &JSON);
    let expected = [(json!("Land"), Value::Null, json!(2)), (json!("Sea"), json!("Sea"), json!(2))];
    assert_eq!(responses(&found), expected);
    // Its errors are reported once.
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-errors", test_name()));
    let unknown = format!("{LAND_TIMES}\"land.werk\" = 1\n");
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", &shared), ("land.toml", &unknown)]);
    let found = mauve(MAUVE, &folder, &["check"]);
    assert_eq!(found.out.matches("no codel `land.werk`").count(), 1, "{}", found.out);
}

#[test]
fn a_component_has_the_tables_of_the_deployments_that_execute_it() {
    let robot = ROBOT.replace(
        "  use land\n",
        "  use land\n  codel dive(): int\n  core D(S) { update = { dive(); } }\n  component Diver(S, D)\n  \
         architecture B { instance arm: C  instance diver: Diver }\n",
    );
    let robot = robot.replace(
        "Sea { architecture A ",
        "Sea { architecture B  activity diver { priority = 2  period = 10 } ",
    );
    let sea = "[codel]\n\"land.work\" = 3\n\"marine.dive\" = 4\n";
    let config = format!("{CONFIG}{SEA}");
    let run = |name: &str, arguments: &[&str]| run_with(name, &robot, &config, sea, arguments);
    let machine = run("psm", &["psm", "Diver"]);
    assert!(machine.out.contains("Diver at 1e-4, times of Sea: ") && machine.err.is_empty(), "{machine:?}");
    let generated = run("generate", &["generate", "--out", "generated"]);
    assert_eq!(generated.code, 0, "{generated:?}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-generate", test_name()));
    let exported = |path: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(folder.join(path)).unwrap()).unwrap()
    };
    let diver = exported("generated/marine/models/Diver.psm.json");
    assert_eq!(diver["task"][0]["time"], 4_000_000, "{diver}");
    assert_eq!(diver["times"], "Sea");
    assert_eq!(exported("generated/land/models/C.psm.json")["times"], Value::Null);
    let sea = mauve(MAUVE, &folder, &["wcrt", "generated/marine/models/Sea.json"]).out;
    assert!(sea.starts_with("Sea: response times in ms at 1e-4, method best, times of Sea\n"), "{sea}");
}
