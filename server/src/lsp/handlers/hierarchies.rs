//! `textDocument/prepareCallHierarchy` and `callHierarchy/…`, `textDocument/prepareTypeHierarchy` and `typeHierarchy/…`.

use mauve_ide::{Calls, HierarchyItem};
use mauve_syntax::TextRange;
use serde_json::Value;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    CallHierarchyIncomingCall, CallHierarchyIncomingCallsParams, CallHierarchyItem,
    CallHierarchyOutgoingCall, CallHierarchyOutgoingCallsParams, CallHierarchyPrepareParams, Range,
    TextDocumentIdentifier, TypeHierarchyItem, TypeHierarchyPrepareParams, TypeHierarchySubtypesParams,
    TypeHierarchySupertypesParams, Url,
};

use super::document_symbols::kind;
use crate::lsp::position::line_index;
use crate::lsp::snapshot::Snapshot;

/// The codels, operations and programs that are named at a position.
pub(crate) fn prepare_calls(
    snapshot: &Snapshot,
    params: &CallHierarchyPrepareParams,
) -> Result<Option<Vec<CallHierarchyItem>>> {
    let at = &params.text_document_position_params;
    let (file, _, offset) = snapshot.at(at)?;
    let found = mauve_ide::call_items(&snapshot.db, &snapshot.workspaces, file, offset);
    Ok(some(found.into_iter().filter_map(|item| call_item(snapshot, item))))
}

/// Who calls it.
pub(crate) fn incoming(
    snapshot: &Snapshot,
    params: &CallHierarchyIncomingCallsParams,
) -> Result<Option<Vec<CallHierarchyIncomingCall>>> {
    snapshot.complete()?;
    let Some((uri, id)) = asked(&params.item.uri, params.item.data.as_ref()) else { return Ok(None) };
    let (file, _) = snapshot.file(&TextDocumentIdentifier { uri })?;
    let found = mauve_ide::incoming_calls(&snapshot.db, &snapshot.workspaces, file, id);
    let found = found.into_iter().filter_map(|Calls { item, ranges }| {
        let from_ranges = ranges.iter().map(|range| range_in(snapshot, item.file, *range)).collect();
        Some(CallHierarchyIncomingCall { from: call_item(snapshot, item)?, from_ranges })
    });
    Ok(Some(found.collect()))
}

/// What it calls.
pub(crate) fn outgoing(
    snapshot: &Snapshot,
    params: &CallHierarchyOutgoingCallsParams,
) -> Result<Option<Vec<CallHierarchyOutgoingCall>>> {
    snapshot.complete()?;
    let Some((uri, id)) = asked(&params.item.uri, params.item.data.as_ref()) else { return Ok(None) };
    let (file, _) = snapshot.file(&TextDocumentIdentifier { uri })?;
    let found = mauve_ide::outgoing_calls(&snapshot.db, &snapshot.workspaces, file, id);
    let found = found.into_iter().filter_map(|Calls { item, ranges }| {
        let from_ranges = ranges.iter().map(|range| range_in(snapshot, file, *range)).collect();
        Some(CallHierarchyOutgoingCall { to: call_item(snapshot, item)?, from_ranges })
    });
    Ok(Some(found.collect()))
}

/// The shells that are named at a position.
pub(crate) fn prepare_types(
    snapshot: &Snapshot,
    params: &TypeHierarchyPrepareParams,
) -> Result<Option<Vec<TypeHierarchyItem>>> {
    let at = &params.text_document_position_params;
    let (file, _, offset) = snapshot.at(at)?;
    let found = mauve_ide::type_items(&snapshot.db, &snapshot.workspaces, file, offset);
    Ok(some(found.into_iter().filter_map(|item| type_item(snapshot, item))))
}

/// The shells that it extends.
pub(crate) fn supertypes(
    snapshot: &Snapshot,
    params: &TypeHierarchySupertypesParams,
) -> Result<Option<Vec<TypeHierarchyItem>>> {
    let Some((uri, id)) = asked(&params.item.uri, params.item.data.as_ref()) else { return Ok(None) };
    let (file, _) = snapshot.file(&TextDocumentIdentifier { uri })?;
    let found = mauve_ide::supertypes(&snapshot.db, &snapshot.workspaces, file, id);
    Ok(Some(found.into_iter().filter_map(|item| type_item(snapshot, item)).collect()))
}

/// The shells that extend it.
pub(crate) fn subtypes(
    snapshot: &Snapshot,
    params: &TypeHierarchySubtypesParams,
) -> Result<Option<Vec<TypeHierarchyItem>>> {
    let Some((uri, id)) = asked(&params.item.uri, params.item.data.as_ref()) else { return Ok(None) };
    let (file, _) = snapshot.file(&TextDocumentIdentifier { uri })?;
    let found = mauve_ide::subtypes(&snapshot.db, &snapshot.workspaces, file, id);
    Ok(Some(found.into_iter().filter_map(|item| type_item(snapshot, item)).collect()))
}

/// The file and the words that an item is known by, whatever has been edited since.
fn asked<'a>(uri: &Url, data: Option<&'a Value>) -> Option<(Url, &'a str)> {
    Some((uri.clone(), data?.as_str()?))
}

fn some<T>(found: impl Iterator<Item = T>) -> Option<Vec<T>> {
    let found: Vec<T> = found.collect();
    (!found.is_empty()).then_some(found)
}

fn call_item(snapshot: &Snapshot, item: HierarchyItem) -> Option<CallHierarchyItem> {
    Some(CallHierarchyItem {
        uri: snapshot.url(item.file)?,
        range: range_in(snapshot, item.file, item.range),
        selection_range: range_in(snapshot, item.file, item.name_range),
        kind: kind(item.kind, snapshot.capabilities.symbol_kinds),
        tags: None,
        detail: (!item.detail.is_empty()).then_some(item.detail),
        name: item.name,
        data: Some(Value::String(item.id)),
    })
}

fn type_item(snapshot: &Snapshot, item: HierarchyItem) -> Option<TypeHierarchyItem> {
    Some(TypeHierarchyItem {
        uri: snapshot.url(item.file)?,
        range: range_in(snapshot, item.file, item.range),
        selection_range: range_in(snapshot, item.file, item.name_range),
        kind: kind(item.kind, snapshot.capabilities.symbol_kinds),
        tags: None,
        detail: (!item.detail.is_empty()).then_some(item.detail),
        name: item.name,
        data: Some(Value::String(item.id)),
    })
}

fn range_in(snapshot: &Snapshot, file: mauve_hir::File, range: TextRange) -> Range {
    line_index(&snapshot.db, file).range(range, snapshot.capabilities.encoding)
}
