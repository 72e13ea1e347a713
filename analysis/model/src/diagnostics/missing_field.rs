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
//! ```

use super::*;

code!(MISSING_FIELD, Error, "missing-field");

pub(crate) fn report<'db>(at: Place<'db>, instance: &str, field: &str) -> Diagnostic<'db> {
    let example = if field == "period" { "period = 100" } else { "priority = 10" };
    let message = format!("the activity of `{instance}` has no {field}: write, for example, `{example}`");
    Diagnostic::new(&MISSING_FIELD, at, message)
}
