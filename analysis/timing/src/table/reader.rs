//! Reads a timing table.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeInteger, DeTable, DeValue};
use toml_parser::Source;
use toml_parser::parser::{EventKind, RecursionGuard, parse_document};

use super::error::{TableError, TableErrorKind, TomlKind};
use super::keys::{KEYS, OVERHEAD, TableKeyKind};
use super::{Entry, KeyPart, Table, TableSection, Times, is_assumption};
use crate::level::MOST_LEVELS;
use crate::toml_key::{TomlKey, key_named};
use crate::{Level, Rounding, Time, TimeError, Unit};

impl Table {
    /// Reads the text of a table. Never fails: see [`errors`](Table::errors) and [`lost`](Table::lost).
    pub fn parse(text: &str) -> Table {
        let mut reader = TableReader {
            table: Table::default(),
            unit: Unit::Milliseconds,
            levels: Some(0),
            levels_span: 0..0,
            loses_all: false,
            is_wait: false,
            parts: parts_of_keys(text),
        };
        let (document, errors) = DeTable::parse_recoverable(text);
        reader.document(document.get_ref());
        let mut table = reader.table;
        for entry in table.entries_mut() {
            entry.is_assumed = is_assumption(text.get(entry.value_span.end..).unwrap_or_default());
        }
        // If the text is not TOML, the entries are guesses, and so are all errors after the first.
        if let Some(error) = errors.into_iter().min_by_key(|error| error.span().map(|span| span.start)) {
            let kind = TableErrorKind::NotToml(error.message().to_owned());
            table.lost = true;
            table.errors = vec![TableError { span: error.span().unwrap_or(0..0), kind }];
        }
        table.errors.sort_by_key(|error| (error.span.start, error.span.end));
        table
    }
}

pub(super) struct TableReader {
    pub(super) table: Table,
    unit: Unit,
    /// How many levels there are; `None` where they were in error, so that no array can be judged.
    levels: Option<usize>,
    levels_span: Range<usize>,
    /// Whether an error in the present entry makes the whole table unusable.
    loses_all: bool,
    /// Whether the present section is that of waits.
    is_wait: bool,
    /// The parts of each key, by where its last one begins.
    parts: HashMap<usize, Vec<KeyPart>>,
}

impl TableReader {
    pub(super) fn error(&mut self, span: Range<usize>, kind: TableErrorKind) {
        self.table.lost |= self.loses_all;
        self.table.errors.push(TableError { span, kind });
    }

    fn document(&mut self, document: &DeTable) {
        // First what the entries are read with.
        self.loses_all = true;
        let mut without_section = Vec::new();
        for (key, value) in document.iter() {
            match key_named(&KEYS, key.get_ref()).map(|it| &it.kind) {
                Some(TableKeyKind::Unit) => self.unit(value),
                Some(TableKeyKind::Levels) => self.levels(value),
                Some(_) => {}
                None if matches!(value.get_ref(), DeValue::Integer(_) | DeValue::Float(_)) => {
                    self.table.lost = true;
                    without_section.push(key);
                }
                None => self.error(key.span(), TableErrorKind::UnknownKey(key.get_ref().to_string())),
            }
        }
        // One header is missing, above the first of them.
        if let Some(first) = without_section.into_iter().min_by_key(|key| key.span().start) {
            self.error(first.span(), TableErrorKind::NoSection(first.get_ref().to_string()));
        }
        if self.table.lost {
            // One of those keys may be `levels`.
            self.levels = None;
        }
        for (key, value) in document.iter() {
            // A section turns this off for its entries.
            self.loses_all = true;
            match (key_named(&KEYS, key.get_ref()).map(|it| &it.kind), value.get_ref()) {
                (Some(TableKeyKind::Entries(of, _, field)), DeValue::Table(section)) => {
                    self.is_wait = *of == TableSection::Wait;
                    let entries = self.section(section);
                    *field(&mut self.table) = entries;
                }
                (Some(TableKeyKind::Keys(..)), DeValue::Table(section)) if key.get_ref() == "overhead" => {
                    self.overhead(section);
                }
                (Some(TableKeyKind::Keys(..)), DeValue::Table(section)) => {
                    // No time of a record is in a bound.
                    self.loses_all = false;
                    self.measured(None, section);
                }
                (Some(TableKeyKind::Entries(..) | TableKeyKind::Keys(..)), other) => {
                    let (name, found) = (key.get_ref().to_string(), TomlKind::of(other));
                    self.error(value.span(), TableErrorKind::NotASection { name, found });
                }
                _ => {}
            }
        }
        self.loses_all = false;
        self.falling();
    }

    fn unit(&mut self, value: &Spanned<DeValue>) {
        let DeValue::String(name) = value.get_ref() else {
            return self.error(value.span(), TableErrorKind::UnitOfKind(TomlKind::of(value.get_ref())));
        };
        match Unit::parse(name) {
            Some(unit) => self.unit = unit,
            None => self.error(value.span(), TableErrorKind::UnknownUnit(name.to_string())),
        }
    }

    /// What is exceeded more rarely is not shorter: where times fall from level to level, one of them is wrong, or the
    /// levels stand in another order than the times.
    fn falling(&mut self) {
        let (levels, overhead) = (self.table.levels.clone(), &self.table.overhead);
        let mut order: Vec<usize> = (0..levels.len()).collect();
        order.sort_by_key(|&level| std::cmp::Reverse(levels[level]));
        let fall_in = |times: &[Time]| order.windows(2).find(|pair| times[pair[1]] < times[pair[0]]);
        let falls = |times: &Times| matches!(times, Times::PerLevel(times) if fall_in(times).is_some());
        if falls(&overhead.dispatch) || falls(&overhead.context_switch) {
            self.loses_all = true;
            self.error(self.table.overhead_span.clone(), TableErrorKind::FallingOverhead);
            return;
        }
        let mut varying = 0;
        let mut falling = Vec::new();
        for entry in self.table.entries_mut() {
            let Some(Times::PerLevel(times)) = &entry.value else { continue };
            varying += usize::from(times.windows(2).any(|pair| pair[0] != pair[1]));
            if let Some(&[before, after]) = fall_in(times) {
                let at = |column: usize| (times[column], levels[column]);
                let (key, before, after) = (entry.key.clone(), at(before), at(after));
                falling.push((entry.value_span.clone(), TableErrorKind::FallingTime { key, before, after }));
                entry.value = None;
            }
        }
        if falling.len() > 1 && falling.len() == varying {
            self.loses_all = true;
            self.error(self.levels_span.clone(), TableErrorKind::AllFalling);
            return;
        }
        for (span, kind) in falling {
            self.error(span, kind);
        }
    }

    fn levels(&mut self, value: &Spanned<DeValue>) {
        self.levels_span = value.span();
        let DeValue::Array(array) = value.get_ref() else {
            self.levels = None;
            return self.error(value.span(), TableErrorKind::LevelsOfKind(TomlKind::of(value.get_ref())));
        };
        if array.len() > MOST_LEVELS {
            self.levels = None;
            return self.error(value.span(), TableErrorKind::TooManyLevels(array.len()));
        }
        let mut levels = Vec::with_capacity(array.len());
        for item in array.iter() {
            let probability = match item.get_ref() {
                DeValue::Float(float) => float.as_str().parse().ok(),
                // No integer is between 0 and 1.
                _ => None,
            };
            match probability.and_then(Level::from_f64) {
                Some(level) if levels.contains(&level) => {
                    self.error(item.span(), TableErrorKind::RepeatedLevel(level));
                }
                Some(level) => levels.push(level),
                None => self.error(item.span(), TableErrorKind::NotALevel),
            }
        }
        // A column of a level in error must not be taken for that of another.
        self.levels = (levels.len() == array.len()).then_some(levels.len());
        if self.levels.is_some() {
            self.table.levels = levels;
        }
    }

    fn overhead(&mut self, section: &DeTable) {
        self.loses_all = true;
        self.table.overhead_span =
            section.iter().map(|(key, _)| key.span()).min_by_key(|span| span.start).unwrap_or_default();
        for (key, value) in section.iter() {
            let name = key.get_ref();
            if let Some(TomlKey { kind: TableKeyKind::Times(field), .. }) = key_named(&OVERHEAD, name) {
                *field(&mut self.table.overhead) = self.overhead_times(value);
            } else {
                self.error(key.span(), TableErrorKind::UnknownOverhead(name.to_string()));
            }
        }
    }

    fn overhead_times(&mut self, value: &Spanned<DeValue>) -> Times {
        let times = self.times(value);
        // That is reported, perhaps elsewhere.
        self.table.lost |= times.is_none();
        times.unwrap_or_default()
    }

    fn section(&mut self, section: &DeTable) -> Vec<Entry> {
        self.loses_all = false;
        let mut entries = Vec::with_capacity(section.len());
        self.entries(None, section, &mut entries);
        entries.sort_by_key(|entry| entry.key_span.start);
        let mut first_of: HashMap<String, usize> = HashMap::with_capacity(entries.len());
        for index in 0..entries.len() {
            let Some(&first) = first_of.get(&entries[index].key) else {
                first_of.insert(entries[index].key.clone(), index);
                continue;
            };
            // Neither is safe: the greater may be the mistake, or the smaller.
            entries[first].value = None;
            entries[index].value = None;
            let kind = TableErrorKind::RepeatedKey(entries[index].key.clone());
            self.error(entries[index].key_span.clone(), kind);
        }
        entries
    }

    /// `prefix`: the parts of the key before these. It is `Some("")` behind `""`, which is a part too: `"".a` is not `a`.
    fn entries(&mut self, prefix: Option<&str>, section: &DeTable, entries: &mut Vec<Entry>) {
        for (key, value) in section.iter() {
            let name = key.get_ref();
            let whole = prefix.map_or_else(|| name.to_string(), |prefix| format!("{prefix}.{name}"));
            let mut waits = None;
            let times = match value.get_ref() {
                DeValue::Table(section) if self.has_wait_keys(section) => {
                    let (times, number) = self.wait(section);
                    waits = number;
                    times
                }
                DeValue::Table(section) if !section.is_empty() => {
                    self.entries(Some(&whole), section, entries);
                    continue;
                }
                DeValue::Table(_) => {
                    self.error(key.span(), TableErrorKind::NoTime(whole.clone()));
                    None
                }
                // Below a section these are its entries, and all times would be read without them.
                DeValue::String(_) | DeValue::Array(_)
                    if match name.rsplit('.').next() {
                        Some("unit") => true,
                        Some("levels") => self.table.levels.is_empty(),
                        _ => false,
                    } =>
                {
                    self.loses_all = true;
                    self.error(key.span(), TableErrorKind::BelowSection(name.to_string()));
                    self.loses_all = false;
                    None
                }
                _ => self.times(value),
            };
            entries.push(Entry {
                key: whole,
                key_span: key.span(),
                key_parts: self.parts.remove(&key.span().start).unwrap_or_default(),
                value: times,
                value_span: value.span(),
                waits,
                is_assumed: false,
            });
        }
    }

    /// Whether a value of `[wait]` is `{ time = 0.8, waits = 3 }`, and not a part of a dotted key. Earlier versions wrote `times`.
    fn has_wait_keys(&self, section: &DeTable) -> bool {
        let has = |key| section.contains_key(key);
        self.is_wait && section.len() == 2 && has("time") && (has("waits") || has("times"))
    }

    /// Reads the time and the number of waits.
    fn wait(&mut self, section: &DeTable) -> (Option<Times>, Option<u64>) {
        let (mut times, mut number) = (None, None);
        for (key, value) in section.iter() {
            if key.get_ref() == "time" {
                times = self.times(value);
                continue;
            }
            if let DeValue::Integer(integer) = value.get_ref() {
                number = integer_text(integer).and_then(|text| text.parse().ok()).filter(|it| *it > 0);
            }
            if number.is_none() {
                self.error(value.span(), TableErrorKind::NoNumberOfWaits);
            }
        }
        (times.filter(|_| number.is_some()), number)
    }

    pub(super) fn times(&mut self, value: &Spanned<DeValue>) -> Option<Times> {
        match value.get_ref() {
            DeValue::Array(array) => self.times_per_level(value.span(), array),
            _ => self.one_time(value).map(Times::Always),
        }
    }

    fn times_per_level(&mut self, span: Range<usize>, array: &DeArray) -> Option<Times> {
        let levels = self.levels?;
        let times = array.len();
        if levels == 0 {
            self.error(span, TableErrorKind::NoLevels { times });
            // Once is enough.
            self.levels = None;
            return None;
        }
        if times != levels {
            self.error(span, TableErrorKind::OtherCount { times, levels });
            return None;
        }
        // All of them, so that every error is reported.
        let times: Vec<Option<Time>> = array.iter().map(|item| self.one_time(item)).collect();
        times.into_iter().collect::<Option<Vec<Time>>>().map(Times::PerLevel)
    }

    pub(super) fn one_time(&mut self, value: &Spanned<DeValue>) -> Option<Time> {
        let unit = self.unit;
        let kind = match (time_in(value.get_ref(), unit), value.get_ref()) {
            (Some((_, Ok(time))), _) => return Some(time),
            (Some((text, Err(error))), _) => TableErrorKind::InvalidTime { text, unit, error },
            (None, DeValue::String(text)) if Time::parse_with_unit(text, Rounding::Up).is_ok() => {
                TableErrorKind::TimeWithUnit { text: text.to_string(), unit }
            }
            (None, other) => TableErrorKind::TimeOfKind { found: TomlKind::of(other), unit },
        };
        self.error(value.span(), kind);
        None
    }
}

/// Returns a number as it is written, and as a time; none where the value is no number.
pub(crate) fn time_in(value: &DeValue, unit: Unit) -> Option<(String, Result<Time, TimeError>)> {
    let (text, number) = match value {
        DeValue::Integer(integer) => (integer.to_string(), integer_text(integer)),
        DeValue::Float(float) => (float.to_string(), Some(float.as_str().to_owned())),
        _ => return None,
    };
    let time = number.ok_or(TimeError::TooLarge).and_then(|it| Time::parse(&it, unit, Rounding::Up));
    Some((text, time))
}

/// So deep may inline tables be nested, as [`DeTable`] has it.
const MOST_NESTED: u32 = 80;

/// So many parts of a key are kept: those of a header and of a dotted key, each as long as it may be.
const MOST_PARTS: usize = 160;

/// The parts of all keys and headers, by where the last of them begins. A [`DeTable`] knows only the first place of a part
/// that several keys have in common.
fn parts_of_keys(text: &str) -> HashMap<usize, Vec<KeyPart>> {
    let source = Source::new(text);
    let mut events = Vec::new();
    parse_document(&source.lex().into_vec(), &mut RecursionGuard::new(&mut events, MOST_NESTED), &mut ());
    let mut found = HashMap::new();
    // What the keys of the document begin with, and of each inline table that is open; the first part is the section.
    let mut open: Vec<Vec<KeyPart>> = vec![Vec::new()];
    let mut key: Vec<KeyPart> = Vec::new();
    let (mut last, mut is_continued) = (0, false);
    let without_section = |key: &[KeyPart]| key.get(1..).unwrap_or_default().to_vec();
    for event in events {
        match event.kind() {
            EventKind::StdTableOpen | EventKind::ArrayTableOpen => open = vec![Vec::new()],
            EventKind::SimpleKey => {
                if !is_continued {
                    key = open.last().cloned().unwrap_or_default();
                }
                is_continued = false;
                last = event.span().start();
                if let Some(raw) = source.get(event).filter(|_| key.len() < MOST_PARTS) {
                    let mut name = Cow::Borrowed("");
                    raw.decode_key(&mut name, &mut ());
                    let written = raw.as_str();
                    let bare = written
                        .strip_prefix(['"', '\''])
                        .map_or(written, |it| it.strip_suffix(['"', '\'']).unwrap_or(it));
                    let span_start = last + usize::from(written.starts_with(['"', '\'']));
                    let start =
                        key.get(1..).and_then(<[KeyPart]>::last).map_or(0, |part| part.of_key.end + 1);
                    let of_key = if key.is_empty() { 0..0 } else { start..start + name.len() };
                    key.push(KeyPart {
                        of_key,
                        span: span_start..span_start + bare.len(),
                        verbatim: bare == name,
                    });
                }
            }
            EventKind::KeySep => is_continued = true,
            EventKind::StdTableClose | EventKind::ArrayTableClose => {
                found.insert(last, without_section(&key));
                open = vec![key.clone()];
            }
            EventKind::KeyValSep => {
                found.insert(last, without_section(&key));
            }
            EventKind::InlineTableOpen => open.push(key.clone()),
            EventKind::InlineTableClose => drop(open.pop()),
            _ => {}
        }
    }
    found
}

/// In decimal; `None` where it does not fit.
fn integer_text(integer: &DeInteger) -> Option<String> {
    match integer.radix() {
        10 => Some(integer.as_str().to_owned()),
        radix => u64::from_str_radix(integer.as_str(), radix).ok().map(|value| value.to_string()),
    }
}
