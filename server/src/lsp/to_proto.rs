//! From our words to the protocol's.

use mauve_model::Place;
use mauve_model::diagnostics::{Finding, Severity};
use tower_lsp::lsp_types::{
    CodeDescription, Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location,
    NumberOrString,
};

use super::pages;
use super::position::line_index;
use super::snapshot::{ANOTHER_TEXT, Snapshot};

/// A diagnostic.
pub(crate) fn diagnostic(snapshot: &Snapshot, finding: &Finding<'_>) -> Diagnostic {
    let (db, found) = (&snapshot.db, &finding.diagnostic);
    let related = found.related.iter().filter(|_| snapshot.capabilities.related);
    let related = related.filter_map(|(at, message)| {
        Some(DiagnosticRelatedInformation { location: location(snapshot, at)?, message: message.clone() })
    });
    let related: Vec<_> = related.collect();
    let only = finding.only_in.map(|project| {
        let name = project.root(db).path(db).file_name().unwrap_or_default().display().to_string();
        format!(" (in the project of {name})")
    });
    Diagnostic {
        range: range(snapshot, &found.at),
        severity: Some(match finding.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Hint => DiagnosticSeverity::HINT,
        }),
        code: Some(NumberOrString::String(found.code.name.to_owned())),
        code_description: match snapshot.capabilities.pages {
            true => pages::address(found.code.name).map(|href| CodeDescription { href }),
            false => None,
        },
        source: Some("mauve".to_owned()),
        message: found.message.clone() + &only.unwrap_or_default(),
        related_information: (!related.is_empty()).then_some(related),
        tags: found.code.unused.then(|| vec![DiagnosticTag::UNNECESSARY]),
        ..Diagnostic::default()
    }
}

/// What is said of an open text that is not the one that is analysed.
pub(crate) fn another_text() -> Diagnostic {
    Diagnostic {
        severity: Some(DiagnosticSeverity::WARNING),
        code: Some(NumberOrString::String("unreadable-file".to_owned())),
        source: Some("mauve".to_owned()),
        message: ANOTHER_TEXT.to_owned(),
        ..Diagnostic::default()
    }
}

/// Where something stands.
pub(crate) fn location(snapshot: &Snapshot, at: &Place<'_>) -> Option<Location> {
    Some(Location { uri: snapshot.url(at.file(&snapshot.db))?, range: range(snapshot, at) })
}

fn range(snapshot: &Snapshot, at: &Place<'_>) -> tower_lsp::lsp_types::Range {
    let db = &snapshot.db;
    line_index(db, at.file(db)).range(at.range(db), snapshot.capabilities.encoding)
}
