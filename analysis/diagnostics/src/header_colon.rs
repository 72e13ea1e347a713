//! # header-colon
//!
//! The published grammar has a colon behind the header of a core. Models are written without it, and it has no effect.
//!
//! ```mauve
//! shell S { }
//! core C(S): { update = { } }   // hint
//! core D(S) { update = { } }
//! ```
//!
//! Fix: remove the colon.

use super::*;

pub(super) fn report<'db>(at: Location<'db>) -> Diagnostic<'db> {
    let message = "the header of a core needs no colon".to_owned();
    Diagnostic::new(&HEADER_COLON, at.clone(), message).fix("Remove the colon", at, String::new())
}
