//! The typed view of the tree: a struct for each node of `mauve.ungram`, with an accessor for each child.
//!
//! Any child may be missing in an incomplete text: each accessor returns an `Option`, and [`is_whole`](crate::is_whole)
//! tells whether a node is complete.

use crate::keywords::{ActivityField, Direction};
use crate::{SyntaxKind, SyntaxToken, TextRange};

pub use crate::generated::AstNode;
pub use crate::generated::nodes::*;
pub(crate) use crate::generated::{child, children, nth_child, token};

impl Param {
    /// Returns the direction of a parameter; `in` by default.
    pub fn direction(&self) -> Direction {
        let keyword = self.own_token();
        keyword.and_then(|token| Direction::from_kind(token.kind())).unwrap_or(Direction::In)
    }
}

impl Field {
    /// Returns the field that it gives a value; `None` if no field has its name.
    pub fn field(&self) -> Option<ActivityField> {
        ActivityField::from_keyword(&self.name_ref()?.syntax().text().to_string())
    }

    /// Returns the range of its value, with the unit of a rate.
    pub fn value_range(&self) -> Option<TextRange> {
        let list = self.value_list().map(|list| list.syntax().text_range());
        let value = self.expr().map(|value| value.syntax().text_range()).or(list)?;
        Some(token(self.syntax(), SyntaxKind::IDENT).map_or(value, |unit| value.cover(unit.text_range())))
    }
}

impl ValueList {
    /// Returns the word before it: `any` or `all`.
    pub fn word(&self) -> Option<SyntaxToken> {
        token(self.syntax(), SyntaxKind::IDENT)
    }
}

impl Include {
    /// Returns the path between the quotes, with resolved escapes; none if the string is unclosed.
    pub fn path(&self) -> Option<String> {
        self.string_token().map(|token| unescape(token.text()))
    }
}

/// Returns the value of a string literal: the text between its quotes, with `\"`, `\\`, `\n` and `\t` resolved.
///
/// ```
/// assert_eq!(mauve_syntax::ast::unescape(r#""a\"b\\""#), "a\"b\\");
/// ```
pub fn unescape(literal: &str) -> String {
    let inner = literal.strip_prefix('"').unwrap_or(literal);
    let mut out = String::with_capacity(inner.len());
    let mut letters = inner.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '"' => break,
            '\\' => match letters.next() {
                Some('n') => out.push('\n'),
                Some('t') => out.push('\t'),
                Some(other) => out.push(other),
                None => {}
            },
            _ => out.push(letter),
        }
    }
    out
}
