//! What the model of a deployment promises about a recording of it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use mauve_hir::{Decl, Edges, ModelDb, Project, behaviour_of, core_of, hosts_of, uses_of};
use mauve_pwcet::trace::access_key;
use mauve_timing::{CpuSet, Level, Priority, Time};

use super::chain_model::{ExpectedChain, ExpectedConnection, expected_chains, expected_connections};
use crate::execution_times::execution_times;
use crate::fact::InterferenceReport;
use crate::reason::Timed;
use crate::report::{Query, Report};
use crate::response::response_times;
use crate::system::system_of;
use crate::table_set::tables_of_host;
use crate::timetable::{files_of, table, timetable_of};

/// Times in tables without levels are compared at this level.
const STRICT: f64 = 1e-9;

/// Chains that are not declared, and are compared.
const MOST_CHAINS: usize = 64;

/// A deployment, as far as a recording shows it. Times are in nanoseconds.
#[derive(Debug, Clone, Default)]
pub struct ExpectedDeployment {
    /// The activities, in the order of the deployment.
    pub instances: Vec<ExpectedInstance>,
    /// Its chains, as far as a recording shows them.
    pub chains: Vec<ExpectedChain>,
    /// Its connections between ports.
    pub connections: Vec<ExpectedConnection>,
    /// The codels that its components may call, with their times, and the programs with times of their own, by their keys in a timing
    /// table; the ports and topics whose accesses have times, by their keys in a recording.
    pub times: BTreeMap<String, Option<u64>>,
    /// The waits of codels in the tables.
    pub waits: BTreeMap<String, u64>,
    /// The probability with which an execution may exceed its time.
    pub level: f64,
    /// The times at each level of the tables. Those without levels hold at each, and are compared at the strictest.
    pub levels: Vec<ExpectedLevel>,
}

/// The times at one level.
#[derive(Debug, Clone, Default)]
pub struct ExpectedLevel {
    /// The level.
    pub level: f64,
    /// The times of codels and programs, by their keys in a timing table, and of ports, by their keys in a recording.
    pub times: BTreeMap<String, u64>,
}

/// An activity of a deployment.
#[derive(Debug, Clone, Default)]
pub struct ExpectedInstance {
    /// The instance.
    pub instance: String,
    /// The qualified name of its component, if it is known.
    pub component: Option<String>,
    /// Its priority.
    pub priority: Priority,
    /// Whether its jobs have the highest priority once they have begun.
    pub is_not_preempted: bool,
    /// The CPUs that it may use, a bit each, if they are known.
    pub cpus: Option<CpuSet>,
    /// T; where data releases it, the least time for its releases.
    pub period: Option<u64>,
    /// How often data releases it in T at most; none where its clock does.
    pub burst: Option<u64>,
    /// D.
    pub deadline: Option<u64>,
    /// R, the bound of its response time.
    pub response: Option<u64>,
    /// The greatest cost of one of its jobs, with the whole overhead of its thread: any of its instances may need that.
    pub own: Option<u64>,
    /// Whether its thread wakes up for it, and not for another instance before it.
    pub wakes: bool,
    /// R and the greatest cost at the strictest level of the tables.
    pub strict: (Option<u64>, Option<u64>),
    /// Its behaviour, if it is known.
    pub machine: Option<ExpectedMachine>,
    /// The codels that its component may call; none if that is unknown.
    pub codels: Option<BTreeSet<String>>,
    /// The interference in its bound.
    pub interference: Vec<InterferenceReport>,
}

/// The state machine of a component, without times.
#[derive(Debug, Clone, Default)]
pub struct ExpectedMachine {
    /// The names of the states, by number.
    pub states: Vec<String>,
    /// The programs that its edges execute, by number: their keys in a timing table after `Component/`.
    pub programs: Vec<String>,
    /// The operations that it executes for others.
    pub operations: BTreeSet<String>,
    /// Its edges.
    pub edges: Arc<Edges>,
}

impl ExpectedMachine {
    fn of<'db>(db: &'db dyn ModelDb, project: Project<'db>, core: Decl<'db>) -> Option<ExpectedMachine> {
        let behaviour = behaviour_of(db, project, core);
        behaviour.refusals.is_empty().then(|| ExpectedMachine {
            states: behaviour.states.iter().map(ToString::to_string).collect(),
            programs: behaviour.programs.iter().map(|it| it.id.to_string()).collect(),
            operations: behaviour.operations.iter().map(|it| it.id.to_string()).collect(),
            edges: behaviour.edges.clone(),
        })
    }
}

/// Returns what a deployment promises, on one host if it has several. `report` is the answer to `query`.
pub fn expected<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<usize>,
    query: Query,
    report: &Report<'db>,
) -> ExpectedDeployment {
    let hosts = hosts_of(db, project.workspace(db));
    let is_here = |instance: &str| host.is_none() || hosts.of(instance) == host;
    let times = execution_times(db, project, deployment, host, query.level);
    let nanos = |time: Option<Time>| time.map(Time::as_nanos);
    let files = files_of(db, tables_of_host(db, project, deployment, host));
    let mut levels: Vec<Level> = files.iter().flat_map(|&file| table(db, file).levels.clone()).collect();
    levels.sort();
    levels.dedup();
    if levels.is_empty() {
        levels.extend(Level::from_f64(STRICT));
    }
    // The levels are in ascending order.
    let strictest = levels.first().copied().unwrap_or(query.level);
    let strict = response_times(db, project, deployment, Query { level: strictest, ..query });
    let interrupt = || ();
    let mut breakdown = report.breakdown(&interrupt);
    let system = system_of(db, project, deployment).activities.iter();
    let all = report.activities.iter().zip(system).enumerate();
    let here = all.filter(|(_, (_, it))| host.is_none() || it.host == host);
    let instances = here.map(|(index, (activity, resolved))| {
        let with_overhead = |own: Option<Time>, level: Level| {
            let overhead = timetable_of(db, resolved.tables).overhead(level).filter(|_| !resolved.wakes);
            nanos(own?.checked_add(overhead.unwrap_or_default()))
        };
        let core = activity.component.and_then(|component| core_of(db, project, component));
        let machine = core.and_then(|core| ExpectedMachine::of(db, project, core));
        let uses = core.filter(|_| machine.is_some()).map(|core| uses_of(db, project, core));
        ExpectedInstance {
            instance: activity.instance.to_string(),
            component: activity.component.map(|component| component.qualified(db)),
            priority: activity.priority,
            is_not_preempted: resolved.task.is_not_preempted,
            cpus: activity.cpus.map(|cpus| hosts.local(cpus).1),
            period: nanos(activity.period).filter(|period| *period > 0),
            burst: (!activity.is_periodic()).then_some(activity.burst.max(1)),
            deadline: nanos(activity.deadline),
            response: nanos(activity.response),
            own: with_overhead(activity.own, query.level),
            wakes: resolved.wakes,
            strict: strict
                .activities
                .get(index)
                .map(|it| (nanos(it.response), with_overhead(it.own, strictest)))
                .unwrap_or_default(),
            machine,
            codels: uses.map(|uses| uses.codels.iter().map(|codel| codel.qualified(db)).collect()),
            interference: breakdown.of(index),
        }
    });
    let of_level = |level: Level| {
        let found = execution_times(db, project, deployment, host, level);
        let codels = found.codels.into_iter();
        let codels = codels.filter_map(|(codel, time)| Some((codel.qualified(db), time?.as_nanos())));
        let programs = found.programs.into_iter();
        let programs = programs.map(|(component, program, time)| {
            (format!("{}/{program}", component.qualified(db)), time.as_nanos())
        });
        let accesses = found.accesses.into_iter();
        let accesses = accesses.map(|(component, port, time)| {
            (access_key(&format!("{}.{port}", component.qualified(db))), time.as_nanos())
        });
        let topics = found.topics.into_iter();
        let topics = topics.map(|(topic, time)| (access_key(&Timed::Topic(topic).key(db)), time.as_nanos()));
        let times = codels.chain(programs).chain(accesses).chain(topics).collect();
        ExpectedLevel { level: level.as_f64(), times }
    };
    let known = times.codels.iter().map(|(codel, _)| (codel.qualified(db), None));
    let timed = of_level(query.level).times.into_iter().map(|(key, time)| (key, Some(time)));
    let waits = times.waits.iter().map(|(codel, wait)| (codel.qualified(db), wait.as_nanos()));
    let connections = expected_connections(db, project, deployment).into_iter();
    let connections = connections.filter(|it| it.ends.iter().all(|(instance, _)| is_here(instance)));
    ExpectedDeployment {
        instances: instances.collect(),
        chains: expected_chains(db, project, deployment, query, MOST_CHAINS),
        connections: connections.collect(),
        times: known.chain(timed).collect(),
        waits: waits.collect(),
        level: query.level.as_f64(),
        levels: levels.into_iter().map(of_level).collect(),
    }
}
