//! `workspace/symbol`. A place costs nothing to find, so that nothing is left for `workspaceSymbol/resolve`.

use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{SymbolInformation, WorkspaceSymbolParams};

use super::document_symbols::kind;
use crate::snapshot::Snapshot;

/// More than these nobody reads; another letter leaves fewer.
const MOST: usize = 512;

/// The declarations of all files that the query may mean, the best first.
pub(crate) fn workspace_symbols(
    snapshot: &Snapshot,
    params: &WorkspaceSymbolParams,
) -> Result<Option<Vec<SymbolInformation>>> {
    let found = mauve_ide::workspace_symbols(&snapshot.db, &snapshot.workspaces, &params.query, MOST);
    let symbols = found.into_iter().filter_map(|symbol| {
        #[allow(deprecated, reason = "the field must be given")]
        Some(SymbolInformation {
            name: symbol.name,
            kind: kind(symbol.kind, snapshot.capabilities.workspace_symbol_kinds),
            tags: None,
            deprecated: None,
            location: snapshot.location(symbol.file, symbol.range)?,
            container_name: (!symbol.container.is_empty()).then_some(symbol.container),
        })
    });
    Ok(Some(symbols.collect()))
}
