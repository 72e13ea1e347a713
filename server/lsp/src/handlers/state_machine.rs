//! `mauve/stateMachine`: the state machine of a component, with its times, its places, and a drawing.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position` | a place: the component that is declared there, or whose core, instance or activity is |
//! | `component` | instead of `position`: the name of a component of the file's project |
//! | `deployment` | instead of the deployment at `position`: the name of one, whose times are shown |
//! | `significance` | a level; if left out, the one that is shown |
//! | `drawing` | `"svg"` (if left out), `"dot"` or `"text"` |
//! | `columns` | of a `"text"`: how wide it may be; any width if left out |
//!
//! Of the result, `times` is the section of `mauve.toml` with the deployment's own timing tables, or null, and `otherTimes` has
//! those that other deployments use. `source` and `target` are numbers of states, and `worstTrace` has numbers of edges. In the
//! SVG, `data-state`, `data-source` and `data-target` hold the numbers of states, and `data-edge` those of edges. A state has the programs that its periods
//! execute first, in `first`: `run` and the guards. An edge executes as many of them as its `first` says, then the programs of
//! `then`. `assumed` has the codels whose times are assumed. Without times, there are `reasons`.
//! `incomplete` is whether a text has syntax errors.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ProgramId, names_of};
use mauve_ide::{MachineTitle, component_at, draw_state_machine, state_machine as machine_of};
use mauve_projects::analysis_document::milliseconds;
use mauve_timing::Time;
use mauve_wcrt::{TableSet, first_tables, level_shown, table_sets, tables_in, tables_of};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the state machine of a component.
pub(crate) fn state_machine(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (tables, component) = component_of(snapshot, params)?;
    let project = tables.project(db);
    let level = params.significance.unwrap_or_else(|| level_shown(db, project));
    let view = machine_of(db, tables, component, level);
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
    let times = tables.label(db);
    let others = table_sets(db, project).iter().filter(|it| **it != tables);
    let assumed = view.psm.into_iter().flat_map(|psm| &psm.assumed).map(|(codel, _)| codel.as_str());
    let title = MachineTitle { component: &name, level, times: times.as_deref() };
    let drawing = draw_state_machine(db, project.workspace(db), title, &view, params.drawing());
    Ok(json!({
        "component": name,
        "times": times,
        "otherTimes": others.map(|it| it.label(db)).collect::<Vec<_>>(),
        "unit": "ms",
        "significance": level.as_f64(),
        "states": states.collect::<Vec<_>>(),
        "edges": edges.collect::<Vec<_>>(),
        "worstTrace": view.worst_trace,
        "assumed": assumed.collect::<Vec<_>>(),
        "reasons": view.reasons,
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": drawing,
    }))
}

fn component_of<'db>(snapshot: &'db Snapshot, params: &DrawingParams) -> Result<(TableSet<'db>, Decl<'db>)> {
    let (tables, component) = place_of(snapshot, params)?;
    let Some(name) = &params.deployment else { return Ok((tables, component)) };
    let (db, project) = (&snapshot.db, tables.project(&snapshot.db));
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let named = deployments.filter(|it| it.is_called(db, name));
    let mut named = named.map(|it| (it, tables_of(db, project, it)));
    let refuse = |why: &str| Error::invalid_params(format!("{why} `{name}` in this project"));
    let (first, of_first) = named.next().ok_or_else(|| refuse("no deployment"))?;
    match named.all(|(_, other)| other == of_first) {
        true => {
            Ok((tables_in(db, project, first, component).first().copied().unwrap_or(of_first), component))
        }
        false => Err(refuse("several deployments with different timing tables")),
    }
}

fn place_of<'db>(snapshot: &'db Snapshot, params: &DrawingParams) -> Result<(TableSet<'db>, Decl<'db>)> {
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let project = snapshot.project(file);
    if let Some(name) = &params.component {
        let components = project.into_iter().flat_map(|it| names_of(db, it).of_kind(db, Kind::Component));
        let mut named = components.filter(|it| it.is_called(db, name));
        let found = project.zip(named.next());
        let found = found.map(|(project, component)| (first_tables(db, project, component), component));
        let refuse = || Error::invalid_params(format!("no component `{name}` in the project of this file"));
        return found.ok_or_else(refuse);
    }
    let Some(position) = params.position else {
        return Err(Error::invalid_params("mauve/stateMachine takes a `position` or a `component`"));
    };
    let offset = lines.offset(position);
    let found = project.and_then(|project| component_at(db, project, file, offset));
    found.ok_or_else(|| Error::invalid_params("no component, instance or activity here"))
}
