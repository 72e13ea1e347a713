//! The overhead of a job that a recording shows, as a line for a timing table that was tried.
//!
//! ```text
//!   overhead: a period took 0.0125 ms besides its codels and ports in `pilot`, 0.004 ms in `camera`; the tables have 0 ms
//!     for `times.toml`: [overhead] dispatch = 0.0125
//!     with it, 8 of 9 deadlines are proved (9 now)
//! ```

use std::fmt::Write as _;

use mauve_hir::{Database, File, Workspace};
use mauve_timing::{Level, Overhead, Time, with_dispatch};
use mauve_wcrt::{Deadlines, Query, files_of, response_times, table, tables_of_host, timetable_of};

use super::checked::Checked;
use crate::errors::{host_called, only_deployment};

/// So many instances are named.
const MOST_SHOWN: usize = 4;

/// The greatest overheads of instances, in nanoseconds, the greatest first.
pub(super) struct Overheads(Vec<(u64, String)>);

impl Overheads {
    /// Those of a recording whose times were measured.
    pub(super) fn of(checked: &Checked<'_>) -> Overheads {
        let instances = checked.expected.instances.iter().zip(&checked.observed.instances);
        let instances = instances.filter(|_| !checked.summary.is_from_tables);
        let overhead = instances.filter_map(|(of, seen)| {
            Some((seen.overhead?.div_ceil(1000).saturating_mul(1000), of.instance.clone()))
        });
        let mut found: Vec<(u64, String)> = overhead.collect();
        found.sort_by(|a, b| b.cmp(a));
        Overheads(found)
    }

    /// Returns the lines about them; none where the tables have as much. Changes the text of a table in `db`, to analyse it.
    pub(super) fn advice(
        &self,
        db: &mut Database,
        workspaces: &[Workspace],
        (deployment, host): (Option<&str>, Option<&str>),
        level: Level,
    ) -> Option<String> {
        let greatest = self.0.first()?.0;
        let now = OverheadTables::of(db, workspaces, (deployment, host), level)?;
        if now.declared.as_nanos() >= greatest {
            return None;
        }
        let one = |(time, name): &(u64, String)| format!("{} in `{name}`", Time::from_nanos(*time));
        let shown: Vec<String> = self.0.iter().take(MOST_SHOWN).map(one).collect();
        let mut out = format!(
            "  overhead: a period took at most {} besides its codels and ports; the tables have {}\n",
            shown.join(", "),
            now.declared
        );
        let file = now.file?;
        let name = file.path(db).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let dispatch = Time::from_nanos(greatest.saturating_sub(now.switches.as_nanos()));
        let (text, line) = with_dispatch(file.text(db), dispatch)?;
        let _ = writeln!(out, "    for `{name}`: [overhead] {line}");
        file.set_text(db, text.into());
        let then = OverheadTables::of(db, workspaces, (deployment, host), level)?.deadlines;
        let Deadlines { met, all, .. } = then;
        let _ = writeln!(out, "    with it, {met} of {all} deadlines are proved ({} now)", now.deadlines.met);
        Some(out)
    }
}

/// What the tables of a deployment say, and which deadlines are proved with them.
struct OverheadTables {
    /// The overhead of a job, and the part of it for context switches.
    declared: Time,
    switches: Time,
    /// The table that has the overhead, or may get it.
    file: Option<File>,
    deadlines: Deadlines,
}

impl OverheadTables {
    fn of(
        db: &Database,
        workspaces: &[Workspace],
        (deployment, host): (Option<&str>, Option<&str>),
        level: Level,
    ) -> Option<OverheadTables> {
        let (project, deployment) = only_deployment(db, workspaces, deployment, "analyse").ok()?;
        let host = host_called(db, (project, deployment), host).ok()?;
        let tables = tables_of_host(db, project, deployment, host);
        let files = files_of(db, tables);
        let has_one = |file: &&File| table(db, **file).overhead != Overhead::default();
        let file = files.iter().find(has_one).or(files.first()).copied();
        let switches = file.and_then(|file| {
            let table = table(db, file);
            table.time(&table.overhead.context_switch, level)?.checked_mul(2)
        });
        let query = Query::at_level(db, project, deployment, Some(level));
        Some(OverheadTables {
            declared: timetable_of(db, tables).overhead(level)?,
            switches: switches.unwrap_or_default(),
            file,
            deadlines: response_times(db, project, deployment, query).deadlines(),
        })
    }
}
