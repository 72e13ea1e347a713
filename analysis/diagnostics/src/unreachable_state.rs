//! # unreachable-state
//!
//! The state machine cannot reach this state from its initial state. The analysis ignores the state, because no period ever
//! begins in it. If a transition has the wrong target, correct it: otherwise the response times do not include this state's
//! execution time.
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

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message =
        format!("state `{name}` cannot be reached from the initial state: the analysis ignores it");
    Diagnostic::new(&UNREACHABLE_STATE, at, message)
}
