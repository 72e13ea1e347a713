//! `mauve wcrt --probability`: how probable it is that an activity is late.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use mauve_diagnostics::{miss_conditions, not_independent, probability_rounded_up, times_of};
use mauve_ide::{Drawing, draw_probability};
use mauve_projects::analysis_document::{Deployed, Origin};
use mauve_wcrt::{ActivityReport, MissProbability};

use crate::text::{columns, csv};

/// Returns the real-time activities of a deployment, those called `only` if that is given, with their probabilities, by their index.
fn of<'a, 'db>(
    it: &'a Deployed<'db>,
    only: &'a str,
) -> impl Iterator<Item = (usize, &'a ActivityReport<'db>, &'db MissProbability)> {
    let probabilities = it.probabilities();
    let activities = it.reports.first().into_iter().flat_map(|(_, report)| &report.activities);
    let all = activities.zip(probabilities).enumerate();
    let all = all.filter_map(|(index, (activity, found))| Some((index, activity, found.as_ref()?)));
    all.filter(move |(_, activity, _)| only.is_empty() || activity.instance == *only)
}

/// Returns a table, with what its figures depend on.
pub(super) fn probability_table(it: &Deployed<'_>, only: &str) -> String {
    let mut conditions: BTreeSet<String> = BTreeSet::new();
    let mut reasons: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let cell = |probability: Option<f64>| probability.map_or_else(|| "—".to_owned(), probability_rounded_up);
    let row = |(_, activity, found): (usize, &ActivityReport<'_>, &MissProbability)| {
        conditions.extend(miss_conditions(found).into_iter().map(|it| format!("if {it}")));
        if let Some(why) = not_independent(found) {
            reasons.entry(why).or_default().push(activity.instance.to_string());
        }
        let level = found.level.map_or_else(|| "—".to_owned(), |level| level.to_string());
        let (hour, job) = (cell(Some(found.per_hour)), cell(found.per_job));
        vec![activity.instance.to_string(), hour, job, found.rule().to_owned(), level]
    };
    let rows: Vec<Vec<String>> = of(it, only).map(row).collect();
    if rows.is_empty() {
        return format!(
            "\n{}: no probabilities: no time of an analysed activity depends on the level\n",
            it.name
        );
    }
    let mut out = format!("\n{}: probability of a late job, at most{}\n", it.name, times_of(it.times()));
    out += &columns(&["instance", "in an hour", "of a job", "rule", "met at"], &rows);
    let reasons = reasons.iter().map(|(why, instances)| format!("{}: {why}", instances.join(", ")));
    conditions.into_iter().chain(reasons).for_each(|line| _ = writeln!(out, "  {line}"));
    out
}

/// Returns a line for each activity.
pub(super) fn probability_csv(
    all: &[Deployed<'_>],
    only: &str,
    root: &dyn Fn(&Deployed<'_>) -> String,
) -> String {
    let header = "deployment,instance,miss_per_hour,miss_per_job,rule,met_at,conditions,root";
    let row = |it: &Deployed<'_>, activity: &ActivityReport<'_>, found: &MissProbability| {
        vec![
            it.name.to_owned(),
            activity.instance.to_string(),
            format!("{:e}", found.per_hour),
            found.per_job.map(|it| format!("{it:e}")).unwrap_or_default(),
            found.rule().to_owned(),
            found.level.map(|level| level.to_string()).unwrap_or_default(),
            miss_conditions(found).into_iter().chain(not_independent(found)).collect::<Vec<_>>().join("; "),
            root(it),
        ]
    };
    let rows =
        all.iter().flat_map(|it| of(it, only).map(move |(_, activity, found)| row(it, activity, found)));
    csv(header, rows.collect())
}

/// Draws the activity called `only`, otherwise the one that is late with the greatest probability.
///
/// # Errors
///
/// There is none.
pub(super) fn probability_svg(all: &[Deployed<'_>], only: &str) -> Result<String, String> {
    let found =
        all.iter().flat_map(|it| of(it, only).map(move |(index, _, found)| (it, index, found.per_hour)));
    let greatest = found.reduce(|one, other| if other.2 > one.2 { other } else { one });
    let drawn = greatest.and_then(|(it, index, _)| match it.origin {
        Origin::Model(tables) => {
            draw_probability(it.db, tables.project(it.db), it.declared?, index, Drawing::Svg)
        }
        Origin::File { .. } => None,
    });
    drawn.ok_or_else(|| "no activity has a probability: `mauve wcrt --probability` says why".to_owned())
}
