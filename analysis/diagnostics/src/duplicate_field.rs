//! # duplicate-field
//!
//! A field stands twice in an activity. Which one counts is unknown: the activity is not analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 priority = 2 period = 10 }   // error
//!   activity back { priority = 2 period = 10 }
//! }
//! ```
//!
//! Fix: remove the second one.

use super::*;
use mauve_wcrt::ActivityField;

code!(DUPLICATE_FIELD, Error, "duplicate-field");

pub(super) fn report<'db>(
    (of, id): (Decl<'db>, SourceId),
    field: ActivityField,
    instance: &str,
    first: &Location<'db>,
) -> Diagnostic<'db> {
    let found = Diagnostic::new(&DUPLICATE_FIELD, Location::Source(of, id), message(field, instance));
    let found = found.related(first, "the first is here");
    found.remove(format!("Remove the second {}", field.keyword()), of, id)
}

pub(super) fn message(field: ActivityField, instance: &str) -> String {
    format!("a second {} for `{instance}`: remove one", field.keyword())
}
