//! White space and comments: the tokens between them, lines, and the comment above a declaration.

use crate::tree::{token_at, token_before};
use crate::{NodeOrToken, SyntaxKind, SyntaxNode, SyntaxToken};

/// Returns the token before `token`.
///
/// Rowan's `prev_token` stops at a node without text, such as the mark of a missing element.
///
/// ```
/// let root = mauve_syntax::parse("codel f(in a: ) : int").syntax();
/// let parenthesis = mauve_syntax::token_at(&root, 14.into()).unwrap();
/// assert_eq!(mauve_syntax::previous_token(&parenthesis).unwrap().text(), " ");
/// ```
pub fn previous_token(token: &SyntaxToken) -> Option<SyntaxToken> {
    token.prev_token().or_else(|| token_before(&root_of(token)?, token.text_range().start()))
}

/// Returns the token after `token`. Rowan's `next_token` stops at a node without text.
pub fn next_token(token: &SyntaxToken) -> Option<SyntaxToken> {
    token.next_token().or_else(|| token_at(&root_of(token)?, token.text_range().end()))
}

fn root_of(token: &SyntaxToken) -> Option<SyntaxNode> {
    token.parent_ancestors().last()
}

/// Returns the nearest token before `token` that is neither white space nor a comment.
pub fn previous_significant(token: &SyntaxToken) -> Option<SyntaxToken> {
    std::iter::successors(previous_token(token), previous_token).find(|it| !it.kind().is_trivia())
}

/// Returns the nearest token after `token` that is neither white space nor a comment.
pub fn next_significant(token: &SyntaxToken) -> Option<SyntaxToken> {
    std::iter::successors(next_token(token), next_token).find(|it| !it.kind().is_trivia())
}

/// Returns the direct child tokens of `node`, without white space and comments.
///
/// ```
/// let root = mauve_syntax::parse("codel /* fast */ f(): int").syntax();
/// let mut tokens = mauve_syntax::significant_tokens(&root.first_child().unwrap());
/// assert_eq!(tokens.next().unwrap().text(), "codel");
/// assert_eq!(tokens.next().unwrap().text(), ":");
/// ```
pub fn significant_tokens(node: &SyntaxNode) -> impl Iterator<Item = SyntaxToken> + use<> {
    let tokens = node.children_with_tokens().filter_map(NodeOrToken::into_token);
    tokens.filter(|token| !token.kind().is_trivia())
}

/// Returns whether only white space precedes `token` on its line.
pub fn begins_line(token: &SyntaxToken) -> bool {
    previous_token(token).is_none_or(|before| {
        before.kind() == SyntaxKind::WHITESPACE
            && (before.text().contains(['\n', '\r']) || previous_token(&before).is_none())
    })
}

/// Returns whether `token` is white space without an empty line.
pub fn is_gap(token: &SyntaxToken) -> bool {
    token.kind() == SyntaxKind::WHITESPACE && token.text().matches('\n').count() < 2
}

/// Returns whether `node` contains a comment.
pub fn has_comment(node: &SyntaxNode) -> bool {
    node.descendants_with_tokens().any(|it| it.kind().is_comment())
}

/// Returns the comments directly above `node`, the nearest first: each one begins its line, without empty lines between
/// them.
pub fn comments_above(node: &SyntaxNode) -> impl Iterator<Item = SyntaxToken> + use<> {
    let first = node.first_token();
    let before = std::iter::successors(first.as_ref().and_then(previous_token), previous_token);
    // A comment after another token belongs to that token.
    before
        .take_while(|token| is_gap(token) || token.kind().is_comment() && begins_line(token))
        .filter(|token| token.kind().is_comment())
}

/// Returns the lines of the comments directly above a declaration, without the comment markers.
///
/// ```
/// let root = mauve_syntax::parse("// Finds a way.\n// Slowly.\ncodel plan(): int").syntax();
/// let codel = root.first_child().unwrap();
/// assert_eq!(mauve_syntax::comment_above(&codel), "Finds a way.\nSlowly.");
/// ```
pub fn comment_above(node: &SyntaxNode) -> String {
    let text_of = |token: SyntaxToken| {
        let text = token.text().trim_start_matches('/').trim_matches('*').trim();
        text.trim_end_matches("*/").trim_end().to_owned()
    };
    let mut lines: Vec<String> = comments_above(node).map(text_of).collect();
    lines.reverse();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Vec<SyntaxToken> {
        let root = crate::parse(text).syntax();
        root.descendants_with_tokens().filter_map(NodeOrToken::into_token).collect()
    }

    #[test]
    fn no_token_is_passed_over() {
        // A missing element is a node without text between two tokens.
        for text in
            ["codel f(in a: ): int", "core C(S) { update = { x = ; y = f(a,); } }", "shell { input", " "]
        {
            let all = tokens(text);
            for pair in all.windows(2) {
                assert_eq!(previous_token(&pair[1]).as_ref(), Some(&pair[0]), "{text}");
                assert_eq!(next_token(&pair[0]).as_ref(), Some(&pair[1]), "{text}");
            }
            assert_eq!(all.first().and_then(previous_token), None);
            assert_eq!(all.last().and_then(next_token), None);
        }
    }

    #[test]
    fn significant_tokens_are_found_over_comments() {
        let all = tokens("use /* a */ // b\n  c");
        let (first, last) = (all.first().unwrap(), all.last().unwrap());
        assert_eq!(next_significant(first).as_ref(), Some(last));
        assert_eq!(previous_significant(last).as_ref(), Some(first));
        assert_eq!(next_significant(last), None);
    }

    #[test]
    fn white_space_alone_may_stand_before_what_begins_a_line() {
        let begins = |text: &str| -> Vec<String> {
            let tokens = tokens(text).into_iter().filter(|it| it.kind() != SyntaxKind::WHITESPACE);
            tokens.filter(begins_line).map(|it| it.text().to_owned()).collect()
        };
        assert_eq!(begins("  use a // b\n  // c\r\n/* d */ use e\ruse f"), ["use", "// c", "/* d */", "use"]);
    }

    #[test]
    fn comments_above_a_declaration() {
        let above = |text: &str| {
            let root = crate::parse(text).syntax();
            comment_above(&root.children().last().unwrap())
        };
        assert_eq!(above("// far\n\n/* a */\n  // b\nuse c"), "a\nb");
        assert_eq!(above("use a // of a\n// of b\nuse b"), "of b");
        assert_eq!(above("use a /* of a */ use b"), "");
        assert!(!crate::is_closed_comment("/*/") && crate::is_closed_comment("/**/"));
    }
}
