//! The syntax of MAUVE: parses a text into a lossless tree.
//!
//! [`parse`] never fails and never loses a byte: the text of the tree is the parsed text. Missing and unexpected text
//! is an [`SyntaxKind::ERROR`] node in the tree, with a [`SyntaxError`] at its position. [`is_whole`] tells whether a
//! node has no error in it.
//!
//! ```
//! let parse = mauve_syntax::parse("deployment D { architecture A  activity pilot { priority = 1 period = 100 } }");
//! assert!(parse.errors().is_empty());
//! assert_eq!(parse.syntax().text(), "deployment D { architecture A  activity pilot { priority = 1 period = 100 } }");
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `mauve.ungram` | the tree: nodes and their children, and the sets of keywords; `generated/` is generated from it |
//! | `lexer.rs` | splits a text into tokens, with logos |
//! | `grammar/` | the handwritten parser: a function for each rule, from tokens to events |
//! | `foreign.rs` | the forms of other languages that the parser recognises |
//! | `parser.rs` | the state of the parser for these functions: markers, recovery, the depth limit |
//! | `tree.rs` | builds rowan's tree from events and tokens, with white space |
//! | `reparse.rs` | reparses an edited text |
//! | `ast.rs` | the typed view |
//! | `format.rs` | formats white space |
//! | `trivia.rs` | white space and comments between tokens, and the comment above a declaration |
//! | `spelling.rs` | finds the intended word of a misspelling |
//!
//! This crate does not depend on the database, an editor protocol or any analysis.

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
pub use tree::{Parse, is_whole, token_at, token_before, tokens_at};
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

/// A node of the tree, with its position in the file.
pub type SyntaxNode = rowan::SyntaxNode<Mauve>;
/// A token of the tree, with its position in the file.
pub type SyntaxToken = rowan::SyntaxToken<Mauve>;
/// A node or a token.
pub type SyntaxElement = rowan::SyntaxElement<Mauve>;

/// The maximal length of a text that is parsed, in bytes: offsets in a tree are 32-bit numbers.
pub const LONGEST_TEXT: usize = u32::MAX as usize / 2;

/// Parses a file. Any text gives a tree with the same text.
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
