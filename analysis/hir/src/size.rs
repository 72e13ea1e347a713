//! How much a project becomes when shells have what they extend, architectures what they import, and deployments an activity
//! for each instance: a few lines may say a product of many. What is too large is not expanded.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::item_tree::{Kind, TypeRef};
use crate::names::names_of;
use crate::project::Project;
use crate::source::{Decl, architecture, component, deployment, shell};

/// So many features, instances and connections a project may have in all its shells, architectures and deployments,
/// with what each takes from others.
const MOST: usize = 1 << 19;

/// What two activities of a deployment may tell of each other is a part of that.
const PAIRS_TO_ONE: usize = 16;

/// The declaration with which a project becomes too large to be analysed.
///
/// Values, comments and places change nothing here.
#[salsa::tracked(returns(copy))]
pub fn too_large<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Option<Decl<'db>> {
    let mut sizes = Sizes { db, project, left: MOST, features: FxHashMap::default() };
    names_of(db, project).all.iter().copied().find(|&decl| sizes.add(decl).is_none())
}

/// What a declaration has, and what it takes over or instantiates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Shape {
    own: usize,
    taken: Vec<TypeRef>,
    instances: Vec<TypeRef>,
}

#[salsa::tracked(returns(ref))]
fn shape_of<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Shape {
    let shape = match decl.kind(db) {
        Kind::Shell => shell(db, decl).map(|it| Shape {
            own: it.features.len(),
            taken: it.bases.clone(),
            ..Shape::default()
        }),
        Kind::Architecture => architecture(db, decl).map(|it| Shape {
            own: it.connections.len() + it.operations.len() + it.settings.len(),
            taken: it.imports.iter().flatten().cloned().collect(),
            instances: it.instances.iter().filter_map(|it| it.component.clone()).collect(),
        }),
        Kind::Component => component(db, decl)
            .map(|it| Shape { taken: it.shell.iter().cloned().collect(), ..Shape::default() }),
        Kind::Deployment => deployment(db, decl).map(|it| Shape {
            own: it.activities.len(),
            taken: it.targets.clone(),
            ..Shape::default()
        }),
        _ => None,
    };
    shape.unwrap_or_default()
}

struct Sizes<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// How much more there may be.
    left: usize,
    /// The features of components.
    features: FxHashMap<Decl<'db>, usize>,
}

impl<'db> Sizes<'db> {
    /// Adds a declaration; nothing where that is too much.
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
                self.take(activities.saturating_mul(activities) / PAIRS_TO_ONE)?;
            }
            _ => {}
        }
        Some(())
    }

    fn take(&mut self, size: usize) -> Option<()> {
        self.left = self.left.checked_sub(size)?;
        Some(())
    }

    /// A shell with all that it extends, or an architecture with all that it imports.
    fn all_of(&mut self, decl: Decl<'db>, kind: Kind) -> Option<Vec<Decl<'db>>> {
        let mut all = vec![decl];
        let mut seen: FxHashSet<Decl<'db>> = FxHashSet::from_iter([decl]);
        let mut next = 0;
        while let Some(&current) = all.get(next) {
            next += 1;
            self.take(1)?;
            all.extend(self.resolved(current, kind).filter(|it| seen.insert(*it)));
        }
        Some(all)
    }

    fn resolved(&self, of: Decl<'db>, kind: Kind) -> impl Iterator<Item = Decl<'db>> + use<'db> {
        let (db, names) = (self.db, names_of(self.db, self.project));
        shape_of(db, of).taken.iter().filter_map(move |it| names.resolve_type(db, of, kind, Some(it)).ok())
    }

    /// How many features the component has that `of` instantiates.
    fn features(&mut self, of: Decl<'db>, component: &TypeRef) -> Option<usize> {
        let names = names_of(self.db, self.project);
        let Ok(component) = names.resolve_type(self.db, of, Kind::Component, Some(component)) else {
            return Some(0);
        };
        if let Some(&known) = self.features.get(&component) {
            return Some(known);
        }
        let mut features = 0;
        if let Some(shell) = self.resolved(component, Kind::Shell).next() {
            features = self.all_of(shell, Kind::Shell)?.into_iter().map(|it| shape_of(self.db, it).own).sum();
        }
        self.features.insert(component, features);
        Some(features)
    }
}
