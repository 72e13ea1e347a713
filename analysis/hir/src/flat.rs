//! Architectures flattened with their imports, and the checks of the names in them.

use crate::link::Link;
use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::fact::{Defined, EndKind, Fact, FactKind, Reason, Refusal, unresolved_type};
use crate::features::{FeatureOf, Features, features_of, shell_of};
use crate::graph::closure;
use crate::item_tree::{Endpoint, FeatureKind, Instance, Kind, Name};
use crate::names::{names_of, similar};
use crate::project::Project;
use crate::size::too_large;
use crate::source::{Decl, Location, architecture, deployment};
use crate::values::whole_number;

/// An architecture with its direct and indirect imports.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Flat<'db> {
    /// The instances, those of imported architectures first.
    pub instances: Vec<FlatInstance<'db>>,
    /// The connections between ports and between operations, without incomplete ones.
    pub links: Vec<Link<'db>>,
    /// The properties and constants that are set: instance and feature.
    pub settings: Vec<(Name, Name)>,
    /// The architecture itself and its direct and indirect imports.
    pub architectures: Vec<Decl<'db>>,
    /// The index of the first instance of each name.
    by_name: FxHashMap<Name, usize>,
    /// Why an instance may be unknown.
    pub refusals: Vec<Refusal<'db>>,
    /// Whether all connections are known, with their endpoints.
    pub link_completeness: Completeness,
    /// Whether it imports itself, directly or indirectly.
    pub cycle: bool,
}

impl<'db> Flat<'db> {
    /// Returns the first instance of that name.
    pub fn instance(&self, name: &str) -> Option<&FlatInstance<'db>> {
        self.by_name.get(name).and_then(|&index| self.instances.get(index))
    }

    /// Returns the shell of that instance, if it resolves.
    pub(crate) fn shell(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        instance: &str,
    ) -> Option<Decl<'db>> {
        shell_of(db, project, self.instance(instance)?.component?)
    }

    /// Returns the features of that instance, if its shell resolves.
    pub(crate) fn features(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        instance: &str,
    ) -> Option<&'db Features<'db>> {
        self.instance(instance)?.features(db, project)
    }

    /// Returns the feature of an instance, if it resolves.
    pub(crate) fn feature(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        (instance, name): &(Name, Name),
    ) -> Option<&'db FeatureOf<'db>> {
        self.features(db, project, instance)?.get(name)
    }
}

/// An instance of a component.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct FlatInstance<'db> {
    /// Its name.
    pub name: Name,
    /// The architecture that declares it, and its index there.
    pub declared: (Decl<'db>, usize),
    /// Its component, if it resolves.
    pub component: Option<Decl<'db>>,
    /// Whether another instance has the same name; another fact reports that.
    pub repeated: bool,
}

impl<'db> FlatInstance<'db> {
    /// Returns its features, if its shell resolves.
    pub fn features(&self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<&'db Features<'db>> {
        Some(features_of(db, project, shell_of(db, project, self.component?)?))
    }

    /// Returns the location of its name.
    pub fn declaration(&self, db: &'db dyn ModelDb) -> Option<Location<'db>> {
        let (of, index) = self.declared;
        Some(Location::Source(of, architecture(db, of)?.instances.get(index)?.name.id))
    }
}

/// Flattens an architecture.
#[salsa::tracked(returns(ref))]
pub fn flat_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Flat<'db> {
    let names = names_of(db, project);
    let mut flat = Flat::default();
    if let Some(at) = too_large(db, project) {
        flat.refusals.push(Refusal { reason: Reason::TooLarge, at: Location::name_of(at) });
        return flat;
    }
    flat.architectures = closure(of, |it| imports_of(db, project, it));
    for &current in &flat.architectures {
        let Some(data) = architecture(db, current) else { continue };
        if data.completeness.is_incomplete() {
            let reason = Reason::SyntaxErrorIn(current);
            flat.refusals.push(Refusal { reason, at: Location::name_of(current) });
        }
        for import in data.imports.iter().flatten() {
            match names.resolve_type(db, current, Kind::Architecture, Some(import)) {
                Ok(import) => flat.cycle |= import == of,
                Err(_) => {
                    let reason = Reason::UnknownImport { architecture: current, import: import.clone() };
                    flat.refusals.push(Refusal { reason, at: Location::Source(current, import.id) });
                }
            }
        }
        flat.link_completeness &= data.connection_completeness;
        for (operation, links) in [(false, &data.connections), (true, &data.operations)] {
            for link in links {
                let [source, target] = [&link.source, &link.target].map(|end| end.as_ref()?.names());
                let feature = link.target.as_ref().and_then(|end| end.feature.as_ref());
                let (Some(source), Some(target), Some(feature)) = (source, target, feature) else {
                    flat.link_completeness = Completeness::Incomplete;
                    continue;
                };
                let buffer = link.buffer.as_ref().and_then(|(size, _)| whole_number(size));
                let buffer = buffer.and_then(|size| u32::try_from(size).ok());
                let at = Location::Source(current, feature.id);
                flat.links.push(Link { operation, source, target, buffer, at });
            }
        }
        let set = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
        flat.settings.extend(set.filter_map(Endpoint::names));
    }
    // Instances of imported architectures come first.
    for &current in flat.architectures.iter().rev() {
        let Some(data) = architecture(db, current) else { continue };
        for (index, Instance { name, component }) in data.instances.iter().enumerate() {
            if name.name.is_empty() {
                continue;
            }
            let component = names.resolve_type(db, current, Kind::Component, component.as_ref()).ok();
            let earlier = flat.by_name.get(&name.name).and_then(|&earlier| flat.instances.get_mut(earlier));
            let repeated = earlier.is_some();
            match earlier {
                Some(earlier) => earlier.repeated = true,
                None => _ = flat.by_name.insert(name.name.clone(), flat.instances.len()),
            }
            let declared = (current, index);
            flat.instances.push(FlatInstance { name: name.name.clone(), declared, component, repeated });
        }
    }
    flat
}

/// Returns the errors in the names in an architecture: of imports, components, instances and features.
pub(crate) fn check_architecture<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let Some(data) = architecture(db, of) else { return Vec::new() };
    let names = names_of(db, project);
    let flat = flat_of(db, project, of);
    let mut found = Vec::new();
    for import in data.imports.iter().flatten() {
        match names.resolve_type(db, of, Kind::Architecture, Some(import)) {
            Ok(target) if flat.cycle && closure(target, |it| imports_of(db, project, it)).contains(&of) => {
                let kind = FactKind::ImportCycle { architecture: of.name(db).clone() };
                found.push(Fact::new(Location::Source(of, import.id), kind));
            }
            Ok(_) => {}
            Err(unresolved) => {
                found.extend(unresolved_type(of, Kind::Architecture, Some(import), &unresolved));
            }
        }
    }
    for instance in &data.instances {
        if let Err(unresolved) = names.resolve_type(db, of, Kind::Component, instance.component.as_ref()) {
            found.extend(unresolved_type(of, Kind::Component, instance.component.as_ref(), &unresolved));
        }
    }
    // An instance of an imported architecture, or an earlier one, has the same name.
    for (index, instance) in data.instances.iter().enumerate().filter(|(_, it)| !it.name.name.is_empty()) {
        let same = flat.instance(&instance.name.name).filter(|first| first.declared != (of, index));
        if let Some(first) = same.and_then(|same| same.declaration(db)) {
            let (what, name) = (Defined::Instance, instance.name.name.clone());
            let kind = FactKind::DuplicateDefinition { what, name, first };
            found.push(Fact::new(Location::Source(of, instance.name.id), kind));
        }
    }
    if !flat.refusals.is_empty() || flat.cycle {
        return found;
    }
    let connections = data.connections.iter().map(|it| (it, EndKind::Port));
    for (link, kind) in connections.chain(data.operations.iter().map(|it| (it, EndKind::Operation))) {
        let ends = [&link.source, &link.target].into_iter().flatten();
        let errors: Vec<_> =
            ends.filter_map(|end| endpoint(db, project, of, flat, of.name(db), end, kind)).collect();
        match (errors.is_empty(), &link.source, &link.target) {
            (true, Some(source), Some(target)) => {
                found.extend(direction(db, project, of, flat, [source, target], kind));
            }
            // A wrong keyword is reported once, not at both endpoints.
            (false, Some(source), Some(target))
                if [source, target].into_iter().all(|end| {
                    let found = feature_of(db, project, flat, end).map(|feature| feature.kind);
                    let other = if kind == EndKind::Port { EndKind::Operation } else { EndKind::Port };
                    found.is_some_and(|found| other.takes(found))
                }) =>
            {
                found.extend(errors.into_iter().take(1));
            }
            _ => found.extend(errors),
        }
    }
    let settings = data.settings.iter().filter_map(|it| it.endpoint.as_ref());
    let kind = EndKind::Value;
    found.extend(settings.filter_map(|end| endpoint(db, project, of, flat, of.name(db), end, kind)));
    found
}

/// Returns the direct imports of an architecture that resolve.
pub(crate) fn imports_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> impl Iterator<Item = Decl<'db>> {
    let imports = architecture(db, of).into_iter().flat_map(|data| data.imports.iter().flatten());
    let resolve = move |it| names_of(db, project).resolve_type(db, of, Kind::Architecture, Some(it)).ok();
    imports.filter_map(resolve)
}

/// Returns the feature at an endpoint, if it resolves and its shell is complete.
fn feature_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    flat: &Flat<'db>,
    end: &Endpoint,
) -> Option<&'db FeatureOf<'db>> {
    let features = flat.features(db, project, &end.instance.name)?;
    features.get(&end.feature.as_ref()?.name).filter(|_| features.completeness.is_complete())
}

/// Checks the direction of a connection whose endpoints are both ports or both operations.
fn direction<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    ends: [&Endpoint; 2],
    kind: EndKind,
) -> Option<Fact<'db>> {
    let [source, target] = ends.map(|end| {
        let found = feature_of(db, project, flat, end)?;
        Some((found.kind, [end.instance.clone(), end.feature.clone()?]))
    });
    let ((from, source), (to, target)) = (source?, target?);
    let starts = matches!(from, FeatureKind::Output | FeatureKind::Provided);
    let ends = matches!(to, FeatureKind::Input | FeatureKind::Required);
    if !starts && !ends {
        let at = Location::Source(of, source[1].id);
        return Some(Fact::new(at, FactKind::SwappedEnds { kind, source, target }));
    }
    let [instance, feature] = match (starts, ends) {
        (false, _) => source,
        (_, false) => target,
        _ => return None,
    };
    let at = Location::Source(of, feature.id);
    let (instance, name) = (instance.name, feature.name);
    Some(Fact::new(at, FactKind::WrongEnd { kind, is_source: !starts, instance, name }))
}

/// Returns the errors in the names in the settings of a deployment: of instances and features.
pub(crate) fn check_settings<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let Some(data) = deployment(db, of) else { return Vec::new() };
    let Some((flat, target)) = deployed(db, project, of) else { return Vec::new() };
    let settings = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
    settings.filter_map(|end| endpoint(db, project, of, flat, target.name(db), end, EndKind::Value)).collect()
}

fn endpoint<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    architecture: &Name,
    end: &Endpoint,
    kind: EndKind,
) -> Option<Fact<'db>> {
    let name = &end.instance.name;
    let Some(instance) = flat.instance(name) else {
        if name.is_empty() {
            return None;
        }
        let near = similar(name, flat.instances.iter().map(|instance| &instance.name));
        let at = Location::Source(of, end.instance.id);
        let (name, architecture) = (name.clone(), architecture.clone());
        return Some(Fact::new(at, FactKind::UnresolvedInstance { name, architecture, near }));
    };
    let feature = end.feature.as_ref()?;
    let shell = shell_of(db, project, instance.component?)?;
    let features = features_of(db, project, shell);
    if features.completeness.is_incomplete()
        || features.get(&feature.name).is_some_and(|found| kind.takes(found.kind))
    {
        return None;
    }
    let at = Location::Source(of, feature.id);
    let (expected, name, instance) = (kind, feature.name.clone(), name.clone());
    let (found, shell) = (features.get(&name).map(|it| it.kind), shell.name(db).clone());
    if let Some(found) = found {
        return Some(Fact::new(at, FactKind::OtherFeature { expected, name, instance, found, shell }));
    }
    let fitting = features.by_name.iter().filter(|(_, found)| found.iter().any(|it| kind.takes(it.kind)));
    let near = similar(&name, fitting.map(|(name, _)| name));
    Some(Fact::new(at, FactKind::UnresolvedFeature { expected, name, instance, shell, near }))
}

/// Returns the flattened architecture of a deployment; `None` if it is unresolved or incomplete.
pub fn deployed<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<(&'db Flat<'db>, Decl<'db>)> {
    let target = target_of(db, project, of)?;
    let flat = flat_of(db, project, target);
    (flat.refusals.is_empty() && !flat.cycle).then_some((flat, target))
}

/// Returns the architecture of a deployment, if it is the only one and resolves.
#[salsa::tracked(returns(copy))]
pub fn target_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    if deployment(db, of)?.targets.len() == 1 { first_target_of(db, project, of) } else { None }
}

/// Returns the first architecture of a deployment, if it resolves.
pub fn first_target_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    let target = deployment(db, of)?.targets.first();
    names_of(db, project).resolve_type(db, of, Kind::Architecture, target).ok()
}
