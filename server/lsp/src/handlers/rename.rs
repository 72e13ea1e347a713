//! `textDocument/prepareRename`, `textDocument/rename` and `workspace/willRenameFiles`.

use std::path::PathBuf;

use mauve_ide::Change;
use mauve_projects::address::file_at;
use mauve_projects::load::canonical_path;
use tower_lsp::jsonrpc::{Error, ErrorCode, Result};
use tower_lsp::lsp_types::{
    PrepareRenameResponse, RenameFilesParams, RenameParams, TextDocumentPositionParams, WorkspaceEdit,
};

use crate::diagnostics::ANOTHER_TEXT;
use crate::snapshot::Snapshot;
use crate::to_proto::workspace_edit;

/// The name at a position, to be changed; an error says why it cannot be.
pub(crate) fn prepare(
    snapshot: &Snapshot,
    params: &TextDocumentPositionParams,
) -> Result<Option<PrepareRenameResponse>> {
    let (file, lines, offset) = snapshot.at(params)?;
    let found =
        mauve_ide::prepare_rename(&snapshot.db, &snapshot.workspaces, file, offset).map_err(refused)?;
    Ok(Some(PrepareRenameResponse::RangeWithPlaceholder {
        range: lines.range(found.range),
        placeholder: found.name,
    }))
}

/// Another name for what is named at a position.
pub(crate) fn rename(snapshot: &Snapshot, params: &RenameParams) -> Result<Option<WorkspaceEdit>> {
    // What is not read yet may have a use of it.
    snapshot.complete_everywhere()?;
    let (file, _, offset) = snapshot.at(&params.text_document_position)?;
    let (db, workspaces) = (&snapshot.db, &snapshot.workspaces);
    let change = mauve_ide::rename(db, workspaces, file, offset, &params.new_name).map_err(refused)?;
    edit(snapshot, &change, &format!("Rename to `{}`", params.new_name))
}

/// What must be changed in texts before these files get other names.
pub(crate) fn will_rename_files(
    snapshot: &Snapshot,
    params: &RenameFilesParams,
) -> Result<Option<WorkspaceEdit>> {
    snapshot.complete_everywhere()?;
    let path = |uri: &String| Some(canonical_path(&file_at(uri)?));
    let moves = params.files.iter().filter_map(|it| Some((path(&it.old_uri)?, path(&it.new_uri)?)));
    let moves: Vec<(PathBuf, PathBuf)> = moves.collect();
    let change = mauve_ide::rename_files(&snapshot.db, &snapshot.workspaces, &moves);
    if change.files.is_empty() {
        return Ok(None);
    }
    edit(snapshot, &change, "Update the paths of renamed files")
}

fn edit(snapshot: &Snapshot, change: &Change, label: &str) -> Result<Option<WorkspaceEdit>> {
    let is_another = |it: &mauve_ide::FileChange| {
        snapshot.documents.values().any(|document| document.file == it.file && !document.is_analysed)
    };
    if change.files.iter().any(is_another) {
        return Err(refused(ANOTHER_TEXT.to_owned()));
    }
    Ok(workspace_edit(snapshot, change, label))
}

/// That the user asked for something that cannot be done, in words for him.
pub(crate) fn refused(why: String) -> Error {
    // RequestFailed: nothing is wrong with the request itself.
    Error { code: ErrorCode::ServerError(-32803), message: why.into(), data: None }
}
