//! `textDocument/hover`.

use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, HoverContents, HoverParams, MarkupContent, MarkupKind};

use crate::lsp::snapshot::Snapshot;

pub(crate) fn hover(snapshot: &Snapshot, params: &HoverParams) -> Result<Option<lsp_types::Hover>> {
    snapshot.complete()?;
    let (file, lines, offset) = snapshot.at(&params.text_document_position_params)?;
    let hover = mauve_ide::hover(&snapshot.db, &snapshot.workspaces, file, offset);
    Ok(hover.map(|hover| lsp_types::Hover {
        range: Some(lines.range(hover.range)),
        contents: HoverContents::Markup(content(snapshot, hover.markdown)),
    }))
}

/// Returns Markdown, or its text for a client that shows no Markdown.
pub(crate) fn content(snapshot: &Snapshot, markdown: String) -> MarkupContent {
    match snapshot.capabilities.markdown {
        true => MarkupContent { kind: MarkupKind::Markdown, value: markdown },
        false => MarkupContent { kind: MarkupKind::PlainText, value: plain_text(&markdown) },
    }
}

/// Returns Markdown without its fences.
pub(super) fn plain_text(markdown: &str) -> String {
    let lines = markdown.lines().filter(|line| !line.starts_with("```"));
    lines.collect::<Vec<_>>().join("\n").trim_end().to_owned()
}
