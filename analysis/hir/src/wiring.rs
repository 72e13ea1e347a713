//! Checks of connections, and of unset values and unconnected features in deployments.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::fact::{Fact, FactKind};
use crate::flat::{Flat, deployed, flat_of, imports_of};
use crate::infer::signature;
use crate::item_tree::{Connection, Endpoint, Feature, FeatureKind, Name};
use crate::link::Link;
use crate::project::Project;
use crate::source::{Decl, Location, architecture, deployment};
use crate::types::type_of;

/// Returns the errors of the connections of an architecture with valid endpoints.
pub(crate) fn check_architecture<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let Some(data) = architecture(db, of) else { return Vec::new() };
    let flat = flat_of(db, project, of);
    let mut found = Vec::new();
    for connection in &data.connections {
        if let Some((size, id)) = &connection.buffer
            && crate::values::whole_number(size).is_none_or(|size| size < 1)
        {
            let kind = FactKind::BufferSize { size: size.as_str().into() };
            found.push(Fact::new(Location::Source(of, *id), kind));
        }
        let Some(([source, target], at)) = ends(db, project, of, flat, connection) else { continue };
        if (source.data.kind, target.data.kind) != (FeatureKind::Output, FeatureKind::Input) {
            continue;
        }
        let [output, input] =
            [&source, &target].map(|end| type_of(db, project, end.shell, end.data.ty.as_ref()));
        if !output.is(&input) {
            let side = |end: &End<'db>| {
                Location::Source(end.shell, end.data.ty.as_ref().map_or(end.data.name.id, |it| it.id))
            };
            let (from, to) = (side(&source), side(&target));
            let ends = [(source.name, output, from), (target.name, input, to)];
            found.push(Fact::new(at, FactKind::ConnectionType { ends }));
        }
    }
    for connection in &data.operations {
        let Some(([source, target], at)) = ends(db, project, of, flat, connection) else { continue };
        if (source.data.kind, target.data.kind) != (FeatureKind::Provided, FeatureKind::Required) {
            continue;
        }
        let [provided, required] = [&source, &target]
            .map(|end| signature(db, project, end.shell, &end.data.parameters, end.data.ty.as_ref()));
        if !provided.is(&required) {
            let (provided, required) = ((source.feature, provided), (target.feature, required));
            found.push(Fact::new(at, FactKind::OperationSignature { provided, required }));
        }
    }
    found.extend(two_writers(db, project, of, flat));
    found
}

/// A resolved endpoint of a connection.
struct End<'db> {
    /// `instance.feature`
    name: String,
    feature: Name,
    /// The shell that declares the feature.
    shell: Decl<'db>,
    data: &'db Feature,
}

/// Returns the endpoints of a connection, if they resolve, and the location of its target.
fn ends<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    connection: &Connection,
) -> Option<([End<'db>; 2], Location<'db>)> {
    let end = |end: &Option<Endpoint>| {
        let names = end.as_ref()?.names()?;
        let found = flat.feature(db, project, &names)?;
        let (instance, feature) = names;
        let name = format!("{instance}.{feature}");
        Some(End { name, feature, shell: found.shell, data: found.data(db)? })
    };
    let at = Location::Source(of, connection.target.as_ref()?.feature.as_ref()?.id);
    Some(([end(&connection.source)?, end(&connection.target)?], at))
}

/// Returns the connections of an architecture and its imports to an input port that has another connection.
fn two_writers<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
) -> Vec<Fact<'db>> {
    let mut first: FxHashMap<&(Name, Name), &Link<'db>> = FxHashMap::default();
    let mut found = Vec::new();
    let is_input = |end: &(Name, Name)| {
        flat.feature(db, project, end).is_some_and(|feature| feature.kind == FeatureKind::Input)
    };
    // Connections of imported architectures come first: the own ones are reported.
    let links = flat.links.iter().filter(|link| !link.operation);
    let (own, imported): (Vec<_>, Vec<_>) = links.partition(|link| link.is_in(of));
    // If one import contains both connections, its own check reports them.
    let imports: Vec<&Flat<'db>> =
        imports_of(db, project, of).map(|import| flat_of(db, project, import)).collect();
    let has = |flat: &Flat<'db>, at: &Location<'db>| flat.links.iter().any(|link| link.at == *at);
    for link in imported.into_iter().chain(own) {
        let Some(earlier) = first.get(&link.target).copied() else {
            first.insert(&link.target, link);
            continue;
        };
        let is_reported = imports.iter().any(|import| has(import, &earlier.at) && has(import, &link.at));
        if !is_reported && is_input(&link.target) {
            let at = if link.is_in(of) { link.at.clone() } else { Location::name_of(of) };
            let (first, second) = (Box::new(earlier.clone()), Box::new(link.clone()));
            found.push(Fact::new(at, FactKind::TwoWriters { of, first, second }));
        }
    }
    found
}

/// Returns whether a connection leads from an output to an input port, or from a provided to a required operation.
fn is_valid<'db>(db: &'db dyn ModelDb, project: Project<'db>, flat: &Flat<'db>, link: &Link<'db>) -> bool {
    let kind = |end| Some(flat.feature(db, project, end)?.kind);
    let expected = match link.operation {
        true => (FeatureKind::Provided, FeatureKind::Required),
        false => (FeatureKind::Output, FeatureKind::Input),
    };
    kind(&link.source).zip(kind(&link.target)) == Some(expected)
}

/// Returns the facts for values that are not set, and for unconnected operations and inputs.
pub(crate) fn check_deployment<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let (Some(data), Some((flat, _))) = (deployment(db, of), deployed(db, project, of)) else {
        return Vec::new();
    };
    let own = data.settings.iter().filter_map(|it| it.endpoint.as_ref()?.names());
    let set: FxHashSet<(Name, Name)> = own.chain(flat.settings.iter().cloned()).collect();
    // An unresolved setting may be the missing one, if its instance or its feature is correct.
    let is_value =
        |end: &&(Name, Name)| flat.feature(db, project, end).is_some_and(|feature| feature.kind.is_value());
    let unresolved: Vec<&(Name, Name)> = set.iter().filter(|it| !is_value(it)).collect();
    let may_be_set = |(instance, name): &(Name, Name)| {
        unresolved.iter().any(|(of, other)| of == instance || other == name)
    };
    let connected: FxHashSet<&(Name, Name)> = flat.links.iter().map(|link| &link.target).collect();
    // An incomplete or invalid connection may be the missing one.
    let links_are_valid = flat.link_completeness.is_complete()
        && flat.links.iter().all(|link| is_valid(db, project, flat, link));
    let mut found = Vec::new();
    for instance in flat.instances.iter().filter(|instance| !instance.repeated) {
        let Some(features) = flat.features(db, project, &instance.name) else { continue };
        if features.completeness.is_incomplete() || features.cycle {
            continue;
        }
        let activity = data.activities.iter().find(|activity| activity.instance.name == instance.name);
        let at =
            activity.map_or(Location::name_of(of), |activity| Location::Source(of, activity.instance.id));
        let mut unconnected = Vec::new();
        for (name, feature) in &features.by_name {
            let Some(feature) = feature.first() else { continue };
            let Some(declared) = feature.data(db) else { continue };
            let end = (instance.name.clone(), name.clone());
            let declared_at = Location::Source(feature.shell, declared.name.id);
            let instance = instance.name.clone();
            match feature.kind {
                FeatureKind::Property | FeatureKind::Constant
                    if declared.value.is_none() && !set.contains(&end) && !may_be_set(&end) =>
                {
                    let (kind, name, declared) = (feature.kind, name.clone(), declared_at);
                    let kind = FactKind::MissingValue { instance, kind, name, declared };
                    found.push(Fact::new(at.clone(), kind));
                }
                FeatureKind::Required if !connected.contains(&end) && links_are_valid => {
                    let (name, declared) = (name.clone(), declared_at);
                    let kind = FactKind::UnconnectedOperation { instance, name, declared };
                    found.push(Fact::new(at.clone(), kind));
                }
                FeatureKind::Input if !connected.contains(&end) && links_are_valid => {
                    unconnected.push(name.clone());
                }
                _ => {}
            }
        }
        if !unconnected.is_empty() {
            let instance = instance.name.clone();
            found.push(Fact::new(at, FactKind::UnconnectedInput { instance, ports: unconnected }));
        }
    }
    found
}
