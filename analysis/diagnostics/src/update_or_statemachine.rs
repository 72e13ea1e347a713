//! # update-or-statemachine
//!
//! A core says what it does each period by `update = { … }` or by a `statemachine { … }`: by one of them, once.
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

code!(UPDATE_OR_STATEMACHINE, Error, "update-or-statemachine");

pub(super) fn neither<'db>(at: Location<'db>) -> Diagnostic<'db> {
    let message = "this core does nothing each period: write `update = { … }` or a `statemachine { … }`";
    Diagnostic::new(&UPDATE_OR_STATEMACHINE, at, message)
}

pub(super) fn both<'db>(at: Location<'db>, machines: bool) -> Diagnostic<'db> {
    let what = if machines { "a second `statemachine`" } else { "both `update` and `statemachine`" };
    let message = format!("this core has {what}: one of them says what it does each period");
    Diagnostic::new(&UPDATE_OR_STATEMACHINE, at, message)
}
