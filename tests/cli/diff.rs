//! `mauve diff`: what changed in figures between two states.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_tests::{Run, mauve, scratch, test_name, write};
use serde_json::{Value, json};

use crate::MAUVE;

/// Runs git, which has to succeed, and returns what it says.
fn git(folder: &Path, arguments: &[&str]) -> String {
    let output = mauve_tests::git(folder, arguments);
    assert!(output.status.success(), "git {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

fn repository(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    git(&folder, &["init", "--quiet", "--initial-branch=main"]);
    folder
}

fn commit(folder: &Path, message: &str) {
    git(folder, &["add", "--all"]);
    git(folder, &["commit", "--quiet", "--allow-empty", "--message", message]);
}

/// Commits what is staged.
fn commit_index(folder: &Path, message: &str) {
    git(folder, &["commit", "--quiet", "--message", message]);
}

fn diff(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["diff"], arguments].concat())
}

fn document(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap_or_else(|why| panic!("{why}: {run:?}"))
}

/// An activity of the robots of these tests: one codel, which is its only work.
#[derive(Debug, Clone, PartialEq)]
struct Activity {
    component: &'static str,
    /// In the background without one.
    priority: Option<u32>,
    period: u64,
    cpu: u32,
    /// Its execution time, if a table has it.
    time: Option<u64>,
}

#[derive(Debug, Clone)]
struct Robot {
    deployment: &'static str,
    activities: BTreeMap<&'static str, Activity>,
    folder: &'static str,
    /// The names of the files: the model, the table and the pattern in mauve.toml.
    model: &'static str,
    table: &'static str,
    pattern: &'static str,
    is_broken: bool,
}

impl Robot {
    fn write(&self, top: &Path) {
        for entry in std::fs::read_dir(top).unwrap().map(|it| it.unwrap().path()) {
            if !entry.ends_with(".git") {
                std::fs::remove_dir_all(entry).unwrap();
            }
        }
        let (mut model, mut table) = ("shell S { }\n".to_owned(), "[codel]\n".to_owned());
        let mut instances = String::new();
        let mut activities = String::new();
        for (name, it) in &self.activities {
            let component = it.component;
            let codel = component.to_lowercase();
            let _ =
                writeln!(model, "codel {codel}(): int\ncore K{component}(S) {{ update = {{ {codel}(); }} }}");
            let _ = writeln!(model, "component {component}(S, K{component})");
            let _ = write!(instances, "instance {name}: {component} ");
            let priority = it.priority.map_or("background".to_owned(), |it| it.to_string());
            let (period, cpu) = (it.period, it.cpu);
            let _ = writeln!(
                activities,
                "activity {name} {{ priority = {priority} period = {period} cpus = [{cpu}] }}"
            );
            it.time.iter().for_each(|time| _ = writeln!(table, "{codel} = {time}"));
        }
        let deployment = self.deployment;
        let _ = write!(
            model,
            "architecture A {{ {instances} }}\ndeployment {deployment} {{ architecture A\n{activities}}}\n"
        );
        if self.is_broken {
            model = model.replace("architecture A {", "architecture A { instance");
        }
        let config = format!("platform.rt_throttling = false\ntiming.tables = [\"{}\"]\n", self.pattern);
        write(&top.join(self.folder), &[("mauve.toml", &config), (self.model, &model), (self.table, &table)]);
    }

    /// The response time of each real-time activity by the equation of Joseph and Pandya, without this program: none where it
    /// grows beyond the period, or a time is not known.
    fn responses(&self) -> BTreeMap<&'static str, Option<u64>> {
        let real_time = self.activities.iter().filter_map(|(name, it)| Some((*name, it, it.priority?)));
        let real_time: Vec<_> = real_time.collect();
        let of = |(_, it, priority): &(&str, &Activity, u32)| {
            let others: Vec<&Activity> = real_time
                .iter()
                .filter(|(_, other, others)| other.cpu == it.cpu && others > priority)
                .map(|(_, other, _)| *other)
                .collect();
            let own = it.time?;
            let mut response = own;
            loop {
                let mut sum = own;
                for other in &others {
                    sum += response.div_ceil(other.period) * other.time?;
                }
                if sum == response || sum > 1000 {
                    return Some(sum);
                }
                response = sum;
            }
        };
        real_time.iter().map(|it| (it.0, of(it))).collect()
    }
}

fn robot() -> Robot {
    let activity = |component, priority, period, cpu, time| Activity {
        component,
        priority: Some(priority),
        period,
        cpu,
        time: Some(time),
    };
    let activities = BTreeMap::from([
        ("imu", activity("Imu", 9, 10, 1, 2)),
        ("ctrl", activity("Control", 8, 20, 1, 5)),
        ("nav", activity("Planner", 2, 100, 1, 21)),
        ("map", activity("Slam", 1, 200, 2, 60)),
        ("log", Activity { priority: None, ..activity("Log", 0, 100, 2, 3) }),
    ]);
    Robot {
        deployment: "D",
        activities,
        folder: "robot",
        model: "robot.mal",
        table: "times.toml",
        pattern: "*s.toml",
        is_broken: false,
    }
}

/// A commit: what it changes, what `diff` says of each figure that is different, and whether something is worse.
type Step = (&'static str, fn(&mut Robot), &'static [&'static str], bool);

fn change(robot: &mut Robot, name: &'static str, how: fn(&mut Activity)) {
    how(robot.activities.get_mut(name).unwrap());
}

fn rename(robot: &mut Robot, from: &str, to: &'static str) {
    let activity = robot.activities.remove(from).unwrap();
    robot.activities.insert(to, activity);
}

const STEPS: [Step; 21] = [
    ("a longer time", |it| change(it, "nav", |nav| nav.time = Some(30)), &["nav later"], true),
    (
        "a shorter period",
        |it| change(it, "imu", |imu| imu.period = 8),
        &["ctrl same", "imu tightened", "nav later"],
        true,
    ),
    ("a renamed instance", |it| rename(it, "ctrl", "control"), &["control (was ctrl) same"], false),
    (
        "a new activity",
        |it| {
            let gps = Activity { component: "Gps", priority: Some(7), period: 50, cpu: 2, time: Some(4) };
            it.activities.insert("gps", gps);
        },
        &["gps new", "map later"],
        true,
    ),
    (
        "another order of priorities",
        |it| change(it, "map", |map| map.priority = Some(8)),
        &["gps missed", "map earlier"],
        true,
    ),
    ("back", |it| change(it, "map", |map| map.priority = Some(1)), &["gps met", "map later"], true),
    ("another CPU", |it| change(it, "nav", |nav| nav.cpu = 2), &["map later", "nav earlier"], true),
    (
        "an activity less",
        |it| _ = it.activities.remove("gps"),
        &["gps gone", "map earlier", "nav earlier"],
        true,
    ),
    ("a broken model", |it| it.is_broken = true, &[], true),
    ("the model corrected", |it| it.is_broken = false, &[], false),
    ("a moved model", |it| it.model = "models/deep/robot.mal", &[], false),
    ("a moved table", |it| (it.table, it.pattern) = ("timing/all.toml", "timing/*.toml"), &[], false),
    (
        "a table of another name",
        |it| (it.table, it.pattern) = ("timing/all.times", "timing/*.times"),
        &[],
        false,
    ),
    ("a time less", |it| change(it, "nav", |nav| nav.time = None), &["map missed", "nav missed"], true),
    ("a time again", |it| change(it, "nav", |nav| nav.time = Some(30)), &["map met", "nav met"], false),
    ("too long a time", |it| change(it, "map", |map| map.time = Some(190)), &["map missed"], true),
    ("a shorter time", |it| change(it, "map", |map| map.time = Some(50)), &["map met"], false),
    (
        "three renamed instances",
        |it| {
            [("imu", "imu0"), ("map", "slam"), ("nav", "planner")]
                .iter()
                .for_each(|(old, new)| rename(it, old, new))
        },
        &["imu0 (was imu) same", "planner (was nav) same", "slam (was map) same"],
        false,
    ),
    (
        "an activity in the background",
        |it| change(it, "imu0", |imu| imu.priority = None),
        &["control earlier", "imu0 lost"],
        true,
    ),
    ("a renamed deployment", |it| it.deployment = "Robot", &[], false),
    ("a moved project", |it| it.folder = "platform/robot", &[], false),
];

#[test]
fn each_commit_of_a_history() {
    let top = repository("all");
    let mut states = vec![robot()];
    states[0].write(&top);
    commit(&top, "a robot");
    for (message, step, ..) in STEPS {
        let mut next = states.last().unwrap().clone();
        step(&mut next);
        next.write(&top);
        commit(&top, message);
        states.push(next);
    }
    let status = git(&top, &["status", "--porcelain"]);
    for (index, (message, _, expected, is_worse)) in STEPS.iter().enumerate() {
        let [old, new] = [&states[index], &states[index + 1]];
        let names = [STEPS.len() - index, STEPS.len() - index - 1].map(|back| format!("HEAD~{back}"));
        let [before, after] = &names;
        let range = format!("{before}..{after}");
        let moved = names
            .each_ref()
            .map(|it| format!("{it}:robot"))
            .map(|it| it.replace("HEAD~0:", "HEAD~0:platform/"));
        let arguments = match old.folder == new.folder {
            true => vec![range.as_str(), "--format", "json"],
            false => vec![moved[0].as_str(), moved[1].as_str(), "--format", "json"],
        };
        let run = diff(&top, &arguments);
        let found = document(&run);
        assert_eq!(
            (run.code, &found["worse"]),
            (i32::from(*is_worse), &json!(is_worse)),
            "{message}: {run:?}"
        );
        let figures = &found["deployments"][0]["figures"];
        assert_eq!(found["deployments"].as_array().unwrap().len(), 1, "{message}: {run:?}");
        let rows = figures["activities"].as_array().unwrap();
        let is_same = |row: &Value| row["change"] == "same" && row.get("was").is_none();
        let shown = |row: &Value| {
            let was = row.get("was").map_or(String::new(), |was| format!(" (was {})", was.as_str().unwrap()));
            format!("{}{was} {}", row["name"].as_str().unwrap(), row["change"].as_str().unwrap())
        };
        let mut changed: Vec<String> = rows.iter().filter(|it| !is_same(it)).map(shown).collect();
        changed.sort();
        let expected: Vec<&str> = expected.iter().copied().filter(|it| *it != "ctrl same").collect();
        if !old.is_broken && !new.is_broken {
            assert_eq!(changed, expected, "{message}: {run:?}");
        }
        // Every figure is that of the equation.
        for (side, state) in [("before", old), ("after", new)] {
            for (name, response) in state.responses().into_iter().filter(|_| !state.is_broken) {
                let called = |row: &&Value| match side {
                    "before" => row.get("was").unwrap_or(&row["name"]) == name && !row["before"].is_null(),
                    _ => row["name"] == name && !row["after"].is_null(),
                };
                let figure =
                    &rows.iter().find(called).unwrap_or_else(|| panic!("{message}: {name} in {run:?}"))[side];
                let period = state.activities[name].period;
                let is_met = response.is_some_and(|it| it <= period);
                assert_eq!(figure["status"] == "met", is_met, "{message}: {name} in {run:?}");
                if is_met {
                    assert_eq!(
                        (&figure["time"], &figure["limit"]),
                        (&json!(response), &json!(period)),
                        "{message}: {name}"
                    );
                }
            }
        }
    }
    assert_eq!(git(&top, &["status", "--porcelain"]), status);
    // The broken state: no deadline is proved.
    let broken = diff(&top, &["HEAD~13..HEAD~12"]);
    assert!(broken.code == 1 && broken.out.contains("not proved: the project has "), "{broken:?}");
    let mended = diff(&top, &["HEAD~12..HEAD~11", "robot"]);
    assert!(mended.code == 0 && mended.out.contains("before, nothing was proved"), "{mended:?}");
    // What the execution times explain.
    let first = diff(&top, &["HEAD~21..HEAD~20"]);
    let expected =
        "D at 1e-4: 4 of 4 deadlines met, as before\n  activity  before         after\n  nav       ";
    assert!(first.out.contains(expected), "{first:?}");
    assert!(first.out.contains("  execution times: planner 21 → 30 ms\n"), "{first:?}");
    let second = diff(&top, &["HEAD~20..HEAD~19"]);
    assert!(second.out.contains("period 10 ms → 8 ms"), "{second:?}");
}

#[test]
fn the_states_that_arguments_name() {
    let top = repository("states");
    let mut it = robot();
    it.write(&top);
    commit(&top, "first");
    git(&top, &["branch", "old"]);
    git(&top, &["checkout", "--quiet", "-b", "topic"]);
    change(&mut it, "nav", |nav| nav.time = Some(30));
    it.write(&top);
    commit(&top, "second");
    git(&top, &["checkout", "--quiet", "main"]);
    let mut other = robot();
    change(&mut other, "map", |map| map.time = Some(70));
    other.write(&top);
    commit(&top, "third");
    other.activities.get_mut("imu").unwrap().time = Some(3);
    other.write(&top);
    // The times of `map`, `nav` and `imu` tell the states apart.
    let first = "map 60, nav 21, imu 2";
    let second = "map 60, nav 30, imu 2";
    let third = "map 70, nav 21, imu 2";
    let disk = "map 70, nav 21, imu 3";
    for (arguments, expected) in [
        (&[][..], [third, disk]),
        (&["robot"], [third, disk]),
        (&["robot/mauve.toml"], [third, disk]),
        (&["old"], [first, disk]),
        (&["old", "robot"], [first, disk]),
        (&["robot", "old"], [disk, first]),
        (&["old", "topic"], [first, second]),
        (&["old..topic"], [first, second]),
        (&["old..topic", "robot"], [first, second]),
        (&["main..topic"], [third, second]),
        (&["main...topic"], [first, second]),
        (&["topic...", "robot"], [first, third]),
        (&["git:old"], [first, disk]),
        (&["old:robot", "robot"], [first, disk]),
        (&["old:./robot", "topic:robot"], [first, second]),
        (&["robot", "./robot"], [disk, disk]),
        (&["topic^{/second}", "robot"], [second, disk]),
    ] {
        let run = diff(&top, &[arguments, &["--format", "json"]].concat());
        let found = document(&run);
        let rows = &found["deployments"][0]["figures"]["activities"];
        let time = |side: &str, name: &str| {
            let row = rows.as_array().unwrap().iter().find(|row| row["name"] == name).unwrap();
            row[side]["time"].as_u64().unwrap()
        };
        let own = |side: &str| {
            // `map` is alone on its CPU, `imu` has the highest priority; R of `nav` is 39 or 54 with 21 ms, 57 with 30 ms.
            let imu = time(side, "imu");
            let nav = if time(side, "nav") < 57 { 21 } else { 30 };
            format!("map {}, nav {nav}, imu {imu}", time(side, "map"))
        };
        assert_eq!(["before", "after"].map(own), expected.map(str::to_owned), "{arguments:?}: {run:?}");
    }
    // Below the top, and with a revision that is called like a file.
    let below = diff(&top.join("robot"), &["old"]);
    assert!(below.code == 1 && below.out.starts_with("old ("), "{below:?}");
    std::fs::create_dir(top.join("old")).unwrap();
    for (arguments, expected) in [
        (
            &["old"][..],
            "`old` is a path and a revision: write `./old` for the path, `git:old` for the revision",
        ),
        (&["nothing"], "`nothing` is neither a path nor a revision"),
        (&["main:typo"], "`main:typo`: there is no model and no mauve.toml in `typo`"),
        (&["robot", "old..topic"], "a range such as `main..HEAD` names both states: only a PATH may follow"),
        (&["old..topic", "topic"], "a range such as `main..HEAD` names both states: only a PATH may follow"),
        (&["main", "--deployment", "X"], "no deployment `X`: there is D"),
        (&["main", "--tolerance", "much"], "expected a time or percent, such as 2ms or 5%"),
    ] {
        let run = diff(&top, arguments);
        assert!(run.code == 2 && run.err.contains(expected), "{arguments:?}: {run:?}");
    }
    let outside = diff(Path::new("/"), &["HEAD"]);
    assert!(outside.code == 2 && outside.err.contains("is in no repository that git reads"), "{outside:?}");
}

#[test]
fn a_tolerance_and_what_is_new_or_gone() {
    let top = repository("tolerance");
    robot().write(&top);
    commit(&top, "before");
    let mut it = robot();
    change(&mut it, "map", |map| map.time = Some(63));
    it.write(&top);
    for (tolerance, code) in [("0", 1), ("2ms", 1), ("3ms", 0), ("4%", 1), ("5%", 0)] {
        let run = diff(&top, &["--tolerance", tolerance]);
        assert_eq!(run.code, code, "{tolerance}: {run:?}");
    }
    // A deadline that is missed is worse, whatever the tolerance.
    change(&mut it, "map", |map| map.time = Some(201));
    it.write(&top);
    assert_eq!(diff(&top, &["--tolerance", "1000%"]).code, 1);
    // The first models of a repository, and the last.
    git(&top, &["rm", "--quiet", "-r", "--cached", "."]);
    git(&top, &["commit", "--quiet", "--message", "nothing"]);
    robot().write(&top);
    let new = diff(&top, &[]);
    assert!(new.code == 0 && new.out.contains("D at 1e-4: new: 4 of 4 deadlines met"), "{new:?}");
    let gone = diff(&top, &["HEAD~1..HEAD"]);
    assert!(gone.code == 1 && gone.out.contains("D at 1e-4: gone"), "{gone:?}");
    let nothing = diff(&top, &["HEAD..HEAD"]);
    assert!(nothing.code == 2 && nothing.err.contains("neither state has a deployment"), "{nothing:?}");
}

/// A link within the repository is part of it, in a commit as on the disk; one that leads out is not followed.
#[test]
fn links_of_a_commit() {
    let top = repository("links");
    robot().write(&top);
    std::fs::create_dir(top.join("common")).unwrap();
    std::fs::rename(top.join("robot/times.toml"), top.join("common/times.toml")).unwrap();
    std::os::unix::fs::symlink("../common/times.toml", top.join("robot/times.toml")).unwrap();
    commit(&top, "a link");
    let run = diff(&top, &["HEAD", "robot"]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
    std::fs::remove_file(top.join("robot/times.toml")).unwrap();
    std::os::unix::fs::symlink("../../times.toml", top.join("robot/times.toml")).unwrap();
    commit(&top, "a link out");
    let said = "`robot/times.toml` is a link out of the repository, and is not followed";
    for range in ["HEAD~1..HEAD", "HEAD..HEAD~1"] {
        let run = diff(&top, &[range, "robot"]);
        assert!(run.code == 2 && run.out.contains(said), "{run:?}");
    }
    // A folder behind a link.
    std::fs::remove_file(top.join("robot/times.toml")).unwrap();
    std::os::unix::fs::symlink("../common", top.join("robot/all")).unwrap();
    let config = std::fs::read_to_string(top.join("robot/mauve.toml")).unwrap();
    write(&top, &[("robot/mauve.toml", &config.replace("*s.toml", "all/*s.toml"))]);
    commit(&top, "a link to a folder");
    let run = diff(&top, &["HEAD~2..HEAD", "robot"]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
}

/// A robot whose codels and execution times are in a submodule, with two commits in each: `turn` becomes slower.
fn with_submodule(name: &str) -> PathBuf {
    let (parts, top) = (repository(&format!("{name}-parts")), repository(name));
    let table = |turn: u32| format!("unit = \"ms\"\n[codel]\nturn = {turn}\n");
    write(&parts, &[("turn.mal", "codel turn(): void\n"), ("times/all.toml", &table(4))]);
    commit(&parts, "parts");
    let model = "include \"parts/turn.mal\"\nshell Plain { }\ncore Turns(Plain) { update = { turn(); } }
        component Wheel(Plain, Turns)\narchitecture Cart { instance wheel: Wheel }
        deployment Yard { architecture Cart activity wheel { affinity = 1 priority = 3 period = 30 } }\n";
    let config = "project.root = \"cart.mal\"\ntiming.tables = [\"parts/times/*.toml\"]
        platform.cpus = 1\nplatform.rt_throttling = false\n";
    write(&top, &[("cart.mal", model), ("mauve.toml", config)]);
    let allowed = "protocol.file.allow=always";
    git(&top, &["-c", allowed, "submodule", "--quiet", "add", &parts.display().to_string(), "parts"]);
    commit(&top, "first");
    write(&top.join("parts"), &[("times/all.toml", &table(11))]);
    commit(&top.join("parts"), "slower");
    commit(&top, "second");
    top
}

/// Checks the output where one state of a deployment cannot be read: the command compares no figures.
fn check_unread(folder: &Path, arguments: &[&str], why: &str) {
    let run = diff(folder, arguments);
    assert_eq!(run.code, 2, "{arguments:?}: {run:?}");
    assert!(
        run.out.contains("1 deployment not compared, since files cannot be read"),
        "{arguments:?}: {run:?}"
    );
    assert!(run.has(why), "{arguments:?}: {run:?}");
    for word in ["better", "worse", "nothing changes", "as before", " new", "gone", "met now", "no longer"] {
        assert!(!run.out.contains(word), "{word} {arguments:?}: {run:?}");
    }
    let markdown = diff(folder, &[arguments, &["--format", "markdown"]].concat());
    assert!(
        markdown.code == 2 && markdown.out.starts_with("⚠️ **Response times:** 1 deployment not"),
        "{markdown:?}"
    );
    let json = diff(folder, &[arguments, &["--format", "json"]].concat());
    let found = document(&json);
    let figures = &found["deployments"][0]["figures"];
    assert_eq!((json.code, &found["worse"]), (2, &json!(false)), "{json:?}");
    assert!(figures["unread"].to_string().contains(why), "{json:?}");
    let none = [&figures["before"], &figures["after"]].map(Value::is_null);
    assert_eq!((none, &figures["activities"]), ([true, true], &json!([])), "{json:?}");
}

/// Removes what a clone without its submodules does not have.
fn without_submodule(top: &Path) {
    git(top, &["submodule", "--quiet", "deinit", "--force", "parts"]);
    std::fs::remove_dir_all(top.join(".git/modules/parts")).unwrap();
}

#[test]
fn a_submodule_is_read_where_its_commit_is_here() {
    let top = with_submodule("here");
    let expected = "wheel     ✓ 4 / 30 ms  ✓ 11 / 30 ms  later";
    for arguments in [&["HEAD~1..HEAD"][..], &["HEAD~1"], &["HEAD~1..HEAD", "cart.mal"]] {
        let run = diff(&top, arguments);
        assert!(run.code == 1 && run.out.contains(expected), "{arguments:?}: {run:?}");
    }
    let run = diff(&top, &["HEAD"]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
    // Links to its files.
    std::os::unix::fs::symlink("parts/turn.mal", top.join("turn.mal")).unwrap();
    let model = std::fs::read_to_string(top.join("cart.mal")).unwrap();
    write(&top, &[("cart.mal", &model.replace("parts/turn.mal", "turn.mal"))]);
    commit(&top, "a link");
    let run = diff(&top, &["HEAD~1..HEAD"]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
    without_submodule(&top);
    let why =
        "`parts` is a submodule whose commit is not here, and is not read: run `git submodule update --init`";
    check_unread(&top, &["HEAD~1..HEAD"], why);
    write(
        &top,
        &[
            ("mauve.toml", "project.root = \"cart.mal\"\ntiming.tables = [\"t.toml\"]\n"),
            ("t.toml", "codel.turn = 5\n"),
        ],
    );
    commit(&top, "another table");
    check_unread(&top, &["HEAD..HEAD"], why);
}

#[test]
fn a_submodule_that_is_not_here_has_no_figures() {
    let top = with_submodule("gone");
    without_submodule(&top);
    let why =
        "`parts` is a submodule whose commit is not here, and is not read: run `git submodule update --init`";
    check_unread(&top, &["HEAD~1..HEAD"], why);
    // The disk has the files.
    let config = "timing.tables = [\"t.toml\"]\nplatform.cpus = 1\nplatform.rt_throttling = false\n";
    let table = "codel.turn = 7\n";
    write(&top.join("parts"), &[("turn.mal", "codel turn(): void\n"), ("times/all.toml", table)]);
    check_unread(&top, &["HEAD"], why);
    check_unread(&top, &[".", "HEAD"], why);
    // What does not need it has figures; what is in it may have been there before.
    let other = std::fs::read_to_string(top.join("cart.mal")).unwrap();
    let other = other.replace("include \"parts/turn.mal\"", "codel turn(): void").replace("Yard", "Road");
    for (folder, change) in [("road", Some("new")), ("parts/road", None)] {
        write(&top.join(folder), &[("road.mal", &*other), ("mauve.toml", config), ("t.toml", table)]);
        let run = diff(&top, &["HEAD", "--format", "json"]);
        let found = document(&run);
        let all = found["deployments"].as_array().unwrap();
        let root = format!("{folder}/road.mal");
        let road = all.iter().find(|it| it["root"] == root).unwrap();
        let found = &road["figures"]["activities"][0]["change"];
        assert_eq!((run.code, found.as_str()), (2, change), "{road}");
    }
}

#[test]
fn a_submodule_elsewhere_is_not_read_and_executes_nothing() {
    let top = with_submodule("hostile");
    let mark = top.parent().unwrap().join(format!("{}.mark", test_name()));
    let _ = std::fs::remove_file(&mark);
    // The repository of the submodule in its folder, as `git clone` makes it.
    let parts = top.join("parts");
    std::fs::remove_file(parts.join(".git")).unwrap();
    std::fs::rename(top.join(".git/modules/parts"), parts.join(".git")).unwrap();
    git(&top, &["config", "--file", "parts/.git/config", "--unset", "core.worktree"]);
    with_traps(&parts, &mark);
    let run = diff(&top, &["HEAD~1..HEAD"]);
    assert!(run.code == 1 && run.out.contains("✓ 4 / 30 ms  ✓ 11 / 30 ms  later"), "{run:?}");
    assert!(!mark.exists(), "{}", std::fs::read_to_string(&mark).unwrap());
    // A repository elsewhere with the same commits, by its folder and by a link.
    let elsewhere = top.parent().unwrap().join(format!("{}-elsewhere", test_name()));
    let _ = std::fs::remove_dir_all(&elsewhere);
    std::fs::rename(&parts, &elsewhere).unwrap();
    let why = "`parts` is a submodule whose commit is not here";
    write(&parts, &[(".git", &format!("gitdir: {}/.git\n", elsewhere.display()))]);
    check_unread(&top, &["HEAD~1..HEAD"], why);
    std::fs::remove_dir_all(&parts).unwrap();
    std::os::unix::fs::symlink(&elsewhere, &parts).unwrap();
    check_unread(&top, &["HEAD~1..HEAD"], why);
    // In its place, for a repository that says of itself that it is around it.
    std::fs::remove_file(&parts).unwrap();
    std::fs::rename(&elsewhere, &parts).unwrap();
    let inner = top.join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::rename(top.join(".git"), inner.join(".git")).unwrap();
    git(&inner, &["config", "core.worktree", &top.display().to_string()]);
    check_unread(&inner, &["HEAD~1:", "HEAD:"], why);
}

#[test]
fn a_file_of_git_lfs_has_no_figures() {
    let pointer =
        format!("version https://git-lfs.github.com/spec/v1\noid sha256:{}\nsize 120\n", "7".repeat(64));
    let why = "this file is only a pointer to one that Git LFS stores: run `git lfs pull`";
    let top = repository("lfs");
    let model = "include \"codels.mal\"\nshell Plain { }\ncore Turns(Plain) { update = { turn(); } }
        component Wheel(Plain, Turns)\narchitecture Cart { instance wheel: Wheel }
        deployment Yard { architecture Cart activity wheel { affinity = 1 priority = 3 period = 30 } }\n";
    let config =
        "timing.tables = [\"times.toml\", \"more.table\"]\ntiming.observed = [\"seen.observed.toml\"]
        platform.cpus = 1\nplatform.rt_throttling = false\n";
    let files = [
        ("cart.mal", model),
        ("codels.mal", "codel turn(): void\ncodel rest(): void\n"),
        ("mauve.toml", config),
        ("times.toml", "codel.turn = 7\n"),
        ("more.table", "codel.rest = 7\n"),
        ("seen.observed.toml", "# nothing yet\n"),
    ];
    write(&top, &files);
    commit(&top, "files");
    for (file, _) in files {
        write(&top, &[(file, &pointer)]);
        commit(&top, file);
        git(&top, &["checkout", "--quiet", "HEAD~1", "."]);
        for arguments in ["HEAD", "HEAD~1..HEAD", "HEAD..HEAD"] {
            check_unread(&top, &[arguments], &format!("`{file}`: {why}"));
        }
        commit(&top, "back");
    }
    // A file that no project needs.
    write(&top, &[("unused.toml", &pointer)]);
    commit(&top, "unused");
    let run = diff(&top, &["HEAD~1..HEAD"]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
}

#[test]
fn markdown_begins_with_the_verdict() {
    let top = repository("markdown");
    let mut it = robot();
    it.write(&top);
    commit(&top, "before");
    change(&mut it, "nav", |nav| nav.time = Some(90));
    it.write(&top);
    let run = diff(&top, &["--format", "markdown"]);
    let id = git(&top, &["rev-parse", "HEAD"]);
    let expected = format!(
        "❌ **Response times:** 1 figure worse (nav no longer met), 3 of 4 deadlines met\n\n**`D`** at 1e-4: 4 → 3 of 4 deadlines met\n\n\
         | activity | before | after | |\n|---|---|---|---|\n\
         | `nav` | `✓ 39 / 100 ms` | `✗ CPU 1 overloaded (135.0 %)` | no longer met |\n\n4 activities as before\n\n\
         CPU 1 utilisation: 66.0 % → 135.0 %\n\nexecution times: planner 21 → 90 ms\n\n\
         <sub>mauve diff: HEAD ({}) → the working folder</sub>\n",
        &id[..10]
    );
    assert_eq!((run.code, run.out.as_str()), (1, expected.as_str()));
}

/// Adds a file with this text to the next commit, under any path.
fn stage(folder: &Path, mode: &str, path: &str, text: &[u8]) {
    std::fs::write(folder.join(".git/staged"), text).unwrap();
    let object = git(folder, &["hash-object", "-w", ".git/staged"]);
    git(folder, &["update-index", "--add", "--cacheinfo", &format!("{mode},{object},{path}")]);
}

/// Everything that a repository can name to be executed leaves a mark when it is.
fn with_traps(top: &Path, mark: &Path) {
    use std::os::unix::fs::PermissionsExt as _;
    let script = format!("#!/bin/sh\necho \"$0\" >>'{}'\n", mark.display());
    let trap = top.join(".git/trap");
    std::fs::create_dir_all(top.join(".git/hooks")).unwrap();
    let hooks =
        ["post-checkout", "post-index-change", "reference-transaction", "fsmonitor-watchman", "pre-auto-gc"];
    let hooks = hooks.map(|hook| top.join(".git/hooks").join(hook));
    for path in hooks.iter().chain([&trap]) {
        std::fs::write(path, &script).unwrap();
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let trap = trap.display().to_string();
    for (key, value) in [
        ("core.fsmonitor", trap.as_str()),
        ("core.pager", &trap),
        ("core.editor", &trap),
        ("core.askPass", &trap),
        ("core.sshCommand", &trap),
        ("core.gitProxy", &trap),
        ("core.alternateRefsCommand", &trap),
        ("credential.helper", &trap),
        ("diff.external", &trap),
        ("diff.t.textconv", &trap),
        ("diff.t.command", &trap),
        ("filter.t.smudge", &trap),
        ("filter.t.clean", &trap),
        ("filter.t.process", &trap),
        ("gpg.program", &trap),
        ("log.showSignature", "true"),
        ("pager.rev-parse", &trap),
        ("pager.cat-file", &trap),
        ("alias.rev-parse", &format!("!{trap}")),
        ("alias.ls-tree", &format!("!{trap}")),
        ("alias.cat-file", &format!("!{trap}")),
        ("alias.merge-base", &format!("!{trap}")),
        ("protocol.allow", "always"),
        ("protocol.ext.allow", "always"),
        ("remote.origin.url", &format!("ext::{trap}")),
        ("remote.origin.uploadpack", &trap),
        ("remote.origin.vcs", "ext"),
        ("remote.origin.promisor", "true"),
        ("core.repositoryFormatVersion", "1"),
        ("extensions.partialClone", "origin"),
        ("include.path", "more"),
    ] {
        git(top, &["config", key, value]);
    }
    std::fs::write(top.join(".git/more"), format!("[core]\n\tfsmonitor = {trap}\n")).unwrap();
    write(top, &[(".gitattributes", "* filter=t diff=t\n")]);
}

#[test]
fn a_hostile_repository_executes_nothing() {
    let top = repository("hostile");
    let mark = top.parent().unwrap().join(format!("{}.mark", test_name()));
    let _ = std::fs::remove_file(&mark);
    robot().write(&top);
    commit(&top, "honest");
    git(&top, &["tag", "honest"]);
    let mut it = robot();
    change(&mut it, "nav", |nav| nav.time = Some(30));
    it.write(&top);
    commit(&top, "slower");
    git(&top, &["tag", "slower"]);
    // An object is missing, and the remote would give it.
    stage(&top, "100644", "robot/more.mal", b"// missing\n");
    commit_index(&top, "partial");
    let object = git(&top, &["rev-parse", "HEAD:robot/more.mal"]);
    std::fs::remove_file(top.join(".git/objects").join(&object[..2]).join(&object[2..])).unwrap();
    // Replaced objects show another commit under the name of the old one.
    git(&top, &["replace", "honest", "slower"]);
    with_traps(&top, &mark);
    // The traps are set.
    let shown = Command::new("git").args(["status"]).current_dir(&top).output().unwrap();
    assert!(mark.exists(), "{shown:?}");
    std::fs::remove_file(&mark).unwrap();
    let expected = "nav       ✓ 39 / 100 ms  ✓ 57 / 100 ms  later";
    for arguments in
        [&["honest"][..], &["honest..slower"], &["honest...slower", "robot"], &["robot", "honest"]]
    {
        let run = diff(&top, arguments);
        assert!(run.out.contains(expected) || arguments[0] == "robot", "{arguments:?}: {run:?}");
        assert!(!mark.exists(), "{arguments:?}: {}", std::fs::read_to_string(&mark).unwrap());
    }
    // Names like options, and like programs.
    for name in [
        "--output=x",
        "-h",
        "--help=x",
        "--exec-path=/x",
        "git:--all",
        "git:-C",
        "honest..--all",
        "--all..honest",
        "ext::x",
    ] {
        let run = diff(&top, &["--", name]);
        assert!(run.code == 2 && run.err.contains("is neither a path nor a revision"), "{name}: {run:?}");
    }
    let run = diff(&top, &["honest..HEAD"]);
    let expected =
        format!("cannot read `robot/more.mal` of the revision: the repository does not have object {object}");
    assert!(run.code == 2 && run.err.contains(&expected), "{run:?}");
    assert!(!mark.exists(), "{}", std::fs::read_to_string(&mark).unwrap());
    // A program called git in the current folder, and a variable of a hook, are not those of the user.
    std::fs::copy(top.join(".git/trap"), top.join("git")).unwrap();
    let own = Command::new(MAUVE)
        .args(["diff", "honest..slower"])
        .current_dir(&top)
        .env("PATH", format!(".::{}", std::env::var("PATH").unwrap()))
        .env("GIT_DIR", "/nowhere")
        .env("GIT_EXTERNAL_DIFF", top.join(".git/trap"))
        .env("GIT_CONFIG_COUNT", "1")
        .env("GIT_CONFIG_KEY_0", "core.fsmonitor")
        .env("GIT_CONFIG_VALUE_0", top.join(".git/trap"))
        .output()
        .unwrap();
    assert_eq!(own.status.code(), Some(1), "{own:?}");
    assert!(!mark.exists(), "{}", std::fs::read_to_string(&mark).unwrap());
}

#[test]
fn trees_that_lead_elsewhere_are_not_followed() {
    let top = repository("trees");
    robot().write(&top);
    commit(&top, "honest");
    // Links, a submodule, and a file that is too long.
    stage(&top, "120000", "robot/link.mal", b"/etc/passwd");
    stage(&top, "120000", "robot/inner/mauve.toml", b"../../../mauve.toml");
    let here = git(&top, &["rev-parse", "HEAD"]);
    git(&top, &["update-index", "--add", "--cacheinfo", &format!("160000,{here},robot/parts")]);
    stage(&top, "100644", "robot/longs.toml", &vec![b'#'; (16 << 20) + 1]);
    commit_index(&top, "links");
    let run = diff(&top, &["HEAD~1..HEAD", "robot"]);
    assert!(run.code == 2 && run.out.contains("`longs.toml`: cannot be read"), "{run:?}");
    for said in [
        "HEAD: `robot/link.mal` is a link out of the repository, and is not followed",
        "HEAD: `robot/inner/mauve.toml` is a link out of the repository, and is not followed",
        "HEAD: `robot/parts` is a submodule whose commit is not here, and is not read",
    ] {
        assert!(run.err.contains(said), "{run:?}");
    }
    // Paths that git itself does not write.
    let entry = |mode: &str, name: &str, object: &str| {
        let digits = (0..object.len()).step_by(2);
        let bytes = digits.map(|at| u8::from_str_radix(&object[at..at + 2], 16).unwrap());
        [format!("{mode} {name}\0").into_bytes(), bytes.collect()].concat()
    };
    let tree = |entries: &[Vec<u8>]| {
        std::fs::write(top.join(".git/tree"), entries.concat()).unwrap();
        git(&top, &["hash-object", "-t", "tree", "--literally", "-w", ".git/tree"])
    };
    let model = git(&top, &["rev-parse", "HEAD:robot/robot.mal"]);
    let robot = git(&top, &["rev-parse", "HEAD~1:robot"]);
    let inner = tree(&[entry("100644", "stolen.mal", &model)]);
    let all = tree(&[
        entry("40000", "..", &inner),
        entry("40000", ".git", &inner),
        entry("100644", "../x.mal", &model),
        entry("40000", "robot", &robot),
    ]);
    let hostile = git(&top, &["commit-tree", &all, "-m", "hostile", "-p", "HEAD~1"]);
    let run = diff(&top, &["HEAD~1", &hostile]);
    assert!(run.code == 0 && run.out.contains("nothing changes"), "{run:?}");
    let twice = tree(&[
        entry("40000", "robot", &robot),
        entry("100644", "robot.mal", &model),
        entry("100644", "robot.mal", &model),
    ]);
    let twice = git(&top, &["commit-tree", &twice, "-m", "twice"]);
    let run = diff(&top, &["HEAD~1", &twice]);
    assert!(run.code == 2 && run.err.contains("cannot read `robot.mal` of the revision"), "{run:?}");
    // Nothing is left of all states.
    let temporary = std::fs::read_dir(std::env::temp_dir()).unwrap().map(|it| it.unwrap().path());
    let stolen = temporary.filter(|path| path.ends_with("stolen.mal") || path.ends_with("x.mal"));
    assert_eq!(stolen.collect::<Vec<_>>(), Vec::<PathBuf>::new());
}

#[test]
fn names_of_a_stranger_are_shown_harmlessly() {
    let top = repository("names");
    robot().write(&top);
    commit(&top, "before");
    let folder = top.join("a\u{1b}[2J<b>@all");
    std::fs::rename(top.join("robot"), &folder).unwrap();
    git(&top, &["branch", "x_@channel|b"]);
    let run = diff(&top, &["x_@channel|b..HEAD", "--format", "markdown"]);
    assert!(run.code == 0 && run.out.contains("channel\\|b") && !run.out.contains("@channel"), "{run:?}");
    let run = diff(&top, &["HEAD", "a\u{1b}[2J<b>@all", "--format", "markdown"]);
    assert!(!run.out.contains('\u{1b}') && !run.out.contains("<b>") && !run.out.contains("@all"), "{run:?}");
    let text = diff(&top, &["HEAD:robot", "a\u{1b}[2J<b>@all"]);
    assert!(text.code == 0 && !text.out.contains('\u{1b}'), "{text:?}");
}

/// A hidden folder that the user names is read from a commit as from the disk; one that is not named is not.
#[test]
fn a_hidden_folder_that_is_named() {
    let top = repository("hidden");
    let mut it = Robot { folder: ".robot", ..robot() };
    it.write(&top);
    std::fs::create_dir(top.join(".robot/deep")).unwrap();
    std::fs::rename(top.join(".robot/times.toml"), top.join(".robot/deep/times.toml")).unwrap();
    std::os::unix::fs::symlink("deep/times.toml", top.join(".robot/times.toml")).unwrap();
    write(&top, &[(".robot/.env/more.mal", "codel more(: int\n")]);
    commit(&top, "before");
    let table = std::fs::read_to_string(top.join(".robot/deep/times.toml")).unwrap();
    change(&mut it, "nav", |nav| nav.time = Some(30));
    write(
        &top,
        &[(".robot/deep/times.toml", table.replace("planner = 21", "planner = 30"))]
            .map(|(path, text)| (path.to_owned(), text)),
    );
    let expected = "nav       ✓ 39 / 100 ms  ✓ 57 / 100 ms  later";
    let on_disk = |arguments: &[&str]| {
        let run = diff(&top, arguments);
        assert!(run.code == 1 && run.out.contains(expected), "{arguments:?}: {run:?}");
    };
    on_disk(&["HEAD", ".robot"]);
    on_disk(&["HEAD", ".robot/robot.mal"]);
    on_disk(&["HEAD", ".robot/deep/.."]);
    commit(&top, "after");
    on_disk(&["HEAD~1..HEAD", ".robot"]);
    on_disk(&["HEAD~1:.robot", "HEAD:.robot"]);
    let below = diff(&top.join(".robot"), &["HEAD~1..HEAD"]);
    assert!(below.code == 1 && below.out.contains(expected), "{below:?}");
    let top_only = diff(&top, &["HEAD~1..HEAD"]);
    assert!(top_only.code == 2 && top_only.err.contains("neither state has a deployment"), "{top_only:?}");
}

/// What only the configuration accepts or assumes is a change, with its cause.
#[test]
fn a_changed_assumption_is_a_change() {
    let top = repository("assumption");
    let mut it = robot();
    change(&mut it, "map", |map| map.time = Some(300));
    it.write(&top);
    commit(&top, "before");
    let config = std::fs::read_to_string(top.join("robot/mauve.toml")).unwrap();
    for (more, shown, summary) in [
        (
            "deployment.D.accept = { map = \"known\" }",
            "accepted none → \"known\"",
            "1 figure with other fields",
        ),
        (
            "clocks.ptp = \"1 us\"",
            "changed assumption: [clocks] ptp: none → 0.001 ms",
            "1 assumption changed",
        ),
    ] {
        write(&top, &[("robot/mauve.toml", &format!("{more}\n{config}"))]);
        let run = diff(&top, &[]);
        assert!(run.code == 0 && run.out.contains(shown) && run.out.contains(summary), "{run:?}");
        assert!(!run.out.contains("nothing changes"), "{run:?}");
    }
}

/// Whenever a signal comes, the private folder is removed, and what a killed process has left is swept by the next one.
#[test]
fn a_private_folder_never_stays() {
    use std::os::unix::fs::{chown, symlink};
    let top = repository("private");
    robot().write(&top);
    let models: Vec<(String, String)> = (0..400)
        .map(|it| (format!("robot/d{}/m{it}.mal", it % 100), format!("codel c{it}(): int\n")))
        .collect();
    write(&top, &models);
    commit(&top, "many");
    let temporary = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-tmp", test_name()));
    let start = || {
        Command::new(MAUVE)
            .args(["diff", "HEAD..HEAD"])
            .current_dir(&top)
            .env("TMPDIR", &temporary)
            .spawn()
            .unwrap()
    };
    let left = || {
        let entries =
            std::fs::read_dir(&temporary).unwrap().map(|it| it.unwrap().file_name().into_string().unwrap());
        let mut all: Vec<String> = entries.collect();
        all.sort();
        all
    };
    let of = |it: &str| temporary.join(it).join("robot").read_dir().map_or(0, Iterator::count);
    let in_the_midst = |least: usize| {
        while !left().iter().any(|it| of(it) >= least) {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    };
    for (signal, least) in [("-TERM", 1), ("-INT", 20), ("-HUP", 40), ("-TERM", 60), ("-TERM", 90)] {
        let mut child = start();
        in_the_midst(least);
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
        assert_eq!(left(), Vec::<String>::new(), "{signal} {least}");
    }
    let mut child = start();
    in_the_midst(10);
    child.kill().unwrap();
    let ended = child.wait().map(|_| child.id()).unwrap();
    assert_eq!(left().len(), 1);
    // Those of a living process and of another user, links, and other folders stay.
    let own = std::process::id();
    let names = [(own, "1"), (ended, "2"), (ended, "3"), (ended, "notes")]
        .map(|(process, it)| format!("mauve-revision-{process}-{it}"));
    let [living, linked, foreign, others] = &names;
    let elsewhere = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-elsewhere", test_name()));
    write(&elsewhere, &[("kept", "")]);
    symlink(&elsewhere, temporary.join(linked)).unwrap();
    write(
        &temporary,
        &[
            (format!("{living}/kept"), ""),
            (format!("{foreign}/kept"), ""),
            (format!("{others}/kept"), ""),
            (format!("mauve-other-{ended}-1/kept"), ""),
        ]
        .map(|(path, text)| (path, text.to_owned())),
    );
    let is_foreign = chown(temporary.join(foreign), Some(65534), None).is_ok();
    let mut kept: Vec<String> = [living, linked, others]
        .map(String::clone)
        .into_iter()
        .chain(is_foreign.then(|| foreign.clone()))
        .collect();
    kept.push(format!("mauve-other-{ended}-1"));
    kept.sort();
    assert!(start().wait().unwrap().success());
    assert_eq!(left(), kept);
    assert!(elsewhere.join("kept").exists());
}

/// An unpacked archive may have any `.git`: none shows commits of another repository, unless the user has made it himself.
#[test]
fn a_folder_of_a_stranger_shows_no_other_repository() {
    use std::os::unix::{ffi::OsStrExt as _, fs::symlink};
    let secret = branches("secret");
    let hash = git(&secret, &["rev-parse", "HEAD"]);
    let inner = secret.join(".git");
    let shown = inner.display().to_string();
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-stranger", test_name()));
    let stranger = top.join("robot");
    let empty = || git(&stranger, &["init", "--quiet"]);
    let link = |to: &Path, at: &str| {
        let at = stranger.join(at);
        let _ = std::fs::remove_dir_all(&at);
        symlink(to, at).unwrap();
    };
    let pipe = |at: &Path| assert!(Command::new("mkfifo").arg(at).status().unwrap().success());
    type Case<'a> = (&'a str, Box<dyn Fn() + 'a>);
    let cases: Vec<Case<'_>> = vec![
        (
            "which does not lead back",
            Box::new(|| write(&stranger, &[(".git", &*format!("gitdir: {shown}\n"))])),
        ),
        ("which does not lead back", Box::new(|| link(&inner, ".git"))),
        (
            "commondir` names another repository",
            Box::new(|| {
                empty();
                write(&stranger, &[(".git/commondir", &*shown)])
            }),
        ),
        (
            "`git repack -a -d` copies them",
            Box::new(|| {
                empty();
                write(&stranger, &[(".git/objects/info/alternates", &*format!("{shown}/objects\n"))])
            }),
        ),
        (
            "objects` is a link out of its folder",
            Box::new(|| {
                empty();
                link(&inner.join("objects"), ".git/objects")
            }),
        ),
        (
            "is a link out of its folder",
            Box::new(|| {
                empty();
                link(&inner.join(format!("objects/{}", &hash[..2])), &format!(".git/objects/{}", &hash[..2]))
            }),
        ),
        (
            "refs` is a link out of its folder",
            Box::new(|| {
                empty();
                link(&inner.join("refs"), ".git/refs")
            }),
        ),
        (
            "config` is a link out of its folder",
            Box::new(|| {
                empty();
                std::fs::remove_file(stranger.join(".git/config")).unwrap();
                symlink(inner.join("config"), stranger.join(".git/config")).unwrap()
            }),
        ),
        // A worktree that says of itself that it belongs there.
        (
            "commondir` names another repository",
            Box::new(|| {
                let own = stranger.join(".git").display().to_string();
                let files = [
                    (".git", "gitdir: worktrees/x\n"),
                    ("worktrees/x/gitdir", &own),
                    ("worktrees/x/commondir", &shown),
                    ("worktrees/x/HEAD", &hash),
                ];
                write(&stranger, &files);
            }),
        ),
        // Git goes on above a folder that is no repository.
        (
            "which does not lead back",
            Box::new(|| {
                write(&stranger, &[(".git/config", "")]);
                write(&top, &[(".git", &*format!("gitdir: {shown}\n"))])
            }),
        ),
        // Folders that lead elsewhere for git only.
        (
            "leads git elsewhere",
            Box::new(|| {
                write(&stranger, &[(".git/HEAD", "x"), (".git/objects/x", ""), (".git/refs/x", "")]);
                git(&top, &["init", "--quiet"]);
                write(&top, &[(".git/objects/info/alternates", &*format!("{shown}/objects\n"))])
            }),
        ),
        ("leads git elsewhere", Box::new(|| write(&stranger, &[(".git", &*format!("gitdir: {shown}\0"))]))),
        (
            "leads git elsewhere",
            Box::new(|| {
                git(&stranger, &["init", "--quiet", "good"]);
                write(&stranger, &[(".git", "gitdir:  ./good/.git\n"), (" ./x", "")]);
                link(&secret, " ./good")
            }),
        ),
        (
            "leads git elsewhere",
            Box::new(|| {
                symlink(&secret, stranger.join(std::ffi::OsStr::from_bytes(b"\xff"))).unwrap();
                std::fs::write(stranger.join(".git"), b"gitdir: \xff/.git\n").unwrap()
            }),
        ),
        (
            "pack` is a link out of its folder",
            Box::new(|| {
                empty();
                link(&inner.join("objects/pack"), ".git/objects/pack");
                std::fs::rename(stranger.join(".git/objects"), stranger.join(".git/other")).unwrap();
                symlink("other", stranger.join(".git/objects")).unwrap()
            }),
        ),
        (
            "HEAD` is a pipe or a device",
            Box::new(|| {
                empty();
                std::fs::remove_file(stranger.join(".git/HEAD")).unwrap();
                pipe(&stranger.join(".git/HEAD"))
            }),
        ),
        (
            "its configuration may include a pipe",
            Box::new(|| {
                empty();
                pipe(&stranger.join("more"));
                git(&stranger, &["config", "include.path", "../more"]);
            }),
        ),
    ];
    for (number, (why, make)) in cases.iter().enumerate() {
        let _ = std::fs::remove_dir_all(&top);
        std::fs::create_dir_all(&stranger).unwrap();
        make();
        let run = diff(&stranger, &[&format!("{hash}~1..{hash}")]);
        // A pipe gives no answer to its owner either.
        let is_pipe = why.contains("include a pipe");
        let is_refused = run.code == 2
            && run.err.contains(why)
            && run.err.contains("use `--allow-outside` if you have made") != is_pipe;
        assert!(is_refused && !run.out.contains("nav"), "{number} {why}: {run:?}");
        if [0, 1, 3, 4].contains(&number) {
            let run = diff(&stranger, &["--allow-outside", &format!("{hash}~1..{hash}")]);
            assert!(run.code == 1 && run.out.contains("nav"), "{number} {why}: {run:?}");
        }
    }
    // Runners of CI systems include files, which git may quote.
    let path = |name: &str| top.join(name).display().to_string();
    let _ = std::fs::remove_dir_all(&top);
    std::fs::create_dir_all(&stranger).unwrap();
    robot().write(&stranger);
    empty();
    commit(&stranger, "first");
    write(&top, &[("good", "[core]\n\tautocrlf = false\n"), ("bad", "[core]\n\tcompression = SECRET\n")]);
    let config = stranger.join(".git/config");
    let plain = std::fs::read_to_string(&config).unwrap();
    let comment = "#".repeat(17 << 20);
    for (name, more, is_good) in [("good", "", true), ("bad", "", false), ("bad", &*comment, false)] {
        std::fs::write(&config, format!("{plain}[include]\npath = {}\n{more}", path(name))).unwrap();
        let run = diff(&stranger, &["HEAD"]);
        assert!((run.code == 0) == is_good && !run.err.contains("SECRET"), "{run:?}");
        assert!(is_good || run.err.contains("git cannot read it: `git fsck` there says why"), "{run:?}");
    }
    // What git itself makes.
    let _ = std::fs::remove_dir_all(&top);
    std::fs::create_dir(&top).unwrap();
    git(&secret, &["worktree", "prune"]);
    git(&secret, &["worktree", "add", "--quiet", "--detach", &path("worktree")]);
    git(&top, &["clone", "--quiet", &shown, "clone"]);
    git(&top, &["clone", "--quiet", "--shared", &shown, "shared"]);
    git(&top, &["clone", "--quiet", "--depth", "2", &format!("file://{shown}"), "shallow"]);
    git(&top.join("clone"), &["pack-refs", "--all"]);
    symlink("refs/heads/topic", top.join("clone/.git/link")).unwrap();
    std::fs::rename(top.join("clone/.git/link"), top.join("clone/.git/HEAD")).unwrap();
    let below = top.join("worktree/robot");
    for folder in ["worktree", "clone", "shallow"].map(|it| top.join(it)).iter().chain([&below]) {
        let run = diff(folder, &["HEAD~1..HEAD"]);
        assert!(run.code == 1 && run.out.contains("nav"), "{}: {run:?}", folder.display());
    }
    let run = diff(&top.join("shared"), &["HEAD~1..HEAD"]);
    assert!(run.code == 2 && run.err.contains("as `git clone --shared` and `--reference` do"), "{run:?}");
    let parts = with_submodule("own").join("parts");
    let run = diff(&parts, &["HEAD~1..HEAD"]);
    assert!(run.err.contains("neither state has a deployment"), "{run:?}");
}

/// The hooks of a bare repository see what is pushed, before and after it is accepted.
#[test]
fn the_hooks_of_a_bare_repository() {
    let top = branches("pushing");
    let bare = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-bare", test_name()));
    git(&bare, &["init", "--quiet", "--bare"]);
    let address = bare.display().to_string();
    git(&top, &["push", "--quiet", &address, "main"]);
    let run = diff(&bare, &["main..main"]);
    assert!(
        run.code == 2 && run.err.contains("help: for a bare repository, name it by the variable GIT_DIR"),
        "{run:?}"
    );
    let hook = |name: &str, end: &str| {
        let script = format!(
            "#!/bin/sh\nread old new name\n{MAUVE} diff $old..$new robot >$GIT_DIR/{name}.out\n{end}\n"
        );
        programs(&bare.join("hooks"), &[(name, &script)]);
    };
    let shown = |name: &str| std::fs::read_to_string(bare.join(format!("{name}.out"))).unwrap();
    let expected = "nav       ✓ 39 / 100 ms  ✓ 57 / 100 ms  later";
    hook("pre-receive", "exit $?");
    let refused = mauve_tests::git(&top, &["push", &address, "topic:main"]);
    assert!(!refused.status.success() && shown("pre-receive").contains(expected), "{refused:?}");
    hook("pre-receive", "exit 0");
    hook("post-receive", "exit 0");
    git(&top, &["push", "--quiet", &address, "topic:main"]);
    assert!(shown("post-receive").contains(expected), "{}", shown("post-receive"));
    // A variable that names another repository is not that of a hook, nor is another folder of objects.
    let other = branches("other");
    let run = |git_dir: &Path, objects: &Path| {
        let mut run = Command::new(MAUVE);
        run.args(["diff", "topic~1..topic"])
            .current_dir(&bare)
            .env("GIT_DIR", git_dir)
            .env("GIT_QUARANTINE_PATH", objects);
        run.output().unwrap().status.code()
    };
    assert_eq!(run(&other.join(".git"), &other), Some(2));
    assert_eq!(run(&bare, &other.join(".git/objects")), Some(2));
}

#[test]
fn a_foreign_owner_and_names_that_are_not_utf_8() {
    use std::os::unix::ffi::OsStrExt as _;
    let top = repository("owner");
    let folder = top.join(std::ffi::OsStr::from_bytes(b"r\xff\xfe"));
    let mut it = robot();
    it.write(&top);
    std::fs::rename(top.join("robot"), &folder).unwrap();
    commit(&top, "before");
    change(&mut it, "nav", |nav| nav.time = Some(30));
    let table = std::fs::read_to_string(folder.join("times.toml")).unwrap();
    std::fs::write(folder.join("times.toml"), table.replace("planner = 21", "planner = 30")).unwrap();
    for format in ["text", "json", "markdown"] {
        let run = diff(&folder, &["--format", format]);
        assert!(run.code == 1 && run.out.contains("nav"), "{run:?}");
        let run = diff(&top, &["--format", format]);
        assert!(run.code == 1 && run.out.contains("nav"), "{run:?}");
    }
    for command in ["check", "wcrt", "chains"] {
        let run = mauve(MAUVE, &folder, &[command, "--format", "json"]);
        assert!(run.code == 0 && document(&run).is_object(), "{command}: {run:?}");
    }
    if std::os::unix::fs::chown(&top, Some(65534), None).is_ok() {
        let run = Command::new(MAUVE)
            .arg("diff")
            .current_dir(&top)
            .env("GIT_CONFIG_GLOBAL", "/dev/null")
            .env("GIT_CONFIG_NOSYSTEM", "1")
            .output()
            .unwrap();
        let err = String::from_utf8_lossy(&run.stderr);
        let said = format!(
            "help: if you trust its owner, run `git config --global --add safe.directory {}`",
            top.display()
        );
        assert!(
            run.status.code() == Some(2) && err.contains("dubious ownership") && err.contains(&said),
            "{run:?}"
        );
    }
}

/// Returns a file of YAML as JSON, where there is a parser for it.
fn yaml(path: &Path) -> Option<Value> {
    let parse = "import json, sys, yaml\nprint(json.dumps(yaml.safe_load(open(sys.argv[1]))))";
    let output = Command::new("python3").args(["-c", parse]).arg(path).output().ok()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() || errors.contains("No module named"), "{}: {errors}", path.display());
    serde_json::from_slice(&output.stdout).ok()
}

fn action(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.github/actions/diff")).join(file)
}

/// A repository whose branch `topic` is slower than `main`.
fn branches(name: &str) -> PathBuf {
    let top = repository(name);
    let mut it = robot();
    it.write(&top);
    commit(&top, "first");
    git(&top, &["checkout", "--quiet", "-b", "topic"]);
    change(&mut it, "nav", |nav| nav.time = Some(30));
    it.write(&top);
    commit(&top, "slower");
    top
}

#[test]
fn the_action_reports_and_fails() {
    use std::os::unix::fs::PermissionsExt as _;
    let top = branches("action");
    let out = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-out", test_name()));
    // Writes down what it is asked for; there is a comment after the first time.
    let gh = format!(
        "#!/bin/sh\nprintf '%s\\n' \"$*\" >>{0}/calls\ncase \"$*\" in *--jq*) cat {0}/comments 2>/dev/null || true;; esac\n",
        out.display()
    );
    write(&out, &[("bin/gh", gh.as_str())]);
    std::fs::set_permissions(out.join("bin/gh"), std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", out.join("bin").display(), std::env::var("PATH").unwrap());
    let run = |variables: &[(&str, &str)]| {
        for file in ["summary", "output", "calls"] {
            std::fs::write(out.join(file), "").unwrap();
        }
        let output = Command::new("bash")
            .arg(action("diff"))
            .current_dir(&top)
            .env("PATH", &path)
            .env("MAUVE", MAUVE)
            .env("RUNNER_TEMP", &out)
            .env("MAUVE_OUT", out.join("diff.md"))
            .env("GITHUB_STEP_SUMMARY", out.join("summary"))
            .env("GITHUB_OUTPUT", out.join("output"))
            .env("GITHUB_REPOSITORY", "robots/robot")
            .envs(variables.iter().copied())
            .output()
            .unwrap();
        let [summary, set, calls] =
            ["summary", "output", "calls"].map(|file| std::fs::read_to_string(out.join(file)).unwrap());
        (
            output.status.code().unwrap(),
            summary,
            set,
            calls,
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    };
    let worse = "❌ **Response times:** 1 figure worse";
    for (variables, code, begins, set) in [
        (&[("MAUVE_BASE", "main")][..], 1, worse, "worse=true\n"),
        (&[("MAUVE_BASE", "main"), ("MAUVE_PATH", "robot")], 1, worse, "worse=true\n"),
        (&[("MAUVE_BASE", "main"), ("MAUVE_FAIL", "false")], 0, worse, "worse=true\n"),
        (
            &[("MAUVE_BASE", "main"), ("MAUVE_TOLERANCE", "50%")],
            0,
            "✅ **Response times:** 1 figure later",
            "worse=false\n",
        ),
        (&[("MAUVE_BASE", "topic")], 0, "✅ **Response times:** nothing changes", "worse=false\n"),
        // A push that made the branch.
        (&[("MAUVE_BASE", "0000000000000000000000000000000000000000")], 1, worse, "worse=true\n"),
        (&[], 1, worse, "worse=true\n"),
        (&[("MAUVE_BASE", "$(touch taken)`touch taken`; touch taken")], 2, "", ""),
        (&[("MAUVE_BASE", "--help")], 2, "", ""),
        (&[("MAUVE_BASE", "main"), ("MAUVE_PATH", "--help")], 2, "", ""),
        (&[("MAUVE_BASE", "main"), ("MAUVE_TOLERANCE", "--help")], 2, "", ""),
        (&[("GITHUB_WORKSPACE", "/nowhere"), ("MAUVE_FAIL", "false")], 2, "", ""),
    ] {
        let found = run(variables);
        let is_empty = begins.is_empty() == found.1.is_empty();
        assert!(
            found.0 == code && found.1.starts_with(begins) && is_empty && found.2 == set,
            "{variables:?}: {found:?}"
        );
        assert!(found.3.is_empty() && !top.join("taken").exists(), "{variables:?}: {found:?}");
    }
    // One comment, which the next run updates.
    let numbered = [("MAUVE_BASE", "main"), ("MAUVE_COMMENT", "7")];
    let comments = "repos/robots/robot/issues/7/comments";
    let body = format!("--field body=@{}", out.join("diff.md.comment").display());
    let (_, _, _, calls, _) = run(&numbered);
    assert!(calls.ends_with(&format!("api --silent --method POST {comments} {body}\n")), "{calls}");
    std::fs::write(out.join("comments"), "41\n42\n").unwrap();
    let (code, _, _, calls, _) = run(&numbered);
    let update = format!("api --silent --method PATCH repos/robots/robot/issues/comments/41 {body}\n");
    assert!(code == 1 && calls.ends_with(&update), "{calls}");
    let text = std::fs::read_to_string(out.join("diff.md.comment")).unwrap();
    assert!(text.starts_with("<!-- mauve diff -->\n❌"), "{text}");
    // Without the permission, the summary remains.
    write(&out, &[("bin/gh", "#!/bin/sh\nexit 1\n")]);
    let (code, summary, _, _, err) = run(&numbered);
    assert!(
        code == 1 && summary.starts_with(worse) && err.contains("the comment cannot be written"),
        "{err}"
    );
    // No script has a value of an event in it.
    let Some(parsed) = yaml(&action("action.yml")) else { return };
    assert_eq!(parsed["runs"]["using"], "composite");
    for step in parsed["runs"]["steps"].as_array().unwrap() {
        let script = step["run"].as_str().unwrap();
        assert!(step["shell"] == "bash" && !script.contains("${{"), "{step}");
    }
    assert!(parsed["runs"]["steps"][1]["run"].as_str().unwrap().ends_with("/diff\""));
}

/// A folder of stand-ins for cargo and gh. As the real ones do, cargo starts the toolchain and the wrapper that files in and above the
/// current folder name; it installs this `mauve`. Each writes down where it runs.
fn stand_ins(out: &Path) -> PathBuf {
    let cargo = format!(
        "#!/bin/bash\necho \"cargo in $PWD: $* ($CARGO_HOME, $RUSTUP_TOOLCHAIN)\" >>{0}/calls\nat=$PWD\nwhile :; do\n\
         [ -n \"$RUSTUP_TOOLCHAIN\" ] || [ ! -f $at/rust-toolchain.toml ] || $at/$(sed -n 's/^path = \"\\(.*\\)\"/\\1/p' $at/rust-toolchain.toml)/bin/cargo\n\
         [ ! -f $at/.cargo/config.toml ] || $at/$(sed -n 's/^rustc-wrapper = \"\\(.*\\)\"/\\1/p' $at/.cargo/config.toml) rustc\n\
         [ -n \"$at\" ] || break; at=${{at%/*}}\ndone\n\
         while [ $# -gt 0 ]; do [ \"$1\" != --root ] || {{ mkdir -p \"$2/bin\"; ln -sf {MAUVE} \"$2/bin/mauve\"; }}; shift; done\n",
        out.display()
    );
    let gh = format!("#!/bin/bash\necho \"gh in $PWD: $*\" >>{}/calls\n", out.display());
    let bin = out.join("bin");
    programs(&bin, &[("cargo", &cargo), ("gh", &gh)]);
    bin
}

fn programs(folder: &Path, all: &[(&str, &str)]) {
    use std::os::unix::fs::PermissionsExt as _;
    write(folder, all);
    for (name, _) in all {
        std::fs::set_permissions(folder.join(name), std::fs::Permissions::from_mode(0o755)).unwrap();
    }
}

/// A branch that has a program for whatever a job may look up in its checkout; each leaves a mark.
fn hostile_branch(name: &str, mark: &Path) -> PathBuf {
    let top = branches(name);
    let trap = format!("#!/bin/sh\necho \"$0 $*\" >>'{}'\nexit 0\n", mark.display());
    let names = [
        "cargo",
        "rustc",
        "rustup",
        "git",
        "gh",
        "mauve",
        "bash",
        "sh",
        "env",
        "cat",
        "head",
        "mktemp",
        "mkdir",
        "rm",
        "cp",
        "ln",
        "wrapper",
        "start",
        "tool/bin/cargo",
        "tool/bin/rustc",
    ];
    programs(&top, &names.map(|it| (it, trap.as_str())));
    let files = [
        ("rust-toolchain.toml", "[toolchain]\npath = \"tool\"\n"),
        (".cargo/config.toml", "[build]\nrustc-wrapper = \"wrapper\"\n"),
    ];
    write(&top, &files);
    let elsewhere = mark.with_extension("victim");
    std::fs::write(&elsewhere, "kept").unwrap();
    std::os::unix::fs::symlink(&elsewhere, top.join("mauve-diff.md")).unwrap();
    commit(&top, "hostile");
    with_traps(&top, mark);
    git(&top, &["config", "--unset", "extensions.partialClone"]);
    top
}

/// What the steps of the action and the lines of the template execute, as they are shipped, in the checkout of a hostile branch.
#[test]
fn a_hostile_branch_executes_nothing_in_a_job() {
    let (Some(parsed), Some(template)) = (yaml(&action("action.yml")), yaml(&action("gitlab.yml"))) else {
        return;
    };
    let out = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-out", test_name()));
    let (mark, temp) = (out.join("mark"), out.join("temp"));
    std::fs::create_dir(&temp).unwrap();
    let (bin, actions) = (stand_ins(&out), action("diff").parent().unwrap().to_owned());
    let top = hostile_branch("action", &mark);
    let path = format!(".:tool/bin::{}:{}", bin.display(), std::env::var("PATH").unwrap());
    let is_marked = || std::fs::remove_file(&mark).is_ok();
    let job = |folder: &Path, top: &Path, script: &str| {
        let mut bash = Command::new("/bin/bash");
        bash.args(["--noprofile", "--norc", "-eo", "pipefail", "-c", script]).current_dir(folder);
        bash.env("PATH", &path).env("BASH_ENV", top.join("start")).env_remove("RUSTUP_TOOLCHAIN");
        bash
    };
    // The traps are set.
    for script in ["cargo install", "PATH=${PATH#.:tool/bin::}; cargo install", "true"] {
        assert!(job(&top, &top, script).status().is_ok() && is_marked(), "{script}");
    }
    let calls = || std::fs::read_to_string(out.join("calls")).unwrap();
    std::fs::write(out.join("calls"), "").unwrap();
    let values = |it: &Value| {
        let all = it.as_object().cloned().unwrap_or_default().into_iter();
        all.map(|(name, it)| (name, it.as_str().unwrap().to_owned()))
    };
    for step in parsed["runs"]["steps"].as_array().unwrap() {
        // A step begins in the checkout, unless it says otherwise.
        let folder = if step["working-directory"] == "${{ runner.temp }}" { &temp } else { &top };
        let plain = values(&step["env"]).filter(|(_, it)| !it.contains("${{"));
        let ran = job(folder, &top, step["run"].as_str().unwrap())
            .envs(plain)
            .env("GITHUB_ACTION_PATH", &actions)
            .env("GITHUB_WORKSPACE", &top)
            .env("GITHUB_REPOSITORY", "robots/robot")
            .env("RUNNER_TEMP", &temp)
            .env("MAUVE", temp.join("mauve/bin/mauve"))
            .env("MAUVE_OUT", temp.join("diff.md"))
            .env("MAUVE_BASE", "main")
            .env("MAUVE_COMMENT", "7")
            .output()
            .unwrap();
        let is_last = step["id"] == "diff";
        assert_eq!(ran.status.code(), Some(i32::from(is_last)), "{step}: {ran:?}");
        assert!(!is_marked(), "{step}");
    }
    let text = std::fs::read_to_string(temp.join("diff.md")).unwrap();
    assert!(text.starts_with("❌ **Response times:** 1 figure worse"), "{text}");
    let (here, source) = (temp.join("mauve"), actions.join("../../../server"));
    let built = format!(
        "cargo in {0}: install --locked --path {1} --root {0} ({0}/cargo, stable)\n",
        here.display(),
        source.display()
    );
    let said = calls();
    assert!(said.starts_with(&built), "{said}");
    assert!(
        said.contains(&format!("gh in {}: api", temp.display()))
            && !said.contains(&format!("in {}", top.display())),
        "{said}"
    );
    // A program of the checkout is not the one of the user.
    for named in ["./mauve", "nothing", "tool/bin/cargo"] {
        let ran = job(&temp, &top, &format!("source '{}'", action("diff").display()))
            .env("BASH_ENV", "")
            .env("GITHUB_WORKSPACE", &top)
            .env("RUNNER_TEMP", &temp)
            .env("MAUVE", named)
            .output()
            .unwrap();
        let err = String::from_utf8_lossy(&ran.stderr);
        assert!(
            ran.status.code() == Some(2) && err.contains(&format!("there is no program `{named}`")),
            "{ran:?}"
        );
    }
    // GitLab: a runner begins in the checkout.
    let job_of_template = &template["mauve-diff"];
    let lines = ["before_script", "script"].map(|key| {
        job_of_template[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| it.as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    });
    std::fs::write(out.join("calls"), "").unwrap();
    let ran = job(&top, &top, &lines.concat().join("\n"))
        .envs(values(&job_of_template["variables"]))
        .env("MAUVE_REPOSITORY", "https://example.org/mauve.git")
        .env("CI_PROJECT_DIR", &top)
        .env("CI_MERGE_REQUEST_DIFF_BASE_SHA", "main")
        .env("TMPDIR", &temp)
        .output()
        .unwrap();
    assert_eq!(ran.status.code(), Some(1), "{ran:?}");
    assert!(!is_marked());
    let result = top.join("mauve-diff.md");
    assert!(std::fs::read_to_string(&result).unwrap().starts_with("❌") && !result.is_symlink());
    assert_eq!(std::fs::read_to_string(mark.with_extension("victim")).unwrap(), "kept");
    let said = calls();
    let version = concat!("v", env!("CARGO_PKG_VERSION"));
    let built = format!(
        "install --locked --git https://example.org/mauve.git --tag {version} --root {}/tmp.",
        temp.display()
    );
    assert!(
        said.starts_with(&format!("cargo in {}/tmp.", temp.display())) && said.contains(&built),
        "{said}"
    );
    assert!(said.ends_with("/cargo, 1.90.0)\n"), "{said}");
}

#[test]
fn the_template_of_gitlab_reports_and_fails() {
    let Some(parsed) = yaml(&action("gitlab.yml")) else { return };
    let job = &parsed["mauve-diff"];
    let programs = Path::new(MAUVE).parent().unwrap().display().to_string();
    let path = format!("{programs}:{}", std::env::var("PATH").unwrap());
    let top = branches("gitlab");
    let script = |key: &str| {
        let lines = job[key].as_array().unwrap().iter().map(|line| line.as_str().unwrap());
        lines.collect::<Vec<_>>().join("\n")
    };
    let run = |base: &str, tolerance: &str| {
        // As a runner does: all lines in one shell, which ends with the first that fails.
        let output = Command::new("bash")
            .args([
                "-e",
                "-o",
                "pipefail",
                "-c",
                &format!("{}\n{}", script("before_script"), script("script")),
            ])
            .current_dir(&top)
            .env("PATH", &path)
            .envs(job["variables"].as_object().unwrap().iter().map(|(name, it)| (name, it.as_str().unwrap())))
            .env("CI_MERGE_REQUEST_DIFF_BASE_SHA", base)
            .env("CI_PROJECT_DIR", &top)
            .env("MAUVE_TOLERANCE", tolerance)
            .output()
            .unwrap();
        (output.status.code().unwrap(), std::fs::read_to_string(top.join("mauve-diff.md")).unwrap())
    };
    let (code, text) = run("main", "0");
    assert!(code == 1 && text.starts_with("❌ **Response times:** 1 figure worse"), "{text}");
    let (code, text) = run("main", "50%");
    assert!(code == 0 && text.starts_with("✅"), "{text}");
    assert_eq!(run("$(touch taken)", "0").0, 2);
    assert!(!top.join("taken").exists());
    assert_eq!(job["artifacts"]["paths"][0], "mauve-diff.md");
}
