//! `textDocument/documentLink`. Links have their targets, so `documentLink/resolve` is not needed.

use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, DocumentLinkParams};

use crate::snapshot::Snapshot;

/// The files that a document names. One at a place has it as its address's fragment, `#L12,3`, which says the same to
/// VS Code, and nothing to those who only want the file.
pub(crate) fn document_links(
    snapshot: &Snapshot,
    params: &DocumentLinkParams,
) -> Result<Option<Vec<lsp_types::DocumentLink>>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let (workspace, project) = (snapshot.workspace(file), snapshot.project(file));
    let links = workspace.map(|it| mauve_ide::document_links(&snapshot.db, it, project, file));
    let links = links.into_iter().flatten().filter_map(|link| {
        let mut target = snapshot.url(link.target)?;
        if let Some(at) = link.at {
            let at = snapshot.lines(link.target).position(at);
            target.set_fragment(Some(&format!("L{},{}", at.line + 1, at.character + 1)));
        }
        Some(lsp_types::DocumentLink {
            range: lines.range(link.range),
            target: Some(target),
            tooltip: snapshot.capabilities.link_tooltips.then_some(link.tooltip),
            data: None,
        })
    });
    Ok(Some(links.collect()))
}
