//! `textDocument/formatting`, `textDocument/rangeFormatting` and `textDocument/onTypeFormatting`.
//!
//! The options of the client change nothing. There is one format, that of `mauve fmt`, so that no file changes by who has
//! saved it and `mauve fmt --check` accepts what an editor has formatted: two spaces (`tabSize`, `insertSpaces`), no white
//! space at the ends of lines (`trimTrailingWhitespace`), and one line break at the end of the file (`insertFinalNewline`,
//! `trimFinalNewlines`). Where the text has an error, what stands around it stays as it is, whatever the client wants.

use mauve_hir::File;
use mauve_projects::load::is_of_another_language;
use mauve_syntax::format::Replacement;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    DocumentFormattingParams, DocumentOnTypeFormattingParams, DocumentRangeFormattingParams, TextEdit,
};

use crate::snapshot::Snapshot;
use crate::to_proto;

pub(crate) fn formatting(
    snapshot: &Snapshot,
    params: &DocumentFormattingParams,
) -> Result<Option<Vec<TextEdit>>> {
    let (file, _) = snapshot.file(&params.text_document)?;
    Ok(edits(snapshot, file, || mauve_ide::formatting(&snapshot.db, file, None)))
}

pub(crate) fn range_formatting(
    snapshot: &Snapshot,
    params: &DocumentRangeFormattingParams,
) -> Result<Option<Vec<TextEdit>>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let range = lines.text_range(params.range);
    Ok(edits(snapshot, file, || mauve_ide::formatting(&snapshot.db, file, Some(range))))
}

pub(crate) fn on_type_formatting(
    snapshot: &Snapshot,
    params: &DocumentOnTypeFormattingParams,
) -> Result<Option<Vec<TextEdit>>> {
    let (file, _, offset) = snapshot.at(&params.text_document_position)?;
    let Some(typed) = params.ch.chars().next_back() else { return Ok(None) };
    Ok(edits(snapshot, file, || mauve_ide::formatting_on_type(&snapshot.db, file, offset, typed)))
}

/// Translates the edits; none for a text of another language with the same extension.
fn edits(snapshot: &Snapshot, file: File, edits: impl FnOnce() -> Vec<Replacement>) -> Option<Vec<TextEdit>> {
    let is_ours = !is_of_another_language(file.text(&snapshot.db));
    is_ours.then(|| to_proto::text_edits(snapshot, file, &edits()))
}
