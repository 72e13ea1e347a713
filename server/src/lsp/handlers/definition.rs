//! `textDocument/definition`.

use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{GotoDefinitionParams, GotoDefinitionResponse, Location, LocationLink};

use crate::lsp::position::line_index;
use crate::lsp::snapshot::Snapshot;

/// Where the name at a position is declared.
pub(crate) fn definition(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    let at = &params.text_document_position_params;
    let (file, lines) = snapshot.file(&at.text_document)?;
    let encoding = snapshot.capabilities.encoding;
    let offset = lines.offset(at.position, encoding);
    let Some(found) = mauve_ide::definition(&snapshot.db, &snapshot.workspaces, file, offset) else {
        return Ok(None);
    };
    let origin = lines.range(found.origin, encoding);
    let targets = found.targets.iter().filter_map(|target| {
        let lines = line_index(&snapshot.db, target.file);
        let (all, name) = (lines.range(target.range, encoding), lines.range(target.name, encoding));
        Some((snapshot.url(target.file)?, all, name))
    });
    Ok(Some(match snapshot.capabilities.definition_links {
        true => GotoDefinitionResponse::Link(
            targets
                .map(|(target_uri, target_range, target_selection_range)| LocationLink {
                    origin_selection_range: Some(origin),
                    target_uri,
                    target_range,
                    target_selection_range,
                })
                .collect(),
        ),
        false => GotoDefinitionResponse::Array(
            targets.map(|(uri, _, name)| Location { uri, range: name }).collect(),
        ),
    }))
}
