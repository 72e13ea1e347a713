//! What a call of an operation assigns and writes.

use std::borrow::Cow;
use std::sync::Arc;

use crate::ModelDb;
use crate::body::{BodyId, CoreScope, ProgramIn, core_scope};
use crate::graph::components;
use crate::infer::shared_variables;
use crate::program_graph::{Call, ProgramGraph, graph_of};
use crate::project::Project;
use crate::source::Decl;

use super::program::{OperationEffects, ProgramFlow};

/// Returns the effects of each operation of a core.
pub(super) fn effects_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &CoreScope,
) -> Cow<'db, [OperationEffects]> {
    match (scope.operations.is_empty(), scope.groups().len()) {
        (true, _) => Cow::Borrowed(&[]),
        // A query for the only group would be recomputed with each change of the core.
        (false, 1) => Cow::Owned(effects(db, project, of, scope)),
        (false, _) => Cow::Borrowed(effects_of_groups(db, project, of)),
    }
}

/// Returns the effects of the operations of a core with several groups: few edits change them.
#[salsa::tracked(returns(ref))]
fn effects_of_groups<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<OperationEffects> {
    let scope = core_scope(db, of).as_ref();
    scope.map_or_else(Vec::new, |scope| effects(db, project, of, scope))
}

fn effects<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &CoreScope,
) -> Vec<OperationEffects> {
    let operations = (0..scope.operations.len() as u32).map(BodyId::Operation);
    let graphs = operations.map(|body| graph_of(db, project, of, body, ProgramIn::Whole));
    let graphs: Vec<Option<&Arc<ProgramGraph<'db>>>> = graphs.collect();
    let called = |graph: &Arc<ProgramGraph<'db>>| graph.calls().filter_map(Call::operation).collect();
    let calls: Vec<Vec<usize>> = graphs.iter().map(|graph| graph.map_or_else(Vec::new, called)).collect();
    let shared = shared_variables(db, project, of).len();
    let mut effects = vec![OperationEffects::default(); graphs.len()];
    // Each after its callees, but a recursive one, which is an error, before one of them.
    for index in components(&calls).into_iter().flatten() {
        if let Some(Some(graph)) = graphs.get(index) {
            let flow = ProgramFlow::of(graph, shared, &effects, false);
            effects[index] =
                OperationEffects { assigns: flow.assigns.below(shared), writes: flow.writes.ports };
        }
    }
    effects
}
