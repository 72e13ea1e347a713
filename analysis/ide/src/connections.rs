//! What is known of the connections of an architecture: in each deployment, how long data takes there.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, Flat, Link, ModelDb, Project, flat_of, names_of, target_of};
use mauve_wcrt::Query;
use mauve_wcrt::chains::{ConnectionReport, connections_of};

/// A connection between ports in a deployment.
pub(crate) struct LinkReport<'db> {
    pub(crate) deployment: Decl<'db>,
    /// Its index in [`Flat::links`].
    pub(crate) index: usize,
    pub(crate) link: &'db Link<'db>,
    pub(crate) report: &'db ConnectionReport<'db>,
}

/// Returns the connections between ports that stand in an architecture, those of each deployment that has it.
pub(crate) fn connections_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
) -> Vec<LinkReport<'db>> {
    let mut found = Vec::new();
    for (deployment, flat) in deployments(db, project) {
        if !flat.architectures.contains(&architecture) {
            continue;
        }
        let reports = connections_of(db, project, deployment, Query::shown(db, project, deployment));
        let links = flat.links.iter().zip(reports).enumerate();
        let here = links.filter(|(_, (link, _))| !link.operation && link.is_in(architecture));
        found.extend(here.map(|(index, (link, report))| LinkReport { deployment, index, link, report }));
    }
    found
}

/// Returns the deployments of a project with their architectures, flattened.
pub(crate) fn deployments<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> Vec<(Decl<'db>, &'db Flat<'db>)> {
    let flat = |of: Decl<'db>| Some((of, flat_of(db, project, target_of(db, project, of)?)));
    deployments_of(db, project).iter().filter_map(|of| flat(*of)).collect()
}

/// A query of its own: each architecture asks for it, and there may be thousands.
#[salsa::tracked(returns(ref))]
fn deployments_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Decl<'db>> {
    names_of(db, project).of_kind(db, Kind::Deployment).collect()
}
