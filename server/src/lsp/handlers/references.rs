//! `textDocument/references` and `textDocument/documentHighlight`.

use mauve_ide::Access;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams, Location, ReferenceParams,
};

use crate::lsp::position::line_index;
use crate::lsp::snapshot::Snapshot;

/// Every place that names what is named at a position.
pub(crate) fn references(snapshot: &Snapshot, params: &ReferenceParams) -> Result<Option<Vec<Location>>> {
    snapshot.complete()?;
    let at = &params.text_document_position;
    let (file, _, offset) = snapshot.at(at)?;
    let encoding = snapshot.capabilities.encoding;
    let declaration = params.context.include_declaration;
    let (db, workspaces) = (&snapshot.db, &snapshot.workspaces);
    let found = mauve_ide::references(db, workspaces, file, offset, declaration);
    let location = |it: &mauve_ide::Reference| {
        Some(Location {
            uri: snapshot.url(it.file)?,
            range: line_index(db, it.file).range(it.range, encoding),
        })
    };
    Ok(Some(found.iter().filter_map(location).collect()))
}

/// Those in the same text.
pub(crate) fn highlights(
    snapshot: &Snapshot,
    params: &DocumentHighlightParams,
) -> Result<Option<Vec<DocumentHighlight>>> {
    let at = &params.text_document_position_params;
    let (file, lines, offset) = snapshot.at(at)?;
    let encoding = snapshot.capabilities.encoding;
    let found = mauve_ide::highlights(&snapshot.db, &snapshot.workspaces, file, offset);
    let highlight = |it: mauve_ide::Reference| DocumentHighlight {
        range: lines.range(it.range, encoding),
        kind: Some(match it.access {
            Access::Read => DocumentHighlightKind::READ,
            Access::Write => DocumentHighlightKind::WRITE,
            Access::Mention => DocumentHighlightKind::TEXT,
        }),
    };
    Ok(Some(found.into_iter().map(highlight).collect()))
}
