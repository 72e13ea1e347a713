//! What recordings of a robot showed, as a small text file beside the timing tables: `robot.observed.toml`.
//!
//! `mauve trace import` writes it. A recording has many megabytes and stays outside the repository; this file is in it, and holds
//! the greatest of all that was observed, so that each later check can compare it with the tables.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table as EditTable};

use crate::table::reader::time_in;
use crate::table::update::set;
use crate::{Time, TimeError, TomlKind, Unit};

/// What recordings showed. All times are in nanoseconds.
///
/// ```
/// use mauve_timing::Observed;
///
/// let text = r#"
/// unit = "ms"
/// [[recording]]
/// source = "rec"
/// date = 2026-11-26
/// host = "arm"
/// samples = "3abc82820ae84cf9"
/// [codel."robot.grab"]
/// executions = 3000
/// greatest = 0.061
/// wait = 8.06
/// times = 2
/// [access."robot.Camera.frame"]
/// executions = 3000
/// greatest = 0.6
/// [lock.bus."drivers.imu_read"]
/// executions = 100
/// held = 0.2
/// [work.worker]
/// per_second = 0.5
/// [response.robot]
/// executions = 150
/// greatest = 9.7
/// later = [4.1, 7.7, 9.6]
/// "#;
/// let (observed, problems) = Observed::parse(text);
/// assert!(problems.is_empty());
/// let grab = &observed.codels["robot.grab"];
/// assert_eq!((grab.executions, grab.greatest, grab.wait, grab.times), (3000, 61_000, 8_060_000, 2));
/// assert_eq!(&text[grab.span.clone()], "\"robot.grab\"");
/// ```
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct Observed {
    /// The recordings, in the order in which they were imported.
    pub recordings: Vec<Recording>,
    /// `[codel]`, by the key of timing tables.
    pub codels: BTreeMap<String, ObservedTimes>,
    /// `[program]`, by the key of timing tables.
    pub programs: BTreeMap<String, ObservedTimes>,
    /// `[access]`: reads and writes of ports, by the key of the component, a dot and the name of the port.
    pub accesses: BTreeMap<String, ObservedTimes>,
    /// `[lock]`: for how long a lock was held, by the name of the lock and the codel that held it.
    pub locks: BTreeMap<(String, String), ObservedTimes>,
    /// `[work]`: the CPU time of threads that are not components in a second, on average, by the name of the thread.
    pub work: BTreeMap<String, ObservedTimes>,
    /// `[response]`: the response times of jobs, by the name of their instance.
    pub responses: BTreeMap<String, ObservedTimes>,
}

/// One recording that the file summarises: `[[recording]]`.
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct Recording {
    /// The bytes of `[[recording]]`'s first key.
    pub span: Range<usize>,
    /// The path that was imported.
    pub source: String,
    /// When it was imported, as a date in ISO 8601.
    pub date: String,
    /// The computer on which it was imported.
    pub host: String,
    /// The digest of the recording: the same one is never counted twice.
    pub samples: String,
    /// With which compiler, for which processor and with which flags the program was built; empty if that is not known.
    pub build: String,
}

/// The executions of a codel or a program, the accesses of a port, the times for which a lock was held, the work of a thread, or the
/// response times of jobs.
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct ObservedTimes {
    /// The bytes of the last part of its key, quotes included.
    pub span: Range<usize>,
    /// How many were recorded; 0 of work.
    pub executions: u64,
    /// The greatest time of one of them: CPU time, also of what holds a lock.
    pub greatest: u64,
    /// Only of response times: those that at most 1/2, 1/10, 1/100, … of the jobs exceed, as far as there are so many jobs.
    pub later: Vec<u64>,
    /// Only of codels: the greatest time that one execution spent off the CPU and that no thread of the recording explains.
    pub wait: u64,
    /// How often one execution waited, at most; 0 if that is not known.
    pub times: u64,
    /// Whether the recording shows that `wait` was spent waiting: otherwise, it may have been preemption by a thread that the
    /// recording does not have.
    pub is_wait_known: bool,
}

/// A section of the file, the keys that each of its entries has, and those that it may have.
type ObservedSection = (&'static str, &'static [&'static str], &'static [&'static str]);

const SECTIONS: [ObservedSection; 6] = [
    ("codel", &["executions", "greatest"], &["wait", "times", "waits"]),
    ("program", &["executions", "greatest"], &[]),
    ("access", &["executions", "greatest"], &[]),
    ("lock", &["executions", "held"], &[]),
    ("work", &["per_second"], &[]),
    ("response", &["executions", "greatest"], &["later"]),
];

impl ObservedTimes {
    /// Adds others. A share of all exceeds no time that this share exceeds in no recording.
    pub fn add(&mut self, other: &ObservedTimes) {
        let of = |it: &ObservedTimes, share: usize| it.later.get(share).copied().unwrap_or(it.greatest);
        let shares = 0..self.later.len().max(other.later.len());
        self.later = shares.map(|share| of(self, share).max(of(other, share))).collect();
        self.executions = self.executions.saturating_add(other.executions);
        self.greatest = self.greatest.max(other.greatest);
        self.times = self.times.max(other.times);
        match other.wait.cmp(&self.wait) {
            Ordering::Greater => (self.wait, self.is_wait_known) = (other.wait, other.is_wait_known),
            Ordering::Equal => self.is_wait_known |= other.is_wait_known,
            Ordering::Less => {}
        }
    }

    /// Returns the entry of a section. What is as it usually is has no key.
    fn written(&self, (_, required, optional): ObservedSection) -> Item {
        let mut table = EditTable::new();
        for &key in required.iter().chain(optional) {
            let value = match key {
                "executions" => count(self.executions),
                "times" if self.times == 0 => continue,
                "times" => count(self.times),
                "wait" if self.wait == 0 => continue,
                "wait" => number(self.wait),
                "waits" if self.is_wait_known => continue,
                "waits" => toml_edit::value(UNKNOWN),
                "later" => {
                    let later = self.later.iter().filter_map(|it| number(*it).into_value().ok());
                    toml_edit::value(later.collect::<toml_edit::Array>())
                }
                _ => number(self.greatest),
            };
            table.insert(key, value);
        }
        Item::Table(table)
    }
}

/// Threads that are not those of instances, and that use less CPU time in a second, in nanoseconds, are not reported.
pub const LEAST_WORK: u64 = 100_000;

/// Accesses of ports without an entry in a table, and waits that may have been preemption, are not reported up to this time in
/// nanoseconds: interrupts and the clocks themselves take as long.
pub const UNSUSPICIOUS: u64 = 50_000;

/// A wait of a codel that no table has, up to this time in nanoseconds, is a warning: to wait for a device, another thread or a sleep takes
/// longer, and without a recording the runtime does not look at shorter ones either (`least_wait`).
pub const LEAST_WAIT: u64 = 5_000;

/// An error in such a file. `mauve-diagnostics` has the message.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct ObservedError {
    /// Where, in bytes.
    pub span: Range<usize>,
    /// What is wrong.
    pub kind: ObservedErrorKind,
}

/// The kinds of errors in such a file.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum ObservedErrorKind {
    /// The text is not TOML: the error of the parser.
    NotToml(String),
    /// A section or a key has an unknown name.
    UnknownKey(String),
    /// An entry lacks this key.
    MissingKey(&'static str),
    /// This key has a value of another kind than `expected`, in words.
    OfKind { key: String, expected: &'static str, found: TomlKind },
    /// The unit has an unknown name.
    UnknownUnit(String),
    /// This number is not a time.
    InvalidTime { text: String, unit: Unit, error: TimeError },
}

impl Observed {
    /// Reads the text of such a file, and returns what is wrong with it, in the order of the text. An entry with an error is
    /// left out; a text that is not TOML has no entries.
    pub fn parse(text: &str) -> (Observed, Vec<ObservedError>) {
        let (document, errors) = DeTable::parse_recoverable(text);
        if let Some(error) = errors.into_iter().min_by_key(|error| error.span().map(|span| span.start)) {
            let kind = ObservedErrorKind::NotToml(error.message().to_owned());
            return (
                Observed::default(),
                vec![ObservedError { span: error.span().unwrap_or_default(), kind }],
            );
        }
        let mut reader = ObservedReader { unit: Unit::Milliseconds, errors: Vec::new() };
        let observed = reader.document(document.get_ref());
        let mut errors = reader.errors;
        errors.sort_by_key(|error| (error.span.start, error.span.end));
        (observed, errors)
    }

    /// Returns the text of the file, with times in milliseconds.
    pub fn text(&self) -> String {
        let mut document = DocumentMut::new();
        document.insert("unit", toml_edit::value(Unit::Milliseconds.name()));
        let mut recordings = ArrayOfTables::new();
        for it in &self.recordings {
            let mut table = EditTable::new();
            table.insert("source", toml_edit::value(&it.source));
            if let Ok(date) = it.date.parse::<toml_edit::Datetime>() {
                table.insert("date", toml_edit::value(date));
            }
            table.insert("host", toml_edit::value(&it.host));
            table.insert("samples", toml_edit::value(&it.samples));
            if !it.build.is_empty() {
                table.insert("build", toml_edit::value(&it.build));
            }
            recordings.push(table);
        }
        document.insert("recording", Item::ArrayOfTables(recordings));
        fn keyed(all: &BTreeMap<String, ObservedTimes>) -> Vec<(Vec<&str>, &ObservedTimes)> {
            all.iter().map(|(key, it)| (vec![key.as_str()], it)).collect()
        }
        let entries = [
            keyed(&self.codels),
            keyed(&self.programs),
            keyed(&self.accesses),
            self.locks.iter().map(|((lock, codel), it)| (vec![lock.as_str(), codel.as_str()], it)).collect(),
            keyed(&self.work),
            keyed(&self.responses),
        ];
        for (section, entries) in SECTIONS.into_iter().zip(entries) {
            for (key, it) in entries {
                set(document.as_table_mut(), &[&[section.0], key.as_slice()].concat(), it.written(section));
            }
        }
        format!("{HEADER}{document}")
    }

    /// Adds what other recordings showed: counts are added, of times the greatest is kept. Adds nothing if all its recordings are in
    /// already; returns whether it did.
    pub fn merge(&mut self, other: Observed) -> bool {
        let is_known = |it: &Recording| self.recordings.iter().any(|known| known.samples == it.samples);
        if other.recordings.iter().all(is_known) {
            return false;
        }
        self.recordings.extend(other.recordings);
        merge(&mut self.codels, other.codels);
        merge(&mut self.programs, other.programs);
        merge(&mut self.accesses, other.accesses);
        merge(&mut self.locks, other.locks);
        merge(&mut self.work, other.work);
        merge(&mut self.responses, other.responses);
        true
    }
}

/// What the file begins with.
const HEADER: &str = "# Written by `mauve trace import`: what was observed on the robot. `[timing] observed = [\"…\"]` in mauve.toml\n\
                      # makes `mauve check` compare it with the timing tables.\n";

/// The value of `waits` where the recording does not tell waiting from preemption.
const UNKNOWN: &str = "unknown";

fn merge<K: Ord>(all: &mut BTreeMap<K, ObservedTimes>, other: BTreeMap<K, ObservedTimes>) {
    for (key, it) in other {
        all.entry(key).or_default().add(&it);
    }
}

fn count(count: u64) -> Item {
    toml_edit::value(i64::try_from(count).unwrap_or(i64::MAX))
}

fn number(nanos: u64) -> Item {
    let text = Time::from_nanos(nanos).number_in(Unit::Milliseconds);
    text.parse::<toml_edit::Value>().map_or(Item::None, Item::Value)
}

struct ObservedReader {
    unit: Unit,
    errors: Vec<ObservedError>,
}

type ObservedEntries<'a, 'text> = Vec<(Vec<String>, Range<usize>, &'a DeTable<'text>)>;

impl ObservedReader {
    fn error(&mut self, span: Range<usize>, kind: ObservedErrorKind) {
        self.errors.push(ObservedError { span, kind });
    }

    fn of_kind(&mut self, key: &str, value: &Spanned<DeValue>, expected: &'static str) {
        let (key, found) = (key.to_owned(), TomlKind::of(value.get_ref()));
        self.error(value.span(), ObservedErrorKind::OfKind { key, expected, found });
    }

    fn document(&mut self, document: &DeTable) -> Observed {
        // First what the entries are read with.
        if let Some(value) = document.get("unit") {
            match value.get_ref().as_str().map(|name| (name, Unit::parse(name))) {
                Some((_, Some(unit))) => self.unit = unit,
                Some((name, None)) => {
                    self.error(value.span(), ObservedErrorKind::UnknownUnit(name.to_owned()));
                }
                None => self.of_kind("unit", value, "a text"),
            }
        }
        let mut observed = Observed::default();
        for (key, value) in document.iter() {
            let name: &str = key.get_ref();
            match name {
                "unit" => {}
                "recording" => observed.recordings = self.recordings(value),
                _ => match SECTIONS.into_iter().find(|(section, ..)| *section == name) {
                    Some(section) => self.section(&mut observed, section, value),
                    None => self.error(key.span(), ObservedErrorKind::UnknownKey(name.to_owned())),
                },
            }
        }
        observed
    }

    /// Finds the entries of a section. An entry is a table with a value that is no table, or an empty one; other tables are parts of
    /// keys.
    fn entries<'a, 'text>(
        &mut self,
        prefix: &[String],
        section: &'a DeTable<'text>,
        entries: &mut ObservedEntries<'a, 'text>,
    ) {
        for (key, value) in section.iter() {
            let mut parts = prefix.to_vec();
            parts.push(key.get_ref().to_string());
            let is_table = |it: &Spanned<DeValue>| matches!(it.get_ref(), DeValue::Table(_));
            match value.get_ref() {
                DeValue::Table(table) if !table.is_empty() && table.iter().all(|(_, it)| is_table(it)) => {
                    self.entries(&parts, table, entries);
                }
                DeValue::Table(table) => entries.push((parts, key.span(), table)),
                _ => self.of_kind(key.get_ref(), value, "a table"),
            }
        }
    }

    fn section(&mut self, observed: &mut Observed, of: ObservedSection, value: &Spanned<DeValue>) {
        let (name, required, optional) = of;
        let DeValue::Table(section) = value.get_ref() else { return self.of_kind(name, value, "a section") };
        let mut entries = Vec::new();
        self.entries(&[], section, &mut entries);
        for (parts, span, table) in entries {
            let errors = self.errors.len();
            for key in required.iter().filter(|key| !table.contains_key(**key)) {
                self.error(span.clone(), ObservedErrorKind::MissingKey(key));
            }
            let mut it =
                ObservedTimes { span: span.clone(), is_wait_known: true, ..ObservedTimes::default() };
            for (key, value) in table.iter() {
                match required.iter().chain(optional).find(|known| **known == key.get_ref()) {
                    Some(known) => self.value(&mut it, known, value),
                    None => {
                        self.error(key.span(), ObservedErrorKind::UnknownKey(key.get_ref().to_string()));
                    }
                }
            }
            if self.errors.len() != errors {
                continue;
            }
            let key = parts.join(".");
            match (name, parts.as_slice()) {
                ("codel", _) => drop(observed.codels.insert(key, it)),
                ("program", _) => drop(observed.programs.insert(key, it)),
                ("access", _) => drop(observed.accesses.insert(key, it)),
                ("work", _) => drop(observed.work.insert(key, it)),
                ("response", _) => drop(observed.responses.insert(key, it)),
                (_, [lock, codel @ ..]) if !codel.is_empty() => {
                    observed.locks.insert((lock.clone(), codel.join(".")), it);
                }
                _ => self.error(span, ObservedErrorKind::UnknownKey(key)),
            }
        }
    }

    /// Reads the value of a key.
    fn value(&mut self, it: &mut ObservedTimes, key: &'static str, value: &Spanned<DeValue>) {
        match (key, value.get_ref()) {
            ("executions", _) => it.executions = self.count(key, value),
            ("times", _) => it.times = self.count(key, value),
            ("wait", _) => it.wait = self.time(key, value),
            ("waits", DeValue::String(text)) if text == UNKNOWN => it.is_wait_known = false,
            ("waits", _) => self.of_kind(key, value, "\"unknown\", or left out"),
            ("later", DeValue::Array(all)) => it.later = all.iter().map(|it| self.time(key, it)).collect(),
            ("later", _) => self.of_kind(key, value, "a list of numbers"),
            _ => it.greatest = self.time(key, value),
        }
    }

    fn recordings(&mut self, value: &Spanned<DeValue>) -> Vec<Recording> {
        let DeValue::Array(array) = value.get_ref() else {
            self.of_kind("recording", value, "tables `[[recording]]`");
            return Vec::new();
        };
        let mut recordings = Vec::new();
        for item in array.iter() {
            let DeValue::Table(table) = item.get_ref() else {
                self.of_kind("recording", item, "a table");
                continue;
            };
            let mut recording = Recording { span: item.span(), ..Recording::default() };
            if let Some(first) = table.iter().map(|(key, _)| key.span()).min_by_key(|span| span.start) {
                recording.span = first;
            }
            for (key, value) in table.iter() {
                let name: &str = key.get_ref();
                match (name, value.get_ref()) {
                    ("source", DeValue::String(text)) => recording.source = text.to_string(),
                    ("host", DeValue::String(text)) => recording.host = text.to_string(),
                    ("samples", DeValue::String(text)) => recording.samples = text.to_string(),
                    ("date", DeValue::Datetime(date)) => recording.date = date.to_string(),
                    ("build", DeValue::String(text)) => recording.build = text.to_string(),
                    ("source" | "host" | "samples" | "build", _) => self.of_kind(name, value, "a text"),
                    ("date", _) => self.of_kind(name, value, "a date"),
                    _ => self.error(key.span(), ObservedErrorKind::UnknownKey(name.to_owned())),
                }
            }
            if !table.contains_key("samples") {
                self.error(recording.span.clone(), ObservedErrorKind::MissingKey("samples"));
            }
            recordings.push(recording);
        }
        recordings
    }

    /// Reads a whole number.
    fn count(&mut self, name: &'static str, value: &Spanned<DeValue>) -> u64 {
        let DeValue::Integer(integer) = value.get_ref() else {
            self.of_kind(name, value, "a whole number");
            return 0;
        };
        u64::from_str_radix(integer.as_str(), integer.radix()).unwrap_or_else(|_| {
            self.of_kind(name, value, "a whole number that is not negative");
            0
        })
    }

    /// Reads a time in nanoseconds.
    fn time(&mut self, name: &'static str, value: &Spanned<DeValue>) -> u64 {
        let unit = self.unit;
        match time_in(value.get_ref(), unit) {
            Some((_, Ok(time))) => return time.as_nanos(),
            Some((text, Err(error))) => {
                self.error(value.span(), ObservedErrorKind::InvalidTime { text, unit, error });
            }
            None => self.of_kind(name, value, "a number"),
        }
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    const TEXT: &str = r#"# Written by `mauve trace import`: what was observed on the robot. `[timing] observed = ["…"]` in mauve.toml
# makes `mauve check` compare it with the timing tables.
unit = "ms"

[[recording]]
source = "rec"
date = 2026-11-26
host = "arm"
samples = "3abc82820ae84cf9"
build = "GNU 12.2.0 x86_64 -O2"

[codel."robot.grab"]
executions = 3000
greatest = 0.061
wait = 8.06
times = 2

[codel."robot.look"]
executions = 7
greatest = 1
wait = 0.5
waits = "unknown"

[program."robot.Camera/update"]
executions = 3000
greatest = 0.7

[access."robot.Camera.frame"]
executions = 3000
greatest = 0.6

[lock.bus."drivers.imu_read"]
executions = 100
held = 0.2

[work."pool 1"]
per_second = 12.5

[response.robot]
executions = 150
greatest = 9.7
later = [4.1, 7.7, 9.6]
"#;

    fn parse(text: &str) -> Observed {
        let (observed, errors) = Observed::parse(text);
        assert_eq!(errors, []);
        observed
    }

    #[test]
    fn what_is_written_is_read_again() {
        let observed = parse(TEXT);
        assert_eq!(observed.text(), TEXT);
        assert_eq!(observed.locks[&("bus".to_owned(), "drivers.imu_read".to_owned())].greatest, 200_000);
        assert_eq!(observed.work["pool 1"].greatest, 12_500_000);
        let look = &observed.codels["robot.look"];
        assert_eq!((look.wait, look.is_wait_known), (500_000, false));
        // A key in parts is the same key.
        assert_eq!(
            parse(&TEXT.replace("codel.\"robot.grab\"", "codel.robot.grab")).codels["robot.grab"].wait,
            8_060_000
        );
        assert_eq!(parse("unit = \"us\"\n[work.a]\nper_second = 3").work["a"].greatest, 3_000);
        assert_eq!(parse(""), Observed::default());
    }

    #[test]
    fn the_greatest_is_kept_and_a_recording_counts_once() {
        let mut all = parse(TEXT);
        assert!(!all.merge(parse(TEXT)));
        assert_eq!(all, parse(TEXT));
        let second = TEXT
            .replace("3abc82820ae84cf9", "ff")
            .replace("wait = 8.06\ntimes = 2", "wait = 7\ntimes = 3")
            .replace("wait = 0.5\nwaits = \"unknown\"", "wait = 0.75")
            .replace("greatest = 0.6\n", "greatest = 0.65\n");
        assert!(all.merge(parse(&second)));
        let [grab, look] = ["robot.grab", "robot.look"].map(|key| all.codels[key].clone());
        assert_eq!((grab.executions, grab.wait, grab.times, grab.is_wait_known), (6000, 8_060_000, 3, true));
        assert_eq!((look.executions, look.wait, look.is_wait_known), (14, 750_000, true));
        assert_eq!(all.accesses["robot.Camera.frame"].greatest, 650_000);
        assert_eq!(all.recordings.len(), 2);
    }

    /// No share of all jobs exceeds a time that this share exceeds in no recording.
    #[test]
    fn shares_of_jobs_are_kept() {
        let of = |executions: u64, later: &[u64], greatest: u64| ObservedTimes {
            span: 0..0,
            executions,
            later: later.to_vec(),
            greatest,
            is_wait_known: true,
            ..ObservedTimes::default()
        };
        let mut all = ObservedTimes::default();
        all.add(&parse(TEXT).responses["robot"]);
        all.add(&of(5, &[5_000_000], 8_000_000));
        assert_eq!(all, of(155, &[5_000_000, 8_000_000, 9_600_000], 9_700_000));
        let mut twice = parse(TEXT);
        assert!(
            twice.merge(parse(
                &TEXT.replace("3abc82820ae84cf9", "ff").replace("later = [4.1", "later = [4.5")
            ))
        );
        let both = ObservedTimes { span: 0..0, ..twice.responses["robot"].clone() };
        assert_eq!(both, of(300, &[4_500_000, 7_700_000, 9_600_000], 9_700_000));
    }

    #[test]
    fn errors_name_their_place() {
        let text = r#"
speed = 1
[[recording]]
source = 1
[codel.a]
executions = -1
greatest = 1
[codel.b]
executions = 1
greatest = 1
wait = "8 ms"
waits = "some"
[codel.c]
executions = 1
[program."P/u"]
executions = 1
greatest = -2
wait = 1
[lock.bus]
executions = 1
held = 1
[access]
x = 1
[response.a]
executions = 1
greatest = 1
later = 2
[response.b]
executions = 1
greatest = 1
later = [1, "x"]
"#;
        let (observed, errors) = Observed::parse(text);
        assert!(observed.codels.is_empty() && observed.locks.is_empty() && observed.accesses.is_empty());
        assert!(observed.responses.is_empty());
        let found: String =
            errors.iter().map(|it| format!("{:?}: {:?}\n", &text[it.span.clone()], it.kind)).collect();
        expect![[r#"
            "speed": UnknownKey("speed")
            "source": MissingKey("samples")
            "1": OfKind { key: "source", expected: "a text", found: Number }
            "-1": OfKind { key: "executions", expected: "a whole number that is not negative", found: Number }
            "\"8 ms\"": OfKind { key: "wait", expected: "a number", found: String }
            "\"some\"": OfKind { key: "waits", expected: "\"unknown\", or left out", found: String }
            "c": MissingKey("greatest")
            "-2": InvalidTime { text: "-2", unit: Milliseconds, error: Negative }
            "wait": UnknownKey("wait")
            "bus": UnknownKey("bus")
            "1": OfKind { key: "x", expected: "a table", found: Number }
            "2": OfKind { key: "later", expected: "a list of numbers", found: Number }
            "\"x\"": OfKind { key: "later", expected: "a number", found: String }
        "#]]
        .assert_eq(&found);
        assert!(matches!(Observed::parse("[codel").1[0].kind, ObservedErrorKind::NotToml(_)));
        assert!(matches!(Observed::parse("unit = \"h\"").1[0].kind, ObservedErrorKind::UnknownUnit(_)));
    }
}
