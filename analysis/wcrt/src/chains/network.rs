//! The passages of the components of an architecture, and the connections between them.
//!
//! ```text
//! hokuyo: sweep → scan ─→ guidance: scan → command ─→ p3dx_driver: command → drive
//! ```
//!
//! Nothing here depends on a deployment: a changed period computes it not again.

use std::cell::OnceCell;
use std::collections::VecDeque;

use mauve_hir::item_tree::{Direction, Name, Parameter};
use mauve_hir::{
    Assumption, Decl, Flat, Link, ModelDb, PassageEnd, Passages, Project, Type, closure, codel, core_of,
    passages_of, type_of,
};
use rustc_hash::{FxHashMap, FxHashSet};

use super::{ChainEnd, ChainWay, WayStep};
use crate::psm::is_readable;

/// Where data is: the instance, by its index in [`Flat::instances`], and where it enters or leaves that.
pub(super) type DataPlace<'db> = (usize, PassageEnd<'db>);

/// The instances and connections of an architecture.
pub(super) struct Network<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    pub(super) flat: &'db Flat<'db>,
    nodes: Vec<InstanceNode<'db>>,
    by_name: FxHashMap<&'db str, usize>,
    /// Where data goes that leaves an instance: the connection, and where it enters the next one.
    leaving: FxHashMap<DataPlace<'db>, Vec<(usize, DataPlace<'db>)>>,
}

/// An instance.
struct InstanceNode<'db> {
    assumption: Assumption<'db>,
    /// None where its component has errors, or is unknown.
    core: Option<Decl<'db>>,
    /// Computed where data comes to it.
    through: OnceCell<Through<'db>>,
}

/// How data passes through an instance.
struct Through<'db> {
    passages: &'db Passages<'db>,
    /// The codels whose outputs go on: they are no effects.
    feeding: FxHashSet<&'db PassageEnd<'db>>,
    /// The codels that get inputs from others: they are no sources.
    fed: FxHashSet<&'db PassageEnd<'db>>,
}

/// How many ways are found, and how many steps they have together.
const MOST_WAYS: usize = 10_000;
const MOST_STEPS: usize = 400_000;

fn port<'db>((_, name): &(Name, Name)) -> PassageEnd<'db> {
    PassageEnd::Port(name.clone())
}

fn operation<'db>((_, name): &(Name, Name)) -> PassageEnd<'db> {
    PassageEnd::Operation(name.clone())
}

impl<'db> Network<'db> {
    pub(super) fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        flat: &'db Flat<'db>,
        assumption: impl Fn(&Name, Decl<'db>) -> Assumption<'db>,
    ) -> Network<'db> {
        let nothing = Assumption::nothing(db);
        let node = |name: &Name, component: Option<Decl<'db>>| {
            let known = component.filter(|&component| *is_readable(db, project, component));
            let core = known.and_then(|component| core_of(db, project, component));
            let assumption = core.map_or(nothing, |core| assumption(name, core));
            InstanceNode { assumption, core, through: OnceCell::new() }
        };
        let nodes = flat.instances.iter().map(|it| node(&it.name, it.component)).collect();
        let mut found = Network {
            db,
            project,
            flat,
            nodes,
            by_name: FxHashMap::default(),
            leaving: FxHashMap::default(),
        };
        found.connect();
        found
    }

    fn connect(&mut self) {
        for (number, instance) in self.flat.instances.iter().enumerate() {
            self.by_name.entry(&instance.name).or_insert(number);
        }
        for (number, link) in self.flat.links.iter().enumerate() {
            let ends = [&link.source, &link.target].map(|(instance, _)| self.instance(instance));
            let [Some(source), Some(target)] = ends else { continue };
            let mut add = |from, to| self.leaving.entry(from).or_default().push((number, to));
            if link.operation {
                // A call goes from the client, at the target, to the provider; its results go back.
                let [provider, client] =
                    [(source, operation(&link.source)), (target, operation(&link.target))];
                add(client.clone(), provider.clone());
                add(provider, client);
            } else {
                add((source, port(&link.source)), (target, port(&link.target)));
            }
        }
    }

    /// Returns whether nothing is known of the component of an instance.
    pub(super) fn is_unknown(&self, instance: usize) -> bool {
        self.nodes.get(instance).is_none_or(|node| node.core.is_none())
    }

    /// Returns how data passes through an instance; none if nothing is known of its component.
    fn through(&self, instance: usize) -> Option<&Through<'db>> {
        let node = self.nodes.get(instance)?;
        let core = node.core?;
        Some(node.through.get_or_init(|| {
            let passages = passages_of(self.db, self.project, core, node.assumption);
            let is_codel = |end: &&PassageEnd<'db>| matches!(end, PassageEnd::Codel(_));
            let on = passages.all.iter().filter(|it| it.from != it.to);
            let feeding = on.clone().map(|it| &it.from).filter(is_codel).collect();
            let fed = on.map(|it| &it.to).filter(is_codel).collect();
            Through { passages, feeding, fed }
        }))
    }

    /// Returns the instance of that name.
    pub(super) fn instance(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Returns where data goes that leaves an instance here.
    pub(super) fn after(&self, place: &DataPlace<'db>) -> &[(usize, DataPlace<'db>)] {
        self.leaving.get(place).map_or(&[], Vec::as_slice)
    }

    fn step(
        &self,
        instance: usize,
        connection: Option<usize>,
        ends: [PassageEnd<'db>; 2],
        passages: Vec<usize>,
    ) -> WayStep<'db> {
        let nothing = || Assumption::nothing(self.db);
        let assumption = self.nodes.get(instance).map_or_else(nothing, |node| node.assumption);
        WayStep { instance, connection, ends, passages, assumption }
    }

    /// Returns the steps of data that enters an instance here: one for each end that it reaches, those at codels whose outputs go
    /// on only if `all`. Where nothing is passed on, or nothing is known, a step without passages.
    pub(super) fn entering(
        &self,
        connection: Option<usize>,
        (instance, from): &DataPlace<'db>,
        all: bool,
    ) -> Vec<WayStep<'db>> {
        let through = self.through(*instance);
        let passages = through.into_iter().flat_map(|it| it.passages.all.iter().enumerate());
        let feeds = |end| through.is_some_and(|it| it.feeding.contains(end));
        let taken = passages.filter(|(_, it)| it.from == *from && (all || !feeds(&it.to)));
        let step = |(index, to): (usize, &PassageEnd<'db>)| {
            self.step(*instance, connection, [from.clone(), to.clone()], vec![index])
        };
        let mut found: Vec<WayStep<'db>> = taken.map(|(index, it)| step((index, &it.to))).collect();
        if found.is_empty() {
            found.push(self.step(*instance, connection, [from.clone(), from.clone()], Vec::new()));
        }
        found
    }

    /// Returns the first step of data that comes from an output of an instance, or from an operation that it sends to: of all
    /// codels that are its sources. Where an input reaches it too, they are those that look at the world; without any, `or_input`
    /// decides whether that input is the source. Without passages, what is written is the source.
    pub(super) fn leaving(&self, (instance, end): &DataPlace<'db>, or_input: bool) -> Option<WayStep<'db>> {
        let through = self.through(*instance);
        let passages = through.into_iter().flat_map(|it| it.passages.all.iter().enumerate());
        let to_end: Vec<_> =
            passages.filter(|(_, it)| it.to == *end).map(|(index, it)| (index, &it.from)).collect();
        let of = |is_taken: &dyn Fn(&PassageEnd<'db>) -> bool| {
            let taken = to_end.iter().filter(|(_, from)| is_taken(from)).map(|(index, _)| *index);
            taken.collect::<Vec<usize>>()
        };
        let inputs = of(&|from| !matches!(from, PassageEnd::Codel(_)));
        let is_source = |from: &PassageEnd<'db>| match from {
            PassageEnd::Codel(codel) => {
                !through.is_some_and(|it| it.fed.contains(from))
                    && (inputs.is_empty() || self.looks_at_the_world(*codel))
            }
            _ => false,
        };
        let mut taken = of(&is_source);
        if taken.is_empty() && !inputs.is_empty() {
            if !or_input {
                return None;
            }
            taken = inputs;
        }
        let from = taken.first().and_then(|index| to_end.iter().find(|(it, _)| it == index));
        let from = from.map_or_else(|| end.clone(), |(_, from)| (*from).clone());
        Some(self.step(*instance, None, [from, end.clone()], taken))
    }

    /// Returns whether a codel may give other data than a function of its arguments: it has none, gives data through a parameter,
    /// or gets a handle of an external type.
    fn looks_at_the_world(&self, of: Decl<'db>) -> bool {
        let Some(data) = codel(self.db, of) else { return true };
        let is_handle = |it: &Parameter| {
            let ty = type_of(self.db, self.project, of, it.ty.as_ref());
            it.direction != Direction::In || matches!(ty, Type::External(_) | Type::Unknown)
        };
        data.parameters.is_empty() || data.parameters.iter().any(is_handle)
    }

    /// Returns the first steps of all chains, in the order of the instances and of their connections.
    pub(super) fn sources(&self) -> Vec<WayStep<'db>> {
        let mut places: Vec<&DataPlace<'db>> = self.leaving.keys().collect();
        let first = |place: &DataPlace<'db>| self.after(place).first().map(|(connection, _)| *connection);
        places.sort_by_key(|&place| (place.0, first(place)));
        // Of an operation, only what is sent, or given back.
        let is_left = |(instance, end): &DataPlace<'db>| {
            matches!(end, PassageEnd::Port(_))
                || self.through(*instance).is_none_or(|it| it.passages.all.iter().any(|it| it.to == *end))
        };
        places.retain(|place| is_left(place));
        places.into_iter().filter_map(|place| self.leaving(place, false)).collect()
    }

    /// Returns the step before a connection, with all passages to it, and those after it.
    pub(super) fn around(
        &self,
        number: usize,
        link: &Link<'db>,
    ) -> Option<(WayStep<'db>, Vec<WayStep<'db>>)> {
        let [source, target] = [&link.source, &link.target].map(|(instance, _)| self.instance(instance));
        let (from, to) = match link.operation {
            false => ((source?, port(&link.source)), (target?, port(&link.target))),
            true => ((target?, operation(&link.target)), (source?, operation(&link.source))),
        };
        let before = self.leaving(&from, true)?;
        Some((before, self.entering(Some(number), &to, false)))
    }

    /// Returns the first steps of data that leaves an instance anywhere.
    pub(super) fn leaving_instance(&self, instance: usize) -> Vec<WayStep<'db>> {
        let mut places: Vec<&DataPlace<'db>> = self.leaving.keys().filter(|it| it.0 == instance).collect();
        places.sort_by_key(|&place| self.after(place).first().map(|(connection, _)| *connection));
        places.into_iter().filter_map(|place| self.leaving(place, true)).collect()
    }

    /// Returns the instances from which connections lead to one of these, and these.
    pub(super) fn leading(&self, to: &[usize]) -> FxHashSet<usize> {
        let mut before: FxHashMap<usize, Vec<usize>> = FxHashMap::default();
        for ((from, _), all) in &self.leaving {
            all.iter().for_each(|(_, (next, _))| before.entry(*next).or_default().push(*from));
        }
        let before = |instance| before.get(&instance).into_iter().flatten().copied();
        closure(to.iter().copied(), before).into_iter().collect()
    }

    /// Returns the steps that may follow a way, to instances that are not closed.
    pub(super) fn following(
        &self,
        last: &WayStep<'db>,
        is_closed: &dyn Fn(usize) -> bool,
        all: bool,
    ) -> Vec<WayStep<'db>> {
        let leaving = self.after(&(last.instance, last.ends[1].clone())).iter();
        let on = leaving.filter(|(_, (instance, _))| !is_closed(*instance));
        on.flat_map(|(connection, place)| self.entering(Some(*connection), place, all)).collect()
    }

    /// Gives each way from a first step to `found`, until that returns `false`, depth first: those that end with a step that nothing
    /// follows.
    fn walk(&self, first: WayStep<'db>, found: &mut dyn FnMut(&[WayStep<'db>]) -> bool) {
        let mut on_way = FxHashSet::default();
        let mut way = Vec::new();
        let mut open = vec![vec![first].into_iter()];
        while let Some(rest) = open.last_mut() {
            let Some(step) = rest.next() else {
                open.pop();
                way.pop().inspect(|step: &WayStep<'db>| _ = on_way.remove(&step.instance));
                continue;
            };
            on_way.insert(step.instance);
            let next = self.following(&step, &|it| on_way.contains(&it), false);
            let is_end = next.is_empty() && !way.is_empty();
            way.push(step);
            if is_end && !found(&way) {
                return;
            }
            open.push(next.into_iter());
        }
    }

    /// Returns the shortest way from a first step to each end that nothing follows.
    fn shortest(&self, first: WayStep<'db>) -> Vec<Vec<WayStep<'db>>> {
        let mut steps = vec![(first, None)];
        let mut open = VecDeque::from([0]);
        let (mut seen, mut ends) = (FxHashSet::default(), FxHashSet::default());
        let mut found = Vec::new();
        while let Some(index) = open.pop_front() {
            let back =
                std::iter::successors(Some(index), |&it| steps.get(it).and_then(|(_, before)| *before));
            let mut way: Vec<usize> = back.collect();
            way.reverse();
            let way: Vec<&WayStep<'db>> = way.into_iter().filter_map(|it| Some(&steps.get(it)?.0)).collect();
            let Some(last) = way.last() else { continue };
            let next = self.following(last, &|it| way.iter().any(|step| step.instance == it), false);
            let is_new = |last: &WayStep<'db>| ends.insert((last.instance, last.ends[1].clone()));
            if next.is_empty() && index > 0 && Some(*last).is_some_and(is_new) {
                found.push(way.into_iter().cloned().collect());
            }
            for step in next {
                if seen.insert((step.instance, step.ends.clone())) {
                    open.push_back(steps.len());
                    steps.push((step, Some(index)));
                }
            }
        }
        found
    }

    /// Returns the ways from all sources to all ends, and how many are left out, at least: of too many, the shortest from each
    /// source to each end are kept.
    pub(super) fn ways(&self) -> (Vec<ChainWay<'db>>, usize) {
        let (mut all, mut steps, mut left_out) = (Vec::new(), 0, 0);
        for first in self.sources() {
            self.walk(first, &mut |way| {
                steps += way.len();
                let fits = all.len() < MOST_WAYS && steps <= MOST_STEPS;
                if fits {
                    all.push(way.to_vec())
                } else {
                    left_out += 1
                }
                fits
            });
        }
        if left_out > 0 {
            let enumerated = all.len();
            (all, steps) = (Vec::new(), 0);
            for way in self.sources().into_iter().flat_map(|first| self.shortest(first)) {
                steps += way.len();
                if steps <= MOST_STEPS { all.push(way) } else { left_out += 1 }
            }
            left_out += enumerated.saturating_sub(all.len());
        }
        (self.named(all), left_out)
    }

    /// Returns where a way begins and ends.
    pub(super) fn ends(&self, way: &[WayStep<'db>]) -> Option<[ChainEnd<'db>; 2]> {
        let end = |step: &WayStep<'db>, side: usize| {
            let instance = self.flat.instances.get(step.instance)?.name.clone();
            Some(ChainEnd { instance, end: step.ends.get(side)?.clone() })
        };
        Some([end(way.first()?, 0)?, end(way.last()?, 1)?])
    }

    /// Returns ways with their names. The source is the port, whatever codels fill it.
    fn named(&self, ways: Vec<Vec<WayStep<'db>>>) -> Vec<ChainWay<'db>> {
        let way = |steps: Vec<WayStep<'db>>| {
            let [mut from, to] = self.ends(&steps)?;
            from.end = steps.first()?.ends[1].clone();
            let name = format!("{} -> {}", from.shown(self.db), to.shown(self.db)).into();
            Some(ChainWay { name, ends: [from, to], steps })
        };
        let mut all: Vec<ChainWay<'db>> = ways.into_iter().filter_map(way).collect();
        let mut count: FxHashMap<Name, usize> = FxHashMap::default();
        all.iter().for_each(|way| *count.entry(way.name.clone()).or_default() += 1);
        for way in all.iter_mut().filter(|way| count.get(&way.name) > Some(&1)) {
            let between = way.steps.iter().skip(1).take(way.steps.len().saturating_sub(2));
            let names =
                between.filter_map(|step| Some(self.flat.instances.get(step.instance)?.name.as_str()));
            let names: Vec<&str> = names.collect();
            if !names.is_empty() {
                way.name = format!("{} (through {})", way.name, names.join(", ")).into();
            }
        }
        all
    }
}
