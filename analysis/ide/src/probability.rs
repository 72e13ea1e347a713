//! How probable it is that an activity is late, as a drawing: its response times over the levels of the tables, and its deadline.

use std::fmt::Write as _;

use mauve_diagnostics::{late_at_most, miss_conditions, probability_rounded_up};
use mauve_hir::{Decl, ModelDb, Project};
use mauve_wcrt::{MissProbability, Query, probabilities_of, response_times};

use crate::drawing::Drawing;
use crate::probability_plot::{Plot, PlotPoint};

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
    if drawing != Drawing::Svg {
        return Some(text(&title, probability, query));
    }
    let known = probability.levels.iter().filter_map(|(level, time, late)| Some((level, (*time)?, *late)));
    let points = known.map(|(level, time, late)| PlotPoint {
        time,
        probability: late,
        label: format!("{time} at {level}"),
        title: format!(
            "{time} at {level}: in an hour, a job responds later with a probability of at most {}",
            probability_rounded_up(late)
        ),
        is_shown: *level == query.level,
    });
    let (points, axis) = (points.collect(), "response time in ms; probability of a longer one in an hour");
    let plot = Plot { title, axis, points, deadline: report.deadline, curve: &[] };
    Some(plot.svg())
}

fn text(title: &str, of: &MissProbability, query: Query) -> String {
    let mut out = format!("{title}\n\n");
    for (level, time, late) in &of.levels {
        let time = time.map_or_else(|| "no bound".to_owned(), |time| format!("≤ {time}"));
        let mark = if *level == query.level { " (current level)" } else { "" };
        let late = probability_rounded_up(*late);
        let _ =
            writeln!(out, "{:>8}  {time}, longer in an hour with at most {late}{mark}", level.to_string());
    }
    out.extend(miss_conditions(of).iter().map(|it| format!("if {it}\n")));
    out
}
