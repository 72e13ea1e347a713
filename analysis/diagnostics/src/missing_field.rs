//! # missing-field
//!
//! An activity has a priority and, unless the priority is `background`, a period in milliseconds, or a rate; with a `trigger`, the
//! `least` time between two releases. Where one is missing, its
//! value may stand in another field: the activity may have the highest priority on any CPU, and the activities that it may
//! preempt are not analysed.
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
//! Fix: write the field, with a value to be changed: the priority below those of all others on the CPU, or the lowest that none
//! of them has; a period of 100 ms. `mauve tune --priorities` searches for all priorities together.

use super::*;
use mauve_hir::field_entry;
use mauve_wcrt::ActivityField;

pub(super) fn priority<'db>(
    of: Decl<'db>,
    activity: &(Name, SourceId),
    free: u32,
    period: Option<SourceId>,
) -> Diagnostic<'db> {
    let found = report(of, activity, ActivityField::Priority);
    let field = format!("priority = {free}");
    let title = format!("Write `{field}`, to be changed");
    match period {
        Some(period) => found.fix(title, Location::Before(of, period), format!("{field} ")),
        None => found.fix(title, Location::Inside(of, activity.1), format!(" {field}")),
    }
}

pub(super) fn period<'db>(
    of: Decl<'db>,
    activity: &(Name, SourceId),
    priority: Option<SourceId>,
    has_trigger: bool,
) -> Diagnostic<'db> {
    let field = if has_trigger { ActivityField::Least } else { ActivityField::Period };
    let found = report(of, activity, field);
    let location = priority.map_or(Location::Inside(of, activity.1), |priority| Location::Behind(of, priority));
    let written = format!("{} = 100", field.keyword());
    found.fix(format!("Write `{written}`, to be changed"), location, format!(" {written}"))
}

fn report<'db>(of: Decl<'db>, (name, id): &(Name, SourceId), field: ActivityField) -> Diagnostic<'db> {
    let (field, example) = (field.keyword(), field_entry(field).example);
    let message = format!("activity `{name}` has no {field}: write, for example, `{field} = {example}`");
    Diagnostic::new(&MISSING_FIELD, Location::Source(of, *id), message)
}
