//! Damaged texts by example: what was lost in them never lets anything look faster than it is. (At random: `damage.rs`.)

use expect_test::expect;
use mauve_diagnostics::Severity;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Problem, Workspace, names_of, projects};
use mauve_timing::Method;
use mauve_wcrt::{Query, response_times};
use salsa::Setter as _;

use crate::common::{LEVEL, diagnostics, verdicts, verdicts_with};

/// What is damaged in `fixture` may not make anything look faster than it is there: each damage replaces the first of
/// two texts by the second.
fn never_faster(fixture: &str, damages: &[(&str, &str)]) {
    let responses = |fixture: &str| -> Vec<(String, Option<f64>)> {
        let verdicts = verdicts(fixture);
        let lines = verdicts.lines().map(|line| {
            let mut words = line.split([' ', ':']);
            let name = words.next().unwrap_or_default().to_owned();
            let verdict = words.next().unwrap_or_default();
            let response = words.next().and_then(|number| number.parse().ok());
            (name, response.filter(|_| matches!(verdict, "met" | "missed")))
        });
        lines.collect()
    };
    let before = responses(fixture);
    for (from, to) in damages {
        assert!(fixture.contains(from), "{from}");
        let damaged = fixture.replacen(from, to, 1);
        let after = responses(&damaged);
        for (name, response) in &before {
            for (_, damaged) in after.iter().filter(|(other, response)| other == name && response.is_some()) {
                assert!(damaged >= response, "`{from}` → `{to}`: {name} {response:?} → {damaged:?}");
            }
            assert!(after.iter().any(|(other, _)| other == name), "`{from}` → `{to}` loses {name}");
        }
    }
}

/// A codel `f` in `app` and a cheap one in `lib`, which `app` uses; a codel that is called like a built-in function.
const TWICE: &str = r#"
include "lib.mal"
library app {
  use lib
  use drv
  codel e(in x: int): void  codel f(in x: int): void
  shell S { }
  core K(S) { var v: int = 0; update = { f(v); read(v); } }
  component P(S, K)
  architecture Front { instance p: P }
  architecture R {
    import Front
    instance q: lib.P
  }
  deployment D {
    architecture R
    activity p { affinity = 1 priority = 5 period = 100 }
    activity q { affinity = 1 priority = 4 period = 100 }
  }
}
//- /lib.mal
library drv {
  codel read(in x: int): void
}
library lib {
  codel f(in x: int): void
  shell S { }
  core K(S) { var v: int = 0; update = { f(v); } }
  component P(S, K)
  architecture Front { instance p: P }
}
//- /mauve.toml
[generate]
out = "gen"
[timing]
tables = ["t.toml"]
[assume]
codel = "1 ms"
[types.Laser]
cpp = "L*"
[platform]
rt_throttling = true
//- /t.toml
[codel]
"lib.f" = 1
"app.f" = 20
"drv.read" = 7
[overhead]
dispatch = 5
"#;

/// `own.mal` and `lib.mal` have the same names; the cheap ones are in the library that is used.
const NAMESAKE: &str = r#"
include "lib.mal"
include "own.mal"
library app {
  use lib
  shell Z {
    input port i: int
  }
  architecture R {
    instance p: P
  }
  deployment D { architecture R activity p { affinity = 1 priority = 5 period = 100 } }
}
//- /lib.mal
library lib {
  codel f(in x: int): int
  shell T { }
  core K(T) { update = { f(1); } }
  component P(T, K)
  architecture R { instance p: P }
}
//- /own.mal
library app {
  codel slow(in x: int): int
  shell S { }
  shell Base { }
  core C(S) {
    update = { slow(1); }
  }
  component P(S, C)
  shell Other extends Base { }
  core L(S) {
    update = { }
  }
}
//- /mauve.toml
project.root = "model.mal"
timing.tables = ["t.toml"]
//- /t.toml
[codel]
"lib.f" = 1
"app.slow" = 20
"#;

#[test]
fn the_rests_of_declarations_do_not_let_a_namesake_in() {
    assert_eq!(verdicts(NAMESAKE), "p met 20 ms\n");
    let own = NAMESAKE.split("//- /own.mal\n").nth(1).unwrap().split("//- /mauve").next().unwrap();
    let one_line = own.replace('\n', " ") + "\n";
    let damages = [
        (own, "librar\n"),
        (own, "l\n"),
        (own, &one_line.replacen("library app", "app", 1)),
        (own, &one_line.replacen("library app", "package app", 1)),
        (own, &one_line.replacen("library app", "lbry app", 1)),
        ("  component P(S, C)\n", "  ros { node = \"a\" component P(S, C) }\n"),
        ("  component P(S, C)\n  shell Other extends Base { }", "  extends Base { }"),
        ("  component P(S, C)\n  shell Other extends Base { }", "  Other extends Base { }"),
        ("  component P(S, C)\n  shell Other extends Base { }", "  Base { }"),
        ("  }\n  component P(S, C)\n  shell Other extends Base { }\n  core L(S) {\n", ""),
        ("  }\n  architecture R {\n", ""),
        ("architecture R {\n    instance p: P", "deployment R {\n    instance p: P"),
        ("architecture R {\n    instance p: P", "core R {\n    instance p: P"),
        ("architecture R {\n    instance p: P", "shell R {\n    instance p: P"),
    ];
    never_faster(NAMESAKE, &damages);
}

#[test]
fn fields_beside_one_that_is_lost_may_have_its_value() {
    let fixture = r#"
codel f(): int
shell S { }
core C(S) { update = { f(); } }
component P(S, C)
architecture A { instance p: P  instance q: P }
deployment D {
  architecture A
  activity p {
    affinity = 1
    priority = 50
    period = 20
  }
  activity q { affinity = 1 priority = 30 period = 100 }
}
//- /mauve.toml
assume.codel = "5 ms"
platform.cpus = 2
"#;
    let damages = [
        ("50\n    period = 20", "20"),
        ("affinity = 1\n    priority = 50", "affinity = 2"),
        ("affinity = 1\n    priority = 50", "affinity = 50 priority = 1"),
        ("affinity = 1\n    priority = 50", "priority = 1 affinity = 50"),
        ("affinity = 1\n    priority = 50", "affinity = 2 priority = 500"),
    ];
    never_faster(fixture, &damages);
}

#[test]
fn keys_of_programs_and_components_of_another_library_are_not_ignored() {
    let fixture = r#"
library lib { codel f(): int  shell S { }  core C(S) { update = { f(); } }  component P(S, C) }
library app {
  codel slow(): int
  shell S { }
  core C(S) { statemachine { initial state A { run = { slow(); } transition t to A } } }
  component P(S, C)
}
architecture R { instance p: app.P  instance q: lib.P }
deployment D { architecture R
  activity p { affinity = 1 priority = 5 period = 100 }
  activity q { affinity = 2 priority = 5 period = 100 }
}
//- /mauve.toml
timing.tables = ["t.toml"]
//- /t.toml
[codel]
"lib.f" = 1
"app.slow" = 20
[program]
"app.P/A.run" = 35
[component]
"app.P" = 40
[overhead]
dispatch = 5
"#;
    assert_eq!(verdicts(fixture), "p met 40 ms\nq met 6 ms\n");
    let damages = [
        ("app.P/A.run", "lib.P/A.run"),
        ("app.P/A.run", "P/A.rn"),
        ("app.P/A.run", "P/A.run"),
        ("[overhead]\n", ""),
        ("[component]\n", ""),
        ("[overhead]\ndispatch = 5", "dispatch = 5\n[overhead]"),
        ("[overhead]", "[component.app]"),
        ("[overhead]", "[codel.x]"),
    ];
    never_faster(fixture, &damages);
    // The classic method too: the time of a whole component may be below another header.
    for damaged in [fixture.replace("[component]\n", ""), fixture.replace("[component]", "[codel.x]")] {
        let found = verdicts_with(&damaged, Method::Classic, LEVEL);
        assert!(!found.contains("met"), "{found}");
    }
    // What stands outside libraries has no other key than its name.
    let outside = "codel f(): int\nlibrary l { codel f(): int }\nshell S { }\ncore C(S) { update = { f(); } }\n\
                   component P(S, C)\narchitecture R { instance p: P }\n\
                   deployment D { architecture R  activity p { priority = 1 period = 9 } }\n\
                   //- /mauve.toml\ntiming.tables = [\"t.toml\"]\n//- /t.toml\n[codel]\nf = 3\n\"l.f\" = 4\n";
    assert_eq!(verdicts(outside), "p met 3 ms\n");
}

#[test]
fn what_is_called_like_a_built_in_function_does_not_hide_it() {
    let fixture = r#"
library lib { codel read(in mode: int, in last: int): int }
library app {
  use lib
  codel f(in x: int): int
  shell S { input port scan: int  input port read: int  output port status: int  require send(): int }
  core C(S) {
    var scan: int
    handler collect: send
    update = { read(scan, scan); write(status, f(scan)); collect = send(send); collect(collect, scan); }
  }
  component P(S, C)
}
architecture R { instance p: app.P }
deployment D { architecture R  activity p { priority = 1 period = 100 } }
//- /mauve.toml
assume.codel = "5 ms"
"#;
    assert_eq!(verdicts(&fixture.replace("codel read(in mode: int, in last: int): int", "")), "p met 5 ms\n");
    // Which of the two is meant where there is a codel, too, is not guessed.
    assert!(verdicts(fixture).contains("`read` is a port here, which hides the codel of that name"));
    let codel = fixture.replace("input port read: int", "");
    assert_eq!(verdicts(&codel), "p met 10 ms\n");
    let whole = "codel read(in mode: int, in last: int): int";
    never_faster(&codel, &[(whole, "cod"), ("codel read(", "codel (")]);
}

#[test]
fn a_call_that_lost_its_name_or_its_brackets_is_no_value() {
    let damages = [
        ("f(v); read(v)", "(v); read(v)"),
        ("f(v); read(v)", "f; read(v)"),
        ("f(v); read(v)", "f;(v); read(v)"),
        ("f(v); read(v)", "f=(v); read(v)"),
        ("f(v); read(v)", "v = f; read(v)"),
        ("f(v); read(v)", "v(f); read(v)"),
    ];
    never_faster(TWICE, &damages);
}

#[test]
fn a_codel_called_like_a_built_in_function_is_never_free() {
    let damages = [
        ("use drv", "use dvr"),
        ("use drv", "use"),
        ("use drv", "us"),
        ("use drv", ""),
        ("codel read", "codel reed"),
        ("codel read(in x: int): void", "codel (in x: int): void"),
        ("codel read(in x: int): void", "codel in(read x: int): void"),
        ("codel read(in x: int): void", "cod"),
        ("\"lib.mal\"", "\"lbi.mal\""),
        ("\"lib.mal\"", "\"lib.mal"),
        ("include \"lib.mal\"", "include"),
        ("include \"lib.mal\"", "inc"),
        ("include \"lib.mal\"", ""),
    ];
    never_faster(TWICE, &damages);
}

#[test]
fn what_a_damaged_declaration_may_declare_is_not_looked_for_elsewhere() {
    let two = "codel e(in x: int): void  codel f(in x: int): void";
    let damages = [
        (two, "codel e(in x: int): "),
        (two, "codel e(in x: "),
        (two, "cod"),
        (two, "codel e(in x: int): void  codel ff(in x: int): void"),
        ("codel f(in x: int): void", "codel in(f x: int): void"),
        ("codel f(in x: int): void", "codel void"),
        ("codel f(in x: int): void", "odel f(in x: int): void"),
        ("core K(S) { var v: int = 0; update = { f(v); read", "K(S) { var v: int = 0; update = { f(v); read"),
        (
            "core K(S) { var v: int = 0; update = { f(v); read",
            "co K(S) { var v: int = 0; update = { f(v); read",
        ),
        ("core K(S) { var v: int = 0; update = { f(v); read", "core { var v: int = 0; update = { f(v); read"),
        ("architecture Front {", "Front {"),
        ("architecture Front {", "arch Front {"),
        ("architecture Front {", "ar Front {"),
        ("architecture Front {", "architecture {"),
    ];
    never_faster(TWICE, &damages);
}

#[test]
fn a_section_that_lost_its_header_changes_no_time() {
    let damages = [
        ("[platform]\n", ""),
        ("[platform]", "[lints]"),
        ("[platform]", "[chains]"),
        ("[timing]\n", ""),
        ("[timing]", "[project]"),
        ("[timing]", "[chains]"),
        ("[timing]", "[types]"),
        ("[assume]\n", ""),
        ("[overhead]\n", ""),
        ("[overhead]\ndispatch = 5", "dispatch = 5\n[overhead]"),
        ("[codel]\n", ""),
    ];
    never_faster(TWICE, &damages);
    // In a table that is called like the configuration, too.
    let elsewhere = TWICE
        .replace("[\"t.toml\"]", "[\"t.toml\", \"timing/*.toml\"]")
        .replace("[overhead]", "//- /timing/mauve.toml\n[overhead]");
    assert_eq!(verdicts(&elsewhere), verdicts(TWICE));
}

#[test]
fn a_method_that_lost_its_end_is_not_free() {
    let fixture = r#"
codel f(): void
codel g(): void
shell S { }
core N(S) { statemachine {
  initial state A {
    run = { g(); }
    exit = { f(); }
    transition t if (true) to A { f(); }
  }
} }
component C(S, N)
architecture A { instance a: C }
deployment D { architecture A  activity a { priority = 1 period = 100 } }
//- /mauve.toml
assume.codel = "9 ms"
"#;
    let damages = [
        ("exit = { f(); }", "exi"),
        ("exit = { f(); }", "exit"),
        ("exit = { f(); }", "exit ="),
        ("transition t if (true) to A { f(); }", "transiti"),
        ("transition t if (true) to A { f(); }", "transition t"),
        ("run = { g(); }", "r"),
    ];
    never_faster(fixture, &damages);
}

#[test]
fn a_connection_that_is_not_right_may_serve_anybody() {
    let fixture = r#"
codel f(): void
shell SP { provide go(): void  output port out1: int }
core CP(SP) { provide go() = { f(); } update = { write(out1, 1); } }
component P(SP, CP)
shell SC { require go(): void  input port in1: int }
core CC(SC) { update = { send(go); } }
component C(SC, CC)
architecture A {
  instance p: P
  instance c: C
  connection p.out1 -> c.in1
  operation p.go -> c.go
}
deployment D { architecture A
  activity p { affinity = 1 priority = 5 period = 100 }
  activity c { affinity = 1 priority = 4 period = 100 }
}
//- /mauve.toml
assume.codel = "20 ms"
"#;
    for line in [
        "operation c.go -> c.go",
        "operation c.go -> p.go",
        "operation p.go ->",
        "operation",
        "oper",
        "connection p.go -> c.go",
        "connection -> c.go",
        "connection q.go -> c.go",
        "connection c.go -> c.go",
        "connection",
        "con",
    ] {
        let found = verdicts(&fixture.replace("operation p.go -> c.go", line));
        assert_eq!(found.matches("not-analysed").count(), 2, "{line}: {found}");
    }
    assert_eq!(verdicts(&fixture.replace("operation p.go -> c.go", "")).matches("met").count(), 2);
}

#[test]
fn a_name_that_means_nothing_says_where_it_may_be_found() {
    let model = |app: &str| {
        diagnostics(&format!(
            "include \"lib.mal\"\n{app}\n//- /lib.mal\nlibrary near {{ codel f(): int  shell S {{ }} }}\n\
             //- /parts/other.mal\ncodel elsewhere(): int\n//- /mauve.toml\nproject.root = \"model.mal\"\n"
        ))
    };
    expect![[r#"
        /model.mal "S" unresolved-shell: no shell `S`; library `near` has one: add `use near`
        /parts/other.mal "" not-included: no root includes this file, so it is not checked
    "#]]
    .assert_eq(&model("library app { core K(S) { update = { f(); elsewhere(); } } }"));
    expect![[r#"
        /model.mal "elsewhere" unresolved-codel: no codel or operation `elsewhere`; parts/other.mal declares one, and is not included
    "#]].assert_eq(&model("library app { use near core K(S) { update = { f(); elsewhere(); } } }"));
    expect![[r#"
        /model.mal "naer.S" unresolved-shell: no shell `naer.S`; did you mean `S`?
        /model.mal "L" unresolved-shell: `L` is a core: the shell comes first, then the core
        /parts/other.mal "" not-included: no root includes this file, so it is not checked
    "#]]
    .assert_eq(&model(
        "core K(naer.S) { update = { f(); } }\ncomponent C(L, near.S)\ncore L(S) { update = { } }",
    ));
    expect![[r#"
        /model.mal "include" syntax-error: an `include` comes before all declarations of its file
    "#]]
    .assert_eq(&model("core L(S) { update = { } }\ncomponent C(L, S)\ninclude \"pa\\rts.mal\""));
}

#[test]
fn duplicates_are_not_chosen_from() {
    // One of the twins has lost its activity, which may be the most urgent.
    let twins = TWICE
        .replace("instance q: lib.P", "instance p: lib.P")
        .replace("activity q { affinity = 1 priority = 4 period = 100 }", "");
    assert_eq!(verdicts(&twins).matches("not-analysed").count(), verdicts(&twins).lines().count(), "{twins}");
    let merged = TWICE.replace("  deployment D {", "  deployment D { architecture R }\n  deployment D {");
    let found = verdicts(&merged);
    assert!(found.contains("deployment D is declared twice") && !found.contains("met"), "{found}");
}

#[test]
fn statements_between_declarations_are_no_section_of_another_tool() {
    for statement in
        ["if x > 0 then { h(); }", "else { h(); }", "loop { h(); h(); }", "{ h(); }", "state A { }"]
    {
        for (from, to) in [("shell S", "shell S"), ("component C", "component C")] {
            let model = PROGRAM.replacen(&format!("  {from}"), &format!("  {statement}\n  {to}"), 1);
            assert!(verdicts(&model).contains("not-analysed"), "{statement}: {}", verdicts(&model));
        }
    }
    // This one is of another tool.
    assert_eq!(
        verdicts(&PROGRAM.replacen("  shell S", "  ros { node = \"a\" }\n  shell S", 1)),
        "i met 6 ms\n"
    );
}

#[test]
fn a_deadline_behind_the_period_is_not_used() {
    let late = TWICE.replace("priority = 4 period = 100", "priority = 4 period = 40 deadline = 60");
    assert!(verdicts(&late).contains("q missed"), "{}", verdicts(&late));
}

#[test]
fn a_text_of_which_a_change_was_lost_says_nothing() {
    let db = Database::default();
    let model = "include \"other.mal\"\ncodel f(): int\nshell S { }\ncore K(S) { update = { f(); } }\ncomponent P(S, K)\n\
                 architecture R { instance p: P }\ndeployment D { architecture R  activity p { priority = 1 period = 9 } }\n\
                 //- /other.mal\ncodel g(): int\n//- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n//- /times.toml\n\
                 codel.f = 1\n";
    let texts = mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let mut db = db;
    let verdicts = |db: &Database| -> Vec<&str> {
        let project = projects(db, workspace)[0];
        let deployment = names_of(db, project).anywhere(Kind::Deployment, "D")[0];
        let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
        report.activities.iter().map(|activity| activity.verdict.name()).collect()
    };
    let before = verdicts(&db);
    assert_eq!(before, ["met"]);
    // Even in a file that nothing of the deployment rests on, as far as is known.
    for path in ["/other.mal", "/model.mal"] {
        let file = workspace.file(&db, path.as_ref()).unwrap();
        file.set_problem(&mut db).to(Some(Problem::Unknown("lost".to_owned())));
        assert!(verdicts(&db).iter().all(|verdict| *verdict == "not-analysed"), "{path}");
        file.set_problem(&mut db).to(None);
        assert_eq!(verdicts(&db), before);
    }
}

/// A program with everything that an error can stand in.
const PROGRAM: &str = r#"
library one { codel twin(): int }
library two { codel twin(): int }
library app {
  use one
  use two
  codel f(in x: int): int
  codel g(): int
  codel o(out x: int): int
  shell S {
    input port scan: int
    output port way: int
    property p: int = 1
    provide help(in x: int): int
    require ask(): int
  }
  core K(S) {
    var x: int = 0
    var c: bool = false
    handler h: ask
    provide help(in x: int): int = { return f(x); }
    start = { g(); return true; }
    statemachine {
      initial state A {
        run = { x = f(g()); read(scan, x); }
        handle = { var y: int = g(); var z: int = g(); help(y + z); }
        transition t if g() > 1 to B { o(x); write(way, g()); }
      }
      state B { entry = { x = x + g(); } transition back if c to A }
    }
  }
  component C(S, K)
}
architecture R { instance i: app.C }
deployment D { architecture R  activity i { priority = 1 period = 100 } }
//- /mauve.toml
assume.codel = "1 ms"
"#;

#[test]
fn a_lost_call_that_shows_as_an_error_refuses_its_core() {
    assert_eq!(verdicts(PROGRAM), "i met 6 ms\n");
    let cases = [
        ("ambiguous-name", "x = f(g());", "x = twin();"),
        ("argument-count", "x = f(g());", "x = f();"),
        ("argument-count", "read(scan, x);", "read(scan);"),
        ("argument-count", "help(y + z);", "help();"),
        ("argument-type", "x = f(g());", "x = f(c);"),
        ("argument-type", "help(y + z);", "help(c);"),
        ("assignment-type", "x = f(g());", "x = c;"),
        ("assignment-type", "write(way, g());", "write(way, c);"),
        ("blocking-call", "x = f(g());", "x = ask();"),
        ("condition-type", "if g() > 1 to B", "if x to B"),
        ("duplicate-definition", "var z: int = g();", "var y: int = 1;"),
        (
            "duplicate-hook",
            "start = { g(); return true; }",
            "start = { return true; } start = { return true; }",
        ),
        ("duplicate-hook", "handle = {", "run = {"),
        ("initial-state", "initial state A", "state A"),
        ("invalid-type", "var z: int = g();", "var z: void;"),
        ("no-effect", "x = f(g());", "x;"),
        ("not-assignable", "x = f(g());", "p = x;"),
        ("operation-definition", "help(in x: int): int = { return f(x); }", "help(): int = { return x; }"),
        ("operator-type", "x = x + g();", "x = x + c;"),
        ("out-argument", "o(x); write(way, g());", "o(x + 1);"),
        ("port-direction", "read(scan, x);", "read(way, x);"),
        ("recursive-operation", "return f(x);", "return help(x);"),
        ("return-type", "return f(x);", "return c;"),
        ("return-type", "return f(x);", ""),
        ("syntax-error", "x = f(g());", "x = f(g();"),
        ("undeclared-operation", "provide help(in x: int): int = {", "provide aid(in x: int): int = {"),
        ("undefined-operation", "provide help(in x: int): int = { return f(x); }", ""),
        ("unresolved-codel", "x = f(g());", "x = ff(1);"),
        ("unresolved-codel", "start = { g(); return", "start = { gg(); return"),
        ("unresolved-operation", "handler h: ask", "handler h: aks"),
        ("unresolved-shell", "core K(S)", "core K(T)"),
        ("unresolved-state", "to B {", "to C {"),
        ("unresolved-variable", "x = f(g());", "x = fg;"),
        ("update-or-statemachine", "start = { g(); return true; }", "update = { }"),
    ];
    for (code, call, damaged) in cases {
        assert!(PROGRAM.contains(call), "{call}");
        let text = PROGRAM.replacen(call, damaged, 1);
        assert!(diagnostics(&text).contains(code), "{code}: {}", diagnostics(&text));
        // A severity never changes a proof.
        for text in [text.clone(), format!("{text}[lints]\n{code} = \"allow\"\n")] {
            let found = verdicts(&text);
            assert!(found.starts_with("i not-analysed: "), "{code}, `{call}` → `{damaged}`: {found}");
        }
    }
    // Every other error stands elsewhere.
    let elsewhere = [
        "buffer-size",
        "conflicting-fields",
        "connection-direction",
        "connection-type",
        "constant-expression",
        "chain-late",
        "deadline-missed",
        "deployment-target",
        "duplicate-activity",
        "duplicate-field",
        "empty-interval",
        "import-cycle",
        "inheritance-cycle",
        "invalid-configuration",
        "across-hosts",
        "invalid-field",
        "invalid-table",
        "invalid-topic",
        "missing-activity",
        "missing-field",
        "missing-value",
        "never-triggered",
        "operation-signature",
        "outside-interval",
        "refuted-time",
        "too-large",
        "two-writers",
        "undeclared-lock",
        "unknown-field",
        "unreadable-file",
        "unresolved-architecture",
        "unresolved-component",
        "unresolved-core",
        "unresolved-feature",
        "unresolved-include",
        "unresolved-instance",
        "waiting-codel",
        "work-elsewhere",
        "wrong-shell",
    ];
    let errors = mauve_diagnostics::codes().filter(|code| code.severity == Severity::Error);
    for code in errors {
        let stands_here = cases.iter().any(|(here, ..)| *here == code.name);
        assert!(stands_here != elsewhere.contains(&code.name), "{}", code.name);
    }
}

#[test]
fn the_time_of_something_that_was_renamed_is_not_ignored() {
    let model = "library app { codel slow(): int\nshell S { }\ncore C(S) { update = { slow(); } }\ncomponent Driver(S, C)\n\
                 architecture R { instance p: Driver }\n\
                 deployment D { architecture R  activity p { priority = 5 period = 30 } } }\n\
                 //- /mauve.toml\ntiming.tables = [\"t.toml\"]\nassume.codel = \"5 ms\"\n//- /t.toml\n";
    for (method, table) in [
        (Method::Psm, "[codel]\nslow = 20\n[program]\n\"Pilot/update\" = 35\n"),
        (Method::Psm, "[codel]\nslow = 20\n[program]\n\"app.Pilot/update\" = 35\n"),
        (Method::Psm, "[codel]\nis_blocked = 35\n"),
        (Method::Psm, "[codel]\n\"app.is_blocked\" = 35\n"),
        (Method::Classic, "[codel]\nslow = 20\n[component]\nPilot = 35\n"),
        (Method::Classic, "[codel]\nslow = 20\n[component]\n\"app.Pilot\" = 35\n"),
    ] {
        let found = verdicts_with(&format!("{model}{table}"), method, LEVEL);
        assert!(found.starts_with("p not-analysed"), "{table}{found}");
    }
}
