//! Prints the rows of an explanation in Markdown, for a hover: the verdict, a table whose rows sum to the response time,
//! the costliest path through the state machine, and the details.
//!
//! ```text
//! **Deadline met: 53 ms ≤ 100 ms, 47 ms slack** at 1e-4
//!
//! |               | priority |      jobs |      time |                  |
//! |:--------------|:--------:|----------:|----------:|:-----------------|
//! | own time      |        9 | 1 × 43 ms |     43 ms | ████████████████▎ |
//! | `p3dx_driver` |       10 | 1 × 10 ms |     10 ms | ███▊             |
//! | **response time** |      |           | **53 ms** |                  |
//! ```

use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_hir::ModelDb;
use mauve_timing::{Status, Time};
use mauve_wcrt::{Query, Report, Share, TableSet};

use super::{Explanation, Load, Overload, OwnTime, Released, Row, SHOWN_PERIODS, Sum, Trace, with_facts};
use crate::markdown::{self, Links, bar, code, row};
use crate::occurrences::grouped;

/// Columns of numbers beside each other, which editors set without a space: the priority is in the middle of its column.
const ALIGNMENT: [&str; 5] = [":--", ":-:", "--:", "--:", ":--"];

/// The greatest number of activities in a table; the last row sums the others.
const MOST_ROWS: usize = 16;

/// [`super::explain_response`] in Markdown; `links` has the addresses of activities.
pub(crate) fn explain_in_markdown<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    report: &Report<'db>,
    activity: usize,
    query: Query,
    links: Links<'_>,
) -> String {
    with_facts(db, tables, report, activity, query, |facts| print(db, facts, links)).unwrap_or_default()
}

fn print(db: &dyn ModelDb, facts: &Explanation<'_, '_>, links: Links<'_>) -> String {
    let verdict = verdict(facts);
    if facts.activity.verdict == Status::Background {
        return verdict;
    }
    let sum = facts.sum.as_ref().zip(facts.activity.response);
    let own = facts.own.as_ref().filter(|own| own.of_programs > Time::ZERO);
    let trace = facts.trace.as_ref().filter(|trace| !trace.periods.is_empty());
    let parts = [
        Some(verdict),
        sum.map(|(sum, response)| sum_table(db, facts, sum, response, links)),
        facts.overload.as_ref().map(|overload| load_table(db, overload, links)),
        own.map(own_time),
        trace.map(costliest_path),
        Some(format!("---\n\n{}", list(details(facts)))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join("\n")
}

fn list(lines: impl IntoIterator<Item = String>) -> String {
    lines.into_iter().map(|line| format!("- {line}\n")).collect()
}

/// Returns the first line, and the reasons below it if there are several.
fn verdict(facts: &Explanation<'_, '_>) -> String {
    let activity = facts.activity;
    let deadline = activity.deadline.unwrap_or_default();
    let first = facts.reasons.first().map(|why| inline(&why.text)).unwrap_or_default();
    let after = |from: Time, to: Time| to.checked_sub(from).unwrap_or_default();
    let figure = |response: Time, deadline: Time, slack: &str| {
        let forms = Forms::of(response, deadline, TIGHT_SLACK);
        let bar = forms.bar.as_ref().map(|bar| bar.join(" ")).unwrap_or_default();
        format!("**{}** {bar}, {slack}", forms.text())
    };
    let said = match (activity.verdict, activity.response) {
        (Status::Background, _) => return "**Background**: not real-time, not analysed\n".to_owned(),
        (Status::Met, Some(response)) => {
            figure(response, deadline, &format!("slack {}", after(response, deadline)))
        }
        (Status::Missed, Some(response)) => {
            figure(response, deadline, &format!("missed by {}", after(deadline, response)))
        }
        (Status::Unbounded, _) => format!("**{first}**: no bounded response time"),
        (Status::NotAnalysed, _) => format!("**Not analysed**: {first}"),
        (_, _) => format!("**{}**", capitalised(&first)),
    };
    let assumed = if facts.is_assumed { ", with assumed times" } else { "" };
    let first = match activity.verdict {
        // Most reasons do not depend on the level.
        Status::NotAnalysed => format!("{said}{}\n", facts.of_which),
        _ => format!("{said} at {}{assumed}{}\n", facts.query.level, facts.of_which),
    };
    let others = facts.reasons.iter().skip(1).map(|why| inline(&why.text));
    let behind = facts.reasons.iter().filter_map(|why| why.behind.as_ref());
    let behind = behind.map(|(instance, text)| format!("{}: {}", code(instance), inline(text)));
    let more = list(others.chain(behind));
    if more.is_empty() { first } else { format!("{first}\n{more}") }
}

/// Returns text with names in code; its other marks are no Markdown.
fn inline(text: &str) -> String {
    markdown::comment(&text.replace(['\n', '\r'], " "))
}

fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// Returns the name of an activity with its link and the mark of assumed times.
fn named(db: &dyn ModelDb, of: &Row<'_>, links: Links<'_>) -> String {
    let assumed = if of.is_assumed { " (with assumed times)" } else { "" };
    format!("{}{}{assumed}", markdown::link(db, links, &of.name, of.at.as_ref()), inline(&of.noted()))
}

fn priority(of: Option<u32>) -> String {
    of.map_or_else(String::new, |priority| priority.to_string())
}

/// Returns `10 × 43 ms` where each job has the greatest time, `10 × ≤ 297 ms` where some have less. A job without demand, which
/// counts as 1 ns, has no factor.
fn jobs_of(jobs: u64, greatest: Option<Time>, sum: Time) -> String {
    let all = greatest.and_then(|greatest| Some((greatest, greatest.checked_mul(jobs)?)));
    match all {
        Some((greatest, all)) if all == sum => format!("{jobs} × {greatest}"),
        Some((greatest, all)) if all > sum => format!("{jobs} × ≤ {greatest}"),
        _ => jobs.to_string(),
    }
}

/// Returns the table of a response time. Its rows sum to the response time.
fn sum_table(
    db: &dyn ModelDb,
    facts: &Explanation<'_, '_>,
    sum: &Sum<'_>,
    response: Time,
    links: Links<'_>,
) -> String {
    let whole = response.as_nanos() as f64;
    let bar_of = |time: Time| bar(time.as_nanos() as f64 / whole);
    let own_priority = facts.activity.priority.real_time();
    let mut out = row(&["", "priority", "jobs", "time", ""]) + &row(&ALIGNMENT);
    let mut line = |what: &str, priority: &str, jobs: &str, time: Time| {
        out += &row(&[what, priority, jobs, &time.to_string(), &bar_of(time)]);
    };
    let jobs = facts.activity.window.as_ref().map_or(1, |window| window.job);
    let own_priority = priority(own_priority);
    match sum.programs() {
        Some(time) => {
            let greatest = facts.own.as_ref().and_then(|own| match own.of_component {
                Some(time) => Some(time),
                None => own.of_programs.checked_sub(own.overhead),
            });
            line("own time", &own_priority, &jobs_of(jobs, greatest, time), time);
            for it in &sum.calls {
                let calls = if it.calls == 1 { "call" } else { "calls" };
                let what = format!("operation {} for {}", code(&it.operation), code(&it.client));
                line(&what, "", &format!("{} {calls}", it.calls), it.time);
            }
            if sum.overhead > Time::ZERO {
                let each = facts.own.as_ref().map(|own| own.overhead);
                line("dispatch and context switches", "", &jobs_of(jobs, each, sum.overhead), sum.overhead);
            }
        }
        None => line("own time", &own_priority, &jobs.to_string(), sum.own),
    }
    let (shown, others, of_others) = sum.greatest(MOST_ROWS);
    for it in shown {
        line(&named(db, it, links), &priority(it.priority), &jobs_of(it.count, it.each, it.time), it.time);
    }
    if others > 0 {
        line(&format!("{others} more activities"), "", "", of_others);
    }
    if sum.blocking > Time::ZERO {
        line("lower priorities that hold locks", "", "", sum.blocking);
    }
    if sum.at_once > Time::ZERO {
        out += &row(&["on several CPUs at once", "", "", &format!("−{}", sum.at_once), ""]);
    }
    let (what, by) = match sum.released {
        Released::AtStart => ("", String::new()),
        Released::After(by) => ("start of the busy window until the release", format!("−{by}")),
        Released::Before(by) => ("release until the start of the busy window", by.to_string()),
    };
    if !what.is_empty() {
        out += &row(&[what, "", "", &by, ""]);
    }
    out + &row(&["**response time**", "", "", &format!("**{response}**"), ""])
}

/// Returns the table of the utilisation of an overloaded CPU.
fn load_table(db: &dyn ModelDb, overload: &Overload<'_>, links: Links<'_>) -> String {
    let mut parts: Vec<_> = overload.parts.iter().collect();
    parts.sort_by(|a, b| b.share.0.total_cmp(&a.share.0));
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let mut out = row(&["", "priority", "execution time", "utilisation", ""]) + &row(&ALIGNMENT);
    for Load { of, period, share: Share(share) } in parts.iter().take(MOST_ROWS) {
        let time = of.each.zip(*period).map(|(time, period)| format!("{time} per {period}"));
        let (name, bar) = (named(db, of, links), bar(share / overload.utilisation.0));
        out += &row(&[&name, &priority(of.priority), &time.unwrap_or_default(), &percent(*share), &bar]);
    }
    if let Some(others) = parts.len().checked_sub(MOST_ROWS).filter(|others| *others > 0) {
        let share = parts.iter().skip(MOST_ROWS).map(|it| it.share.0).sum();
        out += &row(&[&format!("{others} more activities"), "", "", &percent(share), ""]);
    }
    let what = format!("**{}, priority ≥ {}**", overload.named, overload.priority);
    out + &row(&[&what, "", "", &format!("**{}**", percent(overload.utilisation.0)), ""])
}

/// Returns the greatest execution time of a period by programs and codels.
fn own_time(own: &OwnTime<'_>) -> String {
    let programs = own.programs.iter().map(|(program, codels)| {
        let codels = codels.iter().map(|it| {
            let assumed = if it.is_assumed { " (assumed)" } else { "" };
            format!("{} {}{assumed}", code(&it.name), it.time)
        });
        let codels = codels.collect::<Vec<_>>().join(", ");
        let codels = if codels.is_empty() { codels } else { format!(": {codels}") };
        format!("{} {}{codels}", code(&program.name), program.time)
    });
    let others = own.others().map(|(time, what)| format!("{what} {time}"));
    let period = code(&own.period);
    format!("costliest period: {}, {period}\n\n{}", own.of_programs, list(programs.chain(others)))
}

fn costliest_path(trace: &Trace<'_>) -> String {
    let total = trace.total.map_or_else(String::new, |sum| format!(": {sum}"));
    // Each kind of period once, as a cycle repeats them.
    let kinds = grouped(trace.periods.iter().map(|it| ((&it.name, it.time), it.count))).into_iter();
    let kinds = kinds
        .map(|((name, time), counts)| format!("{} {} × {time}", code(name), counts.into_iter().sum::<u64>()));
    format!("costliest {SHOWN_PERIODS} consecutive periods{total}\n\n{}", list(kinds))
}

fn details(facts: &Explanation<'_, '_>) -> Vec<String> {
    let activity = facts.activity;
    let is_known = !activity.component_name.is_empty();
    let component = is_known.then(|| format!("component {}", code(&activity.component_name)));
    let jitter = Some(activity.jitter).filter(|jitter| *jitter > Time::ZERO);
    let times = [("period", activity.period), ("deadline", activity.deadline), ("jitter", jitter)];
    let times = times.into_iter().filter_map(|(name, time)| Some(format!("{name} {}", time?)));
    let method = format!("method {}", facts.method());
    let released = facts.released.clone();
    let first: Vec<String> = component.into_iter().chain(times).chain(released).chain([method]).collect();
    let mut found = vec![first.join(", ")];
    found.extend(facts.notes.iter().map(|note| inline(note)));
    found.extend(facts.busy_window());
    if let Some(crossed) = &facts.crossed {
        found.push(format!(
            "fixed-point iteration {} exceeds the deadline, {} after the start of the busy window: {}",
            crossed.iteration, crossed.deadline, crossed.shown
        ));
    }
    if let Some(first_job) = facts.critical.filter(|time| activity.response != Some(*time)) {
        found.push(format!("response time at the critical instant: {first_job}"));
    }
    found
}
