//! From what was counted to findings, when all recordings have been read.

use std::collections::{BTreeMap, BTreeSet};

use mauve_pwcet::exceedance_probability;
use mauve_pwcet::trace::{self, NameId, SpanKind, SpanNames, port_of};
use mauve_timing::{CpuSet, LEAST_WAIT, Priority};

use super::{
    Causes, ExpectedDeployment, ExpectedInstance, FindingKind, Greatest, IMPROBABLE, InstanceObserver,
    Interferer, ObservedDeployment, ObservedInstance, ObservedTime, Observer, Recent, SeenPeriods, Tally,
    TraceFinding, TracedName, Waited, Worst, cause_of,
};

/// The priority of a job that is not preempted.
const RAISED: u32 = 99;

impl Observer {
    /// Returns what was observed. `names` are those of the recording.
    pub fn finish(mut self, names: &SpanNames) -> ObservedDeployment {
        let mut observed = ObservedDeployment::default();
        observed.work.clone_from(self.observation.work());
        let seen = std::mem::take(&mut self.observation).finish(names);
        let all: Vec<(NameId, Tally)> = std::mem::take(&mut self.series).into_iter().collect();
        for (id, series) in &all {
            let name = names.get(*id);
            observed.has_instances |= !name.instance.is_empty();
            observed.has_programs |= name.kind == SpanKind::Program;
            observed.has_periods |= name.kind == SpanKind::Period;
            if let Some(instance) = series.instance.and_then(|index| self.instances.get_mut(index)) {
                instance.observed.is_observed = true;
            }
        }
        observed.has_releases = observed.has_periods && !self.lacks_releases;
        let mut by_instance: Vec<Vec<(&str, &Tally)>> = vec![Vec::new(); self.instances.len()];
        for (id, series) in &all {
            let own = series.instance.and_then(|index| by_instance.get_mut(index));
            own.into_iter().for_each(|own| own.push((names.get(*id).key.as_str(), series)));
        }
        let mut seen_in: BTreeMap<&str, Vec<&trace::SeenName>> = BTreeMap::new();
        seen.iter().for_each(|it| seen_in.entry(&it.name.instance).or_default().push(it));
        let by_key = times(&self.expected, names, &all);
        let recent = std::mem::take(&mut self.recent);
        for (index, instance) in std::mem::take(&mut self.instances).into_iter().enumerate() {
            if let Some(expected) = self.expected.instances.get(index) {
                let own = by_instance.get(index).map(Vec::as_slice).unwrap_or_default();
                let mut context = Finish {
                    index,
                    all: &self.expected,
                    expected,
                    recent: &recent,
                    seen: seen_in.remove(expected.instance.as_str()).unwrap_or_default(),
                    has_instances: observed.has_instances,
                    findings: &mut observed.findings,
                };
                let found = context.instance(instance, own);
                observed.has_scheduling |= !found.priorities.is_empty();
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
            } else if let TracedName::UnknownCodel { is_known } = series.role {
                let kind = FindingKind::UnknownCodel { key: name.key.clone(), is_known };
                observed.findings.push(TraceFinding::of_all(kind, series.first, series.executions));
            }
        }
        for (instance, (count, at)) in strangers {
            let kind = FindingKind::UnknownInstance { instance: instance.to_owned() };
            observed.findings.push(TraceFinding::of_all(kind, at, count));
        }
        for it in &by_key {
            let Some(worst) = it.worst.filter(|worst| worst.probability < IMPROBABLE) else { continue };
            let kind = FindingKind::ExecutionTime {
                key: it.key.clone(),
                time: worst.time,
                level: worst.level,
                executions: it.executions,
                expected: it.executions as f64 * worst.level,
                greatest: it.greatest.map_or(0, |greatest| greatest.time),
            };
            let at = it.greatest.and_then(|greatest| greatest.at);
            observed.findings.push(TraceFinding::of_all(kind, at, worst.exceeded));
        }
        (observed.chains, observed.connections) = std::mem::take(&mut self.chains).finish();
        for (chain, (it, expected)) in observed.chains.iter().zip(&self.expected.chains).enumerate() {
            let Some((greatest, bound)) = it.greatest.zip(expected.bound.or(expected.limit)) else {
                continue;
            };
            if greatest.time > bound {
                let kind = FindingKind::Chain { chain, latency: greatest.time, bound };
                observed.findings.push(TraceFinding::of_all(kind, greatest.at, it.late));
            }
        }
        observed.times = by_key;
        let is_seen = observed.instances.iter().any(|it| it.is_observed)
            || observed.times.iter().any(|it| it.executions > 0);
        if !is_seen && observed.findings.is_empty() {
            observed.findings.push(TraceFinding::of_all(FindingKind::NothingObserved, None, 0));
        }
        observed
    }
}

/// Returns what was observed of codels and of programs with times of their own.
fn times(expected: &ExpectedDeployment, names: &SpanNames, all: &[(NameId, Tally)]) -> Vec<ObservedTime> {
    let new = |(key, time): (&String, &Option<u64>)| ObservedTime {
        key: key.clone(),
        time: *time,
        probability: 1.0,
        ..ObservedTime::default()
    };
    let all_times = expected.times.iter().map(new);
    let mut found: BTreeMap<String, ObservedTime> = all_times.map(|it| (it.key.clone(), it)).collect();
    let mut of_levels: BTreeMap<&str, Vec<(Option<u64>, u64)>> = BTreeMap::new();
    for (id, series) in all {
        let name = names.get(*id);
        let Some(it) = found.get_mut(&name.key).filter(|_| name.kind != SpanKind::Period) else { continue };
        it.executions += series.executions;
        it.exceeded += series.exceeded;
        let sums = of_levels.entry(&name.key).or_insert_with(|| vec![(None, 0); series.of_levels.len()]);
        for (sum, (time, exceeded)) in sums.iter_mut().zip(&series.of_levels) {
            *sum = (*time, sum.1 + exceeded);
        }
        if it.greatest.map(|it| it.time) < series.greatest.map(|it| it.time) {
            it.greatest = series.greatest;
            it.instance.clone_from(&name.instance);
        }
    }
    let mut found: Vec<ObservedTime> = found.into_values().collect();
    for it in &mut found {
        it.probability = exceedance_probability(it.executions, it.exceeded, expected.level);
        let sums = of_levels.get(it.key.as_str()).into_iter().flatten();
        let count = expected.levels.len() as f64;
        let compared = expected.levels.iter().zip(sums).filter_map(|(of, &(time, exceeded))| {
            let probability = exceedance_probability(it.executions, exceeded, of.level) * count;
            Some(Worst { level: of.level, time: time?, exceeded, probability: probability.min(1.0) })
        });
        // At the level of the analysis, too, which may not be one of the tables.
        let analysed = it.time.map(|time| Worst {
            level: expected.level,
            time,
            exceeded: it.exceeded,
            probability: it.probability,
        });
        it.worst =
            analysed.into_iter().chain(compared).min_by(|a, b| a.probability.total_cmp(&b.probability));
    }
    found
}

/// The findings about one instance.
struct Finish<'a> {
    index: usize,
    all: &'a ExpectedDeployment,
    expected: &'a ExpectedInstance,
    recent: &'a [Recent],
    /// The codels, programs, ports and locks of the instance.
    seen: Vec<&'a trace::SeenName>,
    has_instances: bool,
    findings: &'a mut Vec<TraceFinding>,
}

impl Finish<'_> {
    fn add(&mut self, kind: FindingKind, at: Option<u64>, count: u64) {
        self.findings.push(TraceFinding { instance: Some(self.index), kind, at, count });
    }

    fn instance(&mut self, mut it: InstanceObserver, series: &[(&str, &Tally)]) -> ObservedInstance {
        if !it.observed.is_observed {
            // Without names of instances, none can be missing. A recording of ROS 2 has callbacks only, which are codels.
            let is_silent = self.expected.codels.as_ref().is_some_and(BTreeSet::is_empty);
            let may_be_silent = is_silent && self.expected.priority == Priority::Background;
            if self.has_instances && !may_be_silent {
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
        // A hundredth may be cut off by gaps and by the ends of recordings.
        if it.observed.untimed * 100 > it.observed.periods {
            self.add(FindingKind::Untimed { periods: it.observed.periods }, None, it.observed.untimed);
        }
        self.execution(&it);
        self.waits();
        self.releases(&mut it);
        it.observed
    }

    fn scheduling(&mut self, it: &InstanceObserver) {
        let priority = match self.expected.priority {
            Priority::RealTime(priority) => Some(priority),
            Priority::Background => Some(0),
            Priority::Unknown => None,
        };
        for (&observed, &SeenPeriods { periods, first }) in &it.observed.priorities {
            // LTTng records the priority after the begin.
            let is_raised = self.expected.is_not_preempted && observed == RAISED;
            if let Some(expected) = priority.filter(|expected| *expected != observed && !is_raised) {
                self.add(FindingKind::Priority { expected, observed }, first, periods);
            }
        }
        let Some(expected) = self.expected.cpus.filter(|cpus| !cpus.is_empty()) else { return };
        for (&observed, &SeenPeriods { periods, first }) in &it.observed.masks {
            if expected != observed {
                self.add(FindingKind::Cpus { expected, observed }, first, periods);
            }
        }
        // A wrong mask says it already.
        if it.observed.masks.keys().any(|mask| *mask != expected) {
            return;
        }
        let others = it.observed.cpus.iter().filter(|(cpu, _)| !expected.contains(**cpu));
        let observed: CpuSet = others.clone().map(|(cpu, _)| CpuSet::of(*cpu)).collect();
        if let Some(first) = others.clone().map(|(_, it)| it.first).min() {
            let periods = others.map(|(_, it)| it.periods).sum();
            self.add(FindingKind::OtherCpu { expected, observed }, first, periods);
        }
    }

    fn names(&mut self, series: &[(&str, &Tally)]) {
        let mut components: BTreeMap<&str, (Option<u64>, u64)> = BTreeMap::new();
        for (key, it) in series {
            match it.role {
                TracedName::OtherComponent => {
                    let component = key.rsplit_once('/').map_or(*key, |(component, _)| component);
                    let (at, count) = components.entry(component).or_insert((it.first, 0));
                    *count += it.executions;
                    *at = (*at).min(it.first);
                }
                TracedName::UnknownProgram => {
                    let kind = FindingKind::UnknownProgram { key: (*key).to_owned() };
                    self.add(kind, it.first, it.executions);
                }
                TracedName::UnknownCodel { is_known } => {
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

    fn execution(&mut self, it: &InstanceObserver) {
        let Some((own, greatest)) = self.expected.own.zip(it.observed.execution) else { return };
        // If a codel exceeds its time, its period may exceed its own.
        let probability = (self.all.level * it.most_codels.max(1) as f64).min(1.0);
        if exceedance_probability(it.observed.periods, it.long, probability) < IMPROBABLE {
            let ports =
                self.seen.iter().filter_map(|it| Some((port_of(&it.name.key)?.to_owned(), it.greatest)));
            let port = ports.max_by_key(|(_, greatest)| *greatest);
            self.add(FindingKind::Execution { own, greatest: greatest.time, port }, it.first_long, it.long);
        }
    }

    fn waits(&mut self) {
        for it in self.seen.clone() {
            let (wait, key) = (it.wait, it.name.key.clone());
            let known = self.all.waits.get(&key).copied();
            // `mauve trace import` and `mauve check` say shorter ones.
            if wait.greatest > known.unwrap_or(LEAST_WAIT) && !wait.is_unknown {
                let kind = FindingKind::Wait {
                    key,
                    wait: known,
                    executions: it.executions,
                    greatest: wait.greatest,
                };
                self.add(kind, None, wait.executions);
            }
        }
    }

    /// Returns whether a codel of the instance waited.
    fn waited(&self) -> Waited {
        let codels = self.seen.iter().filter(|it| it.name.kind == SpanKind::Codel);
        if codels.clone().any(|it| it.wait.is_unknown) || codels.clone().count() == 0 {
            return Waited::Unknown;
        }
        match codels.max_by_key(|it| it.wait.greatest) {
            Some(it) if it.wait.greatest > self.all.waits.get(&it.name.key).copied().unwrap_or(0) => {
                Waited::Codel(it.name.key.clone(), it.wait.greatest)
            }
            _ => Waited::Never,
        }
    }

    fn releases(&mut self, it: &mut InstanceObserver) {
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
        if let (Some(gap), Some(burst)) = (found.least_gap, self.expected.burst) {
            let kind = FindingKind::Gap { expected: period, burst, observed: unsigned(gap) };
            self.add(kind, found.first_in_gap.map(unsigned), found.in_gap);
        }
        let Some(longest) = found.longest else { return };
        let response = unsigned(longest.response);
        let at = unsigned(longest.job.end);
        it.observed.response = Some(Greatest { time: response, at: Some(at) });
        let (bound, deadline) = (self.expected.response, self.expected.deadline);
        if bound.or(deadline).is_some_and(|limit| response > limit) {
            let interference = self.interference(&longest.cause);
            let execution = unsigned(longest.job.execution);
            let count = found.late.max(1);
            // The times of the analysis may be exceeded as often as their level says, and the bound with them, but not those of
            // the strictest level. Each execution of a period may; those of others only make that more probable.
            let is_long = self.expected.own.is_some_and(|own| execution > own)
                || interference.iter().any(|it| it.bound_jobs > 0 && it.execution > it.bound);
            let (strict_response, strict_own) = self.expected.strict;
            let is_within = |limit: Option<u64>, time: u64| limit.is_some_and(|limit| time <= limit);
            let probability = (self.all.level * it.most_codels.max(1) as f64).min(1.0);
            let is_expected = bound.is_some()
                && deadline.is_none_or(|deadline| response <= deadline)
                && is_long
                && is_within(strict_response, response)
                && is_within(strict_own, execution)
                && exceedance_probability(it.observed.periods, count, probability) >= IMPROBABLE;
            if is_expected {
                return;
            }
            let own = self.expected.own;
            let waited = self.waited();
            let kind =
                FindingKind::Response { bound, deadline, response, execution, own, interference, waited };
            self.add(kind, Some(at), count);
        }
    }

    fn interference(&self, cause: &Causes) -> Vec<Interferer> {
        let mut all: Vec<Interferer> = cause
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
        let cpus = |it: &ExpectedInstance| it.cpus.unwrap_or(CpuSet::ALL);
        other.is_some_and(|other| cpus(other).meets(cpus(self.expected)))
    }
}
