//! # invalid-field
//!
//! The value of a field of an activity is invalid. `priority` is a whole number from 1 (lowest) to 99, or `background`;
//! `period`, `least`, `deadline`, `jitter` and `offset` are times in milliseconds, exact to the nanosecond, or quotients such as
//! `1000/30`, and the offset is less than the period; `rate` is a number of releases per second; `affinity` is a bit mask of
//! CPUs: 1 is CPU 1, 2 is CPU 2, 3 is both, 0 is any; `cpus` is a list of CPUs, or a name of `[platform.cpu_sets]` in mauve.toml;
//! `trigger` is an input port of the instance; `burst` is a number from 1 to 1000; `instances` is a list.
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
    let (message, near) = match why {
        InvalidValue::UnknownCpuSet(name, near) => {
            (format!("no CPU set `{name}` in `[platform.cpu_sets]` of mauve.toml"), near)
        }
        InvalidValue::NoInputPort(name, shell, near) => (format!("no input port `{name}` in {shell}"), near),
        InvalidValue::UnknownThread(id, near) => {
            (format!("no thread `{id}`, or several, in the files of `[platform] threads` of mauve.toml"), near)
        }
        InvalidValue::AbovePeriod(period) => {
            (format!("the thread has the period {period} by its file: write a shorter one, or none"), &None)
        }
        InvalidValue::OfThread => {
            (format!("the thread has the {} in its file: remove it here", field.keyword()), &None)
        }
        why => (format!("invalid {}: expected {}", field.keyword(), expected(why)), &None),
    };
    let found = Diagnostic::new(&INVALID_FIELD, at.clone(), message).did_you_mean(near.clone());
    match (why, at) {
        (InvalidValue::NoList(_, list), _) => found.writing(Some(list)),
        (InvalidValue::NoMask(name), Location::Source(of, _)) => {
            found.fix("Change to `cpus`", Location::Source(of, *name), "cpus".to_owned())
        }
        _ => found,
    }
}

fn expected(why: &InvalidValue) -> String {
    match why {
        InvalidValue::OtherKind(kind) | InvalidValue::NoList(kind, _) => kind.expected().to_owned(),
        InvalidValue::NoMask(_) => format!("{}; a list is written as `cpus = [1, 2]`", FieldKind::Cpus.expected()),
        InvalidValue::NotBelow(period) => format!("a time less than the period of {period}"),
        InvalidValue::NoTime(why) => format!("{} ({})", FieldKind::Time.expected(), no_time(why)),
        InvalidValue::CpuZero => "CPUs from 1, the first one".to_owned(),
        InvalidValue::UnknownThread(..) | InvalidValue::OfThread | InvalidValue::AbovePeriod(_) => FieldKind::Thread.expected().to_owned(),
        InvalidValue::UnknownCpuSet(..) => FieldKind::CpuList.expected().to_owned(),
        InvalidValue::NoInputPort(..) => FieldKind::Ports.expected().to_owned(),
    }
}

fn no_time(why: &NoTime) -> String {
    match why {
        NoTime::TooLarge(text) => format!("`{text}` is greater than 2147483647"),
        NoTime::Hexadecimal => "not in hexadecimal".to_owned(),
        NoTime::Negative => "not negative".to_owned(),
        NoTime::NotALiteral => "a number, or a quotient such as 1000/30".to_owned(),
        NoTime::Unreadable(error) => time_error_message(*error).to_owned(),
    }
}

pub(super) fn no_such_cpu(at: Location<'_>, missing: NoSuchCpu) -> Diagnostic<'_> {
    Diagnostic::new(&INVALID_FIELD, at, reasons::no_such_cpu(missing))
}
