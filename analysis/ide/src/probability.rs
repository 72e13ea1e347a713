//! How probable it is that an activity is late, as a drawing: its response times over the levels of the tables, and its deadline.

use std::fmt::Write as _;

use mauve_diagnostics::{late_at_most, miss_conditions, not_independent, probability_rounded_up};
use mauve_hir::{Decl, ModelDb, Project};
use mauve_timing::{ObservedTimes, Time};
use mauve_wcrt::{
    MissProbability, Query, distribution_of, observed_responses, probabilities_of, response_times, system_of,
};

use crate::drawing::Drawing;
use crate::probability_plot::{PlotLine, PlotPoint, ProbabilityPlot, plot_width};
use crate::text_canvas::in_columns;

/// Draws how probable it is that the activity of this index is late; `None` where that is unknown, or no time depends on the level.
pub fn draw_probability<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    activity: usize,
    drawing: Drawing,
) -> Option<String> {
    let query = Query::shown(db, project, deployment);
    let report = response_times(db, project, deployment, query).activities.get(activity)?;
    let probability = probabilities_of(db, project, deployment).get(activity)?.as_ref()?;
    let title = format!("{} of {}: {}", report.instance, deployment.name(db), late_at_most(probability));
    if !matches!(drawing, Drawing::Svg | Drawing::Narrow) {
        return Some(text(&title, probability, query, drawing.columns()));
    }
    let known = || probability.levels.iter().filter_map(|(level, time, late)| Some((level, (*time)?, *late)));
    let points = known().map(|(level, time, late)| PlotPoint {
        time,
        probability: late,
        label: format!("{time} at {level}"),
        title: format!(
            "{time} at {level}: in an hour, a job responds later with a probability of at most {}",
            probability_rounded_up(late)
        ),
        is_shown: *level == query.level,
    });
    let distribution = distribution_of(db, project, deployment, activity);
    let hour = distribution.iter().map(|it| (it.time, it.per_hour));
    let job = distribution.iter().filter_map(|it| Some((it.time, it.per_job?)));
    let tables = system_of(db, project, deployment).activities.get(activity)?.tables;
    let seen = observed_responses(db, tables, &report.instance);
    let observed = format!("observed: at most this share of {} jobs", seen.executions);
    let levels = known().map(|(_, time, late)| (time, late));
    let lines = [
        (
            "wire",
            "a job that responds later, in an hour, by the levels of the tables alone".to_owned(),
            levels.collect(),
        ),
        ("curve", "a job that responds later, in an hour".to_owned(), hour.collect()),
        ("curve call", "one job, and the one before it ended within its period".to_owned(), job.collect()),
        ("seen", observed, shares(&seen)),
    ];
    let lines = lines.into_iter().filter(|(_, _, points): &PlotLine| !points.is_empty());
    let (points, lines) = (points.collect(), lines.collect());
    Some(
        ProbabilityPlot {
            title,
            axis: "response time in ms",
            upright: "probability in an hour",
            points,
            width: plot_width(drawing),
            deadline: report.deadline,
            level: None,
            lines,
        }
        .svg(),
    )
}

/// Returns the stairs of an observed distribution, which end at the greatest response time.
fn shares(seen: &ObservedTimes) -> Vec<(Time, f64)> {
    let share = |number: i32| if number == 0 { 0.5 } else { 10_f64.powi(-number) };
    let all = seen.later.iter().zip((0..).map(share)).map(|(time, share)| (*time, share));
    // Of one more job, the recording says nothing.
    let greatest = (seen.greatest, 1.0 / seen.executions.max(1) as f64);
    let all = all.chain((seen.executions > 0).then_some(greatest));
    all.map(|(time, share)| (Time::from_nanos(time), share)).collect()
}

fn text(title: &str, of: &MissProbability, query: Query, columns: Option<usize>) -> String {
    let mut out = in_columns(title, columns, "  ") + "\n\n";
    for (level, time, late) in &of.levels {
        let time = time.map_or_else(|| "no bound".to_owned(), |time| format!("≤ {time}"));
        let mark = if *level == query.level { " (current level)" } else { "" };
        let late = probability_rounded_up(*late);
        let _ =
            writeln!(out, "{:>8}  {time}, longer in an hour with at most {late}{mark}", level.to_string());
    }
    let conditions = miss_conditions(of);
    let conditions = conditions.iter().map(|it| format!("if {it}")).chain(not_independent(of));
    out.extend(conditions.map(|it| in_columns(&it, columns, "  ") + "\n"));
    out
}
