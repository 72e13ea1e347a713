//! The tree-sitter grammar of MAUVE as a crate: its tests compare the generated parser with `mauve-syntax`.
//!
//! Editors do not use this crate. They compile `src/parser.c` themselves.

use tree_sitter_language::LanguageFn;

#[expect(unsafe_code, reason = "the generated parser is in C")]
mod parser {
    use tree_sitter_language::LanguageFn;

    // SAFETY: `src/parser.c` defines this function; it has no preconditions.
    unsafe extern "C" {
        fn tree_sitter_mauve() -> *const ();
    }

    // SAFETY: tree-sitter generated the function.
    pub(super) const LANGUAGE: LanguageFn = unsafe { LanguageFn::from_raw(tree_sitter_mauve) };
}

/// The language, for `tree_sitter::Parser::set_language`.
pub const LANGUAGE: LanguageFn = parser::LANGUAGE;
