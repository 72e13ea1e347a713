//! An architecture with all that it imports, and what is wrong with the names in it.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::Refusal;
use crate::diagnostics::{self, Diagnostic};
use crate::item_tree::{Endpoint, FeatureKind, Instance, Kind, Name};
use crate::names::{FeatureOf, Features, features_of, names_of, similar};
use crate::project::Project;
use crate::psm::shell_of;
use crate::settings::deployed;
use crate::size::too_large;
use crate::source::{Decl, Place, architecture, deployment};
use crate::values::whole_number;

/// An architecture with what it imports.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Flat<'db> {
    /// The instances, those of imported architectures first.
    pub instances: Vec<FlatInstance<'db>>,
    /// The connections between ports and between operations, those whose ends are complete.
    pub links: Vec<Link<'db>>,
    /// The properties and constants that get a value: instance and feature.
    pub settings: Vec<(Name, Name)>,
    /// The architecture itself and all that it imports.
    pub architectures: Vec<Decl<'db>>,
    /// The number of the first instance of each name.
    by_name: FxHashMap<Name, usize>,
    /// Can an instance have been lost? Why.
    pub lost: Vec<Refusal<'db>>,
    /// Can a connection have been lost, or an end of one?
    pub links_lost: bool,
    /// Does it import itself, over others or directly?
    pub cycle: bool,
}

impl<'db> Flat<'db> {
    /// The instance of that name, the first where there are several.
    pub fn instance(&self, name: &str) -> Option<&FlatInstance<'db>> {
        self.by_name.get(name).and_then(|&index| self.instances.get(index))
    }

    /// The features of that instance; none where its shell is not known.
    pub(crate) fn features(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        instance: &str,
    ) -> Option<&'db Features<'db>> {
        let shell = shell_of(db, project, self.instance(instance)?.component?)?;
        Some(features_of(db, project, shell))
    }
}

/// A connection.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Link<'db> {
    /// Is it between operations, and not between ports?
    pub operation: bool,
    /// From where: instance and feature.
    pub source: (Name, Name),
    /// To where.
    pub target: (Name, Name),
    /// How many values its circular buffer holds; none where it holds the last one.
    pub buffer: Option<u32>,
    /// Where the feature that it leads to stands.
    pub at: Place<'db>,
}

/// An instance of a component.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct FlatInstance<'db> {
    /// Its name.
    pub name: Name,
    /// The architecture that declares it, and its number there.
    pub declared: (Decl<'db>, usize),
    /// Its component, where that is known.
    pub component: Option<Decl<'db>>,
    /// Does another one have the same name? That is reported where it stands.
    pub repeated: bool,
}

/// The instances and operations of an architecture and of all that it imports.
#[salsa::tracked(returns(ref))]
pub fn flat_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Flat<'db> {
    let names = names_of(db, project);
    let mut flat = Flat::default();
    if let Some(at) = too_large(db, project) {
        flat.lost.push(Refusal::reported("the project is too large", Place::name_of(at)));
        return flat;
    }
    let mut all = vec![of];
    let mut seen: FxHashSet<Decl<'db>> = all.iter().copied().collect();
    let mut next = 0;
    while let Some(&current) = all.get(next) {
        next += 1;
        let Some(data) = architecture(db, current) else { continue };
        let name = current.name(db);
        if !data.whole {
            let why = format!("architecture {name} has a syntax error: an instance may be missing in it");
            flat.lost.push(Refusal::reported(why, Place::name_of(current)));
        }
        for import in data.imports.iter().flatten() {
            match names.resolve_type(db, current, Kind::Architecture, Some(import)) {
                Ok(import) if import == of => flat.cycle = true,
                Ok(import) => {
                    if seen.insert(import) {
                        all.push(import);
                    }
                }
                Err(_) => {
                    let why = format!("architecture {name} imports `{import}`, which is unknown");
                    flat.lost.push(Refusal::reported(why, Place::Part(current, import.part)));
                }
            }
        }
        flat.links_lost |= !data.connections_whole;
        for (operation, links) in [(false, &data.connections), (true, &data.operations)] {
            for link in links {
                let [source, target] = [&link.source, &link.target].map(|end| {
                    let end = end.as_ref()?;
                    let feature = end.feature.as_ref()?;
                    Some(((end.instance.name.clone(), feature.name.clone()), feature.part))
                });
                match source.zip(target) {
                    Some(((source, _), (target, part))) => {
                        let buffer = link.buffer.as_ref().and_then(|(size, _)| whole_number(size));
                        let buffer = buffer.and_then(|size| u32::try_from(size).ok());
                        let at = Place::Part(current, part);
                        flat.links.push(Link { operation, source, target, buffer, at });
                    }
                    None => flat.links_lost = true,
                }
            }
        }
        let set = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
        flat.settings.extend(
            set.filter_map(|end| Some((end.instance.name.clone(), end.feature.as_ref()?.name.clone()))),
        );
    }
    flat.architectures = all.clone();
    for &current in all.iter().rev() {
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
                None => {
                    flat.by_name.insert(name.name.clone(), flat.instances.len());
                }
            }
            let declared = (current, index);
            flat.instances.push(FlatInstance { name: name.name.clone(), declared, component, repeated });
        }
    }
    flat
}

/// Why a name of an instance or a feature in an architecture means nothing.
pub(crate) fn check_architecture<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Diagnostic<'db>> {
    let Some(data) = architecture(db, of) else { return Vec::new() };
    let names = names_of(db, project);
    let flat = flat_of(db, project, of);
    let mut found = Vec::new();
    for import in data.imports.iter().flatten() {
        match names.resolve_type(db, of, Kind::Architecture, Some(import)) {
            Ok(target) if flat.cycle && reaches(db, project, target, of) => {
                found.push(diagnostics::import_cycle::report(Place::Part(of, import.part), of.name(db)));
            }
            Ok(_) => {}
            Err(unresolved) => {
                found.extend(diagnostics::unresolved_type(
                    db,
                    project,
                    of,
                    Kind::Architecture,
                    Some(import),
                    &unresolved,
                ));
            }
        }
    }
    for instance in &data.instances {
        if let Err(unresolved) = names.resolve_type(db, of, Kind::Component, instance.component.as_ref()) {
            let ty = instance.component.as_ref();
            found.extend(diagnostics::unresolved_type(db, project, of, Kind::Component, ty, &unresolved));
        }
    }
    // An instance of an imported architecture, or an earlier one, has the name already.
    for (index, instance) in data.instances.iter().enumerate().filter(|(_, it)| !it.name.name.is_empty()) {
        let same = flat.instance(&instance.name.name).filter(|first| first.declared != (of, index));
        let first = same.and_then(|same| {
            let (declared, number) = same.declared;
            let first = architecture(db, declared)?.instances.get(number)?;
            Some(Place::Part(declared, first.name.part))
        });
        if let Some(first) = first {
            let at = Place::Part(of, instance.name.part);
            found.push(diagnostics::duplicate_definition::report(at, "instance", &instance.name.name, first));
        }
    }
    if !flat.lost.is_empty() || flat.cycle {
        return found;
    }
    let connections = data.connections.iter().map(|it| (it, "port"));
    for (link, what) in connections.chain(data.operations.iter().map(|it| (it, "operation"))) {
        let ends = [&link.source, &link.target].into_iter().flatten();
        let wrong: Vec<_> =
            ends.filter_map(|end| endpoint(db, project, of, flat, of.name(db), end, what)).collect();
        match (wrong.is_empty(), &link.source, &link.target) {
            (true, Some(source), Some(target)) => {
                found.extend(direction(db, project, of, flat, [source, target], what));
            }
            // The keyword is one mistake, at both ends.
            (false, Some(source), Some(target))
                if [source, target].into_iter().all(|end| {
                    let kind = feature_of(db, project, flat, end).map(|feature| feature.kind);
                    kind.is_some_and(|kind| if what == "port" { kind.is_operation() } else { kind.is_port() })
                }) =>
            {
                found.extend(wrong.into_iter().take(1));
            }
            _ => found.extend(wrong),
        }
    }
    let settings = data.settings.iter().filter_map(|it| it.endpoint.as_ref());
    let what = "property or constant";
    found.extend(settings.filter_map(|end| endpoint(db, project, of, flat, of.name(db), end, what)));
    found
}

/// The feature that the end of a connection names, where all that its shell has is known.
fn feature_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    flat: &Flat<'db>,
    end: &Endpoint,
) -> Option<&'db FeatureOf<'db>> {
    let features = flat.features(db, project, &end.instance.name)?;
    features.get(&end.feature.as_ref()?.name).filter(|_| !features.lost)
}

/// Whether a connection, both ends of which are ports, or operations, goes the right way.
fn direction<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    ends: [&Endpoint; 2],
    what: &str,
) -> Option<Diagnostic<'db>> {
    let [source, target] = ends.map(|end| {
        let found = feature_of(db, project, flat, end)?;
        Some((found.kind, &end.instance, end.feature.as_ref()?))
    });
    diagnostics::connection_direction::report(what, of, source?, target?)
}

/// Why a name of an instance or a feature in the settings of a deployment means nothing.
pub(crate) fn check_settings<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Diagnostic<'db>> {
    let Some(data) = deployment(db, of) else { return Vec::new() };
    let Some((flat, target)) = deployed(db, project, of) else { return Vec::new() };
    let settings = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
    settings
        .filter_map(|end| endpoint(db, project, of, flat, target.name(db), end, "property or constant"))
        .collect()
}

fn endpoint<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    architecture: &str,
    end: &Endpoint,
    what: &str,
) -> Option<Diagnostic<'db>> {
    let name = &end.instance.name;
    let Some(instance) = flat.instance(name) else {
        if name.is_empty() {
            return None;
        }
        let near = similar(name, flat.instances.iter().map(|instance| &instance.name));
        let at = Place::Part(of, end.instance.part);
        return Some(diagnostics::unresolved_instance::report(at, name, architecture, near));
    };
    let feature = end.feature.as_ref()?;
    let shell = shell_of(db, project, instance.component?)?;
    let features = features_of(db, project, shell);
    let fits = |kind: FeatureKind| match what {
        "port" => kind.is_port(),
        "operation" => kind.is_operation(),
        _ => kind.is_value(),
    };
    if features.lost || features.get(&feature.name).is_some_and(|found| fits(found.kind)) {
        return None;
    }
    let at = Place::Part(of, feature.part);
    if let Some(other) = features.get(&feature.name) {
        let of_shell = (other.kind, shell.name(db).as_str());
        return Some(diagnostics::unresolved_feature::another_kind(at, what, &feature.name, name, of_shell));
    }
    let fitting = features.by_name.iter().filter(|(_, found)| found.iter().any(|it| fits(it.kind)));
    let near = similar(&feature.name, fitting.map(|(name, _)| name));
    Some(diagnostics::unresolved_feature::report(at, what, &feature.name, name, shell.name(db), near))
}

fn reaches<'db>(db: &'db dyn ModelDb, project: Project<'db>, from: Decl<'db>, to: Decl<'db>) -> bool {
    let names = names_of(db, project);
    let mut seen: FxHashSet<Decl<'db>> = FxHashSet::from_iter([from]);
    let mut open = vec![from];
    while let Some(current) = open.pop() {
        if current == to {
            return true;
        }
        for import in architecture(db, current).into_iter().flat_map(|data| data.imports.iter().flatten()) {
            if let Ok(import) = names.resolve_type(db, current, Kind::Architecture, Some(import))
                && seen.insert(import)
            {
                open.push(import);
            }
        }
    }
    false
}
