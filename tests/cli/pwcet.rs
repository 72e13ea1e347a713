//! `mauve pwcet`: from executions in a file to the times of a table, and to the response times of a model.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_tests::{Run, mauve, own_scratch};

use crate::MAUVE;

/// A project with two codels of 100 ms periods.
const MODEL: &str = "library robot {
  codel scan(): int
  codel avoid(): int
  shell S { }
  core LaserCore(S) { update = { scan(); } }
  core PilotCore(S) { update = { avoid(); } }
  component Laser(S, LaserCore)
  component Pilot(S, PilotCore)
  architecture Robot { instance laser: Laser  instance pilot: Pilot }
  deployment Run {
    architecture Robot
    activity laser { priority = 2  period = 100  deadline = 50 }
    activity pilot { priority = 1  period = 100 }
  }
}
";

/// Makes a project with the samples of 2000 executions: exponential with these means, in milliseconds, after 10 ms.
fn project(name: &str, scan: f64, avoid: f64) -> PathBuf {
    let folder = own_scratch(name);
    let mut lines = String::from("codel,execution_ns,instance\n");
    // The quantiles of the distribution, in an order that looks random.
    for index in 0..2000_u32 {
        let share = f64::from(index * 1213 % 2000) / 2000.0 + 0.000_25;
        for (codel, instance, mean) in [("robot.scan", "laser", scan), ("robot.avoid", "pilot", avoid)] {
            let _ = writeln!(lines, "{codel},{:.0},{instance}", 1e7 - mean * 1e6 * share.ln());
        }
    }
    for (file, text) in [
        ("robot.mal", MODEL),
        ("mauve.toml", "[timing]\ntables = [\"timing.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n"),
        ("timing.toml", "unit = \"ms\"\n[codel]\n# by hand\n\"robot.avoid\" = 30\n"),
        ("run.csv", &lines),
    ] {
        std::fs::write(folder.join(file), text).unwrap();
    }
    let imported = mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    folder
}

fn mauve_in(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, arguments)
}

fn table(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("timing.toml")).unwrap()
}

/// A small drone: the codels of its instances, and how many executions of them are recorded.
const DRONE: [(&str, u32); 5] =
    [("gyro", 6000), ("filter", 6000), ("mix", 4000), ("detect", 300), ("replan", 12)];

/// Makes the project of the drone, with assumed times and one by hand, and its samples: `gyro` has a light tail, `filter` depends on its
/// last execution, `mix` takes few distinct times, `detect` has a heavy tail, and `replan` is rare.
fn drone(name: &str) -> PathBuf {
    let folder = own_scratch(name);
    let mut model = String::from("library uav {\n  shell S { }\n");
    let (mut instances, mut activities) = (String::new(), String::new());
    let mut lines = String::from("codel,execution_ns,instance\n");
    for (index, (codel, count)) in DRONE.into_iter().enumerate() {
        let _ = writeln!(
            model,
            "  codel {codel}(): int\n  core {codel}_core(S) {{ update = {{ {codel}(); }} }}\n  component {codel}_component(S, {codel}_core)"
        );
        let _ = writeln!(instances, "    instance i_{codel}: {codel}_component");
        let _ = writeln!(activities, "    activity i_{codel} {{ priority = {} period = 1000 }}", 9 - index);
        let (mut state, mut seed) = (0.0, 5_u64);
        for execution in 0..count {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let share = ((seed >> 33) as f64 + 0.5) / f64::from(1_u32 << 31);
            let random = -share.ln();
            state = 0.9 * state + 0.1 * random;
            let micros = match codel {
                "filter" => 50.0 + 10.0 * state,
                "mix" => 7.0 + f64::from(execution * 7 % 13 / 2),
                "detect" => 20.0 * share.powf(-0.8),
                _ => 20.0 + 5.0 * random,
            };
            let _ = writeln!(lines, "uav.{codel},{:.0},i_{codel}", micros * 1000.0);
        }
    }
    let _ = writeln!(
        model,
        "  architecture A {{\n{instances}  }}\n  deployment Flight {{\n    architecture A\n{activities}  }}\n}}"
    );
    let table = "unit = \"us\"\n[codel]\ngyro = 900 # assumed: as on the last drone\n\"uav.filter\" = 900   # assumed\n\
                 \"uav.mix\" = 800\n";
    for (file, text) in [
        ("uav.mal", model.as_str()),
        (
            "mauve.toml",
            "[timing]\ntables = [\"timing.toml\"]\n[assume]\ncodel = \"1 ms\"\n[platform]\ncpus = 1\nrt_throttling = false\n",
        ),
        ("timing.toml", table),
        ("run.csv", &lines),
    ] {
        std::fs::write(folder.join(file), text).unwrap();
    }
    let imported = mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    folder
}

#[test]
fn a_codel_has_one_line_and_a_warning_is_named_once() {
    let folder = drone("pwcet-lines");
    let found = mauve_in(&folder, &["pwcet", "run.samples", "--project", "."]);
    for (codel, count) in DRONE {
        let lines: Vec<&str> =
            found.out.lines().filter(|it| it.starts_with(&format!("  uav.{codel} "))).collect();
        assert!(lines.len() == 1 && lines[0].contains(&count.to_string()), "{codel}: {}", found.out);
    }
    assert!(
        found.out.starts_with("95 % upper bounds in ms from n executions, at 1e-4, the level of the project"),
        "{}",
        found.out
    );
    let dependent = found.out.lines().filter(|it| it.contains("dependent-executions: ")).count();
    assert!(dependent == 1 && found.out.contains("uav.filter"), "{}", found.out);
    // A page for each kind; without a time, the next step.
    let kinds = found.out.lines().filter_map(|it| Some(it.strip_prefix("  ")?.split_once(": ")?.0));
    let kinds: Vec<&str> = kinds.collect();
    assert!(kinds.contains(&"too-few-executions"), "{kinds:?}");
    for kind in kinds {
        let page = mauve_in(&folder, &["explain", kind]);
        assert!(page.code == 0 && page.out.starts_with(&format!("# {kind}\n")), "{kind}: {}", page.err);
    }
    assert!(found.out.contains("✗ needs 188 more"), "{}", found.out);
    // 6000 executions with a light tail: a verdict at 1e-4 is not that of 1e-3, which is counted.
    let verdict = |arguments: &[&str]| {
        let all = ["pwcet", "run.samples", "--levels"];
        let found = mauve_in(&folder, &[&all, arguments].concat()).out;
        let line = found.lines().find(|it| it.starts_with("  uav.gyro ")).unwrap().to_owned();
        line.split_whitespace().skip(4).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(verdict(&["1e-3"]), "✓");
    assert_eq!(verdict(&["1e-4"]), "~ extrapolated");
    assert!(verdict(&["1e-3,1e-4"]).ends_with(" ~ ~ extrapolated"), "{}", verdict(&["1e-3,1e-4"]));
    let next = found.out.lines().find(|it| it.starts_with("  mauve measure ")).unwrap();
    assert!(
        next.contains("uav.replan") && next.ends_with(" --codels DIR -n 100000 -o run.samples"),
        "{next}"
    );
    let words = found.out.lines().filter(|it| !it.starts_with("  mauve "));
    let longest = words.map(|it| it.chars().count()).max();
    assert!(longest <= Some(80) && found.out.lines().count() < 28, "{}", found.out);
    // Everything is in the document and, with `--levels`, in the table.
    let all = mauve_in(&folder, &["pwcet", "run.samples", "--format", "json"]);
    let all: serde_json::Value = serde_json::from_str(&all.out).unwrap();
    assert_eq!(all["levels"].as_array().unwrap().len(), 7);
    let several = mauve_in(&folder, &["pwcet", "run.samples", "--levels", "1e-3,1e-6"]);
    assert!(several.out.contains("  1e-3  ") && several.out.contains("  1e-6\n"), "{}", several.out);
}

/// The next steps: what alone has too few executions is executed alone, with its inputs; what has a tail without a bound in the robot is
/// recorded there for longer, since no other executions say how long these are.
#[test]
fn the_next_steps_can_be_followed() {
    let folder = own_scratch("pwcet-next");
    let mut model = String::from("library uav {\n  shell S { }\n");
    let (mut instances, mut activities) = (String::new(), String::new());
    for (codel, input, call) in
        [("tail", "", "tail();"), ("replan", "in state: int", "n = replan(n);"), ("never", "", "never();")]
    {
        let _ = writeln!(
            model,
            "  codel {codel}({input}): int\n  core {codel}_core(S) {{ var n: int; update = {{ {call} }} }}\n  component {codel}_c(S, {codel}_core)"
        );
        let _ = writeln!(instances, "    instance i_{codel}: {codel}_c");
        let _ = writeln!(activities, "    activity i_{codel} {{ priority = 1 period = 1000 }}");
    }
    let _ = writeln!(
        model,
        "  architecture A {{\n{instances}  }}\n  deployment D {{\n    architecture A\n{activities}  }}\n}}"
    );
    let configuration = "assume = { codel = \"1 ms\" }\nplatform = { cpus = 1, rt_throttling = false }\n\
                         [generate]\nout = \"src\"\nmaintainer = \"A <a@b.org>\"\nlicense = \"MIT\"\n";
    let mut lines = String::from("codel,execution_ns,instance,elapsed_ns,time_ns\n");
    for index in 0..900_u64 {
        let share = (index * 577 % 900) as f64 / 900.0 + 0.000_5;
        let _ = writeln!(lines, "uav.tail,{:.0},i_tail,,{}", 2e4 * share.powf(-1.3), index * 50_000_000);
    }
    lines += &"uav.replan,15000000,i_replan,,\n".repeat(12);
    for (file, text) in [("uav.mal", model.as_str()), ("mauve.toml", configuration), ("run.csv", &lines)] {
        std::fs::write(folder.join(file), text).unwrap();
    }
    assert_eq!(mauve_in(&folder, &["generate"]).code, 0);
    assert_eq!(mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]).code, 0);
    let next = || {
        let found = mauve_in(&folder, &["pwcet", "run.samples", "--project", "."]);
        let next = found.out.split("\nNext:\n").nth(1).unwrap_or(&found.out);
        next.split("\n\n").next().unwrap().to_owned()
    };
    // Twice 29,956 executions, 900 of which are there, each 50 ms.
    assert_eq!(
        next(),
        "No execution was recorded of: uav.never\n\
         Record the robot for longer, above all for uav.tail:\n  \
         mauve run --codels ./src --for 50min --trace more --inputs\n  \
         mauve trace import more -o run.samples\n\
         Execute alone what runs rarely in the robot:\n  \
         mauve measure uav.replan --codels ./src --inputs more/inputs.toml -n 8000 -o run.samples\n  \
         mauve measure uav.never --codels ./src -n 100000 -o run.samples\n"
    );
    // Once it was executed alone, only the robot can show more of `replan`; and cold executions are a hundredth of all.
    let mut lines = String::from("codel,execution_ns,instance\n");
    for index in 0..20_000_u64 {
        let _ = writeln!(lines, "uav.replan,{},(alone warm)", 5_000_000 + index * 577 % 20_000);
        let _ = writeln!(lines, "uav.never,{},(alone warm)", 5_000 + index * 577 % 20_000);
    }
    for index in 0..300_u64 {
        let share = (index * 77 % 300) as f64 / 300.0 + 0.001;
        let _ = writeln!(lines, "uav.never,{:.0},(alone cold)", 2e3 * share.powf(-1.3));
    }
    std::fs::write(folder.join("alone.csv"), lines).unwrap();
    assert_eq!(mauve_in(&folder, &["trace", "import", "alone.csv", "-o", "run.samples"]).code, 0);
    let next = next();
    assert!(next.contains("mauve measure uav.never --codels ./src -n 5991200 -o"), "{next}");
    assert!(!next.contains("measure uav.replan") && !next.contains("--inputs"), "{next}");
}

#[test]
fn an_absurd_bound_is_explained_and_not_written() {
    let folder = drone("pwcet-absurd");
    let run = |levels: &str| {
        let options = ["pwcet", "run.samples", "-o", "new.toml", "--levels", levels];
        mauve_in(&folder, &options)
    };
    let found = run("1e-3,1e-9");
    let line = found.out.lines().find(|it| it.contains("uav.detect ")).unwrap();
    assert!(
        line.contains("—") && line.ends_with("✗ no time at this level") && found.code == 1,
        "{}",
        found.out
    );
    assert!(found.out.contains("\n  absurd-bound: uav.detect\n"), "{}", found.out);
    assert!(found.out.contains("leave them out (--levels)"), "{}", found.out);
    let written = std::fs::read_to_string(folder.join("new.toml")).unwrap();
    assert!(written.contains("uav.gyro") && !written.contains("uav.detect"), "{written}");
}

/// A new table has the levels at which no codel is lost that has a time at the level of the project.
#[test]
fn a_new_table_has_the_levels_that_the_executions_support() {
    let folder = project("pwcet-new-levels", 1.0, 0.5);
    let coarse: String =
        (0..40_000).map(|it| format!("robot.tick,{},laser\n", 10_000 + it % 7 * 1000)).collect();
    std::fs::write(folder.join("more.csv"), format!("codel,execution_ns,instance\n{coarse}")).unwrap();
    mauve_in(&folder, &["trace", "import", "more.csv", "-o", "run.samples"]);
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "new.toml"]);
    let table = mauve_timing::Table::parse(&std::fs::read_to_string(folder.join("new.toml")).unwrap());
    let levels: Vec<f64> = table.levels.iter().map(|it| it.as_f64()).collect();
    assert_eq!((levels.as_slice(), table.codels.len()), (&[1e-3, 1e-4][..], 3), "{}{}", found.out, found.err);
    assert!(
        found.err.contains("has the measured times of 3 codels and ports, at 1e-3,1e-4"),
        "{}",
        found.err
    );
}

#[test]
fn records_are_short_and_older_ones_are_read() {
    let folder = drone("pwcet-short");
    let update = ["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-3"];
    mauve_in(&folder, &update);
    let text = table(&folder);
    let record = text.split("[measured.\"uav.filter\"]").nth(1).unwrap();
    let warnings = record.lines().find(|it| it.starts_with("warnings = ")).unwrap();
    let kinds: Vec<&str> = warnings.split('"').skip(1).step_by(2).collect();
    assert!(
        kinds.contains(&"dependent-executions") && kinds.iter().all(|it| !it.contains(' ')),
        "{warnings}"
    );
    assert!(text.lines().all(|line| line.len() <= 120), "{text}");
    let hints = mauve_in(&folder, &["check", "--hints"]).out;
    assert!(hints.contains("the measured time of `uav.filter` has warnings: "), "{hints}");
    // A table of an earlier version.
    let sentence = "executions depend on earlier ones (runs about the median: p = 0.025): the confidence is less than 95 %";
    std::fs::write(
        folder.join("timing.toml"),
        text.replace("\"dependent-executions\"", &format!("\"{sentence}\"")),
    )
    .unwrap();
    let checked = mauve_in(&folder, &["check", "--hints"]);
    assert!(checked.out.contains(sentence) && !checked.out.contains("invalid-table"), "{}", checked.out);
    assert!(mauve_timing::Table::parse(&table(&folder)).measured.iter().any(|it| it.is_dependent()));
    mauve_in(&folder, &update);
    assert_eq!(table(&folder), text);
}

#[test]
fn assumed_times_are_replaced_and_the_share_of_measured_ones_is_shown() {
    let folder = drone("pwcet-assumed");
    let heading = || {
        let checked = mauve_in(&folder, &["check"]).out;
        let heading = checked.lines().find(|it| it.starts_with("Flight: ")).unwrap_or_default().to_owned();
        let summary = checked.lines().find(|it| it.contains("deadlines are proved")).unwrap_or_default();
        assert!(!summary.contains("assumed") && !summary.contains("measured"), "{checked}");
        heading
    };
    assert!(heading().ends_with("; 0 of 5 execution times measured, 4 assumed"), "{}", heading());
    let update = ["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-3"];
    let found = mauve_in(&folder, &update);
    let kept = "`timing.toml` keeps the time by hand of `uav.mix`: --replace overwrites it";
    assert!(found.err.contains(kept), "{}", found.err);
    assert!(found.err.contains("at 1e-3; 2 of them were assumed"), "{}", found.err);
    let text = table(&folder);
    assert!(
        !text.contains("assumed") && !text.contains("\ngyro") && text.contains("\"uav.mix\" = 800\n"),
        "{text}"
    );
    let config = std::fs::read_to_string(folder.join("mauve.toml")).unwrap();
    std::fs::write(
        folder.join("mauve.toml"),
        config.replace("[timing]\n", "[timing]\nsignificance = 1e-3\n"),
    )
    .unwrap();
    // `mix` is by hand; `detect`, whose bound is far beyond its 300 executions, and `replan` have no time, and that of `[assume]`.
    assert!(
        heading().ends_with("; 2 of 5 execution times measured (1 extrapolated), 2 assumed"),
        "{}",
        heading()
    );
}

#[test]
fn measured_times_give_response_times() {
    let folder = project("pwcet-loop", 1.0, 0.5);
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4,1e-6"]);
    assert_eq!(found.code, 0, "{}{}", found.out, found.err);
    assert!(
        found.err.contains("keeps the time by hand of `robot.avoid`: --replace overwrites it"),
        "{}",
        found.err
    );
    let text = table(&folder);
    assert!(text.contains("# by hand\n\"robot.avoid\" = 30\n\"robot.scan\" = ["), "{text}");
    assert!(text.contains("[measured.\"robot.scan\"]\nexecutions = 2000\n"), "{text}");
    // The bound at 1e-4 is above the true 10 ms + ln(1e4) ms = 19.21 ms.
    let checked = mauve_in(&folder, &["wcrt", "--format", "json"]);
    let document: serde_json::Value = serde_json::from_str(&checked.out).unwrap();
    let own = document["results"][0]["activities"][0]["own"].as_f64().unwrap();
    assert!((19.21..25.0).contains(&own), "{own}");

    let reported = mauve_in(&folder, &["pwcet", "run.samples", "--report", "report.html"]);
    assert_eq!(reported.code, 0, "{}", reported.err);
    let report = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(report.starts_with("<!") && report.contains("robot.scan") && report.contains("<svg"));

    // Again: nothing changes. By force: the entry by hand is replaced.
    mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml"]);
    assert_eq!(table(&folder), text);
    let forced = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--replace"]);
    assert_eq!(forced.code, 0, "{}", forced.err);
    assert!(
        table(&folder).contains("[measured.\"robot.avoid\"]") && !table(&folder).contains(" = 30"),
        "{}",
        table(&folder)
    );
}

#[test]
fn ports_are_estimated_and_waits_are_told() {
    let folder = own_scratch("pwcet-ports");
    let mut lines = String::from("codel,execution_ns,instance,elapsed_ns,time_ns,waits\n");
    for index in 0..2000_u32 {
        let share = f64::from(index * 1213 % 2000) / 2000.0 + 0.000_25;
        let (execution, end) = (1e6 - 1e5 * share.ln(), 10_000_000 * u64::from(index + 1));
        let _ = writeln!(lines, "robot.scan,{execution:.0},laser,8060000,{end},1");
        let _ = writeln!(lines, "(access) robot.Laser.frame,{execution:.0},laser,{execution:.0},{end},");
        let short = execution / 100.0;
        let _ = writeln!(lines, "(access) ros2.laser.frame,{short:.0},ros2,{short:.0},{end},");
        let _ = writeln!(lines, "(lock bus) robot.scan,500,laser,500,{end},");
    }
    std::fs::write(folder.join("run.csv"), lines).unwrap();
    let imported = mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    let estimate = ["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-3"];
    let found = mauve_in(&folder, &estimate);
    assert_eq!(found.code, 0, "{}{}", found.out, found.err);
    // Above the true 1 ms + 0.1 ms × ln(1e3) = 1.69 ms, as for the codel.
    let written = mauve_timing::Table::parse(&table(&folder));
    assert_eq!((written.errors.as_slice(), written.codels.len()), (&[][..], 1), "{}", table(&folder));
    let [port, topic] = &written.accesses[..] else { panic!("{}", table(&folder)) };
    assert_eq!((port.key.as_str(), &port.value), ("robot.Laser.frame", &written.codels[0].value));
    assert!(
        found.out.contains("codel or port ") && found.out.contains("robot.Laser.frame "),
        "{}",
        found.out
    );
    // Short accesses of a component are a part of its overhead, and those of a topic are not.
    assert!(topic.key == "ros2.laser.frame" && found.out.contains("ros2.laser.frame "), "{}", found.out);
    let wait = "`robot.scan` waited for up to 7.060 ms, which is in no execution time: in a timing table in us, [wait] \
                \"robot.scan\" = { time = 7100, waits = 1 }";
    assert!(found.err.contains(wait), "{}", found.err);
    // Once the table has it, nothing is to be said.
    std::fs::write(folder.join("timing.toml"), table(&folder) + "[wait]\nscan = 7100\n").unwrap();
    let found = mauve_in(&folder, &estimate);
    assert!(!found.err.contains("waited for up to"), "{}", found.err);
    assert!(table(&folder).contains("scan = 7100"), "{}", table(&folder));
}

#[test]
fn a_codel_over_its_budget_comes_first() {
    let folder = project("pwcet-budget", 6.0, 0.5);
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4"]);
    assert_eq!(found.code, 1, "{}{}", found.out, found.err);
    let first = found.out.lines().find(|line| line.contains("robot.")).unwrap();
    assert!(first.contains("robot.scan") && first.ends_with("✗ over budget"), "{first}");
    assert!(found.out.contains("mauve explain over-budget`:\n  over-budget: robot.scan\n"), "{}", found.out);
}

#[test]
fn a_table_that_cannot_be_updated_stays() {
    let folder = project("pwcet-refused", 1.0, 0.5);
    for (text, message) in [
        ("[codel]\na = -3\n", "timing.toml`, line 2: negative time -3"),
        ("levels = [1e-2]\n[codel]\na = [3]\n", "has times at other levels, which stay: use --levels 1e-2"),
    ] {
        std::fs::write(folder.join("timing.toml"), text).unwrap();
        let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4"]);
        assert!(found.code == 2 && found.err.contains(message), "{}{}", found.out, found.err);
        assert_eq!(table(&folder), text);
    }
    for (arguments, message) in [
        (&["pwcet", "run.csv"][..], "`run.csv` is not a sample file"),
        (&["pwcet", "none.samples"], "cannot read `none.samples`"),
        (&["pwcet", "run.samples", "--levels", "2"], "the level 2 is not a number between 0 and 1"),
    ] {
        let found = mauve_in(&folder, arguments);
        assert!(found.code == 2 && found.err.contains(message), "{}{}", found.out, found.err);
    }
}

#[test]
fn few_and_constant_executions_give_no_time() {
    let folder = own_scratch("pwcet-few");
    let constant = "b,5\n".repeat(300);
    std::fs::write(folder.join("run.csv"), format!("codel,execution_ns\na,1\na,2\na,3\n{constant}")).unwrap();
    mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "new.toml"]);
    assert_eq!(found.code, 1);
    let line =
        |key: &str| found.out.lines().find(|it| it.starts_with(&format!("  {key} "))).unwrap_or_default();
    let cells = |key: &str| line(key).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(cells("a"), "a 3 0.000003 — ✗ needs 197 more", "{}", found.out);
    assert_eq!(cells("b"), "b 300 0.000005 — ✗ needs 29656 more", "{}", found.out);
    assert!(found.out.contains("\n  too-few-executions: a\n  constant-times: b\n"), "{}", found.out);
    assert!(!folder.join("new.toml").exists());
}

/// Whole microseconds from 10 to 16, and 12 executions of 20: the levels with enough executions are counted.
#[test]
fn a_coarse_clock_gives_the_times_that_can_be_counted() {
    let folder = own_scratch("pwcet-coarse");
    let time = |index: u32| if index % 5000 == 7 { 20_000 } else { 10_000 + index * 7 % 13 / 2 * 1000 };
    let lines: String = (0..60_000).map(|index| format!("os.wakeup,{}\n", time(index))).collect();
    std::fs::write(folder.join("run.csv"), format!("codel,execution_ns\n{lines}")).unwrap();
    mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    // 60 of 60,000 should exceed the time of 1e-3, 6 that of 1e-4: 16 and 20 µs, and a step; 0.6 that of 1e-5.
    let with = |levels: &str| {
        mauve_in(&folder, &["pwcet", "run.samples", "--levels", levels, "--format", "json", "-o", "new.toml"])
    };
    let found = with("1e-3,1e-4,1e-5");
    let document: serde_json::Value = serde_json::from_str(&found.out).unwrap();
    assert_eq!(document["codels"][0]["bounds"], serde_json::json!([0.017, 0.021, null]));
    let said = "`new.toml` gets no time of `os.wakeup`, which has none at 1e-5: measure more, or write a table with --levels 1e-3,1e-4";
    assert!(found.code == 1 && found.err.contains(said), "{}", found.err);
    assert!(!folder.join("new.toml").exists());

    let found = with("1e-3,1e-4");
    assert_eq!(found.code, 0, "{}", found.err);
    let table = std::fs::read_to_string(folder.join("new.toml")).unwrap();
    assert!(table.contains("\"os.wakeup\" = [17, 21]"), "{table}");
    let table = mauve_in(&folder, &["pwcet", "run.samples", "--levels", "1e-3,1e-5"]).out;
    assert!(table.contains("✗ needs 239572 more") && table.contains("coarse-clock: os.wakeup"), "{table}");
}

#[test]
fn a_measurement_becomes_outdated() {
    let folder = project("pwcet-outdated", 1.0, 0.5);
    std::fs::create_dir_all(folder.join("generated/robot/src/codels")).unwrap();
    let source = folder.join("generated/robot/src/codels/scan.cpp");
    std::fs::write(&source, "int scan() { return 1; }").unwrap();
    mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4"]);
    assert!(
        table(&folder).contains("source = \"generated/robot/src/codels/scan.cpp\""),
        "{}",
        table(&folder)
    );
    let hints = || mauve_in(&folder, &["check", "--hints"]).out;
    assert!(!hints().contains("outdated-measurement"), "{}", hints());

    std::fs::write(&source, "int scan() { return 2; }").unwrap();
    let changed = "`generated/robot/src/codels/scan.cpp` has changed since `robot.scan` was measured";
    assert!(hints().contains(changed), "{}", hints());

    std::fs::write(folder.join("more.csv"), "codel,execution_ns,instance\nrobot.scan,1,laser\n").unwrap();
    mauve_in(&folder, &["trace", "import", "more.csv", "-o", "run.samples"]);
    let older = "the time of `robot.scan` is older than its executions in `run.samples`";
    assert!(hints().contains(older), "{}", hints());
}

/// A heavy tail in one instance leaves the codel without a time, although the other instance has an estimate.
#[test]
fn an_instance_without_a_bound_takes_the_time_away() {
    let folder = own_scratch("pwcet-heavy-instance");
    let mut lines = String::from("codel,execution_ns,instance\n");
    for index in 0..2000_u32 {
        let share = f64::from(index * 1213 % 2000) / 2000.0 + 0.000_25;
        let _ = writeln!(lines, "robot.scan,{:.0},left", 1e7 - 1e6 * share.ln());
        let _ = writeln!(lines, "robot.scan,{:.0},right", 1e6 / share.powf(1.5));
    }
    std::fs::write(folder.join("run.csv"), lines).unwrap();
    mauve_in(&folder, &["trace", "import", "run.csv", "-o", "run.samples"]);
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "new.toml"]);
    assert_eq!(found.code, 1, "{}{}", found.out, found.err);
    assert!(found.out.contains("✗ needs 27956 more"), "{}", found.out);
    assert!(found.out.contains("endless-tail: robot.scan"), "{}", found.out);
    assert!(!folder.join("new.toml").exists());
}

#[test]
fn a_time_by_hand_that_was_exceeded_is_a_finding() {
    let folder = project("pwcet-exceeded", 1.0, 0.5);
    std::fs::write(folder.join("timing.toml"), "[codel]\n\"robot.scan\" = 12\n\"robot.avoid\" = 30\n")
        .unwrap();
    let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4"]);
    assert_eq!(found.code, 1, "{}{}", found.out, found.err);
    let exceeded =
        "`timing.toml`: the time of `robot.scan` is too short: an execution of `robot.scan` took 18.";
    assert!(found.err.contains(exceeded), "{}", found.err);
    assert!(!found.err.contains("the time of `robot.avoid` is too short"), "{}", found.err);
}

/// Executions that give no estimate refute an entry all the same, also one that lacks the library.
#[test]
fn a_time_without_its_library_that_was_exceeded_is_a_finding() {
    let folder = project("pwcet-exceeded-short", 1.0, 0.5);
    let lines = ["codel,execution_ns,instance\n".to_owned(), "robot.scan,15000000,laser\n".repeat(100)];
    std::fs::write(folder.join("few.csv"), lines.concat()).unwrap();
    mauve_in(&folder, &["trace", "import", "few.csv", "-o", "few.samples"]);
    for entry in ["\"robot.scan\"", "scan"] {
        std::fs::write(folder.join("timing.toml"), format!("[codel]\n{entry} = 12\navoid = 30\n")).unwrap();
        let found = mauve_in(&folder, &["pwcet", "few.samples", "-o", "timing.toml"]);
        let entry = entry.replace('"', "");
        let exceeded = format!("the time of `{entry}` is too short: an execution of `robot.scan` took 15 ms");
        assert!(found.code == 1 && found.err.contains(&exceeded), "{entry}: {}", found.err);
    }
}

/// Each budget leaves the times of the other codels as they were: together, the new times may be too long.
#[test]
fn new_times_that_miss_a_deadline_together_are_a_finding() {
    let folder = project("pwcet-together", 3.0, 3.0);
    let model = MODEL.replace("period = 100", "period = 70").replace("deadline = 50", "deadline = 70");
    std::fs::write(folder.join("robot.mal"), model).unwrap();
    let by_hand = "[codel]\n\"robot.scan\" = 1\n\"robot.avoid\" = 1\n";
    std::fs::write(folder.join("timing.toml"), by_hand).unwrap();
    let update = ["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4", "--replace"];
    let found = mauve_in(&folder, &update);
    assert!(!found.out.contains("over budget"), "{}", found.out);
    assert!(found.code == 1 && found.err.contains("is not proved"), "{}{}", found.out, found.err);
}

#[test]
fn new_times_of_a_project_that_is_not_analysed_are_a_finding() {
    let folder = project("pwcet-not-analysed", 0.1, 0.1);
    let update = ["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4", "--replace"];
    let found = mauve_in(&folder, &update);
    assert!(found.code == 0 && !found.err.contains("proved"), "{}{}", found.out, found.err);
    std::fs::write(folder.join("robot.mal"), MODEL.replace("period = 100", "")).unwrap();
    let found = mauve_in(&folder, &update);
    assert!(found.code == 1 && found.err.contains("is not proved"), "{}{}", found.out, found.err);
    assert!(found.err.contains("the project has 2 errors"), "{}", found.err);
}

#[test]
fn what_a_recording_lacks_is_said_with_its_times() {
    let folder = project("pwcet-lacks", 1.0, 0.5);
    let run = std::fs::read_to_string(folder.join("run.csv")).unwrap();
    let mut lines = run.lines();
    let header = format!("{},elapsed_ns", lines.next().unwrap());
    // Less time passed than the CPU was used.
    let lines: Vec<String> = lines.map(|line| format!("{line},1000")).collect();
    std::fs::write(folder.join("odd.csv"), format!("{header}\n{}\n", lines.join("\n"))).unwrap();
    mauve_in(&folder, &["trace", "import", "odd.csv", "-o", "odd.samples"]);
    let found = mauve_in(&folder, &["pwcet", "odd.samples", "-o", "timing.toml", "--levels", "1e-4"]);
    let said = "4000 executions used more CPU time than the time that passed";
    let kind = "\"incomplete-recording\"";
    assert!(found.out.contains(said) && table(&folder).contains(kind), "{}{}", found.out, table(&folder));
}

/// Links of a project lead to files of the user.
#[test]
fn tables_and_reports_are_not_written_through_links_of_a_project() {
    let folder = project("pwcet-links", 1.0, 0.5);
    let mine = folder.join("mine");
    std::fs::create_dir_all(mine.join(".git")).unwrap();
    for (file, text) in [("table.toml", "unit = \"ms\"\n"), ("report.html", "<!doctype html>mine")] {
        std::fs::write(mine.join(file), text).unwrap();
        std::os::unix::fs::symlink(mine.join(file), folder.join(format!("linked-{file}"))).unwrap();
    }
    let pwcet = |output: &str, report: &str| {
        let arguments = ["pwcet", "run.samples", "-o", output, "--report", report];
        mauve_in(&folder, &arguments)
    };
    for (output, report) in [("linked-table.toml", "new.html"), ("new.toml", "linked-report.html")] {
        let found = pwcet(output, report);
        assert!(found.code == 2 && found.err.contains("which is a link in a project, to `"), "{}", found.err);
    }
    assert_eq!(std::fs::read_to_string(mine.join("table.toml")).unwrap(), "unit = \"ms\"\n");
    assert_eq!(std::fs::read_to_string(mine.join("report.html")).unwrap(), "<!doctype html>mine");
    // Who wants it names the target. A device is no file to keep.
    let found = pwcet(mine.join("table.toml").to_str().unwrap(), "/dev/stdout");
    assert!(found.code == 1 && found.out.starts_with("<!"), "{}", found.err);
    assert!(std::fs::read_to_string(mine.join("table.toml")).unwrap().contains("robot.scan"));
}

#[test]
fn a_report_overwrites_reports_only() {
    let folder = project("pwcet-report", 1.0, 0.5);
    let before = std::fs::read(folder.join("run.samples")).unwrap();
    for path in ["run.samples", "robot.mal", "timing.toml"] {
        let found = mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--report", path]);
        assert!(
            found.code == 2 && found.err.contains("is not a report, and is not overwritten"),
            "{}",
            found.err
        );
    }
    assert_eq!(std::fs::read(folder.join("run.samples")).unwrap(), before);
    for _ in 0..2 {
        let found = mauve_in(&folder, &["pwcet", "run.samples", "--report", "r.html"]);
        assert_eq!(found.code, 0, "{}", found.err);
    }
}

/// The code that was measured is not that of today.
#[test]
fn the_same_executions_are_not_those_of_other_code() {
    let folder = project("pwcet-same", 1.0, 0.5);
    std::fs::create_dir_all(folder.join("generated/robot/src/codels")).unwrap();
    let source = folder.join("generated/robot/src/codels/scan.cpp");
    let update = || mauve_in(&folder, &["pwcet", "run.samples", "-o", "timing.toml", "--levels", "1e-4"]);
    std::fs::write(&source, "int scan() { return 1; }").unwrap();
    update();
    std::fs::write(&source, "int scan() { return 2; }").unwrap();
    update();
    let hints = mauve_in(&folder, &["check", "--hints"]).out;
    assert!(hints.contains("has changed since `robot.scan` was measured"), "{hints}");
}
