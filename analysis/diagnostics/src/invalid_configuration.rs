//! # invalid-configuration
//!
//! `mauve.toml` is not TOML, or has a section, a key or a value that means nothing. Something that makes response times
//! longer may have lost its header, or be misspelt: nothing is analysed until it is mended. (A root that does not exist,
//! or is no path, is left out: the others are analysed.) So is what a text over several lines may have swallowed.
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
//! Fix: write the section or the key that is nearly so.

use super::*;

code!(INVALID_CONFIGURATION, Error, "invalid-configuration");

pub(crate) fn report<'db>(at: Location<'db>, message: String) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_CONFIGURATION, at, message)
}
