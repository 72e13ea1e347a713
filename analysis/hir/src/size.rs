//! The size of an expanded project: shells with inherited features, architectures with imports, deployments with an activity
//! for each instance. A short text may expand to a huge project; such a project is not expanded.

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::graph::closure;
use crate::item_tree::{Data, Kind, TypeRef};
use crate::names::names_of;
use crate::project::Project;
use crate::source::{Decl, data};

/// The maximum number of features, instances and connections in all shells, architectures and deployments of a project,
/// including inherited and imported ones.
const MAX_SIZE: usize = 1 << 19;

/// The number of pairs of activities that count as one unit of size: each pair may have facts.
const PAIRS_PER_UNIT: usize = 16;

/// Returns the declaration with which the project exceeds the size limit.
///
/// Edits of values and comments do not change the result.
#[salsa::tracked(returns(copy))]
pub fn too_large<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Option<Decl<'db>> {
    let mut sizes = Sizes { db, project, remaining: MAX_SIZE, features: FxHashMap::default() };
    names_of(db, project).all.iter().copied().find(|&decl| sizes.add(decl).is_none())
}

/// The number of a declaration's own items, and the declarations that it includes or instantiates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Shape {
    own: usize,
    included: Vec<TypeRef>,
    instances: Vec<TypeRef>,
}

#[salsa::tracked(returns(ref))]
fn shape_of<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Shape {
    let Some(data) = data(db, decl).as_deref() else { return Shape::default() };
    let (own, included) = match data {
        Data::Shell(it) => (it.features.len(), it.bases.clone()),
        Data::Architecture(it) => {
            let own = it.connections.len() + it.operations.len() + it.settings.len();
            (own, it.imports.iter().flatten().cloned().collect())
        }
        Data::Component(it) => (0, it.shell.iter().cloned().collect()),
        Data::Deployment(it) => (it.activities.len(), it.targets.clone()),
        Data::Use | Data::Codel(_) | Data::Core(_) => return Shape::default(),
    };
    let instances = match data {
        Data::Architecture(it) => it.instances.iter().filter_map(|it| it.component.clone()).collect(),
        _ => Vec::new(),
    };
    Shape { own, included, instances }
}

struct Sizes<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// The size that remains until the limit.
    remaining: usize,
    features: FxHashMap<Decl<'db>, usize>,
}

impl<'db> Sizes<'db> {
    /// Adds the size of a declaration; `None` if it exceeds the limit.
    fn add(&mut self, decl: Decl<'db>) -> Option<()> {
        match decl.kind(self.db) {
            Kind::Shell | Kind::Architecture => {
                for of in self.all_of(decl, decl.kind(self.db))? {
                    let shape = shape_of(self.db, of);
                    self.take(shape.own + shape.instances.len())?;
                }
            }
            Kind::Deployment => {
                let target = self.resolved(decl, Kind::Architecture).next();
                let mut instances = 0;
                for of in target.map_or(Some(Vec::new()), |target| self.all_of(target, Kind::Architecture))? {
                    for component in &shape_of(self.db, of).instances {
                        instances += 1;
                        let features = self.features(of, component)?;
                        self.take(2 * (1 + features))?;
                    }
                }
                let activities = shape_of(self.db, decl).own.max(instances);
                self.take(activities.saturating_mul(activities) / PAIRS_PER_UNIT)?;
            }
            _ => {}
        }
        Some(())
    }

    fn take(&mut self, size: usize) -> Option<()> {
        self.remaining = self.remaining.checked_sub(size)?;
        Some(())
    }

    /// Returns a shell with its direct and indirect bases, or an architecture with its direct and indirect imports.
    fn all_of(&mut self, decl: Decl<'db>, kind: Kind) -> Option<Vec<Decl<'db>>> {
        let all = closure(decl, |it| self.resolved(it, kind));
        self.take(all.len())?;
        Some(all)
    }

    fn resolved(&self, of: Decl<'db>, kind: Kind) -> impl Iterator<Item = Decl<'db>> + use<'db> {
        let (db, names) = (self.db, names_of(self.db, self.project));
        shape_of(db, of).included.iter().filter_map(move |it| names.resolve_type(db, of, kind, Some(it)).ok())
    }

    /// Returns the number of features of a component that `of` instantiates.
    fn features(&mut self, of: Decl<'db>, component: &TypeRef) -> Option<usize> {
        let names = names_of(self.db, self.project);
        let Ok(component) = names.resolve_type(self.db, of, Kind::Component, Some(component)) else {
            return Some(0);
        };
        if let Some(&features) = self.features.get(&component) {
            return Some(features);
        }
        let mut features = 0;
        if let Some(shell) = self.resolved(component, Kind::Shell).next() {
            features = self.all_of(shell, Kind::Shell)?.into_iter().map(|it| shape_of(self.db, it).own).sum();
        }
        self.features.insert(component, features);
        Some(features)
    }
}
