//! Checks of the names in `mauve.toml`: synchronised instances, the ports of chains, accepted instances of deployments, and
//! deployments with their own timing tables.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::config::{Acceptance, Chain, Config, DeploymentConfig};
use crate::fact::{EndKind, Fact, FactKind};
use crate::flat::{Flat, flat_of, target_of};
use crate::item_tree::{Kind, Name};
use crate::names::{names_of, similar};
use crate::project::{Project, all_roots, config_file, config_of, roots_exist};
use crate::source::{Decl, Location};
use crate::{File, ModelDb, Workspace};

/// Returns why, and until which response time, the deadline of an instance needs no proof: `[deployment.NAME] accept`.
pub fn accepted<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    instance: &str,
) -> Option<&'db Acceptance> {
    let deployments = &config_of(db, project.workspace(db)).deployments;
    let of_name = deployments.get(deployment.name(db).as_str());
    let mut sections = of_name.into_iter().chain(deployments.get(&deployment.qualified(db)));
    sections.find_map(|section| section.accepted.iter().find(|it| it.instance == instance))
}

/// Returns the name of the section `[timing.deployment.NAME]` with the timing tables of a deployment: the qualified name of the
/// deployment, otherwise its name; `None` if it uses those of `[timing] tables`.
pub fn section_with_tables<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Option<&'db str> {
    let sections = &config_of(db, project.workspace(db)).deployment_tables;
    let of = |name: &str| sections.get_key_value(name).map(|(name, _)| name.as_str());
    if sections.is_empty() {
        return None;
    }
    of(&deployment.qualified(db)).or_else(|| of(deployment.name(db)))
}

/// The deployments whose timing tables a section `[timing.deployment.NAME]` names, as seen from a project.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OwnerOfTables {
    /// A deployment of the project.
    Own,
    /// A deployment of another project of the workspace.
    Elsewhere,
    /// Several deployments of the project, with these qualified names.
    Several(Vec<String>),
    /// The workspace has no such deployment.
    Missing,
}

/// Returns the deployments whose timing tables the section `[timing.deployment.NAME]` names.
pub fn owner_of_tables<'db>(db: &'db dyn ModelDb, project: Project<'db>, section: &str) -> OwnerOfTables {
    match owners_of_tables(db, project).get(section) {
        Some(owners) if owners.len() == 1 => return OwnerOfTables::Own,
        Some(owners) => return OwnerOfTables::Several(owners.iter().cloned().collect()),
        None => {}
    }
    match owned_sections(db, project.workspace(db)).contains(section) {
        true => OwnerOfTables::Elsewhere,
        false => OwnerOfTables::Missing,
    }
}

/// Returns the sections that name the timing tables of some deployment of a workspace.
#[salsa::tracked(returns(ref))]
fn owned_sections(db: &dyn ModelDb, workspace: Workspace) -> BTreeSet<String> {
    if config_of(db, workspace).deployment_tables.is_empty() {
        return BTreeSet::new();
    }
    let all = all_roots(db, workspace).iter().map(|&root| Project::new(db, workspace, root));
    all.flat_map(|project| owners_of_tables(db, project).keys().cloned()).collect()
}

/// Returns the qualified names of the deployments whose timing tables each section names.
#[salsa::tracked(returns(ref))]
fn owners_of_tables<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> BTreeMap<String, BTreeSet<String>> {
    let mut owners: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    if config_of(db, project.workspace(db)).deployment_tables.is_empty() {
        return owners;
    }
    for deployment in names_of(db, project).of_kind(db, Kind::Deployment) {
        let Some(section) = section_with_tables(db, project, deployment) else { continue };
        // Two declarations of one name in one library are another error.
        owners.entry(section.to_owned()).or_default().insert(deployment.qualified(db));
    }
    owners
}

/// Returns the facts for deployments, instances and ports in `mauve.toml` that the workspace does not have, each with a project
/// without them. Without deployments, and if a missing or unreadable file may contain a deployment, there are none.
pub fn check<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<(Project<'db>, Fact<'db>)> {
    let config = config_of(db, workspace);
    if config.completeness.is_incomplete()
        || !roots_exist(db, workspace)
        || config.synchronised.is_empty()
            && config.chains.is_empty()
            && config.deployments.is_empty()
            && config.deployment_tables.is_empty()
    {
        return Vec::new();
    }
    let Some(file) = config_file(db, workspace) else { return Vec::new() };
    let Some(deployed) = deployed(db, workspace) else { return Vec::new() };
    let Some(&(any, ..)) = deployed.first() else { return Vec::new() };
    let ports = config.chains.iter().flat_map(Chain::ends);
    let ports = ports.filter_map(|(end, span)| Some((end.split_once('.')?, end, span)));
    let ports = ports.map(|((instance, port), value, span)| (instance, Some(port), value, span));
    let instances = config.synchronised.iter().map(|(name, span)| (name.as_str(), None, name, span));
    let mut found = Vec::new();
    for (instance, port, value, span) in instances.chain(ports) {
        // If the string has escapes, the location is the entire string, and there is no fix.
        let start = start_of(file.text(db), span, value);
        let at = |offset: usize, name: &str| match start {
            Some(start) => {
                let from = start + offset;
                Location::Range(file, from as u32, (from + name.len()) as u32)
            }
            None => Location::Range(file, span.start as u32, span.end as u32),
        };
        let with_instance: Vec<_> =
            deployed.iter().filter(|(.., flat)| flat.instance(instance).is_some()).collect();
        if with_instance.is_empty() {
            let names = deployed.iter().flat_map(|(.., flat)| &flat.instances).map(|it| &it.name);
            let near = similar(instance, names).filter(|_| start.is_some());
            let kind = FactKind::NotDeployed { instance: instance.into(), near };
            found.push((any, Fact::new(at(0, instance), kind)));
            continue;
        }
        let Some(port) = port else { continue };
        let features: Option<Vec<_>> = with_instance
            .iter()
            .map(|(project, _, flat)| {
                Some((*project, flat, flat.instance(instance)?.features(db, *project)?))
            })
            .collect();
        // An unresolved shell may have the port.
        let Some(features) = features else { continue };
        if features
            .iter()
            .any(|(_, _, it)| it.completeness.is_incomplete() || it.cycle || it.get(port).is_some())
        {
            continue;
        }
        let Some((project, flat, features)) = features.first() else { continue };
        let shell = flat.instance(instance).and_then(|it| it.shell(db, *project));
        let shell = shell.map_or_else(Name::default, |shell| shell.name(db).clone());
        let is_port = |name: &&Name| features.get(name).is_some_and(|feature| feature.kind.is_port());
        let near = similar(port, features.by_name.keys().filter(is_port)).filter(|_| start.is_some());
        let at = at(instance.len() + 1, port);
        let (expected, name, instance) = (EndKind::Port, port.into(), instance.into());
        let kind = FactKind::UnresolvedFeature { expected, name, instance, shell, near };
        found.push((*project, Fact::new(at, kind)));
    }
    let accepted = check_acceptances(db, file, &config.deployments, &deployed);
    found.extend(accepted.into_iter().map(|fact| (any, fact)));
    found.extend(check_tables(db, file, config, &deployed));
    found
}

/// Returns the facts for the names of `[timing.deployment.NAME]`, each with the project that has it.
fn check_tables<'db>(
    db: &'db dyn ModelDb,
    file: File,
    config: &Config,
    deployed: &[DeployedArchitecture<'db>],
) -> Vec<(Project<'db>, Fact<'db>)> {
    let mut projects: Vec<Project<'db>> = deployed.iter().map(|(project, ..)| *project).collect();
    projects.dedup();
    let mut found = Vec::new();
    for (name, section) in &config.deployment_tables {
        let at = location_of_key(file, &section.span);
        for &project in &projects {
            let kind = match owner_of_tables(db, project, name) {
                OwnerOfTables::Own | OwnerOfTables::Elsewhere => continue,
                OwnerOfTables::Several(candidates) => {
                    FactKind::AmbiguousDeployment { name: name.as_str().into(), candidates }
                }
                OwnerOfTables::Missing => {
                    let named = deployed.iter().find(|(_, of, _)| of.name(db) == name.as_str());
                    match named {
                        Some((_, of, _)) => FactKind::SecondTables { deployment: of.qualified(db) },
                        None => {
                            let near = similar(name, deployed.iter().map(|(_, of, _)| of.name(db)));
                            FactKind::UnresolvedDeployment { name: name.as_str().into(), near }
                        }
                    }
                }
            };
            found.push((project, Fact::new(at, kind)));
            break;
        }
    }
    found
}

/// Returns the facts for the names of `[deployment.NAME] accept`.
fn check_acceptances<'db>(
    db: &'db dyn ModelDb,
    file: File,
    sections: &BTreeMap<String, DeploymentConfig>,
    deployed: &[DeployedArchitecture<'db>],
) -> Vec<Fact<'db>> {
    let mut found = Vec::new();
    for (deployment, section) in sections {
        let flats = deployed.iter().filter(|(_, of, _)| of.is_called(db, deployment));
        let flats: Vec<_> = flats.map(|(.., flat)| flat).collect();
        if flats.is_empty() {
            let near = similar(deployment, deployed.iter().map(|(_, of, _)| of.name(db)));
            let kind = FactKind::UnresolvedDeployment { name: deployment.as_str().into(), near };
            found.push(Fact::new(location_of_key(file, &section.span), kind));
            continue;
        }
        for Acceptance { instance, span, .. } in &section.accepted {
            if flats.iter().all(|flat| flat.instance(instance).is_none()) {
                let near = similar(instance, flats.iter().flat_map(|it| &it.instances).map(|it| &it.name));
                let (deployment, instance) = (deployment.as_str().into(), instance.as_str().into());
                let kind = FactKind::NotInDeployment { deployment, instance, near };
                found.push(Fact::new(location_of_key(file, span), kind));
            }
        }
    }
    found
}

fn location_of_key<'db>(file: File, span: &Range<usize>) -> Location<'db> {
    Location::Range(file, span.start as u32, span.end as u32)
}

/// A deployment of a project, with its flattened architecture.
type DeployedArchitecture<'db> = (Project<'db>, Decl<'db>, &'db Flat<'db>);

/// Returns all deployments; `None` if one is incomplete.
fn deployed<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Option<Vec<DeployedArchitecture<'db>>> {
    let mut found = Vec::new();
    for &root in all_roots(db, workspace) {
        let project = Project::new(db, workspace, root);
        let names = names_of(db, project);
        if names.may_miss_names() || names.incomplete_file.is_some() {
            return None;
        }
        for deployment in names.of_kind(db, Kind::Deployment) {
            let flat = flat_of(db, project, target_of(db, project, deployment)?);
            if !flat.refusals.is_empty() || flat.cycle {
                return None;
            }
            found.push((project, deployment, flat));
        }
    }
    Some(found)
}

/// Returns the start of `value` within the quotes of a string; `None` if the string is not written literally.
fn start_of(text: &str, span: &Range<usize>, value: &str) -> Option<usize> {
    let inner = text.get(span.start + 1..span.end.checked_sub(1)?)?;
    (inner == value).then_some(span.start + 1)
}
