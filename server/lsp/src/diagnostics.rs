//! Translates diagnostics to the protocol.

use mauve_diagnostics::{Finding, Severity};
use mauve_hir::{File, ModelDb};
use mauve_projects::address::{address_of, address_of_document};
use mauve_projects::harmless::harmless;
use tower_lsp::lsp_types::*;

use super::pages;
use super::position::{Encoding, LineIndex};

/// The message for a text that is not analysed.
pub(crate) const ANOTHER_TEXT: &str = "this file is also open under another URI with a different text: that \
    text, which was changed last, is analysed";

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
    address_of(path).or_else(|| address_of_document(path))
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
