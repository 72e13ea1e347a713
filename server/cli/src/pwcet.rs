//! `mauve pwcet SAMPLES…`: from measured executions to the times of a timing table.

mod budgets;
mod document;
mod estimates;
mod next;
mod report;
mod table;
mod waits;
mod write;

use std::path::{Path, PathBuf};

use mauve_hir::CONFIG_FILE;
use mauve_projects::disk;
use mauve_projects::load::Outside;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::put;
use mauve_pwcet::samples::Samples;
use mauve_pwcet::trace::SpanKind;
use mauve_pwcet::{EstimateOptions, Measurement, measure, rounded_up};
use mauve_timing::{Level, MOST_LEVELS, Table, Time, unit_in};

use self::budgets::{Budgets, budgets};
use self::estimates::{Estimates, MeasuredEntry};
use super::measure::alone_and_in_robot;
use super::own_output::check_own;
use super::sample_file::unreadable_samples;
use super::trace::{recording_warnings, shown_key};
use crate::errors::say_errors;
use crate::options::TableFormat;
use crate::text::counted;

#[derive(Debug, clap::Args)]
pub struct Pwcet {
    /// Sample files of `mauve trace import`.
    #[arg(value_name = "SAMPLES", required = true, value_hint = clap::ValueHint::FilePath)]
    samples: Vec<PathBuf>,
    /// The timing table that gets the times. Comments, order and entries that were written or edited by hand stay.
    #[arg(short, long, value_name = "TABLE", value_hint = clap::ValueHint::FilePath)]
    output: Option<PathBuf>,
    /// The levels, such as 1e-4,1e-7. By default those of the table; a new table has those of 1e-3 to 1e-9 at which all codels have a
    /// time that have one at the level of the project.
    #[arg(long, value_name = "LEVEL,…", value_delimiter = ',')]
    levels: Vec<f64>,
    /// Write a report with plots, tests and fits: one HTML file for a browser.
    #[arg(long, value_name = "FILE.html", value_hint = clap::ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Estimate programs, too. In a table, the time of a program is used instead of the times of its codels.
    #[arg(long)]
    programs: bool,
    /// Overwrite entries that were written or edited by hand.
    #[arg(long, requires = "output")]
    replace: bool,
    /// The project whose deadlines give each codel a budget, and whose sources are recorded; by default that of TABLE.
    #[arg(long, value_name = "PATH", value_hint = clap::ValueHint::AnyPath)]
    project: Option<PathBuf>,
    #[command(flatten)]
    outside: Outside,
    /// Determines the random numbers: the same seed gives the same times.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How to show the times.
    #[arg(long, value_enum, default_value = "table")]
    format: TableFormat,
}

impl Pwcet {
    fn options(&self, levels: &[Level]) -> EstimateOptions {
        EstimateOptions { levels: levels.iter().map(|level| level.as_f64()).collect(), seed: self.seed }
    }

    pub(crate) fn run(self) -> Result<Output, String> {
        self.check_report()?;
        let of_table = self.levels_of_table();
        let levels = self.levels(of_table.as_ref())?;
        let options = self.options(&levels);
        let open = |path: &PathBuf| Samples::open(path).map_err(|error| unreadable_samples(path, &error));
        let mut files = self.samples.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let wanted = |key: &str| match SpanKind::of(key) {
            SpanKind::Codel | SpanKind::Access => true,
            SpanKind::Program => self.programs,
            SpanKind::Lock | SpanKind::Period => false,
        };
        let measurements = measure(&mut files, wanted, &options)
            .map_err(|(index, error)| unreadable_samples(&self.samples[index], &error))?;
        if measurements.is_empty() {
            let first = self.samples[0].display();
            return Err(format!("`{first}` has no executions of codels: record a trace and import it first"));
        }
        let recording = self.recording(&files);
        measurements.iter().filter_map(|it| alone_and_in_robot(&it.key, &files)).for_each(|line| say(&line));
        let budgets = self.budgets()?;
        let budget_level = budgets.as_ref().and_then(|it| levels.iter().position(|level| *level == it.level));
        if let Some(level) = budgets.as_ref().map(|it| it.level).filter(|_| budget_level.is_none()) {
            say(&format!(
                "the project is analysed at {level}, which is not one of the levels: add it to --levels, or change `significance` in \
                 mauve.toml"
            ));
        }
        let measured = |measurement: Measurement| {
            let time = |nanoseconds: f64| Time::from_nanos(rounded_up(nanoseconds));
            let mut times: Vec<Option<Time>> =
                measurement.times().into_iter().map(|it| it.map(time)).collect();
            times.resize(levels.len(), None);
            let budget = budgets.as_ref().and_then(|it| it.greatest.get(&measurement.key).copied());
            let compared = budget_level.and_then(|level| times.get(level).copied().flatten());
            let is_over_budget = compared.zip(budget).is_some_and(|(time, budget)| time > budget);
            MeasuredEntry { name: shown_key(&measurement.key), measurement, times, budget, is_over_budget }
        };
        let measurements: Vec<MeasuredEntry> = measurements.into_iter().map(measured).collect();
        let shown = self.shown(&levels, budget_level);
        let needed = match (&self.output, of_table.is_some() || !self.levels.is_empty()) {
            (None, _) => shown.clone(),
            (Some(_), true) => (0..levels.len()).collect(),
            (Some(_), false) => supported(levels.len(), &shown, &measurements),
        };
        let mut estimates =
            Estimates { options, levels, needed, shown, measurements, budgets, budget_level, recording };
        estimates.sort();
        let mut code = u8::from(estimates.are_incomplete());
        if let Some(path) = &self.output {
            let written = write::write(path, &self.samples, &files, &estimates, self.replace)?;
            written.messages.iter().for_each(|message| say(message));
            code |= u8::from(written.is_exceeded || self.has_open(&estimates));
        }
        let table = self.output.as_ref().and_then(|path| disk::read(path, disk::LONGEST).ok());
        let text = String::from_utf8(table.unwrap_or_default()).unwrap_or_default();
        waits::messages(&self.samples, &Table::parse(&text), unit_in(&text))
            .iter()
            .for_each(|message| say(message));
        if let Some(path) = &self.report {
            let fingerprints: Vec<String> = files.iter().map(Samples::fingerprint).collect();
            put(path, &report::report(&estimates, &self.samples, &fingerprints))?;
            say(&format!("`{}` has the report", path.display()));
        }
        match self.format {
            TableFormat::Table => {
                let next = next::next(&estimates, &self.samples, &mut files);
                Ok(Output::escaped(table::table(&estimates, &next), code))
            }
            TableFormat::Json => Ok(Output::verbatim(document::document(&estimates)?, code)),
        }
    }

    /// Returns what the recordings lack, and says which files have a part that is not used.
    fn recording(&self, files: &[Samples]) -> Vec<String> {
        let mut recording = Vec::new();
        for (path, file) in self.samples.iter().zip(files) {
            recording.extend(recording_warnings(&path.display().to_string(), &file.summary()));
            if file.incomplete_bytes() > 0 {
                say(&format!(
                    "`{}` ends with {} of an import that did not end, or that is damaged: they are not used; import that trace again",
                    path.display(),
                    counted(usize::try_from(file.incomplete_bytes()).unwrap_or(usize::MAX), "byte")
                ));
            }
        }
        recording
    }

    /// Returns the indices of the levels that a terminal shows: those of the option, otherwise that of the project.
    fn shown(&self, levels: &[Level], of_project: Option<usize>) -> Vec<usize> {
        let usual = || levels.iter().position(|level| *level == Level::TEN_TO_MINUS_FOUR);
        match of_project.or_else(usual).filter(|_| self.levels.is_empty()) {
            Some(level) => vec![level],
            None => (0..levels.len()).collect(),
        }
    }

    fn levels_of_table(&self) -> Option<Vec<Level>> {
        let text = disk::read(self.output.as_ref()?, disk::LONGEST).ok()?;
        Some(Table::parse(str::from_utf8(&text).ok()?).levels).filter(|levels| !levels.is_empty())
    }

    /// The levels of the option, of the table, or the default.
    fn levels(&self, of_table: Option<&Vec<Level>>) -> Result<Vec<Level>, String> {
        if self.levels.is_empty() {
            let default =
                || (3..=9).filter_map(|exponent| Level::from_f64(format!("1e-{exponent}").parse().ok()?));
            return Ok(of_table.cloned().unwrap_or_else(|| default().collect()));
        }
        let level = |&level: &f64| {
            Level::from_f64(level)
                .ok_or_else(|| format!("the level {level} is not a number between 0 and 1, such as 1e-4"))
        };
        let mut levels = self.levels.iter().map(level).collect::<Result<Vec<_>, _>>()?;
        levels.sort_by(|a, b| b.cmp(a));
        levels.dedup();
        // In the order of the table, if they are those of the table.
        if let Some(of_table) = of_table {
            let mut sorted = of_table.clone();
            sorted.sort_by(|a, b| b.cmp(a));
            if sorted == levels {
                return Ok(of_table.clone());
            }
        }
        match levels.len() {
            0..=MOST_LEVELS => Ok(levels),
            count => Err(format!("{count} levels: a table has at most {MOST_LEVELS}")),
        }
    }

    /// Returns whether a deadline of the project is not proved with the table as it now is, and says which: budgets are for one codel
    /// each, while the others keep their times.
    fn has_open(&self, estimates: &Estimates) -> bool {
        let Some(project) = estimates.budgets.as_ref() else { return false };
        if project.sources.is_empty() {
            say(
                "no C++ file of a codel was found: changes of them will not be noticed; `[generate] out` in mauve.toml is the folder to search",
            );
        }
        let found = budgets::not_proved(&project.project, self.outside.allow_outside);
        let (open, errors) = found.unwrap_or_default();
        say_errors(errors);
        if let [first, ..] = open.as_slice() {
            let others = match open.len() - 1 {
                0 => String::new(),
                others => format!(" and {others} more"),
            };
            say(&format!(
                "with the times of the tables, the deadline of `{first}`{others} is not proved: `mauve wcrt` shows it"
            ));
        }
        !open.is_empty() || errors > 0
    }

    /// A report overwrites reports only.
    fn check_report(&self) -> Result<(), String> {
        let Some(path) = &self.report else { return Ok(()) };
        check_own(path, "<!doctype", "report", "--report")?;
        let absolute = |path: &Path| std::path::absolute(path).ok();
        match self.output.as_ref().is_some_and(|table| absolute(table) == absolute(path)) {
            true => Err("the report and the table have one path: choose another one for --report".to_owned()),
            false => Ok(()),
        }
    }

    /// The budgets of the project that was named, or whose table is written; the latter may have nothing to analyse.
    fn budgets(&self) -> Result<Option<Budgets>, String> {
        let read = |path: &Path| budgets(path, self.outside.allow_outside);
        if let Some(path) = &self.project {
            return read(path).map(Some);
        }
        let table = self.output.as_ref().and_then(|path| std::path::absolute(path).ok());
        let folders = table.iter().flat_map(|path| path.ancestors().skip(1));
        let Some(folder) = folders.into_iter().find(|it| it.join(CONFIG_FILE).is_file()) else {
            return Ok(None);
        };
        let found =
            read(folder).map_err(|error| say(&format!("the times are compared with no budgets: {error}")));
        Ok(found.ok())
    }
}

/// Returns the indices of the levels of a new table: those at which each codel has a time that has one at the levels that are shown.
/// Short accesses need none.
fn supported(levels: usize, shown: &[usize], all: &[MeasuredEntry]) -> Vec<usize> {
    let has_shown =
        |it: &&MeasuredEntry| !it.is_short_access() && shown.iter().all(|&level| it.time(level).is_some());
    let all: Vec<&MeasuredEntry> = all.iter().filter(has_shown).collect();
    let is_supported = |level: usize| !all.is_empty() && all.iter().all(|it| it.time(level).is_some());
    (0..levels).filter(|level| shown.contains(level) || is_supported(*level)).collect()
}
