//! The document: header, overview and a section for each codel.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use mauve_diagnostics::{capitalised, measurement_refusal, measurement_warning};
use mauve_pwcet::{Estimate, EstimateOptions, InstanceMeasurement, Warning};

use super::figures::{self, TimeUnit, count, counted};
use super::plots::{self, Plotted};
use super::{ExecutionReport, ReportedCodel, tables};
use crate::html::{self, code, text};

/// Returns the report as an HTML document. The same values give the same text.
pub fn execution_report(report: &ExecutionReport<'_>) -> String {
    let names: Vec<&str> = report.sources.iter().map(|(name, _)| name.as_str()).collect();
    let names = names.join(", ");
    let title = text(&names);
    let mut order: Vec<&ReportedCodel<'_>> = report.measured.iter().collect();
    // A stable sort keeps the order of the caller among equals.
    order.sort_by_key(|it| CodelVerdict::of(it).rank());
    let mut out = String::new();
    header(&mut out, report, &title);
    out.push_str("<main>\n");
    overview(&mut out, report, &order);
    for (index, measured) in order.iter().enumerate() {
        section(&mut out, index, measured, report.options);
    }
    out.push_str("</main>\n");
    footer(&mut out, report);
    html::page(&format!("Execution times of {names}"), include_str!("plots.css"), &out)
}

fn header(out: &mut String, report: &ExecutionReport<'_>, title: &str) {
    let levels: Vec<String> = report.options.levels.iter().copied().map(figures::level).collect();
    let executions = report.measured.iter().map(|it| it.measurement.executions.len()).sum();
    let _ = write!(
        out,
        "<header>\n<h1>Execution times of {title}</h1>\n\
         <p class=\"lead\">Probabilistic worst-case execution times (pWCET), estimated from measured executions.</p>\n\
         <dl>\n<dt>Date</dt><dd>{}</dd>\n<dt>Measurement</dt><dd>{} of {}, in {}</dd>\n<dt>Levels</dt><dd>{}</dd>\n\
         <dt>Tail</dt><dd>generalised Pareto with ξ ≥ 0: exponential, or heavier where the executions suggest it</dd>\n</dl>\n\
         <div class=\"read\">\n<h2>How to read this report</h2>\n<ul>\n\
         <li>The time of a level p is a <b>95\u{a0}% upper bound</b>: in at least 95 of 100 such measurements, an execution exceeds it \
         with a probability of at most p, if executions are independent and have one distribution with the fitted tail.</li>\n\
         <li>A bound for less than one expected exceedance (p·n &lt; 1) is <b>extrapolated</b>: no execution confirms it.</li>\n\
         <li>Tests can only <b>reject</b> an assumption: “not rejected” does not prove it.</li>\n\
         <li>Inputs and modes that no execution showed are in <b>no number</b>: an event that is rarer than 3/n may be missing \
         from n executions.</li>\n\
         </ul>\n</div>\n</header>\n",
        text(report.date),
        counted(executions, "execution"),
        kinds(report.measured),
        counted(report.sources.len(), "file"),
        levels.join(", "),
    );
}

/// Returns how many codels and programs there are, whatever the number of their instances: `7 codels and 2 programs`.
fn kinds(measured: &[ReportedCodel<'_>]) -> String {
    let keys: BTreeMap<&str, bool> = measured.iter().map(|it| (it.key, it.is_program())).collect();
    let programs = keys.values().filter(|is_program| **is_program).count();
    match (keys.len() - programs, programs) {
        (codels, 0) => counted(codels, "codel"),
        (0, programs) => counted(programs, "program"),
        (codels, programs) => format!("{} and {}", counted(codels, "codel"), counted(programs, "program")),
    }
}

/// What the overview says about a codel.
pub(super) struct CodelVerdict {
    refusal: Option<String>,
    warnings: Vec<String>,
    is_over_budget: bool,
    /// Whether a time of the verdict is extrapolated.
    is_extrapolated: bool,
}

impl CodelVerdict {
    fn of(measured: &ReportedCodel<'_>) -> CodelVerdict {
        let is_over_budget = tables::is_over_budget(measured);
        let mut verdict =
            CodelVerdict { refusal: None, warnings: Vec::new(), is_over_budget, is_extrapolated: false };
        match &measured.measurement.result {
            Ok(estimate) => {
                // At the level of the budget, otherwise at all.
                let levels = measured.budget.map_or(0..estimate.levels.len(), |(level, _)| level..level + 1);
                let (extrapolated, warnings): (Vec<_>, Vec<_>) = levels
                    .flat_map(|level| estimate.warnings_at(level))
                    .partition(|it| matches!(it, Warning::Extrapolated { .. }));
                verdict.is_extrapolated = !extrapolated.is_empty();
                let is_told = |it: &&Warning| warnings.contains(it);
                verdict.warnings =
                    estimate.warnings.iter().filter(is_told).map(measurement_warning).collect();
                verdict.warnings.extend(extrapolated.first().map(measurement_warning));
            }
            Err(it) => verdict.refusal = Some(measurement_refusal(&it.refusal)),
        }
        verdict
    }

    /// First what misses a deadline, then refusals, then what needs a look.
    fn rank(&self) -> u32 {
        match self {
            CodelVerdict { is_over_budget: true, .. } => 0,
            CodelVerdict { refusal: Some(_), .. } => 1,
            CodelVerdict { warnings, .. } if !warnings.is_empty() => 2,
            _ => 3,
        }
    }

    fn badges(&self) -> String {
        let badge = |class: &str, text: &str| format!("<span class=\"badge {class}\">{text}</span> ");
        if self.refusal.is_some() {
            return badge("failed", "refused");
        }
        let mut out = String::new();
        if self.is_over_budget {
            out += &badge("failed", "over budget");
        }
        match self.warnings.len() - usize::from(self.is_extrapolated) {
            0 if self.is_extrapolated => out += &badge("warned", "extrapolated"),
            0 => {}
            _ => out += &badge("warned", &counted(self.warnings.len(), "warning")),
        }
        if out.is_empty() { badge("fine", "fine") } else { out }
    }
}

fn overview(out: &mut String, report: &ExecutionReport<'_>, order: &[&ReportedCodel<'_>]) {
    let levels = &report.options.levels;
    let heads: String = levels
        .iter()
        .map(|&level| format!("<th scope=\"col\" class=\"number\">{}</th>", figures::level(level)))
        .collect();
    let _ = write!(
        out,
        "<h2 id=\"overview\">Overview</h2>\n\
         <p class=\"note\">Codels over their budgets first, then those with refusals and warnings. Below each bound: its ratio to the high-water mark; ~ marks a bound that is extrapolated.</p>\n\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-labelledby=\"overview\">\n<table class=\"overview\">\n\
         <thead><tr><th scope=\"col\" rowspan=\"2\">codel or program</th><th scope=\"col\" rowspan=\"2\">instance</th>\
         <th scope=\"col\" rowspan=\"2\">verdict</th><th scope=\"col\" rowspan=\"2\" class=\"number\">executions</th>\
         <th scope=\"col\" rowspan=\"2\" class=\"number\">high-water<br/>mark</th>\
         <th scope=\"colgroup\" colspan=\"{}\" class=\"group\">95\u{a0}% upper bound at level</th></tr>\n\
         <tr>{heads}</tr></thead>\n\
         <tbody>\n",
        levels.len().max(1)
    );
    for (index, measured) in order.iter().enumerate() {
        let (verdict, unit) = (CodelVerdict::of(measured), unit_of(measured));
        let executions = &measured.measurement.executions;
        let high_water = executions.iter().max().map_or("–".to_owned(), |&time| unit.bound(time as f64));
        let _ = write!(
            out,
            "<tr><th scope=\"row\"><a href=\"#codel-{}\">{}</a></th><td>{}</td><td>{}</td>\
             <td class=\"number\">{}</td><td class=\"number\">{high_water}</td>",
            index + 1,
            code(measured.key),
            measured.instance().map_or("all".to_owned(), code),
            verdict.badges(),
            count(executions.len()),
        );
        let of_levels = measured.measurement.result.iter().flat_map(|estimate| {
            estimate.levels.iter().map(|level| match level.bound {
                Ok(bound) => {
                    let ratio = figures::ratio(bound / estimate.greatest as f64);
                    let mark = if level.is_extrapolated { " ~" } else { "" };
                    format!("<td class=\"number\">{}{mark}<small>{ratio}</small></td>", unit.bound(bound))
                }
                Err(_) => "<td class=\"number\">–</td>".to_owned(),
            })
        });
        out.extend(of_levels);
        if let Some(refusal) = &verdict.refusal {
            let (columns, why) = (levels.len().max(1), text(refusal));
            let _ = write!(out, "<td class=\"why\" colspan=\"{columns}\"><small>{why}</small></td>");
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n</div>\n");
}

/// Returns the unit of all times of a codel: that of its high-water mark.
fn unit_of(measured: &ReportedCodel<'_>) -> TimeUnit {
    TimeUnit::of(measured.measurement.executions.iter().copied().max().unwrap_or_default() as f64)
}

fn section(out: &mut String, index: usize, measured: &ReportedCodel<'_>, options: &EstimateOptions) {
    let verdict = CodelVerdict::of(measured);
    let kind = if measured.is_program() { "program" } else { "codel" };
    let of_instance = measured.instance().map_or(String::new(), |it| format!(" of instance {}", code(it)));
    let _ = write!(
        out,
        "<section id=\"codel-{number}\" aria-labelledby=\"name-{number}\">\n<div class=\"title\">\
         <h2 id=\"name-{number}\">{} <small>{kind}{of_instance}</small></h2>\
         <span>{}</span><a href=\"#overview\">back to the overview</a></div>\n",
        code(measured.key),
        verdict.badges().trim_end(),
        number = index + 1,
    );
    if let Some(refusal) = &verdict.refusal {
        let why = text(&sentence(refusal));
        let _ = writeln!(out, "<div class=\"refusal\"><h3>No estimate</h3><p>{why}</p></div>");
    }
    if !verdict.warnings.is_empty() {
        let items: String =
            verdict.warnings.iter().map(|it| format!("<li>{}</li>", text(&sentence(it)))).collect();
        let _ = writeln!(out, "<div class=\"warnings\"><h3>Warnings</h3><ul>{items}</ul></div>");
    }
    let InstanceMeasurement { executions, runs, result, .. } = measured.measurement;
    let mut ascending = executions.clone();
    ascending.sort_unstable();
    let unit = unit_of(measured);
    key_figures(out, measured, &ascending, &unit);
    let instance = measured.instance().map(|instance| format!(" of instance {instance}"));
    let name = text(&(measured.key.to_owned() + &instance.unwrap_or_default()));
    let plotted = Plotted { name, unit, executions, ascending, runs };
    let estimate = result.as_ref().ok();
    if executions.len() >= 2 {
        let budget = measured.budget.map(|(level, time)| (level, time.as_nanos() as f64));
        let figures = [
            estimate.map(|it| plots::tail(&plotted, it, budget)),
            Some(plots::recording(&plotted)),
            plots::density(&plotted, estimate),
            estimate.map(|it| plots::quantiles(&plotted, it)),
            estimate.and_then(|it| plots::convergence(&plotted, it, options)),
        ];
        out.push_str("<div class=\"plots\">\n");
        out.extend(figures.into_iter().flatten());
        out.push_str("</div>\n");
    }
    if let Some(estimate) = estimate {
        tables::tables(out, measured, estimate, &plotted.unit);
    }
    out.push_str("</section>\n");
}

/// Returns a message as a sentence.
fn sentence(message: &str) -> String {
    format!("{}.", capitalised(message))
}

fn key_figures(out: &mut String, measured: &ReportedCodel<'_>, ascending: &[u64], unit: &TimeUnit) {
    let mut figures = vec![("executions", count(ascending.len()))];
    let is_inside = |start: &&usize| (1..ascending.len()).contains(*start);
    let runs = measured.measurement.runs.iter().filter(is_inside).count() + 1;
    figures.extend((runs > 1).then(|| ("runs", count(runs))));
    let time = |time: Option<&u64>| time.map(|&time| unit.time(time as f64));
    figures.extend(time(ascending.first()).map(|it| ("least", it)));
    figures.extend(time(ascending.get(ascending.len() / 2)).map(|it| ("median", it)));
    figures.extend(ascending.last().map(|&time| ("high-water mark", unit.bound(time as f64))));
    let strictest = |estimate: &Estimate| {
        let bounds = estimate.levels.iter().filter_map(|it| Some((it.level, it.bound.ok()?)));
        let (level, bound) = bounds.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let ratio = figures::ratio(bound / estimate.greatest as f64);
        Some((format!("bound at {}", figures::level(level)), unit.bound(bound), ratio))
    };
    let bound = measured.measurement.result.as_ref().ok().and_then(strictest);
    let _ = write!(out, "<dl class=\"keys\">");
    for (name, value) in figures {
        let _ = write!(out, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    if let Some((name, value, ratio)) = bound {
        let _ = write!(
            out,
            "<div><dt>{name}</dt><dd>{value}</dd><dd class=\"note\">{ratio} high-water mark</dd></div>"
        );
    }
    out.push_str("</dl>\n");
}

fn footer(out: &mut String, report: &ExecutionReport<'_>) {
    let rows: String = report
        .sources
        .iter()
        .map(|(name, digest)| {
            format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", code(name), code(digest))
        })
        .collect();
    let EstimateOptions { seed, .. } = report.options;
    let _ = write!(
        out,
        "<footer>\n<h3 id=\"sources\">Sources</h3>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-labelledby=\"sources\">\n\
         <table>\n<thead><tr><th scope=\"col\">file</th><th scope=\"col\">digest</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n\
         <p class=\"note\">Seed {seed}. The same files, options and version of mauve give the same numbers.</p>\n</footer>\n",
    );
}
