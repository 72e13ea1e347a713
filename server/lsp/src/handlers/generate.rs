//! Orocos packages from an editor: code actions of the kind `source.generate.mauve`, the command `mauve.generateOrocos`
//! (see `execute_command.rs`), and the request `mauve/generate` for clients that show what would be done by themselves.
//!
//! | parameter | is | if left out |
//! |---|---|---|
//! | `textDocument` | a file: that of the deployment, or any other of its projects | |
//! | `deployment` | a name, with its library or without: its packages and those that they need | all packages |
//! | `write` | the `edit` of an earlier answer: where it is still the same, the server makes it, all of it or nothing | nothing is written |
//!
//! The result has the `folder` of the packages, absolute; `files`, each with its `path` in there and the `action` that is
//! due, `create`, `change` or `remove`; a `warning` for the user, or null, about what stays though the models have left it
//! behind: the user's codels of another prototype or of none, files that may be the user's, and packages; the message that
//! `nothing` changes, or null. And the `edit` that does it all: each text edit in it gives a file all of its text, and the
//! manifest of a package comes last. It is refused in words for the user where something is to be put right first.
//!
//! A client that has the command `mauve.generateOrocos` itself says so in its capabilities, `experimental.commands`. Then
//! code actions are that command, with the same arguments, and the client asks by the request.

use mauve_hir::item_tree::Kind;
use mauve_hir::{File, declarations, is_model, source_map};
use mauve_orocos::Action;
use mauve_projects::address::{address_of, file_of};
use mauve_projects::generate::{GenerateRequest, Generated};
use mauve_syntax::TextRange;
use salsa::Database as _;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    ChangeAnnotation, CodeAction, CodeActionContext, CodeActionDisabled, CodeActionKind,
    CodeActionTriggerKind, Command, Position, Range, TextDocumentIdentifier, TextEdit, Url, WorkspaceEdit,
};

use super::rename::refused;
use crate::commands::GENERATE;
use crate::diagnostics::ANOTHER_TEXT;
use crate::generate::{Preview, only, open, preview, refusal, request, title};
use crate::position::end_of;
use crate::snapshot::Snapshot;
use crate::to_proto::EditBuilder;

/// The kind of the code actions.
pub(crate) const KIND: CodeActionKind = CodeActionKind::new("source.generate.mauve");

/// The parameters of `mauve/generate`.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GenerateParams {
    pub(crate) text_document: TextDocumentIdentifier,
    pub(crate) deployment: Option<String>,
    pub(crate) write: Option<WorkspaceEdit>,
}

/// The result of `mauve/generate`.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GenerateDocument {
    folder: std::path::PathBuf,
    files: Vec<Value>,
    pub(crate) edit: WorkspaceEdit,
    #[serde(flatten)]
    pub(crate) messages: GenerateMessages,
}

/// Messages about an edit, for the user.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(crate) struct GenerateMessages {
    /// Which of the user's files, and which packages, the model no longer has.
    pub(crate) warning: Option<String>,
    /// That nothing needs to change.
    pub(crate) nothing: Option<String>,
}

impl GenerateDocument {
    /// Returns the result of the command: the folder, and the numbers of files.
    pub(crate) fn summary(&self) -> Value {
        let of = |action| self.files.iter().filter(|it| it["action"] == action).count();
        json!({"folder": self.folder, "created": of("create"), "changed": of("change"), "removed": of("remove")})
    }
}

/// Returns the edit that generates packages, and its description.
pub(crate) fn generate(snapshot: &Snapshot, params: &GenerateParams) -> Result<GenerateDocument> {
    snapshot.complete()?;
    let uri = &params.text_document.uri;
    let (file, _) = snapshot.file(&params.text_document)?;
    if !snapshot.capabilities.creates_files {
        return Err(refused(
            "this editor does not create files for a workspace edit: run `mauve generate`".to_owned(),
        ));
    }
    let mut request = request(snapshot, file).map_err(refused)?;
    if let Some(deployment) = &params.deployment {
        request = only(&snapshot.db, &request, deployment).map_err(refused)?;
    }
    request.is_written = params.write.is_some();
    let preview = preview(snapshot, &request).map_err(refused)?;
    let edit = edit(snapshot, &preview, uri)?;
    let messages = GenerateMessages { warning: preview.warning(), nothing: preview.nothing() };
    let Generated { out, plan, site, .. } = preview.generated;
    // As a client sends it back: what was read may differ from what was written.
    let sent = serde_json::to_value(&edit).and_then(WorkspaceEdit::deserialize).ok();
    if let Some(site) = site.filter(|_| params.write == sent) {
        site.write(&plan.steps).map_err(refused)?;
    }
    let files = plan.steps.iter().map(|step| json!({ "path": step.path, "action": step.action.name() }));
    Ok(GenerateDocument { files: files.collect(), edit, messages, folder: out.real })
}

/// The data of an offered action with which it is resolved.
#[derive(Serialize, Deserialize)]
pub(crate) struct ChosenGeneration {
    pub(crate) document: TextDocumentIdentifier,
    pub(crate) version: Option<i32>,
    generate: GenerateChoice,
}

#[derive(Serialize, Deserialize)]
struct GenerateChoice {
    deployment: Option<String>,
}

/// The actions that generate packages: of the deployments that a range touches; where somebody asks for this kind, also of
/// the others of the file, and of all projects that have it. The edit is made when the user has chosen one: until then
/// nothing is read from the disk.
pub(crate) fn actions(
    snapshot: &Snapshot,
    document: &TextDocumentIdentifier,
    file: File,
    range: TextRange,
    context: &CodeActionContext,
) -> Vec<CodeAction> {
    let db = &snapshot.db;
    // Disabled actions are listed only if the client requests this kind.
    let is_possible = context.only.is_some() || snapshot.capabilities.creates_files;
    if !is_model(file.path(db)) || !is_possible {
        return Vec::new();
    }
    let all = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
    let all = all.filter(|(decl, _)| decl.kind(db) == Kind::Deployment && !decl.name(db).is_empty());
    let all: Vec<_> = all.map(|(decl, map)| (decl.qualified(db), map.range)).collect();
    let touched = all.iter().filter(|(_, at)| at.intersect(range).is_some());
    let mut of: Vec<Option<&str>> = touched.map(|(name, _)| Some(name.as_str())).collect();
    if context.only.is_some() {
        if of.is_empty() {
            of.extend(all.iter().map(|(name, _)| Some(name.as_str())));
        }
        of.push(None);
    }
    if of.is_empty() {
        return Vec::new();
    }
    let is_automatic = context.trigger_kind == Some(CodeActionTriggerKind::AUTOMATIC);
    // Computed once for all actions, since it reads all models and the disk.
    let Ok(all) = request(snapshot, file) else { return Vec::new() };
    of.into_iter()
        .filter_map(|deployment| action(snapshot, document, &all, deployment, is_automatic))
        .collect()
}

/// Returns `None` for a disabled action, unless the client requests this kind.
fn action<'db>(
    snapshot: &'db Snapshot,
    document: &TextDocumentIdentifier,
    all: &GenerateRequest<'db>,
    deployment: Option<&str>,
    is_automatic: bool,
) -> Option<CodeAction> {
    let capabilities = snapshot.capabilities;
    let request = match deployment {
        Some(name) => only(&snapshot.db, all, name).ok()?,
        None => all.clone(),
    };
    let refusal = refusal(snapshot, &request);
    if is_automatic && refusal.is_some() {
        return None;
    }
    let title = title(&snapshot.db, &request);
    let mut action = CodeAction { title: title.clone(), kind: Some(KIND), ..CodeAction::default() };
    match refusal {
        Some(reason) if capabilities.disabled_actions => {
            action.disabled = Some(CodeActionDisabled { reason });
        }
        None if capabilities.resolves_edits && capabilities.creates_files && !capabilities.generates => {
            let version = snapshot.version(&document.uri);
            let generate = GenerateChoice { deployment: deployment.map(str::to_owned) };
            let chosen = ChosenGeneration { document: document.clone(), version, generate };
            action.data = serde_json::to_value(chosen).ok();
        }
        // A disabled action has the reason. Otherwise the disk is read only after the user has chosen the action.
        _ => action.command = Some(command(title, &document.uri, deployment)),
    }
    Some(action)
}

/// Returns the command that generates the packages of a deployment, or all packages.
pub(crate) fn command(title: String, uri: &Url, deployment: Option<&str>) -> Command {
    Command { title, command: GENERATE.to_owned(), arguments: Some(vec![json!(uri), json!(deployment)]) }
}

/// Returns the data of a chosen action.
pub(crate) fn chosen(action: &CodeAction) -> Option<ChosenGeneration> {
    ChosenGeneration::deserialize(action.data.as_ref().filter(|_| action.edit.is_none())?).ok()
}

/// Returns the edit of a chosen action.
pub(crate) fn resolve(snapshot: &Snapshot, chosen: ChosenGeneration) -> Result<GenerateDocument> {
    snapshot.unchanged(&chosen.document, chosen.version)?;
    let ChosenGeneration { document: text_document, generate: GenerateChoice { deployment }, .. } = chosen;
    generate(snapshot, &GenerateParams { text_document, deployment, write: None })
}

/// Returns the workspace edit; `asked` is the document from which it was requested.
fn edit(snapshot: &Snapshot, preview: &Preview, asked: &Url) -> Result<WorkspaceEdit> {
    let steps = &preview.generated.plan.steps;
    let capabilities = snapshot.capabilities;
    let annotation = |label: &str, needs_confirmation: bool| ChangeAnnotation {
        label: label.to_owned(),
        needs_confirmation: Some(needs_confirmation),
        description: Some(format!("in {}", preview.shown_folder)),
    };
    let mut builder = EditBuilder::new(capabilities.change_annotations);
    // VS Code shows all of an edit before it is made where a part of it is to be confirmed, and leaves that part out
    // unless the user chooses it. So it is one that does nothing, and no file is left out by accident.
    let is_there = file_of(asked).is_some_and(|path| path.is_file());
    if capabilities.change_annotations && is_there && !steps.is_empty() {
        builder.create(asked.clone(), None, Some(true), &annotation("Preview the generated files", true));
    }
    for step in steps {
        snapshot.db.unwind_if_revision_cancelled();
        let path = preview.path(step);
        let known = open(snapshot, &path);
        if known.is_some_and(|(_, document)| !document.is_analysed) {
            return Err(refused(format!("{}: {ANOTHER_TEXT}", path.display())));
        }
        let uri = known.map(|(uri, _)| uri.clone()).or_else(|| address_of(&path));
        let uri = uri.ok_or_else(|| refused(format!("{} cannot be written as a URI", path.display())))?;
        let version = known.map(|(_, document)| document.version);
        let (text, end, annotation) = match &step.action {
            Action::Create(text) => {
                let annotation = annotation("Create files", false);
                builder.create(uri.clone(), Some(false), Some(false), &annotation);
                // The only line of an empty file is replaced as well, if the client would keep it.
                (text, Position::new(u32::from(capabilities.keeps_last_line), 0), annotation)
            }
            Action::Change(text) => {
                let before = preview.before.get(&step.path).map_or("", String::as_str);
                (text, end_of(before, capabilities.encoding), annotation("Change generated files", false))
            }
            Action::Remove if capabilities.deletes_files => {
                builder.delete(uri, &annotation("Remove files that are no longer generated", false));
                continue;
            }
            Action::Remove => {
                return Err(refused(format!(
                    "{} is no longer generated, and this editor does not remove files for a workspace edit: \
                     run `mauve generate`",
                    path.display()
                )));
            }
        };
        let edits = vec![TextEdit::new(Range::new(Position::default(), end), text.clone())];
        builder.edit(uri, version, edits, Some(&annotation));
    }
    Ok(builder.finish())
}
