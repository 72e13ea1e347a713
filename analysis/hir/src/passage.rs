//! How data passes through a core: from an input port, an operation or a codel to an output port or a codel, in how many
//! periods, and which statement may overwrite it. Independent of all deployments: a changed period computes nothing here.

mod flow;
mod graph;
mod search;
mod types;

pub use self::types::{Assumption, Overwrite, Passage, PassageEnd, Passages, Skip, SkipCause, Written};

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, TimedProgram, behaviour_of};
use crate::body::core_scope;
use crate::cost::{Cost, cost_until};
use crate::infer::inference_of;
use crate::item_tree::{Machine, SourceId};
use crate::project::Project;
use crate::source::{Decl, core};

use self::graph::{Builder, Graph, Node, Place, Slots, code_of};
use self::search::{Found, Moment, Search};

/// What a core does with data, whatever is followed and assumed.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Flows<'db> {
    graph: Graph<'db>,
    /// The nodes that jobs come to, each with values of its cells.
    reached: Vec<(u32, u128)>,
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
) -> Option<Arc<Flows<'db>>> {
    let behaviour = behaviour_of(db, project, of);
    if !behaviour.refusals.is_empty() {
        return None;
    }
    let mut flows = Flows {
        graph: Builder::new(db, project, of, behaviour, through_handles)?.build(),
        ..Flows::default()
    };
    let states = vec![true; flows.graph.starts.len()];
    for forgets in [false, true] {
        let search = Search { forgets, ..Search::new(&flows.graph, &states) };
        if let Some(found) = search.explore(search.starts(), |_, _| false, false) {
            flows.reached = found.moments.iter().map(|it| (it.node, it.values)).collect();
            flows.forgets = forgets;
            return Some(Arc::new(flows));
        }
    }
    flows.too_large = true;
    Some(Arc::new(flows))
}

/// Returns how data passes through a core.
#[salsa::tracked(returns(ref))]
pub fn passages_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    assumption: Assumption<'db>,
) -> Passages<'db> {
    let Some(flows) = flows_of(db, project, of, assumption.through_handles(db)) else {
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
    let search = Search {
        answers: assumption.answers(db),
        new_data: &new_data,
        forgets: flows.forgets,
        ..Search::new(graph, &states)
    };
    Context { db, project, of, flows, behaviour, search }.all()
}

struct Context<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flows: &'a Flows<'db>,
    behaviour: &'db Behaviour<'db>,
    /// Follows nothing.
    search: Search<'a, 'db>,
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
                found.reads.push((port.clone(), self.gap(Some(from), None)));
            }
        }
        found
    }

    fn program(&self, place: &Place) -> Option<&TimedProgram<'db>> {
        let operation = place.program.checked_sub(self.behaviour.programs.len());
        let operation = operation.and_then(|index| self.behaviour.operations.get(index));
        self.behaviour.programs.get(place.program).or(operation)
    }

    fn state_of(&self, node: u32) -> Option<usize> {
        let graph = &self.flows.graph;
        Some(graph.places.get(graph.nodes.get(node as usize)?.place as usize)?.state)
    }

    /// Returns where the core may be when data arrives.
    fn arrivals<'a>(&'a self, search: Search<'a, 'db>) -> impl Iterator<Item = Moment> + 'a {
        let is_assumed = |node| self.state_of(node).and_then(|it| search.states.get(it)) == Some(&true);
        let reached =
            self.flows.reached.iter().filter(move |(node, _)| !search.is_skipped(*node) && is_assumed(*node));
        reached.map(move |(node, values)| search.start(*node, *values))
    }

    /// Returns the most releases from any instant to the next of some nodes.
    fn gap(&self, source: Option<u16>, sink: Option<u16>) -> Result<u32, Skip<'db>> {
        let skips = self.flows.graph.skips(source, sink, &[]);
        let search = Search { skips: &skips, ..self.search };
        let is_goal = |_: &Moment, node: &Node| match sink {
            Some(_) => node.sink == sink,
            None => node.source == source,
        };
        let found = search.explore(self.arrivals(search), is_goal, true);
        self.releases(search, found.as_ref())
    }

    fn releases(&self, search: Search<'_, 'db>, found: Option<&Found>) -> Result<u32, Skip<'db>> {
        let skip = |states: Vec<usize>, at, cause| {
            let states = states.into_iter().filter_map(|it| self.behaviour.states.get(it).cloned());
            Skip { core: self.of, states: states.collect(), at, cause }
        };
        let Some(found) = found.filter(|_| !self.flows.too_large && !self.flows.graph.too_large) else {
            return Err(skip(Vec::new(), None, SkipCause::TooLarge));
        };
        match search.longest(found) {
            Ok(Some(releases)) => Ok(releases.max(1)),
            Ok(None) => {
                let states = (0..search.states.len()).filter(|it| search.states.get(*it) == Some(&true));
                Err(skip(states.collect(), None, SkipCause::NoWrite))
            }
            Err(cycle) => {
                let states = search.states_of(found, &cycle);
                Err(match search.skipped(found, &cycle) {
                    Some((node, cause)) => skip(states, Some(node.at), cause),
                    None => skip(states, None, SkipCause::NoWrite),
                })
            }
        }
    }

    fn passage(&self, from: u16, to: u16, carried: &[Slots], wanted: &[Slots]) -> Option<Passage<'db>> {
        let graph = &self.flows.graph;
        let ends = [graph.sources.get(usize::from(from))?, graph.sinks.get(usize::from(to))?];
        if let [PassageEnd::Codel(from), PassageEnd::Codel(to)] = ends
            && from == to
        {
            return None;
        }
        let skips = graph.skips(Some(from), Some(to), wanted);
        let mut search = Search { source: Some(from), wanted, skips: &skips, ..self.search };
        let carries = |moment: &Moment, node: &Node| node.sink == Some(to) && node.from & moment.carry != 0;
        let mut found = search.explore(self.arrivals(search), carries, true);
        if found.is_none() && !search.forgets {
            search.forgets = true;
            found = search.explore(self.arrivals(search), carries, true);
        }
        let releases = self.releases(search, found.as_ref());
        let overwritten = found.and_then(|found| self.overwritten(search, &found, to, carried));
        let handles = graph.to_handle.get(usize::from(to)).copied().unwrap_or_default();
        Some(Passage {
            from: ends[0].clone(),
            to: ends[1].clone(),
            releases,
            periods: self.periods(search, to),
            overwritten,
            written: self.written(to, carried),
            to_handle: handles,
        })
    }

    /// Returns the first write of less after a write of the data.
    fn overwritten(
        &self,
        search: Search<'_, 'db>,
        found: &Found,
        to: u16,
        carried: &[Slots],
    ) -> Option<Overwrite<'db>> {
        let graph = &self.flows.graph;
        let is_less = |moment: &Moment, node: &Node| node.sink == Some(to) && node.from & moment.carry == 0;
        let after = search.explore(search.after_goals(found), is_less, true)?;
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
    fn periods(&self, search: Search<'_, 'db>, to: u16) -> Option<u32> {
        let search = Search { is_age: true, ..search };
        let is_read = |moment: &Moment| search.node(moment).is_some_and(|node| node.source == search.source);
        let starts = self.arrivals(search).filter(is_read).flat_map(|moment| search.taken(moment));
        let mut found = search.explore(
            starts,
            |moment, node| {
                node.sink == Some(to) && node.from & moment.carry != 0 && node.from & moment.newer == 0
            },
            false,
        )?;
        found.keep_to_goals();
        search.longest(&found).ok().flatten()
    }

    /// Returns what each edge executes up to its last write of data.
    fn written(&self, to: u16, carried: &[Slots]) -> Vec<Written<'db>> {
        let graph = &self.flows.graph;
        // By state: the programs with such a write, each with the calls that write.
        let mut by_state: FxHashMap<usize, Vec<(Place, Vec<SourceId>)>> = FxHashMap::default();
        for (node, before) in graph.nodes.iter().zip(carried) {
            let Some(place) = graph.places.get(node.place as usize) else { continue };
            if node.sink != Some(to) || node.from & before == 0 {
                continue;
            }
            if place.is_called(self.behaviour) {
                return vec![Written { edge: 0, programs: usize::MAX, part: Arc::default() }];
            }
            let of_state = by_state.entry(place.state).or_default();
            match of_state.last_mut().filter(|(last, _)| last == place) {
                Some((_, calls)) => calls.push(node.call),
                None => of_state.push((*place, vec![node.call])),
            }
        }
        let mut found = Vec::new();
        let mut parts = FxHashMap::default();
        let is_assumed = |state: usize| self.search.states.get(state) == Some(&true);
        let edges = self.behaviour.edges.all.iter().enumerate();
        for (index, edge) in edges.filter(|(_, edge)| is_assumed(edge.source) && is_assumed(edge.target)) {
            let executes = |place: &Place| match place.edge {
                Some(other) => other == index,
                None => place.before < edge.first,
            };
            let of_state = by_state.get(&edge.source).into_iter().flatten();
            let last = of_state.filter(|(place, _)| executes(place)).max_by_key(|(place, _)| place.before);
            if let Some((place, calls)) = last {
                let part = parts.entry(calls.first()).or_insert_with(|| Arc::new(self.part(place, calls)));
                found.push(Written { edge: index, programs: place.before, part: part.clone() });
            }
        }
        found
    }

    fn part(&self, place: &Place, calls: &[SourceId]) -> Cost<'db> {
        let (core, scope) = (core(self.db, self.of), core_scope(self.db, self.of).as_ref());
        let program = self.program(place);
        let Some((core, scope, program)) = core.zip(scope).zip(program).map(|((a, b), c)| (a, b, c)) else {
            return Cost::default();
        };
        let states = core.machines.first().map_or_else(FxHashMap::default, Machine::state_indices);
        let Some((body, code)) = code_of(core, &states, &program.id) else { return Cost::default() };
        let inference = inference_of(self.db, self.project, self.of, scope.group(body).unwrap_or_default());
        cost_until(self.of, code, inference, calls)
    }
}
