//! Orocos packages from an editor: code actions of the kind `source.generate.mauve`, the command `mauve.generateOrocos`
//! (see `execute_command.rs`), and the request `mauve/generate` for clients that show what would be done by themselves.
//!
//! | parameter | is | if left out |
//! |---|---|---|
//! | `textDocument` | a file: that of the deployment, or any other of its projects | |
//! | `deployment` | a name, with its library or without: its packages and those that they need | all packages |
//!
//! The result has the `folder` of the packages, absolute; `files`, each with its `path` in there and the `action` that is
//! due, `create`, `change` or `remove`; `changedCodels`, files of the user's that were written for another prototype, with
//! the `path`, the prototype `before` and `now`; `leftCodels`, such files of no codel of the model any more; `leftFiles`,
//! files that a manifest lists as generated, that are made no more, and that may be the user's all the same; `leftPackages`,
//! folders of packages that the models make no more; all of these stay. And the `edit` that does it all: each text edit in it
//! gives a file all of its text, and the manifest of a package comes last. It is refused in words for the user where something
//! is to be put right first.
//!
//! A client that has the command `mauve.generateOrocos` itself says so in its capabilities, `experimental.commands`. Then
//! code actions are that command, with the same arguments, and the client asks by the request.

use std::collections::HashMap;

use mauve_hir::item_tree::Kind;
use mauve_hir::{File, declarations, is_model, source_map};
use mauve_orocos::Action;
use mauve_syntax::TextRange;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    AnnotatedTextEdit, ChangeAnnotation, CodeAction, CodeActionContext, CodeActionDisabled, CodeActionKind,
    CodeActionTriggerKind, Command, CreateFile, CreateFileOptions, DeleteFile, DeleteFileOptions,
    DocumentChangeOperation, DocumentChanges, OneOf, OptionalVersionedTextDocumentIdentifier, Position,
    Range, ResourceOp, TextDocumentEdit, TextDocumentIdentifier, TextEdit, Url, WorkspaceEdit,
};

use super::execute_command::GENERATE;
use super::rename::refused;
use crate::generate::{GenerateRequest, Generated};
use crate::lsp::generate::{Preview, only, open, preview, refusal, request, title};
use crate::lsp::position::end_of;
use crate::lsp::snapshot::{ANOTHER_TEXT, Snapshot};

/// The kind of the code actions.
pub(crate) const KIND: CodeActionKind = CodeActionKind::new("source.generate.mauve");

/// What is asked.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GenerateParams {
    pub(crate) text_document: TextDocumentIdentifier,
    pub(crate) deployment: Option<String>,
}

/// What would be done.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct GenerateDocument {
    folder: std::path::PathBuf,
    files: Vec<FileDocument>,
    changed_codels: Vec<ChangedCodelDocument>,
    left_codels: Vec<String>,
    left_files: Vec<String>,
    left_packages: Vec<String>,
    edit: WorkspaceEdit,
    /// What the user is told when it is done, or instead of it.
    #[serde(skip)]
    messages: Messages,
}

#[derive(Debug, Serialize)]
struct FileDocument {
    path: String,
    action: &'static str,
}

#[derive(Debug, Serialize)]
struct ChangedCodelDocument {
    path: String,
    before: String,
    now: String,
}

/// Messages about an edit, for the user.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Messages {
    /// Which of the user's files, and which packages, the model no longer has.
    pub(crate) warning: Option<String>,
    /// That nothing needs to change.
    pub(crate) nothing: Option<String>,
}

impl GenerateDocument {
    /// The edit, and the messages about it.
    pub(crate) fn into_edit(self) -> (WorkspaceEdit, Messages) {
        (self.edit, self.messages)
    }

    /// What was done, for who cannot see it.
    pub(crate) fn summary(&self) -> Value {
        let of = |action| self.files.iter().filter(|it| it.action == action).count();
        json!({"folder": self.folder, "created": of("create"), "changed": of("change"), "removed": of("remove")})
    }
}

/// What would be done to the files of the workspace.
pub(crate) fn generate(snapshot: &Snapshot, params: &GenerateParams) -> Result<GenerateDocument> {
    snapshot.complete()?;
    let uri = &params.text_document.uri;
    let (file, _) = snapshot.file(&params.text_document)?;
    if !snapshot.capabilities.resource_operations {
        return Err(refused(
            "this editor makes no files that a change says to: run `mauve generate`".to_owned(),
        ));
    }
    let mut request = request(snapshot, file).map_err(refused)?;
    if let Some(deployment) = &params.deployment {
        request = only(&snapshot.db, &request, deployment).map_err(refused)?;
    }
    let preview = preview(snapshot, &request).map_err(refused)?;
    let edit = edit(snapshot, &preview, uri)?;
    let messages = Messages { warning: preview.warning(), nothing: preview.nothing() };
    let Generated { out, plan, left_packages, .. } = preview.generated;
    let files = plan.steps.iter().map(|step| FileDocument {
        path: step.path.clone(),
        action: match step.action {
            Action::Create(_) => "create",
            Action::Change(_) => "change",
            Action::Remove => "remove",
        },
    });
    let changed = plan.changed_codels.into_iter().map(|it| ChangedCodelDocument {
        path: it.path,
        before: it.before,
        now: it.now,
    });
    Ok(GenerateDocument {
        files: files.collect(),
        changed_codels: changed.collect(),
        left_codels: plan.left_codels,
        left_files: plan.left_files,
        left_packages,
        edit,
        messages,
        folder: out.real,
    })
}

/// What an action needs to be found again, once the user has chosen it.
#[derive(Serialize, Deserialize)]
pub(crate) struct Chosen {
    pub(crate) document: TextDocumentIdentifier,
    pub(crate) version: Option<i32>,
    generate: Generate,
}

#[derive(Serialize, Deserialize)]
struct Generate {
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
    if !is_model(file.path(db)) {
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
    // What comes to nothing but a word is for those who ask for it.
    if context.only.is_none() && !snapshot.capabilities.resource_operations {
        return Vec::new();
    }
    if of.is_empty() {
        return Vec::new();
    }
    let is_automatic = context.trigger_kind == Some(CodeActionTriggerKind::AUTOMATIC);
    // Once for all of them: it asks all the models, and the disk.
    let Ok(all) = request(snapshot, file) else { return Vec::new() };
    of.into_iter()
        .filter_map(|deployment| action(snapshot, document, &all, deployment, is_automatic))
        .collect()
}

/// None where nobody asked for an action that cannot be done.
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
        None if capabilities.resolves_edits
            && capabilities.resource_operations
            && !capabilities.generates =>
        {
            let version = snapshot.documents.get(&document.uri).map(|document| document.version);
            let generate = Generate { deployment: deployment.map(str::to_owned) };
            let chosen = Chosen { document: document.clone(), version, generate };
            action.data = serde_json::to_value(chosen).ok();
        }
        // It says why not, where that is so. Otherwise no disk is read before the user has chosen it.
        _ => action.command = Some(command(title, &document.uri, deployment)),
    }
    Some(action)
}

/// The command that generates the packages of a deployment, or all.
pub(crate) fn command(title: String, uri: &Url, deployment: Option<&str>) -> Command {
    Command { title, command: GENERATE.to_owned(), arguments: Some(vec![json!(uri), json!(deployment)]) }
}

/// What was chosen.
pub(crate) fn chosen(action: &CodeAction) -> Option<Chosen> {
    let data = action.data.clone().filter(|_| action.edit.is_none())?;
    serde_json::from_value(data).ok()
}

/// The edit of an action that was chosen.
pub(crate) fn resolve(snapshot: &Snapshot, chosen: Chosen) -> Result<GenerateDocument> {
    snapshot.unchanged(&chosen.document, chosen.version)?;
    let Chosen { document: text_document, generate: Generate { deployment }, .. } = chosen;
    generate(snapshot, &GenerateParams { text_document, deployment })
}

/// The edit that does it; `asked` is the document from which it was asked for.
fn edit(snapshot: &Snapshot, preview: &Preview, asked: &Url) -> Result<WorkspaceEdit> {
    let steps = &preview.generated.plan.steps;
    let capabilities = snapshot.capabilities;
    let mut annotations = Annotations {
        are_known: capabilities.change_annotations,
        folder: &preview.shown_folder,
        all: HashMap::new(),
    };
    let mut operations = Vec::new();
    // VS Code shows all of an edit before it is made where a part of it is to be confirmed, and leaves that part out
    // unless the user chooses it. So it is one that does nothing, and no file is left out by accident.
    let is_there = asked.to_file_path().is_ok_and(|path| path.is_file());
    if capabilities.change_annotations && is_there && !steps.is_empty() {
        let options = CreateFileOptions { overwrite: None, ignore_if_exists: Some(true) };
        let annotation_id = annotations.add("Look at what is generated", true);
        let create = CreateFile { uri: asked.clone(), options: Some(options), annotation_id };
        operations.push(DocumentChangeOperation::Op(ResourceOp::Create(create)));
    }
    for step in steps {
        let path = preview.path(step);
        let known = open(snapshot, &path);
        if known.is_some_and(|(_, document)| !document.is_analysed) {
            return Err(refused(format!("{}: {ANOTHER_TEXT}", path.display())));
        }
        let uri = known.map(|(uri, _)| uri.clone()).or_else(|| Url::from_file_path(&path).ok());
        let uri = uri.ok_or_else(|| refused(format!("{} has no address", path.display())))?;
        let version = known.map(|(_, document)| document.version);
        let text_document = OptionalVersionedTextDocumentIdentifier { uri: uri.clone(), version };
        let (text, end, annotation_id) = match &step.action {
            Action::Create(text) => {
                let annotation_id = annotations.add("Create files", false);
                let options = CreateFileOptions { overwrite: Some(false), ignore_if_exists: Some(false) };
                let create = CreateFile { uri, options: Some(options), annotation_id: annotation_id.clone() };
                operations.push(DocumentChangeOperation::Op(ResourceOp::Create(create)));
                // The only line of an empty file is replaced as well where it would stay.
                (text, Position::new(u32::from(capabilities.keeps_last_line), 0), annotation_id)
            }
            Action::Change(text) => {
                let before = preview.before.get(&step.path).map_or("", String::as_str);
                let annotation_id = annotations.add("Change generated files", false);
                (text, end_of(before, capabilities.encoding), annotation_id)
            }
            Action::Remove => {
                if !capabilities.deletes_files {
                    return Err(refused(format!(
                        "{} is not generated any more, and this editor removes no files that a change says to: run `mauve \
                         generate`",
                        path.display()
                    )));
                }
                let options = annotations.add("Remove files that are not generated any more", false);
                let options = DeleteFileOptions {
                    recursive: Some(false),
                    ignore_if_not_exists: Some(true),
                    annotation_id: options,
                };
                let delete = DeleteFile { uri, options: Some(options) };
                operations.push(DocumentChangeOperation::Op(ResourceOp::Delete(delete)));
                continue;
            }
        };
        let text_edit = TextEdit::new(Range::new(Position::default(), end), text.clone());
        let text_edit = match annotation_id {
            Some(annotation_id) => OneOf::Right(AnnotatedTextEdit { text_edit, annotation_id }),
            None => OneOf::Left(text_edit),
        };
        let edit = TextDocumentEdit { text_document, edits: vec![text_edit] };
        operations.push(DocumentChangeOperation::Edit(edit));
    }
    Ok(WorkspaceEdit {
        changes: None,
        document_changes: Some(DocumentChanges::Operations(operations)),
        change_annotations: (!annotations.all.is_empty()).then_some(annotations.all),
    })
}

/// What the parts of an edit are called, for clients that show that.
struct Annotations<'a> {
    are_known: bool,
    folder: &'a str,
    all: HashMap<String, ChangeAnnotation>,
}

impl Annotations<'_> {
    fn add(&mut self, label: &str, needs_confirmation: bool) -> Option<String> {
        if !self.are_known {
            return None;
        }
        self.all.entry(label.to_owned()).or_insert_with(|| ChangeAnnotation {
            label: label.to_owned(),
            needs_confirmation: Some(needs_confirmation),
            description: Some(format!("in {}", self.folder)),
        });
        Some(label.to_owned())
    }
}
