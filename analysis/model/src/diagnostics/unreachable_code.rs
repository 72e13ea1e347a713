//! # unreachable-code
//!
//! What is never executed: what follows a `return`, a branch of a condition that is constant, a transition whose guard is
//! always false, or that stands behind one whose guard is always true. The analysis does not count its time. A condition is
//! constant where it consists of literals of type `int` and `bool`, or where one that does decides `&&` or `||`.
//!
//! ```mauve
//! codel stop(): void
//! shell S { }
//! core C(S) {
//!   update = {
//!     if 1 > 2 then {
//!       stop();   // hint
//!     } else { }
//!   }
//!   stop = {
//!     return;
//!     stop();   // hint
//!   }
//!   cleanup = { stop(); return; }
//! }
//! ```

use super::*;

code!(UNREACHABLE_CODE, Hint, "unreachable-code", Unused);

/// What stands behind a `return`.
pub(crate) fn behind_return<'db>(at: Place<'db>) -> Diagnostic<'db> {
    report(at, "every path before it ends with `return`".to_owned())
}

/// A branch whose condition is always `value`; it is the other one that is executed.
pub(crate) fn branch<'db>(at: Place<'db>, value: bool) -> Diagnostic<'db> {
    report(at, format!("the condition is always {value}"))
}

/// A transition whose guard is always false.
pub(crate) fn guard<'db>(at: Place<'db>) -> Diagnostic<'db> {
    report(at, "the guard is always false".to_owned())
}

/// A transition behind one whose guard is always true.
pub(crate) fn behind<'db>(at: Place<'db>, first: &Name) -> Diagnostic<'db> {
    report(at, format!("the guard of `{first}` before it is always true"))
}

fn report<'db>(at: Place<'db>, why: String) -> Diagnostic<'db> {
    Diagnostic::new(&UNREACHABLE_CODE, at, format!("this is never executed: {why}"))
}
