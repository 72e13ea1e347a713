//! Folding ranges: blocks, lists, comments, groups of includes and uses, regions.

use mauve_hir::{File, ModelDb, is_model, parse};
use mauve_syntax::{
    NodeOrToken, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, WalkEvent, begins_line, is_gap,
};

use crate::selection_ranges::siblings_behind;

/// A range of several lines that an editor can fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoldingRange {
    /// The hidden text: the text between the braces of a block, otherwise all lines but the first.
    pub range: TextRange,
    /// Its kind.
    pub kind: FoldingKind,
}

/// The kind of a folding range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoldingKind {
    /// `{ … }`, `( … )`.
    Block,
    /// A comment of several lines, or consecutive `//` comments.
    Comment,
    /// Consecutive includes or uses.
    Imports,
    /// From `// region` to `// endregion`.
    Region,
}

/// Returns the folding ranges of a file, in text order and properly nested.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "shell S {\n  property p: int\n}\n".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let folds = mauve_ide::folding_ranges(&db, file);
/// assert_eq!(&file.text(&db)[folds[0].range], "\n  property p: int\n");
/// ```
pub fn folding_ranges(db: &dyn ModelDb, file: File) -> Vec<FoldingRange> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let text: &str = file.text(db);
    let mut finder = FoldFinder { text, found: Vec::new(), regions: Vec::new(), passed: 0.into() };
    for event in parse(db, file).syntax().preorder_with_tokens() {
        db.unwind_if_revision_cancelled();
        match event {
            WalkEvent::Enter(NodeOrToken::Node(node)) => finder.node(&node),
            WalkEvent::Enter(NodeOrToken::Token(token)) => finder.token(&token),
            WalkEvent::Leave(_) => {}
        }
    }
    nested(db, finder.found)
}

struct FoldFinder<'a> {
    text: &'a str,
    found: Vec<FoldingRange>,
    regions: Vec<TextRange>,
    /// The offset up to which comments and includes have been visited.
    passed: mauve_syntax::TextSize,
}

impl FoldFinder<'_> {
    fn push(&mut self, range: TextRange, kind: FoldingKind) {
        if self.text.get(std::ops::Range::<usize>::from(range)).is_some_and(|text| text.contains('\n')) {
            self.found.push(FoldingRange { range, kind });
        }
    }

    fn node(&mut self, node: &SyntaxNode) {
        if let Some((open, close)) = brackets(node) {
            let inside = TextRange::new(open.text_range().end(), close.text_range().start());
            self.push(inside, FoldingKind::Block);
        }
        let is_import = matches!(node.kind(), SyntaxKind::INCLUDE | SyntaxKind::USE);
        if is_import && node.text_range().start() >= self.passed {
            let mut last = node.clone();
            while let Some(next) = follower(&last).filter(|next| next.kind() == node.kind()) {
                last = next;
            }
            self.passed = last.text_range().end();
            let range = TextRange::new(node.text_range().end(), last.text_range().end());
            self.push(range, FoldingKind::Imports);
        }
    }

    fn token(&mut self, token: &SyntaxToken) {
        match token.kind() {
            SyntaxKind::BLOCK_COMMENT => {
                let first_line = token.text().find(['\r', '\n']).unwrap_or_default() as u32;
                let start = token.text_range().start() + mauve_syntax::TextSize::new(first_line);
                self.push(TextRange::new(start, token.text_range().end()), FoldingKind::Comment);
            }
            SyntaxKind::LINE_COMMENT => {
                if let Some(is_begin) = marker(token.text()) {
                    self.marker(token, is_begin);
                } else if token.text_range().start() >= self.passed && begins_line(token) {
                    let mut last = token.clone();
                    while let Some(next) = comment_below(&last).filter(|next| marker(next.text()).is_none()) {
                        last = next;
                    }
                    self.passed = self.passed.max(last.text_range().end());
                    let range = TextRange::new(token.text_range().end(), last.text_range().end());
                    self.push(range, FoldingKind::Comment);
                }
            }
            _ => {}
        }
    }

    fn marker(&mut self, token: &SyntaxToken, is_begin: bool) {
        if is_begin {
            self.regions.push(token.text_range());
        } else if let Some(begin) = self.regions.pop() {
            let range = TextRange::new(begin.end(), token.text_range().end());
            self.push(range, FoldingKind::Region);
        }
    }
}

fn brackets(node: &SyntaxNode) -> Option<(SyntaxToken, SyntaxToken)> {
    let tokens = || node.children_with_tokens().filter_map(NodeOrToken::into_token);
    // The parentheses of a core are not folded.
    for (open, close) in
        [(SyntaxKind::L_CURLY, SyntaxKind::R_CURLY), (SyntaxKind::L_PAREN, SyntaxKind::R_PAREN)]
    {
        if let Some(open) = tokens().find(|token| token.kind() == open) {
            let close = tokens().filter(|token| token.kind() == close).last()?;
            return (open.text_range().end() <= close.text_range().start()).then_some((open, close));
        }
    }
    None
}

fn follower(node: &SyntaxNode) -> Option<SyntaxNode> {
    let is_gap = |token: &SyntaxToken| {
        is_gap(token)
            || token.kind() == SyntaxKind::SEMICOLON
            || token.kind() == SyntaxKind::LINE_COMMENT && !begins_line(token)
    };
    siblings_behind(node.clone()).find(|it| !it.as_token().is_some_and(is_gap))?.into_node()
}

fn comment_below(comment: &SyntaxToken) -> Option<SyntaxToken> {
    let white = comment.next_token().filter(|white| white.kind() == SyntaxKind::WHITESPACE)?;
    let is_next_line = white.text().matches('\n').count() == 1;
    white.next_token().filter(|next| is_next_line && next.kind() == SyntaxKind::LINE_COMMENT)
}

/// Returns whether a comment begins or ends a region.
fn marker(comment: &str) -> Option<bool> {
    let word = comment.trim_start_matches('/').trim_start();
    let word =
        word.strip_prefix('#').unwrap_or(word).split(|letter: char| !letter.is_alphanumeric()).next()?;
    match word {
        "region" => Some(true),
        "endregion" => Some(false),
        _ => None,
    }
}

/// Sorts the ranges and drops those that partly overlap others: regions that cross a block.
fn nested(db: &dyn ModelDb, mut found: Vec<FoldingRange>) -> Vec<FoldingRange> {
    // Blocks are properly nested, so they win against regions.
    let (regions, mut kept): (Vec<_>, Vec<_>) =
        found.drain(..).partition(|fold| fold.kind == FoldingKind::Region);
    for region in regions {
        db.unwind_if_revision_cancelled();
        let crosses = |other: &FoldingRange| {
            let (one, two) = (region.range, other.range);
            one.intersect(two).is_some_and(|both| !both.is_empty() && both != one && both != two)
        };
        if !kept.iter().any(crosses) {
            kept.push(region);
        }
    }
    kept.sort_by_key(|fold| (fold.range.start(), std::cmp::Reverse(fold.range.end())));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, broken_models};
    use expect_test::{Expect, expect};

    fn check(text: &str, expected: Expect) {
        let Fixture { db, file, .. } = Fixture::of_text(text);
        let line = |offset: mauve_syntax::TextSize| text[..offset.into()].matches('\n').count() + 1;
        let mut shown = String::new();
        for fold in folding_ranges(&db, file) {
            let hidden = text[fold.range].split_whitespace().collect::<Vec<_>>().join(" ");
            let (start, end) = (line(fold.range.start()), line(fold.range.end()));
            shown += &format!("{start}–{end} {:?} | {hidden}\n", fold.kind);
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn blocks_and_lists() {
        check(
            "library robot {
  codel plan(
    in goal: int,
    out path: int
  ): bool
  core C(S) {
    update = { if (a) then {
      x = 1;
    } else {
      f(1,
        2);
    } }
  }
  component P(S, C)
}
",
            expect![[r#"
                1–15 Block | codel plan( in goal: int, out path: int ): bool core C(S) { update = { if (a) then { x = 1; } else { f(1, 2); } } } component P(S, C)
                2–5 Block | in goal: int, out path: int
                6–13 Block | update = { if (a) then { x = 1; } else { f(1, 2); } }
                7–12 Block | if (a) then { x = 1; } else { f(1, 2); }
                7–9 Block | x = 1;
                9–12 Block | f(1, 2);
                10–11 Block | 1, 2
            "#]],
        );
    }

    #[test]
    fn comments_and_imports() {
        check(
            "/* é
   🦀 */ // not by itself
// one
  // two

// alone
include \"a.mal\"
include \"b.mal\" // why

include \"c.mal\"
use a
use b;
use c
",
            expect![[r#"
                1–2 Comment | 🦀 */
                3–4 Comment | // two
                7–8 Imports | include "b.mal"
                11–13 Imports | use b; use c
            "#]],
        );
    }

    #[test]
    fn regions_in_comments_fold() {
        check(
            "// region Codels
codel f(): int
// #region more
codel g(): int
// #endregion
// endregion
// region crossing
shell S {
  // endregion
}
// endregion too many
",
            expect![[r#"
                1–6 Region | codel f(): int // #region more codel g(): int // #endregion // endregion
                3–5 Region | codel g(): int // #endregion
                8–10 Block | // endregion
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            "shell S {
  property p:
  input port
}
core C(S) {
  update = {
    f(
",
            expect![[r#"
                1–4 Block | property p: input port
            "#]],
        );
        check(
            "/* not\nclosed",
            expect![[r#"
            1–2 Comment | closed
        "#]],
        );
    }

    #[test]
    fn whatever_the_text_they_nest() {
        for text in broken_models(23) {
            let Fixture { db, file, .. } = Fixture::of_text(&text);
            let folds = folding_ranges(&db, file);
            for (index, fold) in folds.iter().enumerate() {
                assert!(text[fold.range].contains('\n'), "{fold:?}");
                for other in &folds[index + 1..] {
                    assert!(fold.range.start() <= other.range.start(), "{fold:?} {other:?} {text}");
                    let apart = fold.range.end() <= other.range.start();
                    assert!(apart || fold.range.contains_range(other.range), "{fold:?} {other:?} {text}");
                }
            }
        }
    }
}
