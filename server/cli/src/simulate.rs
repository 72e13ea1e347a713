//! `mauve simulate [PATH]`: one of the possible schedules of a deployment, of a model or of the task set in a generated package,
//! with the simulated response times beside their bounds; the schedule behind one of the bounds; or the longest way of data along
//! a chain that a search finds.

mod document;
mod simulation;
mod trace_events;

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::ValueEnum;
use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::TIGHT_SLACK;
use mauve_diagnostics::{errors_of, reasons_of, times_of, timing_reason};
use mauve_hir::{Database, Decl, Project};
use mauve_ide::{Drawing, WayOf, WorstOf, draw_schedule, no_worst_case, to_micros};
use mauve_projects::json;
use mauve_projects::output::{Output, say, terminal_columns};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{LeftOut, Level, Method, NoWorstCase, SimulationOptions, Statistics, Time, Unit};
use mauve_wcrt::{DeployedTasks, Footing, Query, Report, response_times, response_times_of, system_of};

use self::simulation::{Simulation, SimulationRow};
use super::wcrt::{cpu_numbers, priority, refused, shown_tables, task_sets};
use crate::errors::say_errors;
use crate::options::{Models, level, time};
use crate::text::{Sheet, counted, number};

#[derive(Debug, clap::Args)]
pub struct Simulate {
    #[command(flatten)]
    models: Models,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// The simulated time, such as 10s. By default the hyperperiod or ten times the longest period, whichever is less; the
    /// table simulates 100 times as long.
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    length: Option<Time>,
    /// Determines the random choices: the same seed gives the same schedule.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Release all activities at time 0 instead of at random instants of their first periods.
    #[arg(long)]
    simultaneous: bool,
    /// Let each job take the full execution time of its path; otherwise a random time from half of it.
    #[arg(long)]
    full_times: bool,
    /// Simulate the schedule behind the bound of this instance: the releases and the paths that its analysis found.
    #[arg(long, value_name = "INSTANCE", conflicts_with_all = ["simultaneous", "full_times"])]
    worst: Option<String>,
    /// Search for a schedule in which data takes long along this chain, and show its way.
    #[arg(long, value_name = "CHAIN", conflicts_with_all = ["simultaneous", "full_times", "worst"])]
    worst_chain: Option<String>,
    /// How to show the schedule.
    #[arg(long, value_enum, default_value = "table")]
    format: ScheduleFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ScheduleFormat {
    /// The response times, for people.
    Table,
    /// A Gantt chart for terminals.
    Text,
    /// A Gantt chart for browsers.
    Svg,
    /// One document with the response times and the schedule.
    Json,
    /// The schedule as trace events, for ui.perfetto.dev and chrome://tracing.
    Perfetto,
}

impl ScheduleFormat {
    /// The most jobs of a simulation whose length is not given.
    fn most_jobs(self, activities: usize) -> u64 {
        match self {
            ScheduleFormat::Table => 10_000,
            ScheduleFormat::Svg | ScheduleFormat::Text => (8 * activities as u64).max(30),
            ScheduleFormat::Json | ScheduleFormat::Perfetto => 100_000,
        }
    }

    /// The most events of a simulation, so that the memory is enough for the schedule.
    fn most_events(self) -> u64 {
        match self {
            ScheduleFormat::Table => 1_000_000_000,
            ScheduleFormat::Svg | ScheduleFormat::Text => 50_000,
            ScheduleFormat::Json | ScheduleFormat::Perfetto => 2_000_000,
        }
    }
}

impl Simulate {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut db = Database::default();
        if self.models.are_task_sets() {
            let all = self.of_task_sets(&db)?;
            return self.output(&all, 0);
        }
        let (db, mut found, errors) = self.models.deployments(&mut db, "simulate")?;
        if let Some(instance) = &self.worst {
            let has_it = |&(project, deployment): &(Project<'_>, Decl<'_>)| {
                let activities = &system_of(db, project, deployment).activities;
                activities.iter().any(|activity| activity.instance.as_str() == instance)
            };
            found.retain(has_it);
            if found.is_empty() {
                return Err(no_activity(instance));
            }
        }
        let of_model = |(project, of)| {
            let query = Query::at_level(db, project, of, self.significance);
            let report = response_times(db, project, of, query).clone();
            let name = of.name(db).to_string();
            let deployment = DeployedTasks::simulated(db, project, of, query.level);
            let errors = errors_of(db, project);
            let chain = self.worst_chain.as_ref();
            let way = chain
                .map(|chain| WayOf::of(db, (project, of, query), &deployment, (chain, self.seed), &|| ()));
            Ok(Simulation { errors, ..self.simulate(db, name, query, report, deployment, way.transpose()?)? })
        };
        let all: Result<Vec<Simulation<'_>>, String> = found.into_iter().map(of_model).collect();
        self.output(&all?, errors)
    }

    fn of_task_sets<'db>(&self, db: &'db Database) -> Result<Vec<Simulation<'db>>, String> {
        if self.worst_chain.is_some() {
            return Err("a task set has no chains: --worst-chain needs a model".to_owned());
        }
        let simulation = |(path, set): (PathBuf, TaskSet)| {
            let level = self.significance.unwrap_or(set.level());
            let query = Query { level, method: Method::Best };
            let report = response_times_of(&set, query);
            let found =
                report.and_then(|report| Ok((report, DeployedTasks::of_file(&set, level, Method::Psm)?)));
            let (report, deployment) = found.map_err(|why| refused(&path, &why))?;
            self.simulate(db, set.name.unwrap_or_default(), query, report, deployment, None)
        };
        task_sets(&self.models.paths.paths, self.models.deployment.as_deref())?
            .into_iter()
            .map(simulation)
            .collect()
    }

    fn simulate<'db>(
        &self,
        db: &'db Database,
        name: String,
        query: Query,
        report: Report<'db>,
        deployment: DeployedTasks<'db>,
        way: Option<WayOf>,
    ) -> Result<Simulation<'db>, String> {
        let set = &deployment.tasks;
        let worst = match &self.worst {
            Some(instance) => {
                let activity = set.activities().iter().position(|activity| *activity.name == **instance);
                let activity = activity.ok_or_else(|| no_activity(instance))?;
                let worst = WorstOf::of(&deployment, activity, query, &|| ());
                Some(worst.map_err(|why| {
                    let says_why =
                        if why == NoWorstCase::NoResponse { ": `mauve wcrt` says why" } else { "" };
                    no_worst_case(why, instance, &name) + says_why
                })?)
            }
            None => None,
        };
        let of_way = way.as_ref().and_then(|found| Some(found.way.passes.last()?.write));
        let length =
            self.length.or(worst.as_ref().map(|worst| worst.case.length)).or(of_way).unwrap_or_else(|| {
                let shown = set.length_to_show(self.format.most_jobs(set.activities().len()));
                let times = if self.format == ScheduleFormat::Table { 100 } else { 1 };
                shown.checked_mul(times).unwrap_or(shown)
            });
        let new = SimulationOptions::new(self.seed, length);
        let options = SimulationOptions {
            simultaneous: self.simultaneous,
            initial_states: deployment.initial_states(),
            least_time: if self.full_times || worst.is_some() { 100 } else { new.least_time },
            keeps_schedule: self.format != ScheduleFormat::Table || worst.is_some(),
            // The table keeps no schedule otherwise.
            most_events: match worst {
                Some(_) => self.format.most_events().min(ScheduleFormat::Json.most_events()),
                None => self.format.most_events(),
            },
            script: worst.as_ref().map(|worst| worst.case.script.clone()),
            ..new
        };
        let of_way = |found: &WayOf| SimulationOptions {
            length,
            keeps_schedule: options.keeps_schedule,
            most_events: options.most_events,
            ..found.way.options.clone()
        };
        let options = way.as_ref().map_or(options.clone(), of_way);
        let schedule = set.simulate(&options, &|| ());
        if schedule.end < options.length {
            say(&format!(
                "the simulation of {name} ends at {} instead of {}: it is too long for this format",
                schedule.end, options.length
            ));
        }
        let level = query.level;
        Ok(Simulation { db, name, level, report, deployment, options, schedule, worst, way, errors: 0 })
    }

    fn output(&self, all: &[Simulation<'_>], errors: usize) -> Result<Output, String> {
        let text = match self.format {
            ScheduleFormat::Table => {
                let tables: Vec<String> = all.iter().map(table).collect();
                shown_tables(&tables).join("\n")
            }
            ScheduleFormat::Json => json::one_or_all(all.iter().map(document::document))?,
            ScheduleFormat::Svg | ScheduleFormat::Text => {
                let it = only(all)?;
                let what = it.worst_case();
                let what = what.unwrap_or_else(|| format!("a simulated schedule, seed {}", self.seed));
                let times = times_of(it.report.times.as_deref());
                let title = format!("{} at {}{times}: {what}", it.name, it.level);
                let drawing = if self.format == ScheduleFormat::Svg {
                    Drawing::Svg
                } else {
                    Drawing::Text(terminal_columns())
                };
                let worst = it.worst.as_ref().map(|it| (it, TIGHT_SLACK));
                let shown = (&it.schedule, it.passes(), worst);
                draw_schedule(&title, &it.deployment, shown, drawing, &|| ())
            }
            ScheduleFormat::Perfetto => trace_events::text(only(all)?),
        };
        say_errors(errors);
        for it in all.iter().filter(|it| it.schedule.statistics.iter().all(Option::is_none)) {
            say(&format!("no activity of {} can be simulated", it.name));
        }
        let is_fine = all.iter().all(Simulation::is_fine);
        let code = u8::from(!is_fine || errors > 0);
        Ok(match self.format {
            ScheduleFormat::Text => Output::escaped(text, code),
            _ => Output::verbatim(text, code),
        })
    }
}

fn no_activity(instance: &str) -> String {
    format!("no deployment here has an activity `{instance}`; `mauve wcrt` lists them")
}

/// Returns the only deployment.
fn only<'a, 'db>(all: &'a [Simulation<'db>]) -> Result<&'a Simulation<'db>, String> {
    match all {
        [one] => Ok(one),
        several => {
            let names: Vec<&str> = several.iter().map(|it| it.name.as_str()).collect();
            Err(format!(
                "this format shows one deployment: choose it with --deployment: {}",
                names.join(", ")
            ))
        }
    }
}

/// The response times of a deployment for people.
fn table(it: &Simulation<'_>) -> String {
    let mut out = String::new();
    let Simulation { name, level, schedule, options, .. } = it;
    let _ = writeln!(
        out,
        "{name}: simulated response times in ms, {} at {level}, seed {}{}",
        schedule.end,
        options.seed,
        times_of(it.report.times.as_deref())
    );
    let none = || "—".to_owned();
    let rounded =
        |time: Option<Time>| time.map_or_else(none, |it| format!("{:.3}", it.as_f64(Unit::Milliseconds)));
    out += &Sheet::of(&it.rows().collect::<Vec<_>>())
        .column("instance", |row| row.activity.instance.to_string())
        .column("CPU", |row| cpu_numbers(&it.report.hosts, row.activity.cpus))
        .column("priority", |row| priority(row.activity.priority))
        .column("period", |row| number(row.activity.period))
        .column("jobs", |row| row.statistics.map_or_else(none, |it| it.jobs.to_string()))
        .column("average", |row| rounded(row.statistics.and_then(|it| it.average)))
        .column("greatest", |row| rounded(row.statistics.and_then(|it| it.greatest)))
        .column("of bound", |row| row.ratio().map_or_else(none, |ratio| format!("{:.1} %", ratio * 100.0)))
        .column("late", |row| row.statistics.map_or_else(none, |it| it.misses.to_string()))
        .column("bound / deadline", |row| {
            figure(it.db, row.activity, Footing::Known, TIGHT_SLACK).text().to_owned()
        })
        .column("", left_out)
        .text();
    match it.worst_case() {
        Some(worst) => out += &format!("  {worst}\n{}", way_table(it)),
        None => out += "  a simulation shows some of the possible schedules: only the bounds hold for all\n",
    }
    let lost = it.report.not_analysed.iter();
    out.extend(lost.map(|lost| format!("  incomplete: {}\n", timing_reason(it.db, &lost.reason))));
    for row in it.rows().filter(|row| row.left_out == Some(LeftOut::Unknown)) {
        let own = row.activity.reasons.len().saturating_sub(it.report.not_analysed.len());
        let reasons: Vec<String> = reasons_of(it.db, row.activity).into_iter().take(own).collect();
        let reasons = if reasons.is_empty() { String::new() } else { format!(": {}", reasons.join("; ")) };
        let _ = writeln!(out, "  {} is not simulated, and may delay others{reasons}", row.activity.instance);
    }
    if it.errors > 0 {
        let _ = writeln!(out, "  the project has {}", counted(it.errors, "error"));
    }
    out
}

/// Says how data passes through each instance of a chain, in times since the change.
fn way_table(it: &Simulation<'_>) -> String {
    let passes = it.passes();
    let Some(change) = passes.first().map(|pass| pass.arrival) else { return String::new() };
    let since = |at: Time| number(at.checked_sub(change).map(to_micros));
    Sheet::of(passes)
        .column("instance", |pass| it.instance(pass.task).unwrap_or_default())
        .column("arrives", |pass| since(pass.arrival))
        .column("read by job", |pass| pass.reads.to_string())
        .column("written by job", |pass| pass.writes.to_string())
        .column("written", |pass| since(pass.write))
        .text()
}

/// Says that a row has no figures of jobs.
fn left_out(row: &SimulationRow<'_, '_>) -> String {
    match (row.statistics, row.left_out) {
        (Some(Statistics { jobs: 0, .. }), _) => "no job ended".to_owned(),
        (Some(_), _) | (None, Some(LeftOut::Background)) => String::new(),
        (None, _) => "not simulated".to_owned(),
    }
}
