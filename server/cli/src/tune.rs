//! `mauve tune [PATH]`: values of a deployment with which every deadline is met, as a diff with the figures before and after it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_diagnostics::{all_of, timing_reason};
use mauve_hir::item_tree::Name;
use mauve_hir::{Database, Decl, Project, similar};
use mauve_ide::{Change, Compared, Comparison, Figure, Figures, compared, edit_of_fields};
use mauve_projects::analysis_document::milliseconds;
use mauve_projects::harmless::harmless;
use mauve_projects::json::{self, non_empty, object};
use mauve_projects::load::models_in;
use mauve_projects::output::{Output, print_patch, say};
use mauve_timing::Level;
use mauve_wcrt::tune::{
    Conflict, ConflictKind, Remedy, SearchKind, TuneAim, TuneRequest, Tuned, Untunable, tune,
};
use mauve_wcrt::{Query, system_of, thread_files};
use serde::Serialize;

use crate::comparison::{comparison_document, comparison_table, name_project};
use crate::edited_files::EditedFiles;
use crate::options::{Models, TableFormat, level};
use crate::text::{shown, wrapped};

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true).args(["priorities", "cpus", "periods", "slack", "latency"]))]
pub struct Tune {
    #[command(flatten)]
    models: Models,
    /// Search for priorities with which every deadline is met: deadline-monotonic ones, otherwise those of Audsley's algorithm.
    #[arg(long)]
    priorities: bool,
    /// Search for CPUs too: every activity may move within its host, unless --pin names it.
    #[arg(long)]
    cpus: bool,
    /// Search for the shortest periods with which every deadline is met; where one is missed, for the least longer ones.
    #[arg(long)]
    periods: bool,
    /// Search for the priorities (with --cpus, also the CPUs) that make the least slack, as a part of the deadline, as great as possible.
    #[arg(long, conflicts_with = "latency")]
    slack: bool,
    /// Search for the priorities with which the chains of mauve.toml are shortest, while every deadline is met.
    #[arg(long)]
    latency: bool,
    /// Leave the activity of this instance as it is. May be repeated.
    #[arg(long, value_name = "INSTANCE")]
    pin: Vec<String>,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// Write the values into the models, if every deadline is met with them. Writes only files in PATH.
    #[arg(long, conflicts_with = "diff")]
    apply: bool,
    /// Where not every deadline can be met, give up some, and write the values with which all others are met.
    #[arg(long, conflicts_with = "periods")]
    partly: bool,
    /// Print only the unified diff.
    #[arg(long, conflicts_with = "format")]
    diff: bool,
    /// How to show the figures.
    #[arg(long, value_enum, default_value = "table")]
    format: TableFormat,
}

/// What was found for a deployment of a project.
struct Tuning<'db> {
    project: Project<'db>,
    /// The path of its root.
    root: String,
    deployment: Decl<'db>,
    tuned: Tuned,
    change: Change,
    edited: EditedFiles,
    comparison: Comparison,
    elsewhere: Vec<Elsewhere<'db>>,
    /// The root of the project whose values are taken instead of those that were found.
    other: Option<String>,
}

/// What the change does to the deployment in another project that has its file.
#[derive(Clone)]
struct Elsewhere<'db> {
    project: Project<'db>,
    /// The path of its root.
    root: String,
    /// The figures before and after, or the error that the text would have.
    effect: Result<Comparison, String>,
}

impl Tune {
    pub(crate) fn run(self) -> Result<Output, String> {
        let here = std::env::current_dir().unwrap_or_default();
        let mut db = Database::default();
        let (db, declared, _) = self.models.deployments(&mut db, "tune")?;
        self.check_pins(db, &declared)?;
        let (mut writable, _) = models_in(&self.models.paths.paths)?;
        // Priorities may stand in the files of threads of the named folders.
        let named: Vec<PathBuf> =
            self.models.paths.paths.iter().filter_map(|it| it.canonicalize().ok()).collect();
        for (project, _) in &declared {
            let threads = &thread_files(db, project.workspace(db)).files;
            let paths = threads.iter().map(|file| file.path(db));
            writable.extend(paths.filter(|path| named.iter().any(|it| path.starts_with(it))).cloned());
        }
        let mut all = Vec::new();
        let mut is_complete = true;
        for &(project, deployment) in &declared {
            match self.found(db, (project, deployment), &declared, &writable)? {
                Ok(found) => all.push(found),
                Err(why) => {
                    say(&untunable(db, deployment, &why));
                    is_complete = false;
                }
            }
        }
        share(&mut all);
        let is_met = is_complete && all.iter().all(Tuning::is_met);
        if self.diff {
            all.iter().flat_map(Tuning::losses).for_each(|it| say(&it));
        }
        // Deployments may be in one file: it is changed once.
        let joined = |is_taken: &dyn Fn(&Tuning) -> bool| {
            let mut change = Change::default();
            for found in all.iter().filter(|it| is_taken(it)) {
                change.join(found.change.clone());
            }
            edited(db, &change, &writable)
        };
        let mut text = match (self.diff, self.format) {
            (true, _) => {
                print_patch(&joined(&|it| it.losses().next().is_none())?.diff(&here))?;
                String::new()
            }
            (false, TableFormat::Json) => json::one_or_all(all.iter().map(|it| document(it, &here)))?,
            (false, TableFormat::Table) => {
                let texts: Vec<String> = all.iter().map(|it| self.shown(it, &here)).collect();
                harmless(&texts.join("\n"))
            }
        };
        let mut code = u8::from(!is_met);
        if self.apply {
            let (files, is_complete) = joined(&|it| it.is_taken())?.write(&here);
            if !is_complete {
                code = 2;
            }
            if self.format == TableFormat::Table {
                text += &match files.as_slice() {
                    [] if all.iter().any(|it| self.may_give_up(it)) => {
                        "\nnothing is written; `--partly` gives up deadlines, and writes values with which all others are met\n".to_owned()
                    }
                    [] => "\nnothing is written\n".to_owned(),
                    files => harmless(&format!("\nwritten: {}\n", files.join(", "))),
                };
            }
        }
        Ok(Output::verbatim(text, code))
    }

    fn request(&self) -> TuneRequest {
        TuneRequest {
            priorities: self.priorities,
            cpus: self.cpus,
            periods: self.periods,
            aim: match (self.slack, self.latency) {
                (true, _) => TuneAim::Slack,
                (_, true) => TuneAim::Latency,
                _ => TuneAim::Deadlines,
            },
            partly: self.partly,
            pins: self.pin.iter().map(|it| Name::from(it.as_str())).collect(),
            most_steps: TuneRequest::STEPS_OF_COMMAND,
        }
    }

    /// Whether `--partly` may find values for a deployment that gets none.
    fn may_give_up(&self, found: &Tuning<'_>) -> bool {
        !self.partly && !self.periods && !found.tuned.is_met && found.losses().next().is_none()
    }

    /// Searches for values, edits the text in memory, and analyses it.
    fn found<'db>(
        &self,
        db: &'db Database,
        (project, deployment): (Project<'db>, Decl<'db>),
        declared: &[(Project<'db>, Decl<'db>)],
        writable: &BTreeSet<PathBuf>,
    ) -> Result<Result<Tuning<'db>, Vec<Untunable<'db>>>, String> {
        let query = Query::at_level(db, project, deployment, self.significance);
        let tuned = match tune(db, project, deployment, query, &self.request()) {
            Ok(tuned) => tuned,
            Err(why) => return Ok(Err(why)),
        };
        let change = edit_of_fields(db, project, deployment, &tuned.fields)?.with_line_ends(db);
        let edited = edited(db, &change, writable)?;
        let here = std::env::current_dir().unwrap_or_default();
        let root = |project: Project<'db>| shown(project.root(db).path(db), &here);
        let others = declared.iter().filter(|&&it| it.1 == deployment && it.0 != project);
        let is_shared = others.clone().next().is_some();
        let effect = |project: Project<'db>| {
            let query = Query::at_level(db, project, deployment, self.significance);
            let mut found = compared(db, (project, deployment, query), &change)?;
            if is_shared && self.format == TableFormat::Table {
                name_project(&mut found, &root(project));
            }
            Ok(found)
        };
        let comparison = effect(project)?;
        let elsewhere = |&(project, _): &(Project<'db>, _)| Elsewhere {
            project,
            root: root(project),
            effect: effect(project),
        };
        let elsewhere = others.filter(|_| !tuned.fields.is_empty()).map(elsewhere).collect();
        let root = root(project);
        Ok(Ok(Tuning {
            project,
            root,
            deployment,
            tuned,
            change,
            edited,
            comparison,
            elsewhere,
            other: None,
        }))
    }

    /// Refuses a pin that no deployment has.
    fn check_pins<'db>(
        &self,
        db: &'db Database,
        declared: &[(Project<'db>, Decl<'db>)],
    ) -> Result<(), String> {
        let mut names = BTreeSet::new();
        for &(project, deployment) in declared {
            let activities = &system_of(db, project, deployment).activities;
            names.extend(activities.iter().flat_map(|it| [it.instance.clone(), it.activity.clone()]));
        }
        let Some(pin) = self.pin.iter().find(|it| !names.contains(it.as_str())) else { return Ok(()) };
        let near = similar(pin, &names).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        Err(format!("--pin {pin}: no activity of this name{near}"))
    }

    fn shown(&self, found: &Tuning, here: &Path) -> String {
        let mut out = comparison_table(&found.comparison);
        let diff = found.edited.diff(here);
        if !diff.is_empty() {
            let _ = write!(out, "\n{diff}");
        }
        for effect in found.elsewhere.iter().filter(|it| it.is_loss()).flat_map(|it| &it.effect) {
            let _ = write!(out, "\n{}", comparison_table(effect));
        }
        let said = match &found.other {
            Some(root) => Some(format!("these are the figures with the values for `{root}`\n")),
            None => self.said(&found.tuned),
        };
        for said in said.into_iter().chain(found.losses().map(|it| it + "\n")) {
            let _ = write!(out, "\n{}", wrapped(&said));
        }
        out
    }

    /// Says what the search could not reach, and why.
    fn said(&self, tuned: &Tuned) -> Option<String> {
        if tuned.is_met {
            return match tuned.search {
                SearchKind::Exhausted if self.slack || self.latency || self.periods => {
                    Some("the budget of the search is exhausted: better values may exist\n".to_owned())
                }
                SearchKind::Heuristic if self.slack || self.latency => {
                    Some("better values may exist: not all could be analysed\n".to_owned())
                }
                _ => None,
            };
        }
        let (what, meet) = match (self.cpus, self.periods) {
            (_, true) => ("periods up to 64 times the present ones", "meet"),
            (true, false) => ("CPUs and priorities", "meet"),
            (false, false) => ("priority assignment", "meets"),
        };
        let found = format!("found no {what} that {meet} every deadline");
        let mut out = match tuned.search {
            SearchKind::Exact => format!("no {what} {meet} every deadline"),
            SearchKind::Heuristic => format!(
                "{found}, as far as the search went: some may exist, because response times depend on each other (operations, waits, \
                 several CPUs), and the orders and placements are too many to analyse all"
            ),
            SearchKind::Exhausted => {
                format!("{found}, and the budget of the search is exhausted: some may exist")
            }
        };
        if let Some(conflict) = &tuned.conflict {
            out += &conflict_text(conflict);
        }
        if !tuned.given_up.is_empty() {
            let names: Vec<String> = tuned.given_up.iter().map(|it| format!("`{it}`")).collect();
            let [those, are] = if names.len() == 1 { ["that", "is"] } else { ["those", "are"] };
            out += &format!(
                "\n\nWith these values, all other deadlines are met; {those} of {} {are} given up.",
                all_of(&names)
            );
        }
        Some(out + "\n")
    }
}

impl<'db> Tuning<'db> {
    /// Whether every deadline of the edited text is met, and none is missed in another project that is met there now.
    fn is_met(&self) -> bool {
        let is_met = self.comparison.after.as_ref().is_some_and(Figures::schedulable);
        is_met && (self.other.is_some() || self.tuned.is_met) && self.losses().next().is_none()
    }

    /// Whether its values are written: every deadline is met with them, but for those that are given up.
    fn is_taken(&self) -> bool {
        self.is_met() || !self.tuned.given_up.is_empty() && self.losses().next().is_none()
    }

    /// Says which deadlines would be missed in other projects.
    fn losses(&self) -> impl Iterator<Item = String> {
        self.elsewhere.iter().filter(|it| it.is_loss()).map(Elsewhere::said)
    }
}

impl Elsewhere<'_> {
    /// Whether something that is met now would not be.
    fn is_loss(&self) -> bool {
        self.effect.as_ref().map_or(true, |it| it.rows().any(is_lost))
    }

    fn said(&self) -> String {
        let why = match &self.effect {
            Ok(it) => {
                let names: Vec<String> =
                    it.rows().filter(|it| is_lost(it)).map(|it| format!("`{}`", it.name())).collect();
                format!("{} would not be met any more", all_of(&names))
            }
            Err(why) => why.clone(),
        };
        format!("these values are not written: `{}` has the deployment too, and there {why}", self.root)
    }
}

fn is_lost(row: &Compared) -> bool {
    let is_met = |it: &Option<Figure>| it.as_ref().is_some_and(|it| it.status.is_met());
    is_met(&row.before) && !is_met(&row.after)
}

/// Takes the same values for a deployment in all projects: the first ones that are written.
fn share(all: &mut [Tuning<'_>]) {
    for index in 0..all.len() {
        let is_taken = |it: &&Tuning<'_>| it.other.is_none() && !it.tuned.fields.is_empty() && it.is_taken();
        let Some(taken) = all.get(index).filter(is_taken) else { continue };
        let (deployment, root, effects) = (taken.deployment, taken.root.clone(), taken.elsewhere.clone());
        for Elsewhere { project, effect, .. } in effects {
            let mut same = all.iter_mut().filter(|it| it.deployment == deployment && it.project == project);
            if let (Some(found), Ok(effect)) = (same.next(), effect) {
                (found.comparison, found.other) = (effect, Some(root.clone()));
                (found.change, found.edited, found.tuned.fields, found.elsewhere) = Default::default();
            }
        }
    }
}

/// Returns the files of a change with their texts.
fn edited(db: &Database, change: &Change, writable: &BTreeSet<PathBuf>) -> Result<EditedFiles, String> {
    let mut files = Vec::new();
    for of in &change.files {
        let path = of.file.path(db);
        if of.file.is_outside(db) || !writable.contains(path) {
            return Err(format!("`{}` is not in PATH: name its folder too", path.display()));
        }
        let old = of.file.text(db).clone();
        let new: Arc<str> = change.applied(db, of.file).into();
        if old != new {
            files.push((path.clone(), old, new));
        }
    }
    Ok(EditedFiles(files))
}

/// Says why a deployment cannot be tuned.
fn untunable(db: &Database, deployment: Decl<'_>, all: &[Untunable<'_>]) -> String {
    let reason = |it: &Untunable<'_>| {
        let reasons: Vec<String> = it.refusals.iter().map(|it| timing_reason(db, &it.reason)).collect();
        let of = it.instance.as_ref().map_or_else(String::new, |it| format!("`{it}`: "));
        format!("{of}{}", reasons.join("; "))
    };
    let reasons: Vec<String> = all.iter().map(reason).collect();
    let reasons = if reasons.is_empty() { "it has no activities".to_owned() } else { reasons.join("\n  ") };
    format!(
        "{} cannot be tuned, because its activities are not analysed with any values:\n  {reasons}",
        deployment.name(db)
    )
}

fn conflict_text(conflict: &Conflict) -> String {
    let Conflict { activities, kind, remedies } = conflict;
    let mut out = match activities.as_slice() {
        [] => "".to_owned(),
        [one] => format!(": `{one}` misses its deadline even if no other thread delays it"),
        all => {
            let smallest = match kind {
                ConflictKind::Smallest => "no fewer activities are such a set",
                ConflictKind::Minimal => "without any one of them, the others can be",
                ConflictKind::Some => "fewer of them may be such a set",
            };
            let all: Vec<String> = all.iter().map(|it| format!("`{it}`")).collect();
            format!(": {} cannot be scheduled together ({smallest})", all_of(&all))
        }
    };
    let lines: Vec<String> = remedies.iter().filter_map(remedy_text).collect();
    if *kind == ConflictKind::Some {
        return out;
    }
    out += match lines.as_slice() {
        [] => ". No shorter time and no longer period of one of them alone was found to be enough.",
        _ => ". Each of these alone would be enough:",
    };
    out.extend(lines.into_iter().map(|it| format!("\n  {it}")));
    out
}

fn remedy_text(of: &Remedy) -> Option<String> {
    let time = of.time.map(|[now, most]| format!("takes at most {} instead of {now}", most));
    let period = of.period.map(|[now, least]| format!("has a period of at least {} instead of {now}", least));
    let both: Vec<String> = time.into_iter().chain(period).collect();
    (!both.is_empty()).then(|| format!("`{}` {}", of.instance, both.join(", or ")))
}

fn document(found: &Tuning<'_>, here: &Path) -> impl Serialize + use<> {
    let Tuning { tuned, comparison, .. } = found;
    let values = tuned.fields.iter().map(|it| {
        object! { instance: it.instance.to_string(), field: it.field.keyword(), value: it.value.to_string() }
    });
    let remedy = |it: &Remedy| {
        object! {
            instance: it.instance.to_string(),
            // The greatest time of its jobs, and the least period, with which every deadline is met.
            [time]: it.time.map(|[now, most]| object! { now: milliseconds(now), at_most: milliseconds(most) }),
            [period]: it.period.map(|[now, least]| object! { now: milliseconds(now), at_least: milliseconds(least) }),
        }
    };
    let conflict = tuned.conflict.as_ref().map(|it| {
        object! {
            activities: it.activities.iter().map(Name::to_string).collect::<Vec<_>>(),
            smallest: it.kind == ConflictKind::Smallest,
            remedies: it.remedies.iter().map(remedy).collect::<Vec<_>>(),
        }
    });
    object! {
        root: found.root.clone(),
        met: found.is_met(),
        // exact, heuristic or exhausted: whether something better may exist
        search: match tuned.search {
            SearchKind::Exact => "exact",
            SearchKind::Heuristic => "heuristic",
            SearchKind::Exhausted => "exhausted",
        },
        values: values.collect::<Vec<_>>(),
        diff: found.edited.diff(here),
        [conflict]: conflict,
        // The instances whose deadlines are given up, with `--partly`.
        [given_up]: non_empty(tuned.given_up.iter().map(Name::to_string)),
        comparison: comparison_document(comparison),
        // Why the values are not written: what would not be met any more in other projects.
        [refused]: non_empty(found.losses()),
    }
}
