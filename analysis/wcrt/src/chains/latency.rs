//! The latencies of the chains and connections of a deployment: of each way, the sum of its steps, or why there is none.

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Assumption, Decl, Flat, Link, ModelDb, Overwrite, Passage, PassageEnd, Passages, Project, Ros2, Skip,
    SkipCause, Topic, core_of, deployed, flat_of, passages_of, ros2_of,
};
use mauve_timing::{
    ChainBuffer, ChainLatency, ChainPart, ChainStep, ChainWrite, Distance, NoLatency, Status, Task, Time,
    TriggerWriter, Triggers,
};
use rustc_hash::FxHashMap;

use super::declared::declared_chains;
use super::network::Network;
use super::{
    ChainProblem, ChainReason, ChainReport, ChainStepReport, ChainWay, Chains, ConnectionReport,
    DeclaredChain, WayStep,
};
use crate::priorities::is_stale;
use crate::psm::{ends_with_write, is_readable, write_costs};
use crate::reason::Reason;
use crate::report::{ActivityReport, Query, Report};
use crate::response::{response_times, response_times_if};
use crate::sends::writes_of;
use crate::system::{System, system_of};
use crate::variants::Variants;
use crate::what_if::{WhatIfField, system_if};

/// Returns the chains of a deployment. Without its architecture, only those that are declared, with that reason.
#[salsa::tracked(returns(ref))]
pub fn chains_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Chains<'db> {
    let Some((flat, target)) = deployed(db, project, deployment) else {
        return without_architecture(db, project);
    };
    let declared = declared_chains(db, project, target);
    let (ways, left_out) = ways_of(db, project, target);
    let report = response_times(db, project, deployment, query);
    let mut sums =
        Sums::new(db, project, deployment, query, flat, report, system_of(db, project, deployment));
    let all = sums.all(declared, ways);
    let hops = connections_of(db, project, deployment, query).clone();
    Chains { all, declared: declared.len(), hops, left_out: *left_out }
}

/// The limit of a chain, and its latency.
pub(crate) type LimitedLatency = (Option<Time>, Option<Time>);

/// Returns the limit and the latency of each declared chain of a deployment with other values, as [`chains_of`] would compute them
/// after that edit; without declared chains, of all. The second result is the number of steps, and of writes that were analysed.
pub(crate) fn latencies_of(of: &Variants<'_>, what_if: &[WhatIfField]) -> (Vec<LimitedLatency>, usize) {
    let Variants { db, project, deployment, query, .. } = *of;
    let Some((flat, target)) = deployed(db, project, deployment) else { return (Vec::new(), 0) };
    let system = system_if(db, project, deployment, what_if);
    let report = response_times_if(db, project, deployment, query, what_if);
    let declared = declared_chains(db, project, target);
    let (ways, _) = ways_of(db, project, target);
    let ways = if declared.is_empty() { ways.as_slice() } else { &[] };
    let mut sums = Sums::new(db, project, deployment, query, flat, &report, &system);
    let all = sums.all(declared, ways);
    let steps = sums.writes.len() + all.iter().map(|chain| chain.steps.len()).sum::<usize>();
    (all.into_iter().map(|chain| (chain.limit, chain.latency)).collect(), steps)
}

fn without_architecture<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Chains<'db> {
    let declared = mauve_hir::config_of(db, project.workspace(db)).chains.iter().enumerate();
    let all: Vec<ChainReport<'db>> = declared
        .map(|(index, chain)| ChainReport {
            name: chain.name.as_str().into(),
            declared: Some(index),
            limit: chain.latency,
            reasons: vec![ChainReason::Declaration { at: None, problem: ChainProblem::NoArchitecture }],
            ..ChainReport::default()
        })
        .collect();
    Chains { declared: all.len(), all, ..Chains::default() }
}

/// Returns what happens to data on each connection of a deployment, in the order of [`Flat::links`].
#[salsa::tracked(returns(ref))]
pub fn connections_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<ConnectionReport<'db>> {
    let Some((flat, target)) = deployed(db, project, deployment) else { return Vec::new() };
    let hops = hops_of(db, project, target);
    let report = response_times(db, project, deployment, query);
    let mut sums =
        Sums::new(db, project, deployment, query, flat, report, system_of(db, project, deployment));
    sums.find_writes(hops.iter().flatten().flat_map(|hop| hop.after.iter().chain([&hop.before])));
    hops.iter().zip(&flat.links).map(|(hop, link)| sums.connection(hop.as_ref(), link)).collect()
}

/// The ways of an architecture from each source to each end, and how many are left out.
#[salsa::tracked(returns(ref))]
fn ways_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
) -> (Vec<ChainWay<'db>>, usize) {
    network_of(db, project, architecture).ways()
}

fn network_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, architecture: Decl<'db>) -> Network<'db> {
    let nothing = |_: &Name, _| Assumption::nothing(db);
    Network::new(db, project, flat_of(db, project, architecture), nothing)
}

/// A connection between two instances.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct Hop<'db> {
    /// The first declared chain over it, whose assumptions count.
    chain: Option<usize>,
    before: WayStep<'db>,
    /// One for each end that data reaches from it.
    after: Vec<WayStep<'db>>,
}

/// The connections of an architecture; none for one whose instances are not known.
#[salsa::tracked(returns(ref))]
fn hops_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
) -> Vec<Option<Hop<'db>>> {
    let network = network_of(db, project, architecture);
    let mut assumed: FxHashMap<usize, (usize, &[WayStep<'db>])> = FxHashMap::default();
    for chain in declared_chains(db, project, architecture) {
        let steps = chain.way.as_ref().map_or(&[] as &[_], |way| &way.steps);
        for pair in steps.windows(2) {
            let connection = pair.get(1).and_then(|step| step.connection);
            connection.map(|it| assumed.entry(it).or_insert((chain.index, pair)));
        }
    }
    let hop = |(number, link): (usize, &Link<'db>)| {
        let (mut before, mut after) = network.around(number, link)?;
        let chain = assumed.get(&number);
        if let Some((_, [writer, reader])) = chain {
            before = writer.clone();
            after.iter_mut().for_each(|step| step.assumption = reader.assumption);
        }
        Some(Hop { chain: chain.map(|(index, _)| *index), before, after })
    };
    network.flat.links.iter().enumerate().map(hop).collect()
}

/// What is known of a component under an assumption.
#[derive(Clone, Copy)]
struct KnownComponent<'db> {
    component: Decl<'db>,
    core: Decl<'db>,
    passages: &'db Passages<'db>,
    /// What a job executes up to the end of the write of each passage, at most.
    costs: &'db [Option<Time>],
}

/// What data passes.
enum Stage<'a, 'db> {
    Step(&'a WayStep<'db>),
    /// The gateway of the host of a topic, and the network from it to the same topic on another host.
    Gateway {
        topic: &'db Topic,
        to: Option<&'db Topic>,
    },
}

struct Sums<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    query: Query,
    flat: &'db Flat<'db>,
    report: &'db Report<'db>,
    system: &'db System<'db>,
    ros2: &'db Ros2,
    /// What is assumed of instances while a chain is summed.
    assumed: FxHashMap<usize, Assumption<'db>>,
    /// The time between the releases of activities, under these assumptions.
    distances: FxHashMap<usize, Option<Distance>>,
    /// The activity of each instance, by its name, and by its index.
    activities: FxHashMap<&'db Name, usize>,
    of_instances: Vec<Option<usize>>,
    known: FxHashMap<(usize, Assumption<'db>), Option<KnownComponent<'db>>>,
    /// The response times to writes, by activity and by what a job executes up to the write.
    writes: FxHashMap<(usize, Time), Time>,
}

impl<'db> Sums<'db> {
    fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        deployment: Decl<'db>,
        query: Query,
        flat: &'db Flat<'db>,
        report: &'db Report<'db>,
        system: &'db System<'db>,
    ) -> Sums<'db> {
        let activities = report.activities.iter().enumerate().rev().map(|(index, it)| (&it.instance, index));
        let activities: FxHashMap<&'db Name, usize> = activities.collect();
        Sums {
            db,
            project,
            query,
            flat,
            report,
            system,
            ros2: ros2_of(db, project, deployment),
            assumed: FxHashMap::default(),
            distances: FxHashMap::default(),
            of_instances: flat.instances.iter().map(|it| activities.get(&it.name).copied()).collect(),
            activities,
            known: FxHashMap::default(),
            writes: FxHashMap::default(),
        }
    }

    fn known(&mut self, step: &WayStep<'db>) -> Option<KnownComponent<'db>> {
        let key = (step.instance, step.assumption);
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let known = self.read(step);
        self.known.insert(key, known);
        known
    }

    fn read(&self, step: &WayStep<'db>) -> Option<KnownComponent<'db>> {
        let instance = self.flat.instances.get(step.instance)?;
        let component = instance.component.filter(|it| *is_readable(self.db, self.project, *it))?;
        let core = core_of(self.db, self.project, component)?;
        let passages = passages_of(self.db, self.project, core, step.assumption);
        let activity = self.system.activities.get((*self.of_instances.get(step.instance)?)?)?;
        let (tables, level) = (activity.tables, self.query.level);
        let costs = write_costs(self.db, tables, component, level, activity.wakes, step.assumption);
        Some(KnownComponent { component, core, passages, costs })
    }

    fn activity(&self, step: &WayStep<'db>) -> Option<(usize, &'db ActivityReport<'db>)> {
        let index = (*self.of_instances.get(step.instance)?)?;
        Some((index, self.report.activities.get(index)?))
    }

    /// Returns the activity of a step, and what its job executes up to the write at most, if that is known.
    fn cost(&mut self, step: &WayStep<'db>) -> Option<(usize, Time)> {
        let known = self.known(step)?;
        let (index, activity) = self.activity(step)?;
        activity.response?;
        let costs = step.passages.iter().map(|&it| known.costs.get(it).copied().flatten());
        let write = costs.reduce(|one, other| Some(one?.max(other?))).flatten()?;
        let calls = activity.calls.iter().try_fold(Time::ZERO, |sum, calls| sum.checked_add(calls.time))?;
        Some((index, write.checked_add(calls)?))
    }

    /// Returns the declared chains, then those of these ways.
    fn all(&mut self, declared: &[DeclaredChain<'db>], ways: &[ChainWay<'db>]) -> Vec<ChainReport<'db>> {
        let known = declared.iter().filter_map(|chain| chain.way.as_ref().ok());
        self.find_writes(known.chain(ways).flat_map(|way| &way.steps));
        let mut all: Vec<ChainReport<'db>> = declared.iter().map(|chain| self.declared(chain)).collect();
        all.extend(ways.iter().map(|way| self.way(way)));
        all
    }

    /// Computes the response times to the writes of these steps, all together.
    fn find_writes<'a>(&mut self, steps: impl Iterator<Item = &'a WayStep<'db>>)
    where
        'db: 'a,
    {
        let mut keys: Vec<(usize, Time)> = steps.filter_map(|step| self.cost(step)).collect();
        if keys.is_empty() {
            return;
        }
        keys.sort_unstable();
        keys.dedup();
        let response = |task: usize| self.report.activities.get(task).and_then(|it| it.response);
        let write = |&(task, cost): &(usize, Time)| ChainWrite {
            task,
            cost,
            response: response(task).unwrap_or_default(),
        };
        let writes: Vec<ChainWrite> = keys.iter().map(write).collect();
        let interrupt = || self.db.unwind_if_revision_cancelled();
        let times = self.report.tasks.write_times(&writes, &self.query.options(false), &interrupt);
        self.writes = keys.into_iter().zip(times).collect();
    }

    fn declared(&mut self, chain: &DeclaredChain<'db>) -> ChainReport<'db> {
        let found = match &chain.way {
            Ok(way) => self.way(way),
            Err((at, problem)) => ChainReport {
                name: chain.name.clone(),
                reasons: vec![ChainReason::Declaration { at: at.clone(), problem: problem.clone() }],
                ..ChainReport::default()
            },
        };
        ChainReport { declared: Some(chain.index), limit: chain.limit, ..found }
    }

    fn way(&mut self, way: &ChainWay<'db>) -> ChainReport<'db> {
        let mut reasons = Vec::new();
        self.assumed = way.steps.iter().map(|step| (step.instance, step.assumption)).collect();
        self.distances.clear();
        let stages = self.stages(&way.steps.iter().collect::<Vec<_>>(), true);
        let mut steps = self.steps(&stages, None, &mut reasons);
        let mut found = self.sum(&steps, &stages, &mut reasons);
        let apart = found.as_ref().and_then(|of| self.apart(&steps, &stages, of.latency));
        let is_apart = apart.is_some();
        if let Some((of_apart, latency)) = apart {
            (steps, found) = (of_apart.into_iter().map(Some).collect(), Some(latency));
        }
        let mut parts = found.as_ref().map_or(&[] as &[_], |it| it.parts.as_slice()).iter();
        let report = |(stage, found): (&Stage<'_, 'db>, &Option<ChainStep>)| {
            let (instance, connection, passage) = match stage {
                Stage::Step(step) => {
                    let instance = self.flat.instances.get(step.instance).map(|it| it.name.clone());
                    (instance.unwrap_or_default(), step.connection, step.ends.clone())
                }
                Stage::Gateway { topic, .. } => {
                    let port = PassageEnd::Port(topic.port.1.clone());
                    (self.ros2.gateway(topic.host), None, [port.clone(), port])
                }
            };
            ChainStepReport {
                activity: self.activities.get(&instance).copied(),
                instance,
                connection,
                passage,
                releases: found.as_ref().map(|it| it.releases),
                decides: matches!(stage, Stage::Step(step) if self.decides(step)),
                timed: found.clone(),
                part: parts.next().copied().unwrap_or_default(),
            }
        };
        let steps: Vec<ChainStepReport<'db>> = stages.iter().zip(&steps).map(report).collect();
        // Data that decides nothing may leave an old decision there.
        let decides = steps.iter().any(|step| step.decides);
        ChainReport {
            name: way.name.clone(),
            declared: None,
            ends: Some(way.ends.clone()),
            latency: found.as_ref().map(|it| it.latency),
            age_at_write: found.as_ref().filter(|_| !decides).and_then(|it| it.age_at_write),
            limit: None,
            steps,
            overwritten: way.steps.last().and_then(|step| self.overwritten(step)),
            is_apart,
            reasons,
        }
    }

    /// Returns the steps if they do not delay each other, with their latency, if it is less than this one.
    fn apart(
        &self,
        steps: &[Option<ChainStep>],
        stages: &[Stage<'_, 'db>],
        latency: Time,
    ) -> Option<(Vec<ChainStep>, ChainLatency)> {
        if !steps.iter().skip(1).flatten().any(|step| step.released.is_some_and(|it| it.by_data)) {
            return None;
        }
        let stages = stages.iter().zip(steps).enumerate().map(|(index, (stage, step))| {
            let Stage::Step(of) = stage else { return None };
            // Other programs may write a topic.
            let is_of_topic = index > 0 && self.topic(of, 0).is_some();
            let ends_with_write = self.ends_with_write(of);
            Some(ChainStep { ends_with_write, ..step.clone()? }).filter(|_| !is_of_topic)
        });
        let chain = stages.collect::<Option<Vec<ChainStep>>>()?;
        let interrupt = || self.db.unwind_if_revision_cancelled();
        let chain = self.report.tasks.steps_apart(&chain, &self.query.options(false), &interrupt)?;
        let found = self.report.tasks.latency(&chain, true).ok()?;
        (found.latency < latency).then_some((chain, found))
    }

    /// Returns whether the write with which data leaves a step ends each job that writes there.
    fn ends_with_write(&self, step: &WayStep<'db>) -> bool {
        let (PassageEnd::Port(port), Some((task, _))) = (&step.ends[1], self.activity(step)) else {
            return false;
        };
        let component = self.flat.instances.get(step.instance).and_then(|it| it.component);
        let activity = self.system.activities.get(task);
        component.zip(activity).is_some_and(|(component, of)| {
            *ends_with_write(self.db, of.tables, component, self.query.level, port.clone())
        })
    }

    /// Returns whether data only decides what a step writes.
    fn decides(&self, step: &WayStep<'db>) -> bool {
        let of = step.assumption;
        if !of.decides(self.db) {
            return false;
        }
        let component = self.flat.instances.get(step.instance).and_then(|it| it.component);
        let core = component.and_then(|it| core_of(self.db, self.project, it));
        let Some(core) = core else { return false };
        let [states, new_data] = [of.states(self.db), of.new_data(self.db)].map(Clone::clone);
        let answers = of.answers(self.db).clone();
        let values = Assumption::new(self.db, states, answers, new_data, of.through_handles(self.db), false);
        let all = &passages_of(self.db, self.project, core, values).all;
        !all.iter().any(|it| [&it.from, &it.to] == step.ends.each_ref())
    }

    /// Returns what data passes on a way: the instances, and the gateways between hosts. With its `ends`, also those of the topics
    /// that it begins and ends with.
    fn stages<'a>(&self, way: &[&'a WayStep<'db>], ends: bool) -> Vec<Stage<'a, 'db>> {
        let mut found = Vec::with_capacity(way.len());
        let end = |step: Option<&WayStep<'db>>, side: usize| {
            let topic = self.topic(step.filter(|_| ends)?, side)?;
            Some(Stage::Gateway { topic, to: None })
        };
        found.extend(end(way.first().copied(), 0));
        for (index, step) in way.iter().enumerate() {
            // What is before the first one does not count.
            if let Some([from, to]) = step.connection.filter(|_| index > 0).and_then(|link| self.across(link))
            {
                found.push(Stage::Gateway { topic: from, to: Some(to) });
                found.push(Stage::Gateway { topic: to, to: None });
            }
            found.push(Stage::Step(step));
        }
        found.extend(end(way.last().copied(), 1));
        found
    }

    /// Returns the ends of a connection, by its index, that leads to another host.
    fn across(&self, link: usize) -> Option<[&'db Topic; 2]> {
        self.ros2.across(self.flat.links.get(link)?)
    }

    /// Returns the topic of the port where data enters, or leaves, a step.
    fn topic(&self, step: &WayStep<'db>, side: usize) -> Option<&'db Topic> {
        let PassageEnd::Port(port) = step.ends.get(side)? else { return None };
        let found = self.ros2.topic(&self.flat.instances.get(step.instance)?.name, port)?;
        (found.is_published == (side == 1)).then_some(found)
    }

    /// Returns the steps of these stages; the first one is `known`.
    fn steps(
        &mut self,
        stages: &[Stage<'_, 'db>],
        known: Option<Option<ChainStep>>,
        reasons: &mut Vec<ChainReason<'db>>,
    ) -> Vec<Option<ChainStep>> {
        let mut before: Option<&WayStep<'db>> = None;
        let mut topic: Option<&Topic> = None;
        let mut found = Vec::with_capacity(stages.len());
        let skipped = known.iter().len();
        if let Some(Stage::Step(step)) = stages.first().filter(|_| skipped > 0) {
            before = Some(step);
        }
        found.extend(known);
        for (index, stage) in stages.iter().enumerate().skip(skipped) {
            match stage {
                Stage::Gateway { topic: of, to } => {
                    found.push(self.gateway(of, *to, reasons));
                    topic = Some(of);
                }
                Stage::Step(step) => {
                    if topic.is_none() {
                        reasons.extend(step.connection.and_then(|link| self.not_across(link)));
                    }
                    let mut next = self.step(index, step, before, reasons);
                    if let (Some(next), Some(topic)) = (&mut next, topic.take()) {
                        // In each of its periods, the gateway writes so many samples at most.
                        next.writes = Some(topic.depth);
                        if topic.depth > 1 {
                            let reads = self.releases(step, true).ok();
                            let of_link = next.buffer.map_or(0, |it| it.size);
                            next.buffer = Some(ChainBuffer { size: of_link.max(topic.depth), reads });
                        }
                    }
                    found.push(next);
                    let keeps = stages.get(index + 1).is_some();
                    if let Some(by) = self.overwritten(step).filter(|_| keeps) {
                        reasons.push(ChainReason::Overwrites { step: index, by });
                    }
                    before = Some(step);
                }
            }
        }
        found
    }

    /// Returns the step of a gateway, which moves data in each period, and of the network to the host `to`, as far as its write.
    fn gateway(
        &self,
        topic: &Topic,
        to: Option<&Topic>,
        reasons: &mut Vec<ChainReason<'db>>,
    ) -> Option<ChainStep> {
        let gateway = self.ros2.gateway(topic.host);
        if let Some(reader) = to.filter(|to| topic.is_best_effort || to.is_best_effort) {
            let port = if topic.is_best_effort { &topic.port } else { &reader.port };
            reasons.push(ChainReason::BestEffort { port: format!("{}.{}", port.0, port.1).into() });
            return None;
        }
        let network = match to {
            None => Time::ZERO,
            Some(to) => match self.ros2.latency(topic.host, to.host) {
                Some(latency) => latency,
                None => {
                    let name = |host: usize| self.ros2.hosts.get(host).cloned().unwrap_or_default();
                    reasons.push(ChainReason::NoLink { hosts: [topic.host, to.host].map(name) });
                    return None;
                }
            },
        };
        let task = self.activities.get(&gateway).copied();
        let activity = task.and_then(|it| self.report.activities.get(it));
        let Some((task, response)) = task.zip(activity.and_then(|it| it.response)) else {
            let refusals = activity.map_or_else(Vec::new, |it| it.reasons.clone());
            let reason = ChainReason::Gateway { gateway, refusals };
            if !reasons.contains(&reason) {
                reasons.push(reason);
            }
            return None;
        };
        let Some(write) = response.checked_add(network) else {
            reasons.push(ChainReason::TooLong);
            return None;
        };
        Some(ChainStep {
            task,
            releases: 1,
            periods: Some(0),
            write,
            response: write,
            ..ChainStep::default()
        })
    }

    /// Returns the most time from a write to the arrival of the data at the reader of a connection, by its index: none of one host.
    fn between_hosts(&self, link: usize) -> Option<Time> {
        let Some([from, to]) = self.across(link) else {
            return self.not_across(link).is_none().then_some(Time::ZERO);
        };
        let mut reasons = Vec::new();
        let hops = [(from, Some(to)), (to, None)];
        hops.into_iter().try_fold(Time::ZERO, |sum, (topic, next)| {
            let step = self.gateway(topic, next, &mut reasons)?;
            let period = self.report.activities.get(step.task)?.period?;
            sum.checked_add(period)?.checked_add(step.write)
        })
    }

    /// Returns why a connection, by its index, is none: it leads to another host, and is no topic.
    fn not_across(&self, link: usize) -> Option<ChainReason<'db>> {
        let link = self.flat.links.get(link)?;
        let ends = [&link.source.0, &link.target.0].map(|it| {
            let index = self.activities.get(it)?;
            self.system.activities.get(*index)?.host
        });
        let name =
            |host: Option<usize>| host.and_then(|it| self.ros2.hosts.get(it)).cloned().unwrap_or_default();
        (ends[0] != ends[1]).then(|| ChainReason::NoTopic { hosts: ends.map(name) })
    }

    fn sum(
        &self,
        steps: &[Option<ChainStep>],
        way: &[Stage<'_, 'db>],
        reasons: &mut Vec<ChainReason<'db>>,
    ) -> Option<ChainLatency> {
        if !reasons.is_empty() {
            return None;
        }
        let steps: Option<Vec<ChainStep>> = steps.iter().cloned().collect();
        let why = match self.report.tasks.latency(&steps?, true) {
            Ok(found) => return Some(found),
            Err(NoLatency::NoPeriod(step)) => ChainReason::NoBound { step },
            Err(NoLatency::NotPeriodic(step)) => {
                let triggers = match way.get(step) {
                    Some(Stage::Step(it)) => self.activity(it).map(|(task, _)| self.triggers_of(task)),
                    _ => None,
                };
                let by = triggers.into_iter().flatten().flatten().next();
                let by = by.map(|(_, link)| link.source.0.clone());
                ChainReason::ReleasedByData { step, by }
            }
            Err(NoLatency::NotRead(step)) => ChainReason::NotRead { step, skip: None },
            Err(NoLatency::TooLong) => ChainReason::TooLong,
        };
        reasons.push(why);
        None
    }

    /// Returns the ports whose data releases an activity, as the targets of their connections, which have indices; none for a port
    /// to which several connections lead, since what they write is not known, or no connection.
    fn triggers_of(&self, activity: usize) -> Vec<Option<(usize, &'db Link<'db>)>> {
        let Some(of) = self.system.activities.get(activity) else { return Vec::new() };
        let of_port = |port: &Name| {
            let is_it =
                |link: &Link<'db>| !link.operation && link.target.0 == of.instance && link.target.1 == *port;
            let mut links = self.flat.links.iter().enumerate().filter(|(_, link)| is_it(link));
            links.next().filter(|_| links.next().is_none())
        };
        of.trigger.iter().flat_map(|it| &it.ports).map(of_port).collect()
    }

    /// Returns at which of the ports whose data releases an activity data enters its step.
    fn entered(&self, activity: usize, step: &WayStep<'db>) -> Option<usize> {
        let PassageEnd::Port(port) = &step.ends[0] else { return None };
        let ports = &self.system.activities.get(activity)?.trigger.as_ref()?.ports;
        let place = ports.iter().position(|it| it == port)?;
        let link = self.triggers_of(activity).get(place).copied().flatten();
        let is_it = link.is_some_and(|(it, _)| step.connection == Some(it)) || self.topic(step, 0).is_some();
        is_it.then_some(place)
    }

    /// Returns the time between the releases of an activity; none without a bound.
    ///
    /// Activities may release each other in a circle. So the distances of all that release it, directly or through others, begin
    /// without a bound, and are computed from each other until none changes: those of each round hold.
    fn distance(&mut self, activity: usize) -> Option<Distance> {
        if let Some(known) = self.distances.get(&activity) {
            return *known;
        }
        let mut open = vec![activity];
        let mut released: Vec<(usize, Time, Triggers)> = Vec::new();
        while let Some(index) = open.pop() {
            if self.distances.contains_key(&index) {
                continue;
            }
            let Some(of) = self.report.activities.get(index) else { continue };
            let periodic = of.period.filter(|_| of.is_periodic());
            self.distances.insert(index, periodic.map(|each| Distance { each, late: Time::ZERO }));
            if let (false, Some(response)) = (of.is_periodic(), of.response) {
                let triggers = self.triggers(index);
                open.extend(triggers.writers.iter().flatten().map(|it| it.task));
                released.push((index, response, triggers));
            }
        }
        for _ in 0..released.len() {
            let before = self.distances.clone();
            for (index, response, triggers) in released.iter().rev() {
                let triggers = self.with_distances(triggers.clone());
                let found = self.report.tasks.greatest_distance(*index, *response, &triggers);
                self.distances.insert(*index, found);
            }
            if self.distances == before {
                break;
            }
        }
        self.distances.get(&activity).copied().flatten()
    }

    /// Enters the known distances of the releases of writers.
    fn with_distances(&self, mut triggers: Triggers) -> Triggers {
        for writer in &mut triggers.writers {
            let distance = writer.and_then(|it| self.distances.get(&it.task).copied().flatten());
            *writer = writer.zip(distance).map(|(it, distance)| TriggerWriter { distance, ..it });
        }
        triggers
    }

    /// Returns the ports whose data releases an activity, with their writers, without the distances of their releases.
    fn triggers(&mut self, activity: usize) -> Triggers {
        let trigger = self.system.activities.get(activity).and_then(|it| it.trigger.as_ref());
        let needs = trigger.map(|it| it.needs).unwrap_or_default();
        let links = self.triggers_of(activity).into_iter();
        Triggers { needs, writers: links.map(|it| self.trigger_writer(it?)).collect() }
    }

    /// Returns the writer of a port whose data releases an activity; none where the time to its next write has no bound.
    fn trigger_writer(&mut self, (connection, link): (usize, &'db Link<'db>)) -> Option<TriggerWriter> {
        let instance = self.flat.instances.iter().position(|it| it.name == link.source.0)?;
        let nothing = Assumption::nothing(self.db);
        let end = PassageEnd::Port(link.source.1.clone());
        let writer = WayStep {
            instance,
            connection: Some(connection),
            ends: [end.clone(), end],
            passages: Vec::new(),
            assumption: self.assumed.get(&instance).copied().unwrap_or(nothing),
        };
        let (task, by) = self.activity(&writer)?;
        Some(TriggerWriter {
            task,
            distance: Distance::default(),
            // What is between two hosts delays the data like the writer.
            response: by.response?.checked_add(self.between_hosts(connection)?)?,
            gap: self.releases(&writer, false).ok()?,
            writes: self.writes(&writer, link),
            has_buffer: link.buffer.is_some(),
        })
    }

    /// Returns whether the first jobs read the data that enters a step.
    fn is_read_at_start(&mut self, step: &WayStep<'db>) -> bool {
        let PassageEnd::Port(port) = &step.ends[0] else { return false };
        self.known(step).is_some_and(|known| known.passages.read_at_start.contains(port))
    }

    /// Returns the most writes of the source of a connection in a job of its writer, if that is known.
    fn writes(&mut self, writer: &WayStep<'db>, link: &Link<'db>) -> Option<u32> {
        writes_of(self.db, self.project, self.known(writer)?.component, &link.source.1)
    }

    fn passages(&mut self, step: &WayStep<'db>) -> Vec<&'db Passage<'db>> {
        let Some(known) = self.known(step) else { return Vec::new() };
        step.passages.iter().filter_map(|&it| known.passages.all.get(it)).collect()
    }

    /// Returns the statement that may overwrite what a step wrote.
    fn overwritten(&mut self, step: &WayStep<'db>) -> Option<Overwrite<'db>> {
        self.passages(step).into_iter().find_map(|it| it.overwritten.clone())
    }

    /// Returns the most releases until data that enters a step is read, or until what leaves it is written.
    fn releases(&mut self, step: &WayStep<'db>, is_read: bool) -> Result<u32, Skip<'db>> {
        let (known, end) = (self.known(step), if is_read { &step.ends[0] } else { &step.ends[1] });
        let PassageEnd::Port(port) = end else {
            // A call is executed in the next period.
            return Ok(1);
        };
        let of_port = known.and_then(|known| {
            let all = if is_read { &known.passages.reads } else { &known.passages.writes };
            all.iter().find(|(name, _)| name == port)
        });
        match (of_port, known) {
            (Some((_, releases)), _) => releases.clone(),
            (None, Some(KnownComponent { core, .. })) => {
                Err(Skip { core, states: Vec::new(), at: None, cause: SkipCause::NoWrite })
            }
            (None, None) => Ok(1),
        }
    }

    /// Returns a step whose next release writes. Adds the reason why it has no figures; it is the one of this `index`.
    fn written(
        &mut self,
        index: usize,
        step: &WayStep<'db>,
        reasons: &mut Vec<ChainReason<'db>>,
    ) -> Option<ChainStep> {
        let activity = self.activity(step);
        let why = no_response(index, activity.map(|(_, it)| it));
        let why = why.or_else(|| self.known(step).is_none().then_some(ChainReason::Unknown { step: index }));
        if why.is_some() {
            reasons.extend(why);
            return None;
        }
        let (task, activity) = activity?;
        let response = activity.response?;
        let write = self.cost(step).and_then(|key| self.writes.get(&key)).copied();
        let write = write.map_or(response, |it| it.min(response));
        let gap = self.releases(step, false).ok();
        let released = (!activity.is_periodic()).then(|| {
            self.distance(task);
            let triggers = self.triggers(task);
            let triggers = self.with_distances(triggers);
            let entered = self.entered(task, step);
            self.report.tasks.release(task, response, &triggers, entered)
        });
        Some(ChainStep { task, releases: 1, write, response, gap, released, ..ChainStep::default() })
    }

    /// The same for a step that passes data on, or reads it.
    fn step(
        &mut self,
        index: usize,
        step: &WayStep<'db>,
        before: Option<&WayStep<'db>>,
        reasons: &mut Vec<ChainReason<'db>>,
    ) -> Option<ChainStep> {
        let written = self.written(index, step, reasons)?;
        let passages = self.passages(step);
        let reads = self.releases(step, true);
        let of_passages =
            || passages.iter().try_fold(1, |most, it| it.releases.clone().map(|it| most.max(it)));
        let may_skip = |skip| ChainReason::MaySkip { step: index, skip };
        let releases = match (passages.as_slice(), step.connection) {
            ([], Some(_)) => reads.clone().map_err(|it| ChainReason::NotRead { step: index, skip: Some(it) }),
            ([], None) => self.releases(step, false).map_err(may_skip),
            _ => of_passages().map_err(may_skip),
        };
        let releases = releases.map_err(|why| reasons.push(why)).ok()?;
        let link = step.connection.and_then(|it| self.flat.links.get(it));
        let is_call = link.is_some_and(|link| link.operation);
        let link = link.filter(|_| !is_call);
        let buffer = link
            .and_then(|link| link.buffer)
            .map(|size| ChainBuffer { size: size.max(1), reads: reads.ok() });
        // What the first job leaves in a buffer may be more than the writes.
        let by_data = written.released.is_some_and(|it| it.by_data);
        let is_read = !by_data || buffer.is_none() || self.is_read_at_start(step);
        let writes = before.filter(|_| is_read).and_then(|it| self.writes(it, link?));
        let periods = passages.iter().map(|it| it.periods).reduce(|one, other| Some(one?.max(other?)));
        Some(ChainStep { releases, periods: periods.unwrap_or(Some(0)), buffer, writes, is_call, ..written })
    }

    fn connection(&mut self, hop: Option<&Hop<'db>>, link: &Link<'db>) -> ConnectionReport<'db> {
        let Some(hop) = hop else {
            let reason = Some(ChainReason::Unknown { step: 0 });
            return ConnectionReport { reason, ..ConnectionReport::default() };
        };
        let mut found = ConnectionReport { chain: hop.chain, ..ConnectionReport::default() };
        let [writer, reader] = [Some(&hop.before), hop.after.first()].map(|it| Some(self.activity(it?)?.1));
        if let Some((writer, reader)) = writer.zip(reader).filter(|_| !link.operation) {
            found.is_stale = is_stale(writer, reader);
            if link.buffer.is_none() {
                self.never_read(hop, reader, &mut found);
            }
        }
        // A buffer keeps what was written before.
        if link.buffer.is_none() {
            let mut overwritten = self.passages(&hop.before).into_iter().map(|it| it.overwritten.clone());
            found.overwritten = overwritten.next().flatten().filter(|_| overwritten.all(|it| it.is_some()));
        }
        let mut reasons = Vec::new();
        self.assumed.clear();
        self.distances.clear();
        // Without a chain, nothing is assumed.
        let ways = hop.after.iter().chain([&hop.before]).filter(|_| hop.chain.is_some());
        self.assumed.extend(ways.map(|step| (step.instance, step.assumption)));
        let mut before = self.written(0, &hop.before, &mut reasons);
        // Its wait for a release does not count here, and what it drops from a buffer does.
        let released = before.as_mut().and_then(|it| it.released.as_mut()).filter(|_| link.buffer.is_none());
        if let Some(released) = released {
            released.distance = released.distance.or(Some(Distance::default()));
        }
        for step in &hop.after {
            let mut why = reasons.clone();
            let stages = self.stages(&[&hop.before, step], false);
            let steps = self.steps(&stages, Some(before.clone()), &mut why);
            let latency = self.sum(&steps, &stages, &mut why).and_then(|it| {
                let [writer, gateways @ .., reader] = it.parts.as_slice() else { return None };
                let rest = writer.wait.checked_add(writer.periods)?;
                let mut reader = ChainPart { rule: gateways.last().unwrap_or(writer).rule, ..*reader };
                for part in gateways {
                    reader.wait = reader.wait.checked_add(part.wait)?.checked_add(part.run)?;
                }
                Some((it.latency.checked_sub(rest)?, writer.run, reader))
            });
            match latency {
                Some((latency, write, part)) if Some(latency) > found.latency => {
                    (found.latency, found.write, found.part) = (Some(latency), write, part);
                }
                None if found.reason.is_none() => found.reason = why.into_iter().next(),
                _ => {}
            }
        }
        if found.latency.is_some() {
            found.reason = None;
        }
        let period = writer.and_then(|it| it.period).unwrap_or_default();
        let ahead = link.buffer.filter(|_| writer.is_some_and(|it| it.burst <= 1));
        let ahead = ahead.and_then(|size| period.checked_mul(u64::from(size).saturating_sub(1)));
        // A gateway may write more at once than it does in the long run.
        let is_across = |it: &WayStep<'db>| it.connection.is_some_and(|link| self.across(link).is_some());
        let ahead = ahead.filter(|_| !hop.after.iter().any(is_across));
        found.stays_full = ahead.filter(|_| found.part.stays_full);
        found
    }

    /// Returns of how many values that are written at most one is read by a job that reads once. For a trigger, the most time
    /// between two writes on the average and the least one between two releases, if that is more.
    fn never_read(&mut self, hop: &Hop<'db>, reader: &Task, found: &mut ConnectionReport<'db>) -> Option<()> {
        let (writer, _) = self.activity(&hop.before)?;
        let gap = self.releases(&hop.before, false).ok()?;
        let each = self.distance(writer)?.each.checked_mul(u64::from(gap))?;
        let least = Time::from_nanos(reader.period?.as_nanos() / reader.burst.max(1));
        let step = hop.after.first()?;
        if self.activity(step).is_some_and(|(task, _)| self.entered(task, step).is_some()) {
            found.faster = Some([each, least]).filter(|_| each < least);
        } else {
            let values = least.as_nanos().checked_div(each.as_nanos());
            found.never_read = values.filter(|values| *values >= 2);
        }
        Some(())
    }
}

/// Returns why the activity of a step has no response time.
fn no_response<'db>(step: usize, activity: Option<&ActivityReport<'db>>) -> Option<ChainReason<'db>> {
    let Some(activity) = activity else { return Some(ChainReason::NoActivity { step }) };
    match activity.verdict {
        Status::Background => Some(ChainReason::Background { step }),
        Status::NotAnalysed if activity.reasons.iter().any(|it| matches!(it.reason, Reason::NoActivity)) => {
            Some(ChainReason::NoActivity { step })
        }
        Status::NotAnalysed => Some(ChainReason::NotAnalysed { step, refusals: activity.reasons.clone() }),
        _ => activity.response.is_none().then_some(ChainReason::NoBound { step }),
    }
}
