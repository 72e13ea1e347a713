//! The value of a key of a file: absent, unknown, or known, and where it is.

use std::ops::{Range, RangeInclusive};

use mauve_timing::CpuSet;

use super::problem::{ExpectedValue, FileProblem, FileProblemKind};
use super::yaml::{Lookup, NodeId, Yaml};
use crate::completeness::Completeness;

/// The value of a key. A value that cannot be read is unknown, and never absent: the reader of the file may read it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, salsa::SalsaValue)]
pub enum YamlValue<T> {
    /// The key is not there: its default counts.
    #[default]
    Absent,
    /// The value at this place cannot be read, or is missing in the entry at this place.
    Unknown(Range<usize>),
    /// A value.
    Known {
        /// The value.
        value: T,
        /// Its place, in bytes: an alias has that of the alias.
        range: Range<usize>,
    },
}

impl<T> YamlValue<T> {
    /// Returns the value, if it is known.
    pub fn known(&self) -> Option<&T> {
        match self {
            YamlValue::Known { value, .. } => Some(value),
            _ => None,
        }
    }

    /// Returns the place of the value, if it is there.
    pub fn range(&self) -> Option<&Range<usize>> {
        match self {
            YamlValue::Absent => None,
            YamlValue::Unknown(range) | YamlValue::Known { range, .. } => Some(range),
        }
    }
}

/// Reads values of a file, and collects its problems.
pub(super) struct ValueReader<'y> {
    pub(super) yaml: &'y Yaml,
    pub(super) problems: Vec<FileProblem>,
}

impl ValueReader<'_> {
    pub(super) fn problem(&mut self, kind: FileProblemKind, range: Range<usize>) {
        self.problems.push(FileProblem { kind, range });
    }

    /// Returns the problems in the order of the text, and whether the reader of the file takes it, and reads these values.
    /// `counts`: whether a problem of the YAML is one of the file.
    pub(super) fn finish(
        mut self,
        counts: impl Fn(&&FileProblem) -> bool,
    ) -> (Vec<FileProblem>, Completeness) {
        self.problems.extend(self.yaml.problems.iter().filter(counts).cloned());
        self.problems.sort_by_key(|it| it.range.start);
        // A value that belongs to several entries is read once for each of them.
        self.problems.dedup();
        let is_complete = !self.problems.iter().any(|it| it.kind.is_error());
        (self.problems, Completeness::of(is_complete))
    }

    /// Reports a value of another kind.
    pub(super) fn wrong_kind(&mut self, key: &str, expected: ExpectedValue, range: Range<usize>) {
        self.problem(FileProblemKind::WrongKind { key: key.to_owned(), expected }, range);
    }

    /// Returns the value of a key of a mapping, as `read` reads it.
    pub(super) fn value<T>(
        &mut self,
        mapping: NodeId,
        key: &str,
        expected: ExpectedValue,
        read: impl FnOnce(&Yaml, NodeId) -> Option<T>,
    ) -> YamlValue<T> {
        let node = match self.yaml.find(mapping, key) {
            Lookup::Absent => return YamlValue::Absent,
            Lookup::Unknown(range) => return YamlValue::Unknown(range),
            Lookup::Found(node) => node,
        };
        let range = self.yaml.range(node);
        match read(self.yaml, node) {
            Some(value) => YamlValue::Known { value, range },
            None => {
                self.wrong_kind(key, expected, range.clone());
                YamlValue::Unknown(range)
            }
        }
    }

    /// Returns an integer. `is_plain`: a number in quotes is a text.
    pub(super) fn integer<T: TryFrom<i64>>(
        &mut self,
        mapping: NodeId,
        key: &str,
        within: RangeInclusive<i64>,
        is_plain: bool,
    ) -> YamlValue<T> {
        let expected = ExpectedValue::Integer(*within.start(), *within.end());
        self.value(mapping, key, expected, |yaml, node| {
            integer(yaml, node, is_plain).filter(|it| within.contains(it)).and_then(|it| T::try_from(it).ok())
        })
    }

    /// Returns a text that is not empty and not null.
    pub(super) fn text(&mut self, mapping: NodeId, key: &str) -> YamlValue<String> {
        self.value(mapping, key, ExpectedValue::Text, |yaml, node| {
            yaml.text(node).filter(|text| !text.is_empty() && !is_null(yaml, node)).map(str::to_owned)
        })
    }

    /// Returns one of several values with names.
    pub(super) fn named<T: Copy>(
        &mut self,
        mapping: NodeId,
        key: &str,
        (names, values): (&'static [&'static str], &[T]),
    ) -> YamlValue<T> {
        self.value(mapping, key, ExpectedValue::OneOf(names), |yaml, node| {
            let text = yaml.text(node)?;
            names.iter().position(|name| *name == text).and_then(|index| values.get(index).copied())
        })
    }

    /// Reports the keys of a mapping that `is_known` does not have.
    pub(super) fn unknown_keys(&mut self, mapping: NodeId, is_known: impl Fn(&str) -> bool) {
        let yaml = self.yaml;
        for [key, _] in yaml.mapping(mapping).unwrap_or_default() {
            // A key on which readers disagree is a problem of its own.
            if let Some(name) = yaml.key(*key).filter(|name| !is_known(name)) {
                self.problem(FileProblemKind::UnknownKey(name.to_owned()), yaml.range(*key));
            }
        }
    }
}

/// Returns whether a value is null, as yaml-cpp has it.
pub(super) fn is_null(yaml: &Yaml, id: NodeId) -> bool {
    yaml.plain(id).is_some_and(|it| ["", "~", "null", "Null", "NULL"].contains(&it))
}

/// Returns an integer in decimal digits. Some readers take a leading zero for an octal number.
pub(super) fn integer(yaml: &Yaml, id: NodeId, is_plain: bool) -> Option<i64> {
    let text = if is_plain { yaml.plain(id) } else { yaml.text(id) }?;
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_decimal =
        digits.bytes().all(|it| it.is_ascii_digit()) && (digits == "0" || !digits.starts_with('0'));
    text.parse().ok().filter(|_| is_decimal)
}

/// Returns one of Linux's CPUs, from 0.
pub(super) fn cpu(yaml: &Yaml, id: NodeId, is_plain: bool) -> Option<CpuSet> {
    let cpu = integer(yaml, id, is_plain).and_then(|it| u32::try_from(it).ok()).map(CpuSet::of);
    cpu.filter(|cpu| cpu.is_one())
}

/// Returns the CPUs in a list.
pub(super) fn cpus(yaml: &Yaml, id: NodeId, is_plain: bool) -> Option<CpuSet> {
    let items = yaml.items(id).filter(|_| !yaml.is_open(id))?;
    items.iter().map(|it| cpu(yaml, *it, is_plain)).collect()
}
