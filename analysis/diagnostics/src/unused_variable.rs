//! # unused-variable
//!
//! No program reads this variable, or collects the call of this handler.
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
//! Fix, where no program names the variable and its initial value calls nothing: remove it.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, is_handler: bool, name: &str, is_removable: bool) -> Diagnostic<'db> {
    let what = if is_handler { "handler" } else { "variable" };
    let message = match is_handler {
        true => format!("handler `{name}` is never collected"),
        false => format!("variable `{name}` is never read"),
    };
    let found = Diagnostic::new(&UNUSED_VARIABLE, at.clone(), message);
    match at {
        Location::Source(of, id) if is_removable => found.remove(format!("Remove the unused {what} `{name}`"), of, id),
        _ => found,
    }
}
