//! What a hover is, and how a client shows it.

use mauve_hir::{File, Location, ModelDb, Project, is_model, parse};
use mauve_syntax::{SyntaxToken, TextRange, TextSize, tokens_at};

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

/// The place of a hover in a project, and how the client shows it.
#[derive(Clone, Copy)]
pub(super) struct HoverContext<'a, 'db> {
    pub(super) db: &'db dyn ModelDb,
    pub(super) project: Project<'db>,
    pub(super) file: File,
    pub(super) offset: TextSize,
    pub(super) format: HoverFormat<'a>,
}

impl HoverContext<'_, '_> {
    /// Returns the tokens of a model that touch the offset.
    pub(super) fn tokens(&self) -> impl Iterator<Item = SyntaxToken> + use<> {
        let offset = self.offset;
        let root = is_model(self.file.path(self.db)).then(|| parse(self.db, self.file).syntax());
        root.into_iter().flat_map(move |root| tokens_at(&root, offset))
    }

    /// Returns the word of a model at the offset.
    pub(super) fn word(&self) -> Option<SyntaxToken> {
        self.tokens().find(|token| token.kind().is_word())
    }

    /// Returns a name as code; as a link if the client shows links, and the location has an address.
    pub(super) fn link(&self, name: &str, at: &Location<'_>) -> String {
        match self.format {
            HoverFormat::Markdown(links) => markdown::link(self.db, links, name, Some(at)),
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
