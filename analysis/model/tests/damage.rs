//! Damaged models: one token of the sample robot is taken away, put in, or replaced by a word that means nothing. Where
//! that is an error, whatever still has a response time has at least that of the whole model: nothing is analysed that
//! rests on what was lost. And nothing panics, and the database says what a new one would say.
//!
//! `MAUVE_DAMAGES=20000 cargo test --release -p mauve-model --test damage` tries more.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use mauve_model::diagnostics::{Severity, workspace_diagnostics};
use mauve_model::item_tree::Kind;
use mauve_model::{Database, Query, Workspace, names_of, projects, response_times};
use mauve_timing::{Level, Method, Time};
use salsa::Setter as _;

/// What is put in, or in the place of a token.
const JUNK: [&str; 16] =
    ["qqq", "{", "}", "(", ")", ";", "=", ".", ":", "->", "§", "\"", "/*", "\n", "if", "transition"];

#[test]
fn what_still_has_a_bound_has_at_least_the_old_one() {
    let damages = std::env::var("MAUVE_DAMAGES").map_or(600, |count| count.parse().expect("a number"));
    let texts = sample();
    let mut db = Database::default();
    let workspace = Workspace::of_texts(&db, mauve_tests::models().join("p3dx"), texts.iter().cloned());
    let whole = responses(&db, workspace);
    assert_eq!(whole.values().flatten().count(), 18, "nine activities, both methods");
    let (mut lost, mut kept) = (0, 0);
    for damage in 0..damages {
        let mut random = Random(0x9e37_79b9_7f4a_7c15 ^ (damage + 1_u64).wrapping_mul(0xd134_2543_de82_ef95));
        let (path, text) = &texts[random.below(texts.len())];
        let (damaged, what) = damaged(text, &mut random);
        let file = workspace.file(&db, path).unwrap();
        file.set_text(&mut db).to(damaged.as_str().into());
        let found = workspace_diagnostics(&db, workspace);
        let errors = found.iter().filter(|it| it.diagnostic.code.severity == Severity::Error).count();
        let now = responses(&db, workspace);
        if damage % 16 == 0 {
            let fresh_db = Database::default();
            let fresh = texts
                .iter()
                .map(|(at, text)| (at.clone(), if at == path { damaged.clone() } else { text.clone() }));
            let fresh_workspace = Workspace::of_texts(&fresh_db, workspace.folder(&db).clone(), fresh);
            assert_eq!(now, responses(&fresh_db, fresh_workspace), "{what} in {}", path.display());
            let fresh = workspace_diagnostics(&fresh_db, fresh_workspace);
            let shown = |db: &Database, all: &[mauve_model::diagnostics::Finding<'_>]| -> Vec<_> {
                all.iter().map(|it| (it.diagnostic.at.range(db), it.diagnostic.message.clone())).collect()
            };
            assert_eq!(shown(&db, &found), shown(&fresh_db, &fresh), "{what} in {}", path.display());
        }
        if errors > 0 {
            for (activity, response) in &now {
                match response {
                    None => lost += 1,
                    Some(response) => {
                        kept += 1;
                        let old = whole.get(activity).copied().flatten();
                        assert!(
                            old.is_some_and(|old| *response >= old),
                            "{what} in {}: {activity:?} was {old:?}, is {response:?}",
                            path.display()
                        );
                    }
                }
            }
        }
        file.set_text(&mut db).to(text.as_str().into());
    }
    assert!(
        lost > damages && kept > damages,
        "damage costs something, and not everything: {lost} lost, {kept} kept"
    );
}

/// The models, tables and configuration of the sample robot.
fn sample() -> Vec<(PathBuf, String)> {
    let mut texts = Vec::new();
    let mut open = vec![mauve_tests::models().join("p3dx")];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|it| it == "mal" || it == "toml") {
                texts.push((path.clone(), std::fs::read_to_string(path).unwrap()));
            }
        }
    }
    texts.sort();
    texts
}

type Responses = BTreeMap<(String, String), Option<Time>>;

fn responses(db: &Database, workspace: Workspace) -> Responses {
    let mut responses = BTreeMap::new();
    for method in [Method::Psm, Method::Classic] {
        let level = Level::from_f64(1e-3).unwrap();
        for &project in projects(db, workspace) {
            for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
                let query = Query { level, method, horizon: None };
                for activity in &response_times(db, project, decl, query).activities {
                    let key = (activity.row.instance.to_string(), method.to_string());
                    responses.insert(key, activity.response);
                }
            }
        }
    }
    responses
}

fn damaged(text: &str, random: &mut Random) -> (String, String) {
    let lexed = mauve_syntax::lex(text);
    let token = lexed.range(random.below(lexed.len()));
    let junk = JUNK[random.below(JUNK.len())];
    let (range, put) = match random.below(3) {
        0 => (token, String::new()),
        1 => (token.start..token.start, format!(" {junk} ")),
        _ => (token, junk.to_owned()),
    };
    let line = text[..range.start].matches('\n').count() + 1;
    let what = format!("line {line}: {:?} becomes {put:?}", &text[range.clone()]);
    (format!("{}{put}{}", &text[..range.start], &text[range.end..]), what)
}

struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}
