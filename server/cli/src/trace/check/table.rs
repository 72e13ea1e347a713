//! A recording beside its model, for people.

use std::fmt::Write as _;

use mauve_timing::{LEAST_WORK, Priority};
use mauve_wcrt::observed::{EdgeCount, ExpectedInstance, IMPROBABLE, ObservedInstance, ObservedTime};

use super::super::import::messages::{cut, work_elsewhere};
use super::super::import::shown_key;
use super::checked::Checked;
use super::findings::{message, number};
use crate::text::{Sheet, counted, duration, wrapped};

/// The names in a list of what was not observed.
const MOST_NAMES: usize = 8;

pub(super) fn text(it: &Checked<'_>) -> String {
    let mut out = String::new();
    let length = it.summary.last.zip(it.summary.first).map(|(last, first)| last.saturating_sub(first));
    let length = length.map_or_else(String::new, |length| format!(" of {}", duration(length)));
    let _ = writeln!(out, "{}: a recording{length} beside the model at {}, times in ms", it.name, it.level);
    let ms = |time: Option<u64>| time.map_or_else(none, milliseconds);
    let rows: Vec<CheckedRow<'_>> = rows(it).collect();
    out += &Sheet::of(&rows)
        .column("instance", |(_, model, _)| model.instance.clone())
        .column("periods", |(.., seen)| seen.periods.to_string())
        .column("every", |(.., seen)| ms(seen.interval))
        .column("period", |(_, model, _)| ms(model.period))
        .column("response", |(.., seen)| ms(seen.response.map(|it| it.time)))
        .column("bound", |(_, model, _)| ms(model.response))
        .column("of bound", |(_, model, seen)| share(seen.response.map(|it| it.time), model.response))
        .column("jitter", |(.., seen)| ms(seen.jitter))
        .column("execution", |(.., seen)| ms(seen.execution.map(|it| it.time)))
        .column("greatest", |(_, model, _)| ms(model.own))
        .column("", |row| verdict(it, row))
        .text();
    out += "  every, response, jitter, execution: observed; period, bound and the greatest execution of a period: model\n";
    out.push('\n');
    // What no table has is compared with nothing.
    let compared = |of: &ObservedTime, cell: String| of.time.map_or_else(none, |_| cell);
    if !it.observed.times.is_empty() {
        out += &Sheet::of(&it.observed.times)
            .column("codel or program", |of| shown_key(&of.key))
            .column("executions", |of| of.executions.to_string())
            .column("above", |of| compared(of, of.exceeded.to_string()))
            .column("expected", |of| compared(of, number(of.executions as f64 * it.expected.level)))
            .column("longest", |of| ms(of.greatest.map(|it| it.time)))
            .column("time", |of| ms(of.time))
            .column("", verdict_of_time)
            .text();
        out.push('\n');
    }
    let chains: Vec<_> = it.expected.chains.iter().zip(&it.observed.chains).collect();
    if !chains.is_empty() {
        out += &Sheet::of(&chains)
            .column("chain", |(model, _)| model.name.clone())
            .column("latency", |(_, seen)| ms(seen.greatest.map(|it| it.time)))
            .column("bound", |(model, _)| ms(model.bound))
            .column("of bound", |(model, seen)| share(seen.greatest.map(|it| it.time), model.bound))
            .column("limit", |(model, _)| ms(model.limit))
            .column("at", |(_, seen)| ms(seen.greatest.and_then(|at| Some(it.since_begin(at.at?)))))
            .text();
        out += "  latency: observed, the greatest time from a change to its effect, at least; at: its end, since the begin\n\n";
    }
    for finding in &it.observed.findings {
        let _ = writeln!(out, "  ✗ {}", message(it, finding));
    }
    match it.observed.findings.len() {
        0 if !it.observed.has_periods => {
            let unseen = it.observed.times.iter().filter(|time| time.executions == 0).count();
            let unseen = match unseen {
                0 => String::new(),
                unseen => {
                    format!("{unseen} of {} were never observed, ", counted(it.observed.times.len(), "codel"))
                }
            };
            let _ = writeln!(out, "  ✓ no execution contradicts the model; {unseen}periods are not compared");
        }
        0 => out += "  ✓ nothing in the recording contradicts the model\n",
        count => {
            let _ = writeln!(out, "  {}", counted(count, "finding"));
        }
    }
    notes(it).iter().for_each(|note| out += &format!("  note: {note}\n"));
    wrapped(&out)
}

/// An instance: its index, what the model says of it, and what was observed.
type CheckedRow<'a> = (usize, &'a ExpectedInstance, &'a ObservedInstance);

fn rows<'a>(it: &'a Checked<'_>) -> impl Iterator<Item = CheckedRow<'a>> {
    let both = it.expected.instances.iter().zip(&it.observed.instances).enumerate();
    both.map(|(index, (model, seen))| (index, model, seen))
}

fn none() -> String {
    "—".to_owned()
}

fn share(observed: Option<u64>, bound: Option<u64>) -> String {
    let ratio = observed.zip(bound.filter(|bound| *bound > 0));
    ratio.map_or_else(none, |(observed, bound)| format!("{:.1} %", 100.0 * observed as f64 / bound as f64))
}

fn verdict(it: &Checked<'_>, (index, _, observed): &CheckedRow<'_>) -> String {
    let findings = it.observed.findings.iter().filter(|finding| finding.instance == Some(*index)).count();
    match findings {
        _ if !observed.is_observed => "not observed".to_owned(),
        0 if observed.periods == 0 => "codels only".to_owned(),
        0 => "✓ as modelled".to_owned(),
        count => format!("✗ {}", counted(count, "finding")),
    }
}

fn verdict_of_time(time: &ObservedTime) -> String {
    match (time.executions, time.time, time.exceeded) {
        (0, ..) => "not observed".to_owned(),
        (_, None, _) => "no time in the tables".to_owned(),
        _ if let Some(worst) = time.worst.filter(|it| it.probability < IMPROBABLE) => {
            format!("✗ too often at {:e}", worst.level)
        }
        (_, _, 0) => "✓".to_owned(),
        _ => "✓ as often as expected".to_owned(),
    }
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
            "not all releases are in the trace: response times and jitter are those with the latest releases that agree with it, and \
             the true ones may be greater"
                .to_owned(),
        );
    }
    if observed.has_periods && !observed.has_scheduling {
        notes.push(
            "priorities and CPUs of threads are not in the trace: to record them, generate and build the packages again, or of ROS 2, \
             record the events sched_switch"
                .to_owned(),
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
    notes.extend(cut("the recording", &it.summary));
    let missing = it.summary.dropped + it.summary.unbalanced + it.summary.clock_errors;
    if it.summary.losses > 0 || missing > 0 {
        notes.push(format!(
            "the recording has gaps: {} events discarded, {missing} incomplete executions; nothing is compared across them",
            it.summary.lost_events
        ));
    }
    for (thread, per_second) in it.observed.work.iter().filter(|(_, time)| **time >= LEAST_WORK) {
        notes.push(work_elsewhere(thread, *per_second));
    }
    for (connection, seen) in it.expected.connections.iter().zip(&it.observed.connections) {
        if seen.unread > 0 {
            let how =
                if connection.buffer.is_some() { "dropped from the full buffer" } else { "overwritten" };
            notes.push(format!(
                "{} of {} values on {} were {how} before they were read",
                seen.unread, seen.written, connection.name
            ));
        }
    }
    for (_, expected, observed) in rows(it) {
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
        if let Some(not_observed) = coverage(expected, observed) {
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
fn coverage(expected: &ExpectedInstance, observed: &ObservedInstance) -> Option<String> {
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
            parts.push(listed("state", &states));
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
            parts.push(listed("transition", &missing));
        }
        let unclear = edges.filter(|(_, count)| count.observed == 0 && count.possible > 0).count();
        if unclear > 0 {
            parts.push(format!(
                "{} may have been taken: others execute the same programs",
                counted(unclear, "transition")
            ));
        }
    }
    let codels: Vec<String> = observed.codels_not_observed.iter().map(|codel| format!("`{codel}`")).collect();
    if !codels.is_empty() {
        parts.push(listed("codel", &codels));
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Returns names of one kind: `state a`, `codels a, b`.
fn listed(what: &str, names: &[String]) -> String {
    let ending = if names.len() == 1 { "" } else { "s" };
    let shown = names.get(..MOST_NAMES.min(names.len())).unwrap_or_default().join(", ");
    let others = match names.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        rest => format!(" and {rest} others"),
    };
    format!("{what}{ending} {shown}{others}")
}

fn milliseconds(time: u64) -> String {
    format!("{:.3}", time as f64 / 1e6)
}
