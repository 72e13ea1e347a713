//! A recording of a deployment beside its model: what was observed, and which assumption of the analysis fails.
//!
//! [`Observer`] takes the spans of a recording one by one, and keeps counters and greatest values: its memory does not grow with
//! the length of the recording. [`Observer::finish`] returns facts.
//!
//! | file | holds |
//! |---|---|
//! | `model.rs` | what the model promises |
//! | `releases.rs` | releases, response times, missing periods |
//! | `path.rs` | the path through the state machine |

mod model;
mod path;
mod releases;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use mauve_pwcet::exceedance_probability;
use mauve_pwcet::trace::{NameId, Names, Span, SpanKind, Visitor};
use rustc_hash::FxHashMap;

pub use model::{Expected, ExpectedInstance, ExpectedMachine, expected};
pub use path::{EdgeCount, UnknownPath};

use crate::system::Priority;
use path::Path;
use releases::{Job, Releases};

/// A count of exceedances is a finding if its probability is less.
pub const IMPROBABLE: f64 = 1e-3;

/// The periods of all instances that are remembered, to say who delayed a late one.
const REMEMBERED: usize = 1 << 10;

/// The programs of one period that are remembered.
const MOST_PROGRAMS: usize = 1 << 14;

/// The different schedulings of an instance that are remembered.
const MOST_SCHEDULINGS: usize = 16;

/// The findings of one kind about one instance.
const MOST_PATHS: usize = 16;

/// Times without recorded events that are remembered.
const MOST_GAPS: usize = 1 << 12;

/// What LTTng counts for itself: in each span, and for each span inside of it (see `orocos/src/trace.rs`).
const TRACING: (u64, u64) = (500, 1500);

/// A greatest value, and when it was observed. Times are in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Greatest {
    /// The value.
    pub time: u64,
    /// The time of the end of the span.
    pub at: Option<u64>,
}

/// What another activity executed in a response time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interferer {
    /// The instance.
    pub instance: String,
    /// The number of its periods, and their execution time.
    pub jobs: u64,
    /// See `jobs`.
    pub execution: u64,
    /// The same in the bound; 0 if it does not count this instance.
    pub bound_jobs: u64,
    /// See `bound_jobs`.
    pub bound: u64,
}

/// Where a response time comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Cause {
    /// The response time, in which the others executed.
    time: u64,
    /// The instance, the number of periods and their execution time.
    others: BTreeMap<usize, (u64, u64)>,
}

/// Something that the model and the recording do not agree on.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The index of the instance in the deployment.
    pub instance: Option<usize>,
    /// What it is.
    pub kind: FindingKind,
    /// When it was first observed.
    pub at: Option<u64>,
    /// How often: periods, or executions.
    pub count: u64,
}

/// See [`Finding`]. Times are in nanoseconds.
#[derive(Debug, Clone, PartialEq)]
pub enum FindingKind {
    /// The recording does not have the instance.
    NotObserved,
    /// The priority of the thread; 0 without the real-time scheduler.
    Priority {
        /// That of the model; 0 in the background.
        expected: u32,
        /// That of the recording.
        observed: u32,
    },
    /// The CPUs that the thread may use, a bit each.
    Cpus {
        /// Those of the model.
        expected: u64,
        /// Those of the recording.
        observed: u64,
    },
    /// A period began on another CPU.
    OtherCpu {
        /// Those of the model, a bit each.
        expected: u64,
        /// The number of the CPU.
        observed: u32,
    },
    /// The instance executes the programs of another component.
    Component {
        /// That of the model.
        expected: String,
        /// That of the recording.
        observed: String,
    },
    /// The programs of a period are those of no edge.
    Path(UnknownPath),
    /// The component has no such program.
    UnknownProgram {
        /// Its key in a timing table.
        key: String,
    },
    /// The component does not call the codel.
    UnknownCodel {
        /// Its name.
        key: String,
        /// Whether another component of the deployment calls it.
        is_known: bool,
    },
    /// The deployment has no such instance.
    UnknownInstance {
        /// Its name.
        instance: String,
    },
    /// Executions exceeded a time of the tables more often than its level promises; `count` of them.
    ExecutionTime {
        /// The codel or program.
        key: String,
        /// The time.
        time: u64,
        /// The number of all executions.
        executions: u64,
        /// The number that exceed it on average, if the time holds.
        expected: f64,
        /// The longest execution.
        greatest: u64,
    },
    /// Periods executed longer than the greatest edge, more often than the level promises.
    Execution {
        /// The greatest edge.
        own: u64,
        /// The longest execution.
        greatest: u64,
    },
    /// The response time exceeds the bound, or, without a bound, the deadline.
    Response {
        /// R.
        bound: Option<u64>,
        /// D.
        deadline: Option<u64>,
        /// The greatest response time.
        response: u64,
        /// The execution time of this job.
        execution: u64,
        /// The greatest edge.
        own: Option<u64>,
        /// The others that executed, those first that exceed the bound most.
        interference: Vec<Interferer>,
    },
    /// Periods are missing; `count` of them.
    Skipped,
    /// The periods do not begin as often as the period says.
    Period {
        /// That of the model.
        expected: u64,
        /// The mean time between two begins.
        observed: u64,
    },
}

/// What was observed of an activity. Times are in nanoseconds.
#[derive(Debug, Clone, Default)]
pub struct ObservedInstance {
    /// Whether the recording has its name.
    pub is_observed: bool,
    /// The number of its periods.
    pub periods: u64,
    /// The mean time from begin to begin.
    pub interval: Option<u64>,
    /// The greatest response time: a lower bound, where the recording does not have releases.
    pub response: Option<Greatest>,
    /// The greatest difference of the delays from release to begin.
    pub jitter: Option<u64>,
    /// The greatest execution time of a period.
    pub execution: Option<Greatest>,
    /// Times without periods, after which the instance was at work again, and the end of the first.
    pub pauses: u64,
    /// See `pauses`.
    pub first_pause: Option<u64>,
    /// The priorities of its thread, with the number of periods.
    pub priorities: BTreeMap<u32, u64>,
    /// The CPUs that its thread might use, a bit each, with the number of periods.
    pub masks: BTreeMap<u64, u64>,
    /// The CPUs on which periods began, with their number.
    pub cpus: BTreeMap<u32, u64>,
    /// How often each edge of its state machine was observed; empty if the recording does not have its programs.
    pub edges: Vec<EdgeCount>,
    /// The codels of its component without an execution.
    pub codels_not_observed: Vec<String>,
}

/// What was observed of a codel, or of a program with a time of its own, in all instances.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedTime {
    /// Its key in a timing table.
    pub key: String,
    /// Whether it is a program.
    pub is_program: bool,
    /// The time in the tables.
    pub time: Option<u64>,
    /// The number of executions.
    pub executions: u64,
    /// How many of them exceeded the time.
    pub exceeded: u64,
    /// How probable so many are, if each exceeds with the probability of the level.
    pub probability: f64,
    /// The greatest execution time; none without an execution.
    pub greatest: Option<Greatest>,
    /// The instance with the greatest execution time.
    pub instance: String,
}

/// A recording beside a model.
#[derive(Debug, Clone, Default)]
pub struct Observed {
    /// In the order of [`Expected::instances`].
    pub instances: Vec<ObservedInstance>,
    /// Sorted by key.
    pub times: Vec<ObservedTime>,
    /// By instance, then those of none.
    pub findings: Vec<Finding>,
    /// Whether the recording has periods, and their releases.
    pub has_periods: bool,
    /// See `has_periods`.
    pub has_releases: bool,
    /// Whether it has programs.
    pub has_programs: bool,
    /// Whether it has priorities and CPUs of threads.
    pub has_scheduling: bool,
    /// Whether it has the CPUs on which periods began.
    pub has_cpus: bool,
    /// Whether it names instances.
    pub has_instances: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Period,
    /// The number of the program in the state machine.
    Program(u32),
    Operation,
    /// `configure`, `start`, `stop` or `cleanup`: the state is unknown afterwards.
    Hook,
    UnknownProgram,
    /// A program of an instance whose behaviour is unknown, or that the deployment does not have.
    AnyProgram,
    OtherComponent,
    Codel,
    UnknownCodel {
        is_known: bool,
    },
}

/// The executions of one name.
#[derive(Debug)]
struct Series {
    role: Role,
    /// The index of the instance; none if the deployment does not have it.
    instance: Option<usize>,
    time: Option<u64>,
    executions: u64,
    exceeded: u64,
    first: Option<u64>,
    greatest: Option<Greatest>,
}

#[derive(Debug)]
struct Instance {
    observed: ObservedInstance,
    path: Option<Path>,
    releases: Option<Releases<Cause>>,
    /// The programs since the last period, with their begins.
    programs: Vec<(Option<u64>, u32)>,
    has_programs: bool,
    /// Programs were too many, or periods are missing: the path is not compared.
    is_interrupted: bool,
    last_end: u64,
    /// The number of codels and other spans since the last period, and the greatest one of codels in a period.
    spans: u64,
    codels: u64,
    most_codels: u64,
    /// Periods with a longer execution than the greatest edge, and the first.
    long: u64,
    first_long: Option<u64>,
    paths: Vec<(UnknownPath, u64, Option<u64>)>,
    first_priority: BTreeMap<u32, Option<u64>>,
    first_mask: BTreeMap<u64, Option<u64>>,
    first_cpu: BTreeMap<u32, Option<u64>>,
}

/// A period that was recorded, to say who delayed others.
#[derive(Debug, Clone, Copy)]
struct Recent {
    instance: usize,
    begin: u64,
    end: u64,
    execution: u64,
}

/// Compares a recording with a model: see the module.
#[derive(Debug)]
pub struct Observer {
    expected: Expected,
    by_name: FxHashMap<String, usize>,
    programs: Vec<FxHashMap<String, u32>>,
    instances: Vec<Instance>,
    /// By number of the name.
    series: Vec<Option<Series>>,
    recent: Vec<Recent>,
    next_recent: usize,
    /// Times in which executions may be missing, in order.
    gaps: Vec<(u64, u64)>,
    has_releases: bool,
}

impl Observer {
    /// Begins with a recording.
    pub fn new(expected: Expected) -> Observer {
        let names = expected.instances.iter().enumerate();
        let by_name = names.map(|(index, it)| (it.instance.clone(), index)).collect();
        let programs = |it: &ExpectedInstance| {
            let all = it.machine.iter().flat_map(|machine| &machine.programs).enumerate();
            all.map(|(index, program)| (program.clone(), index as u32)).collect()
        };
        let instance = |it: &ExpectedInstance| Instance {
            observed: ObservedInstance::default(),
            path: it.machine.as_ref().map(Path::new),
            releases: releases_of(it),
            programs: Vec::new(),
            has_programs: false,
            is_interrupted: true,
            last_end: 0,
            spans: 0,
            codels: 0,
            most_codels: 0,
            long: 0,
            first_long: None,
            paths: Vec::new(),
            first_priority: BTreeMap::new(),
            first_mask: BTreeMap::new(),
            first_cpu: BTreeMap::new(),
        };
        Observer {
            by_name,
            programs: expected.instances.iter().map(programs).collect(),
            instances: expected.instances.iter().map(instance).collect(),
            series: Vec::new(),
            recent: Vec::new(),
            next_recent: 0,
            gaps: Vec::new(),
            has_releases: false,
            expected,
        }
    }

    /// Returns what a name of the recording is in the model.
    fn series_of(&self, id: NameId, names: &Names) -> Series {
        let name = names.get(id);
        let instance = self.by_name.get(&name.instance).copied();
        let of_model = instance.and_then(|index| self.expected.instances.get(index));
        let mut time = None;
        let role = match name.kind {
            SpanKind::Period => Role::Period,
            SpanKind::Codel => {
                let known = self.expected.codels.get(&name.key);
                time = known.copied().flatten();
                let is_called = match of_model {
                    Some(it) => it.codels.as_ref().is_none_or(|codels| codels.contains(&name.key)),
                    None => known.is_some() || !name.instance.is_empty(),
                };
                if is_called { Role::Codel } else { Role::UnknownCodel { is_known: known.is_some() } }
            }
            SpanKind::Program => {
                time = self.expected.programs.get(&name.key).copied();
                let (component, program) = name.key.rsplit_once('/').unwrap_or_default();
                let machine = of_model.and_then(|it| it.machine.as_ref());
                let number = instance.and_then(|index| self.programs.get(index)?.get(program)).copied();
                let is_hook = ["configure", "start", "stop", "cleanup"].contains(&program);
                match (machine, number) {
                    _ if of_model
                        .and_then(|it| it.component.as_deref())
                        .is_some_and(|it| it != component) =>
                    {
                        Role::OtherComponent
                    }
                    (_, Some(number)) => Role::Program(number),
                    (None, None) => Role::AnyProgram,
                    (Some(machine), None) if machine.operations.contains(program) => Role::Operation,
                    (Some(_), None) if is_hook => Role::Hook,
                    (Some(_), None) => Role::UnknownProgram,
                }
            }
        };
        Series { role, instance, time, executions: 0, exceeded: 0, first: None, greatest: None }
    }

    fn period(&mut self, index: usize, span: &Span) {
        let Some((instance, expected)) =
            self.instances.get_mut(index).zip(self.expected.instances.get(index))
        else {
            return;
        };
        let observed = &mut instance.observed;
        observed.periods += 1;
        if observed.execution.is_none_or(|greatest| greatest.time < span.execution) {
            observed.execution = Some(Greatest { time: span.execution, at: span.end });
        }
        count(
            &mut observed.priorities,
            &mut instance.first_priority,
            span.scheduling.map(|it| it.priority),
            span,
        );
        let mask = span.scheduling.map(|it| it.cpus).filter(|cpus| *cpus != 0);
        count(&mut observed.masks, &mut instance.first_mask, mask, span);
        count(&mut observed.cpus, &mut instance.first_cpu, span.cpu, span);
        self.has_releases |= span.release.is_some();

        // What tracing itself took is no execution of the model.
        let tracing = if span.thread.is_some() { TRACING.0 + instance.spans * TRACING.1 } else { 0 };
        instance.most_codels = instance.most_codels.max(instance.codels);
        (instance.spans, instance.codels) = (0, 0);
        if expected.own.is_some_and(|own| span.execution > own.saturating_add(tracing)) {
            instance.long += 1;
            instance.first_long = instance.first_long.or(span.end);
        }

        let (Some(begin), Some(end)) = (span.begin, span.end) else {
            instance.programs.clear();
            return;
        };
        let last_end = std::mem::replace(&mut instance.last_end, end);
        // A gap that overlaps the time since the last period.
        let first = self.gaps.partition_point(|gap| gap.1 < last_end);
        let has_gap = self.gaps.get(first).is_some_and(|gap| gap.0 <= end);
        let recent = &self.recent;
        let mut cause = |from: i64, to: i64| cause_of(recent, index, from, to);
        if let Some(releases) = &mut instance.releases {
            if has_gap {
                releases.interrupt(&mut cause);
            }
            if let Some(job) = job_of(span) {
                releases.job(job, &mut cause);
            }
        }
        let mut programs = std::mem::take(&mut instance.programs);
        let was_interrupted = std::mem::take(&mut instance.is_interrupted) || has_gap;
        if let (Some(path), Some(machine)) = (&mut instance.path, &expected.machine) {
            if was_interrupted {
                path.forget();
            }
            // The first period of a recording may lack programs: LTTng enables one event after the other.
            let is_first = observed.periods == 1 && span.thread.is_some();
            let executed: Vec<u32> = programs
                .iter()
                .filter(|(at, _)| at.is_none_or(|at| at >= begin))
                .map(|(_, program)| *program)
                .collect();
            if instance.has_programs
                && !is_first
                && let Some(unknown) = path.period(machine, &executed)
            {
                match instance.paths.iter().position(|(path, ..)| *path == unknown) {
                    Some(place) => {
                        if let Some((_, count, _)) = instance.paths.get_mut(place) {
                            *count += 1;
                        }
                    }
                    None if instance.paths.len() < MOST_PATHS => {
                        instance.paths.push((unknown, 1, Some(begin)));
                    }
                    None => {}
                }
            }
        }
        programs.clear();
        instance.programs = programs;

        let recent = Recent { instance: index, begin, end, execution: span.execution };
        match self.recent.get_mut(self.next_recent) {
            Some(place) => *place = recent,
            None => self.recent.push(recent),
        }
        self.next_recent = (self.next_recent + 1) % REMEMBERED;
    }

    /// Ends a recording; another one of the same deployment may follow.
    pub fn end_recording(&mut self) {
        let recent = std::mem::take(&mut self.recent);
        self.next_recent = 0;
        self.gaps.clear();
        for (index, instance) in self.instances.iter_mut().enumerate() {
            if let Some(releases) = &mut instance.releases {
                releases.interrupt(&mut |from, to| cause_of(&recent, index, from, to));
            }
            instance.programs.clear();
            (instance.is_interrupted, instance.last_end) = (true, 0);
        }
    }

    /// Returns what was observed. `names` are those of the recording.
    pub fn finish(mut self, names: &Names) -> Observed {
        let mut observed = Observed { has_releases: self.has_releases, ..Observed::default() };
        let all: Vec<(NameId, Series)> = names
            .ids()
            .zip(std::mem::take(&mut self.series))
            .filter_map(|(id, series)| Some((id, series?)))
            .collect();
        for (id, series) in &all {
            let name = names.get(*id);
            observed.has_instances |= !name.instance.is_empty();
            observed.has_programs |= name.kind == SpanKind::Program;
            observed.has_periods |= name.kind == SpanKind::Period;
            if let Some(instance) = series.instance.and_then(|index| self.instances.get_mut(index)) {
                instance.observed.is_observed = true;
            }
        }
        let by_key = times(&self.expected, names, &all);
        let recent = std::mem::take(&mut self.recent);
        for (index, instance) in std::mem::take(&mut self.instances).into_iter().enumerate() {
            if let Some(expected) = self.expected.instances.get(index) {
                let own = all.iter().filter(|(_, series)| series.instance == Some(index));
                let own: Vec<(&str, &Series)> =
                    own.map(|(id, series)| (names.get(*id).key.as_str(), series)).collect();
                let mut context = Finish {
                    index,
                    all: &self.expected,
                    expected,
                    recent: &recent,
                    has_instances: observed.has_instances,
                    findings: &mut observed.findings,
                };
                let found = context.instance(instance, &own);
                observed.has_scheduling |= !found.priorities.is_empty();
                observed.has_cpus |= !found.cpus.is_empty();
                observed.instances.push(found);
            }
        }
        let unknown = all.iter().filter(|(_, series)| series.instance.is_none());
        let mut strangers: BTreeMap<&str, (u64, Option<u64>)> = BTreeMap::new();
        for (id, series) in unknown {
            let name = names.get(*id);
            if !name.instance.is_empty() {
                let (count, first) = strangers.entry(&name.instance).or_default();
                *count += series.executions;
                *first = first.map_or(series.first, |first| Some(first.min(series.first.unwrap_or(first))));
            } else if let Role::UnknownCodel { is_known } = series.role {
                let kind = FindingKind::UnknownCodel { key: name.key.clone(), is_known };
                let (at, count) = (series.first, series.executions);
                observed.findings.push(Finding { instance: None, kind, at, count });
            }
        }
        for (instance, (count, at)) in strangers {
            let kind = FindingKind::UnknownInstance { instance: instance.to_owned() };
            observed.findings.push(Finding { instance: None, kind, at, count });
        }
        for it in by_key.iter().filter(|it| it.probability < IMPROBABLE) {
            let kind = FindingKind::ExecutionTime {
                key: it.key.clone(),
                time: it.time.unwrap_or_default(),
                executions: it.executions,
                expected: it.executions as f64 * self.expected.level,
                greatest: it.greatest.map_or(0, |greatest| greatest.time),
            };
            let at = it.greatest.and_then(|greatest| greatest.at);
            observed.findings.push(Finding { instance: None, kind, at, count: it.exceeded });
        }
        observed.times = by_key;
        observed
    }
}

impl Visitor for Observer {
    fn span(&mut self, span: &Span, names: &Names) -> ControlFlow<()> {
        let id = span.name.index();
        if self.series.len() <= id {
            self.series.resize_with(id + 1, || None);
        }
        if self.series.get(id).is_none_or(Option::is_none) {
            let new = self.series_of(span.name, names);
            if let Some(place) = self.series.get_mut(id) {
                *place = Some(new);
            }
        }
        let Some(Some(series)) = self.series.get_mut(id) else { return ControlFlow::Continue(()) };
        series.executions += 1;
        series.exceeded += u64::from(series.time.is_some_and(|time| span.execution > time));
        series.first = series.first.or(span.begin);
        if series.greatest.is_none_or(|greatest| greatest.time < span.execution) {
            series.greatest = Some(Greatest { time: span.execution, at: span.end });
        }
        let Some(index) = series.instance else { return ControlFlow::Continue(()) };
        let role = series.role;
        if role == Role::Period {
            self.period(index, span);
            return ControlFlow::Continue(());
        }
        let Some(instance) = self.instances.get_mut(index) else { return ControlFlow::Continue(()) };
        instance.spans += 1;
        match role {
            Role::Codel | Role::UnknownCodel { .. } => instance.codels += 1,
            Role::Hook => {
                instance.is_interrupted = true;
                instance.programs.clear();
            }
            Role::Program(program) => {
                instance.has_programs = true;
                if instance.programs.len() < MOST_PROGRAMS {
                    instance.programs.push((span.begin, program));
                }
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn lost(&mut self, begin: u64, end: u64) {
        // Most are at the end, and many are one.
        if let Some(last) = self.gaps.last_mut()
            && last.0 <= begin
            && begin <= last.1
        {
            last.1 = last.1.max(end);
            return;
        }
        if self.gaps.len() >= MOST_GAPS {
            self.gaps.drain(..MOST_GAPS / 2);
        }
        let at = self.gaps.partition_point(|gap| gap.0 <= begin);
        self.gaps.insert(at, (begin, end.max(begin)));
    }
}

/// The releases of periods while a recording is read: as recorded, or the latest ones that agree with the periods so far.
#[derive(Debug)]
pub struct LatestReleases(Vec<Option<Releases<()>>>);

impl LatestReleases {
    /// Begins with a recording.
    pub fn new(expected: &Expected) -> LatestReleases {
        LatestReleases(expected.instances.iter().map(releases_of).collect())
    }

    /// Takes the next period of the instance with this index; returns its release in nanoseconds, if it is known.
    pub fn release(&mut self, instance: usize, period: &Span) -> Option<i64> {
        let releases = self.0.get_mut(instance)?.as_mut()?;
        releases.job(job_of(period)?, &mut |_, _| ());
        releases.last_release()
    }

    /// Periods may be missing here.
    pub fn interrupt(&mut self) {
        self.0.iter_mut().flatten().for_each(|releases| releases.interrupt(&mut |_, _| ()));
    }
}

fn releases_of<C: Clone + Default>(it: &ExpectedInstance) -> Option<Releases<C>> {
    let period = it.period.filter(|_| it.priority != Priority::Background)?;
    Some(Releases::new(period, it.response.or(it.deadline)))
}

fn job_of(span: &Span) -> Option<Job> {
    let signed = |time: u64| i64::try_from(time).unwrap_or(i64::MAX / 4);
    Some(Job {
        begin: signed(span.begin?),
        end: signed(span.end?),
        execution: signed(span.execution),
        release: span.release.map(signed),
    })
}

/// Counts a value of a period, and remembers when it was first seen.
fn count<T: Copy + Ord>(
    counts: &mut BTreeMap<T, u64>,
    first: &mut BTreeMap<T, Option<u64>>,
    value: Option<T>,
    span: &Span,
) {
    let Some(value) = value else { return };
    if counts.len() < MOST_SCHEDULINGS || counts.contains_key(&value) {
        *counts.entry(value).or_default() += 1;
        first.entry(value).or_insert(span.begin);
    }
}

/// Returns what the others executed between two times.
fn cause_of(recent: &[Recent], instance: usize, from: i64, to: i64) -> Cause {
    let (Ok(from), Ok(to)) = (u64::try_from(from), u64::try_from(to)) else { return Cause::default() };
    let mut others: BTreeMap<usize, (u64, u64)> = BTreeMap::new();
    for it in recent.iter().filter(|it| it.instance != instance && it.begin < to && it.end > from) {
        let overlap = it.end.min(to).saturating_sub(it.begin.max(from));
        let (jobs, execution) = others.entry(it.instance).or_default();
        *jobs += 1;
        *execution += it.execution.min(overlap);
    }
    Cause { time: to - from, others }
}

/// Returns what was observed of codels and of programs with times of their own.
fn times(expected: &Expected, names: &Names, all: &[(NameId, Series)]) -> Vec<ObservedTime> {
    let new = |key: &str, is_program, time| ObservedTime {
        key: key.to_owned(),
        is_program,
        time,
        executions: 0,
        exceeded: 0,
        probability: 1.0,
        greatest: None,
        instance: String::new(),
    };
    let codels = expected.codels.iter().map(|(key, time)| new(key, false, *time));
    let programs = expected.programs.iter().map(|(key, time)| new(key, true, Some(*time)));
    let mut found: BTreeMap<String, ObservedTime> =
        codels.chain(programs).map(|it| (it.key.clone(), it)).collect();
    for (id, series) in all {
        let name = names.get(*id);
        let Some(it) = found.get_mut(&name.key).filter(|_| name.kind != SpanKind::Period) else { continue };
        it.executions += series.executions;
        it.exceeded += series.exceeded;
        if it.greatest.map(|it| it.time) < series.greatest.map(|it| it.time) {
            it.greatest = series.greatest;
            it.instance.clone_from(&name.instance);
        }
    }
    let mut found: Vec<ObservedTime> = found.into_values().collect();
    for it in &mut found {
        it.probability = exceedance_probability(it.executions, it.exceeded, expected.level);
    }
    found
}

/// The findings about one instance.
struct Finish<'a> {
    index: usize,
    all: &'a Expected,
    expected: &'a ExpectedInstance,
    recent: &'a [Recent],
    has_instances: bool,
    findings: &'a mut Vec<Finding>,
}

impl Finish<'_> {
    fn add(&mut self, kind: FindingKind, at: Option<u64>, count: u64) {
        self.findings.push(Finding { instance: Some(self.index), kind, at, count });
    }

    fn instance(&mut self, mut it: Instance, series: &[(&str, &Series)]) -> ObservedInstance {
        if !it.observed.is_observed {
            // Without names of instances, none can be missing.
            if self.has_instances {
                self.add(FindingKind::NotObserved, None, 0);
            }
            return it.observed;
        }
        self.scheduling(&it);
        self.names(series);
        for (path, count, at) in std::mem::take(&mut it.paths) {
            self.add(FindingKind::Path(path), at, count);
        }
        if let Some(mut path) = it.path.take() {
            path.count(None);
            if it.has_programs && it.observed.periods > 0 {
                it.observed.edges = path.counts;
            }
        }
        let called: BTreeSet<&str> = series.iter().map(|(key, _)| *key).collect();
        let codels = self.expected.codels.iter().flatten();
        it.observed.codels_not_observed =
            codels.filter(|codel| !called.contains(codel.as_str())).cloned().collect();
        self.execution(&it);
        self.releases(&mut it);
        it.observed
    }

    fn scheduling(&mut self, it: &Instance) {
        let priority = match self.expected.priority {
            Priority::RealTime(priority) => Some(priority),
            Priority::Background => Some(0),
            Priority::Unknown => None,
        };
        for (&observed, &count) in &it.observed.priorities {
            if let Some(expected) = priority.filter(|expected| *expected != observed) {
                let at = it.first_priority.get(&observed).copied().flatten();
                self.add(FindingKind::Priority { expected, observed }, at, count);
            }
        }
        let Some(expected) = self.expected.cpus.filter(|cpus| *cpus != 0) else { return };
        for (&observed, &count) in &it.observed.masks {
            if expected != observed {
                let at = it.first_mask.get(&observed).copied().flatten();
                self.add(FindingKind::Cpus { expected, observed }, at, count);
            }
        }
        // A wrong mask says it already.
        if it.observed.masks.keys().any(|mask| *mask != expected) {
            return;
        }
        for (&observed, &count) in &it.observed.cpus {
            if observed >= 64 || expected >> observed & 1 == 0 {
                let at = it.first_cpu.get(&observed).copied().flatten();
                self.add(FindingKind::OtherCpu { expected, observed }, at, count);
            }
        }
    }

    fn names(&mut self, series: &[(&str, &Series)]) {
        let mut components: BTreeMap<&str, (Option<u64>, u64)> = BTreeMap::new();
        for (key, it) in series {
            match it.role {
                Role::OtherComponent => {
                    let component = key.rsplit_once('/').map_or(*key, |(component, _)| component);
                    let (at, count) = components.entry(component).or_insert((it.first, 0));
                    *count += it.executions;
                    *at = (*at).min(it.first);
                }
                Role::UnknownProgram => {
                    let kind = FindingKind::UnknownProgram { key: (*key).to_owned() };
                    self.add(kind, it.first, it.executions);
                }
                Role::UnknownCodel { is_known } => {
                    let kind = FindingKind::UnknownCodel { key: (*key).to_owned(), is_known };
                    self.add(kind, it.first, it.executions);
                }
                _ => {}
            }
        }
        for (observed, (at, count)) in components {
            let expected = self.expected.component.clone().unwrap_or_default();
            self.add(FindingKind::Component { expected, observed: observed.to_owned() }, at, count);
        }
    }

    fn execution(&mut self, it: &Instance) {
        let Some((own, greatest)) = self.expected.own.zip(it.observed.execution) else { return };
        // If a codel exceeds its time, its period may exceed its own.
        let probability = (self.all.level * it.most_codels.max(1) as f64).min(1.0);
        if exceedance_probability(it.observed.periods, it.long, probability) < IMPROBABLE {
            self.add(FindingKind::Execution { own, greatest: greatest.time }, it.first_long, it.long);
        }
    }

    fn releases(&mut self, it: &mut Instance) {
        let Some(releases) = it.releases.take() else { return };
        let (recent, index) = (self.recent, self.index);
        let found = releases.finish(&mut |from, to| cause_of(recent, index, from, to));
        let unsigned = |time: i64| u64::try_from(time).unwrap_or(0);
        it.observed.interval = found.interval();
        it.observed.jitter = found.jitter.map(unsigned);
        (it.observed.pauses, it.observed.first_pause) = (found.pauses, found.first_pause.map(unsigned));
        let period = self.expected.period.unwrap_or_default();
        if let Some(observed) = found.other_period(period) {
            // Neither releases nor response times are known.
            it.observed.jitter = None;
            self.add(FindingKind::Period { expected: period, observed }, None, it.observed.periods);
            return;
        }
        if found.skipped > 0 {
            self.add(FindingKind::Skipped, found.first_skipped.map(unsigned), found.skipped);
        }
        let Some(longest) = found.longest else { return };
        let response = unsigned(longest.response);
        let at = unsigned(longest.job.end);
        it.observed.response = Some(Greatest { time: response, at: Some(at) });
        let (bound, deadline) = (self.expected.response, self.expected.deadline);
        if bound.or(deadline).is_some_and(|limit| response > limit) {
            let kind = FindingKind::Response {
                bound,
                deadline,
                response,
                execution: unsigned(longest.job.execution),
                own: self.expected.own,
                interference: self.interference(&longest.cause),
            };
            self.add(kind, Some(at), found.late.max(1));
        }
    }

    fn interference(&self, cause: &Cause) -> Vec<Interferer> {
        let mut all: Vec<Interferer> = cause
            .others
            .iter()
            .filter_map(|(&index, &(jobs, execution))| {
                let instance = self.all.instances.get(index)?.instance.clone();
                let bound = self.expected.interference.iter().find(|it| it.instance.as_str() == instance);
                let bound = bound.map_or((0, 0), |it| (it.jobs, it.time.as_nanos()));
                Some(Interferer { instance, jobs, execution, bound_jobs: bound.0, bound: bound.1 })
            })
            // On another CPU it delays nothing.
            .filter(|it| it.bound_jobs > 0 || self.shares_cpu(&it.instance))
            .collect();
        all.sort_by_key(|it| std::cmp::Reverse((it.execution.saturating_sub(it.bound), it.execution)));
        all
    }

    fn shares_cpu(&self, instance: &str) -> bool {
        let other = self.all.instances.iter().find(|it| it.instance == instance);
        let cpus = |it: &ExpectedInstance| it.cpus.unwrap_or(u64::MAX);
        other.is_some_and(|other| cpus(other) & cpus(self.expected) != 0)
    }
}
