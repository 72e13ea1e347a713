//! What a hover is, and how a client shows it.

use mauve_hir::{Location, ModelDb};
use mauve_syntax::TextRange;

use crate::markdown::{self, Links};

/// A hover.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hover {
    /// The text that it describes.
    pub range: TextRange,
    /// Its content in Markdown.
    pub markdown: String,
}

/// How a client shows a hover.
#[derive(Clone, Copy)]
pub enum HoverFormat<'a> {
    /// Rendered Markdown, in which names may be links.
    Markdown(Links<'a>),
    /// The text as it is: no tables, no links.
    Text,
}

impl HoverFormat<'_> {
    /// Returns a name as code; as a link if the client shows links, and the location has an address.
    pub(super) fn link(self, db: &dyn ModelDb, name: &str, at: &Location<'_>) -> String {
        match self {
            HoverFormat::Markdown(links) => markdown::link(db, links, name, Some(at)),
            HoverFormat::Text => markdown::code(name),
        }
    }
}

/// Truncates a list to its first lines, and the number of the others.
pub(super) fn and_more(mut lines: Vec<String>, most: usize) -> Vec<String> {
    if let Some(more) = lines.len().checked_sub(most).filter(|more| *more > 0) {
        lines.truncate(most);
        lines.push(format!("and {more} more"));
    }
    lines
}
