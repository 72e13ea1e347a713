//! # invalid-table
//!
//! A timing table has an error: it is not TOML, a section or a key is unknown, a value is no time, a shorter time stands at
//! a stricter level, something has two times. Such a table is incomplete, and nothing is analysed until it is mended: the
//! error may hide other entries, and a bound without them would be too low.
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
