//! # undeclared-operation
//!
//! A core defines an operation that its shell does not provide. Nobody can be connected to it, and a program that calls
//! it means something else: a codel of that name, perhaps.
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

code!(UNDECLARED_OPERATION, Error, "undeclared-operation");

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("the shell does not provide `{name}`: declare it there, or rename this operation");
    Diagnostic::new(&UNDECLARED_OPERATION, at, message)
}
