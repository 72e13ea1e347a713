//! # unresolved-state
//!
//! A transition leads to a state that its state machine does not have.
//!
//! ```mauve
//! shell S { }
//! core C(S) {
//!   statemachine {
//!     initial state Waiting { transition go to Movng }   // error
//!     state Moving { transition done to Waiting }
//!   }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no state `{name}` in this state machine");
    Diagnostic::new(&UNRESOLVED_STATE, at, message).did_you_mean(near)
}
