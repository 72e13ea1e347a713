//! # undeclared-operation
//!
//! A core defines an operation that its shell does not provide. No component can connect to it, and a call of its name in a
//! program calls a codel instead.
//!
//! ```mauve
//! shell S { provide reset(): void }
//! core C(S) {
//!   provide reset() = { }
//!   provide rseet() = { }   // error
//!   update = { }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("the shell does not provide `{name}`: declare it there, or rename this operation");
    Diagnostic::new(&UNDECLARED_OPERATION, at, message)
}
