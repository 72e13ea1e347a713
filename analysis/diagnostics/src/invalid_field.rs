//! # invalid-field
//!
//! The value of a field of an activity is invalid. `priority` is a whole number from 1 (lowest) to 99, or `background`;
//! `period`, `deadline`, `jitter` and `offset` are times in milliseconds, exact to the nanosecond, and the offset is less than
//! the period; `affinity` is a bit mask of CPUs: 1 is CPU 1, 2 is CPU 2, 3 is both, 0 is any.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 100 period = 10 }   // error
//!   activity back { priority = 99 period = 0.5 affinity = 0x1 }
//! }
//! ```

use super::*;
use mauve_hir::{FieldKind, InvalidValue, NoTime};
use mauve_wcrt::{ActivityField, NoSuchCpu};

pub(super) fn report<'db>(at: Location<'db>, field: ActivityField, why: &InvalidValue) -> Diagnostic<'db> {
    let expected = match why {
        InvalidValue::OtherKind(kind) => kind.expected().to_owned(),
        InvalidValue::NotBelow(period) => format!("a time less than the period of {period}"),
        InvalidValue::NoTime(why) => format!("{} ({})", FieldKind::Time.expected(), no_time(why)),
    };
    let message = format!("invalid {}: expected {expected}", field.keyword());
    Diagnostic::new(&INVALID_FIELD, at, message)
}

fn no_time(why: &NoTime) -> String {
    match why {
        NoTime::TooLarge(text) => format!("`{text}` is greater than 2147483647"),
        NoTime::Hexadecimal => "not in hexadecimal".to_owned(),
        NoTime::Negative => "not negative".to_owned(),
        NoTime::NotALiteral => "a number, not an expression".to_owned(),
        NoTime::Unreadable(error) => time_error_message(*error).to_owned(),
    }
}

pub(super) fn no_such_cpu(at: Location<'_>, missing: NoSuchCpu) -> Diagnostic<'_> {
    Diagnostic::new(&INVALID_FIELD, at, reasons::no_such_cpu(missing))
}
