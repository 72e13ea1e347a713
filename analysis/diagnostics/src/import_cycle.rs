//! # import-cycle
//!
//! An architecture that imports itself, over others or directly. Its instances are not known, so nothing that deploys
//! it is analysed.
//!
//! ```mauve
//! architecture A { import B }   // error
//! architecture B { import A }   // error
//! ```

use super::*;

code!(IMPORT_CYCLE, Error, "import-cycle");

pub(super) fn report<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&IMPORT_CYCLE, at, format!("what is imported here imports {name} in turn: remove one of the imports"))
}
