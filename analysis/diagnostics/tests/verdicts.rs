//! What of a deployment is analysed: nothing that rests on what was lost, and everything else.

use expect_test::{Expect, expect};
use mauve_diagnostics::{Finding, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, names_of, projects};
use mauve_timing::{Level, Method};
use mauve_wcrt::{Deadlines, Query, Report, response_times};

use crate::common::{LEVEL, diagnostics, verdicts, verdicts_with, workspace};

/// Three activities of 1, 2 and 4 ms on one CPU, by falling priority.
const ROBOT: &str = "
codel one(): int
codel two(): int
codel four(): int
shell S { }
shell Serving { provide help(): int }
shell Asking { require help(): int }
core K1(S) { update = { one(); } }
core K2(S) { update = { two(); } }
core K4(S) { update = { four(); } }
core KS(Serving) { provide help() = { return one(); } update = { two(); } }
core KA(Asking) { update = { one(); } }
component C1(S, K1)
component C2(S, K2)
component C4(S, K4)
component CS(Serving, KS)
component CA(Asking, KA)
architecture A { instance a: C1  instance b: C2  instance c: C4 }
";

const TIMES: &str = "
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
one = 1
two = 2
four = 4
";

fn check(deployment: &str, expected: Expect) {
    expected.assert_eq(&verdicts(&format!("{ROBOT}{deployment}{TIMES}")));
}

fn activities(a: &str, b: &str, c: &str) -> String {
    format!(
        "deployment D {{ architecture A  activity a {{ {a} }}  activity b {{ {b} }}  activity c {{ {c} }} }}"
    )
}

const FINE: (&str, &str, &str) =
    ("priority = 3 period = 10", "priority = 2 period = 10", "priority = 1 period = 10");

#[test]
fn a_system_without_faults() {
    check(
        &activities(FINE.0, FINE.1, FINE.2),
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]],
    );
}

/// The response times of deployment `D` in the fixture.
fn reported<T>(fixture: &str, of: impl FnOnce(&Report<'_>) -> T) -> T {
    let db = Database::default();
    let project = projects(&db, workspace(&db, fixture))[0];
    let decl = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
    of(response_times(&db, project, decl, Query::shown(&db, project, decl)))
}

/// How many deadlines are met, unknown, and there.
fn deadlines(deployment: &str) -> [usize; 3] {
    let found = reported(&format!("{ROBOT}{deployment}{TIMES}"), |report| report.deadlines());
    let Deadlines { met, unknown, all } = found;
    [met, unknown, all]
}

#[test]
fn deadlines_are_counted() {
    let [met, missed] = ["priority = 1 period = 10", "priority = 1 period = 10 deadline = 6"];
    assert_eq!(deadlines(&activities(FINE.0, FINE.1, met)), [3, 0, 3]);
    assert_eq!(deadlines(&activities(FINE.0, FINE.1, missed)), [2, 0, 3]);
    assert_eq!(deadlines(&activities("priority = background", FINE.1, missed)), [2, 0, 2]);
    // What is less urgent may be delayed by what is not known.
    assert_eq!(deadlines(&activities(FINE.0, "priority = 2 period = 0", met)), [1, 2, 3]);
    // Where an activity may be missing, nothing is known of the others.
    let lost = "deployment D { architecture A  actvity b { priority = 1 }
        activity a { priority = 3 period = 10 } activity c { priority = background } }";
    assert_eq!(deadlines(lost), [0, 2, 2]);
}

#[test]
fn equal_priorities_delay_each_other() {
    check(
        &activities("priority = 2 period = 10", "priority = 2 period = 10", "priority = 1 period = 10"),
        expect![[r#"
        a met 3 ms
        b met 3 ms
        c met 7 ms
    "#]],
    );
}

#[test]
fn background_delays_nobody() {
    check(
        &activities("priority = background", FINE.1, FINE.2),
        expect![[r#"
        a background
        b met 2 ms
        c met 6 ms
    "#]],
    );
}

#[test]
fn a_deadline_is_missed_strictly_after_it() {
    check(
        &activities(FINE.0, FINE.1, "priority = 1 period = 10 deadline = 7"),
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]],
    );
    check(
        &activities(FINE.0, FINE.1, "priority = 1 period = 10 deadline = 6.999999"),
        expect![[r#"
        a met 1 ms
        b met 3 ms
        c missed 7 ms
    "#]],
    );
}

#[test]
fn a_broken_field_takes_what_it_may_delay_with_it() {
    // The priority is known: what is more urgent is not delayed.
    check(
        &activities(FINE.0, "priority = 2 period = 0", FINE.2),
        expect![[r#"
            a met 1 ms
            b not-analysed: its period cannot be used
            c not-analysed: `b` may preempt it and is not analysed
        "#]],
    );
    // It is not known: it may be the most urgent.
    check(
        &activities(FINE.0, "priority = 100 period = 10", FINE.2),
        expect![[r#"
            a not-analysed: `b`, whose priority is unknown, may preempt it and is not analysed
            b not-analysed: its priority cannot be used
            c not-analysed: `b`, whose priority is unknown, may preempt it and is not analysed
        "#]],
    );
    check(
        &activities(FINE.0, "priority = 2 period = 10 deadlin = 5", FINE.2),
        expect![[r#"
            a met 1 ms
            b not-analysed: unknown field `deadlin`; did you mean `deadline`?
            c not-analysed: `b` may preempt it and is not analysed
        "#]],
    );
    check(
        &activities(FINE.0, "priority = 2 period = 10 period = 20", FINE.2),
        expect![[r#"
            a met 1 ms
            b not-analysed: `period` of `b` is set twice: remove one of the values
            c not-analysed: `b` may preempt it and is not analysed
        "#]],
    );
    check(
        &activities(FINE.0, "priority = 2 period = 10 deadline = 99999999999", FINE.2),
        expect![[r#"
            a met 1 ms
            b not-analysed: its deadline cannot be used
            c not-analysed: `b` may preempt it and is not analysed
        "#]],
    );
}

#[test]
fn a_field_that_may_be_another_one_leaves_the_priority_unknown() {
    // The only number may be the period.
    check(
        &activities(FINE.0, "priority = 2", FINE.2),
        expect![[r#"
        a not-analysed: `b`, whose priority may be intended as its period, may preempt it and is not analysed
        b not-analysed: it has no period
        c not-analysed: `b`, whose priority may be intended as its period, may preempt it and is not analysed
    "#]],
    );
    // The other number may be the priority.
    check(
        &activities(FINE.0, "affinity = 0.5 priority = 2 period = 10", FINE.2),
        expect![[r#"
        a not-analysed: `b`, whose affinity may be intended as its priority, may preempt it and is not analysed
        b not-analysed: its affinity cannot be used
        c not-analysed: `b`, whose affinity may be intended as its priority, may preempt it and is not analysed
    "#]],
    );
    // A background activity has no period: it may be real-time.
    for field in ["priority = background period = 0", "priority = backgrund period = 10"] {
        let found = verdicts(&format!("{ROBOT}{}{TIMES}", activities(FINE.0, field, FINE.2)));
        assert_eq!(found.matches("not-analysed").count(), 3, "{field}: {found}");
    }
    // Two activities may preempt it.
    check(
        &activities("period = 10", "period = 20", FINE.2),
        expect![[r#"
        a not-analysed: it has no priority; `b`, whose priority is unknown, may preempt it and is not analysed
        b not-analysed: it has no priority; `a`, whose priority is unknown, may preempt it and is not analysed
        c not-analysed: `a` and `b`, whose priorities are unknown, may preempt it and are not analysed
    "#]],
    );
}

#[test]
fn half_typed_activities() {
    check(
        "deployment D { architecture A
             activity a { priority = 3 period = 10 }
             activity b { priority = 2 period =
             activity c { priority = 1 period = 10 } }",
        expect![[r#"
            a met 1 ms
            b not-analysed: its period has a syntax error
            c not-analysed: `b` may preempt it and is not analysed
        "#]],
    );
    check(
        "deployment D { architecture A
             activity a { priority = 3 period = 10 }
             activity b
             activity c { priority = 1 period = 10 } }",
        expect![[r#"
            a not-analysed: `b`, whose priority is unknown, may preempt it and is not analysed
            b not-analysed: its activity has a syntax error; it has no priority
            c not-analysed: `b`, whose priority is unknown, may preempt it and is not analysed
        "#]],
    );
    check(
        "deployment D { architecture A  actvity b { priority = 1 }
             activity a { priority = 3 period = 10 }
             activity c { priority = 1 period = 10 } }",
        expect![[r#"
            a not-analysed: deployment D has a syntax error: an activity may be missing in it
            c not-analysed: deployment D has a syntax error: an activity may be missing in it
            b not-analysed: it has no activity; deployment D has a syntax error: an activity may be missing in it
        "#]],
    );
}

#[test]
fn a_codel_that_is_declared_twice_is_no_built_in_function() {
    let deployment = "deployment D { architecture A  activity a { priority = 1 period = 10 } }";
    let robot = "codel read(in x: int): int\ncodel read(in y: int): int\nshell S { }\n\
                 core K(S) { update = { read(1); read(2); } }\ncomponent C(S, K)\n\
                 architecture A { instance a: C }\n";
    let fixture = format!("{robot}{deployment}\n//- /mauve.toml\nassume.codel = \"5 ms\"\n");
    expect![[r#"
        a not-analysed: core K: codel `read` is declared twice
    "#]]
    .assert_eq(&verdicts(&fixture));
}

#[test]
fn a_word_behind_a_value_may_be_a_unit_or_a_lost_field() {
    check(
        "deployment D { architecture A
             activity a { priority = 3 period = 10 affinity }
             activity b { priority = 2 period = 10 affinity = 2 }
             activity c { priority = 1 period = 10 ms } }",
        expect![[r#"
            a not-analysed: its period has a syntax error
            b not-analysed: `a` may preempt it and is not analysed
            c not-analysed: its period has a syntax error; `a` may preempt it and is not analysed
        "#]],
    );
}

#[test]
fn instances_and_activities_that_do_not_match() {
    check(
        "deployment D { architecture A  activity a { priority = 3 period = 10 } activity b { priority = 2 period = 10 } }",
        expect![[r#"
            a not-analysed: `c`, whose priority is unknown, may preempt it and is not analysed
            b not-analysed: `c`, whose priority is unknown, may preempt it and is not analysed
            c not-analysed: it has no activity
        "#]],
    );
    check(
        &(activities(FINE.0, FINE.1, FINE.2).replace("} }", "}")
            + " activity d { priority = 2 period = 10 } }"),
        expect![[r#"
            a not-analysed: architecture A has no instance `d`: one may be missing in it
            b not-analysed: architecture A has no instance `d`: one may be missing in it
            c not-analysed: architecture A has no instance `d`: one may be missing in it
            d not-analysed: its instance is unknown; architecture A has no instance `d`: one may be missing in it
        "#]],
    );
    check(
        &(activities(FINE.0, FINE.1, FINE.2).replace("} }", "}")
            + " activity b { priority = 1 period = 10 } }"),
        expect![[r#"
            a not-analysed: `b`, which has two activities, may preempt it and is not analysed
            b not-analysed: `b` has two activities: remove one of them
            c not-analysed: `b`, which has two activities, may preempt it and is not analysed
            b not-analysed: `b` has two activities: remove one of them
        "#]],
    );
    check(
        "deployment D { activity a { priority = 3 period = 10 } }",
        expect![[r#"
            a not-analysed: its instance is unknown; the architecture of deployment D is unknown
        "#]],
    );
}

#[test]
fn verdicts_depend_on_cpus() {
    check(
        &activities(
            "affinity = 1 priority = 3 period = 10",
            "affinity = 2 priority = 2 period = 10",
            "affinity = 0x2 priority = 1 period = 10",
        ),
        expect![[r#"
        a met 1 ms
        b met 2 ms
        c met 6 ms
    "#]],
    );
    // An activity that may run anywhere competes with all that are as urgent.
    check(
        &activities(
            "affinity = 1 priority = 3 period = 10",
            "priority = 2 period = 10",
            "affinity = 2 priority = 1 period = 10",
        ),
        expect![[r#"
            a met 1 ms
            b met 2 ms
            c met 6 ms
        "#]],
    );
    check(
        &activities(
            "affinity = 1 priority = 3 period = 10",
            "affinity = 3 priority = 2 period = 10",
            "affinity = 4 priority = 1 period = 10",
        ),
        expect![[r#"
            a met 1 ms
            b met 2 ms
            c met 4 ms
        "#]],
    );
    // 2 ms of each millisecond on CPU 2; CPU 1 has nothing to do with it.
    check(
        &activities(
            "affinity = 1 priority = 3 period = 10",
            "affinity = 2 priority = 2 period = 1",
            "affinity = 1 priority = 1 period = 10",
        ),
        expect![[r#"
            a met 1 ms
            b unbounded: CPU 2 overloaded (200.0 % at priority ≥ 2)
            c met 5 ms
        "#]],
    );
    let platform = TIMES.replace("timing.tables", "platform.cpus = 2\ntiming.tables");
    let on_four = activities(
        "affinity = 1 priority = 3 period = 10",
        "affinity = 4 priority = 2 period = 10",
        "affinity = 2 priority = 1 period = 10",
    );
    expect![[r#"
        a not-analysed: `b`, whose affinity is invalid and which may therefore run on this CPU, may preempt it and is not analysed
        b not-analysed: affinity names CPU 3, and mauve.toml has CPUs 1 and 2
        c not-analysed: `b`, whose affinity is invalid and which may therefore run on this CPU, may preempt it and is not analysed
    "#]]
    .assert_eq(&verdicts(&format!("{ROBOT}{on_four}{platform}")));
    // Whether it is the more urgent one is not certain of any: each value may be another field's.
    let deployed = activities(
        "affinity = 1 priority = 3 period = 10",
        "affinity = 2 priority = 2 period = 10",
        "affinity = 2 priority = 1 period = 10",
    );
    expect![[r#"
        a not-analysed: `b` and `c`, whose priorities or CPUs are unknown, may preempt it and are not analysed
        b not-analysed: affinity names CPU 2, and mauve.toml has CPU 1; `c`, whose affinity is invalid and which may therefore run on this CPU, may preempt it and is not analysed
        c not-analysed: affinity names CPU 2, and mauve.toml has CPU 1; `b`, whose affinity is invalid and which may therefore run on this CPU, may preempt it and is not analysed
    "#]]
    .assert_eq(&verdicts(&format!("{ROBOT}{deployed}{}", TIMES.replace("timing.", "platform.cpus = 1\ntiming."))));
    // Without any affinity: as many CPUs as the platform has. While `c` waits, both execute: 1 ms of `b` is not meanwhile.
    let nowhere = activities(FINE.0, FINE.1, FINE.2);
    assert_eq!(verdicts(&format!("{ROBOT}{nowhere}{platform}")), "a met 1 ms\nb met 2 ms\nc met 5 ms\n");
}

#[test]
fn a_sum_that_no_time_can_hold_is_not_left_out() {
    // Each of them fits into 64 bits of nanoseconds, two of them do not.
    let long = "10000000000000";
    let deployed = activities(FINE.0, FINE.1, "priority = background");
    let with = |core: &str, times: &str| {
        let robot = ROBOT.replace("core K2(S) { update = { two(); } }", &format!("core K2(S) {{ {core} }}"));
        let times = format!("{}{times}", TIMES.replace("= 2", &format!("= {long}")));
        verdicts(&format!("{robot}{deployed}{}", times.replace("= 4", &format!("= {long}"))))
    };
    let machine = "statemachine { initial state A { run = { two(); } transition t if four() > 0 to A } }";
    let edge = with(machine, "");
    assert_eq!(edge, "a met 1 ms\nb not-analysed: the time of `A.t.guard` exceeds 584 years\nc background\n");
    let overhead = with("update = { two(); }", &format!("[overhead]\ncontext_switch = {long}\n"));
    assert_eq!(overhead.matches("not-analysed: the overhead exceeds 584 years").count(), 2, "{overhead}");
}

/// `b` provides operations, and `c` sends calls to them.
const OPERATIONS: &str = "
codel one(): int
codel two(): int
codel four(): int
shell S { }
shell Serving { provide help(): int  provide peek(): int }
shell Asking { require help(): int  require peek(): int }
core K1(S) { update = { one(); } }
core KS(Serving) {
  provide help(): int = { return four(); }
  provide peek(): int = { return 1; }
  update = { two(); }
}
core KA(Asking) {
  handler h: help
  handler p: peek
  update = {
    if one() > 0 then { h = send(help); } else { h = send(help); h = send(help); }
    p = send(peek);
  }
}
component C1(S, K1)
component CS(Serving, KS)
component CA(Asking, KA)
architecture A { instance a: C1  instance b: CS  instance c: CA  CONNECTIONS }
";

#[test]
fn the_provider_executes_the_calls_of_a_client() {
    let robot = |connections: &str, fine: (&str, &str, &str)| {
        let deployment = activities(fine.0, fine.1, fine.2);
        verdicts(&format!("{}{deployment}{TIMES}", OPERATIONS.replace("CONNECTIONS", connections)))
    };
    // Nobody calls it, or calls what costs nothing.
    let without = robot("", FINE);
    expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 4 ms
    "#]]
    .assert_eq(&without);
    assert_eq!(robot("operation b.peek -> c.peek", FINE), without);
    // Two calls of 4 ms: a job of `b` and what was sent before it contain two releases of `c` at most.
    let slow = ("priority = 3 period = 100", "priority = 2 period = 100", "priority = 1 period = 400");
    expect![[r#"
        a met 1 ms
        b met 11 ms
        c met 12 ms
    "#]]
    .assert_eq(&robot("operation b.help -> c.help", slow));
    let fast = (slow.0, slow.1, "priority = 1 period = 100");
    expect![[r#"
        a met 1 ms
        b met 19 ms
        c met 20 ms
    "#]]
    .assert_eq(&robot("operation b.help -> c.help", fast));
}

/// A call wakes the thread of the provider, also if the operation takes no time: 0.5 ms, as each job of `a`, `b` and `c` has.
#[test]
fn a_call_has_the_overhead_of_a_job() {
    let slow =
        activities("priority = 3 period = 100", "priority = 2 period = 100", "priority = 1 period = 400");
    let robot = |connections: &str| {
        let model = OPERATIONS.replace("CONNECTIONS", connections);
        verdicts(&format!("{model}{slow}{TIMES}[overhead]\ndispatch = 0.3\ncontext_switch = 0.1\n"))
    };
    expect![[r#"
        a met 1.5 ms
        b met 4 ms
        c met 5.5 ms
    "#]]
    .assert_eq(&robot(""));
    expect![[r#"
        a met 1.5 ms
        b met 4.5 ms
        c met 6 ms
    "#]]
    .assert_eq(&robot("operation b.peek -> c.peek"));
    // A thread of `a` and `b` wakes up once for both, and once more for the call, which also delays `a`.
    let connected = OPERATIONS.replace("CONNECTIONS", "operation b.peek -> c.peek");
    let deployment = "deployment D { architecture A activity t { instances = [a, b] priority = 2 period = 100 affinity = 1 } \
                      activity c { priority = 1 period = 400 affinity = 1 } }";
    expect![[r#"
        a met 4 ms
        b met 4 ms
        c met 5.5 ms
    "#]]
    .assert_eq(&verdicts(&format!(
        "{connected}{deployment}{TIMES}[overhead]\ndispatch = 0.3\ncontext_switch = 0.1\n"
    )));
}

/// `c` may run on CPU 1, where nothing says what `a` takes, or on CPU 2, where `b` delays it beyond its deadline: with a short time
/// of `a` it meets the deadline, so it is not said to miss it.
#[test]
fn a_missing_time_is_no_missed_deadline() {
    let robot = |deadline: u64| {
        let model = "
codel one(): int
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
";
        let deployed = activities(
            "priority = 3 period = 100 affinity = 1",
            "priority = 2 period = 100 affinity = 2",
            &format!("priority = 1 period = 100 deadline = {deadline} affinity = 3"),
        );
        verdicts(&format!("{model}{deployed}{}", TIMES.replace("one = 1\n", "")))
    };
    expect![[r#"
        a not-analysed: no time for codel `one`
        b met 2 ms
        c not-analysed: `a` may preempt it and is not analysed
    "#]]
    .assert_eq(&robot(5));
    // On CPU 2 it meets this one, whatever `a` takes.
    assert!(robot(6).contains("c met 6 ms"), "{}", robot(6));
}

#[test]
fn the_number_of_calls_must_be_known() {
    let robot = |connections: &str, c: &str| {
        let deployment = activities("priority = 3 period = 100", "priority = 2 period = 100", c);
        verdicts(&format!("{}{deployment}{TIMES}", OPERATIONS.replace("CONNECTIONS", connections)))
    };
    // What costs nothing needs no client.
    expect![[r#"
        a met 1 ms
        b met 3 ms
        c background
    "#]]
    .assert_eq(&robot("operation b.peek -> c.peek", "priority = background"));
    expect![[r#"
        a met 1 ms
        b not-analysed: it executes the operation `help` for `c`, which has no period: the number of calls has no bound
        c background
    "#]].assert_eq(&robot("operation b.help -> c.help", "priority = background"));
    // A period in the background is none.
    let found = robot("operation b.help -> c.help", "priority = background period = 400");
    assert!(
        found.contains("b not-analysed: it executes the operation `help` for `c`, which has no period"),
        "{found}"
    );
    // Each job of `b` would execute more calls than a period has room for.
    expect![[r#"
        a met 1 ms
        b not-analysed: it executes the operation `help` for `c`, and one of the two has no bound on its response time: the number of calls has none
        c not-analysed: `b` may preempt it and is not analysed
    "#]].assert_eq(&robot("operation b.help -> c.help", "priority = 1 period = 4"));
    // The calls of a program that is not known.
    let wrong = OPERATIONS.replace("h = send(help); } else", "h = send(help, 1); } else");
    let found = verdicts(&format!(
        "{}{}{TIMES}",
        wrong.replace("CONNECTIONS", "operation b.help -> c.help"),
        activities(FINE.0, FINE.1, FINE.2)
    ));
    let why = "b not-analysed: it executes the operation `help` for `c`, which is not analysed: the number of calls is unknown";
    assert!(found.contains(why), "{found}");
}

/// `c` sends to `b`, and `b` to `a`, while it executes the call.
const CHAIN: &str = "
codel one(): int
codel log(): int
shell Last { provide last(): int }
shell Middle { provide middle(): int  require next(): int }
shell First { require go(): int }
core KL(Last) { provide last(): int = { return one(); }  update = { } }
core KM(Middle) { handler h: next  provide middle(): int = { h = send(next); return log(); }  update = { } }
core KF(First) { handler h: go  update = { h = send(go); } }
component CL(Last, KL)
component CM(Middle, KM)
component CF(First, KF)
architecture A {
  instance a: CL  instance b: CM  instance c: CF
  operation a.last -> b.next
  operation b.middle -> c.go
}
";

#[test]
fn what_an_operation_sends_is_counted_or_refused() {
    let verdict = |b: &str, c: &str, codels: &str| {
        let deployment = activities("priority = 9 period = 100", b, c);
        verdicts(&format!(
            "{CHAIN}{deployment}\n//- /mauve.toml\ntiming.tables = [\"times.toml\"]\n//- /times.toml\n[codel]\n{codels}"
        ))
    };
    let (b, c) = ("priority = 2 period = 100", "priority = 1 period = 100");
    // Two calls of `middle` in a period of `b`, and so four of `last` in one of `a`.
    expect![[r#"
        a met 4 ms
        b met 6 ms
        c met 6.000001 ms
    "#]]
    .assert_eq(&verdict(b, c, "one = 1\nlog = 1"));
    // Twice as many of `last` where `middle` sends two.
    let twice = CHAIN.replace("h = send(next); return", "h = send(next); h = send(next); return");
    let deployment = activities("priority = 9 period = 100", b, c);
    assert_eq!(
        verdicts(&format!("{twice}{deployment}\n//- /mauve.toml\nassume.codel = \"1 ms\"\n")),
        "a met 8 ms\nb met 10 ms\nc met 10.000001 ms\n"
    );
    // Where `middle` has no time, and where nothing bounds how often it is executed.
    for (b, c, codels) in [
        (b, c, "one = 1"),
        ("priority = background", c, "one = 1"),
        ("priority = background", c, "one = 1\nlog = 1"),
        (b, "priority = background", "one = 1\nlog = 1"),
        ("priority = background", "priority = background", "one = 1"),
    ] {
        let found = verdict(b, c, codels);
        assert!(
            found.starts_with("a not-analysed: it executes the operation `last` for `b`"),
            "{b} {c}: {found}"
        );
        assert!(!found.contains("584 years"), "an unknown time is not too long: {found}");
    }
    // `c` has no bound, so the number of its calls is unknown; but each call takes `b` no time.
    let endless =
        CHAIN.replace("return log();", "return 1;").replace("h = send(go); }", "h = send(go); log(); }");
    let (b, c) = ("affinity = 2 priority = 2 period = 100", "affinity = 4 priority = 1 period = 100");
    let deployment = activities("affinity = 1 priority = 9 period = 100", b, c);
    let endless = format!(
        "{endless}{deployment}\n//- /mauve.toml\ntiming.tables = [\"times.toml\"]\n//- /times.toml\n[codel]\none = 1\nlog = 101\n"
    );
    assert!(verdicts(&endless).contains("b met 0.000001 ms\nc unbounded"), "{}", verdicts(&endless));
    assert!(reported(&endless, |report| report.activities[1].reasons.is_empty()));
    // An operation that sends nothing itself needs no bound on its calls.
    let idle = CHAIN
        .replace("shell Middle {", "shell Middle { provide idle(): int ")
        .replace("core KM(Middle) {", "core KM(Middle) { provide idle(): int = { return 1; }")
        .replace("b.middle -> c.go", "b.idle -> c.go");
    let deployment = activities("priority = 9 period = 100", b, "priority = background");
    assert_eq!(
        verdicts(&format!("{idle}{deployment}\n//- /mauve.toml\nassume.codel = \"1 ms\"\n")),
        "a met 0.000001 ms\nb met 0.000001 ms\nc background\n"
    );
    // What the background sends is not known if its program is not.
    let damaged = CHAIN.replace("h = send(go);", "h = send(gone);");
    let deployment = activities("priority = 9 period = 100", b, "priority = background");
    let found = verdicts(&format!("{damaged}{deployment}\n//- /mauve.toml\nassume.codel = \"1 ms\"\n"));
    assert!(found.contains("b not-analysed: it executes the operation `middle` for `c`"), "{found}");
    assert!(found.contains("a not-analysed: it executes the operation `last` for `b`"), "{found}");
}

/// What `planner` gets, every 500 ms, whose calls take 60 ms each, from a core of `pilot`, which runs every so many ms.
fn planner(core: &str, period: u32) -> String {
    let found = verdicts(&format!(
        "
codel search(in goal: int): int
codel drive(in way: int): bool
shell S {{ provide plan(in goal: int): int }}
shell R {{ require plan(in goal: int): int  provide halt(): void }}
core K(S) {{ provide plan(in goal: int) = {{ return search(goal); }}  update = {{ }} }}
core A(R) {{ handler h: plan  handler g: plan  var way: int = 0  {core} }}
component Planner(S, K)
component Pilot(R, A)
architecture Robot {{ instance planner: Planner  instance pilot: Pilot  operation planner.plan -> pilot.plan }}
deployment D {{
  architecture Robot
  activity planner {{ priority = 1  period = 500  cpus = [1] }}
  activity pilot {{ priority = 2  period = {period}  cpus = [2] }}
}}
//- /mauve.toml
timing.tables = ['times.toml']
//- /times.toml
[codel]
search = 60
drive = 1
"
    ));
    let line = found.lines().find(|it| it.starts_with("planner ")).unwrap();
    if line.contains("the number of calls has none") {
        "unbounded".to_owned()
    } else {
        line["planner ".len()..].to_owned()
    }
}

/// A pilot that asks for a way, waits for it and drives there.
const ASKING: &str = "
provide halt() = { }
statemachine {
  initial state Asking { transition sent to Planning { h = send(plan, 1); } }
  state Planning { transition planned if collect(h, way) == success to Driving }
  state Driving { transition arrived if drive(way) to Asking }
}";

/// A job of `planner` executes the call that was pending, and those that are sent in 500 ms and in the response time of `pilot`. `pilot`
/// has at most 11 jobs in that time, and each third job sends a call: 4 calls. So `planner` executes 5 calls of 60 ms, 300 ms.
#[test]
fn a_call_that_waits_for_the_last_one() {
    assert_eq!(planner(ASKING, 50), "met 300 ms");
    // With a transition in each job, every second one: 1 + 6 calls. A call may also fail.
    let short = "provide halt() = { }
        statemachine {
          initial state Waiting { transition asked if drive(way) to Planning { h = send(plan, 1); } }
          state Planning {
            transition planned if collect(h, way) == success to Waiting
            transition failed if collect(h, way) == failure to Waiting
          }
        }";
    assert_eq!(planner(short, 50), "met 420 ms");
    // The call is sent when the component starts, and again in the job that collects it: 1 + 6 calls, every 100 ms.
    let entry = "provide halt() = { }
        statemachine {
          initial state Planning {
            entry = { h = send(plan, 1); }
            transition planned if collect(h, way) == success to Planning
          }
        }";
    assert_eq!(planner(entry, 100), "met 420 ms");
    // Sent at the start only, without a wait for its end: one call, once, and 11 jobs that send none.
    let once = "provide halt() = { }
        statemachine {
          initial state First { entry = { send(plan, 1); } transition on if drive(way) to Driving }
          state Driving { transition arrived if drive(way) to Driving }
        }";
    assert_eq!(planner(once, 50), "met 60 ms");
    let hook = "provide halt() = { } start = { send(plan, 1); send(plan, 2); return true; } update = { drive(way); }";
    assert_eq!(planner(hook, 50), "met 120 ms");
    for update in [
        "if collect(h, way) != not_ready then { h = send(plan, 1); } else { }",
        "if not_ready == collect(h, way) then { } else { h = send(plan, 1); }",
        "if !(collect(h, way) == not_ready) && drive(way) then { h = send(plan, 1); } else { }",
        "if collect(h, way) == success then { way = 1; h = send(plan, 1); } else { if drive(way) then { return; } else { } }",
    ] {
        assert_eq!(
            planner(&format!("provide halt() = {{ }} update = {{ {update} }}"), 100),
            "met 420 ms",
            "{update}"
        );
    }
    // Two handlers: a call of each may be pending, 2 + 2 · 3 calls.
    let two = "provide halt() = { } update = {
        if collect(h, way) != not_ready then { h = send(plan, 1); } else { }
        if collect(g, way) != not_ready then { g = send(plan, 1); } else { }
    }";
    assert_eq!(planner(two, 200), "met 480 ms");
}

/// Where a job may send before the last call has ended, calls may wait for each other: their number depends on how late they are. With
/// c calls of 60 ms each, ⌈(501 + 60 · c) / 100⌉ are sent, which is 13 for 13 calls: more than fit into 500 ms.
#[test]
fn a_call_that_may_not_wait_for_the_last_one() {
    // Another way leads back: every second job sends.
    let late = ASKING.replace("to Driving }", "to Driving  transition late if drive(way) to Asking }");
    assert_eq!(planner(&late, 50), "unbounded");
    // Not ended, or ended and sent twice. Each third job sends, and 6 calls are sent in 501 + 360 ms.
    let not = ASKING.replace("== success", "!= success");
    assert_eq!(planner(&not, 50), "met 360 ms");
    let twice = ASKING.replace("h = send(plan, 1);", "h = send(plan, 1); h = send(plan, 2);");
    assert_eq!(planner(&twice, 50), "unbounded");
    // The call of another handler ends.
    assert_eq!(planner(&ASKING.replace("collect(h", "collect(g"), 50), "met 360 ms");
    let waits = "if collect(h, way) != not_ready then { h = send(plan, 1); } else { }";
    for (operation, update) in [
        ("", "collect(h, way); h = send(plan, 1);"),
        ("", "if collect(h, way) == not_ready then { h = send(plan, 1); } else { }"),
        ("", "if collect(g, way) != not_ready then { h = send(plan, 1); } else { }"),
        ("", "if collect(h, way) != not_ready || drive(way) then { h = send(plan, 1); } else { }"),
        // A call without a handler, a call that an operation sends, and a handler to which another handler is assigned.
        (
            "",
            "if collect(h, way) != not_ready then { h = send(plan, 1); } else { if drive(way) then { send(plan, 1); } else { } }",
        ),
        ("h = send(plan, 1);", waits),
        ("h = g;", waits),
    ] {
        let core = format!("provide halt() = {{ {operation} }} update = {{ {update} }}");
        assert_eq!(planner(&core, 100), "unbounded", "{operation} {update}");
    }
}

#[test]
fn a_ring_of_operations_has_no_bound() {
    let model = "
codel one(): int
shell S { provide ask(): int  require reply(): int }
core K(S) { handler h: reply  provide ask(): int = { h = send(reply); return one(); }  update = { h = send(reply); } }
component C(S, K)
architecture A { instance x: C  instance y: C  operation x.ask -> y.reply  LAST }
deployment D { architecture A
  activity x { priority = 2 period = 100 }
  activity y { priority = 1 period = 100 }
}
//- /mauve.toml
assume.codel = \"1 ms\"
";
    // `y` sends calls to `x`; `x` sends none.
    expect![[r#"
        x met 2 ms
        y met 2.000001 ms
    "#]]
    .assert_eq(&verdicts(&model.replace("LAST", "")));
    let found = verdicts(&model.replace("LAST", "operation y.ask -> x.reply"));
    let ring = "not-analysed: its operation `ask` is executed again by a call that it sends: the number of calls has no bound";
    assert!(found.contains(&format!("x {ring}")) && found.contains(&format!("y {ring}")), "{found}");
}

#[test]
fn more_chains_of_calls_than_can_be_followed_are_refused() {
    // Each operation sends two calls to the next: 2ⁿ chains reach the one behind n others.
    let verdict = |count: usize| {
        let mut model = "codel one(): int\nshell S { provide go(): int  require to(): int }\n\
            core K(S) { handler h: to  provide go(): int = { h = send(to); return one(); }  update = { } }\n\
            core F(S) { handler h: to  provide go(): int = { return one(); }  update = { h = send(to); } }\n\
            component C(S, K)\ncomponent D(S, F)\n"
            .to_owned();
        let (mut architecture, mut deployment) = ("instance i0: D".to_owned(), String::new());
        for number in 0..=count {
            if number > 0 {
                let client = number - 1;
                architecture += &format!("\ninstance i{number}: C");
                architecture += &format!("  operation i{number}.go -> i{client}.to").repeat(2);
            }
            deployment += &format!("activity i{number} {{ priority = {} period = 1000 }}\n", number + 1);
        }
        model +=
            &format!("architecture A {{ {architecture} }}\ndeployment D {{ architecture A {deployment} }}\n");
        verdicts(&format!("{model}//- /mauve.toml\nassume.codel = \"0.001 ms\"\n"))
    };
    // 8 calls behind three others in each of the two periods whose calls a job of `i3` may find: 8 µs each.
    assert!(verdict(3).ends_with("i3 met 0.064 ms\n"), "{}", verdict(3));
    // 2¹³ chains reach the last.
    let found = verdict(13);
    let why = "not-analysed: operations send calls to other operations in more than 4096 ways";
    assert_eq!(found.matches(why).count(), 13, "{found}");
}

#[test]
fn an_unknown_connection_may_serve_any_client() {
    let deployment = activities(FINE.0, FINE.1, FINE.2);
    let robot = |connection: &str| {
        let architecture =
            format!("architecture A {{ instance a: C1  instance b: CS  instance c: CA  {connection} }}");
        let robot =
            ROBOT.replace("architecture A { instance a: C1  instance b: C2  instance c: C4 }", &architecture);
        verdicts(&format!("{robot}{deployment}{TIMES}"))
    };
    // The operation of an unknown component may be one of `b`.
    let unknown = robot("instance d: Nothing  operation d.help -> c.help");
    assert!(unknown.contains("b not-analysed: it provides operations, and which"), "{unknown}");
    // Half typed, it may be anybody's.
    expect![[r#"
        a met 1 ms
        b not-analysed: it provides operations, and which connections call them is not known
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&robot("operation\n "));
    // So it may where an error has swallowed one, or where one is not right: another provider may be meant.
    for lost in [
        "property a.x = operation b.help -> c.help",
        "instance d: CS  property d.x = 1  operation d.help -> c.nothing",
        "operation c.help -> b.help",
    ] {
        let found = robot(lost);
        assert!(found.contains("b not-analysed: it provides operations, and which"), "{lost}: {found}");
    }
    // A text that is not closed may have any item in it.
    let found = robot("property b.x = \"/dev  operation b.help -> c.help\n");
    assert_eq!(found.matches("not-analysed:").count(), 3, "{found}");
    let found = robot("property b.x = \"/dev\n");
    assert!(found.starts_with("a met 1 ms\n"), "{found}");
}

#[test]
fn an_operation_whose_signature_is_wrong_may_be_meant_for_another_provider() {
    let robot = "codel f(): int
shell S1 { provide plan(in g: int): int }
shell S2 { provide plan(in g: double): int }
shell S { require route(in g: int): int }
core C1(S1) { provide plan(in g: int): int = { return g; }  update = { f(); } }
core C2(S2) { provide plan(in g: double): int = { return 1; }  update = { f(); } }
core C(S) { handler h: route  update = { h = send(route, 1); f(); } }
component K1(S1, C1)
component K2(S2, C2)
component K(S, C)
architecture A { instance p1: K1  instance p2: K2  instance q: K
  operation p2.plan -> q.route
}
deployment D { architecture A
  activity p1 { priority = 9 period = 10 affinity = 1 }
  activity p2 { priority = 9 period = 10 affinity = 2 }
  activity q { priority = 5 period = 10 affinity = 2 }
}
//- /mauve.toml
assume.codel = \"1 ms\"
";
    let found = verdicts(robot);
    assert!(found.starts_with("p1 not-analysed: it provides operations, and which connections"), "{found}");
    let right = verdicts(&robot.replace("operation p2", "operation p1"));
    assert!(right.starts_with("p1 met 1 ms\np2 met 1 ms\n"), "{right}");
}

#[test]
fn a_codel_with_a_syntax_error_refuses_who_calls_it() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let damaged = ROBOT.replace("codel two(): int", "codel two() int");
    let found = verdicts(&format!("{damaged}{deployed}{TIMES}"));
    assert!(
        found.contains("a met 1 ms") && found.contains("b not-analysed: codel two has a syntax error"),
        "{found}"
    );
}

#[test]
fn an_error_in_an_inherited_shell_refuses_the_component() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |base: &str| {
        let robot =
            ROBOT.replace("shell S { }", &format!("shell Base {{ {base} }}\nshell S extends Base {{ }}"));
        verdicts(&format!("{robot}{deployed}{TIMES}"))
    };
    assert_eq!(with(""), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    for wrong in ["property p: int = \"x\"", "provid help(): int"] {
        let found = with(wrong);
        assert_eq!(found.matches("not-analysed").count(), 3, "{wrong}: {found}");
    }
}

#[test]
fn a_component_of_an_extended_shell_is_refused_for_that_shell() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |item: &str| {
        let robot = ROBOT
            .replace("component C2(S, K2)", &format!("shell T extends S {{ {item} }} component C2(T, K2)"));
        verdicts(&format!("{robot}{deployed}{TIMES}"))
    };
    assert_eq!(with(""), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    expect![[r#"
        a met 1 ms
        b not-analysed: shell T has an error: an operation may be missing in it
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&with("provid help(): int"));
}

#[test]
fn a_pattern_of_tables_that_chooses_may_miss_one() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with =
        |pattern: &str| verdicts(&format!("{ROBOT}{deployed}{}", TIMES.replace("times.toml\"]", pattern)));
    assert!(with("*.toml\"]").starts_with("a met 1 ms"));
    assert!(with("[t]imes.toml\"]").starts_with("a met 1 ms"));
    for choice in ["{times,more}.toml\"]", "[tm]imes.toml\"]", "[!m]imes.toml\"]", "[t-z]imes.toml\"]"] {
        let found = with(choice);
        assert_eq!(found.matches("not-analysed: mauve.toml: ").count(), 3, "{found}");
    }
}

#[test]
fn verdicts_over_imported_and_broken_architectures() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |architecture: &str| {
        let robot =
            ROBOT.replace("architecture A { instance a: C1  instance b: C2  instance c: C4 }", architecture);
        verdicts(&format!("{robot}{deployed}{TIMES}"))
    };
    let fine = "a met 1 ms\nb met 3 ms\nc met 7 ms\n";
    assert_eq!(
        with("architecture B { instance a: C1  instance b: C2 } architecture A { import B  instance c: C4 }"),
        fine
    );
    // A half-typed connection has no time.
    assert_eq!(
        with(
            "architecture A { instance a: C1  instance b: C2  instance c: C4  connection a.\n property b. = \n }"
        ),
        fine
    );
    // One with an error says that one of its ends may be of another component; of no instance, that one may be lost.
    expect![[r#"
        a met 1 ms
        b not-analysed: error in architecture A: no property or constant `p` in S, the shell of b
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&with("architecture A { instance a: C1  instance b: C2  instance c: C4  property b.p = 1 }"));
    for item in ["connection a.x -> d.y", "operation d.x -> a.y", "property d.p = 1"] {
        let found =
            with(&format!("architecture A {{ instance a: C1  instance b: C2  instance c: C4  {item} }}"));
        assert_eq!(found.matches("error in architecture A: no instance `d` in `A`").count(), 3, "{found}");
    }
    // Anything else may have been an instance.
    for lost in [
        "architecture A { instance a: C1  instance b: C2  instance c: C4  instanc d: C1 }",
        "architecture A { instance a: C1  instance b: C2  instance c: C4  import }",
        "architecture A { instance a: C1  instance b: C2  instance c: C4  import Nothing }",
        "architecture A { instance a: C1  instance b: C2  instance c: C4  import A }",
        "architecture A { instance a: C1  instance b: C2  instance c: C4  instance : C1 }",
    ] {
        assert_eq!(with(lost).matches("not-analysed").count(), 3, "{lost}: {}", with(lost));
    }
    expect![[r#"
        a met 1 ms
        b not-analysed: the component of instance b is unknown; error in architecture A: no component `Nothing`
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&with("architecture A { instance a: C1  instance b: Nothing  instance c: C4 }"));
    expect![[r#"
        a not-analysed: `b`, whose name several instances have, may preempt it and is not analysed
        b not-analysed: several instances have its name; error in architecture A: instance `b` is defined twice: rename or remove one of them
        c not-analysed: `b`, whose name several instances have, may preempt it and is not analysed
    "#]]
    .assert_eq(&with("architecture A { instance a: C1  instance b: C2  instance b: C1  instance c: C4 }"));
}

#[test]
fn verdicts_over_included_and_missing_files() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let fine = "a met 1 ms\nb met 3 ms\nc met 7 ms\n";
    let split = |root: &str| verdicts(&format!("{root}\n{deployed}\n//- /robot.mal\n{ROBOT}{TIMES}"));
    assert_eq!(split("include \"robot.mal\"\ninclude \"robot.mal\""), fine);
    // A ring of includes is harmless; a missing file costs what stands in it.
    assert_eq!(
        verdicts(&format!(
            "include \"robot.mal\"\n{deployed}\n//- /robot.mal\ninclude \"model.mal\"\n{ROBOT}{TIMES}"
        )),
        fine
    );
    assert_eq!(split("include \"robot.mal\"\ninclude \"nothing.mal\""), fine);
    assert_eq!(
        verdicts(&format!("include \"robto.mal\"\n{deployed}{TIMES}")).matches("not-analysed").count(),
        3
    );
}

#[test]
fn what_a_missing_file_or_a_stray_brace_may_hide_is_not_guessed() {
    // `f` of one's own library may stand in the file that is missing: the one of the used library is not taken.
    let model = |includes: &str, brace: &str| {
        let text = format!(
            "{includes}
library near {{ use far  shell S {{ }}  core K(S) {{ update = {{ f(); }} }}  component C(S, K) {brace} }}
library far {{ codel f(): int  shell S {{ }}  core K(S) {{ update = {{ f(); }} }}  component C(S, K) }}
architecture A {{ instance a: near.C  instance b: far.C }}
deployment D {{ architecture A  activity a {{ priority = 1 period = 10 }}  activity b {{ priority = 2 period = 10 }} }}
//- /mauve.toml
assume.codel = \"1 ms\"
"
        );
        verdicts(&text)
    };
    assert_eq!(model("", ""), "a met 2 ms\nb met 1 ms\n");
    expect![[r#"
        a not-analysed: core K: codel `f` is not found: a file that may declare it is missing
        b met 1 ms
    "#]]
    .assert_eq(&model("include \"lost.mal\"", ""));
    expect![[r#"
        a not-analysed: model.mal has a syntax error between its declarations: one of them may be missing
        b not-analysed: model.mal has a syntax error between its declarations: one of them may be missing
    "#]]
    .assert_eq(&model("", "}"));
    // A half-typed word moves nothing; but it may have been the codel `f` of that library.
    expect![[r#"
        a not-analysed: core K: codel `f` is not found: a syntax error may hide its declaration
        b met 1 ms
    "#]]
    .assert_eq(&model("", "\n  cod\n"));
    // What is missing is one mistake.
    let lost = "include \"lost.mal\"\ncomponent C(S, K)\narchitecture A { instance a: Lost }\n";
    expect![[r#"
        /model.mal "\"lost.mal\"" unresolved-include: no file `lost.mal`: looked for /lost.mal
    "#]]
    .assert_eq(&diagnostics(lost));
}

#[test]
fn a_table_that_cannot_be_read_analyses_nothing() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |times: &str| {
        verdicts(&format!(
            "{ROBOT}{deployed}\n//- /mauve.toml\ntiming.tables = [\"*.times\"]\n//- /a.times\n{times}"
        ))
    };
    let fine = "[codel]\none = 1\ntwo = 2\nfour = 4\n";
    assert_eq!(with(fine), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    for lost in [
        "[program\n\"C1/update\" = 50\n",
        "[programs]\n\"C1/update\" = 50\n",
        "[overhead]\ndispach = 1\n",
        "[overhead]\ndispatch = -1\n",
        "[program]\n\"C1\" = 50\n",
    ] {
        let found = with(&format!("{fine}{lost}"));
        assert_eq!(found.matches("not-analysed").count(), 3, "{lost}: {found}");
    }
    // A value with an error may have swallowed other entries.
    for (value, message) in [
        ("-2", "negative time -2: expected a number of ms from 0"),
        ("[1, 2]", "2 values but no `levels`: name them, or write one time"),
        ("1e30", "1e30 ms is too large: the longest time is 584 years"),
        ("\"2\"", "expected a number of ms, or one for each level; found a string"),
        ("\"\"\"\none = 1\n\"\"\"", "expected a number of ms, or one for each level; found a string"),
        ("nan", "nan is not a time: expected a finite number of ms"),
    ] {
        let found = with(&fine.replace("two = 2", &format!("two = {value}")));
        assert_eq!(
            found.matches(&format!("not-analysed: a.times: {message}\n")).count(),
            3,
            "{value}: {found}"
        );
    }
    // So does one that two tables have.
    expect![[r#"
        a not-analysed: b.times: a second time for `two`: the first is in a.times
        b not-analysed: b.times: a second time for `two`: the first is in a.times
        c not-analysed: b.times: a second time for `two`: the first is in a.times
    "#]]
    .assert_eq(&with(&format!("{fine}//- /b.times\n[codel]\ntwo = 1\n")));
}

#[test]
fn a_configuration_that_may_hide_something_analyses_nothing() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |config: &str| {
        verdicts(&format!(
            "{ROBOT}{deployed}{}",
            TIMES.replace("timing.tables", &format!("{config}\ntiming.tables"))
        ))
    };
    for lost in [
        "project.rot = \"x\"",
        "project.platform.rt_throttling = true",
        "generate.cpp = \"x\"",
        "chains.roots = [\"main.mal\"]",
        "platfrm.rt_throttling = true",
        "platform.rt_throttling = 1",
        "clocks.x = 1",
        "assume.codel = 5",
        "x = [[",
        "timing.significance = 2",
    ] {
        let found = with(lost);
        assert_eq!(found.matches("not-analysed").count(), 3, "{lost}: {found}");
    }
    let none = verdicts(&format!(
        "{ROBOT}{deployed}{}",
        TIMES.replace("times.toml\"]", "times.toml\", \"more.toml\"]")
    ));
    assert_eq!(none.matches("not-analysed: mauve.toml: no file matches `more.toml`").count(), 3, "{none}");
}

#[test]
fn platform_clocks_and_assumptions() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |config: &str| {
        verdicts(&format!(
            "{ROBOT}{deployed}{}",
            TIMES.replace("timing.tables", &format!("{config}\ntiming.tables"))
        ))
    };
    // Throttling takes 50 ms of each second: all that is left of several periods.
    expect![[r#"
        a missed 51 ms
        b missed 58 ms
        c missed 78 ms
    "#]]
    .assert_eq(&with("platform.rt_throttling = true"));
    expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]]
    .assert_eq(&with("clocks.synchronised = [\"b\"]"));
    let lan = |cpus: &str, time: &str| {
        let lan = format!("name = \"lan\", priority = 99, period = \"5 ms\", time = \"{time}\"");
        with(&format!("platform.other = [{{ {lan}{cpus} }}]"))
    };
    expect![[r#"
        a met 2 ms
        b met 4 ms
        c met 9 ms
    "#]]
    .assert_eq(&lan("", "1 ms"));
    expect![[r#"
        a unbounded: CPU 1 overloaded (130.0 % at priority ≥ 3)
        b unbounded: CPU 1 overloaded (150.0 % at priority ≥ 2)
        c unbounded: CPU 1 overloaded (190.0 % at priority ≥ 1)
    "#]]
    .assert_eq(&lan("", "6 ms"));
    expect![[r#"
        a met 2 ms
        b met 4 ms
        c met 9 ms
    "#]]
    .assert_eq(&lan(", cpus = [1, 2]", "1 ms"));
    expect![[r#"
        a met 1 ms
        b met 3 ms
        c met 7 ms
    "#]]
    .assert_eq(&lan(", cpus = [2]", "1 ms"));
    expect![[r#"
        a not-analysed: mauve.toml: `cpus` is a list of CPUs, numbered from 1 to 128, such as [1, 2]
        b not-analysed: mauve.toml: `cpus` is a list of CPUs, numbered from 1 to 128, such as [1, 2]
        c not-analysed: mauve.toml: `cpus` is a list of CPUs, numbered from 1 to 128, such as [1, 2]
    "#]]
    .assert_eq(&lan(", cpus = [0]", "1 ms"));
    let missing = TIMES.replace("two = 2\n", "");
    expect![[r#"
        a met 1 ms
        b not-analysed: no time for codel `two`
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&verdicts(&format!("{ROBOT}{deployed}{missing}")));
    let assumed = missing.replace("timing.tables", "assume.codel = \"3 ms\"\ntiming.tables");
    expect![[r#"
        a met 1 ms
        b met 4 ms
        c met 8 ms
    "#]]
    .assert_eq(&verdicts(&format!("{ROBOT}{deployed}{assumed}")));
}

#[test]
fn keys_that_mean_nothing_are_not_ignored() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |entries: &str| verdicts(&format!("{ROBOT}{deployed}{TIMES}{entries}"));
    // An unknown codel is nobody's: all that are executed have their times.
    assert_eq!(with("three = 3\n"), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    // A component among the codels has lost its header.
    let classic =
        |entries: &str| verdicts_with(&format!("{ROBOT}{deployed}{TIMES}{entries}"), Method::Classic, LEVEL);
    assert_eq!(classic("three = 3\n"), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    let found = classic("C4 = 9\n");
    let reason = "c not-analysed: times.toml:5: the unknown key `C4` may be that of component `C4`";
    assert!(found.starts_with("a met 1 ms\nb met 3 ms\n") && found.contains(reason), "{found}");
    let found = with("\"C4/update\" = 9\n");
    let reason = "c not-analysed: times.toml:5: the unknown key `C4/update` may be that of `C4/update`";
    assert!(found.starts_with("a met 1 ms\nb met 3 ms\n") && found.contains(reason), "{found}");
    // A program of a known component may be any of its programs.
    expect![[r#"
        a not-analysed: times.toml:7: the unknown key `C2/updaet` may be that of `C1/update`
        b not-analysed: times.toml:7: C2 has no program `updaet`; `a` may preempt it and is not analysed
        c not-analysed: times.toml:7: the unknown key `C2/updaet` may be that of `C4/update`; `a` and `b` may preempt it and are not analysed
    "#]]
    .assert_eq(&with("[program]\n\"C2/update\" = 1\n\"C2/updaet\" = 50\n"));
    // That of an unknown component may be that of any component without an entry, which was renamed; of another library, of none.
    let found = with("[program]\n\"Renamed/update\" = 50\n");
    assert_eq!(
        found.matches("not-analysed: times.toml:6: the unknown key `Renamed/update` may be").count(),
        3,
        "{found}"
    );
    let entries = "\"C1/update\" = 1\n\"C2/update\" = 2\n\"C4/update\" = 4\n";
    let found = with(&format!("[program]\n{entries}\"Renamed/update\" = 50\n"));
    assert_eq!(found, "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    assert_eq!(with("[program]\n\"other.Renamed/update\" = 50\n"), found);
    // It is that of a program, and not of a component.
    assert_eq!(classic(&format!("[program]\n{entries}\"Renamed/update\" = 50\n")), found);
    // Misspelt, it is that of a component without an entry of its own.
    let found = with("[program]\n\"C2/update\" = 2\n\"C1/update\" = 1\n\"D4/update\" = 50\n");
    let reason = "c not-analysed: times.toml:8: the unknown key `D4/update` may be that of `C4/update`\n";
    assert!(found.starts_with("a met 1 ms\nb met 3 ms\n") && found.contains(reason), "{found}");
    // In the wrong section, an unknown program is that of no other component.
    let found = with("\"C4/other\" = 9\n");
    assert!(
        found
            .starts_with("a met 1 ms\nb met 3 ms\nc not-analysed: times.toml:5: C4 has no program `other`\n"),
        "{found}"
    );
    // The name of a state tells more than that of a component in another library.
    let states = ROBOT.replace("core K4(S) { update = { four(); } }",
        "core K4(S) { statemachine { initial state Idle { run = { four(); } transition t if one() > 0 to Idle } } }");
    let found = |key: &str| {
        let found = verdicts(&format!("{states}{deployed}{TIMES}[program]\n\"other.Gone/{key}\" = 1\n"));
        found.lines().last().unwrap().to_owned()
    };
    assert_eq!(
        found("Idle.run"),
        "c not-analysed: times.toml:6: the unknown key `other.Gone/Idle.run` may be that of `C4/Idle.run`"
    );
    // 3 ms of `a` and `b`, 4 ms of its own, and 1 ms for the guard.
    assert_eq!(found("Busy.run"), "c met 8 ms");
    // Three letters are wrong, and no other key is like it.
    let names = "library near { codel one(): int  shell S { }  core K(S) { update = { one(); } }
        component MeasurementControl(S, K)  component Pilot(S, K) }
        architecture A { instance a: near.MeasurementControl  instance b: near.Pilot }
        deployment D { architecture A activity a { priority = 1 period = 10 } activity b { priority = 2 period = 10 } }";
    let times = TIMES.replace("two = 2\nfour = 4\n", "");
    expect![[r#"
        a not-analysed: times.toml:4: the unknown key `naer.MesurementContrl/update` may be that of `MeasurementControl/update`
        b met 1 ms
    "#]]
    .assert_eq(&verdicts(&format!("{names}{times}[program]\n\"naer.MesurementContrl/update\" = 9\n")));
    // With an assumed time, an unknown codel may be the one that is assumed to be short.
    let assumed = TIMES
        .replace("two = 2", "tow = 200")
        .replace("timing.tables", "assume.codel = \"1 ms\"\ntiming.tables");
    let found = verdicts(&format!("{ROBOT}{deployed}{assumed}"));
    assert!(
        found.contains("b not-analysed: times.toml:3: the unknown key `tow` may be that of codel `two`\n"),
        "{found}"
    );
}

/// The codes of the table, each with what it marks.
fn of_table(fixture: &str) -> Vec<String> {
    let found = diagnostics(fixture);
    let lines = found.lines().filter_map(|line| line.strip_prefix("/times.toml "));
    lines.map(|line| line.to_owned()).collect()
}

#[test]
fn a_key_in_another_section_is_sent_there() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |entries: &str| of_table(&format!("{ROBOT}{deployed}{TIMES}{entries}")).join("\n");
    expect![[r#"
        "C4" unknown-timing-key: `C4` is a key of [component]: move it to that section
        "\"C1/update\"" unknown-timing-key: `C1/update` is a key of [program]: move it to that section"#]]
    .assert_eq(&with("C4 = 9\n\"C1/update\" = 9\n"));
    expect![[r#"
        "four" unknown-timing-key: `four` is a key of [codel]: move it to that section
        "C9" unknown-timing-key: no component `C9`; did you mean `C1`?"#]]
    .assert_eq(&with("[component]\nfour = 9\nC9 = 9\n"));
    // The proposed component is one whose program has no time yet; the proposed codel as well.
    expect![[r#""\"C9/update\"" unknown-timing-key: no component `C9`; did you mean `C2`?"#]]
        .assert_eq(&with("[program]\n\"C1/update\" = 1\n\"C9/update\" = 5\n"));
    let fourth = format!("codel fourth(): int\n{ROBOT}");
    expect![[r#""fourr" unknown-timing-key: no codel `fourr`; did you mean `fourth`?"#]]
        .assert_eq(&of_table(&format!("{fourth}{deployed}{TIMES}fourr = 1\n")).join("\n"));
    expect![[r#""dispatch" unknown-timing-key: `dispatch` is a key of [overhead]: move it to that section"#]]
        .assert_eq(&with("dispatch = 1\n"));
}

#[test]
fn a_library_that_nothing_declares_is_one_mistake() {
    let with = |model: &str, entries: &str| {
        let model =
            format!("library near {{ codel f(): int  codel g(): int }} library user {{ use near }}\n{model}");
        of_table(&format!(
            "{model}\n//- /mauve.toml\ntiming.tables = [\"times.toml\"]\n//- /times.toml\n[codel]\n{entries}"
        ))
        .join("\n")
    };
    expect![[r#""f" unknown-timing-key: no library `naer`, which 2 keys name; did you mean `near`?"#]]
        .assert_eq(&with("", "naer.f = 1\nnaer.g = 1\n"));
    expect![[r#""f" unknown-timing-key: no library `naer`, which 2 keys name"#]]
        .assert_eq(&with("", "naer.f = 1\nnaer.h = 1\n"));
    // The library is there, and the codels are not.
    expect![[r#"
        "far1" unknown-timing-key: no codel `near.far1`; did you mean `near.f`?
        "far2" unknown-timing-key: no codel `near.far2`; did you mean `near.f`?"#]]
    .assert_eq(&with("", "near.far1 = 1\nnear.far2 = 1\n"));
    // A missing file may declare it, and a `use` of it is reported.
    for model in ["include \"lost.mal\"", "library other { use gone }"] {
        assert_eq!(with(model, "gone.f = 1\ngone.g = 1\n"), "", "{model}");
    }
}

#[test]
fn an_unknown_program_is_reported_where_all_programs_are_known() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |robot: &str, entry: &str| {
        of_table(&format!("{robot}{deployed}{TIMES}[program]\n{entry} = 1\n")).join("\n")
    };
    expect![[r#""\"C1/updaet\"" unknown-timing-key: C1 has no program `updaet`; did you mean `C1/update`?"#]]
        .assert_eq(&with(ROBOT, "\"C1/updaet\""));
    // That of another library is unknown as a whole.
    expect![[r#""\"gone.C1/updaet\"" unknown-timing-key: no component `gone.C1`"#]]
        .assert_eq(&with(ROBOT, "\"gone.C1/updaet\""));
    // The core has an error, or is for another shell.
    for (from, to) in [
        ("core K1(S) { update = { one(); } }", "core K1(S) { update = { one(); } update = { one(); } }"),
        ("component C1(S, K1)", "component C1(Serving, K1)"),
    ] {
        assert_eq!(with(&ROBOT.replace(from, to), "\"C1/updaet\""), "", "{to}");
    }
    // The shell provides the operation: that the core does not define it is reported.
    let undefined = ROBOT.replace("provide help() = { return one(); }", "");
    assert_eq!(with(&undefined, "\"CS/help\""), "");
}

#[test]
fn a_table_may_have_times_of_another_project() {
    let projects = "codel one(): int\n//- /other.mal\ncodel other(): int\n//- /mauve.toml\n\
        project.roots = [\"model.mal\", \"other.mal\"]\ntiming.tables = [\"times.toml\"]\n//- /times.toml\n[codel]\n";
    assert_eq!(of_table(&format!("{projects}one = 1\nother = 1\n")), [] as [&str; 0]);
    expect![[r#""neither" unknown-timing-key: no codel `neither`"#]]
        .assert_eq(&of_table(&format!("{projects}one = 1\nneither = 1\n")).join("\n"));
}

#[test]
fn an_operation_called_like_the_hook_shares_no_key_with_it() {
    let robot = ROBOT.replace(
        "core KS(Serving) { provide help() = { return one(); } update = { two(); } }",
        "core KS(Serving) { provide update() = { return one(); } update = { two(); } }",
    );
    let robot =
        robot.replace("shell Serving { provide help(): int }", "shell Serving { provide update(): int }");
    let robot = robot.replace("instance b: C2", "instance b: CS");
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    expect![[r#"
        a not-analysed: times.toml:6: the unknown key `CS/update` may be that of `C1/update`
        b not-analysed: times.toml:6: CS has several programs `update`; `a` may preempt it and is not analysed
        c not-analysed: times.toml:6: the unknown key `CS/update` may be that of `C4/update`; `a` and `b` may preempt it and are not analysed
    "#]]
    .assert_eq(&verdicts(&format!("{robot}{deployed}{TIMES}[program]\n\"CS/update\" = 1\n")));
}

#[test]
fn tokens_left_over_behind_a_value_may_belong_to_it() {
    for (field, taken) in [
        ("priority = 2 9 period = 10", 3),
        ("priority = 2)9 period = 10", 3),
        ("priority = background 9 period = 10", 3),
        ("priority = background priorty = 9 period = 10", 3),
        ("priority = 2 e1 period = 10", 3),
        ("affinity 2 priority = 2 period = 10", 2),
        ("priority = 2 period = 10 0", 2),
    ] {
        let deployed = activities(FINE.0, field, FINE.2);
        let found = verdicts(&format!("{ROBOT}{deployed}{TIMES}"));
        assert_eq!(found.matches("not-analysed:").count(), taken, "{field}: {found}");
    }
}

#[test]
fn operations_with_any_fault_are_not_taken_for_silent() {
    let deployment = activities(FINE.0, FINE.1, FINE.2);
    let robot = |shells: &str, connection: &str| {
        let text = format!(
            "codel one(): int codel two(): int codel four(): int\n{shells}
core K1(S) {{ update = {{ one(); }} }}
core KS(Serving) {{ provide help() = {{ return four(); }} update = {{ two(); }} }}
core KA(Asking) {{ update = {{ one(); }} }}
component C1(S, K1) component CS(Serving, KS) component CA(Asking, KA)
architecture A {{ instance a: C1  instance b: CS  instance c: CA  {connection} }}
{deployment}{TIMES}"
        );
        verdicts(&text)
    };
    let fine = "shell S { } shell Serving { provide help(): int } shell Asking { require help(): int }";
    assert_eq!(robot(fine, ""), "a met 1 ms\nb met 3 ms\nc met 4 ms\n");
    for (shells, connection) in [
        (fine, "operation b. -> c.help"),
        // The shell does not list what the core defines.
        ("shell S { } shell Serving { } shell Asking { require help(): int }", "operation b.help -> c.help"),
        // Connected like ports.
        (fine, "connection b.help -> c.help"),
        (fine, "connection b.hlep -> c.help"),
        // Provided by the base, required by the shell.
        (
            "shell S { } shell Base { provide help(): int } shell Serving extends Base { require help(): int } \
             shell Asking { require help(): int }",
            "operation b.help -> c.help",
        ),
    ] {
        let found = robot(shells, connection);
        assert!(found.starts_with("a met 1 ms\nb not-analysed: "), "{shells} {connection}: {found}");
    }
    // A misspelt provider may be any instance.
    let found = robot(fine, "operation bb.help -> c.help");
    assert_eq!(found.matches("not-analysed").count(), 3, "{found}");
}

#[test]
fn a_core_for_another_shell_is_not_analysed() {
    let robot = ROBOT.replace("component C2(S, K2)", "component C2(Serving, K2)");
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    expect![[r#"
        a met 1 ms
        b not-analysed: the core of component C2 is for another shell
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&verdicts(&format!("{robot}{deployed}{TIMES}")));
    let extended = robot.replace("shell Serving { provide help(): int }", "shell Serving extends S { }");
    assert_eq!(verdicts(&format!("{extended}{deployed}{TIMES}")), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
}

#[test]
fn text_between_declarations_may_be_one() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |text: &str| verdicts(&format!("{ROBOT}{text}\n{deployed}{TIMES}"));
    assert_eq!(with("arch"), "a met 1 ms\nb met 3 ms\nc met 7 ms\n");
    for lost in [
        "Rob",
        "x = 3",
        "coedl one(): int",
        "instance h: C1",
        "operation b.help -> c.help",
        "ues far",
        "paths { include \"x.mal\" }",
        "from x { use far }",
        "files { \"x.mal\" }",
        "}",
        "library x {",
    ] {
        assert_eq!(with(lost).matches("not-analysed:").count(), 3, "{lost}: {}", with(lost));
    }
    // Sections of other tools are errors, and harmless; a misspelt keyword is not one.
    let fine = "a met 1 ms\nb met 3 ms\nc met 7 ms\n";
    assert_eq!(with("view Robot { a { x = 1; } b }"), fine);
    assert_eq!(with("libary near { codel one(): int }").matches("not-analysed:").count(), 3);
    // Half of the text is a comment that nobody closed.
    let found = verdicts(&format!("{ROBOT}{deployed}\n/* codel\n{TIMES}"));
    assert_eq!(found.matches("not-analysed:").count(), 3, "{found}");
}

#[test]
fn a_name_that_is_still_to_come_is_not_looked_for_elsewhere() {
    // In each, one token is missing, and something of the same name stands in a library that is used.
    let model = |near: &str, instance: &str| {
        verdicts(&format!(
            "library near {{ use far {near} }}
library far {{ codel f(): int  shell S {{ }}  core K(S) {{ update = {{ f(); }} }}  component C(S, K) }}
library other {{ component X(far.S, far.K) }}
architecture A {{ {instance} }}
deployment D {{ architecture A  activity a {{ priority = 1 period = 10 }} }}
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
\"near.f\" = 5
\"far.f\" = 1
"
        ))
    };
    let whole = "codel f(): int  shell S { }  core K(S) { update = { f(); } }  component C(S, K)";
    assert_eq!(model(whole, "instance a: near.C"), "a met 5 ms\n");
    for (from, to) in [
        ("codel f()", "codel ()"),
        ("shell S", "shell "),
        ("core K(S)", "core (S)"),
        ("component C(", "component ("),
        ("(S, K)", "(S, far.)"),
        ("core K(S)", "core K(far.)"),
    ] {
        let found = model(&whole.replace(from, to), "instance a: near.C");
        assert!(found.starts_with("a not-analysed: "), "{to}: {found}");
    }
    for instance in ["instance a: X.", "instance a: X C", "instance a: X\n near"] {
        let found = model(whole, instance);
        assert!(found.starts_with("a not-analysed: "), "{instance}: {found}");
    }
}

#[test]
fn a_background_activity_of_two_instances_may_be_real_time() {
    let robot = ROBOT.replace("instance b: C2", "instance b: C2  instance b: C4");
    let deployed = activities(FINE.0, "priority = background", FINE.2);
    let found = verdicts(&format!("{robot}{deployed}{TIMES}"));
    assert_eq!(found.matches("not-analysed").count(), 3, "{found}");
}

#[test]
fn a_deployment_of_which_nothing_is_known_is_not_schedulable() {
    let schedulable = |text: &str| {
        let db = Database::default();
        let workspace = workspace(&db, text);
        let project = projects(&db, workspace)[0];
        let names = names_of(&db, project);
        let deployment = names.anywhere(Kind::Deployment, "D")[0];
        let query = Query { level: LEVEL, method: Method::Psm };
        response_times(&db, project, deployment, query).schedulable()
    };
    assert!(schedulable("architecture A { } deployment D { architecture A }"));
    assert!(!schedulable("deployment D { architecture Missing }"));
    assert!(!schedulable("architecture A { instnce h: K } deployment D { architecture A }"));
}

#[test]
fn levels_are_never_interpolated() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let times = "\n//- /mauve.toml\ntiming.tables = [\"times.toml\"]\nassume.codel = \"1 ms\"\n//- /times.toml\nlevels = [1e-3, 1e-5]\n[codel]\none = 1\ntwo = [2, 3]\nfour = 4\n";
    let at = |level: f64| {
        verdicts_with(&format!("{ROBOT}{deployed}{times}"), Method::Psm, Level::from_f64(level).unwrap())
    };
    assert_eq!(at(1e-5), "a met 1 ms\nb met 4 ms\nc met 8 ms\n");
    expect![[r#"
        a met 1 ms
        b not-analysed: no time for codel `two` at 1e-4: times.toml has the levels 1e-3, 1e-5
        c not-analysed: `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&at(1e-4));
    let overhead = times.replace("[2, 3]", "2").replace("[codel]", "[overhead]\ndispatch = [1, 2]\n[codel]");
    let found = verdicts(&format!("{ROBOT}{deployed}{overhead}"));
    assert_eq!(found.matches("not-analysed: no overhead at 1e-4").count(), 3, "{found}");
    // That is one mistake, at the level that is asked for.
    let asked =
        times.replace("assume", "timing.significance = 1e-7\nassume").replace("one = 1", "one = [1, 1]");
    expect![[r#"
        /mauve.toml "1e-7" missing-time: no times at 1e-7: times.toml has the levels 1e-3, 1e-5; set `[timing] significance` to one of them
    "#]]
    .assert_eq(&diagnostics(&format!("{ROBOT}{deployed}{asked}")));
}

#[test]
fn the_classic_method_takes_the_greater_of_component_and_edge() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let with = |components: &str| {
        verdicts_with(&format!("{ROBOT}{deployed}{TIMES}[component]\n{components}"), Method::Classic, LEVEL)
    };
    assert_eq!(with("C1 = 2\nC2 = 1\n"), "a met 2 ms\nb met 4 ms\nc met 8 ms\n");
    expect![[r#"
        a not-analysed: times.toml: negative time -2: expected a number of ms from 0
        b not-analysed: times.toml: negative time -2: expected a number of ms from 0
        c not-analysed: times.toml: negative time -2: expected a number of ms from 0
    "#]]
    .assert_eq(&with("C1 = -2\n"));
    // An unknown component may be any that has no time of its own.
    expect![[r#"
        a met 2 ms
        b not-analysed: times.toml:7: the unknown key `Nothing` may be that of component `C2`
        c not-analysed: times.toml:7: the unknown key `Nothing` may be that of component `C4`; `b` may preempt it and is not analysed
    "#]]
    .assert_eq(&with("C1 = 2\nNothing = 9\n"));
}

#[test]
fn what_a_codel_without_a_time_may_take() {
    let deployed = activities(FINE.0, FINE.1, FINE.2);
    let without = |names: &[&str]| {
        let times =
            names.iter().fold(TIMES.to_owned(), |times, name| times.replace(&format!("{name} = "), "# "));
        diagnostics(&format!("{ROBOT}{deployed}{times}"))
    };
    // 1 + x + 4 ≤ 10 for the least urgent.
    expect![[r#"
        /model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; all deadlines are met up to 5 ms
    "#]]
    .assert_eq(&without(&["two"]));
    expect![[r#"
        /model.mal "one" missing-time: no time for codel `one`: `a` is not analysed; all deadlines are met up to 6 ms if the other codels without a time take 0 ms
        /model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; all deadlines are met up to 6 ms if the other codels without a time take 0 ms
    "#]].assert_eq(&without(&["one", "two"]));
    // Where a deadline is missed anyway, and where another activity is not analysed, no time is promised.
    let of_two = |c: &str| {
        let times = TIMES.replace("two = ", "# ");
        let found = diagnostics(&format!("{ROBOT}{}{times}", activities(FINE.0, FINE.1, c)));
        found.lines().filter(|line| line.contains("missing-time")).collect::<Vec<_>>().join("\n")
    };
    expect![[r#"/model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; no further deadline is missed up to 9 ms"#]]
        .assert_eq(&of_two("priority = 1 period = 10 deadline = 3"));
    // Alone on another CPU, it has nothing to do with the missed deadline.
    expect![[r#"/model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; no further deadline is missed up to 9 ms"#]].assert_eq(&of_two("priority = 1 period = 10 deadline = 3 affinity = 2"));
    // It is late even if `two` takes nothing.
    let times = TIMES.replace("two = ", "# ");
    let found = diagnostics(&format!(
        "{ROBOT}{}{times}",
        activities(FINE.0, "priority = 2 period = 9 deadline = 0.5", FINE.2)
    ));
    expect![[r#"
        /model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; it is late with any time
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `a` (0.5 < 10 ms) but a lower priority (2 < 3)
    "#]].assert_eq(&found);
    expect![[r#"/model.mal "two" missing-time: no time for codel `two`: `b` is not analysed"#]]
        .assert_eq(&of_two("priority = 1 period = 0"));
    // All activities that execute it are named.
    let both = ROBOT.replace("instance c: C4", "instance c: C2");
    expect![[r#"
        /model.mal "two" missing-time: no time for codel `two`: `b` and `c` are not analysed; all deadlines are met up to 4.5 ms
    "#]].assert_eq(&diagnostics(&format!("{both}{deployed}{}", TIMES.replace("two = ", "# "))));
    // In one of two deployments, `four` has no time either: 1 ms of `a`, and 1 ns for a job that takes nothing.
    let one = "architecture B { instance b: C2 } deployment E { architecture B activity b { priority = 1 period = 9 } }";
    let times = TIMES.replace("two = ", "# ").replace("four = ", "# ");
    let found = diagnostics(&format!("{ROBOT}{deployed}{one}{times}"));
    expect![[r#"/model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; all deadlines are met up to 8.999999 ms if the other codels without a time take 0 ms"#]].assert_eq(found.lines().find(|line| line.contains("`two`")).unwrap());
    // `four` has no time at the level of the report: it is another codel without a time.
    let levels = TIMES
        .replace("[codel]", "levels = [1e-3, 1e-5]\n[codel]")
        .replace("two = ", "# ")
        .replace("= 4", "= [4, 5]");
    let found = diagnostics(&format!("{ROBOT}{deployed}{levels}"));
    expect![[r#"
        /model.mal "two" missing-time: no time for codel `two`: `b` is not analysed; all deadlines are met up to 8.999999 ms if the other codels without a time take 0 ms
        /model.mal "D" missing-time: no times at 1e-4: times.toml has the levels 1e-3, 1e-5; set `[timing] significance` to one of them
    "#]].assert_eq(&found);
    let no_table = TIMES.split("//- /mauve.toml").next().unwrap();
    expect![[r#"
        /model.mal "D" missing-time: no execution times: 3 codels have no time, and nothing is analysed; write the times into timing tables that mauve.toml names (`[timing] tables = ["timing/*.toml"]`), or one for all under `[assume]` (`codel = "5 ms"`)
    "#]].assert_eq(&diagnostics(&format!("{ROBOT}{deployed}{no_table}")));
}

/// An overloaded CPU is one error, and each activity without a bound stands there or in its related locations, whatever the
/// priorities and periods are.
#[test]
fn an_overloaded_cpu_is_one_error_with_all_its_activities() {
    let mut overloaded = 0;
    for number in 0..27_usize {
        let period = |place: u32| [1, 3, 6, 100][(number / 3_usize.pow(place)) % 3 + usize::from(place == 2)];
        let [a, b, c] = [0, 1, 2].map(|place| format!("priority = {} period = {}", 3 - place, period(place)));
        let db = Database::default();
        let workspace = workspace(&db, &format!("{ROBOT}{}{TIMES}", activities(&a, &b, &c)));
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let report = response_times(&db, project, deployment, Query::shown(&db, project, deployment));
        let is_unbounded = |it: &&mauve_wcrt::ActivityReport<'_>| it.verdict.name() == "unbounded";
        let mut unbounded: Vec<_> =
            report.activities.iter().filter(is_unbounded).filter_map(|it| it.at.clone()).collect();
        let found = workspace_diagnostics(&db, workspace);
        let is_error = |it: &&Finding<'_>| it.diagnostic.code.name == "deadline-missed";
        let errors =
            found.iter().filter(is_error).filter(|it| it.diagnostic.message.contains(" overloaded ("));
        let errors: Vec<_> = errors.map(|it| &it.diagnostic).collect();
        assert_eq!(errors.len(), usize::from(!unbounded.is_empty()));
        let Some(error) = errors.first() else { continue };
        overloaded += 1;
        // At the highest priority: the activities are in this order.
        assert_eq!(error.at, unbounded.remove(0), "{}", error.message);
        assert_eq!(error.related.iter().map(|(at, _)| at.clone()).collect::<Vec<_>>(), unbounded);
        let mut missed = found.iter().filter(|it| it.diagnostic.code.name == "deadline-missed");
        assert!(missed.all(|it| !unbounded.contains(&it.diagnostic.at)));
    }
    assert!(overloaded > 10, "{overloaded}");
}

#[test]
fn an_activity_on_an_overloaded_cpu_says_whether_it_misses_its_deadline_anyway() {
    let error = |a: &str, b: &str, c: &str| {
        let db = Database::default();
        let workspace = workspace(&db, &format!("{ROBOT}{}{TIMES}", activities(a, b, c)));
        let found = workspace_diagnostics(&db, workspace);
        let found = found.iter().find(|it| it.diagnostic.message.contains(" overloaded (")).unwrap();
        let related = found.diagnostic.related.iter().map(|(_, message)| format!("\n  {message}"));
        found.diagnostic.message.clone() + &related.collect::<String>() + "\n"
    };
    expect![[r#"
        CPU 1 overloaded (111.1 % at priority ≥ 3); the execution time of `a` alone, 1 ms, exceeds its period of 0.9 ms
          `b` has no bounded response time
          `c` has no bounded response time: also, its execution time of 4 ms alone exceeds its deadline of 3 ms
    "#]].assert_eq(&error(
        "priority = 3 period = 0.9",
        "priority = 2 period = 10",
        "priority = 1 period = 10 deadline = 3",
    ));
    expect![[r#"
        CPU 1 overloaded (116.7 % at priority ≥ 2); `b` contributes most (66.7 %); the execution time of `b` alone, 2 ms, exceeds its deadline of 1 ms
    "#]].assert_eq(&error(
        "priority = 3 period = 2",
        "priority = 2 period = 3 deadline = 1",
        "priority = background",
    ));
}

#[test]
fn what_a_missed_deadline_and_an_overloaded_cpu_say() {
    let found = |a: &str, b: &str, c: &str, times: &str| {
        let found = diagnostics(&format!("{ROBOT}{}{times}", activities(a, b, c)));
        let is_of_model = |line: &&str| !line.contains(" overloading-times: ");
        found.split_inclusive('\n').filter(is_of_model).collect::<String>()
    };
    // The deadline is its own 4 ms, and then less.
    let late = |deadline: &str| found(FINE.0, FINE.1, &format!("{} deadline = {deadline}", FINE.2), TIMES);
    expect![[r#"
        /model.mal "c" deadline-missed: `c` misses its deadline: ✗ 7 / 4 ms; largest interference: `b`, 2 ms (1 job)
        /model.mal "1" not-deadline-monotonic: `c` has a shorter deadline than `a` (4 < 10 ms) but a lower priority (1 < 3)
    "#]].assert_eq(&late("4"));
    expect![[r#"
        /model.mal "c" deadline-missed: `c` misses its deadline: its own execution time of 4 ms exceeds the deadline of 3 ms
    "#]].assert_eq(&late("3"));
    // The seven jobs of a busy window of 694 ms: the fifth ends 118 ms after its release (Lehoczky, 1990).
    let times = TIMES.replace("one = 1", "one = 26").replace("two = 2", "two = 62");
    let lehoczky =
        found("priority = 2 period = 70", "priority = 1 period = 100", "priority = background", &times);
    expect![[r#"
        /model.mal "b" deadline-missed: `b` misses its deadline: ✗ 118 / 100 ms; largest interference: `a`, 208 ms (8 jobs) in the busy window of 518 ms, 5 jobs of `b`
    "#]].assert_eq(&lehoczky);
    // 40 % and 100 %; then 10 % more. `b` has the greatest part, and alone it would have a bound.
    let overloaded = |b: &str, config: &str| {
        let times = TIMES.replace("timing.", &format!("{config}timing."));
        found("priority = 1 period = 10", b, "priority = 3 period = 10", &times)
    };
    expect![[r#"
        /model.mal "b" deadline-missed: CPU 1 overloaded (140.0 % at priority ≥ 2); `b` contributes most (100.0 %)
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `c` (2 < 10 ms) but a lower priority (2 < 3)
    "#]].assert_eq(&overloaded("priority = 2 period = 2", ""));
    expect![[r#"
        /model.mal "b" deadline-missed: CPU 1 overloaded (145.3 % at priority ≥ 2); the execution time of `b` alone, 2 ms, exceeds its period of 1.9 ms
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `c` (1.9 < 10 ms) but a lower priority (2 < 3)
    "#]].assert_eq(&overloaded("priority = 2 period = 1.9", ""));
    // Only what the CPU executes contributes to its overload: 66.7 % and 50 %, and 90.9 % on the other one.
    let other_cpu = found(
        "affinity = 1 priority = 9 period = 1.1",
        "affinity = 2 priority = 8 period = 3",
        "affinity = 2 priority = 7 period = 8",
        TIMES,
    );
    expect![[r#"
        /model.mal "c" deadline-missed: CPU 2 overloaded (116.7 % at priority ≥ 7); `b` contributes most (66.7 %)
    "#]].assert_eq(&other_cpu);
    // Other work has 120 % of the CPU, and none where it has another CPU.
    let lan = |fields: &str| {
        let lan = format!(
            "platform.other = [{{ name = \"lan\", period = \"5 ms\", time = \"6 ms\", {fields} }}]\n"
        );
        overloaded("priority = 2 period = 2", &lan)
    };
    expect![[r#"
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `c` (2 < 10 ms) but a lower priority (2 < 3)
        /model.mal "c" deadline-missed: CPU 1 overloaded (160.0 % at priority ≥ 3); the execution time of `lan (platform)` alone, 6 ms, exceeds its period of 5 ms
    "#]].assert_eq(&lan("priority = 99"));
    // It has 100 %, and `b` 10 %; then it has 2 %.
    let other = |time: &str| {
        let lan = format!("name = \"lan\", priority = 99, period = \"5 ms\", time = \"{time}\"");
        overloaded("priority = 2 period = 20", &format!("platform.other = [{{ {lan} }}]\n"))
    };
    expect![[r#"
        /model.mal "1" not-deadline-monotonic: `a` has a shorter deadline than `b` (10 < 20 ms) but a lower priority (1 < 2)
        /model.mal "c" deadline-missed: CPU 1 overloaded (140.0 % at priority ≥ 3); `lan (platform)` contributes most (100.0 %)
    "#]].assert_eq(&other("5 ms"));
    expect![[r#"
        /model.mal "b" deadline-missed: CPU 1 overloaded (142.0 % at priority ≥ 2); `b` contributes most (100.0 %)
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `c` (2 < 10 ms) but a lower priority (2 < 3)
    "#]].assert_eq(&overloaded(
        "priority = 2 period = 2",
        "platform.other = [{ name = \"lan\", priority = 99, period = \"5 ms\", time = \"0.1 ms\" }]\n",
    ));
    let other = lan("priority = 99, cpus = [2]");
    assert_eq!(other, overloaded("priority = 2 period = 2", ""));
}

#[test]
fn a_priority_out_of_order_is_compared_with_another_deadline() {
    let found = |a: &str, b: &str, c: &str| {
        let [a, b, c] = [a, b, c].map(|it| format!("affinity = 2 period = {it}"));
        diagnostics(&format!("{ROBOT}{}{TIMES}", activities(&a, &b, &c)))
    };
    // `a` and `c` have one deadline: `c` is out of order because of `b`. Then the other way round.
    expect![[r#"
        /model.mal "1" not-deadline-monotonic: `c` has a shorter deadline than `b` (10 < 20 ms) but a lower priority (1 < 2)
    "#]].assert_eq(&found("10 priority = 3", "20 priority = 2", "10 priority = 1"));
    expect![[r#"
        /model.mal "2" not-deadline-monotonic: `b` has a shorter deadline than `a` (10 < 20 ms) but a lower priority (2 < 3)
    "#]].assert_eq(&found("20 priority = 3", "10 priority = 2", "20 priority = 1"));
}

#[test]
fn a_misspelt_activity_is_one_mistake() {
    let robot =
        ROBOT.replace("instance b: C2", "instance laser: C2").replace("instance c: C4", "instance pilot: C4");
    let codes = |b: &str, c: &str, after: &str| {
        let activity = |name: &str, fields: &str| match name {
            "" => String::new(),
            _ => format!("activity {name} {{ {fields} }}"),
        };
        let (a, b, c) = (activity("a", FINE.0), activity(b, FINE.1), activity(c, FINE.2));
        let found =
            diagnostics(&format!("{robot}deployment D {{ architecture A {a} {b} {c} }} {after}{TIMES}"));
        let codes =
            found.lines().filter_map(|line| line.rsplit_once("\" ")?.1.split(':').next().map(str::to_owned));
        codes.collect::<Vec<_>>()
    };
    assert_eq!(codes("laser", "pilot", ""), [] as [&str; 0]);
    assert_eq!(codes("laser", "", ""), ["missing-activity"]);
    assert_eq!(codes("laser", "wheel", ""), ["unresolved-instance"]);
    assert_eq!(codes("lasr", "pilott", ""), ["unresolved-instance", "unresolved-instance"]);
    // It may be the one behind the deployment.
    assert_eq!(codes("laser", "", "activity pilot { priority = 1 period = 10 }"), ["syntax-error"]);
    // The half-typed word may name the architecture.
    let half = diagnostics(&format!("{ROBOT}deployment D {{ architectur }}{TIMES}"));
    assert!(half.contains("syntax-error") && !half.contains("deployment-target"), "{half}");
}

#[test]
fn a_misspelt_field_is_one_mistake() {
    let found =
        diagnostics(&format!("{ROBOT}{}{TIMES}", activities(FINE.0, "priority = 2 perod = 10", FINE.2)));
    expect![[r#"
        /model.mal "perod" unknown-field: unknown field `perod`; did you mean `period`?
    "#]]
    .assert_eq(&found);
}

#[test]
fn data_is_outdated_where_the_reader_runs_first() {
    let robot = ROBOT.replace("shell S { }", "shell S { input port i: int  output port o: int }");
    let is_stale = |b: &str, back: &str| {
        let robot =
            robot.replace("instance c: C4", &format!("instance c: C4  connection a.o -> b.i  {back}"));
        let deployed = activities("affinity = 1 priority = 5 period = 20", b, FINE.2);
        let db = Database::default();
        let found = workspace_diagnostics(&db, workspace(&db, &format!("{robot}{deployed}{TIMES}")));
        found.iter().any(|it| it.diagnostic.code.name == "stale-data")
    };
    assert!(is_stale("affinity = 1 priority = 6 period = 20", ""));
    for fresh in [
        "affinity = 1 priority = 5 period = 20",
        "affinity = 1 priority = 4 period = 20",
        "affinity = 1 priority = 6 period = 10",
        "affinity = 2 priority = 6 period = 20",
    ] {
        assert!(!is_stale(fresh, ""), "{fresh}");
    }
    // One of the two reads outdated data in any order.
    assert!(!is_stale("affinity = 1 priority = 6 period = 20", "connection b.o -> a.i"));
}

#[test]
fn a_period_in_hexadecimal_is_named_as_such() {
    for period in ["0x10", "0X10"] {
        let found = diagnostics(&format!(
            "{ROBOT}{}{TIMES}",
            activities(&format!("priority = 3 period = {period}"), FINE.1, FINE.2)
        ));
        assert!(found.contains("hexadecimal"), "{found}");
    }
}

#[test]
fn what_rests_on_an_assumed_time_is_known() {
    let with = |a: &str, b: &str, c: &str| {
        let assumed = TIMES.replace("two = ", "# ").replace("timing.", "assume.codel = \"2 ms\"\ntiming.");
        reported(&format!("{ROBOT}{}{assumed}", activities(a, b, c)), |report| report.with_assumptions())
    };
    let on = |cpu: u32, priority: u32| format!("affinity = {cpu} priority = {priority} period = 10");
    // The time of `b` is assumed: what it may preempt rests on it, on its CPU.
    assert_eq!(with(&on(2, 3), &on(2, 2), &on(2, 1)), [false, true, true]);
    assert_eq!(with(&on(2, 2), &on(2, 2), &on(1, 1)), [true, true, false]);
}

#[test]
fn a_report_shows_what_it_leaves_out() {
    let fine = format!("{ROBOT}{}{TIMES}", activities(FINE.0, FINE.1, FINE.2));
    // 1 ms of `a` and 2 ms of `b` delay `c`.
    let greatest = reported(&fine, |report| {
        let (parts, others) = report.breakdown(&|| ()).greatest_of(2, 1);
        (parts.into_iter().map(|it| it.instance.to_string()).collect::<Vec<_>>(), others)
    });
    assert_eq!(greatest, (vec!["b".to_owned()], 1));
    // An activity may be missing: then the utilisation is not all of it.
    let is_complete = |fixture: &str| reported(fixture, |report| report.cpus.iter().all(|cpu| cpu.complete));
    assert!(is_complete(&fine));
    assert!(!is_complete(&fine.replace("activity a {", "actvity x { } activity a {")));
}

#[test]
fn names_are_looked_up_in_ones_own_library_first() {
    let model = "
library near { codel f(): int  shell S { }  core K(S) { update = { f(); } }  component C(S, K) }
library far { codel f(): int  codel g(): int }
library user { use far  shell S { }  core K(S) { update = { f(); g(); } }  component C(S, K) }
architecture A { instance a: near.C  instance b: user.C }
deployment D { architecture A  activity a { priority = 2 period = 10 }  activity b { priority = 1 period = 10 } }
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
\"near.f\" = 1
far.f = 2
g = 4
";
    assert_eq!(verdicts(model), "a met 1 ms\nb met 7 ms\n");
    // A key that several codels have is an error, and none of them has that time; one that has its own keeps it.
    let found = verdicts(&format!("{model}\"gone.g\" = 9\n"));
    expect![[r#"
        a met 1 ms
        b not-analysed: times.toml:5: the unknown key `gone.g` may be that of codel `far.g`
    "#]]
    .assert_eq(&found);
    let found = verdicts(&model.replace("\"near.f\" = 1", "f = 1"));
    expect![[r#"
        a not-analysed: times.toml:2: the key `f` is ambiguous
        b not-analysed: `a` may preempt it and is not analysed
    "#]]
    .assert_eq(&found);
}

/// Three callbacks of one thread, and one activity beside them, each of which takes a time.
fn callbacks(fields: &str, rest: &str) -> String {
    verdicts(&format!(
        "
codel one(): int
codel two(): int
codel three(): int
codel top(): int
shell S {{ input port go: int  output port done: int }}
core A(S) {{ update = {{ one(); write(done, 1); }} }}
core B(S) {{ var n: int = 0  update = {{ read(go, n); two(); }} }}
core C(S) {{ update = {{ three(); }} }}
core T(S) {{ update = {{ top(); }} }}
component Imu(S, A)
component Cmd(S, B)
component Log(S, C)
component Top(S, T)
architecture Robot {{ instance imu: Imu  instance cmd: Cmd  instance log: Log  instance top: Top  connection imu.done -> cmd.go }}
deployment D {{
  architecture Robot
  activity imu {{ {fields}  period = 10 }}
  activity cmd {{ {fields}  trigger = go  least = 25 }}
  activity log {{ {fields}  period = 40 }}
  activity top {{ cpus = [1]  {rest} }}
}}
//- /mauve.toml
timing.tables = ['times.toml']
//- /times.toml
[codel]
one = 2
two = 4
three = 5
top = 3
"
    ))
}

/// All three in the queue: 2 + 4 + 5. In any order, the next job of `imu`, at 10, may come before another one: 2 more. A job of `top`
/// delays each of these by 3, and the second one, at 20, is too late.
#[test]
fn callbacks_of_one_thread() {
    let of_thread = "thread = control  cpus = [1]  priority = 50";
    let background = "priority = background";
    let fifo = callbacks(of_thread, background);
    assert_eq!(fifo, "imu missed 11 ms\ncmd met 11 ms\nlog met 11 ms\ntop background\n");
    let any = callbacks(&format!("{of_thread}  order = any"), background);
    assert_eq!(any, "imu missed 11 ms\ncmd met 13 ms\nlog met 13 ms\ntop background\n");
    let above = callbacks(of_thread, "priority = 60  period = 20");
    assert_eq!(above, "imu missed 14 ms\ncmd met 14 ms\nlog met 14 ms\ntop met 3 ms\n");
    // With a thread of its own, each of them may preempt the others; so in a thread with other values.
    let other = callbacks(
        "thread = control  cpus = [1]  priority = 50",
        "priority = 50  thread = control  period = 20  order = any",
    );
    assert!(other.contains("top not-analysed"), "{other}");
}

/// `top` waits for the longest job below it that has begun, 5, and `imu` for `top` and until then: 3 + 5 + 2.
#[test]
fn jobs_that_are_not_preempted() {
    let found = |preemptive: &str| {
        callbacks(&format!("cpus = [1]  priority = 50  {preemptive}"), "priority = 60  period = 20")
    };
    assert!(found("").ends_with("top met 3 ms\n"), "{}", found(""));
    assert!(found("preemptive = false").ends_with("top met 8 ms\n"), "{}", found("preemptive = false"));
    assert!(found("preemptive = true").ends_with("top met 3 ms\n"));
    // What is written may be `false`.
    let unknown = "top not-analysed: `imu` of lower priority is not preempted";
    assert!(found("preemptive = no").contains(unknown), "{}", found("preemptive = no"));
}
