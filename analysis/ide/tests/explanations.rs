//! Every figure of an explanation adds up: the tables of random deployments, and those of hovers, also of the sample models, are read
//! again, and their sums are computed. What models have not, such as bursts, is in random task sets.
//!
//! `MAUVE_EXPLANATIONS=1000 cargo test --release -p mauve-ide --test main explanations::` tries more deployments.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};

use expect_test::expect;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Location, ModelDb, Workspace, names_of, projects};
use mauve_ide::{HoverFormat, explain_response, explain_response_of, hover};
use mauve_tests::{Random, files_in, fixture, models};
use mauve_timing::task_set::{Notation, TaskSet};
use mauve_timing::{CpuRule, Level, Method, Rounding, THROTTLING, Time};
use mauve_wcrt::{ActivityReport, Query, Reason, response_times, response_times_of, tables_of};

use serde_json::json;

use crate::project_with;

/// The number of deployments or task sets: a fifth of what was tried once, unless the environment says otherwise.
fn number() -> u64 {
    std::env::var("MAUVE_EXPLANATIONS").ok().and_then(|it| it.parse().ok()).unwrap_or(200)
}

/// Returns a deployment of two to five activities, sometimes twenty: state machines, operations between them, overhead, other work,
/// jitter, offsets, waits, locks, counters and several CPUs.
fn model(random: &mut Random) -> String {
    let count = if random.below(40) == 0 { 20 } else { 2 + random.below(4) };
    let has_lock = random.below(4) == 0;
    let mut waits = String::new();
    // Some systems are loaded, so that jobs overlap.
    let load = *random.of(&[1, 1, 4]);
    let operations: Vec<(usize, usize)> = (0..random.below(3))
        .map(|_| (random.below(count), random.below(count)))
        .filter(|(provider, client)| provider != client)
        .collect();
    let (mut model, mut times) = (String::new(), "unit = \"ms\"\n[codel]\n".to_owned());
    let (mut instances, mut activities) = (String::new(), String::new());
    let mut clocks = Vec::new();
    for number in 0..count {
        for (codel, greatest) in [("x", 40), ("y", 20), ("g", 5), ("h", 10)] {
            let time = load * random.below(greatest) / if count == 20 { 10 } else { 1 };
            let _ = writeln!(model, "codel {codel}{number}(): int");
            let _ = writeln!(times, "{codel}{number} = {}.{}", time / 10, time % 10);
            let wait = 1 + random.below(30);
            match random.below(24) {
                0 => _ = writeln!(waits, "{codel}{number} = {wait}e-1"),
                1 => {
                    let many = 1 + random.below(2);
                    let _ = writeln!(waits, "{codel}{number} = {{ time = {wait}e-1, times = {many} }}");
                }
                _ => {}
            }
        }
        let provides = operations.iter().any(|(provider, _)| *provider == number);
        let mut required: Vec<usize> = operations
            .iter()
            .filter(|(_, client)| *client == number)
            .map(|(provider, _)| *provider)
            .collect();
        required.sort_unstable();
        required.dedup();
        let _ = write!(model, "shell S{number} {{ ");
        if provides {
            let _ = write!(model, "provide help{number}(): int  ");
        }
        for provider in &required {
            let _ = write!(model, "require help{provider}(): int  ");
        }
        let _ = write!(model, "}}\ncore K{number}(S{number}) {{ ");
        if provides {
            let _ = write!(model, "provide help{number}() = {{ return h{number}(); }} ");
        }
        let mut sends = String::new();
        for provider in &required {
            let _ = write!(model, "handler of{provider}: help{provider} ");
            let _ = write!(sends, "of{provider} = send(help{provider}); ");
            let _ = writeln!(instances, "operation i{provider}.help{provider} -> i{number}.help{provider}");
        }
        let work = match random.below(4) {
            0 => {
                model += "var n: int = 0 ";
                format!("if (n > 2) then {{ y{number}(); n = 0; }} else {{ x{number}(); n = n + 1; }}")
            }
            1 => format!("if (g{number}() > 1) then {{ y{number}(); }} else {{ x{number}(); }}"),
            _ => format!("y{number}();"),
        };
        let _ = writeln!(
            model,
            "statemachine {{ initial state A {{ run = {{ x{number}(); }} transition go if (g{number}() > 0) to B }} \
             state B {{ run = {{ {work} {sends} }} transition back to A }} }} }}\n\
             component C{number}(S{number}, K{number})"
        );
        let _ = writeln!(instances, "instance i{number}: C{number}");
        let period = *random.of(&[10, 20, 40, 50]);
        let affinity = if has_lock { 1 } else { *random.of(&[1, 1, 1, 2, 3]) };
        let priority = 1 + random.below(count);
        let _ = write!(
            activities,
            "activity i{number} {{ priority = {priority} affinity = {affinity} period = {period} "
        );
        if random.below(4) == 0 {
            let _ = write!(activities, "jitter = 0.{} ", 1 + random.below(9));
        }
        if random.below(2) == 0 {
            clocks.push(format!("\"i{number}\""));
            let _ = write!(activities, "offset = {} ", random.below(period));
        }
        activities += "}\n";
    }
    if let (0, Some((first, rest))) = (random.below(5), activities.split_once('\n')) {
        // The first two share a thread.
        let rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
        activities =
            format!("{}\n{rest}", first.replace("activity i0 {", "activity t { instances = [i0, i1]"));
        clocks.retain(|it| !["\"i0\"", "\"i1\""].contains(&it.as_str()));
    }
    let mut config = format!("timing.tables = [\"t.toml\"]\nclocks.synchronised = [{}]\n", clocks.join(", "));
    let _ = writeln!(config, "[platform]\nrt_throttling = {}\ncpus = 2", random.below(8) == 0);
    if has_lock {
        let protocol = *random.of(&["ceiling", "inheritance", "none"]);
        let users = [random.below(count), random.below(count)].map(|it| format!("\"y{it}\""));
        let _ = writeln!(
            config,
            "[locks.bus]\ncodels = [{}]\nprotocol = \"{protocol}\"\nheld = \"0.3 ms\"",
            users.join(", ")
        );
    }
    if random.below(3) == 0 {
        let other = "name = \"network\"\npriority = 50\nperiod = \"5 ms\"\ntime = \"0.2 ms\"\njitter = \"1 ms\"\ncpus = [1]";
        let _ = writeln!(config, "[[platform.other]]\n{other}");
    }
    if random.below(2) == 0 {
        times += "[overhead]\ndispatch = 0.1\ncontext_switch = 0.02\n";
    }
    let _ = write!(times, "[wait]\n{waits}");
    format!(
        "{model}architecture Z {{\n{instances}}}\ndeployment D {{ architecture Z\n{activities}}}\n//- /mauve.toml\n{config}//- /t.toml\n{times}"
    )
}

/// Returns a task set in JSON: two to five tasks, sometimes 110, with bursts, releases by data, threads, locks, operations, waits,
/// jitter, offsets, throttling and several CPUs.
fn task_set(random: &mut Random) -> String {
    let count = if random.below(50) == 0 { 110 } else { 2 + random.below(4) };
    let is_in = |random: &mut Random, one_of: usize| random.below(one_of) == 0;
    let [threads, bursts, waits, locks, operations, offsets, jitters] =
        [6, 4, 4, 4, 4, 4, 3].map(|one_of| is_in(random, one_of));
    let bursts = bursts && !threads;
    let sets = random.below(8);
    let load = *random.of(&[1, 1, 4]);
    let name = |task: usize| format!("t{task}");
    let mut tasks = Vec::new();
    for task in 0..count {
        let period = 1000 * *random.of(&[10, 20, 40, 50]);
        let time = |random: &mut Random| load * random.below(if count > 5 { 50 } else { 4000 });
        let mut of =
            json!({ "name": name(task), "period": period, "priority": 1 + random.below(count.min(50)) });
        of["cpus"] = match (sets, random.below(3)) {
            // All tasks on both: each of them waits only while both execute others.
            (1, _) => json!([1, 2]),
            (2, 0) => json!([1, 2]),
            (2, 1) => json!([2, 3]),
            (3, cpu) => json!([1 + cpu.min(1)]),
            _ => json!([1]),
        };
        if is_in(random, 3) {
            let edge = |random: &mut Random, from: &str, to: &str| {
                let mut edge = json!({ "from": from, "to": to, "time": time(random) });
                if waits && is_in(random, 2) {
                    edge["wait"] = json!(time(random));
                }
                edge
            };
            of["machine"] = json!([edge(random, "A", "B"), edge(random, "B", "A"), edge(random, "A", "A")]);
        } else {
            of["time"] = json!(time(random));
            if waits && is_in(random, 2) {
                of["wait"] = json!(time(random));
            }
        }
        if waits && is_in(random, 2) {
            of["waits"] = json!(1 + random.below(3));
        }
        if bursts && is_in(random, 2) {
            of["burst"] = json!(2 + random.below(2));
        } else if bursts && is_in(random, 2) {
            of["sporadic"] = json!(true);
        } else if offsets && is_in(random, 2) {
            of["offset"] = json!(random.below(period));
            of["clock"] = json!(random.below(2));
        }
        if jitters && is_in(random, 2) {
            of["jitter"] = json!(random.below(period));
        }
        tasks.push(of);
    }
    if threads {
        let first = tasks[0].clone();
        for task in &mut tasks[..2] {
            for key in ["period", "priority", "cpus", "jitter", "offset", "clock", "burst", "sporadic"] {
                task.as_object_mut().unwrap().remove(key);
                task.as_object_mut().unwrap().extend(first.get(key).map(|it| (key.to_owned(), it.clone())));
            }
            task["thread"] = json!("main");
        }
    }
    let mut set = json!({ "unit": "us", "cpus": 3, "task": tasks });
    if is_in(random, 6) {
        set["rt_throttling"] = json!(true);
    }
    if is_in(random, 4) {
        set["other"] = json!([{ "name": "irq", "period": 5000, "time": 100, "priority": 60, "cpus": [1] }]);
    }
    if locks {
        let user = |random: &mut Random| json!({ "task": name(random.below(count)), "held": 50 + random.below(500) });
        let users = [user(random), user(random)];
        let protocol = *random.of(&["ceiling", "inheritance", "none"]);
        if users[0]["task"] != users[1]["task"] {
            set["lock"] = json!([{ "name": "bus", "protocol": protocol, "user": users }]);
        }
    }
    if operations {
        let (provider, client) = (random.below(count), random.below(count));
        set["operation"] = json!([{ "name": "help", "provider": name(provider), "client": name(client), "sends": 1, "time": 300 }]);
        set["operation"][0]["waits"] = json!(waits);
    }
    set.to_string()
}

fn ns(text: &str) -> u64 {
    let time = Time::parse_with_unit(text.trim(), Rounding::Exact);
    time.unwrap_or_else(|why| panic!("{why:?} in `{text}`")).as_nanos()
}

/// Returns the part of `text` between two others.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let rest = &text[text.find(before)? + before.len()..];
    Some(&rest[..rest.find(after)?])
}

/// How many explanations had each kind of row, and how many response times each way to count.
#[derive(Default)]
struct Seen(BTreeMap<&'static str, usize>);

impl Seen {
    fn count(&mut self, what: &'static str, is_seen: bool) {
        *self.0.entry(what).or_default() += usize::from(is_seen);
    }

    /// Prints what was seen, and returns what was seen less than `least` times.
    fn seldom(&self, least: usize) -> Vec<&'static str> {
        self.0.iter().for_each(|(what, count)| println!("{count:>7} {what}"));
        self.0.iter().filter(|(_, count)| **count < least).map(|(what, _)| *what).collect()
    }
}

/// The cells of the rows of the table, without its two header lines.
fn rows(markdown: &str) -> Vec<Vec<&str>> {
    let rows = markdown.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    rows.skip(2).map(|row| row.split(" | ").map(|cell| cell.trim_matches(['*', ' '])).collect()).collect()
}

fn signed(time: &str) -> i64 {
    match time.strip_prefix('−') {
        Some(time) => -(ns(time) as i64),
        None => ns(time) as i64,
    }
}

/// Checks that the rows of an overloaded CPU sum to its utilisation.
fn check_load(rows: &[Vec<&str>], utilisation: f64) {
    let percent = |row: &Vec<&str>| row[3].strip_suffix(" %").unwrap().parse::<f64>().unwrap();
    let (last, parts) = rows.split_last().unwrap();
    let sum: f64 = parts.iter().map(percent).sum();
    let rounding = 0.05 * rows.len() as f64 + 0.001;
    assert!((percent(last) - utilisation).abs() <= 0.051 && (sum - utilisation).abs() <= rounding);
}

/// Returns the time of the costliest period. Checks that it is the sum of its programs and of the codels outside them, and that the time of
/// each program is the sum of its codels.
fn costliest_period(markdown: &str) -> Option<u64> {
    let (head, list) = markdown.split_once("costliest period: ")?.1.split_once("\n\n")?;
    let period = ns(head.split_once(", ")?.0);
    let mut sum = 0;
    for line in list.lines().map_while(|line| line.strip_prefix("- ")) {
        // The last two words are a number and its unit.
        let time = |text: &str| {
            ns(&text
                .rsplitn(3, ' ')
                .take(2)
                .collect::<Vec<_>>()
                .into_iter()
                .rev()
                .collect::<Vec<_>>()
                .join(" "))
        };
        let (program, codels) = line.split_once(": ").map_or((line, None), |(it, codels)| (it, Some(codels)));
        if let Some(codels) = codels {
            assert_eq!(codels.split(", ").map(time).sum::<u64>(), time(program), "{line}");
        }
        sum += time(program);
    }
    assert!(sum == 0 || sum == period, "{sum} of {period}");
    Some(period)
}

/// Checks that the rows of an explanation sum to the figure of the last one: the response time, or the end of the first job, or the
/// utilisation of the CPU.
fn check(markdown: &str, report: &ActivityReport<'_>, seen: &mut Seen) {
    let rows = rows(markdown);
    let overloaded = report.reasons.iter().find_map(|it| match it.reason {
        Reason::Overloaded { utilisation, .. } => Some(utilisation.0 * 100.0),
        _ => None,
    });
    seen.count("on an overloaded CPU", overloaded.is_some());
    let period = costliest_period(markdown);
    if let Some(utilisation) = overloaded {
        return check_load(&rows, utilisation);
    }
    let Some(total) = report.response.or(report.first_job) else {
        return assert_eq!(rows, Vec::<Vec<&str>>::new());
    };
    let total = total.as_nanos().max(1);
    let (last, parts) = rows.split_last().unwrap();
    let name = if report.response.is_some() { "response time" } else { "end of its first job" };
    assert_eq!((last[0], ns(last[3]).max(1)), (name, total));
    assert_eq!(parts.iter().map(|row| signed(row[3])).sum::<i64>(), total as i64);
    for row in parts {
        let Some((jobs, bound)) = row[2].split_once(" × ") else { continue };
        let jobs: u64 = jobs.parse().unwrap();
        match bound.strip_prefix("≤ ") {
            Some(each) => assert!(ns(row[3]) < jobs * ns(each)),
            None => assert_eq!(ns(row[3]), jobs * ns(bound)),
        }
    }
    let jobs = report.window.as_ref().map_or(1, |window| window.job);
    let time_of = |what: &str| {
        parts.iter().filter(|row| row[0].starts_with(what)).map(|row| signed(row[3])).sum::<i64>()
    };
    let (after, before) = (time_of("start of the busy window"), time_of("release until"));
    if let Some(ends) = between(markdown, "it ends ", " after the start of the window") {
        assert_eq!(ns(ends) as i64, total as i64 - after - before);
    }
    if report.response.is_some() && !markdown.contains("synchronised") {
        let released = report.task.release_of(jobs).unwrap().as_nanos();
        assert_eq!(-(after + before), released as i64 - report.jitter.as_nanos() as i64);
    }
    if let (Some(response), Some(deadline)) = (report.response, report.deadline) {
        let (mark, slack) = match deadline.checked_sub(response) {
            Some(slack) => ("✓", format!(", slack {slack} at ")),
            None => ("✗", format!(", missed by {} at ", response.checked_sub(deadline).unwrap())),
        };
        let first = markdown.lines().next().unwrap().replacen("**!", "**✓", 1);
        assert!(first.starts_with(&format!("**{mark} ")) && first.contains(&slack), "{first}");
    }
    let calls = time_of("operation ");
    let of_calls: u64 = report.calls.iter().map(|it| it.time.as_nanos() * jobs).sum();
    assert_eq!(calls as u64, of_calls);
    let overhead = time_of("dispatch and context switches");
    if jobs == 1 {
        // A job without demand counts as 1 ns.
        assert_eq!(
            (time_of("own time") + overhead) as u64,
            period.unwrap_or_default().max(u64::from(calls == 0))
        );
    }
    let cpus = report.rule.map_or("", |it| match it {
        CpuRule::Cpu(_) => "on one CPU",
        CpuRule::Linked(_) => "on CPUs as if they were one",
        CpuRule::Global(_) => "on several CPUs at once",
    });
    let has_row = |of: &str| parts.iter().any(|row| row[0].contains(of));
    for (what, is_seen) in [
        ("explanations", true),
        ("of later jobs", jobs > 1),
        ("of an activity without a bound", report.response.is_none()),
        ("with a release after the start of the window", after < 0),
        ("with a release before the start of the window", before > 0),
        ("on synchronised clocks", markdown.contains("synchronised")),
        ("with jitter", report.jitter > Time::ZERO),
        ("in bursts", report.task.burst() > 1),
        ("beside bursts", has_row("(in bursts of ")),
        ("released by data", report.task.is_sporadic),
        ("in a thread", has_row("it in its thread")),
        ("with calls", calls > 0),
        ("with overhead", overhead > 0),
        ("with waits", report.task.waits.is_some()),
        ("with switches of waits", markdown.contains("- context switches of its waits")),
        ("with a row of waits", markdown.contains("- waits of its codels")),
        ("with waits as execution", markdown.contains("counts waits as execution")),
        ("with waits as jitter", markdown.contains("counts no waits of other")),
        ("blocked by locks", has_row("lower priorities that hold locks")),
        ("executed at once", has_row("on several CPUs at once")),
        ("beside other work", has_row("(platform)")),
        ("beside throttling", has_row(THROTTLING)),
        ("with the sum of more activities", has_row(" more activities")),
        ("on one CPU", cpus == "on one CPU"),
        ("on CPUs as if they were one", cpus == "on CPUs as if they were one"),
        ("on several CPUs at once", cpus == "on several CPUs at once"),
    ] {
        seen.count(what, is_seen);
    }
}

/// Checks the hovers of the activities of each deployment.
fn check_hovers(db: &Database, workspace: Workspace, seen: &mut Seen) {
    for &project in projects(db, workspace) {
        for deployment in names_of(db, project).of_kind(db, Kind::Deployment) {
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            for activity in &report.activities {
                let Some(at) = &activity.at else { continue };
                let (file, offset) = (at.file(db), at.range(db).start());
                let links = |_: &dyn ModelDb, _: &Location<'_>| None;
                let format = HoverFormat::Markdown(&links);
                let shown =
                    hover(db, project_with(db, workspace, file), file, offset, format).unwrap().markdown;
                let checked = AssertUnwindSafe(|| check(&shown, activity, seen));
                assert!(catch_unwind(checked).is_ok(), "{shown}\nof\n{}", file.text(db));
            }
        }
    }
}

#[test]
fn the_rows_of_the_sample_robot_sum_to_the_response_time() {
    let mut seen = Seen::default();
    let db = Database::default();
    let folder = models().join("p3dx");
    let files = files_in(&folder).into_iter();
    let texts = files.filter_map(|path| Some((path.clone(), std::fs::read_to_string(path).ok()?)));
    check_hovers(&db, Workspace::of_texts(&db, folder.clone(), texts), &mut seen);
    assert_eq!(seen.0["explanations"], 9);
}

/// The greatest number of activities in a table.
const MOST_ROWS: usize = 100;

const METHODS: [Method; 5] = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact, Method::Best];

#[test]
fn every_figure_of_a_deployment_adds_up() {
    let mut seen = Seen::default();
    for seed in 0..number() {
        let fixture_text = model(&mut Random::of_seed(seed));
        let db = Database::default();
        let texts = fixture(&fixture_text).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        check_hovers(&db, workspace, &mut seen);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        for method in METHODS {
            let query = Query { level: Level::TEN_TO_MINUS_FOUR, method };
            let report = response_times(&db, project, deployment, query).clone();
            for (index, activity) in report.activities.iter().enumerate() {
                let tables = tables_of(&db, project, deployment);
                let doc = explain_response(&db, tables, &report, index, query, MOST_ROWS).unwrap();
                let said = doc.markdown(&db, &|_, _| None);
                let checked = AssertUnwindSafe(|| check(&said, activity, &mut seen));
                assert!(catch_unwind(checked).is_ok(), "{said}\nof\n{fixture_text}");
            }
        }
    }
    // Only task sets have these.
    let mut seldom = seen.seldom(10);
    seldom.retain(|what| *what != "with the sum of more activities");
    assert_eq!(seldom, ["beside bursts", "in bursts", "on CPUs as if they were one", "released by data"]);
}

#[test]
fn every_figure_of_a_task_set_adds_up() {
    let (mut seen, db) = (Seen::default(), Database::default());
    for seed in 0..number() {
        let text = task_set(&mut Random::of_seed(seed));
        let set = TaskSet::parse(&text, Notation::Json).unwrap_or_else(|why| panic!("{why:?} in {text}"));
        for method in METHODS {
            let query = Query { level: set.level(), method };
            let report = response_times_of(&set, query).unwrap();
            for (index, activity) in report.activities.iter().enumerate() {
                let doc = explain_response_of(&db, &set, &report, index, query, MOST_ROWS).unwrap();
                let said = doc.markdown(&db, &|_, _| None);
                let checked = AssertUnwindSafe(|| check(&said, activity, &mut seen));
                assert!(catch_unwind(checked).is_ok(), "{said}\nof\n{text}");
            }
        }
    }
    // Only models have these.
    assert_eq!(seen.seldom(10), ["with overhead", "with switches of waits"]);
}

/// What a thread executes before and after, and how others are released.
#[test]
fn threads_bursts_and_releases_by_data_are_named() {
    let text = "name,period,time,priority,sporadic,burst,thread\n\
        imu,10,1,2,,,drivers\ngps,10,2,2,,,drivers\ncan,20,1,3,,3,\nlog,100,5,1,true,,\nplan,100,1,1,,,\n";
    let db = Database::default();
    let set = TaskSet::parse(text, Notation::Csv).unwrap();
    let query = Query { level: set.level(), method: Method::Exact };
    let report = response_times_of(&set, query).unwrap();
    let of = |task: usize| explain_response_of(&db, &set, &report, task, query, MOST_ROWS).unwrap().text();
    expect![[r#"
        ✓ 6 / 10 ms ▰▰▰▱▱▱ 60 %, slack 4 ms at 1e-4

                                       priority      jobs  time
        own time                              2  1 × 2 ms  2 ms  ██████▋
        imu (before it in its thread)         2  1 × 1 ms  1 ms  ███▍
        can (in bursts of 3)                  3  3 × 1 ms  3 ms  ██████████
        response time                                      6 ms

        costliest period: 2 ms, update

        - period 10 ms, deadline 10 ms, method exact
        - assumes real-time throttling off

        ✓ 3 / 20 ms ▰▱▱▱▱▱ 15 %, slack 17 ms at 1e-4

                       priority      jobs  time
        own time              3  3 × 1 ms  3 ms  ████████████████████
        response time                      3 ms

        costliest period: 1 ms, update

        - period 20 ms, deadline 20 ms, in bursts of 3, method exact
        - assumes real-time throttling off
        - job 3 of the busy window has the largest response time: it ends 3 ms after the start of the window

        ✓ 15 / 100 ms ▰▱▱▱▱▱ 15 %, slack 85 ms at 1e-4

                                priority      jobs   time
        own time                       1  1 × 1 ms   1 ms  █▍
        imu                            2  2 × 1 ms   2 ms  ██▋
        gps                            2  2 × 2 ms   4 ms  █████▍
        can (in bursts of 3)           3  3 × 1 ms   3 ms  ████
        log (released by data)         1  1 × 5 ms   5 ms  ██████▋
        response time                               15 ms

        costliest period: 1 ms, update

        - period 100 ms, deadline 100 ms, method exact
        - assumes real-time throttling off
    "#]]
    .assert_eq(&[1, 2, 4].map(of).join("\n"));
}
