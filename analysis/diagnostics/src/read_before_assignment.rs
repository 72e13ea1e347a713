//! # read-before-assignment
//!
//! A variable without a first value is read where no path has assigned it yet: what is in it then is unknown. Whatever may
//! assign it in a state before, or earlier in the same state, counts; so do `configure` and `start`.
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

code!(READ_BEFORE_ASSIGNMENT, Warning, "read-before-assignment");

pub(super) fn report<'db>(at: Location<'db>, name: &str, declared: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("`{name}` is read here before anything is assigned to it: give it a first value");
    Diagnostic::new(&READ_BEFORE_ASSIGNMENT, at, message).related(declared, "declared without a value")
}
