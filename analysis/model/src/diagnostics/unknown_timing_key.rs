//! # unknown-timing-key
//!
//! A timing table has a time for something that no model of the workspace declares, or that several do. Keys are
//! `library.codel` or `codel`; `Component/update`, `Component/state.run`, `Component/state.transition.guard`,
//! `Component/state.transition.effect`, `Component/operation`; `Component`.
//!
//! ```mauve
//! codel plan(): int
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! plan = 1
//! plna = 2   # warning
//! ```
//!
//! A component that a misspelt program or component may be meant for is not analysed: the entry could make it longer.

use super::*;

code!(UNKNOWN_TIMING_KEY, Warning, "unknown-timing-key");

pub(crate) fn report<'db>(at: Place<'db>, what: &str, key: &str, near: Option<Name>) -> Diagnostic<'db> {
    let mean = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    Diagnostic::new(&UNKNOWN_TIMING_KEY, at, format!("no {what} `{key}`{mean}"))
}

pub(crate) fn ambiguous<'db>(at: Place<'db>, key: &str, hint: &str) -> Diagnostic<'db> {
    let message = format!("`{key}` means several: write the library before it, as in `{hint}`");
    Diagnostic::new(&UNKNOWN_TIMING_KEY, at, message)
}
