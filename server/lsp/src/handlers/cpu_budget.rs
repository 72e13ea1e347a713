//! `mauve/cpuBudget`: what each instance of a deployment uses of its CPU, and what is left.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position`, `deployment`, `significance` | as in `mauve/schedule` |
//! | `drawing` | `"svg"` (if left out) or `"text"` |
//!
//! Of the result, `cpus` has the CPUs that are used. Of each, `parts` are what executes there, the largest `share` first, 1 being all of
//! a CPU; `figure` of an instance is its response time beside its deadline. `status` is `met`, `tight`, `missed` if the CPU is
//! overloaded, or `unknown` if the demand of an activity is not known.

use mauve_ide::{draw_budget, drawn_budget};
use mauve_projects::graph_document::budget_document;
use serde_json::Value;
use tower_lsp::jsonrpc::Result;

use super::DrawingParams;
use super::schedule::deployment;
use crate::snapshot::Snapshot;

/// Returns the CPU budget of a deployment.
pub(crate) fn cpu_budget(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    let of = deployment(snapshot, params)?;
    let budget = drawn_budget(&snapshot.db, of, snapshot.settings.hints.tight_slack);
    let mut document = budget_document(&snapshot.db, of, &budget);
    document["unit"] = "ms".into();
    document["reasons"] = Vec::<Value>::new().into();
    document["incomplete"] = snapshot.has_syntax_errors(of.0).into();
    document["drawing"] = draw_budget(&budget, params.drawing()).into();
    Ok(document)
}
