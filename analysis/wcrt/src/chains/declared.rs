//! The chains of `mauve.toml`: what their names mean in an architecture, and the way that they take.

use std::ops::Range;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Assumption, Chain, Decl, Location, ModelDb, PassageEnd, Project, all_roots, behaviour_of, config_file,
    config_of, core_of, flat_of, names_of, target_of, uses_of,
};
use rustc_hash::{FxHashMap, FxHashSet};

use super::network::{MOST_WAYS, Network, Place};
use super::{ChainProblem, DeclaredChain, Way, WayStep};

/// A name with its range in `mauve.toml`.
type Located = (String, Range<usize>);

/// What is wrong, and the name.
type Problem<'a> = (Option<&'a Range<usize>>, ChainProblem);

/// What a name in a chain means.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Named<'db> {
    Instance(usize),
    /// A port or an operation.
    Feature(Place<'db>),
    /// A codel, in the instances that call it.
    Codel(Decl<'db>, Vec<usize>),
}

impl<'db> Named<'db> {
    /// Returns the instances that it can mean.
    fn instances(&self) -> Vec<usize> {
        match self {
            Named::Instance(instance) | Named::Feature((instance, _)) => vec![*instance],
            Named::Codel(_, instances) => instances.clone(),
        }
    }

    /// Returns the only instance that it can mean.
    fn instance(&self) -> Option<usize> {
        if let [one] = self.instances().as_slice() { Some(*one) } else { None }
    }

    /// Returns whether a step is in it.
    fn has(&self, step: &WayStep<'db>) -> bool {
        match self {
            Named::Instance(instance) => step.instance == *instance,
            Named::Feature((instance, end)) => step.instance == *instance && step.ends.contains(end),
            Named::Codel(..) => false,
        }
    }

    /// Returns whether a chain to it may end at a step.
    fn ends(&self, step: &WayStep<'db>) -> bool {
        match self {
            Named::Codel(codel, instances) => {
                instances.contains(&step.instance) && step.ends[1] == PassageEnd::Codel(*codel)
            }
            _ => self.has(step),
        }
    }
}

/// Returns the declared chains that concern an architecture, in the order of `mauve.toml`: all but those with names that only
/// another deployment has.
#[salsa::tracked(returns(ref))]
pub(super) fn declared_chains<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
) -> Vec<DeclaredChain<'db>> {
    let workspace = project.workspace(db);
    let file = config_file(db, workspace);
    let mut found = Vec::new();
    for (index, chain) in config_of(db, workspace).chains.iter().enumerate() {
        let resolver = Resolver::new(db, project, architecture, chain, false);
        let way = resolver.way();
        if matches!(way, Err((_, ChainProblem::Unresolved(_))))
            && is_of_another(db, project, architecture, chain)
        {
            continue;
        }
        let location = |span: &Range<usize>| {
            let of = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
            Some(Location::Range(file?, of(span.start), of(span.end)))
        };
        let problem = |(span, problem): Problem<'_>| (location(span.unwrap_or(&chain.span)), problem);
        let (name, limit) = (Name::from(chain.name.as_str()), chain.latency);
        let way = way.map_err(problem).map(|(steps, ends)| Way { name: name.clone(), ends, steps });
        found.push(DeclaredChain { name, index, limit, way });
    }
    found
}

/// Returns whether another deployment has all names of a chain.
fn is_of_another<'db>(db: &'db dyn ModelDb, own: Project<'db>, except: Decl<'db>, chain: &Chain) -> bool {
    let workspace = own.workspace(db);
    let projects = all_roots(db, workspace).iter().map(|&root| Project::new(db, workspace, root));
    let targets = projects.flat_map(|project| {
        let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
        deployments.filter_map(move |it| Some((project, target_of(db, project, it)?)))
    });
    let targets: FxHashSet<(Project<'db>, Decl<'db>)> = targets.filter(|it| *it != (own, except)).collect();
    targets.into_iter().any(|(project, target)| {
        let resolver = Resolver::new(db, project, target, chain, false);
        chain.ends().all(|(name, _)| resolver.named(name).is_some())
    })
}

struct Resolver<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
    chain: &'a Chain,
    network: Network<'db>,
}

impl<'a, 'db> Resolver<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        architecture: Decl<'db>,
        chain: &'a Chain,
        through_handles: bool,
    ) -> Resolver<'a, 'db> {
        // What is assumed of other instances is not in the assumption of one.
        let of = |all: &[Located], instance: &str| -> Vec<Name> {
            let named = all.iter().filter_map(|(name, _)| name.split_once('.'));
            named.filter(|(it, _)| *it == instance).map(|(_, name)| name.into()).collect()
        };
        let answering = |(name, _): &Located| names_of(db, project).by_key(Kind::Codel, name).to_vec();
        let answers: Vec<Decl<'db>> = chain.answers.iter().flat_map(answering).collect();
        let assumption = |instance: &Name, core: Decl<'db>| {
            let known = &behaviour_of(db, project, core).states;
            let mut states = of(&chain.states, instance);
            states.retain(|it| known.contains(it));
            let called = &uses_of(db, project, core).codels;
            let answers: Vec<Decl<'db>> = answers.iter().copied().filter(|it| called.contains(it)).collect();
            Assumption::new(db, states, answers, of(&chain.answers, instance), through_handles)
        };
        let network = Network::new(db, project, flat_of(db, project, architecture), assumption);
        Resolver { db, project, architecture, chain, network }
    }

    /// Returns the way of the chain, and its ends.
    fn way(self) -> Result<(Vec<WayStep<'db>>, [super::ChainEnd<'db>; 2]), Problem<'a>> {
        let (chain, network) = (self.chain, &self.network);
        let missing = |key| (None, ChainProblem::Missing(key));
        let from_at = chain.from.as_ref().ok_or_else(|| missing("from"))?;
        let to_at = chain.to.as_ref().ok_or_else(|| missing("to"))?;
        let [from, to] = [from_at, to_at].map(|it| self.resolved(it));
        let (from, to) = (from?, to?);
        if from == to {
            return Err((Some(&to_at.1), ChainProblem::NoWay));
        }
        let mut through = Vec::new();
        for name in &chain.through {
            match self.resolved(name)? {
                Named::Codel(..) => {
                    return Err((Some(&name.1), ChainProblem::Unresolved(name.0.as_str().into())));
                }
                named => through.push((named, name)),
            }
        }
        let points = [&[(from.clone(), from_at)], through.as_slice(), &[(to.clone(), to_at)]].concat();
        self.check_repetitions(&points)?;
        self.check_states()?;
        let through: Vec<&Named<'db>> = through.iter().map(|(named, _)| named).collect();
        let ways = self.ways(&from, &through, &to);
        if ways.is_empty() {
            // Data may be in a device, or a library, on its way.
            let with_handles =
                |it: &Network<'db>| it.nodes.iter().any(|it| it.assumption.through_handles(self.db));
            if !with_handles(network) {
                return Resolver::new(self.db, self.project, self.architecture, chain, true).way();
            }
            return Err(self.not_connected(&points));
        }
        let steps = self.only(ways, from_at)?;
        self.check_answers(&steps)?;
        let ends = network.ends(&steps).ok_or((None, ChainProblem::NoWay))?;
        Ok((steps, ends))
    }

    fn resolved(&self, (name, span): &'a Located) -> Result<Named<'db>, Problem<'a>> {
        self.named(name).ok_or_else(|| (Some(span), ChainProblem::Unresolved(name.as_str().into())))
    }

    /// Returns what a name means: `instance`, `instance.port`, `instance.codel`, or a codel that an instance calls.
    fn named(&self, name: &str) -> Option<Named<'db>> {
        let network = &self.network;
        let Some((instance, feature)) = name.split_once('.') else {
            return network.instance(name).map(Named::Instance).or_else(|| self.codel(name, None));
        };
        let Some(instance) = network.instance(instance) else { return self.codel(name, None) };
        let flat = network.flat.instances.get(instance)?;
        match flat.features(self.db, self.project).map(|features| features.get(feature)) {
            Some(Some(found)) if found.kind.is_port() => {
                Some(Named::Feature((instance, PassageEnd::Port(feature.into()))))
            }
            Some(Some(found)) if found.kind.is_operation() => {
                Some(Named::Feature((instance, PassageEnd::Operation(feature.into()))))
            }
            Some(_) => self.codel(feature, Some(instance)),
            // Its shell is unknown.
            None => Some(Named::Feature((instance, PassageEnd::Port(feature.into())))),
        }
    }

    /// Returns the codel of a name that instances call; only those of `instance`, where its library need not be named.
    fn codel(&self, name: &str, instance: Option<usize>) -> Option<Named<'db>> {
        let of = |index: usize| {
            let component = self.network.flat.instances.get(index)?.component?;
            Some(&uses_of(self.db, self.project, core_of(self.db, self.project, component)?).codels)
        };
        let codel = match instance {
            Some(index) => of(index)?.iter().copied().find(|it| it.is_called(self.db, name))?,
            None => *names_of(self.db, self.project).by_key(Kind::Codel, name).first()?,
        };
        let all = (0..self.network.flat.instances.len()).filter(|it| instance.is_none_or(|only| only == *it));
        let calling: Vec<usize> =
            all.filter(|it| of(*it).is_some_and(|codels| codels.contains(&codel))).collect();
        (!calling.is_empty()).then_some(Named::Codel(codel, calling))
    }

    /// Checks that the chain goes through no instance twice, as far as its names say that.
    fn check_repetitions(&self, points: &[(Named<'db>, &'a Located)]) -> Result<(), Problem<'a>> {
        let mut seen = FxHashSet::default();
        let mut before = None;
        for (named, (_, span)) in points {
            let Some(instance) = named.instance() else { continue };
            if before.replace(instance) != Some(instance) && !seen.insert(instance) {
                return Err((Some(span), ChainProblem::Twice(self.name(instance))));
            }
        }
        Ok(())
    }

    fn name(&self, instance: usize) -> Name {
        self.network.flat.instances.get(instance).map_or_else(Name::default, |it| it.name.clone())
    }

    /// Checks that the instances of `while` have these states.
    fn check_states(&self) -> Result<(), Problem<'a>> {
        for (name, span) in &self.chain.states {
            let (instance, state) = name.split_once('.').unwrap_or((name, ""));
            let found = self.network.instance(instance).and_then(|it| self.network.nodes.get(it));
            // Of an unknown component, the reason is another.
            let is_known = |it: Name| {
                found.is_none_or(|node| {
                    node.passages.is_some() && !node.assumption.states(self.db).contains(&it)
                })
            };
            if is_known(state.into()) {
                return Err((
                    Some(span),
                    ChainProblem::NoState { instance: instance.into(), state: state.into() },
                ));
            }
        }
        Ok(())
    }

    /// Checks that the assumptions are about instances on the way.
    fn check_answers(&self, steps: &[WayStep<'db>]) -> Result<(), Problem<'a>> {
        let is_on_way = |instance: &str| {
            self.network.instance(instance).is_some_and(|it| steps.iter().any(|step| step.instance == it))
        };
        for (name, span) in &self.chain.states {
            let (instance, state) = name.split_once('.').unwrap_or((name, ""));
            if !is_on_way(instance) {
                let (instance, state) = (instance.into(), state.into());
                return Err((Some(span), ChainProblem::NoState { instance, state }));
            }
        }
        for (name, span) in &self.chain.answers {
            let is_called = match self.named(name) {
                Some(Named::Codel(_, instances)) => {
                    instances.iter().any(|it| steps.iter().any(|step| step.instance == *it))
                }
                Some(Named::Feature((instance, PassageEnd::Port(_)))) => is_on_way(&self.name(instance)),
                _ => false,
            };
            if !is_called {
                return Err((Some(span), ChainProblem::NoAnswer(name.as_str().into())));
            }
        }
        Ok(())
    }

    /// Returns the ways from one end to the other, through these.
    fn ways(&self, from: &Named<'db>, through: &[&Named<'db>], to: &Named<'db>) -> Vec<Vec<WayStep<'db>>> {
        let network = &self.network;
        let entering = |instance: usize, end: PassageEnd<'db>| {
            let steps = network.entering(None, &(instance, end), true).into_iter();
            steps.filter(|step| !step.passages.is_empty()).collect::<Vec<_>>()
        };
        let first = match from {
            Named::Codel(codel, instances) => {
                instances.iter().flat_map(|&it| entering(it, PassageEnd::Codel(*codel))).collect()
            }
            Named::Feature(place) => match network.after(place) {
                [] if !entering(place.0, place.1.clone()).is_empty() => entering(place.0, place.1.clone()),
                _ => network.leaving(place, true).into_iter().collect(),
            },
            Named::Instance(instance) => network.leaving_instance(*instance),
        };
        let reaching = self.reaching(to);
        let is_end = |step: &WayStep<'db>| to.ends(step);
        let (mut found, mut budget) = (Vec::new(), 10 * MOST_WAYS);
        for first in first {
            network.walk(first, Some((&is_end, &reaching)), &mut |way| {
                budget -= 1;
                if let Some(way) = way {
                    let mut rest = through.iter().peekable();
                    for step in way {
                        while rest.next_if(|it| it.has(step)).is_some() {}
                    }
                    if rest.peek().is_none() {
                        found.push(way.to_vec());
                    }
                }
                budget > 0
            });
        }
        found
    }

    /// Returns where data may be that reaches an end.
    fn reaching(&self, to: &Named<'db>) -> FxHashSet<Place<'db>> {
        let mut before: FxHashMap<Place<'db>, Vec<Place<'db>>> = FxHashMap::default();
        let mut open = Vec::new();
        for place in self.network.entries() {
            for step in self.network.entering(None, &place, true) {
                if to.ends(&step) {
                    open.push(place.clone());
                }
                for (_, next) in self.network.after(&(step.instance, step.ends[1].clone())) {
                    before.entry(next.clone()).or_default().push(place.clone());
                }
            }
        }
        let mut found = FxHashSet::default();
        while let Some(place) = open.pop() {
            if found.insert(place.clone()) {
                open.extend(before.get(&place).into_iter().flatten().cloned());
            }
        }
        found
    }

    /// Returns the only way; of several that differ only in their ends, all as one.
    fn only(
        &self,
        ways: Vec<Vec<WayStep<'db>>>,
        from: &'a Located,
    ) -> Result<Vec<WayStep<'db>>, Problem<'a>> {
        let way_of = |steps: &[WayStep<'db>]| -> Vec<(usize, Option<usize>)> {
            steps.iter().map(|it| (it.instance, it.connection)).collect()
        };
        let mut ways = ways.into_iter();
        let Some(mut first) = ways.next() else { return Err((Some(&from.1), ChainProblem::NoWay)) };
        let of_first = way_of(&first);
        for other in ways {
            let of_other = way_of(&other);
            if of_other == of_first {
                for (step, other) in first.iter_mut().zip(other) {
                    step.passages.extend(other.passages);
                    step.passages.sort_unstable();
                    step.passages.dedup();
                }
                continue;
            }
            let [one, two] = [&of_first, &of_other].map(|it| it.first().map_or(0, |(instance, _)| *instance));
            if one != two && matches!(self.named(&from.0), Some(Named::Codel(..))) {
                let (codel, instances) = (from.0.as_str().into(), vec![self.name(one), self.name(two)]);
                return Err((Some(&from.1), ChainProblem::Ambiguous { codel, instances }));
            }
            // What only one of the two has.
            let mut through: Vec<Name> = Vec::new();
            for (steps, of_other) in [(&first, &of_other), (&other, &of_first)] {
                let mut only =
                    steps.iter().filter(|step| of_other.iter().all(|(it, _)| *it != step.instance));
                through.extend(only.next().map(|step| self.name(step.instance)));
            }
            if through.is_empty() {
                let differs = first.iter().zip(&other).find(|(one, two)| one.connection != two.connection);
                let entered = differs.into_iter().flat_map(|(one, two)| [one, two]);
                through.extend(entered.filter_map(|step| {
                    let way = self.network.ends(std::slice::from_ref(step))?;
                    Some(Name::from(way[0].shown(self.db)))
                }));
            }
            return Err((Some(&from.1), ChainProblem::SeveralWays { through }));
        }
        Ok(first)
    }

    /// Returns why there is no way from one point to the next.
    fn not_connected(&self, points: &[(Named<'db>, &'a Located)]) -> Problem<'a> {
        let mut pairs = points.windows(2);
        let is_apart = |pair: &&[(Named<'db>, &'a Located)]| match pair {
            [(from, _), (to, _)] => self.ways(from, &[], to).is_empty(),
            _ => false,
        };
        let [(from, (from_name, _)), (to, (to_name, span))] = pairs.find(is_apart).unwrap_or_default() else {
            // Each part has a way, and all together have none.
            let [.., (named, (name, span)), _] = points else { return (None, ChainProblem::NoWay) };
            let name = named.instance().map_or_else(|| name.as_str().into(), |it| self.name(it));
            return (Some(span), ChainProblem::Twice(name));
        };
        if let Some(instance) = from.instance().filter(|it| to.instance() == Some(*it)) {
            return (Some(span), ChainProblem::Twice(self.name(instance)));
        }
        let Some(way) = self.network.connected(&from.instances(), &to.instances()) else {
            let (from, to) = (from_name.as_str().into(), to_name.as_str().into());
            return (Some(span), ChainProblem::NotConnected { from, to });
        };
        // The last component on the way from which data does not reach the end.
        let reaching = self.reaching(to);
        let stops = |instance: &&usize| reaching.iter().all(|(reached, _)| reached != *instance);
        let instance = way.iter().rev().find(stops).or(way.first()).copied().unwrap_or_default();
        (Some(span), ChainProblem::NotPassed { instance: self.name(instance) })
    }
}
