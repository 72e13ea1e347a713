//! `textDocument/diagnostic` and `workspace/diagnostic`, for clients that pull diagnostics.

use std::collections::BTreeMap;

use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::{
    DocumentDiagnosticParams, DocumentDiagnosticReportResult, FullDocumentDiagnosticReport,
    RelatedFullDocumentDiagnosticReport, RelatedUnchangedDocumentDiagnosticReport,
    UnchangedDocumentDiagnosticReport, Url, WorkspaceDiagnosticParams, WorkspaceDiagnosticReport,
    WorkspaceDiagnosticReportResult, WorkspaceFullDocumentDiagnosticReport,
    WorkspaceUnchangedDocumentDiagnosticReport,
};

use crate::check::{diagnostics_of, shown};
use crate::diagnostics::defect;
use crate::items::{DiagnosticsByFile, Items, OfFile};
use crate::pulls::GivenResult;
use crate::snapshot::{Document, Failure, Snapshot, attempt};

/// An answer, and its result for each file.
pub(crate) type Diagnosed<T> = (T, BTreeMap<Url, GivenResult>);

/// Returns the diagnostics of a file.
pub(crate) fn document_diagnostic(
    snapshot: &Snapshot,
    params: &DocumentDiagnosticParams,
) -> Result<Diagnosed<DocumentDiagnosticReportResult>> {
    let url = &params.text_document.uri;
    // A file that is neither open nor known has no diagnostics: an error would be shown to a user who has done nothing.
    let (version, items) = known(snapshot, |snapshot| diagnostics_of(snapshot, url).into_iter().collect())?
        .remove(url)
        .unwrap_or_default();
    let id = items.id();
    let related_documents = None;
    let report = match full_or_unchanged(&items, params.previous_result_id.as_deref()) {
        Ok(full_document_diagnostic_report) => {
            RelatedFullDocumentDiagnosticReport { related_documents, full_document_diagnostic_report }.into()
        }
        Err(unchanged_document_diagnostic_report) => RelatedUnchangedDocumentDiagnosticReport {
            related_documents,
            unchanged_document_diagnostic_report,
        }
        .into(),
    };
    let given = BTreeMap::from([(url.clone(), (version, Some(id)))]);
    Ok((DocumentDiagnosticReportResult::Report(report), given))
}

/// Returns the diagnostics of all files. A file whose earlier diagnostics the client has gets a report even if none
/// are left.
pub(crate) fn workspace_diagnostic(
    snapshot: &Snapshot,
    params: &WorkspaceDiagnosticParams,
) -> Result<Diagnosed<WorkspaceDiagnosticReportResult>> {
    let given_before: BTreeMap<&Url, &str> =
        params.previous_result_ids.iter().map(|known| (&known.uri, known.value.as_str())).collect();
    let mut found = known(snapshot, |snapshot| shown(snapshot).0)?;
    for &url in given_before.keys() {
        found.entry(url.clone()).or_default();
    }
    let mut given = BTreeMap::new();
    let report = |(uri, (version, items)): (Url, OfFile)| {
        let id = items.id();
        given.insert(uri.clone(), (version, Some(id)));
        let version = version.map(i64::from);
        match full_or_unchanged(&items, given_before.get(&uri).copied()) {
            Ok(full_document_diagnostic_report) => {
                WorkspaceFullDocumentDiagnosticReport { uri, version, full_document_diagnostic_report }.into()
            }
            Err(unchanged_document_diagnostic_report) => WorkspaceUnchangedDocumentDiagnosticReport {
                uri,
                version,
                unchanged_document_diagnostic_report,
            }
            .into(),
        }
    };
    let items = found.into_iter().map(report).collect();
    Ok((WorkspaceDiagnosticReportResult::Report(WorkspaceDiagnosticReport { items }), given))
}

/// Returns the diagnostics. If the analysis panics, returns a diagnostic about that instead, which replaces outdated
/// ones.
fn known(snapshot: &Snapshot, look: impl Fn(&Snapshot) -> DiagnosticsByFile) -> Result<DiagnosticsByFile> {
    if snapshot.is_searching && !snapshot.is_complete {
        return Err(cancelled("the folders are being searched", false));
    }
    if !snapshot.is_stopped {
        snapshot.complete()?;
    }
    attempt(|| look(snapshot)).or_else(|failure| match failure {
        Failure::Panicked(message) => {
            let of = |(url, document): (&Url, &Document)| {
                (url.clone(), (Some(document.version), Items::of([defect(&message)])))
            };
            Ok(snapshot.documents.iter().map(of).collect())
        }
        failure => Err(failure.into_error()),
    })
}

fn full_or_unchanged(
    items: &Items,
    known: Option<&str>,
) -> std::result::Result<FullDocumentDiagnosticReport, UnchangedDocumentDiagnosticReport> {
    let result_id = format!("{:016x}", items.id());
    if known == Some(result_id.as_str()) {
        return Err(UnchangedDocumentDiagnosticReport { result_id });
    }
    Ok(FullDocumentDiagnosticReport { result_id: Some(result_id), items: items.list() })
}

/// Returns the error for a request that an edit has cancelled, after which the client repeats it. After other errors,
/// it may show no diagnostics.
pub(crate) fn ask_again(error: Error) -> Error {
    match error == Error::content_modified() {
        true => cancelled("the text has changed in the meantime", true),
        false => error,
    }
}

/// Returns the error for a request that the client is to repeat at once, or after the next refresh.
fn cancelled(why: &'static str, is_repeated: bool) -> Error {
    Error {
        code: tower_lsp::lsp_types::error_codes::SERVER_CANCELLED.into(),
        message: why.into(),
        data: Some(serde_json::json!({ "retriggerRequest": is_repeated })),
    }
}
