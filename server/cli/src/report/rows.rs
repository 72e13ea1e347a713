//! What all parts of the page use: activities with their figures, tables and lists.

use std::fmt::Write as _;

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_ide::html_text;
use mauve_projects::analysis_document::Deployed;
use mauve_wcrt::ActivityReport;

/// An activity with its figure.
pub(super) struct ReportRow<'a, 'db> {
    pub(super) activity: &'a ActivityReport<'db>,
    pub(super) forms: Forms,
}

/// Returns the activities of a deployment with their figures.
pub(super) fn rows<'a, 'db>(of: &'a Deployed<'db>) -> Vec<ReportRow<'a, 'db>> {
    let reports = of.reports.iter().flat_map(|(_, it)| it.activities.iter().zip(it.footings()));
    let row =
        |(activity, footing)| ReportRow { activity, forms: figure(of.db, activity, footing, TIGHT_SLACK) };
    reports.map(row).collect()
}

impl ReportRow<'_, '_> {
    /// The worst status is the first; of several with one status, the one with the least slack relative to the deadline.
    pub(super) fn order(&self) -> (usize, i64) {
        (self.forms.status.rank(), self.activity.used().map_or(i64::MIN, |part| -(part * 1e9) as i64))
    }
}

/// Returns a figure with its bar and per cent; the bar is for the eye only.
pub(super) fn shown(forms: &Forms) -> String {
    let bar = forms.bar.as_ref().map_or_else(String::new, |[bar, percent]| {
        format!(" <span class=\"gauge\" aria-hidden=\"true\">{bar}</span> {}", html_text(percent))
    });
    format!("<span class=\"figure {}\">{}{bar}</span>", forms.status.name(), html_text(forms.text()))
}

/// Returns a table under these heads.
pub(super) fn table(heads: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let heads: String = heads.iter().map(|it| format!("<th scope=\"col\">{it}</th>")).collect();
    let mut out =
        format!("<div class=\"scroll\" tabindex=\"0\"><table><thead><tr>{heads}</tr></thead><tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (index, cell) in row.iter().enumerate() {
            let (name, scope) = if index == 0 { ("th", " scope=\"row\"") } else { ("td", "") };
            let _ = write!(out, "<{name}{scope}>{cell}</{name}>");
        }
        out.push_str("</tr>\n");
    }
    out + "</tbody></table></div>\n"
}

/// Returns a list of texts that are HTML already; nothing without any.
pub(super) fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: String = items.into_iter().map(|it| format!("<li>{it}</li>\n")).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
}
