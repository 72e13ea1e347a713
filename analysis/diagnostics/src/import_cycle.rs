//! # import-cycle
//!
//! An architecture imports itself, directly or through other architectures. Its instances are unknown, so its deployments
//! are not analysed.
//!
//! ```mauve
//! architecture A { import B }   // error
//! architecture B { import A }   // error
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&IMPORT_CYCLE, at, format!("this architecture imports `{name}` in turn: remove one of the imports"))
}
