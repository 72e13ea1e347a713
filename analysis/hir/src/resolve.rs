//! What the names in programs refer to. This is the only place that decides it: types, costs, data flow, occurrences,
//! completion, signature help and generated code ask here, or read what was found here.

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::CoreScope;
use crate::builtin::{Builtin, Operand};
use crate::completeness::Completeness;
use crate::fact::NotCallable;
use crate::features::Features;
use crate::item_tree::{FeatureKind, Kind, Name};
use crate::names::{Names, Unresolved};
use crate::source::Decl;

/// A variable, parameter or handler of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub struct VariableId {
    /// The group of bodies that declares it; none where all bodies share it.
    pub group: Option<u32>,
    /// Its number among the variables of that group, or among those that are shared.
    pub index: u32,
}

/// What the name of a value refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Binding<'db> {
    /// A variable, parameter or handler.
    Variable(VariableId),
    /// A feature of a shell, by its number there.
    Feature(Decl<'db>, usize),
}

/// What a call calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Callee<'db> {
    /// A codel.
    Codel(Decl<'db>),
    /// An operation that the core itself defines, by its number there.
    Operation(usize),
    /// A built-in function.
    Builtin(Builtin),
}

/// Why a call calls nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CallError {
    /// The shell provides an operation of this name, and the core does not define it.
    Undefined,
    /// The shell requires an operation of this name: calling it would block.
    Required,
    /// Something has the name that cannot be called.
    NotCallable(NotCallable),
    /// Nothing has the name of the first argument of a built-in function.
    UnresolvedOperand(Builtin),
    /// No codel has the name.
    Unresolved(Unresolved),
}

/// A resolved call.
pub struct ResolvedCall<'db> {
    /// What it calls.
    pub callee: Result<Callee<'db>, CallError>,
    /// Whether its first argument is, or should be, the operand of a built-in function, and no value.
    pub has_operand: bool,
}

/// The variables in scope, innermost last.
#[derive(Debug, Default)]
pub struct Scope {
    all: Vec<(Name, VariableId)>,
    by_name: FxHashMap<Name, Vec<VariableId>>,
}

impl Scope {
    /// Enters a variable, which hides those of its name.
    pub fn push(&mut self, name: &Name, id: VariableId) {
        self.all.push((name.clone(), id));
        self.by_name.entry(name.clone()).or_default().push(id);
    }

    /// How many variables there are.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Leaves all scopes with more than `depth` variables.
    pub fn truncate(&mut self, depth: usize) {
        for (name, _) in self.all.drain(depth.min(self.all.len())..) {
            if let Some(all) = self.by_name.get_mut(&name) {
                all.pop();
            }
        }
    }

    /// The variables entered behind the first `depth` ones.
    pub fn from(&self, depth: usize) -> impl Iterator<Item = VariableId> {
        self.all.iter().skip(depth).map(|(_, id)| *id)
    }

    /// Their names, outermost first.
    pub fn names(&self) -> impl Iterator<Item = &Name> {
        self.all.iter().map(|(name, _)| name)
    }

    fn get(&self, name: &str) -> Option<VariableId> {
        self.by_name.get(name)?.last().copied()
    }
}

/// Resolves names as they are seen at one point of a core's programs.
pub struct Resolver<'a, 'db> {
    pub(crate) db: &'db dyn ModelDb,
    /// The core.
    pub(crate) of: Decl<'db>,
    pub(crate) names: &'db Names<'db>,
    /// The features of its shell.
    pub(crate) features: &'a Features<'db>,
    pub(crate) core: &'db CoreScope,
    /// The variables that hide what is called.
    pub scope: Scope,
    /// Those of the state machines: all programs see them, behind those in scope.
    pub machine: Scope,
    /// Whether all variables are known: an unresolved name may be a missing one.
    pub variables: Completeness,
}

impl<'db> Resolver<'_, 'db> {
    /// Enters the programs of the state machine: its variables hide those of the core, and what is called.
    pub(crate) fn enter_machine(&mut self) {
        for (name, id) in &self.machine.all {
            self.scope.push(name, *id);
        }
    }

    /// What the name of a value refers to: a variable, innermost first, a variable of the state machine, a feature of the
    /// shell.
    pub(crate) fn resolve_name(&self, name: &str) -> Option<Binding<'db>> {
        if name.is_empty() {
            return None;
        }
        let variable = self.scope.get(name).or_else(|| self.machine.get(name));
        variable
            .map(Binding::Variable)
            .or_else(|| self.features.get(name).map(|feature| Binding::Feature(feature.shell, feature.index)))
    }

    /// The codel of that name, as the core sees it.
    pub(crate) fn resolve_codel(&self, name: &Name) -> Result<Decl<'db>, Unresolved> {
        let library = self.of.library(self.db).as_ref();
        self.names.resolve(self.db, library, Kind::Codel, std::slice::from_ref(name))
    }

    /// What `name` calls, with `first` for its first argument where that is a name. In this order: a built-in function
    /// that `first` fits, unless a codel or an operation of the core has its name; what a variable hides; the features of
    /// the shell; codels.
    pub fn resolve_call(&self, name: &Name, first: Option<&Name>) -> ResolvedCall<'db> {
        let feature = self.features.get(name).map(|feature| feature.kind);
        let builtin = Builtin::of_name(name).zip(first);
        let has_operand = builtin.is_some_and(|(builtin, first)| self.is_operand(builtin, first));
        if let Some((builtin, first)) = builtin {
            let is_codel =
                !matches!(self.resolve_codel(name), Err(Unresolved::Unknown | Unresolved::Incomplete));
            if has_operand && !is_codel && feature != Some(FeatureKind::Provided) {
                return ResolvedCall { callee: Ok(Callee::Builtin(builtin)), has_operand };
            }
            if !has_operand && self.is_unresolved_operand(name, first) {
                let callee = Err(CallError::UnresolvedOperand(builtin));
                return ResolvedCall { callee, has_operand: true };
            }
        }
        let callee = match feature {
            _ if self.scope.get(name).is_some() => Err(CallError::NotCallable(NotCallable::Variable)),
            Some(FeatureKind::Provided) => {
                let defined = self.core.operations.iter().position(|operation| operation.name.name == *name);
                defined.map(Callee::Operation).ok_or(CallError::Undefined)
            }
            Some(FeatureKind::Required) => Err(CallError::Required),
            Some(kind) if kind.is_port() => Err(CallError::NotCallable(NotCallable::Port)),
            Some(_) => Err(CallError::NotCallable(NotCallable::Property)),
            None => self.resolve_codel(name).map(Callee::Codel).map_err(CallError::Unresolved),
        };
        ResolvedCall { callee, has_operand }
    }

    /// Whether `first` names what a built-in function takes. Ports and operations are no values: a variable of the same
    /// name is not meant, unless a codel of the function's name may be missing.
    fn is_operand(&self, builtin: Builtin, first: &Name) -> bool {
        if builtin.operand() == Operand::Handler {
            return self.core.handlers.iter().any(|handler| handler.name.name == *first);
        }
        let is_value = self.scope.get(first).is_some() && self.names.may_miss_names();
        !is_value && self.features.get(first).is_some_and(|feature| builtin.takes(feature.kind))
    }

    /// Whether `name` can only be the built-in function, and `first` is nothing at all.
    fn is_unresolved_operand(&self, name: &Name, first: &Name) -> bool {
        let is_known = |name: &Name| {
            self.scope.get(name).is_some()
                || self.features.get(name).is_some()
                || !matches!(self.resolve_codel(name), Err(Unresolved::Unknown))
        };
        (self.features.completeness & self.variables).is_complete() && !is_known(name) && !is_known(first)
    }
}
