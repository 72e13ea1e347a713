//! # read-before-assignment
//!
//! A program reads a variable that has no initial value and that no earlier program assigns, so its value is unknown.
//! Earlier programs are those of preceding states and of the same state, and `configure` and `start`. Declare the variable
//! with an initial value (`var n: int = 0`), or assign it first.
//!
//! ```mauve
//! codel drive(in speed: int): void
//! codel measure(): int
//! shell S { }
//! core C(S) {
//!   var speed: int
//!   statemachine {
//!     initial state Waiting { transition go to Moving }
//!     state Moving {
//!       run = { drive(speed); }   // warning
//!       transition done to Measuring
//!     }
//!     state Measuring {
//!       run = { speed = measure(); drive(speed); }
//!       transition done to Moving
//!     }
//!   }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str, declared: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("`{name}` is read before any assignment: give it an initial value");
    Diagnostic::new(&READ_BEFORE_ASSIGNMENT, at, message).related(declared, "declared here without a value")
}
