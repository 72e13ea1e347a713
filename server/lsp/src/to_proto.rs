//! Translates results to types of the protocol.

use std::collections::HashMap;
use std::path::PathBuf;

use mauve_hir::File;
use mauve_ide::{Change, FileChange};
use mauve_projects::address::address_of;
use mauve_syntax::format::Replacement;
use tower_lsp::lsp_types::*;

use super::snapshot::Snapshot;

/// Translates a change; `None` if the client cannot create its files. `label` is the title of the chosen action.
pub(crate) fn workspace_edit(snapshot: &Snapshot, change: &Change, label: &str) -> Option<WorkspaceEdit> {
    let capabilities = snapshot.capabilities;
    if !capabilities.document_changes {
        let by_url =
            |it: &FileChange| Some((snapshot.url(it.file)?, text_edits(snapshot, it.file, &it.edits)));
        let changes = change.files.iter().map(by_url).collect::<Option<_>>()?;
        return change.created.is_empty().then(|| WorkspaceEdit::new(changes));
    }
    if !change.created.is_empty() && !capabilities.creates_files {
        return None;
    }
    let annotation = |label: &str| ChangeAnnotation {
        label: label.to_owned(),
        needs_confirmation: None,
        description: None,
    };
    let mut builder = EditBuilder::new(capabilities.change_annotations);
    for it in &change.files {
        let uri = snapshot.url(it.file)?;
        let version = snapshot.version(&uri);
        let annotation = annotation(it.note.as_deref().unwrap_or(label));
        builder.edit(uri, version, text_edits(snapshot, it.file, &it.edits), Some(&annotation));
    }
    for (path, text) in &change.created {
        let uri = address_of(path)?;
        builder.create(uri.clone(), Some(false), Some(false), &annotation(label));
        builder.edit(uri, None, vec![TextEdit::new(Range::default(), text.clone())], None);
    }
    Some(builder.finish())
}

/// Builds an edit of ordered operations, with annotations for clients that support them.
pub(crate) struct EditBuilder {
    has_annotations: bool,
    operations: Vec<DocumentChangeOperation>,
    annotations: HashMap<String, ChangeAnnotation>,
}

impl EditBuilder {
    pub(crate) fn new(has_annotations: bool) -> EditBuilder {
        EditBuilder { has_annotations, operations: Vec::new(), annotations: HashMap::new() }
    }

    fn annotate(&mut self, annotation: &ChangeAnnotation) -> Option<String> {
        let label = self.has_annotations.then(|| annotation.label.clone())?;
        self.annotations.entry(label.clone()).or_insert_with(|| annotation.clone());
        Some(label)
    }

    pub(crate) fn create(
        &mut self,
        uri: Url,
        overwrite: Option<bool>,
        ignore_if_exists: Option<bool>,
        annotation: &ChangeAnnotation,
    ) {
        let options = Some(CreateFileOptions { overwrite, ignore_if_exists });
        let create = CreateFile { uri, options, annotation_id: self.annotate(annotation) };
        self.operations.push(DocumentChangeOperation::Op(ResourceOp::Create(create)));
    }

    pub(crate) fn delete(&mut self, uri: Url, annotation: &ChangeAnnotation) {
        let options = DeleteFileOptions {
            recursive: Some(false),
            ignore_if_not_exists: Some(true),
            annotation_id: self.annotate(annotation),
        };
        let delete = DeleteFile { uri, options: Some(options) };
        self.operations.push(DocumentChangeOperation::Op(ResourceOp::Delete(delete)));
    }

    pub(crate) fn edit(
        &mut self,
        uri: Url,
        version: Option<i32>,
        edits: Vec<TextEdit>,
        annotation: Option<&ChangeAnnotation>,
    ) {
        let edit = |text_edit| match annotation.and_then(|it| self.annotate(it)) {
            Some(annotation_id) => OneOf::Right(AnnotatedTextEdit { text_edit, annotation_id }),
            None => OneOf::Left(text_edit),
        };
        let edits = edits.into_iter().map(edit).collect();
        let text_document = OptionalVersionedTextDocumentIdentifier { uri, version };
        self.operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits }));
    }

    pub(crate) fn finish(self) -> WorkspaceEdit {
        WorkspaceEdit {
            changes: None,
            document_changes: Some(DocumentChanges::Operations(self.operations)),
            change_annotations: (!self.annotations.is_empty()).then_some(self.annotations),
        }
    }
}

/// Translates the edits of a file.
pub(crate) fn text_edits(snapshot: &Snapshot, file: File, edits: &[Replacement]) -> Vec<TextEdit> {
    let lines = snapshot.lines(file);
    edits.iter().map(|it| TextEdit::new(lines.range(it.range), it.text.clone())).collect()
}

/// Returns the URIs of the files that exist. A codel may not be written yet, or a message package may be removed.
pub(crate) fn files_there(paths: &[PathBuf]) -> impl Iterator<Item = Url> {
    paths.iter().filter(|path| path.is_file()).filter_map(|path| address_of(path))
}

/// Translates a location.
pub(crate) fn location(snapshot: &Snapshot, at: &mauve_hir::Location<'_>) -> Option<Location> {
    snapshot.location(at.file(&snapshot.db), at.range(&snapshot.db))
}
