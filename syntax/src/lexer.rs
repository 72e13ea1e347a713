//! Splits a text into tokens. Each byte belongs to exactly one token.

use std::ops::Range;

use logos::Logos;
use rowan::{TextRange, TextSize};

use crate::SyntaxKind::{self, *};
pub(crate) use crate::comment::block_comment;
use crate::comment::is_closed_comment;
use crate::conflict::{self, Region, other_text};
use crate::error::{SyntaxError, SyntaxErrorKind, TokenError};

/// The tokens of a text, trivia included.
pub struct Lexed {
    kinds: Vec<SyntaxKind>,
    /// The start of each token, with [`BEGINS_LINE`]. The additional last element is the end of the text.
    starts: Vec<u32>,
    errors: Vec<(u32, TokenError)>,
    /// The regions between git's conflict markers.
    regions: Vec<Region>,
}

/// A flag on the start of the first significant token of a line. (Texts are shorter than 2³¹ bytes.)
const BEGINS_LINE: u32 = 1 << 31;

/// Splits `text` into tokens.
///
/// ```
/// let lexed = mauve_syntax::lex("period = 100 // ms");
/// assert_eq!(lexed.len(), 7);
/// assert_eq!(lexed.range(4), 9..12);
/// ```
pub fn lex(text: &str) -> Lexed {
    let regions = conflict::regions(text);
    let hidden: Vec<_> = regions.iter().flat_map(|it| [it.start.clone(), it.other.clone()]).collect();
    Lexed { regions, ..lex_from(text, &hidden, 0, text.len() / 3, |_, _| false) }
}

/// Returns by how much a text deepens what follows it; `None` if it also changes which library or file that is in, or has
/// errors, such as markers of its own.
fn shape(text: &str) -> Option<i64> {
    // Up to the first marker: regions may be nested deeply.
    let lexed = lex_from(text, &[], 0, text.len() / 3, |kind, _| kind == ERROR_CHARACTERS);
    let depth = |kind: &SyntaxKind| i64::from(*kind == L_CURLY) - i64::from(*kind == R_CURLY);
    let moves = lexed.kinds().iter().any(|kind| matches!(kind, LIBRARY_KW | INCLUDE_KW));
    (!moves && lexed.errors().is_empty()).then(|| lexed.kinds().iter().map(depth).sum())
}

/// Returns the tokens of `text` from `from`, the start of a token, to the first one that is `enough`, judged by its
/// kind and start. [`lex`] finds the same tokens; only for `from` > 0, it is unknown whether the first one begins its line.
///
/// `expected` is the expected number of tokens. `hidden` are the lines of conflicts that are one token each, in text order.
#[inline]
pub(crate) fn lex_from(
    text: &str,
    hidden: &[Range<usize>],
    from: usize,
    expected: usize,
    mut enough: impl FnMut(SyntaxKind, usize) -> bool,
) -> Lexed {
    let mut kinds = Vec::with_capacity(expected);
    let mut starts = Vec::with_capacity(expected + 1);
    let mut errors = Vec::new();
    let mut lexer = SyntaxKind::lexer(text);
    lexer.bump(from);
    let mut begins_line = 0;
    if from == 0 {
        begins_line = BEGINS_LINE;
        // A byte order mark is white space; anywhere else it is a stray character.
        if text.starts_with('\u{feff}') {
            kinds.push(WHITESPACE);
            starts.push(0);
            lexer.bump('\u{feff}'.len_utf8());
        }
    }
    let mut end;
    loop {
        // Half of all tokens are white space: a manual scan is faster than the automaton.
        let at = lexer.span().end;
        let (white, breaks) = white_space(&text.as_bytes()[at..]);
        if white > 0 {
            kinds.push(WHITESPACE);
            starts.push(at as u32);
            begins_line |= u32::from(breaks) * BEGINS_LINE;
            lexer.bump(white);
        }
        end = at + white;
        let Some(token) = lexer.next() else { break };
        let start = lexer.span().start as u32;
        let kind = match token {
            _ if let Some(marker) = conflict::marker_at(text, start as usize) => {
                let region = hidden.binary_search_by_key(&marker.start, |lines| lines.start);
                let lines = region.ok().and_then(|index| hidden.get(index));
                lexer.bump(lines.unwrap_or(&marker).end - lexer.span().end);
                if lines.is_some() { CONFLICT } else { ERROR_CHARACTERS }
            }
            // Git puts the first marker before a byte order mark.
            Err(()) if kinds == [CONFLICT, WHITESPACE] && lexer.slice() == "\u{feff}" => WHITESPACE,
            Ok(kind) => kind,
            // Consecutive stray characters are one token, with one error.
            Err(()) if kinds.last() == Some(&ERROR_CHARACTERS) => continue,
            Err(()) => of_another_language(&mut lexer),
        };
        if kind.is_trivia() {
            if kind != LINE_COMMENT && lexer.slice().bytes().any(|byte| matches!(byte, b'\n' | b'\r')) {
                begins_line = BEGINS_LINE;
            }
            starts.push(start);
        } else {
            starts.push(start | begins_line);
            begins_line = 0;
        }
        let error = match kind {
            ERROR_CHARACTERS if lexer.slice().starts_with('#') => Some(TokenError::Hash),
            ERROR_CHARACTERS if conflict::marker_at(text, start as usize).is_some() => {
                Some(TokenError::ConflictMarker)
            }
            ERROR_CHARACTERS => Some(TokenError::Characters),
            BAD_NUMBER => Some(TokenError::BadNumber),
            STRING | UNTERMINATED_STRING if lexer.slice().starts_with('\'') => Some(TokenError::SingleQuotes),
            UNTERMINATED_STRING => Some(TokenError::UnterminatedString),
            STRING if has_unknown_escape(lexer.slice()) => Some(TokenError::UnknownEscape),
            BLOCK_COMMENT if !is_closed_comment(lexer.slice()) => Some(TokenError::UnterminatedComment),
            _ => None,
        };
        errors.extend(error.map(|error| (kinds.len() as u32, error)));
        kinds.push(kind);
        if enough(kind, start as usize) {
            end = lexer.span().end;
            break;
        }
    }
    starts.push(end as u32);
    Lexed { kinds, starts, errors, regions: Vec::new() }
}

impl Lexed {
    /// Returns the number of tokens.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Returns whether there are no tokens.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Returns the kind of a token; [`SyntaxKind::EOF`] after the last one.
    pub fn kind(&self, index: usize) -> SyntaxKind {
        self.kinds.get(index).copied().unwrap_or(EOF)
    }

    /// Returns the range of a token in bytes; after the last one, an empty range at the end of the text.
    pub fn range(&self, index: usize) -> Range<usize> {
        let start = self.start(index);
        start..self.start(index + 1).max(start)
    }

    fn start(&self, index: usize) -> usize {
        (self.starts.get(index).or(self.starts.last()).copied().unwrap_or(0) & !BEGINS_LINE) as usize
    }

    /// Returns whether a token is the first significant one of its line. The end of the text is.
    pub(crate) fn begins_line(&self, index: usize) -> bool {
        index >= self.len() || self.starts.get(index).is_none_or(|start| start & BEGINS_LINE != 0)
    }

    pub(crate) fn kinds(&self) -> &[SyntaxKind] {
        &self.kinds
    }

    pub(crate) fn errors(&self) -> &[(u32, TokenError)] {
        &self.errors
    }

    /// Returns whether a region of a conflict contains a token.
    pub(crate) fn is_in_conflict(&self, index: usize) -> bool {
        let start = self.start(index);
        let next = self.regions.partition_point(|region| region.other.end <= start);
        self.regions.get(next).is_some_and(|region| region.start.start <= start)
    }

    /// Returns the error of each region of a conflict in `text`.
    pub(crate) fn conflicts(&self, text: &str) -> impl Iterator<Item = SyntaxError> {
        let part = move |range: Range<usize>| text.get(range).unwrap_or_default();
        let offset = |offset: usize| TextSize::new(offset as u32);
        self.regions.iter().map(move |Region { start, other }| {
            let is_contained = match (self.kind_at(start.start), self.kind_at(other.start)) {
                (CONFLICT, CONFLICT) => {
                    let own = shape(part(start.end..other.start));
                    own.is_some() && own == shape(other_text(part(other.clone())))
                }
                // In a comment, it changes nothing, unless it ends the comment.
                (BLOCK_COMMENT, BLOCK_COMMENT) => !part(start.start..other.end).contains("*/"),
                _ => false,
            };
            let range = TextRange::new(offset(start.start), offset(start.end));
            let length = offset(other.end) - range.start();
            SyntaxError { range, kind: SyntaxErrorKind::Conflict { length, is_contained } }
        })
    }

    /// Returns the kind of the token at an offset.
    fn kind_at(&self, offset: usize) -> SyntaxKind {
        let next = self.starts.partition_point(|start| (start & !BEGINS_LINE) as usize <= offset);
        self.kind(next.saturating_sub(1))
    }
}

/// Returns the length of the white space at the beginning of `bytes`, and whether it contains a line break.
#[inline]
fn white_space(bytes: &[u8]) -> (usize, bool) {
    let mut breaks = false;
    for (length, byte) in bytes.iter().enumerate() {
        match byte {
            b' ' | b'\t' | b'\x0C' => {}
            b'\n' | b'\r' => breaks = true,
            _ => return (length, breaks),
        }
    }
    (bytes.len(), breaks)
}

/// Returns the keyword that `word` writes with capital letters: `State`.
pub(crate) fn in_lower_case(word: &str) -> Option<SyntaxKind> {
    let has_capital = word.len() <= 20 && word.contains(|letter: char| letter.is_ascii_uppercase());
    let kind = has_capital.then(|| lex(&word.to_ascii_lowercase()).kind(0))?;
    (kind.is_word() && kind != IDENT).then_some(kind)
}

/// Returns whether the rest of a line after `#` includes a file, as in C.
fn is_include(line: &str) -> bool {
    let path = line.strip_prefix("include");
    path.is_some_and(|path| path.starts_with([' ', '\t', '"', '<']))
}

/// Takes a comment that begins with `#`, or a string between `'`, after its first character. Both end with the line.
/// Otherwise takes only this character.
fn of_another_language(lexer: &mut logos::Lexer<'_, SyntaxKind>) -> SyntaxKind {
    let rest = lexer.remainder();
    let line = rest.find(['\n', '\r']).map_or(rest, |end| rest.get(..end).unwrap_or_default());
    match lexer.slice() {
        // The parser reads an include.
        "#" if is_include(line) => ERROR_CHARACTERS,
        "#" => {
            lexer.bump(line.len());
            ERROR_CHARACTERS
        }
        "'" => {
            let end = line.find('\'');
            lexer.bump(end.map_or(line.len(), |end| end + 1));
            if end.is_some() { STRING } else { UNTERMINATED_STRING }
        }
        _ => ERROR_CHARACTERS,
    }
}

fn has_unknown_escape(string: &str) -> bool {
    let mut letters = string.chars();
    while let Some(letter) = letters.next() {
        if letter == '\\' && !matches!(letters.next(), Some('"' | '\\' | 'n' | 't')) {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use super::*;

    fn check(text: &str, expected: Expect) {
        let lexed = lex(text);
        let mut out = String::new();
        for index in 0..lexed.len() {
            out += &format!("{:?} {:?}\n", lexed.kind(index), &text[lexed.range(index)]);
        }
        for (index, error) in lexed.errors() {
            out += &format!("error at token {index}: {error:?}\n");
        }
        expected.assert_eq(&out);
    }

    #[test]
    fn numbers_and_units_are_tokens() {
        check(
            "10 0x1F 1.5 1e-3 1.5e3 010 5ms 1.5s 0x 1.",
            expect![[r#"
                INT_NUMBER "10"
                WHITESPACE " "
                INT_NUMBER "0x1F"
                WHITESPACE " "
                FLOAT_NUMBER "1.5"
                WHITESPACE " "
                FLOAT_NUMBER "1e-3"
                WHITESPACE " "
                FLOAT_NUMBER "1.5e3"
                WHITESPACE " "
                INT_NUMBER "010"
                WHITESPACE " "
                BAD_NUMBER "5ms"
                WHITESPACE " "
                BAD_NUMBER "1.5s"
                WHITESPACE " "
                BAD_NUMBER "0x"
                WHITESPACE " "
                INT_NUMBER "1"
                DOT "."
                error at token 12: BadNumber
                error at token 14: BadNumber
                error at token 16: BadNumber
            "#]],
        );
    }

    #[test]
    fn strings_end_with_their_line() {
        check(
            "\"a\\\"b\" \"open\r\n\"\\q\" \"end\\",
            expect![[r#"
                STRING "\"a\\\"b\""
                WHITESPACE " "
                UNTERMINATED_STRING "\"open"
                WHITESPACE "\r\n"
                STRING "\"\\q\""
                WHITESPACE " "
                UNTERMINATED_STRING "\"end\\"
                error at token 2: UnterminatedString
                error at token 4: UnknownEscape
                error at token 6: UnterminatedString
            "#]],
        );
    }

    #[test]
    fn comments_and_stray_characters() {
        check(
            "\u{feff}// a\n/* b /* */ é§\u{feff} /*/",
            expect![[r#"
                WHITESPACE "\u{feff}"
                LINE_COMMENT "// a"
                WHITESPACE "\n"
                BLOCK_COMMENT "/* b /* */"
                WHITESPACE " "
                ERROR_CHARACTERS "é§\u{feff}"
                WHITESPACE " "
                BLOCK_COMMENT "/*/"
                error at token 5: Characters
                error at token 7: UnterminatedComment
            "#]],
        );
    }

    #[test]
    fn words_and_punctuation() {
        check(
            "state statex -> :: : <= < ! != &",
            expect![[r#"
                STATE_KW "state"
                WHITESPACE " "
                IDENT "statex"
                WHITESPACE " "
                ARROW "->"
                WHITESPACE " "
                COLON2 "::"
                WHITESPACE " "
                COLON ":"
                WHITESPACE " "
                LTEQ "<="
                WHITESPACE " "
                LT "<"
                WHITESPACE " "
                BANG "!"
                WHITESPACE " "
                NEQ "!="
                WHITESPACE " "
                ERROR_CHARACTERS "&"
                error at token 18: Characters
            "#]],
        );
    }
}
