//! # missing-else
//!
//! The published grammar requires an `else` for each `if`, and models write it even where it is empty. Without it the `if`
//! does nothing when its condition is false.
//!
//! ```mauve
//! shell S { }
//! core C(S) {
//!   var n: int = 0
//!   update = {
//!     if n > 0 then { n = 0; }   // hint
//!     if n < 0 then { n = 0; } else { }
//!   }
//! }
//! ```
//!
//! Fix: write an empty `else`.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, end: SourceId) -> Diagnostic<'db> {
    let end = beside(&at, end);
    let message = "this `if` has no `else`".to_owned();
    Diagnostic::new(&MISSING_ELSE, at, message).fix("Write `else { }`", end, " else { }".to_owned())
}
