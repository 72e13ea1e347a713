//! # lost-write
//!
//! A value is written to an output port, and every path writes another one before the period ends: nobody is sure to see the
//! first. Where a connection from the port has a buffer, both are kept, and there is no warning.
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

code!(LOST_WRITE, Warning, "lost-write");

pub(super) fn report<'db>(at: Location<'db>, port: &str) -> Diagnostic<'db> {
    let message = format!("what is written to `{port}` here is overwritten in the same period, on every path");
    Diagnostic::new(&LOST_WRITE, at, message)
}
