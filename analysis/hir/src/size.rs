//! The size of an expanded project: shells with inherited features, architectures with imports, deployments with an activity
//! for each instance. A short text may expand to a huge project; such a project is not expanded.

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::graph::closure;
use crate::item_tree::{Kind, Name};
use crate::names::names_of;
use crate::project::Project;
use crate::source::{Decl, expansion_of};

/// The maximum number of features, instances and connections in all shells, architectures and deployments of a project,
/// including inherited and imported ones.
const MAX_SIZE: usize = 1 << 19;

/// The number of pairs of activities that count as one unit of size: each pair may have facts.
const PAIRS_PER_UNIT: usize = 16;

/// Returns the declaration with which the project exceeds the size limit.
///
/// It depends on the outlines of the files only: most queries depend on it.
#[salsa::tracked(returns(copy))]
pub fn too_large<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Option<Decl<'db>> {
    let mut sizes = Sizes { db, project, remaining: MAX_SIZE, features: FxHashMap::default() };
    names_of(db, project).all.iter().copied().find(|&decl| sizes.add(decl).is_none())
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
                    let expansion = expansion_of(self.db, of);
                    self.take(expansion.own + expansion.instances.len())?;
                }
            }
            Kind::Deployment => {
                let target = self.resolved(decl, Kind::Architecture).next();
                let mut instances = 0;
                for of in target.map_or(Some(Vec::new()), |target| self.all_of(target, Kind::Architecture))? {
                    for component in &expansion_of(self.db, of).instances {
                        instances += 1;
                        let features = self.features(of, component)?;
                        self.take(2 * (1 + features))?;
                    }
                }
                let activities = expansion_of(self.db, decl).own.max(instances);
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
        let all = closure([decl], |it| self.resolved(it, kind));
        self.take(all.len())?;
        Some(all)
    }

    fn resolved(&self, of: Decl<'db>, kind: Kind) -> impl Iterator<Item = Decl<'db>> + use<'db> {
        let (db, names) = (self.db, names_of(self.db, self.project));
        let library = of.library(db).as_ref();
        expansion_of(db, of).included.iter().filter_map(move |it| names.resolve(db, library, kind, it).ok())
    }

    /// Returns the number of features of a component that `of` instantiates.
    fn features(&mut self, of: Decl<'db>, component: &[Name]) -> Option<usize> {
        let (db, names) = (self.db, names_of(self.db, self.project));
        let Ok(component) = names.resolve(db, of.library(db).as_ref(), Kind::Component, component) else {
            return Some(0);
        };
        if let Some(&features) = self.features.get(&component) {
            return Some(features);
        }
        let mut features = 0;
        if let Some(shell) = self.resolved(component, Kind::Shell).next() {
            features =
                self.all_of(shell, Kind::Shell)?.into_iter().map(|it| expansion_of(self.db, it).own).sum();
        }
        self.features.insert(component, features);
        Some(features)
    }
}
