//! A text in pieces: a change costs what it touches, and one message may have thousands of changes.

use std::collections::VecDeque;

use tower_lsp::lsp_types::Position;

use super::position::Encoding;

/// The length to which a piece grows before it is divided, in bytes. In tests, short texts have several pieces.
const LONGEST: usize = if cfg!(test) { 8 } else { 8 << 10 };

/// The length of the parts.
const PART: usize = LONGEST / 2;

/// A changed piece that is shorter is joined to the next one.
const SHORTEST: usize = LONGEST / 4;

/// A text. No boundary of its pieces is between a carriage return and a line feed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rope {
    /// None of them is empty.
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone)]
struct Piece {
    text: String,
    line_feeds: usize,
    /// The number of carriage returns without a line feed.
    lone_returns: usize,
    characters: usize,
    /// The number of UTF-16 code units.
    units: usize,
}

/// An offset: that in a piece, less than its length, or the end of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    piece: usize,
    at: usize,
}

impl Piece {
    fn new(text: String) -> Piece {
        let line_feeds = text.bytes().filter(|&byte| byte == b'\n').count();
        let lone_returns = match text.bytes().filter(|&byte| byte == b'\r').count() {
            0 => 0,
            returns => returns - text.matches("\r\n").count(),
        };
        let characters = text.chars().count();
        // A character of four bytes has two code units, any other one.
        let units = characters + text.bytes().filter(|&byte| byte >= 0xf0).count();
        Piece { text, line_feeds, lone_returns, characters, units }
    }

    fn width(&self, encoding: Encoding) -> usize {
        match encoding {
            Encoding::Utf8 => self.text.len(),
            Encoding::Utf16 => self.units,
            Encoding::Utf32 => self.characters,
        }
    }
}

impl Rope {
    /// Divides a text.
    pub(crate) fn new(text: &str) -> Rope {
        Rope { pieces: divided(text).collect() }
    }

    /// Returns the whole text.
    pub(crate) fn text(&self) -> String {
        self.pieces.iter().map(|piece| piece.text.as_str()).collect()
    }

    /// Returns whether this is the text.
    pub(crate) fn is(&self, text: &str) -> bool {
        let mut rest = text;
        let mut pieces = self.pieces.iter();
        pieces.all(|piece| rest.strip_prefix(piece.text.as_str()).map(|left| rest = left).is_some())
            && rest.is_empty()
    }

    /// Returns the place of `position`, clamped to its line and to the text, and whether it is inside a character; then the
    /// place is that of the character.
    pub(crate) fn place(&self, position: Position, encoding: Encoding) -> (Place, bool) {
        let Some(Place { mut piece, mut at }) = self.line(position.line as usize) else {
            return (self.end(), false);
        };
        let mut left = position.character as usize;
        while let Some(here) = self.pieces.get(piece) {
            let width = here.width(encoding);
            // A line may be longer than many pieces.
            if at == 0 && here.line_feeds == 0 && width <= left {
                left -= width;
                piece += 1;
                continue;
            }
            let rest = here.text.get(at..).unwrap_or_default();
            let (offset, column) = encoding.offset_in_line(rest, left);
            if let Some(letter) = rest[offset..].chars().next() {
                let is_end = matches!(letter, '\r' | '\n');
                return (Place { piece, at: at + offset }, column < left && !is_end);
            }
            left -= column;
            (piece, at) = (piece + 1, 0);
        }
        (self.end(), false)
    }

    fn end(&self) -> Place {
        Place { piece: self.pieces.len(), at: 0 }
    }

    /// Returns where a line begins; none behind the last one.
    fn line(&self, line: usize) -> Option<Place> {
        let mut left = line;
        if left == 0 {
            return Some(Place { piece: 0, at: 0 });
        }
        for (piece, here) in self.pieces.iter().enumerate() {
            match left.checked_sub(here.line_feeds) {
                Some(less) if less > 0 => left = less,
                _ => {
                    let at = here.text.match_indices('\n').nth(left - 1)?.0 + 1;
                    let is_end = at == here.text.len();
                    return Some(if is_end {
                        Place { piece: piece + 1, at: 0 }
                    } else {
                        Place { piece, at }
                    });
                }
            }
        }
        None
    }

    /// Returns the first line, from 1, with a carriage return without a line feed, which ends a line in some editors.
    pub(crate) fn line_with_lone_return(&self) -> Option<usize> {
        let index = self.pieces.iter().position(|piece| piece.lone_returns > 0)?;
        let (before, text) = (self.pieces.get(..index)?, &self.pieces.get(index)?.text);
        let mut returns = text.match_indices('\r').map(|(at, _)| at);
        let at = returns.find(|at| text.as_bytes().get(at + 1) != Some(&b'\n'))?;
        let lines: usize = before.iter().map(|piece| piece.line_feeds).sum();
        Some(lines + text.get(..at)?.matches('\n').count() + 1)
    }

    /// Replaces the text from `start` to `end`, which is not before it.
    pub(crate) fn replace(&mut self, start: Place, end: Place, text: &str) {
        let of = |place: Place| self.pieces.get(place.piece).map_or("", |piece| piece.text.as_str());
        let before = of(start).get(..start.at).unwrap_or_default();
        let after = of(end).get(end.at..).unwrap_or_default();
        let mut new = VecDeque::from([before, text, after]);
        let (mut from, mut to) = (start.piece, (end.piece + 1).min(self.pieces.len()));
        let mut length: usize = new.iter().map(|part| part.len()).sum();
        while let Some(next) = self.pieces.get(to) {
            let ends_in_return =
                new.iter().rfind(|part| !part.is_empty()).is_some_and(|it| it.ends_with('\r'));
            if length >= SHORTEST && !(ends_in_return && next.text.starts_with('\n')) {
                break;
            }
            new.push_back(&next.text);
            length += next.text.len();
            to += 1;
        }
        let previous = from.checked_sub(1).and_then(|previous| self.pieces.get(previous));
        if let Some(previous) = previous.filter(|previous| previous.text.ends_with('\r')) {
            new.push_front(&previous.text);
            from -= 1;
        }
        let new: String = new.into_iter().collect();
        let new: Vec<Piece> = divided(&new).collect();
        self.pieces.splice(from..to, new);
    }
}

/// Divides a text into pieces.
fn divided(text: &str) -> impl Iterator<Item = Piece> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let mut end = if rest.len() <= LONGEST { rest.len() } else { PART };
        while !rest.is_char_boundary(end) || rest.as_bytes().get(end - 1..=end) == Some(b"\r\n") {
            end += 1;
        }
        let (piece, left) = rest.split_at(end);
        rest = left;
        Some(Piece::new(piece.to_owned()))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ENCODINGS: [Encoding; 3] = [Encoding::Utf8, Encoding::Utf16, Encoding::Utf32];

    /// What [`Rope::place`] returns, in one text.
    fn offset(text: &str, position: Position, encoding: Encoding) -> (usize, bool) {
        let mut start = 0;
        for _ in 0..position.line {
            match text[start..].find('\n') {
                Some(length) => start += length + 1,
                None => return (text.len(), false),
            }
        }
        let line = &text[start..];
        let (mut offset, mut left) = (0, position.character as usize);
        for letter in line.chars() {
            let is_end = letter == '\n' || line[offset..].starts_with("\r\n");
            let width = encoding.width_of(letter);
            if is_end || left < width {
                break;
            }
            left -= width;
            offset += letter.len_utf8();
        }
        let is_end = line[offset..].is_empty() || line[offset..].starts_with(['\r', '\n']);
        (start + offset, left > 0 && !is_end)
    }

    fn line_with_lone_return(text: &str) -> Option<usize> {
        let bytes = text.as_bytes();
        let at = (0..bytes.len())
            .find(|&at| bytes[at..].starts_with(b"\r") && !bytes[at..].starts_with(b"\r\n"))?;
        Some(text[..at].matches('\n').count() + 1)
    }

    fn offset_of(rope: &Rope, place: Place) -> usize {
        rope.pieces[..place.piece].iter().map(|piece| piece.text.len()).sum::<usize>() + place.at
    }

    /// The pieces are as the fields of [`Rope`] say.
    fn assert_divided(rope: &Rope) {
        for (index, piece) in rope.pieces.iter().enumerate() {
            let next = rope.pieces.get(index + 1).is_some_and(|next| next.text.starts_with('\n'));
            assert!(!piece.text.is_empty() && piece.text.len() <= LONGEST, "{rope:?}");
            assert!(!(next && piece.text.ends_with('\r')), "{rope:?}");
        }
    }

    fn text() -> impl Strategy<Value = String> {
        "[ab\u{e9}\u{1f916}\r\n]{0,40}"
    }

    fn change() -> impl Strategy<Value = ((u32, u32), (u32, u32), String)> {
        ((0..9u32, 0..12u32), (0..9u32, 0..12u32), "[b\u{1f916}\r\n]{0,20}|\n|\r|")
    }

    proptest! {
        #[test]
        fn a_rope_is_the_text(text in text(), changes in proptest::collection::vec(change(), 1..12)) {
            for encoding in ENCODINGS {
                let (mut rope, mut plain) = (Rope::new(&text), text.clone());
                for (from, to, new) in &changes {
                    prop_assert_eq!(rope.line_with_lone_return(), line_with_lone_return(&plain));
                    let [from, to] = [from, to].map(|&(line, column)| Position::new(line, column));
                    let ((start, is_within), (end, is_end_within)) =
                        (rope.place(from, encoding), rope.place(to, encoding));
                    let places = [(offset_of(&rope, start), is_within), (offset_of(&rope, end), is_end_within)];
                    let expected = [offset(&plain, from, encoding), offset(&plain, to, encoding)];
                    prop_assert_eq!(places, expected, "{:?} {:?} {:?}", rope, from, to);
                    prop_assert_eq!(end < start, places[1].0 < places[0].0);
                    rope.replace(start, end.max(start), new);
                    plain.replace_range(places[0].0..places[1].0.max(places[0].0), new);
                    prop_assert_eq!(&rope.text(), &plain);
                    let longer = format!("{plain}a");
                    prop_assert!(rope.is(&plain) && !rope.is(&longer));
                    assert_divided(&rope);
                }
            }
        }
    }

    #[test]
    fn a_change_leaves_all_other_pieces_as_they_are() {
        let pieces =
            |rope: &Rope| -> Vec<*const u8> { rope.pieces.iter().map(|it| it.text.as_ptr()).collect() };
        let mut rope = Rope::new(&"abc\n".repeat(1000));
        for line in (0..1000).chain((0..1000).rev()) {
            let before = pieces(&rope);
            let [start, end] =
                [0, 2].map(|column| rope.place(Position::new(line, column), Encoding::Utf16).0);
            rope.replace(start, end, "de");
            let after = pieces(&rope);
            let kept = after.iter().filter(|piece| before.contains(piece)).count();
            assert!(kept + 2 >= after.len(), "{kept} of {}", after.len());
        }
        assert_eq!(rope.text(), "dec\n".repeat(1000));
    }

    #[test]
    fn a_rope_that_was_emptied_has_no_pieces_left() {
        let mut rope = Rope::new(&"ab\n".repeat(100));
        for _ in 0..100 {
            let [start, end] = [1, 2].map(|line| rope.place(Position::new(line, 0), Encoding::Utf8).0);
            rope.replace(start, end, "");
        }
        assert_eq!((rope.text().as_str(), rope.pieces.len()), ("ab\n", 1));
    }
}
