//! # unreachable-state
//!
//! A state that no transition leads to, from the initial state on. It is left out of the analysis, since no period ever
//! begins in it: where a transition to it has another target by mistake, what it takes is missing in every response time.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) {
//!   statemachine {
//!     initial state Waiting { transition go if (plan() > 0) to Waiting }
//!     state Moving { run = { plan(); }  transition done to Waiting }   // warning
//!   }
//! }
//! ```

use super::*;

code!(UNREACHABLE_STATE, Warning, "unreachable-state", Unused);

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("no transition leads to state `{name}`: it is never entered, and not part of the analysis");
    Diagnostic::new(&UNREACHABLE_STATE, at, message)
}
