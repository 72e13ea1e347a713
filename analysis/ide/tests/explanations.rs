//! Every figure of an explanation adds up: the texts of random deployments, which people see with `--explain`, and the tables of
//! hovers, also those of the sample models, are read again, and their sums are computed.
//!
//! `MAUVE_EXPLANATIONS=10000 cargo test --release -p mauve-ide --test main explanations::` tries more deployments.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};

use expect_test::expect;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Location, ModelDb, Workspace, names_of, projects};
use mauve_ide::{HoverFormat, explain_response, explain_response_of, hover};
use mauve_tests::{Random, files_in, fixture, models};
use mauve_timing::task_set::{Notation, TaskSet};
use mauve_timing::{Level, Method, Rounding, Time};
use mauve_wcrt::{ActivityReport, Query, Reason, response_times, response_times_of, tables_of};

use crate::project_with;

/// Returns a deployment of two to five activities: state machines, operations between them, overhead, other work, jitter, offsets
/// and several CPUs.
fn model(random: &mut Random) -> String {
    let count = 2 + random.below(4);
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
            let time = load * random.below(greatest);
            let _ = writeln!(model, "codel {codel}{number}(): int");
            let _ = writeln!(times, "{codel}{number} = {}.{}", time / 10, time % 10);
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
        let _ = writeln!(
            model,
            "statemachine {{ initial state A {{ run = {{ x{number}(); }} transition go if (g{number}() > 0) to B }} \
             state B {{ run = {{ y{number}(); {sends} }} transition back to A }} }} }}\n\
             component C{number}(S{number}, K{number})"
        );
        let _ = writeln!(instances, "instance i{number}: C{number}");
        let period = *random.of(&[10, 20, 40, 50]);
        let (priority, affinity) = (1 + random.below(count), *random.of(&[1, 1, 1, 2, 3]));
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
    let mut config = format!("timing.tables = [\"t.toml\"]\nclocks.synchronised = [{}]\n", clocks.join(", "));
    let _ = writeln!(config, "[platform]\nrt_throttling = {}\ncpus = 2", random.below(8) == 0);
    if random.below(3) == 0 {
        let other = "name = \"network\"\npriority = 50\nperiod = \"5 ms\"\ntime = \"0.2 ms\"\njitter = \"1 ms\"\ncpus = [1]";
        let _ = writeln!(config, "[[platform.other]]\n{other}");
    }
    if random.below(2) == 0 {
        times += "[overhead]\ndispatch = 0.1\ncontext_switch = 0.02\n";
    }
    format!(
        "{model}architecture Z {{\n{instances}}}\ndeployment D {{ architecture Z\n{activities}}}\n//- /mauve.toml\n{config}//- /t.toml\n{times}"
    )
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

/// The sum of the times in the lines below the one with this text, without those that are indented further.
fn block(text: &str, head: &str) -> Option<u64> {
    let rest = &text[text.find(head)? + head.len()..];
    let lines = rest.lines().skip(1).take_while(|line| line.starts_with("  "));
    let time = |line: &str| {
        let time = line.get(2..14)?.trim();
        (!time.is_empty()).then(|| ns(time))
    };
    Some(lines.filter_map(time).sum())
}

#[derive(Default)]
struct Seen {
    windows: usize,
    later_jobs: usize,
    starts: usize,
    jitters: usize,
    calls: usize,
    overheads: usize,
    others: usize,
}

fn check(text: &str, seen: &mut Seen) {
    let total = |line: &str| {
        let line = line.strip_prefix("response time ")?;
        Some(ns(line.strip_prefix("at the critical instant: ").unwrap_or(line).split(" = ").next()?))
    };
    let Some(response) = text.lines().find_map(total).filter(|_| !text.contains("no response time")) else {
        return;
    };
    let period = ns(between(text, ", period ", "\n").unwrap().split([',', '(']).next().unwrap());
    let jitter = between(text, ", jitter ", "\n").map_or(0, ns);
    let jobs = between(text, "\njob ", " of the busy window").map_or(1, |job| job.parse::<u64>().unwrap());
    let own = match jobs {
        1 => ns(between(text, "execution time of its own job: ", "\n").unwrap()),
        _ => ns(between(text, &format!("execution time of its own {jobs} jobs: "), "\n").unwrap()),
    };
    // A job without demand counts as 1 ns.
    let at_once = between(text, "executed on several CPUs at once: −", "\n").map_or(0, ns);
    let length = own.max(1) + block(text, "\ninterference:").unwrap_or(0) - at_once;
    seen.windows += 1;
    if let Some(ends) = between(text, "it ends ", " after the start of the window") {
        assert_eq!(ns(ends), length);
        seen.later_jobs += 1;
    }
    let sum = text.lines().filter_map(|line| line.strip_prefix("response time ")?.split_once(": "));
    match sum.filter_map(|(sum, _)| sum.split_once(" = ")).next() {
        Some((total, terms)) => {
            assert_eq!(ns(total), response);
            let minus = terms.split_once(" − ").map(|(from, less)| (ns(from), -(ns(less) as i64)));
            let plus = || terms.split_once(" + ").map(|(from, more)| (ns(from), ns(more) as i64));
            let (from, by) = minus.or_else(plus).unwrap();
            assert_eq!(from, length);
            assert_eq!(from as i64 + by, response as i64);
            if !text.contains("synchronised") {
                assert_eq!(-by, (period * (jobs - 1)) as i64 - jitter as i64);
            }
        }
        None => assert_eq!(response, length),
    }
    seen.starts += usize::from(text.contains("synchronised"));
    seen.jitters += usize::from(jitter > 0);
    seen.others += usize::from(text.contains("(platform)"));
    // The greatest period by programs and overhead, and the programs by codels.
    let mut edges = text.lines().filter_map(|line| line.strip_prefix("execution time ")?.split_once(':'));
    let (edge, _) = edges.find(|(edge, _)| !edge.starts_with("of ")).unwrap();
    let head = format!("\nexecution time {edge}:");
    assert_eq!(block(text, &head).unwrap(), ns(edge));
    seen.overheads += usize::from(text.contains("dispatch and context switches"));
    let calls = between(text, "execution time of calls in each period: ", "\n").map_or(0, ns);
    assert_eq!(block(text, "\nexecution time of calls in each period").unwrap_or(0), calls);
    seen.calls += usize::from(calls > 0);
    if jobs == 1 {
        assert_eq!(own, ns(edge) + calls);
    }
}

/// The cells of the rows of the table, without its two header lines.
fn rows(markdown: &str) -> Vec<Vec<&str>> {
    let rows = markdown.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    rows.skip(2).map(|row| row.split(" | ").map(|cell| cell.trim_matches(['*', ' '])).collect()).collect()
}

#[derive(Default)]
struct SeenTables {
    responses: usize,
    later_jobs: usize,
    calls: usize,
    overheads: usize,
    overloads: usize,
}

/// Checks that the rows of a hover sum to the figure of the last one, which is the response time or the utilisation of the CPU.
fn check_table(markdown: &str, report: &ActivityReport<'_>, seen: &mut SeenTables) {
    let rows = rows(markdown);
    let overloaded = report.reasons.iter().find_map(|it| match it.reason {
        Reason::Overloaded { utilisation, .. } => Some(utilisation.0 * 100.0),
        _ => None,
    });
    if let Some(utilisation) = overloaded {
        let percent = |row: &Vec<&str>| row[3].strip_suffix(" %").unwrap().parse::<f64>().unwrap();
        let (last, parts) = rows.split_last().unwrap();
        let sum: f64 = parts.iter().map(percent).sum();
        let rounding = 0.05 * rows.len() as f64 + 0.001;
        assert!((percent(last) - utilisation).abs() <= 0.051 && (sum - utilisation).abs() <= rounding);
        seen.overloads += 1;
        return;
    }
    let Some(response) = report.response else { return assert_eq!(rows, Vec::<Vec<&str>>::new()) };
    let (last, parts) = rows.split_last().unwrap();
    assert_eq!((last[0], ns(last[3])), ("response time", response.as_nanos()));
    let signed = |time: &str| match time.strip_prefix('−') {
        Some(time) => -(ns(time) as i64),
        None => ns(time) as i64,
    };
    assert_eq!(parts.iter().map(|row| signed(row[3])).sum::<i64>(), response.as_nanos() as i64);
    for row in parts {
        let Some((jobs, bound)) = row[2].split_once(" × ") else { continue };
        let jobs: u64 = jobs.parse().unwrap();
        match bound.strip_prefix("≤ ") {
            Some(each) => assert!(ns(row[3]) < jobs * ns(each)),
            None => assert_eq!(ns(row[3]), jobs * ns(bound)),
        }
    }
    let deadline = report.deadline.unwrap();
    let (mark, slack) = match deadline.checked_sub(response) {
        Some(slack) => ("✓", format!(", slack {slack} at ")),
        None => ("✗", format!(", missed by {} at ", response.checked_sub(deadline).unwrap())),
    };
    let first = markdown.lines().next().unwrap().replacen("**!", "**✓", 1);
    assert!(first.starts_with(&format!("**{mark} ")) && first.contains(&slack), "{first}");
    let jobs = report.window.as_ref().unwrap().job;
    let calls: Vec<_> = parts.iter().filter(|row| row[0].starts_with("operation ")).collect();
    let of_calls: u64 = report.calls.iter().map(|it| it.time.as_nanos() * jobs).sum();
    assert_eq!(calls.iter().map(|row| ns(row[3])).sum::<u64>(), of_calls);
    seen.responses += 1;
    seen.later_jobs += usize::from(jobs > 1);
    seen.calls += usize::from(!calls.is_empty());
    seen.overheads += usize::from(parts.iter().any(|row| row[0] == "dispatch and context switches"));
}

/// Checks the hovers of the activities of the first deployment of each project.
fn check_tables(db: &Database, workspace: Workspace, seen: &mut SeenTables) {
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
                let checked = AssertUnwindSafe(|| check_table(&shown, activity, seen));
                assert!(catch_unwind(checked).is_ok(), "{shown}\nof\n{}", file.text(db));
            }
        }
    }
}

#[test]
fn the_rows_of_a_hover_sum_to_the_response_time() {
    let count = std::env::var("MAUVE_EXPLANATIONS").ok().and_then(|it| it.parse().ok()).unwrap_or(400);
    let mut seen = SeenTables::default();
    for seed in 0..count {
        let db = Database::default();
        let texts = fixture(&model(&mut Random::of_seed(seed))).into_iter();
        let workspace = Workspace::of_texts(&db, "/".into(), texts.map(|(path, text)| (path.into(), text)));
        check_tables(&db, workspace, &mut seen);
    }
    let SeenTables { responses, later_jobs, calls, overheads, overloads } = seen;
    println!(
        "{responses} response times: {later_jobs} of later jobs, {calls} with calls, {overheads} with overhead"
    );
    println!("{overloads} on overloaded CPUs");
    assert!(later_jobs >= 3 && overloads >= 10);
    assert!(calls.min(overheads) * 100 > responses);
}

#[test]
fn the_rows_of_the_sample_robot_sum_to_the_response_time() {
    let mut seen = SeenTables::default();
    let db = Database::default();
    let folder = models().join("p3dx");
    let files = files_in(&folder).into_iter();
    let texts = files.filter_map(|path| Some((path.clone(), std::fs::read_to_string(path).ok()?)));
    check_tables(&db, Workspace::of_texts(&db, folder.clone(), texts), &mut seen);
    assert_eq!(seen.responses, 9);
}

#[test]
fn every_figure_adds_up() {
    let count = std::env::var("MAUVE_EXPLANATIONS").ok().and_then(|it| it.parse().ok()).unwrap_or(250);
    let mut seen = Seen::default();
    for seed in 0..count {
        let fixture_text = model(&mut Random::of_seed(seed));
        let db = Database::default();
        let texts = fixture(&fixture_text).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        for method in [Method::Classic, Method::Psm, Method::Ibf, Method::Exact, Method::Best] {
            let query = Query { level: Level::TEN_TO_MINUS_FOUR, method, horizon: None };
            let report = response_times(&db, project, deployment, query).clone();
            for activity in 0..report.activities.len() {
                let text =
                    explain_response(&db, tables_of(&db, project, deployment), &report, activity, query);
                let checked = AssertUnwindSafe(|| check(&text, &mut seen));
                assert!(catch_unwind(checked).is_ok(), "{text}\nof\n{fixture_text}");
            }
        }
    }
    let Seen { windows, later_jobs, starts, jitters, calls, overheads, others } = seen;
    println!(
        "{windows} windows: {later_jobs} of later jobs, {starts} that begin at a release, {jitters} with jitter,"
    );
    println!("{calls} with calls, {overheads} with overhead, {others} with other work");
    assert!(later_jobs >= 10);
    assert!(starts.min(jitters).min(calls).min(overheads).min(others) * 100 > windows);
}

/// What a thread executes before and after, and how others are released.
#[test]
fn threads_bursts_and_releases_by_data_are_named() {
    let text = "name,period,time,priority,sporadic,burst,thread\n\
        imu,10,1,2,,,drivers\ngps,10,2,2,,,drivers\ncan,20,1,3,,3,\nlog,100,5,1,true,,\nplan,100,1,1,,,\n";
    let db = Database::default();
    let set = TaskSet::parse(text, Notation::Csv).unwrap();
    let query = Query { level: set.level(), method: Method::Exact, horizon: None };
    let report = response_times_of(&set, query).unwrap();
    let of = |task: usize| explain_response_of(&db, &set, &report, task, query);
    expect![[r#"
        gps (component unknown): ✓ 6 / 10 ms ▰▰▰▱▱▱ 60 %
          at 1e-4, method exact, period 10 ms
          assumes real-time throttling off

        execution time of its own job: 2 ms
        interference:
                  1 ms     1 job   imu (before it in the thread `drivers`)
                  3 ms     3 jobs  can (in bursts of 3)

        execution time 2 ms: update

        response time at the critical instant: 6 ms

        can (component unknown): ✓ 3 / 20 ms ▰▱▱▱▱▱ 15 %
          at 1e-4, method exact, period 20 ms (in bursts of 3)
          assumes real-time throttling off

        job 3 of the busy window has the largest response time: it ends 3 ms after the start of the window
        execution time of its own 3 jobs: 3 ms

        execution time 1 ms: update

        plan (component unknown): ✓ 15 / 100 ms ▰▱▱▱▱▱ 15 %
          at 1e-4, method exact, period 100 ms
          assumes real-time throttling off

        execution time of its own job: 1 ms
        interference:
                  2 ms     2 jobs  imu
                  4 ms     2 jobs  gps
                  3 ms     3 jobs  can (in bursts of 3)
                  5 ms     1 job   log (released by data)

        execution time 1 ms: update

        response time at the critical instant: 15 ms
    "#]]
    .assert_eq(&[1, 2, 4].map(of).join("\n"));
}
