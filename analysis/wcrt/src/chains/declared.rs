//! The chains of `mauve.toml`: what their names mean in an architecture, and the way that they take.

use std::cell::Cell;
use std::ops::Range;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Assumption, Chain, Decl, Location, ModelDb, PassageEnd, Project, all_roots, behaviour_of, config_file,
    config_of, core_of, flat_of, names_of, target_of, uses_of,
};
use rustc_hash::FxHashSet;

use super::network::{DataPlace, Network};
use super::ways::{FoundWays, MOST_TRIES, NamedInChain, ways};
use super::{ChainProblem, ChainWay, DeclaredChain, WayStep};

/// A name with its range in `mauve.toml`.
type LocatedName = (String, Range<usize>);

/// What is wrong, and the name.
type ChainFault<'a> = (Option<&'a Range<usize>>, ChainProblem);

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
    let budget = Cell::new(MOST_TRIES);
    for (index, chain) in config_of(db, workspace).chains.iter().enumerate() {
        // Data may be in a device, or a library, on its way, or decide what is written.
        let way = Assumption::CARRIERS.into_iter().try_fold(None, |_, carriers| {
            let resolver = ChainResolver::new(db, project, architecture, chain, carriers);
            match resolver.way(&budget) {
                Err(found @ (_, ChainProblem::NotConnected { .. } | ChainProblem::NotPassed { .. })) => {
                    Ok(Some(found))
                }
                way => Err(way),
            }
        });
        let way = way.map_or_else(|way| way, |problem| Err(problem.unwrap_or((None, ChainProblem::NoWay))));
        let is_unresolved = matches!(way, Err((_, ChainProblem::Unresolved(_))));
        if is_unresolved && is_of_another(db, project, architecture, chain) {
            continue;
        }
        let location = |span| Some(Location::of_span(file?, span));
        let way = way.map_err(|(span, problem)| (location(span.unwrap_or(&chain.span)), problem));
        found.push(DeclaredChain { name: chain.name.as_str().into(), index, limit: chain.latency, way });
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
        let resolver = ChainResolver::new(db, project, target, chain, (false, false));
        chain.ends().all(|(name, _)| resolver.named(name).is_some())
    })
}

struct ChainResolver<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    chain: &'a Chain,
    network: Network<'db>,
}

impl<'a, 'db> ChainResolver<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        architecture: Decl<'db>,
        chain: &'a Chain,
        (through_handles, decides): (bool, bool),
    ) -> ChainResolver<'a, 'db> {
        let of = |all: &[LocatedName], instance: &str| -> Vec<Name> {
            let named = all.iter().filter_map(|(name, _)| name.split_once('.'));
            named.filter(|(it, _)| *it == instance).map(|(_, name)| name.into()).collect()
        };
        let named =
            chain.answers.iter().flat_map(|(name, _)| names_of(db, project).by_key(Kind::Codel, name));
        let answers: Vec<Decl<'db>> = named.copied().collect();
        // Only what is about the instance: others have the same passages with or without the chain.
        let assumption = |instance: &Name, core: Decl<'db>| {
            let known = &behaviour_of(db, project, core).states;
            let mut states = of(&chain.states, instance);
            states.retain(|it| known.contains(it));
            let called = &uses_of(db, project, core).codels;
            let answers: Vec<Decl<'db>> = answers.iter().copied().filter(|it| called.contains(it)).collect();
            Assumption::new(db, states, answers, of(&chain.answers, instance), through_handles, decides)
        };
        let network = Network::new(db, project, flat_of(db, project, architecture), assumption);
        ChainResolver { db, project, chain, network }
    }

    fn way(&self, budget: &Cell<usize>) -> Result<ChainWay<'db>, ChainFault<'a>> {
        let chain = self.chain;
        let mut points: Vec<(NamedInChain<'db>, &LocatedName)> = Vec::new();
        let from = chain.from.as_ref().ok_or((None, ChainProblem::Missing("from")))?;
        let to = chain.to.as_ref().ok_or((None, ChainProblem::Missing("to")))?;
        for located in std::iter::once(from).chain(&chain.through).chain([to]) {
            let (name, span) = located;
            let named = self.named(name);
            let named = named.ok_or((Some(span), ChainProblem::Unresolved(name.as_str().into())))?;
            points.push((named, located));
        }
        let [(first, _), through @ .., (last, _)] = points.as_slice() else {
            return Err((None, ChainProblem::NoWay));
        };
        if first == last {
            return Err((Some(&to.1), ChainProblem::NoWay));
        }
        let through: Vec<&NamedInChain<'db>> = through.iter().map(|(it, _)| it).collect();
        let too_many = (Some(&from.1), ChainProblem::TooManyWays);
        let ways = self.ways(first, &through, last, budget).ok_or_else(|| too_many.clone())?.all;
        let steps = match ways.is_empty() {
            true => Err(self.not_connected(&points, budget).ok_or(too_many)?),
            false => self.only(ways, [from, to]),
        }?;
        self.check_assumptions(&steps)?;
        let ends = self.network.ends(&steps).ok_or((None, ChainProblem::NoWay))?;
        Ok(ChainWay { name: chain.name.as_str().into(), ends, steps })
    }

    /// Returns what a name means: `instance`, `instance.port`, `instance.codel`, or a codel that an instance calls.
    fn named(&self, name: &str) -> Option<NamedInChain<'db>> {
        let network = &self.network;
        let Some((instance, feature)) = name.split_once('.') else {
            return network.instance(name).map(NamedInChain::Instance).or_else(|| self.codel(name, None));
        };
        let Some(instance) = network.instance(instance) else { return self.codel(name, None) };
        let features = network.flat.instances.get(instance)?.features(self.db, self.project);
        let end = match features.map(|features| features.get(feature)) {
            Some(Some(found)) if found.kind.is_operation() => PassageEnd::Operation(feature.into()),
            // Or its shell is unknown.
            Some(Some(_)) | None => PassageEnd::Port(feature.into()),
            Some(None) => return self.codel(feature, Some(instance)),
        };
        Some(NamedInChain::Feature((instance, end)))
    }

    /// Returns the codel of a name that instances call; of `instance` alone, its library need not be named.
    fn codel(&self, name: &str, instance: Option<usize>) -> Option<NamedInChain<'db>> {
        let called = |index: usize| {
            let component = self.network.flat.instances.get(index)?.component?;
            Some(&uses_of(self.db, self.project, core_of(self.db, self.project, component)?).codels)
        };
        let codel = match instance {
            Some(index) => called(index)?.iter().copied().find(|it| it.is_called(self.db, name))?,
            None => *names_of(self.db, self.project).by_key(Kind::Codel, name).first()?,
        };
        let mut calling: Vec<usize> = (0..self.network.flat.instances.len()).collect();
        calling.retain(|&it| instance.is_none_or(|only| only == it));
        calling.retain(|&it| called(it).is_some_and(|codels| codels.contains(&codel)));
        (!calling.is_empty()).then_some(NamedInChain::Codel(codel, calling))
    }

    fn name(&self, instance: Option<usize>) -> Name {
        let found = instance.and_then(|it| self.network.flat.instances.get(it));
        found.map_or_else(Name::default, |it| it.name.clone())
    }

    /// Checks that `while` and `answers` are about instances on the way, and that these have such states, codels and ports.
    fn check_assumptions(&self, steps: &[WayStep<'db>]) -> Result<(), ChainFault<'a>> {
        for (name, span) in &self.chain.states {
            let (instance, state) = name.split_once('.').unwrap_or((name, ""));
            let (instance, state) = (Name::from(instance), Name::from(state));
            let has_state = |it: &WayStep<'db>| {
                self.network.is_unknown(it.instance) || it.assumption.states(self.db).contains(&state)
            };
            if !steps.iter().any(|it| self.name(Some(it.instance)) == instance && has_state(it)) {
                return Err((Some(span), ChainProblem::NoState { instance, state }));
            }
        }
        for (name, span) in &self.chain.answers {
            let named = self.named(name).filter(|it| !matches!(it, NamedInChain::Instance(_)));
            if !named.is_some_and(|it| steps.iter().any(|step| it.instances().contains(&step.instance))) {
                return Err((Some(span), ChainProblem::NoAnswer(name.as_str().into())));
            }
        }
        Ok(())
    }

    /// Returns the ways from one end to the other through these. None where the budget is exhausted.
    fn ways(
        &self,
        from: &NamedInChain<'db>,
        through: &[&NamedInChain<'db>],
        to: &NamedInChain<'db>,
        budget: &Cell<usize>,
    ) -> Option<FoundWays<'db>> {
        let network = &self.network;
        let entering = |place: &DataPlace<'db>| {
            let steps = network.entering(None, place, true).into_iter();
            steps.filter(|step| !step.passages.is_empty()).collect::<Vec<_>>()
        };
        let first = match from {
            NamedInChain::Codel(codel, instances) => {
                instances.iter().flat_map(|&it| entering(&(it, PassageEnd::Codel(*codel)))).collect()
            }
            NamedInChain::Feature(place)
                if network.after(place).is_empty() && !entering(place).is_empty() =>
            {
                entering(place)
            }
            NamedInChain::Feature(place) => network.leaving(place, true).into_iter().collect(),
            NamedInChain::Instance(instance) => network.leaving_instance(*instance),
        };
        ways(network, first, through, to, budget)
    }

    /// Returns the only way; of several that differ only in their ends, all as one.
    fn only(
        &self,
        ways: Vec<Vec<WayStep<'db>>>,
        [from, to]: [&'a LocatedName; 2],
    ) -> Result<Vec<WayStep<'db>>, ChainFault<'a>> {
        let mut found: Vec<WayStep<'db>> = Vec::new();
        for way in ways {
            if found.is_empty() {
                found = way;
                continue;
            }
            let differs = |(one, two): &(&WayStep<'db>, &WayStep<'db>)| {
                (one.instance, one.connection) != (two.instance, two.connection)
            };
            match found.iter().zip(&way).find(differs) {
                Some((one, two)) if one.connection.is_none() => {
                    let instances = vec![self.name(Some(one.instance)), self.name(Some(two.instance))];
                    let codel = from.0.as_str().into();
                    return Err((Some(&from.1), ChainProblem::Ambiguous { codel, instances }));
                }
                Some((one, two)) => {
                    let ends = [one, two].map(|it| self.network.ends(std::slice::from_ref(it)));
                    let through = ends.into_iter().flatten().map(|[entry, _]| entry.shown(self.db).into());
                    return Err((Some(&from.1), ChainProblem::SeveralWays { through: through.collect() }));
                }
                // One ends where the other goes on.
                None if found.len() != way.len() => {
                    let lasts = [found.last(), way.last()].into_iter().flatten();
                    let instances = lasts.map(|it| self.name(Some(it.instance))).collect();
                    let codel = to.0.as_str().into();
                    return Err((Some(&to.1), ChainProblem::Ambiguous { codel, instances }));
                }
                None => {}
            }
            for (step, other) in found.iter_mut().zip(way) {
                step.passages.extend(other.passages);
                step.passages.sort_unstable();
                step.passages.dedup();
            }
        }
        Ok(found)
    }

    /// Returns why there is no way. None where the budget is exhausted.
    fn not_connected(
        &self,
        points: &[(NamedInChain<'db>, &'a LocatedName)],
        budget: &Cell<usize>,
    ) -> Option<ChainFault<'a>> {
        let parts = points.windows(2).filter_map(|part| part.first().zip(part.last()));
        // Two parts may each have a way through different data of one instance: then the whole has none.
        let whole = points.first().zip(points.last());
        for ((from, (from_name, _)), (to, (to_name, span))) in parts.chain(whole) {
            let FoundWays { all, last } = self.ways(from, &[], to, budget)?;
            if !all.is_empty() {
                continue;
            }
            let leading = self.network.leading(to.instances());
            let problem = match from.instances() {
                several if several.iter().any(|it| leading.contains(it)) => {
                    ChainProblem::NotPassed { instance: self.name(last.or(several.first().copied())) }
                }
                _ => ChainProblem::NotConnected {
                    from: from_name.as_str().into(),
                    to: to_name.as_str().into(),
                },
            };
            return Some((Some(span), problem));
        }
        // Each part has a way, and all together have none.
        let last = points.iter().rev().nth(1);
        let name = self.name(last.and_then(|(it, _)| it.instances().first().copied()));
        Some((last.map(|(_, (_, span))| span), ChainProblem::NotPassed { instance: name }))
    }
}
