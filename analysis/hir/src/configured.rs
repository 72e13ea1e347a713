//! What `mauve.toml` names in the models: instances whose clocks are synchronised, the ports of chains.

use std::ops::Range;

use crate::config::Chain;
use crate::fact::{EndKind, Fact, FactKind};
use crate::features::shell_of;
use crate::flat::{Flat, flat_of, target_of};
use crate::item_tree::{Kind, Name};
use crate::names::{names_of, similar};
use crate::project::{Project, all_roots, config_file, config_of, root_file};
use crate::source::Location;
use crate::{ModelDb, Workspace};

/// The instances and ports in `mauve.toml` that no deployment of the workspace has. Nothing, where one that is missing or
/// cannot be read may have them, or where nothing is deployed. Each with a project that it was looked for in.
pub fn check<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<(Project<'db>, Fact<'db>)> {
    let config = config_of(db, workspace);
    let all_there = config.roots.iter().all(|(path, _)| root_file(db, workspace, path).is_some());
    if config.completeness.is_incomplete()
        || !all_there
        || config.synchronised.is_empty() && config.chains.is_empty()
    {
        return Vec::new();
    }
    let Some(file) = config_file(db, workspace) else { return Vec::new() };
    let Some(deployed) = deployed(db, workspace) else { return Vec::new() };
    let Some(&(any, _)) = deployed.first() else { return Vec::new() };
    let ports = config.chains.iter().flat_map(|Chain { ends, .. }| ends);
    let ports = ports.filter_map(|(end, span)| Some((end.split_once('.')?, end, span)));
    let ports = ports.map(|((instance, port), whole, span)| (instance, Some(port), whole, span));
    let instances = config.synchronised.iter().map(|(name, span)| (name.as_str(), None, name, span));
    let mut found = Vec::new();
    for (instance, port, whole, span) in instances.chain(ports) {
        // Where it is written otherwise than it reads, all of it is the place, and a fix would write too much.
        let start = written(file.text(db), span, whole);
        let at = |offset: usize, name: &str| match start {
            Some(start) => {
                let from = start + offset;
                Location::Range(file, from as u32, (from + name.len()) as u32)
            }
            None => Location::Range(file, span.start as u32, span.end as u32),
        };
        let having: Vec<_> = deployed.iter().filter(|(_, flat)| flat.instance(instance).is_some()).collect();
        if having.is_empty() {
            let known = deployed.iter().flat_map(|(_, flat)| &flat.instances).map(|it| &it.name);
            let near = similar(instance, known).filter(|_| start.is_some());
            let kind = FactKind::NotDeployed { instance: instance.into(), near };
            found.push((any, Fact::new(at(0, instance), kind)));
            continue;
        }
        let Some(port) = port else { continue };
        let features: Option<Vec<_>> = having
            .iter()
            .map(|(project, flat)| Some((*project, flat, flat.features(db, *project, instance)?)))
            .collect();
        // A shell that is not known may have it.
        let Some(features) = features else { continue };
        if features
            .iter()
            .any(|(_, _, it)| it.completeness.is_incomplete() || it.cycle || it.get(port).is_some())
        {
            continue;
        }
        let Some((project, flat, known)) = features.first() else { continue };
        let shell = flat.instance(instance).and_then(|it| shell_of(db, *project, it.component?));
        let shell = shell.map_or_else(Name::default, |shell| shell.name(db).clone());
        let is_port = |name: &&Name| known.get(name).is_some_and(|feature| feature.kind.is_port());
        let near = similar(port, known.by_name.keys().filter(is_port)).filter(|_| start.is_some());
        let at = at(instance.len() + 1, port);
        let (expected, name, instance) = (EndKind::Port, port.into(), instance.into());
        let kind = FactKind::UnresolvedFeature { expected, name, instance, shell, near };
        found.push((*project, Fact::new(at, kind)));
    }
    found
}

/// What each deployment runs; `None` where a part of it is unknown.
fn deployed<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Option<Vec<(Project<'db>, &'db Flat<'db>)>> {
    let mut found = Vec::new();
    for &root in all_roots(db, workspace) {
        let project = Project::new(db, workspace, root);
        let names = names_of(db, project);
        if names.may_miss_names() || names.incomplete_file.is_some() {
            return None;
        }
        for &deployment in names.all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
            let flat = flat_of(db, project, target_of(db, project, deployment)?);
            if !flat.refusals.is_empty() || flat.cycle {
                return None;
            }
            found.push((project, flat));
        }
    }
    Some(found)
}

/// Where `value` begins in the text of a string that has it as it is, between its quotes.
fn written(text: &str, span: &Range<usize>, value: &str) -> Option<usize> {
    let inner = text.get(span.start + 1..span.end.checked_sub(1)?)?;
    (inner == value).then_some(span.start + 1)
}
