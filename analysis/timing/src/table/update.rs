//! Writes measured times into a table, and keeps everything else of its text: comments, order, and entries by hand.

use toml_edit::{Array, DocumentMut, Item, Table as EditTable, Value};

use super::measured::Measured;
use super::{Entry, Level, Table, TableError, Times};
use crate::{Time, Unit};

/// A measured entry to write.
#[derive(Debug, Clone, PartialEq)]
pub struct NewEntry {
    /// Its record. The key has a `/` for a program, and `times` has one time for each level.
    pub record: Measured,
}

/// A table with measured times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Updated {
    /// The text.
    pub text: String,
    /// The entries that were not written.
    pub kept: Vec<Kept>,
}

/// An entry that was not overwritten, since somebody wrote or edited it by hand.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum Kept {
    /// The table has no record of this entry; `entry` is its key in the table, which may lack the library.
    ByHand { key: String, entry: String },
    /// The entry has other times than its record.
    Edited { key: String },
}

/// Why a table cannot be updated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UpdateError {
    /// It has an error: its entries may not be those that they seem.
    Invalid(TableError),
    /// Entries that are kept have times at other levels, those of the table.
    OtherLevels(Vec<Level>),
}

/// Writes entries with times at `levels` into the text of a table. An empty text becomes a table in microseconds.
///
/// An entry by hand stays unless `replace`: one without a record in `[measured]`, or with other times than its record.
///
/// # Errors
///
/// The table has an error, or other entries with other levels. The text is not changed.
pub fn update(
    text: &str,
    levels: &[Level],
    entries: &[NewEntry],
    replace: bool,
) -> Result<Updated, UpdateError> {
    let is_new = text.trim().is_empty();
    let text = if is_new { "unit = \"us\"\n" } else { text };
    let table = Table::parse(text);
    if let Some(error) = table.errors.first() {
        return Err(UpdateError::Invalid(error.clone()));
    }
    let Ok(mut document) = text.parse::<DocumentMut>() else {
        let kind = super::TableErrorKind::NotToml(String::new());
        return Err(UpdateError::Invalid(TableError { span: 0..0, kind }));
    };
    let mut kept = Vec::new();
    let mut written = Vec::new();
    for NewEntry { record } in entries {
        match existing(&table, record) {
            Some(entry) if !replace && !is_measured(&table, entry) => {
                kept.push(reason(&table, record, entry))
            }
            found => written.push((record, found)),
        }
    }
    let replaced = |entry: &Entry| written.iter().any(|(_, found)| *found == Some(entry));
    let others = table.codels.iter().chain(&table.programs).chain(&table.components);
    let has_levels = |times: &Times| matches!(times, Times::PerLevel(_));
    let stay = others.filter(|entry| !replaced(entry)).filter_map(|entry| entry.value.as_ref());
    let overhead = [&table.overhead.dispatch, &table.overhead.context_switch];
    if table.levels != levels {
        if stay.chain(overhead).any(has_levels) {
            return Err(UpdateError::OtherLevels(table.levels));
        }
        let mut array = Array::new();
        levels.iter().for_each(|level| array.push_formatted(number(&level.to_string())));
        set(document.as_table_mut(), &["levels"], Item::Value(Value::Array(array)));
    }
    let unit = unit_of(&document);
    for (record, found) in &written {
        let section = if record.key.contains('/') { "program" } else { "codel" };
        let whole = [record.key.as_str()];
        let parts: Vec<&str> = match found {
            Some(entry) => entry.key_parts.iter().map(|part| &entry.key[part.of_key.clone()]).collect(),
            None => whole.into(),
        };
        let path: Vec<&str> = [section].into_iter().chain(parts).collect();
        set(document.as_table_mut(), &path, Item::Value(times(&record.times, unit)));
    }
    // After all entries, so that the sections of a new table are in this order.
    for (record, found) in &written {
        let key = found.map_or(record.key.as_str(), |entry| entry.key.as_str());
        set(document.as_table_mut(), &["measured", key], Item::Table(fields(record, unit)));
    }
    Ok(Updated { text: document.to_string(), kept })
}

/// The entry of this key: that with the library, or without if there is none.
fn existing<'t>(table: &'t Table, record: &Measured) -> Option<&'t Entry> {
    let section = if record.key.contains('/') { &table.programs } else { &table.codels };
    let find = |key: &str| section.iter().find(|entry| entry.key == key);
    find(&record.key).or_else(|| find(record.key.split_once('.')?.1))
}

fn record_of<'t>(table: &'t Table, entry: &Entry) -> Option<&'t Measured> {
    table.measured.iter().find(|record| record.key == entry.key)
}

fn is_measured(table: &Table, entry: &Entry) -> bool {
    record_of(table, entry).is_some_and(|record| entry.value.as_ref() == Some(&record.times))
}

fn reason(table: &Table, record: &Measured, entry: &Entry) -> Kept {
    let key = record.key.clone();
    match record_of(table, entry) {
        Some(_) => Kept::Edited { key },
        None => Kept::ByHand { key, entry: entry.key.clone() },
    }
}

fn unit_of(document: &DocumentMut) -> Unit {
    let named = document.get("unit").and_then(Item::as_str).and_then(Unit::parse);
    named.unwrap_or(Unit::Milliseconds)
}

/// Sets the value at a path, and makes the tables on the way; the comments around an old value stay.
fn set(table: &mut EditTable, path: &[&str], item: Item) {
    let Some((last, sections)) = path.split_last() else { return };
    let mut table: &mut dyn toml_edit::TableLike = table;
    for &section in sections {
        let entry = table.entry(section).or_insert_with(|| {
            let mut new = EditTable::new();
            // `[measured]` has tables only, and needs no header of its own.
            new.set_implicit(section == "measured");
            Item::Table(new)
        });
        match entry.as_table_like_mut() {
            Some(inner) => table = inner,
            None => return,
        }
    }
    let mut item = item;
    match (table.get_mut(last), item.as_value_mut()) {
        (Some(Item::Value(old)), Some(new)) => {
            *new.decor_mut() = old.decor().clone();
            *old = new.clone();
        }
        (Some(Item::Table(old)), _) => {
            if let Item::Table(new) = &mut item {
                *new.decor_mut() = old.decor().clone();
                new.set_position(old.position());
            }
            table.insert(last, item);
        }
        _ => {
            table.insert(last, item);
        }
    }
}

fn fields(record: &Measured, unit: Unit) -> EditTable {
    let mut table = EditTable::new();
    let texts = |texts: &[String]| Item::Value(Value::Array(texts.iter().map(String::as_str).collect()));
    let mut put = |name: &str, item: Item| drop(table.insert(name, item));
    put("executions", toml_edit::value(i64::try_from(record.executions).unwrap_or(i64::MAX)));
    put("greatest", Item::Value(number(&record.greatest.number_in(unit))));
    put("times", Item::Value(times(&record.times, unit)));
    put("method", toml_edit::value(&record.method));
    // What is no date stays readable as a text.
    let date = record
        .date
        .parse()
        .map_or_else(|_| toml_edit::value(&record.date), |date: toml_edit::Datetime| toml_edit::value(date));
    put("date", date);
    put("samples", toml_edit::value(&record.samples));
    put("files", texts(&record.files));
    put("bytes", toml_edit::value(i64::try_from(record.bytes).unwrap_or(i64::MAX)));
    if let Some((source, digest)) = record.source.as_ref().zip(record.source_digest.as_ref()) {
        put("source", toml_edit::value(source));
        put("source_digest", toml_edit::value(digest));
    }
    if !record.warnings.is_empty() {
        put("warnings", texts(&record.warnings));
    }
    table
}

fn times(times: &Times, unit: Unit) -> Value {
    let one = |time: &Time| number(&time.number_in(unit));
    match times {
        Times::Always(time) => one(time),
        Times::PerLevel(times) => {
            let mut array = Array::new();
            times.iter().for_each(|time| array.push(one(time)));
            Value::Array(array)
        }
    }
}

/// A number as it is written: `1e-3` stays `1e-3`.
fn number(text: &str) -> Value {
    text.parse().unwrap_or_else(|_| Value::from(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::{Expect, expect};

    fn entry(key: &str, micros: &[u64]) -> NewEntry {
        let times = micros.iter().map(|it| Time::from_nanos(it * 1000)).collect();
        NewEntry {
            record: Measured {
                key: key.to_owned(),
                span: 0..0,
                executions: 5000,
                greatest: Time::from_nanos(micros[0] * 900),
                times: Times::PerLevel(times),
                method: "generalised Pareto".to_owned(),
                date: "2026-11-23".to_owned(),
                samples: "ab12".to_owned(),
                files: vec!["run.samples".to_owned()],
                bytes: 4711,
                source: None,
                source_digest: None,
                warnings: Vec::new(),
            },
        }
    }

    fn levels() -> Vec<Level> {
        [1e-3, 1e-4].into_iter().filter_map(Level::from_f64).collect()
    }

    fn check(text: &str, entries: &[NewEntry], replace: bool, expected: Expect) {
        let updated = update(text, &levels(), entries, replace).expect("a valid table");
        let table = Table::parse(&updated.text);
        assert!(table.errors.is_empty(), "{:?}\n{}", table.errors, updated.text);
        let kept: String = updated.kept.iter().map(|it| format!("{it:?}\n")).collect();
        expected.assert_eq(&format!("{}{kept}", updated.text));
        // A second update changes nothing.
        assert_eq!(
            update(&updated.text, &levels(), entries, replace).expect("a valid table").text,
            updated.text
        );
    }

    #[test]
    fn a_new_table() {
        check(
            "",
            &[entry("nav.astar", &[290_000, 297_500]), entry("Pilot/update", &[4, 5])],
            false,
            expect![[r#"
                unit = "us"
                levels = [1e-3, 1e-4]

                [codel]
                "nav.astar" = [290000, 297500]

                [program]
                "Pilot/update" = [4, 5]

                [measured."nav.astar"]
                executions = 5000
                greatest = 261000
                times = [290000, 297500]
                method = "generalised Pareto"
                date = 2026-11-23
                samples = "ab12"
                files = ["run.samples"]
                bytes = 4711

                [measured."Pilot/update"]
                executions = 5000
                greatest = 3.6
                times = [4, 5]
                method = "generalised Pareto"
                date = 2026-11-23
                samples = "ab12"
                files = ["run.samples"]
                bytes = 4711
            "#]],
        );
    }

    #[test]
    fn comments_order_and_entries_by_hand_stay() {
        let text = r#"# By the team of the arm.
unit = "ms" # not s
levels = [1e-3, 1e-4]

[codel]
# static analysis
"arm.grip" = 3
astar = 7 # guessed
nav.dist = [1, 2] # measured

[overhead]
dispatch = 0.01

[measured."nav.dist"]
executions = 10
greatest = 1
times = [1, 2]
method = "generalised Pareto"
date = 2026-01-01
samples = "00"
files = []
bytes = 0
"#;
        let entries = [
            entry("nav.astar", &[9000, 9500]),
            entry("nav.dist", &[1500, 2500]),
            entry("nav.turn", &[70, 80]),
        ];
        check(
            text,
            &entries,
            false,
            expect![[r##"
                # By the team of the arm.
                unit = "ms" # not s
                levels = [1e-3, 1e-4]

                [codel]
                # static analysis
                "arm.grip" = 3
                astar = 7 # guessed
                nav.dist = [1.5, 2.5] # measured
                "nav.turn" = [0.07, 0.08]

                [overhead]
                dispatch = 0.01

                [measured."nav.dist"]
                executions = 5000
                greatest = 1.35
                times = [1.5, 2.5]
                method = "generalised Pareto"
                date = 2026-11-23
                samples = "ab12"
                files = ["run.samples"]
                bytes = 4711

                [measured."nav.turn"]
                executions = 5000
                greatest = 0.063
                times = [0.07, 0.08]
                method = "generalised Pareto"
                date = 2026-11-23
                samples = "ab12"
                files = ["run.samples"]
                bytes = 4711
                ByHand { key: "nav.astar", entry: "astar" }
            "##]],
        );
        check(
            text,
            &entries[..1],
            true,
            expect![[r##"
                # By the team of the arm.
                unit = "ms" # not s
                levels = [1e-3, 1e-4]

                [codel]
                # static analysis
                "arm.grip" = 3
                astar = [9, 9.5] # guessed
                nav.dist = [1, 2] # measured

                [overhead]
                dispatch = 0.01

                [measured."nav.dist"]
                executions = 10
                greatest = 1
                times = [1, 2]
                method = "generalised Pareto"
                date = 2026-01-01
                samples = "00"
                files = []
                bytes = 0

                [measured.astar]
                executions = 5000
                greatest = 8.1
                times = [9, 9.5]
                method = "generalised Pareto"
                date = 2026-11-23
                samples = "ab12"
                files = ["run.samples"]
                bytes = 4711
            "##]],
        );
    }

    #[test]
    fn an_edited_entry_stays() {
        let first = update("", &levels(), &[entry("a.b", &[10, 20])], false).expect("a valid table").text;
        let edited = first.replacen("[10, 20]", "[10, 25]", 1);
        let second = update(&edited, &levels(), &[entry("a.b", &[11, 21])], false).expect("a valid table");
        assert_eq!((second.text, second.kept), (edited, vec![Kept::Edited { key: "a.b".to_owned() }]));
    }

    #[test]
    fn other_levels_are_refused_if_entries_by_hand_have_them() {
        let text = "levels = [1e-2]\n[codel]\na = [3]\n";
        let found = update(text, &levels(), &[entry("b.c", &[1, 2])], false);
        assert_eq!(found, Err(UpdateError::OtherLevels(Level::from_f64(1e-2).into_iter().collect())));
        let invalid = update("[codel]\na = -3\n", &levels(), &[], false);
        assert!(matches!(invalid, Err(UpdateError::Invalid(_))));
    }
}
