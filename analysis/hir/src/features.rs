//! The own and inherited features of shells; the shell and the core of a component.

use std::collections::BTreeMap;
use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::item_tree::{Feature, FeatureKind, Kind, Name, TypeRef};
use crate::names::{MayHide, Names, Unresolved, resolve_type};
use crate::project::Project;
use crate::size::too_large;
use crate::source::{Decl, Location, component, core_interface, shell};
use crate::types::{Type, type_of};

/// A feature of a shell, and the shell that declares it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct FeatureOf<'db> {
    /// The shell.
    pub shell: Decl<'db>,
    /// Its index in the shell.
    pub index: u32,
    /// Its kind.
    pub kind: FeatureKind,
}

impl<'db> FeatureOf<'db> {
    /// Returns its declaration.
    pub fn data(&self, db: &'db dyn ModelDb) -> Option<&'db Feature> {
        shell(db, self.shell)?.features.get(self.index as usize)
    }

    /// Returns the type of its value or of its result; unknown if missing or unresolved.
    pub fn ty(&self, db: &'db dyn ModelDb, project: Project<'db>) -> Type {
        type_of(db, project, self.shell, self.data(db).and_then(|data| data.ty.as_ref()))
    }

    /// Returns the location of its name.
    pub fn name(&self, db: &'db dyn ModelDb) -> Option<Location<'db>> {
        Some(Location::Source(self.shell, self.data(db)?.name.id))
    }
}

/// The own and inherited features of a shell.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Features<'db> {
    /// By name; more than one for a name is an error.
    pub by_name: BTreeMap<Name, Vec<FeatureOf<'db>>>,
    /// The shell itself and its direct and indirect bases.
    pub shells: Vec<Decl<'db>>,
    /// Whether the shell extends itself, directly or indirectly.
    pub cycle: bool,
    /// Whether all features are known, except ports and properties without a name, which have no effect on the demand of
    /// programs: incomplete if a feature or a base shell may be missing, or if a name is ambiguous.
    pub completeness: Completeness,
    /// Whether all ports and properties have a name.
    pub value_completeness: Completeness,
    /// Whether a missing file or a text with syntax errors may declare a base shell.
    pub has_hidden_base: bool,
}

impl<'db> Features<'db> {
    /// Returns the features of an unknown shell: it may provide any operation.
    pub(crate) fn unknown() -> &'db Features<'db> {
        static UNKNOWN: Features<'static> = Features {
            by_name: BTreeMap::new(),
            shells: Vec::new(),
            cycle: false,
            completeness: Completeness::Incomplete,
            value_completeness: Completeness::Incomplete,
            has_hidden_base: false,
        };
        &UNKNOWN
    }

    /// Returns whether all names of features are known.
    pub(crate) fn name_completeness(&self) -> Completeness {
        self.completeness & self.value_completeness
    }

    /// Returns the feature of that name.
    pub fn get(&self, name: &str) -> Option<&FeatureOf<'db>> {
        self.by_name.get(name).and_then(|found| found.first())
    }

    /// Returns why an operation may be missing.
    pub fn incomplete(&self, names: &Names<'_>) -> Incomplete {
        if self.has_hidden_base { Incomplete::UnknownBase(names.may_hide()) } else { Incomplete::Error }
    }

    /// Returns whether the shell has a feature of this kind.
    pub fn has_any(&self, kind: FeatureKind) -> bool {
        self.by_name.values().flatten().any(|feature| feature.kind == kind)
    }
}

/// Returns the own and inherited features of a shell.
pub fn features_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> &'db Features<'db> {
    shared_features(db, project, of)
}

#[salsa::tracked(returns(ref))]
fn shared_features<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Arc<Features<'db>> {
    let mut features = Features::default();
    if too_large(db, project).is_some() {
        features.completeness = Completeness::Incomplete;
        return Arc::new(features);
    }
    let mut seen: FxHashSet<Decl<'db>> = FxHashSet::from_iter([of]);
    let mut worklist = vec![of];
    while let Some(current) = worklist.pop() {
        features.shells.push(current);
        let Some(data) = shell(db, current) else { continue };
        features.completeness &= data.completeness;
        for (index, feature) in data.features.iter().enumerate() {
            let found = FeatureOf { shell: current, index: index as u32, kind: feature.kind };
            match feature.kind.is_operation() {
                true => features.completeness &= feature.completeness,
                false => features.value_completeness &= feature.completeness,
            }
            features.by_name.entry(feature.name.name.clone()).or_default().push(found);
        }
        for base in &data.bases {
            match resolve_type(db, project, current, Kind::Shell, Some(base)) {
                Ok(base) if base == of => features.cycle = true,
                Ok(base) => {
                    if seen.insert(base) {
                        worklist.push(base);
                    }
                }
                Err(unresolved) => {
                    features.completeness = Completeness::Incomplete;
                    features.has_hidden_base |= unresolved == Unresolved::Incomplete;
                }
            }
        }
    }
    // One of two features with the same name may be an operation.
    features.completeness &= Completeness::of(features.by_name.values().all(|found| found.len() == 1));
    Arc::new(features)
}

/// Returns the core of a component, if it resolves.
pub fn core_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    let data = component(db, of)?;
    resolve_type(db, project, of, Kind::Core, data.core.as_ref()).ok()
}

/// Returns the shell of a component or a core, if it resolves.
pub fn shell_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    resolve_type(db, project, of, Kind::Shell, written_shell(db, of)).ok()
}

/// Returns the shell of a component or a core as written.
pub(crate) fn written_shell<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Option<&'db TypeRef> {
    match of.kind(db) {
        Kind::Core => core_interface(db, of).as_ref()?.shell.as_ref(),
        _ => component(db, of)?.shell.as_ref(),
    }
}

/// Returns the direct bases of a shell that resolve.
pub fn bases_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Decl<'db>> {
    let bases = shell(db, of).into_iter().flat_map(|data| &data.bases);
    bases.filter_map(|base| resolve_type(db, project, of, Kind::Shell, Some(base)).ok()).collect()
}

/// Returns whether a core implements `shell` or a base of it.
pub fn is_core_for<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    shell: Decl<'db>,
) -> bool {
    // Another fact reports an unresolved shell.
    let fits = |own: Decl<'db>| own == shell || features_of(db, project, shell).shells.contains(&own);
    core_interface(db, of).is_some() && shell_of(db, project, of).is_none_or(fits)
}

/// What architectures and deployments read of a component.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Implementation<'db> {
    /// Its shell with its features, if the shell resolves. If its core is for another shell, its shell is unknown.
    pub shell: Option<(Decl<'db>, Arc<Features<'db>>)>,
    /// Its core, if that resolves.
    pub core: Option<Decl<'db>>,
    /// Whether its core defines operations, or is unknown.
    pub may_define_operations: bool,
}

/// Returns the [`Implementation`] of a component.
#[salsa::tracked(returns(ref))]
pub(crate) fn implementation_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Implementation<'db> {
    let core = core_of(db, project, of);
    let fits = |shell: &Decl<'db>| core.is_none_or(|core| is_core_for(db, project, core, *shell));
    let shell = shell_of(db, project, of).filter(fits);
    let interface = core.and_then(|core| core_interface(db, core).as_ref());
    Implementation {
        shell: shell.map(|shell| (shell, shared_features(db, project, shell).clone())),
        core,
        may_define_operations: interface.is_none_or(|core| core.defines_operations),
    }
}

/// Why an operation may be missing in a shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
pub enum Incomplete {
    /// A base shell is unresolved.
    UnknownBase(MayHide),
    /// The shell has an error.
    Error,
}
