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

pub(super) fn report<'db>(at: Location<'db>, is_handler: bool, name: &str, is_removable: bool) -> Diagnostic<'db> {
    let what = if is_handler { "handler" } else { "variable" };
    let message = format!("no program reads the {what} `{name}`");
    let found = Diagnostic::new(&UNUSED_VARIABLE, at.clone(), message);
    match at {
        Location::Source(of, id) if is_removable => found.remove(format!("Remove `{name}`"), of, id),
        _ => found,
    }
}
