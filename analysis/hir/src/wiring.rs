//! What connections carry, and what a deployed system leaves open.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::fact::{Fact, FactKind};
use crate::flat::{Flat, deployed, flat_of};
use crate::infer::signature;
use crate::item_tree::{Connection, Endpoint, Feature, FeatureKind, Kind, Name};
use crate::link::Link;
use crate::names::names_of;
use crate::project::Project;
use crate::source::{Decl, Location, architecture, deployment};
use crate::types::type_of;

/// What is wrong with the connections of an architecture, whose ends are right.
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
        let [gives, takes] =
            [&source, &target].map(|end| type_of(db, project, end.shell, end.data.ty.as_ref()));
        if !gives.is(&takes) {
            let side = |end: &End<'db>| {
                Location::Source(end.shell, end.data.ty.as_ref().map_or(end.data.name.id, |it| it.id))
            };
            let (from, to) = (side(&source), side(&target));
            let ends = [(source.name, gives, from), (target.name, takes, to)];
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

/// One end of a connection.
struct End<'db> {
    /// `instance.feature`
    name: String,
    feature: Name,
    /// Where the feature is declared.
    shell: Decl<'db>,
    data: &'db Feature,
}

/// The ends of a connection, where they are known, and where its target stands.
fn ends<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    connection: &Connection,
) -> Option<([End<'db>; 2], Location<'db>)> {
    let end = |end: &Option<Endpoint>| {
        let Endpoint { instance, feature } = end.as_ref()?;
        let feature = feature.as_ref()?;
        let found = flat.features(db, project, &instance.name)?.get(&feature.name)?;
        let data = found.data(db)?;
        let name = format!("{}.{}", instance.name, feature.name);
        Some(End { name, feature: feature.name.clone(), shell: found.shell, data })
    };
    let at = Location::Source(of, connection.target.as_ref()?.feature.as_ref()?.id);
    Some(([end(&connection.source)?, end(&connection.target)?], at))
}

/// Connections of an architecture to an input that one of its own, or of what it imports, leads to already.
fn two_writers<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
) -> Vec<Fact<'db>> {
    let mut first: FxHashMap<&(Name, Name), &Link<'db>> = FxHashMap::default();
    let mut found = Vec::new();
    let is_input = |(instance, port): &(Name, Name)| {
        let feature = flat.features(db, project, instance).and_then(|features| features.get(port));
        feature.is_some_and(|feature| feature.kind == FeatureKind::Input)
    };
    // Those of imported architectures come first: they are there already.
    let links = flat.links.iter().filter(|link| !link.operation);
    let (mine, others): (Vec<_>, Vec<_>) = links.partition(|link| link.is_in(of));
    // What one import has already is reported there.
    let imports = architecture(db, of).into_iter().flat_map(|data| data.imports.iter().flatten());
    let imports: Vec<&Flat<'db>> = imports
        .filter_map(|it| names_of(db, project).resolve_type(db, of, Kind::Architecture, Some(it)).ok())
        .map(|import| flat_of(db, project, import))
        .collect();
    let has = |flat: &Flat<'db>, at: &Location<'db>| flat.links.iter().any(|link| link.at == *at);
    for link in others.into_iter().chain(mine) {
        let Some(earlier) = first.get(&link.target).copied() else {
            first.insert(&link.target, link);
            continue;
        };
        let is_known = imports.iter().any(|import| has(import, &earlier.at) && has(import, &link.at));
        if !is_known && is_input(&link.target) {
            let at = if link.is_in(of) { link.at.clone() } else { Location::name_of(of) };
            let (first, second) = (Box::new(earlier.clone()), Box::new(link.clone()));
            found.push(Fact::new(at, FactKind::TwoWriters { of, first, second }));
        }
    }
    found
}

/// Does a connection lead from an output to an input, or from a provided operation to a required one?
fn is_right<'db>(db: &'db dyn ModelDb, project: Project<'db>, flat: &Flat<'db>, link: &Link<'db>) -> bool {
    let kind =
        |(instance, feature): &(Name, Name)| Some(flat.features(db, project, instance)?.get(feature)?.kind);
    let right = match link.operation {
        true => (FeatureKind::Provided, FeatureKind::Required),
        false => (FeatureKind::Output, FeatureKind::Input),
    };
    kind(&link.source).zip(kind(&link.target)) == Some(right)
}

/// What a deployed system leaves open: values, operations, inputs.
pub(crate) fn check_deployment<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let (Some(data), Some((flat, _))) = (deployment(db, of), deployed(db, project, of)) else {
        return Vec::new();
    };
    let own = data.settings.iter().filter_map(|it| it.endpoint.as_ref());
    let own = own.filter_map(|it| Some((it.instance.name.clone(), it.feature.as_ref()?.name.clone())));
    let set: FxHashSet<(Name, Name)> = own.chain(flat.settings.iter().cloned()).collect();
    // A value that is for nothing may be the one that is missing, where either part of its name is right.
    let is_value = |(instance, name): &&(Name, Name)| {
        let feature = flat.features(db, project, instance).and_then(|features| features.get(name));
        feature.is_some_and(|feature| feature.kind.is_value())
    };
    let strays: Vec<&(Name, Name)> = set.iter().filter(|it| !is_value(it)).collect();
    let may_be_set =
        |(instance, name): &(Name, Name)| strays.iter().any(|(of, stray)| of == instance || stray == name);
    let connected: FxHashSet<&(Name, Name)> = flat.links.iter().map(|link| &link.target).collect();
    // A connection that is half typed, or leads to the wrong place, may be the one that is missing.
    let all_known = flat.link_completeness.is_complete()
        && flat.links.iter().all(|link| is_right(db, project, flat, link));
    let mut found = Vec::new();
    for instance in flat.instances.iter().filter(|instance| !instance.repeated) {
        let Some(features) = flat.features(db, project, &instance.name) else { continue };
        if features.completeness.is_incomplete() || features.cycle {
            continue;
        }
        let activity = data.activities.iter().find(|activity| activity.instance.name == instance.name);
        let at =
            activity.map_or(Location::name_of(of), |activity| Location::Source(of, activity.instance.id));
        let mut open = Vec::new();
        for (name, feature) in &features.by_name {
            let Some(feature) = feature.first() else { continue };
            let Some(declared) = feature.data(db) else { continue };
            let end = (instance.name.clone(), name.clone());
            let place = Location::Source(feature.shell, declared.name.id);
            let instance = instance.name.clone();
            match feature.kind {
                FeatureKind::Property | FeatureKind::Constant
                    if declared.value.is_none() && !set.contains(&end) && !may_be_set(&end) =>
                {
                    let (kind, name, declared) = (feature.kind, name.clone(), place);
                    let kind = FactKind::MissingValue { instance, kind, name, declared };
                    found.push(Fact::new(at.clone(), kind));
                }
                FeatureKind::Required if !connected.contains(&end) && all_known => {
                    let (name, declared) = (name.clone(), place);
                    let kind = FactKind::UnconnectedOperation { instance, name, declared };
                    found.push(Fact::new(at.clone(), kind));
                }
                FeatureKind::Input if !connected.contains(&end) && all_known => open.push(name.clone()),
                _ => {}
            }
        }
        if !open.is_empty() {
            let instance = instance.name.clone();
            found.push(Fact::new(at, FactKind::UnconnectedInput { instance, ports: open }));
        }
    }
    found
}
