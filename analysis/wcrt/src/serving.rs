//! The instances of an architecture that serve operations, and the errors in the items that name instances.

use rustc_hash::{FxHashMap, FxHashSet};

use mauve_hir::fact;
use mauve_hir::item_tree::{Activity, Endpoint, FeatureKind, Name, NameRef, SourceId};
use mauve_hir::{
    Decl, Features, Link, Location, ModelDb, Project, architecture, deployment, errors_in, flat_of,
};

/// The instances of an architecture that serve operations.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Serving {
    /// The instances that provide operations.
    pub(crate) providing: FxHashSet<Name>,
    /// The connected operations: the provider and the client, each with the name in its shell.
    pub(crate) connected: Vec<((Name, Name), (Name, Name))>,
    /// Whether any instance that provides operations may serve one.
    pub(crate) may_serve: bool,
}

/// Returns which instances of an architecture serve operations. A query, because it does not depend on deployments.
#[salsa::tracked(returns(ref))]
pub(crate) fn serving_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, target: Decl<'db>) -> Serving {
    let flat = flat_of(db, project, target);
    let mut serving = Serving::default();
    let mut shells: FxHashMap<&Name, &Features<'db>> = FxHashMap::default();
    for instance in &flat.instances {
        if let Some(features) = instance.features(db, project) {
            shells.insert(&instance.name, features);
        }
    }
    // The kind of a feature; none where it is unknown. Where the shell is incomplete, its component is refused.
    let kind = |(instance, feature): &(Name, Name)| {
        let [feature] = shells.get(instance)?.by_name.get(feature)?.as_slice() else { return None };
        Some(feature.kind)
    };
    // A connection with an error may call any activity that provides operations.
    let has_wrong_operation = |&decl: &Decl<'db>| {
        let errors = errors_and_items(db, project, decl);
        errors.into_iter().any(|(_, item)| item.is_some_and(|item| item.is_operation))
    };
    serving.may_serve =
        flat.link_completeness.is_incomplete() || flat.architectures.iter().any(has_wrong_operation);
    for Link { operation, source, target, .. } in &flat.links {
        let kinds = (kind(source), kind(target));
        let is_port = |kind: Option<FeatureKind>| kind.is_some_and(FeatureKind::is_port);
        if *operation && kinds == (Some(FeatureKind::Provided), Some(FeatureKind::Required)) {
            serving.connected.push((source.clone(), target.clone()));
        } else {
            serving.may_serve |= *operation || !is_port(kinds.0) || !is_port(kinds.1);
        }
    }
    for (&name, features) in &shells {
        let implementation = flat.instance(name).and_then(|it| it.implementation(db, project));
        let Some(implementation) = implementation else { continue };
        // A component of a shell with an error is refused for that error.
        if features.has_any(FeatureKind::Provided) || implementation.may_define_operations {
            serving.providing.insert(name.clone());
        }
    }
    serving
}

/// An item of an architecture or of a deployment.
#[derive(Clone)]
pub(crate) struct Item<'db> {
    first: SourceId,
    /// The instances that it declares, connects, runs or sets a value of.
    pub(crate) instances: Vec<&'db Name>,
    is_operation: bool,
}

/// The items of an architecture or of a deployment, in the order of the text.
fn items_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<Item<'db>> {
    let item = |ends: &[&'db Option<Endpoint>], is_operation| {
        let ends: Vec<&NameRef> = ends.iter().filter_map(|end| Some(&end.as_ref()?.instance)).collect();
        let named = ends.iter().map(|end| &end.name).filter(|name| !name.is_empty());
        Some(Item { first: ends.first()?.id, instances: named.collect(), is_operation })
    };
    let other = |first, instances| Item { first, instances, is_operation: false };
    let mut items: Vec<Item<'db>> = Vec::new();
    if let Some(data) = architecture(db, of) {
        items.extend(data.connections.iter().filter_map(|it| item(&[&it.source, &it.target], false)));
        items.extend(data.operations.iter().filter_map(|it| item(&[&it.source, &it.target], true)));
        items.extend(data.settings.iter().filter_map(|it| item(&[&it.endpoint], false)));
        items.extend(data.instances.iter().map(|it| other(it.name.id, vec![&it.name.name])));
        items.extend(data.imports.iter().flatten().map(|it| other(it.id, Vec::new())));
    }
    if let Some(data) = deployment(db, of) {
        items.extend(data.settings.iter().filter_map(|it| item(&[&it.endpoint], false)));
        let names = |it: &'db Activity| it.instances.iter().map(|it| &it.name).collect();
        items.extend(data.activities.iter().map(|it| other(it.name.id, names(it))));
    }
    items.sort_by_key(|item| item.first);
    items
}

/// Returns the errors in an architecture or a deployment, each with the item that contains it.
pub(crate) fn errors_and_items<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<(&'db fact::ModelRefusal<'db>, Option<Item<'db>>)> {
    let errors = errors_in(db, project, of);
    let items = if errors.is_empty() { Vec::new() } else { items_of(db, of) };
    let item_at = |at: &Location<'db>| match at {
        Location::Source(decl, id) if *decl == of => {
            items.get(items.partition_point(|item| item.first <= *id).checked_sub(1)?).cloned()
        }
        _ => None,
    };
    errors.iter().map(|error| (error, item_at(&error.at))).collect()
}
