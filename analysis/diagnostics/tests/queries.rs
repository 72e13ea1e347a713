//! What an edit makes the database compute again, counted by query.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_timing::{Level, Method};
use mauve_wcrt::{Query, response_times};

/// Two robots that share a component.
const MODEL: &str = r#"
include "parts.mal"
architecture A { instance a: C  instance b: C }
architecture B { instance b: C }

deployment D {
  architecture A
  activity a { priority = 2 period = 10 }
  activity b { priority = 1 period = 20 }
}
deployment E {
  architecture B
  activity b { priority = 1 period = 30 }
}
//- /parts.mal
codel one(): int
codel two(): int
shell S { }
core K(S) {
  statemachine {
    initial state A { run = { one(); } transition t if two() > 1 to B }
    state B { transition back to A }
  }
}
core Other(S) { update = { one(); } }
component C(S, K)
//- /mauve.toml
project.root = "model.mal"
timing.tables = ["times.toml"]
//- /times.toml
[codel]
one = 1
two = 2
"#;

/// Asks for everything that is shown: all diagnostics, all response times.
fn show(db: &Database, workspace: Workspace) {
    workspace_diagnostics(db, workspace);
    for &project in projects(db, workspace) {
        for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
            let query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Best };
            response_times(db, project, decl, query);
        }
    }
}

/// The queries that are executed when `from` becomes `to` in the file at `path`, with how often.
fn executed(fixture: &[(PathBuf, String)], path: &str, from: &str, to: &str) -> BTreeMap<String, usize> {
    let mut db = Database::with_log();
    let workspace =
        Workspace::of_texts(&db, fixture[0].0.parent().unwrap().to_owned(), fixture.iter().cloned());
    show(&db, workspace);
    assert!(db.take_log().executed.len() > 30, "the log is not kept");
    show(&db, workspace);
    assert_eq!(db.take_log().executed, Vec::<String>::new(), "nothing changed");
    let file = workspace.file(&db, Path::new(path)).unwrap();
    let old = file.text(&db).to_string();
    assert!(old.contains(from), "{from:?} is not in {path}");
    file.set_text(&mut db, old.replacen(from, to, 1).into());
    show(&db, workspace);
    let mut counts = BTreeMap::new();
    for query in db.take_log().executed {
        *counts.entry(query).or_default() += 1;
    }
    counts
}

fn robot() -> Vec<(PathBuf, String)> {
    mauve_tests::fixture(MODEL).into_iter().map(|(path, text)| (path.into(), text)).collect()
}

/// [`robot`], where deployment `E` executes another component too.
fn with_other() -> Vec<(PathBuf, String)> {
    let mut texts = robot();
    for (path, text) in &mut texts {
        if path.ends_with("parts.mal") {
            *text += "component O(S, Other)\n";
        }
        if path.ends_with("model.mal") {
            *text = text.replace("architecture B { instance b: C }", "architecture B { instance b: O }");
        }
    }
    texts
}

/// What any edit of a file may execute again: it looks at that file alone, or copies what others found.
const OF_A_FILE: [&str; 18] = [
    "line_index",
    "allows",
    "core_interface",
    "core_scope",
    "deployment_interface",
    "parse",
    "lowered",
    "item_tree_of",
    "declarations",
    "includes",
    "data",
    "file_diagnostics",
    "broken_lines",
    "diagnostics_in",
    "findings_of",
    "gathered",
    "gathered_in_group",
    "of_project",
];

#[track_caller]
fn check(counts: &BTreeMap<String, usize>, analysis: &[(&str, usize)]) {
    let mut rest = counts.clone();
    for query in OF_A_FILE {
        rest.remove(query);
    }
    let expected: BTreeMap<String, usize> =
        analysis.iter().map(|(query, count)| ((*query).to_owned(), *count)).collect();
    assert_eq!(rest, expected);
}

#[test]
fn a_comment_runs_no_analysis() {
    for (path, at) in [
        ("/model.mal", "deployment D {"),
        ("/model.mal", "  architecture A\n"),
        ("/model.mal", "include"),
        ("/parts.mal", "codel one"),
        ("/parts.mal", "    initial state"),
    ] {
        let counts = executed(&robot(), path, at, &format!("// a comment\n\n{at}"));
        check(&counts, &[]);
        assert_eq!(
            counts.get("data"),
            None,
            "what stands in a declaration is not even looked at: {counts:?}"
        );
    }
}

#[test]
fn a_changed_period_runs_only_its_deployments_response_times() {
    let counts = executed(&robot(), "/model.mal", "period = 10", "period = 15");
    check(
        &counts,
        &[
            ("system_of", 1),
            ("response_times", 1),
            ("chains_of", 1),
            ("connections_of", 1),
            ("declaration_diagnostics", 1),
            ("missing_time_facts", 1),
        ],
    );
}

#[test]
fn a_changed_program_runs_its_core_and_where_a_time_changed_the_response_times() {
    let counts = executed(&robot(), "/parts.mal", "run = { one(); }", "run = { one(); one(); }");
    let of_core = [
        ("behaviour_of", 1),
        ("declaration_facts", 1),
        ("errors_in", 1),
        ("flow_facts", 1),
        ("graphs_of_group", 1),
        ("inference_of", 1),
        ("structure_of", 1),
        ("unknown_types", 1),
        ("uses_of", 1),
    ];
    let and = |more: &[(&'static str, usize)]| [&of_core, more].concat();
    check(
        &counts,
        &and(&[
            ("psm_in_thread", 1),
            ("response_times", 2),
            ("chains_of", 2),
            ("connections_of", 2),
            ("followed_of", 1),
            ("is_readable", 1),
            ("product_of", 1),
            ("missing_time_facts", 1),
            ("declaration_diagnostics", 2),
            ("large_ports", 1),
        ]),
    );
    // The same cost: nothing behind the core.
    let counts =
        executed(&robot(), "/parts.mal", "run = { one(); }", "run = { if (1 > 0) then { one(); } else { } }");
    check(&counts, &and(&[("followed_of", 1)]));
    // A core that no component has; what the project uses is another codel.
    let counts = executed(&robot(), "/parts.mal", "update = { one(); }", "update = { two(); }");
    let of_core: Vec<_> = of_core.into_iter().filter(|(query, _)| *query != "errors_in").collect();
    let and = |more: &[(&'static str, usize)]| [of_core.as_slice(), more].concat();
    check(&counts, &and(&[("usage_in_group", 1)]));
    // A half-typed line in it: what is unused is unknown.
    let counts = executed(&robot(), "/parts.mal", "update = { one(); }", "update = { one() }");
    let asked = [("usage_in_group", 1), ("usage_of", 1), ("unused_facts", 1)];
    check(&counts, &and(&asked));
}

#[test]
fn only_an_edit_of_its_core_runs_the_product_of_a_core() {
    let mut robot = robot();
    let counting = "update = { if left == 0 then { one(); left = 3; } else { left = left - 1; } }";
    for (path, text) in &mut robot {
        if path.ends_with("parts.mal") {
            *text = text.replace("update = { one(); }", &format!("var left: int = 0 {counting}"));
            *text += "component Q(S, Other)\n";
        }
        if path.ends_with("model.mal") {
            *text = text.replace("architecture B { instance b: C }", "architecture B { instance b: Q }");
        }
    }
    let products = |path: &str, from: &str, to: &str| {
        executed(&robot, path, from, to).get("product_of").copied().unwrap_or(0)
    };
    assert_eq!(products("/parts.mal", "left = 3;", "left = 4;"), 1);
    assert_eq!(products("/parts.mal", "left = 3;", "left = 3; // periods"), 0);
    assert_eq!(products("/times.toml", "two = 2", "two = 3"), 0);
    assert_eq!(products("/times.toml", "one = 1", "one = 3"), 0);
    assert_eq!(products("/model.mal", "period = 10", "period = 11"), 0);
}

#[test]
fn a_saved_table_runs_no_names_and_no_behaviours() {
    let counts = executed(&robot(), "/times.toml", "two = 2", "two = 3");
    let expected = [
        ("table", 1),
        ("joined", 1),
        ("timetable_of", 1),
        ("incomplete_tables", 1),
        ("times_of", 1),
        ("psm_in_thread", 1),
        ("response_times", 2),
        ("chains_of", 2),
        ("connections_of", 2),
        ("declaration_diagnostics", 2),
        ("missing_time_facts", 1),
    ];
    check(&counts, &expected);
    let counts = executed(&robot(), "/times.toml", "[codel]", "# measured\n[codel]");
    check(&counts, &[("table", 1), ("joined", 1), ("timetable_of", 1)]);
    // Nor where the table has a warning in it.
    let mut warned = robot();
    for (path, text) in &mut warned {
        if path.ends_with("times.toml") {
            *text += "three = 3\n[program]\n\"C/B.rnu\" = 1\n";
        }
    }
    let counts = executed(&warned, "/times.toml", "[codel]", "# measured\n[codel]");
    check(&counts, &[("table", 1), ("joined", 1), ("timetable_of", 1)]);
}

#[test]
fn a_changed_time_runs_only_the_state_machines_that_use_it() {
    let counts = executed(&with_other(), "/times.toml", "two = 2", "two = 3");
    assert_eq!(
        (counts["times_of"], counts["psm_in_thread"], counts["response_times"]),
        (2, 1, 1),
        "{counts:?}"
    );
    let counts = executed(&with_other(), "/times.toml", "one = 1", "one = 3");
    assert_eq!(
        (counts["times_of"], counts["psm_in_thread"], counts["response_times"]),
        (2, 2, 2),
        "{counts:?}"
    );
    // The time of a program of one component.
    let counts = executed(&with_other(), "/times.toml", "[codel]", "[program]\n\"O/update\" = 5\n[codel]");
    assert_eq!((counts["times_of"], counts["psm_in_thread"]), (2, 1), "{counts:?}");
}

/// [`robot`], where deployment `E` has its own tables.
fn with_own_tables() -> Vec<(PathBuf, String)> {
    let mut texts = robot();
    for (path, text) in &mut texts {
        if path.ends_with("mauve.toml") {
            *text += "timing.deployment.E.tables = [\"e.toml\"]\n";
        }
    }
    texts.push(("/e.toml".into(), "[codel]\none = 3\ntwo = 4\n".to_owned()));
    texts
}

#[test]
fn a_changed_time_runs_only_the_deployments_that_use_its_table() {
    for (path, from, to) in [("/e.toml", "two = 4", "two = 5"), ("/times.toml", "two = 2", "two = 3")] {
        let counts = executed(&with_own_tables(), path, from, to);
        let expected = [
            ("table", 1),
            ("joined", 1),
            ("timetable_of", 1),
            ("incomplete_tables", 1),
            ("times_of", 1),
            ("psm_in_thread", 1),
            ("response_times", 1),
            ("chains_of", 1),
            ("connections_of", 1),
            ("declaration_diagnostics", 1),
            ("missing_time_facts", 1),
        ];
        check(&counts, &expected);
    }
    // Another deployment than `E` gets the section: both have other times.
    let counts = executed(&with_own_tables(), "/mauve.toml", "deployment.E", "deployment.D");
    assert_eq!((counts["tables_of"], counts["response_times"]), (2, 2), "{counts:?}");
    // A new section changes no other deployment.
    let counts = executed(&robot(), "/mauve.toml", "tables", "deployment.E.tables = []\ntiming.tables");
    assert_eq!((counts["tables_of"], counts["response_times"]), (2, 1), "{counts:?}");
}

#[test]
fn a_new_codel_runs_no_inference() {
    for new in ["codel three(): int\n", "library l { codel one(): int }\n"] {
        let counts = executed(&with_other(), "/parts.mal", "shell S", &format!("{new}shell S"));
        for query in
            ["inference_of", "behaviour_of", "uses_of", "shared_features", "psm_in_thread", "system_of"]
        {
            assert_eq!(counts.get(query), None, "{new}: {counts:?}");
        }
        assert_eq!(counts["names_of"], 1);
    }
    // The core that calls the renamed codel, and not the other one.
    let counts = executed(&with_other(), "/parts.mal", "codel two", "codel deux");
    assert_eq!((counts["inference_of"], counts["behaviour_of"]), (1, 1), "{counts:?}");
}

#[test]
fn a_comment_in_the_configuration_runs_no_analysis() {
    let counts = executed(&robot(), "/mauve.toml", "project", "# a comment\nproject");
    for query in ["psm_in_thread", "behaviour_of", "system_of", "response_times"] {
        assert_eq!(counts.get(query), None, "{counts:?}");
    }
}

#[test]
fn a_new_name_runs_no_response_times() {
    for new in ["codel three(): int\n", "codel thr\n", "cod\n"] {
        let counts = executed(&robot(), "/parts.mal", "shell S", &format!("{new}shell S"));
        assert_eq!(counts.get("response_times"), None, "{new}: {counts:?}");
    }
}

/// Returns how many queries salsa verifies after an edit of one program, in a project of `files` files. Only the edited file and
/// the deployment are open.
fn verified(files: usize) -> usize {
    let mut db = Database::with_log();
    let texts = mauve_tests::generated_project(files, 50 * files).into_iter();
    let texts = texts.map(|(path, text)| (PathBuf::from(format!("/{path}")), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let all: Vec<_> = workspace.files(&db).values().copied().collect();
    for file in all {
        let text = file.text(&db).clone();
        file.set_text_with(&mut db, text, salsa::Durability::HIGH);
    }
    let open = workspace.file(&db, Path::new("/part1.mal")).unwrap();
    let (old, new) = (open.text(&db).clone(), open.text(&db).replacen("next = 0;", "next = 1;", 1));
    assert_ne!(*old, *new);
    open.set_text(&mut db, old);
    let root = workspace.file(&db, Path::new("/root.mal")).unwrap();
    let deployment = root.text(&db).clone();
    root.set_text(&mut db, deployment);
    show(&db, workspace);
    db.take_log();
    open.set_text(&mut db, new.into());
    show(&db, workspace);
    db.take_log().verified.len()
}

#[test]
fn an_edit_verifies_other_files_as_a_whole() {
    // What the project, the deployment and its chains ask about each file and its component; with the queries of each declaration, it would be
    // about 40.
    let more = verified(60) - verified(30);
    assert!((30..30 * 12).contains(&more), "{more} for 30 files");
}

#[test]
fn a_changed_state_runs_the_group_of_its_body_in_a_large_core() {
    let texts = mauve_tests::generated_project(2, 1000).into_iter();
    let texts: Vec<_> = texts.map(|(path, text)| (PathBuf::from(path), text)).collect();
    let counts = executed(&texts, "/part0.mal", "next = 7;", "next = sense(7);");
    for of_a_group in ["inference_of", "flow_of_group", "costs_of_group"] {
        assert_eq!(counts.get(of_a_group), Some(&1), "{of_a_group}: {counts:?}");
    }
    // The same calls and the same names: nothing is computed anew for the core as a whole.
    let counts = executed(&texts, "/part0.mal", "next = 7;", "next = 8;");
    assert_eq!(counts.get("inference_of"), Some(&1), "{counts:?}");
    for of_the_core in ["behaviour_of", "declaration_facts", "errors_in", "flow_facts", "uses_of"] {
        assert_eq!(counts.get(of_the_core), None, "{of_the_core}: {counts:?}");
    }
}

#[test]
fn an_edit_of_the_sample_robot_runs_few_queries() {
    let folder = mauve_tests::models().join("p3dx");
    let mut texts: Vec<_> = mauve_tests::all_texts_in(&folder).into_iter().collect();
    texts.sort_by_key(|(path, _)| (path.parent() != Some(&folder), path.clone()));
    let deployment = folder.join("deployment.mal");
    let deployment = deployment.to_str().unwrap();
    let counts = executed(&texts, deployment, "deployment", "// a comment\ndeployment");
    check(&counts, &[]);
    let counts = executed(&texts, deployment, "period = 1000", "period = 900");
    check(
        &counts,
        &[
            ("system_of", 1),
            ("response_times", 1),
            ("chains_of", 1),
            ("connections_of", 1),
            ("declaration_diagnostics", 1),
            ("missing_time_facts", 1),
        ],
    );
}

/// [`robot`] with a time that depends on the level.
fn with_levels() -> Vec<(PathBuf, String)> {
    let mut texts = robot();
    for (_, text) in texts.iter_mut().filter(|(path, _)| path.ends_with("times.toml")) {
        *text = format!("levels = [1e-4, 1e-6]\n{}", text.replace("two = 2", "two = [2, 3]"));
    }
    texts
}

/// The queries of numbers of executions and of probabilities that an edit runs again.
fn probable(path: &str, from: &str, to: &str) -> Vec<(String, usize)> {
    let asked = |db: &Database, workspace: Workspace| {
        for &project in projects(db, workspace) {
            for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
                assert!(mauve_wcrt::support(db, project, decl, Level::TEN_TO_MINUS_FOUR).is_some());
                assert!(mauve_wcrt::probabilities_of(db, project, decl).iter().all(Option::is_some));
            }
        }
    };
    let mut db = Database::with_log();
    let workspace = Workspace::of_texts(&db, "/".into(), with_levels());
    asked(&db, workspace);
    db.take_log();
    let file = workspace.file(&db, Path::new(path)).unwrap();
    let old = file.text(&db).to_string();
    assert!(old.contains(from), "{from:?} is not in {path}");
    file.set_text(&mut db, old.replacen(from, to, 1).into());
    asked(&db, workspace);
    let mut counts = BTreeMap::new();
    let ours = ["levelled", "counts_of", "probabilities_of", "response_times"];
    for query in db.take_log().executed.into_iter().filter(|query| ours.contains(&query.as_str())) {
        *counts.entry(query).or_default() += 1;
    }
    counts.into_iter().collect()
}

#[test]
fn an_edit_counts_executions_again_only_where_their_number_changes() {
    let counts = |expected: &[(&str, usize)]| -> Vec<(String, usize)> {
        expected.iter().map(|(query, count)| ((*query).to_owned(), *count)).collect()
    };
    assert_eq!(probable("/model.mal", "deployment D {", "// a comment\ndeployment D {"), counts(&[]));
    // A period: the response times of its deployment at each level, and its probabilities.
    let of_deployment = [("probabilities_of", 1), ("response_times", 2)];
    assert_eq!(probable("/model.mal", "period = 10", "period = 11"), counts(&of_deployment));
    // A time at one level: not the number of executions.
    let of_time = [("levelled", 1), ("probabilities_of", 2), ("response_times", 2)];
    assert_eq!(probable("/times.toml", "[2, 3]", "[2, 4]"), counts(&of_time));
    // A program: one component.
    let of_program = [("counts_of", 1), ("probabilities_of", 2), ("response_times", 4)];
    assert_eq!(probable("/parts.mal", "run = { one(); }", "run = { one(); two(); }"), counts(&of_program));
}
