//! `mauve/graph`: the instances of an architecture and what connects them; of a deployment, with loads and response times.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument` | a file: a model, a timing table or `mauve.toml` |
//! | `position` | a position in a deployment or an architecture, which is selected; if left out, the deployments of the file, else its architectures, else those of its project |
//! | `name` | instead of `position`: the name of a deployment or architecture of the file's project |
//! | `chain` | the name of a chain, to light in each deployment that has it: its nodes and edges are `lit` |
//! | `significance` | a level; if left out, the one that is shown |
//! | `drawing` | `"svg"` (if left out), `"narrow"` (as SVG, one below the other), `"dot"` or `"text"` |
//! | `columns` | of a `"text"`: how wide it may be; any width if left out |
//!
//! The result is a list with a document for each selected deployment or architecture, at least one; for a table or `mauve.toml`,
//! for those of each project that has it. `root` is the path of the project's root and `name` that of the deployment or architecture, as in `mauve/analysis`.
//!
//! Of each, `source` and `target` are numbers of nodes, as are `data-instance`, `data-source` and `data-target` in the SVG;
//! `data-edge` holds the number of an edge. `location` is that of an instance or a connection, `activity` that of the activity.
//! `load` is the share of a CPU, 1 being all of it; `status` is that of `mauve wcrt --format json`, and of CPUs
//! `met`, `tight`, `missed` or `unknown`. Only deployments have a
//! `significance`, `cpus`, a `verdict` (as in `mauve/status`) and what concerns times; a deployment whose architecture is unknown has no graph. `lost` has the
//! reasons why something may be missing. `tree` lists the instances below their CPUs, in lines of text. `incomplete` is whether a
//! text has syntax errors, such as one that is being typed.

use mauve_hir::{Decl, File, Location, Project};
use mauve_ide::{GraphsOf, cpu_status, draw_graph, graph as graph_of, instance_tree, selected_graphs};
use mauve_projects::analysis_document::Deployed;
use mauve_projects::graph_document::graph_document;
use mauve_projects::verdict::Verdict;
use mauve_wcrt::Query;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the graphs of the architectures or deployments that the parameters select.
pub(crate) fn graph(snapshot: &Snapshot, params: &DrawingParams) -> Result<Vec<Value>> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let selection = match (&params.name, params.position) {
        (Some(name), _) => GraphsOf::Name(name),
        (None, Some(position)) => GraphsOf::At(lines.offset(position)),
        (None, None) => GraphsOf::File,
    };
    let selected = selected(snapshot, file, selection).map_err(Error::invalid_params)?;
    let documents: Vec<Value> = selected
        .iter()
        .filter_map(|&(project, of)| document(snapshot, project, of, params).transpose())
        .collect::<Result<_>>()?;
    match selected.first() {
        Some((_, of)) if documents.is_empty() => {
            Err(Error::invalid_params(format!("the architecture of {} is unknown", of.name(db))))
        }
        _ => Ok(documents),
    }
}

/// Returns the selected deployments or architectures of the projects that answer for a file, at least one.
///
/// # Errors
///
/// The reason why there is none, for the user.
pub(super) fn selected<'db>(
    snapshot: &'db Snapshot,
    file: File,
    selection: GraphsOf<'_>,
) -> std::result::Result<Vec<(Project<'db>, Decl<'db>)>, String> {
    let (mut found, mut refusal) = (Vec::new(), "this file is not part of any project".to_owned());
    for project in snapshot.answering(file) {
        match selected_graphs(&snapshot.db, project, file, selection) {
            Ok(all) => found.extend(all.into_iter().map(|of| (project, of))),
            Err(why) => refusal = why,
        }
    }
    if found.is_empty() { Err(refusal) } else { Ok(found) }
}

fn document(
    snapshot: &Snapshot,
    project: Project<'_>,
    of: Decl<'_>,
    params: &DrawingParams,
) -> Result<Option<Value>> {
    let db = &snapshot.db;
    let query = Query::at_level(db, project, of, params.significance);
    let Some(mut graph) = graph_of(db, project, of, query, snapshot.settings.hints.tight_slack) else {
        return Ok(None);
    };
    if let Some(chain) = &params.chain {
        graph.light(db, (project, of, query), chain);
    }
    let mut document = graph_document(db, (project, of), query, &graph);
    if graph.report.is_some() {
        let deployed = Deployed::of_model(db, project, of, std::iter::once(query));
        document["verdict"] = Verdict::of(&[deployed], snapshot.settings.hints.tight_slack).document(None);
    }
    let location = |at: &Location<'_>| json!(to_proto::location(snapshot, at));
    let nodes = document.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten();
    for (document, node) in nodes.zip(&graph.nodes) {
        let activity = node.activity.and_then(|activity| activity.at.as_ref());
        document["location"] = location(&node.at);
        document["activity"] = activity.map(location).into();
    }
    let cpus = document.get_mut("cpus").and_then(Value::as_array_mut).into_iter().flatten();
    for (document, load) in cpus.zip(graph.report.into_iter().flat_map(|report| &report.cpus)) {
        document["status"] = cpu_status(load, snapshot.settings.hints.tight_slack).1.name().into();
    }
    let edges = document.get_mut("edges").and_then(Value::as_array_mut).into_iter().flatten();
    for (document, edge) in edges.zip(&graph.edges) {
        document["location"] = location(&edge.at);
    }
    document["drawing"] = draw_graph(db, &graph, params.drawing()).into();
    document["tree"] = instance_tree(&graph).into();
    document["incomplete"] = snapshot.has_syntax_errors(project).into();
    Ok(Some(document))
}
