//! # duplicate-activity
//!
//! An instance has two activities. The analysis does not know which of them is right, so no activity that either of them can
//! delay has a response time. Remove one.
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

pub(super) fn report<'db>(at: Location<'db>, instance: &str, first: &Location<'db>) -> Diagnostic<'db> {
    Diagnostic::new(&DUPLICATE_ACTIVITY, at, message(instance)).related(first, "first activity")
}

pub(super) fn message(instance: &str) -> String {
    format!("`{instance}` has two activities: remove one of them")
}
