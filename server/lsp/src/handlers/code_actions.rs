//! `textDocument/codeAction` and `codeAction/resolve`.

use mauve_hir::Severity;
use mauve_ide::{ActionKind, ActionQuestion, Changes, CodeAction};
use mauve_syntax::TextRange;
use serde::{Deserialize, Serialize};
use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::{
    self, CodeActionDisabled, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse,
    CodeActionTriggerKind, NumberOrString, Range, TextDocumentIdentifier,
};

use super::generate::{self, GenerateMessages};
use crate::snapshot::Snapshot;
use crate::to_proto;

/// All fixes that change no meaning and no figure. A client that asks for `source.fixAll` gets them, too.
const FIX_ALL: CodeActionKind = CodeActionKind::new("source.fixAll.mauve");

/// The kinds of code actions, and their names in the protocol.
const KINDS: [(ActionKind, CodeActionKind); 4] = [
    (ActionKind::QuickFix, CodeActionKind::QUICKFIX),
    (ActionKind::Rewrite, CodeActionKind::REFACTOR_REWRITE),
    (ActionKind::OrganizeUses, CodeActionKind::SOURCE_ORGANIZE_IMPORTS),
    (ActionKind::FixAll, FIX_ALL),
];

/// Returns the kinds that the server offers.
pub(crate) fn kinds() -> Vec<CodeActionKind> {
    KINDS.into_iter().map(|(_, name)| name).chain([generate::KIND]).collect()
}

/// The data of an offered action with which it is resolved.
#[derive(Serialize, Deserialize)]
struct ChosenAction {
    document: TextDocumentIdentifier,
    version: Option<i32>,
    range: Range,
    fixed: Option<(Range, String)>,
}

/// Returns the code actions for a range. Their edits are computed when the user has chosen one, if the client
/// supports that.
pub(crate) fn code_actions(
    snapshot: &Snapshot,
    params: &CodeActionParams,
) -> Result<Option<CodeActionResponse>> {
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let capabilities = snapshot.capabilities;
    if !capabilities.code_actions {
        return Ok(Some(Vec::new()));
    }
    let context = &params.context;
    let is_wanted = |(kind, name): &(ActionKind, CodeActionKind)| match &context.only {
        Some(only) => is_among(only, name),
        // Actions for the whole file are not computed at every cursor movement.
        None => !matches!(kind, ActionKind::OrganizeUses | ActionKind::FixAll),
    };
    let kinds: Vec<ActionKind> = KINDS.into_iter().filter(is_wanted).map(|(kind, _)| kind).collect();
    let known = context.diagnostics.iter().filter_map(|it| match &it.code {
        Some(NumberOrString::String(code)) => Some((lines.text_range(it.range), code.clone())),
        _ => None,
    });
    let diagnostics: Vec<(TextRange, String)> = known.collect();
    let changes = if capabilities.resolves_edits { Changes::None } else { Changes::All };
    let range = lines.text_range(params.range);
    let question = ActionQuestion { file, range, diagnostics: &diagnostics, kinds: &kinds, changes };
    let version = snapshot.version(&params.text_document.uri);
    let is_automatic = context.trigger_kind == Some(CodeActionTriggerKind::AUTOMATIC);
    let shows_disabled = capabilities.disabled_actions && !is_automatic;
    let found = of_question(snapshot, question);
    // The editor shows a bulb: nothing but what needs to be changed.
    let is_bulb = is_automatic && range.is_empty();
    let is_needed = |action: &CodeAction<'_>| action.fixed.iter().any(|it| it.severity != Severity::Hint);
    let found = found.into_iter().filter(|action| !is_bulb || is_needed(action));
    let found = found.filter(|action| action.disabled.is_none() || shows_disabled);
    let found = found.filter(|action| !action.creates_files || capabilities.creates_files);
    let found = found.filter_map(|action| {
        let chosen = ChosenAction {
            document: params.text_document.clone(),
            version,
            range: params.range,
            fixed: first_fixed(snapshot, &action),
        };
        to_client(snapshot, action, &chosen)
    });
    let mut shown: Vec<lsp_types::CodeAction> = found.collect();
    if context.only.as_ref().is_none_or(|only| is_among(only, &generate::KIND)) {
        shown.extend(generate::actions(snapshot, &params.text_document, file, range, context));
    }
    Ok(Some(shown.into_iter().map(CodeActionOrCommand::CodeAction).collect()))
}

/// Returns an action with its edit, and the messages about that.
pub(crate) fn resolve(
    snapshot: &Snapshot,
    action: &lsp_types::CodeAction,
) -> Result<(lsp_types::CodeAction, GenerateMessages)> {
    if let Some(chosen) = generate::chosen(action) {
        let document = generate::resolve(snapshot, chosen)?;
        let action = lsp_types::CodeAction { edit: Some(document.edit), ..action.clone() };
        return Ok((action, document.messages));
    }
    resolve_change(snapshot, action).map(|action| (action, GenerateMessages::default()))
}

fn resolve_change(snapshot: &Snapshot, action: &lsp_types::CodeAction) -> Result<lsp_types::CodeAction> {
    let mut action = action.clone();
    let chosen = action.data.as_ref().and_then(|data| ChosenAction::deserialize(data).ok());
    let Some(chosen) = chosen.filter(|_| action.edit.is_none()) else { return Ok(action) };
    snapshot.unchanged(&chosen.document, chosen.version)?;
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&chosen.document)?;
    let diagnostics: Vec<(TextRange, String)> =
        chosen.fixed.iter().map(|(range, code)| (lines.text_range(*range), code.clone())).collect();
    let of_name = |(kind, name)| (action.kind.as_ref() == Some(&name)).then_some(kind);
    let kinds: Vec<ActionKind> = KINDS.into_iter().filter_map(of_name).collect();
    let range = lines.text_range(chosen.range);
    let changes = Changes::Of(&action.title);
    let question = ActionQuestion { file, range, diagnostics: &diagnostics, kinds: &kinds, changes };
    let found = of_question(snapshot, question);
    let is_it = |it: &CodeAction<'_>| {
        it.title == action.title && it.disabled.is_none() && first_fixed(snapshot, it) == chosen.fixed
    };
    let change = found.into_iter().find(is_it).and_then(|it| it.change);
    // The action is no longer offered, since another file has changed.
    let change = change.ok_or_else(Error::content_modified)?;
    action.edit = to_proto::workspace_edit(snapshot, &change, &action.title);
    Ok(action)
}

fn of_question<'a>(snapshot: &'a Snapshot, question: ActionQuestion<'_>) -> Vec<CodeAction<'a>> {
    let project = snapshot.project(question.file);
    mauve_ide::code_actions(&snapshot.db, &snapshot.workspaces, project, question)
}

fn first_fixed(snapshot: &Snapshot, action: &CodeAction<'_>) -> Option<(Range, String)> {
    let mauve_diagnostics::Diagnostic { at, code, .. } = &*action.fixed.first()?.diagnostic;
    Some((snapshot.lines(at.file(&snapshot.db)).range(at.range(&snapshot.db)), code.name.to_owned()))
}

/// Translates an action; `None` if the client does not support it.
fn to_client(
    snapshot: &Snapshot,
    action: CodeAction<'_>,
    chosen: &ChosenAction,
) -> Option<lsp_types::CodeAction> {
    let capabilities = snapshot.capabilities;
    let is_later = capabilities.resolves_edits && action.disabled.is_none();
    let edit = action.change.map(|change| to_proto::workspace_edit(snapshot, &change, &action.title));
    if edit == Some(None) {
        return None;
    }
    let fixed: Vec<_> = action.fixed.iter().map(|it| snapshot.diagnostic(it)).collect();
    Some(lsp_types::CodeAction {
        title: action.title,
        kind: KINDS.into_iter().find(|(kind, _)| *kind == action.kind).map(|(_, name)| name),
        diagnostics: (!fixed.is_empty()).then_some(fixed),
        edit: edit.flatten(),
        is_preferred: (capabilities.preferred_actions && action.preferred).then_some(true),
        disabled: action.disabled.map(|reason| CodeActionDisabled { reason }),
        data: is_later.then(|| serde_json::to_value(chosen).ok()).flatten(),
        ..lsp_types::CodeAction::default()
    })
}

/// Returns whether a kind is one of these, or a sub-kind of one: `refactor` includes `refactor.rewrite`.
fn is_among(only: &[CodeActionKind], kind: &CodeActionKind) -> bool {
    only.iter().any(|asked| {
        let rest = kind.as_str().strip_prefix(asked.as_str());
        rest.is_some_and(|rest| asked.as_str().is_empty() || rest.is_empty() || rest.starts_with('.'))
    })
}
