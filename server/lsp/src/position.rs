//! Converts between offsets in a text and the client's lines and columns, in the negotiated encoding.
//!
//! A line ends at `\n`; a `\r` before it belongs to the end of the line. Positions from a client are clamped: to the
//! end of the line, or to the end of the text.

use line_index::WideEncoding;
use mauve_hir::{File, ModelDb};
use mauve_syntax::{TextRange, TextSize};
use tower_lsp::lsp_types::{Position, PositionEncodingKind, Range};

/// The unit of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, salsa::SalsaValue)]
pub(crate) enum Encoding {
    Utf8,
    /// UTF-16 code units, as in JavaScript; all clients support them.
    #[default]
    Utf16,
    Utf32,
}

impl Encoding {
    /// Returns the most efficient encoding that the client supports: UTF-8 needs no conversion.
    pub(crate) fn negotiated(knows: impl Fn(PositionEncodingKind) -> bool) -> Encoding {
        if knows(PositionEncodingKind::UTF8) {
            Encoding::Utf8
        } else if knows(PositionEncodingKind::UTF32) && !knows(PositionEncodingKind::UTF16) {
            Encoding::Utf32
        } else {
            Encoding::Utf16
        }
    }

    /// Returns the name in the protocol.
    pub(crate) fn kind(self) -> PositionEncodingKind {
        match self {
            Encoding::Utf8 => PositionEncodingKind::UTF8,
            Encoding::Utf16 => PositionEncodingKind::UTF16,
            Encoding::Utf32 => PositionEncodingKind::UTF32,
        }
    }

    /// Returns the number of columns of a character.
    pub(crate) fn width_of(self, letter: char) -> usize {
        match self {
            Encoding::Utf8 => letter.len_utf8(),
            Encoding::Utf16 => letter.len_utf16(),
            Encoding::Utf32 => 1,
        }
    }

    /// Returns the offset of a column in the first line of `text`, clamped to the end of the line and to the beginning of a
    /// character.
    fn offset_in_line(self, text: &str, column: usize) -> usize {
        let mut left = column;
        for (offset, letter) in text.char_indices() {
            let is_end = letter == '\n' || text[offset..].starts_with("\r\n");
            let width = self.width_of(letter);
            if is_end || left < width {
                return offset;
            }
            left -= width;
        }
        text.len()
    }
}

/// Returns the position of the end of `text`.
pub(crate) fn end_of(text: &str, encoding: Encoding) -> Position {
    let last = text.rsplit('\n').next().unwrap_or_default();
    let column: usize = last.chars().map(|letter| encoding.width_of(letter)).sum();
    Position::new(text.matches('\n').count() as u32, column as u32)
}

/// A text with its lines and the unit of its columns.
#[derive(Clone, Copy)]
pub(crate) struct LineIndex<'a> {
    db: &'a dyn ModelDb,
    text: &'a str,
    lines: &'a line_index::LineIndex,
    encoding: Encoding,
}

impl LineIndex<'_> {
    pub(crate) fn new(db: &dyn ModelDb, file: File, encoding: Encoding) -> LineIndex<'_> {
        LineIndex { db, text: file.text(db), lines: mauve_hir::line_index(db, file), encoding }
    }

    /// Returns the offset of a position, clamped to the text.
    pub(crate) fn offset(&self, position: Position) -> TextSize {
        let line = self.lines.line(position.line);
        let text = line.and_then(|line| self.text.get(std::ops::Range::<usize>::from(line)));
        match (line, text) {
            (Some(line), Some(text)) => {
                let offset = self.encoding.offset_in_line(text, position.character as usize);
                line.start() + TextSize::new(offset as u32)
            }
            _ => TextSize::of(self.text),
        }
    }

    /// Returns the offsets of a range. Its end is never before its start.
    pub(crate) fn text_range(&self, range: Range) -> TextRange {
        let (start, end) = (self.offset(range.start), self.offset(range.end));
        TextRange::new(start, end.max(start))
    }

    /// Returns the position of an offset. An edit cancels this: answers may have very many positions.
    pub(crate) fn position(&self, offset: TextSize) -> Position {
        self.db.unwind_if_revision_cancelled();
        let offset = offset.min(TextSize::of(self.text));
        let line_column = self.lines.line_col(offset);
        let wide = |encoding| self.lines.to_wide(encoding, line_column).map(|wide| wide.col);
        let column = match self.encoding {
            Encoding::Utf8 => None,
            Encoding::Utf16 => wide(WideEncoding::Utf16),
            Encoding::Utf32 => wide(WideEncoding::Utf32),
        };
        Position::new(line_column.line, column.unwrap_or(line_column.col))
    }

    pub(crate) fn range(&self, range: TextRange) -> Range {
        Range::new(self.position(range.start()), self.position(range.end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snapshot::{Failure, attempt};
    use mauve_hir::Database;
    use salsa::Database as _;

    const TEXT: &str = "aé\u{1f916}b\r\n\nlast";

    #[test]
    fn columns_count_what_was_agreed_on() {
        let robot = TEXT.find('b').unwrap();
        for (encoding, column) in [(Encoding::Utf8, 7), (Encoding::Utf16, 4), (Encoding::Utf32, 3)] {
            let position = Position::new(0, column);
            let db = Database::default();
            let index = LineIndex { db: &db, text: TEXT, lines: &line_index::LineIndex::new(TEXT), encoding };
            assert_eq!(index.offset(position), TextSize::new(robot as u32));
            assert_eq!(index.position(TextSize::new(robot as u32)), position);
            assert_eq!(end_of(&TEXT[..robot], encoding), position);
        }
        assert_eq!(end_of("a\r\n\n", Encoding::Utf16), Position::new(2, 0));
        assert_eq!(end_of("", Encoding::Utf16), Position::new(0, 0));
    }

    #[test]
    fn positions_outside_the_text_mean_its_nearest_place() {
        let (lines, encoding, db) = (line_index::LineIndex::new(TEXT), Encoding::Utf16, Database::default());
        let index = LineIndex { db: &db, text: TEXT, lines: &lines, encoding };
        let end_of_line = TEXT.find('\r').unwrap();
        for (position, expected) in [
            (Position::new(0, 99), end_of_line),
            (Position::new(0, u32::MAX), end_of_line),
            (Position::new(1, 5), TEXT.find("\nlast").unwrap()),
            (Position::new(2, 99), TEXT.len()),
            (Position::new(3, 0), TEXT.len()),
            (Position::new(u32::MAX, u32::MAX), TEXT.len()),
            // Within a surrogate pair: before the character.
            (Position::new(0, 3), 3),
        ] {
            assert_eq!(usize::from(index.offset(position)), expected, "{position:?}");
        }
    }

    #[test]
    fn an_edit_ends_the_translation_of_an_answer() {
        let (lines, db) = (line_index::LineIndex::new(TEXT), Database::default());
        let index = LineIndex { db: &db, text: TEXT, lines: &lines, encoding: Encoding::Utf16 };
        assert!(attempt(|| index.position(0.into())).is_ok());
        db.cancellation_token().cancel();
        assert_eq!(attempt(|| index.position(0.into())), Err(Failure::Cancelled));
    }

    #[test]
    fn bytes_are_chosen_where_they_are_known() {
        use PositionEncodingKind as Kind;
        let negotiated = |known: &[Kind]| Encoding::negotiated(|kind| known.contains(&kind));
        assert_eq!(negotiated(&[]), Encoding::Utf16);
        assert_eq!(negotiated(&[Kind::UTF16, Kind::UTF8]), Encoding::Utf8);
        assert_eq!(negotiated(&[Kind::UTF32]), Encoding::Utf32);
        assert_eq!(negotiated(&[Kind::UTF32, Kind::UTF16]), Encoding::Utf16);
    }
}
