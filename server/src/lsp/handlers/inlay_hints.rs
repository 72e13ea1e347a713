//! `textDocument/inlayHint` and `inlayHint/resolve`.

use serde_json::Value;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    self, InlayHintLabel, InlayHintParams, InlayHintTooltip, Position, TextDocumentIdentifier, Url,
};

use super::hover::content;
use crate::lsp::snapshot::Snapshot;

/// What a hint needs to be explained, later. One text, since a deployment may have thousands of hints.
struct Explained {
    document: TextDocumentIdentifier,
    version: Option<i32>,
    at: Position,
}

impl Explained {
    fn write(uri: &Url, version: Option<i32>, at: Position) -> Value {
        let version = version.map_or_else(String::new, |version| version.to_string());
        Value::String(format!("{}:{}:{version}:{uri}", at.line, at.character))
    }

    fn read(data: &Value) -> Option<Explained> {
        let mut parts = data.as_str()?.splitn(4, ':');
        let at = Position::new(parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        let version = match parts.next()? {
            "" => None,
            version => Some(version.parse().ok()?),
        };
        let document = TextDocumentIdentifier::new(Url::parse(parts.next()?).ok()?);
        Some(Explained { document, version, at })
    }
}

/// The hints of a range; why they say what they say is found when somebody wants to know.
pub(crate) fn inlay_hints(
    snapshot: &Snapshot,
    params: &InlayHintParams,
) -> Result<Option<Vec<lsp_types::InlayHint>>> {
    if snapshot.is_stopped {
        return Ok(Some(Vec::new()));
    }
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let range = lines.text_range(params.range);
    let hints =
        mauve_ide::inlay_hints(&snapshot.db, &snapshot.workspaces, file, range, snapshot.settings.hints);
    let version = snapshot.version(&params.text_document.uri);
    let hints = hints.into_iter().map(|hint| {
        let explained = hint.explained_at.map(|offset| lines.position(offset));
        lsp_types::InlayHint {
            position: lines.position(hint.offset),
            // What stands within a line brings its own space.
            padding_left: Some(!hint.label.starts_with(' ')),
            label: InlayHintLabel::String(hint.label),
            kind: None,
            text_edits: None,
            tooltip: None,
            padding_right: None,
            data: explained.map(|at| Explained::write(&params.text_document.uri, version, at)),
        }
    });
    Ok(Some(hints.collect()))
}

/// A hint with its explanation.
pub(crate) fn resolve(snapshot: &Snapshot, hint: &lsp_types::InlayHint) -> Result<lsp_types::InlayHint> {
    let mut hint = hint.clone();
    let explained = hint.data.as_ref().and_then(Explained::read);
    let Some(Explained { document, version, at }) = explained else { return Ok(hint) };
    snapshot.unchanged(&document, version)?;
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&document)?;
    let offset = lines.offset(at);
    if let Some(hover) = mauve_ide::hover(&snapshot.db, &snapshot.workspaces, file, offset) {
        hint.tooltip = Some(InlayHintTooltip::MarkupContent(content(snapshot, hover.markdown)));
    }
    Ok(hint)
}
