//! # missing-field
//!
//! An activity has a priority and, unless that is `background`, a period in milliseconds. Where one is missing, another
//! field may have its value: the activity may be the most urgent, on any CPU, and what it may delay is not analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 }   // error
//!   activity back { priority = background }
//! }
//! deployment Lab {
//!   architecture A
//!   activity front { priority = 7 period = 20 }
//!   activity back { period = 50 }   // error
//! }
//! ```
//!
//! Fix: write the field, with a value to be changed: a priority below those of all others on the CPU, where one is free
//! there; a period of 100 ms.

use super::*;
use crate::item_tree::Activity;

code!(MISSING_FIELD, Error, "missing-field");

pub(crate) fn priority<'db>(of: Decl<'db>, activity: &Activity, free: u32) -> Diagnostic<'db> {
    let found = report(of, activity, "priority", "priority = 10");
    let field = format!("priority = {free}");
    let title = format!("Write `{field}`, to be changed");
    match activity.fields.iter().find(|field| field.name.name == "period") {
        Some(period) => found.fix(title, Place::Before(of, period.name.part), format!("{field} ")),
        None => found.fix(title, Place::Inside(of, activity.instance.part), format!(" {field}")),
    }
}

pub(crate) fn period<'db>(of: Decl<'db>, activity: &Activity) -> Diagnostic<'db> {
    let found = report(of, activity, "period", "period = 100");
    let place = match activity.fields.iter().find(|field| field.name.name == "priority") {
        Some(priority) => Place::Behind(of, priority.value_part),
        None => Place::Inside(of, activity.instance.part),
    };
    found.fix("Write `period = 100`, to be changed", place, " period = 100".to_owned())
}

fn report<'db>(of: Decl<'db>, activity: &Activity, field: &str, example: &str) -> Diagnostic<'db> {
    let NameRef { name, part } = &activity.instance;
    let message = format!("the activity of `{name}` has no {field}: write, for example, `{example}`");
    Diagnostic::new(&MISSING_FIELD, Place::Part(of, *part), message)
}
