//! The report for a browser.

use std::path::PathBuf;

use mauve_ide::{ExecutionReport, ReportedCodel, execution_report};

use super::estimates::{Estimates, MeasuredEntry};
use crate::date::today;

/// Returns the report on all instances, as one HTML document.
pub(super) fn report(estimates: &Estimates, samples: &[PathBuf], fingerprints: &[String]) -> String {
    let source = |(path, it): (&PathBuf, &String)| (path.display().to_string(), format!("SHA-256 {it}"));
    let sources: Vec<(String, String)> = samples.iter().zip(fingerprints).map(source).collect();
    let tables: Vec<_> = estimates.measurements.iter().map(MeasuredEntry::all_times).collect();
    let measured = estimates.measurements.iter().zip(&tables).flat_map(|(it, table)| {
        it.measurement.instances.iter().map(move |measurement| ReportedCodel {
            key: &it.name,
            measurement,
            table: table.as_deref().unwrap_or_default(),
            budget: estimates.budget_level.zip(it.budget),
        })
    });
    execution_report(&ExecutionReport {
        date: &today(),
        sources: &sources,
        options: &estimates.options,
        measured: &measured.collect::<Vec<_>>(),
    })
}
