//! The diagnostics of the chains and connections of a deployment.

use mauve_hir::deployed;
use mauve_wcrt::chains::{ChainReport, ConnectionReport, chains_of};
use mauve_wcrt::is_throttled;

use super::*;

/// Returns the diagnostics of the chains that `mauve.toml` declares, and of the connections.
pub(super) fn chain_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<Arc<Diagnostic<'db>>> {
    let Some((flat, _)) = deployed(db, project, deployment) else { return Vec::new() };
    let chains = chains_of(db, project, deployment, Query::shown(db, project, deployment));
    let mut found = Vec::new();
    for (link, hop) in flat.links.iter().zip(&chains.hops) {
        let ConnectionReport { overwritten, stays_full, never_read, faster, .. } = hop;
        found.extend(overwritten.as_ref().map(|by| may_be_overwritten::report(link, by)));
        found.extend(stays_full.map(|age| buffer_stays_full::report(link, age)));
        found.extend(faster.map(|times| never_read::report_faster(link, times)));
        found.extend(never_read.and_then(|values| never_read::report(link, values)));
    }
    let declared = config_file(db, project.workspace(db)).zip(Some(config_of(db, project.workspace(db))));
    let of_config = chains.all.iter().filter_map(|chain| {
        let (file, config) = declared?;
        let config = config.chains.get(chain.declared?)?;
        let at = Location::of_span(file, &config.span);
        let Some(latency) = chain.latency else {
            let keys = || chain_broken::keys(db, (project, deployment), config, chain);
            return (!chain_broken::is_reported(db, project, chain))
                .then(|| chain_broken::report(db, (&at, config), chain, keys()));
        };
        let limit = chain.limit.filter(|limit| latency > *limit)?;
        let is_throttled = is_throttled(db, project.workspace(db)) == Some(true);
        late(flat, chain, (latency, limit), &at, is_throttled)
    });
    found.extend(of_config);
    found.into_iter().map(Arc::new).collect()
}

/// Reports a chain at the connection to the component that contributes most; without a connection, at its declaration.
fn late<'db>(
    flat: &mauve_hir::Flat<'db>,
    chain: &ChainReport<'db>,
    times: (Time, Time),
    declared: &Location<'db>,
    is_throttled: bool,
) -> Option<Diagnostic<'db>> {
    let connected = || chain.steps.iter().filter(|it| it.connection.is_some());
    // Of equal ones, the first.
    let greatest = connected().rev().max_by_key(|it| it.total()).or(chain.steps.first())?;
    let link = greatest.connection.and_then(|it| flat.links.get(it));
    let at = link.map_or_else(|| declared.clone(), |link| link.at.clone());
    Some(chain_late::report(at, chain, greatest, times, declared, is_throttled))
}
