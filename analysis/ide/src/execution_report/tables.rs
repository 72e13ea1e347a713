//! The tables of a section: levels, tests, hold-out, fits.

use std::fmt::Write as _;

use mauve_diagnostics::{check_assumption, check_name, no_bound};
use mauve_pwcet::{Check, CheckKind, Estimate, HoldOut, LevelEstimate};
use mauve_timing::Time;

use super::ReportedCodel;
use super::figures::{self, TimeUnit, count, p_value, significant};
use crate::html::text;

/// Writes all tables of an estimate.
pub(super) fn tables(out: &mut String, measured: &ReportedCodel<'_>, estimate: &Estimate, unit: &TimeUnit) {
    levels(out, measured, estimate, unit);
    tests(out, estimate);
    out.push_str("<div class=\"tables\">\n<div>\n");
    hold_out(out, estimate, unit);
    out.push_str("</div>\n<div>\n");
    clock(out, estimate);
    out.push_str("</div>\n</div>\n");
    fits(out, estimate, unit);
}

/// Whether the time of a level exceeds its budget: the time in the table, otherwise the bound.
pub(super) fn is_over_budget(measured: &ReportedCodel<'_>) -> bool {
    let (Some((index, budget)), Ok(estimate)) = (measured.budget, &measured.measurement.result) else {
        return false;
    };
    match measured.table.get(index) {
        Some(&time) => time > budget,
        None => estimate
            .levels
            .get(index)
            .is_some_and(|it| it.bound.is_ok_and(|bound| bound > budget.as_nanos() as f64)),
    }
}

/// A column of a table: its head, its class, and its cell for an item.
struct ReportColumn<'a, T> {
    head: &'static str,
    class: &'static str,
    cell: Box<dyn Fn(&T) -> String + 'a>,
}

fn column<'a, T>(
    head: &'static str,
    class: &'static str,
    cell: impl Fn(&T) -> String + 'a,
) -> ReportColumn<'a, T> {
    ReportColumn { head, class, cell: Box::new(cell) }
}

/// Writes a table, with a row for each item. The first cell of a row is its head.
fn table<T>(out: &mut String, title: &str, caption: &str, columns: &[ReportColumn<'_, T>], items: &[T]) {
    let _ = write!(
        out,
        "<h3>{title}</h3>\n<p class=\"note\">{caption}</p>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\">\n<table>\n<thead><tr>"
    );
    for ReportColumn { head, class, .. } in columns {
        let _ = write!(out, "<th scope=\"col\"{}>{head}</th>", attribute(class));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for item in items {
        out.push_str("<tr>");
        for (index, ReportColumn { class, cell, .. }) in columns.iter().enumerate() {
            let (class, cell) = (attribute(class), cell(item));
            let _ = match index {
                0 => write!(out, "<th scope=\"row\"{class}>{cell}</th>"),
                _ => write!(out, "<td{class}>{cell}</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n</div>\n");
}

/// Writes a table of values and their names, which have the head `names`.
fn values(out: &mut String, title: &str, caption: &str, names: &'static str, rows: &[(&str, String)]) {
    // A probability below a limit is not equal to it.
    let shown = |value: &str| value.replace("= <", "<").replace('<', "&lt;");
    let columns = [
        column(names, "", |(name, _): &(&str, String)| (*name).to_owned()),
        column("value", NUMBER, |(_, value): &(&str, String)| shown(value)),
    ];
    table(out, title, caption, &columns, rows);
}

fn attribute(class: &str) -> String {
    if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") }
}

fn badge(class: &str, text: &str) -> String {
    format!("<span class=\"badge {class}\">{text}</span>")
}

const NUMBER: &str = "number";

fn levels(out: &mut String, measured: &ReportedCodel<'_>, estimate: &Estimate, unit: &TimeUnit) {
    type Level = (usize, LevelEstimate);
    let time = |it: Time| it.as_nanos() as f64;
    let or_none = |cell: Option<String>| cell.unwrap_or_else(|| "–".to_owned());
    let mut columns = vec![
        column("level", "level", |(_, it): &Level| figures::level(it.level)),
        column("estimate", NUMBER, |(_, it): &Level| unit.number(it.point)),
        column("95\u{a0}% upper<br/>bound", NUMBER, |(_, it): &Level| {
            or_none(it.bound.ok().map(|bound| format!("<b>{}</b>", unit.bound_number(bound))))
        }),
        column("ratio", NUMBER, |(_, it): &Level| {
            or_none(it.bound.ok().map(|bound| figures::ratio(bound / estimate.greatest as f64)))
        }),
    ];
    if !measured.table.is_empty() {
        columns.push(column("timing<br/>table", NUMBER, |(index, _): &Level| {
            or_none(measured.table.get(*index).map(|it| unit.bound_number(time(*it))))
        }));
    }
    if measured.budget.is_some() {
        columns.push(column("budget", NUMBER, |(index, _): &Level| {
            or_none(measured.budget_at(*index).map(|it| unit.number(time(it))))
        }));
        columns.push(column("verdict", "", |(index, _): &Level| {
            match (measured.budget_at(*index), is_over_budget(measured)) {
                (None, _) => String::new(),
                (Some(_), true) => badge("failed", "exceeded"),
                (Some(_), false) => badge("plain", "kept"),
            }
        }));
    }
    columns.push(column("expected<br/>p·n", NUMBER, |(_, it): &Level| significant(it.depth)));
    columns.push(column("the bound is", "words", |(_, it): &Level| match it.bound {
        Ok(_) => depth(it.is_extrapolated, it.depth),
        Err(why) => text(&no_bound(&why)),
    }));
    let levels: Vec<Level> = estimate.levels.iter().copied().enumerate().collect();
    let caption = format!("Times in {}; the ratio is that of the bound to the high-water mark.", unit.name);
    table(out, "Levels", &caption, &columns, &levels);
}

/// Returns how far a bound is from the executions.
fn depth(is_extrapolated: bool, expected: f64) -> String {
    if !is_extrapolated {
        "counted in the sample".to_owned()
    } else if expected >= 1.0 {
        "of the fitted tail, within the sample".to_owned()
    } else {
        let measurements = (1.0 / expected).round();
        if measurements < 2.0 {
            return "extrapolated: less than one exceedance is expected".to_owned();
        }
        let number =
            if measurements < 10_000.0 { count(measurements as usize) } else { significant(measurements) };
        format!("extrapolated: one exceedance in {number} such measurements")
    }
}

fn tests(out: &mut String, estimate: &Estimate) {
    let columns = [
        column("test", "", |it: &Check| text(&check_name(it.kind))),
        column("assumption", "", |it: &Check| text(check_assumption(it.kind))),
        column("statistic", NUMBER, |it: &Check| significant(it.statistic)),
        column("p", NUMBER, |it: &Check| p_value(it.p).replace('<', "&lt;")),
        column("adjusted p", NUMBER, |it: &Check| p_value(it.adjusted).replace('<', "&lt;")),
        column("verdict", "", |it: &Check| verdict(it.is_rejected())),
    ];
    let caption = "Adjusted for the number of tests (Holm): below 0.05, the assumption is rejected.";
    table(out, "Tests", caption, &columns, &estimate.checks);
}

fn verdict(is_rejected: bool) -> String {
    if is_rejected { badge("warned", "rejected") } else { badge("plain", "not rejected") }
}

fn hold_out(out: &mut String, estimate: &Estimate, unit: &TimeUnit) {
    let number = estimate.hold_out.len() as f64;
    let is_rejected = estimate.checks.iter().any(|it| it.kind == CheckKind::HoldOut && it.is_rejected());
    let columns = [
        column("level", "level", |it: &HoldOut| figures::level(it.level)),
        column("bound", NUMBER, |it: &HoldOut| unit.bound_number(it.bound)),
        column("expected at most", NUMBER, |it: &HoldOut| significant(it.level * it.executions as f64)),
        column("observed", NUMBER, |it: &HoldOut| count(it.exceedances as usize)),
        column("p", NUMBER, |it: &HoldOut| p_value(it.p).replace('<', "&lt;")),
        column("verdict", "", |it: &HoldOut| verdict(is_rejected && it.p * number < 0.05)),
    ];
    let caption = format!(
        "Bounds from the first half of the executions, in {}, and the exceedances in the second half.",
        unit.name
    );
    table(out, "Hold-out", &caption, &columns, &estimate.hold_out);
}

fn clock(out: &mut String, estimate: &Estimate) {
    let resolution = estimate.resolution as f64;
    let rows = [
        ("resolution of the clock", TimeUnit::of(resolution).time(resolution)),
        ("distinct times", count(estimate.distinct)),
        ("executions with the time of another one", repeated(estimate)),
        ("mean", TimeUnit::of(estimate.mean).time(estimate.mean)),
    ];
    values(out, "Clock", "Times without ties need a fine clock.", "property", &rows);
}

fn repeated(estimate: &Estimate) -> String {
    let repeated = estimate.count.saturating_sub(estimate.distinct);
    let share = 100.0 * repeated as f64 / estimate.count.max(1) as f64;
    format!("{} ({}\u{a0}%)", count(repeated), figures::rounded(share))
}

fn fits(out: &mut String, estimate: &Estimate, unit: &TimeUnit) {
    let tail = &estimate.tail;
    let share = 100.0 * tail.excesses as f64 / tail.count.max(1) as f64;
    let law = |shape: f64, scale: f64| format!("ξ = {}, σ = {}", significant(shape), unit.time(scale));
    let rows = [
        ("threshold", unit.time(tail.threshold)),
        ("excesses", format!("{} ({}\u{a0}%)", count(tail.excesses), figures::rounded(share))),
        ("free fit", law(tail.free.shape, tail.free.scale)),
        ("fit with ξ ≥ 0", law(tail.model.shape, tail.model.scale)),
        ("greatest ξ that is not rejected", significant(tail.greatest_shape)),
        (
            "goodness of the free fit",
            format!("Anderson–Darling {}, p = {}", significant(tail.statistic), p_value(tail.p)),
        ),
    ];
    let caption =
        "Excesses over the threshold, with a generalised Pareto distribution. The bounds come from this fit.";
    values(out, "Fit of the tail", caption, "peaks over threshold", &rows);
}
