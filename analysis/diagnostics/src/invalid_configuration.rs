//! # invalid-configuration
//!
//! `mauve.toml` is not TOML, or has an unknown section, an unknown key or an invalid value. A misspelt key may be one that makes
//! response times longer, and a string over several lines may contain one: nothing is analysed until the error is corrected.
//! (A root that does not exist is left out, and the others are analysed.)
//!
//! ```mauve
//! codel plan(): int
//! //- /mauve.toml
//! [platfrom]   # error
//! rt_throttling = true
//! [timing]
//! significanse = 1e-4   # error
//! ```
//!
//! Fix: replace a misspelt section or key by the similar one.

use super::*;

pub(crate) fn report<'db>(at: Location<'db>, message: String) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_CONFIGURATION, at, message)
}
