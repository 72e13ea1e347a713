//! Random components that count and switch modes are walked by an interpreter that knows nothing of the analyser, from each
//! reachable value of their variables: each step is an edge of the state machine with values, which costs no less; and no edge
//! costs more than without values.
//!
//! `MAUVE_PRODUCTS` is the number of components.

use std::collections::BTreeSet;

use expect_test::{Expect, expect};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_tests::machines::{Library, Times, Walk, WalkStep, counting, edges, walk};
use mauve_tests::search;
use mauve_timing::{StateMachine, Time};
use mauve_wcrt::{Psm, first_tables, psm_of};

use crate::common::{LEVEL, verdicts, workspace};

const TABLES: &str = "
codel sense(): bool
codel plan(): void
codel move(): void
codel pick(out it: int): void
shell S { provide reset(): void  property limit: int = 3  input port source: int }
component C(S, K)
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
sense = 1
plan = 10
move = 2
pick = 3
";

/// A line for each edge of the machine of a core with values: where periods begin and end, and what they cost at most.
fn edges_of(core: &str) -> String {
    let core = match core.contains("provide reset") {
        true => core.to_owned(),
        false => core.replacen('{', "{ provide reset() = { }", 1),
    };
    let db = Database::default();
    let signature =
        core.split("provide reset").nth(1).and_then(|it| it.split(" = {").next()).expect("it has one");
    let result = if signature.contains("): ") { "" } else { ": void" };
    let tables = TABLES.replace("reset(): void", &format!("reset{signature}{result}"));
    let workspace = workspace(&db, &format!("core K(S) {core}{tables}"));
    let project = projects(&db, workspace)[0];
    let of = names_of(&db, project).anywhere(Kind::Component, "C")[0];
    let psm = psm_of(&db, first_tables(&db, project, of), of, LEVEL).as_ref().unwrap();
    let name = |state: u32| psm.state_with_values(state as usize);
    let edges = psm.machine.edges().iter();
    edges.map(|edge| format!("{} → {}: {}\n", name(edge.source), name(edge.target), edge.cost)).collect()
}

fn check(core: &str, expected: Expect) {
    expected.assert_eq(&edges_of(core));
}

#[test]
fn a_counter_plans_in_every_third_period() {
    check(
        "{ var left: int = 0  update = { move(); if left == 0 then { plan(); left = 2; } else { left = left - 1; } } }",
        expect![[r#"
            update (left = 0) → update (left = 2): 12 ms
            update (left = 2) → update (left = 1): 2 ms
            update (left = 1) → update (left = 0): 2 ms
        "#]],
    );
}

#[test]
fn a_robot_with_a_counter_keeps_its_deadlines() {
    let robot = "core K(S) { var left: int = 1  provide reset() = { }
  update = { move(); if left > 0 then { left = left - 1; } else { plan(); left = 9; } } }
core L(T) { update = { plan(); plan(); } }
shell T { }
component Low(T, L)
architecture A { instance fast: C  instance slow: Low }
deployment D { architecture A
  activity fast { priority = 2  period = 12  affinity = 1 }
  activity slow { priority = 1  period = 60  affinity = 1 } }";
    expect![[r#"
        fast met 12 ms
        slow met 36 ms
    "#]]
    .assert_eq(&verdicts(&format!("{robot}{TABLES}")));
}

#[test]
fn a_mode_excludes_the_branches_of_others() {
    check(
        "{ statemachine { var busy: bool = false
          initial state Idle { run = { if sense() && busy then { plan(); } busy = false; }  transition go to Work { busy = true; } }
          state Work { run = { if busy then { move(); } else { plan(); } }  transition back if !busy || sense() to Idle } } }",
        expect![[r#"
            Idle (busy = false) → Work (busy = true): 1 ms
            Work (busy = true) → Idle (busy = true): 3 ms
            Work (busy = true) → Work (busy = true): 3 ms
            Idle (busy = true) → Work (busy = true): 11 ms
        "#]],
    );
}

#[test]
fn a_program_of_too_many_variables_follows_none() {
    let names: Vec<String> = (0..140).map(|it| format!("v{it}")).collect();
    let declared: String = names.iter().map(|it| format!("var {it}: bool = false ")).collect();
    let toggled =
        |it: &String| format!("if {it} then {{ move(); {it} = false; }} else {{ plan(); {it} = true; }} ");
    let program: String = names.iter().map(toggled).collect();
    check(
        &format!("{{ {declared} update = {{ {program} }} }}"),
        expect![[r#"
        update → update: 1400 ms
    "#]],
    );
}

#[test]
fn a_program_of_too_many_calls_costs_all_of_them() {
    let count = 70;
    let provided: String = (0..count).map(|it| format!("provide f{it}(): void ")).collect();
    let calls = |it: usize| if it + 1 == count { "plan()".to_owned() } else { format!("f{}()", it + 1) };
    let operations: String =
        (0..count).map(|it| format!("provide f{it}() = {{ {}; }} ", calls(it))).collect();
    let model = format!(
        "codel plan(): void\nshell S {{ {provided} }}\ncomponent C(S, K)\n
         core K(S) {{ var busy: bool = true {operations}
           update = {{ if busy then {{ busy = true; }} else {{ return; }} f0(); }} }}
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
plan = 10
"
    );
    expect![[r#"
        update stay update: 10 ms
    "#]]
    .assert_eq(&crate::common::machine(&model, "C"));
}

#[test]
fn what_others_give_is_any_value() {
    // A codel, a port and a property.
    check(
        "{ var n: int = 1  update = { if n == 1 then { plan(); } n = 2; pick(n); } }",
        expect![[r#"
        update (n = 1) → update: 13 ms
        update → update: 13 ms
    "#]],
    );
    check(
        "{ var n: int = 1  update = { if n == 1 then { plan(); } n = 2; read(source, n); } }",
        expect![[r#"
        update (n = 1) → update: 10 ms
        update → update: 10 ms
    "#]],
    );
    check(
        "{ var n: int = 1  update = { if n == 1 then { plan(); } n = 2; if sense() then { n = limit; } } }",
        expect![[r#"
            update (n = 1) → update: 11 ms
            update (n = 1) → update (n = 2): 11 ms
            update → update: 11 ms
            update → update (n = 2): 11 ms
            update (n = 2) → update: 1 ms
            update (n = 2) → update (n = 2): 1 ms
        "#]],
    );
    // Clients call the operation between two periods, and the core itself during one.
    let operation = "provide reset() = { n = 1; }";
    check(
        &format!(
            "{{ var n: int = 2  {operation}  update = {{ if n == 1 then {{ plan(); }} n = 2; if n == 1 then {{ move(); }} }} }}"
        ),
        expect![[r#"
            update → update: 10 ms
        "#]],
    );
    check(
        &format!(
            "{{ var n: int = 2  {operation}  update = {{ n = 3; reset(); if n == 3 then {{ plan(); }} }} }}"
        ),
        expect![[r#"
            update → update: 0 ms
        "#]],
    );
}

#[test]
fn a_restart_keeps_the_variables_of_the_core() {
    check(
        "{ var n: int = 0  stop = { n = 7; }  statemachine { var m: int = 1
          initial state Idle { run = { if n == 7 then { plan(); } else if m == 1 then { move(); } }  transition go to On { n = 5; m = 2; } }
          state On { run = { if m == 1 then { plan(); } } } } }",
        expect![[r#"
            Idle (n = 0, m = 1) → On (n = 5, m = 2): 2 ms
            On (n = 5, m = 2) → On (n = 5, m = 2): 0 ms
            Idle (n = 7, m = 1) → On (n = 5, m = 2): 10 ms
        "#]],
    );
    // A start resets what has no initial value, or keeps it.
    check(
        "{ configure = { m = 1; }  statemachine { var m: int
          initial state Idle { run = { if m == 1 then { plan(); } else { move(); } m = 1; } } } }",
        expect![[r#"
            Idle → Idle (m = 1): 10 ms
            Idle (m = 1) → Idle (m = 1): 10 ms
        "#]],
    );
}

#[test]
fn hooks_set_values_also_those_that_fail() {
    check(
        "{ var n: int = 0  configure = { n = 4; }  update = { if n == 4 then { plan(); } n = 1; } }",
        expect![[r#"
            update (n = 4) → update (n = 1): 10 ms
            update (n = 1) → update (n = 1): 0 ms
        "#]],
    );
    // The second start, after one that fails.
    check(
        "{ var n: int = 0  var m: int = 0  start = { n = n + 1; }  statemachine { initial state Idle {
          entry = { if n == 2 then { m = 1; } n = 0; }  run = { if m == 1 then { plan(); } } } } }",
        expect![[r#"
            Idle (m = 0) → Idle (m = 0): 0 ms
            Idle (m = 1) → Idle (m = 1): 10 ms
        "#]],
    );
}

#[test]
fn an_operation_sets_the_variables_of_its_caller() {
    check(
        "{ var n: int = 0  provide reset(out it: int) = { it = 3; }  update = { if n == 3 then { plan(); } reset(n); } }",
        expect![[r#"
            update (n = 0) → update (n = 3): 0 ms
            update (n = 3) → update (n = 3): 10 ms
        "#]],
    );
}

#[test]
fn a_number_that_an_operation_has_as_a_double_is_no_int() {
    // Half of it is 1.5.
    for (operation, half) in [
        ("provide reset(in it: double) = { if it / 2 == 1 then { move(); } else { plan(); } }", "reset(n);"),
        ("provide reset(): double = { return n; }", "if reset() / 2 == 1 then { move(); } else { plan(); }"),
    ] {
        let update = format!("update = {{ if n == 3 then {{ n = 3; }} {half} }}");
        let edges = edges_of(&format!("{{ var n: int = 3  {operation}  {update} }}"));
        assert_eq!(edges, "update → update: 10 ms\n", "{operation}");
    }
    let edges = edges_of(
        "{ var d: double = 3  var n: int = 0  update = { if n == 0 then { n = 0; }
        if d / 2 == 1 then { move(); } else { plan(); } d = 3; } }",
    );
    assert_eq!(edges, "update → update: 10 ms\n");
}

#[test]
fn an_integer_that_overflows_has_any_value() {
    check(
        "{ var n: int = 2147483646  update = { if n < 0 then { plan(); n = 2147483646; } else { n = n + 1; } } }",
        expect![[r#"
            update (n = 2147483646) → update (n = 2147483647): 0 ms
            update (n = 2147483647) → update: 0 ms
            update → update (n = 2147483646): 10 ms
            update → update: 0 ms
        "#]],
    );
}

#[test]
fn a_counter_without_a_limit_has_any_value_far_from_the_numbers_of_the_text() {
    let edges = edges_of(
        "{ var seen: int = 0  update = { if sense() then { seen = 0; } else { seen = seen + 1; } if seen == 0 then { plan(); } } }",
    );
    let last: Vec<&str> = edges.lines().rev().take(4).collect();
    assert_eq!(edges.lines().count(), 16);
    expect![[r#"
        [
            "update → update: 1 ms",
            "update → update (seen = 0): 11 ms",
            "update (seen = 6) → update: 1 ms",
            "update (seen = 6) → update (seen = 0): 11 ms",
        ]
    "#]]
    .assert_debug_eq(&last);
    // A product, and an initial value, are numbers of the text.
    for core in [
        "{ var n: int = 0  update = { if n < 10 * 20 then { n = n + 1; } else { n = 0; plan(); } } }",
        "{ var n: int = 200  update = { if n > 0 then { n = n - 1; } else { reset(); } } provide reset() = { plan(); } }",
    ] {
        assert_eq!(edges_of(core).lines().count(), 201, "{core}");
    }
}

#[test]
fn beyond_the_limit_the_variable_of_most_values_has_any() {
    let edges = edges_of(
        "{ var n: int = 0  var mode: bool = false
          update = { if n < 100000 then { n = n + 1; } else { n = 0; } mode = !mode; if mode then { plan(); } } }",
    );
    expect![[r#"
        update (mode = false) → update (mode = true): 10 ms
        update (mode = true) → update (mode = false): 0 ms
    "#]]
    .assert_eq(&edges);
    // 4,000 values are followed.
    let edges =
        edges_of("{ var n: int = 0  update = { if n < 3999 then { n = n + 1; } else { n = 0; plan(); } } }");
    assert_eq!(edges.lines().count(), 4000);
}

#[test]
fn a_table_with_the_time_of_a_program_has_that_of_all_its_paths() {
    let core = "core K(S) { var n: int = 0  provide reset() = { }  update = { if n == 0 then { plan(); n = 1; } else { n = 0; } } }";
    let tables = format!("{}[program]\n\"C/update\" = 4\n", TABLES.replace("plan = 10\n", ""));
    expect![[r#"
        update stay update: 4 ms
    "#]]
    .assert_eq(&crate::common::machine(&format!("{core}{tables}"), "C"));
}

/// Whether a state of the machine stands for a place.
fn is_at(psm: &Psm<'_>, number: usize, (state, values): &(String, Vec<(String, String)>)) -> bool {
    let (own, known) = (psm.text_state(number), psm.values_in(number));
    let mut known = known.split(", ").filter(|it| !it.is_empty());
    psm.state(own) == state
        && known.all(|it| {
            let (name, value) = it.split_once(" = ").unwrap();
            values.iter().any(|(other, it)| other == name && it == value)
        })
}

/// Returns the first step that no edge covers, with the states that the machine may be in before.
fn uncovered<'a>(psm: &Psm<'_>, walk: &'a Walk) -> Option<(&'a WalkStep, String)> {
    let at = |place: usize| {
        let all = 0..psm.machine.states() as usize;
        all.filter(move |number| is_at(psm, *number, &walk.places[place])).map(move |it| (place, it))
    };
    let mut open: Vec<(usize, usize)> = walk.starts.iter().flat_map(|place| at(*place)).collect();
    let mut seen: BTreeSet<(usize, usize)> = open.iter().copied().collect();
    while let Some((place, number)) = open.pop() {
        for step in walk.steps.iter().filter(|step| step.source == place) {
            let covers = |index: usize, edge: &mauve_timing::Edge| {
                let of_text = &psm.edges.all[psm.text_edge(index).unwrap()];
                let name = of_text.transition.as_ref().map_or("stay", |name| name.as_str());
                edge.source as usize == number
                    && step.transition.as_deref() == Some(name)
                    && edge.cost >= Time::from_nanos(step.cost * 1_000_000)
                    && is_at(psm, edge.target as usize, &walk.places[step.target])
            };
            let edges = psm.machine.edges().iter().enumerate().filter(|(index, edge)| covers(*index, edge));
            let mut after: Vec<usize> = edges.map(|(_, edge)| edge.target as usize).collect();
            // A call between two periods changes nothing that is known.
            if step.transition.is_none() && is_at(psm, number, &walk.places[step.target]) {
                after.push(number);
            }
            if after.is_empty() {
                return Some((step, psm.state_with_values(number)));
            }
            for next in after.into_iter().map(|number| (step.target, number)) {
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
    }
    None
}

/// Returns the machine where each condition on a variable may hold or not; none where there are too many paths.
fn free(psm: &Psm<'_>, library: &Library, times: &Times) -> Option<StateMachine> {
    let costs = edges(library, &library.components[0], times)?;
    let edge = |edge: &mauve_hir::PeriodEdge| {
        let name = edge.transition.as_ref().map_or("stay", |name| name.as_str());
        let key = format!("{} {name} {}", psm.state(edge.source), psm.state(edge.target));
        let cost = Time::from_nanos(costs[&key] * 1_000_000);
        mauve_timing::Edge { source: edge.source as u32, target: edge.target as u32, cost }
    };
    StateMachine::new(psm.states.len() as u32, psm.edges.all.iter().map(edge).collect()).ok()
}

fn mean(machine: &StateMachine) -> f64 {
    let mean = machine.greatest_cycle_mean();
    mean.cost.as_nanos() as f64 / mean.length as f64
}

#[test]
fn each_step_of_a_random_component_is_an_edge_that_costs_no_less() {
    let seeds = search::seeds("MAUVE_PRODUCTS", 200);
    let count = seeds.end - seeds.start;
    let (mut followed, mut steps, mut refused, mut ratios) = (0, 0, 0, Vec::new());
    for seed in seeds {
        let (library, times, model) = counting(seed);
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), model.texts());
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Component, "K")[0];
        let tables = first_tables(&db, project, of);
        let text = || model.texts().into_iter().map(|(_, text)| text).collect::<String>();
        let psm = match psm_of(&db, tables, of, LEVEL) {
            Ok(psm) => psm,
            Err(_) => {
                refused += 1;
                continue;
            }
        };
        let free = free(psm, &library, &times);
        for (time, free) in psm.longest_times().zip(free.iter().flat_map(StateMachine::edges)) {
            assert!(time.is_none_or(|time| time <= free.cost), "seed {seed}\n{}", text());
        }
        let found = walk(&library, &library.components[0], &times, (seed % 3) as i64);
        steps += found.steps.len();
        if let Some((step, state)) = uncovered(psm, &found) {
            let (before, after) = (&found.places[step.source], &found.places[step.target]);
            panic!("seed {seed}, {state}: {step:?} from {before:?} to {after:?}\n{}", text());
        }
        followed += usize::from(psm.has_values());
        if let Some(free) = free.filter(|it| psm.has_values() && mean(it) > 0.0) {
            ratios.push(mean(&psm.machine) / mean(&free));
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (sum, middle) = (ratios.iter().sum::<f64>(), ratios[ratios.len() / 2]);
    let tighter = ratios.iter().filter(|it| **it < 0.999).count();
    println!(
        "{count} components, {refused} refused, {followed} with values, {tighter} of them with a lower utilisation; \
         mean ratio {:.3}, median {middle:.3}, least {:.3}; {steps} steps",
        sum / ratios.len() as f64,
        ratios[0]
    );
    assert!(
        followed as u64 * 2 > count && refused as u64 * 20 <= count && tighter * 5 > followed,
        "{followed} {refused} {tighter}"
    );
    assert!(ratios.iter().all(|it| *it <= 1.000_001));
}
