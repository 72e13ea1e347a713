//! The table of the estimates for a terminal: one line for each codel, then each kind of warning once.

use std::fmt::Write as _;

use mauve_diagnostics::grouped;
use mauve_pwcet::rounded_up;
use mauve_pwcet::trace::SpanKind;
use mauve_timing::{DEPENDENT, EXTRAPOLATED, Time};

use super::estimates::{Estimates, Lack, MeasuredEntry};
use crate::text::{Sheet, number};

/// The lines below the table have at most so many characters, if their words allow that.
const WIDTH: usize = 80;

/// With these, the times may be too short; with all others, only too long. A heavy tail makes extrapolated times too long if more than
/// 25 executions show it, otherwise they may be too short.
const TOO_SHORT: [&str; 8] = [
    DEPENDENT,
    "changing-times",
    "exceeded-bounds",
    "poor-fit",
    "not-converged",
    "few-executions",
    "heavy-tail",
    "incomplete-recording",
];

/// No codel can be measured so often.
pub(super) const MOST_EXECUTIONS: u64 = 10_000_000;

/// `next` are the commands that measure the missing times.
pub(super) fn table(estimates: &Estimates, next: &str) -> String {
    let (short, rows): (Vec<&MeasuredEntry>, Vec<&MeasuredEntry>) =
        estimates.measurements.iter().partition(|it| it.is_short_access());
    let with_budgets = rows.iter().any(|it| it.budget.is_some());
    let levels: Vec<String> = estimates
        .shown
        .iter()
        .filter_map(|&index| estimates.levels.get(index))
        .map(|it| it.to_string())
        .collect();
    let heads: Vec<String> = match levels.as_slice() {
        [level] => vec![format!("at {level}")],
        _ => levels.clone(),
    };
    let has_ports = rows.iter().any(|it| it.kind() == SpanKind::Access);
    let mut sheet = Sheet::of(&rows)
        .column(if has_ports { "codel or port" } else { "codel" }, |it| it.key().to_owned())
        .column("n", |it| it.measurement.count().to_string())
        .column("greatest", |it| Time::from_nanos(rounded_up(it.measurement.greatest() as f64)).number());
    for (&level, head) in estimates.shown.iter().zip(heads) {
        let is_marked = |it: &MeasuredEntry| estimates.shown.len() > 1 && it.is_extrapolated(level);
        sheet = sheet.column(head, |it| number(it.time(level)) + if is_marked(it) { " ~" } else { "" });
    }
    let sheet = sheet
        .column_if(with_budgets, "budget", |it| number(it.budget))
        .column("", |it| verdict(estimates, it));
    let mut out = heading(estimates, &levels) + &sheet.text();
    if !short.is_empty() {
        let each =
            if short.len() == 1 { "1 port takes".to_owned() } else { format!("{} ports take", short.len()) };
        let _ = writeln!(
            out,
            "  {each} less than 0.02 ms for each access, a part of the overhead (in --format json)"
        );
    }
    out += &warnings(estimates, &rows);
    out += next;
    for line in &estimates.recording {
        let _ = writeln!(out, "\n{line}");
    }
    let estimated = rows.iter().filter(|it| !it.is_refused()).flat_map(|it| &it.measurement.instances);
    if let Some(least) = estimated.map(|it| it.executions.len()).min().filter(|least| *least >= 6) {
        let _ = writeln!(
            out,
            "\nThe times hold for inputs and conditions like those of the measurement. A case\nthat is rarer than 1 in {} executions \
             may never have occurred in it.",
            least / 3
        );
    }
    out
}

fn heading(estimates: &Estimates, levels: &[String]) -> String {
    let of = match (levels, &estimates.budgets) {
        ([level], Some(it)) if it.level.to_string() == *level => {
            format!(", at {level}, the level of the project")
        }
        ([level], _) => format!(", at {level}"),
        _ => ", by the probability of a longer one".to_owned(),
    };
    format!("95 % upper bounds in ms from n executions{of}\n\n")
}

/// Says whether the times of a codel can be used.
fn verdict(estimates: &Estimates, it: &MeasuredEntry) -> String {
    if it.is_over_budget {
        return "✗ over budget".to_owned();
    }
    if let Some(Lack { more, .. }) = estimates.lack(it) {
        return match more {
            0 => "✗ no time".to_owned(),
            1..=MOST_EXECUTIONS => format!("✗ needs {more} more"),
            _ => "✗ no time at this level".to_owned(),
        };
    }
    match estimates.kinds(it).as_slice() {
        [] => "✓",
        [EXTRAPOLATED] => "~ extrapolated",
        kinds if kinds.iter().any(|kind| TOO_SHORT.contains(kind)) => "! may be too short",
        _ => "! likely too long",
    }
    .to_owned()
}

/// Names each kind of warning once, with its codels.
fn warnings(estimates: &Estimates, rows: &[&MeasuredEntry]) -> String {
    let kinds = rows.iter().flat_map(|it| estimates.kinds(it).into_iter().map(|kind| (kind, it.key())));
    let kinds = grouped(kinds);
    let Some((first, _)) = kinds.first() else { return String::new() };
    let mut out = format!("\nWarnings, each with a page, such as `mauve explain {first}`:\n");
    for (kind, names) in kinds {
        let names = if names.len() == rows.len() && rows.len() > 1 { vec!["all"] } else { names };
        out += &wrapped(&format!("  {kind}: "), &names);
    }
    out
}

/// Returns a list in lines, with the later ones below the first.
pub(super) fn wrapped(start: &str, items: &[&str]) -> String {
    let indent = " ".repeat(4);
    let mut out = start.to_owned();
    let mut width = start.chars().count();
    for (index, item) in items.iter().enumerate() {
        let end = if index + 1 == items.len() { "" } else { ", " };
        let length = item.chars().count() + end.len();
        if index > 0 && width + length > WIDTH {
            out.truncate(out.trim_end().len());
            let _ = write!(out, "\n{indent}");
            width = indent.len();
        }
        let _ = write!(out, "{item}{end}");
        width += length;
    }
    out + "\n"
}
