//! `textDocument/definition`, `textDocument/declaration`, `textDocument/typeDefinition` and `textDocument/implementation`.

use mauve_hir::{File, ModelDb, Project};
use mauve_ide::Navigation;
use mauve_syntax::TextSize;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{GotoDefinitionParams, GotoDefinitionResponse, Location, LocationLink, Range};

use crate::snapshot::Snapshot;
use crate::to_proto;

/// The function of `mauve-ide` that finds the targets.
type Find = for<'db> fn(&'db dyn ModelDb, Project<'db>, File, TextSize) -> Option<Navigation>;

/// Answers with what `find` returns: as `links` with the range that was asked from, for a client that knows them.
pub(crate) fn go_to(
    snapshot: &Snapshot,
    params: &GotoDefinitionParams,
    find: Find,
    links: bool,
) -> Result<Option<GotoDefinitionResponse>> {
    let (file, lines, offset) = snapshot.at(&params.text_document_position_params)?;
    let project = snapshot.project_at(file, offset);
    let Some(found) = project.and_then(|project| find(&snapshot.db, project, file, offset)) else {
        return Ok(None);
    };
    let origin_selection_range = Some(lines.range(found.origin));
    let link = |target_uri, target_range, target_selection_range| LocationLink {
        origin_selection_range,
        target_uri,
        target_range,
        target_selection_range,
    };
    let in_file = |target: &mauve_ide::Target| {
        let lines = snapshot.lines(target.file);
        Some(link(snapshot.url(target.file)?, lines.range(target.range), lines.range(target.name)))
    };
    let start = Range::default();
    let files = to_proto::files_there(&found.files).map(|url| link(url, start, start));
    let targets = found.targets.iter().filter_map(in_file).chain(files);
    let location = |it: LocationLink| Location { uri: it.target_uri, range: it.target_selection_range };
    Ok(Some(match links {
        true => GotoDefinitionResponse::Link(targets.collect()),
        false => GotoDefinitionResponse::Array(targets.map(location).collect()),
    }))
}
