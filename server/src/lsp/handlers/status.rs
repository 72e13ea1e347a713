//! `mauve/status`: what the server has and does, for whoever wonders.

use std::sync::atomic::Ordering;

use mauve_hir::projects;
use mauve_wcrt::level_shown;
use serde::Serialize;
use tower_lsp::jsonrpc::Result;

use crate::lsp::snapshot::Snapshot;

/// What the server has and does.
#[derive(Debug, Serialize)]
pub(crate) struct Status {
    version: &'static str,
    /// The folders of the workspaces, with the roots of their projects.
    workspaces: Vec<WorkspaceStatus>,
    /// How many texts the client has open.
    documents: usize,
    /// The significance levels that the tables have, from the most probable down: arguments of `mauve.setSignificance`.
    levels: Vec<f64>,
    /// How many jobs are running, this request not counted.
    jobs: usize,
    /// Once the server has nothing left to do: how many diagnostics and refresh requests it has sent. A client that has
    /// received as many has received everything. Null while files are read, projects are checked, or messages wait.
    settled: Option<usize>,
}

#[derive(Debug, Serialize)]
struct WorkspaceStatus {
    folder: String,
    files: usize,
    /// The significance level that is shown.
    significance: f64,
    roots: Vec<String>,
}

/// The status of the server.
pub(crate) fn status(snapshot: &Snapshot) -> Result<Status> {
    let db = &snapshot.db;
    let workspaces = snapshot.workspaces.iter().map(|&workspace| WorkspaceStatus {
        folder: workspace.folder(db).display().to_string(),
        files: workspace.files(db).len(),
        significance: level_shown(db, workspace).as_f64(),
        roots: projects(db, workspace).iter().map(|it| it.root(db).path(db).display().to_string()).collect(),
    });
    let jobs = snapshot.running.load(Ordering::SeqCst).saturating_sub(1);
    Ok(Status {
        version: env!("CARGO_PKG_VERSION"),
        workspaces: workspaces.collect(),
        levels: mauve_ide::known_levels(db, &snapshot.workspaces)
            .iter()
            .map(|level| level.as_f64())
            .collect(),
        documents: snapshot.documents.len(),
        jobs,
        settled: snapshot.outbox.sent().filter(|_| snapshot.is_settled && jobs == 0),
    })
}
