//! # duplicate-field
//!
//! An activity has the same field twice. The analysis does not know which value is right, so the activity is not analysed.
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
//! Fix: remove the second field.

use super::*;
use mauve_wcrt::ActivityField;

pub(super) fn report<'db>(
    (of, id): (Decl<'db>, SourceId),
    field: ActivityField,
    instance: &str,
    first: &Location<'db>,
) -> Diagnostic<'db> {
    let found = Diagnostic::new(&DUPLICATE_FIELD, Location::Source(of, id), message(field, instance));
    let found = found.related(first, "first value");
    found.remove(format!("Remove the second `{}`", field.keyword()), of, id)
}

pub(super) fn message(field: ActivityField, instance: &str) -> String {
    format!("`{}` of `{instance}` is set twice: remove one of the values", field.keyword())
}
