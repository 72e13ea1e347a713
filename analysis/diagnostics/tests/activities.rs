//! The fields of an activity, written in several ways: rates, lists of CPUs, triggers and lists of instances.
//!
//! What is half-typed, unknown or in conflict is not analysed, nor is what it may delay.

use crate::common::{diagnostics, verdicts};

/// A deployment of three activities of 1, 2 and 4 ms.
fn robot(activities: &str, config: &str) -> String {
    format!(
        "codel one(): int\ncodel two(): int\ncodel four(): int
shell S {{ input port scan: int  output port track: int }}
core K1(S) {{ update = {{ one(); }} }}
core K2(S) {{ update = {{ two(); }} }}
core K4(S) {{ update = {{ four(); }} }}
component C1(S, K1)
component C2(S, K2)
component C4(S, K4)
architecture A {{ instance a: C1  instance b: C2  instance c: C4  connection a.track -> b.scan  connection b.track -> a.scan  connection a.track -> c.scan }}
deployment D {{ architecture A  {activities} }}
//- /mauve.toml
timing.tables = [\"times.toml\"]
platform.rt_throttling = false
{config}
//- /times.toml
[codel]
one = 1
two = 2
four = 4
"
    )
}

/// The verdicts with these fields of `a`, which has the highest priority.
fn with(a: &str) -> String {
    let others = "activity b { priority = 2 period = 10 affinity = 1 }  activity c { priority = 1 period = 10 affinity = 1 }";
    verdicts(&robot(
        &format!("activity a {{ {a} }}  {others}"),
        "platform.cpus = 2\nplatform.cpu_sets.big = [1]",
    ))
}

fn is_analysed(verdicts: &str) -> Vec<bool> {
    verdicts.lines().map(|line| !line.contains("not-analysed")).collect()
}

#[test]
fn fields_that_say_the_same() {
    let expected = with("priority = 3 period = 10 affinity = 1");
    assert_eq!(is_analysed(&expected), [true; 3], "{expected}");
    for same in [
        "priority = 3 rate = 100 Hz affinity = 1",
        "priority = 3 rate = 100 cpus = [1]",
        "priority = 3 rate = 1000/10 Hz cpus = big",
        "priority = 3 period = 100/10 cpus = [1, 1]",
    ] {
        assert_eq!(with(same), expected, "{same}");
    }
    let other = with("priority = 3 period = 10 affinity = 2");
    assert_eq!(with("priority = 3 period = 10 cpus = [2]"), other);
    assert_ne!(other, expected);
}

#[test]
fn wrong_fields_leave_no_figure_of_what_they_may_delay() {
    for (fields, code) in [
        ("priority = 3 rate = affinity = 1", "syntax-error"),
        ("priority = 3 rate = 100 kHz affinity = 1", "syntax-error"),
        ("priority = 3 rate = 0 Hz affinity = 1", "invalid-field"),
        ("priority = 3 period = 10/0 affinity = 1", "invalid-field"),
        ("priority = 3 period = 10/3/2 affinity = 1", "invalid-field"),
        ("priority = 3 period = 10 rate = 50 Hz affinity = 1", "conflicting-fields"),
        ("priority = 3 period = 10 cpus = [2 affinity = 1", "syntax-error"),
        ("priority = 3 period = 10 cpus = [2,", "syntax-error"),
        ("priority = 3 period = 10 cpus = [2]]", "syntax-error"),
        ("priority = 3 period = 10 cpus = [3]", "invalid-field"),
        ("priority = 3 period = 10 cpus = []", "invalid-field"),
        ("priority = 3 period = 10 cpus = bgi", "invalid-field"),
        ("priority = 3 period = 10 cpus = [2] affinity = 2", "conflicting-fields"),
        ("priority = 3 period = 10 affinity = [2]", "invalid-field"),
        ("priority = 3 period = 10 cpu = [2]", "unknown-field"),
        ("priority = 3 trigger = least = 10 affinity = 1", "syntax-error"),
        ("priority = 3 trigger = track least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = scna least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = [scan] least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = any [] least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = some [scan] least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = any [scan, 1] least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = all [scan, scna] least = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = any [scan least = 10 affinity = 1", "syntax-error"),
        ("priority = 3 period = 10 cpus = any [1]", "invalid-field"),
        ("instances = all [a] priority = 3 period = 10 affinity = 1", "invalid-field"),
        ("priority = 3 trigger = scan affinity = 1", "missing-field"),
        ("priority = 3 trigger = scan least = 10 offset = 1 affinity = 1", "conflicting-fields"),
        ("priority = 3 trigger = scan least = 10 period = 10 affinity = 1", "conflicting-fields"),
        ("priority = 3 least = 10 affinity = 1", "conflicting-fields"),
        ("priority = 3 period = 10 burst = 2 affinity = 1", "conflicting-fields"),
        ("priority = 3 trigger = scan least = 10 burst = 0 affinity = 1", "invalid-field"),
        ("priority = 3 triger = scan least = 10 affinity = 1", "unknown-field"),
        ("instances = priority = 3 period = 10 affinity = 1", "syntax-error"),
        ("instances = a priority = 3 period = 10 affinity = 1", "invalid-field"),
        ("instances = [a priority = 3 period = 10 affinity = 1", "syntax-error"),
        ("instances = [a, 1] priority = 3 period = 10 affinity = 1", "invalid-field"),
        ("instances = [a] trigger = scan priority = 3 least = 10 affinity = 1", "conflicting-fields"),
    ] {
        let found = with(fields);
        assert!(!is_analysed(&found).contains(&true), "{fields}\n{found}");
        let config = "platform.cpus = 2\nplatform.cpu_sets.big = [1]";
        let others = "activity b { priority = 2 period = 10 }  activity c { priority = 1 period = 10 }";
        let reported = diagnostics(&robot(&format!("activity a {{ {fields} }}\n{others}"), config));
        let errors: Vec<&str> =
            reported.lines().filter(|it| it.contains("error[") || it.contains("Error")).collect();
        assert!(reported.contains(code), "{fields}\n{reported}");
        assert!(errors.len() <= 1, "{fields}\n{reported}");
    }
}

#[test]
fn a_thread_has_each_of_its_instances() {
    let found = verdicts(&robot(
        "activity c { priority = 1 period = 20 }  activity drivers { instances = [b, a] priority = 2 period = 10 }",
        "",
    ));
    let names: Vec<&str> = found.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(names, ["c", "b", "a"], "{found}");
    assert_eq!(is_analysed(&found), [true; 3], "{found}");
}

/// A thread wakes up once for all that it executes: 0.3 + 2 × 0.1 ms for the first instance, whichever it is. A wait is two switches more.
#[test]
fn a_thread_wakes_up_once() {
    let overhead = "[overhead]\ndispatch = 0.3\ncontext_switch = 0.1\n";
    let c = "activity c { priority = 1 period = 40 affinity = 1 }";
    let with = |activities: &str, times: &str| {
        verdicts(&(robot(&format!("{activities} {c}"), "") + times + overhead))
    };
    let thread =
        |order: &str| format!("activity t {{ instances = [{order}] priority = 2 period = 20 affinity = 1 }}");
    let alone = "activity a { priority = 3 period = 20 affinity = 1 } activity b { priority = 2 period = 20 affinity = 1 }";
    assert_eq!(with(alone, ""), "a met 1.5 ms\nb met 4 ms\nc met 8.5 ms\n");
    assert_eq!(with(&thread("a, b"), ""), "a met 1.5 ms\nb met 3.5 ms\nc met 8 ms\n");
    assert_eq!(with(&thread("b, a"), ""), "b met 2.5 ms\na met 3.5 ms\nc met 8 ms\n");
    // 2.5 + 1 + 3 + 4 × 0.1; then 4.5.
    let waits = "[wait]\none = { time = 3, waits = 2 }\n";
    assert_eq!(with(&thread("b, a"), waits), "b met 2.5 ms\na met 6.9 ms\nc met 11.4 ms\n");
}

/// Ten functions of 0.1 ms in a thread of 2 ms, which wakes up in 0.05 ms.
#[test]
fn ten_instances_in_a_thread() {
    let names: Vec<String> = (0..10).map(|it| format!("i{it}")).collect();
    let instances: Vec<String> = names.iter().map(|it| format!("instance {it}: C")).collect();
    let found = verdicts(&format!(
        "codel f(): int\nshell S {{ }}\ncore K(S) {{ update = {{ f(); }} }}\ncomponent C(S, K)
        architecture A {{ {} }}
        deployment D {{ architecture A activity t {{ instances = [{}] priority = 1 period = 2 affinity = 1 }} }}
//- /mauve.toml
timing.tables = [\"times.toml\"]
platform.rt_throttling = false
//- /times.toml
codel.f = 0.1
overhead = {{ dispatch = 0.03, context_switch = 0.01 }}
",
        instances.join(" "),
        names.join(", ")
    ));
    let expected = (1..=10).map(|it| format!("i{} met {} ms\n", it - 1, f64::from(100 * it + 50) / 1000.0));
    assert_eq!(found, expected.collect::<String>());
}

#[test]
fn wrong_lists_of_instances() {
    let c = "activity c { priority = 1 period = 20 }";
    for (thread, code) in [
        // An instance is missing, or unknown: any may be.
        ("activity t { instances = [a] priority = 2 period = 10 }", "missing-activity"),
        ("activity t { instances = [a, d] priority = 2 period = 10 }", "unresolved-instance"),
        ("activity t { instances = [a, b, a] priority = 2 period = 10 }", "duplicate-activity"),
        ("activity t { instances = [a, b, c] priority = 2 period = 10 }", "duplicate-activity"),
        ("activity t { instances = [a, b] instances = [a] priority = 2 period = 10 }", "duplicate-field"),
        ("activity t { instance = [a, b] priority = 2 period = 10 }", "unknown-field"),
        ("activity t { instances [a, b] priority = 2 period = 10 }", "syntax-error"),
        ("activity t { instances = [a b] priority = 2 period = 10 }", "syntax-error"),
        ("activity t { instances = [a, ] priority = 2 period = }", "syntax-error"),
        ("activity t { instances = [] priority = 2 period = 10 }", "invalid-field"),
        ("activity t { priority = 2 period = 10 instances = ", "syntax-error"),
        // The activity has the name of an instance that is elsewhere.
        ("activity a { instances = [b] priority = 2 period = 10 }", "duplicate-activity"),
        (
            "activity t { instances = [a] priority = 2 period = 10 } activity t { instances = [b] priority = 3 period = 10 }",
            "duplicate-activity",
        ),
        (
            "activity b { instances = [a] priority = 2 period = 10 } activity b { priority = 3 period = 10 }",
            "duplicate-activity",
        ),
    ] {
        let text = robot(&format!("{c}  {thread}"), "");
        let found = verdicts(&text);
        assert!(!is_analysed(&found).contains(&true), "{thread}\n{found}");
        assert!(diagnostics(&text).contains(code), "{thread}\n{}", diagnostics(&text));
    }
}

#[test]
fn a_deadline_beyond_the_period_counts_as_written() {
    let met = with("priority = 3 period = 10 deadline = 11 affinity = 1");
    assert_eq!(met, with("priority = 3 period = 10 affinity = 1"));
}
