//! `mauve/status`: what the server has and does, for whoever wonders.

use std::sync::atomic::Ordering;

use mauve_model::projects;
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
    /// How many jobs are running, this request not counted.
    jobs: usize,
}

#[derive(Debug, Serialize)]
struct WorkspaceStatus {
    folder: String,
    files: usize,
    roots: Vec<String>,
}

/// The status of the server.
pub(crate) fn status(snapshot: &Snapshot) -> Result<Status> {
    let db = &snapshot.db;
    let workspaces = snapshot.workspaces.iter().map(|&workspace| WorkspaceStatus {
        folder: workspace.folder(db).display().to_string(),
        files: workspace.files(db).len(),
        roots: projects(db, workspace).iter().map(|it| it.root(db).path(db).display().to_string()).collect(),
    });
    Ok(Status {
        version: env!("CARGO_PKG_VERSION"),
        workspaces: workspaces.collect(),
        documents: snapshot.documents.len(),
        jobs: snapshot.running.load(Ordering::SeqCst).saturating_sub(1),
    })
}
