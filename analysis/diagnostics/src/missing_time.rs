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
//! The message contains the longest time with which all deadlines are met, or no further one is missed where some are missed without it. Write the time of the codel into a table
//! (`"library.codel" = 3`), or a time for all codels without one under `[assume]` in `mauve.toml`.
//!
//! Fix: add an entry that is marked as assumed, with the longest time, or with 1 ms where there is none. Its deadlines hold if a
//! measurement is not longer: `mauve pwcet` replaces the entry.

use mauve_timing::{Level, assumed_entry};

use super::*;
use mauve_wcrt::{Budget, MissingTime, TableLevels, TableSet, file_name, files_of, table};

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    missing: &MissingTime<'db>,
    budget: Option<&Budget<'db>>,
) -> Diagnostic<'db> {
    let users = &missing.users;
    // Several deployments may have an activity of one instance.
    let names = each_once(users.iter().map(|(name, _)| format!("`{name}`")));
    let may = match budget {
        Some(Budget { time: Some(time), alone, further, .. }) => {
            let met = if *further { "no further deadline is missed" } else { "all deadlines are met" };
            let condition = if *alone { "" } else { " if the other codels without a time take 0 ms" };
            format!("; {met} up to {time}{condition}")
        }
        Some(Budget { time: None, .. }) => format!("; {} late with any time", if names.len() == 1 { "it is" } else { "one is" }),
        None => String::new(),
    };
    let verb = if names.len() == 1 { "is" } else { "are" };
    let codel = missing.codel.qualified(db);
    let of_which = of_tables(db, missing.tables);
    let message = format!("no time for codel `{codel}`{of_which}: {} {verb} not analysed{may}", enumerated(&names));
    let mut diagnostic = Diagnostic::new(&MISSING_TIME, at, message);
    diagnostic.fixes.extend(entry(db, missing, budget.and_then(|it| it.time)));
    users.iter().fold(diagnostic, |it, (name, at)| it.related(at, format!("`{name}` executes it")))
}

/// Returns the fix that adds an assumed time to a table, the longest one that meets all deadlines.
fn entry<'db>(db: &'db dyn ModelDb, missing: &MissingTime<'db>, most: Option<Time>) -> Option<Fix<'db>> {
    let most = most.map(rounded_down).filter(|most| *most > Time::ZERO);
    let limit = most.map(|most| format!("at most {most}"));
    let note = limit.as_ref().map_or("measure it".to_owned(), |limit| format!("{limit}, measure it"));
    let limit = limit.map_or_else(String::new, |limit| format!(" ({limit})"));
    let key = missing.codel.qualified(db);
    // The table with the most codels of its library.
    let files = files_of(db, missing.tables).iter().filter(|file| !file.is_outside(db) && file.problem(db).is_none());
    let library = missing.codel.library(db).as_ref().map(|library| format!("{library}."));
    let of_library = |file: &&File| {
        let codels = table(db, **file).codels.iter();
        codels.filter(|it| library.as_ref().is_some_and(|library| it.key.starts_with(library.as_str()))).count()
    };
    let file = *files.rev().max_by_key(of_library)?;
    let time = most.unwrap_or(Time::from_nanos(1_000_000));
    let (at, line) = assumed_entry(file.text(db), &key, time, &note)?;
    let title = shortened(&format!("Add `{key}` to {}{limit}", file_name(db, file)), MOST_CHARACTERS);
    Some(Fix { title, edits: vec![(Location::of_span(file, &(at..at)), line)] })
}

/// Returns a time with three digits, which is not longer.
fn rounded_down(time: Time) -> Time {
    let nanos = time.as_nanos();
    let step = 10u64.pow(nanos.checked_ilog10().unwrap_or_default().saturating_sub(2));
    Time::from_nanos(nanos / step * step)
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
