//! The syntax of MAUVE: text in, lossless tree out.
//!
//! [`parse`] never fails and never loses a byte: the text of the tree is the text that was parsed, whatever it was.
//! What is missing or fits nowhere is an [`SyntaxKind::ERROR`] node in the tree, at the place, and a [`SyntaxError`]
//! beside it, so that whoever reads a part of the tree can ask whether anything was lost in it ([`is_whole`]).
//!
//! ```
//! let parse = mauve_syntax::parse("deployment D { architecture A  activity pilot { priority = 1 period = 100 } }");
//! assert!(parse.errors().is_empty());
//! assert_eq!(parse.syntax().text(), "deployment D { architecture A  activity pilot { priority = 1 period = 100 } }");
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `mauve.ungram` | the tree: nodes and what stands in them, and the sets of keywords; `generated/` is made from it |
//! | `lexer.rs` | text → tokens, by logos |
//! | `grammar/` | tokens → events, a function for each rule, by hand |
//! | `foreign.rs` | the forms of other languages that the parser recognises |
//! | `parser.rs` | what those functions are written with: markers, recovery, the cap on depth |
//! | `tree.rs` | events and tokens → rowan's tree, with the white space back in its place |
//! | `reparse.rs` | an edit of a text → an edit of its tree |
//! | `ast.rs` | the typed view |
//! | `format.rs` | white space as it should be |
//! | `trivia.rs` | white space and comments between tokens, and the comment above a declaration |
//! | `spelling.rs` | what a misspelt word may be |
//!
//! This crate knows no database, no editor protocol and no analysis of any kind.

pub mod ast;
mod error;
mod foreign;
pub mod format;
mod generated;
mod grammar;
mod lexer;
mod parser;
mod reparse;
mod spelling;
mod tree;
mod trivia;

pub use error::{Expected, SyntaxError, SyntaxErrorKind, TokenError};
pub use foreign::Foreign;
pub use generated::keywords;
pub use generated::kinds::SyntaxKind;
pub use lexer::{Lexed, lex};
pub use parser::{DEEPEST, List};
pub use reparse::Tier;
pub use rowan::{GreenNode, NodeOrToken, TextRange, TextSize, WalkEvent};
pub use spelling::{is_nearest, is_within, similar};
pub use tree::{Parse, is_whole, token_at, token_before};
pub use trivia::{
    begins_line, comment_above, comments_above, has_comment, is_closed_comment, is_gap, next_significant,
    next_token, previous_significant, previous_token, significant_tokens,
};

/// Ties rowan's untyped kinds to [`SyntaxKind`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mauve {}

impl rowan::Language for Mauve {
    type Kind = SyntaxKind;

    fn kind_from_raw(raw: rowan::SyntaxKind) -> SyntaxKind {
        SyntaxKind::ALL.get(usize::from(raw.0)).copied().unwrap_or(SyntaxKind::ERROR)
    }

    fn kind_to_raw(kind: SyntaxKind) -> rowan::SyntaxKind {
        rowan::SyntaxKind(kind as u16)
    }
}

/// A node of the tree, with its place in the file.
pub type SyntaxNode = rowan::SyntaxNode<Mauve>;
/// A token of the tree, with its place in the file.
pub type SyntaxToken = rowan::SyntaxToken<Mauve>;
/// A node or a token.
pub type SyntaxElement = rowan::SyntaxElement<Mauve>;

/// The longest text that is parsed, in bytes: places in a tree are 32-bit numbers.
pub const LONGEST_TEXT: usize = u32::MAX as usize / 2;

/// Parses a whole file. Any text gives a tree, and the tree's text is that text.
///
/// A text of more than [`LONGEST_TEXT`] bytes gives an empty tree with one error.
pub fn parse(text: &str) -> Parse {
    if text.len() > LONGEST_TEXT {
        return tree::too_long();
    }
    let lexed = lex(text);
    let mut parser = parser::Parser::new(text, &lexed);
    grammar::source_file(&mut parser);
    tree::build(text, &lexed, parser.finish())
}
