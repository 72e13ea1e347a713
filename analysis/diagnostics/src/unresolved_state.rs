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

pub(super) fn report<'db>(
    at: Location<'db>,
    name: &str,
    instance: Option<&Name>,
    near: Option<Name>,
) -> Diagnostic<'db> {
    let machine = instance.map_or("this state machine".to_owned(), |it| format!("the state machine of `{it}`"));
    let message = format!("no state `{name}` in {machine}");
    Diagnostic::new(&UNRESOLVED_STATE, at, message).did_you_mean(near)
}
