//! `mauve/probability`: how probable it is that activities of a deployment are late.
//!
//! Its parameters are those of `mauve/schedule`, without a level. Of the result, `instances` has the activities with a probability;
//! `missPerHour` is that of a late job in an hour, `missPerJob` that of one job that is late after one that was not, or null, and both
//! hold under the `conditions`; `figures` has both in words. The drawing is that of `instance`: the one that is asked for, otherwise
//! the one that is late with the greatest probability. Without a drawing, there are `reasons`. `incomplete` is whether a text has
//! syntax errors.

use mauve_diagnostics::{late_at_most, miss_conditions, not_independent, probability_rounded_up};
use mauve_ide::draw_probability;
use mauve_wcrt::{Query, probabilities_of, response_times};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;

use super::DrawingParams;
use super::schedule::{activities, asked, deployment};
use crate::snapshot::Snapshot;

/// Returns how probable it is that the activities of a deployment are late.
pub(crate) fn probability(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    let (project, of, _) = deployment(snapshot, params)?;
    let db = &snapshot.db;
    let report = response_times(db, project, of, Query::shown(db, project, of));
    let probabilities = probabilities_of(db, project, of);
    let known =
        || report.activities.iter().zip(probabilities).filter_map(|(it, found)| Some((it, found.as_ref()?)));
    let instances = known().map(|(it, found)| {
        json!({
            "instance": it.instance.to_string(),
            "missPerHour": found.per_hour,
            "missPerJob": found.per_job,
            "figures": Vec::from([Some(found.per_hour), found.per_job].map(|it| it.map(probability_rounded_up))),
            "rule": found.rule(),
            "words": late_at_most(found),
            "conditions": miss_conditions(found),
            "reason": not_independent(found),
            "status": it.verdict.name(),
        })
    });
    let is_known = |index: &usize| probabilities.get(*index).is_some_and(Option::is_some);
    let greatest = || {
        let greatest =
            known().reduce(|one, other| if other.1.per_hour > one.1.per_hour { other } else { one })?.0;
        report.activities.iter().position(|it| it.instance == greatest.instance)
    };
    let index = asked(snapshot, params, of, &report.activities)?.filter(is_known).or_else(greatest);
    let drawing = index.and_then(|index| draw_probability(db, project, of, index, params.drawing()));
    let reason = drawing
        .is_none()
        .then(|| format!("no time of an analysed activity of {} depends on the level", of.name(db)));
    Ok(json!({
        "deployment": of.name(db).to_string(),
        "instance": index.and_then(|it| report.activities.get(it)).map(|it| it.instance.to_string()),
        "instances": instances.collect::<Vec<_>>(),
        "activities": activities(snapshot, report),
        "reasons": Vec::from_iter(reason),
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": drawing,
    }))
}
