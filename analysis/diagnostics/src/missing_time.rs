//! # missing-time
//!
//! A real-time activity executes a codel that has no time in any timing table. Neither the activity nor the activities that it
//! may preempt are analysed: a bound without this time would be too low.
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
//! A table has times at its own levels only: the analysis takes none from another level.
//!
//! The message contains the longest time with which all deadlines are met. Write the time of the codel into a table
//! (`"library.codel" = 3`), or a time for all codels without one under `[assume]` in `mauve.toml`.

use mauve_timing::Level;

use super::*;
use mauve_wcrt::{Budget, MissingTime, TableLevels, TableSet};

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    missing: &MissingTime<'db>,
    budget: Option<&Budget<'db>>,
) -> Diagnostic<'db> {
    let users = &missing.users;
    // Several deployments may have an activity of one instance.
    let mut names: Vec<String> = Vec::new();
    for name in users.iter().map(|(name, _)| format!("`{name}`")) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let may = match budget {
        Some(Budget { time: Some(time), alone: true, .. }) => format!("; all deadlines are met up to {time}"),
        Some(Budget { time: Some(time), .. }) => {
            format!("; all deadlines are met up to {time} if the other codels without a time take 0 ms")
        }
        Some(Budget { time: None, .. }) => "; a deadline is missed with any time".to_owned(),
        None => String::new(),
    };
    let verb = if names.len() == 1 { "is" } else { "are" };
    let codel = missing.codel.qualified(db);
    let of_which = of_tables(db, missing.tables);
    let message = format!("no time for codel `{codel}`{of_which}: {} {verb} not analysed{may}", enumerated(&names));
    let diagnostic = Diagnostic::new(&MISSING_TIME, at, message);
    users.iter().fold(diagnostic, |it, (name, at)| it.related(at, format!("`{name}` executes it")))
}

/// Reports that a table lacks the requested level: one warning per table.
pub(super) fn no_level<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    level: Level,
    table: &TableLevels,
) -> Diagnostic<'db> {
    let message = format!(
        "no times at {level}: {}; set `[timing] significance` to one of them",
        table_reasons::table_levels(db, table)
    );
    Diagnostic::new(&MISSING_TIME, at, message)
}

/// One warning for deployments without timing tables, at the first of them, instead of one for each codel.
pub(super) fn no_table<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    tables: TableSet<'db>,
    codels: usize,
    others: &[Decl<'db>],
) -> Diagnostic<'db> {
    let section = tables.header(db);
    let message = format!(
        "no execution times{}: {} no time, and nothing is analysed; write the times into timing \
         tables that mauve.toml names (`{section} tables = [\"timing/*.toml\"]`), or one for all under `[assume]` (`codel = \"5 ms\"`)",
        of_tables(db, tables),
        if codels == 1 { "1 codel has".to_owned() } else { format!("{codels} codels have") }
    );
    let found = Diagnostic::new(&MISSING_TIME, at, message);
    let others = others.iter().map(|it| (Location::name_of(*it), it.name(db)));
    others.fold(found, |found, (at, name)| found.related(&at, format!("deployment {name} is not analysed either")))
}

/// Returns ` in the tables of Sea`; nothing for those of `[timing] tables`.
fn of_tables<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> String {
    tables.label(db).map_or_else(String::new, |name| format!(" in the tables of {name}"))
}
