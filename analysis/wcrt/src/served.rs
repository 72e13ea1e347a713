//! The operations that activities execute for others: how many calls a job of the client sends, and what each takes.
//!
//! A call is sent by a program of the client, and executed by the provider in its own thread. So the provider's jobs may take
//! longer, and whatever they delay: `mauve-timing` counts the calls ([`Operation`]). An operation may send calls itself; these
//! are sent by the provider, each time that it executes the operation.

use mauve_timing::{Level, Operation, Time};
use rustc_hash::FxHashMap;

use crate::psm::{Executed, operation_with};
use crate::reason::{Reason, Refusal};
use crate::sends::sends_of;
use crate::system::{Connected, Priority, System};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, Project};

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
