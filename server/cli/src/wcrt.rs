//! `mauve wcrt [PATH]`: the worst-case response times of deployments, of models or of the task sets in generated packages.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_diagnostics::{
    EXHAUSTED, each_once, enumerated, grouped, known_utilisation, origins, reasons_of, supported,
    task_set_error_message, times_of, timing_reason,
};
use mauve_hir::item_tree::Name;
use mauve_hir::{Database, Decl, Hosts, Location, ModelDb, Project};
use mauve_ide::{Figures, blocking_priorities, counted_cpus, explain_response, explain_response_of, what_if};
use mauve_projects::analysis_document::{Analysed, Deployed, Significance, analysis_document, levels};
use mauve_projects::disk::{LONGEST, read};
use mauve_projects::harmless::harmless;
use mauve_projects::json;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::put;
use mauve_timing::task_set::{Notation, TaskSet, TaskSetError};
use mauve_timing::{CpuSet, Level, Status, Time, name_of_other};
use mauve_wcrt::{
    ActivityReport, Footing, Priority, Query, Refusal, Report, ResolvedActivity, all_tables_of,
    response_times_of, sensitivity, system_of, timetable_of,
};

use super::probability::{probability_csv, probability_svg, probability_table};
use super::sensitivity::{sensitivity_csv, sensitivity_tables};
use crate::comparison::{comparison_document, comparison_table};
use crate::errors::say_errors;
use crate::lines::Lines;
use crate::options::{MethodName, Models};
use crate::text::{Sheet, counted, csv_number, number, shown, wrapped};
use crate::verify::certificate;

#[derive(Debug, clap::Args)]
pub struct Wcrt {
    #[command(flatten)]
    models: Models,
    /// Significance levels, separated by commas, or `all`; by default that of mauve.toml, else 1e-4.
    #[arg(long, value_name = "LEVELS")]
    significance: Option<Significance>,
    /// How the interference is bounded.
    #[arg(long, value_enum, default_value = "best")]
    method: MethodName,
    /// Show where the response time of this instance comes from; not with --format.
    #[arg(long, value_name = "INSTANCE", conflicts_with = "format")]
    explain: Option<String>,
    /// Show how far the time of each codel may grow, and each period shrink, while every deadline is met; not for task
    /// sets in files.
    #[arg(long, conflicts_with = "explain")]
    sensitivity: bool,
    /// Show how probable it is that an activity is late, from the times at all levels of the tables: of all activities, or with
    /// `=INSTANCE` of one; not for task sets in files.
    #[arg(long, value_name = "INSTANCE", num_args = 0..=1, require_equals = true, default_missing_value = "", conflicts_with_all = ["explain", "sensitivity"])]
    probability: Option<String>,
    /// Also analyse with another value, and show what changes: INSTANCE.FIELD=VALUE, such as imu.period=5 or tracker.cpus=2, or
    /// CODEL=TIME, such as nav.plan=12ms. May be repeated; no file is written.
    #[arg(long, value_name = "NAME=VALUE", conflicts_with_all = ["explain", "sensitivity", "probability"])]
    set: Vec<String>,
    /// Write why the deadlines are met into this file, for `mauve verify`.
    #[arg(long, value_name = "FILE")]
    certificate: Option<PathBuf>,
    /// How to show the figures.
    #[arg(long, value_enum, default_value = "table")]
    format: WcrtFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WcrtFormat {
    /// For people.
    Table,
    /// One document.
    Json,
    /// A line for each activity and level.
    Csv,
    /// With --probability, a drawing for browsers: of INSTANCE, otherwise of the activity that is late with the greatest
    /// probability.
    Svg,
}

impl Wcrt {
    pub(crate) fn run(self) -> Result<Output, String> {
        let method = self.method.analysed();
        let query = |level| Query { level, method };
        let mut db = Database::default();
        if self.models.are_task_sets() {
            if self.sensitivity || self.probability.is_some() {
                let option = if self.sensitivity { "--sensitivity" } else { "--probability" };
                return Err(format!("{option} needs a model: task sets do not have the times of codels"));
            }
            if !self.set.is_empty() {
                return Err("--set needs a model: edit the task set instead".to_owned());
            }
            return self.task_sets(&db, &query);
        }
        let (db, found, errors) = self.models.deployments(&mut db, "analyse")?;
        if matches!(self.significance, Some(Significance::All)) {
            let tables =
                found.iter().flat_map(|&(project, deployment)| all_tables_of(db, project, deployment));
            let left_out: BTreeSet<&(Level, String)> =
                tables.flat_map(|it| &timetable_of(db, it).partial_levels).collect();
            for (level, without) in left_out.iter().rev() {
                say(&format!("{level} is left out: {without} does not have it"));
            }
        }
        if !self.set.is_empty() {
            return self.with_other_values(db, &found, &query);
        }
        let deployed = |(project, deployment)| {
            let queries = levels(db, project, deployment, self.significance.as_ref()).into_iter().map(query);
            let mut found = Deployed::of_model(db, project, deployment, queries);
            found.has_probabilities = self.probability.is_some();
            if self.sensitivity {
                let of = |(query, _): &(Query, _)| sensitivity(db, project, deployment, *query);
                found.sensitivities = found.reports.iter().map(of).collect();
            }
            found
        };
        let all: Vec<Deployed<'_>> = found.into_iter().map(deployed).collect();
        let text = self.text(&all)?;
        self.write_certificate(&all)?;
        say_errors(errors);
        let proved = all.iter().all(Deployed::schedulable);
        Ok(Output::verbatim(text, u8::from(!proved || errors > 0)))
    }

    /// The figures beside those with the values of `--set`.
    fn with_other_values<'db>(
        &self,
        db: &'db Database,
        found: &[(Project<'db>, Decl<'db>)],
        query: &dyn Fn(Level) -> Query,
    ) -> Result<Output, String> {
        let (mut all, mut refused) = (Vec::new(), None);
        for &(project, deployment) in found {
            for level in levels(db, project, deployment, self.significance.as_ref()) {
                match what_if(db, (project, deployment, query(level)), &self.set) {
                    Ok(compared) => all.push(compared),
                    Err(why) => refused = Some(why),
                }
            }
        }
        // Of several deployments, those that have the values are shown.
        if let Some(why) = refused.filter(|_| all.is_empty()) {
            return Err(format!("--set {why}"));
        }
        let text = match self.format {
            WcrtFormat::Table => harmless(&all.iter().map(comparison_table).collect::<Vec<_>>().join("\n")),
            WcrtFormat::Json => json::one_or_all(all.iter().map(comparison_document))?,
            WcrtFormat::Csv | WcrtFormat::Svg => {
                return Err("--set has the formats table and json".to_owned());
            }
        };
        let is_proved = all.iter().filter_map(|it| it.after.as_ref()).all(Figures::schedulable);
        Ok(Output::verbatim(text, u8::from(!is_proved)))
    }

    fn task_sets(&self, db: &Database, query: &dyn Fn(Level) -> Query) -> Result<Output, String> {
        let read = task_sets(&self.models.paths.paths, self.models.deployment.as_deref())?;
        let mut reports = Vec::new();
        for (path, set) in &read {
            let levels = levels_of_set(set, self.significance.as_ref());
            let report =
                |query| Ok((query, response_times_of(set, query).map_err(|why| refused(path, &why))?));
            reports.push(levels.into_iter().map(query).map(report).collect::<Result<Vec<_>, String>>()?);
        }
        let deployed = read.iter().zip(&reports).map(|((path, set), reports)| Deployed {
            db,
            name: set.name.as_deref().unwrap_or_default(),
            origin: Analysed::File { path, set },
            sensitivities: Vec::new(),
            errors: 0,
            has_probabilities: false,
            accepted: BTreeMap::new(),
            reports: reports.iter().map(|(query, report)| (*query, report)).collect(),
        });
        let all: Vec<Deployed<'_>> = deployed.collect();
        let text = self.text(&all)?;
        self.write_certificate(&all)?;
        Ok(Output::verbatim(text, u8::from(!all.iter().all(Deployed::schedulable))))
    }

    fn write_certificate(&self, all: &[Deployed<'_>]) -> Result<(), String> {
        self.certificate.as_ref().map_or(Ok(()), |path| put(path, &certificate(all)?))
    }

    fn text(&self, all: &[Deployed<'_>]) -> Result<String, String> {
        Ok(match (&self.explain, self.format) {
            (Some(instance), _) => wrapped(&harmless(&explain(all, instance)?)),
            (None, WcrtFormat::Table) => {
                let tables = tables(all).into_iter().zip(all);
                let probabilities = |it| self.probability.as_ref().map(|only| probability_table(it, only));
                let tables = tables.map(|(table, it)| {
                    table + &sensitivity_tables(it) + &probabilities(it).unwrap_or_default()
                });
                shown_tables(&tables.collect::<Vec<_>>()).join("\n")
            }
            (None, WcrtFormat::Csv) if self.sensitivity => sensitivity_csv(all, &root),
            (None, WcrtFormat::Csv) if self.probability.is_some() => {
                probability_csv(all, self.probability.as_deref().unwrap_or_default(), &root)
            }
            (None, WcrtFormat::Svg) => match &self.probability {
                Some(only) => probability_svg(all, only)?,
                None => return Err("--format svg needs --probability".to_owned()),
            },
            (None, WcrtFormat::Csv) => figures_csv(all),
            (None, WcrtFormat::Json) => json::one_or_all(all.iter().map(analysis_document))?,
        })
    }
}

/// Returns the levels at which a task set is analysed.
fn levels_of_set(set: &TaskSet, asked: Option<&Significance>) -> Vec<Level> {
    match asked {
        Some(Significance::These(levels)) => levels.clone(),
        Some(Significance::All) if !set.levels.is_empty() => set.levels.clone(),
        Some(Significance::All) | None => vec![set.level()],
    }
}

/// Reads task sets, those called `only` if that is given, each with its path behind all links. One without a name has that of its
/// file.
pub(super) fn task_sets(paths: &[PathBuf], only: Option<&str>) -> Result<Vec<(PathBuf, TaskSet)>, String> {
    let mut found = Vec::new();
    for path in paths {
        let notation = Notation::of(path).ok_or_else(|| {
            format!(
                "`{}` is not a task set (*.json, *.toml, *.csv), and others in PATH are: analyse task sets and models one after \
                 the other",
                path.display()
            )
        })?;
        let read = || -> std::io::Result<(String, PathBuf)> {
            let path = path.canonicalize()?;
            let text = String::from_utf8(read(&path, LONGEST)?);
            Ok((text.map_err(|_| std::io::Error::other("this is not UTF-8 text"))?, path))
        };
        let (text, real) = read().map_err(|error| format!("cannot read `{}`: {error}", path.display()))?;
        let mut set = TaskSet::parse(&text, notation).map_err(|why| refused(path, &why))?;
        set.name.get_or_insert_with(|| path.file_stem().unwrap_or_default().to_string_lossy().into_owned());
        if only.is_none_or(|only| set.name.as_deref() == Some(only)) {
            found.push((real, set));
        }
    }
    match only {
        Some(only) if found.is_empty() => Err(format!("no deployment `{only}` in these files")),
        _ => Ok(found),
    }
}

/// Returns the message for a task set that cannot be used.
pub(super) fn refused(path: &Path, why: &TaskSetError) -> String {
    format!("`{}`: {}", path.display(), task_set_error_message(why))
}

/// The greatest number of activities in the table of an explanation.
const MOST_ROWS: usize = 100;

fn explain(all: &[Deployed<'_>], instance: &str) -> Result<String, String> {
    let mut texts = Vec::new();
    for it in all {
        for (query, report) in &it.reports {
            let activities = report.activities.iter().enumerate();
            let activities = activities.filter(|(_, activity)| activity.instance == *instance);
            texts.extend(activities.filter_map(|(activity, _)| {
                let doc = match it.origin {
                    Analysed::Model(project, of) => {
                        let tables = system_of(it.db, project, of).activities.get(activity)?.tables;
                        explain_response(it.db, tables, report, activity, *query, MOST_ROWS)
                    }
                    Analysed::File { set, .. } => {
                        explain_response_of(it.db, set, report, activity, *query, MOST_ROWS)
                    }
                };
                Some(format!("{instance}: {}", doc?.text()))
            }));
        }
    }
    if texts.is_empty() {
        let names: Vec<Name> = all
            .iter()
            .flat_map(|it| it.reports.first().into_iter().flat_map(|(_, report)| &report.activities))
            .map(|activity| activity.instance.clone())
            .collect();
        let near = mauve_hir::similar(instance, &names);
        return Err(match near {
            Some(near) => format!("no instance `{instance}`; did you mean `{near}`?"),
            None => format!("no instance `{instance}`: there is {}", names.join(", ")),
        });
    }
    Ok(texts.join("\n"))
}

fn root(of: &Deployed<'_>) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    shown(of.root(), &here)
}

/// The response times of deployments for people.
pub(super) fn tables(all: &[Deployed<'_>]) -> Vec<String> {
    // Where there are several projects, names do not say which.
    let several = all.iter().any(|it| Some(it.root()) != all.first().map(Deployed::root));
    let heading = |it: &Deployed<'_>| match several {
        true => format!("{} of {}", it.name, root(it)),
        false => it.name.to_owned(),
    };
    all.iter().map(|it| table(&heading(it), it)).collect()
}

/// All figures at one level, or the responses at several.
fn table(name: &str, it: &Deployed<'_>) -> String {
    let mut out = String::new();
    let basis = it.basis().unwrap_or_default();
    let origins = origins(&basis).map_or_else(String::new, |it| format!("; {it}"));
    let times = times_of(it.times()) + &origins;
    match it.reports.as_slice() {
        [(query, report)] => {
            let _ = writeln!(
                out,
                "{name}: response times in ms at {}, method {}{times}",
                query.level, query.method
            );
            out += &one_level(it, report);
            out += &utilisations(report);
        }
        reports => {
            let method = reports.first().map_or_else(String::new, |(query, _)| query.method.to_string());
            let _ = writeln!(out, "{name}: response times in ms, method {method}{times}");
            out += &several_levels(it.db, reports);
        }
    }
    out + &conditions(it)
}

/// Returns what the figures of a deployment depend on, and why some are missing: a line each.
pub(super) fn conditions(it: &Deployed<'_>) -> String {
    let mut out: String = it.supports().into_iter().map(|it| format!("  {}\n", supported(it))).collect();
    let basis = it.basis().unwrap_or_default();
    if it.errors > 0 {
        let _ = writeln!(out, "  not proved: the project has {}", counted(it.errors, "error"));
    }
    if it.rt_throttling().is_none() {
        let key = match it.origin {
            Analysed::Model(..) => "`[platform] rt_throttling` in mauve.toml",
            Analysed::File { .. } => "`rt_throttling` in the file",
        };
        let _ = writeln!(
            out,
            "  assumption: real-time throttling is off, which Linux has on by default; set {key}"
        );
    }
    out += &of_threads(it);
    for port in basis.ports {
        let _ = writeln!(
            out,
            "  assumption: reads and writes of {port} cost nothing; no timing table has `[access]` for it"
        );
    }
    let others = it.reports.first().into_iter().flat_map(|(_, report)| report.others());
    let hosts = it.reports.first().map(|(_, report)| report.hosts.clone()).unwrap_or_default();
    out.extend(others.map(|other| {
        let (name, cpus) = (name_of_other(&other.name), hosts.names(other.cpus.unwrap_or_default()));
        let (time, period) = (other.greatest_cost().unwrap_or_default(), other.period.unwrap_or_default());
        let priority = priority(other.priority);
        format!("  {name} interferes too: {time} every {period}, priority {priority}, {cpus}\n")
    }));
    out + &notes(it)
}

/// Returns how many activities have no bound because of their threads in `[platform] threads`, and which callbacks are assumed to be never
/// executed: a line each.
fn of_threads(it: &Deployed<'_>) -> String {
    let mut out = String::new();
    let Analysed::Model(project, deployment) = it.origin else { return out };
    let system = system_of(it.db, project, deployment);
    let has_none =
        |it: &&ResolvedActivity<'_>| it.priority == Priority::Background && it.declared_thread.is_some();
    let count = system.activities.iter().filter(has_none).count();
    if count > 0 {
        let _ = writeln!(
            out,
            "  no bound for {count} of {} activities: their threads have no real-time policy; see `mauve tune --priorities`",
            system.activities.len()
        );
    }
    let named = |(id, callback): &(Name, Option<Name>)| {
        let node = id.split('@').next().unwrap_or_default().trim_end_matches("/*");
        format!("{} of {node}", callback.as_deref().unwrap_or("other groups"))
    };
    let idle: Vec<String> = system.never_executed.iter().map(named).collect();
    if !idle.is_empty() {
        let idle = enumerated(&idle);
        let _ = writeln!(out, "  assumption: what has no activity in its thread is never executed: {idle}");
    }
    out
}

/// Returns why figures are missing, and which depend on assumptions: a line each, with the levels if it does not hold at all.
fn notes(it: &Deployed<'_>) -> String {
    let of_level = |(query, report)| notes_of(it, report).into_iter().map(move |note| (note, query));
    let line = |(note, queries): (String, Vec<&Query>)| {
        // Two activities of one instance may have one reason.
        let levels = each_once(queries.iter().map(|query| query.level.to_string()));
        match levels.len() == it.reports.len() {
            true => format!("  {note}\n"),
            false => format!("  at {}: {note}\n", levels.join(", ")),
        }
    };
    let reports = it.reports.iter().map(|(query, report)| (query, *report));
    grouped(reports.flat_map(of_level)).into_iter().map(line).collect()
}

fn notes_of<'db>(it: &Deployed<'db>, report: &Report<'db>) -> Vec<String> {
    let lines = Lines { width: |text| text.chars().count() };
    let here = std::env::current_dir().unwrap_or_default();
    // Activities are named already.
    let named: HashSet<&Location<'_>> = report.activities.iter().filter_map(|it| it.at.as_ref()).collect();
    let located = |refusal: &Refusal<'db>| {
        let reason = timing_reason(it.db, &refusal.reason);
        match &refusal.at {
            Some(at) if !named.contains(at) => reason + &lines.shown(it.db, &here, at),
            _ => reason,
        }
    };
    let mut found: Vec<String> =
        report.not_analysed.iter().map(|it| format!("nothing is analysed: {}", located(it))).collect();
    let mut of_activities: Vec<(String, &str)> = Vec::new();
    for activity in &report.activities {
        // A reason of the deployment is not repeated for each activity.
        let own = activity.reasons.len().saturating_sub(report.not_analysed.len());
        let reasons = each_once(activity.reasons.iter().take(own).map(located));
        if !reasons.is_empty() {
            of_activities.push((reasons.join("; "), &activity.instance));
        }
    }
    let counted = report.activities.iter().filter_map(|it| Some((it, counted_cpus(report, it)?)));
    of_activities.extend(counted.map(|(it, counted)| (format!("analysed {counted}"), &*it.instance)));
    for activity in report.activities.iter().filter(|activity| activity.response.is_some()) {
        let (instance, wait) = (&activity.instance, activity.task.wait());
        if wait > Time::ZERO {
            of_activities.push((format!("{wait} of its own time are waits"), instance));
        }
        let blocking = activity.window.as_ref().map_or(Time::ZERO, |window| window.blocking);
        if blocking > Time::ZERO {
            of_activities.push((format!("{} delay it by {blocking}", blocking_priorities(report)), instance));
        }
    }
    let assumed = report.activities.iter().filter(|activity| !activity.assumed.is_empty());
    of_activities.extend(assumed.map(|it| (assumptions(&it.assumed), &*it.instance)));
    let of_each = grouped(of_activities).into_iter();
    found.extend(of_each.map(|(note, names)| format!("{}: {note}", enumerated(&names))));
    if matches!(it.origin, Analysed::File { .. }) && has_inverted_priorities(report) {
        found.push(
            "all priorities rise with the deadlines: is 1 the highest priority in your source? Here greater numbers are higher, as of \
             SCHED_FIFO; write 100 minus its number"
                .to_owned(),
        );
    }
    found
}

/// Whether the priorities would be deadline-monotonic if lower numbers were higher: few tasks may have such priorities by intention.
fn has_inverted_priorities(report: &Report<'_>) -> bool {
    let of = |it: &ActivityReport<'_>| Some((it.deadline?, it.priority.real_time()?));
    let mut all: Vec<(Time, u32)> = report.activities.iter().filter_map(of).collect();
    all.sort_unstable();
    let rises = |pair: &[(Time, u32)]| pair[0].0 == pair[1].0 || pair[0].1 < pair[1].1;
    let deadlines: BTreeSet<Time> = all.iter().map(|(deadline, _)| *deadline).collect();
    deadlines.len() >= 3 && all.windows(2).all(rises)
}

/// `assumed 5 ms for robot.plan`.
fn assumptions(assumed: &[(String, Time)]) -> String {
    let each: Vec<String> = assumed.iter().map(|(codel, time)| format!("{time} for {codel}")).collect();
    format!("assumed {}", each.join(", "))
}

/// A row for each activity: WCET is the greatest execution time of one job. The response time of the first job has a
/// column of its own if it is not the greatest one for all activities.
fn one_level<'db>(of: &Deployed<'db>, report: &Report<'db>) -> String {
    let is_first_greatest =
        report.activities.iter().all(|it| it.first_job.is_none_or(|first| Some(first) == it.response));
    // The best method for each activity; a column where they differ.
    let methods: BTreeSet<_> = report.activities.iter().filter_map(|it| it.method).collect();
    let method = |activity: &ActivityReport<'db>| match activity.method {
        Some((method, true)) => format!("{method} *"),
        Some((method, false)) => method.to_string(),
        None => String::new(),
    };
    let has_methods = methods.len() > 1 || methods.iter().any(|(_, is_exhausted)| *is_exhausted);
    let has_components = report.activities.iter().any(|it| !it.component_name.is_empty());
    let mut out = Sheet::of(&report.activities)
        .column("instance", |it| it.instance.to_string())
        .column_if(has_components, "component", |it| it.component_name.to_string())
        .column("CPU", |it| cpu_numbers(&report.hosts, it.cpus))
        .column("priority", |it| priority(it.priority))
        .column("period", |it| number(it.period))
        .column("WCET", |it| number(it.own))
        .column_if(!is_first_greatest, "first job", |it| number(it.first_job))
        .column_if(has_methods, "method", method)
        .column("response / deadline", |it| forms(of, it).text().to_owned())
        .column("", |it| bar_of(&forms(of, it), 0))
        .column("", |it| bar_of(&forms(of, it), 1))
        .column("", |it| acceptance(of, it).unwrap_or_default())
        .text();
    if methods.iter().any(|(_, is_exhausted)| *is_exhausted) {
        let _ = writeln!(out, "  *: {EXHAUSTED}");
    }
    if report.assumes_clocks() {
        let clocks = match of.origin {
            Analysed::Model(..) => "the clocks which mauve.toml names",
            Analysed::File { .. } => "the clocks of the tasks with an offset",
        };
        let _ = writeln!(out, "  assumes that {clocks} are synchronised");
    }
    out
}

fn several_levels<'db>(db: &'db dyn ModelDb, reports: &[(Query, &Report<'db>)]) -> String {
    let Some((_, first)) = reports.first() else { return String::new() };
    let activities: Vec<_> = first.activities.iter().enumerate().collect();
    let mut sheet = Sheet::of(&activities).column("instance", |(_, it)| it.instance.to_string());
    for (query, report) in reports {
        let footings = report.footings();
        sheet = sheet.column(query.level.to_string(), |(index, _)| {
            let activity = report.activities.get(*index).zip(footings.get(*index));
            activity.map_or_else(String::new, |(it, footing)| match it.verdict {
                Status::Background => "–".to_owned(),
                _ => figure(db, it, *footing, TIGHT_SLACK).with_response().to_owned(),
            })
        });
    }
    sheet.text()
}

/// `CPU 1 utilisation: 99.4 % · CPU 2: 78.9 %`
fn utilisations(report: &Report<'_>) -> String {
    let of_cpu = |(index, cpu): (usize, &mauve_timing::CpuLoad)| {
        let what = if index == 0 { " utilisation" } else { "" };
        format!("{}{what}: {}", report.hosts.names(cpu.cpus), known_utilisation(cpu))
    };
    let all: Vec<String> = report.cpus.iter().enumerate().map(of_cpu).collect();
    if all.is_empty() { String::new() } else { format!("  {}\n", all.join(" · ")) }
}

/// `1`, `2, 3`; of several hosts, `eyes: 1`.
pub(super) fn cpu_numbers(hosts: &Hosts, cpus: Option<CpuSet>) -> String {
    let Some(cpus) = cpus else { return "?".to_owned() };
    let (host, cpus) = hosts.local(cpus);
    let numbers = cpus.to_string();
    let numbers = numbers.trim_start_matches("CPUs ").trim_start_matches("CPU ");
    host.map_or_else(|| numbers.to_owned(), |host| format!("{host}: {numbers}"))
}

pub(super) fn priority(priority: Priority) -> String {
    match priority {
        Priority::RealTime(priority) => priority.to_string(),
        Priority::Background => "background".to_owned(),
        Priority::Unknown => "?".to_owned(),
    }
}

fn forms<'db>(of: &Deployed<'db>, activity: &ActivityReport<'db>) -> Forms {
    figure(of.db, activity, Footing::Known, TIGHT_SLACK)
}

/// Returns the bar of a figure, or its per cent: the columns behind the figure itself.
pub(super) fn bar_of(forms: &Forms, part: usize) -> String {
    forms.bar.as_ref().and_then(|bar| bar.get(part)).cloned().unwrap_or_default()
}

fn acceptance(of: &Deployed<'_>, activity: &ActivityReport<'_>) -> Option<String> {
    let accepted = of.acceptance(activity).map(|reason| format!("{ACCEPTED}{reason}"));
    accepted.or_else(|| of.exceeded_acceptance(activity))
}

const ACCEPTED: &str = "accepted: ";

/// Colours the figures of a table, each up to the end of its line: green for a deadline that is met, yellow for little slack and for an
/// accepted or unknown response time, red for a deadline that is missed or has no bound.
pub(super) fn coloured(table: &str) -> String {
    let mut out = String::new();
    for line in table.split_inclusive('\n') {
        let content = line.trim_end_matches('\n');
        let marks = [("✓", "32"), ("!", "33"), ("?", "33"), ("✗", "31")];
        let places = marks
            .iter()
            .filter_map(|(mark, colour)| Some((content.find(&format!("  {mark} "))? + "  ".len(), *colour)));
        out += &match places.min() {
            Some((at, colour)) => {
                let (before, figure) = content.split_at(at);
                let colour = if figure.contains(ACCEPTED) { "33" } else { colour };
                format!("{before}\u{1b}[{colour}m{figure}\u{1b}[0m")
            }
            None => content.to_owned(),
        };
        out += line.get(content.len()..).unwrap_or_default();
    }
    out
}

/// Returns tables for standard output: on a terminal in colours.
pub(super) fn shown_tables(tables: &[String]) -> Vec<String> {
    let is_terminal = std::io::stdout().is_terminal();
    let shown = |table: &String| {
        let table = wrapped(&harmless(table));
        if is_terminal { coloured(&table) } else { table }
    };
    tables.iter().map(shown).collect()
}

fn figures_csv(all: &[Deployed<'_>]) -> String {
    let reports =
        all.iter().flat_map(|it| it.reports.iter().map(move |(query, report)| (it, query, *report)));
    let rows = reports.flat_map(|(it, query, report)| {
        report.activities.iter().map(move |activity| (it, query, report, activity))
    });
    Sheet::of(&rows.collect::<Vec<_>>())
        .column("deployment", |(of, ..)| of.name.to_owned())
        .column("significance", |(_, query, ..)| query.level.to_string())
        .column("method", |(_, query, _, it)| {
            it.method.map_or(query.method, |(method, _)| method).to_string()
        })
        .column("instance", |(.., it)| it.instance.to_string())
        .column("component", |(.., it)| it.component_name.to_string())
        .column("affinity", |(.., report, it)| {
            it.cpus.map(|cpus| report.hosts.local(cpus).1.0.to_string()).unwrap_or_default()
        })
        .column("priority", |(.., it)| it.priority.real_time().map(|it| it.to_string()).unwrap_or_default())
        .column("period_ms", |(.., it)| csv_number(it.period))
        .column("deadline_ms", |(.., it)| csv_number(it.deadline))
        .column("own_ms", |(.., it)| csv_number(it.own))
        .column("first_job_ms", |(.., it)| csv_number(it.first_job))
        .column("response_ms", |(.., it)| csv_number(it.response))
        .column("status", |(.., it)| it.verdict.name().to_owned())
        .column("assumed", |(.., it)| {
            it.assumed.iter().map(|(codel, _)| codel.as_str()).collect::<Vec<_>>().join(" ")
        })
        .column("root", |(of, ..)| root(of))
        .column("host", |(.., report, it)| {
            let host = it.cpus.and_then(|cpus| report.hosts.local(cpus).0);
            host.map(|it| it.to_string()).unwrap_or_default()
        })
        .column("remark", |(of, .., it)| remark(of, it))
        .csv()
}

/// Why a row has no figures, or why they are not what they seem to be: nothing, for most.
fn remark(of: &Deployed<'_>, activity: &ActivityReport<'_>) -> String {
    let mut remarks = reasons_of(of.db, activity);
    remarks.extend(of.acceptance(activity).map(|reason| format!("accepted: {reason}")));
    remarks.extend(of.exceeded_acceptance(activity));
    if activity.method.is_some_and(|(_, is_exhausted)| is_exhausted) {
        remarks.push(EXHAUSTED.to_owned());
    }
    remarks.extend(of.times().map(|section| format!("times of {section}")));
    remarks.extend((of.errors > 0).then(|| "not proved: the project has errors".to_owned()));
    remarks.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_have_colours() {
        let table = "D: response times\n  a  3  ✓ 3 / 9 ms  ▰\n  b  ! 9 / 9 ms\n  c  ? no time for x\n  d  ✗ 4 / 3 ms\n  \
                     e  ✗ 4 / 3 ms  accepted: it\n  f  – not real-time\n";
        let expected = "D: response times\n  a  3  \u{1b}[32m✓ 3 / 9 ms  ▰\u{1b}[0m\n  b  \u{1b}[33m! 9 / 9 ms\u{1b}[0m\n  \
                        c  \u{1b}[33m? no time for x\u{1b}[0m\n  d  \u{1b}[31m✗ 4 / 3 ms\u{1b}[0m\n  \
                        e  \u{1b}[33m✗ 4 / 3 ms  accepted: it\u{1b}[0m\n  f  – not real-time\n";
        assert_eq!(coloured(table), expected);
    }
}
