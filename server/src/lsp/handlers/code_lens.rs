//! `textDocument/codeLens` and `codeLens/resolve`.
//!
//! A click executes `mauve.setSignificance` or `mauve.generateOrocos` (see `execute_command.rs`), which the server has, or
//! `mauve.showReferences`, which a client may have and then names in its capabilities, `experimental.commands`. Its arguments are an address, a position in
//! it, and locations: what `editor.action.showReferences` of VS Code takes, as the protocol writes them. Without it, the
//! lens says what it says, and does nothing.

use mauve_ide::{Lens, LensAction, LensKind, code_lens_at, resolve_code_lens};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    self, CodeLensParams, Command, Location, Position, Range, TextDocumentIdentifier, Url,
};

use super::execute_command::{GENERATE, SET_SIGNIFICANCE};
use crate::lsp::snapshot::Snapshot;
use crate::lsp::to_proto;

/// The client's command that shows locations.
pub(crate) const SHOW_REFERENCES: &str = "mauve.showReferences";

/// The data of a lens with which it is resolved.
#[derive(Serialize, Deserialize)]
struct Later {
    document: TextDocumentIdentifier,
    version: Option<i32>,
    at: Position,
    kind: Kind,
}

#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
enum Kind {
    Deadlines,
    Instances,
}

/// Returns the lenses of a file; expensive ones are resolved later.
pub(crate) fn code_lenses(
    snapshot: &Snapshot,
    params: &CodeLensParams,
) -> Result<Option<Vec<lsp_types::CodeLens>>> {
    if !snapshot.settings.lenses || snapshot.is_stopped {
        return Ok(Some(Vec::new()));
    }
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let version = snapshot.version(&params.text_document.uri);
    let lenses = mauve_ide::code_lenses(&snapshot.db, &snapshot.workspaces, file);
    let lenses = lenses.into_iter().filter_map(|lens| {
        let range = lines.range(lens.range);
        let later = |kind| {
            let later = Later { document: params.text_document.clone(), version, at: range.start, kind };
            let data = serde_json::to_value(later).ok()?;
            Some(lsp_types::CodeLens { range, command: None, data: Some(data) })
        };
        match lens.kind {
            // Only for clients that can generate packages.
            LensKind::Generate if !snapshot.capabilities.can_generate() => None,
            LensKind::Deadlines => later(Kind::Deadlines),
            LensKind::Instances => later(Kind::Instances),
            LensKind::AtLevel(_) | LensKind::Generate | LensKind::Implementation => {
                let lens = resolve_code_lens(&snapshot.db, &snapshot.workspaces, file, lens)?;
                let is_there = match &lens.action {
                    Some(LensAction::Open(paths)) => to_proto::files_there(paths).next().is_some(),
                    _ => true,
                };
                let command = is_there.then(|| command(snapshot, &params.text_document.uri, range, lens))?;
                Some(lsp_types::CodeLens { range, command: Some(command), data: None })
            }
        }
    });
    Ok(Some(lenses.collect()))
}

/// Resolves a lens: adds its title and its command.
pub(crate) fn resolve(snapshot: &Snapshot, lens: &lsp_types::CodeLens) -> Result<lsp_types::CodeLens> {
    let mut lens = lens.clone();
    let later = lens.data.as_ref().and_then(|data| Later::deserialize(data).ok());
    let Some(Later { document, version, at, kind }) = later else { return Ok(lens) };
    snapshot.unchanged(&document, version)?;
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&document)?;
    let (db, workspaces) = (&snapshot.db, &snapshot.workspaces);
    let is_it = |found: LensKind| match kind {
        Kind::Deadlines => found == LensKind::Deadlines,
        Kind::Instances => found == LensKind::Instances,
    };
    let found = code_lens_at(db, workspaces, file, lines.offset(at), is_it);
    let found = found.and_then(|found| resolve_code_lens(db, workspaces, file, found));
    // A lens without a result gets a title, since an empty command is an error in some clients.
    let found = found.unwrap_or_else(|| Lens { title: "no real-time activities".to_owned(), action: None });
    lens.command = Some(command(snapshot, &document.uri, lens.range, found));
    Ok(lens)
}

fn command(snapshot: &Snapshot, uri: &Url, range: Range, lens: Lens) -> Command {
    let show = |locations: Vec<Location>| {
        let is_shown = snapshot.capabilities.shows_references && !locations.is_empty();
        let arguments = vec![json!(uri), json!(range.start), json!(locations)];
        is_shown.then_some((SHOW_REFERENCES, arguments))
    };
    let action: Option<(&str, Vec<Value>)> = lens.action.and_then(|action| match action {
        LensAction::SetSignificance(level) => Some((SET_SIGNIFICANCE, vec![json!(level.as_f64())])),
        LensAction::Generate(deployment) => Some((GENERATE, vec![json!(uri), json!(deployment)])),
        LensAction::Show(places) => {
            show(places.into_iter().filter_map(|(file, range)| snapshot.location(file, range)).collect())
        }
        LensAction::Open(paths) => {
            let all = to_proto::files_there(&paths);
            show(all.map(|uri| Location { uri, range: Range::default() }).collect())
        }
    });
    let (command, arguments) =
        action.map_or_else(|| (String::new(), None), |(name, arguments)| (name.to_owned(), Some(arguments)));
    Command { title: lens.title, command, arguments }
}
