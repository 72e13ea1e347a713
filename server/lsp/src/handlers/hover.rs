//! `textDocument/hover`.

use mauve_hir::{File, Location, ModelDb};
use mauve_ide::{HoverFormat, markdown_code};
use mauve_projects::address::file_of;
use mauve_syntax::{TextRange, TextSize};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, HoverContents, HoverParams, MarkupContent, MarkupKind};

use crate::plain_text::plain_text;
use crate::snapshot::Snapshot;

pub(crate) fn hover(snapshot: &Snapshot, params: &HoverParams) -> Result<Option<lsp_types::Hover>> {
    snapshot.complete()?;
    let (file, lines, offset) = snapshot.at(&params.text_document_position_params)?;
    Ok(hover_at(snapshot, file, offset).map(|(range, contents)| lsp_types::Hover {
        range: Some(lines.range(range)),
        contents: HoverContents::Markup(contents),
    }))
}

/// Returns the hover at an offset: its range, and its content as the client shows it.
pub(super) fn hover_at(
    snapshot: &Snapshot,
    file: File,
    offset: TextSize,
) -> Option<(TextRange, MarkupContent)> {
    let address = |db: &dyn ModelDb, at: &Location<'_>| {
        let (file, range) = (at.file(db), at.range(db));
        let mut url = snapshot.url(file).filter(|_| !snapshot.capabilities.counts_addresses)?;
        // A fragment changes the address of a document without a file.
        if file_of(&url).is_some() {
            let at = snapshot.lines(file).position(range.start());
            url.set_fragment(Some(&format!("L{},{}", at.line + 1, at.character + 1)));
        }
        Some(url.to_string())
    };
    let format = match snapshot.capabilities.markdown {
        true => HoverFormat::Markdown(&address),
        false => HoverFormat::Text,
    };
    let project = snapshot.project_at(file, offset);
    let hover = mauve_ide::hover(&snapshot.db, project, file, offset, format)?;
    // A word of the language means the same in all projects.
    let is_word = || mauve_ide::hover(&snapshot.db, None, file, offset, format).is_some();
    let as_code = |name: String| markdown_code(&name);
    let named = project.and_then(|it| snapshot.others_named(it, file, as_code)).filter(|_| !is_word());
    let markdown = match named {
        Some((title, _)) => format!("{}\n\n{title}\n", hover.markdown.trim_end()),
        None => hover.markdown,
    };
    Some((hover.range, content(snapshot, markdown)))
}

/// Returns Markdown, or its text for a client that shows no Markdown.
fn content(snapshot: &Snapshot, markdown: String) -> MarkupContent {
    match snapshot.capabilities.markdown {
        true => MarkupContent { kind: MarkupKind::Markdown, value: markdown },
        false => MarkupContent { kind: MarkupKind::PlainText, value: plain_text(&markdown) },
    }
}
