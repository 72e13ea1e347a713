//! The values of a task set in JSON, and its layout. The parser asks for the words that follow *expected* in its errors.

use std::{fmt, io};

use serde::de::{Deserializer, Error as _, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::task::Priority;
use crate::{Level, Time};

/// A value that may be null, and that must be there.
pub(super) fn nullable<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<T>, D::Error> {
    Option::deserialize(from)
}

impl<'de> Deserialize<'de> for Level {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Level, D::Error> {
        let number = f64::deserialize(from)?;
        let expected = &"a probability between 0 and 1, such as 1e-4";
        Level::from_f64(number).ok_or_else(|| D::Error::invalid_value(Unexpected::Float(number), expected))
    }
}

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Time, D::Error> {
        struct Nanoseconds;
        impl Visitor<'_> for Nanoseconds {
            type Value = Time;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a whole number of nanoseconds")
            }
            fn visit_u64<E>(self, nanos: u64) -> Result<Time, E> {
                Ok(Time::from_nanos(nanos))
            }
        }
        from.deserialize_u64(Nanoseconds)
    }
}

impl<'de> Deserialize<'de> for Priority {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Priority, D::Error> {
        struct AnyPriority;
        impl Visitor<'_> for AnyPriority {
            type Value = Priority;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a priority from 1 to 99, \"background\", or null where it is unknown")
            }
            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Priority, E> {
                let priority = u32::try_from(number).ok().filter(|it| (1..=99).contains(it));
                priority
                    .map(Priority::RealTime)
                    .ok_or_else(|| E::invalid_value(Unexpected::Unsigned(number), &self))
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Priority, E> {
                match text {
                    "background" => Ok(Priority::Background),
                    _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
                }
            }
            fn visit_unit<E>(self) -> Result<Priority, E> {
                Ok(Priority::Unknown)
            }
        }
        from.deserialize_any(AnyPriority)
    }
}

impl Serialize for Level {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_f64(self.as_f64())
    }
}

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u64(self.as_nanos())
    }
}

impl Serialize for Priority {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Priority::RealTime(priority) => to.serialize_u32(*priority),
            Priority::Background => to.serialize_str("background"),
            Priority::Unknown => to.serialize_unit(),
        }
    }
}

/// Returns a value in JSON, on one line.
pub(super) fn line(value: &(impl Serialize + ?Sized)) -> String {
    struct OneLine;
    impl serde_json::ser::Formatter for OneLine {
        fn begin_array_value<W: io::Write + ?Sized>(&mut self, to: &mut W, first: bool) -> io::Result<()> {
            to.write_all(if first { b"" } else { b", " })
        }
        fn begin_object_key<W: io::Write + ?Sized>(&mut self, to: &mut W, first: bool) -> io::Result<()> {
            to.write_all(if first { b" " } else { b", " })
        }
        fn begin_object_value<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
            to.write_all(b": ")
        }
        fn end_object<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
            to.write_all(b" }")
        }
    }
    let mut out = Vec::new();
    // All keys are texts, and memory takes every byte: there is no error.
    let _ = value.serialize(&mut serde_json::Serializer::with_formatter(&mut out, OneLine));
    String::from_utf8_lossy(&out).into_owned()
}

/// An array with a line for each value, within `depth` others.
pub(super) fn items(depth: usize, values: impl Iterator<Item = String>) -> String {
    let values: Vec<String> = values.map(|value| format!("\n{}{value}", "  ".repeat(depth + 1))).collect();
    match values.as_slice() {
        [] => "[]".to_owned(),
        values => format!("[{}\n{}]", values.join(","), "  ".repeat(depth)),
    }
}

/// An object with a line for each key, within `depth` others.
pub(super) fn lines(depth: usize, fields: &[(&str, String)]) -> String {
    let indent = "  ".repeat(depth);
    let fields: Vec<String> =
        fields.iter().map(|(key, value)| format!("\n{indent}  \"{key}\": {value}")).collect();
    format!("{{{}\n{indent}}}", fields.join(","))
}
