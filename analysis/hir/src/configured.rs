//! Checks of the names in `mauve.toml`: synchronised instances, the names in chains, accepted instances of deployments, and
//! deployments with their own timing tables.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::config::{Acceptance, Chain, Config, DeploymentConfig, DeploymentTables, Required};
use crate::fact::{EndKind, Fact, FactKind};
use crate::features::{Features, core_of};
use crate::flat::{Flat, flat_of, target_of};
use crate::infer::uses_of;
use crate::item_tree::{Core, Kind, Name};
use crate::names::{names_of, similar};
use crate::project::{Project, all_roots, config_file, config_of, roots_exist};
use crate::ros2::check::{facts_of, facts_of_configuration, has_ros2_or_hosts};
use crate::source::{Decl, Location, core};
use crate::{File, ModelDb, Workspace};

/// Returns why, and until which response time, the deadline of an instance needs no proof: `[deployment.NAME] accept`.
pub fn accepted<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    instance: &str,
) -> Option<&'db Acceptance> {
    let mut sections = sections_of(db, project, deployment);
    sections.find_map(|section| section.accepted.iter().find(|it| it.instance == instance))
}

/// Returns how often executions of a deployment may exceed their times: `[deployment.NAME] required`, otherwise `[timing] required`.
pub fn required_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Option<&'db Required> {
    let own = sections_of(db, project, deployment).find_map(|section| section.required.as_ref());
    own.or(config_of(db, project.workspace(db)).required.as_ref())
}

/// Returns the sections `[deployment.NAME]` of a deployment.
fn sections_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> impl Iterator<Item = &'db DeploymentConfig> {
    let deployments = &config_of(db, project.workspace(db)).deployments;
    let qualified = deployment.qualified(db);
    let of_name = deployments.iter().filter(move |it| *deployment.name(db) == *it.name);
    of_name.chain(deployments.iter().filter(move |it| it.name == qualified))
}

/// Returns the name of the section `[timing.deployment.NAME]` with the timing tables of a deployment: the qualified name of the
/// deployment, otherwise its name; `None` if it uses those of `[timing] tables`.
pub fn section_with_tables<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Option<&'db str> {
    let sections = &config_of(db, project.workspace(db)).deployment_tables;
    let of = |name: &str| sections.iter().map(|it| it.name.as_str()).find(|it| *it == name);
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
        || config.on_clocks().next().is_none()
            && config.chains.is_empty()
            && config.deployments.is_empty()
            && config.deployment_tables.is_empty()
            && !has_ros2_or_hosts(db, workspace)
            && config.links.is_empty()
    {
        return Vec::new();
    }
    let Some(file) = config_file(db, workspace) else { return Vec::new() };
    let Some(deployed) = deployed(db, workspace) else { return Vec::new() };
    let Some(&(any, ..)) = deployed.first() else { return Vec::new() };
    let mut found = Vec::new();
    let checker = NameChecker { db, file, deployed: &deployed, any };
    for (_, (value, span)) in config.on_clocks() {
        found.extend(checker.instance(value, (value, span)));
    }
    for Chain { from, to, through, states, answers, .. } in &config.chains {
        for (value, span) in from.iter().chain(to).chain(answers) {
            found.extend(checker.end((value, span)));
        }
        found.extend(through.iter().filter_map(|(value, span)| checker.port((value, span))));
        found.extend(states.iter().filter_map(|(value, span)| checker.state((value, span))));
    }
    let accepted = check_acceptances(db, file, &config.deployments, &deployed);
    found.extend(accepted.into_iter().map(|fact| (any, fact)));
    found.extend(check_tables(db, file, config, &deployed));
    let topics = config.ros2.iter().flat_map(|it| &it.topics).map(|it| &it.port);
    for (value, span) in topics.filter(|(key, _)| key.contains('.')) {
        found.extend(checker.port((value, span)));
    }
    for (value, span) in config.hosts.iter().flat_map(|it| &it.activities) {
        found.extend(checker.instance(value, (value, span)));
    }
    found.extend(facts_of_configuration(db, workspace).into_iter().map(|fact| (any, fact)));
    for (project, deployment, _) in &deployed {
        for fact in facts_of(db, *project, *deployment) {
            if matches!(fact.at, Location::Range(..)) && found.iter().all(|(_, it)| it != fact) {
                found.push((*project, fact.clone()));
            }
        }
    }
    found
}

/// Checks the names in strings of `mauve.toml`.
struct NameChecker<'a, 'db> {
    db: &'db dyn ModelDb,
    file: File,
    deployed: &'a [DeployedArchitecture<'db>],
    any: Project<'db>,
}

type FactOf<'db> = (Project<'db>, Fact<'db>);
type WrittenName<'a> = (&'a str, &'a Range<usize>);

impl<'db> NameChecker<'_, 'db> {
    /// Returns the location of the part `name` at `offset` of a string. If the string has escapes, that is the entire string, and
    /// there is no fix.
    fn at(&self, (value, span): WrittenName<'_>, offset: usize, name: &str) -> (Location<'db>, bool) {
        let Range { start, end } = match start_of(self.file.text(self.db), span, value) {
            Some(start) => start + offset..start + offset + name.len(),
            None => return (Location::of_span(self.file, span), false),
        };
        (Location::Range(self.file, start as u32, end as u32), true)
    }

    fn having<'a>(&'a self, instance: &'a str) -> impl Iterator<Item = &'a DeployedArchitecture<'db>> {
        self.deployed.iter().filter(move |(.., flat)| flat.instance(instance).is_some())
    }

    fn instances(&self) -> impl Iterator<Item = &Name> {
        self.deployed.iter().flat_map(|(.., flat)| &flat.instances).map(|it| &it.name)
    }

    /// Checks the instance at the beginning of a string.
    fn instance(&self, instance: &str, written: WrittenName<'_>) -> Option<FactOf<'db>> {
        if self.having(instance).next().is_some() {
            return None;
        }
        let (at, is_literal) = self.at(written, 0, instance);
        let near = similar(instance, self.instances()).filter(|_| is_literal);
        Some((self.any, Fact::new(at, FactKind::NotDeployed { instance: instance.into(), near })))
    }

    /// Checks an instance, or `instance.port`.
    fn port(&self, written: WrittenName<'_>) -> Option<FactOf<'db>> {
        let Some((instance, port)) = written.0.split_once('.') else {
            return self.instance(written.0, written);
        };
        if let Some(found) = self.instance(instance, written) {
            return Some(found);
        }
        let db = self.db;
        let features = self.having(instance).map(|(project, _, flat)| {
            Some((*project, flat, flat.instance(instance)?.features(db, *project)?))
        });
        // An unresolved shell may have the port.
        let features: Vec<_> = features.collect::<Option<_>>()?;
        let may_have = |it: &Features<'_>| {
            let is_unknown = it.completeness.is_incomplete() || it.value_completeness.is_incomplete();
            is_unknown || it.cycle || it.get(port).is_some_and(|it| it.kind.is_port())
        };
        if features.iter().any(|(_, _, it)| may_have(it)) {
            return None;
        }
        let (project, flat, features) = features.first()?;
        let shell = flat.instance(instance).and_then(|it| it.shell(db, *project));
        let shell = shell.map_or_else(Name::default, |shell| shell.name(db).clone());
        let (at, is_literal) = self.at(written, instance.len() + 1, port);
        let is_port = |name: &&Name| features.get(name).is_some_and(|feature| feature.kind.is_port());
        let near = similar(port, features.by_name.keys().filter(is_port)).filter(|_| is_literal);
        let (expected, name, instance) = (EndKind::Port, port.into(), instance.into());
        let kind = FactKind::UnresolvedFeature { expected, name, instance, shell, near };
        Some((*project, Fact::new(at, kind)))
    }

    /// Checks a codel, or what [`NameChecker::port`] does.
    fn end(&self, written: WrittenName<'_>) -> Option<FactOf<'db>> {
        let (db, value) = (self.db, written.0);
        let mut names = self.deployed.iter().map(|(project, ..)| names_of(db, *project));
        if names.any(|names| !names.by_key(Kind::Codel, value).is_empty()) {
            return None;
        }
        let (first, rest) = value.split_once('.').unwrap_or((value, ""));
        if self.having(first).next().is_some() {
            // `instance.codel`
            let is_called = |(project, _, flat): &DeployedArchitecture<'db>| {
                let core = flat.instance(first)?.component.and_then(|it| core_of(db, *project, it))?;
                Some(uses_of(db, *project, core).codels.iter().any(|it| it.is_called(db, rest)))
            };
            let is_codel = self.having(first).any(|it| is_called(it) == Some(true));
            return if is_codel { None } else { self.port(written) };
        }
        let codels =
            self.deployed.iter().flat_map(|(project, ..)| names_of(db, *project).of_kind(db, Kind::Codel));
        let codels = codels.flat_map(|it| [it.name(db).clone(), it.qualified(db).into()]);
        let known: Vec<Name> = self.instances().cloned().chain(codels).collect();
        let (at, is_literal) = self.at(written, 0, value);
        let near = similar(value, &known);
        if near.is_none() && value.contains('.') {
            return self.port(written);
        }
        let near = near.filter(|_| is_literal);
        Some((self.any, Fact::new(at, FactKind::UnresolvedEnd { name: value.into(), near })))
    }

    /// Checks `instance.State`.
    fn state(&self, written: WrittenName<'_>) -> Option<FactOf<'db>> {
        let (instance, state) = written.0.split_once('.')?;
        if let Some(found) = self.instance(instance, written) {
            return Some(found);
        }
        let cores = self.having(instance).map(|(project, _, flat)| {
            let of = core_of(self.db, *project, flat.instance(instance)?.component?)?;
            let is_known = |it: &&Core| {
                it.completeness.is_complete() && it.machines.iter().all(|it| it.completeness.is_complete())
            };
            Some((*project, core(self.db, of).filter(is_known)?))
        });
        // An unknown core may have the state.
        let cores: Vec<_> = cores.collect::<Option<_>>()?;
        if cores.iter().any(|(_, core)| core.state(state).is_some()) {
            return None;
        }
        let (project, core) = cores.first()?;
        let (at, is_literal) = self.at(written, instance.len() + 1, state);
        let near = similar(state, core.states().map(|it| &it.name.name)).filter(|_| is_literal);
        let kind = FactKind::UnresolvedState { name: state.into(), instance: Some(instance.into()), near };
        Some((*project, Fact::new(at, kind)))
    }
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
    for DeploymentTables { name, span, .. } in &config.deployment_tables {
        let at = Location::of_span(file, span);
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
    sections: &[DeploymentConfig],
    deployed: &[DeployedArchitecture<'db>],
) -> Vec<Fact<'db>> {
    let mut found = Vec::new();
    for DeploymentConfig { name: deployment, span, accepted, .. } in sections {
        let flats = deployed.iter().filter(|(_, of, _)| of.is_called(db, deployment));
        let flats: Vec<_> = flats.map(|(.., flat)| flat).collect();
        if flats.is_empty() {
            let near = similar(deployment, deployed.iter().map(|(_, of, _)| of.name(db)));
            let kind = FactKind::UnresolvedDeployment { name: deployment.as_str().into(), near };
            found.push(Fact::new(Location::of_span(file, span), kind));
            continue;
        }
        for Acceptance { instance, span, .. } in accepted {
            if flats.iter().all(|flat| flat.instance(instance).is_none()) {
                let near = similar(instance, flats.iter().flat_map(|it| &it.instances).map(|it| &it.name));
                let (deployment, instance) = (deployment.as_str().into(), instance.as_str().into());
                let kind = FactKind::NotInDeployment { deployment, instance, near };
                found.push(Fact::new(Location::of_span(file, span), kind));
            }
        }
    }
    found
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
