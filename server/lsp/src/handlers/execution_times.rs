//! `mauve/executionTimes`: the execution times of a codel, or of all codels of an activity, at the significance levels of the timing
//! tables.
//!
//! | parameter | is |
//! |---|---|
//! | `textDocument`, `position` | a place: the codel that is declared, called or timed there, or the activity in this line |
//! | `codel` | instead of `position`: the name of a codel of the file's project |
//! | `instance` | instead of both: the instance of an activity, to compare its codels |
//! | `drawing` | `"svg"` (if left out) or `"text"` |
//!
//! Of the result, `codels` has the names of all codels of the project, `instances` the activities with several codels, `compared` the
//! codels that are shown, and `levels`, from the most probable one on, the times of these (or null), with the `verdict` on the
//! deployments of the project at that level, as in `mauve/status`. `limit` is the longest time of one codel
//! with which all deadlines are met, or why there is none. `evidence` says what was measured,
//! `source` is the section of `mauve.toml` with the timing tables, or null, and `assumed` says that no table has a time. In the
//! SVG, `data-level` holds the index of a level. `reasons` say why times are missing. `incomplete` is whether a text has
//! syntax errors.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Location, names_of};
use mauve_ide::{
    CodelOf, activity_codels, draw_exceedance, exceedance, exceedances_of, limit_of, selected_codel,
};
use mauve_projects::analysis_document::{Deployed, deployments_of, milliseconds};
use mauve_projects::verdict::Verdict;
use mauve_timing::Level;
use mauve_wcrt::{Query, ResolvedActivity};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the execution times of a codel, or of those of an activity.
pub(crate) fn execution_times(snapshot: &Snapshot, params: &DrawingParams) -> Result<Value> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let tight_slack = snapshot.settings.hints.tight_slack;
    let asked = (&params.instance, &params.codel, params.position);
    let found = snapshot.answering(file).into_iter().find_map(|project| {
        let activities = activity_codels(db, project);
        let of_codel = |selection| {
            let codel = selected_codel(db, project, file, selection)?;
            let limit = limit_of(db, project, codel, tight_slack);
            Some((None, Location::name_of(codel), vec![exceedance(db, project, codel)], limit))
        };
        let of_activity = |is_it: &dyn Fn(&ResolvedActivity<'_>) -> bool| {
            let it = activities.iter().find(|(it, _)| is_it(it))?;
            Some((Some(&it.0.instance), it.0.at.clone(), exceedances_of(db, it), None))
        };
        let line_of = |at: &Location<'_>| lines.position(at.range(db).start()).line;
        let shown = match asked {
            (Some(name), ..) => of_activity(&|it| it.instance == *name.as_str()),
            (None, Some(name), _) => of_codel(CodelOf::Name(name)),
            (None, None, Some(place)) => of_codel(CodelOf::At(lines.offset(place)))
                .or_else(|| of_activity(&|it| it.at.file(db) == file && line_of(&it.at) == place.line)),
            (None, None, None) => None,
        };
        Some((project, shown?, activities))
    });
    let refusal = || match asked {
        (Some(name), ..) => format!("no activity `{name}` with codels in the project of this file"),
        (None, Some(name), _) => format!("no codel `{name}` in the project of this file"),
        (None, None, Some(_)) => "no codel here".to_owned(),
        _ => "mauve/executionTimes takes a `position`, a `codel` or an `instance`".to_owned(),
    };
    let (project, (instance, location, all, limit), activities) =
        found.ok_or_else(|| Error::invalid_params(refusal()))?;
    let verdict = |level: Level| {
        let deployed = deployments_of(db, project).map(|of| {
            let query = Query::at_level(db, project, of, Some(level));
            Deployed::of_model(db, project, of, std::iter::once(query))
        });
        Verdict::of(&deployed.collect::<Vec<_>>(), tight_slack).document(None)
    };
    let levels: BTreeSet<Level> = all.iter().flat_map(|it| it.levels.iter().map(|it| it.0)).collect();
    let levels = levels.into_iter().rev().map(|level| {
        let times = all.iter().map(|it| it.time(level).map(milliseconds));
        json!({ "significance": level.as_f64(), "times": times.collect::<Vec<_>>(), "verdict": verdict(level) })
    });
    let codels = names_of(db, project).of_kind(db, Kind::Codel).map(|of| of.qualified(db));
    let instances = activities.iter().filter(|(_, codels)| codels.len() > 1);
    let instances: BTreeSet<_> = instances.map(|(it, _)| it.instance.as_str()).collect();
    Ok(json!({
        "codel": all.first().filter(|_| instance.is_none()).map(|it| &it.codel),
        "instance": instance.map(Name::as_str),
        "instances": instances,
        "compared": all.iter().map(|it| &it.codel).collect::<Vec<_>>(),
        "codels": codels.collect::<Vec<_>>(),
        "unit": "ms",
        "levels": levels.collect::<Vec<_>>(),
        "limit": limit.map(|(text, status)| json!({ "status": status.name(), "text": text })),
        "shown": all.first().map(|it| it.shown.as_f64()),
        "source": all.first().and_then(|it| it.times.as_ref()),
        "assumed": all.iter().all(|it| it.is_assumed),
        "evidence": all.iter().flat_map(|it| &it.evidence).collect::<Vec<_>>(),
        "location": to_proto::location(snapshot, &location),
        "reasons": all.iter().flat_map(|it| &it.reasons).collect::<Vec<_>>(),
        "incomplete": snapshot.has_syntax_errors(project),
        "drawing": draw_exceedance(instance.map(Name::as_str), &all, params.drawing()),
    }))
}
