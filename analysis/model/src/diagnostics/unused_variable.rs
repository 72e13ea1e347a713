//! # unused-variable
//!
//! No program reads this variable, or collects what this handler is for.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) {
//!   var way: int   // hint
//!   var goal: int = 0   // hint
//!   var home: int = 1; var here: int = 2   // hint
//!   update = { way = plan(); var there: int = 0; if home > 0 then { } else { } }   // hint
//! }
//! ```
//!
//! Fix: remove it, where no program names it and its value calls nothing.

use super::*;

code!(UNUSED_VARIABLE, Hint, "unused-variable", Unused);

pub(crate) fn report<'db>(of: Decl<'db>, at: Part, what: &str, name: &str, is_removable: bool) -> Diagnostic<'db> {
    let message = format!("no program reads the {what} `{name}`");
    let found = Diagnostic::new(&UNUSED_VARIABLE, Place::Part(of, at), message);
    if is_removable { found.remove(format!("Remove `{name}`"), of, at) } else { found }
}
