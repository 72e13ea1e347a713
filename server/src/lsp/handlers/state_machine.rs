//! `mauve/stateMachine`: the state machine of a component, with its times, its places, and a drawing.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position` | a place: the component that is declared there, or whose core, instance or activity is |
//! | `component` | instead of `position`: the name of a component of the file's projects |
//! | `significance` | a level; if left out, the one that is shown |
//! | `drawing` | `"svg"` (if left out) or `"dot"` |
//!
//! Of the result, `source` and `target` are numbers of states, and `worstTrace` has numbers of edges. In the SVG, `data-state`,
//! `data-source` and `data-target` hold the numbers of states. A state has the programs that its periods execute first, in
//! `first`: `run` and the guards. An edge executes as many of them as its `first` says, then the programs of `then`. `assumed`
//! has the codels whose times are assumed. Without times, there are `reasons`, and no drawing.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ProgramId, Project, names_of, project_files, projects};
use mauve_ide::{Drawing, component_at, draw_state_machine, state_machine as machine_of};
use mauve_timing::Time;
use mauve_wcrt::Query;
use serde::Deserialize;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::{Position, TextDocumentIdentifier};

use super::analysis::read_level;
use crate::analysis_document::milliseconds;
use crate::lsp::snapshot::Snapshot;
use crate::lsp::to_proto;

/// The parameters of `mauve/stateMachine`.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct StateMachineParams {
    text_document: TextDocumentIdentifier,
    position: Option<Position>,
    component: Option<String>,
    significance: Option<f64>,
    #[serde(default)]
    drawing: AskedDrawing,
}

/// The format of a drawing.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum AskedDrawing {
    #[default]
    Svg,
    Dot,
}

impl From<AskedDrawing> for Drawing {
    fn from(asked: AskedDrawing) -> Drawing {
        match asked {
            AskedDrawing::Svg => Drawing::Svg,
            AskedDrawing::Dot => Drawing::Dot,
        }
    }
}

/// Returns the state machine of a component.
pub(crate) fn state_machine(snapshot: &Snapshot, params: &StateMachineParams) -> Result<Value> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (project, component) = component_of(snapshot, params)?;
    let level = match params.significance {
        Some(level) => read_level(level)?,
        None => Query::shown(db, project).level,
    };
    let view = machine_of(db, project, component, level);
    let location = |at: &Option<_>| at.as_ref().and_then(|at| to_proto::location(snapshot, at));
    let programs = |all: &[(ProgramId, Option<Time>)]| -> Vec<Value> {
        let program = |(program, time): &(ProgramId, Option<Time>)| json!({ "program": program.to_string(), "time": time.map(milliseconds) });
        all.iter().map(program).collect()
    };
    let states = view.states.iter().map(|state| {
        json!({
            "name": state.name.to_string(),
            "initial": state.initial,
            "first": programs(&state.first),
            "location": location(&state.at),
        })
    });
    let edges = view.edges.iter().map(|edge| {
        json!({
            "source": edge.source,
            "target": edge.target,
            "transition": edge.transition.as_ref().map(ToString::to_string),
            "time": edge.time.map(milliseconds),
            "first": edge.first,
            "then": programs(&edge.then),
            "location": location(&edge.at),
        })
    });
    let name = component.name(db).to_string();
    let assumed = view.psm.into_iter().flat_map(|psm| &psm.assumed).map(|(codel, _)| codel.as_str());
    Ok(json!({
        "component": name,
        "unit": "ms",
        "significance": level.as_f64(),
        "states": states.collect::<Vec<_>>(),
        "edges": edges.collect::<Vec<_>>(),
        "worstTrace": view.worst_trace,
        "assumed": assumed.collect::<Vec<_>>(),
        "reasons": view.reasons,
        "drawing": view.psm.map(|psm| draw_state_machine(&name, level, psm, params.drawing.into())),
    }))
}

fn component_of<'db>(
    snapshot: &'db Snapshot,
    params: &StateMachineParams,
) -> Result<(Project<'db>, Decl<'db>)> {
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    if let Some(name) = &params.component {
        let all = snapshot.workspaces.iter().flat_map(|&workspace| projects(db, workspace));
        for &project in all.filter(|project| project_files(db, **project).contains(&file)) {
            let of = |decl: &&Decl<'db>| {
                decl.kind(db) == Kind::Component
                    && (*decl.name(db) == *name.as_str() || decl.qualified(db) == *name)
            };
            if let Some(&component) = names_of(db, project).all.iter().find(of) {
                return Ok((project, component));
            }
        }
        return Err(Error::invalid_params(format!("no component `{name}` in the projects of this file")));
    }
    let Some(position) = params.position else {
        return Err(Error::invalid_params("mauve/stateMachine takes a `position` or a `component`"));
    };
    let offset = lines.offset(position);
    component_at(db, &snapshot.workspaces, file, offset)
        .ok_or_else(|| Error::invalid_params("no component, instance or activity here"))
}
