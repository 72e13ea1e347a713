//! # include-cycle
//!
//! A file that includes itself, over others or directly. It is harmless: each file counts once. But who reads the
//! files cannot tell which comes first.
//!
//! ```mauve
//! include "b.mal"   // warning
//! //- /b.mal
//! include "model.mal"   // warning
//! ```

use super::*;

code!(INCLUDE_CYCLE, Warning, "include-cycle");

pub(super) fn report<'db>(at: Location<'db>, path: &str) -> Diagnostic<'db> {
    let message = format!("`{path}` includes this file in turn: leave out one of the includes");
    Diagnostic::new(&INCLUDE_CYCLE, at, message)
}
