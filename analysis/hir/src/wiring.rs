//! Checks of connections, and of unset values and unconnected features in deployments.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::fact::{Checker, Fact, FactKind};
use crate::features::FeatureOf;
use crate::flat::{Flat, deployed, flat_of, imports_of};
use crate::infer::signature;
use crate::item_tree::{Connection, Endpoint, Feature, FeatureKind, Name, SourceId};
use crate::link::Link;
use crate::project::Project;
use crate::ros2::check::has_ros2_or_hosts;
use crate::ros2::ros2_of;
use crate::source::{Location, architecture, deployment_interface};
use crate::values::whole_number;

impl<'db> Checker<'db> {
    /// Checks the connections of an architecture with valid endpoints.
    pub(crate) fn connections(&mut self) {
        let (db, project) = (self.db, self.project);
        let Some(data) = architecture(db, self.of) else { return };
        let flat = flat_of(db, project, self.of);
        for connection in &data.connections {
            if let Some((size, id)) = &connection.buffer
                && whole_number(size).is_none_or(|size| size < 1)
            {
                self.report(*id, FactKind::BufferSize { size: size.clone() });
            }
            let Some(([source, target], id)) = self.ends(flat, connection) else { continue };
            if (source.feature.kind, target.feature.kind) != (FeatureKind::Output, FeatureKind::Input) {
                continue;
            }
            let [output, input] = [&source, &target].map(|end| end.feature.ty(db, project));
            if !output.is(&input) {
                let side = |ResolvedEnd { feature, data, .. }: &ResolvedEnd<'db>| {
                    Location::Source(feature.shell, data.ty.as_ref().map_or(data.name.id, |it| it.id))
                };
                let (from, to) = (side(&source), side(&target));
                let ends = [(source.name, output, from), (target.name, input, to)];
                self.report(id, FactKind::ConnectionType { ends });
            }
        }
        for connection in &data.operations {
            let Some(([source, target], id)) = self.ends(flat, connection) else { continue };
            if (source.feature.kind, target.feature.kind) != (FeatureKind::Provided, FeatureKind::Required) {
                continue;
            }
            let [provided, required] = [&source, &target].map(|ResolvedEnd { feature, data, .. }| {
                signature(db, project, feature.shell, &data.parameters, data.ty.as_ref())
            });
            if !provided.is(&required) {
                let [provided, required] = [(source, provided), (target, required)]
                    .map(|(end, signature)| (end.data.name.name.clone(), signature));
                self.report(id, FactKind::OperationSignature { provided, required });
            }
        }
        self.two_writers(flat);
    }

    /// Returns the endpoints of a connection, if they resolve to features without syntax errors, and the source of its target.
    fn ends(&self, flat: &Flat<'db>, connection: &Connection) -> Option<([ResolvedEnd<'db>; 2], SourceId)> {
        let end = |end: &Option<Endpoint>| {
            let names = end.as_ref()?.names()?;
            let feature = *flat.feature(self.db, self.project, &names)?;
            let name = format!("{}.{}", names.0, names.1);
            let data = feature.data(self.db).filter(|it| it.completeness.is_complete())?;
            Some(ResolvedEnd { name, feature, data })
        };
        let id = connection.target.as_ref()?.feature.as_ref()?.id;
        Some(([end(&connection.source)?, end(&connection.target)?], id))
    }

    /// Reports the connections of an architecture and its imports to an input port that has another connection.
    fn two_writers(&mut self, flat: &Flat<'db>) {
        let (db, project, of) = (self.db, self.project, self.of);
        let mut first: FxHashMap<&(Name, Name), &Link<'db>> = FxHashMap::default();
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
                self.report_at(at, FactKind::TwoWriters { of, first, second });
            }
        }
    }

    /// Reports the values that a deployment does not set, and its unconnected operations and inputs.
    pub(crate) fn unset_and_unconnected(&mut self) {
        let (db, project, of) = (self.db, self.project, self.of);
        let (Some(data), Some((flat, _))) = (deployment_interface(db, of), deployed(db, project, of)) else {
            return;
        };
        let own = data.settings.iter().filter_map(|it| it.endpoint.as_ref()?.names());
        let set: FxHashSet<(Name, Name)> = own.chain(flat.settings.iter().cloned()).collect();
        // An unresolved setting may be the missing one, if its instance or its feature is correct.
        let is_value = |end: &&(Name, Name)| {
            flat.feature(db, project, end).is_some_and(|feature| feature.kind.is_value())
        };
        let unresolved: Vec<&(Name, Name)> = set.iter().filter(|it| !is_value(it)).collect();
        let instances: FxHashSet<&Name> = unresolved.iter().map(|(instance, _)| instance).collect();
        let names: FxHashSet<&Name> = unresolved.iter().map(|(_, name)| name).collect();
        let may_be_set =
            |(instance, name): &(Name, Name)| instances.contains(instance) || names.contains(name);
        // A setting with a syntax error may be the missing one.
        let settings_are_known = (data.completeness & flat.link_completeness).is_complete()
            && data.settings.iter().all(|it| it.endpoint.as_ref().and_then(Endpoint::names).is_some());
        let connected: FxHashSet<&(Name, Name)> = flat.links.iter().map(|link| &link.target).collect();
        // An incomplete or invalid connection may be the missing one.
        let links_are_valid = flat.link_completeness.is_complete()
            && flat.links.iter().all(|link| is_valid(db, project, flat, link));
        // The first activity of each instance.
        let activities =
            data.activities.iter().rev().flat_map(|it| &it.instances).map(|it| (&it.name, it.id));
        let activities: FxHashMap<&Name, SourceId> = activities.collect();
        let ros2 = has_ros2_or_hosts(db, project.workspace(db)).then(|| ros2_of(db, project, of));
        let topics: FxHashSet<_> = ros2.iter().flat_map(|it| &it.topics).map(|it| &it.port).collect();
        for instance in flat.instances.iter().filter(|instance| !instance.repeated) {
            let Some(features) = instance.features(db, project) else { continue };
            if features.completeness.is_incomplete() || features.cycle {
                continue;
            }
            let activity = activities.get(&instance.name);
            let at = activity.map_or(Location::name_of(of), |id| self.at(*id));
            let mut unconnected = Vec::new();
            for (name, feature) in &features.by_name {
                let Some(feature) = feature.first() else { continue };
                let Some(data) = feature.data(db) else { continue };
                let end = (instance.name.clone(), name.clone());
                let declared = Location::Source(feature.shell, data.name.id);
                let is_unconnected = links_are_valid && !connected.contains(&end) && !topics.contains(&end);
                let (instance, name) = (instance.name.clone(), name.clone());
                let kind = match feature.kind {
                    kind @ (FeatureKind::Property | FeatureKind::Constant)
                        if data.value.is_none() && !set.contains(&end) && !may_be_set(&end) =>
                    {
                        FactKind::MissingValue { instance, kind, name, declared }
                    }
                    FeatureKind::Required if is_unconnected => {
                        FactKind::UnconnectedOperation { instance, name, declared }
                    }
                    FeatureKind::Input if is_unconnected => {
                        unconnected.push(name);
                        continue;
                    }
                    _ => continue,
                };
                let is_follow_up = matches!(kind, FactKind::MissingValue { .. }) && !settings_are_known;
                self.found.push(Fact { is_follow_up, ..Fact::new(at.clone(), kind) });
            }
            if !unconnected.is_empty() {
                let instance = instance.name.clone();
                self.report_at(at, FactKind::UnconnectedInput { instance, ports: unconnected });
            }
        }
    }
}

/// A resolved endpoint of a connection.
struct ResolvedEnd<'db> {
    /// `instance.feature`
    name: String,
    feature: FeatureOf<'db>,
    data: &'db Feature,
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
