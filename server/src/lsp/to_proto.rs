//! From our words to the protocol's.

use std::collections::HashMap;
use std::path::PathBuf;

use mauve_diagnostics::{Finding, Severity};
use mauve_hir::{File, Location};
use mauve_ide::{Change, FileChange};
use mauve_syntax::format::Replacement;
use tower_lsp::lsp_types::{
    self, AnnotatedTextEdit, ChangeAnnotation, CodeDescription, CreateFile, CreateFileOptions, Diagnostic,
    DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, DocumentChangeOperation,
    DocumentChanges, NumberOrString, OneOf, OptionalVersionedTextDocumentIdentifier, Range, ResourceOp,
    TextDocumentEdit, TextEdit, Url, WorkspaceEdit,
};

use super::pages;
use super::position::line_index;
use super::snapshot::{ANOTHER_TEXT, Snapshot};
use crate::harmless::harmless;

/// A diagnostic.
pub(crate) fn diagnostic(snapshot: &Snapshot, finding: &Finding<'_>) -> Diagnostic {
    let (db, found) = (&snapshot.db, &finding.diagnostic);
    let related = found.related.iter().filter(|_| snapshot.capabilities.related);
    let related = related.filter_map(|(at, message)| {
        Some(DiagnosticRelatedInformation { location: location(snapshot, at)?, message: harmless(message) })
    });
    let related: Vec<_> = related.collect();
    let only = finding.only_in.map(|project| {
        let name = project.root(db).path(db).file_name().unwrap_or_default().display().to_string();
        format!(" (in the project of {name})")
    });
    Diagnostic {
        range: range(snapshot, &found.at),
        severity: Some(severity_of(finding.severity)),
        code: Some(NumberOrString::String(found.code.name.to_owned())),
        code_description: match snapshot.capabilities.pages {
            true => pages::address(found.code.name).map(|href| CodeDescription { href }),
            false => None,
        },
        source: Some("mauve".to_owned()),
        message: harmless(&found.message) + &harmless(&only.unwrap_or_default()),
        related_information: (!related.is_empty()).then_some(related),
        tags: found.code.unused.then(|| vec![DiagnosticTag::UNNECESSARY]),
        ..Diagnostic::default()
    }
}

fn severity_of(severity: Severity) -> DiagnosticSeverity {
    match severity {
        Severity::Error => DiagnosticSeverity::ERROR,
        Severity::Warning => DiagnosticSeverity::WARNING,
        Severity::Hint => DiagnosticSeverity::HINT,
    }
}

/// What is said of an open text that is not the one that is analysed.
pub(crate) fn another_text() -> Diagnostic {
    whole_file(DiagnosticSeverity::WARNING, "unreadable-file", ANOTHER_TEXT.to_owned())
}

/// What is said of an open text while the user does not want to wait for its analysis.
pub(crate) fn stopped() -> Diagnostic {
    let message =
        "the analysis was stopped: no response time is known, nor what else is wrong, until the next edit";
    whole_file(DiagnosticSeverity::WARNING, "analysis-stopped", message.to_owned())
}

/// What is said of an open text where something of ours went wrong.
pub(crate) fn defect(message: &str) -> Diagnostic {
    let message = format!(
        "a defect of mauve: {message}. Nothing was analysed, and no response time is known; please report it"
    );
    whole_file(DiagnosticSeverity::ERROR, "internal-error", message)
}

/// That a file has more of such a severity than are shown.
pub(crate) fn more(severity: Severity, count: usize) -> Diagnostic {
    let message = format!("… and {count} more: `mauve check --format json` shows all");
    Diagnostic { code: None, ..whole_file(severity_of(severity), "", message) }
}

fn whole_file(severity: DiagnosticSeverity, code: &str, message: String) -> Diagnostic {
    Diagnostic {
        severity: Some(severity),
        code: Some(NumberOrString::String(code.to_owned())),
        source: Some("mauve".to_owned()),
        message,
        ..Diagnostic::default()
    }
}

/// A change; none where the client cannot make the files that it makes. `label` is what the user chose.
pub(crate) fn workspace_edit(snapshot: &Snapshot, change: &Change, label: &str) -> Option<WorkspaceEdit> {
    let capabilities = snapshot.capabilities;
    if !capabilities.document_changes {
        let by_url =
            |it: &FileChange| Some((snapshot.url(it.file)?, text_edits(snapshot, it.file, &it.edits)));
        let changes = change.files.iter().map(by_url).collect::<Option<_>>()?;
        return change.created.is_empty().then(|| WorkspaceEdit::new(changes));
    }
    if !change.created.is_empty() && !capabilities.resource_operations {
        return None;
    }
    let mut annotations = HashMap::new();
    let mut operations = Vec::new();
    for it in &change.files {
        let note = it.note.as_deref().unwrap_or(label);
        let uri = snapshot.url(it.file)?;
        let version = snapshot.documents.get(&uri).map(|document| document.version);
        let edits = text_edits(snapshot, it.file, &it.edits).into_iter().map(|text_edit| match capabilities
            .change_annotations
        {
            true => OneOf::Right(AnnotatedTextEdit {
                text_edit,
                annotation_id: annotated(&mut annotations, note),
            }),
            false => OneOf::Left(text_edit),
        });
        let edits = edits.collect();
        let text_document = OptionalVersionedTextDocumentIdentifier { uri, version };
        operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits }));
    }
    for (path, text) in &change.created {
        let uri = Url::from_file_path(path).ok()?;
        let options = CreateFileOptions { overwrite: Some(false), ignore_if_exists: Some(false) };
        let annotation_id = capabilities.change_annotations.then(|| annotated(&mut annotations, label));
        let create = CreateFile { uri: uri.clone(), options: Some(options), annotation_id };
        operations.push(DocumentChangeOperation::Op(ResourceOp::Create(create)));
        let text_document = OptionalVersionedTextDocumentIdentifier { uri, version: None };
        let edits = vec![OneOf::Left(TextEdit::new(Range::default(), text.clone()))];
        operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits }));
    }
    Some(WorkspaceEdit {
        changes: None,
        document_changes: Some(DocumentChanges::Operations(operations)),
        change_annotations: (!annotations.is_empty()).then_some(annotations),
    })
}

fn annotated(annotations: &mut HashMap<String, ChangeAnnotation>, label: &str) -> String {
    let annotation =
        ChangeAnnotation { label: label.to_owned(), needs_confirmation: None, description: None };
    annotations.entry(label.to_owned()).or_insert(annotation);
    label.to_owned()
}

/// What is replaced in a file.
pub(crate) fn text_edits(snapshot: &Snapshot, file: File, edits: &[Replacement]) -> Vec<TextEdit> {
    let lines = line_index(&snapshot.db, file);
    let edit = |it: &Replacement| {
        TextEdit::new(lines.range(it.range, snapshot.capabilities.encoding), it.text.clone())
    };
    edits.iter().map(edit).collect()
}

/// The addresses of those files that are there. The others nobody can open: a codel that has not been written yet, a message
/// of a package that is gone.
pub(crate) fn files_there(paths: &[PathBuf]) -> impl Iterator<Item = Url> {
    paths.iter().filter(|path| path.is_file()).filter_map(|path| Url::from_file_path(path).ok())
}

/// Where something stands.
pub(crate) fn location(snapshot: &Snapshot, at: &Location<'_>) -> Option<lsp_types::Location> {
    Some(lsp_types::Location { uri: snapshot.url(at.file(&snapshot.db))?, range: range(snapshot, at) })
}

fn range(snapshot: &Snapshot, at: &Location<'_>) -> Range {
    let db = &snapshot.db;
    line_index(db, at.file(db)).range(at.range(db), snapshot.capabilities.encoding)
}
