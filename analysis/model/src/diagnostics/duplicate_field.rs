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

code!(DUPLICATE_FIELD, Error, "duplicate-field");

pub(crate) fn report<'db>(of: Decl<'db>, at: Part, name: &str, instance: &str, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("a second {name} for `{instance}`: remove one");
    let found = Diagnostic::new(&DUPLICATE_FIELD, Place::Part(of, at), message).related(first, "the first is here");
    found.remove(format!("Remove the second {name}"), of, at)
}
