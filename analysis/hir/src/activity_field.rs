//! The fields of an activity, each written down once: what its value is, what it means, and what holds without it.
//!
//! The grammar has the names ([`ActivityField`]). Reading a value, completion, hovers, the messages and the order of fields
//! follow the table; `diagnostics/tests/tables.rs` writes the lists of the highlighters and the table of the reference from it.

use mauve_syntax::keywords::{ActivityField, BACKGROUND};
use mauve_timing::{CpuSet, Rounding, Time, TimeError, Unit};

use crate::item_tree::{Expr, Literal, Name, UnaryOperator};
use crate::values::whole_number;

/// A field of an activity.
#[derive(Debug)]
pub struct FieldEntry {
    /// Its name.
    pub field: ActivityField,
    /// Its valid values.
    pub kind: FieldKind,
    /// What holds without the field; `None` if an activity must have it.
    pub default: Option<&'static str>,
    /// Whether it has an effect on real-time activities only.
    pub only_real_time: bool,
    /// The other names that newcomers give it.
    pub other_names: &'static [&'static str],
    /// A valid value.
    pub example: &'static str,
    /// The values in a few words, for a list.
    pub values: &'static str,
    /// What it means, in sentences.
    pub meaning: &'static str,
}

/// The valid values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// A bit for each CPU.
    Cpus,
    /// 1 to 99, or `background`.
    Priority,
    /// A time in milliseconds.
    Time,
    /// A time in milliseconds greater than 0.
    PositiveTime,
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "see `FieldKind`")]
pub enum FieldValue {
    Cpus(CpuSet),
    Priority(u32),
    Background,
    Time(Time),
}

/// The fields, in the order in which an activity usually has them.
#[rustfmt::skip] // rustfmt would put each field of an entry on its own line.
pub static ACTIVITY_FIELDS: [FieldEntry; ActivityField::ALL.len()] = [
    FieldEntry { field: ActivityField::Affinity, kind: FieldKind::Cpus, default: Some("any CPU"), only_real_time: false,
        other_names: &["cpu", "cpus", "core", "cores", "mask"], example: "1",
        values: "the CPUs as a mask: 1 is CPU 1, 2 is CPU 2, 3 is both",
        meaning: "The CPUs on which the activity may run, as a bit mask: 1 is CPU 1, 2 is CPU 2, 3 is both, 4 is CPU 3. With 0, \
                  or without affinity: any CPU." },
    FieldEntry { field: ActivityField::Priority, kind: FieldKind::Priority, default: None, only_real_time: false,
        other_names: &["prio"], example: "10",
        values: "1 to 99, the highest is 99; or background",
        meaning: "The priority of the activity, from 1 (lowest) to 99 (highest), or `background`. An activity preempts all \
                  activities of lower priority on its CPU." },
    FieldEntry { field: ActivityField::Period, kind: FieldKind::PositiveTime, default: None, only_real_time: false,
        other_names: &[], example: "100",
        values: "in milliseconds",
        meaning: "The period of the activity in milliseconds, such as `100` or `2.5`: the time between two releases." },
    FieldEntry { field: ActivityField::Deadline, kind: FieldKind::PositiveTime, default: Some("the period"), only_real_time: true,
        other_names: &["dl"], example: "50",
        values: "in milliseconds",
        meaning: "The deadline of the activity in milliseconds after its release. Not greater than the period; without a \
                  deadline, the period is the deadline." },
    FieldEntry { field: ActivityField::Jitter, kind: FieldKind::Time, default: Some("0"), only_real_time: true,
        other_names: &[], example: "0.5",
        values: "in milliseconds",
        meaning: "The release jitter of the activity in milliseconds: a release may be late by as much. The response time \
                  counts from the nominal release. Without jitter: 0." },
    FieldEntry { field: ActivityField::Offset, kind: FieldKind::Time, default: Some("0"), only_real_time: true,
        other_names: &[], example: "2",
        values: "in milliseconds, less than the period; only with a synchronised clock",
        meaning: "The offset of the activity in milliseconds, less than the period: the distance of its releases from the \
                  multiples of the period. Has an effect only if `[clocks] synchronised` in mauve.toml names the instance. \
                  Without offset: 0." },
];

/// Returns the entry of a field.
pub fn field_entry(field: ActivityField) -> &'static FieldEntry {
    &ACTIVITY_FIELDS[field as usize]
}

/// Returns the field that an unknown name is probably meant for.
pub fn similar_field(name: &str) -> Option<ActivityField> {
    let renamed = ACTIVITY_FIELDS.iter().find(|it| it.other_names.contains(&name)).map(|it| it.field);
    renamed.or_else(|| ActivityField::from_keyword(mauve_syntax::similar(name, ActivityField::KEYWORDS)?))
}

/// Why a field cannot have a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InvalidValue {
    /// It is not of the kind of the field.
    OtherKind(FieldKind),
    /// It is not less than this period.
    NotBelow(Time),
    /// It is not a time.
    NoTime(NoTime),
}

/// Why a value is not a time in milliseconds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoTime {
    /// It is an integer that exceeds INT.
    TooLarge(Name),
    /// It is in hexadecimal.
    Hexadecimal,
    /// It is negative.
    Negative,
    /// It is an expression.
    NotALiteral,
    /// It cannot be read.
    Unreadable(TimeError),
}

impl FieldKind {
    /// Returns the valid values in words.
    pub fn expected(self) -> &'static str {
        match self {
            FieldKind::Cpus => "a bit mask of CPUs: 1 is CPU 1, 2 is CPU 2, 3 is both",
            FieldKind::Priority => "a whole number from 1 to 99, or `background`",
            FieldKind::Time => "a time in milliseconds",
            FieldKind::PositiveTime => "a time in milliseconds greater than 0",
        }
    }

    /// Returns whether the values are times.
    pub fn is_time(self) -> bool {
        matches!(self, FieldKind::Time | FieldKind::PositiveTime)
    }

    /// Reads the value of a field.
    ///
    /// # Errors
    ///
    /// A field of this kind cannot have the value.
    pub fn read(self, value: &Expr) -> Result<FieldValue, InvalidValue> {
        let found = match self {
            FieldKind::Cpus => affinity(value).map(FieldValue::Cpus),
            FieldKind::Priority => match (value, integer(value)) {
                (Expr::Name(it), _) if it.name == BACKGROUND => Some(FieldValue::Background),
                (_, Some(priority @ 1..=99)) => Some(FieldValue::Priority(priority)),
                _ => None,
            },
            FieldKind::Time | FieldKind::PositiveTime => {
                let time = milliseconds(value).map_err(InvalidValue::NoTime)?;
                Some(FieldValue::Time(time)).filter(|_| self == FieldKind::Time || time > Time::ZERO)
            }
        };
        found.ok_or(InvalidValue::OtherKind(self))
    }
}

/// Returns the CPUs that an affinity names; `None` where `value` is not a literal of at most 128 bits, more than other integers
/// have.
pub fn affinity(value: &Expr) -> Option<CpuSet> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    let bits = match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => u128::from_str_radix(digits, 16),
        None => text.parse(),
    };
    bits.ok().map(CpuSet)
}

/// Returns the text of a number without a sign.
pub fn number(value: &Expr) -> Option<&Name> {
    match value {
        Expr::Literal(Literal::Int(text) | Literal::Float(text), _) => Some(text),
        _ => None,
    }
}

fn integer(value: &Expr) -> Option<u32> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    u32::try_from(whole_number(text)?).ok()
}

fn milliseconds(value: &Expr) -> Result<Time, NoTime> {
    if let Expr::Literal(Literal::Int(text), _) = value {
        if integer(value).is_none() {
            return Err(NoTime::TooLarge(text.clone()));
        }
        if text.starts_with("0x") || text.starts_with("0X") {
            return Err(NoTime::Hexadecimal);
        }
    }
    let not_a_number = match value {
        Expr::Unary(UnaryOperator::Minus, ..) => NoTime::Negative,
        _ => NoTime::NotALiteral,
    };
    let text = number(value).ok_or(not_a_number)?;
    Time::parse(text, Unit::Milliseconds, Rounding::Exact).map_err(NoTime::Unreadable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_has_its_entry() {
        for field in ActivityField::ALL {
            assert_eq!(field_entry(field).field, field);
        }
    }

    #[test]
    fn each_example_is_valid() {
        for FieldEntry { field, kind, example, .. } in &ACTIVITY_FIELDS {
            let number = Name::from(*example);
            let literal = if example.contains('.') { Literal::Float(number) } else { Literal::Int(number) };
            let value = Expr::Literal(literal, crate::item_tree::SourceId(0));
            assert!(kind.read(&value).is_ok(), "{field:?}");
        }
    }
}
