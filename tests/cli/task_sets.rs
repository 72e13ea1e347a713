//! Task sets in files: `mauve wcrt` says of one what it says of the model that it was made of.

use std::path::{Path, PathBuf};

use mauve_hir::{Database, Workspace, projects};
use mauve_tests::{Run, files_in, mauve, models, scratch, test_name, texts_in, write};
use serde_json::Value;

use crate::MAUVE;

fn run(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, arguments)
}

/// A folder of the test's own.
fn folder() -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &test_name())
}

/// The exported files of a project, by their paths below the folder of the packages.
fn exported(folder: &Path, texts: impl IntoIterator<Item = (PathBuf, String)>) -> Vec<(String, String)> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, folder.to_owned(), texts);
    let [project] = projects(&db, workspace)[..] else { panic!("one project") };
    let packages = mauve_orocos::packages(&db, project, None).unwrap_or_else(|why| panic!("{why:?}"));
    let files = packages.into_iter().flat_map(|package| {
        let models = package.files.into_iter().filter(|file| file.path.starts_with("models/"));
        models.map(move |file| (format!("{}/{}", package.name, file.path), file.text)).collect::<Vec<_>>()
    });
    files.collect()
}

/// The packages of the sample robot in a folder, and its task set in there.
fn robot() -> (PathBuf, String) {
    let folder = folder();
    let robot = models().join("p3dx");
    let files = exported(&robot, texts_in(&robot));
    write(&folder, &files);
    let mut sets = files.into_iter().map(|(path, _)| path).filter(|path| !path.ends_with(".psm.json"));
    let set = sets.next().unwrap();
    assert_eq!((set.rsplit('/').next(), sets.next()), (Some("P3dxDeployment.json"), None));
    (folder, set)
}

/// Its models are those of the other, and planning stands in an `entry`.
#[test]
fn its_variant_gives_the_same_document() {
    let (variant, folder) = (models().join("p3dx_entry"), folder());
    let texts = texts_in(&variant).into_iter().chain(texts_in(&models().join("p3dx")));
    let files = exported(&variant, texts);
    write(&folder, &files);
    let (set, _) = files.iter().find(|(path, _)| path.ends_with("Deployment.json")).unwrap();
    for method in ["psm", "classic", "ibf", "exact"] {
        let arguments = ["--format", "json", "--significance", "all", "--method", method];
        let of_model = run(&folder, &[&["wcrt", variant.to_str().unwrap()], &arguments[..]].concat());
        let of_file = run(&folder, &[&["wcrt", set.as_str()], &arguments[..]].concat());
        assert_eq!(document(&of_file), document(&of_model), "{method}");
    }
}

/// A document without what says where it comes from.
fn document(run: &Run) -> Value {
    let mut document: Value = serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"));
    assert!(document.as_object_mut().unwrap().remove("root").is_some());
    // A task set does not say how often codels are executed.
    document.as_object_mut().unwrap().remove("support");
    document
}

#[test]
fn the_sample_robot_gives_the_same_document() {
    let (folder, set) = robot();
    let model = models().join("p3dx");
    let model = model.to_str().unwrap();
    let mut codes = Vec::new();
    for arguments in [
        &["--format", "json"] as &[&str],
        &["--format", "json", "--significance", "all"],
        &["--format", "json", "--significance", "all", "--method", "classic"],
        &["--format", "json", "--significance", "1e-9,1e-3"],
        &["--format", "json", "--deployment", "P3dxDeployment", "--method", "classic"],
    ] {
        let of_model = run(&folder, &[&["wcrt", model], arguments].concat());
        let of_file = run(&folder, &[&["wcrt", set.as_str()], arguments].concat());
        assert_eq!(document(&of_file), document(&of_model), "{arguments:?}");
        assert_eq!((of_file.code, of_file.err.as_str()), (of_model.code, ""), "{arguments:?}");
        codes.push(of_file.code);
    }
    assert_eq!(codes, [0, 1, 1, 1, 1], "navigation is late at some level, and by the classic method");
    // For people and for tables, where a root is a column, and codels are below a task set.
    let without_support = |text: String| -> Vec<String> {
        text.lines()
            .filter(|line| {
                !line.contains(" may exceed its time") && !line.contains(" may exceed their times")
            })
            .map(str::to_owned)
            .collect()
    };
    let table = |of: &str| without_support(run(&folder, &["wcrt", of, "--significance", "all"]).out);
    assert_eq!(table(&set), table(model));
    let one = |of: &str| without_support(run(&folder, &["wcrt", of]).out);
    assert_eq!(one(&set), one(model));
    let csv = |of: &str| -> Vec<String> {
        let run = run(&folder, &["wcrt", of, "--format", "csv"]);
        let without_root = |line: &str| {
            let mut cells = line.rsplitn(4, ',');
            let [remark, host, _root] = [(); 3].map(|()| cells.next().unwrap());
            format!("{},{host},{remark}", cells.next().unwrap())
        };
        run.out.lines().map(without_root).collect()
    };
    assert_eq!(csv(&set), csv(model));
}

#[test]
fn it_is_explained_as_far_as_it_is_known() {
    let (folder, set) = robot();
    let model = models().join("p3dx");
    let explained =
        |of: &str| run(&folder, &["wcrt", of, "--explain", "navigation", "--significance", "1e-5"]);
    let (of_file, of_model) = (explained(&set), explained(model.to_str().unwrap()));
    assert_eq!(of_file.code, of_model.code);
    // Programs and codels are below the costliest period; the values of variables belong to the names of its states.
    let parts = |out: &str| out.split("\n\n").map(str::to_owned).collect::<Vec<String>>();
    let (of_file, of_model) = (parts(&of_file.out), parts(&of_model.out));
    let period = of_model.iter().position(|part| part.starts_with("costliest period: ")).unwrap();
    assert!(of_model[period + 1].starts_with("- Planning.run 297 ms: ") && of_file.len() > 3);
    let (edge, values) = of_model[period].split_once(" with ").unwrap();
    assert!(of_file[period].contains(&format!(" ({values}) ")), "{}", of_file[period]);
    assert_eq!(of_file[period].split(" —").map(without_values).collect::<Vec<_>>().join(" —"), edge);
    assert_eq!(of_file[..period], of_model[..period]);
    assert_eq!(of_file[period + 1..], of_model[period + 2..]);
    let unknown = run(&folder, &["wcrt", &set, "--explain", "navigatoin"]);
    assert_eq!(
        (unknown.code, unknown.err.as_str()),
        (2, "mauve: no instance `navigatoin`; did you mean `navigation`?\n")
    );
}

#[test]
fn a_reason_of_the_deployment_has_nothing_to_do_with_its_first_activity() {
    let (folder, set) = robot();
    let path = folder.join(&set);
    let mut document: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    document["not_analysed"] = serde_json::json!(["a table is missing"]);
    document["task"][0]["not_analysed"] = serde_json::json!([{ "reason": "no scanner" }]);
    let first = document["task"][0]["name"].as_str().unwrap().to_owned();
    std::fs::write(&path, document.to_string()).unwrap();
    let of = |instance: &str| run(&folder, &["wcrt", &set, "--explain", instance]).out;
    assert!(of("navigation").contains("Not analysed: a table is missing\n"));
    assert!(!of("navigation").contains("no scanner"));
    assert!(of(&first).contains("Not analysed: no scanner\n"));
}

#[test]
fn several_files_and_what_goes_with_none() {
    let (folder, set) = robot();
    let shown = run(&folder, &["wcrt", &set, &set, "--format", "json"]);
    let both: Value = serde_json::from_str(&shown.out).unwrap();
    assert_eq!(both.as_array().map(Vec::len), Some(2));
    assert!(both[0]["root"].as_str().unwrap().ends_with("/models/P3dxDeployment.json"));
    let says = |arguments: &[&str], code: i32, expected: &str| {
        let run = run(&folder, &[&["wcrt"], arguments].concat());
        assert_eq!((run.code, run.out.as_str()), (code, ""), "{arguments:?}");
        assert!(run.err.contains(expected), "{arguments:?}: {}", run.err);
    };
    let model = models().join("p3dx");
    says(&[&set, model.to_str().unwrap()], 2, "one after the other");
    says(&[&set, "--significance", "1e-2"], 2, "no times at 1e-2: the file has 1e-3, 1e-4,");
    says(&[&set, "--deployment", "Other"], 2, "no deployment `Other` in these files");
    says(&["nowhere.json"], 2, "cannot read `nowhere.json`");
    std::fs::create_dir(folder.join("folder.json")).unwrap();
    says(&["folder.json"], 2, "cannot read `folder.json`: this is not a file");
    // A component has no period.
    let machine = set.replace("P3dxDeployment.json", "Navigation.psm.json");
    let mut files = files_in(&folder).into_iter();
    let machines = files.find(|path| path.ends_with("Navigation.psm.json"));
    let machine = machines.map_or(machine, |path| path.display().to_string());
    let shown = run(&folder, &["wcrt", &machine]);
    assert!(shown.code == 1 && shown.out.contains("it has no period"), "{shown:?}");
    let text = std::fs::read_to_string(folder.join(&set)).unwrap();
    let earlier = r#"{ "format": "mauve-3", "unit": "ns", "deployment": {} }"#;
    write(
        &folder,
        &[
            ("torn.json", &text[..text.len() / 2]),
            ("other.json", "{}"),
            ("earlier.json", earlier),
            ("a.csv", "a,100,5,9\n"),
            ("empty.csv", "name,period,time,priority\n"),
        ],
    );
    says(&["torn.json"], 2, "`torn.json`: line ");
    says(&["other.json"], 2, "`other.json`: line 1: missing field `task`");
    says(&["earlier.json"], 2, "`mauve-3` is the format of an earlier version: generate the package again");
    says(
        &["a.csv"],
        2,
        "`a.csv`: no line with the names of the columns: expected `name,period,time,priority`",
    );
    says(
        &["empty.csv"],
        2,
        "`empty.csv`: line 1: no task below the names of the columns: write a line for each task",
    );
}

/// Who has no model writes three lines.
#[test]
fn a_table_of_tasks_in_each_notation() {
    let folder = folder();
    let csv = "unit,us\nname,period,time,priority\nlaser,100000,43000,20\nmap,200000,50500,10\n";
    let toml = "unit = \"us\"\ntask = [\n  { name = \"laser\", period = 100000, time = 43000, priority = 20 },\n  \
                { name = \"map\", period = 200000, time = 50500, priority = 10 },\n]\n";
    let json = "{ \"unit\": \"us\", \"task\": [\n  { \"name\": \"laser\", \"period\": 100000, \"time\": 43000, \"priority\": 20 },\n  \
                { \"name\": \"map\", \"period\": 200000, \"time\": 50500, \"priority\": 10 }\n] }\n";
    write(&folder, &[("robot.csv", csv), ("robot.toml", toml), ("robot.json", json)]);
    let shown = run(&folder, &["wcrt", "robot.csv"]);
    let expected = "robot: response times in ms at 1e-4, method best\n  \
         instance  CPU  priority  period  WCET  response / deadline\n  \
         laser       1        20     100    43  ✓ 43 / 100 ms        ▰▰▱▱▱▱  43 %\n  \
         map         1        10     200  50.5  ✓ 93.5 / 200 ms      ▰▰▱▱▱▱  47 %\n  \
         CPU 1 utilisation: 68.2 %\n  \
         assumption: real-time throttling is off, which Linux has on by default; set `rt_throttling` in the file\n";
    assert_eq!((shown.code, shown.out.as_str(), shown.err.as_str()), (0, expected, ""));
    for other in ["robot.toml", "robot.json"] {
        for arguments in
            [&["wcrt"] as &[&str], &["wcrt", "--format", "csv"], &["simulate"], &["wcrt", "--explain", "map"]]
        {
            let of = |file: &str| run(&folder, &[arguments, &[file]].concat()).out.replace(file, "FILE");
            assert_eq!(of(other), of("robot.csv"), "{arguments:?}");
        }
    }
    // A level is chosen where times have none.
    let at = run(&folder, &["wcrt", "robot.csv", "--significance", "1e-9,0.5"]);
    assert!(at.code == 0 && at.out.contains("93.5"), "{at:?}");
    write(
        &folder,
        &[("late.toml", &toml.replace("43000", "143000")), ("wrong.toml", &toml.replace("priority", "prio"))],
    );
    assert_eq!(run(&folder, &["wcrt", "late.toml"]).code, 1);
    let wrong = run(&folder, &["wcrt", "wrong.toml"]);
    assert_eq!(wrong.code, 2);
    assert!(wrong.err.contains("`wrong.toml`: line 3: unknown key `prio`"), "{}", wrong.err);
    let sensitivity = run(&folder, &["wcrt", "robot.csv", "--sensitivity"]);
    assert!(
        sensitivity.code == 2 && sensitivity.err.contains("--sensitivity needs a model"),
        "{sensitivity:?}"
    );
}

/// Many kernels call their highest priority 1.
#[test]
fn priorities_that_are_upside_down_have_a_hint() {
    let folder = folder();
    let set = |priorities: [u32; 3]| {
        let [a, b, c] = priorities;
        format!("name,period,time,priority\na,10,2,{a}\nb,20,4,{b}\nc,50,9,{c}\n")
    };
    write(
        &folder,
        &[
            ("down.csv", &set([1, 2, 3])),
            ("up.csv", &set([3, 2, 1])),
            ("mixed.csv", &set([1, 3, 2])),
            ("two.csv", "name,period,time,priority\na,10,2,1\nb,20,4,2\n"),
        ],
    );
    for (file, is_hinted) in [("down.csv", true), ("up.csv", false), ("mixed.csv", false), ("two.csv", false)]
    {
        let run = run(&folder, &["wcrt", file]);
        assert_eq!(run.out.contains("Here greater numbers are higher"), is_hinted, "{file}: {}", run.out);
    }
}

#[test]
fn nothing_in_them_tells_where_they_were_made() {
    let robot = models().join("p3dx");
    let files = exported(&robot, texts_in(&robot));
    assert_eq!(files, exported(&robot, texts_in(&robot)), "the same each time");
    assert_eq!(files.len(), 11, "ten components and a deployment");
    for (path, text) in files {
        assert!(text.ends_with("}\n"), "{path}");
        assert!(!text.contains(robot.to_str().unwrap()) && !text.contains('/'), "{path}");
    }
}

#[test]
fn what_is_not_analysed_stays_so() {
    let folder = folder();
    let model = "codel work(): int\ncodel plan(): int\nshell S { }\ncore K(S) { update = { work(); } }\n\
                 core L(S) { update = { plan(); } }\ncomponent C(S, K)\ncomponent P(S, L)\n\
                 architecture A { instance front: C  instance back: C  instance above: P }\n\
                 deployment D {\n  architecture A\n  activity above { priority = 3 period = 10 }\n  \
                 activity front { priority = 2 period = 10 deadline = 9 }\n  \
                 activity back { priority = 5 period = 10 deadline = 9 }\n}\n";
    let table = "levels = [1e-3, 1e-6]\n[codel]\nwork = [1, 2]\n[component]\nC = [4, 6]\n";
    let config = "[project]\nroot = \"robot.mal\"\n[timing]\ntables = \"times.toml\"\n[platform]\nrt_throttling = true\n";
    let texts = [("robot.mal", model), ("times.toml", table), ("mauve.toml", config)];
    write(&folder, &texts);
    write(&folder, &exported(&folder, texts.map(|(path, text)| (folder.join(path), text.to_owned()))));
    for method in ["psm", "classic", "ibf", "exact"] {
        let arguments = ["--format", "json", "--significance", "all", "--method", method];
        let of_model = run(&folder, &[&["wcrt", "robot.mal"], &arguments[..]].concat());
        let of_file = run(&folder, &[&["wcrt", "robot/models/D.json"], &arguments[..]].concat());
        let (of_file, of_model) = (document(&of_file), document(&of_model));
        assert_eq!(of_file, of_model);
        let statuses: Vec<&Value> =
            of_file["results"][0]["activities"].as_array().unwrap().iter().map(|it| &it["status"]).collect();
        assert_eq!(statuses, ["not-analysed", "not-analysed", "missed"], "throttling takes 50 ms");
        assert_eq!(of_file["rt_throttling"], true);
    }
}

/// `Planning` of `Planning (found = false)`, as the states of a file are called where the values of variables count.
fn without_values(state: &str) -> String {
    state.split(" (").next().unwrap().to_owned()
}

/// Removes what a document says of programs, which files of task sets do not have, and of values in the names of states.
fn remove_programs(document: &mut Value) {
    match document {
        Value::Object(members) => {
            members.remove("programs");
            for (name, value) in members {
                match value {
                    Value::String(state) if ["source", "target", "name"].contains(&name.as_str()) => {
                        *state = without_values(state);
                    }
                    value => remove_programs(value),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(remove_programs),
        _ => {}
    }
}

#[test]
fn a_simulation_is_the_same() {
    let (folder, set) = robot();
    let model = models().join("p3dx");
    let simulated = |of: &str, arguments: &[&str]| run(&folder, &[&["simulate", of], arguments].concat());
    for arguments in [&["--format", "json"] as &[&str], &["--significance", "1e-6", "--format", "perfetto"]] {
        let of = |path: &str| {
            let run = simulated(path, arguments);
            let mut document: Value =
                serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"));
            remove_programs(&mut document);
            (run.code, run.err, document)
        };
        let (of_file, of_model) = (of(&set), of(model.to_str().unwrap()));
        assert!(of_file == of_model, "{arguments:?}\n{of_file:?}\n{of_model:?}");
    }
    let (of_file, of_model) = (simulated(&set, &[]), simulated(model.to_str().unwrap(), &[]));
    assert_eq!((of_file.code, of_file.out), (of_model.code, of_model.out));
    let found = run(&folder, &["simulate", set.as_str(), "--significance", "0.5"]);
    assert_eq!(found.code, 2);
    assert!(found.err.contains("no times at 5e-1: the file has 1e-3, 1e-4"), "{}", found.err);
    assert_eq!(run(&folder, &["simulate", set.as_str(), "--deployment", "Other"]).code, 2);
}

/// Returns the blocks of a language in a page of the reference.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let fence = format!("```{language}\n");
    page.split(fence.as_str()).skip(1).filter_map(|it| it.split("```").next()).collect()
}

#[test]
fn tasks_on_all_cpus_have_no_first_job() {
    let folder = folder();
    let set = "cpus,6\nname,period,time,priority,deadline\n\
               controller,20,4,30,10\nlidar,100,3,20,50\nplanner,200,60,10,200\n";
    write(&folder, &[("arm.csv", set)]);
    let shown = run(&folder, &["wcrt", "arm.csv", "--format", "csv"]).out;
    let mut lines = shown.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let of = |name: &str| header.iter().position(|it| *it == name).unwrap();
    let (first, response) = (of("first_job_ms"), of("response_ms"));
    let found: Vec<_> = lines.map(|line| [line[first].to_owned(), line[response].to_owned()]).collect();
    assert_eq!(found, [["4", "4"], ["", "3"], ["", "60"]], "{shown}");
}

#[test]
fn commands_that_need_a_model_say_which_read_task_sets() {
    let folder = folder();
    write(&folder, &[("robot.csv", "name,period,time,priority\na,9,1,1\n")]);
    for command in ["check", "chains", "tune --priorities"] {
        let arguments: Vec<&str> = command.split(' ').chain(["robot.csv"]).collect();
        let found = run(&folder, &arguments);
        let is_said = found.err.contains("a task set has response times only: `mauve wcrt`");
        assert!(found.code == 2 && is_said, "{command}: {}", found.err);
    }
}

#[test]
fn the_reference_has_three_forms() {
    let page = include_str!("../spec/task-sets.md");
    let folder = folder();
    for language in ["csv", "toml", "json"] {
        let found = blocks(page, language);
        assert_eq!(found.len(), 1, "{language}");
        write(&folder, &[(&*format!("robot.{language}"), found[0])]);
    }
    let shown = run(&folder, &["wcrt", "robot.csv"]);
    assert!(shown.code == 0 && shown.out.contains("  ✓ 43 / 100 ms  "), "{shown:?}");
    assert!(shown.out.contains("  ✓ 93 / 200 ms  "), "{shown:?}");
    let all = |file: &str| run(&folder, &["wcrt", file, "--significance", "all"]);
    let (of_toml, of_json) = (all("robot.toml"), all("robot.json"));
    assert_eq!((of_toml.code, &of_toml.out), (0, &of_json.out), "{of_toml:?}");
}
