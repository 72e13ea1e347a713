//! The table of the estimates for a terminal, with what each measurement lacks.

use std::fmt::Write as _;

use mauve_pwcet::{LEAST_EXECUTIONS, NoEstimate, Refusal, rounded_up};
use mauve_timing::{Level, Time};

use super::estimates::{Estimates, Measured};
use crate::cli::text::{columns, counted};

pub(super) fn table(estimates: &Estimates) -> String {
    let with_budgets = estimates.measurements.iter().any(|it| it.budget.is_some());
    let levels: Vec<String> = estimates.levels.iter().map(Level::to_string).collect();
    let mut header = vec!["codel", "executions", "greatest"];
    header.extend(levels.iter().map(String::as_str));
    if with_budgets {
        header.push("budget");
    }
    header.push("");
    let rows: Vec<Vec<String>> =
        estimates.measurements.iter().map(|it| row(estimates, it, with_budgets)).collect();
    let model = estimates.options.model.name();
    let mut out = format!(
        "95 % upper confidence bounds in ms, by the probability that an execution takes longer (tail: {model})\n\n"
    );
    out += &columns(&header, &rows);
    let (few, others): (Vec<&Measured>, Vec<&Measured>) =
        estimates.measurements.iter().partition(|it| has_few(it));
    for it in others {
        for line in remarks(estimates, it) {
            let _ = write!(out, "\n{}: {line}", it.name);
        }
    }
    if !few.is_empty() {
        let few: Vec<String> = few.iter().map(|it| high_water(it)).collect();
        let _ = write!(
            out,
            "\nToo few executions for a tail: measure at least {LEAST_EXECUTIONS}, better 5000: {}",
            few.join(", ")
        );
    }
    if !out.ends_with('\n') {
        out.push('\n');
    }
    for line in &estimates.recording {
        let _ = writeln!(out, "\n{line}");
    }
    let estimated = estimates.measurements.iter().filter(|it| !it.is_refused());
    let instances = estimated.flat_map(|it| &it.measurement.instances);
    if let Some(least) = instances.map(|it| it.executions.len()).min().filter(|least| *least >= 6) {
        let _ = writeln!(
            out,
            "\nThe times hold for inputs and conditions like those of the measurement. A case that is rarer than 1 in {} executions \
             may never have occurred in it.",
            least / 3
        );
    }
    out
}

fn row(estimates: &Estimates, it: &Measured, with_budgets: bool) -> Vec<String> {
    let greatest = Time::from_nanos(rounded_up(it.measurement.greatest() as f64));
    let mut row = vec![it.name.clone(), it.measurement.count().to_string(), greatest.number()];
    row.extend(estimates.levels.iter().enumerate().map(|(level, _)| {
        it.times.get(level).copied().flatten().map_or_else(|| "—".to_owned(), Time::number)
    }));
    if with_budgets {
        row.push(it.budget.map_or_else(|| "—".to_owned(), Time::number));
    }
    let warnings =
        it.measurement.instances.iter().filter_map(|it| it.result.as_ref().ok()).map(|it| it.warnings.len());
    row.push(match warnings.sum() {
        _ if it.is_over_budget => "✗ over budget".to_owned(),
        _ if it.is_refused() => "✗ no estimate".to_owned(),
        _ if it.all_times().is_none() => "✗ not at each level".to_owned(),
        0 if it.measurement.instances.iter().all(|it| it.result.is_ok()) => "✓".to_owned(),
        0 => "! see below".to_owned(),
        warnings => format!("! {}", counted(warnings, "warning")),
    });
    row
}

/// Describes a codel that runs rarely: `nav.plan (3, the longest 1.25 ms)`.
fn high_water(it: &Measured) -> String {
    let longest = Time::from_nanos(rounded_up(it.measurement.greatest() as f64));
    format!("{} ({}, the longest {longest})", it.name, it.measurement.count())
}

/// Returns whether all instances have too few executions.
fn has_few(it: &Measured) -> bool {
    it.measurement
        .instances
        .iter()
        .all(|it| matches!(it.result, Err(NoEstimate { refusal: Refusal::TooFew { .. }, .. })))
}

/// Returns what is wrong with a codel: first its budget.
fn remarks(estimates: &Estimates, it: &Measured) -> Vec<String> {
    let over = estimates.budgets.as_ref().filter(|_| it.is_over_budget);
    let over = over.zip(it.budget).map(|(budgets, budget)| match budget.as_nanos() {
        0 => format!("a deadline is missed at {}, whatever it takes", budgets.level),
        _ => format!(
            "exceeds its budget of {budget} at {}: with a longer time, a deadline is missed",
            budgets.level
        ),
    });
    over.into_iter().chain(it.remarks()).collect()
}
