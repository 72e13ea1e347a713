//! Resolution of the names in programs. No other module resolves them: types, costs, data flow, occurrences, completion,
//! signature help and generated code use the [`Resolver`] or its results.

use std::cell::RefCell;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::CoreScope;
use crate::builtin::{Builtin, Operand};
use crate::completeness::Completeness;
use crate::features::{FeatureOf, Features};
use crate::item_tree::{FeatureKind, Kind, Name};
use crate::names::{Unresolved, may_miss_names, resolve_path};
use crate::project::Project;
use crate::source::Decl;

/// A variable, parameter or handler of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub struct VariableId {
    /// The group of bodies that declares it; `None` if all bodies share it.
    pub group: Option<u32>,
    /// Its index among the variables of the group, or among the shared variables.
    pub index: u32,
}

/// The definition that the name of a value refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Binding<'db> {
    /// A variable, parameter or handler.
    Variable(VariableId),
    /// A feature.
    Feature(FeatureOf<'db>),
}

/// The callee of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Callee<'db> {
    /// A codel.
    Codel(Decl<'db>),
    /// An operation that the core defines, by its index there.
    Operation(usize),
    /// A built-in function.
    Builtin(Builtin),
}

impl VariableId {
    /// Returns its number, where those of a group follow the shared ones.
    pub(crate) fn number(self, shared: usize) -> usize {
        self.index as usize + if self.group.is_some() { shared } else { 0 }
    }
}

impl<'db> Binding<'db> {
    /// Returns the index of a variable that all bodies share.
    pub(crate) fn shared_variable(&self) -> Option<usize> {
        match self {
            Binding::Variable(VariableId { group: None, index }) => Some(*index as usize),
            _ => None,
        }
    }

    /// Returns the index of a variable that its group of bodies declares.
    pub(crate) fn local_variable(&self) -> Option<usize> {
        match self {
            Binding::Variable(VariableId { group: Some(_), index }) => Some(*index as usize),
            _ => None,
        }
    }

    pub(crate) fn feature(&self) -> Option<FeatureOf<'db>> {
        match self {
            Binding::Feature(feature) => Some(*feature),
            Binding::Variable(_) => None,
        }
    }
}

impl<'db> Callee<'db> {
    pub(crate) fn codel(&self) -> Option<Decl<'db>> {
        match self {
            Callee::Codel(codel) => Some(*codel),
            Callee::Operation(_) | Callee::Builtin(_) => None,
        }
    }

    pub(crate) fn operation(self) -> Option<usize> {
        match self {
            Callee::Operation(index) => Some(index),
            Callee::Codel(_) | Callee::Builtin(_) => None,
        }
    }
}

/// Why a call has no callee.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum CallError {
    /// The shell provides an operation of this name, and the core does not define it.
    Undefined,
    /// The shell requires an operation of this name: a call would block.
    Required,
    /// The name refers to a variable, or to a feature of this kind that is not an operation.
    NotCallable(Option<FeatureKind>),
    /// The first argument of a built-in function is unresolved.
    UnresolvedOperand(Builtin),
    /// No codel has the name, or several have.
    Unresolved(Unresolved),
}

pub(crate) struct ResolvedCall<'db> {
    pub(crate) callee: Result<Callee<'db>, CallError>,
    /// Whether its first argument is, or should be, the operand of a built-in function instead of a value.
    pub(crate) has_operand: bool,
}

/// The names that all programs of a core share. A map for each core: copies for each program would be quadratic in the size
/// of the core.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(crate) struct SharedNames {
    /// The last variable or handler of each name.
    pub(crate) core: FxHashMap<Name, VariableId>,
    /// The last variable of the state machines of each name.
    pub(crate) machine: FxHashMap<Name, VariableId>,
    /// The index of the first operation of each name.
    pub(crate) operations: FxHashMap<Name, usize>,
    /// The index of the first handler of each name.
    pub(crate) handlers: FxHashMap<Name, usize>,
}

/// The parameters and local variables in scope, innermost last.
#[derive(Debug, Default)]
pub(crate) struct LocalScope {
    all: Vec<(Name, VariableId)>,
    by_name: FxHashMap<Name, Vec<VariableId>>,
}

impl LocalScope {
    /// Adds a variable, which shadows those of its name.
    pub(crate) fn push(&mut self, name: &Name, id: VariableId) {
        self.all.push((name.clone(), id));
        self.by_name.entry(name.clone()).or_default().push(id);
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Removes all variables after the first `depth` ones.
    pub(crate) fn truncate(&mut self, depth: usize) {
        for (name, _) in self.all.drain(depth.min(self.all.len())..) {
            if let Some(all) = self.by_name.get_mut(&name) {
                all.pop();
            }
        }
    }

    /// Returns the names, outermost first.
    pub(crate) fn names(&self) -> impl Iterator<Item = &Name> {
        self.all.iter().map(|(name, _)| name)
    }

    fn get(&self, name: &str) -> Option<VariableId> {
        self.by_name.get(name)?.last().copied()
    }
}

/// Resolves names at a position in the programs of a core.
pub(crate) struct Resolver<'a, 'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) of: Decl<'db>,
    pub(crate) project: Project<'db>,
    /// The resolved names of codels.
    pub(crate) codels: RefCell<FxHashMap<Name, Result<Decl<'db>, Unresolved>>>,
    /// The features of its shell.
    pub(crate) features: &'db Features<'db>,
    pub(crate) core: &'db CoreScope,
    pub(crate) shared: &'a SharedNames,
    /// The parameters and local variables.
    pub(crate) scope: LocalScope,
    /// Whether the program is in the state machine, whose variables shadow those of the core, and callees. Other programs
    /// see these variables too, after those in scope; they do not shadow callees.
    pub(crate) is_in_machine: bool,
    /// Whether all variables are known: otherwise an unresolved name may be a missing variable.
    pub(crate) variables: Completeness,
}

impl<'db> Resolver<'_, 'db> {
    /// Returns the variable in scope, which also shadows callees: innermost first.
    fn variable(&self, name: &str) -> Option<VariableId> {
        let of_machine = || self.shared.machine.get(name).filter(|_| self.is_in_machine);
        self.scope.get(name).or_else(|| of_machine().or_else(|| self.shared.core.get(name)).copied())
    }

    /// Resolves the name of a value: to a variable in scope, innermost first, a variable of the state machine, or a feature of
    /// the shell.
    pub(crate) fn resolve_name(&self, name: &str) -> Option<Binding<'db>> {
        if name.is_empty() {
            return None;
        }
        let variable = self.variable(name).or_else(|| self.shared.machine.get(name).copied());
        let feature = || self.features.get(name).copied().map(Binding::Feature);
        variable.map(Binding::Variable).or_else(feature)
    }

    /// Resolves the name of a codel in the library of the core.
    pub(crate) fn resolve_codel(&self, name: &Name) -> Result<Decl<'db>, Unresolved> {
        if let Some(found) = self.codels.borrow().get(name) {
            return *found;
        }
        let library = self.of.library(self.db).as_ref();
        let found = resolve_path(self.db, self.project, library, Kind::Codel, std::slice::from_ref(name));
        self.codels.borrow_mut().insert(name.clone(), found);
        found
    }

    /// Resolves a call of `name`; `first` is its first argument if that is a name. The order of the lookup: a built-in
    /// function with the operand `first`, unless a codel or a provided operation has its name; variables, which shadow
    /// callees; features of the shell; codels.
    pub(crate) fn resolve_call(&self, name: &Name, first: Option<&Name>) -> ResolvedCall<'db> {
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
            _ if self.variable(name).is_some() => Err(CallError::NotCallable(None)),
            Some(FeatureKind::Provided) => {
                let defined = self.shared.operations.get(name).copied();
                defined.map(Callee::Operation).ok_or(CallError::Undefined)
            }
            Some(FeatureKind::Required) => Err(CallError::Required),
            Some(_) => Err(CallError::NotCallable(feature)),
            None => self.resolve_codel(name).map(Callee::Codel).map_err(CallError::Unresolved),
        };
        ResolvedCall { callee, has_operand }
    }

    /// Returns whether `first` is an operand of a built-in function. A port or operation takes precedence over a variable
    /// of the same name, unless a codel with the function's name may be missing.
    pub(crate) fn is_operand(&self, builtin: Builtin, first: &Name) -> bool {
        if builtin.operand() == Operand::Handler {
            return self.shared.handlers.contains_key(first);
        }
        let is_value = self.variable(first).is_some() && may_miss_names(self.db, self.project);
        !is_value && self.features.get(first).is_some_and(|feature| builtin.takes(feature.kind))
    }

    /// Returns whether `name` can only be the built-in function, and `first` is unresolved.
    fn is_unresolved_operand(&self, name: &Name, first: &Name) -> bool {
        let is_declared = |name: &Name| {
            self.variable(name).is_some()
                || self.features.get(name).is_some()
                || !matches!(self.resolve_codel(name), Err(Unresolved::Unknown))
        };
        (self.features.name_completeness() & self.variables).is_complete()
            && !is_declared(name)
            && !is_declared(first)
    }
}
