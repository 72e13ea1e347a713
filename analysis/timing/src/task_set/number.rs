//! The numbers of a task set, as a file has them: what they are follows from their keys and the unit.

use std::fmt;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{CpuSet, Level, Time};

/// A number, or a text with it or with a word such as `background`. CSV has texts only.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number")]
pub enum Number {
    /// It is whole.
    Whole(u64),
    /// It has a fraction or a sign.
    Fraction(f64),
    /// It is in quotes: with so many digits as it needs.
    Text(String),
}

/// One number, or a list of them: of times, one for each level, or `null` where the time is unknown.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or a list of numbers")]
pub enum Numbers {
    /// The same everywhere.
    One(Number),
    /// Those of a list.
    List(Vec<Option<Number>>),
}

/// Reads a number that may be left out, but may not be `null`: a missing key has a default value, and `null` means that the value
/// is unknown.
pub(super) fn known<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Number>, D::Error> {
    Number::deserialize(from).map(Some)
}

impl Number {
    /// Returns the number if it is whole.
    pub(super) fn whole(&self) -> Option<u64> {
        match self {
            Number::Whole(number) => Some(*number),
            Number::Fraction(_) | Number::Text(_) => self.to_string().parse().ok(),
        }
    }

    /// Returns whether the file may have more digits than a fraction keeps.
    pub(super) fn is_inexact(&self) -> bool {
        let Number::Fraction(number) = self else { return false };
        let digits = format!("{number:e}");
        digits.bytes().take_while(|it| *it != b'e').filter(u8::is_ascii_digit).count() > 15
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number::Whole(number) => number.fmt(f),
            Number::Fraction(number) => number.fmt(f),
            Number::Text(text) => f.write_str(text),
        }
    }
}

impl From<Time> for Number {
    /// The number of nanoseconds.
    fn from(time: Time) -> Number {
        Number::Whole(time.as_nanos())
    }
}

impl Numbers {
    /// Returns the numbers of CPUs, from 1.
    pub fn of_cpus(cpus: CpuSet) -> Numbers {
        let number = |cpu: u32| Number::Whole(u64::from(cpu) + 1);
        match cpus.first().filter(|_| cpus.is_one()) {
            Some(cpu) => Numbers::One(number(cpu)),
            None => Numbers::List(cpus.iter().map(|cpu| Some(number(cpu))).collect()),
        }
    }

    /// Returns the times at each level, in nanoseconds; `None` where all are unknown.
    pub fn of_times(times: &[Option<Time>]) -> Option<Numbers> {
        let first = times.iter().flatten().next()?;
        Some(match times.iter().all(|time| time.as_ref() == Some(first)) {
            true => Numbers::One((*first).into()),
            false => Numbers::List(times.iter().map(|time| time.map(Number::from)).collect()),
        })
    }
}

impl<'de> Deserialize<'de> for Level {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Level, D::Error> {
        let level = match Number::deserialize(from) {
            Ok(Number::Fraction(number)) => Level::from_f64(number),
            Ok(Number::Text(text)) => text.parse().ok().and_then(Level::from_f64),
            Ok(Number::Whole(_)) | Err(_) => None,
        };
        level.ok_or_else(|| D::Error::custom("expected a probability between 0 and 1, such as 1e-4"))
    }
}

impl Serialize for Level {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_f64(self.as_f64())
    }
}
