//! # lost-write
//!
//! A program writes an output port twice in one period, on every path, so readers may never see the first value. Remove one
//! of the writes, or give the connection a buffer (`-> [2]`): a buffer keeps both values, and there is no warning.
//!
//! ```mauve
//! shell S { output port way: int }
//! core C(S) {
//!   statemachine {
//!     initial state A {
//!       run = { write(way, 1); }   // warning
//!       handle = { write(way, 2); }
//!       transition t if 1 > 0 to B { write(way, 3); }
//!     }
//!     state B {
//!       run = { write(way, 4); }
//!       transition t to A
//!     }
//!   }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, port: &str) -> Diagnostic<'db> {
    let message =
        format!("the value written to `{port}` here is overwritten later in the same period, on every path");
    Diagnostic::new(&LOST_WRITE, at, message)
}
