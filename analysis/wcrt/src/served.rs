//! The operations that activities execute for others: how many calls a job of the client sends, and what each takes.
//!
//! A call is sent by a program of the client, and executed by the provider in its own thread. So the provider's jobs may take
//! longer, and whatever they delay: `mauve-timing` counts the calls ([`TaskOperation`]). An operation may send calls itself; these
//! are sent by the provider, each time that it executes the operation.

use mauve_timing::{Level, Priority, TaskOperation, Time};
use rustc_hash::FxHashMap;

use crate::psm::{OtherTimes, is_readable, operation_with};
use crate::reason::{CallsReason, Reason, Refusal};
use crate::sends::{SentCalls, sends_of};
use crate::system::{Connected, System};
use mauve_hir::item_tree::Name;
use mauve_hir::{ModelDb, Project};

/// The operations that are executed in a deployment, and why they cannot be analysed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Served<'db> {
    /// Those that take time, or that send calls to such ones.
    pub(crate) operations: Vec<TaskOperation>,
    /// Whether each waits.
    pub(crate) waits: Vec<bool>,
    /// The connection of each.
    pub(crate) connections: Vec<Connected>,
    /// Why activities are not analysed because of operations that they execute.
    pub(crate) refusals: FxHashMap<usize, Vec<Refusal<'db>>>,
}

/// Calls that are sent over a connection.
struct Sent<'a> {
    connected: &'a Connected,
    /// The greatest number that one job of the client sends; `during` an operation, that one execution of it sends. `None` if it
    /// is unknown.
    sends: Option<SentCalls>,
    /// The operation that sends them, as an index into [`Served::operations`]; none for a job, and if the number is unknown.
    during: Option<usize>,
    /// The operations whose execution leads to these calls: the provider, and the name.
    chain: Vec<(usize, Name)>,
}

impl<'db> Served<'db> {
    fn refuse(&mut self, system: &System<'db>, provider: usize, why: CallsReason) {
        let Some(at) = system.activities.get(provider).map(|it| it.at.clone()) else { return };
        self.add(provider, Refusal::new(Reason::Calls(why), at));
    }

    fn add(&mut self, provider: usize, refusal: Refusal<'db>) {
        let known = self.refusals.entry(provider).or_default();
        if !known.contains(&refusal) {
            known.push(refusal);
        }
    }
}

/// The maximum number of operations, counted for each chain of calls by which one is executed.
pub(crate) const MOST_OPERATIONS: usize = 4096;

/// Returns the calls that the jobs of clients send, the last connection first.
fn sent_by_jobs<'a, 'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &'a System<'db>,
) -> Vec<Sent<'a>> {
    let mut sent = Vec::new();
    for connected in system.connected.iter().rev() {
        let component = system.activities.get(connected.client).and_then(|client| client.component);
        // In the background too: there, it only has no period.
        let component = component.filter(|&component| *is_readable(db, project, component));
        let sends = component
            .map(|it| sends_of(db, project, it).get(&connected.required).copied().unwrap_or_default());
        if sends.is_none_or(|it| it.most > 0 || it.starting > 0) {
            sent.push(Sent { connected, sends, during: None, chain: Vec::new() });
        }
    }
    sent
}

/// Returns the operations that are executed in a deployment. `what_if` replaces times of the tables.
pub(crate) fn served_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    level: Level,
    what_if: OtherTimes<'_, 'db>,
) -> Served<'db> {
    let mut found = Served::default();
    if system.connected.is_empty() {
        return found;
    }
    let mut by_client: FxHashMap<usize, Vec<&Connected>> = FxHashMap::default();
    for connected in &system.connected {
        by_client.entry(connected.client).or_default().push(connected);
    }
    // The calls that are sent; those of every client first, in the order of the connections.
    let mut open = sent_by_jobs(db, project, system);
    let mut visited = 0;
    while let Some(Sent { connected, sends, during, mut chain }) = open.pop() {
        visited += 1;
        if visited > MOST_OPERATIONS {
            let providers = system.connected.iter().map(|it| it.provider);
            providers.for_each(|it| found.refuse(system, it, CallsReason::ManyChains));
            return found;
        }
        let Some(provider) = system.activities.get(connected.provider) else { continue };
        let Some(client) = system.activities.get(connected.client) else { continue };
        let operation = connected.operation.clone();
        let executed = provider
            .component
            .and_then(|component| operation_with(db, provider.tables, component, &operation, level, what_if));
        // The provider is refused for the same reason, and what it sends is unknown.
        let Some(executed) = executed else { continue };
        let of_provider = by_client.get(&connected.provider).map_or(&[] as &[_], Vec::as_slice);
        let sent = executed.sends.iter().flat_map(|(required, sends)| {
            of_provider.iter().filter(move |it| it.required == *required).map(move |it| (*it, *sends))
        });
        let sent: Vec<(&Connected, u64)> = sent.collect();
        if executed.time == Ok(Time::ZERO) && sent.is_empty() {
            continue;
        }
        let link = (connected.provider, operation.clone());
        if chain.contains(&link) {
            // Each provider of a ring of calls may be called without end.
            for (provider, _) in chain {
                found.refuse(system, provider, CallsReason::Ring(operation.clone()));
            }
            continue;
        }
        chain.push(link);
        let index = match (sends, executed.time) {
            (None, _) => {
                let client = client.instance.clone();
                found.refuse(system, connected.provider, CallsReason::NotAnalysed { operation, client });
                None
            }
            // Without a period, it may still send some when it starts.
            (Some(SentCalls { most: 1.., .. }), _)
                if client.priority == Priority::Background || client.period.is_none() =>
            {
                let client = client.instance.clone();
                let why = CallsReason::ClientWithoutPeriod { operation, client };
                found.refuse(system, connected.provider, why);
                None
            }
            (Some(_), Err(refusals)) => {
                refusals.into_iter().for_each(|refusal| found.add(connected.provider, refusal));
                None
            }
            (Some(SentCalls { most: sends, every, starting, pending }), Ok(time)) => {
                found.connections.push(connected.clone());
                let (provider, client) = (connected.provider, connected.client);
                found.operations.push(TaskOperation {
                    provider,
                    client,
                    sends,
                    every,
                    starting,
                    pending,
                    time,
                    during,
                });
                found.waits.push(executed.waits);
                Some(found.operations.len() - 1)
            }
        };
        // What an unknown number of executions sends is unknown.
        open.extend(sent.into_iter().map(|(connected, sends)| Sent {
            connected,
            sends: index.map(|_| SentCalls { most: sends, ..SentCalls::default() }),
            during: index,
            chain: chain.clone(),
        }));
    }
    found
}
