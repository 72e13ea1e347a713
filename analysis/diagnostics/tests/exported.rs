//! A task set that is written to a file and read again gives what its model gives: every figure, every verdict, every
//! reason, at every level, by each method, with traces that end early too. Only why a priority is unknown is not in a file. So it is for the sample robot, for random
//! models, and for models that are damaged, of which much is not analysed.
//!
//! `MAUVE_EXPORTS=20000 cargo test --release -p mauve-diagnostics --test main exported::` tries more.

use std::path::PathBuf;

use mauve_diagnostics::{task_set_error_message, timing_reason};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects};
use mauve_tests::{random_model, search, texts_in};
use mauve_timing::task_set::{Notation, Number, Numbers, TaskSet};
use mauve_timing::{CpuRule, Demand, Level, Method, Status, Time};
use mauve_wcrt::{
    Query, Reason, Report, exported_component, first_tables, levels_of, psm_of, response_times,
    response_times_of, task_set_of, timetable_of,
};
use serde_json::{Value, json};

use crate::common::deployments;
use crate::damaged::{Project as DamagedProject, any, cases};
use crate::schemas::assert_is_task_set;

/// What was compared.
#[derive(Default, Debug)]
struct Counted {
    responses: usize,
    calls: usize,
    not_analysed: usize,
    machines: usize,
}

/// Everything that is said of a report, but why a priority is unknown.
fn said<'db>(db: &'db Database, report: &Report<'db>) -> Vec<String> {
    let mut breakdown = report.breakdown(&|| ());
    let reason = |it: &Reason<'db>| match it {
        Reason::DelayedBy { first, instances, .. } => {
            let (first, instances, unknown_priority) = (*first, instances.clone(), None);
            timing_reason(db, &Reason::DelayedBy { first, instances, unknown_priority })
        }
        other => timing_reason(db, other),
    };
    let activities = report.activities.iter().enumerate().map(|(index, it)| {
        let reasons: Vec<String> = it.reasons.iter().map(|it| reason(&it.reason)).collect();
        format!(
            "{} {} {:?} {:?} {:?} {:?} {}: {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {reasons:?}",
            it.instance,
            it.component_name,
            it.priority,
            it.cpus,
            it.period,
            it.deadline,
            it.jitter,
            it.verdict,
            it.own,
            it.first_job,
            it.response,
            breakdown.of(index),
            it.window,
            it.assumed,
            it.calls,
            it.method,
            it.rule,
        )
    });
    let not_analysed: Vec<String> =
        report.not_analysed.iter().map(|it| timing_reason(db, &it.reason)).collect();
    let ends =
        format!("{:?} {not_analysed:?} {} {:?}", report.cpus, report.schedulable(), report.deadlines());
    activities.chain([ends]).collect()
}

/// Every response time is the sum of what explains it. Returns the number of calls in these sums.
fn check_sums<'db>(
    db: &'db Database,
    project: Project<'db>,
    report: &Report<'db>,
    query: Query,
    what: &str,
) -> usize {
    let mut breakdown = report.breakdown(&|| ());
    let mut counted = 0;
    for (index, it) in report.activities.iter().enumerate() {
        let Some((response, window)) = it.response.zip(it.window.as_ref()) else { continue };
        let calls: u64 = it.calls.iter().map(|calls| calls.time.as_nanos()).sum();
        counted += it.calls.len();
        if query.method != Method::Classic {
            let psm = psm_of(
                db,
                first_tables(db, project, it.component.unwrap()),
                it.component.unwrap(),
                query.level,
            )
            .as_ref()
            .unwrap();
            let own = psm.machine.greatest_cost().as_nanos() + calls;
            assert_eq!(it.own.unwrap().as_nanos(), own, "{what}: {it:?}");
        }
        assert!(window.job > 1 || Some(window.own) == it.own, "{what}: {it:?}");
        let interference: u64 = breakdown.of(index).iter().map(|part| part.time.as_nanos()).sum();
        let length = window.length.as_nanos();
        // Several CPUs execute it at once.
        let at_once = if let Some(CpuRule::Global(cpus)) = it.rule { u64::from(cpus.len()) } else { 1 };
        let interference = interference.div_ceil(at_once);
        let parts = window.own.as_nanos().max(1) + interference + window.blocking.as_nanos();
        assert_eq!(parts, length, "{what}, {query:?}: {it:?}");
        let released = it.release_of(window.job).unwrap().as_nanos();
        assert_eq!(response.as_nanos(), length + it.jitter.as_nanos() - released, "{what}: {it:?}");
    }
    counted
}

fn written(set: &TaskSet) -> TaskSet {
    let text = set.to_json();
    assert_is_task_set(&text);
    TaskSet::parse(&text, Notation::Json).unwrap_or_else(|why| panic!("{why:?}\n{text}"))
}

/// Returns the levels of a set; one of all, where each time holds at every level.
fn levels(set: &TaskSet) -> Vec<Level> {
    if set.levels.is_empty() { vec![set.level()] } else { set.levels.clone() }
}

fn check(db: &Database, workspace: Workspace, what: &str, counted: &mut Counted) {
    for (project, deployment) in deployments(db, workspace) {
        let set = task_set_of(db, project, deployment, timing_reason);
        let read = written(&set);
        assert_eq!(read, set, "{what}");
        assert_eq!(read.levels, levels_of(db, project, deployment), "{what}");
        for level in levels(&read) {
            for method in [Method::Psm, Method::Classic, Method::Exact, Method::Best] {
                let query = Query { level, method };
                let model = response_times(db, project, deployment, query);
                let from_file = response_times_of(&read, query).unwrap();
                assert_eq!(said(db, &from_file), said(db, model), "{what}, {query:?}");
                counted.calls += check_sums(db, project, model, query, what);
                for activity in &model.activities {
                    counted.responses += usize::from(activity.response.is_some());
                    counted.not_analysed += usize::from(activity.verdict == Status::NotAnalysed);
                }
            }
        }
        let other = Level::from_f64(0.123).unwrap();
        let query = Query { level: other, method: Method::Psm };
        let has_times = response_times_of(&read, query).is_ok();
        assert_eq!(has_times, read.levels.is_empty(), "a level without times");
    }
    for &project in projects(db, workspace) {
        for &of in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Component) {
            let component = exported_component(db, first_tables(db, project, of), of, timing_reason);
            assert_eq!(written(&component), component, "{what}");
            counted.machines += machines(db, project, of, &component, what);
        }
    }
}

/// The machine of a component is that of the model, where that has one.
fn machines<'db>(
    db: &'db Database,
    project: Project<'db>,
    of: Decl<'db>,
    set: &TaskSet,
    what: &str,
) -> usize {
    let is_timed = timetable_of(db, first_tables(db, project, of)).incomplete.is_none();
    let mut machines = 0;
    for level in levels(set) {
        let machine = match set.demand(&set.task[0], level).0 {
            Demand::Machine { machine, .. } => Some(machine),
            Demand::Unknown => None,
        };
        let psm = psm_of(db, first_tables(db, project, of), of, level).as_ref().ok().filter(|_| is_timed);
        assert_eq!(machine.as_ref(), psm.map(|psm| &psm.machine), "{what}");
        machines += usize::from(machine.is_some());
    }
    machines
}

fn count() -> u64 {
    search::cases("MAUVE_EXPORTS", 300)
}

#[test]
fn the_sample_robot_and_its_file_have_equal_figures() {
    let db = Database::default();
    let folder = mauve_tests::models().join("p3dx");
    let workspace = Workspace::of_texts(&db, folder.clone(), texts_in(&folder));
    let mut counted = Counted::default();
    check(&db, workspace, "p3dx", &mut counted);
    // Seven levels and three questions of nine activities, of which some are unbounded at some levels.
    assert!(counted.responses >= 140 && counted.not_analysed == 0, "{counted:?}");
    assert_eq!(counted.machines, 63, "of nine components: nobody measured the one in the background");
}

/// `plan` sends calls to `map`, and `drive` to both, over two connections to one of them; the last three activities may use
/// several CPUs. At 1e-9, `draw` takes longer than `plan` has.
#[test]
fn operations_and_sets_of_cpus() {
    let model = "
codel work(): int
codel think(): int
codel draw(): int
shell Map { provide view(): int  provide size(): int }
shell Plan { provide route(): int  require look(): int }
shell Drive { require go(): int  require again(): int  require see(): int }
core MapCore(Map) { provide view(): int = { return draw(); }  provide size(): int = { return 1; }  update = { work(); } }
core PlanCore(Plan) {
  handler h: look
  provide route(): int = { h = send(look); return think(); }
  statemachine {
    initial state Idle { run = { work(); }  transition go to Busy; }
    state Busy { run = { think(); h = send(look); }  transition done to Idle; }
  }
}
core DriveCore(Drive) {
  handler g: go
  handler a: again
  handler s: see
  update = { if work() > 1 then { g = send(go); g = send(go); } else { a = send(again); s = send(see); } }
}
component MapC(Map, MapCore)
component PlanC(Plan, PlanCore)
component DriveC(Drive, DriveCore)
architecture A {
  instance map: MapC
  instance plan: PlanC
  instance drive: DriveC
  operation map.view -> plan.look
  operation plan.route -> drive.go
  operation plan.route -> drive.again
  operation map.size -> drive.see
}
deployment D {
  architecture A
  activity map { priority = 3  period = 50  affinity = 1 }
  activity plan { priority = 2  period = 100  affinity = 3 }
  activity drive { priority = 1  period = 200 }
}";
    let config = "timing.tables = [\"times.toml\"]\n";
    let times = "levels = [1e-3, 1e-9]\n[codel]\nwork = 1\nthink = [2, 3]\ndraw = [0, 40]\n";
    let texts = [("/model.mal", model), ("/mauve.toml", config), ("/times.toml", times)];
    let texts = texts.map(|(path, text)| (PathBuf::from(path), text.to_owned()));
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let mut counted = Counted::default();
    check(&db, workspace, "operations", &mut counted);
    assert!(counted.calls >= 12 && counted.responses >= 15 && counted.not_analysed > 0, "{counted:?}");
    let (project, deployment) = deployments(&db, workspace)[0];
    let set = task_set_of(&db, project, deployment, timing_reason);
    let times = |times: &Numbers| match times {
        Numbers::One(_) => Vec::new(),
        Numbers::List(times) => {
            times.iter().flatten().map(|it| it.to_string().replace("000000", "")).collect()
        }
    };
    let operations: Vec<_> = set
        .operation
        .iter()
        .map(|it| (it.name.as_str(), it.client.as_str(), it.sends, it.during, times(&it.time).join(" ")))
        .collect();
    let expected = [
        ("route", "drive", 2, None, "2 3".to_owned()),
        ("route", "drive", 1, None, "2 3".to_owned()),
        ("view", "plan", 1, None, "0 40".to_owned()),
        ("view", "plan", 1, Some(0), "0 40".to_owned()),
        ("view", "plan", 1, Some(1), "0 40".to_owned()),
    ];
    assert_eq!(operations, expected);
}

/// One connection that is there twice sends each call twice. What is too long at 1e-9 only is said of that level.
#[test]
fn connections_that_repeat_and_reasons_of_one_level() {
    let model = "
codel work(): int
codel draw(): int
shell Map { provide view(): int }
shell Plan { require look(): int }
core MapCore(Map) { provide view(): int = { return draw(); }  update = { work(); } }
core PlanCore(Plan) { handler h: look  update = { h = send(look); } }
component MapC(Map, MapCore)
component PlanC(Plan, PlanCore)
architecture A {
  instance map: MapC
  instance plan: PlanC
  operation map.view -> plan.look
  operation map.view -> plan.look
}
deployment D {
  architecture A
  activity map { priority = 2  period = 50 }
  activity plan { priority = 1  period = 50 }
}";
    let check_with = |model: &str, times: &str| {
        let config = "timing.tables = [\"times.toml\"]\n";
        let times = format!("levels = [1e-3, 1e-9]\n{times}");
        let texts = [("/model.mal", model), ("/mauve.toml", config), ("/times.toml", times.as_str())];
        let texts = texts.map(|(path, text)| (PathBuf::from(path), text.to_owned()));
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let mut counted = Counted::default();
        check(&db, workspace, times.as_str(), &mut counted);
        let (project, deployment) = deployments(&db, workspace)[0];
        let level = Level::from_f64(1e-3).unwrap();
        let query = Query { level, method: Method::Psm };
        response_times(&db, project, deployment, query).activities[0].response
    };
    // Its own 1 ms, and two calls of 2 ms over each connection: a job may meet those of two periods.
    let twice = check_with(model, "[codel]\nwork = 1\ndraw = [2, 3]\n");
    assert_eq!(twice, Some(Time::from_nanos(9_000_000)));
    let long = "10000000000000";
    let sum = model.replace("update = { work(); }", "update = { work(); work(); }");
    // 2 ms of its own and four calls of 1 ms at 1e-3; at 1e-9, the sum of the two `work` is too long.
    let some = check_with(&sum, &format!("[codel]\nwork = [1, {long}]\ndraw = 1\n"));
    assert_eq!(some, Some(Time::from_nanos(6_000_000)));
    // At 1e-9, the overhead is too long as well.
    let none = check_with(
        &sum,
        &format!("[codel]\nwork = {long}\ndraw = 1\n[overhead]\ncontext_switch = [0, {long}]\n"),
    );
    assert_eq!(none, None);
}

/// What random models do not have: jitters, offsets, and work that is not in the model.
#[test]
fn releases_and_other_work() {
    let model = "codel work(): int  shell S { }  core K(S) { update = { work(); } }  component C(S, K)
        architecture A { instance a: C  instance b: C  instance c: C }
        deployment D {
          architecture A
          activity a { priority = 30 period = 10 jitter = 0.5 offset = 2 }
          activity b { priority = 20 period = 20 offset = 3 }
          activity c { priority = 10 period = 40 jitter = 50 }
        }";
    let config = "assume.codel = \"1 ms\"\nclocks.synchronised = [\"a\", \"c\"]\n[[platform.other]]\nname = \"lan\"\n\
                  priority = 25\nperiod = \"5 ms\"\ntime = \"0.5 ms\"\n";
    let db = Database::default();
    let texts = [("/robot.mal".into(), model.to_owned()), ("/mauve.toml".into(), config.to_owned())];
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let mut counted = Counted::default();
    check(&db, workspace, "releases", &mut counted);
    assert!(counted.responses > 0 && counted.not_analysed == 0, "{counted:?}");
    let (project, deployment) = deployments(&db, workspace)[0];
    let set = task_set_of(&db, project, deployment, timing_reason);
    let millis = |time: &Option<Number>| time.as_ref().map(|it| it.to_string().parse::<f64>().unwrap() / 1e6);
    let releases: Vec<_> = set.task.iter().map(|it| (millis(&it.jitter), millis(&it.offset))).collect();
    assert_eq!(releases, [(Some(0.5), Some(2.0)), (None, None), (Some(50.0), Some(0.0))]);
    let [other] = set.other.as_slice() else { panic!("{:?}", set.other) };
    let whole = |number| Number::Whole(number);
    assert_eq!((other.name.as_str(), &other.cpus), ("lan", &Some(Numbers::One(whole(1)))));
    assert_eq!(other.priority, Some(whole(25)));
    // It delays only the activities of lower priority.
    let query = Query { level: set.level(), method: Method::Psm };
    let report = response_times(&db, project, deployment, query);
    let mut breakdown = report.breakdown(&|| ());
    let delays: Vec<bool> =
        (0..3).map(|index| breakdown.of(index).iter().any(|it| it.instance == "lan (platform)")).collect();
    assert_eq!(delays, [false, true, true]);
}

#[test]
fn waits_and_locks() {
    let model = "codel grab(): int  codel look(): int  codel plan(): int  codel log(): int  codel late(): int
        shell S { }
        core Grab(S) { update = { if (grab() > 0) then { look(); } else { } } }
        core Look(S) { statemachine { initial state A { run = { look(); } transition t if (plan() > 0) to B }
            state B { run = { grab(); } transition u to A } } }
        core Plan(S) { update = { plan(); } }
        core Log(S) { update = { log(); } }
        core Late(S) { update = { late(); } }
        component G(S, Grab)  component L(S, Look)  component P(S, Plan)  component O(S, Log)  component T(S, Late)
        architecture A { instance g: G  instance l: L  instance p: P  instance o: O  instance t: T  instance q: T  instance r: T }
        deployment D { architecture A
            activity g { priority = 9 period = 20 affinity = 1 }  activity l { priority = 8 period = 30 affinity = 1 }
            activity p { priority = 7 period = 100 affinity = 1 }  activity o { priority = 6 period = 100 affinity = 1 }
            activity t { priority = 9 period = 50 affinity = 2 }  activity q { priority = 5 period = 90 affinity = 4 }
            activity r { priority = 4 period = 90 affinity = 4 } }";
    let times = "levels = [1e-3, 1e-4]\n[codel]\ngrab = [1, 2]\nlook = 2\nplan = 5\nlog = [4, 5]\nlate = 3\n[component]\nG = 4\n\
                 [wait]\ngrab = { time = [3, 4], times = 2 }\nlate = 8\n[overhead]\ncontext_switch = 0.1\n";
    let config = "timing.tables = [\"times.toml\"]\nplatform.cpus = 3\n[locks.map]\ncodels = [\"look\", \"plan\"]\n\
                  protocol = \"inheritance\"\nheld = \"1 ms\"\n[locks.log]\ncodels = [\"log\", \"plan\"]\nprotocol = \"PROTOCOL\"\n";
    for protocol in ["ceiling", "inheritance", "none"] {
        let config = config.replace("PROTOCOL", protocol);
        let files = [("/a.mal", model), ("/times.toml", times), ("/mauve.toml", config.as_str())];
        let db = Database::default();
        let texts = files.map(|(path, text)| (path.into(), text.to_owned()));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let mut counted = Counted::default();
        check(&db, workspace, protocol, &mut counted);
        assert!(counted.responses > 0, "{protocol}: {counted:?}");
    }
}

#[test]
fn random_models_and_their_files_have_equal_figures() {
    let mut counted = Counted::default();
    for seed in 0..count() / 5 {
        let db = Database::default();
        let model = random_model(seed);
        let model = if seed % 2 == 0 { model.varied(seed) } else { model };
        let workspace = Workspace::of_texts(&db, "/".into(), model.texts());
        check(&db, workspace, &format!("seed {seed}"), &mut counted);
    }
    assert!(counted.responses > 100 && counted.machines > 100, "{counted:?}");
}

#[test]
fn damaged_models() {
    let random = (0..count() / 30).map(DamagedProject::random);
    let mut counted = Counted::default();
    for (salt, project) in std::iter::once(DamagedProject::sample("p3dx")).chain(random).enumerate() {
        project.damage(
            (30, salt as u64),
            false,
            |texts, random| vec![any(texts, random)],
            |damaged| check(damaged.db, damaged.workspace, "damaged", &mut counted),
        );
    }
    let least = if search::is_full() { 100 } else { 0 };
    assert!(counted.responses > least && counted.not_analysed > least, "{counted:?}");
}

/// A file that somebody wrote himself, to harm: it is refused, or analysed, and nothing panics.
#[test]
fn hostile_task_sets() {
    let hostile = [
        json!(null),
        json!(0),
        json!(1),
        json!(2),
        json!(3),
        json!(99),
        json!(100),
        json!(-1),
        json!(1.5),
        json!(1e300),
        json!(u64::MAX),
        json!(u64::MAX / 2),
        json!(1_u64 << 63),
        json!(""),
        json!("background"),
        json!("\u{1b}[2J"),
        json!([]),
        json!({}),
        json!(true),
        json!([null]),
        json!([0]),
        json!(1e-9),
        json!(0.001),
    ];
    let db = Database::default();
    let folder = mauve_tests::models().join("p3dx");
    let workspace = Workspace::of_texts(&db, folder.clone(), texts_in(&folder));
    let (project, deployment) = deployments(&db, workspace)[0];
    let text = task_set_of(&db, project, deployment, timing_reason).to_json();
    let whole: Value = serde_json::from_str(&text).unwrap();
    let (mut refused, mut analysed) = (0, 0);
    cases(count() * 10, 0, |_, random| {
        let mut document = whole.clone();
        for _ in 0..1 + random.below(3) {
            let paths = pointers(&document);
            let path = random.of(&paths).clone();
            let other = match random.below(3) {
                0 => document.pointer(random.of(&paths).as_str()).unwrap().clone(),
                _ => random.of(&hostile).clone(),
            };
            *document.pointer_mut(&path).unwrap() = other;
        }
        match TaskSet::parse(&document.to_string(), Notation::Json) {
            Err(error) => {
                let message = task_set_error_message(&error);
                assert!(!message.chars().any(char::is_control), "{message:?}");
                refused += 1;
            }
            Ok(set) => {
                for &level in &set.levels {
                    for method in [Method::Psm, Method::Classic] {
                        let query = Query { level, method };
                        let report = response_times_of(&set, query).unwrap();
                        // Of nothing that is said not to be known is there a figure.
                        for (activity, asked) in report.activities.iter().zip(&set.task) {
                            let unknown = asked.not_analysed.iter().any(|it| it.holds(level, method));
                            assert!(!unknown || activity.response.is_none());
                        }
                        analysed += 1;
                    }
                }
            }
        }
    });
    assert!(refused > count() && analysed > count(), "{refused} refused, {analysed} analysed");
}

/// Where every value of a document stands.
fn pointers(document: &Value) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![(String::new(), document)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Array(values) => {
                open.extend(values.iter().enumerate().map(|(index, it)| (format!("{path}/{index}"), it)));
            }
            Value::Object(values) => {
                open.extend(values.iter().map(|(key, it)| (format!("{path}/{key}"), it)))
            }
            _ => {}
        }
        found.push(path);
    }
    found
}
