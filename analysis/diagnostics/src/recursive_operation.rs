//! # recursive-operation
//!
//! An operation calls itself, directly or through other operations, so its execution time has no bound.
//!
//! ```mauve
//! shell S { provide reset(): void }
//! core C(S) {
//!   provide reset() = { reset(); }   // error
//!   update = { }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("`{name}` calls itself: its execution time has no bound");
    Diagnostic::new(&RECURSIVE_OPERATION, at, message)
}
