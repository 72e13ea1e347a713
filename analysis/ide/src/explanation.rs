//! Explains a response time: execution time, interference, and the iteration that exceeds the deadline.
//!
//! Its sums, reasons and notes are computed here, once; `explanation/document.rs` lays them out.

mod document;

use std::collections::HashMap;
use std::fmt::Write as _;

use mauve_diagnostics::{EXHAUSTED, timing_reason};
use mauve_hir::item_tree::Name;
use mauve_hir::{Location, ModelDb, config_of};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{
    Counted, CpuRule, CpuSet, Method, Status, Task, Time, Window, name_of_other, worst_trace,
};
use mauve_wcrt::{
    ActivityReport, CallsReport, Priority, Psm, Query, Reason, Report, TableSet, is_throttled, psm_at,
    psm_in_thread, worst_path,
};
use rustc_hash::FxHashSet;

use crate::doc::{Doc, DocLine, DocSpan};
use crate::occurrences::grouped;

const SHOWN_PERIODS: usize = 12;
const SHOWN_ITERATIONS: usize = 12;

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
    let of = report.activities.get(activity)?;
    let component = of.component;
    let psm = component.and_then(|it| psm_in_thread(db, tables, it, query.level, of.wakes).as_ref().ok());
    let path = |program: usize| {
        component.map_or_else(Vec::new, |of| worst_path(db, tables, of, query.level, program))
    };
    let workspace = tables.project(db).workspace(db);
    let (config, throttling) = (config_of(db, workspace), is_throttled(db, workspace));
    let origin =
        ExplanationOrigin { throttling, clocks: &|number| config.clock_name(number), psm, worst_path: &path };
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
    let origin =
        ExplanationOrigin { throttling, clocks: &|_| None, psm: psm.as_ref(), worst_path: &|_| Vec::new() };
    Some(Explanation::new(db, report, activity, query, &origin)?.document(most))
}

struct ExplanationOrigin<'a> {
    /// Whether real-time throttling is on, if `mauve.toml` says so.
    throttling: Option<bool>,
    /// The names of clocks, by number.
    clocks: &'a dyn Fn(u32) -> Option<&'a str>,
    psm: Option<&'a Psm<'a>>,
    /// The codels of a program along its worst path, with their times; by its index in the state machine.
    worst_path: &'a dyn Fn(usize) -> Vec<(String, Time)>,
}

/// An activity, and what its explanation is computed from.
struct Explanation<'a, 'db> {
    db: &'db dyn ModelDb,
    report: &'a Report<'db>,
    /// The index of the activity.
    index: usize,
    activity: &'a ActivityReport<'db>,
    query: Query,
    origin: &'a ExplanationOrigin<'a>,
    own: Option<OwnTime>,
}

/// A part of a response time or of a utilisation: an activity or other work on the platform.
#[derive(Clone, Default)]
struct Summand<'db> {
    name: Name,
    /// The location of an activity.
    at: Option<Location<'db>>,
    /// Where it is in the thread of the explained activity, or how it is released, in words.
    note: Option<String>,
    priority: Option<u32>,
    /// The number of jobs.
    count: u64,
    /// The greatest time of one of them.
    each: Option<Time>,
    /// The time of all of them.
    time: Time,
    is_assumed: bool,
}

/// The summands of a response time; without a bound, of the time until the first job ends.
struct Sum<'db> {
    /// The execution time of its own jobs. A job without demand counts as 1 ns.
    own: Time,
    /// The parts of `own`: a call or an overhead is in each job.
    overhead: Time,
    calls: Vec<CallsReport>,
    interference: Vec<Summand<'db>>,
    /// What of it is not waited for, as several CPUs execute it at once.
    at_once: Time,
    /// The time for which lower priorities hold locks.
    blocking: Time,
    /// The time from the start of the busy window until the nominal release of the job with the greatest response time.
    until_release: Time,
    /// The time from that release until the start, if the release is first.
    since_release: Time,
}

/// The greatest execution time of a period by programs and codels, without those that take no time.
struct OwnTime {
    /// The time of the greatest period by the programs.
    of_programs: Time,
    /// The greater time of the component in the timing table, if that counts.
    of_component: Option<Time>,
    /// The states and the transition of the period.
    period: String,
    /// A line for each program with the codels that it calls.
    programs: Vec<DocLine<'static>>,
    overhead: Time,
    /// What is in no program, each with what it is.
    others: Vec<(Time, &'static str)>,
}

impl<'a, 'db> Explanation<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        report: &'a Report<'db>,
        index: usize,
        query: Query,
        origin: &'a ExplanationOrigin<'a>,
    ) -> Option<Self> {
        let activity = report.activities.get(index)?;
        let own = origin.psm.and_then(|psm| OwnTime::new(psm, query.method, origin));
        Some(Explanation { db, report, index, activity, query, origin, own })
    }

    /// Returns which activities are counted, the assumptions about the platform, the precision, what is special about the busy window,
    /// and the iteration that exceeds the deadline: a clause each.
    fn notes(&self) -> Vec<String> {
        let Explanation { report, activity, origin, .. } = self;
        let mut notes = Vec::new();
        if activity.method.is_some_and(|(_, is_exhausted)| is_exhausted) {
            notes.push(EXHAUSTED.to_owned());
        }
        notes.extend(counted_cpus(report, activity));
        if activity.verdict != Status::NotAnalysed && origin.throttling.is_none() {
            notes.push("assumes real-time throttling off".to_owned());
        }
        notes.extend(waits(report, activity).map(str::to_owned));
        let window = activity.window.as_ref();
        let start = window.and_then(|window| window.start);
        if start.is_some() {
            notes.push("assumes synchronised clocks".to_owned());
        }
        let clock = window.filter(|_| start.is_some()).map_or(0, |window| window.clock);
        notes.extend((origin.clocks)(clock).map(|clock| format!("counts the offsets of [clocks.{clock}]")));
        notes.extend(start.map(|start| {
            format!("the busy window begins {start} after the instant that the synchronised clocks share")
        }));
        notes.extend(window.filter(|window| window.job > 1).map(|Window { job, length, .. }| {
            let ends = format!("it ends {length} after the start of the window");
            format!("job {job} of the busy window has the largest response time: {ends}")
        }));
        notes.extend(window.and_then(counted));
        notes.extend(exceeded_deadline(activity));
        // The first job of the activity may be released at the critical instant.
        let is_whole = window.is_none_or(|it| it.counted == Counted::Whole);
        let is_critical =
            activity.jitter == Time::ZERO && start.is_none() && activity.burst() == 1 && is_whole;
        let critical = activity.first_job.filter(|_| is_critical);
        notes.extend(
            critical
                .filter(|time| activity.response != Some(*time))
                .map(|time| format!("response time at the critical instant: {time}")),
        );
        notes
    }

    /// Returns why there is no response time; where a reason is another activity, also the reason of that.
    fn reasons(&self) -> (Vec<String>, Vec<DocLine<'db>>) {
        let (mut texts, mut behind): (Vec<String>, Vec<DocLine<'db>>) = Default::default();
        for reason in &self.activity.reasons {
            let text = timing_reason(self.db, &reason.reason);
            if texts.contains(&text) {
                continue;
            }
            texts.push(text);
            // The first activity that may delay it and is not analysed itself.
            let activities = &self.report.activities;
            let mut others = activities.iter().filter(|other| other.instance != self.activity.instance);
            let other = match reason.reason {
                Reason::DelayedBy { first, .. } => activities.get(first),
                _ => others.find(|other| other.at.is_some() && other.at == reason.at),
            };
            behind.extend(other.and_then(|other| {
                let why = timing_reason(self.db, &other.reasons.first()?.reason);
                Some(vec![DocSpan::Code(other.instance.to_string()), DocSpan::Words(format!(": {why}"))])
            }));
        }
        (texts, behind)
    }

    /// Returns the number and the total time of the consecutive periods with the greatest total execution time, and each kind of
    /// period once, as a cycle repeats them; without those that take no time.
    fn costliest_path(&self) -> Option<(String, Vec<DocLine<'db>>)> {
        // In the classic method, every job has the greatest execution time.
        let psm = self.origin.psm.filter(|_| self.query.method != Method::Classic)?;
        if psm.machine.states() <= 1 || !self.report.activities.iter().any(|it| delays(self.activity, it)) {
            return None;
        }
        let edges = worst_trace(&psm.machine, SHOWN_PERIODS)?;
        let edges = edges.iter().filter_map(|&edge| psm.machine.edges().get(edge));
        let in_text = |edge: &mauve_timing::Edge| {
            let of = |state: u32| psm.text_state(state as usize);
            (of(edge.source), of(edge.target), edge.cost)
        };
        let edges: Vec<(usize, usize, Time)> = edges.map(in_text).collect();
        let total = edges.iter().try_fold(Time::ZERO, |sum, (_, _, cost)| sum.checked_add(*cost));
        let costly = edges.into_iter().zip(0..).filter(|((_, _, cost), _)| *cost > Time::ZERO);
        let kinds = grouped(costly).into_iter().map(|((source, target, time), positions)| {
            let name = match psm.states.len() {
                1 => psm.state(source).to_owned(),
                _ => format!("{} → {}", psm.state(source), psm.state(target)),
            };
            let every = if psm.has_values() { repetition(&positions) } else { String::new() };
            vec![DocSpan::Code(name + &every), DocSpan::Words(format!(" {} × {time}", positions.len()))]
        });
        let kinds: Vec<DocLine<'db>> = kinds.collect();
        let total = total.map_or_else(String::new, |sum| format!(": {sum}"));
        (!kinds.is_empty()).then(|| (format!("costliest {SHOWN_PERIODS} consecutive periods{total}"), kinds))
    }
}

/// Returns whether `activity` may delay `other`.
fn delays(activity: &ActivityReport<'_>, other: &ActivityReport<'_>) -> bool {
    let priorities = activity.priority.real_time().zip(other.priority.real_time());
    let is_not_higher = priorities.is_some_and(|(own, other)| own >= other);
    let (own, others) = (activity.cpus.unwrap_or(CpuSet::ALL), other.cpus.unwrap_or(CpuSet::ALL));
    !std::ptr::eq(other, activity) && is_not_higher && own.meets(others)
}

/// Returns which lower priorities may delay an activity: `lower priorities that hold locks`.
pub fn blocking_priorities(report: &Report<'_>) -> &'static str {
    match (report.activities.iter().any(|it| it.is_not_preempted), report.locks()) {
        (false, _) => "lower priorities that hold locks",
        (true, []) => "lower priorities that are not preempted",
        (true, _) => "lower priorities that are not preempted, or hold locks",
    }
}

/// Returns which part of the window counts, unless all of it does.
fn counted(window: &Window) -> Option<String> {
    match window.counted {
        Counted::Whole => None,
        Counted::UntilRelease(_) => Some(
            "counts what its thread has to execute when the job is released, and no later job of it"
                .to_owned(),
        ),
        Counted::Rounds => Some(format!(
            "counts {} jobs at most of each other activity in its thread, which executes one of each in a round",
            window.job + 1
        )),
        Counted::UntilBegin(begin) => Some(format!(
            "counts other activities until the job begins, {begin} after the start of the window"
        )),
    }
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

/// Returns how a task is released, unless that is in each period.
fn releases(task: &Task) -> Option<String> {
    match task.burst() {
        _ if task.is_periodic() => None,
        _ if task.arrivals.is_some() => Some("released by data, as often as it is written".to_owned()),
        1 => Some("released by data".to_owned()),
        burst => Some(format!("in bursts of {burst}")),
    }
}

impl<'db> Summand<'db> {
    fn named(name: &str) -> Self {
        Summand { name: name.into(), ..Summand::default() }
    }

    fn activity(it: &ActivityReport<'db>) -> Self {
        let (at, is_assumed) = (it.at.clone(), !it.assumed.is_empty());
        let priority = it.priority.real_time();
        let note = releases(&it.task);
        Summand {
            name: it.instance.clone(),
            at,
            note,
            priority,
            each: it.own,
            is_assumed,
            ..Summand::default()
        }
    }

    fn other(it: &Task) -> Self {
        let priority = it.priority.real_time();
        let (each, note) = (it.greatest_cost(), releases(it));
        Summand { priority, each, note, ..Summand::named(&name_of_other(&it.name)) }
    }
}

impl<'db> Sum<'db> {
    fn new(
        db: &'db dyn ModelDb,
        report: &Report<'db>,
        index: usize,
        own_time: Option<&OwnTime>,
    ) -> Option<Self> {
        let activity = report.activities.get(index)?;
        let window = activity.window.as_ref();
        if window.is_none() && activity.first_job.is_none() {
            return None;
        }
        let interrupt = || db.unwind_if_revision_cancelled();
        let others = report.others().iter().map(Summand::other);
        let rows = others.chain(report.activities.iter().enumerate().map(|(other, it)| {
            let before = if other < index { "before" } else { "after" };
            let in_thread = it.is_mate(activity).then(|| format!("{before} it in its thread"));
            let in_queue = it.is_queued_with(activity).then(|| "in its thread".to_owned());
            let row = Summand::activity(it);
            Summand { note: in_thread.or(in_queue).or(row.note), ..row }
        }));
        let by_name: HashMap<Name, Summand<'db>> = rows.map(|row| (row.name.clone(), row)).collect();
        let interference = report.breakdown(&interrupt).of(index).into_iter().map(|it| {
            let of = by_name.get(&it.instance).cloned().unwrap_or_else(|| Summand::named(&it.instance));
            Summand { count: it.jobs, time: it.time, ..of }
        });
        let interference: Vec<Summand<'db>> = interference.collect();
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
        // The nominal release is at delay − J + (q − 1)·T; in bursts of b, + ⌊(q − 1)/b⌋·T.
        let released = window.and_then(|window| match window.counted {
            Counted::UntilRelease(release) => Some(release),
            _ => activity.release_of(window.job)?.checked_add(window.delay),
        });
        let released = released.unwrap_or(activity.jitter);
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
            until_release: released.checked_sub(activity.jitter).unwrap_or_default(),
            since_release: activity.jitter.checked_sub(released).unwrap_or_default(),
        })
    }

    /// Returns the execution time of its own programs; none where a declared time of the component includes the other parts.
    fn programs(&self) -> Option<Time> {
        let calls = self.calls.iter().try_fold(self.overhead, |sum, it| sum.checked_add(it.time))?;
        self.own.checked_sub(calls)
    }

    /// Returns the greatest interferences, in the order of the deployment, and the number and the sum of the others.
    fn greatest(&self, most: usize) -> (Vec<&Summand<'db>>, usize, Time) {
        let mut by_time: Vec<usize> = (0..self.interference.len()).collect();
        by_time.sort_by_key(|&place| std::cmp::Reverse(self.interference.get(place).map(|it| it.time)));
        let shown: FxHashSet<usize> = by_time.into_iter().take(most).collect();
        let is_shown = |(place, _): &(usize, _)| shown.contains(place);
        let (shown, others): (Vec<_>, Vec<_>) = self.interference.iter().enumerate().partition(is_shown);
        let sum = others.iter().try_fold(Time::ZERO, |sum, (_, it)| sum.checked_add(it.time));
        (shown.into_iter().map(|(_, it)| it).collect(), others.len(), sum.unwrap_or_default())
    }
}

/// Returns the first iteration of the busy window that exceeds the deadline, with the successive values.
fn exceeded_deadline(activity: &ActivityReport<'_>) -> Option<String> {
    let window = activity.window.as_ref()?;
    // The deadline of job q is delay − J + (q − 1)·T + D after the start of the window.
    let deadline = activity.release_of(window.job)?.checked_add(activity.deadline?)?;
    let deadline = deadline.checked_add(window.delay)?.checked_sub(activity.jitter)?;
    let iteration = window.iterations.iter().position(|&length| length > deadline)? + 1;
    let mut shown: Vec<String> = window.iterations.iter().map(Time::to_string).collect();
    if let Some(more) = shown.len().checked_sub(SHOWN_ITERATIONS + 1).filter(|more| *more > 0) {
        shown.splice(1..=more, [format!("… {more} more …")]);
    }
    Some(format!(
        "fixed-point iteration {iteration} exceeds the deadline, {deadline} after the start of the busy window: {}",
        shown.join(" → ")
    ))
}

impl OwnTime {
    fn new(psm: &Psm<'_>, method: Method, origin: &ExplanationOrigin<'_>) -> Option<Self> {
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
        let programs =
            psm.greatest.iter().filter(|(_, time)| *time > Time::ZERO).filter_map(|(index, time)| {
                let (program, _) = psm.programs.get(*index)?;
                let mut line = vec![DocSpan::Code(program.to_string()), DocSpan::Words(format!(" {time}"))];
                let codels = (origin.worst_path)(*index).into_iter().filter(|(_, time)| *time > Time::ZERO);
                for (position, (codel, time)) in codels.enumerate() {
                    let assumed = if assumed.contains(codel.as_str()) { " (assumed)" } else { "" };
                    let sign = if position == 0 { ": " } else { ", " };
                    let time = DocSpan::Words(format!(" {time}{assumed}"));
                    line.extend([DocSpan::Words(sign.to_owned()), DocSpan::Code(codel), time]);
                }
                Some(line)
            });
        let of_component = psm.component_time.filter(|_| method == Method::Classic);
        let known = psm.greatest.iter().map(|(_, time)| *time).chain([psm.overhead, psm.switches]);
        let rest = known.fold(edge.cost, |rest, part| rest.checked_sub(part).unwrap_or_default());
        let wait = if psm.greatest.is_empty() { psm.wait_of(greatest).unwrap_or_default() } else { rest };
        let mut others = vec![
            (psm.overhead, "dispatch and context switches"),
            (psm.switches, "context switches of its waits"),
            (wait, "waits of its codels, until the thread runs again"),
        ];
        others.retain(|(time, _)| *time > Time::ZERO);
        // All of it is execution where its programs are not known.
        let execution = rest.checked_sub(wait).unwrap_or_default();
        if !others.is_empty() && execution > Time::ZERO {
            others.push((execution, "execution"));
        }
        Some(OwnTime {
            of_programs: edge.cost,
            of_component: of_component.filter(|time| *time > edge.cost),
            period,
            programs: programs.collect(),
            overhead: psm.overhead,
            others,
        })
    }
}

/// Returns how often a kind of period repeats, by its positions: `, every 10th period`. The kinds of periods of counters alternate.
fn repetition(positions: &[usize]) -> String {
    let mut steps = positions.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?));
    let step = steps.next().filter(|step| *step > 1 && steps.all(|it| it == *step));
    let ending = |step: usize| match step {
        2 => "nd",
        3 => "rd",
        _ => "th",
    };
    step.map_or_else(String::new, |step| format!(", every {step}{} period", ending(step)))
}
