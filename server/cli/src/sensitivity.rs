//! The tables of `mauve wcrt --sensitivity`: how far each time may grow, and each period shrink.

use std::fmt::Write as _;

use mauve_diagnostics::times_of;
use mauve_ide::percentage;
use mauve_projects::analysis_document::{Deployed, factor};
use mauve_timing::Time;
use mauve_wcrt::{ActivitySensitivity, Limit, Query, Sensitivity, TimeSensitivity};

use crate::text::{columns, csv, number};

/// Returns two tables for each level: times and periods. Empty where the sensitivity was not requested.
pub(super) fn sensitivity_tables(it: &Deployed<'_>) -> String {
    let mut out = String::new();
    for ((query, _), found) in it.reports.iter().zip(&it.sensitivities) {
        out += &tables_at(it, query, found);
    }
    out
}

fn tables_at(it: &Deployed<'_>, query: &Query, found: &Sensitivity<'_>) -> String {
    let mut out = format!(
        "\n{}: limits of each value, changed alone, in ms at {}{}\n",
        it.name,
        query.level,
        times_of(it.times())
    );
    let rows: Vec<Vec<String>> = found.times.iter().map(|of| time_row(it, of)).collect();
    if !rows.is_empty() {
        out += &columns(&["codel or program", "time", "at most", "growth", ""], &rows);
        out.push('\n');
    }
    let rows: Vec<Vec<String>> = found.activities.iter().map(period_row).collect();
    out += &columns(&["instance", "period", "at least", "slack", ""], &rows);
    let limits = found.times.iter().map(|it| &it.limit).chain(found.activities.iter().map(|it| &it.limit));
    if limits.into_iter().any(|limit| matches!(limit, Limit::Proved(_))) {
        out += "  ≥, ≤: the analysis proves no more, and no miss: the limit may be further\n";
    }
    let serving = found
        .activities
        .iter()
        .filter(|it| it.serves && matches!(it.limit, Limit::Last(_) | Limit::Proved(_)));
    for activity in serving {
        let _ = writeln!(
            out,
            "  {}: executes operations for others: analyse a period between the two before using it",
            activity.instance
        );
    }
    out
}

fn time_row(it: &Deployed<'_>, of: &TimeSensitivity<'_>) -> Vec<String> {
    let change = of.time.zip(of.limit.time()).map(|(now, limit)| {
        let percentage = percentage(now, limit).map_or_else(String::new, |share| format!(" ({share})"));
        change(now, limit) + &percentage
    });
    let remark = match &of.unproved {
        Some(_) if of.limit == Limit::NotFound => remark(&of.limit, of.unproved.as_deref()),
        Some(late) => format!("for the deadline of {late}"),
        None => remark(&of.limit, None),
    };
    vec![of.key(it.db), number(of.time), cell(&of.limit, "≥ "), change.unwrap_or_default(), remark]
}

fn period_row(of: &ActivitySensitivity) -> Vec<String> {
    let remark = match &of.unproved {
        Some(late) if of.limit.time().is_some() => format!("for the deadline of {late}"),
        unproved => remark(&of.limit, unproved.as_deref()),
    };
    vec![of.instance.to_string(), number(of.period), cell(&of.limit, "≤ "), number(of.slack), remark]
}

/// Returns the difference between two times, with its sign: `+2.5`.
fn change(now: Time, then: Time) -> String {
    match (then.checked_sub(now), now.checked_sub(then)) {
        (Some(more), _) => format!("+{}", more.number()),
        (None, less) => format!("-{}", less.unwrap_or_default().number()),
    }
}

fn cell(limit: &Limit, open: &str) -> String {
    match limit {
        Limit::Any => "any".to_owned(),
        Limit::Last(time) => time.number(),
        Limit::Proved(time) => format!("{open}{}", time.number()),
        Limit::NotFound | Limit::NotAnalysed(_) | Limit::Exhausted => "—".to_owned(),
    }
}

/// Returns why there is no limit.
fn remark(limit: &Limit, unproved: Option<&str>) -> String {
    match (limit, unproved) {
        (Limit::Any | Limit::Last(_) | Limit::Proved(_), _) => String::new(),
        (Limit::NotFound, Some(late)) => format!("no value proves the deadline of {late}"),
        (Limit::NotFound, None) => "no value proves all deadlines".to_owned(),
        (Limit::NotAnalysed(Some(instance)), _) => format!("{instance} is not analysed"),
        (Limit::NotAnalysed(None), _) => "nothing is analysed".to_owned(),
        (Limit::Exhausted, _) => "the budget of the search is exhausted".to_owned(),
    }
}

/// Returns a line for each time and each period, at each level.
pub(super) fn sensitivity_csv(all: &[Deployed<'_>], root: &dyn Fn(&Deployed<'_>) -> String) -> String {
    let header =
        "deployment,significance,method,kind,name,now_ms,limit_ms,factor,limit,slack_ms,unproved,root,remark";
    let mut rows = Vec::new();
    for it in all {
        let root = root(it);
        let errors = if it.errors > 0 { "not proved: the project has errors" } else { "" };
        for ((query, _), found) in it.reports.iter().zip(&it.sensitivities) {
            let mut line = |kind: &str,
                            name: &str,
                            now: Option<Time>,
                            limit: &Limit,
                            slack: Option<Time>,
                            unproved: Option<&str>| {
                let time = |time: Option<Time>| time.map(Time::number).unwrap_or_default();
                let multiple = now.zip(limit.time()).and_then(|(now, limit)| factor(now, limit));
                let remarks = [remark(limit, unproved), errors.to_owned()];
                let remarks: Vec<String> = remarks.into_iter().filter(|it| !it.is_empty()).collect();
                rows.push(vec![
                    it.name.to_owned(),
                    query.level.to_string(),
                    query.method.to_string(),
                    kind.to_owned(),
                    name.to_owned(),
                    time(now),
                    time(limit.time()),
                    multiple.map(|it| it.to_string()).unwrap_or_default(),
                    limit.name().to_owned(),
                    time(slack),
                    unproved.unwrap_or_default().to_owned(),
                    root.clone(),
                    remarks.join("; "),
                ]);
            };
            for of in &found.times {
                line("time", &of.key(it.db), of.time, &of.limit, None, of.unproved.as_deref());
            }
            for of in &found.activities {
                line("period", &of.instance, of.period, &of.limit, of.slack, of.unproved.as_deref());
            }
        }
    }
    csv(header, rows)
}
