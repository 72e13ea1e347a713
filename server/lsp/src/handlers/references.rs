//! `textDocument/references` and `textDocument/documentHighlight`.

use mauve_ide::Access;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams, Location, ReferenceParams,
};

use crate::snapshot::Snapshot;

pub(crate) fn references(snapshot: &Snapshot, params: &ReferenceParams) -> Result<Option<Vec<Location>>> {
    snapshot.complete_everywhere()?;
    let (file, _, offset) = snapshot.at(&params.text_document_position)?;
    let declaration = params.context.include_declaration;
    let found = mauve_ide::references(&snapshot.db, &snapshot.workspaces, file, offset, declaration);
    Ok(Some(found.iter().filter_map(|it| snapshot.location(it.file, it.range)).collect()))
}

/// The references in the same text.
pub(crate) fn highlights(
    snapshot: &Snapshot,
    params: &DocumentHighlightParams,
) -> Result<Option<Vec<DocumentHighlight>>> {
    let (file, lines, offset) = snapshot.at(&params.text_document_position_params)?;
    let project = snapshot.project_at(file, offset);
    let found = project.map(|project| mauve_ide::highlights(&snapshot.db, project, file, offset));
    let highlight = |it: mauve_ide::Reference| DocumentHighlight {
        range: lines.range(it.range),
        kind: Some(match it.access {
            Access::Read => DocumentHighlightKind::READ,
            Access::Write => DocumentHighlightKind::WRITE,
            Access::Mention => DocumentHighlightKind::TEXT,
        }),
    };
    Ok(Some(found.into_iter().flatten().map(highlight).collect()))
}
