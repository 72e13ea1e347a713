//! Where an offset is in `mauve.toml` or in a timing table: in which section, and at which key or value.

use std::collections::BTreeSet;

use mauve_syntax::{TextRange, TextSize};

/// Returns the key at an offset that is written without quotes, with its range, behind the keys of the sections and tables around it.
pub(crate) fn key_at(text: &str, offset: TextSize) -> Option<(String, String, TextRange)> {
    let place = Place::at(text, offset.into())?;
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
pub(crate) struct Place {
    pub(crate) what: What,
    /// The section around the cursor, with the keys of inline tables around it; empty before the first one.
    pub(crate) section: String,
    /// The number of the section, in the order of the text.
    pub(crate) number: usize,
    pub(crate) sections: BTreeSet<String>,
    /// The keys on other lines of the section, or in the same inline table.
    pub(crate) given: BTreeSet<String>,
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) is_quoted: bool,
    pub(crate) has_value: bool,
    pub(crate) is_inline: bool,
}

impl Place {
    /// Returns the location of `offset`; none in comments and numbers.
    pub(crate) fn at(text: &str, offset: usize) -> Option<Place> {
        let (mut section, mut open_key, mut depth) = (String::new(), String::new(), 0_i32);
        let mut here: Option<Place> = None;
        let mut sections = BTreeSet::new();
        let (mut number, mut keys): (usize, Vec<(usize, String)>) = (0, Vec::new());
        let mut line_start = 0;
        for line in text.split('\n') {
            let is_here = (line_start..=line_start + line.len()).contains(&offset);
            if is_here {
                let before = line.get(..offset - line_start)?;
                let place = Place::in_line(line, before, line_start, depth > 0, &open_key)?;
                let parts = [section.as_str(), &place.section].into_iter().filter(|it| !it.is_empty());
                let section = parts.collect::<Vec<_>>().join(".");
                here = Some(Place { section, number, ..place });
            }
            let trimmed = without_comment(line).trim();
            let assigned = equals(trimmed);
            if depth == 0 && trimmed.starts_with('[') && assigned.is_none() {
                section = trimmed.trim_matches(['[', ']']).trim().to_owned();
                number += 1;
                if !is_here {
                    sections.insert(section.clone());
                }
            } else if let Some(at) = assigned.filter(|_| depth == 0) {
                let (key, value) = trimmed.split_at(at);
                open_key = unquoted(key.trim());
                if !is_here {
                    keys.push((number, open_key.clone()));
                }
                depth += brackets(value);
            } else if depth > 0 {
                depth += brackets(trimmed);
            }
            depth = depth.max(0);
            line_start += line.len() + 1;
        }
        let mut here = here?;
        if !here.is_inline {
            let given = keys.into_iter().filter(|(of, _)| *of == here.number);
            here.given = given.map(|(_, key)| key).collect();
        }
        Some(Place { sections, ..here })
    }

    fn in_line(line: &str, before: &str, line_start: usize, goes_on: bool, key: &str) -> Option<Place> {
        if without_comment(before).len() < before.len() {
            return None;
        }
        let trimmed = before.trim_start();
        let indent = before.len() - trimmed.len();
        let assigned = equals(trimmed).filter(|_| !goes_on);
        let what = match assigned {
            _ if goes_on => What::Value(key.to_owned()),
            Some(at) => What::Value(unquoted(trimmed.get(..at)?.trim())),
            None if trimmed.starts_with('[') => What::Header,
            None => What::Key,
        };
        let mut value_start = assigned.map_or(indent, |at| indent + at + 1);
        let table =
            assigned.and_then(|_| InlineTable::at(line.get(value_start..)?, before.len() - value_start));
        let (mut section, mut given, is_inline) = (String::new(), BTreeSet::new(), table.is_some());
        let mut what = what;
        if let Some(table) = table {
            let What::Value(key) = &what else { return None };
            section = [std::slice::from_ref(key), &table.path].concat().join(".");
            value_start += table.start;
            given = table.given;
            what = table.key.map_or(What::Key, What::Value);
        }
        let typed = before.get(value_start..)?;
        let quotes = typed.matches('"').count();
        let is_value = matches!(what, What::Value(_));
        let start = if quotes % 2 == 1 {
            value_start + typed.rfind('"')?
        } else if is_value {
            value_start + typed.rfind(['[', ',', ' ', '\t']).map_or(0, |at| at + 1)
        } else {
            before.len() - typed.trim_start().len()
        };
        let is_quoted = line.get(start..)?.starts_with('"') && start < before.len();
        let behind = line.get(before.len()..)?.trim_end();
        let rest = match (is_quoted, &what) {
            (true, _) => behind.find('"').map_or(0, |at| at + 1),
            (false, What::Header) => behind.find(']').map_or(0, |at| at + 1),
            (false, _) => {
                let is_part = |c: char| c.is_alphanumeric() || "_-.".contains(c);
                behind.find(|c| !is_part(c)).unwrap_or(behind.len())
            }
        };
        let typed = line.get(start..before.len())?;
        if is_value && !is_quoted && typed.starts_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        let (start, end) = (line_start + start, line_start + before.len() + rest);
        let entry = if is_inline { behind.split([',', '}']).next()? } else { without_comment(behind) };
        let has_value = equals(entry).is_some() || is_value;
        Some(Place { what, section, given, start, end, is_quoted, has_value, is_inline, ..Place::default() })
    }
}

/// An inline table around the cursor, such as `{ priority = 20, period = "1 ms" }`.
#[derive(Debug, Default)]
struct InlineTable {
    /// The keys of the tables around it within the same value, and its own.
    path: Vec<String>,
    /// The keys of its other entries.
    given: BTreeSet<String>,
    /// The key of the entry whose value the cursor is in; none in a key.
    key: Option<String>,
    /// Where that value begins, or the entry.
    start: usize,
}

impl InlineTable {
    /// Returns the innermost table around the cursor in a value, which may be incomplete.
    fn at(value: &str, cursor: usize) -> Option<InlineTable> {
        /// A table that is open: its key, where its last entry begins, the key of that with the start of its value, all keys, and
        /// how many arrays are open in it.
        type Open = (Option<String>, usize, Option<(String, usize)>, BTreeSet<String>, usize);
        let mut open: Vec<Open> = Vec::new();
        // With its depth.
        let mut found: Option<(InlineTable, usize)> = None;
        for (at, letter) in outside_strings(value).chain([(value.len(), ' ')]) {
            if found.is_none() && at >= cursor {
                let (_, entry, assigned, ..) = open.last()?;
                let (key, start) = assigned.clone().map_or((None, *entry), |(key, at)| (Some(key), at));
                let path = open.iter().filter_map(|it| it.0.clone()).collect();
                found = Some((InlineTable { path, key, start, ..InlineTable::default() }, open.len()));
            }
            let depth = open.len();
            match (letter, open.last_mut()) {
                ('{', outer) => {
                    let key = outer.and_then(|it| it.2.clone()).map(|(key, _)| key);
                    open.push((key, at + 1, None, BTreeSet::new(), 0));
                }
                ('}', Some(_)) if found.as_ref().is_some_and(|it| it.1 == depth) => break,
                ('}', Some(_)) => _ = open.pop(),
                ('[', Some(table)) => table.4 += 1,
                (']', Some(table)) => table.4 = table.4.saturating_sub(1),
                (',', Some(table)) if table.4 == 0 => (table.1, table.2) = (at + 1, None),
                ('=', Some((_, entry, assigned, keys, _))) if assigned.is_none() => {
                    let key = unquoted(value.get(*entry..at)?.trim());
                    // The key at the cursor is typed again.
                    if !found
                        .as_ref()
                        .is_some_and(|it| it.1 == depth && it.0.key.is_none() && it.0.start == *entry)
                    {
                        keys.insert(key.clone());
                    }
                    *assigned = Some((key, at + 1));
                }
                _ => {}
            }
        }
        let (mut table, depth) = found?;
        table.given = open.into_iter().nth(depth - 1)?.3;
        Some(table)
    }
}

/// Returns the letters outside strings.
fn outside_strings(line: &str) -> impl Iterator<Item = (usize, char)> {
    let mut in_string = false;
    line.char_indices().filter(move |(_, letter)| {
        in_string ^= *letter == '"';
        !in_string
    })
}

fn without_comment(line: &str) -> &str {
    let end = outside_strings(line).find(|(_, letter)| *letter == '#');
    end.and_then(|(at, _)| line.get(..at)).unwrap_or(line)
}

fn equals(line: &str) -> Option<usize> {
    outside_strings(line).find(|(_, letter)| *letter == '=').map(|(at, _)| at)
}

fn brackets(value: &str) -> i32 {
    let one = |(_, letter)| match letter {
        '[' => 1,
        ']' => -1,
        _ => 0,
    };
    outside_strings(value).map(one).sum()
}

fn unquoted(key: &str) -> String {
    key.split('.').map(|part| part.trim().trim_matches('"')).collect::<Vec<_>>().join(".")
}
