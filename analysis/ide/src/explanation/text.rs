//! Writes the explanation of a response time as text, for a terminal.

use std::fmt::Write as _;

use mauve_hir::ModelDb;
use mauve_timing::task_set::TaskSet;
use mauve_timing::{Time, Window};
use mauve_wcrt::{Query, Report, TableSet, Verdict, psm_at};

use super::{Crossed, Explanation, Origin, OwnTime, Release, SHOWN_PERIODS, Sum, Trace, with_facts};

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
    with_facts(db, tables, report, activity, query, write).unwrap_or_default()
}

/// [`explain_response`] for the report of a task set, which has programs but not the codels that they call.
pub fn explain_response_of<'db>(
    db: &'db dyn ModelDb,
    set: &TaskSet,
    report: &Report<'db>,
    activity: usize,
    query: Query,
) -> String {
    let machine = set.activities.get(activity).and_then(|activity| activity.machine.as_ref());
    let psm = machine.zip(set.column(query.level)).and_then(|(machine, column)| psm_at(machine, column));
    let throttling = set.rt_throttling;
    let origin = Origin { throttling, psm: psm.as_ref(), worst_path: &|_| Vec::new() };
    let facts = Explanation::new(db, report, activity, query, &origin);
    facts.as_ref().map(write).unwrap_or_default()
}

fn write(facts: &Explanation<'_, '_>) -> String {
    let mut out = String::new();
    let activity = facts.activity;
    let time = |time: Option<Time>| time.map_or_else(|| "—".to_owned(), |time| time.to_string());
    let _ = writeln!(
        out,
        "{} ({}) at {}, method {}{}",
        activity.instance,
        if activity.component_name.is_empty() { "component unknown" } else { &activity.component_name },
        facts.query.level,
        facts.method(),
        facts.of_which
    );
    if activity.verdict == Verdict::Background {
        return out + "  background: not real-time, not analysed\n";
    }
    let jitter = match activity.jitter {
        Time::ZERO => String::new(),
        jitter => format!(", jitter {jitter}"),
    };
    let _ = writeln!(
        out,
        "  {}: response time {}, deadline {}, period {}{jitter}",
        activity.verdict.name(),
        time(activity.response),
        time(activity.deadline),
        time(activity.period)
    );
    for why in &facts.reasons {
        let _ = writeln!(out, "  reason: {}", why.text);
        if let Some((instance, text)) = &why.behind {
            let _ = writeln!(out, "    {instance}: {text}");
        }
    }
    for note in &facts.notes {
        let _ = writeln!(out, "  {note}");
    }
    if let Some(window) = activity.window.as_ref() {
        write_window(&mut out, window);
    }
    if let Some(sum) = &facts.sum {
        write_interference(&mut out, sum);
        write_release(&mut out, sum, activity.response);
    }
    if let Some(crossed) = &facts.crossed {
        write_crossed(&mut out, crossed);
    }
    if let Some(own) = &facts.own {
        write_own(&mut out, own);
    }
    write_calls(&mut out, facts);
    if let Some(first_job) = facts.critical {
        let _ = writeln!(out, "\nresponse time at the critical instant: {first_job}");
        if facts.query.horizon.is_some() {
            out +=
                "  (with --horizon, traces end at the horizon: for comparison only, this is not a bound)\n";
        }
    }
    if let Some(trace) = &facts.trace {
        write_trace(&mut out, trace);
    }
    out
}

fn write_window(out: &mut String, window: &Window) {
    if let Some(start) = window.start {
        let _ = writeln!(
            out,
            "\nthe busy window begins {start} after the instant that the synchronised clocks share"
        );
    }
    let _ = match window.job {
        1 => writeln!(out, "\nexecution time of its own job: {}", window.own),
        job => writeln!(
            out,
            "\njob {job} of the busy window has the largest response time: it ends {} after the start of the window\n\
             execution time of its own {job} jobs: {}",
            window.length, window.own
        ),
    };
}

fn write_interference(out: &mut String, sum: &Sum<'_, '_>) {
    let (shown, others, of_others) = sum.greatest(MOST_INTERFERENCE);
    if shown.is_empty() {
        return;
    }
    *out += match sum.window {
        Some(_) => "interference:\n",
        None => "\ninterference until its first job ends:\n",
    };
    for (of, jobs, time) in shown {
        let counted = if *jobs == 1 { "job" } else { "jobs" };
        let assumed = if of.is_assumed { "  (with assumed times)" } else { "" };
        let time = time.to_string();
        let _ = writeln!(out, "  {time:>12}  {jobs:>4} {counted:<4}  {}{assumed}", of.name);
    }
    if others > 0 {
        let time = of_others.to_string();
        let _ = writeln!(out, "  {time:>12}  of {others} more activities, none with more interference");
    }
}

/// Writes how the response time follows from the length of the window, where it is not that length.
fn write_release(out: &mut String, sum: &Sum<'_, '_>, response: Option<Time>) {
    let (Some(window), Some(response)) = (sum.window, response) else { return };
    let (sign, between, when) = match sum.release {
        Release::AtStart => return,
        Release::After(between) => ('−', between, "after"),
        Release::Before(between) => ('+', between, "before"),
    };
    let job = match window.job {
        1 => "its job".to_owned(),
        job => format!("job {job}"),
    };
    let _ = writeln!(
        out,
        "\nresponse time {response} = {} {sign} {between}: {job} is nominally released {between} {when} the start of the window",
        window.length
    );
}

fn write_crossed(out: &mut String, Crossed { iteration, deadline, shown }: &Crossed) {
    let _ = writeln!(
        out,
        "\nfixed-point iterations: iteration {iteration} exceeds the deadline ({deadline} after the start of the busy window)\n  \
         {shown}"
    );
}

/// Writes the greatest execution time of a period by programs and codels, or the timing table's time for the component.
fn write_own(out: &mut String, own: &OwnTime) {
    let OwnTime { of_programs, period, .. } = own;
    let _ = match own.of_component {
        Some(time) => writeln!(
            out,
            "\nexecution time {time}, from the timing table's entry for the component; sum of its codels {of_programs}: {period}"
        ),
        None => writeln!(out, "\nexecution time {of_programs}: {period}"),
    };
    for (program, time, codels) in &own.programs {
        let _ = writeln!(out, "  {:>12}  {program}", time.to_string());
        for it in codels {
            let assumed = if it.is_assumed { "  (assumed: in no timing table)" } else { "" };
            let _ = writeln!(out, "  {:>12}    {:>10}  {}{assumed}", "", it.time.to_string(), it.codel);
        }
    }
    if own.overhead > Time::ZERO {
        let _ = writeln!(out, "  {:>12}  dispatch and context switches", own.overhead.to_string());
    }
}

/// Writes the calls that each job executes for other activities.
fn write_calls(out: &mut String, facts: &Explanation<'_, '_>) {
    let calls = &facts.activity.calls;
    let total = calls.iter().try_fold(Time::ZERO, |sum, it| sum.checked_add(it.time));
    if let Some(total) = total.filter(|total| *total > Time::ZERO) {
        let _ = writeln!(out, "\nexecution time of calls in each period: {total}");
    }
    for it in calls {
        let counted = if it.calls == 1 { "call" } else { "calls" };
        let _ = writeln!(
            out,
            "  {:>12}  {:>4} {counted:<5}  {} for {}",
            it.time.to_string(),
            it.calls,
            it.operation,
            it.client
        );
    }
}

/// Writes the consecutive periods with the greatest total execution time.
fn write_trace(out: &mut String, trace: &Trace) {
    let total = trace.total.map_or_else(String::new, |sum| format!(", {sum} in total"));
    let _ = writeln!(
        out,
        "\nits {SHOWN_PERIODS} consecutive periods with the most interference for other activities{total}:"
    );
    for (states, time, count) in &trace.periods {
        let times = if *count == 1 { String::new() } else { format!("  {count} times") };
        let _ = writeln!(out, "  {:>12}  {states}{times}", time.to_string());
    }
}
