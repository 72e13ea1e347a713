//! What holds for any text: run by `cargo fuzz`, and on a bounded number of texts by `analysis/diagnostics/tests/fuzz.rs`.

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, Workspace, read_message};
use mauve_syntax::format::formatted;
use mauve_syntax::{SyntaxError, SyntaxErrorKind, SyntaxKind, is_whole};
use mauve_timing::Method;
use mauve_timing::task_set::{Notation, TaskSet};
use mauve_wcrt::{Query, response_times_of};

/// No byte is lost, every error lies in the text, and what is lost is marked.
pub(crate) fn parse(text: &str) {
    let parse = mauve_syntax::parse(text);
    assert_eq!(parse.syntax().text(), text);
    // A conflict in a comment is an error in a complete tree.
    let is_conflict = |error: &SyntaxError| matches!(error.kind, SyntaxErrorKind::Conflict { .. });
    let is_conflict_only = parse.errors().iter().all(is_conflict);
    assert!(if is_whole(&parse.syntax()) { is_conflict_only } else { !parse.errors().is_empty() });
    for error in parse.errors() {
        let range = std::ops::Range::<usize>::from(error.range);
        assert!(text.get(range).is_some(), "{error:?}");
    }
}

/// The tree of an edited text is the one of a full parse. `text` has two parts, divided by a zero.
pub(crate) fn reparse(text: &str) {
    let (old, new) = text.split_once('\0').unwrap_or((text, ""));
    assert_eq!(mauve_syntax::parse(old).reparse(old, new), mauve_syntax::parse(new));
}

/// A formatted text stays as it is, and its tree is the old one but for white space.
pub(crate) fn format(text: &str) {
    let once = formatted(text);
    assert_eq!(formatted(&once), once);
    assert_eq!(tokens(&once), tokens(text));
}

/// The tokens and nodes of a text, but for white space.
fn tokens(text: &str) -> Vec<(SyntaxKind, String)> {
    let root = mauve_syntax::parse(text).syntax();
    let all = root.descendants_with_tokens().filter(|it| it.kind() != SyntaxKind::WHITESPACE);
    let text_of = |it: &mauve_syntax::SyntaxElement| {
        it.as_token().map_or("", |token| token.text().trim_end()).to_owned()
    };
    all.map(|it| (it.kind(), text_of(&it))).collect()
}

/// Whatever a model says, everything that is wrong in it has a place in it.
pub(crate) fn check(text: &str) {
    findings_have_places(&[("/a.mal", text)]);
}

/// The same holds for a configuration.
pub(crate) fn config(text: &str) {
    findings_have_places(&[("/mauve.toml", text), ("/a.mal", ROBOT), ("/t.toml", TABLE)]);
}

/// The same holds for a timing table.
pub(crate) fn table(text: &str) {
    findings_have_places(&[
        ("/mauve.toml", "timing.tables = [\"t.toml\"]"),
        ("/a.mal", ROBOT),
        ("/t.toml", text),
    ]);
}

const ROBOT: &str = "library l { codel f(in a: int): int  shell S { }  core K(S) { var v: int = 0  statemachine { \
    initial state A { run = { v = f(v); } transition go if v == f(1) to B } state B { } } }  component C(S, K) } \
    architecture A { instance a: l.C  instance b: l.C } deployment D { architecture A \
    activity a { affinity = 1 priority = 2 period = 10 } activity b { affinity = 1 priority = 1 period = 30 } }";

const TABLE: &str = "levels = [1e-3, 1e-4]\n[codel]\n\"l.f\" = [1, 2]\n";

fn findings_have_places(texts: &[(&str, &str)]) {
    let db = Database::default();
    let texts = texts.iter().map(|(path, text)| ((*path).into(), (*text).to_owned()));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    for finding in workspace_diagnostics(&db, workspace) {
        let related = finding.diagnostic.related.iter().map(|(at, _)| at);
        let edits = finding.diagnostic.fixes.iter().flat_map(|fix| &fix.edits).map(|(at, _)| at);
        for at in [&finding.diagnostic.at].into_iter().chain(related).chain(edits) {
            let range = std::ops::Range::<usize>::from(at.range(&db));
            assert!(at.file(&db).text(&db).get(range).is_some(), "{:?}", finding.diagnostic);
        }
    }
}

/// What is read of a `.msg` text says the same when it is read again.
pub(crate) fn message(text: &str) {
    let message = read_message(text);
    let fields = message.fields.iter().map(ToString::to_string);
    let again: Vec<String> = fields.chain(message.constants.iter().map(ToString::to_string)).collect();
    let read = read_message(&again.join("\n"));
    assert_eq!((read.fields, read.constants), (message.fields, message.constants));
}

/// A task set that is read is written as it was, and analysed at each of its levels.
pub(crate) fn task_set(text: &str) {
    for notation in [Notation::Json, Notation::Toml, Notation::Csv] {
        let Ok(set) = TaskSet::parse(text, notation) else { continue };
        assert_eq!(TaskSet::parse(&set.to_json(), Notation::Json).as_ref(), Ok(&set));
        for &level in set.levels.iter().chain([&set.level()]) {
            let query = Query { level, method: Method::Best };
            assert!(response_times_of(&set, query).is_ok() || !set.levels.contains(&level));
        }
    }
}
