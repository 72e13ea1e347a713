//! # invalid-field
//!
//! A field of an activity has a value that it cannot have. `priority` is a whole number from 1 to 99, greater is more
//! urgent, or `background`; `period` and `deadline` are milliseconds, exact to the nanosecond; `affinity` is a bit
//! mask of CPUs: 1 is the first, 2 the second, 3 both, 0 any.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 100 period = 10 }   // error
//!   activity back { priority = 99 period = 0.5 affinity = 0x1 }
//! }
//! ```

use super::*;

code!(INVALID_FIELD, Error, "invalid-field");

pub(crate) fn report<'db>(at: Place<'db>, name: &str, expected: &str) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_FIELD, at, format!("this cannot be the {name}: expected {expected}"))
}

pub(crate) fn no_such_cpu<'db>(at: Place<'db>, why: &str) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_FIELD, at, why.to_owned())
}
