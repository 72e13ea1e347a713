//! A recording beside its model, for people.

use std::fmt::Write as _;

use mauve_timing::Priority;
use mauve_wcrt::observed::{EdgeCount, ExpectedInstance, IMPROBABLE, ObservedInstance, ObservedTime};

use super::checked::Checked;
use super::findings::{message, number};
use crate::cli::text::{columns, counted, duration};

/// The names in a list of what was not observed.
const MOST_NAMES: usize = 8;

pub(super) fn text(it: &Checked<'_>) -> String {
    let mut out = String::new();
    let length = it.summary.last.zip(it.summary.first).map(|(last, first)| last.saturating_sub(first));
    let length = length.map_or_else(String::new, |length| format!(" of {}", duration(length)));
    let _ = writeln!(out, "{}: a recording{length} beside the model at {}, times in ms", it.name, it.level);
    let header = [
        "instance",
        "periods",
        "every",
        "period",
        "response",
        "bound",
        "of bound",
        "jitter",
        "execution",
        "greatest",
        "",
    ];
    let rows: Vec<Vec<String>> =
        rows(it).map(|(index, expected, observed)| cells(it, index, expected, observed)).collect();
    out += &columns(&header, &rows);
    out += "  every, response, jitter, execution: observed; period, bound and the greatest execution of a period: model\n";
    out.push('\n');
    let header = ["codel or program", "executions", "above", "expected", "longest", "time", ""];
    let rows: Vec<Vec<String>> = it.observed.times.iter().map(|time| times(it, time)).collect();
    if !rows.is_empty() {
        out += &columns(&header, &rows);
        out.push('\n');
    }
    for finding in &it.observed.findings {
        let _ = writeln!(out, "  ✗ {}", message(it, finding));
    }
    match it.observed.findings.len() {
        0 if !it.observed.has_periods => {
            out += "  ✓ no execution contradicts the model; periods are not compared\n";
        }
        0 => out += "  ✓ nothing in the recording contradicts the model\n",
        count => {
            let _ = writeln!(out, "  {}", counted(count, "finding"));
        }
    }
    notes(it).iter().for_each(|note| out += &format!("  note: {note}\n"));
    out
}

fn rows<'a>(
    it: &'a Checked<'_>,
) -> impl Iterator<Item = (usize, &'a ExpectedInstance, &'a ObservedInstance)> {
    it.expected
        .instances
        .iter()
        .zip(&it.observed.instances)
        .enumerate()
        .map(|(index, (one, other))| (index, one, other))
}

fn cells(
    it: &Checked<'_>,
    index: usize,
    expected: &ExpectedInstance,
    observed: &ObservedInstance,
) -> Vec<String> {
    let none = || "—".to_owned();
    let ms = |time: Option<u64>| time.map_or_else(none, milliseconds);
    let response = observed.response.map(|it| it.time);
    let ratio = response.zip(expected.response.filter(|bound| *bound > 0));
    vec![
        expected.instance.clone(),
        observed.periods.to_string(),
        ms(observed.interval),
        ms(expected.period),
        ms(response),
        ms(expected.response),
        ratio.map_or_else(none, |(response, bound)| {
            format!("{:.1} %", 100.0 * response as f64 / bound as f64)
        }),
        ms(observed.jitter),
        ms(observed.execution.map(|it| it.time)),
        ms(expected.own),
        verdict(it, index, observed),
    ]
}

fn verdict(it: &Checked<'_>, index: usize, observed: &ObservedInstance) -> String {
    let findings = it.observed.findings.iter().filter(|finding| finding.instance == Some(index)).count();
    match findings {
        _ if !observed.is_observed => "not observed".to_owned(),
        0 if observed.periods == 0 => "codels only".to_owned(),
        0 => "✓ as modelled".to_owned(),
        count => format!("✗ {}", counted(count, "finding")),
    }
}

fn times(it: &Checked<'_>, time: &ObservedTime) -> Vec<String> {
    let none = || "—".to_owned();
    let verdict = match (time.executions, time.time, time.exceeded) {
        (0, ..) => "not observed".to_owned(),
        (_, None, _) => "no time in the tables".to_owned(),
        _ if let Some(worst) = time.worst.filter(|it| it.probability < IMPROBABLE) => {
            format!("✗ too often at {:e}", worst.level)
        }
        (_, _, 0) => "✓".to_owned(),
        _ => "✓ as often as expected".to_owned(),
    };
    vec![
        time.key.clone(),
        time.executions.to_string(),
        time.time.map_or_else(none, |_| time.exceeded.to_string()),
        time.time.map_or_else(none, |_| number(time.executions as f64 * it.expected.level)),
        time.greatest.map_or_else(none, |it| milliseconds(it.time)),
        time.time.map_or_else(none, milliseconds),
        verdict,
    ]
}

/// What the recording does not show.
fn notes(it: &Checked<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    let observed = &it.observed;
    if !observed.has_periods {
        notes.push(
            "periods are not in the trace: response times, activations, priorities and CPUs are not compared"
                .to_owned(),
        );
    } else if !observed.has_releases {
        notes.push(
            "releases are not in the trace: response times and jitter are those with the latest releases that agree with it, and \
             the true ones may be greater"
                .to_owned(),
        );
    }
    if observed.has_periods && !observed.has_scheduling {
        notes.push(
            "priorities and CPUs of threads are not in the trace: generate and build the packages again to record them".to_owned(),
        );
    }
    if !observed.has_programs {
        notes.push("programs are not in the trace: states and transitions are not compared".to_owned());
    }
    if !observed.has_instances {
        notes.push("instances are not in the trace: only codels and programs are compared".to_owned());
    }
    if it.summary.is_from_tables {
        notes.push(
            "the execution times are those of the timing tables that the program was built with, and were not measured"
                .to_owned(),
        );
    }
    let missing = it.summary.dropped + it.summary.unbalanced + it.summary.clock_errors;
    if it.summary.losses > 0 || missing > 0 {
        notes.push(format!(
            "the recording has gaps: {} events discarded, {missing} incomplete executions; nothing is compared across them",
            it.summary.lost_events
        ));
    }
    for (index, expected, observed) in rows(it) {
        let name = &expected.instance;
        if expected.priority == Priority::Background && observed.periods > 0 {
            notes.push(format!("`{name}` runs in the background: its response times are not compared"));
        }
        if observed.pauses > 0 {
            let first = observed.first_pause.map_or(0, |at| it.since_begin(at));
            let times =
                if observed.pauses == 1 { "once".to_owned() } else { format!("{} times", observed.pauses) };
            notes.push(format!(
                "`{name}` paused {times}, until {} after the begin the first time: it was stopped and started, or did not run",
                duration(first)
            ));
        }
        if !observed.is_observed {
            continue;
        }
        if let Some(not_observed) = coverage(it, index, observed) {
            notes.push(format!("`{name}`: not observed: {not_observed}"));
        }
    }
    if it.observed.times.iter().any(|time| time.greatest.is_none())
        && !it.observed.has_programs
        && !it.observed.has_periods
    {
        notes.push("what was not executed, the recording says nothing about".to_owned());
    }
    notes
}

/// What of an instance was never executed.
fn coverage(it: &Checked<'_>, index: usize, observed: &ObservedInstance) -> Option<String> {
    let expected = it.expected.instances.get(index)?;
    let mut parts = Vec::new();
    if let Some(machine) = expected.machine.as_ref().filter(|_| !observed.edges.is_empty()) {
        let edges = machine.edges.all.iter().zip(&observed.edges);
        let name = |state: usize| machine.states.get(state).map_or("", String::as_str);
        let was_left = |state: usize, count: &EdgeCount| count.possible > 0 && state < machine.states.len();
        let is_seen = |state: usize| {
            edges
                .clone()
                .any(|(edge, count)| was_left(state, count) && (edge.source == state || edge.target == state))
        };
        let states: Vec<String> = (0..machine.states.len())
            .filter(|state| !is_seen(*state))
            .map(|state| format!("`{}`", name(state)))
            .collect();
        if !states.is_empty() {
            parts.push(format!("{} {}", if states.len() == 1 { "state" } else { "states" }, listed(&states)));
        }
        let missing: Vec<String> = edges
            .clone()
            .filter(|(edge, count)| count.possible == 0 && is_seen(edge.source))
            .map(|(edge, _)| match &edge.transition {
                Some(transition) => format!("`{}.{transition}`", name(edge.source)),
                None => format!("staying in `{}`", name(edge.source)),
            })
            .collect();
        if !missing.is_empty() {
            let what = if missing.len() == 1 { "transition" } else { "transitions" };
            parts.push(format!("{what} {}", listed(&missing)));
        }
        let unclear = edges.filter(|(_, count)| count.observed == 0 && count.possible > 0).count();
        if unclear > 0 {
            parts.push(format!(
                "{} may have been taken: others execute the same programs",
                periods_of_edges(unclear)
            ));
        }
    }
    let codels: Vec<String> = observed.codels_not_observed.iter().map(|codel| format!("`{codel}`")).collect();
    if !codels.is_empty() {
        parts.push(format!("{} {}", if codels.len() == 1 { "codel" } else { "codels" }, listed(&codels)));
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

fn periods_of_edges(count: usize) -> String {
    counted(count, "transition")
}

fn listed(names: &[String]) -> String {
    match names.len().checked_sub(MOST_NAMES) {
        Some(rest) if rest > 0 => {
            format!("{} and {rest} others", names.get(..MOST_NAMES).unwrap_or_default().join(", "))
        }
        _ => names.join(", "),
    }
}

fn milliseconds(time: u64) -> String {
    format!("{:.3}", time as f64 / 1e6)
}
