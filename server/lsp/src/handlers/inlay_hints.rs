//! `textDocument/inlayHint` and `inlayHint/resolve`.
//!
//! The `data` of a hint tells editors that draw hints themselves what it says:
//!
//! | key | value |
//! |---|---|
//! | `status` | `met`, `tight`, `missed`, `unknown`, `older`, `time` or `value` |
//! | `labels` | texts that say the same in fewer and fewer words, if there are several: one of them is the label |
//! | `load` | the utilisation of a CPU in percent, if the hint shows it |
//! | `at` | what the server needs to resolve the hint |

use std::time::{Duration, Instant};

use mauve_diagnostics::figure::HintStatus;
use mauve_hir::{File, is_model};
use mauve_ide::EarlierFigures;
use mauve_syntax::TextRange;
use serde::Deserialize as _;
use serde_json::json;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    self, InlayHintLabel, InlayHintParams, InlayHintTooltip, Position, TextDocumentIdentifier, Url,
};

use super::hover::hover_at;
use crate::snapshot::Snapshot;

/// What a hint needs to be explained, later: its document and the version of that, a line and a column.
type Explained = (Url, Option<i32>, u32, u32);

/// The tooltip of a hint with an older figure.
const OLDER: &str =
    "The figure is that of the last complete text: this one has an error, or is being edited.";

/// For so long, limits in a timing table are searched before its hints are given; those that are missing follow.
const PATIENCE: Duration = Duration::from_millis(20);

/// The hints of a range.
#[derive(Default)]
pub(crate) struct RangeHints {
    pub(crate) list: Vec<lsp_types::InlayHint>,
    /// Their figures that were in none before.
    pub(crate) figures: EarlierFigures,
    /// The timing table whose limits are missing, and the range.
    pub(crate) missing: Option<(File, TextRange)>,
}

/// Returns the hints of a range. Tooltips are computed when the client resolves them.
pub(crate) fn inlay_hints(snapshot: &Snapshot, params: &InlayHintParams) -> Result<RangeHints> {
    if snapshot.is_stopped {
        return Ok(RangeHints::default());
    }
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let range = lines.text_range(params.range);
    let (db, options) = (&snapshot.db, snapshot.settings.hints);
    let (hints, figures, is_incomplete) = if is_model(file.path(db)) {
        let of_project =
            |project| mauve_ide::inlay_hints(db, project, file, range, options, &snapshot.earlier);
        let project = snapshot.project(file);
        let hints = project.map(of_project).unwrap_or_default();
        let of_project = |it| snapshot.earlier.shown(db, (file, it), range, options, snapshot.are_saved);
        (hints, project.map(of_project).unwrap_or_default(), false)
    } else {
        let end = snapshot.capabilities.hint_refresh.then(|| Instant::now() + PATIENCE);
        let (hints, is_incomplete) = mauve_ide::table_hints(
            db,
            &snapshot.answering(file),
            file,
            range,
            options,
            &snapshot.earlier,
            end,
        );
        (hints, EarlierFigures::default(), is_incomplete)
    };
    let version = snapshot.version(&params.text_document.uri);
    let mut last = None;
    let hints = hints.into_iter().map(|hint| {
        let follows = last.replace(hint.offset) == Some(hint.offset) && snapshot.capabilities.gathers_padding;
        let mut data = json!({ "status": hint.status.name() });
        if hint.labels.len() > 1 {
            data["labels"] = json!(hint.labels[..]);
        }
        if let Some(load) = hint.load {
            data["load"] = json!(load);
        }
        if let Some(offset) = hint.explained_at {
            let at = lines.position(offset);
            data["at"] = json!([params.text_document.uri, version, at.line, at.character]);
        }
        lsp_types::InlayHint {
            position: lines.position(hint.offset),
            label: InlayHintLabel::String(if follows { format!(" · {}", hint.label) } else { hint.label }),
            kind: None,
            text_edits: None,
            // Other hints are explained when they are resolved.
            tooltip: (hint.status == HintStatus::Older).then(|| InlayHintTooltip::String(OLDER.to_owned())),
            padding_left: Some(!follows),
            padding_right: None,
            data: Some(data),
        }
    });
    Ok(RangeHints { list: hints.collect(), figures, missing: is_incomplete.then_some((file, range)) })
}

/// Searches the limits that hints of a timing table lack: salsa keeps them for the next request.
pub(crate) fn search_limits(snapshot: &Snapshot, (file, range): (File, TextRange)) {
    let (db, options) = (&snapshot.db, snapshot.settings.hints);
    mauve_ide::table_hints(db, &snapshot.answering(file), file, range, options, &snapshot.earlier, None);
}

/// A hint with its explanation.
pub(crate) fn resolve(snapshot: &Snapshot, hint: &lsp_types::InlayHint) -> Result<lsp_types::InlayHint> {
    let mut hint = hint.clone();
    let at = hint.data.as_ref().and_then(|data| data.get("at"));
    let explained = at.and_then(|at| Explained::deserialize(at).ok());
    let Some((uri, version, line, column)) = explained else { return Ok(hint) };
    let document = TextDocumentIdentifier::new(uri);
    snapshot.unchanged(&document, version)?;
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&document)?;
    let offset = lines.offset(Position::new(line, column));
    if hint.tooltip.is_none()
        && let Some((_, contents)) = hover_at(snapshot, file, offset)
    {
        hint.tooltip = Some(InlayHintTooltip::MarkupContent(contents));
    }
    Ok(hint)
}
