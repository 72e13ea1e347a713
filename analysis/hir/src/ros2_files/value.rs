//! The value of a key of a file: absent, unknown, or known, and where it is.

use std::ops::{Range, RangeInclusive};

use mauve_timing::CpuSet;

use super::problem::{ExpectedValue, FileProblem, FileProblemKind};
use super::yaml::{Lookup, NodeId, Yaml};

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

    /// Returns the value `then` if the key is not there.
    #[must_use]
    pub(super) fn or(self, then: impl FnOnce() -> YamlValue<T>) -> YamlValue<T> {
        if matches!(self, YamlValue::Absent) { then() } else { self }
    }

    /// Returns the value without its place, to compare files.
    #[must_use]
    pub(super) fn placeless(self) -> YamlValue<T> {
        match self {
            YamlValue::Absent => YamlValue::Absent,
            YamlValue::Unknown(_) => YamlValue::Unknown(0..0),
            YamlValue::Known { value, .. } => YamlValue::Known { value, range: 0..0 },
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
        let range = self.yaml.node(node).range.clone();
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
            let number = integer(yaml, node, is_plain).filter(|it| within.contains(it))?;
            T::try_from(number).ok()
        })
    }

    /// Returns a text that is not empty and not null.
    pub(super) fn text(&mut self, mapping: NodeId, key: &str) -> YamlValue<String> {
        self.value(mapping, key, ExpectedValue::Text, |yaml, node| {
            let text = yaml.text(node).filter(|text| !text.is_empty() && !is_null(yaml, node))?;
            Some(text.to_owned())
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
}

/// Returns whether a value is null, as yaml-cpp has it.
pub(super) fn is_null(yaml: &Yaml, id: NodeId) -> bool {
    yaml.is_plain(id) && yaml.text(id).is_some_and(|it| ["", "~", "null", "Null", "NULL"].contains(&it))
}

/// Returns an integer in decimal digits. Readers take a leading zero for an octal number, or not.
pub(super) fn integer(yaml: &Yaml, id: NodeId, is_plain: bool) -> Option<i64> {
    let text = yaml.text(id).filter(|_| !is_plain || yaml.is_plain(id))?;
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_decimal =
        digits.bytes().all(|byte| byte.is_ascii_digit()) && (digits == "0" || !digits.starts_with('0'));
    text.parse().ok().filter(|_| is_decimal)
}

/// Returns the CPUs in a list of Linux's numbers of CPUs, from 0.
pub(super) fn cpus(yaml: &Yaml, id: NodeId, is_plain: bool) -> Option<CpuSet> {
    let cpu = |id: &NodeId| {
        let cpu = integer(yaml, *id, is_plain).and_then(|it| u32::try_from(it).ok()).map(CpuSet::of)?;
        Some(cpu).filter(|cpu| cpu.is_one())
    };
    yaml.items(id)?.iter().map(cpu).collect()
}
