//! # unresolved-include
//!
//! An `include` of a file that is not there. Includes are looked for beside the including file, then in the folders of
//! the environment variable `MAUVE_MODELS`, which are separated by colons.
//!
//! ```mauve
//! include "lasr.mal"   // error
//! include "laser.mal"
//! //- /laser.mal
//! codel scan(): int
//! ```

use super::*;

code!(UNRESOLVED_INCLUDE, Error, "unresolved-include");

pub(super) fn report<'db>(at: Location<'db>, path: &str, candidates: &[String], near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no file `{path}`: looked for {}", candidates.join(", "));
    let diagnostic = Diagnostic::new(&UNRESOLVED_INCLUDE, at, message);
    diagnostic.did_you_mean(near.map(|near| format!("\"{near}\"").into()))
}
