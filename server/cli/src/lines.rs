//! Lines and columns of locations, from 1.

use std::path::Path;

use mauve_hir::{Database, Location, line_index};
use mauve_syntax::TextSize;
use serde::Serialize;

use crate::text::shown;

#[derive(Serialize)]
pub(super) struct RangeDocument {
    pub(super) start: PositionDocument,
    pub(super) end: PositionDocument,
}

/// From 1.
#[derive(Serialize)]
pub(super) struct PositionDocument {
    pub(super) line: usize,
    pub(super) column: usize,
}

/// How wide a text is in columns.
pub(super) struct Lines {
    pub(super) width: fn(&str) -> usize,
}

impl Lines {
    /// ` (path:line)`; nothing for a whole file, which a message names.
    pub(super) fn shown(&self, db: &Database, here: &Path, at: &Location<'_>) -> String {
        if matches!(at, Location::Range(_, 0, 0)) {
            return String::new();
        }
        let path = shown(at.file(db).path(db), here);
        format!(" ({path}:{})", self.range(db, at).start.line)
    }

    pub(super) fn range(&self, db: &Database, at: &Location<'_>) -> RangeDocument {
        let file = at.file(db);
        let text: &str = file.text(db);
        let range = at.range(db);
        let span = clamp(text, range.start().into(), range.end().into());
        let position = |offset: usize| {
            let found = line_index(db, file).line_col(TextSize::new(offset as u32));
            let before = text.get(offset - found.col as usize..offset).unwrap_or_default();
            PositionDocument { line: found.line as usize + 1, column: (self.width)(before) + 1 }
        };
        RangeDocument { start: position(span.start), end: position(span.end) }
    }
}

/// A range that is in the text, at boundaries of its characters.
pub(super) fn clamp(text: &str, start: usize, end: usize) -> std::ops::Range<usize> {
    let boundary = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let (start, end) = (boundary(start), boundary(end));
    start..end.max(start)
}
