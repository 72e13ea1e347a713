//! Follows data through the jobs of a core, for all its paths: how long it may take, and what may happen on the way.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, VecDeque};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::graph::{closure, components, predecessors_by, reachable, topological_order};
use crate::product::Interpreted;
use crate::source::Decl;

use super::graph::{
    ANY, CellValues, JobGraph, JobNode, NEW_DATA, NO_DATA, NodeOperand, NodeStep, SHARED_SLOTS, Slots, TRUE,
    bits, shift,
};
use super::types::{PassageEnd, SkipCause};

/// The greatest number of states of a search, unless the core has more nodes.
const MAX_STATES: usize = 20_000;

/// Where the core is, and what its variables carry, while data is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Moment {
    pub(super) node: u32,
    /// The state of the product in which the job begins; 0 where none is followed.
    pub(super) product: u32,
    /// The slots that carry the data, or newer data.
    pub(super) carry: Slots,
    /// Those that carry newer data, where the age of one value is followed.
    pub(super) newer: Slots,
    /// The values that each cell may have: 3 bits each.
    pub(super) values: u128,
    /// Whether the followed input was read since the data arrived.
    is_taken: bool,
}

impl Moment {
    fn get(&self, operand: NodeOperand) -> CellValues {
        match operand {
            NodeOperand::Known(values) => values,
            NodeOperand::Cell(cell) => (self.values >> shift(cell)) as CellValues & ANY,
        }
    }

    fn set(&mut self, cell: u8, values: CellValues) {
        self.values = self.values & !bits(cell) | u128::from(values) << shift(cell);
    }
}

/// The most conditions whose outcomes are combined.
const MOST_DECISIONS: usize = 8;

/// What is followed, and what is assumed meanwhile.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassageSearch<'a, 'db> {
    pub(super) graph: &'a JobGraph<'db>,
    /// What counters and modes decide, if they are followed.
    pub(super) interpreted: Option<&'a Interpreted<'db>>,
    /// Where the data comes from.
    pub(super) source: Option<u16>,
    /// Whether one value is followed, instead of the newest one.
    pub(super) is_age: bool,
    /// The slots after each node whose data may come to the sink; empty if nothing is followed.
    pub(super) wanted: &'a [Slots],
    /// For each node, the first one from it on that matters; empty if all do.
    pub(super) skips: &'a [u32],
    /// Whether the core may enter each state.
    pub(super) states: &'a [bool],
    pub(super) answers: &'a [Decl<'db>],
    /// The sources that are assumed to have new data.
    pub(super) new_data: &'a [u16],
    /// Whether values of variables are forgotten at the end of each job, for cores that are too large otherwise.
    pub(super) forgets: bool,
}

/// All moments that a search finds.
#[derive(Debug, Clone, Default)]
pub(super) struct FoundMoments {
    pub(super) moments: Vec<Moment>,
    pub(super) successors: Vec<Vec<usize>>,
    /// Whether each is a goal.
    pub(super) goals: Vec<bool>,
}

/// A repeated part of a path.
pub(super) type PathCycle = Vec<usize>;

impl<'a, 'db> PassageSearch<'a, 'db> {
    /// Follows and assumes nothing.
    pub(super) fn new(graph: &'a JobGraph<'db>, states: &'a [bool]) -> PassageSearch<'a, 'db> {
        let (wanted, skips, answers, new_data) = (&[][..], &[][..], &[][..], &[][..]);
        PassageSearch {
            graph,
            interpreted: None,
            source: None,
            is_age: false,
            wanted,
            skips,
            states,
            answers,
            new_data,
            forgets: false,
        }
    }

    pub(super) fn node(&self, moment: &Moment) -> Option<&'a JobNode> {
        self.graph.nodes.get(moment.node as usize)
    }

    /// Returns a moment before a node, when nothing carries data.
    pub(super) fn start(&self, node: u32, product: u32, values: u128) -> Moment {
        let product = if self.interpreted.is_some() { product } else { 0 };
        Moment { node, product, carry: 0, newer: 0, values, is_taken: false }
    }

    /// Returns the nodes that jobs come to from the first one in a state; none if there are too many.
    pub(super) fn reached(&self, initial: usize) -> Option<Vec<(u32, u32, u128)>> {
        let found = self.explore(self.first(initial), |_, _| false, false)?;
        Some(found.moments.iter().map(|it| (it.node, it.product, it.values)).collect())
    }

    /// Returns the values of all cells when nothing is known, at the beginning of a job.
    fn unknown(&self) -> u128 {
        let mut moment = self.start(0, 0, 0);
        (0..).zip(&self.graph.domains).for_each(|(cell, &values)| moment.set(cell, values));
        moment.values
    }

    /// Returns the moments before the first job in a state, when nothing is known but what counters and modes may be there.
    pub(super) fn first(&self, state: usize) -> Vec<Moment> {
        let start = self.graph.starts.get(state);
        let moments = |&node: &u32| self.products(state).map(move |it| self.start(node, it, self.unknown()));
        start.into_iter().flat_map(moments).collect()
    }

    /// Returns the states of the product that are in a state; 0 where none is followed.
    fn products(&self, state: usize) -> impl Iterator<Item = u32> {
        let all = self.interpreted.map_or(&[][..], |it| &it.product.states);
        let own = (0..).zip(all).filter(move |(_, it)| it.state as usize == state).map(|(index, _)| index);
        own.chain(self.interpreted.is_none().then_some(0))
    }

    /// Returns whether nodes between two others are left out for a node.
    pub(super) fn is_skipped(&self, node: u32) -> bool {
        self.skips.get(node as usize).is_some_and(|it| *it != node)
    }

    /// Returns a moment at the first node from it on that matters, with the values that do; none if the assumed states exclude it.
    fn reduced(&self, mut moment: Moment) -> Option<Moment> {
        moment.node = self.skips.get(moment.node as usize).copied().unwrap_or(moment.node);
        let node = self.node(&moment)?;
        let target = self.graph.places.get(node.place as usize).and_then(|it| it.target);
        moment.values &= self.graph.live.get(moment.node as usize).copied().unwrap_or_default();
        target.is_none_or(|it| self.states.get(it) == Some(&true)).then_some(moment)
    }

    /// Returns the moments after a read of the source, to follow the value that it read.
    pub(super) fn taken(&self, mut moment: Moment) -> Vec<Moment> {
        let mut found = Vec::new();
        (moment.carry, moment.newer) = (0, 0);
        let followed = PassageSearch { is_age: false, ..*self };
        moment.is_taken = true;
        followed.after(moment, &mut found);
        found.retain(|it| it.carry != 0);
        found
    }

    /// Adds the moments that may follow.
    fn after(&self, moment: Moment, found: &mut Vec<Moment>) {
        let Some(node) = self.node(&moment) else { return };
        if self.is_age && moment.carry & !moment.newer == 0 {
            return;
        }
        match node.step {
            NodeStep::End(state) => self.next_job(moment, node, state, found),
            NodeStep::Branch(left, right) => self.branch(moment, node, left, right, found),
            NodeStep::Read(cell) => self.read(moment, node, cell, found),
            NodeStep::Plain => {
                let is_source = node.source.is_some() && node.source == self.source;
                found.extend(self.copied(moment, node, is_source));
            }
        }
    }

    fn next_job(&self, mut moment: Moment, node: &JobNode, state: usize, found: &mut Vec<Moment>) {
        let Some(&start) = self.graph.starts.get(state) else { return };
        if self.states.get(state) != Some(&true) {
            return;
        }
        moment.node = start;
        let shared = (1 << SHARED_SLOTS) - 1;
        moment.carry &= shared;
        moment.newer &= moment.carry;
        if self.forgets {
            moment.values = self.unknown();
        }
        let edge = self.graph.places.get(node.place as usize).and_then(|it| it.edge);
        match self.interpreted.zip(edge) {
            Some((interpreted, edge)) => {
                // The shortest cycles are found first: those with equal values.
                let mut products: Vec<u32> = interpreted.after(moment.product, edge).collect();
                products.sort_by_key(|product| *product != moment.product);
                found.extend(products.into_iter().map(|product| Moment { product, ..moment }));
            }
            None => found.push(moment),
        }
    }

    fn branch(
        &self,
        moment: Moment,
        node: &JobNode,
        left: NodeOperand,
        right: NodeOperand,
        found: &mut Vec<Moment>,
    ) {
        let (a, b) = (moment.get(left), moment.get(right));
        let go = |which: usize, known: [(NodeOperand, CellValues); 2]| {
            let mut moment = Moment { node: (*node.next.get(which)?)?, ..moment };
            for (operand, values) in known.into_iter().filter(|_| left != right) {
                if let NodeOperand::Cell(cell) = operand {
                    moment.set(cell, values);
                }
            }
            Some(moment)
        };
        let decided = self.interpreted.and_then(|it| it.decided.get(&(moment.product, node.at)));
        let excluded = node.holds.zip(decided).map(|(at, holds)| if *holds { 1 - at } else { at });
        if a & b != 0 && excluded != Some(0) {
            found.extend(go(0, [(left, a & b), (right, a & b)]));
        }
        // They differ if they cannot be equal; if one is known, the other is none of its values.
        if (a != b || a.count_ones() != 1) && excluded != Some(1) {
            let without =
                |own: CellValues, other: CellValues| if other.count_ones() == 1 { own & !other } else { own };
            found.extend(go(1, [(left, without(a, b)), (right, without(b, a))]));
        }
    }

    fn read(&self, mut moment: Moment, node: &JobNode, cell: Option<u8>, found: &mut Vec<Moment>) {
        let is_source = node.source == self.source;
        let source = node.source.and_then(|source| self.graph.sources.get(usize::from(source)));
        // With these statuses, the variables keep their values.
        let kept = if matches!(source, Some(PassageEnd::Operation(_))) { !NEW_DATA & ANY } else { NO_DATA };
        let is_new = node.source.is_some_and(|it| self.new_data.contains(&it));
        let statuses = match (is_source, moment.is_taken) {
            _ if is_new => NEW_DATA,
            (true, false) if !self.is_age => NEW_DATA,
            (true, _) if kept == NO_DATA => ANY & !NO_DATA,
            _ => ANY,
        };
        moment.is_taken |= is_source;
        let changes = is_source || moment.carry & node.to != 0;
        let [copies, keeps] = if changes { [statuses & !kept, statuses & kept] } else { [statuses, 0] };
        if copies != 0 {
            let mut moment = moment;
            cell.into_iter().for_each(|cell| moment.set(cell, copies));
            found.extend(self.copied(moment, node, is_source));
        }
        if keeps != 0 {
            cell.into_iter().for_each(|cell| moment.set(cell, keeps));
            found.extend(node.next.first().copied().flatten().map(|next| Moment { node: next, ..moment }));
        }
    }

    /// Returns the moment after a node that copies data.
    fn copied(&self, mut moment: Moment, node: &JobNode, is_source: bool) -> Option<Moment> {
        let wanted = self.wanted.get(moment.node as usize).copied().unwrap_or_default();
        if let Some((cell, operand)) = node.value {
            let is_true =
                self.graph.calls.get(&moment.node).is_some_and(|codel| self.answers.contains(codel));
            moment.set(cell, if is_true { TRUE } else { moment.get(operand) });
        }
        let copy = |slots: Slots, is_source: bool| {
            let copied = if is_source || slots & node.from != 0 { node.to } else { 0 };
            (slots & !node.to | copied) & wanted
        };
        moment.newer = copy(moment.newer, is_source && self.is_age);
        moment.carry = copy(moment.carry, is_source);
        moment.node = node.next.first().copied().flatten()?;
        Some(moment)
    }

    /// Returns all moments from `starts` on; with `stops`, up to the goals. None if there are too many.
    pub(super) fn explore(
        &self,
        starts: impl IntoIterator<Item = Moment>,
        is_goal: impl Fn(&Moment, &JobNode) -> bool,
        stops: bool,
    ) -> Option<FoundMoments> {
        let limit = MAX_STATES.max(self.graph.nodes.len() * 4);
        let (mut found, mut numbers) = (FoundMoments::default(), FxHashMap::default());
        let mut number = |found: &mut FoundMoments, moment: Moment| match numbers.entry(moment) {
            Entry::Occupied(entry) => *entry.get(),
            Entry::Vacant(entry) => {
                found.moments.push(moment);
                *entry.insert(found.moments.len() - 1)
            }
        };
        for start in starts.into_iter().filter_map(|it| self.reduced(it)) {
            number(&mut found, start);
        }
        let mut next = 0;
        let mut after = Vec::new();
        while let Some(&moment) = found.moments.get(next) {
            next += 1;
            if found.moments.len() > limit {
                return None;
            }
            let is_goal = self.node(&moment).is_some_and(|node| is_goal(&moment, node));
            if !(is_goal && stops) {
                self.after(moment, &mut after);
            }
            let successors = after.drain(..).filter_map(|moment| self.reduced(moment));
            let successors = successors.map(|moment| number(&mut found, moment)).collect();
            found.successors.push(successors);
            found.goals.push(is_goal);
        }
        Some(found)
    }

    /// Returns what may follow the goals, up to writes to `sink` that carry less.
    pub(super) fn explore_after(&self, found: &FoundMoments, sink: u16) -> Option<FoundMoments> {
        let goals = found.moments.iter().zip(&found.goals).filter(|(_, is_goal)| **is_goal);
        let mut after = Vec::new();
        goals.for_each(|(moment, _)| self.after(*moment, &mut after));
        let is_less =
            |moment: &Moment, node: &JobNode| node.sink == Some(sink) && node.from & moment.carry == 0;
        self.explore(after, is_less, true)
    }

    /// Returns the most ends of jobs on a path to a goal; none if no path comes to one. A path that may miss all goals for ever is
    /// an error.
    pub(super) fn longest(&self, found: &FoundMoments) -> Result<Option<u32>, PathCycle> {
        let ends = |index: usize| {
            let node = found.moments.get(index).and_then(|it| self.node(it));
            node.is_some_and(|node| matches!(node.step, NodeStep::End(_)))
        };
        // Calls of operations before a job may repeat, and take no job.
        let all = components(&found.successors);
        let mut numbers = vec![None; found.moments.len()];
        for (number, component) in all.iter().enumerate() {
            component.iter().for_each(|it| _ = numbers.get_mut(*it).map(|it| *it = Some(number)));
        }
        let of = |index: usize| numbers.get(index).copied().flatten();
        let mut longest: Vec<Option<u32>> = Vec::with_capacity(all.len());
        for (number, component) in all.iter().enumerate() {
            let mut most = None;
            for &index in component {
                let after = found.successors.get(index).into_iter().flatten();
                for &next in after {
                    match of(next) {
                        Some(own) if own != number => {
                            let after = longest.get(own).copied().flatten();
                            most = most.max(after.map(|jobs| jobs + u32::from(ends(index))));
                        }
                        _ if ends(index) => {
                            let (order, _) = topological_order(&found.successors);
                            let shown = cycle(found, &order);
                            // That one may only repeat calls.
                            return Err(match shown.iter().any(|it| ends(*it)) {
                                true => shown,
                                false => cycle_of(found, next, index, &|it| of(it) == Some(number)),
                            });
                        }
                        _ => {}
                    }
                }
                let is_goal = found.goals.get(index) == Some(&true);
                most = most.max(is_goal.then_some(0));
            }
            longest.push(most);
        }
        Ok(longest.into_iter().max().flatten())
    }

    /// Returns [`PassageSearch::longest`] where conditions on the data decide what is written. A change lasts: each condition has the
    /// same outcome from then on. With outcomes that lead to no goal, the data decides nothing.
    pub(super) fn longest_decided(&self, found: &FoundMoments) -> Result<Option<u32>, PathCycle> {
        let decides = |moment: &Moment| {
            self.node(moment)
                .is_some_and(|it| matches!(it.step, NodeStep::Branch(..)) && it.from & moment.carry != 0)
        };
        let nodes: BTreeSet<u32> = found.moments.iter().filter(|it| decides(it)).map(|it| it.node).collect();
        let nodes: Vec<u32> = nodes.into_iter().collect();
        if nodes.is_empty() || nodes.len() > MOST_DECISIONS {
            return self.longest(found);
        }
        let mut most = None;
        for outcomes in 0..1_usize << nodes.len() {
            let mut kept = found.clone();
            for (moment, successors) in found.moments.iter().zip(&mut kept.successors) {
                let number = nodes.iter().position(|it| *it == moment.node).filter(|_| decides(moment));
                let Some((number, node)) = number.zip(self.node(moment)) else { continue };
                let next = node.next.get(outcomes >> number & 1).copied().flatten();
                let next = next.map(|it| self.skips.get(it as usize).copied().unwrap_or(it));
                successors.retain(|it| found.moments.get(*it).map(|it| it.node) == next);
            }
            kept.keep_to_goals();
            most = most.max(self.longest(&kept)?);
        }
        Ok(most)
    }

    /// Returns whether a cycle that was found without the values of counters and modes may repeat for ever with them.
    pub(super) fn may_repeat(&self, found: &FoundMoments, cycle: &PathCycle) -> bool {
        let all: FxHashSet<Moment> = cycle.iter().filter_map(|it| found.moments.get(*it)).copied().collect();
        let first = cycle.first().and_then(|it| found.moments.get(*it));
        let place = first.and_then(|it| self.graph.places.get(self.node(it)?.place as usize));
        let products = place.into_iter().flat_map(|it| self.products(it.state));
        let starts = products.flat_map(|product| first.map(|it| Moment { product, ..*it }));
        let leaves = |moment: &Moment, _: &JobNode| !all.contains(&Moment { product: 0, ..*moment });
        self.explore(starts, leaves, true).is_none_or(|found| self.longest(&found).is_err())
    }

    /// Returns which branch of a cycle avoids a goal, and why it may.
    pub(super) fn skipped(
        &self,
        found: &FoundMoments,
        cycle: &PathCycle,
    ) -> Option<(&'a JobNode, SkipCause<'db>)> {
        let reaches = reaches_goal(found);
        let mut far = None;
        for (position, &index) in cycle.iter().enumerate() {
            let taken = cycle.get(position + 1).or(cycle.first());
            let (Some(moment), Some(successors)) = (found.moments.get(index), found.successors.get(index))
            else {
                continue;
            };
            let Some(node) = self.node(moment) else { continue };
            let NodeStep::Branch(left, right) = node.step else { continue };
            let Some(&other) = successors.iter().find(|it| Some(*it) != taken) else { continue };
            let of = |operand| self.cause(found, cycle, position, operand);
            let cause = || (node, of(left).or_else(|| of(right)).unwrap_or(SkipCause::Condition));
            if self.in_job(found, other) {
                return Some(cause());
            }
            if far.is_none() && reaches.get(other) == Some(&true) {
                far = Some(cause());
            }
        }
        far
    }

    /// Returns why a cell has no known value at a position of a cycle: by what sets it last.
    fn cause(
        &self,
        found: &FoundMoments,
        cycle: &PathCycle,
        position: usize,
        operand: NodeOperand,
    ) -> Option<SkipCause<'db>> {
        let NodeOperand::Cell(mut cell) = operand else { return None };
        let before = cycle.iter().take(position).rev().chain(cycle.iter().skip(position).rev());
        for moment in before.filter_map(|index| found.moments.get(*index)) {
            match self.node(moment).and_then(|node| node.value).filter(|(set, _)| *set == cell) {
                Some((_, NodeOperand::Cell(other))) => cell = other,
                Some((_, NodeOperand::Known(_))) => {
                    return self.graph.calls.get(&moment.node).map(|codel| SkipCause::Answer(*codel));
                }
                None => {}
            }
        }
        let port = self.graph.statuses.get(&cell)?.clone();
        let own = self.source.and_then(|source| self.graph.sources.get(usize::from(source)));
        let is_own = own == Some(&PassageEnd::Port(port.clone()));
        Some(if is_own { SkipCause::AlreadyRead } else { SkipCause::OtherPort(port) })
    }

    /// Returns whether a goal follows in the same job.
    fn in_job(&self, found: &FoundMoments, from: usize) -> bool {
        let ends = |index: usize| {
            let node = found.moments.get(index).and_then(|it| self.node(it));
            node.is_none_or(|node| matches!(node.step, NodeStep::End(_)))
        };
        let within = |index: usize| {
            let next =
                if ends(index) { &[] } else { found.successors.get(index).map_or(&[][..], Vec::as_slice) };
            next.iter().copied()
        };
        closure([from], within).into_iter().any(|it| found.goals.get(it) == Some(&true))
    }

    /// Returns the states in which the jobs of a cycle begin, in order.
    pub(super) fn states_of(&self, found: &FoundMoments, cycle: &PathCycle) -> Vec<usize> {
        let ends = cycle.iter().filter_map(|index| {
            let node = self.node(found.moments.get(*index)?)?;
            let place = self.graph.places.get(node.place as usize)?;
            matches!(node.step, NodeStep::End(_)).then_some(place.state)
        });
        ends.collect()
    }
}

impl FoundMoments {
    /// Removes the paths that come to no goal.
    pub(super) fn keep_to_goals(&mut self) {
        let reaches = reaches_goal(self);
        for (successors, reached) in self.successors.iter_mut().zip(&reaches) {
            successors.retain(|next| *reached && reaches.get(*next) == Some(&true));
        }
    }
}

/// Returns whether each moment may come to a goal.
fn reaches_goal(found: &FoundMoments) -> Vec<bool> {
    let goals = (0..).zip(&found.goals).filter(|(_, is_goal)| **is_goal).map(|(index, _)| index);
    reachable(&predecessors_by(&found.successors), goals)
}

/// Returns a cycle among the moments that are not in `order`: all others reach none.
fn cycle(found: &FoundMoments, order: &[usize]) -> PathCycle {
    let mut is_open = vec![true; found.moments.len()];
    for &index in order {
        is_open.get_mut(index).into_iter().for_each(|it| *it = false);
    }
    let is_open = |index: &usize| is_open.get(*index) == Some(&true);
    // Each of them has a successor among them.
    let mut seen = FxHashSet::default();
    let mut current = (0..found.moments.len()).find(is_open);
    while let Some(index) = current {
        if !seen.insert(index) {
            return shortest(found, index, is_open);
        }
        current = found.successors.get(index).and_then(|it| it.iter().copied().find(is_open));
    }
    PathCycle::new()
}

/// Returns the shortest cycle through a moment.
fn shortest(found: &FoundMoments, first: usize, is_open: impl Fn(&usize) -> bool) -> PathCycle {
    let mut before: FxHashMap<usize, usize> = FxHashMap::default();
    let mut open = VecDeque::from([first]);
    while let Some(index) = open.pop_front().filter(|_| !before.contains_key(&first)) {
        for &next in found.successors.get(index).into_iter().flatten().filter(|it| is_open(it)) {
            before.entry(next).or_insert_with(|| {
                open.push_back(next);
                index
            });
        }
    }
    let up = |index: &usize| before.get(index).copied().filter(|it| *it != first);
    let mut path: PathCycle = std::iter::successors(before.get(&first).copied(), up).collect();
    path.retain(|it| *it != first);
    path.push(first);
    path.reverse();
    path
}

/// Returns the shortest cycle that leads from `last` to `first`, through some moments.
fn cycle_of(found: &FoundMoments, first: usize, last: usize, is_in: &dyn Fn(usize) -> bool) -> PathCycle {
    let mut before: FxHashMap<usize, usize> = FxHashMap::from_iter([(first, first)]);
    closure([first], |index| {
        let next = found.successors.get(index).into_iter().flatten().copied().filter(|it| is_in(*it));
        let next: Vec<usize> = next.collect();
        next.iter().for_each(|next| _ = before.entry(*next).or_insert(index));
        next
    });
    let up = |index: &usize| before.get(index).copied().filter(|before| before != index);
    let mut path: Vec<usize> = std::iter::successors(Some(last), up).collect();
    path.reverse();
    path
}
