//! Writes measured times into a table, and keeps everything else of its text: comments, order, and entries by hand.

use toml_edit::{Array, Decor, DocumentMut, Item, RawString, Table as EditTable, TableLike, Value};

use super::{Entry, Measured, Table, TableError, Times, is_assumption};
use crate::{Level, Time, Unit};

/// A table with measured times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Updated {
    /// The text.
    pub text: String,
    /// The entries that were not written.
    pub kept: Vec<KeptEntry>,
    /// How many assumed entries were replaced.
    pub assumed: usize,
}

/// An entry that was not overwritten, since somebody wrote or edited it by hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptEntry {
    /// The key of the measured times.
    pub key: String,
    /// The key of the entry, which may lack the library.
    pub entry: String,
    /// The times of the entry.
    pub times: Option<Times>,
    /// Whether it was measured, and edited afterwards.
    pub is_edited: bool,
}

/// Why a table cannot be updated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UpdateError {
    /// It has an error: its entries may not be those that they seem.
    Invalid(TableError),
    /// Entries that are kept have times at other levels, those of the table.
    OtherLevels(Vec<Level>),
}

/// Writes measured times at `levels` into the text of a table. An empty text becomes a table in microseconds.
///
/// The key of a record is that of a program if it has a `/`, and of a port if it begins with `(access) `; its `times` has one time for
/// each level.
///
/// An entry by hand stays unless `replace`: one without a record in `[measured]`, or with other times than its record, or with a key
/// that lacks the library, since it may be that of another one. It is replaced by an entry with the whole key. An entry that says
/// `# assumed` behind its value does not stay, and loses this comment.
///
/// # Errors
///
/// The table has an error, or other entries with other levels. The text is not changed.
pub fn update(
    text: &str,
    levels: &[Level],
    records: &[Measured],
    replace: bool,
) -> Result<Updated, UpdateError> {
    let is_new = text.trim().is_empty();
    let text = if is_new { "unit = \"us\"\n" } else { text };
    let table = Table::parse(text);
    if let Some(error) = table.errors.first() {
        return Err(UpdateError::Invalid(error.clone()));
    }
    let Ok(mut document) = text.parse::<DocumentMut>() else {
        let kind = super::error::TableErrorKind::NotToml(String::new());
        return Err(UpdateError::Invalid(TableError { span: 0..0, kind }));
    };
    let mut kept = Vec::new();
    let mut written = Vec::new();
    for record in records {
        match existing(&table, &record.key) {
            Some(entry) if !replace && !entry.is_assumed && !is_measured(&table, record, entry) => {
                kept.push(KeptEntry {
                    key: section_of(&record.key).1.to_owned(),
                    entry: entry.key.clone(),
                    times: entry.value.clone(),
                    is_edited: entry.key == section_of(&record.key).1
                        && record_of(&table, &entry.key).is_some(),
                });
            }
            found => written.push((record, found)),
        }
    }
    if written.is_empty() {
        return Ok(Updated { text: text.to_owned(), kept, assumed: 0 });
    }
    let replaced = |entry: &Entry| written.iter().any(|(_, found)| *found == Some(entry));
    let others = table.entries();
    let has_levels = |times: &Times| matches!(times, Times::PerLevel(_));
    let stay = others.filter(|entry| !replaced(entry)).filter_map(|entry| entry.value.as_ref());
    let remains = |key: &str| written.iter().all(|(record, _)| section_of(&record.key).1 != key);
    let records = table.measured.iter().filter(|it| remains(&it.key)).map(|it| &it.times);
    let overhead = [&table.overhead.dispatch, &table.overhead.context_switch];
    if table.levels != levels {
        if stay.chain(overhead).chain(records).any(has_levels) {
            return Err(UpdateError::OtherLevels(table.levels));
        }
        let mut array = Array::new();
        levels.iter().for_each(|level| array.push_formatted(number(&level.to_string())));
        set(document.as_table_mut(), &["levels"], Item::Value(Value::Array(array)));
    }
    write_entries(&mut document, &written);
    let assumed = written.iter().filter(|(_, found)| found.is_some_and(|entry| entry.is_assumed)).count();
    Ok(Updated { text: as_before(document.to_string(), text), kept, assumed })
}

/// Returns the text of a table with another time to dispatch a job, and the line to write; `None` where the text is not TOML.
///
/// ```
/// let text = "unit = \"us\"\n[overhead] # measured\ncontext_switch = 2\n";
/// let (text, line) = mauve_timing::with_dispatch(text, mauve_timing::Time::from_nanos(12_500)).unwrap();
/// assert_eq!(text, "unit = \"us\"\n[overhead] # measured\ncontext_switch = 2\ndispatch = 12.5\n");
/// assert_eq!(line, "dispatch = 12.5");
/// ```
pub fn with_dispatch(text: &str, time: Time) -> Option<(String, String)> {
    let mut document: DocumentMut = text.parse().ok()?;
    let value = times(&Times::Always(time), unit_of(&document));
    let line = format!("dispatch = {value}");
    set(document.as_table_mut(), &["overhead", "dispatch"], Item::Value(value));
    Some((as_before(document.to_string(), text), line))
}

/// Returns the text of a table with one time for a key, at every level, instead of those that it has; `None` where the text is not
/// TOML, or has no such entry and `is_added` is not said. The section is `codel`, `program` or `access`. As for a measured time, an
/// entry may lack the library.
///
/// ```
/// use mauve_timing::{Time, with_time};
/// let text = "levels = [1e-3, 1e-6]\n[codel.nav]\nplan = [21, 30] # astar\n";
/// let time = Time::from_nanos(12_000_000);
/// assert_eq!(with_time(text, "nav.plan", time, false).unwrap(), text.replace("[21, 30]", "12"));
/// assert_eq!(with_time(text, "nav.look", time, false), None);
/// assert!(with_time(text, "nav.look", time, true).unwrap().contains("\"nav.look\" = 12\n"));
/// ```
pub fn with_time(text: &str, key: &str, time: Time, is_added: bool) -> Option<String> {
    let table = Table::parse(text);
    let mut document: DocumentMut = text.parse().ok()?;
    let value = times(&Times::Always(time), unit_of(&document));
    let (section, whole) = section_of(key);
    let path: Vec<&str> = match existing(&table, key) {
        Some(entry) => entry.key_parts.iter().filter_map(|part| entry.key.get(part.of_key.clone())).collect(),
        None if is_added => vec![whole],
        None => return None,
    };
    let path: Vec<&str> = [section].into_iter().chain(path).collect();
    set(document.as_table_mut(), &path, Item::Value(value));
    Some(as_before(document.to_string(), text))
}

/// Returns where a table gets an entry for a codel that it lacks, and the line to insert there; the comment says that the time is
/// assumed, and `note`. `None` where the table has an error, or where its layout has no room for a line.
///
/// ```
/// use mauve_timing::{Time, assumed_entry};
/// let text = "[codel]\nscan = 3\n[access]\nscan = 1\n";
/// let (at, line) = assumed_entry(text, "arm.look", Time::from_nanos(33_000_000), "at most 33 ms").unwrap();
/// assert_eq!((at, line.as_str()), (16, "\n\"arm.look\" = 33 # assumed: at most 33 ms"));
/// ```
pub fn assumed_entry(text: &str, key: &str, time: Time, note: &str) -> Option<(usize, String)> {
    let mut document: DocumentMut = text.parse().ok()?;
    let mut value = times(&Times::Always(time), unit_of(&document));
    value.decor_mut().set_suffix(format!(" # assumed: {note}"));
    set(document.as_table_mut(), &["codel", key], Item::Value(value));
    let new = as_before(document.to_string(), text);
    let table = Table::parse(&new);
    let is_right = table.errors.is_empty() && table.codels.iter().any(|it| it.key == key && it.is_assumed);
    // What both texts begin with, then what they end with, is around the line.
    let same = text.bytes().zip(new.bytes()).take_while(|(old, new)| old == new).count();
    let after = text.get(same..).filter(|rest| is_right && new.ends_with(rest))?;
    let line = new.get(same..new.len() - after.len())?;
    let ended = ["\r\n", "\n"]
        .into_iter()
        .find(|end| line.ends_with(end) && text.get(..same).is_some_and(|it| it.ends_with(end)));
    Some(match ended {
        // Lines that are inserted at one place begin with their ends.
        Some(end) => (same - end.len(), format!("{end}{}", line.strip_suffix(end)?)),
        None => (same, line.to_owned()),
    })
}

/// Writes the times of records, each instead of the entry that was found for it; then their places in `[measured]`.
fn write_entries(document: &mut DocumentMut, written: &[(&Measured, Option<&Entry>)]) {
    let unit = unit_of(document);
    for (record, found) in written {
        let (section, key) = section_of(&record.key);
        let mut value = times(&record.times, unit);
        let whole = [key];
        let parts: Vec<&str> = match found {
            Some(entry) if entry.key == key => {
                entry.key_parts.iter().map(|part| &entry.key[part.of_key.clone()]).collect()
            }
            Some(entry) => {
                let entries = document.get_mut(section).and_then(Item::as_table_like_mut);
                if let Some(Item::Value(old)) = entries.and_then(|it| remove(it, &entry.key)) {
                    *value.decor_mut() = decor_of(&old);
                }
                whole.into()
            }
            None => whole.into(),
        };
        let path: Vec<&str> = [section].into_iter().chain(parts).collect();
        set(document.as_table_mut(), &path, Item::Value(value));
    }
    // After all entries, so that the sections of a new table are in this order.
    for (record, found) in written {
        let (_, whole) = section_of(&record.key);
        for key in [whole].into_iter().chain(found.map(|entry| entry.key.as_str())) {
            if let Some(measured) = document.get_mut("measured").and_then(Item::as_table_like_mut)
                && (key != whole || !measured.contains_key(key))
            {
                remove(measured, key);
            }
        }
        set(document.as_table_mut(), &["measured", whole], Item::Table(fields(record, unit)));
    }
}

/// Returns a new text with the byte order mark and the line ends of the old one.
fn as_before(new: String, old: &str) -> String {
    let ends = old.matches('\n').count();
    let has_crlf = ends > 0 && ends == old.matches("\r\n").count();
    let new = if has_crlf { new.replace("\r\n", "\n").replace('\n', "\r\n") } else { new };
    if old.starts_with('\u{feff}') && !new.starts_with('\u{feff}') { format!("\u{feff}{new}") } else { new }
}

/// Removes what has a key that may be written in parts.
fn remove(table: &mut dyn TableLike, key: &str) -> Option<Item> {
    if let Some(found) = table.remove(key) {
        return Some(found);
    }
    key.match_indices('.').find_map(|(at, _)| {
        let inner = table.get_mut(&key[..at])?.as_table_like_mut()?;
        let found = remove(inner, &key[at + 1..])?;
        if inner.is_empty() {
            table.remove(&key[..at]);
        }
        Some(found)
    })
}

/// Returns the section of a record, and its key there.
fn section_of(key: &str) -> (&'static str, &str) {
    match key.strip_prefix("(access) ") {
        Some(port) => ("access", port),
        None if key.contains('/') => ("program", key),
        None => ("codel", key),
    }
}

/// Returns the entry for the key of a measurement.
pub fn existing<'t>(table: &'t Table, key: &str) -> Option<&'t Entry> {
    match section_of(key) {
        ("access", port) => entry_for(&table.accesses, port, true),
        ("program", program) => entry_for(&table.programs, program, false),
        (_, codel) => entry_for(&table.codels, codel, false),
    }
}

/// Returns the entry for a whole key: that with the library, or without if there is none.
pub fn entry_for<'t>(entries: &'t [Entry], key: &str, is_port: bool) -> Option<&'t Entry> {
    let find = |key: &str| entries.iter().find(|entry| entry.key == key);
    let component = key.split('/').next().unwrap_or_default();
    let library = component.split_once('.').map(|(library, _)| library.len() + 1);
    // Without a library, the part before the point is the component of a port.
    let library = library.filter(|_| !is_port || key.matches('.').count() > 1);
    find(key).or_else(|| find(key.get(library?..)?))
}

fn record_of<'t>(table: &'t Table, key: &str) -> Option<&'t Measured> {
    table.measured.iter().find(|record| record.key == key)
}

fn is_measured(table: &Table, record: &Measured, entry: &Entry) -> bool {
    let old = record_of(table, &entry.key).filter(|_| entry.key == section_of(&record.key).1);
    old.is_some_and(|old| entry.value.as_ref() == Some(&old.times))
}

/// Returns the unit of the times in the text of a table.
pub fn unit_in(text: &str) -> Unit {
    text.parse().map_or(Unit::default(), |document| unit_of(&document))
}

fn unit_of(document: &DocumentMut) -> Unit {
    let named = document.get("unit").and_then(Item::as_str).and_then(Unit::parse);
    named.unwrap_or(Unit::Milliseconds)
}

/// Sets the value at a path, and makes the tables on the way; the comments around an old value stay.
pub(crate) fn set(table: &mut EditTable, path: &[&str], mut item: Item) {
    let Some((last, sections)) = path.split_last() else { return };
    let mut table: &mut dyn TableLike = table;
    for &section in sections {
        let entry = table.entry(section).or_insert_with(|| {
            let mut new = EditTable::new();
            // What has tables only, such as `[measured]`, needs no header of its own.
            new.set_implicit(item.is_table());
            Item::Table(new)
        });
        match entry.as_table_like_mut() {
            Some(inner) => table = inner,
            None => return,
        }
    }
    match (table.get_mut(last), item.as_value_mut()) {
        (Some(Item::Value(old)), Some(new)) => {
            *new.decor_mut() = decor_of(old);
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

/// Returns the spaces and comments around an old value, for a new one: that is no longer assumed.
fn decor_of(old: &Value) -> Decor {
    let mut decor = old.decor().clone();
    if decor.suffix().and_then(RawString::as_str).is_some_and(is_assumption) {
        decor.set_suffix("");
    }
    decor
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

    fn entry(key: &str, micros: &[u64]) -> Measured {
        let times = micros.iter().map(|it| Time::from_nanos(it * 1000)).collect();
        Measured {
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
        }
    }

    fn levels() -> Vec<Level> {
        [1e-3, 1e-4].into_iter().filter_map(Level::from_f64).collect()
    }

    fn check(text: &str, entries: &[Measured], replace: bool, expected: Expect) {
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
                KeptEntry { key: "nav.astar", entry: "astar", times: Some(Always(Time(7000000))), is_edited: false }
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
                nav.dist = [1, 2] # measured
                "nav.astar" = [9, 9.5] # guessed

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

                [measured."nav.astar"]
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
    fn ports_have_their_own_section() {
        let text = "unit = \"us\"\nlevels = [1e-3, 1e-4]\n[access]\n\"Pilot.goal\" = 9\n\"Eye.seen\" = 7\n";
        let records = [entry("(access) nav.Eye.seen", &[10, 20]), entry("(access) Pilot.goal", &[3, 4])];
        let kept = update(text, &levels(), &records, false).expect("a valid table");
        assert_eq!(kept.text, text);
        let keys: Vec<(&str, &str)> =
            kept.kept.iter().map(|it| (it.key.as_str(), it.entry.as_str())).collect();
        assert_eq!(keys, [("nav.Eye.seen", "Eye.seen"), ("Pilot.goal", "Pilot.goal")]);
        let written = update(text, &levels(), &records, true).expect("a valid table").text;
        let table = Table::parse(&written);
        let keys: Vec<&str> = table.accesses.iter().map(|it| it.key.as_str()).collect();
        assert_eq!(
            (table.errors.as_slice(), keys.as_slice()),
            (&[][..], &["Pilot.goal", "nav.Eye.seen"][..])
        );
        let measured: Vec<&str> = table.measured.iter().map(|it| it.key.as_str()).collect();
        assert_eq!(measured, ["Pilot.goal", "nav.Eye.seen"]);
        // What was measured is measured again.
        let again = update(&written, &levels(), &[entry("(access) Pilot.goal", &[5, 6])], false)
            .expect("a valid table");
        assert!(again.text.contains("\"Pilot.goal\" = [5, 6]") && again.kept.is_empty(), "{}", again.text);
    }

    #[test]
    fn an_edited_entry_stays() {
        let first = update("", &levels(), &[entry("a.b", &[10, 20])], false).expect("a valid table").text;
        let edited = first.replacen("[10, 20]", "[10, 25]", 1);
        let second = update(&edited, &levels(), &[entry("a.b", &[11, 21])], false).expect("a valid table");
        assert_eq!(second.text, edited);
        assert!(second.kept[0].is_edited && second.kept[0].key == "a.b", "{:?}", second.kept);
    }

    #[test]
    fn an_assumed_entry_is_one_line() {
        let with = |text: &str| {
            let (at, line) = assumed_entry(text, "arm.look", Time::from_nanos(1_500_000), "measure it")?;
            let new = format!("{}{line}{}", &text[..at], &text[at..]);
            assert!(
                Table::parse(&new).codels.iter().any(|it| it.key == "arm.look" && it.is_assumed),
                "{new}"
            );
            Some(new)
        };
        for (text, expected) in [
            ("", "[codel]\n\"arm.look\" = 1.5 # assumed: measure it\n"),
            ("unit = \"us\"\n", "unit = \"us\"\n\n[codel]\n\"arm.look\" = 1500 # assumed: measure it\n"),
            ("codel.scan = 1", "codel.scan = 1\ncodel.\"arm.look\" = 1.5 # assumed: measure it\n"),
            (
                "[codel]\r\nscan = 1\r\n",
                "[codel]\r\nscan = 1\r\n\"arm.look\" = 1.5 # assumed: measure it\r\n",
            ),
            (
                "[codel]\n# é\nscan = 1 # 🦀\n\n[access]\n",
                "[codel]\n# é\nscan = 1 # 🦀\n\"arm.look\" = 1.5 # assumed: measure it\n\n[access]\n",
            ),
        ] {
            assert_eq!(with(text).as_deref(), Some(expected));
        }
        // The comment would hide the brace; the table has an error.
        assert_eq!(with("codel = { scan = 1 }\n"), None);
        assert_eq!(with("[codel]\nscan = -1\n"), None);
        assert_eq!(with("[codel"), None);
    }

    #[test]
    fn an_assumed_entry_is_replaced_with_its_comment() {
        let text = "unit = \"us\"\nlevels = [1e-3, 1e-4]\n[codel]\nplan = 9 # Assumed: an example\n\"nav.turn\" = [1, 2]  # assumedly\n\
                    nav.dist = 3 # assumed\n";
        let records = [entry("nav.plan", &[4, 5]), entry("nav.turn", &[6, 7]), entry("nav.dist", &[8, 9])];
        let found = update(text, &levels(), &records, false).expect("a valid table");
        assert_eq!((found.assumed, found.kept.len()), (2, 1), "{}", found.text);
        let codels = found.text.split("[measured").next().unwrap();
        let expected =
            "[codel]\n\"nav.turn\" = [1, 2]  # assumedly\nnav.dist = [8, 9]\n\"nav.plan\" = [4, 5]\n\n";
        assert!(codels.ends_with(expected), "{codels}");
    }

    /// `plan` may be that of another library.
    #[test]
    fn a_key_without_its_library_is_by_hand() {
        let text = "unit = \"ms\"\nlevels = [1e-3, 1e-4]\n[codel]\nplan = 9 # guessed\n[program]\nrun = 4\n";
        let records = [entry("arm.plan", &[9000, 9500]), entry("nav.plan", &[2000, 2500])];
        let kept = update(text, &levels(), &records, false).expect("a valid table");
        assert_eq!((kept.text.as_str(), kept.kept.len()), (text, 2));
        let replaced = update(text, &levels(), &records, true).expect("a valid table").text;
        let table = Table::parse(&replaced);
        let keys: Vec<&str> = table.codels.iter().map(|it| it.key.as_str()).collect();
        assert_eq!(keys, ["arm.plan", "nav.plan"], "{replaced}");
        let again =
            update(&replaced, &levels(), &[entry("zoo.plan", &[1, 2])], false).expect("a valid table");
        assert!(again.text.contains("\"arm.plan\" = [9, 9.5]") && again.kept.is_empty(), "{}", again.text);
        let program =
            update(text, &levels(), &[entry("Pilot/Moving.run", &[1, 2])], true).expect("a valid table");
        assert!(program.text.contains("run = 4\n\"Pilot/Moving.run\" = "), "{}", program.text);
    }

    #[test]
    fn a_record_in_parts_is_replaced() {
        let first = update("", &levels(), &[entry("a.b", &[10, 20])], false).expect("a valid table").text;
        let parts = first.replacen("[measured.\"a.b\"]", "[measured.a.b]", 1);
        let second = update(&parts, &levels(), &[entry("a.b", &[11, 21])], false).expect("a valid table");
        let table = Table::parse(&second.text);
        assert!(
            second.kept.is_empty() && table.errors.is_empty() && table.measured.len() == 1,
            "{}",
            second.text
        );
    }

    #[test]
    fn line_ends_and_the_byte_order_mark_stay() {
        let text = "\u{feff}unit = \"ms\"\r\n[codel]\r\nb = 3 # by hand\r\n";
        let found = update(text, &levels(), &[entry("a.b", &[10, 20])], true).expect("a valid table").text;
        assert!(found.starts_with("\u{feff}unit = \"ms\"\r\n"), "{found:?}");
        assert_eq!(found.matches('\n').count(), found.matches("\r\n").count(), "{found:?}");
    }

    /// The times of a record belong to the levels, too.
    #[test]
    fn records_that_stay_have_levels() {
        let first = update("", &levels(), &[entry("a.b", &[10, 20])], false).expect("a valid table").text;
        let by_hand = first.replacen("[10, 20]", "12", 1);
        let three: Vec<Level> = [1e-3, 1e-4, 1e-5].into_iter().filter_map(Level::from_f64).collect();
        let found = update(&by_hand, &three, &[entry("b.c", &[1, 2, 3])], false);
        assert_eq!(found, Err(UpdateError::OtherLevels(levels())));
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
