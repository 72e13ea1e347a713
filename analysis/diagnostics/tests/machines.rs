//! From cores to periodic state machines: which programs each edge executes, and what they cost.

use expect_test::{Expect, expect};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, behaviour_of, names_of, projects};
use mauve_wcrt::{first_tables, worst_path};

use crate::common::{LEVEL, machine, workspace};

const CODELS: &str = "
codel one(): int
codel two(): int
codel four(): int
codel eight(): int
codel big(): int
shell S { require ask(): int  input port in1: int  property p: int = 1 }
component C(S, K)
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
one = 1
two = 2
four = 4
eight = 8
big = 16
";

fn check(core: &str, expected: Expect) {
    expected.assert_eq(&machine(&format!("{core}{CODELS}"), "C"));
}

/// [`CODELS`], with a shell that provides these operations.
fn providing(operations: &str) -> String {
    CODELS.replace("shell S {", &format!("shell S {{ {operations}"))
}

fn check_providing(operations: &str, core: &str, expected: Expect) {
    expected.assert_eq(&machine(&format!("{core}{}", providing(operations)), "C"));
}

const HELP: &str = "provide help(): void ";
const HELP_AND_MORE: &str = "provide help(): void  provide more(): void ";

#[test]
fn an_update_is_one_state() {
    check(
        "core K(S) { configure = { big(); } start = { big(); } update = { one(); two(); } stop = { big(); } }",
        expect![[r#"
        update stay update: 3 ms
    "#]],
    );
}

#[test]
fn the_greater_branch_and_both_sides_of_logic_count() {
    check(
        "core K(S) { var v: int = big(); update = {
           if (one() > 0 && two() > 0 || four() > 0) then { eight(); } else if eight() == 1 then { one(); } else { }
           var local: int = one() + two();
           { one(); }
           v = two();
           four();
         } }",
        // 7 + max(8, 8 + 1) + 3 + 1 + 2 + 4; the variable of the core is set once, at the start.
        expect![[r#"
            update stay update: 26 ms
        "#]],
    );
}

#[test]
fn each_of_many_returns_excludes_what_is_after_it() {
    let returns = "if one() > 1 then { big(); return; } ".repeat(100);
    check(
        &format!("core K(S) {{ update = {{ {returns} }} }}"),
        expect![[r#"
        update stay update: 116 ms
    "#]],
    );
}

#[test]
fn a_transition_pays_for_the_guards_before_it() {
    check(
        "core K(S) { statemachine {
           initial state A {
             entry = { big(); } run = { one(); } handle = { two(); } exit = { four(); }
             transition t if one() > 0 to B { eight(); }
             transition u if two() > 0 to B
           }
           state B { entry = { one(); }  transition back to A { one(); } }
         } }",
        expect![[r#"
            A t B: 15 ms
            A u B: 9 ms
            A stay A: 6 ms
            B back A: 17 ms
        "#]],
    );
}

#[test]
fn a_self_transition_leaves_and_enters() {
    check(
        "core K(S) { statemachine {
           initial state A {
             entry = { big(); } run = { one(); } handle = { two(); } exit = { four(); }
             transition again if one() > 0 to A { eight(); }
           }
         } }",
        expect![[r#"
            A again A: 30 ms
            A stay A: 4 ms
        "#]],
    );
}

#[test]
fn nothing_happens_after_a_transition_without_a_guard() {
    check(
        "core K(S) { statemachine {
           initial state A { handle = { big(); }  transition t to B  transition u if one() > 0 to C { eight(); } }
           state B { transition back to A }
           state C { run = { big(); } }
         } }",
        // Nor is C ever reached.
        expect![[r#"
            A t B: 0 ms
            B back A: 0 ms
        "#]],
    );
}

#[test]
fn ones_own_operations_cost_what_they_do_each_time() {
    check_providing(
        HELP_AND_MORE,
        "core K(S) {
           provide help() = { two(); more(); }
           provide more() = { one(); }
           var x: int
           update = { help(); help(); read(in1, x); }
         }",
        expect![[r#"
            update stay update: 6 ms
        "#]],
    );
}

#[test]
fn what_has_no_bound_or_no_meaning_is_refused() {
    check_providing(
        HELP_AND_MORE,
        "core K(S) { provide help() = { more(); } provide more() = { help(); } update = { one(); } }",
        expect![[r#"
            refused: `help` calls itself: its execution time has no bound
            refused: `more` calls itself: its execution time has no bound
        "#]],
    );
    check(
        "core K(S) { update = { ask(); } }",
        expect![[r#"
            refused: `ask` is an operation of another component, and a direct call would wait for it: use `send` and `collect`
        "#]],
    );
    check_providing(
        HELP,
        "core K(S) { var one: int = 0; update = { one(); in1(); p(); eigth(); help(); } }",
        expect![[r#"
            refused: `one` is a variable here, which hides the codel of that name: rename one of them
            refused: `in1` is a port: only codels and operations are called
            refused: `p` is a property: only codels and operations are called
            refused: no codel or operation `eigth`; did you mean `eight`?
            refused: core K: it does not define the operation `help`, and calls it
        "#]],
    );
    check(
        "core K(S) { statemachine { initial state A { transition t to B } } }",
        expect![[r#"
        refused: no state `B` in this state machine
    "#]],
    );
    check(
        "core K(S) { statemachine { initial state A { } state A { run = { one(); } } } }",
        expect![[r#"
            refused: state `A` is defined twice: rename or remove one of them
        "#]],
    );
    check(
        "core K(S) { update = { one(); } update = { big(); } }",
        expect![[r#"
            refused: a second `update`: merge the two programs
        "#]],
    );
    check(
        "core K(S) { update = { one(); } statemachine { initial state A { } } }",
        expect![[r#"
            refused: this core has both `update` and `statemachine`: only one of them can be executed each period
        "#]],
    );
}

#[test]
fn a_syntax_error_costs_the_component_only_where_a_period_rests_on_it() {
    check(
        "core K(S) { var v: = 3 update = { one(); } }",
        expect![[r#"
        update stay update: 1 ms
    "#]],
    );
    for broken in [
        // A hook that is not closed may have swallowed what a period executes.
        "core K(S) { stop = { one(; update = { big(); } } update = { one(); } }",
        "core K(S) { update = { one(; } }",
        "core K(S) { update = { one() } }",
        "core K(S) { update = { one();",
        "core K(S) { update { one(); } }",
        "core K(S) { junk = 3  update = { one(); } }",
        "core K( { update = { one(); } }",
        "core K(S) { provide help() = { one( } update = { one(); } }",
        "core K(S) { statemachine { initial state A { run = { one(); } junk = 3 } } }",
        "core K(S) { statemachine { initial state A { transition t if to A } } }",
        "core K(S) { statemachine { initial state A { transition t if one() > 0 to } } }",
        "core K(S) { statemachine { initial state A { transition t } } }",
        "core K(S) { statemachine { initial state A { } state { } } }",
        "core K(S) { statemachine { initial state A { } junk { } } }",
        "core K(S) { update = { a = b.c; } }",
        "core K(S) { update = { a = 5ms; } }",
        "core K(S) { update = { one(); } /* }",
    ] {
        let found = machine(
            &format!(
                "{broken}\n//- /rest.mal\n{CODELS}\n//- /root.mal\ninclude \"model.mal\"\ninclude \"rest.mal\"\n"
            ),
            "C",
        );
        assert!(found.starts_with("refused: ") && !found.contains(" ms"), "{broken}: {found}");
    }
}

#[test]
fn a_shell_that_may_lack_an_operation_refuses_its_cores() {
    let text = |shell: &str| {
        format!(
            "{shell}\ncodel one(): int\ncore K(S) {{ update = {{ one(); }} }}\ncomponent C(S, K)\n//- /mauve.toml\nassume.codel = \"1 ms\"\n"
        )
    };
    assert_eq!(machine(&text("shell S { }"), "C"), "update stay update: 1 ms\n");
    assert_eq!(machine(&text("shell S { input port }"), "C"), "update stay update: 1 ms\n");
    for broken in [
        "shell S { provde one(): int }",
        "shell S { require (): int }",
        "shell S extends T { }",
        "shell S extends S { }",
        "shell { }",
    ] {
        let found = machine(&text(broken), "C");
        assert!(found.starts_with("refused: "), "{broken}: {found}");
    }
}

#[test]
fn a_program_of_a_table_replaces_its_codels() {
    let model = "core K(S) {
        provide help() = { big(); }
        statemachine {
          initial state A { run = { one(); help(); } handle = { two(); } transition t if one() > 0 to B { four(); } }
          state B { transition back to A }
        } }";
    let with = |programs: &str| machine(&format!("{model}{}[program]\n{programs}", providing(HELP)), "C");
    expect![[r#"
        A t B: 22 ms
        A stay A: 20 ms
        B back A: 0 ms
    "#]]
    .assert_eq(&with(""));
    expect![[r#"
        A t B: 111 ms
        A stay A: 12 ms
        B back A: 0 ms
    "#]]
    .assert_eq(&with("\"C/A.run\" = 10\n\"C/A.t.guard\" = 0\n\"C/A.t.effect\" = 101\n"));
    expect![[r#"
        A t B: 7 ms
        A stay A: 5 ms
        B back A: 0 ms
    "#]]
    .assert_eq(&with("\"C/help\" = 1\n"));
    // A program that the component does not have may be a misspelt one.
    expect![[r#"
        refused: times.toml:8: C has no program `A.rnu`
    "#]]
    .assert_eq(&with("\"C/A.rnu\" = 100\n"));
}

#[test]
fn an_operation_with_the_name_of_a_hook_has_its_key() {
    let times = providing("provide update(): void  provide start(): void ");
    let machine = |core: &str, program: &str| {
        machine(&format!("core K(S) {{ {core} }}{times}[program]\n\"C/{program}\" = 1\n"), "C")
    };
    let operations = "provide update() = { big(); }  provide start() = { big(); }";
    let states =
        format!("{operations} statemachine {{ initial state A {{ run = {{ update(); start(); }} }} }}");
    assert_eq!(machine(&states, "A.run"), "A stay A: 1 ms\n");
    assert_eq!(machine(&states, "update"), "A stay A: 17 ms\n");
    assert_eq!(machine(&states, "start"), "A stay A: 17 ms\n");
    assert_eq!(machine(&states, "configure"), "A stay A: 32 ms\n");
    let both = format!("{operations} start = {{ big(); }} update = {{ start(); }}");
    assert_eq!(machine(&both, "start"), "update stay update: 1 ms\n");
    assert_eq!(machine(&both, "update"), "refused: times.toml:8: C has several programs `update`\n");
}

#[test]
fn what_never_happens_needs_no_time() {
    let times = CODELS.replace("big = 16\n", "");
    let model = "core K(S) { configure = { big(); } statemachine {
        initial state A { entry = { big(); }  transition t to B  transition u to C { big(); } }
        state B { run = { one(); }  transition back to B }
        state C { run = { big(); } }
    } }";
    assert_eq!(machine(&format!("{model}{times}"), "C"), "A t B: 0 ms\nB back B: 1 ms\n");
    // All of them are programs of the component, as a trace names them.
    let keys = "[program]\n\"C/A.entry\" = 9\n\"C/C.run\" = 9\n\"C/A.u.effect\" = 9\n\"C/configure\" = 9\n";
    assert_eq!(machine(&format!("{model}{times}{keys}"), "C"), "A t B: 0 ms\nB back B: 1 ms\n");
    check(
        "core K(S) { statemachine { initial state A { entry = { bogus(); } } } }",
        expect![[r#"
        refused: no codel or operation `bogus`
    "#]],
    );
}

#[test]
fn an_operation_is_what_the_shell_provides() {
    // A misspelling in the shell must not turn its call into that of a codel.
    check(
        "core K(S) { provide two() = { four(); } update = { two(); } }",
        expect![[r#"
        refused: the shell does not provide `two`: declare it there, or rename this operation
    "#]],
    );
    let chain: String = (0..5000).map(|it| format!("provide o{it}() = {{ o{}(); }}\n", it + 1)).collect();
    let shell: String = (0..=5000).map(|it| format!("provide o{it}(): void\n")).collect();
    let model = format!(
        "codel f(): int\nshell S {{ {shell} }}\ncore K(S) {{ {chain} provide o5000() = {{ f(); }} update = {{ o0(); }} }}\n\
         component C(S, K)\n//- /mauve.toml\nassume.codel = \"1 ms\"\n"
    );
    assert_eq!(machine(&model, "C"), "update stay update: 1 ms\n");
}

#[test]
fn the_worst_path_takes_the_longer_branch() {
    let path = |codels: &str| {
        let core = "core K(S) { update = { if one() > 0 then { THEN } else { ELSE } } }";
        let (then, other) = codels.split_once('|').unwrap();
        let model = format!("{}{CODELS}", core.replace("THEN", then).replace("ELSE", other));
        let db = Database::default();
        let project = projects(&db, workspace(&db, &model))[0];
        let of = names_of(&db, project).anywhere(Kind::Component, "C")[0];
        let found = worst_path(&db, first_tables(&db, project, of), of, LEVEL, 0);
        found.into_iter().map(|(codel, time)| format!("{codel} {time}")).collect::<Vec<_>>()
    };
    assert_eq!(path("two(); two();|eight();"), ["one 1 ms", "eight 8 ms"]);
    assert_eq!(path("eight();|two(); four();"), ["one 1 ms", "eight 8 ms"]);
    // Of two that take as long, the first.
    assert_eq!(path("two(); two();|four();"), ["one 1 ms", "two 2 ms", "two 2 ms"]);
}

#[test]
fn overhead_is_paid_by_each_job() {
    let model = format!(
        "core K(S) {{ update = {{ one(); }} }}{CODELS}[overhead]\ndispatch = 0.1\ncontext_switch = 0.05\n"
    );
    assert_eq!(machine(&model, "C"), "update stay update: 1.2 ms\n");
}

#[test]
fn without_a_deployment_the_general_tables_count() {
    let own =
        CODELS.replace("[\"times.toml\"]", "[\"times.toml\"]\ntiming.deployment.D.tables = [\"own.toml\"]");
    let model = format!("core K(S) {{ update = {{ one(); }} }}{own}//- /own.toml\n[codel]\none = 100\n");
    assert_eq!(machine(&model, "C"), "update stay update: 1 ms\n");
    let deployed = "architecture A { instance c: C } deployment D { architecture A }\n";
    assert_eq!(machine(&format!("{deployed}{model}"), "C"), "update stay update: 100 ms\n");
}

#[test]
fn times_that_overflow_are_refused() {
    let model = "codel long(): int\nshell S { }\ncore K(S) { update = { long(); long(); } }\ncomponent C(S, K)\n//- /mauve.toml\ntiming.tables = [\"t.toml\"]\n//- /t.toml\nunit = \"s\"\n[codel]\nlong = 18000000000\n";
    assert_eq!(machine(model, "C"), "refused: the time of a program exceeds 584 years\n");
}

#[test]
fn the_edges_of_a_state_share_its_guards() {
    let transitions: String =
        (0..100).map(|it| format!("transition t{it} if (one() > {it}) to A {{ two(); }}\n")).collect();
    let core = format!(
        "core K(S) {{ statemachine {{ initial state A {{ run = {{ four(); }}\n{transitions} handle = {{ one(); }} }} }} }}"
    );
    let db = Database::default();
    let project = projects(&db, workspace(&db, &format!("{core}{CODELS}")))[0];
    let core = names_of(&db, project).anywhere(Kind::Core, "K")[0];
    let edges = &behaviour_of(&db, project, core).edges;
    // `run`, the guards of all transitions up to it, and its effect or `handle`.
    let counts: Vec<usize> = edges.all.iter().map(|edge| edges.programs(edge).count()).collect();
    assert_eq!(counts, (1..=100).map(|it| 1 + it + 1).chain([102]).collect::<Vec<_>>());
    let kept: usize = edges.first.iter().chain(edges.all.iter().map(|edge| &edge.then)).map(Vec::len).sum();
    assert_eq!(kept, 101 + 101);
}
