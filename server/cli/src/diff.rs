//! `mauve diff [REV | PATH] [PATH]`: what changed in the figures between two states of models, such as two revisions.

mod states;
mod unread;

use clap::ValueEnum;
use mauve_diagnostics::errors_of_text;
use mauve_hir::{Database, relative_path};
use mauve_ide::{Compared, Comparison, FigureChange, Figures};
use mauve_projects::analysis_document::deployments;
use mauve_projects::harmless::harmless;
use mauve_projects::json;
use mauve_projects::load::Outside;
use mauve_projects::output::Output;
use mauve_projects::revision::copy_of;
use mauve_timing::{Level, Time};
use mauve_wcrt::Query;

use self::states::{ModelState, states};
use self::unread::{Unread, lone_projects, unread, unread_of};
use crate::comparison::{
    Tolerance, comparison_document, comparison_markdown, comparison_table, escaped, name_project, tolerance,
};
use crate::errors::missing;
use crate::options::level;
use crate::text::{counted, wrapped};

#[derive(Debug, clap::Args)]
pub struct Diff {
    /// The state before: a revision of git, such as `main` or `HEAD~3`, or a path; HEAD when left out. `main..HEAD` names both states,
    /// `main...HEAD` the common ancestor and HEAD. `git:NAME` is a revision that is called like a file, `REV:PATH` another path in it.
    #[arg(value_name = "REV|PATH")]
    first: Option<String>,
    /// The model, folder or mauve.toml in both states; the current folder when left out. After a path, the state that it is compared
    /// with; after a revision, also another revision.
    #[arg(value_name = "PATH")]
    second: Option<String>,
    #[command(flatten)]
    outside: Outside,
    /// Only this deployment.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The significance level of the execution times; by default that of mauve.toml in each state, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// By how much a response time or a latency may be greater than before, such as 2ms or 5%.
    #[arg(long, value_name = "TIME|PERCENT", value_parser = tolerance, default_value = "0")]
    tolerance: Tolerance,
    /// How to show what changed.
    #[arg(long, value_enum, default_value = "text")]
    format: DiffFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum DiffFormat {
    /// For people.
    Text,
    /// One document, with all figures.
    Json,
    /// For a pull request.
    Markdown,
}

impl Diff {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (all, [before, after]) = self.compared()?;
        let had_none = all.iter().all(|it| it.before.is_none());
        let is_worse = all.iter().any(|it| it.is_worse());
        let is_unread = all.iter().any(Comparison::is_unread);
        let summary = summary(&all);
        let text = match self.format {
            DiffFormat::Json => {
                let document = |it: &Comparison| {
                    json::object! {
                        root: it.state().map(|it| it.root.display().to_string()),
                        worse: it.is_worse(),
                        figures: comparison_document(it),
                    }
                };
                json::text(&json::object! {
                    before: before,
                    after: after,
                    worse: is_worse,
                    deployments: all.iter().map(document).collect::<Vec<_>>(),
                })?
            }
            DiffFormat::Text => harmless(
                &sections(&all, wrapped(&format!("{before} → {after}: {summary}\n")), comparison_table)
                    .join("\n"),
            ),
            DiffFormat::Markdown => {
                let is_proved = all.iter().filter_map(|it| it.after.as_ref()).all(Figures::schedulable);
                let mark = match is_worse {
                    true => "❌",
                    false if is_proved && !had_none && !is_unread => "✅",
                    false => "⚠️",
                };
                let head = format!("{mark} **Response times:** {summary}\n");
                let mut sections = sections(&all, head, comparison_markdown);
                sections.push(format!("<sub>mauve diff: {} → {}</sub>\n", escaped(&before), escaped(&after)));
                harmless(&sections.join("\n"))
            }
        };
        Ok(Output::verbatim(text, if is_unread { 2 } else { u8::from(is_worse) }))
    }

    /// The comparison of the models at a path with those in a state before.
    pub(super) fn since(
        before: &str,
        path: String,
        outside: Outside,
        deployment: Option<String>,
        significance: Option<Level>,
    ) -> Diff {
        let tolerance = Tolerance::default();
        let (first, second) = (Some(before.to_owned()), Some(path));
        Diff { first, second, outside, deployment, significance, tolerance, format: DiffFormat::Text }
    }

    /// Compares the deployments of both states, and returns how the user calls these.
    pub(super) fn compared(&self) -> Result<(Vec<Comparison>, [String; 2]), String> {
        let states = states(self.first.as_deref(), self.second.as_deref(), self.outside.allow_outside)?;
        let [(before, errors_before, unread), (after, errors_after, unread_after)] = {
            let [before, after] = &states;
            [self.figures(before)?, self.figures(after)?]
        };
        let (before, after) = match (before, after) {
            // One of the states may lack the deployment that is asked for.
            (Err(_), Err(why)) => return Err(why),
            (before, after) => (before.unwrap_or_default(), after.unwrap_or_default()),
        };
        let unread = [unread, unread_after].concat();
        let mut found = Comparison::of_all(before, after);
        found.extend(lone_projects(&unread, &found));
        if found.is_empty() {
            let what = "neither state has a deployment: nothing to compare".to_owned();
            return Err(missing(what, errors_before.max(errors_after)));
        }
        let tolerance = |before: Time| self.tolerance.of(before);
        let compared = |it: Comparison| {
            let unread = unread_of(&unread, &it);
            it.tolerating(&tolerance).without_unread(unread)
        };
        let mut all: Vec<Comparison> = found.into_iter().map(compared).collect();
        if self.format != DiffFormat::Json {
            name_projects(&mut all);
        }
        Ok((all, states.each_ref().map(ModelState::name)))
    }

    /// Returns the figures of the deployments of a state, or which deployments it has, the number of errors in it, and what cannot
    /// be read.
    fn figures(&self, state: &ModelState) -> Result<FiguresOfState, String> {
        let mut db = Database::default();
        let (workspaces, folder, left_out) = state.load(&mut db, self.outside.allow_outside)?;
        let found = deployments(&db, &workspaces, self.deployment.as_deref());
        let figures = |(project, deployment)| {
            let query = Query::at_level(&db, project, deployment, self.significance);
            let mut figures = Figures::of(&db, project, deployment, query);
            figures.root = relative_path(&folder, &figures.root);
            if let Some(copy) = copy_of(&folder) {
                figures.replace(&copy, "the repository");
            }
            figures
        };
        let figures = found.map(|found| found.into_iter().map(figures).collect());
        let mut unread = unread(&db, &workspaces, &folder, &left_out);
        unread.iter_mut().for_each(|it| it.why = format!("{}: {}", state.name(), it.why));
        Ok((figures, errors_of_text(&db, &workspaces), unread))
    }
}

/// The figures of the deployments of a state, or which deployments it has, the number of errors in it, and what cannot be read.
type FiguresOfState = (Result<Vec<Figures>, String>, usize, Vec<Unread>);

/// Adds the root of its project to the name of each deployment that is not the only one of its name.
fn name_projects(all: &mut [Comparison]) {
    let name = |it: &Comparison| it.state().map_or_else(String::new, |it| it.deployment.clone());
    let names: Vec<String> = all.iter().map(name).collect();
    for it in all.iter_mut().filter(|it| names.iter().filter(|other| **other == name(it)).count() > 1) {
        let root = it.state().map(|it| it.root.display().to_string()).unwrap_or_default();
        name_project(it, &root);
    }
}

/// Returns the head, the comparisons that show something, and the number of the others.
fn sections(all: &[Comparison], head: String, written: fn(&Comparison) -> String) -> Vec<String> {
    let is_shown = |it: &&Comparison| !it.is_same() || it.was().is_some() || all.len() == 1;
    let mut sections = vec![head];
    sections.extend(all.iter().filter(is_shown).map(written));
    let same = all.len() + 1 - sections.len();
    sections.extend((same > 0).then(|| format!("{}: nothing changes\n", counted(same, "other deployment"))));
    sections
}

/// The number of figures that are named in a summary.
const MOST_NAMED: usize = 3;

/// Returns the verdict in words: `2 figures worse (nav no longer met; imu later), 1 figure better`.
fn summary(all: &[Comparison]) -> String {
    let rows = || all.iter().flat_map(Comparison::rows);
    let figures = |of: &dyn Fn(&Compared) -> bool| rows().filter(|it| of(it)).count();
    let deployments = |of: &dyn Fn(&Comparison) -> bool| all.iter().filter(|it| of(it)).count();
    let is = |change: FigureChange| figures(&|it| it.change() == change);
    // The first ones are named: of a comment, often only the first line is read.
    let mut worse: Vec<&Compared> = rows().filter(|it| it.is_worse()).collect();
    worse.sort_by_key(|it| it.change());
    let mut names: Vec<String> =
        worse.iter().take(MOST_NAMED).map(|it| format!("{} {}", it.name(), it.change().words())).collect();
    names.extend((worse.len() > MOST_NAMED).then(|| "…".to_owned()));
    let is_better = |it: &Compared| {
        matches!(it.change(), FigureChange::Met | FigureChange::Found | FigureChange::Earlier)
    };
    let has_figure =
        |it: &Compared| it.after.as_ref().is_some_and(|it| it.time.is_some() || it.limit.is_some());
    let is_new = |it: &Compared| it.change() == FigureChange::New && has_figure(it);
    let is_unproved = |it: &Comparison| it.after.as_ref().is_some_and(|it| it.errors > 0);
    let counts = [
        (worse.len(), "figure", &*format!("worse ({})", names.join("; "))),
        (is(FigureChange::Tolerated), "figure", "later within the tolerance"),
        (figures(&is_better), "figure", "better"),
        (figures(&is_new), "figure", "new"),
        (figures(&Compared::is_relaxed), "deadline", "relaxed"),
        (is(FigureChange::Tightened), "deadline", "tightened"),
        (is(FigureChange::OtherFields), "figure", "with other fields"),
        (all.iter().map(|it| it.assumptions().len()).sum(), "assumption", "changed"),
        (deployments(&|it| it.after.is_none()), "deployment", "gone"),
        (deployments(&Comparison::is_unread), "deployment", "not compared, since files cannot be read"),
        (deployments(&is_unproved), "deployment", "not proved, since there are errors"),
    ];
    let said = counts.iter().filter(|(count, ..)| *count > 0);
    let mut said: Vec<String> =
        said.map(|(count, what, how)| format!("{} {how}", counted(*count, what))).collect();
    if said.is_empty() {
        said.push("nothing changes".to_owned());
    }
    let met = all.iter().filter_map(|it| it.after.as_ref()).map(Figures::met);
    let (met, of) = met.fold((0, 0), |(met, of), (more, all)| (met + more, of + all));
    said.extend((met < of).then(|| format!("{met} of {of} deadlines met")));
    said.join(", ")
}
