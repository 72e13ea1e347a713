//! # duplicate-activity
//!
//! An instance has two activities. Which one counts is unknown: nothing that either may delay is analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 }
//!   activity back { priority = 2 period = 10 }
//!   activity front { priority = 3 period = 10 }   // error
//! }
//! ```

use super::*;

code!(DUPLICATE_ACTIVITY, Error, "duplicate-activity");

pub(super) fn report<'db>(at: Location<'db>, instance: &str, first: &Location<'db>) -> Diagnostic<'db> {
    Diagnostic::new(&DUPLICATE_ACTIVITY, at, message(instance)).related(first, "the first is here")
}

pub(super) fn message(instance: &str) -> String {
    format!("a second activity for `{instance}`: remove one")
}
