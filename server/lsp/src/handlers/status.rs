//! `mauve/status`: the state of the server.
//!
//! | field | is |
//! |---|---|
//! | `workspaces` | their folders, with the roots of their projects and the significance level that is shown |
//! | `documents` | the number of open documents |
//! | `levels` | the significance levels of the tables, from the most probable down: arguments of `mauve.setSignificance` |
//! | `memory` | the resident set of the server in bytes; null on a system that does not tell |
//! | `verdict` | the verdict on all deployments at the level that is shown, in closed files too: `text` for a status line, such as `✗ 1 late · 2 unknown · 9 measured`, where the last part says where execution times come from, followed by what to do where files are not watched; and `status`, that of its worst part: `missed`, `unknown`, `tight`, `met`, or `time` where there are no deadlines. Null where `settled` is |
//! | `jobs` | the number of running jobs, this request not counted |
//! | `searched` | how many folders were searched since the start, each as often as it was |
//! | `settled` | when the server has nothing left to do: the number of diagnostics and refresh requests that it has sent. A client that has received as many has received everything. Null while files are read, projects are checked, or messages wait |

use std::sync::atomic::Ordering;

use mauve_hir::{config_of, projects};
use mauve_projects::analysis_document::at_shown_level;
use mauve_projects::memory::resident;
use mauve_projects::verdict::Verdict;
use mauve_timing::Level;
use mauve_wcrt::level_shown;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;

use crate::snapshot::Snapshot;

/// Returns the state of the server.
pub(crate) fn status(snapshot: &Snapshot) -> Result<Value> {
    let db = &snapshot.db;
    let workspaces = snapshot.workspaces.iter().map(|&workspace| {
        let level = projects(db, workspace).iter().map(|&it| level_shown(db, it)).min();
        let level = level.or(*workspace.significance(db)).unwrap_or_else(|| config_of(db, workspace).level());
        let roots = projects(db, workspace).iter().map(|it| it.root(db).path(db).display().to_string());
        json!({
            "folder": workspace.folder(db).display().to_string(),
            "files": workspace.files(db).len(),
            "significance": level.as_f64(),
            "roots": roots.collect::<Vec<_>>(),
        })
    });
    let levels = snapshot.levels();
    let is_settled = snapshot.is_settled;
    let jobs = snapshot.running.load(Ordering::SeqCst).saturating_sub(1);
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "workspaces": workspaces.collect::<Vec<_>>(),
        "documents": snapshot.documents.len(),
        "levels": levels.into_iter().map(Level::as_f64).collect::<Vec<_>>(),
        "memory": resident(),
        "jobs": jobs,
        "searched": snapshot.searched,
        "settled": snapshot.outbox.sent().filter(|_| is_settled && jobs == 0),
        "verdict": (is_settled && jobs == 0).then(|| verdict(snapshot)),
    }))
}

/// Returns the verdict. The server has analysed all deployments for their diagnostics.
fn verdict(snapshot: &Snapshot) -> Value {
    let deployed = at_shown_level(&snapshot.db, &snapshot.workspaces).unwrap_or_default();
    Verdict::of(&deployed, snapshot.settings.hints.tight_slack).document(snapshot.unwatched.as_deref())
}
