//! The operations that activities execute for others: how many calls a job of the client sends, and what each takes.
//!
//! A call is sent by a program of the client, and executed by the provider in its own thread. So the provider's jobs may take
//! longer, and whatever they delay: `mauve-timing` counts the calls ([`Operation`]). An operation may send calls itself; these
//! are sent by the provider, each time that it executes the operation.

use mauve_timing::{Level, Operation, Time};
use rustc_hash::FxHashMap;

use crate::psm::operation_with;
use crate::reason::{Reason, Refusal};
use crate::system::{Priority, System};
use crate::task_set::Executed;
use mauve_hir::item_tree::Name;
use mauve_hir::{Cost, Decl, ModelDb, Project, behaviour_of, core_of, sends_in};

/// A connected operation: who executes it, and who sends calls to it. The activities are indices into
/// [`System::activities`].
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Connected {
    /// The activity that executes it.
    pub provider: usize,
    /// Its name in the shell of the provider.
    pub operation: Name,
    /// The activity that sends calls.
    pub client: usize,
    /// Its name in the shell of the client.
    pub required: Name,
}

/// The operations that are executed in a deployment, and why they cannot be analysed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Served<'db> {
    /// Those that take time, or that send calls to such ones.
    pub(crate) operations: Vec<Operation>,
    /// The connection of each.
    pub(crate) connections: Vec<Connected>,
    /// Why activities are not analysed because of operations that they execute.
    pub(crate) refusals: FxHashMap<usize, Vec<Refusal<'db>>>,
}

/// The maximum number of operations, counted for each chain of calls by which one is executed.
const MOST_OPERATIONS: usize = 4096;

/// Returns the operations that are executed in a deployment. `what_if` gives the times of codels that no table has.
pub(crate) fn served_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    psms: &[Executed<'_, 'db>],
    level: Level,
    what_if: &dyn Fn(Decl<'db>) -> Option<Time>,
) -> Served<'db> {
    let mut found = Served::default();
    if system.connected.is_empty() {
        return found;
    }
    let mut by_client: FxHashMap<usize, Vec<&Connected>> = FxHashMap::default();
    for connected in &system.connected {
        by_client.entry(connected.client).or_default().push(connected);
    }
    // The calls that are sent: by which connection, how many, and during which operation.
    let mut open: Vec<(&Connected, u64, Option<usize>)> = Vec::new();
    for connected in system.connected.iter().rev() {
        let sends = system.activities.get(connected.client).and_then(|client| {
            let is_known = psms.get(connected.client).copied().flatten().is_some_and(Result::is_ok);
            // What is sent in the background has no period: any number of calls.
            let component =
                client.component.filter(|_| is_known || client.priority == Priority::Background)?;
            sends_of(db, project, component).get(&connected.required).copied().or(Some(0))
        });
        match sends {
            Some(0) => {}
            Some(sends) => open.push((connected, sends, None)),
            None => open.push((connected, u64::MAX, None)),
        }
    }
    let mut chains: Vec<Vec<(usize, Name)>> = Vec::new();
    while let Some((connected, sends, during)) = open.pop() {
        let Some(provider) = system.activities.get(connected.provider) else { continue };
        let (Some(client), Some(component)) = (system.activities.get(connected.client), provider.component)
        else {
            continue;
        };
        // In the background, it delays nobody; but what it sends may.
        let executed = match operation_with(db, project, component, &connected.operation, level, what_if) {
            Ok(executed) => executed,
            Err(refusals) => {
                found.refusals.entry(connected.provider).or_default().extend(refusals);
                continue;
            }
        };
        let sent: Vec<(&Connected, u64)> = executed
            .sends
            .iter()
            .flat_map(|(required, sends)| {
                let of_provider = by_client.get(&connected.provider).into_iter().flatten();
                of_provider.filter(move |it| it.required == *required).map(move |it| (*it, *sends))
            })
            .collect();
        if executed.time == Time::ZERO && sent.is_empty() {
            continue;
        }
        let mut chain = during.and_then(|during| chains.get(during)).cloned().unwrap_or_default();
        let link = (connected.provider, connected.operation.clone());
        let is_ring = chain.contains(&link);
        chain.push(link);
        let operation = || connected.operation.clone();
        let reason = if is_ring {
            Some(Reason::OperationRing(operation()))
        } else if chains.len() >= MOST_OPERATIONS {
            Some(Reason::ManyOperations)
        } else if sends == u64::MAX {
            Some(Reason::UnknownCalls { operation: operation(), client: client.instance.clone() })
        } else if client.priority == Priority::Background || client.period.is_none() {
            Some(Reason::ClientWithoutPeriod { operation: operation(), client: client.instance.clone() })
        } else {
            None
        };
        if let Some(reason) = reason {
            // All that take part: each of them may be called without end.
            let refused = if is_ring { chain } else { vec![(connected.provider, operation())] };
            for (provider, _) in refused {
                let Some(at) = system.activities.get(provider).map(|it| it.at.clone()) else { continue };
                let refusal = Refusal::new(reason.clone(), at);
                let known = found.refusals.entry(provider).or_default();
                if !known.contains(&refusal) {
                    known.push(refusal);
                }
            }
            continue;
        }
        let index = chains.len();
        chains.push(chain);
        found.connections.push(connected.clone());
        found.operations.push(Operation {
            provider: connected.provider,
            client: connected.client,
            sends,
            time: executed.time,
            during,
        });
        open.extend(sent.into_iter().map(|(connected, sends)| (connected, sends, Some(index))));
    }
    found
}

/// Returns the greatest number of calls that one period of a component sends to each of its required operations.
#[salsa::tracked(returns(ref))]
fn sends_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, component: Decl<'db>) -> FxHashMap<Name, u64> {
    let Some(core) = core_of(db, project, component) else { return FxHashMap::default() };
    let behaviour = behaviour_of(db, project, core);
    let costs = behaviour.programs.iter().chain(&behaviour.operations).map(|program| &*program.cost);
    let mut sends: FxHashMap<Name, u64> = FxHashMap::default();
    for name in costs.flat_map(sends_in) {
        if sends.contains_key(name) {
            continue;
        }
        let of_operations = calls_of_operations(behaviour, name);
        let count = |program: &mauve_hir::TimedProgram<'db>| calls(&program.cost, name, &of_operations);
        let of_programs: Vec<u64> = behaviour.programs.iter().map(count).collect();
        let of_program = |index: usize| of_programs.get(index).copied().unwrap_or(0);
        // For each state, the sums of the first programs of its list.
        let sums = |first: &Vec<usize>| {
            let mut sums = vec![0u64];
            for &index in first {
                sums.push(sums.last().map_or(0, |sum| sum.saturating_add(of_program(index))));
            }
            sums
        };
        let first: Vec<Vec<u64>> = behaviour.edges.first.iter().map(sums).collect();
        let of_edge = |edge: &mauve_hir::Edge| {
            let first = first.get(edge.source).and_then(|sums| sums.get(edge.first)).copied().unwrap_or(0);
            edge.then.iter().fold(first, |sum, &index| sum.saturating_add(of_program(index)))
        };
        let greatest = behaviour.edges.all.iter().map(of_edge).max().unwrap_or(0);
        sends.insert(name.clone(), greatest);
    }
    sends
}

/// Returns the greatest number of calls that one execution of an operation sends, by required operation.
pub(crate) fn sends_of_operation(behaviour: &mauve_hir::Behaviour<'_>, operation: usize) -> Vec<(Name, u64)> {
    let mut names: Vec<&Name> = Vec::new();
    for name in behaviour.operations.iter().flat_map(|program| sends_in(&program.cost)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let calls = |name: &Name| calls_of_operations(behaviour, name).get(operation).copied().unwrap_or(0);
    names.into_iter().map(|name| (name.clone(), calls(name))).filter(|(_, calls)| *calls > 0).collect()
}

/// Returns, for each operation that a core defines, the greatest number of calls that it sends to the required operation `name`.
fn calls_of_operations(behaviour: &mauve_hir::Behaviour<'_>, name: &Name) -> Vec<u64> {
    let mut found = vec![0; behaviour.operations.len()];
    // Callees first.
    for &index in &behaviour.order {
        if let Some(operation) = behaviour.operations.get(index) {
            found[index] = calls(&operation.cost, name, &found);
        }
    }
    found
}

/// Returns the greatest number of calls to the required operation `name` along a path of a program; it saturates.
fn calls(cost: &Cost<'_>, name: &Name, of_operations: &[u64]) -> u64 {
    match cost {
        Cost::Codel(_) => 0,
        Cost::Operation(index) => of_operations.get(*index).copied().unwrap_or(0),
        Cost::Send(sent) => u64::from(sent == name),
        Cost::Sum(costs) => {
            costs.iter().fold(0, |sum: u64, cost| sum.saturating_add(calls(cost, name, of_operations)))
        }
        Cost::Greatest(costs) => costs.iter().map(|cost| calls(cost, name, of_operations)).max().unwrap_or(0),
    }
}
