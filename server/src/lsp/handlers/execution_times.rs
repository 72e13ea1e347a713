//! `mauve/executionTimes`: the execution times of a codel at the significance levels of the timing tables.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position` | a place: the codel that is declared, called or timed there |
//! | `codel` | instead of `position`: the name of a codel of the file's project |
//! | `drawing` | `"svg"` (if left out) or `"text"` |
//!
//! Of the result, `codels` has the names of all codels of the project, `levels` the times from the most probable level on, each
//! with the `verdict` on the deployments of the project at that level, as in `mauve/status`. `evidence` says what was measured,
//! `source` is the section of `mauve.toml` with the timing tables, or null, and `assumed` says that no table has a time. In the
//! SVG, `data-level` holds the index of a level. `reasons` say why times are missing. `incomplete` is whether a text has
//! syntax errors.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Location, names_of};
use mauve_ide::{CodelOf, draw_exceedance, exceedance, selected_codel};
use mauve_timing::Level;
use mauve_wcrt::Query;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use crate::analysis_document::{Deployed, deployments_of, milliseconds};
use crate::lsp::snapshot::Snapshot;
use crate::lsp::to_proto;
use crate::verdict::Verdict;

/// Returns the execution times of a codel.
pub(crate) fn execution_times(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let (selection, refusal) = match (&params.codel, params.position) {
        (Some(name), _) => (CodelOf::Name(name), format!("no codel `{name}` in the project of this file")),
        (None, Some(position)) => (CodelOf::At(lines.offset(position)), "no codel here".to_owned()),
        (None, None) => {
            return Err(Error::invalid_params("mauve/executionTimes takes a `position` or a `codel`"));
        }
    };
    let mut projects = snapshot.answering(file).into_iter();
    let found = projects.find_map(|project| Some((project, selected_codel(db, project, file, selection)?)));
    let (project, codel) = found.ok_or_else(|| Error::invalid_params(refusal))?;
    let times = exceedance(db, project, codel);
    let levels = times.levels.iter();
    let tight_slack = snapshot.settings.hints.tight_slack;
    let verdict = |level: Level| {
        let deployed = deployments_of(db, project).map(|of| {
            let query = Query::at_level(db, project, of, Some(level));
            Deployed::of_model(db, project, of, std::iter::once(query))
        });
        Verdict::of(&deployed.collect::<Vec<_>>(), tight_slack).document()
    };
    let levels = levels.map(|(level, time)| {
        json!({ "significance": level.as_f64(), "time": milliseconds(*time), "verdict": verdict(*level) })
    });
    let codels = names_of(db, project).of_kind(db, Kind::Codel).map(|of| of.qualified(db));
    let location = Location::name_of(codel);
    Ok(json!({
        "codel": times.codel,
        "codels": codels.collect::<Vec<_>>(),
        "unit": "ms",
        "levels": levels.collect::<Vec<_>>(),
        "shown": times.shown.as_f64(),
        "source": times.times,
        "assumed": times.is_assumed,
        "evidence": times.evidence,
        "location": to_proto::location(snapshot, &location),
        "reasons": times.reasons,
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": draw_exceedance(&times, params.drawing()),
    }))
}
