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
//! | `chain_model.rs` | the chains and connections of the model |
//! | `chains.rs` | the way of data, and its latency |
//! | `conclusion.rs` | from counters to findings |
//! | `findings.rs` | the result |

mod chain_model;
mod chains;
mod conclusion;
mod findings;
mod model;
mod path;
mod releases;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use mauve_pwcet::trace::{NameId, Observation, Span, SpanKind, SpanNames, Visitor};
use mauve_timing::{CpuSet, Priority};
use rustc_hash::FxHashMap;

pub use chain_model::{ExpectedChain, ExpectedConnection, ExpectedEnd, ExpectedStep, expected_chains};
pub use findings::{
    FindingKind, Greatest, Interferer, ObservedChain, ObservedConnection, ObservedDeployment,
    ObservedInstance, ObservedTime, SeenPeriods, TraceFinding, Waited, Worst,
};
pub use model::{ExpectedDeployment, ExpectedInstance, ExpectedLevel, ExpectedMachine, expected};
pub use path::{EdgeCount, UnknownPath};

use chains::ChainObserver;
use path::MachinePath;
use releases::{LATEST, RecordedJob, Releases};

pub use crate::timetable::IMPROBABLE;

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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TracedName {
    Period,
    /// The number of the program in the state machine.
    Program(u32),
    /// `configure`, `start`, `stop` or `cleanup`: the state is unknown afterwards.
    Hook,
    UnknownProgram,
    OtherComponent,
    Codel,
    UnknownCodel {
        is_known: bool,
    },
    /// An access to a port, a lock, an operation; a program of an instance whose behaviour is unknown, or that the deployment does not
    /// have.
    Other,
}

/// The executions of one name.
#[derive(Debug)]
struct Tally {
    role: TracedName,
    /// The index of the instance; none if the deployment does not have it.
    instance: Option<usize>,
    time: Option<u64>,
    executions: u64,
    exceeded: u64,
    /// For each of [`ExpectedDeployment::levels`], the time, and how many executions exceeded it.
    of_levels: Vec<(Option<u64>, u64)>,
    first: Option<u64>,
    greatest: Option<Greatest>,
}

#[derive(Debug, Default)]
struct InstanceObserver {
    observed: ObservedInstance,
    path: Option<MachinePath>,
    releases: Option<Releases<Causes>>,
    /// The programs since the last period, with their begins.
    programs: Vec<(Option<u64>, u32)>,
    has_programs: bool,
    /// Programs were too many, or periods are missing: the path is not compared.
    is_interrupted: bool,
    /// Whether the recording has the overhead of its periods.
    has_overhead: bool,
    last_end: u64,
    /// The number of codels and other spans since the last period, and the greatest one of codels in a period.
    spans: u64,
    codels: u64,
    most_codels: u64,
    /// The execution time of the codels and of the accesses to ports since the last period.
    measured: u64,
    /// What its thread executed besides these in the last period, up to its end.
    unmeasured: u64,
    /// Periods with a longer execution than the greatest edge, and the first.
    long: u64,
    first_long: Option<u64>,
    paths: Vec<(UnknownPath, u64, Option<u64>)>,
}

impl InstanceObserver {
    /// Compares the programs of a period that began at `begin` with the edges of its state machine.
    fn follow(&mut self, machine: &ExpectedMachine, begin: u64, was_interrupted: bool, is_first: bool) {
        let Some(path) = &mut self.path else { return };
        if was_interrupted {
            path.forget();
        }
        if !self.has_programs || is_first {
            return;
        }
        let in_period = self.programs.iter().filter(|(at, _)| at.is_none_or(|at| at >= begin));
        let executed: Vec<u32> = in_period.map(|(_, program)| *program).collect();
        let Some(unknown) = path.period(machine, &executed) else { return };
        let known = self.paths.iter_mut().find(|(path, ..)| *path == unknown);
        if let Some((_, count, _)) = known {
            *count += 1;
        } else if self.paths.len() < MOST_PATHS {
            self.paths.push((unknown, 1, Some(begin)));
        }
    }
}

/// Where a response time comes from: of each other instance, the number of periods and their execution time.
type Causes = BTreeMap<usize, (u64, u64)>;

/// A period that was recorded, to say who delayed others.
#[derive(Debug, Clone, Copy)]
struct Recent {
    instance: usize,
    begin: u64,
    end: u64,
    execution: u64,
}

/// Compares a recording with a model: see the module.
#[derive(Debug, Default)]
pub struct Observer {
    expected: ExpectedDeployment,
    by_name: FxHashMap<String, usize>,
    programs: Vec<FxHashMap<String, u32>>,
    instances: Vec<InstanceObserver>,
    series: BTreeMap<NameId, Tally>,
    recent: Vec<Recent>,
    next_recent: usize,
    /// Times in which executions may be missing, in order.
    gaps: Vec<(u64, u64)>,
    lacks_releases: bool,
    /// What codels waited, and what ports took.
    observation: Observation,
    chains: ChainObserver,
}

impl Observer {
    /// Begins with a recording.
    pub fn new(expected: ExpectedDeployment) -> Observer {
        let names = expected.instances.iter().enumerate();
        let by_name = names.map(|(index, it)| (it.instance.clone(), index)).collect();
        let programs = |it: &ExpectedInstance| {
            let all = it.machine.iter().flat_map(|machine| &machine.programs).enumerate();
            all.map(|(index, program)| (program.clone(), index as u32)).collect()
        };
        let instance = |it: &ExpectedInstance| InstanceObserver {
            path: it.machine.as_ref().map(MachinePath::new),
            releases: releases_of(it),
            is_interrupted: true,
            ..InstanceObserver::default()
        };
        Observer {
            by_name,
            programs: expected.instances.iter().map(programs).collect(),
            instances: expected.instances.iter().map(instance).collect(),
            chains: ChainObserver::new(&expected.chains, &expected.connections),
            expected,
            ..Observer::default()
        }
    }

    /// Returns what a name of the recording is in the model.
    fn series_of(&self, id: NameId, names: &SpanNames) -> Tally {
        let name = names.get(id);
        let instance = self.by_name.get(&name.instance).copied();
        let of_model = instance.and_then(|index| self.expected.instances.get(index));
        let known = self
            .expected
            .times
            .get(&name.key)
            .filter(|_| !matches!(name.kind, SpanKind::Period | SpanKind::Lock));
        let role = match name.kind {
            SpanKind::Period => TracedName::Period,
            SpanKind::Access | SpanKind::Lock => TracedName::Other,
            SpanKind::Codel => {
                let is_called = match of_model {
                    Some(it) => it.codels.as_ref().is_none_or(|codels| codels.contains(&name.key)),
                    None => known.is_some() || !name.instance.is_empty(),
                };
                if is_called {
                    TracedName::Codel
                } else {
                    TracedName::UnknownCodel { is_known: known.is_some() }
                }
            }
            SpanKind::Program => {
                let (component, program) = name.key.rsplit_once('/').unwrap_or_default();
                let machine = of_model.and_then(|it| it.machine.as_ref());
                let number = instance.and_then(|index| self.programs.get(index)?.get(program)).copied();
                let is_hook = ["configure", "start", "stop", "cleanup"].contains(&program);
                match (machine, number) {
                    _ if of_model
                        .and_then(|it| it.component.as_deref())
                        .is_some_and(|it| it != component) =>
                    {
                        TracedName::OtherComponent
                    }
                    (_, Some(number)) => TracedName::Program(number),
                    (None, None) => TracedName::Other,
                    (Some(machine), None) if machine.operations.contains(program) => TracedName::Other,
                    (Some(_), None) if is_hook => TracedName::Hook,
                    (Some(_), None) => TracedName::UnknownProgram,
                }
            }
        };
        let of_levels = match name.kind {
            SpanKind::Period => Vec::new(),
            _ => self.expected.levels.iter().map(|it| (it.times.get(&name.key).copied(), 0)).collect(),
        };
        let time = known.copied().flatten();
        Tally { role, instance, time, executions: 0, exceeded: 0, of_levels, first: None, greatest: None }
    }

    fn period(&mut self, index: usize, span: &Span) {
        // That of the instances before it in its thread.
        let unmeasured_before =
            index.checked_sub(1).and_then(|it| self.instances.get(it)).map(|it| it.unmeasured);
        let Some((instance, expected)) =
            self.instances.get_mut(index).zip(self.expected.instances.get(index))
        else {
            return;
        };
        let observed = &mut instance.observed;
        observed.periods += 1;
        Greatest::raise(&mut observed.execution, span.execution, span.end);
        count(&mut observed.priorities, span.scheduling.map(|it| it.priority), span);
        let cpus = span.scheduling.map(|it| CpuSet(it.cpus.into())).filter(|cpus| !cpus.is_empty());
        count(&mut observed.masks, cpus, span);
        count(&mut observed.cpus, span.cpu, span);
        self.lacks_releases |= span.release.is_none();

        // What tracing itself took is no execution of the model.
        let tracing = if span.thread.is_some() { TRACING.0 + instance.spans * TRACING.1 } else { 0 };
        instance.most_codels = instance.most_codels.max(instance.codels);
        let measured = std::mem::take(&mut instance.measured);
        // Recordings of earlier versions lack the wake-up. Of the first period of a thread, no recording has it.
        if span.overhead.is_some() && !std::mem::replace(&mut instance.has_overhead, true) {
            instance.observed.overhead = None;
        }
        let is_derived = instance.codels > 0 && span.thread.is_none() && !instance.has_overhead;
        let before = unmeasured_before.filter(|_| !expected.wakes).unwrap_or_default();
        instance.unmeasured = span.execution.saturating_sub(measured).saturating_add(before);
        let of_period = is_derived.then_some(instance.unmeasured);
        instance.observed.overhead = instance.observed.overhead.max(span.overhead.or(of_period));
        (instance.spans, instance.codels) = (0, 0);
        if expected.own.is_some_and(|own| span.execution > own.saturating_add(tracing)) {
            instance.long += 1;
            instance.first_long = instance.first_long.or(span.end);
        }

        let (Some(begin), Some(end)) = (span.begin, span.end) else {
            instance.observed.untimed += 1;
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
        let was_interrupted = std::mem::take(&mut instance.is_interrupted) || has_gap;
        if let Some(machine) = &expected.machine {
            // The first period of a recording may lack programs: LTTng enables one event after the other.
            let is_first = instance.observed.periods == 1 && span.thread.is_some();
            instance.follow(machine, begin, was_interrupted, is_first);
        }
        instance.programs.clear();

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
        self.observation.end_recording();
        self.chains.end_recording();
        for (index, instance) in self.instances.iter_mut().enumerate() {
            if let Some(releases) = &mut instance.releases {
                releases.interrupt(&mut |from, to| cause_of(&recent, index, from, to));
            }
            instance.programs.clear();
            (instance.is_interrupted, instance.last_end) = (true, 0);
        }
    }
}

impl Visitor for Observer {
    fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
        self.observation.add(span, names);
        self.chains.span(&self.expected, span, names);
        if !self.series.contains_key(&span.name) {
            self.series.insert(span.name, self.series_of(span.name, names));
        }
        let Some(series) = self.series.get_mut(&span.name) else { return ControlFlow::Continue(()) };
        series.executions += 1;
        series.exceeded += u64::from(series.time.is_some_and(|time| span.execution > time));
        for (time, exceeded) in &mut series.of_levels {
            *exceeded += u64::from(time.is_some_and(|time| span.execution > time));
        }
        series.first = series.first.or(span.begin);
        Greatest::raise(&mut series.greatest, span.execution, span.end);
        let Some(index) = series.instance else { return ControlFlow::Continue(()) };
        let role = series.role;
        if role == TracedName::Period {
            self.period(index, span);
            return ControlFlow::Continue(());
        }
        let Some(instance) = self.instances.get_mut(index) else { return ControlFlow::Continue(()) };
        instance.spans += 1;
        if matches!(names.get(span.name).kind, SpanKind::Codel | SpanKind::Access) {
            instance.measured = instance.measured.saturating_add(span.execution);
        }
        match role {
            TracedName::Codel | TracedName::UnknownCodel { .. } => instance.codels += 1,
            TracedName::Hook => {
                instance.is_interrupted = true;
                instance.programs.clear();
            }
            TracedName::Program(program) => {
                instance.has_programs = true;
                if instance.programs.len() < MOST_PROGRAMS {
                    instance.programs.push((span.begin, program));
                }
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn work(&mut self, thread: &str, cpu: u64, elapsed: u64) {
        self.observation.add_work(thread, cpu, elapsed);
    }

    /// The times are those of one level: at the others, each execution would be too long, or none.
    fn times_are_from_tables(&mut self) -> ControlFlow<()> {
        self.expected.levels.clear();
        ControlFlow::Continue(())
    }

    fn lost(&mut self, begin: u64, end: u64) {
        self.chains.lose(end);
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
    pub fn new(expected: &ExpectedDeployment) -> LatestReleases {
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
    Some(Releases::new(period, it.burst, it.response.or(it.deadline)))
}

fn job_of(span: &Span) -> Option<RecordedJob> {
    let signed = |time: u64| i64::try_from(time).unwrap_or(LATEST).min(LATEST);
    Some(RecordedJob {
        begin: signed(span.begin?),
        end: signed(span.end?),
        execution: signed(span.execution),
        release: span.release.map(signed),
    })
}

/// Counts a value of a period, and remembers when it was first seen.
fn count<T: Ord>(counts: &mut BTreeMap<T, SeenPeriods>, value: Option<T>, span: &Span) {
    let Some(value) = value else { return };
    if counts.len() < MOST_SCHEDULINGS || counts.contains_key(&value) {
        counts.entry(value).or_insert(SeenPeriods { periods: 0, first: span.begin }).periods += 1;
    }
}

/// Returns what the others executed between two times.
fn cause_of(recent: &[Recent], instance: usize, from: i64, to: i64) -> Causes {
    let (Ok(from), Ok(to)) = (u64::try_from(from), u64::try_from(to)) else { return Causes::default() };
    let mut others = Causes::new();
    for it in recent.iter().filter(|it| it.instance != instance && it.begin < to && it.end > from) {
        let overlap = it.end.min(to).saturating_sub(it.begin.max(from));
        let (jobs, execution) = others.entry(it.instance).or_default();
        *jobs += 1;
        *execution += it.execution.min(overlap);
    }
    others
}
