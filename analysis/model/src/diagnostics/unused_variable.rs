//! # unused-variable
//!
//! No program reads this variable, or collects what this handler is for.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) {
//!   var way: int   // hint
//!   var goal: int = 0
//!   update = { way = plan(); goal = goal + 1; }
//! }
//! ```

use super::*;

code!(UNUSED_VARIABLE, Hint, "unused-variable", Unused);

pub(crate) fn report<'db>(at: Place<'db>, what: &str, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNUSED_VARIABLE, at, format!("no program reads the {what} `{name}`"))
}
