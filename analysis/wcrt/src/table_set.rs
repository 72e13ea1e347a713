//! Which timing tables count for a deployment: those of `[timing] tables` in `mauve.toml`, or its own ones.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, ModelDb, OwnerOfTables, Project, config_of, hosts_of, names_of, owner_of_tables,
    section_with_tables,
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
    /// The host whose tables of its own they are, `[host.NAME] tables`, instead of the others.
    #[returns(ref)]
    pub host: Option<Name>,
}

/// Returns the timing tables of a deployment. Those of its own section replace the others: the times of two computers in one
/// sum could give a bound that is too low.
#[salsa::tracked(returns(copy))]
pub fn tables_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> TableSet<'db> {
    TableSet::new(db, project, section_with_tables(db, project, deployment).map(Name::from), None)
}

/// Returns the timing tables of a host for a deployment: its own ones, if it has any. They replace the others, for the same reason.
pub fn tables_of_host<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<usize>,
) -> TableSet<'db> {
    let hosts = hosts_of(db, project.workspace(db));
    match host.and_then(|it| hosts.all.get(it)).filter(|it| it.has_tables) {
        Some(host) => TableSet::new(db, project, None, Some(host.name.clone())),
        None => tables_of(db, project, deployment),
    }
}

/// Returns all timing tables of a deployment: one set for each host that has tables of its own, and one for the others.
pub fn all_tables_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<TableSet<'db>> {
    let hosts = &hosts_of(db, project.workspace(db)).all;
    let mut found: Vec<TableSet<'db>> =
        (0..hosts.len()).map(|it| tables_of_host(db, project, deployment, Some(it))).collect();
    let mut seen = FxHashSet::default();
    found.retain(|it| seen.insert(*it));
    match found.is_empty() {
        true => vec![tables_of(db, project, deployment)],
        false => found,
    }
}

/// Returns the timing tables of the deployments of a project, those of `[timing] tables` first; only these without any
/// deployment. For everything that belongs to no deployment, the times of all of them are shown.
#[salsa::tracked(returns(ref))]
pub fn table_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let general = TableSet::new(db, project, None, None);
    let workspace = project.workspace(db);
    let hosts = hosts_of(db, workspace).all.iter().any(|it| it.has_tables);
    if config_of(db, workspace).deployment_tables.is_empty() && !hosts {
        return vec![general];
    }
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let used: FxHashSet<TableSet<'db>> = deployments.flat_map(|it| all_tables_of(db, project, it)).collect();
    let all = checked_sets(db, project).into_iter();
    all.filter(|it| used.contains(it) || used.is_empty() && *it == general).collect()
}

/// Returns the timing tables that are checked in a project: those of `[timing] tables`, and those of sections, except sections
/// for deployments of other projects.
pub(crate) fn checked_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let sections = config_of(db, project.workspace(db)).deployment_tables.keys();
    let checked = sections.filter(|name| owner_of_tables(db, project, name) != OwnerOfTables::Elsewhere);
    let sections = checked.map(|name| Some(Name::from(name.as_str())));
    let sections = std::iter::once(None).chain(sections);
    let of_deployments = sections.map(|section| TableSet::new(db, project, section, None));
    let hosts = hosts_of(db, project.workspace(db)).all.iter().filter(|it| it.has_tables);
    of_deployments.chain(hosts.map(|it| TableSet::new(db, project, None, Some(it.name.clone())))).collect()
}
