//! # update-or-statemachine
//!
//! A core executes either `update = { … }` or a `statemachine { … }` in each period. It has exactly one of the two.
//!
//! ```mauve
//! shell S { }
//! core Neither(S) { }   // error
//! core Both(S) {
//!   update = { }
//!   statemachine { initial state Waiting { } }   // error
//! }
//! core Good(S) { update = { } }
//! ```

use super::*;

pub(super) fn neither<'db>(at: Location<'db>) -> Diagnostic<'db> {
    let message = "this core has no program for its periods: write `update = { … }` or `statemachine { … }`";
    Diagnostic::new(&UPDATE_OR_STATEMACHINE, at, message)
}

pub(super) fn both<'db>(at: Location<'db>, machines: bool) -> Diagnostic<'db> {
    let what = if machines { "a second `statemachine`" } else { "both `update` and `statemachine`" };
    let message = format!("this core has {what}: only one of them can be executed each period");
    Diagnostic::new(&UPDATE_OR_STATEMACHINE, at, message)
}
