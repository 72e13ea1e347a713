//! `mauve/schedule`: the schedule behind the response time of an instance, from its critical instant on.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position` | a place: the activity there, or an activity of the deployment there; without `position`, of the deployments of the file or of its project |
//! | `deployment` | instead of `position`: the name of a deployment of the file's project |
//! | `instance` | the instance; if left out, the one of the activity at `position`, otherwise the one with the greatest response time as a part of its deadline |
//! | `significance` | a level; if left out, the one that is shown |
//! | `drawing` | `"svg"` (if left out), `"narrow"` (as SVG) or `"text"` |
//! | `columns` | of a `"text"`: how wide it may be; any width if left out |
//!
//! Of the result, `instances` has the instances of the deployment; `response` is null where it is unknown. `bound` is
//! the response time of `instance`, `response` that of the schedule, and `note` says how they compare. In the SVG,
//! `data-activity` holds the index of an activity in `activities`. Without a schedule, there are `reasons`, and no drawing.
//! `incomplete` is whether a text has syntax errors.

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::{reasons_of, times_of};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, Project};
use mauve_ide::{GraphsOf, WorstOf, draw_schedule, end_of_item, no_worst_case};
use mauve_projects::analysis_document::milliseconds;
use mauve_wcrt::{ActivityReport, DeployedTasks, Query, Report, response_times};
use salsa::Database as _;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use super::graph::selected;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// The most events of a schedule: more are too many for a drawing.
const MOST_EVENTS: u64 = 50_000;

/// Returns the schedule behind a response time.
pub(crate) fn schedule(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    let (project, of, query) = deployment(snapshot, params)?;
    let db = &snapshot.db;
    let report = response_times(db, project, of, query);
    let activity =
        asked(snapshot, params, of, &report.activities)?.or_else(|| least_slack(&report.activities));
    let tight_slack = snapshot.settings.hints.tight_slack;
    let instances = report.activities.iter().zip(report.footings());
    let instances = instances.map(|(it, footing)| {
        let figure = figure(db, it, footing, tight_slack);
        json!({
            "instance": it.instance.to_string(),
            "response": it.response.map(milliseconds),
            "deadline": it.deadline.map(milliseconds),
            "figure": figure.text(),
            "status": it.verdict.name(),
        })
    });
    let name = of.name(db).to_string();
    let mut document = json!({
        "deployment": name,
        "instance": null,
        "instances": instances.collect::<Vec<_>>(),
        "significance": query.level.as_f64(),
        "unit": "ms",
        "response": null,
        "bound": null,
        "note": null,
        "activities": activities(snapshot, report),
        "reasons": [],
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": null,
    });
    let Some((index, of_activity)) = activity.and_then(|index| Some((index, report.activities.get(index)?)))
    else {
        document["reasons"] = json!([format!("no activity of {name} has a response time")]);
        return Ok(document);
    };
    document["instance"] = of_activity.instance.to_string().into();
    document["bound"] = json!(of_activity.response.map(milliseconds));
    let deployment = DeployedTasks::simulated(db, project, of, query.level);
    let interrupt = || db.unwind_if_revision_cancelled();
    match WorstOf::of(&deployment, index, query, &interrupt) {
        Ok(worst) => {
            let schedule = worst.schedule(&deployment, MOST_EVENTS, &interrupt);
            let tight_slack = snapshot.settings.hints.tight_slack;
            let note = worst.description(&deployment, &schedule, tight_slack);
            let title = format!("{name} at {}{}: {note}", query.level, times_of(report.times.as_deref()));
            document["response"] = json!(worst.response(&schedule).map(milliseconds));
            document["note"] = note.into();
            let shown = (&schedule, &[][..], Some((&worst, tight_slack)));
            document["drawing"] =
                draw_schedule(&title, &deployment, shown, params.drawing(), &interrupt).into();
        }
        Err(why) => {
            let why = no_worst_case(why, &of_activity.instance, &name);
            document["reasons"] = std::iter::once(why).chain(reasons_of(db, of_activity)).collect();
        }
    }
    Ok(document)
}

/// Returns the activities with their numbers, as drawings have them.
pub(super) fn activities(snapshot: &Snapshot, report: &Report<'_>) -> Vec<Value> {
    let location = |it: &ActivityReport<'_>| it.at.as_ref().and_then(|at| to_proto::location(snapshot, at));
    let activities = report.activities.iter().enumerate();
    let document = |(index, it): (usize, &ActivityReport<'_>)| json!({ "index": index, "instance": it.instance.to_string(), "location": location(it) });
    activities.map(document).collect()
}

/// Returns the deployment with this name, or at this position, of a document, and what is asked about it.
pub(super) fn deployment<'db>(
    snapshot: &'db Snapshot,
    params: &DrawingParams,
) -> Result<(Project<'db>, Decl<'db>, Query)> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let mut selections: Vec<GraphsOf<'_>> = Vec::new();
    match (&params.deployment, params.position) {
        (Some(name), _) => selections.push(GraphsOf::Name(name)),
        // Elsewhere in the file, a position selects no deployment.
        (None, Some(position)) => selections.extend([GraphsOf::At(lines.offset(position)), GraphsOf::File]),
        (None, None) => selections.push(GraphsOf::File),
    }
    let mut refusal = None;
    for selection in selections {
        match selected(snapshot, file, selection) {
            Ok(found) => {
                let is_deployment = |(_, of): &(Project<'db>, Decl<'db>)| of.kind(db) == Kind::Deployment;
                if let Some((project, of)) = found.into_iter().find(is_deployment) {
                    return Ok((project, of, Query::at_level(db, project, of, params.significance)));
                }
            }
            Err(why) => refusal = Some(why),
        }
    }
    Err(Error::invalid_params(refusal.unwrap_or_else(|| "no deployment here".to_owned())))
}

/// Returns the index of the activity that is asked for: by its name, otherwise at the position.
pub(super) fn asked(
    snapshot: &Snapshot,
    params: &DrawingParams,
    of: Decl<'_>,
    activities: &[ActivityReport<'_>],
) -> Result<Option<usize>> {
    let Some(name) = &params.instance else { return at_position(snapshot, params, of, activities) };
    let found = activities.iter().position(|it| it.instance == *name.as_str());
    let none = || Error::invalid_params(format!("no activity `{name}` in {}", of.name(&snapshot.db)));
    found.map(Some).ok_or_else(none)
}

/// Returns the index of the activity at the position: the last one that begins before it.
fn at_position(
    snapshot: &Snapshot,
    params: &DrawingParams,
    of: Decl<'_>,
    activities: &[ActivityReport<'_>],
) -> Result<Option<usize>> {
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let Some(position) = params.position.filter(|_| of.file(db) == file) else { return Ok(None) };
    let offset = end_of_item(db, file, lines.offset(position));
    // Activities of other files, or without a place of their own, are not here.
    let starts = activities.iter().enumerate().filter_map(|(index, activity)| {
        let at = activity.at.as_ref()?.range_in(db, file)?;
        Some((at.start(), index)).filter(|(start, _)| *start <= offset)
    });
    Ok(starts.max().map(|(_, index)| index))
}

/// Returns the index of the activity with the greatest response time as a part of its deadline.
fn least_slack(activities: &[ActivityReport<'_>]) -> Option<usize> {
    let parts = activities.iter().enumerate().filter_map(|(index, it)| Some((it.used()?, index)));
    parts.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, index)| index)
}
