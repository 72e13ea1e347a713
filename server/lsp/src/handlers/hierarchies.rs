//! `textDocument/prepareCallHierarchy` and `callHierarchy/…`, `textDocument/prepareTypeHierarchy` and `typeHierarchy/…`.

use mauve_hir::{File, ModelDb, Project};
use mauve_ide::{HierarchyCalls, HierarchyItem};
use mauve_projects::json::non_empty;
use mauve_syntax::TextSize;
use serde::Deserialize as _;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::*;

use super::document_symbols::kind;
use crate::snapshot::Snapshot;

/// The items that `find` returns for a position: codels, operations and programs, or shells.
pub(crate) fn prepare<T>(
    snapshot: &Snapshot,
    at: &TextDocumentPositionParams,
    find: for<'db> fn(&'db dyn ModelDb, Project<'db>, File, TextSize) -> Vec<HierarchyItem>,
    item: fn(&Snapshot, Project<'_>, HierarchyItem) -> Option<T>,
) -> Result<Option<Vec<T>>> {
    let (file, _, offset) = snapshot.at(at)?;
    let Some(project) = snapshot.project_at(file, offset) else { return Ok(None) };
    let found = find(&snapshot.db, project, file, offset);
    Ok(non_empty(found.into_iter().filter_map(|it| item(snapshot, project, it))))
}

pub(crate) fn incoming(
    snapshot: &Snapshot,
    params: &CallHierarchyIncomingCallsParams,
) -> Result<Option<Vec<CallHierarchyIncomingCall>>> {
    snapshot.complete()?;
    let CallHierarchyItem { uri, data, .. } = &params.item;
    let Some((project, file, id)) = asked(snapshot, uri, data)? else { return Ok(None) };
    let found = mauve_ide::incoming_calls(&snapshot.db, project, file, &id);
    let found = found.into_iter().filter_map(|HierarchyCalls { item, ranges }| {
        let lines = snapshot.lines(item.file);
        let from_ranges = ranges.iter().map(|range| lines.range(*range)).collect();
        Some(CallHierarchyIncomingCall { from: call_item(snapshot, project, item)?, from_ranges })
    });
    Ok(Some(found.collect()))
}

pub(crate) fn outgoing(
    snapshot: &Snapshot,
    params: &CallHierarchyOutgoingCallsParams,
) -> Result<Option<Vec<CallHierarchyOutgoingCall>>> {
    snapshot.complete()?;
    let CallHierarchyItem { uri, data, .. } = &params.item;
    let Some((project, file, id)) = asked(snapshot, uri, data)? else { return Ok(None) };
    let lines = snapshot.lines(file);
    let found = mauve_ide::outgoing_calls(&snapshot.db, project, file, &id);
    let found = found.into_iter().filter_map(|HierarchyCalls { item, ranges }| {
        let from_ranges = ranges.iter().map(|range| lines.range(*range)).collect();
        Some(CallHierarchyOutgoingCall { to: call_item(snapshot, project, item)?, from_ranges })
    });
    Ok(Some(found.collect()))
}

/// The shells that `find` returns for an item: those that it extends, or those that extend it.
pub(crate) fn related_types(
    snapshot: &Snapshot,
    item: &TypeHierarchyItem,
    find: for<'db> fn(&'db dyn ModelDb, Project<'db>, File, &str) -> Vec<HierarchyItem>,
) -> Result<Option<Vec<TypeHierarchyItem>>> {
    let Some((project, file, id)) = asked(snapshot, &item.uri, &item.data)? else { return Ok(None) };
    let found = find(&snapshot.db, project, file, &id);
    Ok(Some(found.into_iter().filter_map(|item| type_item(snapshot, project, item)).collect()))
}

/// The project, the file and the id of an item. The id stays valid whatever has been edited since.
fn asked<'a>(
    snapshot: &'a Snapshot,
    uri: &Url,
    data: &Option<Value>,
) -> Result<Option<(Project<'a>, File, String)>> {
    let data = data.as_ref().and_then(|data| <(String, String)>::deserialize(data).ok());
    let Some((root, id)) = data else { return Ok(None) };
    let (file, _) = snapshot.file(&TextDocumentIdentifier { uri: uri.clone() })?;
    let projects = snapshot.projects(file);
    let same = projects.iter().find(|it| it.root(&snapshot.db).path(&snapshot.db).to_string_lossy() == root);
    Ok(same.or(projects.first()).map(|project| (*project, file, id)))
}

/// Translates an item. The project that answered for it answers for what is above and below, too.
pub(crate) fn call_item(
    snapshot: &Snapshot,
    project: Project<'_>,
    item: HierarchyItem,
) -> Option<CallHierarchyItem> {
    let root = project.root(&snapshot.db).path(&snapshot.db).to_string_lossy();
    let lines = snapshot.lines(item.file);
    Some(CallHierarchyItem {
        uri: snapshot.url(item.file)?,
        range: lines.range(item.range),
        selection_range: lines.range(item.name_range),
        kind: kind(item.kind, snapshot.capabilities.symbol_kinds),
        tags: None,
        detail: (!item.detail.is_empty()).then_some(item.detail),
        name: item.name,
        data: Some(json!([root, item.id])),
    })
}

/// Translates an item: one of a hierarchy of types has the fields of one of calls.
pub(crate) fn type_item(
    snapshot: &Snapshot,
    project: Project<'_>,
    item: HierarchyItem,
) -> Option<TypeHierarchyItem> {
    let CallHierarchyItem { name, kind, detail, uri, range, selection_range, data, .. } =
        call_item(snapshot, project, item)?;
    Some(TypeHierarchyItem { name, kind, tags: None, detail, uri, range, selection_range, data })
}
