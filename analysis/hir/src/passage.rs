//! How data passes through a core: from an input port, an operation or a codel to an output port or a codel, in how many
//! periods, and which statement may overwrite it. Independent of all deployments: a changed period computes nothing here.
//!
//! A counter or mode decides what a period does: its state in the product (`product.rs`) is part of where the core is.
//! `if left == 0 then { read(a, x); write(q, x); left = 9; } else { left = left - 1; }` passes data on in every tenth period.
//! Such a search has many states: data is followed so only where the values may exclude what is found without them.

mod flow;
mod graph;
mod search;
mod types;

pub use self::types::{Assumption, Overwrite, Passage, PassageEnd, Passages, Skip, SkipCause, Written};

use std::cell::RefCell;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, TimedProgram, behaviour_of};
use crate::cost::{CostGraph, cost_until};
use crate::graph::{successors_by, topological_order};
use crate::item_tree::SourceId;
use crate::product::{Interpreted, ProductEdge, interpreted_of};
use crate::program_graph::graph_of;
use crate::project::Project;
use crate::source::Decl;

use self::graph::{Builder, JobGraph, JobNode, JobPlace, Slots};
use self::search::{FoundMoments, Moment, PassageSearch, PathCycle};

/// The nodes that jobs come to, each with the state of the product and values of its cells.
type Reached = Vec<(u32, u32, u128)>;

/// What a core does with data, whatever is followed and assumed.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Flows<'db> {
    graph: JobGraph<'db>,
    reached: Reached,
    through_handles: bool,
    decides: bool,
    /// Whether the values of variables are forgotten at the end of each job, since there are too many.
    forgets: bool,
    /// There is too much to follow.
    too_large: bool,
}

/// Returns what a core does with data; none for a core that is not analysed.
#[salsa::tracked(returns(as_ref))]
fn flows_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    through_handles: bool,
    decides: bool,
) -> Option<Arc<Flows<'db>>> {
    let behaviour = behaviour_of(db, project, of);
    if !behaviour.refusals.is_empty() {
        return None;
    }
    let graph = Builder::new(db, project, of, behaviour, through_handles, decides)?.build();
    let states = vec![true; graph.starts.len()];
    let search = PassageSearch::new(&graph, &states);
    let all = [search, PassageSearch { forgets: true, ..search }];
    let found = all.iter().filter(|_| !graph.too_large);
    let found = found.filter_map(|it| Some((it.reached(behaviour.initial)?, it.forgets))).next();
    let too_large = found.is_none();
    let (reached, forgets) = found.unwrap_or_default();
    Some(Arc::new(Flows { graph, reached, through_handles, decides, forgets, too_large }))
}

/// Returns what jobs come to with the values of counters and modes; none where these are not followed, or are too many.
#[salsa::tracked(returns(ref))]
fn reached_with_values<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    through_handles: bool,
    decides: bool,
) -> Option<Reached> {
    let flows = flows_of(db, project, of, through_handles, decides)?;
    let states = vec![true; flows.graph.starts.len()];
    let interpreted = interpreted_of(db, project, of).as_deref();
    let search = PassageSearch { interpreted, ..PassageSearch::new(&flows.graph, &states) };
    search.reached(behaviour_of(db, project, of).initial)
}

/// Returns how data passes through a core.
#[salsa::tracked(returns(ref))]
pub fn passages_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    assumption: Assumption<'db>,
) -> Passages<'db> {
    let Some(flows) = flows_of(db, project, of, assumption.through_handles(db), assumption.decides(db))
    else {
        return Passages::default();
    };
    let behaviour = behaviour_of(db, project, of);
    let graph = &flows.graph;
    let assumed = assumption.states(db);
    let states: Vec<bool> =
        behaviour.states.iter().map(|it| assumed.is_empty() || assumed.contains(it)).collect();
    let is_new = |end: &PassageEnd<'db>| matches!(end, PassageEnd::Port(port) if assumption.new_data(db).contains(port));
    let new_data: Vec<u16> =
        (0..).zip(&graph.sources).filter(|(_, end)| is_new(end)).map(|(index, _)| index).collect();
    let search = PassageSearch {
        answers: assumption.answers(db),
        new_data: &new_data,
        forgets: flows.forgets,
        ..PassageSearch::new(graph, &states)
    };
    let context = Context { db, project, of, flows, behaviour, search, parts: RefCell::default() };
    if flows.too_large || graph.too_large { context.unknown() } else { context.all() }
}

struct Context<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flows: &'a Flows<'db>,
    behaviour: &'db Behaviour<'db>,
    /// Follows nothing.
    search: PassageSearch<'a, 'db>,
    /// The costs up to calls.
    parts: RefCell<FxHashMap<Vec<SourceId>, Arc<CostGraph<'db>>>>,
}

/// What a search finds: the most jobs to a goal, and what overwrites the data afterwards.
struct PassageOutcome<'a, 'db> {
    search: PassageSearch<'a, 'db>,
    found: FoundMoments,
    longest: Result<Option<u32>, PathCycle>,
    overwritten: Option<Overwrite<'db>>,
}

impl<'db> Context<'_, 'db> {
    fn all(&self) -> Passages<'db> {
        let graph = &self.flows.graph;
        let mut found = Passages::default();
        let wanted: Vec<Vec<Slots>> = (0..graph.sinks.len() as u16).map(|it| graph.wanted(it)).collect();
        for from in 0..graph.sources.len() as u16 {
            let carried = graph.carried(from);
            let given = graph.nodes.iter().zip(&carried).filter(|(node, before)| node.from & **before != 0);
            let given: FxHashSet<u16> = given.filter_map(|(node, _)| node.sink).collect();
            let sinks = (0..).zip(&wanted).filter(|(to, _)| given.contains(to));
            found.all.extend(sinks.filter_map(|(to, wanted)| self.passage(from, to, &carried, wanted)));
        }
        for (to, end) in (0..).zip(&graph.sinks) {
            if let PassageEnd::Port(port) = end {
                found.writes.push((port.clone(), self.gap(None, Some(to))));
            }
        }
        for (from, end) in (0..).zip(&graph.sources) {
            if let PassageEnd::Port(port) = end {
                let reads = self.gap(Some(from), None);
                let releases = reads.as_ref().copied().unwrap_or_default();
                found.read_at_start.extend(self.is_read_at_start(from, releases).then(|| port.clone()));
                found.reads.push((port.clone(), reads));
            }
        }
        found
    }

    fn program(&self, place: &JobPlace) -> Option<&TimedProgram<'db>> {
        let index = place.program?;
        let operation = || self.behaviour.operations.get(index.checked_sub(self.behaviour.programs.len())?);
        self.behaviour.programs.get(index).or_else(operation)
    }

    /// Returns the passages of a core that is too large: all that there may be between a port and another end.
    fn unknown(&self) -> Passages<'db> {
        let JobGraph { sources, sinks, .. } = &self.flows.graph;
        let skip = || self.skip(Vec::new(), None, SkipCause::TooLarge);
        let mut found = Passages::default();
        for from in sources {
            for to in sinks.iter().filter(|to| [from, to].into_iter().any(is_port)) {
                found.all.push(Passage {
                    from: from.clone(),
                    to: to.clone(),
                    releases: Err(skip()),
                    periods: None,
                    overwritten: None,
                    written: Vec::new(),
                    to_handle: true,
                });
            }
        }
        let ports = |ends: &[PassageEnd<'db>]| {
            let name = |end: &PassageEnd<'db>| {
                if let PassageEnd::Port(port) = end { Some((port.clone(), Err(skip()))) } else { None }
            };
            ends.iter().filter_map(name).collect()
        };
        (found.writes, found.reads) = (ports(sinks), ports(sources));
        found
    }

    fn state_of(&self, node: u32) -> Option<usize> {
        let graph = &self.flows.graph;
        Some(graph.places.get(graph.nodes.get(node as usize)?.place as usize)?.state)
    }

    /// What counters and modes decide, if they are followed.
    fn interpreted(&self) -> Option<&'db Interpreted<'db>> {
        interpreted_of(self.db, self.project, self.of).as_deref()
    }

    fn with_values(&self) -> &'db Option<Reached> {
        reached_with_values(self.db, self.project, self.of, self.flows.through_handles, self.flows.decides)
    }

    /// Returns where the core may be when data arrives.
    fn arrivals<'b>(&'b self, search: PassageSearch<'b, 'db>) -> impl Iterator<Item = Moment> + 'b {
        let is_assumed = |node| self.state_of(node).and_then(|it| search.states.get(it)) == Some(&true);
        let valued = search.interpreted.and_then(|_| self.with_values().as_ref());
        let reached = valued.unwrap_or(&self.flows.reached).iter();
        let reached = reached.filter(move |it| !search.is_skipped(it.0) && is_assumed(it.0));
        reached.map(move |(node, product, values)| search.start(*node, *product, *values))
    }

    /// Explores the jobs from arrivals on, also with the values of counters and modes if they may change what is found: more than
    /// the least number of jobs, a write of less, or a repetition that they may exclude.
    fn explored<'b>(
        &'b self,
        search: PassageSearch<'b, 'db>,
        least: u32,
        explore: impl Fn(PassageSearch<'b, 'db>) -> Option<(FoundMoments, Option<Overwrite<'db>>)>,
    ) -> Option<PassageOutcome<'b, 'db>> {
        let explore = |search: PassageSearch<'b, 'db>| {
            let (found, overwritten) = explore(search)?;
            let decides = self.flows.decides && !search.is_age;
            let longest = if decides { search.longest_decided(&found) } else { search.longest(&found) };
            Some(PassageOutcome { search, longest, found, overwritten })
        };
        let first = explore(search);
        let valued = match &first {
            Some(PassageOutcome { longest: Ok(jobs), overwritten: None, .. })
                if jobs.unwrap_or_default() <= least =>
            {
                None
            }
            first => {
                let all = self.interpreted();
                let valued = all.map(|it| PassageSearch { interpreted: Some(it), forgets: false, ..search });
                valued.filter(|valued| match first {
                    Some(PassageOutcome { longest: Err(cycle), found, .. }) => {
                        !valued.may_repeat(found, cycle)
                    }
                    _ => true,
                })
            }
        };
        let valued = valued.filter(|_| self.with_values().is_some()).and_then(explore);
        valued.or(first).or_else(|| explore(PassageSearch { forgets: true, ..search }))
    }

    /// Returns the most releases from any instant to the next of some nodes.
    fn gap(&self, source: Option<u16>, sink: Option<u16>) -> Result<u32, Skip<'db>> {
        let skips = self.flows.graph.skips(source, sink, &[]);
        let search = PassageSearch { skips: &skips, ..self.search };
        let is_goal = |_: &Moment, node: &JobNode| match sink {
            Some(_) => node.sink == sink,
            None => node.source == source,
        };
        let all = self.explored(search, 1, |it| Some((it.explore(self.arrivals(it), is_goal, true)?, None)));
        self.releases(all.as_ref())
    }

    /// Returns whether the first job, or one of so many, reads a source.
    fn is_read_at_start(&self, source: u16, releases: u32) -> bool {
        let Some(least) = releases.checked_sub(1) else { return false };
        let skips = self.flows.graph.skips(Some(source), None, &[]);
        let search = PassageSearch { skips: &skips, ..self.search };
        let initial = Some(self.behaviour.initial).filter(|it| search.states.get(*it) == Some(&true));
        let found = self.explored(search, least, |search| {
            let first = initial.into_iter().flat_map(|state| search.first(state));
            Some((search.explore(first, |_, node| node.source == Some(source), true)?, None))
        });
        found.and_then(|it| it.longest.ok().flatten()).is_some_and(|jobs| jobs <= least)
    }

    fn skip(&self, states: Vec<usize>, at: Option<SourceId>, cause: SkipCause<'db>) -> Skip<'db> {
        let states = states.into_iter().filter_map(|it| self.behaviour.states.get(it).cloned());
        Skip { core: self.of, states: states.collect(), at, cause }
    }

    fn releases(&self, found: Option<&PassageOutcome<'_, 'db>>) -> Result<u32, Skip<'db>> {
        let Some(PassageOutcome { search, found, longest, .. }) = found else {
            return Err(self.skip(Vec::new(), None, SkipCause::TooLarge));
        };
        let assumed =
            || (0..search.states.len()).filter(|it| search.states.get(*it) == Some(&true)).collect();
        if search.states.contains(&false) && !self.may_stay() {
            return Err(self.skip(assumed(), None, SkipCause::Leaves));
        }
        match longest {
            Ok(Some(releases)) => Ok((*releases).max(1)),
            Ok(None) => Err(self.skip(assumed(), None, SkipCause::NoWrite)),
            Err(cycle) => {
                let states = search.states_of(found, cycle);
                Err(match search.skipped(found, cycle) {
                    Some((node, cause)) => self.skip(states, Some(node.at), cause),
                    None => self.skip(states, None, SkipCause::NoWrite),
                })
            }
        }
    }

    /// Returns whether the core may stay in the assumed states for ever; otherwise a bound for them would be one of nothing.
    fn may_stay(&self) -> bool {
        let is_assumed = |state: usize| self.search.states.get(state) == Some(&true);
        let all = &self.behaviour.edges.all;
        let assumed =
            |edge: usize| all.get(edge).is_some_and(|it| is_assumed(it.source) && is_assumed(it.target));
        let edges: Vec<(usize, usize)> = match self.interpreted() {
            Some(it) => {
                let own = it.product.edges.iter().filter(|it| assumed(it.edge as usize));
                own.map(ProductEdge::ends).collect()
            }
            None => {
                let own = (0..).zip(all).filter(|(index, _)| assumed(*index));
                own.map(|(_, it)| (it.source, it.target)).collect()
            }
        };
        let count = edges.iter().map(|(source, target)| 1 + source.max(target)).max().unwrap_or_default();
        topological_order(&successors_by(count, edges)).0.len() < count
    }

    fn passage(&self, from: u16, to: u16, carried: &[Slots], wanted: &[Slots]) -> Option<Passage<'db>> {
        let graph = &self.flows.graph;
        let (source, sink) = (graph.sources.get(usize::from(from))?, graph.sinks.get(usize::from(to))?);
        if source == sink {
            return None;
        }
        let skips = graph.skips(Some(from), Some(to), wanted);
        let search = PassageSearch { source: Some(from), wanted, skips: &skips, ..self.search };
        let carries =
            |moment: &Moment, node: &JobNode| node.sink == Some(to) && node.from & moment.carry != 0;
        // What follows may be too much too: then nothing is known.
        let found = self.explored(search, 1, |it| {
            let found = it.explore(self.arrivals(it), carries, true)?;
            let after = it.explore_after(&found, to)?;
            Some((found, self.overwritten(&after, carried)))
        });
        let handles = graph.to_handle.get(usize::from(to)).copied().unwrap_or_default();
        Some(Passage {
            from: source.clone(),
            to: sink.clone(),
            releases: self.releases(found.as_ref()),
            periods: self.periods(search, to),
            overwritten: found.and_then(|it| it.overwritten),
            written: self.written(to, carried),
            to_handle: handles,
        })
    }

    /// Returns the first write of less of those that follow a write of the data.
    fn overwritten(&self, after: &FoundMoments, carried: &[Slots]) -> Option<Overwrite<'db>> {
        let graph = &self.flows.graph;
        let first = after.goals.iter().position(|is_goal| *is_goal)?;
        let index = after.moments.get(first)?.node as usize;
        let node = graph.nodes.get(index)?;
        let place = graph.places.get(node.place as usize)?;
        Some(Overwrite {
            core: self.of,
            state: self.behaviour.states.get(place.state)?.clone(),
            program: self.program(place)?.id.clone(),
            at: node.at,
            is_older: carried.get(index)? & node.from != 0,
        })
    }

    /// Returns the most periods from a read to the last write that has nothing newer than what was read.
    fn periods(&self, search: PassageSearch<'_, 'db>, to: u16) -> Option<u32> {
        let search = PassageSearch { is_age: true, ..search };
        let is_read = |moment: &Moment| search.node(moment).is_some_and(|node| node.source == search.source);
        let is_last = |moment: &Moment, node: &JobNode| {
            node.sink == Some(to) && node.from & moment.carry != 0 && node.from & moment.newer == 0
        };
        let found = self.explored(search, 0, |search| {
            let starts = self.arrivals(search).filter(is_read).flat_map(|moment| search.taken(moment));
            let mut found = search.explore(starts, is_last, false)?;
            found.keep_to_goals();
            Some((found, None))
        });
        found?.longest.ok().flatten()
    }

    /// Returns what each edge executes up to its last write of data; nothing if an operation may write it, which a client calls before.
    fn written(&self, to: u16, carried: &[Slots]) -> Vec<Written<'db>> {
        let graph = &self.flows.graph;
        // By state: the programs with such a write, each with the calls that write.
        let mut by_state: FxHashMap<usize, Vec<(JobPlace, Vec<SourceId>)>> = FxHashMap::default();
        for (node, before) in graph.nodes.iter().zip(carried) {
            let Some(place) = graph.places.get(node.place as usize) else { continue };
            if node.sink != Some(to) || node.from & before == 0 {
                continue;
            }
            if place.is_called(self.behaviour) {
                return Vec::new();
            }
            let of_state = by_state.entry(place.state).or_default();
            match of_state.last_mut().filter(|(last, _)| last == place) {
                Some((_, calls)) => calls.push(node.call),
                None => of_state.push((*place, vec![node.call])),
            }
        }
        let mut found = Vec::new();
        let is_assumed = |state: usize| self.search.states.get(state) == Some(&true);
        let edges = self.behaviour.edges.all.iter().enumerate();
        for (index, edge) in edges.filter(|(_, edge)| is_assumed(edge.source) && is_assumed(edge.target)) {
            let executes = |place: &JobPlace| match place.edge {
                Some(other) => other == index,
                None => place.before < edge.first,
            };
            let of_state = by_state.get(&edge.source).into_iter().flatten();
            let last = of_state.filter(|(place, _)| executes(place)).max_by_key(|(place, _)| place.before);
            if let Some((place, calls)) = last {
                found.push(Written { edge: index, programs: place.before, part: self.part(place, calls) });
            }
        }
        found
    }

    /// Returns the cost of a program up to the end of the last of these calls.
    fn part(&self, place: &JobPlace, calls: &[SourceId]) -> Arc<CostGraph<'db>> {
        if let Some(found) = self.parts.borrow().get(calls) {
            return found.clone();
        }
        let at = self.program(place).map(|program| program.place);
        let graph = at.and_then(|(body, program)| graph_of(self.db, self.project, self.of, body, program));
        let found = Arc::new(graph.map(|graph| cost_until(graph, calls)).unwrap_or_default());
        self.parts.borrow_mut().insert(calls.to_vec(), found.clone());
        found
    }
}

fn is_port(end: &PassageEnd<'_>) -> bool {
    matches!(end, PassageEnd::Port(_))
}
