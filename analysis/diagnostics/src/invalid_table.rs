//! # invalid-table
//!
//! A timing table has an error: it is not TOML, a section or a key is unknown, a value is not a time, a time is shorter at a
//! stricter level, or two entries give the same time. Nothing is analysed until the error is corrected: it may hide other
//! entries, and a bound without them would be too low.
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
use mauve_wcrt::TableFault;

pub(super) fn report<'db>(db: &'db dyn ModelDb, at: Location<'db>, fault: &TableFault) -> Diagnostic<'db> {
    let message = match fault {
        TableFault::NoProgramKey(_) => "the key of a program is `Component/update`, `Component/state.run`, \
                                        `Component/state.transition.guard`, `Component/state.transition.effect` \
                                        or `Component/operation`"
            .to_owned(),
        fault => table_reasons::table_fault(db, fault),
    };
    let correction = match fault {
        TableFault::Invalid(kind) => table_error::correction(kind),
        _ => None,
    };
    let found = Diagnostic::new(&INVALID_TABLE, at.clone(), message);
    match correction {
        Some(text) => found.fix(format!("Change to `{text}`"), at, text),
        None => found,
    }
}

pub(super) fn repeated<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    key: &str,
    first: &Location<'db>,
) -> Diagnostic<'db> {
    let message = table_reasons::repeated(db, key, first.file(db));
    Diagnostic::new(&INVALID_TABLE, at, message).related(first, "the first is here")
}
