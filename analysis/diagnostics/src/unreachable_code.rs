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
use mauve_hir::fact::Unreachable;

code!(UNREACHABLE_CODE, Hint, "unreachable-code", Unused);

pub(super) fn report<'db>(at: Location<'db>, why: &Unreachable) -> Diagnostic<'db> {
    let why = match why {
        Unreachable::BehindReturn => "every path before it ends with `return`".to_owned(),
        Unreachable::Branch(value) => format!("the condition is always {value}"),
        Unreachable::Guard => "the guard is always false".to_owned(),
        Unreachable::Behind(first) => format!("the guard of `{first}` before it is always true"),
    };
    Diagnostic::new(&UNREACHABLE_CODE, at, format!("this is never executed: {why}"))
}
