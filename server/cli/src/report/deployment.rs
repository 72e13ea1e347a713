//! The section of a deployment: its architecture, CPU budget, response times with their parts, chains, execution times with their
//! evidence, and what the figures rest on.

use std::fmt::Write as _;

use mauve_diagnostics::figure::{HintStatus, TIGHT_SLACK, short};
use mauve_diagnostics::{reasons_of, timing_reason};
use mauve_ide::{
    DeploymentAt, Drawing, DrawnChain, draw_budget, draw_chains, draw_graph, drawn_budget, drawn_chains,
    explain_response, graph, html_code, html_text,
};
use mauve_projects::analysis_document::Deployed;
use mauve_timing::{Measured, Status, Time};
use mauve_wcrt::{
    ActivityReport, Origin as TimeOrigin, Report, ReportBreakdown, executed_times, file_name, origin_of,
    record_of, system_of,
};

use super::rows::{ReportRow, list, rows, shown, table};
use crate::text::{counted, number};
use crate::wcrt::{conditions, cpu_numbers, priority};

/// The number of activities whose response times are explained in full.
const MOST_EXPLAINED: usize = 20;

/// The greatest number of activities in the table of an explanation.
const MOST_ROWS: usize = 16;

/// The number of parts of a response time that have a name.
const MOST_PARTS: usize = 4;

/// Returns the section of the deployment of this index.
pub(super) fn section(of: &Deployed<'_>, index: usize) -> String {
    let Some(((project, declared), (query, report))) = of.model().zip(of.reports.first()) else {
        return String::new();
    };
    let (db, at) = (of.db, (project, declared, *query));
    let times = mauve_diagnostics::times_of(of.times());
    let mut out = format!(
        "<section id=\"deployment-{index}\">\n<h2>{} <small>at {}, method {}{}</small></h2>\n",
        html_code(of.name),
        query.level,
        query.method,
        html_text(&times)
    );
    out += &not_analysed(of, report);
    out += &response_times(of, report);
    if !report.cpus.is_empty() {
        let budget = draw_budget(&drawn_budget(db, at, TIGHT_SLACK), Drawing::Svg);
        let _ = writeln!(out, "<h3>CPU budget</h3>\n<figure>{budget}</figure>");
    }
    if let Some(graph) = graph(db, project, declared, *query, TIGHT_SLACK) {
        let drawing = draw_graph(db, &graph, Drawing::Svg);
        let _ = writeln!(
            out,
            "<h3>Architecture</h3>\n<figure class=\"scroll\" tabindex=\"0\">{drawing}</figure>"
        );
    }
    out += &chains(of, at);
    out += &explanations(of, at, report);
    out += &execution_times(of, at, report);
    let conditions = conditions(of);
    let conditions = list(conditions.lines().map(|it| html_text(it.trim())));
    if !conditions.is_empty() {
        let _ = writeln!(out, "<h3>What the figures depend on</h3>\n{conditions}");
    }
    out + "</section>\n"
}

/// The activities without a response time, and why.
fn not_analysed(of: &Deployed<'_>, report: &Report<'_>) -> String {
    let of_all = report
        .not_analysed
        .iter()
        .map(|it| format!("Nothing is analysed: {}", html_text(&timing_reason(of.db, &it.reason))));
    let unknown = report
        .activities
        .iter()
        .filter(|it| it.verdict == Status::NotAnalysed && report.not_analysed.is_empty());
    let unknown = unknown
        .map(|it| format!("{}: {}", html_code(&it.instance), html_text(&reasons_of(of.db, it).join("; "))));
    let all = list(of_all.chain(unknown));
    if all.is_empty() { all } else { format!("<div class=\"warnings\"><h3>Not analysed</h3>\n{all}</div>\n") }
}

/// A row for each activity, the worst first.
fn response_times(of: &Deployed<'_>, report: &Report<'_>) -> String {
    let interrupt = || ();
    let mut breakdown = report.breakdown(&interrupt);
    let mut all: Vec<(usize, ReportRow<'_, '_>)> = rows(of).into_iter().enumerate().collect();
    all.sort_by_key(|(_, row)| row.order());
    let row = |(index, ReportRow { activity, forms }): &(usize, ReportRow<'_, '_>)| {
        let accepted =
            of.acceptance(activity).map(|why| format!("<br/><small>accepted: {}</small>", html_text(why)));
        vec![
            format!(
                "{} <small>{}</small>",
                html_code(&activity.instance),
                html_text(&activity.component_name)
            ),
            shown(forms) + &accepted.unwrap_or_default(),
            parts(&mut breakdown, *index, activity),
            number(activity.own),
            html_text(&cpu_numbers(&report.hosts, activity.cpus).replace(' ', "\u{a0}")),
            priority(activity.priority),
            number(activity.period),
        ]
    };
    let heads =
        ["Activity", "Response / deadline", "Where it comes from", "WCET ms", "CPU", "Priority", "Period ms"];
    format!("<h3>Response times</h3>\n{}", table(&heads, all.iter().map(row).collect::<Vec<_>>()))
}

/// Returns the parts of a response time, as a bar up to the deadline and in words: they sum to the response time.
fn parts(breakdown: &mut ReportBreakdown<'_>, index: usize, activity: &ActivityReport<'_>) -> String {
    let (Some(response), Some(deadline), Some(window)) =
        (activity.response, activity.deadline, &activity.window)
    else {
        return String::new();
    };
    let mut others = breakdown.of(index);
    others.sort_by_key(|it| std::cmp::Reverse(it.time));
    let nanos = |time: Time| i128::from(time.as_nanos());
    let jobs = |jobs: u64| if jobs == 1 { String::new() } else { format!("{jobs} × ") };
    let mut all = vec![("own", format!("{}own time", jobs(window.job)), nanos(window.own))];
    all.extend(
        others
            .iter()
            .take(MOST_PARTS)
            .map(|it| ("others", format!("{}{}", jobs(it.jobs), it.instance), nanos(it.time))),
    );
    let rest = others.iter().skip(MOST_PARTS).map(|it| nanos(it.time)).sum();
    let more = others.len().saturating_sub(MOST_PARTS);
    all.push(("others", format!("{more} more"), rest));
    all.push(("blocking", "lower priorities that hold locks".to_owned(), nanos(window.blocking)));
    let sum: i128 = all.iter().map(|(.., time)| time).sum();
    all.retain(|(.., time)| *time > 0);
    let whole = response.max(deadline).as_nanos().max(1) as f64;
    let (mut bar, mut x) = (String::new(), 0.0);
    for (class, _, time) in &all {
        let width = (*time as f64 / whole * 300.0).min(300.0 - x);
        let _ = write!(bar, "<rect class=\"{class}\" x=\"{x:.1}\" width=\"{width:.1}\" height=\"8\"/>");
        x += width;
    }
    let limit = deadline.as_nanos() as f64 / whole * 300.0;
    // The release may be after the start of the busy window, before it, or parts may execute at once.
    let difference = nanos(response) - sum;
    let time = |nanos: i128| short(Time::from_nanos(u64::try_from(nanos.unsigned_abs()).unwrap_or(u64::MAX)));
    let rest = match difference {
        0 => None,
        1.. => Some(format!("{} before the busy window begins", time(difference))),
        _ => Some(format!("− {} before its release, or at once on several CPUs", time(difference))),
    };
    let words: Vec<String> =
        all.iter().map(|(_, what, nanos)| format!("{what} {}", time(*nanos))).chain(rest).collect();
    let words = html_text(&words.join(" + ").replace("+ −", "−"));
    format!(
        "<svg class=\"sum\" viewBox=\"0 0 300 12\" role=\"img\" aria-label=\"{words}\"><g transform=\"translate(0 2)\">{bar}</g>\
         <path class=\"limit\" d=\"M{:.1} 0V12\"/></svg><small>{words}</small>",
        limit.clamp(1.0, 299.0)
    )
}

/// The full explanations of the response times that are not met with slack.
fn explanations(
    of: &Deployed<'_>,
    (project, declared, query): DeploymentAt<'_>,
    report: &Report<'_>,
) -> String {
    let activities = &system_of(of.db, project, declared).activities;
    let mut all: Vec<(usize, ReportRow<'_, '_>)> = rows(of).into_iter().enumerate().collect();
    all.retain(|(_, row)| {
        matches!(row.forms.status, HintStatus::Missed | HintStatus::Tight | HintStatus::Unknown)
    });
    all.sort_by_key(|(_, row)| row.order());
    let explained = all.iter().take(MOST_EXPLAINED).filter_map(|(index, row)| {
        let tables = activities.get(*index)?.tables;
        let doc = explain_response(of.db, tables, report, *index, query, MOST_ROWS)?;
        Some(format!(
            "<h4>{} {}</h4>\n<div class=\"explained\">{}</div>\n",
            html_code(&row.activity.instance),
            shown(&row.forms),
            doc.html()
        ))
    });
    let explained: String = explained.collect();
    if explained.is_empty() { explained } else { format!("<h3>Explanations</h3>\n{explained}") }
}

/// Returns the chains whose limits are not kept, or not known to be.
pub(super) fn late_chains<'db>(of: &Deployed<'db>) -> Vec<DrawnChain<'db>> {
    let Some(((project, declared), (query, _))) = of.model().zip(of.reports.first()) else {
        return Vec::new();
    };
    let at = (project, declared, *query);
    let is_open =
        |it: &DrawnChain<'_>| it.status == HintStatus::Missed || it.limit.is_some() && it.latency.is_none();
    drawn_chains(of.db, at, None, TIGHT_SLACK).all.into_iter().filter(is_open).collect()
}

/// Returns the figure of a chain.
pub(super) fn chain_figure(it: &DrawnChain<'_>) -> String {
    format!("<span class=\"figure {}\">{}</span>", it.status.name(), html_text(&it.figure))
}

/// The chains with a latency or a limit, also as a drawing.
fn chains<'db>(of: &Deployed<'db>, at: DeploymentAt<'db>) -> String {
    let mut drawn = drawn_chains(of.db, at, None, TIGHT_SLACK);
    let (known, unknown): (Vec<_>, Vec<_>) =
        std::mem::take(&mut drawn.all).into_iter().partition(|it| it.latency.is_some() || it.limit.is_some());
    let left_out = std::mem::take(&mut drawn.left_out);
    if known.is_empty() && unknown.is_empty() {
        return String::new();
    }
    let mut out = "<h3>Chains</h3>\n".to_owned();
    let row = |it: &DrawnChain<'_>| {
        let steps = it
            .steps
            .iter()
            .map(|step| html_text(&step.description()))
            .chain(it.reasons.iter().map(|it| html_text(it)));
        vec![html_code(&it.name), chain_figure(it), steps.collect::<Vec<_>>().join("<br/>")]
    };
    if !known.is_empty() {
        out += &table(&["Chain", "Latency / limit", "Where it comes from"], known.iter().map(row));
        drawn.all = known;
        let _ = writeln!(out, "<figure>{}</figure>", draw_chains(&drawn, Drawing::Svg));
    }
    let count = unknown.len() + left_out;
    if count > 0 {
        let count = counted(count, "chain");
        let _ =
            writeln!(out, "<p>{count} without a limit or a bound: <code>mauve chains</code> says why.</p>");
    }
    out
}

/// The execution times with their evidence.
fn execution_times<'db>(
    of: &Deployed<'db>,
    (project, declared, query): DeploymentAt<'db>,
    report: &Report<'db>,
) -> String {
    let db = of.db;
    let row = |it: &mauve_wcrt::ExecutedTime<'db>| {
        let users = it.activities().iter().filter_map(|index| report.activities.get(*index));
        let users: Vec<String> = users.map(|it| html_code(&it.instance)).collect();
        let evidence = it.tables.iter().map(|tables| {
            let origin = origin_of(db, *tables, &it.of, query.level);
            let (record, file) = record_of(db, *tables, &it.of);
            let table = file.map_or_else(String::new, |file| {
                format!(" <small>{}</small>", html_text(&file_name(db, file)))
            });
            evidence(origin, record) + &table
        });
        let time = it.time(db, query.level);
        let evidence = match time {
            None if it.activities().is_empty() => "needs none: not real-time".to_owned(),
            Some(_) => evidence.collect::<Vec<_>>().join("<br/>"),
            None => "<b class=\"failed\">no time</b>".to_owned(),
        };
        vec![html_code(&it.of.key(db)), number(time), users.join(", "), evidence]
    };
    let rows: Vec<Vec<String>> = executed_times(db, project, declared, query.level).iter().map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let heads = ["Codel or program", "Time ms", "Executed by", "Evidence"];
    format!("<h3>Execution times <small>at {}</small></h3>\n{}", query.level, table(&heads, rows))
}

/// Says where a time comes from.
fn evidence(origin: TimeOrigin, record: Option<&Measured>) -> String {
    match (origin, record) {
        (TimeOrigin::Measured, Some(it)) => {
            let warnings = it.warnings.join(", ");
            let warnings = (!warnings.is_empty())
                .then(|| format!("<br/><b class=\"warned\">{}</b>", html_text(&warnings)));
            let count = counted(usize::try_from(it.executions).unwrap_or(usize::MAX), "execution");
            let text = format!("{}, {count}, the longest {}; {}", it.date, it.greatest, it.method);
            format!("<b class=\"fine\">measured</b> {}{}", html_text(&text), warnings.unwrap_or_default())
        }
        (TimeOrigin::Measured, None) => "<b class=\"fine\">measured</b>".to_owned(),
        (TimeOrigin::Assumed, _) => "<b class=\"warned\">assumed</b>".to_owned(),
        (TimeOrigin::Given, _) => "written by hand".to_owned(),
    }
}
