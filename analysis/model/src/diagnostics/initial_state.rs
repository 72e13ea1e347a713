//! # initial-state
//!
//! A state machine starts in exactly one state: one of its states is `initial`.
//!
//! ```mauve
//! shell S { }
//! core None(S) {
//!   statemachine { state Waiting { } }   // error
//! }
//! core Several(S) {
//!   statemachine {
//!     initial state Waiting { }
//!     initial state Moving { }   // error
//!   }
//! }
//! ```

use super::*;

code!(INITIAL_STATE, Error, "initial-state");

pub(crate) fn none<'db>(at: Place<'db>) -> Diagnostic<'db> {
    let message = "no state of this machine is `initial`: mark the one in which it starts";
    Diagnostic::new(&INITIAL_STATE, at, message.to_owned())
}

pub(crate) fn several<'db>(first: (Place<'db>, &Name), second: (Place<'db>, &Name)) -> Diagnostic<'db> {
    let message = format!("`{}` is initial, and so is `{}`: a machine starts in one state", second.1, first.1);
    Diagnostic::new(&INITIAL_STATE, second.0, message).related(first.0, "the first is here")
}
