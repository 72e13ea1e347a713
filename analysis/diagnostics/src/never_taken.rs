//! # never-taken
//!
//! A transition follows one without a guard, which always fires first. The analysis leaves out the times of the transition and
//! of a state that no other transition reaches.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) {
//!   statemachine {
//!     initial state Waiting {
//!       transition stop if (plan() > 9) to Waiting
//!       transition go to Moving
//!       transition turn if (plan() > 0) to Moving   // warning
//!     }
//!     state Moving { transition done to Waiting }
//!   }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, (name, first): (&Name, &Name), first_at: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("transition `{name}` is never taken: `{first}` before it has no guard and always fires");
    Diagnostic::new(&NEVER_TAKEN, at, message).related(first_at, "this transition always fires")
}
