//! Architectures flattened with their imports, and the checks of the names in them.

use crate::link::Link;
use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::fact::{Checker, Defined, EndKind, Fact, FactKind, ModelReason, ModelRefusal};
use crate::features::{FeatureOf, Features, Implementation, implementation_of};
use crate::graph::closure;
use crate::item_tree::{Connection, Endpoint, FeatureKind, Instance, Kind, Name, NameRef, Setting};
use crate::names::{resolve_type, similar};
use crate::project::Project;
use crate::size::too_large;
use crate::source::{Decl, Location, architecture, deployment_interface};
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
    pub refusals: Vec<ModelRefusal<'db>>,
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

    pub(crate) fn feature(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        (instance, name): &(Name, Name),
    ) -> Option<&'db FeatureOf<'db>> {
        self.instance(instance)?.features(db, project)?.get(name)
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
    /// The flattened architecture, and its index there.
    flattened: (Decl<'db>, usize),
}

impl<'db> FlatInstance<'db> {
    /// Returns what is known of its component, if that resolves.
    pub fn implementation(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
    ) -> Option<&'db Implementation<'db>> {
        let (of, index) = self.flattened;
        implementations_in(db, project, of).get(index)?.as_ref()
    }

    /// Returns its shell, if that resolves. If its core is for another shell, its shell is unknown.
    pub fn shell(&self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<Decl<'db>> {
        let (shell, _) = self.implementation(db, project)?.shell.as_ref()?;
        Some(*shell)
    }

    /// Returns its features, if its shell resolves.
    pub fn features(&self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<&'db Features<'db>> {
        let (_, features) = self.implementation(db, project)?.shell.as_ref()?;
        Some(features)
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
    let mut flat = Flat::default();
    if let Some(at) = too_large(db, project) {
        flat.refusals.push(ModelRefusal { reason: ModelReason::TooLarge, at: Location::name_of(at) });
        return flat;
    }
    flat.architectures = closure([of], |it| imports_of(db, project, it));
    for &current in &flat.architectures {
        let Some(data) = architecture(db, current) else { continue };
        if data.completeness.is_incomplete() {
            let reason = ModelReason::SyntaxErrorIn(current);
            flat.refusals.push(ModelRefusal { reason, at: Location::name_of(current) });
        }
        for import in data.imports.iter().flatten() {
            match resolve_type(db, project, current, Kind::Architecture, Some(import)) {
                Ok(import) => flat.cycle |= import == of,
                Err(_) => {
                    let reason = ModelReason::UnknownImport { architecture: current, import: import.clone() };
                    flat.refusals.push(ModelRefusal { reason, at: Location::Source(current, import.id) });
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
            let component = resolve_type(db, project, current, Kind::Component, component.as_ref()).ok();
            let earlier = flat.by_name.get(&name.name).and_then(|&earlier| flat.instances.get_mut(earlier));
            let repeated = earlier.is_some();
            match earlier {
                Some(earlier) => earlier.repeated = true,
                None => _ = flat.by_name.insert(name.name.clone(), flat.instances.len()),
            }
            let declared = (current, index);
            let flattened = (of, flat.instances.len());
            let name = name.name.clone();
            flat.instances.push(FlatInstance { name, declared, component, repeated, flattened });
        }
    }
    flat
}

/// Returns the implementations of the instances of an architecture, in the order of [`Flat::instances`]. The queries about the
/// architecture depend on this one instead of on several for each instance.
#[salsa::tracked(returns(ref))]
fn implementations_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Option<Implementation<'db>>> {
    let instances = flat_of(db, project, of).instances.iter();
    instances.map(|it| Some(implementation_of(db, project, it.component?).clone())).collect()
}

impl<'db> Checker<'db> {
    /// Checks the names in an architecture: of imports, components, instances and features.
    pub(crate) fn names_in_architecture(&mut self) {
        let (db, project, of) = (self.db, self.project, self.of);
        let Some(data) = architecture(db, of) else { return };
        let flat = flat_of(db, project, of);
        for import in data.imports.iter().flatten() {
            let target = self.resolve_or_report(Kind::Architecture, Some(import)).filter(|_| flat.cycle);
            if target.is_some_and(|target| closure([target], |it| imports_of(db, project, it)).contains(&of))
            {
                let architecture = of.name(db).clone();
                self.report(import.id, FactKind::ImportCycle { architecture });
            }
        }
        for instance in &data.instances {
            self.resolve_or_report(Kind::Component, instance.component.as_ref());
        }
        // An instance of an imported architecture, or an earlier one, has the same name.
        for (index, Instance { name: NameRef { name, id }, .. }) in data.instances.iter().enumerate() {
            let same = flat.instance(name).filter(|first| first.declared != (of, index));
            if let Some(first) = same.and_then(|same| same.declaration(db)) {
                let (what, name) = (Defined::Instance, name.clone());
                self.report(*id, FactKind::DuplicateDefinition { what, name, first });
            }
        }
        if !flat.refusals.is_empty() || flat.cycle {
            return;
        }
        let connections = data.connections.iter().map(|it| (it, EndKind::Port));
        for (link, kind) in connections.chain(data.operations.iter().map(|it| (it, EndKind::Operation))) {
            self.names_in_connection(flat, link, kind);
        }
        self.names_in_settings(flat, of, &data.settings);
    }

    fn names_in_connection(&mut self, flat: &Flat<'db>, link: &Connection, kind: EndKind) {
        let before = self.found.len();
        for end in [&link.source, &link.target].into_iter().flatten() {
            self.endpoint(flat, self.of, end, kind);
        }
        let (Some(source), Some(target)) = (&link.source, &link.target) else { return };
        let [from, to] = [source, target].map(|end| self.feature_at(flat, end));
        if self.found.len() == before {
            if let (Some(from), Some(to)) = (from, to) {
                self.direction([(source, from), (target, to)], kind);
            }
            return;
        }
        // A wrong keyword is reported once, not at both endpoints.
        let other = if kind == EndKind::Port { EndKind::Operation } else { EndKind::Port };
        if [from, to].into_iter().all(|found| found.is_some_and(|found| other.takes(found))) {
            self.found.truncate(before + 1);
        }
    }

    /// Returns the kind of the feature at an endpoint, if it resolves and its shell is complete.
    fn feature_at(&self, flat: &Flat<'db>, end: &Endpoint) -> Option<FeatureKind> {
        let features = flat.instance(&end.instance.name)?.features(self.db, self.project)?;
        let found = features.get(&end.feature.as_ref()?.name)?;
        features.completeness.is_complete().then_some(found.kind)
    }

    /// Checks the direction of a connection whose endpoints are both ports or both operations.
    fn direction(&mut self, ends: [(&Endpoint, FeatureKind); 2], kind: EndKind) {
        let [(source, from), (target, to)] = ends;
        let starts = matches!(from, FeatureKind::Output | FeatureKind::Provided);
        let ends = matches!(to, FeatureKind::Input | FeatureKind::Required);
        let names = |end: &Endpoint| Some([end.instance.clone(), end.feature.clone()?]);
        let (Some(source), Some(target)) = (names(source), names(target)) else { return };
        if !starts && !ends {
            return self.report(source[1].id, FactKind::SwappedEnds { kind, source, target });
        }
        let [instance, feature] = match (starts, ends) {
            (false, _) => source,
            (_, false) => target,
            _ => return,
        };
        let (instance, name) = (instance.name, feature.name);
        self.report(feature.id, FactKind::WrongEnd { kind, is_source: !starts, instance, name });
    }

    /// Checks the names in the settings of a deployment: of instances and features.
    pub(crate) fn names_in_deployment(&mut self) {
        let Some(data) = deployment_interface(self.db, self.of) else { return };
        if let Some((flat, target)) = deployed(self.db, self.project, self.of) {
            self.names_in_settings(flat, target, &data.settings);
        }
    }

    fn names_in_settings(&mut self, flat: &Flat<'db>, target: Decl<'db>, settings: &[Setting]) {
        for end in settings.iter().filter_map(|setting| setting.endpoint.as_ref()) {
            self.endpoint(flat, target, end, EndKind::Value);
        }
    }

    /// Checks the names in an endpoint: of an instance of `target`, and of a feature of this kind.
    fn endpoint(&mut self, flat: &Flat<'db>, target: Decl<'db>, end: &Endpoint, kind: EndKind) {
        let (db, project, name) = (self.db, self.project, end.instance.name.clone());
        let Some(instance) = flat.instance(&name) else {
            if !name.is_empty() {
                let near = similar(&name, flat.instances.iter().map(|instance| &instance.name));
                let architecture = target.name(db).clone();
                self.report(end.instance.id, FactKind::UnresolvedInstance { name, architecture, near });
            }
            return;
        };
        let Some(NameRef { name: feature, id }) = &end.feature else { return };
        let implementation = instance.implementation(db, project);
        let Some((shell, features)) = implementation.and_then(|it| it.shell.as_ref()) else { return };
        let found = features.get(feature).map(|it| it.kind);
        if features.completeness.is_incomplete() || found.is_some_and(|found| kind.takes(found)) {
            return;
        }
        let (expected, instance, name, shell) = (kind, name, feature.clone(), shell.name(db).clone());
        if let Some(found) = found {
            return self.report(*id, FactKind::OtherFeature { expected, name, instance, found, shell });
        }
        let fitting = features.by_name.iter().filter(|(_, found)| found.iter().any(|it| kind.takes(it.kind)));
        let near = similar(&name, fitting.map(|(name, _)| name));
        let kind = FactKind::UnresolvedFeature { expected, name, instance, shell, near };
        // A port or property without a name may be this one.
        let is_follow_up = expected != EndKind::Operation && features.value_completeness.is_incomplete();
        self.found.push(Fact { is_follow_up, ..Fact::new(self.at(*id), kind) });
    }
}

/// Returns the direct imports of an architecture that resolve.
pub(crate) fn imports_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> impl Iterator<Item = Decl<'db>> {
    let imports = architecture(db, of).into_iter().flat_map(|data| data.imports.iter().flatten());
    let resolve = move |it| resolve_type(db, project, of, Kind::Architecture, Some(it)).ok();
    imports.filter_map(resolve)
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
    if deployment_interface(db, of)?.targets.len() == 1 { first_target_of(db, project, of) } else { None }
}

/// Returns the first architecture of a deployment, if it resolves.
pub fn first_target_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    let target = deployment_interface(db, of)?.targets.first();
    resolve_type(db, project, of, Kind::Architecture, target).ok()
}
