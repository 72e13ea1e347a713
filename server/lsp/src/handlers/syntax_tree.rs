//! `mauve/syntaxTree`: the tree of a file as `mauve parse` shows it, a node or token a line, with the errors in it.
//!
//! Its parameter is `textDocument`, the result a text.

use mauve_hir::parse;
use salsa::Database as _;
use tower_lsp::jsonrpc::{Error, Result};

use super::DrawingParams;
use crate::snapshot::Snapshot;

/// The tree of a model.
pub(crate) fn syntax_tree(snapshot: &Snapshot, params: &DrawingParams) -> Result<String> {
    let (file, _) = snapshot.file(&params.text_document)?;
    if !mauve_hir::is_model(file.path(&snapshot.db)) {
        let uri = &params.text_document.uri;
        return Err(Error::invalid_params(format!("`{uri}` is not a model (*.mal)")));
    }
    let db = &snapshot.db;
    Ok(mauve_diagnostics::tree_of(parse(db, file), &|| db.unwind_if_revision_cancelled()))
}
