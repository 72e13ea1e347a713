//! `textDocument/definition`, `textDocument/declaration`, `textDocument/typeDefinition` and `textDocument/implementation`:
//! four questions of one shape.

use mauve_hir::{File, ModelDb, Workspace};
use mauve_ide::Definition;
use mauve_syntax::TextSize;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    GotoDefinitionParams, GotoDefinitionResponse, Location, LocationLink, Range, Url,
};

use crate::lsp::position::line_index;
use crate::lsp::snapshot::Snapshot;
use crate::lsp::to_proto;

/// One of the questions.
type Ask = fn(&dyn ModelDb, &[Workspace], File, TextSize) -> Option<Definition>;

/// Where the name at a position is defined.
pub(crate) fn definition(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    go_to(snapshot, params, mauve_ide::definition, snapshot.capabilities.definition_links)
}

/// Where it is declared.
pub(crate) fn declaration(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    go_to(snapshot, params, mauve_ide::declaration, snapshot.capabilities.declaration_links)
}

/// Where its type is declared.
pub(crate) fn type_definition(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    go_to(snapshot, params, mauve_ide::type_definition, snapshot.capabilities.type_definition_links)
}

/// What makes it happen.
pub(crate) fn implementation(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>> {
    go_to(snapshot, params, mauve_ide::implementation, snapshot.capabilities.implementation_links)
}

fn go_to(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
    ask: Ask,
    links: bool,
) -> Result<Option<GotoDefinitionResponse>> {
    let at = &params.text_document_position_params;
    let (file, lines, offset) = snapshot.at(at)?;
    let encoding = snapshot.capabilities.encoding;
    let Some(found) = ask(&snapshot.db, &snapshot.workspaces, file, offset) else {
        return Ok(None);
    };
    let origin = lines.range(found.origin, encoding);
    let mut targets: Vec<(Url, Range, Range)> = Vec::new();
    for target in &found.targets {
        let lines = line_index(&snapshot.db, target.file);
        let (all, name) = (lines.range(target.range, encoding), lines.range(target.name, encoding));
        targets.extend(snapshot.url(target.file).map(|url| (url, all, name)));
    }
    let start = Range::default();
    targets.extend(to_proto::files_there(&found.files).map(|url| (url, start, start)));
    let targets = targets.into_iter();
    Ok(Some(match links {
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
