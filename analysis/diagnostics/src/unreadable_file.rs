//! # unreadable-file
//!
//! A file cannot be read, or its text is not UTF-8. The text before the error is read; declarations that may depend on the
//! rest are not analysed.
//!
//! A model is text: save it as UTF-8.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, problem: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNREADABLE_FILE, at, problem.to_owned())
}
