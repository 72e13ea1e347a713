//! `mauve wcrt --probability`: how probable it is that an activity is late.

use std::collections::{BTreeMap, BTreeSet};

use mauve_diagnostics::{miss_conditions, not_independent, probability_rounded_up, times_of};
use mauve_ide::{Drawing, draw_probability};
use mauve_projects::analysis_document::Deployed;
use mauve_wcrt::{ActivityReport, MissProbability};

use crate::text::Sheet;

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
    let rows: Vec<_> = of(it, only).collect();
    if rows.is_empty() {
        return format!(
            "\n{}: no probabilities: no time of an analysed activity depends on the level\n",
            it.name
        );
    }
    let cell = |probability: Option<f64>| probability.map_or_else(|| "—".to_owned(), probability_rounded_up);
    let mut out = format!("\n{}: probability of a late job, at most{}\n", it.name, times_of(it.times()));
    out += &Sheet::of(&rows)
        .column("instance", |(_, activity, _)| activity.instance.to_string())
        .column("in an hour", |(.., found)| cell(Some(found.per_hour)))
        .column("of a job", |(.., found)| cell(found.per_job))
        .column("rule", |(.., found)| found.rule().to_owned())
        .column("met at", |(.., found)| found.level.map_or_else(|| "—".to_owned(), |it| it.to_string()))
        .text();
    let conditions: BTreeSet<String> = rows.iter().flat_map(|(.., found)| miss_conditions(found)).collect();
    let mut reasons: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (_, activity, found) in &rows {
        if let Some(why) = not_independent(found) {
            reasons.entry(why).or_default().push(&activity.instance);
        }
    }
    let reasons = reasons.iter().map(|(why, instances)| format!("{}: {why}", instances.join(", ")));
    let conditions = conditions.iter().map(|it| format!("if {it}"));
    out.extend(conditions.chain(reasons).map(|line| format!("  {line}\n")));
    out
}

/// Returns a line for each activity.
pub(super) fn probability_csv(
    all: &[Deployed<'_>],
    only: &str,
    root: &dyn Fn(&Deployed<'_>) -> String,
) -> String {
    let rows = all.iter().flat_map(|it| of(it, only).map(move |(_, activity, found)| (it, activity, found)));
    Sheet::of(&rows.collect::<Vec<_>>())
        .column("deployment", |(it, ..)| it.name.to_owned())
        .column("instance", |(_, activity, _)| activity.instance.to_string())
        .column("miss_per_hour", |(.., found)| format!("{:e}", found.per_hour))
        .column("miss_per_job", |(.., found)| found.per_job.map(|it| format!("{it:e}")).unwrap_or_default())
        .column("rule", |(.., found)| found.rule().to_owned())
        .column("met_at", |(.., found)| found.level.map(|level| level.to_string()).unwrap_or_default())
        .column("conditions", |(.., found)| {
            miss_conditions(found).into_iter().chain(not_independent(found)).collect::<Vec<_>>().join("; ")
        })
        .column("root", |(it, ..)| root(it))
        .csv()
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
    let drawn = greatest.and_then(|(it, index, _)| {
        let (project, deployment) = it.model()?;
        draw_probability(it.db, project, deployment, index, Drawing::Svg)
    });
    drawn.ok_or_else(|| "no activity has a probability: `mauve wcrt --probability` says why".to_owned())
}
