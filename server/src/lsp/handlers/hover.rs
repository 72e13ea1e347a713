//! `textDocument/hover`.

use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, HoverContents, HoverParams, MarkupContent, MarkupKind};

use crate::lsp::snapshot::Snapshot;

/// What stands at a position.
pub(crate) fn hover(snapshot: &Snapshot, params: &HoverParams) -> Result<Option<lsp_types::Hover>> {
    let at = &params.text_document_position_params;
    snapshot.complete()?;
    let (file, lines, offset) = snapshot.at(at)?;
    let encoding = snapshot.capabilities.encoding;
    let hover = mauve_ide::hover(&snapshot.db, &snapshot.workspaces, file, offset);
    Ok(hover.map(|hover| lsp_types::Hover {
        range: Some(lines.range(hover.range, encoding)),
        contents: HoverContents::Markup(content(snapshot, hover.markdown)),
    }))
}

/// Markdown, or its text for a client that shows no more.
pub(crate) fn content(snapshot: &Snapshot, markdown: String) -> MarkupContent {
    if snapshot.capabilities.markdown {
        return MarkupContent { kind: MarkupKind::Markdown, value: markdown };
    }
    let lines = markdown.lines().filter(|line| !line.starts_with("```"));
    let value = lines.collect::<Vec<_>>().join("\n").trim_end().to_owned();
    MarkupContent { kind: MarkupKind::PlainText, value }
}
