//! A deployment for simulations: its activities at one level, and the names of what their jobs execute.

use std::sync::Arc;

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Edges, ModelDb, ProgramId, Project};
use mauve_timing::task_set::{Activity, TaskSet};
use mauve_timing::{ActivitySet, Executed, Level, Method, Slice};

use crate::exported::psm_at;
use crate::psm::Psm;
use crate::served::served_in;
use crate::system::system_of;
use crate::table_set::tables_of;
use crate::task_set::{activity_set, psms_of};

/// A deployment at one level, to be simulated.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// Its activities, in the order of the deployment.
    pub set: ActivitySet,
    /// The state machine of each activity, where it is known.
    machines: Vec<Option<Machine>>,
    /// The names of the operations of `set`.
    operations: Vec<Name>,
}

/// The names in a periodic state machine.
#[derive(Debug, Clone)]
struct Machine {
    states: Vec<Name>,
    initial: usize,
    edges: Arc<Edges>,
    programs: Vec<ProgramId>,
}

impl Machine {
    fn new(psm: &Psm<'_>) -> Machine {
        Machine {
            states: psm.states.clone(),
            initial: psm.initial,
            edges: psm.edges.clone(),
            programs: psm.programs.iter().map(|(program, _)| program.clone()).collect(),
        }
    }
}

/// The names of the edge of a state machine that a job executes.
#[derive(Debug, Clone)]
pub struct EdgeNames<'a> {
    /// The state at the start of the period.
    pub source: &'a Name,
    /// The state at its end.
    pub target: &'a Name,
    /// The transition; none where the machine stays in its state.
    pub transition: Option<&'a Name>,
    /// The programs, in the order of execution.
    pub programs: Vec<&'a ProgramId>,
}

/// Returns a deployment of a model.
pub fn simulated<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Simulated {
    let (system, tables) = (system_of(db, project, deployment), tables_of(db, project, deployment));
    let psms = psms_of(db, tables, system, level);
    let served = served_in(db, tables, system, level, &|_| None);
    let set = activity_set(db, project, system, &psms, &served, Method::Psm);
    let machines = psms.into_iter().map(|psm| psm?.as_ref().ok().map(Machine::new));
    let operations = served.connections.into_iter().map(|it| it.operation).collect();
    Simulated { set, machines: machines.collect(), operations }
}

/// Returns the deployment of an exported task set; none where it has no times at the level.
pub fn simulated_of(file: &TaskSet, level: Level) -> Option<Simulated> {
    let column = file.column(level)?;
    let machine = |it: &Activity| Some(Machine::new(&psm_at(it.machine.as_ref()?, column)?));
    let machines = file.activities.iter().map(machine).collect();
    let operations = file.operations.iter().map(|it| it.operation.as_str().into()).collect();
    Some(Simulated { set: file.activities_at(column, Method::Psm), machines, operations })
}

impl Simulated {
    /// Returns the initial state of each activity's machine.
    pub fn initial_states(&self) -> Vec<Option<u32>> {
        let initial = |machine: &Option<Machine>| u32::try_from(machine.as_ref()?.initial).ok();
        self.machines.iter().map(initial).collect()
    }

    /// Returns the names of the edge that a slice executes; none where it executes a call or real-time throttling.
    pub fn edge(&self, slice: &Slice) -> Option<EdgeNames<'_>> {
        let Executed::Edge(edge) = slice.executed else { return None };
        let machine = self.machines.get(slice.activity)?.as_ref()?;
        let edge = machine.edges.all.get(edge)?;
        Some(EdgeNames {
            source: machine.states.get(edge.source)?,
            target: machine.states.get(edge.target)?,
            transition: edge.transition.as_ref(),
            programs: machine.edges.programs(edge).filter_map(|index| machine.programs.get(index)).collect(),
        })
    }

    /// Returns the operation whose call a slice executes, and its client; none where it executes an edge.
    pub fn call(&self, slice: &Slice) -> Option<(&Name, &str)> {
        let Executed::Operation(operation) = slice.executed else { return None };
        let client = self.set.activities.get(self.set.operations.get(operation)?.client)?;
        Some((self.operations.get(operation)?, &client.name))
    }
}
