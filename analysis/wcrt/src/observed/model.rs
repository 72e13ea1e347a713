//! What the model of a deployment promises about a recording of it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use mauve_hir::{Decl, Edges, ModelDb, Project, behaviour_of, core_of, uses_of};
use mauve_timing::Time;

use crate::execution_times::execution_times;
use crate::fact::InterferenceReport;
use crate::report::{Query, Report};
use crate::system::Priority;

/// A deployment, as far as a recording shows it. Times are in nanoseconds.
#[derive(Debug, Clone, Default)]
pub struct Expected {
    /// The activities, in the order of the deployment.
    pub instances: Vec<ExpectedInstance>,
    /// The codels that its components may call, with their times.
    pub codels: BTreeMap<String, Option<u64>>,
    /// The programs with times of their own, by their keys in a timing table.
    pub programs: BTreeMap<String, u64>,
    /// The probability with which an execution may exceed its time.
    pub level: f64,
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
    /// The CPUs that it may use, a bit each, if they are known.
    pub cpus: Option<u64>,
    /// T.
    pub period: Option<u64>,
    /// D.
    pub deadline: Option<u64>,
    /// R, the bound of its response time.
    pub response: Option<u64>,
    /// The greatest cost of one of its jobs.
    pub own: Option<u64>,
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

/// Returns what a deployment promises. `report` is the answer to `query`.
pub fn expected<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    report: &Report<'db>,
) -> Expected {
    let times = execution_times(db, project, deployment, query.level);
    let nanos = |time: Option<Time>| time.map(Time::as_nanos);
    let interrupt = || ();
    let mut breakdown = report.breakdown(&interrupt);
    let instances = report.activities.iter().enumerate().map(|(index, activity)| {
        let core = activity.component.and_then(|component| core_of(db, project, component));
        let machine = core.and_then(|core| ExpectedMachine::of(db, project, core));
        let uses = core.filter(|_| machine.is_some()).map(|core| uses_of(db, project, core));
        ExpectedInstance {
            instance: activity.instance.to_string(),
            component: activity.component.map(|component| component.qualified(db)),
            priority: activity.priority,
            cpus: activity.cpus,
            period: nanos(activity.period).filter(|period| *period > 0),
            deadline: nanos(activity.deadline),
            response: nanos(activity.response),
            own: nanos(activity.own),
            machine,
            codels: uses.map(|uses| uses.codels.iter().map(|codel| codel.qualified(db)).collect()),
            interference: breakdown.of(index),
        }
    });
    let instances = instances.collect();
    let programs = times.programs.into_iter();
    Expected {
        instances,
        codels: times.codels.into_iter().map(|(codel, time)| (codel.qualified(db), nanos(time))).collect(),
        programs: programs
            .map(|(component, program, time)| {
                (format!("{}/{program}", component.qualified(db)), time.as_nanos())
            })
            .collect(),
        level: query.level.as_f64(),
    }
}
