//! The table of the executions that were imported.

use std::collections::BTreeMap;
use std::path::Path;

use mauve_pwcet::samples::Run;
use mauve_pwcet::trace::{SpanKind, Totals, lock_of, port_of};

use crate::text::{Sheet, counted, duration, wrapped};

/// The executions of one codel or program in one instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ImportedSeries {
    /// Its key and its instance.
    pub(super) name: (String, String),
    count: u64,
    /// Of 2⁶⁴ executions of 2⁶³ ns.
    sum: u128,
    least: u64,
    greatest: u64,
}

impl ImportedSeries {
    pub(super) fn new(name: (String, String)) -> ImportedSeries {
        ImportedSeries { name, count: 0, sum: 0, least: u64::MAX, greatest: 0 }
    }

    pub(super) fn add(&mut self, execution: u64) {
        self.count += 1;
        self.sum += u128::from(execution);
        self.least = self.least.min(execution);
        self.greatest = self.greatest.max(execution);
    }

    fn mean(&self) -> u64 {
        u64::try_from(self.sum / u128::from(self.count.max(1))).unwrap_or(u64::MAX)
    }
}

/// What a command has imported.
#[derive(Debug, Default)]
pub(super) struct Imported {
    /// The number of runs.
    pub(super) runs: usize,
    series: BTreeMap<(String, String), ImportedSeries>,
    cut: u64,
}

impl Imported {
    /// Adds a run.
    pub(super) fn add(&mut self, series: &[ImportedSeries], summary: &Totals) {
        self.runs += 1;
        // What was open when the recording began or ended.
        self.cut += summary.cut_at_start + summary.cut_at_end;
        for it in series {
            let all =
                self.series.entry(it.name.clone()).or_insert_with(|| ImportedSeries::new(it.name.clone()));
            all.count += it.count;
            all.sum += it.sum;
            all.least = all.least.min(it.least);
            all.greatest = all.greatest.max(it.greatest);
        }
    }

    /// Returns the executions in a table, and how many the file has. Lists programs only if they are wanted: there are many.
    pub(super) fn table(&self, output: &Path, runs: &[Run], with_programs: bool) -> String {
        let (programs, codels): (Vec<&ImportedSeries>, Vec<&ImportedSeries>) =
            self.series.values().partition(|it| SpanKind::of(&it.name.0) == SpanKind::Program);
        let listed = codels.iter().chain(programs.iter().filter(|_| with_programs));
        let listed: Vec<&&ImportedSeries> = listed.collect();
        let kinds = if with_programs { "codel, port or program" } else { "codel or port" };
        let sheet = Sheet::of(&listed)
            .column(kinds, |it| shown_key(&it.name.0))
            .column("instance", |it| if it.name.1.is_empty() { "—".to_owned() } else { it.name.1.clone() })
            .column("executions", |it| it.count.to_string())
            .column("least", |it| duration(it.least))
            .column("mean", |it| duration(it.mean()))
            .column("greatest", |it| duration(it.greatest));
        let count: u64 = self.series.values().map(|it| it.count).sum();
        let all: u64 = runs.iter().map(|run| run.executions).sum();
        let mut out = if listed.is_empty() { String::new() } else { sheet.text() };
        if !with_programs && !programs.is_empty() {
            let of_programs = programs.iter().map(|it| it.count).sum();
            let series = counted(programs.len(), "program");
            out += &format!("and {} of {series}: --programs lists them\n", executions(of_programs));
        }
        out += &format!(
            "imported {} in {}; {} has {} in {}\n",
            executions(count),
            counted(self.runs, "run"),
            output.display(),
            executions(all),
            counted(runs.len(), "run"),
        );
        if self.cut > 0 {
            out +=
                &format!("not imported: {} at the start or the end of a recording\n", incomplete(self.cut));
        }
        wrapped(&out)
    }
}

/// Returns what was executed, as a table names it.
pub(crate) fn shown_key(key: &str) -> String {
    match (port_of(key), lock_of(key)) {
        (Some(port), _) => format!("port {port}"),
        (_, Some((lock, codel))) => format!("{codel} in lock {lock}"),
        _ => key.to_owned(),
    }
}

/// Returns a number of executions.
pub(in crate::trace) fn executions(count: u64) -> String {
    match count {
        1 => "1 execution".to_owned(),
        _ => format!("{count} executions"),
    }
}

/// Returns a number of executions that are not imported.
pub(super) fn incomplete(count: u64) -> String {
    executions(count).replacen(' ', " incomplete ", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_four_digits() {
        for (nanoseconds, text) in [
            (0, "0 ns"),
            (999, "999 ns"),
            (1_000, "1.000 µs"),
            (12_345, "12.35 µs"),
            (999_960, "1000 µs"),
            (1_234_500, "1.234 ms"),
            (123_456_789, "123.5 ms"),
            (7_000_000_000, "7.000 s"),
            (123_456_000_000_000, "123456 s"),
        ] {
            assert_eq!(duration(nanoseconds), text);
        }
    }
}
