//! # too-large
//!
//! A project that becomes too large with this declaration: each shell has the features of all shells that it extends, each
//! architecture what it imports, each deployment an activity for each instance. More than half a million of them together
//! are not analysed, nor is anything else in the project.
//!
//! Divide the project: `[project] roots` in `mauve.toml` names several, and each is analysed by itself.

use super::*;

code!(TOO_LARGE, Error, "too-large");

pub(super) fn report<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Diagnostic<'db> {
    let message = format!(
        "with {} {}, and what it takes from others, this project is too large to be analysed: divide it",
        of.kind(db),
        of.name(db)
    );
    Diagnostic::new(&TOO_LARGE, Location::name_of(of), message)
}
