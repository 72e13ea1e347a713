//! # unreadable-file
//!
//! A file that cannot be read, or whose text is not UTF-8. What stands before the place is read; nothing is analysed
//! that needs what may stand behind it.
//!
//! A model is text: save it as UTF-8.

use super::*;

code!(UNREADABLE_FILE, Error, "unreadable-file");

pub(super) fn report<'db>(at: Location<'db>, problem: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNREADABLE_FILE, at, problem.to_owned())
}
