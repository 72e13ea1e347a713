//! The graph of an architecture or a deployment as one JSON document, for `mauve graph --format json` and the editors'
//! `mauve/graph`; its CPU budget, for `mauve graph --cpus` and `mauve/cpuBudget`.

use mauve_diagnostics::timing_reason;
use mauve_hir::{Database, Decl, Project, hosts_of};
use mauve_ide::{DrawnBudget, DrawnCpu, Graph, GraphEdge, GraphNode};
use mauve_wcrt::Query;
use serde_json::{Value, json};

use crate::analysis_document::{cpu_document, milliseconds};

/// Returns the document of `graph`, which is that of `of`.
pub fn graph_document<'db>(
    db: &'db Database,
    (project, of): (Project<'db>, Decl<'db>),
    query: Query,
    graph: &Graph<'db>,
) -> Value {
    let hosts = hosts_of(db, project.workspace(db));
    let node = |node: &GraphNode<'db>| {
        let activity = node.activity;
        json!({
            "instance": node.instance.to_string(),
            "component": node.component.to_string(),
            "host": node.host.as_ref().map(ToString::to_string),
            "load": node.load,
            "affinity": activity.and_then(|it| it.cpus).map(|cpus| hosts.local(cpus).1),
            "priority": activity.and_then(|it| it.priority.real_time()),
            "period": activity.and_then(|it| it.period).map(milliseconds),
            "deadline": activity.and_then(|it| it.deadline).map(milliseconds),
            "own": activity.and_then(|it| it.own).map(milliseconds),
            "response": activity.and_then(|it| it.response).map(milliseconds),
            "figure": activity.map(|_| &node.figure),
            "status": activity.map(|it| it.verdict.name()),
            "reasons": activity.map(|it| mauve_diagnostics::reasons_of(db, it)).unwrap_or_default(),
            "place": node.place,
            "lit": node.is_lit,
        })
    };
    let edge = |edge: &GraphEdge<'db>| {
        json!({
            "source": edge.source.0,
            "sourceFeature": edge.source.1.to_string(),
            "target": edge.target.0,
            "targetFeature": edge.target.1.to_string(),
            "operation": edge.operation,
            "place": edge.place,
            "lit": edge.is_lit,
        })
    };
    let cpus = graph.report.into_iter();
    let cpus = cpus.flat_map(|report| report.cpus.iter().map(|it| cpu_document(&report.hosts, it)));
    let of_report = graph.report.into_iter().flat_map(|report| &report.not_analysed);
    let missing = graph.missing.iter().cloned();
    json!({
        "name": of.name(db).to_string(),
        "root": project.root(db).path(db).display().to_string(),
        "unit": "ms",
        "times": graph.report.and_then(|report| report.times.as_ref()).map(ToString::to_string),
        "significance": graph.report.map(|_| query.level.as_f64()),
        "nodes": graph.nodes.iter().map(node).collect::<Vec<_>>(),
        "edges": graph.edges.iter().map(edge).collect::<Vec<_>>(),
        "cpus": cpus.collect::<Vec<_>>(),
        "lost": missing.chain(of_report.map(|lost| timing_reason(db, &lost.reason))).collect::<Vec<_>>(),
    })
}

/// Returns the document of the CPU budget of a deployment. Shares are parts of one CPU.
pub fn budget_document<'db>(
    db: &'db Database,
    (project, of, query): (Project<'db>, Decl<'db>, Query),
    budget: &DrawnBudget<'db>,
) -> Value {
    let hosts = hosts_of(db, project.workspace(db));
    let cpu = |it: &DrawnCpu<'db>| {
        let parts = it.parts.iter().map(|(part, figure)| {
            let is_instance = part.activity.is_some();
            json!({ "name": part.name.to_string(), "instance": is_instance, "share": part.share, "figure": figure })
        });
        let mut document = json!(cpu_document(hosts, it.load));
        document["name"] = it.name.clone().into();
        document["figure"] = it.figure.clone().into();
        document["status"] = it.status.name().into();
        document["left"] = (it.limit - it.used).into();
        document["parts"] = parts.collect();
        document
    };
    json!({
        "deployment": of.name(db).to_string(),
        "root": project.root(db).path(db).display().to_string(),
        "significance": query.level.as_f64(),
        "cpus": budget.cpus.iter().map(cpu).collect::<Vec<_>>(),
    })
}
