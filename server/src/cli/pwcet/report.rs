//! The report for a browser.

use std::path::PathBuf;

use mauve_ide::{ExecutionReport, Measured as InReport, MeasuredKind, SampleSource, execution_report};
use mauve_timing::Time;

use super::date::today;
use super::estimates::Estimates;

/// Returns the report on all instances, as one HTML document.
pub(super) fn report(estimates: &Estimates, samples: &[PathBuf], fingerprints: &[String]) -> String {
    let names: Vec<String> = samples.iter().map(|path| path.display().to_string()).collect();
    let digests: Vec<String> = fingerprints.iter().map(|it| format!("SHA-256 {it}")).collect();
    let sources: Vec<SampleSource<'_>> =
        names.iter().zip(&digests).map(|(name, digest)| SampleSource { name, digest }).collect();
    let budget_level = estimates.budget_level();
    let budgets: Vec<Vec<Option<Time>>> = estimates
        .measurements
        .iter()
        .map(|it| {
            (0..estimates.levels.len())
                .map(|level| it.budget.filter(|_| budget_level == Some(level)))
                .collect()
        })
        .collect();
    let mut measured = Vec::new();
    for (it, budgets) in estimates.measurements.iter().zip(&budgets) {
        let kind = if it.measurement.key.contains('/') { MeasuredKind::Program } else { MeasuredKind::Codel };
        measured.extend(it.measurement.instances.iter().map(|instance| InReport {
            kind,
            key: &it.measurement.key,
            instance: Some(instance.instance.as_str()).filter(|name| !name.is_empty()),
            executions: &instance.executions,
            runs: &instance.runs,
            result: instance.result.as_ref().map_err(|refusal| *refusal),
            table: it.times.as_deref().unwrap_or_default(),
            budgets,
        }));
    }
    let title = names.join(", ");
    execution_report(&ExecutionReport {
        title: &title,
        date: &today(),
        sources: &sources,
        options: &estimates.options,
        measured: &measured,
    })
}
