//! What an edit costs, without clocks: the queries that are executed and verified, and the nodes of programs that are lowered and
//! executed, compared with `work.txt`. A tenth more than there fails, and so does an edit that is not there.
//!
//! `UPDATE_EXPECT=1` writes the file.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Log, Workspace, names_of, projects};
use mauve_tests::axes::Axis;
use mauve_tests::{Counting, counting_project, generated_project, models, texts_moved};
use mauve_wcrt::{Query, response_times};
use salsa::Durability;

type Texts = Vec<(PathBuf, String)>;

fn texts(files: Vec<(String, String)>) -> Texts {
    files.into_iter().map(|(path, text)| (path.into(), text)).collect()
}

/// The edits of each project: the file, what is replaced there, in its middle, and by what.
fn edits() -> Vec<(&'static str, Texts, Vec<[&'static str; 3]>)> {
    let counters = |files, states| texts(counting_project(Counting::Counters, files, states));
    let modes = |files, states| texts(counting_project(Counting::Modes, files, states));
    let literal = "count = count + 1;";
    let period = ["/root.mal", "period = 100 ", "period = 101 "];
    let sample = |name: &str| texts_moved(&models().join(name), "/");
    vec![
        (
            "counters, 200 states",
            counters(1, 200),
            vec![
                ["/part0.mal", literal, "count = count + 2;"],
                ["/part0.mal", "    state", "    // so\n    state"],
            ],
        ),
        ("counters, 2000 states", counters(1, 2000), vec![["/part0.mal", literal, "count = count + 2;"]]),
        (
            "counters in a chain, 100 files",
            counters(100, 10),
            vec![["/part50.mal", literal, "count = count + 2;"], period],
        ),
        ("modes, 100 states", modes(1, 100), vec![["/part0.mal", "count >= 3", "count >= 4"]]),
        (
            "modes, lock, chain, 40 files",
            modes(40, 10),
            vec![["/part20.mal", "count >= 3", "count >= 4"], period],
        ),
        (
            "300 files",
            texts(generated_project(300, 30_000)),
            vec![
                ["/part150.mal", "sense(value + ", "sense(value + 1"],
                ["/root.mal", "period = 20 ", "period = 30 "],
            ],
        ),
        (
            "300 activities",
            texts((Axis::named("activities").project)(300)),
            vec![["/model.mal", "period = 20 ", "period = 30 "]],
        ),
        ("sample robot", sample("p3dx"), vec![["/deployment.mal", "period = 1000", "period = 2000"]]),
    ]
}

fn show(db: &Database, workspace: Workspace) {
    workspace_diagnostics(db, workspace);
    for &project in projects(db, workspace) {
        for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
            response_times(db, project, decl, Query::shown(db, project, decl));
        }
    }
}

/// Replaces a text in the middle of a file, and back; returns what the two cost.
fn cost(texts: &Texts, [path, from, to]: [&str; 3]) -> [usize; 3] {
    let mut db = Database::with_log();
    let workspace = Workspace::of_texts(&db, "/".into(), texts.iter().cloned());
    let file = workspace.file(&db, Path::new(path)).unwrap();
    // As for a server: the other files are closed.
    for other in workspace.files(&db).values().copied().filter(|it| *it != file).collect::<Vec<_>>() {
        let text = other.text(&db).clone();
        other.set_text_with(&mut db, text, Durability::HIGH);
    }
    show(&db, workspace);
    let old = file.text(&db).to_string();
    let middle = mauve_tests::char_boundary(&old, old.len() / 2);
    let at = old[middle..].find(from).map(|at| middle + at).or_else(|| old.find(from));
    let at = at.unwrap_or_else(|| panic!("no `{from}` in {path}"));
    let new = format!("{}{to}{}", &old[..at], &old[at + from.len()..]);
    db.take_log();
    for text in [new, old] {
        file.set_text(&mut db, text.into());
        show(&db, workspace);
    }
    let Log { executed, verified, nodes } = db.take_log();
    [executed.len(), verified.len(), nodes]
}

#[test]
fn no_edit_costs_a_tenth_more_than_before() {
    let mut found = String::from("# executed verified nodes\n");
    for (project, texts, edits) in edits() {
        for edit in edits {
            let [executed, verified, nodes] = cost(&texts, edit);
            let _ = writeln!(found, "{executed:6} {verified:6} {nodes:6}  {project}: {}", edit[1].trim());
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/work.txt");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let rows = |text: &str| -> BTreeMap<String, Vec<usize>> {
        let row = |line: &str| {
            let mut words = line.split_whitespace();
            let figures = words.by_ref().take(3).map(|it| it.parse().unwrap()).collect();
            (words.collect::<Vec<_>>().join(" "), figures)
        };
        text.lines().filter(|line| !line.starts_with('#')).map(row).collect()
    };
    let expected = rows(&std::fs::read_to_string(&path).unwrap());
    for (edit, costs) in rows(&found) {
        let most = expected.get(&edit).unwrap_or_else(|| panic!("work.txt has no row for {edit}:\n{found}"));
        let is_within = costs.iter().zip(most).all(|(cost, most)| *cost <= most + most / 10);
        assert!(is_within, "{edit}: {costs:?}, at most a tenth more than {most:?}\n{found}");
    }
}
