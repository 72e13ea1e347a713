//! A deployment for simulations: its activities at one level, and the names of what their jobs execute.

use std::borrow::Cow;

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, ProgramId, Project};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{ActivitySet, Executed, Level, Method, Slice};

use crate::exported::psm_at;
use crate::psm::Psm;
use crate::system::system_of;
use crate::task_set::{activity_set, psms_of};

/// A deployment at one level, to be simulated.
#[derive(Debug, Clone)]
pub struct Simulated<'db> {
    /// Its activities, in the order of the deployment.
    pub set: ActivitySet,
    /// The state machine of each activity, where it is known.
    psms: Vec<Option<Cow<'db, Psm<'db>>>>,
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
) -> Simulated<'db> {
    let system = system_of(db, project, deployment);
    let psms = psms_of(db, project, system, level);
    let set = activity_set(db, project, system, &psms, Method::Psm);
    let known = psms.into_iter().map(|psm| psm?.as_ref().ok().map(Cow::Borrowed));
    Simulated { set, psms: known.collect() }
}

/// Returns the deployment of an exported task set; none where it has no times at the level.
pub fn simulated_of(file: &TaskSet, level: Level) -> Option<Simulated<'static>> {
    let column = file.column(level)?;
    let psms = file.activities.iter().map(|it| psm_at(it.machine.as_ref()?, column).map(Cow::Owned));
    Some(Simulated { set: file.activities_at(column, Method::Psm), psms: psms.collect() })
}

impl Simulated<'_> {
    /// Returns the initial state of each activity's machine.
    pub fn initial_states(&self) -> Vec<Option<u32>> {
        let initial = |psm: &Option<Cow<'_, Psm<'_>>>| u32::try_from(psm.as_ref()?.initial).ok();
        self.psms.iter().map(initial).collect()
    }

    /// Returns the names of the edge that a slice executes; none where it executes a call or real-time throttling.
    pub fn edge(&self, slice: &Slice) -> Option<EdgeNames<'_>> {
        let Executed::Edge(edge) = slice.executed else { return None };
        let psm = self.psms.get(slice.activity)?.as_ref()?;
        let edge = psm.edges.all.get(edge)?;
        let program = |index: usize| psm.programs.get(index).map(|(program, _)| program);
        Some(EdgeNames {
            source: psm.states.get(edge.source)?,
            target: psm.states.get(edge.target)?,
            transition: edge.transition.as_ref(),
            programs: psm.edges.programs(edge).filter_map(program).collect(),
        })
    }

    /// Returns the client whose call a slice executes, as an index of the activities; none where it executes an edge.
    pub fn client(&self, slice: &Slice) -> Option<usize> {
        let Executed::Operation(operation) = slice.executed else { return None };
        self.set.operations.get(operation).map(|operation| operation.client)
    }
}
