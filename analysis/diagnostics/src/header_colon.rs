//! # header-colon
//!
//! The colon behind the header of a core is in the grammar of the paper, and in no model.
//!
//! ```mauve
//! shell S { }
//! core C(S): { update = { } }   // hint
//! core D(S) { update = { } }
//! ```
//!
//! Fix: remove it.

use super::*;

code!(HEADER_COLON, Hint, "header-colon");

pub(super) fn report<'db>(at: Location<'db>) -> Diagnostic<'db> {
    let message = "a core needs no colon here".to_owned();
    Diagnostic::new(&HEADER_COLON, at.clone(), message).fix("Remove the colon", at, String::new())
}
