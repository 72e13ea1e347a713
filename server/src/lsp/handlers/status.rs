//! `mauve/status`: the state of the server.
//!
//! | field | is |
//! |---|---|
//! | `workspaces` | their folders, with the roots of their projects and the significance level that is shown |
//! | `documents` | the number of open documents |
//! | `levels` | the significance levels of the tables, from the most probable down: arguments of `mauve.setSignificance` |
//! | `memory` | the resident set of the server in bytes; null on a system that does not tell |
//! | `jobs` | the number of running jobs, this request not counted |
//! | `settled` | when the server has nothing left to do: the number of diagnostics and refresh requests that it has sent. A client that has received as many has received everything. Null while files are read, projects are checked, or messages wait |

use std::sync::atomic::Ordering;

use mauve_hir::projects;
use mauve_timing::Level;
use mauve_wcrt::level_shown;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;

use crate::lsp::snapshot::Snapshot;
use crate::memory::resident;

/// Returns the state of the server.
pub(crate) fn status(snapshot: &Snapshot) -> Result<Value> {
    let db = &snapshot.db;
    let workspaces = snapshot.workspaces.iter().map(|&workspace| {
        let roots = projects(db, workspace).iter().map(|it| it.root(db).path(db).display().to_string());
        json!({
            "folder": workspace.folder(db).display().to_string(),
            "files": workspace.files(db).len(),
            "significance": level_shown(db, workspace).as_f64(),
            "roots": roots.collect::<Vec<_>>(),
        })
    });
    let levels = snapshot.levels();
    let jobs = snapshot.running.load(Ordering::SeqCst).saturating_sub(1);
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "workspaces": workspaces.collect::<Vec<_>>(),
        "documents": snapshot.documents.len(),
        "levels": levels.into_iter().map(Level::as_f64).collect::<Vec<_>>(),
        "memory": resident(),
        "jobs": jobs,
        "settled": snapshot.outbox.sent().filter(|_| snapshot.is_settled && jobs == 0),
    }))
}
