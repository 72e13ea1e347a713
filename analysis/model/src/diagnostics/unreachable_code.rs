//! # unreachable-code
//!
//! What follows a `return` is never executed. The analysis counts its time all the same.
//!
//! ```mauve
//! codel stop(): void
//! shell S { }
//! core C(S) {
//!   update = { }
//!   stop = {
//!     return;
//!     stop();   // hint
//!   }
//!   cleanup = { stop(); return; }
//! }
//! ```

use super::*;

code!(UNREACHABLE_CODE, Hint, "unreachable-code", Unused);

pub(crate) fn report<'db>(at: Place<'db>) -> Diagnostic<'db> {
    let message = "this is never executed: every path before it ends with `return`".to_owned();
    Diagnostic::new(&UNREACHABLE_CODE, at, message)
}
