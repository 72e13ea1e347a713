//! How many calls a component sends to each of its required operations.

use std::collections::BTreeSet;

use rustc_hash::{FxHashMap, FxHashSet};

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Behaviour, Cost, CostGraph, Decl, Execution, ModelDb, Project, TimedProgram, behaviour_of, core_of,
};

/// Returns the greatest number of calls that one period of a component sends to each of its required operations.
#[salsa::tracked(returns(ref))]
pub(crate) fn sends_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> FxHashMap<Name, u64> {
    let Some(core) = core_of(db, project, component) else { return FxHashMap::default() };
    let behaviour = behaviour_of(db, project, core);
    let costs = behaviour.programs.iter().chain(&behaviour.operations).map(|program| &*program.cost);
    let mut sends: FxHashMap<Name, u64> = FxHashMap::default();
    for name in costs.flat_map(CostGraph::sends).collect::<BTreeSet<_>>() {
        let of_operations = calls_of_operations(behaviour, name);
        let count = |program: &TimedProgram<'db>| calls(&program.cost, name, &of_operations);
        let of_programs: Vec<u64> = behaviour.programs.iter().map(count).collect();
        let add = |sum: u64, index: usize| sum.saturating_add(of_programs.get(index).copied().unwrap_or(0));
        let greatest = behaviour.edges.sums(0, add).into_iter().max().unwrap_or(0);
        sends.insert(name.clone(), greatest);
    }
    sends
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
    let calls = cost.folded(|part, known: &[u64]| {
        let of = |index: &u32| known.get(*index as usize).copied().unwrap_or(0);
        match part {
            Cost::Nothing | Cost::One(Execution::Codel(_)) => 0,
            Cost::One(Execution::Operation(index)) => of_operations.get(*index).copied().unwrap_or(0),
            Cost::One(Execution::Send(used) | Execution::Access(used)) => u64::from(used == name),
            Cost::Sum(one, other) => of(one).saturating_add(of(other)),
            Cost::Greatest(one, other) => of(one).max(of(other)),
            Cost::Program(_, inner) | Cost::Operation(_, inner) => of(inner),
        }
    });
    calls.unwrap_or(0)
}
