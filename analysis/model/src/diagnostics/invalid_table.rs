//! # invalid-table
//!
//! A timing table is not TOML, or has something in it that means nothing. A table that is no TOML, or has an unknown
//! section, contributes nothing, and nothing is analysed: one missing bracket could swallow an override and lower a
//! bound. So do errors in `unit`, `levels` and `[overhead]`, which every time rests on, a second `[overhead]`, and a key of
//! a program that names no component. An entry with an error costs that entry: so does one with a shorter time at a
//! stricter level, of which one must be wrong; where all are so, the levels are, and that costs the table.
//!
//! ```mauve
//! codel plan(): int
//! codel land(): int
//! codel hover(): int
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! levels = [1e-3, 1e-4]
//! [codel]
//! plan = [1, 2, 3]   # error
//! land = [3, 2]   # error
//! hover = [3, 4]
//! ```

use super::*;

code!(INVALID_TABLE, Error, "invalid-table");

pub(crate) fn report<'db>(at: Place<'db>, message: String) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_TABLE, at, message)
}

pub(crate) fn repeated<'db>(at: Place<'db>, key: &str, first: (Place<'db>, String)) -> Diagnostic<'db> {
    let message = format!("`{key}` has a time in {} already: keep one", first.1);
    Diagnostic::new(&INVALID_TABLE, at, message).related(first.0, "the first is here")
}
