//! `mauve diff [REV | PATH] [PATH]`: what changed in the figures between two states of models, such as two revisions.

mod states;

use clap::ValueEnum;
use mauve_diagnostics::errors_of_text;
use mauve_hir::{Database, relative_path};
use mauve_ide::{Compared, Comparison, FigureChange, Figures};
use mauve_timing::{Level, Time};
use mauve_wcrt::Query;

use self::states::{State, states};
use crate::analysis_document::deployments;
use crate::cli::comparison::{
    Tolerance, comparison_document, comparison_markdown, comparison_table, escaped, tolerance,
};
use crate::cli::errors::missing;
use crate::cli::options::{Outside, level};
use crate::cli::text::counted;
use crate::harmless::harmless;
use crate::json;
use crate::output::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct Diff {
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
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people.
    Text,
    /// One document, with all figures.
    Json,
    /// For a pull request.
    Markdown,
}

impl Diff {
    pub(crate) fn run(self) -> Result<Output, String> {
        let states = states(self.first.as_deref(), self.second.as_deref())?;
        let [(before, errors_before), (after, errors_after)] = {
            let [before, after] = &states;
            [self.figures(before)?, self.figures(after)?]
        };
        if before.is_empty() && after.is_empty() {
            let what = match &self.deployment {
                Some(name) => format!("neither state has a deployment `{name}`: nothing to compare"),
                None => "neither state has a deployment: nothing to compare".to_owned(),
            };
            return Err(missing(what, errors_before.max(errors_after)));
        }
        let all = paired(before, after);
        let tolerance = |before: Time| self.tolerance.of(before);
        let is_worse = all.iter().any(|it| it.is_worse(&tolerance));
        let [before, after] = states.each_ref().map(State::name);
        let summary = summary(&all, &tolerance);
        let text = match self.format {
            Format::Text => {
                let (changed, same) = parts(&all);
                let mut parts = vec![format!("{before} → {after}: {summary}\n")];
                parts.extend(changed.into_iter().map(comparison_table));
                parts.extend(as_before(same).map(|it| it + "\n"));
                harmless(&parts.join("\n"))
            }
            Format::Markdown => {
                let (changed, same) = parts(&all);
                let mark = if is_worse { "❌" } else { "✅" };
                let mut parts = vec![format!("{mark} **Response times:** {summary}\n")];
                parts.extend(changed.into_iter().map(comparison_markdown));
                parts.extend(as_before(same).map(|it| it + "\n"));
                parts.push(format!("<sub>mauve diff: {} → {}</sub>\n", escaped(&before), escaped(&after)));
                harmless(&parts.join("\n"))
            }
            Format::Json => {
                let document = |it: &Comparison| {
                    json::object! {
                        root: it.after.as_ref().or(it.before.as_ref()).map(|it| it.root.clone()),
                        worse: it.is_worse(&tolerance),
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
        };
        Ok(Output::verbatim(text, u8::from(is_worse)))
    }

    /// Returns the figures of all deployments of a state, and the number of errors in it.
    fn figures(&self, state: &State) -> Result<(Vec<Figures>, usize), String> {
        let mut db = Database::default();
        let (workspaces, folder) = state.load(&mut db, self.outside.allow_outside)?;
        // The other state may have the deployment.
        let found = deployments(&db, &workspaces, self.deployment.as_deref()).unwrap_or_default();
        let figures = found.into_iter().map(|(project, deployment)| {
            let query = Query::at_level(&db, project, deployment, self.significance);
            let figures = Figures::of(&db, project, deployment, query);
            Figures { root: relative_path(&folder, &figures.root), ..figures }
        });
        Ok((figures.collect(), errors_of_text(&db, &workspaces)))
    }
}

/// Returns whether two figures are those of one deployment.
type IsPair<'a> = &'a dyn Fn(&Figures, &Figures) -> bool;

/// Pairs the deployments of two states: by project and name; those that are left, by name alone, as in a project that has moved; at
/// last the only one that is left on each side, if they have an activity in common. The others are new or gone.
fn paired(before: Vec<Figures>, after: Vec<Figures>) -> Vec<Comparison> {
    let mut old: Vec<Option<Figures>> = before.into_iter().map(Some).collect();
    let mut all: Vec<(Option<Figures>, Figures)> = after.into_iter().map(|after| (None, after)).collect();
    let is_same_project =
        |one: &Figures, other: &Figures| (&one.root, &one.deployment) == (&other.root, &other.deployment);
    let is_same_name = |one: &Figures, other: &Figures| one.deployment == other.deployment;
    let is_renamed = |one: &Figures, other: &Figures| {
        one.activities.iter().any(|it| other.activities.iter().any(|other| it.name == other.name))
    };
    let passes: [(IsPair<'_>, bool); 3] =
        [(&is_same_project, false), (&is_same_name, false), (&is_renamed, true)];
    for (is_pair, is_only) in passes {
        let left = [old.iter().flatten().count(), all.iter().filter(|(before, _)| before.is_none()).count()];
        if is_only && left != [1, 1] {
            continue;
        }
        for (before, after) in all.iter_mut().filter(|(before, _)| before.is_none()) {
            let found = old.iter_mut().find(|it| it.as_ref().is_some_and(|it| is_pair(it, after)));
            *before = found.and_then(Option::take);
        }
    }
    let both = all.into_iter().map(|(before, after)| Comparison::of(before, Some(after)));
    both.chain(old.into_iter().flatten().map(|gone| Comparison::of(Some(gone), None))).collect()
}

/// Returns the comparisons that show something, and the number of the others.
fn parts(all: &[Comparison]) -> (Vec<&Comparison>, usize) {
    let is_shown = |it: &&Comparison| !it.is_same() || it.was().is_some() || all.len() == 1;
    let shown: Vec<&Comparison> = all.iter().filter(is_shown).collect();
    let same = all.len() - shown.len();
    (shown, same)
}

fn as_before(same: usize) -> Option<String> {
    (same > 0).then(|| format!("{}: nothing changes", counted(same, "other deployment")))
}

/// Returns the verdict in words: `2 figures got worse (no longer met: nav; later: imu), 1 better`.
fn summary(all: &[Comparison], tolerance: &dyn Fn(Time) -> Time) -> String {
    let rows = || all.iter().flat_map(Comparison::rows);
    let worse = rows().filter(|it| it.is_worse(tolerance)).count();
    let is_better = |it: &&Compared| {
        matches!(it.change(), FigureChange::Met | FigureChange::Found | FigureChange::Earlier)
    };
    let better = rows().filter(is_better).count();
    let is_within = |it: &&Compared| it.change() == FigureChange::Later && !it.is_worse(tolerance);
    let within = rows().filter(is_within).count();
    let has_figure =
        |it: &Compared| it.after.as_ref().is_some_and(|it| it.time.is_some() || it.limit.is_some());
    let new = rows().filter(|it| it.change() == FigureChange::New && has_figure(it)).count();
    let figures = |count: usize| counted(count, "figure");
    let mut said = Vec::new();
    said.extend((worse > 0).then(|| format!("{} worse", figures(worse))));
    said.extend((within > 0).then(|| format!("{} later within the tolerance", figures(within))));
    said.extend((better > 0).then(|| format!("{} better", figures(better))));
    said.extend((new > 0).then(|| format!("{} new", figures(new))));
    let deployments = |of: &dyn Fn(&Comparison) -> bool| all.iter().filter(|it| of(it)).count();
    let gone = deployments(&|it| it.after.is_none());
    said.extend((gone > 0).then(|| format!("{} gone", counted(gone, "deployment"))));
    let unproved = deployments(&|it| it.after.as_ref().is_some_and(|it| it.errors > 0));
    said.extend(
        (unproved > 0)
            .then(|| format!("{} not proved, since there are errors", counted(unproved, "deployment"))),
    );
    if said.is_empty() { "nothing changes".to_owned() } else { said.join(", ") }
}
