//! Translates results to types of the protocol.

use std::collections::HashMap;
use std::path::PathBuf;

use mauve_diagnostics::{Finding, Severity};
use mauve_hir::{File, ModelDb};
use mauve_ide::{Change, FileChange};
use mauve_syntax::format::Replacement;
use tower_lsp::lsp_types::*;

use super::documents::uri_of_document;
use super::pages;
use super::position::{Encoding, LineIndex};
use super::snapshot::{ANOTHER_TEXT, Snapshot};
use crate::harmless::harmless;

/// How a client gets diagnostics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(crate) struct DiagnosticStyle {
    pub(crate) encoding: Encoding,
    /// With related locations.
    pub(crate) related: bool,
    /// With the addresses of pages.
    pub(crate) pages: bool,
}

/// Translates a diagnostic.
pub(crate) fn diagnostic(db: &dyn ModelDb, style: DiagnosticStyle, finding: &Finding<'_>) -> Diagnostic {
    let found = &finding.diagnostic;
    let file = found.at.file(db);
    let lines = LineIndex::new(db, file, style.encoding);
    let range = |at: &mauve_hir::Location<'_>| match at.file(db) {
        here if here == file => lines.range(at.range(db)),
        other => LineIndex::new(db, other, style.encoding).range(at.range(db)),
    };
    let related = found.related.iter().filter(|_| style.related);
    let related = related.filter_map(|(at, message)| {
        let location = Location { uri: url_of(db, at.file(db))?, range: range(at) };
        Some(DiagnosticRelatedInformation { location, message: harmless(message) })
    });
    let related: Vec<_> = related.collect();
    let only = finding.only_in.map(|project| {
        let name = project.root(db).path(db).file_name().unwrap_or_default().display().to_string();
        format!(" (in the project of {name})")
    });
    Diagnostic {
        range: range(&found.at),
        severity: Some(severity_of(finding.severity)),
        code: Some(NumberOrString::String(found.code.name.to_owned())),
        code_description: match style.pages {
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

/// Returns the URI of the path of a file; that of its document if it has no path. salsa keeps it: thousands of related
/// locations may be in one file.
#[salsa::tracked(returns(clone))]
pub(crate) fn url_of(db: &dyn ModelDb, file: File) -> Option<Url> {
    let path = file.path(db);
    Url::from_file_path(path).ok().or_else(|| uri_of_document(path))
}

fn severity_of(severity: Severity) -> DiagnosticSeverity {
    match severity {
        Severity::Error => DiagnosticSeverity::ERROR,
        Severity::Warning => DiagnosticSeverity::WARNING,
        Severity::Hint => DiagnosticSeverity::HINT,
    }
}

/// Returns the diagnostic for an open text that is not the analysed one.
pub(crate) fn another_text() -> Diagnostic {
    whole_file(DiagnosticSeverity::WARNING, "unreadable-file", ANOTHER_TEXT.to_owned())
}

/// Returns the diagnostic for an open text whose analysis the user has stopped.
pub(crate) fn stopped() -> Diagnostic {
    let message = "the analysis was stopped: response times and diagnostics are unknown until the next edit";
    whole_file(DiagnosticSeverity::WARNING, "analysis-stopped", message.to_owned())
}

/// Returns the diagnostic for an open text whose analysis panicked.
pub(crate) fn defect(message: &str) -> Diagnostic {
    let message = format!(
        "a defect of mauve: {message}. The analysis failed, and response times are unknown; please report it"
    );
    whole_file(DiagnosticSeverity::ERROR, "internal-error", message)
}

/// Returns the diagnostic for further diagnostics that are not shown.
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
        let uri = Url::from_file_path(path).ok()?;
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
    paths.iter().filter(|path| path.is_file()).filter_map(|path| Url::from_file_path(path).ok())
}

/// Translates a location.
pub(crate) fn location(snapshot: &Snapshot, at: &mauve_hir::Location<'_>) -> Option<Location> {
    snapshot.location(at.file(&snapshot.db), at.range(&snapshot.db))
}
