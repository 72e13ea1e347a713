//! # unknown-field
//!
//! The fields of an activity are `affinity`, `priority`, `period`, `deadline`, `jitter` and `offset`. Another name may be a
//! misspelt one of these, and the activity is not analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 deadlin = 5 }   // error
//!   activity back { priority = 2 period = 10 deadline = 5 }
//! }
//! ```

use super::*;
use mauve_wcrt::ActivityField;

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let found = Diagnostic::new(&UNKNOWN_FIELD, at.clone(), message(name));
    match similar_field(name) {
        Some(near) => found.fix(format!("Change to `{near}`"), at, near.to_owned()),
        None => found,
    }
}

pub(super) fn message(name: &str) -> String {
    let near = similar_field(name).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!("unknown field `{name}`: expected affinity, priority, period, deadline, jitter or offset{near}")
}

fn similar_field(name: &str) -> Option<&'static str> {
    let other = match name {
        "prio" => Some(ActivityField::Priority),
        "cpu" | "cpus" | "core" | "cores" | "mask" => Some(ActivityField::Affinity),
        "dl" => Some(ActivityField::Deadline),
        _ => None,
    };
    if let Some(field) = other {
        return Some(field.keyword());
    }
    mauve_syntax::similar(name, ActivityField::ALL.map(ActivityField::keyword))
}
