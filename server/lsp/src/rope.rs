//! A text that is cheap to change: a change costs what it touches, and one message may have thousands of changes.

use tower_lsp::lsp_types::Position;

use super::position::Encoding;

/// A text, with places in it that are numbers of characters.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rope {
    text: ropey::Rope,
    /// The number of carriage returns without a line feed.
    lone_returns: usize,
}

impl Rope {
    pub(crate) fn new(text: &str) -> Rope {
        Rope { text: ropey::Rope::from_str(text), lone_returns: lone_returns(text) }
    }

    /// Returns the whole text.
    pub(crate) fn text(&self) -> String {
        self.text.to_string()
    }

    /// Returns whether this is the text.
    pub(crate) fn is(&self, text: &str) -> bool {
        self.text == text
    }

    /// Returns the place of `position`, clamped to its line and to the text, and whether it is inside a character; then the
    /// place is that of the character.
    pub(crate) fn place(&self, position: Position, encoding: Encoding) -> (usize, bool) {
        let line = position.line as usize;
        if line >= self.text.len_lines() {
            return (self.text.len_chars(), false);
        }
        let start = self.text.line_to_char(line);
        let mut end = self.text.line_to_char(line + 1);
        for letter in ['\n', '\r'] {
            if end > start && self.text.char(end - 1) == letter {
                end -= 1;
            } else {
                break;
            }
        }
        let width = |place| match encoding {
            Encoding::Utf8 => self.text.char_to_byte(place),
            Encoding::Utf16 => self.text.char_to_utf16_cu(place),
            Encoding::Utf32 => place,
        };
        let target = (width(start) + position.character as usize).min(width(end));
        let place = match encoding {
            Encoding::Utf8 => self.text.byte_to_char(target),
            Encoding::Utf16 => self.text.utf16_cu_to_char(target),
            Encoding::Utf32 => target,
        };
        (place, width(place) < target)
    }

    /// Returns the first line, from 1, with a carriage return without a line feed, which ends a line in some editors.
    pub(crate) fn line_with_lone_return(&self) -> Option<usize> {
        if self.lone_returns == 0 {
            return None;
        }
        let text = self.text();
        let mut returns = text.match_indices('\r').map(|(at, _)| at);
        let at = returns.find(|at| text.as_bytes().get(at + 1) != Some(&b'\n'))?;
        Some(self.text.byte_to_line(at) + 1)
    }

    /// Replaces the text from `start` to `end`, which is not before it.
    pub(crate) fn replace(&mut self, start: usize, end: usize, text: &str) {
        // Whether a carriage return is alone depends on the character behind it.
        let around = |rope: &ropey::Rope, end: usize| {
            let range = start.saturating_sub(1)..(end + 1).min(rope.len_chars());
            lone_returns(&rope.slice(range).to_string())
        };
        let before = around(&self.text, end);
        self.text.remove(start..end);
        self.text.insert(start, text);
        let after = around(&self.text, start + text.chars().count());
        self.lone_returns = self.lone_returns + after - before;
    }
}

/// Returns the number of carriage returns that no line feed follows.
fn lone_returns(text: &str) -> usize {
    match text.matches('\r').count() {
        0 => 0,
        returns => returns - text.matches("\r\n").count(),
    }
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

    fn offset_of(rope: &Rope, place: usize) -> usize {
        rope.text.char_to_byte(place)
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
                }
            }
        }
    }
}
