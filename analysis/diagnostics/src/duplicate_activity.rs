//! # duplicate-activity
//!
//! An instance has two activities. The analysis does not know which of them is right, so no activity that either of them can
//! delay has a response time. Remove one. An activity with a list of `instances` also counts for its own name: it has the name of
//! no other activity, and of no instance outside its list.
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

pub(super) fn report<'db>(
    at: Location<'db>,
    instance: &str,
    first: &Location<'db>,
    in_list: bool,
) -> Diagnostic<'db> {
    let message = match in_list {
        true => format!("`{instance}` is in the list twice: remove it once"),
        false => message(instance),
    };
    Diagnostic::new(&DUPLICATE_ACTIVITY, at, message).related(first, if in_list { "here" } else { "first activity" })
}

pub(super) fn message(instance: &str) -> String {
    format!("`{instance}` has two activities: remove one of them")
}
