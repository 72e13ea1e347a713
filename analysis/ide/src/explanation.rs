//! Explains a response time: execution time, interference, and the iteration that exceeds the deadline.
//!
//! The facts are computed here, once; `explanation/document.rs` makes a document of them.

mod document;

use std::collections::HashMap;
use std::fmt::Write as _;

use mauve_diagnostics::{EXHAUSTED, times_of, timing_reason};
use mauve_hir::item_tree::Name;
use mauve_hir::{Location, ModelDb, config_of};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{
    CpuRule, CpuSet, Method, Status, THROTTLING, Task, Time, Window, name_of_other, worst_trace,
};
use mauve_wcrt::{
    ActivityReport, CallsReport, Priority, Psm, Query, Reason, Report, Share, TableSet, psm_at, psm_of,
    worst_path,
};
use rustc_hash::FxHashSet;

use crate::doc::Doc;
use crate::occurrences::grouped;

const SHOWN_PERIODS: usize = 12;

/// Explains the response time of the activity of `report`, the report with these timing tables, with that index. A table names at
/// `most` as many activities.
pub fn explain_response<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    report: &Report<'db>,
    activity: usize,
    query: Query,
    most: usize,
) -> Option<Doc<'db>> {
    let component = report.activities.get(activity).and_then(|activity| activity.component);
    let psm = component.and_then(|component| psm_of(db, tables, component, query.level).as_ref().ok());
    let path = |program: usize| {
        component.map_or_else(Vec::new, |of| worst_path(db, tables, of, query.level, program))
    };
    let config = config_of(db, tables.project(db).workspace(db));
    let throttling = config.rt_throttling;
    let origin = Origin { throttling, clocks: &|number| config.clock_name(number), psm, worst_path: &path };
    Some(Explanation::new(db, report, activity, query, &origin)?.document(most))
}

/// [`explain_response`] for the report of a task set, which has neither programs nor codels.
pub fn explain_response_of<'db>(
    db: &'db dyn ModelDb,
    set: &TaskSet,
    report: &Report<'db>,
    activity: usize,
    query: Query,
    most: usize,
) -> Option<Doc<'db>> {
    let psm = set.task.get(activity).and_then(|task| psm_at(set, task, query.level));
    let throttling = set.rt_throttling;
    let origin = Origin { throttling, clocks: &|_| None, psm: psm.as_ref(), worst_path: &|_| Vec::new() };
    Some(Explanation::new(db, report, activity, query, &origin)?.document(most))
}

struct Origin<'a> {
    /// Whether real-time throttling is on, if `mauve.toml` says so.
    throttling: Option<bool>,
    /// The names of clocks, by number.
    clocks: &'a dyn Fn(u32) -> Option<&'a str>,
    psm: Option<&'a Psm<'a>>,
    /// The codels of a program along its worst path, with their times; by its index in the state machine.
    worst_path: &'a dyn Fn(usize) -> Vec<(String, Time)>,
}

/// The facts of an explanation.
struct Explanation<'a, 'db> {
    activity: &'a ActivityReport<'db>,
    query: Query,
    /// Words for the timing tables that the figures are from, to be appended.
    of_which: String,
    /// Whether the times of the activity or of its interference are partly assumed.
    is_assumed: bool,
    /// Why there is no response time.
    reasons: Vec<Why>,
    /// The activities that overload its CPU, if these are the reason.
    overload: Option<Overload<'db>>,
    /// How it is released, unless that is in each period.
    released: Option<String>,
    /// Which activities are counted, the assumptions about the platform, and the precision: a clause each.
    notes: Vec<String>,
    sum: Option<Sum<'db>>,
    own: Option<OwnTime<'db>>,
    crossed: Option<Crossed>,
    /// The response time of the first job at the critical instant, if the first job of the activity may be released there.
    critical: Option<Time>,
    trace: Option<Trace<'db>>,
}

/// A row: what takes time, how often, and how long.
#[derive(Clone, Default)]
struct Row<'db> {
    /// An activity, other work on the platform, a program, a codel, or the states of a period.
    name: Name,
    /// The location of an activity.
    at: Option<Location<'db>>,
    /// Where it is in the thread of the explained activity, or how it is released, in words.
    note: Option<String>,
    priority: Option<u32>,
    /// The number of jobs or periods.
    count: u64,
    /// The greatest time of one of them.
    each: Option<Time>,
    /// The time of all of them.
    time: Time,
    is_assumed: bool,
}

/// A reason, and where the reason is another activity, the reason of that.
struct Why {
    text: String,
    behind: Option<(Name, String)>,
}

/// The utilisation of an overloaded CPU.
struct Overload<'db> {
    named: Name,
    priority: u32,
    utilisation: Share,
    parts: Vec<Load<'db>>,
}

/// What one activity contributes to the utilisation of an overloaded CPU.
struct Load<'db> {
    of: Row<'db>,
    period: Option<Time>,
    share: Share,
}

/// The summands of a response time; without a bound, of the time until the first job ends.
struct Sum<'db> {
    /// The execution time of its own jobs. A job without demand counts as 1 ns.
    own: Time,
    /// The parts of `own`: a call or an overhead is in each job.
    overhead: Time,
    calls: Vec<CallsReport>,
    interference: Vec<Row<'db>>,
    /// What of it is not waited for, as several CPUs execute it at once.
    at_once: Time,
    /// The time for which lower priorities hold locks.
    blocking: Time,
    released: Released,
}

/// The nominal release of the job whose response time is the greatest, relative to the start of the busy window.
enum Released {
    AtStart,
    /// The response time is less than the window by this.
    After(Time),
    /// The response time is greater than the window by this.
    Before(Time),
}

/// The greatest execution time of a period by programs and codels, without those that take no time.
struct OwnTime<'db> {
    /// The time of the greatest period by the programs.
    of_programs: Time,
    /// The greater time of the component in the timing table, if that counts.
    of_component: Option<Time>,
    /// The states and the transition of the period.
    period: String,
    /// The programs with the codels that they call.
    programs: Vec<(Row<'db>, Vec<Row<'db>>)>,
    overhead: Time,
    /// The context switches of its waits.
    switches: Time,
    /// The time that its codels wait.
    wait: Time,
    /// What else it executes: all of it where its programs are not known.
    other: Time,
}

/// The first iteration of the busy window that exceeds the deadline.
struct Crossed {
    iteration: usize,
    /// The deadline, counted from the start of the window.
    deadline: Time,
    /// The successive values, with `… n more …` in place of many.
    shown: String,
}

/// The consecutive periods with the greatest total execution time.
struct Trace<'db> {
    total: Option<Time>,
    /// The periods with their states, without those that take no time.
    periods: Vec<Row<'db>>,
}

impl<'a, 'db> Explanation<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        report: &'a Report<'db>,
        index: usize,
        query: Query,
        origin: &Origin<'_>,
    ) -> Option<Self> {
        let activity = report.activities.get(index)?;
        let is_background = activity.verdict == Status::Background;
        let with_assumptions = report.with_assumptions();
        let own = origin.psm.and_then(|psm| OwnTime::new(psm, query.method, origin.worst_path));
        let sum = if is_background { None } else { Sum::new(db, report, index, own.as_ref()) };
        let has_start = activity.window.as_ref().is_some_and(|window| window.start.is_some());
        let number = activity.window.as_ref().filter(|_| has_start).map_or(0, |window| window.clock);
        let clock = (origin.clocks)(number);
        let mut notes = Vec::new();
        if activity.method.is_some_and(|(_, is_exhausted)| is_exhausted) {
            notes.push(EXHAUSTED.to_owned());
        }
        notes.extend(counted_cpus(report, activity));
        let is_analysed = activity.verdict != Status::NotAnalysed;
        if is_analysed && origin.throttling.is_none() {
            notes.push("assumes real-time throttling off".to_owned());
        }
        notes.extend(waits(report, activity).map(str::to_owned));
        if has_start {
            notes.push("assumes synchronised clocks".to_owned());
        }
        if let Some(clock) = clock {
            notes.push(format!("counts the offsets of [clocks.{clock}]"));
        }
        // In the classic method, every job has the greatest execution time.
        let has_states = |psm: &&Psm<'_>| query.method != Method::Classic && psm.machine.states() > 1;
        let machine = origin.psm.filter(has_states);
        let machine = machine.filter(|_| report.activities.iter().any(|it| delays(activity, it)));
        let is_critical = activity.jitter == Time::ZERO && !has_start && activity.burst() == 1;
        Some(Explanation {
            activity,
            query,
            of_which: times_of(report.times.as_deref()),
            is_assumed: with_assumptions.get(index).copied().unwrap_or_default(),
            reasons: reasons(db, report, activity),
            overload: Overload::new(report, activity, origin.throttling == Some(true)),
            released: releases(&activity.task),
            notes,
            sum,
            own,
            crossed: Crossed::new(activity),
            critical: activity.first_job.filter(|_| is_critical && !is_on_all_cpus(activity)),
            trace: machine.and_then(Trace::new),
        })
    }

    /// Returns what is special about the busy window, in sentences.
    fn busy_window(&self) -> impl Iterator<Item = String> {
        let window = self.activity.window.as_ref();
        let start = window.and_then(|window| window.start).map(|start| {
            format!("the busy window begins {start} after the instant that the synchronised clocks share")
        });
        let job = window.filter(|window| window.job > 1).map(|Window { job, length, .. }| {
            let ends = format!("it ends {length} after the start of the window");
            format!("job {job} of the busy window has the largest response time: {ends}")
        });
        start.into_iter().chain(job)
    }

    /// Returns the method that gives the response time, otherwise the requested one.
    fn method(&self) -> Method {
        self.activity.method.map_or(self.query.method, |(method, _)| method)
    }
}

/// Returns whether `activity` may delay `other`.
fn delays(activity: &ActivityReport<'_>, other: &ActivityReport<'_>) -> bool {
    let priorities = activity.priority.real_time().zip(other.priority.real_time());
    let is_not_higher = priorities.is_some_and(|(own, other)| own >= other);
    let (own, others) = (activity.cpus.unwrap_or(CpuSet::ALL), other.cpus.unwrap_or(CpuSet::ALL));
    !std::ptr::eq(other, activity) && is_not_higher && own.meets(others)
}

/// Returns how the waits in a response time are counted.
fn waits(report: &Report<'_>, activity: &ActivityReport<'_>) -> Option<&'static str> {
    let window = activity.window.as_ref()?;
    let others = report.activities.iter().filter(|it| delays(it, activity));
    let has_waits = others.chain([activity]).any(|it| it.task.waits.is_some());
    match window.late.is_empty() {
        _ if !has_waits => None,
        true => Some("counts waits as execution"),
        false => {
            Some("counts no waits of other activities, whose execution may be late by their response times")
        }
    }
}

fn reasons<'db>(db: &'db dyn ModelDb, report: &Report<'db>, activity: &ActivityReport<'db>) -> Vec<Why> {
    let mut found: Vec<Why> = Vec::new();
    for reason in &activity.reasons {
        let text = timing_reason(db, &reason.reason);
        if found.iter().any(|known| known.text == text) {
            continue;
        }
        // The first activity that may delay it and is not analysed itself.
        let mut others = report.activities.iter().filter(|other| other.instance != activity.instance);
        let other = match reason.reason {
            Reason::DelayedBy { first, .. } => report.activities.get(first),
            _ => others.find(|other| other.at.is_some() && other.at == reason.at),
        };
        let behind = other.and_then(|other| {
            let why = other.reasons.first()?;
            Some((other.instance.clone(), timing_reason(db, &why.reason)))
        });
        found.push(Why { text, behind });
    }
    found
}

/// Returns which activities are counted in the response time of one, unless these are just those of its only CPU.
pub fn counted_cpus(report: &Report<'_>, activity: &ActivityReport<'_>) -> Option<String> {
    let several = |it: &ActivityReport<'_>, counted: CpuSet| {
        let may_leave = it.cpus.is_some_and(|cpus| cpus.meets(counted) && cpus.len() > 1);
        it.priority != Priority::Background && it.priority >= activity.priority && may_leave
    };
    match activity.rule? {
        rule @ CpuRule::Cpu(_) if report.activities.iter().any(|it| several(it, rule.cpus())) => {
            let of = if activity.cpus == Some(rule.cpus()) { "" } else { ", the best one of its CPUs" };
            let cpu = report.hosts.names(rule.cpus());
            Some(format!("on {cpu}{of}, with all activities of higher or equal priority that may run there"))
        }
        CpuRule::Cpu(_) => None,
        rule @ CpuRule::Linked(_) => Some(format!(
            "on {} as if they were one CPU: activities have different affinities with several CPUs there",
            report.hosts.names(rule.cpus())
        )),
        CpuRule::Global(cpus) => Some(format!(
            "on {}: it waits only while each of them executes an activity of higher or equal priority",
            report.hosts.names(cpus)
        )),
    }
}

fn is_on_all_cpus(activity: &ActivityReport<'_>) -> bool {
    matches!(activity.rule, Some(CpuRule::Global(_)))
}

impl<'db> Overload<'db> {
    fn new(report: &Report<'db>, activity: &ActivityReport<'db>, is_throttled: bool) -> Option<Self> {
        let (cpu, named, priority, utilisation) =
            activity.reasons.iter().find_map(|it| match &it.reason {
                Reason::Overloaded { cpu, named, priority, utilisation } => {
                    Some((*cpu, named.clone(), *priority, *utilisation))
                }
                _ => None,
            })?;
        let is_counted = |it: &Task| {
            it.priority.real_time() >= Some(priority) && it.cpus.is_some_and(|cpus| cpus.meets(cpu))
        };
        let of_activity = |it: &ActivityReport<'db>| {
            Some(Load { of: Row::activity(it), period: it.period, share: it.share? })
        };
        let of_other = |it: &Task| {
            let (time, period) = it.greatest_cost().zip(it.period)?;
            let share = Share(time.as_nanos() as f64 * it.burst() as f64 / period.as_nanos() as f64);
            Some(Load { of: Row::other(it), period: it.period, share })
        };
        let others = report.others().iter().filter(|it| is_counted(it));
        let activities = report.activities.iter().filter(|it| is_counted(it)).filter_map(of_activity);
        let mut parts: Vec<Load<'db>> = activities.chain(others.filter_map(of_other)).collect();
        if is_throttled {
            parts.push(Load { of: Row::named(THROTTLING), period: None, share: Share(0.05) });
        }
        Some(Overload { named, priority, utilisation, parts })
    }
}

/// Returns how a task is released, unless that is in each period.
fn releases(task: &Task) -> Option<String> {
    match task.burst() {
        _ if task.is_periodic() => None,
        1 => Some("released by data".to_owned()),
        burst => Some(format!("in bursts of {burst}")),
    }
}

impl<'db> Row<'db> {
    fn named(name: &str) -> Self {
        Row { name: name.into(), ..Row::default() }
    }

    fn activity(it: &ActivityReport<'db>) -> Self {
        let (at, is_assumed) = (it.at.clone(), !it.assumed.is_empty());
        let priority = it.priority.real_time();
        let note = releases(&it.task);
        Row { name: it.instance.clone(), at, note, priority, each: it.own, is_assumed, ..Row::default() }
    }

    fn other(it: &Task) -> Self {
        let priority = it.priority.real_time();
        let (each, note) = (it.greatest_cost(), releases(it));
        Row { priority, each, note, ..Row::named(&name_of_other(&it.name)) }
    }
}

impl<'db> Sum<'db> {
    fn new(
        db: &'db dyn ModelDb,
        report: &Report<'db>,
        index: usize,
        own_time: Option<&OwnTime<'_>>,
    ) -> Option<Self> {
        let activity = report.activities.get(index)?;
        let window = activity.window.as_ref();
        if window.is_none() && activity.first_job.is_none() {
            return None;
        }
        let interrupt = || db.unwind_if_revision_cancelled();
        let others = report.others().iter().map(Row::other);
        let rows = others.chain(report.activities.iter().enumerate().map(|(other, it)| {
            let before = if other < index { "before" } else { "after" };
            let thread = it.thread.as_ref().filter(|_| it.is_mate(activity));
            let in_thread = thread.map(|thread| format!("{before} it in the thread `{thread}`"));
            let row = Row::activity(it);
            Row { note: in_thread.or(row.note), ..row }
        }));
        let by_name: HashMap<Name, Row<'db>> = rows.map(|row| (row.name.clone(), row)).collect();
        let interference = report.breakdown(&interrupt).of(index).into_iter().map(|it| {
            let of = by_name.get(&it.instance).cloned().unwrap_or_else(|| Row::named(&it.instance));
            Row { count: it.jobs, time: it.time, ..of }
        });
        let interference: Vec<Row<'db>> = interference.collect();
        let jobs = window.map_or(1, |window| window.job);
        let own = window.map(|window| window.own).or(activity.own).unwrap_or_default();
        let own = own.max(Time::from_nanos(1));
        let waited = window.filter(|_| is_on_all_cpus(activity)).and_then(|it| it.length.checked_sub(own));
        let sum = interference.iter().try_fold(Time::ZERO, |sum, it| sum.checked_add(it.time));
        let at_once = sum.zip(waited).and_then(|(sum, waited)| sum.checked_sub(waited));
        // The first job ends when all of this is executed.
        let until_first = activity.first_job.and_then(|it| it.checked_sub(own)?.checked_sub(sum?));
        let calls = activity.calls.iter().map(|it| {
            let (calls, time) = (it.calls.checked_mul(jobs)?, it.time.checked_mul(jobs)?);
            Some(CallsReport { calls, time, ..it.clone() })
        });
        Some(Sum {
            own,
            // A declared time of the component has it.
            overhead: own_time
                .filter(|it| it.of_component.is_none())
                .and_then(|it| it.overhead.checked_mul(jobs))
                .unwrap_or_default(),
            calls: calls.collect::<Option<Vec<CallsReport>>>().unwrap_or_default(),
            interference,
            at_once: at_once.unwrap_or_default(),
            blocking: window.map_or(until_first.unwrap_or_default(), |window| window.blocking),
            released: Released::of(activity),
        })
    }

    /// Returns the execution time of its own programs; none where a declared time of the component includes the other parts.
    fn programs(&self) -> Option<Time> {
        let calls = self.calls.iter().try_fold(self.overhead, |sum, it| sum.checked_add(it.time))?;
        self.own.checked_sub(calls)
    }

    /// Returns the greatest interferences, in the order of the deployment, and the number and the sum of the others.
    fn greatest(&self, most: usize) -> (Vec<&Row<'db>>, usize, Time) {
        let mut by_time: Vec<usize> = (0..self.interference.len()).collect();
        by_time.sort_by_key(|&place| std::cmp::Reverse(self.interference.get(place).map(|it| it.time)));
        let shown: FxHashSet<usize> = by_time.into_iter().take(most).collect();
        let is_shown = |(place, _): &(usize, _)| shown.contains(place);
        let (shown, others): (Vec<_>, Vec<_>) = self.interference.iter().enumerate().partition(is_shown);
        let sum = others.iter().try_fold(Time::ZERO, |sum, (_, it)| sum.checked_add(it.time));
        (shown.into_iter().map(|(_, it)| it).collect(), others.len(), sum.unwrap_or_default())
    }
}

impl Released {
    fn of(activity: &ActivityReport<'_>) -> Released {
        let released = activity.window.as_ref().and_then(|window| {
            // The nominal release is at delay − J + (q − 1)·T; in bursts of b, + ⌊(q − 1)/b⌋·T.
            activity.release_of(window.job)?.checked_add(window.delay)
        });
        let Some(released) = released else { return Released::AtStart };
        match (released.checked_sub(activity.jitter), activity.jitter.checked_sub(released)) {
            (Some(Time::ZERO), _) | (None, None) => Released::AtStart,
            (Some(after), _) => Released::After(after),
            (None, Some(before)) => Released::Before(before),
        }
    }
}

impl Crossed {
    const SHOWN_ITERATIONS: usize = 12;

    fn new(activity: &ActivityReport<'_>) -> Option<Crossed> {
        let window = activity.window.as_ref()?;
        // The deadline of job q is delay − J + (q − 1)·T + D after the start of the window.
        let deadline = activity.release_of(window.job)?.checked_add(activity.deadline?)?;
        let deadline = deadline.checked_add(window.delay)?.checked_sub(activity.jitter)?;
        let iteration = window.iterations.iter().position(|&length| length > deadline)? + 1;
        let mut shown: Vec<String> = window.iterations.iter().map(Time::to_string).collect();
        if let Some(more) = shown.len().checked_sub(Self::SHOWN_ITERATIONS + 1).filter(|more| *more > 0) {
            shown.splice(1..=more, [format!("… {more} more …")]);
        }
        Some(Crossed { iteration, deadline, shown: shown.join(" → ") })
    }
}

impl OwnTime<'_> {
    /// Returns what is in no program, each with what it is.
    fn others(&self) -> impl Iterator<Item = (Time, &'static str)> {
        let others = [
            (self.overhead, "dispatch and context switches"),
            (self.switches, "context switches of its waits"),
            (self.wait, "waits of its codels, until the thread runs again"),
        ];
        let is_alone = others.iter().all(|(time, _)| *time == Time::ZERO);
        let execution = (self.other, "execution");
        let all = others.into_iter().chain((!is_alone).then_some(execution));
        all.filter(|(time, _)| *time > Time::ZERO)
    }

    fn new(psm: &Psm<'_>, method: Method, worst_path: &dyn Fn(usize) -> Vec<(String, Time)>) -> Option<Self> {
        let greatest = psm.machine.greatest_edge();
        let edge = psm.machine.edges().get(greatest)?;
        let described = psm.edges.all.get(psm.text_edge(greatest)?)?;
        let (source, values) = (psm.text_state(edge.source as usize), psm.values_in(edge.source as usize));
        let (source, target) = (psm.state(source), psm.state(described.target));
        let mut period = match &described.transition {
            Some(name) => format!("{source} —{name}→ {target}"),
            None if psm.states.len() == 1 => source.to_owned(),
            None => format!("staying in {source}"),
        };
        if !values.is_empty() {
            let _ = write!(period, " with {values}");
        }
        let assumed: FxHashSet<&str> = psm.assumed.iter().map(|(codel, _)| codel.as_str()).collect();
        let row = |name: &str, time: Time| {
            let is_assumed = assumed.contains(name);
            (time > Time::ZERO).then(|| Row { time, is_assumed, ..Row::named(name) })
        };
        let programs = psm.greatest.iter().filter_map(|(index, time)| {
            let (program, _) = psm.programs.get(*index)?;
            let codels = worst_path(*index).into_iter().filter_map(|(codel, time)| row(&codel, time));
            Some((row(&program.to_string(), *time)?, codels.collect()))
        });
        let of_component = psm.component_time.filter(|_| method == Method::Classic);
        let known = psm.greatest.iter().map(|(_, time)| *time).chain([psm.overhead, psm.switches]);
        let rest = known.fold(edge.cost, |rest, part| rest.checked_sub(part).unwrap_or_default());
        let wait = if psm.greatest.is_empty() { psm.wait_of(greatest).unwrap_or_default() } else { rest };
        Some(OwnTime {
            of_programs: edge.cost,
            of_component: of_component.filter(|time| *time > edge.cost),
            period,
            programs: programs.collect(),
            overhead: psm.overhead,
            switches: psm.switches,
            wait,
            other: rest.checked_sub(wait).unwrap_or_default(),
        })
    }
}

impl Trace<'_> {
    fn new(psm: &Psm<'_>) -> Option<Self> {
        let edges = worst_trace(&psm.machine, SHOWN_PERIODS)?;
        let edges = edges.iter().filter_map(|&edge| psm.machine.edges().get(edge));
        let in_text = |edge: &mauve_timing::Edge| {
            let of = |state: u32| psm.text_state(state as usize);
            (of(edge.source), of(edge.target), edge.cost)
        };
        let edges: Vec<(usize, usize, Time)> = edges.map(in_text).collect();
        let total = edges.iter().try_fold(Time::ZERO, |sum, (_, _, cost)| sum.checked_add(*cost));
        let name = |source: usize, target: usize| match psm.states.len() {
            1 => psm.state(source).to_owned(),
            _ => format!("{} → {}", psm.state(source), psm.state(target)),
        };
        if psm.has_values() {
            return Some(Trace { total, periods: repeated(&edges, name) });
        }
        let periods = edges.chunk_by(|a, b| a == b).filter_map(|same| {
            let &(source, target, time) = same.first().filter(|(_, _, cost)| *cost > Time::ZERO)?;
            Some(Row { count: same.len() as u64, time, ..Row::named(&name(source, target)) })
        });
        Some(Trace { total, periods: periods.collect() })
    }
}

/// Returns each kind of period once, with how often it repeats: `Idle → Planning, every 10th period`. The kinds of periods of
/// counters alternate.
fn repeated(edges: &[(usize, usize, Time)], name: impl Fn(usize, usize) -> String) -> Vec<Row<'static>> {
    let costly = edges.iter().copied().zip(0..).filter(|((_, _, cost), _)| *cost > Time::ZERO);
    let kinds = grouped(costly);
    let row = |((source, target, time), positions): ((usize, usize, Time), Vec<usize>)| {
        let mut steps = positions.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?));
        let mut name = name(source, target);
        if let Some(step) = steps.next().filter(|step| *step > 1)
            && steps.all(|it| it == step)
        {
            let ending = if step == 2 {
                "nd"
            } else if step == 3 {
                "rd"
            } else {
                "th"
            };
            let _ = write!(name, ", every {step}{ending} period");
        }
        Row { count: positions.len() as u64, time, ..Row::named(&name) }
    };
    kinds.into_iter().map(row).collect()
}
