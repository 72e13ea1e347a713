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

use super::*;

code!(DUPLICATE_FIELD, Error, "duplicate-field");

pub(crate) fn report<'db>(at: Place<'db>, name: &str, instance: &str, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("a second {name} for `{instance}`: remove one");
    Diagnostic::new(&DUPLICATE_FIELD, at, message).related(first, "the first is here")
}
