//! How many calls a component sends to each of its required operations.

use std::collections::BTreeSet;

use rustc_hash::{FxHashMap, FxHashSet};

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Behaviour, Cost, CostGraph, Decl, Execution, ModelDb, Product, Project, behaviour_of, core_of, fold,
    pending_calls_of, product_of,
};

/// The calls that the jobs of a component send to a required operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SentCalls {
    /// The greatest number that one job sends.
    pub(crate) most: u64,
    /// So many successive jobs send no more, at least.
    pub(crate) every: u64,
    /// The greatest number that the component sends when it is configured and started.
    pub(crate) starting: u64,
    /// The greatest number that are pending, if the programs bound it.
    pub(crate) pending: Option<u64>,
}

/// Returns the calls that a component sends to each of its required operations.
#[salsa::tracked(returns(ref))]
pub(crate) fn sends_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> FxHashMap<Name, SentCalls> {
    let Some(core) = core_of(db, project, component) else { return FxHashMap::default() };
    let behaviour = behaviour_of(db, project, core);
    let programs = behaviour.programs.iter().chain(&behaviour.operations).map(|program| &program.cost);
    let costs = programs.chain(&behaviour.starting);
    let mut sends: FxHashMap<Name, SentCalls> = FxHashMap::default();
    for name in costs.flat_map(|it| it.sends()).collect::<BTreeSet<_>>() {
        let of_operations = calls_of_operations(behaviour, name);
        let product = product_of(db, project, core);
        let counts = fold(&product.costs, |part, known| calls_in(part, known, name, &of_operations));
        let (most, every) = most_sent(product, &counts);
        let starting = behaviour.starting.iter().map(|cost| calls(cost, name, &of_operations));
        let starting = starting.fold(0, u64::saturating_add);
        let pending = pending_calls_of(db, project, core).get(name).copied();
        sends.insert(name.clone(), SentCalls { most, every, starting, pending });
    }
    sends
}

/// The most jobs that are followed, times the edges.
const MOST_STEPS: usize = 1 << 20;

/// Returns the greatest number of calls that a job sends, and how many successive jobs send no more.
fn most_sent(product: &Product<'_>, counts: &[u64]) -> (u64, u64) {
    let count = |cost: u32| counts.get(cost as usize).copied().unwrap_or(0);
    let most = product.edges.iter().map(|it| count(it.cost)).max().unwrap_or(0);
    // The most that so many jobs send, by the state in which they begin.
    let mut sent = vec![0; product.states.len()];
    let most_jobs = (MOST_STEPS / product.edges.len().max(1)).max(1) as u64;
    for jobs in 0..most_jobs {
        let mut next = vec![0; sent.len()];
        for edge in &product.edges {
            let (source, target) = edge.ends();
            let after = sent.get(target).copied().unwrap_or(0);
            let known = next.get_mut(source).into_iter();
            known.for_each(|known: &mut u64| *known = (*known).max(count(edge.cost).saturating_add(after)));
        }
        if next.iter().any(|sent| *sent > most) {
            return (most, jobs.max(1));
        }
        // No further job sends any more.
        if next == sent {
            break;
        }
        sent = next;
    }
    (most, most_jobs)
}

/// Returns the greatest number of calls that one execution of an operation sends, by required operation.
pub(crate) fn sends_of_operation(behaviour: &Behaviour<'_>, operation: usize) -> Vec<(Name, u64)> {
    let names: BTreeSet<&Name> =
        behaviour.operations.iter().flat_map(|program| program.cost.sends()).collect();
    let calls = |name: &Name| calls_of_operations(behaviour, name).get(operation).copied().unwrap_or(0);
    names.into_iter().map(|name| (name.clone(), calls(name))).filter(|(_, calls)| *calls > 0).collect()
}

/// Returns the greatest number of writes of an output port in one period of a component; none if operations, which a period may
/// execute any number of times, write it too.
pub(crate) fn writes_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    port: &Name,
) -> Option<u32> {
    writes_by_port(db, project, component).as_ref()?.get(port).copied().unwrap_or(Some(0))
}

/// Returns the greatest number of writes of an output port in one period of a component, if nothing else writes it.
pub(crate) fn all_writes_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    port: &Name,
) -> Option<u32> {
    let behaviour = behaviour_of(db, project, core_of(db, project, component)?);
    let is_of_hook = behaviour.accessed_by_hooks.contains(port);
    writes_of(db, project, component, port).filter(|_| !is_of_hook)
}

/// Returns [`writes_of`] for each port that a component accesses; none where it executes nothing.
#[salsa::tracked(returns(ref))]
fn writes_by_port<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> Option<FxHashMap<Name, Option<u32>>> {
    let behaviour = behaviour_of(db, project, core_of(db, project, component)?);
    if behaviour.edges.all.is_empty() {
        return None;
    }
    let writes = |port: &Name| {
        if calls_of_operations(behaviour, port).iter().any(|writes| *writes > 0) {
            return None;
        }
        let of_programs: Vec<u64> = behaviour.programs.iter().map(|it| calls(&it.cost, port, &[])).collect();
        let add = |sum: u64, index: usize| sum.saturating_add(of_programs.get(index).copied().unwrap_or(0));
        u32::try_from(behaviour.edges.sums(0, add).into_iter().max()?).ok()
    };
    let executions =
        behaviour.programs.iter().chain(&behaviour.operations).flat_map(|it| it.cost.executions());
    let ports = executions.filter_map(|it| if let Execution::Access(port) = it { Some(port) } else { None });
    let ports: FxHashSet<&Name> = ports.collect();
    Some(ports.into_iter().map(|port| (port.clone(), writes(port))).collect())
}

/// Returns, for each operation that a core defines, the greatest number of calls that it sends to the required operation `name`, or
/// of accesses to the port of that name.
fn calls_of_operations(behaviour: &Behaviour<'_>, name: &Name) -> Vec<u64> {
    let mut found = vec![0; behaviour.operations.len()];
    // Callees first.
    for &index in &behaviour.order {
        if let Some(operation) = behaviour.operations.get(index) {
            found[index] = calls(&operation.cost, name, &found);
        }
    }
    found
}

/// Returns the greatest number of calls to the required operation `name`, or of accesses to the port, along a path of a program; it
/// saturates.
fn calls(cost: &CostGraph<'_>, name: &Name, of_operations: &[u64]) -> u64 {
    cost.folded(|part, known| calls_in(part, known, name, of_operations)).unwrap_or(0)
}

/// Returns the number of a part of a cost, from those of earlier parts.
fn calls_in(part: &Cost<'_>, known: &[u64], name: &Name, of_operations: &[u64]) -> u64 {
    let of = |index: &u32| known.get(*index as usize).copied().unwrap_or(0);
    match part {
        Cost::Nothing | Cost::One(Execution::Codel(_)) => 0,
        Cost::One(Execution::Operation(index)) => of_operations.get(*index).copied().unwrap_or(0),
        Cost::One(Execution::Send(used) | Execution::Access(used)) => u64::from(used == name),
        Cost::Sum(one, other) => of(one).saturating_add(of(other)),
        Cost::Greatest(one, other) => of(one).max(of(other)),
        Cost::Program(_, inner) | Cost::Operation(_, inner) => of(inner),
    }
}
