//! The tables of `mauve wcrt --sensitivity`: how far each time may grow, and each period shrink.

use mauve_diagnostics::times_of;
use mauve_ide::percentage;
use mauve_projects::analysis_document::{Deployed, factor};
use mauve_timing::Time;
use mauve_wcrt::{Limit, Query, Sensitivity};

use crate::text::{Sheet, columns, csv_number, number};

/// Returns two tables for each level: times and periods. Empty where the sensitivity was not requested.
pub(super) fn sensitivity_tables(it: &Deployed<'_>) -> String {
    let mut out = String::new();
    for ((query, _), found) in it.reports.iter().zip(&it.sensitivities) {
        out += &tables_at(it, query, found);
    }
    out
}

/// How far a time may grow, or a period shrink.
struct SensitivityRow<'a> {
    is_period: bool,
    name: String,
    now: Option<Time>,
    limit: &'a Limit,
    /// Of a period.
    slack: Option<Time>,
    /// The activity whose deadline is not proved now.
    unproved: Option<&'a str>,
}

/// Returns a row for each time, and one for each period.
fn rows<'a>(it: &Deployed<'_>, found: &'a Sensitivity<'_>) -> [Vec<SensitivityRow<'a>>; 2] {
    let times = found.times.iter().map(|of| SensitivityRow {
        is_period: false,
        name: of.key(it.db),
        now: of.time,
        limit: &of.limit,
        slack: None,
        unproved: of.unproved.as_deref(),
    });
    let periods = found.activities.iter().map(|of| SensitivityRow {
        is_period: true,
        name: of.instance.to_string(),
        now: of.period,
        limit: &of.limit,
        slack: of.slack,
        unproved: of.unproved.as_deref(),
    });
    [times.collect(), periods.collect()]
}

fn tables_at(it: &Deployed<'_>, query: &Query, found: &Sensitivity<'_>) -> String {
    let (name, times_of) = (it.name, times_of(it.times()));
    let mut out =
        format!("\n{name}: limits of each value, changed alone, in ms at {}{times_of}\n", query.level);
    let [times, periods] = rows(it, found);
    if !times.is_empty() {
        let heads = ["codel or program", "time", "at most", "growth", ""];
        out += &(columns(&heads, times.iter().map(SensitivityRow::cells)) + "\n");
    }
    let heads = ["instance", "period", "at least", "slack", ""];
    out += &columns(&heads, periods.iter().map(SensitivityRow::cells));
    if times.iter().chain(&periods).any(|row| matches!(row.limit, Limit::Proved(_))) {
        out += "  ≥, ≤: the analysis proves no more, and no miss: the limit may be further\n";
    }
    for activity in found.activities.iter().filter(|it| it.serves && it.limit.time().is_some()) {
        out += &format!(
            "  {}: executes operations for others: analyse a period between the two before using it\n",
            activity.instance
        );
    }
    out
}

impl SensitivityRow<'_> {
    fn cells(&self) -> Vec<String> {
        let growth = self.now.zip(self.limit.time()).map(|(now, limit)| {
            let percentage = percentage(now, limit).map_or_else(String::new, |share| format!(" ({share})"));
            change(now, limit) + &percentage
        });
        let (open, change) = match self.is_period {
            true => ("≤ ", number(self.slack)),
            false => ("≥ ", growth.unwrap_or_default()),
        };
        let remark = match self.unproved {
            Some(late) if self.limit.time().is_some() => format!("for the deadline of {late}"),
            _ => self.remark(),
        };
        vec![self.name.clone(), number(self.now), cell(self.limit, open), change, remark]
    }

    /// Returns why there is no limit.
    fn remark(&self) -> String {
        match (self.limit, self.unproved) {
            (Limit::Any | Limit::Last(_) | Limit::Proved(_), _) => String::new(),
            (Limit::NotFound, Some(late)) => format!("no value proves the deadline of {late}"),
            (Limit::NotFound, None) => "no value proves all deadlines".to_owned(),
            (Limit::NotAnalysed(Some(instance)), _) => format!("{instance} is not analysed"),
            (Limit::NotAnalysed(None), _) => "nothing is analysed".to_owned(),
            (Limit::Exhausted, _) => "the budget of the search is exhausted".to_owned(),
        }
    }
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

/// Returns a line for each time and each period, at each level.
pub(super) fn sensitivity_csv(all: &[Deployed<'_>], root: &dyn Fn(&Deployed<'_>) -> String) -> String {
    let rows = all.iter().flat_map(|it| {
        it.reports.iter().zip(&it.sensitivities).flat_map(move |((query, _), found)| {
            rows(it, found).into_iter().flatten().map(move |row| (it, query, row))
        })
    });
    Sheet::of(&rows.collect::<Vec<_>>())
        .column("deployment", |(it, ..)| it.name.to_owned())
        .column("significance", |(_, query, _)| query.level.to_string())
        .column("method", |(_, query, _)| query.method.to_string())
        .column("kind", |(.., row)| if row.is_period { "period" } else { "time" }.to_owned())
        .column("name", |(.., row)| row.name.clone())
        .column("now_ms", |(.., row)| csv_number(row.now))
        .column("limit_ms", |(.., row)| csv_number(row.limit.time()))
        .column("factor", |(.., row)| {
            let factor = row.now.zip(row.limit.time()).and_then(|(now, limit)| factor(now, limit));
            factor.map(|it| it.to_string()).unwrap_or_default()
        })
        .column("limit", |(.., row)| row.limit.name().to_owned())
        .column("slack_ms", |(.., row)| csv_number(row.slack))
        .column("unproved", |(.., row)| row.unproved.unwrap_or_default().to_owned())
        .column("root", |(it, ..)| root(it))
        .column("remark", |(it, _, row)| {
            let errors = if it.errors > 0 { "not proved: the project has errors" } else { "" };
            let mut remarks = vec![row.remark(), errors.to_owned()];
            remarks.retain(|it| !it.is_empty());
            remarks.join("; ")
        })
        .csv()
}
