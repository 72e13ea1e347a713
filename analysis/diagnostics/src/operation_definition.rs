//! # operation-definition
//!
//! The core defines an operation otherwise than its shell declares it: other parameters, or another result. (The names of
//! parameters may differ.)
//!
//! ```mauve
//! shell S { provide near(in far: double): bool  provide stop(): void }
//! core C(S) {
//!   provide near(in far: int): bool = { return far < 2; }   // error
//!   provide stop() = { }
//!   update = { }
//! }
//! ```
//!
//! Fix: define it as the shell declares it, where that has as many parameters or more; those that it has keep their names.

use super::*;

code!(OPERATION_DEFINITION, Error, "operation-definition");

pub(super) fn report<'db>(
    at: Location<'db>,
    [declared, defined]: &[String; 2],
    declared_at: &Location<'db>,
    fixed: Option<&(SourceId, String)>,
) -> Diagnostic<'db> {
    let message = format!("this is `{defined}`, and the shell declares `{declared}`");
    let found = Diagnostic::new(&OPERATION_DEFINITION, at.clone(), message).related(declared_at, "declared here");
    match fixed {
        Some((signature, text)) => {
            found.fix("Define it as the shell declares it", beside(&at, *signature), text.clone())
        }
        None => found,
    }
}
