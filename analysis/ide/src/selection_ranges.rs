//! Ranges for extending a selection: a word, the node that contains it, and so on, up to the file.

use mauve_hir::{File, ModelDb, is_model, parse};
use mauve_syntax::{
    NodeOrToken, SyntaxElement, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, TextSize, begins_line,
    comments_above, is_gap, next_token, previous_token, tokens_at,
};

/// Returns the selection ranges around `offset`, from the smallest to the whole file, each larger than the one before.
///
/// A word; the contents of a string, then the string; an argument, all arguments, then with their parentheses; a statement or
/// another item, then with the comments directly above it; the contents of a block, then with its braces. Empty for a file that is
/// not a model.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "codel f(a: int): int".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let ranges = mauve_ide::selection_ranges(&db, file, 8.into());
/// let texts: Vec<&str> = ranges.iter().map(|range| &file.text(&db)[*range]).collect();
/// assert_eq!(texts, ["a", "a: int", "(a: int)", "codel f(a: int): int"]);
/// ```
pub fn selection_ranges(db: &dyn ModelDb, file: File, offset: TextSize) -> Vec<TextRange> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let root = parse(db, file).syntax();
    let offset = offset.min(root.text_range().end());
    let mut ranges = Ranges { offset, found: Vec::new() };
    // Between two tokens, prefers the word.
    let token = tokens_at(&root, offset).min_by_key(|token| match token.kind() {
        SyntaxKind::INT_NUMBER | SyntaxKind::FLOAT_NUMBER | SyntaxKind::STRING => 0,
        kind if kind.is_word() => 0,
        SyntaxKind::WHITESPACE => 2,
        _ => 1,
    });
    if let Some(token) = token {
        let mut above = token.parent();
        match token.kind() {
            SyntaxKind::WHITESPACE => {}
            SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT => {
                ranges.word(&token);
                let is_mark = |letter: char| matches!(letter, '/' | '*') || letter.is_whitespace();
                ranges.push(trimmed(&token, is_mark));
                ranges.push(token.text_range());
                let run = run_of_comments(&token);
                ranges.push(run);
                // The comments above an item are a part of it.
                let item = next_node(&token).filter(is_item).map(|item| with_comments(&item));
                if let Some(all) = item.filter(|all| all.contains_range(run)) {
                    ranges.push(all);
                }
            }
            SyntaxKind::STRING | SyntaxKind::UNTERMINATED_STRING => {
                ranges.word(&token);
                ranges.push(trimmed(&token, |letter| letter == '"'));
                ranges.push(token.text_range());
            }
            _ => ranges.push(token.text_range()),
        }
        while let Some(node) = above {
            if let Some((contents, whole)) = contents(&node, offset) {
                ranges.push(contents);
                ranges.push(whole);
            }
            ranges.push(node.text_range());
            if is_item(&node) {
                ranges.push(with_separator(&node));
                ranges.push(with_comments(&node));
            }
            above = node.parent();
        }
    }
    ranges.push(root.text_range());
    if ranges.found.is_empty() {
        ranges.found.push(root.text_range());
    }
    ranges.found
}

struct Ranges {
    offset: TextSize,
    found: Vec<TextRange>,
}

impl Ranges {
    fn push(&mut self, range: TextRange) {
        let is_more = |last: &TextRange| range.contains_range(*last) && range != *last;
        if range.contains_inclusive(self.offset) && self.found.last().map_or(!range.is_empty(), is_more) {
            self.found.push(range);
        }
    }

    fn word(&mut self, token: &SyntaxToken) {
        let text = token.text();
        let at = usize::from(self.offset.checked_sub(token.text_range().start()).unwrap_or_default());
        let (Some(before), Some(after)) = (text.get(..at), text.get(at..)) else { return };
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
        let start = before.trim_end_matches(is_part).len();
        let end = text.len() - after.trim_start_matches(is_part).len();
        self.push(part_of(token, start..end));
    }
}

fn trimmed(token: &SyntaxToken, is_outside: impl Fn(char) -> bool + Copy) -> TextRange {
    let inner = token.text().trim_end_matches(is_outside);
    let before = inner.len() - inner.trim_start_matches(is_outside).len();
    part_of(token, before..inner.len())
}

fn part_of(token: &SyntaxToken, id: std::ops::Range<usize>) -> TextRange {
    let id = TextRange::new(TextSize::new(id.start as u32), TextSize::new(id.end as u32));
    id + token.text_range().start()
}

/// Returns the text between the brackets of a node without surrounding white space, and with the brackets; for a block, braces.
fn contents(node: &SyntaxNode, offset: TextSize) -> Option<(TextRange, TextRange)> {
    let tokens = || node.children_with_tokens().filter_map(NodeOrToken::into_token);
    let of = |open: SyntaxKind, close: SyntaxKind| {
        let open = tokens().find(|token| token.kind() == open)?.text_range();
        let close = tokens().filter(|token| token.kind() == close).last()?.text_range();
        let is_around = open.end() <= offset && offset <= close.start();
        is_around.then_some((open, close))
    };
    let (open, close) = of(SyntaxKind::L_CURLY, SyntaxKind::R_CURLY)
        .or_else(|| of(SyntaxKind::L_PAREN, SyntaxKind::R_PAREN))
        .or_else(|| of(SyntaxKind::L_BRACK, SyntaxKind::R_BRACK))?;
    let inside = node.children_with_tokens().filter(|it| {
        let range = it.text_range();
        it.kind() != SyntaxKind::WHITESPACE && range.start() >= open.end() && range.end() <= close.start()
    });
    let inside = inside.map(|it| it.text_range()).reduce(TextRange::cover);
    Some((inside.unwrap_or(TextRange::empty(offset)), open.cover(close)))
}

fn is_item(node: &SyntaxNode) -> bool {
    node.kind() != SyntaxKind::ERROR
        && node.parent().is_some_and(|list| match list.kind() {
            SyntaxKind::SOURCE_FILE => true,
            _ => {
                let brace = list.children_with_tokens().find(|it| it.kind() == SyntaxKind::L_CURLY);
                brace.is_some_and(|brace| brace.text_range().end() <= node.text_range().start())
            }
        })
}

fn with_separator(item: &SyntaxNode) -> TextRange {
    let sign = siblings_behind(item.clone()).find(|it| it.kind() != SyntaxKind::WHITESPACE);
    let sign = sign.filter(|it| it.kind() == SyntaxKind::SEMICOLON);
    sign.map_or(item.text_range(), |sign| item.text_range().cover(sign.text_range()))
}

fn with_comments(item: &SyntaxNode) -> TextRange {
    comments_above(item).fold(with_separator(item), |range, comment| range.cover(comment.text_range()))
}

fn run_of_comments(comment: &SyntaxToken) -> TextRange {
    let is_line = |it: &SyntaxToken| it.kind() == SyntaxKind::LINE_COMMENT && begins_line(it);
    if !is_line(comment) {
        return comment.text_range();
    }
    let run = |next: fn(&SyntaxToken) -> Option<SyntaxToken>| {
        let tokens = std::iter::successors(next(comment), next);
        tokens.take_while(move |it| is_line(it) || is_gap(it)).filter(is_line)
    };
    let all = run(next_token).chain(run(previous_token));
    all.fold(comment.text_range(), |range, it| range.cover(it.text_range()))
}

fn next_node(comment: &SyntaxToken) -> Option<SyntaxNode> {
    siblings_behind(comment.clone()).find(|it| !it.kind().is_trivia())?.into_node()
}

/// Returns the nodes and tokens of the same parent that follow a node or token.
pub(crate) fn siblings_behind(it: impl Into<SyntaxElement>) -> impl Iterator<Item = SyntaxElement> {
    std::iter::successors(it.into().next_sibling_or_token(), SyntaxElement::next_sibling_or_token)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, broken_models};
    use expect_test::{Expect, expect};

    fn check(text: &str, expected: Expect) {
        let Fixture { db, file, offset, .. } = Fixture::new(text);
        let mut shown = String::new();
        for range in selection_ranges(&db, file, offset) {
            let text = file.text(&db)[range].split_whitespace().collect::<Vec<_>>().join(" ");
            shown += &format!("{text}\n");
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn arguments_statements_blocks() {
        check(
            "core C(S) {
  // Does it.
  update = {
    x = 1;
    /* 🦀 é */ y = f(a + $0b, c);
  }
}
",
            expect![[r#"
                b
                a + b
                a + b, c
                (a + b, c)
                f(a + b, c)
                y = f(a + b, c);
                /* 🦀 é */ y = f(a + b, c);
                x = 1; /* 🦀 é */ y = f(a + b, c);
                { x = 1; /* 🦀 é */ y = f(a + b, c); }
                update = { x = 1; /* 🦀 é */ y = f(a + b, c); }
                // Does it. update = { x = 1; /* 🦀 é */ y = f(a + b, c); }
                { // Does it. update = { x = 1; /* 🦀 é */ y = f(a + b, c); } }
                core C(S) { // Does it. update = { x = 1; /* 🦀 é */ y = f(a + b, c); } }
                core C(S) { // Does it. update = { x = 1; /* 🦀 é */ y = f(a + b, c); } }
            "#]],
        );
    }

    #[test]
    fn features_types_intervals() {
        check(
            "library l { shell S {
  property p: geo::Po$0se [0; 1] = 2; // trailing
  property q: int } }",
            expect![[r#"
                Pose
                geo::Pose
                property p: geo::Pose [0; 1] = 2
                property p: geo::Pose [0; 1] = 2;
                property p: geo::Pose [0; 1] = 2; // trailing property q: int
                { property p: geo::Pose [0; 1] = 2; // trailing property q: int }
                shell S { property p: geo::Pose [0; 1] = 2; // trailing property q: int }
                { shell S { property p: geo::Pose [0; 1] = 2; // trailing property q: int } }
                library l { shell S { property p: geo::Pose [0; 1] = 2; // trailing property q: int } }
            "#]],
        );
        check(
            "shell S { property p: int [0; 1$0] = 2 }",
            expect![[r#"
            1
            0; 1
            [0; 1]
            property p: int [0; 1] = 2
            { property p: int [0; 1] = 2 }
            shell S { property p: int [0; 1] = 2 }
        "#]],
        );
    }

    #[test]
    fn comments_belong_to_what_follows() {
        check(
            "use a

// One two$0 three.
// Four.
codel f(): int
",
            expect![[r#"
                two
                One two three.
                // One two three.
                // One two three. // Four.
                // One two three. // Four. codel f(): int
                use a // One two three. // Four. codel f(): int
            "#]],
        );
        check(
            "use a /* é o$0n */\nuse b\n",
            expect![[r#"
            on
            é on
            /* é on */
            use a /* é on */ use b
        "#]],
        );
    }

    #[test]
    fn strings_white_space_and_brackets() {
        check(
            "include \"parts/las$0er.mal\"\nuse a\n",
            expect![[r#"
            laser
            parts/laser.mal
            "parts/laser.mal"
            include "parts/laser.mal"
            include "parts/laser.mal" use a
        "#]],
        );
        check(
            "shell S {\n  $0\n}\n",
            expect![[r#"
            { }
            shell S { }
            shell S { }
        "#]],
        );
        check(
            "codel f(a: int)$0: int",
            expect![[r#"
            )
            (a: int)
            codel f(a: int): int
        "#]],
        );
    }

    #[test]
    fn an_empty_text() {
        let Fixture { db, file, .. } = Fixture::of_text("");
        assert_eq!(selection_ranges(&db, file, 5.into()), [TextRange::empty(0.into())]);
    }

    #[test]
    fn whatever_the_text_they_grow_up_to_the_file() {
        for text in broken_models(31) {
            let Fixture { db, file, .. } = Fixture::of_text(&text);
            for offset in (0..text.len() + 2).step_by(17) {
                let offset = TextSize::new(offset as u32);
                let ranges = selection_ranges(&db, file, offset);
                assert_eq!(ranges.last(), Some(&TextRange::up_to(TextSize::of(&*text))));
                for pair in ranges.windows(2) {
                    assert!(pair[1].contains_range(pair[0]) && pair[0] != pair[1], "{ranges:?} {text}");
                }
                let inside = offset.min(TextSize::of(&*text));
                assert!(ranges.iter().all(|range| range.contains_inclusive(inside)), "{ranges:?} {text}");
            }
        }
    }
}
