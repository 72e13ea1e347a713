//! # unreachable-code
//!
//! This code is never executed: statements after a `return`, one branch of a constant condition, a transition whose guard is
//! always false, or a transition after one whose guard is always true. The analysis does not count its execution time. A
//! condition is constant if it consists of literals of type `int` and `bool`, or if such an operand decides `&&` or `||`.
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

pub(super) fn report<'db>(at: Location<'db>, why: &Unreachable) -> Diagnostic<'db> {
    let why = match why {
        Unreachable::BehindReturn => "every path to it ends with `return`".to_owned(),
        Unreachable::Branch(value) => format!("the condition is always {value}"),
        Unreachable::Guard => "the guard is always false".to_owned(),
        Unreachable::Behind(first) => format!("the guard of the earlier transition `{first}` is always true"),
    };
    Diagnostic::new(&UNREACHABLE_CODE, at, format!("never executed: {why}"))
}
