//! # include-cycle
//!
//! A file includes itself, directly or through other files. Each file is read once, so the cycle has no effect; but it
//! hides the order of the files from a reader.
//!
//! ```mauve
//! include "b.mal"   // warning
//! //- /b.mal
//! include "model.mal"   // warning
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, path: &str) -> Diagnostic<'db> {
    let message = format!("`{path}` includes this file in turn: leave out one of the includes");
    Diagnostic::new(&INCLUDE_CYCLE, at, message)
}
