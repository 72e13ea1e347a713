//! # missing-time
//!
//! A codel that a real-time activity executes has no time in any timing table. Neither the activity nor what it may
//! delay is analysed: a bound that leaves it out would be too low.
//!
//! ```mauve
//! codel plan(): int   // warning
//! codel land(): int
//! shell S { }
//! core C(S) { update = { plan(); } }
//! component Pilot(S, C)
//! architecture A { instance pilot: Pilot }
//! deployment D { architecture A  activity pilot { priority = 1 period = 100 } }
//! //- /mauve.toml
//! [timing]
//! tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! land = 3
//! ```
//!
//! A table has times at its levels only: none is ever taken from another level.
//!
//! The message says what the codel may take: the greatest time with which every deadline still holds. Write its time
//! into a table (`"library.codel" = 3`), or a time for all that lack one under `[assume]` in `mauve.toml`.

use mauve_timing::Level;

use super::*;
use mauve_wcrt::{Budget, MissingTime, TableLevels};

code!(MISSING_TIME, Warning, "missing-time");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    missing: &MissingTime<'db>,
    budget: Option<&Budget<'db>>,
) -> Diagnostic<'db> {
    let users = &missing.users;
    let names: Vec<&str> = users.iter().map(|(name, _)| name.as_str()).collect();
    let may = match budget {
        Some(Budget { time: Some(time), alone: true, .. }) => format!(" — it may take up to {time}"),
        Some(Budget { time: Some(time), .. }) => {
            format!(" — it may take up to {time} if the others without a time take nothing")
        }
        Some(Budget { time: None, .. }) => " — a deadline is missed even if it takes nothing".to_owned(),
        None => String::new(),
    };
    let verb = if names.len() == 1 { "is" } else { "are" };
    let codel = missing.codel.qualified(db);
    let message = format!("no time for codel `{codel}`: {} {verb} not analysed{may}", enumerated(&names));
    let diagnostic = Diagnostic::new(&MISSING_TIME, at, message);
    users.iter().fold(diagnostic, |it, (name, at)| it.related(at, format!("{name} executes it")))
}

/// Reports that a table lacks the requested level: one warning per table.
pub(super) fn no_level<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    level: Level,
    table: &TableLevels,
) -> Diagnostic<'db> {
    let message = format!("no times at {level}: {}", timing_reasons::table_levels(db, table));
    Diagnostic::new(&MISSING_TIME, at, message)
}

/// One warning for a deployment without timing tables, instead of one for each codel.
pub(super) fn no_table<'db>(at: Location<'db>, codels: usize) -> Diagnostic<'db> {
    let message = format!(
        "no execution times: {} lacks one, so nothing is analysed. Name timing tables in mauve.toml \
         (`[timing] tables = [\"timing/*.toml\"]`)",
        if codels == 1 { "a codel".to_owned() } else { format!("each of {codels} codels") }
    );
    Diagnostic::new(&MISSING_TIME, at, message)
}
