//! Explains a response time in text: execution time, interference, and the iteration that exceeds the deadline.

use std::fmt::Write as _;

use mauve_diagnostics::{cpu_names, times_of, timing_reason};
use mauve_hir::{ModelDb, config_of};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{CpuRule, Method, Status, Time, worst_trace};
use mauve_wcrt::{
    ActivityReport, Priority, Psm, Query, Reason, Report, TableSet, Verdict, psm_at, psm_of, worst_path,
};
use rustc_hash::FxHashSet;

const SHOWN_PERIODS: usize = 12;

const MOST_INTERFERENCE: usize = 100;

const SHOWN_ITERATIONS: usize = 12;

/// Explains the response time of the activity of `report`, the report with these timing tables, with that index; empty without
/// such an activity.
pub fn explain_response<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    report: &Report<'db>,
    activity: usize,
    query: Query,
) -> String {
    let component = report.activities.get(activity).and_then(|activity| activity.component);
    let psm = component.and_then(|component| psm_of(db, tables, component, query.level).as_ref().ok());
    let path = |program: usize| {
        component.map_or_else(Vec::new, |of| worst_path(db, tables, of, query.level, program))
    };
    let throttling = config_of(db, tables.project(db).workspace(db)).rt_throttling;
    explain(db, report, activity, query, &Origin { throttling, psm, worst_path: &path })
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
    explain(db, report, activity, query, &origin)
}

struct Origin<'a> {
    /// Whether real-time throttling is on, if `mauve.toml` says so.
    throttling: Option<bool>,
    psm: Option<&'a Psm<'a>>,
    /// The codels of a program along its worst path, with their times; by its index in the state machine.
    worst_path: &'a dyn Fn(usize) -> Vec<(String, Time)>,
}

fn explain<'db>(
    db: &'db dyn ModelDb,
    report: &Report<'db>,
    index: usize,
    query: Query,
    origin: &Origin<'_>,
) -> String {
    let mut out = String::new();
    let Some(activity) = report.activities.get(index) else { return out };
    let time = |time: Option<Time>| time.map_or_else(|| "—".to_owned(), |time| time.to_string());
    let method = activity.method.map_or(query.method, |(method, _)| method);
    let _ = writeln!(
        out,
        "{} ({}) at {}, method {method}{}",
        activity.instance,
        activity.component_name,
        query.level,
        times_of(report.times.as_deref())
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
    if activity.method.is_some_and(|(_, is_exhausted)| is_exhausted) {
        out += "  the budget of a better method is exhausted: the response time may be shorter\n";
    }
    if let Some(counted) = counted_cpus(report, activity) {
        let _ = writeln!(out, "  {counted}");
    }
    why_not_analysed(&mut out, db, report, activity);
    let is_analysed = activity.verdict != Verdict::RealTime(Status::NotAnalysed);
    if is_analysed && origin.throttling.is_none() {
        out += "  assumes real-time throttling off\n";
    }
    if activity.window.as_ref().is_some_and(|window| window.start.is_some()) {
        out += "  assumes synchronised clocks\n";
    }
    window(&mut out, activity);
    interference(&mut out, db, report, index);
    response_in_window(&mut out, activity);
    crossed_deadline(&mut out, activity);
    if let Some(psm) = origin.psm {
        own_time(&mut out, psm, query.method, origin.worst_path);
    }
    calls(&mut out, activity);
    let is_critical =
        activity.jitter == Time::ZERO && activity.window.as_ref().is_none_or(|window| window.start.is_none());
    if let Some(first_job) = activity.first_job.filter(|_| is_critical) {
        let _ = writeln!(out, "\nresponse time at the critical instant: {first_job}");
        if query.horizon.is_some() {
            out +=
                "  (with --horizon, traces end at the horizon: for comparison only, this is not a bound)\n";
        }
    }
    // In the classic method, every job has the greatest execution time.
    let delays = |other: &ActivityReport<'_>| {
        let is_not_higher = match (activity.priority, other.priority) {
            (Priority::RealTime(own), Priority::RealTime(other)) => own >= other,
            _ => false,
        };
        let (own, others) = (activity.cpus.unwrap_or(u64::MAX), other.cpus.unwrap_or(u64::MAX));
        !std::ptr::eq(other, activity) && is_not_higher && own & others != 0
    };
    let psm = origin.psm.filter(|psm| query.method != Method::Classic && psm.states.len() > 1);
    if let Some(psm) = psm.filter(|_| report.activities.iter().any(delays)) {
        trace(&mut out, psm);
    }
    out
}

fn why_not_analysed<'db>(
    out: &mut String,
    db: &'db dyn ModelDb,
    report: &Report<'db>,
    activity: &ActivityReport<'db>,
) {
    let mut seen = FxHashSet::default();
    for reason in &activity.reasons {
        let why = timing_reason(db, &reason.reason);
        if !seen.insert(why.clone()) {
            continue;
        }
        let _ = writeln!(out, "  reason: {why}");
        // The first activity that may delay it and is not analysed itself.
        let mut others = report.activities.iter().filter(|other| other.instance != activity.instance);
        let other = match reason.reason {
            Reason::DelayedBy { first, .. } => report.activities.get(first),
            _ => others.find(|other| other.at.is_some() && other.at == reason.at),
        };
        if let Some(other) = other
            && let Some(why) = other.reasons.first()
        {
            let _ = writeln!(out, "    {}: {}", other.instance, timing_reason(db, &why.reason));
        }
    }
}

/// Returns which activities are counted in the response time of one, unless these are just those of its only CPU.
pub fn counted_cpus(report: &Report<'_>, activity: &ActivityReport<'_>) -> Option<String> {
    let several = |it: &ActivityReport<'_>, mask: u64| {
        let may_leave = it.cpus.is_some_and(|cpus| cpus & mask != 0 && cpus.count_ones() > 1);
        let is_counted = match (it.priority, activity.priority) {
            (Priority::RealTime(other), Priority::RealTime(own)) => other >= own,
            (Priority::Background, _) => false,
            (Priority::Unknown, _) | (Priority::RealTime(_), _) => true,
        };
        is_counted && may_leave
    };
    match activity.rule? {
        rule @ CpuRule::Cpu(_) if report.activities.iter().any(|it| several(it, rule.mask())) => {
            let of = if activity.cpus == Some(rule.mask()) { "" } else { ", the best one of its CPUs" };
            let cpu = cpu_names(rule.mask());
            Some(format!("on {cpu}{of}, with all activities of higher or equal priority that may run there"))
        }
        CpuRule::Cpu(_) => None,
        rule @ CpuRule::Linked(_) => Some(format!(
            "on {} as if they were one CPU: activities have different affinities with several CPUs there",
            cpu_names(rule.mask())
        )),
    }
}

/// Writes the calls that each job executes for other activities.
fn calls(out: &mut String, activity: &ActivityReport<'_>) {
    let total = activity.calls.iter().try_fold(Time::ZERO, |sum, it| sum.checked_add(it.time));
    if let Some(total) = total.filter(|total| *total > Time::ZERO) {
        let _ = writeln!(out, "\nexecution time of calls in each period: {total}");
    }
    for it in &activity.calls {
        let calls = if it.calls == 1 { "call" } else { "calls" };
        let _ = writeln!(
            out,
            "  {:>12}  {:>4} {calls:<5}  {} for {}",
            it.time.to_string(),
            it.calls,
            it.operation,
            it.client
        );
    }
}

fn window(out: &mut String, activity: &ActivityReport<'_>) {
    if let Some(window) = &activity.window
        && let Some(start) = window.start
    {
        let _ = writeln!(
            out,
            "\nthe busy window begins {start} after the instant that the synchronised clocks share"
        );
    }
    match &activity.window {
        Some(window) if window.job > 1 => {
            let _ = writeln!(
                out,
                "\njob {job} of the busy window has the largest response time: it ends {} after the start of the window\n\
                 execution time of its own {job} jobs: {}",
                window.length,
                window.own,
                job = window.job
            );
        }
        Some(window) => {
            let _ = writeln!(out, "\nexecution time of its own job: {}", window.own);
        }
        None => {}
    }
}

fn interference(out: &mut String, db: &dyn ModelDb, report: &Report<'_>, index: usize) {
    let Some(activity) = report.activities.get(index) else { return };
    let interrupt = || db.unwind_if_revision_cancelled();
    let (shown, left) = report.breakdown(&interrupt).greatest_of(index, MOST_INTERFERENCE);
    if shown.is_empty() {
        return;
    }
    *out += match activity.window {
        Some(_) => "interference:\n",
        None => "\ninterference until its first job ends:\n",
    };
    for it in shown {
        let jobs = if it.jobs == 1 { "job" } else { "jobs" };
        let mut others = report.activities.iter().filter(|other| other.instance == it.instance);
        let is_assumed = others.any(|other| !other.assumed.is_empty());
        let assumed = if is_assumed { "  (with assumed times)" } else { "" };
        let time = it.time.to_string();
        let _ = writeln!(out, "  {time:>12}  {:>4} {jobs:<4}  {}{assumed}", it.jobs, it.instance);
    }
    if left > 0 {
        let _ = writeln!(out, "  and {left} more activities, none with more interference");
    }
}

/// Writes how the response time follows from the length of the window, where it is not that length.
fn response_in_window(out: &mut String, activity: &ActivityReport<'_>) {
    let (Some(window), Some(period), Some(response)) = (&activity.window, activity.period, activity.response)
    else {
        return;
    };
    let job = match window.job {
        1 => "its job".to_owned(),
        job => format!("job {job}"),
    };
    // The nominal release is at delay − J + (q − 1)·T.
    let released = period.checked_mul(window.job - 1).and_then(|at| at.checked_add(window.delay));
    let (sign, between, when) = match released.and_then(|it| it.checked_sub(activity.jitter)) {
        Some(Time::ZERO) => return,
        Some(after) => ('−', Some(after), "after"),
        None => ('+', released.and_then(|it| activity.jitter.checked_sub(it)), "before"),
    };
    if let Some(between) = between {
        let length = window.length;
        let _ = writeln!(
            out,
            "\nresponse time {response} = {length} {sign} {between}: {job} is nominally released {between} {when} the start of the window"
        );
    }
}

/// Writes the first iteration of the busy window that exceeds the deadline.
fn crossed_deadline(out: &mut String, activity: &ActivityReport<'_>) {
    if let (Some(window), Some(period), Some(deadline)) = (&activity.window, activity.period, activity.deadline)
        // The deadline of job q is delay − J + (q − 1)·T + D after the start of the window.
        && let Some(deadline) = period.checked_mul(window.job - 1).and_then(|at| at.checked_add(deadline))
        && let Some(deadline) = deadline.checked_add(window.delay).and_then(|at| at.checked_sub(activity.jitter))
        && let Some(crossed) = window.iterations.iter().position(|&length| length > deadline)
    {
        let _ = writeln!(
            out,
            "\nfixed-point iterations: iteration {} exceeds the deadline ({deadline} after the start of the busy window)",
            crossed + 1
        );
        let mut shown: Vec<String> = window.iterations.iter().map(Time::to_string).collect();
        if let Some(more) = shown.len().checked_sub(SHOWN_ITERATIONS + 1).filter(|more| *more > 0) {
            shown.splice(1..=more, [format!("… {more} more …")]);
        }
        let _ = writeln!(out, "  {}", shown.join(" → "));
    }
}

/// Writes the greatest execution time of a period by programs and codels, or the timing table's time for the component.
fn own_time(
    out: &mut String,
    psm: &Psm<'_>,
    method: Method,
    worst_path: &dyn Fn(usize) -> Vec<(String, Time)>,
) {
    let greatest = psm.machine.greatest_edge();
    let (Some(edge), Some(described)) = (psm.machine.edges().get(greatest), psm.edges.all.get(greatest))
    else {
        return;
    };
    let state = |number: u32| psm.states.get(number as usize).map_or("", |name| name.as_str());
    let (source, target) = (state(edge.source), state(edge.target));
    let what = match &described.transition {
        Some(name) => format!("{source} —{name}→ {target}"),
        None if psm.states.len() == 1 => source.to_owned(),
        None => format!("staying in {source}"),
    };
    let of_component = psm.component_time.filter(|_| method == Method::Classic);
    let _ = match of_component.filter(|time| *time > edge.cost) {
        Some(time) => writeln!(
            out,
            "\nexecution time {time}, from the timing table's entry for the component; sum of its codels {}: {what}",
            edge.cost
        ),
        None => writeln!(out, "\nexecution time {}: {what}", edge.cost),
    };
    let assumed: FxHashSet<&str> = psm.assumed.iter().map(|(codel, _)| codel.as_str()).collect();
    for index in psm.edges.programs(described) {
        let Some((program, time)) = psm.programs.get(index) else { continue };
        let _ = writeln!(out, "  {:>12}  {program}", time.to_string());
        for (codel, time) in worst_path(index) {
            let assumed =
                if assumed.contains(codel.as_str()) { "  (assumed: in no timing table)" } else { "" };
            let _ = writeln!(out, "  {:>12}    {:>10}  {codel}{assumed}", "", time.to_string());
        }
    }
    if psm.overhead > Time::ZERO {
        let _ = writeln!(out, "  {:>12}  dispatch and context switches", psm.overhead.to_string());
    }
}

/// Writes the consecutive periods with the greatest total execution time.
fn trace(out: &mut String, psm: &Psm<'_>) {
    let Some(edges) = worst_trace(&psm.machine, SHOWN_PERIODS) else { return };
    let edges: Vec<_> = edges.iter().filter_map(|&edge| psm.machine.edges().get(edge)).collect();
    let total = edges.iter().try_fold(Time::ZERO, |sum, edge| sum.checked_add(edge.cost));
    let total = total.map_or_else(String::new, |sum| format!(", {sum} in total"));
    let _ = writeln!(
        out,
        "\nits {SHOWN_PERIODS} consecutive periods with the most interference for other activities{total}:"
    );
    let state = |number: u32| psm.states.get(number as usize).map_or("", |name| name.as_str());
    for same in edges.chunk_by(|a, b| (a.source, a.target, a.cost) == (b.source, b.target, b.cost)) {
        let Some(edge) = same.first() else { continue };
        let times = if same.len() == 1 { String::new() } else { format!("  {} times", same.len()) };
        let (source, target) = (state(edge.source), state(edge.target));
        let _ = writeln!(out, "  {:>12}  {source} → {target}{times}", edge.cost.to_string());
    }
}
