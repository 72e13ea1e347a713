//! `[measured]`: where the times of a table come from. `mauve pwcet` writes it; it changes no response time.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{TableErrorKind, TomlKind};
use super::keys::MEASURED;
use super::reader::TableReader;
use super::{Measured, Times};
use crate::Time;
use crate::toml_key::key_named;

/// Returns a digest that tells a change of a file: FNV-1a with 64 bits, in hexadecimal. It is not cryptographic.
///
/// ```
/// assert_eq!(mauve_timing::digest_of(b"a"), "af63dc4c8601ec8c");
/// ```
pub fn digest_of(content: &[u8]) -> String {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", content.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

impl TableReader {
    /// Reads the section. A record is a table with a value that is no table; other tables are parts of keys.
    pub(super) fn measured(&mut self, prefix: Option<&str>, section: &DeTable) {
        for (key, value) in section.iter() {
            let name = key.get_ref();
            let whole = prefix.map_or_else(|| name.to_string(), |prefix| format!("{prefix}.{name}"));
            match value.get_ref() {
                DeValue::Table(table)
                    if table.iter().all(|(_, it)| matches!(it.get_ref(), DeValue::Table(_))) =>
                {
                    self.measured(Some(&whole), table);
                }
                DeValue::Table(table) => {
                    if let Some(record) = self.record(whole, key.span(), table) {
                        self.table.measured.push(record);
                    }
                }
                other => {
                    let found = TomlKind::of(other);
                    self.error(value.span(), TableErrorKind::MeasuredOfKind { key: whole, found });
                }
            }
        }
    }

    fn record(&mut self, key: String, span: Range<usize>, table: &DeTable) -> Option<Measured> {
        for (name, _) in table.iter() {
            if key_named(&MEASURED, name.get_ref()).is_none() {
                self.error(name.span(), TableErrorKind::UnknownMeasured(name.get_ref().to_string()));
            }
        }
        let errors = self.table.errors.len();
        let mut fields = RecordFields { reader: self, table, record: span.clone() };
        let record = Measured {
            executions: fields.count("executions"),
            greatest: fields.one_time("greatest"),
            times: fields.times("times"),
            method: fields.text("method"),
            date: fields.date("date"),
            samples: fields.text("samples"),
            files: fields.texts("files"),
            bytes: fields.count("bytes"),
            source: table.contains_key("source").then(|| fields.text("source")),
            source_digest: table.contains_key("source").then(|| fields.text("source_digest")),
            warnings: if table.contains_key("warnings") { fields.texts("warnings") } else { Vec::new() },
            key,
            span,
        };
        (self.table.errors.len() == errors).then_some(record)
    }
}

/// The fields of one record: a missing one, or one of another kind, is an error, and gets a default value.
struct RecordFields<'a, 'text> {
    reader: &'a mut TableReader,
    table: &'a DeTable<'text>,
    record: Range<usize>,
}

impl<'a, 'text> RecordFields<'a, 'text> {
    fn get(&mut self, name: &'static str) -> Option<&'a Spanned<DeValue<'text>>> {
        let found = self.table.get(name);
        if found.is_none() {
            self.reader.error(self.record.clone(), TableErrorKind::MissingMeasured(name));
        }
        found
    }

    fn read<T: Default>(&mut self, name: &'static str, read: impl FnOnce(&DeValue) -> Option<T>) -> T {
        let Some(value) = self.get(name) else { return T::default() };
        read(value.get_ref()).unwrap_or_else(|| {
            self.other_kind(name, value);
            T::default()
        })
    }

    fn other_kind(&mut self, key: &str, value: &Spanned<DeValue<'text>>) {
        let (key, found) = (key.to_owned(), TomlKind::of(value.get_ref()));
        self.reader.error(value.span(), TableErrorKind::MeasuredOfKind { key, found });
    }

    fn count(&mut self, name: &'static str) -> u64 {
        self.read(name, |value| match value {
            DeValue::Integer(integer) => u64::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        })
    }

    fn one_time(&mut self, name: &'static str) -> Time {
        self.get(name).and_then(|value| self.reader.one_time(value)).unwrap_or_default()
    }

    fn times(&mut self, name: &'static str) -> Times {
        self.get(name).and_then(|value| self.reader.times(value)).unwrap_or_default()
    }

    fn text(&mut self, name: &'static str) -> String {
        self.read(name, |value| value.as_str().map(str::to_owned))
    }

    fn date(&mut self, name: &'static str) -> String {
        self.read(name, |value| value.as_datetime().map(ToString::to_string))
    }

    fn texts(&mut self, name: &'static str) -> Vec<String> {
        let Some(value) = self.get(name) else { return Vec::new() };
        let DeValue::Array(array) = value.get_ref() else {
            self.other_kind(name, value);
            return Vec::new();
        };
        let text = |item: &Spanned<DeValue<'text>>| match item.get_ref() {
            DeValue::String(text) => Some(text.to_string()),
            _ => {
                self.other_kind(name, item);
                None
            }
        };
        array.iter().filter_map(text).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Table, TableErrorKind, Time, Times};

    const RECORD: &str = r#"
levels = [1e-3, 1e-4]
[codel]
"nav.astar" = [290, 297]
[measured."nav.astar"]
executions = 20_000
greatest = 281.5
times = [290, 297]
method = "generalised Pareto"
date = 2026-11-23
samples = "0123"
files = ["run.samples"]
bytes = 4711
warnings = ["only 300 executions"]
"#;

    #[test]
    fn a_record_of_a_measurement_is_read() {
        let table = Table::parse(RECORD);
        assert!(table.errors.is_empty(), "{:?}", table.errors);
        let record = &table.measured[0];
        assert_eq!((record.key.as_str(), record.executions), ("nav.astar", 20_000));
        assert_eq!(record.greatest, Time::from_nanos(281_500_000));
        assert_eq!(
            record.times,
            Times::PerLevel([290, 297].map(|it| Time::from_nanos(it * 1_000_000)).into())
        );
        assert_eq!((record.date.as_str(), record.source.as_ref()), ("2026-11-23", None));
        assert_eq!(record.warnings, ["only 300 executions"]);
        // Without quotes, the key has the same parts.
        assert_eq!(
            Table::parse(&RECORD.replace("measured.\"nav.astar\"", "measured.nav.astar")).measured[0].key,
            "nav.astar"
        );
    }

    #[test]
    fn errors_in_a_record_lose_no_times() {
        for (from, to) in [
            ("date = 2026-11-23", ""),
            ("date = 2026-11-23", "date = \"today\""),
            ("executions = 20_000", "executions = -1"),
            ("files = [\"run.samples\"]", "files = [1]"),
            ("times = [290, 297]", "times = [290]"),
            ("warnings", "warning"),
        ] {
            let table = Table::parse(&RECORD.replace(from, to));
            assert_eq!(table.errors.len(), 1, "{to}: {:?}", table.errors);
            assert!(!table.lost && table.codels[0].value.is_some(), "{to}");
        }
        let table = Table::parse("[measured]\na = 1");
        assert!(matches!(table.errors[0].kind, TableErrorKind::MeasuredOfKind { .. }));
    }
}
