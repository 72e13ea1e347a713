//! Where an offset is in `mauve.toml` or in a timing table: in which section, and at which key or value. The text is usually not valid
//! TOML during typing, so its tokens are read.

use std::collections::BTreeSet;
use std::ops::Range;

use mauve_syntax::{TextRange, TextSize};
use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

/// Returns the key at an offset that is written without quotes, with its range, behind the keys of the sections and tables around it.
pub(crate) fn key_at(text: &str, offset: TextSize) -> Option<(String, String, TextRange)> {
    let place = TomlPlace::at(text, offset.into())?;
    let key = text.get(place.start..place.end)?;
    let is_key = place.what == What::Key && !place.is_quoted && place.has_value;
    let path = if place.section.is_empty() { key.to_owned() } else { format!("{}.{key}", place.section) };
    let (section, key) = path.rsplit_once('.').unwrap_or(("", &path));
    let range = TextRange::new((place.start as u32).into(), (place.end as u32).into());
    is_key.then(|| (section.to_owned(), key.to_owned(), range))
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum What {
    Header,
    #[default]
    Key,
    Value(String),
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct TomlPlace {
    pub(crate) what: What,
    /// The section around the cursor, with the keys of inline tables around it; empty before the first one.
    pub(crate) section: String,
    /// The other sections.
    pub(crate) sections: BTreeSet<String>,
    /// The other keys of the section, or of the same inline table.
    pub(crate) given: BTreeSet<String>,
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) is_quoted: bool,
    pub(crate) has_value: bool,
    pub(crate) is_inline: bool,
}

impl TomlPlace {
    /// Returns the location of `offset`; none in comments and numbers.
    ///
    /// ```text
    /// "robot.scan" = 2              [timing]
    ///    ^ a key that has a value   tables = ["times.toml"]
    ///                                           ^ the value of `tables` in `timing`
    /// ```
    pub(crate) fn at(text: &str, offset: usize) -> Option<TomlPlace> {
        let tokens = Source::new(text).lex().into_vec();
        let at_cursor = tokens.iter().find(|it| is_in(offset, &token_range(it)));
        if at_cursor.is_some_and(|it| it.kind() == TokenKind::Comment) {
            return None;
        }
        let word = TypedWord::at(text, &tokens, offset);
        let mut tables = OpenTables::new();
        let mut here: Option<(TomlPlace, OpenTable)> = None;
        let mut index = 0;
        while let Some(token) = tokens.get(index) {
            if here.is_none() && token.span().start() >= word.range.start {
                here = Some(tables.place(&word)?);
            }
            index = match tables.header(text, &tokens, index) {
                Some((range, next)) => {
                    // The header at the cursor is typed again.
                    let is_here = is_in(offset, &range);
                    if is_here {
                        let is_closed = text[range.clone()].ends_with(']');
                        let end = if is_closed { range.end } else { word.range.end };
                        let place = TomlPlace {
                            what: What::Header,
                            section: tables.section.clone(),
                            start: range.start,
                            end,
                            ..TomlPlace::default()
                        };
                        here = Some((place, OpenTable::default()));
                    }
                    let name = text[range.clone()].trim_matches(['[', ']']).trim();
                    tables.begin_section(name, !is_here);
                    next
                }
                None => {
                    tables.read(text, *token);
                    index + 1
                }
            };
        }
        let (place, table) = here?;
        let others = tables.keys.into_iter().filter(|it| it.table == table.number && it.entry != table.entry);
        Some(TomlPlace { sections: tables.sections, given: others.map(|it| it.key).collect(), ..place })
    }
}

fn token_range(token: &Token) -> Range<usize> {
    token.span().start()..token.span().end()
}

/// Returns whether a cursor at `offset` is behind a byte of `range`.
fn is_in(offset: usize, range: &Range<usize>) -> bool {
    range.start < offset && offset <= range.end
}

/// The word at the cursor, which a completion replaces.
struct TypedWord {
    range: Range<usize>,
    /// The part of it before the cursor.
    typed: String,
    is_quoted: bool,
    /// Whether `=` follows.
    is_assigned: bool,
}

impl TypedWord {
    fn at(text: &str, tokens: &[Token], offset: usize) -> TypedWord {
        let is_bare = |token: &Token| matches!(token.kind(), TokenKind::Atom | TokenKind::Dot);
        let touches = |token: &Token| token.span().start() <= offset && offset <= token.span().end();
        let string =
            tokens.iter().position(|it| it.kind().encoding().is_some() && is_in(offset, &token_range(it)));
        let at = string.or_else(|| tokens.iter().position(|it| is_bare(it) && touches(it)));
        let (mut first, mut last) = (at, at);
        if string.is_none() {
            let before =
                |index: usize| index.checked_sub(1).filter(|it| tokens.get(*it).is_some_and(is_bare));
            let behind = |index: usize| Some(index + 1).filter(|it| tokens.get(*it).is_some_and(is_bare));
            first = at.and_then(|at| std::iter::successors(Some(at), |it| before(*it)).last());
            last = at.and_then(|at| std::iter::successors(Some(at), |it| behind(*it)).last());
        }
        let start = first.and_then(|it| tokens.get(it)).map_or(offset, |it| it.span().start());
        let end = last.and_then(|it| tokens.get(it)).map_or(offset, |it| it.span().end());
        let written = text.get(start..end).unwrap_or_default();
        let is_closed = string.is_none() || written.len() > 1 && written.ends_with(['"', '\'']);
        let rest = tokens.iter().filter(|it| it.span().start() >= end);
        let next = rest.map(Token::kind).find(|kind| *kind != TokenKind::Whitespace);
        // A string without its second quote has the rest of the line.
        let swallowed = text.get(offset..end).unwrap_or_default();
        TypedWord {
            range: start..if is_closed { end } else { offset },
            typed: text.get(start..offset).unwrap_or_default().to_owned(),
            is_quoted: string.is_some(),
            is_assigned: next == Some(TokenKind::Equals) || !is_closed && swallowed.contains('='),
        }
    }
}

/// A section or an inline table that is open.
#[derive(Clone, Default)]
struct OpenTable {
    number: usize,
    /// The number of its entry, in the text.
    entry: usize,
    /// The key of that entry.
    key: String,
    is_value: bool,
    /// How many arrays are open in its value.
    arrays: usize,
}

/// A key that has a value.
struct Assigned {
    table: usize,
    entry: usize,
    key: String,
}

/// What was read before a token.
struct OpenTables {
    section: String,
    sections: BTreeSet<String>,
    keys: Vec<Assigned>,
    /// The section, and the inline tables in it that are open.
    open: Vec<OpenTable>,
    numbers: usize,
}

impl OpenTables {
    fn new() -> OpenTables {
        let (section, sections) = (String::new(), BTreeSet::new());
        OpenTables { section, sections, keys: Vec::new(), open: vec![OpenTable::default()], numbers: 0 }
    }

    /// Returns the location of a word behind what was read, with its table; none in a number.
    fn place(&self, word: &TypedWord) -> Option<(TomlPlace, OpenTable)> {
        let table = self.open.last()?.clone();
        if table.is_value && !word.is_quoted && word.typed.starts_with(|it: char| it.is_ascii_digit()) {
            return None;
        }
        let around = self.open.iter().take(self.open.len() - 1).map(|it| it.key.as_str());
        let section = Some(self.section.as_str()).filter(|it| !it.is_empty());
        let path: Vec<&str> = section.into_iter().chain(around).collect();
        let what = if table.is_value { What::Value(table.key.clone()) } else { What::Key };
        let place = TomlPlace {
            has_value: table.is_value || word.is_assigned,
            what,
            section: path.join("."),
            start: word.range.start,
            end: word.range.end,
            is_quoted: word.is_quoted,
            is_inline: self.open.len() > 1,
            ..TomlPlace::default()
        };
        Some((place, table))
    }

    /// Returns the range of a header that begins at the token of this index, and the index behind it.
    fn header(&self, text: &str, tokens: &[Token], index: usize) -> Option<(Range<usize>, usize)> {
        let [section] = self.open.as_slice() else { return None };
        let first = tokens.get(index).filter(|it| it.kind() == TokenKind::LeftSquareBracket)?;
        if section.is_value || !section.key.is_empty() {
            return None;
        }
        let is_end =
            |it: &Token| matches!(it.kind(), TokenKind::Newline | TokenKind::Comment | TokenKind::Eof);
        let line: &[Token] = tokens.get(index..)?.split(is_end).next()?;
        let end = line.last()?.span().end();
        let range = first.span().start()..end;
        let written = text.get(range.clone())?.trim_end();
        Some((range.start..range.start + written.len(), index + line.len()))
    }

    fn begin_section(&mut self, name: &str, is_other: bool) {
        name.clone_into(&mut self.section);
        if is_other {
            self.sections.insert(name.to_owned());
        }
        self.numbers += 1;
        self.open = vec![OpenTable { number: self.numbers, entry: self.numbers, ..OpenTable::default() }];
    }

    fn begin_entry(&mut self) {
        self.numbers += 1;
        if let Some(table) = self.open.last_mut() {
            *table = OpenTable { number: table.number, entry: self.numbers, ..OpenTable::default() };
        }
    }

    fn read(&mut self, text: &str, token: Token) {
        let is_complete = self.open.first().is_some_and(|section| section.arrays == 0);
        let is_inline = self.open.len() > 1;
        let Some(table) = self.open.last_mut() else { return };
        let written = text.get(token.span().start()..token.span().end()).unwrap_or_default();
        match token.kind() {
            TokenKind::Newline if is_complete => {
                self.open.truncate(1);
                self.begin_entry();
            }
            TokenKind::Equals if !table.is_value => {
                table.is_value = true;
                let (table, entry, key) = (table.number, table.entry, table.key.clone());
                self.keys.push(Assigned { table, entry, key });
            }
            TokenKind::Atom | TokenKind::Dot if !table.is_value => table.key += written,
            kind if kind.encoding().is_some() && !table.is_value => {
                table.key += written.trim_matches(['"', '\'']);
            }
            TokenKind::LeftSquareBracket if table.is_value => table.arrays += 1,
            TokenKind::RightSquareBracket => table.arrays = table.arrays.saturating_sub(1),
            TokenKind::LeftCurlyBracket if table.is_value => {
                self.numbers += 1;
                self.open.push(OpenTable {
                    number: self.numbers,
                    entry: self.numbers,
                    ..OpenTable::default()
                });
            }
            TokenKind::RightCurlyBracket if is_inline => _ = self.open.pop(),
            TokenKind::Comma if is_inline && table.arrays == 0 => self.begin_entry(),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place at `$0`: what is there, the section, what is replaced, and the other keys.
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let offset = text.find("$0").unwrap();
        let text = text.replace("$0", "");
        let place = TomlPlace::at(&text, offset).map(|it| {
            let what = match &it.what {
                What::Header => "header".to_owned(),
                What::Key if it.has_value => "key with a value".to_owned(),
                What::Key => "key".to_owned(),
                What::Value(key) => format!("value of {key}"),
            };
            let others: Vec<&str> = it.given.iter().map(String::as_str).collect();
            format!("{what} in [{}]: {}; {}", it.section, &text[it.start..it.end], others.join(" "))
        });
        assert_eq!(place.as_deref().unwrap_or("none"), expected, "{text}");
    }

    #[test]
    fn keys() {
        for (text, expected) in [
            ("[codel]\n\"robot.sc$0an\" = 2", "key with a value in [codel]: \"robot.scan\"; "),
            ("[codel]\n\"robot.scan\"$0 = 2", "key with a value in [codel]: \"robot.scan\"; "),
            ("[codel]\n'robot.sc$0an' = 2", "key with a value in [codel]: 'robot.scan'; "),
            ("[codel]\n\"robot.sc$0 = 2\nb = 1", "key with a value in [codel]: \"robot.sc; b"),
            ("[codel]\n\"rob$0\nb = 1", "key in [codel]: \"rob; b"),
            ("[codel]\na.b$0.c = 1\nd=2\n[x]\ny = 1", "key with a value in [codel]: a.b.c; d"),
            ("a = 1\n$0", "key in []: ; a"),
            ("[x]\na = { b = 1, $0c = 2 }\nd = 1", "key with a value in [x.a]: c; b"),
            ("[x]\na = { b = { c = 1, $0 } }", "key in [x.a.b]: ; c"),
            ("[x]\na = [{ b = 1 }, {\n$0", "key in [x.a]: ; "),
            ("a = { b = 1, $0\n[y]\nc = 1", "key in [a]: ; b"),
            ("# $0\na = 1", "none"),
        ] {
            check(text, expected);
        }
    }

    #[test]
    fn values_and_headers() {
        for (text, expected) in [
            ("[x]\na = \"b$0c\" # d", "value of a in [x]: \"bc\"; "),
            ("[x]\na = [\"b\", \"c$0\nd = 1", "value of a in [x]: \"c; "),
            ("[x]\na = [\n  \"b\"$0,\n]\nd = 1", "value of a in [x]: \"b\"; d"),
            ("a = tr$0ue", "value of a in []: true; "),
            ("a = 1$0.5", "none"),
            ("a = { b = \"$0\", c = 1 }", "value of b in [a]: \"\"; c"),
            ("[x]\na = 1\n[[y.z]$0]\nb = 2", "header in [x]: [[y.z]]; "),
            ("[x]\na = 1\n[y$0", "header in [x]: [y; "),
        ] {
            check(text, expected);
        }
    }

    #[test]
    fn any_text_has_places() {
        let pieces =
            ["[", "]", "{", "}", "=", ",", ".", "\"", "'", "\"\"\"", "#", "\n", " ", "a", "1", "é", "\r\n"];
        let mut random = mauve_tests::Random(7);
        for _ in 0..20_000 {
            let text: String = (0..random.below(16)).map(|_| *random.of(&pieces)).collect();
            for (offset, _) in text.char_indices().chain([(text.len(), ' ')]) {
                if let Some(place) = TomlPlace::at(&text, offset) {
                    assert!(text.get(place.start..place.end).is_some(), "{text:?} at {offset}");
                    assert!(place.start <= offset && offset <= place.end, "{text:?} at {offset}: {place:?}");
                }
            }
        }
    }
}
