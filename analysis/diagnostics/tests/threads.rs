//! Threads of `[platform] threads`: their figures are those of the same priorities and CPUs in the model, and no thread is left out.

use expect_test::{Expect, expect};
use proptest::prelude::*;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, names_of, projects};
use mauve_wcrt::system_of;

use crate::common::{diagnostics, verdicts, workspace};

/// Three activities of 1, 2 and 4 ms in the threads of a file.
fn robot(threads: &str, more: &str) -> String {
    let activity = |(name, thread, fields): (&str, &str, &str)| {
        format!("  activity {name} {{ thread = \"{thread}\"  {fields} }}\n")
    };
    let activities = [
        ("a", "/a@Timer(10000000)", "period = 10"),
        ("b", "/b@Timer(20000000)@Waitable", "period = 20"),
        ("c", "logger", "period = 40"),
    ]
    .map(activity);
    format!(
        "{}{}}}\n//- /mauve.toml\n{CONFIG}{more}//- /t.toml\n{TIMES}//- /threads.yaml\n{threads}",
        MODEL,
        activities.concat()
    )
}

const MODEL: &str = "codel one(): int
codel two(): int
codel four(): int
shell S { }
core K1(S) { update = { one(); } }
core K2(S) { update = { two(); } }
core K4(S) { update = { four(); } }
component C1(S, K1)
component C2(S, K2)
component C4(S, K4)
architecture A { instance a: C1  instance b: C2  instance c: C4 }
deployment D {
  architecture A
";

const TIMES: &str = "[codel]\none = 1\ntwo = 2\nfour = 4\n";
const CONFIG: &str = "timing.tables = [\"t.toml\"]\n[platform]\ncpus = 2\nthreads = [\"threads.yaml\"]\n";

/// A file with three threads on CPU 0.
fn threads(a: &str, b: &str, c: &str) -> String {
    let entry = |(name, id, fields): (&str, &str, &str)| format!("  - {{{name}: {id}, {fields}}}\n");
    let [a, b] = [("id", "/a@Timer(10000000)", a), ("id", "/b@Timer(20000000)", b)].map(entry);
    format!("callback_groups:\n{a}{b}non_ros_threads:\n{}", entry(("name", "logger", c)))
}

const FINE: [&str; 3] = [
    "policy: SCHED_FIFO, priority: 30, affinity: [0]",
    "policy: SCHED_RR, priority: 20, affinity: [0]",
    "policy: SCHED_FIFO, priority: 10, affinity: [0]",
];

fn fine() -> String {
    threads(FINE[0], FINE[1], FINE[2])
}

fn check(threads: &str, more: &str, expected: Expect) {
    let robot = robot(threads, more);
    expected.assert_eq(&(verdicts(&robot) + &diagnostics(&robot)));
}

#[test]
fn the_file_has_priorities_and_cpus() {
    check(
        &fine(),
        "",
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]],
    );
    // On CPU 1, nothing delays `c`.
    let elsewhere = FINE[2].replace("[0]", "[1]");
    check(
        &threads(FINE[0], FINE[1], &elsewhere),
        "",
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 4 ms
    "#]],
    );
    // Linux keeps time for others.
    check(
        &("rt_throttling: {runtime_us: 950000, period_us: 1000000}\n".to_owned() + &fine()),
        "",
        expect![[r#"
            a missed 51 ms
            b missed 58 ms
            c missed 69 ms
            /threads.yaml "/a@Timer(10000000)" deadline-missed: `a` misses its deadline: ✗ 51 / 10 ms; real-time throttling adds 50 ms: set `kernel.sched_rt_runtime_us=-1` and `[platform] rt_throttling = false`
            /threads.yaml "/b@Timer(20000000)" deadline-missed: `b` misses its deadline: ✗ 58 / 20 ms; real-time throttling adds 50 ms: set `kernel.sched_rt_runtime_us=-1` and `[platform] rt_throttling = false`
            /threads.yaml "logger" deadline-missed: `c` misses its deadline: ✗ 69 / 40 ms; real-time throttling adds 50 ms: set `kernel.sched_rt_runtime_us=-1` and `[platform] rt_throttling = false`
        "#]],
    );
}

/// A callback executes for each message when it comes: the first message that counts is one of the window, too. Another thread may have
/// waited with it for `least`.
#[test]
fn each_message_releases_a_callback() {
    let robot = |hand: &str, entry: &str| {
        format!(
            "codel look(out seen: int): void
codel move(in seen: int): void
shell E {{ output port seen: int }}
shell H {{ input port seen: int }}
core See(E) {{ var x: int  update = {{ look(x); write(seen, x); }} }}
core Move(H) {{ var x: int  update = {{ read(seen, x); move(x); }} }}
component Eye(E, See)
component Hand(H, Move)
architecture A {{ instance eye: Eye  instance hand: Hand  connection eye.seen -> hand.seen }}
deployment D {{
  architecture A
  activity eye {{ thread = \"/eye@Timer(100000000)\"  period = 100 }}
  activity hand {{ thread = \"{hand}\"  trigger = seen  least = 70  deadline = 100 }}
}}
//- /mauve.toml
{CONFIG}//- /t.toml
[codel]
look = 50
move = 75
//- /threads.yaml
callback_groups:
  - {{id: /eye@Timer(100000000), policy: SCHED_FIFO, priority: 9, affinity: [1]}}
{entry}: {hand}, {}}}
",
            FINE[0]
        )
    };
    // Two messages are 70 ms apart, the third one comes 150 ms after the first one: 2 · 75 − 70.
    expect![[r#"
        eye met 50 ms
        hand met 80 ms
    "#]]
    .assert_eq(&verdicts(&robot("/hand@Subscription(/seen)", "  - {id")));
    expect![[r#"
        eye met 50 ms
        hand met 100 ms
    "#]]
    .assert_eq(&verdicts(&robot("worker", "non_ros_threads:\n  - {name")));
}

#[test]
fn policies_without_a_bound() {
    check(
        &threads(FINE[0], "policy: SCHED_OTHER, nice: 0", FINE[2]),
        "",
        expect![[r#"
        a met 1 ms
        b background
        c met 5 ms
    "#]],
    );
    check(
        &threads("policy: SCHED_DEADLINE, runtime: 2000, period: 5000, deadline: 4000", FINE[1], FINE[2]),
        "",
        expect![[r#"
            a not-analysed: its thread has the policy SCHED_DEADLINE, which is not analysed: use SCHED_FIFO
            b not-analysed: `a`, whose priority is unknown, may preempt it and is not analysed
            c not-analysed: `a`, whose priority is unknown, may preempt it and is not analysed
            /threads.yaml "/a@Timer(10000000)" not-analysed: `a` is not analysed: its thread has the policy SCHED_DEADLINE, which is not analysed: use SCHED_FIFO
        "#]],
    );
    // Threads of SCHED_RR and of one priority take turns.
    check(
        &threads(FINE[0], FINE[1], &FINE[2].replace("10", "20")),
        "",
        expect![[r#"
            a met 1 ms
            b not-analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
            c not-analysed: `b` may preempt it and is not analysed
            /threads.yaml "/b@Timer(20000000)" not-analysed: `b` is not analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
        "#]],
    );
}

#[test]
fn what_readers_refuse_leaves_nothing_analysed() {
    check(
        &threads(FINE[0], "policy: SCHED_FIFO, priority: 100, affinity: [0]", FINE[2]),
        "",
        expect![[r#"
        a not-analysed: threads.yaml: invalid `priority`: expected an integer from 1 to 99, in decimal digits
        b not-analysed: it has no priority; threads.yaml: invalid `priority`: expected an integer from 1 to 99, in decimal digits
        c not-analysed: threads.yaml: invalid `priority`: expected an integer from 1 to 99, in decimal digits
        /threads.yaml "100" invalid-table: invalid `priority`: expected an integer from 1 to 99, in decimal digits
    "#]],
    );
    check(
        &("rt_throttling: {runtime_us: 100, period_us: 200}\n".to_owned() + &fine()),
        "",
        expect![[r#"
            a not-analysed: threads.yaml: the throttling of real-time threads is analysed with 950000 us of 1000000 us, or without a limit (`runtime_us: -1`)
            b not-analysed: threads.yaml: the throttling of real-time threads is analysed with 950000 us of 1000000 us, or without a limit (`runtime_us: -1`)
            c not-analysed: threads.yaml: the throttling of real-time threads is analysed with 950000 us of 1000000 us, or without a limit (`runtime_us: -1`)
            /threads.yaml "100" invalid-table: the throttling of real-time threads is analysed with 950000 us of 1000000 us, or without a limit (`runtime_us: -1`)
        "#]],
    );
    check(
        "callback_groups: [",
        "",
        expect![[r#"
            a not-analysed: its thread cannot be used; threads.yaml: not YAML: while parsing a node, did not find expected node content
            b not-analysed: its thread cannot be used; threads.yaml: not YAML: while parsing a node, did not find expected node content
            c not-analysed: its thread cannot be used; threads.yaml: not YAML: while parsing a node, did not find expected node content
            /threads.yaml "" invalid-table: not YAML: while parsing a node, did not find expected node content
        "#]],
    );
    let missing = robot(&fine(), "").replace("//- /threads.yaml", "//- /other.yaml");
    expect![[r#"
        a not-analysed: its thread cannot be used; mauve.toml: no file matches `threads.yaml`
        b not-analysed: its thread cannot be used; mauve.toml: no file matches `threads.yaml`
        c not-analysed: its thread cannot be used; mauve.toml: no file matches `threads.yaml`
        /mauve.toml "\"threads.yaml\"" invalid-configuration: no file matches `threads.yaml`
    "#]]
    .assert_eq(&(verdicts(&missing) + &diagnostics(&missing)));
}

#[test]
fn a_thread_of_another_id_is_unknown() {
    check(
        &fine().replace("Timer(20000000)", "Timer(20000001)"),
        "",
        expect![[r#"
            a not-analysed: `b`, whose priority is unknown, may preempt it and is not analysed
            b not-analysed: its thread cannot be used; the thread `/b@Timer(20000001)` of threads.yaml may delay it, and no activity has it
            c not-analysed: the thread `/b@Timer(20000001)` of threads.yaml may delay it, and no activity has it; `b`, whose priority is unknown, may preempt it and is not analysed
            /model.mal "\"/b@Timer(20000000)@Waitable\"" invalid-field: no thread `/b@Timer(20000000)`, or several, in the files of `[platform] threads` of mauve.toml; did you mean `/b@Timer(20000001)`?
            /threads.yaml "/b@Timer(20000001)" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "/b@Timer(20000001)"`, or declare `[[platform.other]]` with `name = "/b@Timer(20000001)"`, this priority, its CPUs and how much it executes
        "#]],
    );
    // Of one id, one of the two counts.
    check(
        &fine().replace(
            "callback_groups:\n",
            "callback_groups:\n  - {id: /b@Timer(20000000), domain_id: 3, policy: SCHED_OTHER, nice: 0}\n",
        ),
        "",
        expect![[r#"
            a not-analysed: the thread `/b@Timer(20000000)` of threads.yaml may delay it, and no activity has it; threads.yaml: a second entry of `/b@Timer(20000000)`: which of the two counts is unknown
            b not-analysed: two entries have the id of its thread; the thread `/b@Timer(20000000)` of threads.yaml may delay it, and no activity has it; threads.yaml: a second entry of `/b@Timer(20000000)`: which of the two counts is unknown
            c not-analysed: the thread `/b@Timer(20000000)` of threads.yaml may delay it, and no activity has it; threads.yaml: a second entry of `/b@Timer(20000000)`: which of the two counts is unknown
            /threads.yaml "/b@Timer(20000000)" invalid-table: a second entry of `/b@Timer(20000000)`: which of the two counts is unknown
        "#]],
    );
}

#[test]
fn a_callback_without_an_activity_is_not_left_out() {
    let group = |callbacks: &str| fine().replace("/a@Timer(10000000)", &format!("/a{callbacks}"));
    // It does execute: the others have no bound.
    check(
        &group("@Timer(10000000)@Timer(50000000)"),
        "",
        expect![[r#"
        a not-analysed: `Timer(50000000)` of the thread `/a@Timer(10000000)@Timer(50000000)` may delay it, and has no activity
        b not-analysed: `Timer(50000000)` of the thread `/a@Timer(10000000)@Timer(50000000)` may delay it, and has no activity; `a` may preempt it and is not analysed
        c not-analysed: `Timer(50000000)` of the thread `/a@Timer(10000000)@Timer(50000000)` may delay it, and has no activity; `a` and `b` may preempt it and are not analysed
        /threads.yaml "/a@Timer(10000000)@Timer(50000000)" not-analysed: no activity of D has `Timer(50000000)` of this thread, and what it may delay is not analysed: add an activity with `thread = "/a@Timer(50000000)"`
    "#]],
    );
    let two = robot(&group("@Timer(10000000)@Timer(10000000)"), "");
    assert!(diagnostics(&two).contains("no activity of D has `Timer(10000000)` of this thread"));
    check(
        &group("@Service(/x)@Timer(10000000)").replace("/b@Timer(20000000)", "/b/*"),
        "",
        expect![[r#"
            a met 1 ms
            b not-analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
            c not-analysed: `b` may preempt it and is not analysed
            /threads.yaml "/b/*" not-analysed: `b` is not analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
        "#]],
    );
    let idle = |group: &str| {
        let db = Database::default();
        let robot = robot(&fine().replace("/a@Timer(10000000)", group).replace("RR", "FIFO"), "");
        let project = projects(&db, workspace(&db, &robot))[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        system_of(&db, project, deployment).never_executed.clone()
    };
    assert_eq!(idle("/a@Timer(10000000)"), []);
    let all = "/a@Service(/x)@Subscription(/y)@Timer(10000000)";
    assert_eq!(idle(all), ["Service(/x)", "Subscription(/y)"].map(|it| (all.into(), Some(it.into()))));
    assert_eq!(idle("/a/*"), [("/a/*".into(), None)]);
}

#[test]
fn two_files_have_one_id() {
    let robot = robot(&fine(), "").replace("[\"threads.yaml\"]", "[\"threads.yaml\", \"more.yaml\"]");
    let more = "//- /more.yaml\nnon_ros_threads: [{name: logger, policy: SCHED_FIFO, priority: 9}]\n";
    let robot = robot + more;
    expect![[r#"
        a not-analysed: the thread `logger` of more.yaml may delay it, and no activity has it; `c`, whose priority is unknown, may preempt it and is not analysed
        b not-analysed: the thread `logger` of more.yaml may delay it, and no activity has it; `a` and `c` may preempt it and are not analysed
        c not-analysed: two entries have the id of its thread; the thread `logger` of more.yaml may delay it, and no activity has it
        /more.yaml "logger" invalid-table: a second entry of `logger`: which of the two counts is unknown
        /threads.yaml "logger" invalid-table: a second entry of `logger`: which of the two counts is unknown
    "#]].assert_eq(&(verdicts(&robot) + &diagnostics(&robot)));
}

#[test]
fn a_thread_without_an_activity_is_not_left_out() {
    let more = |policy: &str| fine() + &format!("  - {{name: driver, {policy}, affinity: [0]}}\n");
    let driver = more("policy: SCHED_FIFO, priority: 20");
    check(
        &driver,
        "",
        expect![[r#"
            a met 1 ms
            b not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it
            c not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it; `b` may preempt it and is not analysed
            /threads.yaml "driver" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "driver"`, or declare `[[platform.other]]` with `name = "driver"`, this priority, its CPUs and how much it executes
        "#]],
    );
    let declared = |priority| {
        format!(
            "[[platform.other]]\nname = \"driver\"\npriority = {priority}\nperiod = \"10 ms\"\ntime = \"1 ms\"\ncpus = [1]\n"
        )
    };
    check(
        &driver,
        &declared(20),
        expect![[r#"
            a met 1 ms
            b not-analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
            c not-analysed: `b` may preempt it and is not analysed
            /threads.yaml "/b@Timer(20000000)" not-analysed: `b` is not analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
        "#]],
    );
    check(
        &driver,
        &declared(19),
        expect![[r#"
            a met 1 ms
            b not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it
            c not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it; `b` may preempt it and is not analysed
            /threads.yaml "driver" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "driver"`, or declare `[[platform.other]]` with `name = "driver"`, this priority, its CPUs and how much it executes
        "#]],
    );
    check(
        &more("policy: SCHED_OTHER, nice: -20"),
        "",
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]],
    );
    check(
        &more("policy: SCHED_DEADLINE, runtime: 2000, period: 5000, deadline: 4000"),
        &declared(99),
        expect![[r#"
            a not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it
            b not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it; `a` may preempt it and is not analysed
            c not-analysed: the thread `driver` of threads.yaml may delay it, and no activity has it; `a` and `b` may preempt it and are not analysed
            /threads.yaml "driver" not-analysed: no activity of D has this thread, and what it may delay is not analysed: use SCHED_FIFO, for which bounds are known
        "#]],
    );
    // The entry of all groups of a node.
    let any = fine().replace("/b@Timer(20000000)", "/b/*");
    check(
        &any,
        "",
        expect![[r#"
            a met 1 ms
            b not-analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
            c not-analysed: `b` may preempt it and is not analysed
            /threads.yaml "/b/*" not-analysed: `b` is not analysed: threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of 20: use SCHED_FIFO, or other priorities
        "#]],
    );
}

#[test]
fn the_model_does_not_say_it_again() {
    let twice = robot(&fine(), "").replace("period = 20", "priority = 20  affinity = 1  period = 20");
    expect![[r#"
        a met 1 ms
        b not-analysed: its priority cannot be used; its affinity cannot be used
        c not-analysed: `b` may preempt it and is not analysed
        /model.mal "20" invalid-field: the thread has the priority in its file: remove it here
        /model.mal "1" invalid-field: the thread has the affinity in its file: remove it here
    "#]]
    .assert_eq(&(verdicts(&twice) + &diagnostics(&twice)));
}

#[test]
fn another_deployment_needs_no_threads() {
    let other = "deployment Other {
  architecture A
  activity a { priority = 3  period = 10 }
  activity b { priority = 2  period = 20 }
  activity c { priority = 1  period = 40 }
}
//- /mauve.toml";
    let with_other = robot(&fine(), "").replacen("//- /mauve.toml", other, 1);
    expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
        a met 1 ms
        b met 2 ms
        c met 5 ms
    "#]]
    .assert_eq(&(verdicts(&with_other) + &diagnostics(&with_other)));
}

/// The control loop of ros2_control, and an asynchronous controller, on one CPU.
const CONTROLLERS: &str = "controller_manager:
  ros__parameters:
    update_rate: 1000
    thread_priority: 98
    cpu_affinity: [0]
    body: { type: body_controllers/BodyController }
    plan: { type: plan_controllers/PlanController }
plan:
  ros__parameters:
    update_rate: 20
    is_async: true
    async_parameters: { thread_priority: 40, cpu_affinity: [0] }
";

fn controlled(activities: &str, controllers: &str) -> String {
    let config = CONFIG.replace("threads.yaml", "controllers.yaml");
    let model = MODEL.replace("instance c: C4 ", "").replace("instance b: C2 ", "instance b: C4 ");
    let times = TIMES.replace("one = 1", "one = 0.4");
    let robot = format!(
        "{model}{activities}}}\n//- /mauve.toml\n{config}//- /t.toml\n{times}//- /controllers.yaml\n{controllers}"
    );
    verdicts(&robot) + &diagnostics(&robot)
}

#[test]
fn a_control_loop_has_its_rate_priority_and_cpus() {
    let plan = "activity b { thread = \"/plan\" }\n";
    let both = "activity a { thread = \"/controller_manager\" }\n".to_owned() + plan;
    expect![[r#"
        a met 0.4 ms
        b met 7.8 ms
    "#]]
    .assert_eq(&controlled(&both, CONTROLLERS));
    // The defaults: 100 Hz, priority 50, any CPU.
    let defaults = CONTROLLERS.replace("    update_rate: 1000\n    thread_priority: 98\n", "");
    expect![[r#"
        a met 0.4 ms
        b met 14.4 ms
    "#]]
    .assert_eq(&controlled(&both, &defaults));
    // The loop comes more often than the model says.
    let slow = "activity a { thread = \"/controller_manager\"  period = 2 }\n".to_owned() + plan;
    expect![[r#"
        a not-analysed: its period cannot be used
        b not-analysed: `a` may preempt it and is not analysed
        /model.mal "2" invalid-field: the thread has the period 1 ms by its file: write a shorter one, or none
    "#]]
    .assert_eq(&controlled(&slow, CONTROLLERS));
    let short = "activity a { thread = \"/controller_manager\"  period = 0.5 }\n".to_owned() + plan;
    expect![[r#"
        a met 0.4 ms
        b met 21 ms
    "#]]
    .assert_eq(&controlled(&short, CONTROLLERS));
    // Of 20 Hz: at least half a cycle less than 50 ms.
    let slow = both.replace("\"/plan\"", "\"/plan\"  period = 50");
    expect![[r#"
        a met 0.4 ms
        b not-analysed: its period cannot be used
        /model.mal "50" invalid-field: the thread has the period 49.5 ms by its file: write a shorter one, or none
    "#]].assert_eq(&controlled(&slow, CONTROLLERS));
    // No activity has the loop.
    let other = "activity a { priority = 1  period = 10 }\n".to_owned() + plan;
    expect![[r#"
        a not-analysed: the thread `/controller_manager` of controllers.yaml may delay it, and no activity has it; `b` may preempt it and is not analysed
        b not-analysed: the thread `/controller_manager` of controllers.yaml may delay it, and no activity has it
        /controllers.yaml "1000" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "/controller_manager"`, or declare `[[platform.other]]` with `name = "/controller_manager"`, this priority, its CPUs and how much it executes
    "#]].assert_eq(&controlled(&other, CONTROLLERS));
    // Its reader refuses it.
    expect![[r#"
        a not-analysed: it has no priority; controllers.yaml: invalid `thread_priority`: expected an integer from 1 to 99, in decimal digits
        b not-analysed: controllers.yaml: invalid `thread_priority`: expected an integer from 1 to 99, in decimal digits
        /controllers.yaml "\"98\"" invalid-table: invalid `thread_priority`: expected an integer from 1 to 99, in decimal digits
    "#]].assert_eq(&controlled(&both, &CONTROLLERS.replace("98", "\"98\"")));
}

/// What a wildcard perhaps says of a node may be worse than the default, and than what another section says.
#[test]
fn an_uncertain_rate_cpu_or_thread_of_a_control_loop_has_no_figures() {
    let both = "activity a { thread = \"/controller_manager\" }\nactivity b { thread = \"/plan\" }\n";
    for perhaps in [
        "/*: { ros__parameters: { update_rate: 2000 } }\n",
        "/*: { ros__parameters: { cpu_affinity: [1] } }\n",
        "/*/plan: { ros__parameters: { is_async: false } }\n",
    ] {
        let found = controlled(both, &(CONTROLLERS.to_owned() + perhaps));
        assert!(
            found.contains("a not-analysed: it has no priority") && !found.contains("met"),
            "{perhaps}{found}"
        );
    }
}

#[test]
fn callbacks_of_one_entry_have_one_thread() {
    let group = "/a@Subscription(/x)@Timer(10000000)";
    let file = fine().replace("/a@Timer(10000000)", group).replace("FIFO, priority: 30", "RR, priority: 30");
    let robot = robot(&file, "").replace("/b@Timer(20000000)@Waitable", "/a@Subscription(/x)");
    expect![[r#"
        a met 3 ms
        b met 3 ms
        c not-analysed: the thread `/b@Timer(20000000)` of threads.yaml may delay it, and no activity has it
        /threads.yaml "/b@Timer(20000000)" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "/b@Timer(20000000)"`, or declare `[[platform.other]]` with `name = "/b@Timer(20000000)"`, this priority, its CPUs and how much it executes
    "#]].assert_eq(&(verdicts(&robot) + &diagnostics(&robot)));
    // Another group has such a timer, too.
    let two = file.replace("/b@Timer(20000000)", "/a@Subscription(/y)@Timer(10000000)");
    let robot = robot.replace(&file, &two);
    expect![[r#"
        a not-analysed: its thread cannot be used; the thread `/a@Subscription(/y)@Timer(10000000)` of threads.yaml may delay it, and no activity has it
        b not-analysed: `Timer(10000000)` of the thread `/a@Subscription(/x)@Timer(10000000)` may delay it, and has no activity; `a`, whose priority is unknown, may preempt it and is not analysed
        c not-analysed: the thread `/a@Subscription(/y)@Timer(10000000)` of threads.yaml may delay it, and no activity has it; `a` and `b` may preempt it and are not analysed
        /model.mal "\"/a@Timer(10000000)\"" invalid-field: no thread `/a@Timer(10000000)`, or several, in the files of `[platform] threads` of mauve.toml
        /threads.yaml "/a@Subscription(/x)@Timer(10000000)" not-analysed: no activity of D has `Timer(10000000)` of this thread, and what it may delay is not analysed: add an activity with `thread = "/a@Timer(10000000)"`
        /threads.yaml "/a@Subscription(/y)@Timer(10000000)" not-analysed: no activity of D has this thread, and what it may delay is not analysed: give its callbacks activities with `thread = "/a@Subscription(/y)@Timer(10000000)"`, or declare `[[platform.other]]` with `name = "/a@Subscription(/y)@Timer(10000000)"`, this priority, its CPUs and how much it executes
    "#]].assert_eq(&(verdicts(&robot) + &diagnostics(&robot)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The same values in the model give the same figures.
    #[test]
    fn figures_are_those_of_the_values_in_the_model(
        entries in prop::array::uniform3((0..6_u32, 0..4_u32)), order in Just([0, 1, 2]).prop_shuffle(),
    ) {
        let policy = |priority: u32| match priority {
            0 => "policy: SCHED_OTHER, nice: 0".to_owned(),
            priority => format!("policy: SCHED_FIFO, priority: {priority}"),
        };
        let cpus = |mask: u32| (0..2).filter(|cpu| mask & 1 << cpu != 0).map(|cpu| cpu.to_string()).collect::<Vec<_>>().join(", ");
        let [a, b, c] = entries.map(|(priority, mask)| format!("{}, affinity: [{}]", policy(priority), cpus(mask)));
        let in_file = robot(&threads(&a, &b, &c), "");
        let fields = entries.map(|(priority, mask)| match priority {
            0 => format!("priority = background  affinity = {mask}"),
            priority => format!("priority = {priority}  affinity = {mask}"),
        });
        let periods = [("a", 10), ("b", 20), ("c", 40)];
        let activities = order.map(|index: usize| format!("activity {} {{ {}  period = {} }}\n", periods[index].0, fields[index], periods[index].1));
        let config = CONFIG.replace("threads = [\"threads.yaml\"]\n", "");
        let in_model = format!("{MODEL}{}}}\n//- /mauve.toml\n{config}//- /t.toml\n{TIMES}", activities.concat());
        let sorted = |text: String| { let mut lines: Vec<String> = text.lines().map(str::to_owned).collect(); lines.sort(); lines };
        prop_assert_eq!(sorted(verdicts(&in_file)), sorted(verdicts(&in_model)), "{}", in_file);
    }
}
