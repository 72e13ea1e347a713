//! What holds for any text: run by `cargo fuzz`, and on a bounded number of texts by `analysis/model/tests/fuzz.rs`.

use mauve_model::diagnostics::workspace_diagnostics;
use mauve_model::{Database, Workspace};
use mauve_syntax::format::formatted;
use mauve_syntax::{SyntaxKind, is_whole};

/// No byte is lost, every error lies in the text, and what is lost is marked.
pub(crate) fn parse(text: &str) {
    let parse = mauve_syntax::parse(text);
    assert_eq!(parse.syntax().text(), text);
    assert_eq!(is_whole(&parse.syntax()), parse.errors().is_empty());
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
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text.to_owned())]);
    for finding in workspace_diagnostics(&db, workspace) {
        let related = finding.diagnostic.related.iter().map(|(at, _)| at);
        let edits = finding.diagnostic.fixes.iter().flat_map(|fix| &fix.edits).map(|(at, _)| at);
        for at in [&finding.diagnostic.at].into_iter().chain(related).chain(edits) {
            let range = std::ops::Range::<usize>::from(at.range(&db));
            assert!(text.get(range).is_some(), "{:?}", finding.diagnostic);
        }
    }
}
