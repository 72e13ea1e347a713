//! Which timing tables count for a component: those of the deployments that execute it.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ModelDb, Project, names_of};
use rustc_hash::FxHashSet;

use crate::system::system_of;
use crate::table_set::{TableSet, all_tables_of, table_sets};

/// Returns the timing tables of the deployments that execute a component; if none does, those of all deployments.
#[salsa::tracked(returns(ref))]
pub fn tables_for<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> Vec<TableSet<'db>> {
    let all = table_sets(db, project);
    if all.len() <= 1 {
        return all.clone();
    }
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let activities = deployments.flat_map(|it| &system_of(db, project, it).activities);
    let executing = activities.filter(|activity| activity.component == Some(component));
    let used: FxHashSet<TableSet<'db>> = executing.map(|it| it.tables).collect();
    all.iter().copied().filter(|it| used.is_empty() || used.contains(it)).collect()
}

/// Returns the timing tables of a component in a deployment: those of the hosts that execute it; if none does, all of the deployment.
/// There is at least one.
pub fn tables_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    component: Decl<'db>,
) -> Vec<TableSet<'db>> {
    let activities = system_of(db, project, deployment).activities.iter();
    let executing = activities.filter(|it| it.component == Some(component));
    let used: FxHashSet<TableSet<'db>> = executing.map(|it| it.tables).collect();
    let all = all_tables_of(db, project, deployment).into_iter();
    all.filter(|it| used.is_empty() || used.contains(it)).collect()
}

/// Returns the first of [`tables_for`] a component: for one view of it that belongs to no deployment.
pub fn first_tables<'db>(db: &'db dyn ModelDb, project: Project<'db>, component: Decl<'db>) -> TableSet<'db> {
    let first = tables_for(db, project, component).first();
    first.copied().unwrap_or_else(|| TableSet::new(db, project, None, None))
}
