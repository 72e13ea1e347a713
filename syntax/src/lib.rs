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
//! | `grammar.rs`, `grammar/` | the handwritten parser: a function for each rule, from tokens to events |
//! | `foreign.rs` | the forms of C++ and other languages that the parser recognises |
//! | `list.rs` | the kinds of list, and the keywords of their items |
//! | `parser.rs` | the state of the parser for these functions: markers, recovery, the depth limit |
//! | `tree.rs` | builds rowan's tree from events and tokens, with white space |
//! | `reparse.rs` | reparses an edited text |
//! | `ast.rs` | the typed view |
//! | `format.rs`, `format/` | formats white space |
//! | `comment.rs` | where a block comment ends |
//! | `conflict.rs` | the regions that git marks where it cannot merge two texts |
//! | `trivia.rs` | white space and comments between tokens, and the comment above a declaration |
//! | `spelling.rs` | finds the intended word of a misspelling |
//!
//! This crate does not depend on the database, an editor protocol or any analysis.

pub mod ast;
mod comment;
mod conflict;
mod error;
mod foreign;
pub mod format;
mod generated;
mod grammar;
mod lexer;
mod list;
mod parser;
mod reparse;
mod spelling;
mod tree;
mod trivia;

pub use comment::is_closed_comment;
pub use conflict::conflicts;
pub use error::{Expected, SyntaxError, SyntaxErrorKind, TokenError};
pub use foreign::Foreign;
pub use generated::keywords;
pub use generated::kinds::SyntaxKind;
pub use generated::{Mauve, SyntaxElement, SyntaxNode, SyntaxToken};
pub use grammar::{LONGEST_TEXT, parse};
pub use lexer::{Lexed, lex};
pub use list::item_keywords;
pub use parser::DEEPEST;
pub use reparse::Tier;
pub use rowan::{GreenNode, NodeOrToken, TextRange, TextSize, WalkEvent};
pub use spelling::{is_nearest, is_within, similar};
pub use tree::{Parse, is_whole, token_at, token_before, tokens_at};
pub use trivia::{
    begins_line, comment_above, comments_above, has_comment, is_gap, next_significant, next_token,
    previous_significant, previous_token, significant_tokens,
};
