//! Where a block comment ends.

/// Takes a block comment after its `/*`, up to the first `*/` or to the end.
pub(crate) fn block_comment<'s, Token: logos::Logos<'s, Source = str>>(lexer: &mut logos::Lexer<'s, Token>) {
    let rest = lexer.remainder();
    lexer.bump(rest.find("*/").map_or(rest.len(), |at| at + 2));
}

/// Returns whether a text that begins with `/*` ends with the `*/` that closes it.
pub fn is_closed_comment(text: &str) -> bool {
    text.len() >= 4 && text.ends_with("*/")
}
