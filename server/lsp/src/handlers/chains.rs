//! `mauve/chains`: how long data takes along the chains of a deployment.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position`, `deployment`, `significance` | as in `mauve/schedule` |
//! | `drawing` | `"svg"` (if left out) or `"text"` |
//! | `columns` | of a `"text"`: how wide it may be; any width if left out |
//!
//! Of the result, `chains` has the declared chains, then those from each source to each effect. Of each, `figure` is its latency beside
//! its limit, `location` the name in `mauve.toml`, otherwise the activity of its first component, and `reasons` are why it has no
//! latency; `status` is `met`, `tight`, `missed`, `time` without a limit, or `unknown`. `hops` has the components of all
//! chains with a latency, in order: `chain` is the index of the chain, and `location` the connection to the component. In the SVG, `data-chain`
//! and `data-hop` hold indices in these lists. `leftOut` chains are too many.

use mauve_ide::{DrawnStep, draw_chains, drawn_chains};
use mauve_projects::analysis_document::milliseconds;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;

use super::DrawingParams;
use super::schedule::deployment;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the chains of a deployment.
pub(crate) fn chains(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    let (project, of, query) = deployment(snapshot, params)?;
    let db = &snapshot.db;
    let drawn = drawn_chains(db, (project, of, query), None, snapshot.settings.hints.tight_slack);
    let place = |step: &DrawnStep<'_>| step.at.as_ref().and_then(|at| to_proto::location(snapshot, at));
    let chains = drawn.all.iter().map(|chain| {
        let declared = chain.declared.and_then(|(file, range)| snapshot.location(file, range));
        json!({
            "name": chain.name,
            "figure": chain.figure,
            "status": chain.status.name(),
            "latency": chain.latency.map(milliseconds),
            "limit": chain.limit.map(milliseconds),
            "reasons": chain.reasons,
            "location": declared.or_else(|| chain.steps.first().and_then(place)),
        })
    });
    let steps =
        drawn.all.iter().enumerate().flat_map(|(index, chain)| chain.steps.iter().map(move |it| (index, it)));
    let hops = steps.map(|(chain, step)| {
        json!({
            "chain": chain,
            "instance": step.instance,
            "wait": milliseconds(step.part.wait),
            "buffer": milliseconds(step.part.buffer),
            "periods": milliseconds(step.part.periods),
            "run": milliseconds(step.part.run),
            "location": place(step),
        })
    });
    Ok(json!({
        "deployment": of.name(db).to_string(),
        "significance": query.level.as_f64(),
        "unit": "ms",
        "chains": chains.collect::<Vec<_>>(),
        "hops": hops.collect::<Vec<_>>(),
        "leftOut": drawn.left_out,
        "reasons": [],
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": draw_chains(&drawn, params.drawing()),
    }))
}
