//! `mauve/graph`: the instances of an architecture and what connects them; of a deployment, with loads and response times.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument` | a file: a model, a timing table or `mauve.toml` |
//! | `position` | a place in the deployment or architecture that is meant; if left out, the deployments of the file, else its architectures, else those of its projects |
//! | `name` | instead of `position`: the name of a deployment or architecture of the file's projects |
//! | `significance` | a level; if left out, the one that is shown |
//! | `drawing` | `"svg"` (if left out) or `"dot"` |
//!
//! The result is a list, with a document for each that is meant in each project that has it, at least one. `root` is the path
//! of the project's root and `name` that of the deployment or architecture, as in `mauve/analysis`.
//!
//! Of each, `source` and `target` are numbers of nodes, as are `data-instance`, `data-source` and `data-target` in the SVG.
//! `load` is the share of a CPU, 1 being all of it; `status` is that of `mauve wcrt --format json`. Only deployments have a
//! `significance`, `cpus` and what concerns times; a deployment whose architecture is unknown has no graph.

use std::path::PathBuf;

use mauve_diagnostics::timing_reason;
use mauve_hir::{Decl, Project};
use mauve_ide::{GraphEdge, GraphNode, GraphsOf, draw_graph, graph as graph_of, graphs_meant};
use mauve_timing::Level;
use mauve_wcrt::Query;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::{Location, Position, TextDocumentIdentifier};

use super::analysis::read_level;
use super::state_machine::AskedDrawing;
use crate::analysis_document::milliseconds;
use crate::lsp::snapshot::Snapshot;
use crate::lsp::to_proto;

/// What is asked.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GraphParams {
    text_document: TextDocumentIdentifier,
    position: Option<Position>,
    name: Option<String>,
    significance: Option<f64>,
    #[serde(default)]
    drawing: AskedDrawing,
}

/// A graph; times are in `unit`.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GraphDocument {
    name: String,
    /// The root of its project.
    root: PathBuf,
    unit: &'static str,
    /// Of a deployment, the level of its response times.
    significance: Option<f64>,
    nodes: Vec<NodeDocument>,
    edges: Vec<EdgeDocument>,
    /// The load of each CPU.
    cpus: Vec<CpuDocument>,
    /// Why something may be missing.
    lost: Vec<String>,
    drawing: String,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct NodeDocument {
    instance: String,
    component: String,
    load: Option<f64>,
    affinity: Option<u64>,
    period: Option<Value>,
    deadline: Option<Value>,
    response: Option<Value>,
    status: Option<&'static str>,
    location: Option<Location>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct EdgeDocument {
    source: usize,
    source_feature: String,
    target: usize,
    target_feature: String,
    operation: bool,
    location: Option<Location>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct CpuDocument {
    mask: u64,
    utilisation: f64,
    complete: bool,
}

/// The graphs of the architectures or deployments that are meant.
pub(crate) fn graph(snapshot: &Snapshot, params: &GraphParams) -> Result<Vec<GraphDocument>> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let level = params.significance.map(read_level).transpose()?;
    let meant = meant(snapshot, params)?;
    let graphs =
        meant.iter().filter_map(|&(project, of)| document(snapshot, project, of, level, params.drawing));
    let graphs: Vec<GraphDocument> = graphs.collect();
    match meant.first() {
        Some((_, of)) if graphs.is_empty() => {
            Err(Error::invalid_params(format!("the architecture of {} is unknown", of.name(db))))
        }
        _ => Ok(graphs),
    }
}

fn document(
    snapshot: &Snapshot,
    project: Project<'_>,
    of: Decl<'_>,
    level: Option<Level>,
    drawing: AskedDrawing,
) -> Option<GraphDocument> {
    let db = &snapshot.db;
    let mut query = Query::shown(db, project);
    query.level = level.unwrap_or(query.level);
    let graph = graph_of(db, project, of, query)?;
    let node = |node: &GraphNode<'_>| {
        let activity = node.activity;
        NodeDocument {
            instance: node.instance.to_string(),
            component: node.component.to_string(),
            load: node.load,
            affinity: activity.and_then(|it| it.cpus),
            period: activity.and_then(|it| it.period).map(milliseconds),
            deadline: activity.and_then(|it| it.deadline).map(milliseconds),
            response: activity.and_then(|it| it.response).map(milliseconds),
            status: activity.map(|it| it.verdict.name()),
            location: to_proto::location(snapshot, &node.at),
        }
    };
    let edge = |edge: &GraphEdge<'_>| EdgeDocument {
        source: edge.source.0,
        source_feature: edge.source.1.to_string(),
        target: edge.target.0,
        target_feature: edge.target.1.to_string(),
        operation: edge.operation,
        location: to_proto::location(snapshot, &edge.at),
    };
    let cpus = graph.report.into_iter().flat_map(|report| &report.cpus).map(|cpu| CpuDocument {
        mask: cpu.mask,
        utilisation: cpu.utilisation.as_f64(),
        complete: cpu.complete,
    });
    let mut lost = graph.lost.clone();
    let of_report = graph.report.into_iter().flat_map(|report| &report.not_analysed);
    lost.extend(of_report.map(|it| timing_reason(db, &it.reason)));
    Some(GraphDocument {
        name: of.name(db).to_string(),
        root: project.root(db).path(db).clone(),
        unit: "ms",
        significance: graph.report.map(|_| query.level.as_f64()),
        nodes: graph.nodes.iter().map(node).collect(),
        edges: graph.edges.iter().map(edge).collect(),
        cpus: cpus.collect(),
        lost,
        drawing: draw_graph(&graph, drawing.into()),
    })
}

/// The deployments or architectures that are meant, in their projects.
fn meant<'db>(snapshot: &'db Snapshot, params: &GraphParams) -> Result<Vec<(Project<'db>, Decl<'db>)>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let meant = match (&params.name, params.position) {
        (Some(name), _) => GraphsOf::Name(name),
        (None, Some(position)) => GraphsOf::At(lines.offset(position)),
        (None, None) => GraphsOf::File,
    };
    graphs_meant(&snapshot.db, &snapshot.workspaces, file, meant).map_err(Error::invalid_params)
}
