//! Damaged models: one token of the sample robot, and of a smaller one, is taken away, put in, or replaced by a word that
//! means nothing, or a line loses its end. Where that is an error, whatever still has a response time has at least that of
//! the whole model: nothing is analysed that rests on what was lost. And nothing panics, and the database says what a new
//! one would say.
//!
//! `MAUVE_DAMAGES=20000 cargo test --release -p mauve-diagnostics --test main damage::` tries more.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Finding, Severity, workspace_diagnostics};
use mauve_hir::{Database, Workspace};
use mauve_tests::{Random, char_boundary};
use mauve_timing::{Level, Method, Time};
use mauve_wcrt::{Query, response_times};

use crate::common::{deployments, sample};

/// What is put in, or in the place of a token.
const JUNK: [&str; 16] =
    ["qqq", "{", "}", "(", ")", ";", "=", ".", ":", "->", "§", "\"", "/*", "\n", "if", "transition"];

/// Everything that costs has a cheap namesake in another library; operations, overrides and overhead have their part.
const NAMESAKES: &str = r#"
include "parts.mal"
library far {
  architecture Base { }
}
architecture Base {
  instance a: near.C
  instance d: C2
}
architecture A {
  import Base
  instance b: far.C
  instance c: far.C
  connection a.out1 -> a.in1
  property a.p = 2
}
component C2(near.S, near.K)
deployment D {
  architecture A
  activity a { affinity = 1 priority = 5 period = 500 deadline = 400 }
  activity b { affinity = 1 priority = 9 period = 500 }
  activity c { priority = 3 affinity = 2 period = 500 }
  activity d { priority = background }
  property a.p = 3
}
//- /parts.mal
library near {
  use far
  codel f(in x: int): int
  codel g(): int
  shell Base { input port in1: int  output port out1: int }
  shell S extends Base {
    property p: int = 1
    provide help(): int
  }
  core K(S) {
    var v: int = 0;
    provide help() = { v = g(); return v; }
    start = { v = 1; }
    statemachine {
      var n: int = 0;
      initial state A {
        run = { if f(v) > 1 then { help(); } else { v = f(2); } }
        transition t if g() > 0 && v < 3 to B { write(out1, v); }
      }
      state B {
        entry = { f(v); }
        exit = { g(); }
        transition back to A
      }
    }
  }
  component C(S, K)
}
library far {
  codel f(in x: int): int
  codel g(): int
  shell S { }
  core K(S) { update = { f(1); g(); } }
  component C(S, K)
}
component C(far.S, far.K)
//- /mauve.toml
[project]
root = "model.mal"
[timing]
tables = ["times.toml", "more.toml"]
significance = 1e-3
[assume]
codel = "1 us"
[lints]
not-deadline-monotonic = "allow"
[platform]
cpus = 2
//- /times.toml
unit = "ms"
levels = [1e-3, 1e-4]
[codel]
"near.f" = [20, 21]
"near.g" = 5
"far.f" = 0.5
"far.g" = 0.25
[overhead]
dispatch = 0.125
context_switch = 0.0625
//- /more.toml
[program]
"near.C/B.entry" = 90
[component]
"near.C" = 120
"#;

#[test]
fn what_still_has_a_bound_has_at_least_the_old_one() {
    let folder = mauve_tests::models().join("p3dx");
    damage(&folder, &sample(), 18);
}

#[test]
fn a_namesake_is_never_taken_instead() {
    let texts: Vec<(PathBuf, String)> =
        mauve_tests::fixture(NAMESAKES).into_iter().map(|(path, text)| (path.into(), text)).collect();
    damage(Path::new("/"), &texts, 6);
}

/// Recovery goes by lines: here each model is one.
#[test]
fn nor_where_everything_stands_on_one_line() {
    let one_line = |(path, text): (String, String)| {
        let text = if path.ends_with(".mal") { text.replace('\n', " ") } else { text };
        (PathBuf::from(path), text)
    };
    let texts: Vec<(PathBuf, String)> = mauve_tests::fixture(NAMESAKES).into_iter().map(one_line).collect();
    damage(Path::new("/"), &texts, 6);
}

fn damage(folder: &Path, texts: &[(PathBuf, String)], analysed: usize) {
    let damages = std::env::var("MAUVE_DAMAGES").map_or(600, |count| count.parse().expect("a number"));
    let mut db = Database::default();
    let workspace = Workspace::of_texts(&db, folder.to_owned(), texts.iter().cloned());
    let whole = responses(&db, workspace);
    let findings = workspace_diagnostics(&db, workspace).into_iter();
    assert_eq!(findings.filter(|finding| finding.severity == Severity::Error).collect::<Vec<_>>(), []);
    assert_eq!(whole.values().flatten().count(), analysed, "activities, for both methods");
    let (mut lost, mut kept) = (0, 0);
    for damage in 0..damages {
        let mut random = Random(0x9e37_79b9_7f4a_7c15 ^ (damage + 1_u64).wrapping_mul(0xd134_2543_de82_ef95));
        let (path, text) = &texts[random.below(texts.len())];
        let (mut damaged, mut what) = damage_once(text, &mut random);
        // Several of them may make another model that means something: then nothing is said of its figures.
        let several = damage % 8 == 7;
        for _ in 0..if several { 1 + random.below(4) } else { 0 } {
            let (twice, more) = damage_once(&damaged, &mut random);
            (damaged, what) = (twice, format!("{what}, {more}"));
        }
        let file = workspace.file(&db, path).unwrap();
        file.set_text(&mut db, damaged.as_str().into());
        let found = workspace_diagnostics(&db, workspace);
        let now = responses(&db, workspace);
        if damage % 16 == 0 {
            let fresh_db = Database::default();
            let fresh = texts
                .iter()
                .map(|(at, text)| (at.clone(), if at == path { damaged.clone() } else { text.clone() }));
            let fresh_workspace = Workspace::of_texts(&fresh_db, workspace.folder(&db).clone(), fresh);
            assert_eq!(now, responses(&fresh_db, fresh_workspace), "{what} in {}", path.display());
            let fresh = workspace_diagnostics(&fresh_db, fresh_workspace);
            let shown = |db: &Database, all: &[Finding<'_>]| -> Vec<_> {
                all.iter().map(|it| (it.diagnostic.at.range(db), it.diagnostic.message.clone())).collect()
            };
            assert_eq!(shown(&db, &found), shown(&fresh_db, &fresh), "{what} in {}", path.display());
        }
        // A codel with another name is another codel, which is no error; in a table everything that is noticed counts.
        let is_error = |it: &Finding<'_>| it.diagnostic.code.severity == Severity::Error;
        let is_noticed = found.iter().any(is_error)
            || found.iter().any(|it| it.severity != Severity::Hint)
                && path.extension().is_some_and(|it| it == "toml");
        if is_noticed && !several {
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
        file.set_text(&mut db, text.as_str().into());
    }
    assert!(
        lost > damages / 4 && kept > damages / 8,
        "damage costs something, and not everything: {lost} lost, {kept} kept"
    );
}

type Responses = BTreeMap<(String, String), Option<Time>>;

fn responses(db: &Database, workspace: Workspace) -> Responses {
    let mut responses = BTreeMap::new();
    for method in [Method::Psm, Method::Classic] {
        let level = Level::from_f64(1e-3).unwrap();
        for (project, deployment) in deployments(db, workspace) {
            let query = Query { level, method, horizon: None };
            for activity in &response_times(db, project, deployment, query).activities {
                let key = (activity.instance.to_string(), method.to_string());
                responses.insert(key, activity.response);
            }
        }
    }
    responses
}

fn damage_once(text: &str, random: &mut Random) -> (String, String) {
    let lexed = mauve_syntax::lex(text);
    let token = lexed.range(random.below(lexed.len().max(1)));
    let junk = JUNK[random.below(JUNK.len())];
    let rest = &text[token.start..];
    let (range, put) = match random.below(4) {
        0 => (token, String::new()),
        1 => (token.start..token.start, format!(" {junk} ")),
        2 => (token, junk.to_owned()),
        // From somewhere in the token on, the line is cut off.
        _ => {
            let cut = char_boundary(rest, random.below(token.len() + 1));
            let end = rest.find('\n').unwrap_or(rest.len()).max(cut);
            (token.start + cut..token.start + end, String::new())
        }
    };
    let line = text[..range.start].matches('\n').count() + 1;
    let what = format!("line {line}: {:?} becomes {put:?}", &text[range.clone()]);
    (format!("{}{put}{}", &text[..range.start], &text[range.end..]), what)
}
