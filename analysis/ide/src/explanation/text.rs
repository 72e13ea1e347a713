//! Prints the rows of an explanation as text, for a terminal.

use std::fmt::{Display, Write as _};

use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_hir::ModelDb;
use mauve_timing::task_set::TaskSet;
use mauve_timing::{Status, Time, Window};
use mauve_wcrt::{Query, Report, TableSet, psm_at};

use super::{Explanation, Origin, OwnTime, Released, SHOWN_PERIODS, Sum, with_facts};

const MOST_INTERFERENCE: usize = 100;

/// Explains the response time of the activity of `report`, the report with these timing tables, with that index; empty without
/// such an activity.
pub fn explain_response<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    report: &Report<'db>,
    activity: usize,
    query: Query,
) -> String {
    with_facts(db, tables, report, activity, query, print).unwrap_or_default()
}

/// [`explain_response`] for the report of a task set, which has neither programs nor codels.
pub fn explain_response_of<'db>(
    db: &'db dyn ModelDb,
    set: &TaskSet,
    report: &Report<'db>,
    activity: usize,
    query: Query,
) -> String {
    let psm = set.task.get(activity).and_then(|task| psm_at(set, task, query.level));
    let throttling = set.rt_throttling;
    let origin = Origin { throttling, clocks: &|_| None, psm: psm.as_ref(), worst_path: &|_| Vec::new() };
    let facts = Explanation::new(db, report, activity, query, &origin);
    facts.as_ref().map(print).unwrap_or_default()
}

fn print(facts: &Explanation<'_, '_>) -> String {
    let activity = facts.activity;
    let component = &activity.component_name;
    let component = if component.is_empty() { "component unknown" } else { component };
    let (level, method, of_which) = (facts.query.level, facts.method(), &facts.of_which);
    let mut out = format!("{} ({component}): ", activity.instance);
    if activity.verdict == Status::Background {
        return out + "background, not real-time, not analysed\n";
    }
    let time = |time: Option<Time>| time.map_or_else(|| "—".to_owned(), |time| time.to_string());
    let deadline = match activity.response.zip(activity.deadline) {
        Some((response, deadline)) => {
            out += &Forms::of(response, deadline, TIGHT_SLACK).full();
            String::new()
        }
        None => {
            let _ = write!(out, "{}, no response time", activity.verdict.name());
            format!("deadline {}, ", time(activity.deadline))
        }
    };
    let period = time(activity.period);
    let _ = write!(out, "\n  at {level}, method {method}{of_which}, {deadline}period {period}");
    out.extend(facts.released.iter().map(|released| format!(" ({released})")));
    if activity.jitter > Time::ZERO {
        let _ = write!(out, ", jitter {}", activity.jitter);
    }
    out.push('\n');
    for why in &facts.reasons {
        let _ = writeln!(out, "  reason: {}", why.text);
        if let Some((instance, text)) = &why.behind {
            let _ = writeln!(out, "    {instance}: {text}");
        }
    }
    out.extend(facts.notes.iter().map(|note| format!("  {note}\n")));
    out.extend(facts.busy_window().map(|sentence| format!("\n{sentence}\n")));
    let what = if activity.task.waits.is_some() { "execution time and waits" } else { "execution time" };
    let _ = match (&activity.window, &facts.sum) {
        (Some(window), _) if window.job > 1 => {
            writeln!(out, "{what} of its own {} jobs: {}", window.job, window.own)
        }
        (Some(Window { own, .. }), _) | (None, Some(Sum { own, .. })) => {
            writeln!(out, "\n{what} of its own job: {own}")
        }
        (None, None) => Ok(()),
    };
    if let Some(sum) = &facts.sum {
        out += &interference(facts, sum);
        if sum.at_once > Time::ZERO {
            let _ = writeln!(out, "executed on several CPUs at once: −{}", sum.at_once);
        }
        if sum.blocking > Time::ZERO {
            let _ = writeln!(out, "blocking by lower priorities that hold locks: {}", sum.blocking);
        }
        out += &release(facts, sum);
    }
    if let Some(crossed) = &facts.crossed {
        let (iteration, deadline, shown) = (crossed.iteration, crossed.deadline, &crossed.shown);
        let exceeds = format!("iteration {iteration} exceeds the deadline");
        let after = format!("{deadline} after the start of the busy window");
        let _ = writeln!(out, "\nfixed-point iterations: {exceeds} ({after})\n  {shown}");
    }
    if let Some(own) = &facts.own {
        out += &own_time(own);
    }
    out += &calls(facts);
    if let Some(first_job) = facts.critical {
        let _ = writeln!(out, "\nresponse time at the critical instant: {first_job}");
    }
    if let Some(trace) = &facts.trace {
        let total = trace.total.map_or_else(String::new, |sum| format!(", {sum} in total"));
        let periods = format!("its {SHOWN_PERIODS} consecutive periods");
        let _ = writeln!(out, "\n{periods} with the most interference for other activities{total}:");
        out.extend(trace.periods.iter().map(|it| match it.count {
            1 => row(it.time, &it.name),
            count => row(it.time, format!("{}  {count} times", it.name)),
        }));
    }
    out
}

fn row(time: Time, what: impl Display) -> String {
    format!("  {:>12}  {what}\n", time.to_string())
}

fn interference(facts: &Explanation<'_, '_>, sum: &Sum<'_>) -> String {
    let (shown, others, of_others) = sum.greatest(MOST_INTERFERENCE);
    if shown.is_empty() {
        return String::new();
    }
    let mut out = match (&facts.activity.window, facts.activity.first_job) {
        (None, Some(first_job)) => format!("interference until its first job ends after {first_job}:\n"),
        _ => "interference:\n".to_owned(),
    };
    out.extend(shown.into_iter().map(|it| {
        let counted = if it.count == 1 { "job" } else { "jobs" };
        let assumed = if it.is_assumed { "  (with assumed times)" } else { "" };
        row(it.time, format!("{:>4} {counted:<4}  {}{}{assumed}", it.count, it.name, it.noted()))
    }));
    if others > 0 {
        out += &row(of_others, format!("of {others} more activities, none with more interference"));
    }
    out
}

/// Prints how the response time follows from the length of the window, where it is not that length.
fn release(facts: &Explanation<'_, '_>, sum: &Sum<'_>) -> String {
    let (Some(window), Some(response)) = (&facts.activity.window, facts.activity.response) else {
        return String::new();
    };
    let (sign, between, when) = match sum.released {
        Released::AtStart => return String::new(),
        Released::After(between) => ('−', between, "after"),
        Released::Before(between) => ('+', between, "before"),
    };
    let job = if window.job == 1 { "its job".to_owned() } else { format!("job {}", window.job) };
    let released = format!("{job} is nominally released {between} {when} the start of the window");
    format!("\nresponse time {response} = {} {sign} {between}: {released}\n", window.length)
}

/// Prints the greatest execution time of a period by programs and codels, or the timing table's time for the component.
fn own_time(own: &OwnTime<'_>) -> String {
    let (of_programs, period) = (own.of_programs, &own.period);
    let mut out = match own.of_component {
        Some(time) => {
            let origin = "from the timing table's entry for the component";
            format!("\nexecution time {time}, {origin}; sum of its codels {of_programs}: {period}\n")
        }
        None if own.wait > Time::ZERO => format!("\nexecution time and waits {of_programs}: {period}\n"),
        None => format!("\nexecution time {of_programs}: {period}\n"),
    };
    for (program, codels) in &own.programs {
        out += &row(program.time, &program.name);
        for it in codels {
            let assumed = if it.is_assumed { "  (assumed: in no timing table)" } else { "" };
            let _ = writeln!(out, "  {:>12}    {:>10}  {}{assumed}", "", it.time.to_string(), it.name);
        }
    }
    out.extend(own.others().map(|(time, what)| row(time, what)));
    out
}

/// Prints the calls that each job executes for other activities.
fn calls(facts: &Explanation<'_, '_>) -> String {
    let calls = &facts.activity.calls;
    let total = calls.iter().try_fold(Time::ZERO, |sum, it| sum.checked_add(it.time));
    let total = total.filter(|total| *total > Time::ZERO);
    let mut out = total
        .map_or_else(String::new, |total| format!("\nexecution time of calls in each period: {total}\n"));
    out.extend(calls.iter().map(|it| {
        let counted = if it.calls == 1 { "call" } else { "calls" };
        row(it.time, format!("{:>4} {counted:<5}  {} for {}", it.calls, it.operation, it.client))
    }));
    out
}
