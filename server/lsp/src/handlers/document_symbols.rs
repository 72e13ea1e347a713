//! `textDocument/documentSymbol`.

use mauve_ide::{Symbol, SymbolKind};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    self, DocumentSymbol, DocumentSymbolParams, DocumentSymbolResponse, SymbolInformation,
};

use crate::position::LineIndex;
use crate::snapshot::Snapshot;

/// Returns the declarations of a file: as a tree, or as a list for a client that does not support trees.
pub(crate) fn document_symbols(
    snapshot: &Snapshot,
    params: &DocumentSymbolParams,
) -> Result<Option<DocumentSymbolResponse>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let symbols = mauve_ide::document_symbols(&snapshot.db, file);
    if snapshot.capabilities.nested_symbols {
        let symbols = symbols.into_iter().map(|symbol| nested(snapshot, lines, symbol));
        return Ok(Some(DocumentSymbolResponse::Nested(symbols.collect())));
    }
    let mut flat = Vec::new();
    let mut open: Vec<(Option<String>, Symbol)> = symbols.into_iter().rev().map(|it| (None, it)).collect();
    while let Some((container_name, symbol)) = open.pop() {
        let range = lines.range(symbol.range);
        let location = lsp_types::Location { uri: params.text_document.uri.clone(), range };
        let name = shown(&symbol);
        open.extend(symbol.children.into_iter().rev().map(|child| (Some(name.clone()), child)));
        #[allow(deprecated, reason = "the field must be given")]
        flat.push(SymbolInformation {
            name,
            kind: kind(symbol.kind, snapshot.capabilities.symbol_kinds),
            tags: None,
            deprecated: None,
            location,
            container_name,
        });
    }
    Ok(Some(DocumentSymbolResponse::Flat(flat)))
}

fn nested(snapshot: &Snapshot, lines: LineIndex<'_>, symbol: Symbol) -> DocumentSymbol {
    let name = shown(&symbol);
    let children: Vec<_> = symbol.children.into_iter().map(|it| nested(snapshot, lines, it)).collect();
    #[allow(deprecated, reason = "the field must be given")]
    DocumentSymbol {
        name,
        detail: (!symbol.detail.is_empty()).then_some(symbol.detail),
        kind: kind(symbol.kind, snapshot.capabilities.symbol_kinds),
        tags: None,
        deprecated: None,
        range: lines.range(symbol.range),
        selection_range: lines.range(symbol.name_range),
        children: (!children.is_empty()).then_some(children),
    }
}

/// Returns the name of a symbol, or a substitute for an empty name, which the protocol forbids.
fn shown(symbol: &Symbol) -> String {
    if symbol.name.is_empty() { "?".to_owned() } else { symbol.name.clone() }
}

/// Returns the kind in the protocol; a kind of the first version if the client does not support `all`.
pub(crate) fn kind(kind: SymbolKind, all: bool) -> lsp_types::SymbolKind {
    let kind = match kind {
        SymbolKind::Library => lsp_types::SymbolKind::MODULE,
        SymbolKind::Codel => lsp_types::SymbolKind::FUNCTION,
        SymbolKind::Shell => lsp_types::SymbolKind::INTERFACE,
        SymbolKind::Property => lsp_types::SymbolKind::PROPERTY,
        SymbolKind::Constant => lsp_types::SymbolKind::CONSTANT,
        SymbolKind::Port => lsp_types::SymbolKind::FIELD,
        SymbolKind::Operation | SymbolKind::Hook => lsp_types::SymbolKind::METHOD,
        SymbolKind::Core | SymbolKind::Component => lsp_types::SymbolKind::CLASS,
        SymbolKind::Variable | SymbolKind::Handler | SymbolKind::Parameter => lsp_types::SymbolKind::VARIABLE,
        SymbolKind::State => lsp_types::SymbolKind::ENUM_MEMBER,
        SymbolKind::Transition | SymbolKind::Activity => lsp_types::SymbolKind::EVENT,
        SymbolKind::Architecture => lsp_types::SymbolKind::STRUCT,
        SymbolKind::Instance => lsp_types::SymbolKind::OBJECT,
        SymbolKind::Deployment | SymbolKind::Package => lsp_types::SymbolKind::PACKAGE,
        SymbolKind::Message | SymbolKind::Type => lsp_types::SymbolKind::STRUCT,
        SymbolKind::File => lsp_types::SymbolKind::FILE,
    };
    match kind {
        _ if all => kind,
        lsp_types::SymbolKind::ENUM_MEMBER => lsp_types::SymbolKind::CONSTANT,
        lsp_types::SymbolKind::EVENT => lsp_types::SymbolKind::FUNCTION,
        lsp_types::SymbolKind::STRUCT => lsp_types::SymbolKind::CLASS,
        lsp_types::SymbolKind::OBJECT => lsp_types::SymbolKind::VARIABLE,
        of_the_first_version => of_the_first_version,
    }
}
