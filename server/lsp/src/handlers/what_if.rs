//! `mauve/whatIf`: the figures of a deployment as they were beside those that it has now, or would have with other values.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position`, `deployment`, `significance` | as in `mauve/schedule` |
//! | `values` | other values, which the text does not have: `INSTANCE.FIELD=VALUE` or `CODEL=TIME`, as in `mauve wcrt --set`; may be left out |
//! | `before` | the state to compare with: what an earlier answer has; if left out, or that of another deployment, the text as it is |
//! | `drawing` | `"svg"` (if left out) or `"text"` |
//! | `columns` | of a `"text"`: how wide it may be; any width if left out |
//!
//! A wrong value is an error with a message for the user: a client keeps its last figures.
//!
//! Of the result, `rows` has the activities, and the chains that changed or have a limit; the drawing has the worst first. Of each, `figure` is
//! `✓ 53 → 47 / 100 ms`, `status` is `met`, `tight`, `missed`, `unknown` or `time`, `change` is that of `mauve wcrt --set --format json`
//! and `words` says it, `was` is its name before if it was renamed, and `location` is its activity,
//! or the name of the chain in `mauve.toml`. In the SVG, `data-row` holds the index of
//! a row. `cpus` has the utilisations. `verdict` says how many deadlines are met, `schedulable` whether all are proved now.
//!
//! A client keeps `before` as it is and sends it with the next requests, so that the figures are compared with those of the first
//! one. `edit` writes the values into the texts; null without values.

use mauve_ide::{
    Compared, Comparison, Figure, Figures, compared, draw_comparison, drawn_chains, what_if_change,
};
use mauve_projects::analysis_document::milliseconds;
use mauve_wcrt::response_times;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use super::schedule::deployment;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the figures of a deployment in two states.
pub(crate) fn what_if(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    let (project, of, query) = deployment(snapshot, params)?;
    let db = &snapshot.db;
    let change = what_if_change(db, (project, of, query), &params.values).map_err(Error::invalid_params)?;
    let found = compared(db, (project, of, query), &change).map_err(Error::invalid_params)?;
    let with_slack = |it: Figures| it.with_tight_slack(snapshot.settings.hints.tight_slack);
    let kept = params.before.as_ref().map(|text| serde_json::from_str::<Figures>(text)).transpose();
    let kept =
        kept.map_err(|error| Error::invalid_params(format!("`before` is not that of an answer: {error}")))?;
    let before = kept.filter(|it| it.deployment == of.qualified(db)).or(found.before);
    let comparison = Comparison::of(before.map(with_slack), found.after.map(with_slack));
    let report = response_times(db, project, of, query);
    let chains = drawn_chains(db, (project, of, query), None, snapshot.settings.hints.tight_slack);
    let location = |row: &Compared| {
        let name = row.name();
        let Some(activity) = report.activities.iter().find(|it| it.instance == name) else {
            let chain = chains.all.iter().find(|it| *it.name == *name)?;
            let (file, range) = chain.declared?;
            return snapshot.location(file, range);
        };
        to_proto::location(snapshot, activity.at.as_ref()?)
    };
    let figure = |it: &Figure| {
        json!({
            "figure": it.shown,
            "time": it.time.map(milliseconds),
            "limit": it.limit.map(milliseconds),
            "status": it.hint.name(),
            "reasons": it.reasons,
        })
    };
    let rows = comparison.drawn_rows().into_iter().map(|row| {
        json!({
            "name": row.name(),
            "was": row.was(),
            "figure": row.figure(),
            "status": row.status().name(),
            "change": row.change().name(),
            "words": row.words(),
            "before": row.before.as_ref().map(figure),
            "after": row.after.as_ref().map(figure),
            "location": location(row),
        })
    });
    let cpus = comparison
        .utilisations()
        .into_iter()
        .map(|(cpus, [before, after])| json!({ "cpus": cpus, "before": before, "after": after }));
    let title = format!("What if {}", params.values.join(", "));
    let edit = match params.values.as_slice() {
        [] => None,
        _ => to_proto::workspace_edit(snapshot, &change.with_line_ends(db), &title),
    };
    let text = |it: &Figures| serde_json::to_string(it).ok();
    Ok(json!({
        "deployment": of.name(db).to_string(),
        "significance": query.level.as_f64(),
        "unit": "ms",
        "verdict": comparison.verdict(),
        "schedulable": comparison.after.as_ref().is_some_and(Figures::schedulable),
        "rows": rows.collect::<Vec<_>>(),
        "cpus": cpus.collect::<Vec<_>>(),
        "before": comparison.before.as_ref().and_then(text),
        "edit": edit,
        "reasons": comparison.after.as_ref().map_or(&[][..], |it| &*it.not_analysed),
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": draw_comparison(&comparison, &params.values, params.drawing()),
    }))
}
