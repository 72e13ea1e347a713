//! # conflicting-fields
//!
//! An activity has a field that does not go with the others. `affinity` and `cpus` say the same, and so do `period`, `rate` and
//! `least`. An activity with a `trigger` is released by data: it has no `offset`, and executes one instance. Without a `trigger`
//! there is no `least` and no `burst`. Activities with one `thread` have one `order`, `priority` and `preemptive`, and the same CPUs.
//!
//! ```mauve
//! shell S { input port scan: int }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 rate = 100 Hz }   // error
//!   activity back { priority = 2 trigger = scan least = 10 }
//! }
//! deployment Lab {
//!   architecture A
//!   activity front { priority = 1 period = 10 burst = 2 }   // error
//!   activity back { priority = 2 trigger = scan least = 10 burst = 2 }
//! }
//! ```
//!
//! The analysis does not know which field is right, so the activity is not analysed. Fix: remove the field.

use super::*;
use mauve_hir::PERIODS;
use mauve_wcrt::ActivityField;

pub(super) fn report<'db>(
    (of, id): (Decl<'db>, SourceId),
    field: ActivityField,
    other: ActivityField,
    first: &Location<'db>,
) -> Diagnostic<'db> {
    let (name, beside) = (field.keyword(), other.keyword());
    let why = match field {
        _ if PERIODS.contains(&field) => "both say the time between two releases",
        ActivityField::Affinity | ActivityField::Cpus => "both say on which CPUs it runs",
        _ if [field, other].contains(&ActivityField::Thread) => "both say what its thread executes",
        _ if [field, other].contains(&ActivityField::Instances) => "data releases one instance only",
        _ => "no clock releases an activity with a trigger",
    };
    let message = format!("`{name}` cannot be beside `{beside}`: {why}; remove one of them");
    let found = Diagnostic::new(&CONFLICTING_FIELDS, Location::Source(of, id), message);
    found.related(first, format!("`{beside}`")).remove(format!("Remove `{name}`"), of, id)
}

/// At the value of the field.
pub(super) fn other_in_thread<'db>(
    at: Location<'db>,
    thread: &str,
    field: ActivityField,
    first: &Location<'db>,
) -> Diagnostic<'db> {
    let name = field.keyword();
    let message = format!("the thread `{thread}` has one `{name}`: give all of its activities the same");
    Diagnostic::new(&CONFLICTING_FIELDS, at, message).related(first, format!("an activity in `{thread}`"))
}

pub(super) fn without_other<'db>(of: Decl<'db>, id: SourceId, field: ActivityField) -> Diagnostic<'db> {
    let name = field.keyword();
    let message = match field {
        ActivityField::Least => {
            "`least` is for an activity that data releases: write `period`, or add `trigger` with the input port".to_owned()
        }
        ActivityField::Order => {
            "`order` is for activities in one thread: remove it, or add `thread` with a name to all of them".to_owned()
        }
        _ => format!("`{name}` is for an activity that data releases: remove it, or add `trigger` with the input port"),
    };
    let found = Diagnostic::new(&CONFLICTING_FIELDS, Location::Source(of, id), message);
    match field {
        ActivityField::Least => found.fix("Change to `period`", Location::Source(of, id), "period".to_owned()),
        _ => found.remove(format!("Remove `{name}`"), of, id),
    }
}
