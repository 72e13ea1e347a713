//! Which timing tables count for a deployment: those of `[timing] tables` in `mauve.toml`, or its own ones.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, ModelDb, OwnerOfTables, Project, config_of, names_of, owner_of_tables, section_with_tables,
};
use rustc_hash::FxHashSet;

/// The timing tables that count for a deployment: those of `[timing] tables`, or its own ones.
#[salsa::interned(debug)]
pub struct TableSet<'db> {
    /// The project of the deployment.
    #[returns(copy)]
    pub project: Project<'db>,
    /// The name in the header `[timing.deployment.NAME]` of its own tables; none for those of `[timing] tables`.
    #[returns(ref)]
    pub section: Option<Name>,
}

/// Returns the timing tables of a deployment. Those of its own section replace the others: the times of two computers in one
/// sum could give a bound that is too low.
#[salsa::tracked(returns(copy))]
pub fn tables_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> TableSet<'db> {
    TableSet::new(db, project, section_with_tables(db, project, deployment).map(Name::from))
}

/// Returns the timing tables of the deployments of a project, those of `[timing] tables` first; only these without any
/// deployment. For everything that belongs to no deployment, the times of all of them are shown.
#[salsa::tracked(returns(ref))]
pub fn table_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let general = TableSet::new(db, project, None);
    if config_of(db, project.workspace(db)).deployment_tables.is_empty() {
        return vec![general];
    }
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let used: FxHashSet<TableSet<'db>> = deployments.map(|it| tables_of(db, project, it)).collect();
    let all = checked_sets(db, project).into_iter();
    all.filter(|it| used.contains(it) || used.is_empty() && *it == general).collect()
}

/// Returns the timing tables that are checked in a project: those of `[timing] tables`, and those of sections, except sections
/// for deployments of other projects.
pub(crate) fn checked_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let sections = config_of(db, project.workspace(db)).deployment_tables.keys();
    let checked = sections.filter(|name| owner_of_tables(db, project, name) != OwnerOfTables::Elsewhere);
    let sections = checked.map(|name| Some(Name::from(name.as_str())));
    std::iter::once(None).chain(sections).map(|section| TableSet::new(db, project, section)).collect()
}
