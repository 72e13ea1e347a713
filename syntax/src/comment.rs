//! What is said of a declaration right above it.

use crate::{SyntaxKind, SyntaxNode, SyntaxToken};

/// The comment lines right above a declaration, without what marks them as comments.
///
/// ```
/// let root = mauve_syntax::parse("// Finds a way.\n// Slowly.\ncodel plan(): int").syntax();
/// let codel = root.first_child().unwrap();
/// assert_eq!(mauve_syntax::comment_above(&codel), "Finds a way.\nSlowly.");
/// ```
pub fn comment_above(node: &SyntaxNode) -> String {
    let mut lines = Vec::new();
    let mut before = node.first_token().and_then(|token| token.prev_token());
    while let Some(token) = before {
        match token.kind() {
            SyntaxKind::BLOCK_COMMENT | SyntaxKind::LINE_COMMENT if begins_line(&token) => {
                let text = token.text().trim_start_matches('/').trim_matches('*').trim();
                lines.push(text.trim_end_matches("*/").trim_end().to_owned());
            }
            // An empty line ends the comment, and one behind something else is that one's.
            SyntaxKind::WHITESPACE if token.text().matches('\n').count() < 2 => {}
            _ => break,
        }
        before = token.prev_token();
    }
    lines.reverse();
    lines.join("\n")
}

fn begins_line(token: &SyntaxToken) -> bool {
    let before = token.prev_token();
    before.is_none_or(|before| before.kind() == SyntaxKind::WHITESPACE && before.text().contains('\n'))
}
