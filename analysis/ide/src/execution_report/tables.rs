//! The tables of a section: levels, tests, hold-out, fits.

use std::fmt::Write as _;

use mauve_diagnostics::{check_assumption, check_name};
use mauve_pwcet::{Check, CheckKind, Estimate, HoldOut, Options, TailModel};

use super::Measured;
use super::figures::{self, TimeUnit, count, counted, p_value, significant};
use super::html::text;

/// Writes all tables of an estimate.
pub(super) fn tables(
    out: &mut String,
    measured: &Measured<'_>,
    estimate: &Estimate,
    options: &Options,
    unit: &TimeUnit,
) {
    levels(out, measured, estimate, unit);
    tests(out, estimate);
    out.push_str("<div class=\"tables\">\n<div>\n");
    hold_out(out, estimate, unit);
    out.push_str("</div>\n<div>\n");
    clock(out, estimate);
    out.push_str("</div>\n</div>\n");
    fits(out, estimate, options, unit);
}

/// Whether the time of a level exceeds its budget: the time in the table, otherwise the bound.
pub(super) fn is_over_budget(measured: &Measured<'_>) -> bool {
    let (Some((index, budget)), Ok(estimate)) = (measured.budget, &measured.measurement.result) else {
        return false;
    };
    match measured.table.get(index) {
        Some(&time) => time > budget,
        None => estimate.levels.get(index).is_some_and(|it| it.upper > budget.as_nanos() as f64),
    }
}

/// Writes a table. Each head has its class; the first cell of a row is its head.
fn table(out: &mut String, title: &str, caption: &str, heads: &[(&str, &str)], rows: &[Vec<String>]) {
    let _ = write!(
        out,
        "<h3>{title}</h3>\n<p class=\"note\">{caption}</p>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\">\n<table>\n<thead><tr>"
    );
    for (head, class) in heads {
        let _ = write!(out, "<th scope=\"col\"{}>{head}</th>", attribute(class));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (index, (cell, (_, class))) in row.iter().zip(heads).enumerate() {
            let class = attribute(class);
            let _ = match index {
                0 => write!(out, "<th scope=\"row\"{class}>{cell}</th>"),
                _ => write!(out, "<td{class}>{cell}</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n</div>\n");
}

fn attribute(class: &str) -> String {
    if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") }
}

fn badge(class: &str, text: &str) -> String {
    format!("<span class=\"badge {class}\">{text}</span>")
}

const NUMBER: &str = "number";

fn levels(out: &mut String, measured: &Measured<'_>, estimate: &Estimate, unit: &TimeUnit) {
    let (has_table, has_budget) = (!measured.table.is_empty(), measured.budget.is_some());
    let has_blocks = estimate.levels.iter().any(|it| it.block_maxima.is_some());
    let mut heads = vec![
        ("level", "level"),
        ("estimate", NUMBER),
        ("95\u{a0}% upper<br/>bound", NUMBER),
        ("ratio", NUMBER),
    ];
    if has_table {
        heads.push(("timing<br/>table", NUMBER));
    }
    if has_budget {
        heads.extend([("budget", NUMBER), ("verdict", "")]);
    }
    if has_blocks {
        heads.extend([("block maxima:<br/>estimate", NUMBER), ("block maxima:<br/>bound", NUMBER)]);
    }
    heads.extend([("expected<br/>p·n", NUMBER), ("the bound is", "words")]);
    let row = |(index, it): (usize, &mauve_pwcet::LevelEstimate)| {
        let mut row = vec![
            figures::level(it.level),
            unit.number(it.point),
            format!("<b>{}</b>", unit.bound_number(it.upper)),
            figures::ratio(it.ratio),
        ];
        if has_table {
            row.push(
                measured
                    .table
                    .get(index)
                    .map_or("–".to_owned(), |it| unit.bound_number(it.as_nanos() as f64)),
            );
        }
        if has_budget {
            let budget = measured.budget_at(index);
            row.push(budget.map_or("–".to_owned(), |it| unit.number(it.as_nanos() as f64)));
            row.push(match (budget, is_over_budget(measured)) {
                (None, _) => String::new(),
                (Some(_), true) => badge("failed", "exceeded"),
                (Some(_), false) => badge("plain", "kept"),
            });
        }
        if has_blocks {
            let (point, upper) = it.block_maxima.unzip();
            row.push(point.map_or("–".to_owned(), |it| unit.number(it)));
            row.push(upper.map_or("–".to_owned(), |it| unit.bound_number(it)));
        }
        row.extend([significant(it.depth), depth(it.is_extrapolated, it.depth)]);
        row
    };
    let rows: Vec<Vec<String>> = estimate.levels.iter().enumerate().map(row).collect();
    let caption = format!("Times in {}; the ratio is that of the bound to the high-water mark.", unit.name);
    table(out, "Levels", &caption, &heads, &rows);
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
    let row = |check: &Check| {
        vec![
            text(&check_name(check.kind)),
            text(check_assumption(check.kind)),
            significant(check.statistic),
            p_value(check.p).replace('<', "&lt;"),
            p_value(check.adjusted).replace('<', "&lt;"),
            verdict(check.is_rejected()),
        ]
    };
    let rows: Vec<Vec<String>> = estimate.checks.iter().map(row).collect();
    let heads = [
        ("test", ""),
        ("assumption", ""),
        ("statistic", NUMBER),
        ("p", NUMBER),
        ("adjusted p", NUMBER),
        ("verdict", ""),
    ];
    let caption = "Adjusted for the number of tests (Holm): below 0.05, the assumption is rejected.";
    table(out, "Tests", caption, &heads, &rows);
}

fn verdict(is_rejected: bool) -> String {
    if is_rejected { badge("warned", "rejected") } else { badge("plain", "not rejected") }
}

fn hold_out(out: &mut String, estimate: &Estimate, unit: &TimeUnit) {
    let number = estimate.hold_out.len() as f64;
    let is_rejected = estimate.checks.iter().any(|it| it.kind == CheckKind::HoldOut && it.is_rejected());
    let row = |it: &HoldOut| {
        vec![
            figures::level(it.level),
            unit.bound_number(it.bound),
            significant(it.level * it.executions as f64),
            count(it.exceedances as usize),
            p_value(it.p).replace('<', "&lt;"),
            verdict(is_rejected && it.p * number < 0.05),
        ]
    };
    let rows: Vec<Vec<String>> = estimate.hold_out.iter().map(row).collect();
    let heads = [
        ("level", "level"),
        ("bound", NUMBER),
        ("expected at most", NUMBER),
        ("observed", NUMBER),
        ("p", NUMBER),
        ("verdict", ""),
    ];
    let caption = format!(
        "Bounds from the first half of the executions, in {}, and the exceedances in the second half.",
        unit.name
    );
    table(out, "Hold-out", &caption, &heads, &rows);
}

fn clock(out: &mut String, estimate: &Estimate) {
    let resolution = estimate.resolution as f64;
    let rows = [
        ("resolution of the clock", TimeUnit::of(resolution).time(resolution)),
        ("distinct times", count(estimate.distinct)),
        ("executions with the time of another one", repeated(estimate)),
        ("mean", TimeUnit::of(estimate.mean).time(estimate.mean)),
    ];
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    table(
        out,
        "Clock",
        "Times without ties need a fine clock.",
        &[("property", ""), ("value", NUMBER)],
        &rows,
    );
}

fn repeated(estimate: &Estimate) -> String {
    let repeated = estimate.count.saturating_sub(estimate.distinct);
    let share = 100.0 * repeated as f64 / estimate.count.max(1) as f64;
    format!("{} ({}\u{a0}%)", count(repeated), figures::rounded(share))
}

fn fits(out: &mut String, estimate: &Estimate, options: &Options, unit: &TimeUnit) {
    let tail = &estimate.tail;
    let share = 100.0 * tail.excesses as f64 / tail.count.max(1) as f64;
    let model = match options.model {
        TailModel::GeneralisedPareto => "fit with ξ ≥ 0",
        TailModel::Exponential => "fit with ξ = 0",
    };
    let law = |shape: f64, scale: f64| format!("ξ = {}, σ = {}", significant(shape), unit.time(scale));
    let mut rows = vec![
        ("threshold", unit.time(tail.threshold)),
        ("excesses", format!("{} ({}\u{a0}%)", count(tail.excesses), figures::rounded(share))),
        ("free fit", law(tail.free.shape, tail.free.scale)),
        (model, law(tail.model.shape, tail.model.scale)),
        ("greatest ξ that is not rejected", significant(tail.greatest_shape)),
        (
            "goodness of the free fit",
            format!("Anderson–Darling {}, p = {}", significant(tail.statistic), p_value(tail.p))
                .replace("= <", "<"),
        ),
    ];
    let bootstrapped = match estimate.bootstrapped_p {
        Some(p) => format!("p = {} ({})", p_value(p), counted(options.bootstraps as usize, "sample"))
            .replace("= <", "<"),
        None => "not computed".to_owned(),
    };
    rows.push(("the same by bootstrap", bootstrapped));
    let heads = [("peaks over threshold", ""), ("value", NUMBER)];
    let cells = |rows: Vec<(&str, String)>| -> Vec<Vec<String>> {
        rows.into_iter().map(|(name, value)| vec![name.to_owned(), value.replace('<', "&lt;")]).collect()
    };
    out.push_str("<div class=\"tables\">\n<div>\n");
    let caption =
        "Excesses over the threshold, with a generalised Pareto distribution. The bounds come from this fit.";
    table(out, "Fit of the tail", caption, &heads, &cells(rows));
    out.push_str("</div>\n<div>\n");
    let rows = match &estimate.block_maxima {
        Some(it) => {
            let law = |fit: &mauve_pwcet::Gev| {
                format!(
                    "ξ = {}, μ = {}, σ = {}",
                    significant(fit.shape),
                    unit.time(fit.location),
                    unit.time(fit.scale)
                )
            };
            vec![
                ("blocks", format!("{} of {}", count(it.blocks), counted(it.block, "execution"))),
                ("free fit", law(&it.free)),
                ("fit with ξ ≥ 0", law(&it.model)),
            ]
        }
        None => vec![("blocks", "too few for a fit".to_owned())],
    };
    let caption = "Maxima of blocks, with a generalised extreme value distribution. For comparison only.";
    table(out, "Fit of block maxima", caption, &[("block maxima", ""), ("value", NUMBER)], &cells(rows));
    out.push_str("</div>\n</div>\n");
}
