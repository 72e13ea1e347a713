//! # inheritance-cycle
//!
//! A shell extends itself, directly or through other shells.
//!
//! ```mauve
//! shell A extends B { }   // error
//! shell B extends A { }   // error
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("shell {name} extends itself: remove one of the `extends`");
    Diagnostic::new(&INHERITANCE_CYCLE, at, message)
}
