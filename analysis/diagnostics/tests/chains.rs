//! The chains of deployments: their ways, latencies and reasons, and what an edit computes of them again.

use std::fmt::Write as _;
use std::path::PathBuf;

use expect_test::{Expect, expect};
use mauve_diagnostics::chain_reason;
use mauve_hir::{Database, Workspace, deployed};
use mauve_timing::Method;
use mauve_wcrt::chains::{ChainReason, ConnectionReport, chains_of, connections_of};
use mauve_wcrt::{Query, certificate_of};

use crate::common::{LEVEL, deployments, sample, workspace};

/// Sensors, components that pass data on, and actuators.
const PARTS: &str = "
codel sense(out v: int): void
codel check(in v: int): int
codel join(in v: int, in w: int): int
codel act(in v: int): void
shell SensorShell { output port o: int }
shell FilterShell { input port i: int  output port o: int }
shell MergeShell { input port i: int  input port j: int  output port o: int }
shell ActuatorShell { input port i: int }
core SensorCore(SensorShell) { var v: int; update = { sense(v); write(o, v); } }
core FilterCore(FilterShell) { var v: int; update = { read(i, v); write(o, check(v)); } }
core MergeCore(MergeShell) { var v: int; var w: int; update = { read(i, v); read(j, w); write(o, join(v, w)); } }
core ActuatorCore(ActuatorShell) { var v: int; update = { read(i, v); act(v); } }
component Sensor(SensorShell, SensorCore)
component Filter(FilterShell, FilterCore)
component Merge(MergeShell, MergeCore)
component Actuator(ActuatorShell, ActuatorCore)
";

const TIMES: &str = "
//- /times.toml
[codel]
sense = 1
check = 2
join = 2
act = 3
//- /mauve.toml
timing.tables = ['times.toml']
";

/// A sensor, a filter and an actuator, each on a CPU of its own.
const LINE: &str = "
architecture A {
  instance s: Sensor  instance f: Filter  instance a: Actuator
  connection s.o -> f.i  connection f.o -> a.i
}
deployment D {
  architecture A
  activity s { priority = 3 period = 10 affinity = 1 }
  activity f { priority = 2 period = 20 affinity = 2 }
  activity a { priority = 1 period = 30 affinity = 4 }
}
";

const QUERY: Query = Query { level: LEVEL, method: Method::Psm };

/// A line for each chain: its latency and age at the write, and that it may be overwritten at its end; or why it has none, with the
/// text in `mauve.toml` that is wrong.
fn chains_in(db: &Database, workspace: Workspace) -> String {
    let mut out = String::new();
    let all = deployments(db, workspace);
    for &(project, decl) in &all {
        if all.len() > 1 {
            let _ = writeln!(out, "{}:", decl.name(db));
        }
        let found = chains_of(db, project, decl, QUERY);
        assert_eq!(found.hops, *connections_of(db, project, decl, QUERY));
        for chain in &found.all {
            let _ = write!(out, "{}:", chain.name);
            assert_eq!(chain.latency.is_none(), !chain.reasons.is_empty(), "{}", chain.name);
            let sum = chain.steps.iter().map(|it| it.total().as_nanos()).sum::<u64>();
            assert_eq!(sum, chain.latency.unwrap_or_default().as_nanos(), "{}", chain.name);
            if let Some(latency) = chain.latency {
                let _ = write!(
                    out,
                    " {latency}, age {}",
                    chain.age_at_write.map_or("—".to_owned(), |it| it.to_string())
                );
                out += if chain.overwritten.is_some() { ", not lasting" } else { "" };
            }
            let reason = |reason: &ChainReason<'_>| {
                let at = match reason {
                    ChainReason::Declaration { at: Some(at), .. } => at,
                    reason => return chain_reason(db, chain, reason),
                };
                let marked = &at.file(db).text(db)[at.range(db)];
                format!("{marked}: {}", chain_reason(db, chain, reason))
            };
            let reasons: Vec<String> = chain.reasons.iter().map(reason).collect();
            let _ = writeln!(out, "{}{}", if reasons.is_empty() { "" } else { " " }, reasons.join("; "));
        }
    }
    out
}

#[track_caller]
fn check(fixture: &str, expected: Expect) {
    let db = Database::default();
    expected.assert_eq(&chains_in(&db, workspace(&db, fixture)));
}

/// [`PARTS`] in this architecture, each instance every 10 ms on a CPU of its own, with these chains.
fn robot(instances: &str, connections: &str, chains: &str) -> String {
    let all: Vec<(&str, &str)> = instances.split(", ").map(|it| it.split_once(": ").unwrap()).collect();
    let declared: String = all.iter().map(|(name, of)| format!("  instance {name}: {of}\n")).collect();
    let links: String = connections.split(", ").map(|it| format!("  connection {it}\n")).collect();
    let activity = |(cpu, (name, _)): (usize, &(&str, &str))| {
        format!("  activity {name} {{ priority = 1 period = 10 affinity = {} }}\n", 1_u64 << (cpu % 64))
    };
    let activities: String = all.iter().enumerate().map(activity).collect();
    format!(
        "{PARTS}architecture A {{\n{declared}{links}}}\ndeployment D {{\n  architecture A\n{activities}}}\n{TIMES}{chains}"
    )
}

#[test]
fn from_a_sensor_to_an_actuator() {
    check(
        &format!("{PARTS}{LINE}{TIMES}"),
        expect![[r#"
        s.o -> a.act: 66 ms, age 36 ms
    "#]],
    );
    // On one CPU, a reader waits for the release of a writer of higher priority only: not 70 ms.
    let one_cpu = LINE.replace("affinity = 2", "affinity = 1").replace("affinity = 4", "affinity = 1");
    check(
        &format!("{PARTS}{one_cpu}{TIMES}"),
        expect![[r#"
        s.o -> a.act: 66 ms, age 36 ms
    "#]],
    );
}

/// A sensor, a filter and an actuator in one thread of 10 ms, in any order.
#[test]
fn the_order_in_a_thread() {
    let in_thread = |order: &str| {
        let deployment = "
architecture A {
  instance s: Sensor  instance f: Filter  instance a: Actuator
  connection s.o -> f.i  connection f.o -> a.i
}
deployment D { architecture A  activity all { instances = [ORDER]  priority = 3 period = 10 affinity = 1 } }
";
        format!("{PARTS}{}{TIMES}", deployment.replace("ORDER", order))
    };
    // The world changes just after the sensor looked: 10 ms, then 1 + 2 + 3.
    check(
        &in_thread("s, f, a"),
        expect![[r#"
            s.o -> a.act: 16 ms, age 6 ms
        "#]],
    );
    // Each step waits for the next period: 10 + 10 + 10, and the actuator is the first.
    check(
        &in_thread("a, f, s"),
        expect![[r#"
            s.o -> a.act: 33 ms, age 23 ms
        "#]],
    );
    // The filter reads a period later, and the actuator after it in that period.
    check(
        &in_thread("f, a, s"),
        expect![[r#"
            s.o -> a.act: 25 ms, age 15 ms
        "#]],
    );
}

/// Sensors of 40 and 50 ms whose data releases one component, each on a CPU of its own, and an actuator that releases follow.
#[test]
fn data_at_several_ports_releases_a_component() {
    let merged = |trigger: &str| {
        let deployment = "
architecture A {
  instance s: Sensor  instance t: Sensor  instance m: Merge  instance a: Actuator
  connection s.o -> m.i  connection t.o -> m.j  connection m.o -> a.i
}
deployment D {
  architecture A
  activity s { priority = 4 period = 40 affinity = 1 }
  activity t { priority = 3 period = 50 affinity = 2 }
  activity m { priority = 2 TRIGGER affinity = 4 }
  activity a { priority = 1 trigger = i least = 10 affinity = 8 }
}
";
        format!("{PARTS}{}{TIMES}", deployment.replace("TRIGGER", trigger))
    };
    // What `s` samples 40 ms after the change arrives 1 ms later, when data of `t` may have released a job just before: 20 ms, and 2 + 3.
    check(
        &merged("trigger = any [i, j] least = 20"),
        expect![[r#"
            s.o -> a.act: 66 ms, age 66 ms
            t.o -> a.act: 76 ms, age 76 ms
        "#]],
    );
    // It may have to wait for data of `t`, 50 + 1 ms; that of `t`, for 40 + 1.
    check(
        &merged("trigger = all [i, j] least = 20"),
        expect![[r#"
            s.o -> a.act: 97 ms, age 97 ms
            t.o -> a.act: 97 ms, age 97 ms
        "#]],
    );
    // A gap of 60 ms is longer than that.
    check(
        &merged("trigger = all [i, j] least = 60"),
        expect![[r#"
            s.o -> a.act: 106 ms, age 106 ms
            t.o -> a.act: 116 ms, age 116 ms
        "#]],
    );
    // In a circle, each has a bound where something else releases one of them.
    let circle = |trigger: &str| {
        let deployment = "
architecture A {
  instance s: Sensor  instance m: Merge  instance f: Filter  instance a: Actuator
  connection s.o -> m.i  connection m.o -> f.i  connection f.o -> m.j  connection f.o -> a.i
}
deployment D {
  architecture A
  activity s { priority = 4 period = 40 affinity = 1 }
  activity m { priority = 3 trigger = WORD [j, i] least = 20 affinity = 2 }
  activity f { priority = 2 trigger = i least = 20 affinity = 4 }
  activity a { priority = 1 period = 30 affinity = 8 }
}
";
        format!("{PARTS}{}{TIMES}", deployment.replace("WORD", trigger))
    };
    check(
        &circle("any"),
        expect![[r#"
            s.o -> a.act: 98 ms, age 68 ms
        "#]],
    );
    check(
        &circle("all"),
        expect![[r#"
            s.o -> a.act: `m` is released by data that `f` may never write again
        "#]],
    );
}

/// The steps on CPU 1, and those on CPU 3, cannot be active at once. (The offset example of pyCPA, after Palencia and González Harbour.)
#[test]
fn a_chain_that_ends_before_it_starts_again() {
    let model = |period: &str, finish: &str| {
        let step = |name: &str, ports: &str, read: &str, write: &str| {
            format!(
                "codel do_{name}(in v: int): int  shell S{name} {{ {ports} }}
core C{name}(S{name}) {{ var v: int = 0;  update = {{ {read} v = do_{name}(v); {write} }} }}  component {name}(S{name}, C{name})\n"
            )
        };
        let first = step("t21", "output port o: int", "", "write(o, v);");
        let ports = "input port i: int  output port o: int";
        let steps = ["t22", "t23"].map(|name| step(name, ports, "read(i, v);", "write(o, v);")).concat();
        let late = step("t24", ports, "read(i, v);", &format!("write(o, v); {finish}"));
        let last = step("t25", "input port i: int", "read(i, v);", "");
        let others = ["t11", "t12", "t31", "t51"].map(|name| step(name, "", "", "")).concat();
        format!(
            "{first}{steps}codel finish(): void  {late}{last}{others}
architecture A {{
  instance t11: t11  instance t12: t12  instance t21: t21  instance t22: t22  instance t23: t23
  instance t24: t24  instance t25: t25  instance t31: t31  instance t51: t51
  connection t21.o -> t22.i  connection t22.o -> t23.i  connection t23.o -> t24.i  connection t24.o -> t25.i
}}
deployment D {{
  architecture A
  activity t11 {{ cpus = [1] priority = 9 period = 20 }}
  activity t12 {{ cpus = [4] priority = 5 period = 300 }}
  activity t21 {{ cpus = [1] priority = 5 period = {period} }}
  activity t22 {{ cpus = [3] priority = 5 trigger = i least = {period} }}
  activity t23 {{ cpus = [2] priority = 5 trigger = i least = {period} }}
  activity t24 {{ cpus = [3] priority = 5 trigger = i least = {period} }}
  activity t25 {{ cpus = [1] priority = 5 trigger = i least = {period} }}
  activity t31 {{ cpus = [2] priority = 9 period = 30 }}
  activity t51 {{ cpus = [2] priority = 4 period = 200 }}
}}
//- /times.toml
codel = {{ do_t11 = 4, do_t12 = 1, do_t21 = 20, do_t22 = 25, do_t23 = 15, do_t24 = 34, do_t25 = 30, do_t31 = 5, do_t51 = 100, finish = 1 }}
//- /mauve.toml
timing.tables = ['times.toml']
platform = {{ cpus = 4, rt_throttling = false }}
chains.s1 = {{ from = 'do_t21', to = 'do_t25', latency = '300 ms' }}
"
        )
    };
    let latency = |text: &str| {
        let db = Database::default();
        let workspace = workspace(&db, text);
        let (project, decl) = deployments(&db, workspace)[0];
        let chain = &chains_of(&db, project, decl, QUERY).all[0];
        let parts = certificate_of(&db, project, decl, QUERY, &|_| String::new());
        assert_eq!((&*chain.name, &parts["chains"]), ("s1", &serde_json::json!([])));
        let not_certified = serde_json::json!(["chain s1", "released-by-data"]);
        let is_open = !chain.is_within_limit();
        assert!(is_open || parts["not_certified"].as_array().unwrap().contains(&not_certified));
        (chain.is_apart, chain.latency.unwrap().as_nanos() / 1_000_000)
    };
    // CPU 1: 20 + 2·4 and 30 + 2·4; CPU 3: 25 and 34; CPU 2: 15 + 5. A change just after `t21` has looked waits for its period:
    // 150 + 28 + 25 + 20 + 34 + 38. All but the wait, 145, is within the period.
    assert_eq!(latency(&model("150", "")), (true, 295));
    assert_eq!(latency(&model("145", "")), (true, 290));
    // With all steps on a CPU: 20 + 30 + 4·4, 25 + 34, 15 + 5, 25 + 34, 30 + 20 + 4·4.
    assert_eq!(latency(&model("144", "")), (false, 144 + 66 + 59 + 20 + 59 + 66));
    // A task of the same priority on CPU 1: a step delays it, and it delays the other step, and so on.
    let between = model("150", "").replace("cpus = [4]", "cpus = [1]");
    assert_eq!(latency(&between), (false, 150 + 67 + 59 + 20 + 59 + 67));
    // After its write, `t24` executes for 1 ms, beside the next steps: its 35 count for `t22`, and `t22` for it.
    assert_eq!(latency(&model("300", "finish();")), (true, 300 + 28 + 60 + 20 + 60 + 38));
}

/// A sample of a topic is written by the gateway, every 5 ms, and releases the filter: once in 20 ms.
#[test]
fn a_topic_releases_a_component() {
    let model = "
architecture A { instance f: Filter  instance a: Actuator  connection f.o -> a.i }
deployment D {
  architecture A
  activity f { priority = 2 trigger = i least = 20 affinity = 1 }
  activity a { priority = 1 trigger = i least = 10 affinity = 2 }
}
//- /times.toml
[codel]
check = 2
act = 3
[access]
'ros2.f.i' = 0.5
//- /mauve.toml
timing.tables = ['times.toml']
[ros2]
gateway = { priority = 20, period = '5 ms', cpus = [3] }
topics = { 'f.i' = '/in' }
[chains.follow]
from = 'f.i'
to = 'act'
[[platform.other]]
name = 'recv'
period = '1 s'
time = '1 us'
priority = 50
cpus = [3]
";
    // The gateway looks after 5 ms, and takes 0.501; 20 ms, and 2 + 3.
    check(
        &format!("{PARTS}{model}"),
        expect![[r#"
            follow: 30.501 ms, age 30.501 ms
        "#]],
    );
}

/// A thread wakes up once for all that it executes, before the first one.
#[test]
fn the_overhead_of_a_thread() {
    let in_thread = |order: &str, instances: &str, connections: &str, times: &str| {
        format!(
            "{PARTS}architecture A {{ {instances} {connections} }}
            deployment D {{ architecture A  activity all {{ instances = [{order}]  priority = 3 period = 10 affinity = 1 }} }}
{}",
            times.replace("//- /mauve.toml", "[overhead]\ndispatch = 0.1\ncontext_switch = 0.05\n//- /mauve.toml")
        )
    };
    // The world changes just after the sensor looked: 10 ms, then 0.2 + 1 + 1.
    check(
        &in_thread(
            "s, a",
            "instance s: Sensor  instance a: Actuator",
            "connection s.o -> a.i",
            &TIMES.replace('3', "1"),
        ),
        expect![[r#"
            s.o -> a.act: 12.2 ms, age 2.2 ms
        "#]],
    );
    let three = [
        "instance s: Sensor  instance f: Filter  instance a: Actuator",
        "connection s.o -> f.i  connection f.o -> a.i",
    ];
    for (order, expected) in [
        (
            "s, f, a",
            expect![[r#"
            s.o -> a.act: 16.2 ms, age 6.2 ms
        "#]],
        ),
        (
            "a, f, s",
            expect![[r#"
            s.o -> a.act: 33.2 ms, age 23.2 ms
        "#]],
        ),
        (
            "f, a, s",
            expect![[r#"
            s.o -> a.act: 25.2 ms, age 15.2 ms
        "#]],
        ),
    ] {
        check(&in_thread(order, three[0], three[1], TIMES), expected);
    }
}

/// Two ways to one actuator, and one to another.
const DIAMOND: (&str, &str) = (
    "s: Sensor, f: Filter, g: Filter, m: Merge, a: Actuator, b: Actuator",
    "s.o -> f.i, s.o -> g.i, f.o -> m.i, g.o -> m.j, m.o -> a.i, f.o -> b.i",
);

#[test]
fn a_loop_is_cut_and_each_way_has_a_row() {
    check(
        &robot(
            "s: Sensor, m: Merge, f: Filter, a: Actuator",
            "s.o -> m.i, m.o -> f.i, f.o -> m.j, f.o -> a.i",
            "",
        ),
        expect![[r#"
            s.o -> a.act: 48 ms, age 38 ms
        "#]],
    );
    check(
        &robot(DIAMOND.0, DIAMOND.1, ""),
        expect![[r#"
        s.o -> a.act (through f, m): 48 ms, age 38 ms
        s.o -> b.act: 36 ms, age 26 ms
        s.o -> a.act (through g, m): 48 ms, age 38 ms
    "#]],
    );
    // Nothing comes from a sensor.
    check(&robot("f: Filter, g: Filter", "f.o -> g.i, g.o -> f.i", ""), expect![[""]]);
    check(
        &robot("s: Sensor, f: Filter", "s.o -> f.i", ""),
        expect![[r#"
        s.o -> f.o: 23 ms, age 13 ms
    "#]],
    );
}

#[test]
fn buffers() {
    let slow = |n: u32, period: u32| {
        let connection = format!("s.o -> [{n}] a.i");
        robot("s: Sensor, a: Actuator", &connection, "")
            .replace("1 period = 10 affinity = 2", &format!("1 period = {period} affinity = 2"))
    };
    check(
        &slow(3, 10),
        expect![[r#"
        s.o -> a.act: 24 ms, age 14 ms
    "#]],
    );
    check(
        &slow(3, 5),
        expect![[r#"
        s.o -> a.act: 19 ms, age 14 ms
    "#]],
    );
    check(
        &slow(3, 100),
        expect![[r#"
            s.o -> a.act: 134 ms, age 34 ms
        "#]],
    );
    let db = Database::default();
    let workspace = workspace(&db, &slow(3, 100));
    let (project, of) = deployments(&db, workspace)[0];
    let ConnectionReport { stays_full, never_read, .. } = connections_of(&db, project, of, QUERY)[0];
    assert_eq!((stays_full.map(|it| it.to_string()), never_read), (Some("20 ms".to_owned()), None));
}

#[test]
fn connections() {
    let db = Database::default();
    let lines = |fixture: &str| {
        let workspace = workspace(&db, fixture);
        let (project, of) = deployments(&db, workspace)[0];
        let (flat, _) = deployed(&db, project, of).unwrap();
        let hops = connections_of(&db, project, of, QUERY).iter().zip(&flat.links);
        let line = |(hop, link): (&ConnectionReport<'_>, &mauve_hir::Link<'_>)| {
            let latency = hop.latency.map_or("no bound".to_owned(), |it| it.to_string());
            let more = (hop.never_read, hop.is_stale, hop.overwritten.is_some(), hop.chain);
            format!("{}.{} {latency} {more:?}\n", link.target.0, link.target.1)
        };
        hops.map(line).collect::<String>()
    };
    expect![[r#"
        f.i 23 ms (Some(2), false, false, None)
        a.i 35 ms (None, false, false, None)
    "#]]
    .assert_eq(&lines(&format!("{PARTS}{LINE}{TIMES}")));
    // The reader has a higher priority, and the same period.
    let swapped =
        LINE.replace("priority = 2 period = 20 affinity = 2", "priority = 4 period = 10 affinity = 1");
    expect![[r#"
        f.i 15 ms (None, true, false, Some(0))
        a.i 35 ms (Some(3), false, false, Some(0))
    "#]]
    .assert_eq(&lines(&format!("{PARTS}{swapped}{TIMES}[chains.c]\nfrom = 's'\nto = 'a'\n")));
}

#[test]
fn what_is_not_analysed_has_its_reason() {
    let of = |from: &str, to: &str| format!("{PARTS}{LINE}{TIMES}").replace(from, to);
    check(
        &of("priority = 2 period = 20", "priority = background"),
        expect![[r#"
        s.o -> a.act: `f` is in the background
    "#]],
    );
    check(
        &of("  activity f { priority = 2 period = 20 affinity = 2 }\n", ""),
        expect![[r#"
        s.o -> a.act: `s` is not analysed: `f`, whose priority is unknown, may preempt it and is not analysed; `f` has no activity; `a` is not analysed: `f`, whose priority is unknown, may preempt it and is not analysed
    "#]],
    );
    check(
        &of("period = 20", "period = 1"),
        expect![[r#"
        s.o -> a.act: `f` has no bound on its response time
    "#]],
    );
    check(
        &of("check = 2\n", ""),
        expect![[r#"
        s.o -> a.act: `f` is not analysed: no time for codel `check`
    "#]],
    );
    check(
        &of("component Filter(FilterShell, FilterCore)", "include \"filter.mal\""),
        expect![[r#"
        s.o -> f.i: `f` is not analysed: the component of instance f is unknown: a file that may declare it is missing
        f.o -> a.act: `f` is not analysed: the component of instance f is unknown: a file that may declare it is missing
    "#]],
    );
    check(&of("architecture A\n", "architecture B\n"), expect![[""]]);
    check(
        &(of("architecture A\n", "architecture B\n") + "[chains.c]\nfrom = 's'\nto = 'a'\n"),
        expect![[r#"
            c: the architecture of the deployment has errors, or is unknown
        "#]],
    );
    // Data may stay in a component for ever.
    check(
        &of("write(o, check(v));", "if (check(v) > 0) then { write(o, v); } else { }"),
        expect![[r#"
        s.o -> f.check: 33 ms, age 13 ms
        s.o -> a.act: `f` may never pass the data on in update: a condition is not known
    "#]],
    );
    check(
        &of("write(o, check(v));", "if (check(v) > 0) then { write(o, v); } else { write(o, 0); }"),
        expect![[r#"
            s.o -> f.check: 33 ms, age 13 ms
            s.o -> a.act: `f` may never pass the data on in update: a condition is not known; `f` may overwrite the data before it is read: update writes a value that does not come from it
        "#]],
    );
}

#[test]
fn declared_chains() {
    let diamond = |chain: &str| robot(DIAMOND.0, DIAMOND.1, &format!("[chains.c]\n{chain}\n"));
    let first = |fixture: &str| {
        let db = Database::default();
        chains_in(&db, workspace(&db, fixture)).lines().next().unwrap_or_default().to_owned()
    };
    let mut out = String::new();
    for chain in [
        // Codels, ports and instances.
        "from = 'sense'\nto = 'b.act'",
        "from = 's.o'\nto = 'b'",
        "from = 's'\nto = 'b.i'",
        "from = 's'\nthrough = ['g']\nto = 'a'",
        "from = 's'\nthrough = ['f.o']\nto = 'a.act'",
        "from = 'f.i'\nto = 'f.o'",
        "from = 'f'\nto = 'a'",
        "from = 'b.i'\nto = 'b'",
        // What is wrong.
        "from = 's'",
        "from = 's'\nto = 'nobody'",
        "from = 's.x'\nto = 'b'",
        "from = 's'\nto = 's'",
        "from = 's'\nto = 'a'",
        "from = 's'\nto = 'act'",
        "from = 'check'\nto = 'a'",
        "from = 'a'\nto = 's'",
        "from = 'f'\nto = 'g'",
        "from = 's'\nthrough = ['f', 'g', 'f']\nto = 'a'",
        "from = 's'\nthrough = ['a']\nto = 'm'",
        "from = 's'\nto = 'b'\nwhile = ['f.Steering']",
        "from = 's'\nto = 'b'\nwhile = ['g.update']",
        "from = 's'\nto = 'b'\nwhile = ['f.update']",
        "from = 's'\nto = 'b'\nanswers = ['sens']",
        "from = 's'\nto = 'b'\nanswers = ['sense', 'f.i']",
        "from = 's'\nto = 'b'\nanswers = ['g.i']",
    ] {
        let _ = writeln!(out, "{:<55} {}", chain.replace('\n', " "), first(&diamond(chain)));
    }
    // The ports of one instance.
    for through in ["", "through = 'm.j'"] {
        let chain = format!("[chains.c]\nfrom = 's'\nto = 'a'\n{through}\n");
        let ports = robot("s: Sensor, m: Merge, a: Actuator", "s.o -> m.i, s.o -> m.j, m.o -> a.i", &chain);
        let _ = writeln!(out, "{through:<55} {}", first(&ports));
    }
    expect![[r#"
        from = 'sense' to = 'b.act'                             c: 36 ms, age 26 ms
        from = 's.o' to = 'b'                                   c: 36 ms, age 26 ms
        from = 's' to = 'b.i'                                   c: 36 ms, age 26 ms
        from = 's' through = ['g'] to = 'a'                     c: 48 ms, age 38 ms
        from = 's' through = ['f.o'] to = 'a.act'               c: 48 ms, age 38 ms
        from = 'f.i' to = 'f.o'                                 c: 12 ms, age 2 ms
        from = 'f' to = 'a'                                     c: 37 ms, age 27 ms
        from = 'b.i' to = 'b'                                   c: 13 ms, age 3 ms
        from = 's'                                              c: c: `to` is missing: write a codel, a port or an instance, such as "hokuyo.scan"
        from = 's' to = 'nobody'                                c: 'nobody': no instance or port `nobody`, and no instance calls such a codel
        from = 's.x' to = 'b'                                   c: 's.x': no instance or port `s.x`, and no instance calls such a codel
        from = 's' to = 's'                                     c: 's': it ends where it begins
        from = 's' to = 'a'                                     c: 's': several ways lead there, such as through `f.i` and `g.i`: write one in `through`
        from = 's' to = 'act'                                   c: 's': several ways lead there, such as through `m.i` and `b.i`: write one in `through`
        from = 'check' to = 'a'                                 c: 'check': `check` is called by `f` and `g`: write which, as `instance.codel`
        from = 'a' to = 's'                                     c: 's': no connections lead from `a` to `s`
        from = 'f' to = 'g'                                     c: 'g': no connections lead from `f` to `g`
        from = 's' through = ['f', 'g', 'f'] to = 'a'           c: 'g': no connections lead from `f` to `g`
        from = 's' through = ['a'] to = 'm'                     c: 'm': no connections lead from `a` to `m`
        from = 's' to = 'b' while = ['f.Steering']              c: 'f.Steering': `f` has no state `Steering`, or is not in the chain
        from = 's' to = 'b' while = ['g.update']                c: 'g.update': `g` has no state `update`, or is not in the chain
        from = 's' to = 'b' while = ['f.update']                c: 36 ms, age 26 ms
        from = 's' to = 'b' answers = ['sens']                  c: 'sens': the instances in the chain call no codel `sens`, and have no such input port
        from = 's' to = 'b' answers = ['sense', 'f.i']          c: 36 ms, age 26 ms
        from = 's' to = 'b' answers = ['g.i']                   c: 'g.i': the instances in the chain call no codel `g.i`, and have no such input port
                                                                c: 's': several ways lead there, such as through `m.i` and `m.j`: write one in `through`
        through = 'm.j'                                         c: 36 ms, age 26 ms
    "#]].assert_eq(&out);
}

#[test]
fn a_chain_goes_through_an_instance_twice_at_most_and_each_component_passes_data_on() {
    let parts = "
codel sense(out v: int): void
codel act(in v: int): void
shell S { input port i: int  output port o: int }
core BothCore(S) { var v: int; var w: int; update = { sense(v); write(o, v); read(i, w); act(w); } }
core DeafCore(S) { var v: int; update = { read(i, v); write(o, 1); } }
core FilterCore(S) { var v: int; update = { read(i, v); write(o, v); } }
component Both(S, BothCore)
component Deaf(S, DeafCore)
component Filter(S, FilterCore)
architecture A {
  instance b: Both  instance f: Filter  instance d: Deaf
  connection b.o -> f.i  connection f.o -> b.i  connection f.o -> d.i
}
deployment D {
  architecture A
  activity b { priority = 1 period = 10 affinity = 1 }
  activity f { priority = 1 period = 10 affinity = 2 }
  activity d { priority = 1 period = 10 affinity = 4 }
}
//- /times.toml
[codel]
sense = 1
act = 3
//- /mauve.toml
timing.tables = ['times.toml']
[chains]
c.from = 'sense'
c.to = 'act'
d.from = 'f'
d.to = 'd.o'
e.from = 'sense'
e.through = ['f']
e.to = 'b.act'
";
    check(
        parts,
        expect![[r#"
            c: 35.000001 ms, age 25.000001 ms
            d: 'd.o': `d` does not pass the data on: nothing that leads there depends on what it reads
            e: 35.000001 ms, age 25.000001 ms
            b.o -> d.i: 31.000002 ms, age 21.000002 ms
        "#]],
    );
    // What leads to it and what leads from it are two data.
    let through = parts
        .replace("instance d: Deaf", "instance d: Deaf  instance g: Filter  connection d.o -> g.i")
        .replace("affinity = 4 }", "affinity = 4 }\n  activity g { priority = 1 period = 10 affinity = 8 }");
    let (deployed, _) = through.split_once("c.from").expect("it has chains");
    check(
        &format!("{deployed}c.from = 'f'\nc.through = ['d']\nc.to = 'g'\n"),
        expect![[r#"
            c: 'g': `d` does not pass the data on: nothing that leads there depends on what it reads
            b.o -> d.i: 31.000002 ms, age 21.000002 ms
            d.o -> g.o: 20.000002 ms, age 10.000002 ms
        "#]],
    );
}

/// A manager reads and drives a robot, and a servo computes what it drives it to. The planner beside them is a longer loop. What the
/// manager writes comes from the robot only.
const LOOP: &str = "
codel sense(out v: int): void
codel join(in v: int, in w: int): int
codel act(in v: int): void
shell ManagerShell { input port goal: int  output port state: int }
shell ServoShell { input port state: int  input port path: int  output port goal: int }
shell PlannerShell { input port state: int  output port path: int }
core ManagerCore(ManagerShell) {
  var q: int; var g: int;
  update = { sense(q); read(goal, g); write(state, q); act(join(q, g)); }
}
core ServoCore(ServoShell) { var q: int; var p: int; update = { read(state, q); read(path, p); write(goal, join(q, p)); } }
core PlannerCore(PlannerShell) { var q: int; update = { read(state, q); write(path, q); } }
component Manager(ManagerShell, ManagerCore)
component Servo(ServoShell, ServoCore)
component Planner(PlannerShell, PlannerCore)
architecture A {
  instance cm: Manager  instance servo: Servo  instance plan: Planner
  connection cm.state -> servo.state  connection cm.state -> plan.state
  connection plan.path -> servo.path  connection servo.goal -> cm.goal
}
deployment D {
  architecture A
  activity cm { priority = 3 period = 10 affinity = 1 }
  activity servo { priority = 2 period = 20 affinity = 2 }
  activity plan { priority = 1 period = 40 affinity = 4 }
}
//- /times.toml
[codel]
sense = 1
join = 2
act = 3
//- /mauve.toml
timing.tables = ['times.toml']
[chains]
";

/// The robot moves at any instant. The next job of `cm` begins up to 10 ms later, and writes what it sees 1 ms after its begin. A job of
/// `servo` that has just read begins again 20 ms later, and writes 2 ms after its begin; one of `cm` 10 ms later, and acts 6 ms after:
/// 10 + 1 + 20 + 2 + 10 + 6 ms. Without the loop, 10 + 6 ms; with the planner, 40 ms more.
#[test]
fn a_chain_that_loops_through_one_instance() {
    let chain = |name: &str, through: &str| {
        format!("{name} = {{ from = 'sense', to = 'act', through = [{through}] }}\n")
    };
    let chains = chain("local", "")
        + &chain("react", "'servo'")
        + &chain("visits", "'cm', 'servo', 'cm'")
        + &chain("planned", "'plan'")
        + &chain("thrice", "'servo', 'cm', 'plan', 'servo', 'cm'");
    check(
        &format!("{LOOP}{chains}"),
        expect![[r#"
            local: 16 ms, age 6 ms
            planned: 89.000001 ms, age 79.000001 ms
            react: 49 ms, age 39 ms
            thrice: 'cm': `cm` does not pass the data on: nothing that leads there depends on what it reads
            visits: 49 ms, age 39 ms
            cm.state -> servo.goal: 33 ms, age 13 ms
            cm.state -> servo.goal (through plan): 73.000001 ms, age 53.000001 ms
        "#]],
    );
}

/// A guard writes literals when what it sees is dangerous, or no longer is.
const STOP: &str = "
codel look(out n: int): void
codel danger(in n: int): bool
codel drive(in halted: bool): void
shell Eye { output port seen: int }
shell Guard { input port seen: int  output port stop: bool }
shell Base { input port stop: bool }
core EyeCore(Eye) { var n: int = 0  update = { look(n); write(seen, n); } }
core GuardCore(Guard) {
  var n: int = 0
  CORE
}
core BaseCore(Base) { var h: bool = true  update = { read(stop, h); drive(h); } }
component Scanner(Eye, EyeCore)
component Monitor(Guard, GuardCore)
component Wheels(Base, BaseCore)
architecture A {
  instance front: Scanner  instance monitor: Monitor  instance wheels: Wheels
  connection front.seen -> monitor.seen  connection monitor.stop -> wheels.stop
}
deployment D {
  architecture A
  activity front { priority = 3  period = 40  cpus = [1] }
  activity monitor { priority = 2  period = 20  cpus = [2] }
  activity wheels { priority = 4  period = 10  cpus = [3] }
}
//- /mauve.toml
assume.codel = '1 ms'
[chains.stop]
from = 'look'
to = 'drive'
";

fn stops(core: &str) -> String {
    let db = Database::default();
    let all = chains_in(&db, workspace(&db, &STOP.replace("CORE", core)));
    all.lines().next().unwrap().to_owned()
}

/// `look` has just returned when the danger begins: 40 ms, and 1 ms until the write. `monitor` has just read: 20 ms, and it decides after
/// 1 ms of `danger`, or 2 ms with both guards. `wheels` has just read: 10 ms, and 1 ms.
#[test]
fn a_decision_is_carried_by_what_it_lets_write() {
    let machine = "statemachine {
        initial state Clear { entry = { write(stop, false); } run = { read(seen, n); }  transition bad if danger(n) to Stopped }
        state Stopped { entry = { write(stop, true); } run = { read(seen, n); }  transition good if !danger(n) to Clear }
      }";
    assert_eq!(stops(machine), "stop: 73 ms, age —");
    // The decision lasts in the state that it led to, which writes a period later and does not wait for `danger`: 40 + 1 + 2 · 20 + 10 + 1.
    let runs = "statemachine {
        initial state Clear { run = { read(seen, n); write(stop, false); }  transition bad if danger(n) to Stopped }
        state Stopped { run = { read(seen, n); write(stop, true); }  transition good if !danger(n) to Clear }
      }";
    expect!["stop: 92.000001 ms, age —"].assert_eq(&stops(runs));
    let branch = |then: &str| format!("update = {{ read(seen, n); if danger(n) {then} }}");
    for both in [
        "then { write(stop, true); } else { write(stop, false); }",
        "then { write(stop, true); } else { }",
        "then { } else { write(stop, false); }",
        "then { write(stop, true); return; } else { } write(stop, false);",
    ] {
        assert_eq!(stops(&branch(both)), "stop: 73 ms, age —", "{both}");
    }
    // What is written in any case, or decided by others, is no decision.
    let nothing = "stop: 'drive': `monitor` does not pass the data on: nothing that leads there depends on what it reads";
    for other in [
        branch("then { n = 1; } else { n = 2; } write(stop, true);"),
        branch("then { n = 1; } else { } if danger(2) then { write(stop, true); } else { }"),
        machine.replace("danger(n)", "danger(1)"),
    ] {
        assert_eq!(stops(&other), nothing, "{other}");
    }
    // The danger may not be enough, and a transition that it does not decide may lead back.
    for (other, expected) in [
        (
            branch("then { if danger(1) then { write(stop, true); } else { } } else { }"),
            expect!["stop: `monitor` may never pass the data on in update: `danger` may not return `true`"],
        ),
        (
            machine.replace("if danger(n)", "if danger(n) && danger(1)"),
            expect!["stop: `monitor` may never pass the data on in Clear: `danger` may not return `true`"],
        ),
        (
            machine.replace("to Clear", "to Clear  transition time if danger(1) to Clear"),
            expect![
                "stop: `monitor` may never pass the data on in Stopped: `danger` may not return `true`; `monitor` may overwrite the data before it is read: Clear.entry writes a value that does not come from it"
            ],
        ),
        (
            machine.replace(
                "to Stopped }",
                "to Asking }  state Asking { transition sure if danger(1) to Stopped }",
            ),
            expect![
                "stop: `monitor` may never pass the data on in Asking: `danger` may not return `true`; `monitor` may overwrite the data before it is read: Stopped.entry writes a value that does not come from it"
            ],
        ),
    ] {
        expected.assert_eq(&stops(&other));
    }
}

#[test]
fn each_deployment_has_the_chains_whose_names_it_has() {
    let two = "
architecture B { instance t: Sensor  instance a: Actuator  connection t.o -> a.i }
deployment E { architecture B  activity t { priority = 1 period = 10 affinity = 1 }  activity a { priority = 1 period = 20 affinity = 2 } }
";
    let chains = "[chains]\none = { from = 's.o', to = 'a.i' }\nboth = { from = 'nowhere.o', to = 'a.i' }\n\
                  two = { from = 't.o', to = 'a.i' }\n";
    check(
        &format!("{PARTS}{LINE}{two}{TIMES}{chains}"),
        expect![[r#"
            D:
            both: 'nowhere.o': no instance or port `nowhere.o`, and no instance calls such a codel
            one: 66 ms, age 36 ms
            s.o -> a.act: 66 ms, age 36 ms
            E:
            both: 'nowhere.o': no instance or port `nowhere.o`, and no instance calls such a codel
            two: 34 ms, age 14 ms
            t.o -> a.act: 34 ms, age 14 ms
        "#]],
    );
}

#[test]
fn of_too_many_ways_the_shortest_are_kept() {
    // Fourteen layers of two components: 2^14 ways to each actuator.
    let mut instances = vec!["s: Sensor".to_owned()];
    let mut links = vec!["s.o -> f0.i".to_owned(), "s.o -> g0.i".to_owned(), "f0.o -> c.i".to_owned()];
    for layer in 0..15 {
        instances.extend(["f", "g"].map(|it| format!("{it}{layer}: Merge")));
        for (from, to) in
            [("f", "f.i"), ("f", "g.i"), ("g", "f.j"), ("g", "g.j")].into_iter().filter(|_| layer < 14)
        {
            links.push(format!("{from}{layer}.o -> {}", to.replace('.', &format!("{}.", layer + 1))));
        }
    }
    instances.extend(["a", "b", "c"].map(|it| format!("{it}: Actuator")));
    links.extend(["f14.o -> a.i", "g14.o -> b.i"].map(str::to_owned));
    let db = Database::default();
    let workspace = workspace(&db, &robot(&instances.join(", "), &links.join(", "), ""));
    let (project, of) = deployments(&db, workspace)[0];
    let found = chains_of(&db, project, of, QUERY);
    let chains: Vec<(&str, usize)> = found.all.iter().map(|it| (it.name.as_str(), it.steps.len())).collect();
    assert_eq!(chains, [("s.o -> c.act", 3), ("s.o -> a.act", 17), ("s.o -> b.act", 17)]);
    assert!(found.left_out > 9_000, "{}", found.left_out);
}

#[test]
fn operations_pass_data_on() {
    let fixture = "
codel sense(out v: int): void
codel act(in v: int): void
shell Asking { require go(in v: int): void }
shell Serving { provide go(in v: int): void }
core AskingCore(Asking) { var v: int; update = { sense(v); send(go, v); } }
core ServingCore(Serving) { provide go(in v: int) = { act(v); } update = { } }
component Asks(Asking, AskingCore)
component Serves(Serving, ServingCore)
architecture A { instance c: Asks  instance p: Serves  operation p.go -> c.go }
deployment D {
  architecture A
  activity c { priority = 1 period = 10 affinity = 1 }
  activity p { priority = 1 period = 20 affinity = 2 }
}
//- /times.toml
[codel]
sense = 1
act = 3
//- /mauve.toml
timing.tables = ['times.toml']
";
    check(
        fixture,
        expect![[r#"
        c.go -> p.go: 40 ms, age 20 ms
    "#]],
    );
}

/// The sample with something else in place of the states and answers of its chain in `mauve.toml`.
fn sample_with(assumed: &str) -> Vec<(PathBuf, String)> {
    let mut texts = sample();
    for (path, text) in &mut texts {
        if path.ends_with("mauve.toml") {
            let (before, _) = text.split_once("while = ").unwrap();
            *text = format!("{before}{assumed}");
        }
    }
    texts
}

#[test]
fn the_sample_avoids_obstacles() {
    let first = |more: &str| {
        let db = Database::default();
        let texts = sample_with(more);
        let root = texts[0].0.ancestors().find(|it| it.ends_with("p3dx")).unwrap().to_owned();
        chains_in(&db, Workspace::of_texts(&db, root, texts)).lines().next().unwrap().to_owned()
    };
    let states = "while = ['guidance.Steering', 'switch.Automatic']\nanswers = 'drivers.hokuyo_sweep'\n";
    expect!["avoid: 526 ms, age 426 ms"].assert_eq(&first(states));
    let all = "['hokuyo', 'guidance', 'switch', 'p3dx_driver']";
    expect!["avoid: 310 ms, age 210 ms"]
        .assert_eq(&first(&format!("{states}[clocks]\nsynchronised = {all}\n")));
    expect!["avoid: `hokuyo` may never pass the data on in update: `drivers.hokuyo_sweep` may not return `true`; `guidance` may never pass the data on in Waiting, Steering: a condition is not known; `guidance` may overwrite the data before it is read: Waiting.entry writes a value that does not come from it; `switch` may never pass the data on in Manual: `scan` may have no new data; `switch` may overwrite the data before it is read: Automatic.take_over.effect writes a value that does not come from it"].assert_eq(&first(""));
}

/// How often the queries about chains are executed when `from` becomes `to` in the first file.
fn executed(from: &str, to: &str) -> Vec<(String, usize)> {
    let mut db = Database::with_log();
    let workspace = workspace(&db, &format!("{PARTS}{LINE}{TIMES}[chains.c]\nfrom = 's'\nto = 'a'\n"));
    chains_in(&db, workspace);
    let file = workspace.file(&db, "/model.mal".as_ref()).unwrap();
    let old = file.text(&db).to_string();
    assert!(old.contains(from), "{from}");
    db.take_log();
    file.set_text(&mut db, old.replacen(from, to, 1).into());
    chains_in(&db, workspace);
    let of_chains = [
        "chains_of",
        "connections_of",
        "declared_chains",
        "flows_of",
        "hops_of",
        "passages_of",
        "ways_of",
        "write_costs",
    ];
    let log = db.take_log().executed;
    let count = |query: &str| (query.to_owned(), log.iter().filter(|it| *it == query).count());
    of_chains.into_iter().map(count).filter(|(_, count)| *count > 0).collect()
}

/// The bound that the page on chains has for a sensor that falls silent is attained by the worst phase of a guard that counts silent jobs, and
/// of a leg that halts, each on a CPU of its own.
#[test]
fn a_silent_sensor_halts_the_robot_in_the_time_of_the_page() {
    let fixture = |buffer: u64| {
        format!(
            "
codel look(out n: int): void
codel judge(in n: int, in is_silent: bool): int
codel drive(in n: int): void
shell EyeShell {{ output port seen: int }}
shell GuardShell {{ input port seen: int  output port goal: int }}
shell LegShell {{ input port goal: int }}
core EyeCore(EyeShell) {{ var n: int = 0  update = {{ look(n); write(seen, n); }} }}
core GuardCore(GuardShell) {{ var n: int = 0; var age: int = 5
  update = {{
    if read(seen, n) == new_data then {{ age = 0; }} else {{ if age < 5 then {{ age = age + 1; }} else {{ }} }}
    write(goal, judge(n, age == 5));
  }}
}}
core LegCore(LegShell) {{ var n: int = 0  update = {{ read(goal, n); drive(n); }} }}
component Eye(EyeShell, EyeCore)
component Guard(GuardShell, GuardCore)
component Leg(LegShell, LegCore)
architecture A {{ instance eye: Eye  instance guard: Guard  instance leg: Leg
  connection eye.seen -> [{buffer}] guard.seen
  connection guard.goal -> leg.goal
}}
deployment D {{
  architecture A
  activity eye   {{ affinity = 1  priority = 1  period = 4 }}
  activity guard {{ affinity = 2  priority = 1  period = 4 }}
  activity leg   {{ affinity = 4  priority = 1  period = 6 }}
}}
//- /times.toml
[codel]
look = 1
judge = 2
drive = 3
//- /mauve.toml
timing.tables = ['times.toml']
[chains.stop]
from = 'judge'
to = 'drive'
"
        )
        .replace("[1] ", "")
    };
    for buffer in 1..=2 {
        let db = Database::default();
        let workspace = workspace(&db, &fixture(buffer));
        let (project, decl) = deployments(&db, workspace)[0];
        let found = chains_of(&db, project, decl, QUERY);
        let stop = found.all.iter().find(|it| it.name == "stop").expect("it is declared");
        let (limit, latency) = (5, stop.latency.expect("each job passes the flag on").as_nanos() / 1_000_000);
        let all = (0..=2).flat_map(|judge| (0..6).map(move |phase| halts_after(limit, buffer, judge, phase)));
        assert_eq!(all.max(), Some((limit + buffer - 1) * 4 + latency));
    }
}

/// The most time from the last scan, just after the guard has read, to the end of `drive` with the flag.
fn halts_after(limit: u64, buffer: u64, judge: u64, phase: u64) -> u64 {
    let (mut waiting, mut age, mut job) = (buffer, 0, 0);
    while age < limit {
        job += 1;
        if waiting > 0 {
            (waiting, age) = (waiting - 1, 0);
        } else {
            age += 1;
        }
    }
    let written = job * 4 + judge;
    // A leg that reads at the instant of the write may miss it.
    let read = (0..).map(|it| phase + it * 6).find(|read| *read > written).expect("it reads for ever");
    read + 3
}

#[test]
fn an_edit_of_a_period_computes_only_the_sums_again() {
    let expected =
        |all: &[(&str, usize)]| all.iter().map(|(it, count)| ((*it).to_owned(), *count)).collect::<Vec<_>>();
    let sums = [("chains_of", 1), ("connections_of", 1)];
    assert_eq!(executed("period = 20", "period = 15"), expected(&sums));
    assert_eq!(executed("architecture A {", "// a comment\narchitecture A {"), []);
    assert_eq!(
        executed("update = { read(i, v); act(v); }", "update = { read(i, v); /* a comment */ act(v); }"),
        []
    );
    // Another program: the passages of its core, and what uses them.
    let core = [("flows_of", 1), ("hops_of", 1), ("passages_of", 1), ("ways_of", 1), ("write_costs", 1)];
    let all = executed("write(o, check(v));", "write(o, check(v)); check(v);");
    assert!(core.iter().all(|it| all.contains(&(it.0.to_owned(), it.1))), "{all:?}");
}
