//! # unused-codel
//!
//! No program of the project calls this codel.
//!
//! ```mauve
//! codel plan(): int   // hint
//! codel drive(): int
//! shell S { }
//! core C(S) { update = { drive(); } }
//! ```

use super::*;

code!(UNUSED_CODEL, Hint, "unused-codel", Unused);

pub(crate) fn report<'db>(at: Place<'db>, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNUSED_CODEL, at, format!("no program calls `{name}`"))
}
