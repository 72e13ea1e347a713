//! # operation-definition
//!
//! A core defines an operation with other parameters or another result type than its shell declares. Only the names of the
//! parameters may differ.
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
//! Fix, where the definition does not have more parameters than the declaration: change the signature to the declared one;
//! existing parameters keep their names.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    [declared, defined]: &[String; 2],
    declared_at: &Location<'db>,
    fixed: Option<&(SourceId, String)>,
) -> Diagnostic<'db> {
    let message = format!("`{defined}` differs from its declaration in the shell: `{declared}`");
    let found = Diagnostic::new(&OPERATION_DEFINITION, at.clone(), message).related(declared_at, "declared here");
    match fixed {
        Some((signature, text)) => {
            found.fix("Change to the signature in the shell", beside(&at, *signature), text.clone())
        }
        None => found,
    }
}
