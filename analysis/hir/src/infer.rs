//! Resolves the names and calls in the programs of a core, and infers the types of all expressions, for each group of
//! bodies: an edit of one group does not invalidate the others.
//!
//! A core with an unresolved name or call is not analysed: `behaviour.rs` turns its [`NameProblem`] into a refusal. An
//! unresolved name has the unknown type, which is compatible with all types, so that a mistake gives one diagnostic.

mod calls;
mod context;

use std::cell::{OnceCell, RefCell};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{
    Body, BodyId, CoreScope, InitialValue, InitialValues, ProgramIn, ScopedCode, SharedVariable, bodies_of,
    core_scope, groups_of,
};
use crate::builtin::{Builtin, Operand};
use crate::completeness::Completeness;
use crate::fact::{
    CoreReason, Defined, Fact, FactKind, Hidden, ParameterName, ProgramName, SendInstead, Takes, repeated,
};
use crate::features::{FeatureOf, Features, features_of};
use crate::item_tree::{
    Direction, Expr, FeatureKind, Handler, HookKind, Kind, Name, NameRef, Operation, Parameter, SourceId,
    State, Statement, TypeRef, Variable,
};
use crate::names::{Unresolved, names_of, resolve_type, similar};
use crate::project::Project;
use crate::resolve::{Binding, CallError, Callee, LocalScope, Resolver, SharedNames, VariableId};
use crate::source::{Decl, Location, codel, core};
use crate::structure::structure_of;
use crate::types::{OperatorError, Signature, Type, Typed, type_of, type_of_value};

/// The bindings, callees and types of a group of bodies.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(crate) struct Inference<'db> {
    /// The parameters and local variables, in the order of the text.
    pub(crate) variables: Vec<VariableOf>,
    /// The bindings of the names of values, sorted by source: half the memory of a hash map.
    bindings: Box<[(SourceId, Binding<'db>)]>,
    /// The callees of the calls, sorted by the source of the name.
    callees: Box<[(SourceId, Callee<'db>)]>,
    /// Whether the name of a value or of a callee is unresolved.
    pub(crate) unresolved: bool,
    /// The definitions of other declarations that the bodies use.
    uses: Uses<'db>,
    /// The reasons not to analyse the core, by program, in the order of execution.
    pub(crate) problems: Problems<'db>,
    /// The type errors.
    pub(crate) facts: Vec<Fact<'db>>,
    /// The shared variables, if the core has only one group.
    shared: Option<Box<SharedVariables<'db>>>,
}

/// The unresolved names, by program.
pub(crate) type Problems<'db> = FxHashMap<(BodyId, ProgramIn), Vec<NameProblem<'db>>>;

/// A variable, parameter or handler.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableOf {
    /// Its name.
    pub name: NameRef,
    /// Its kind.
    pub kind: VariableKind,
    /// The type of its value.
    pub ty: Type,
    /// Its type as written; for a handler, its operation.
    pub written: Option<TypeRef>,
    /// Its value before all assignments.
    pub value: InitialValue,
}

/// The kinds of variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum VariableKind {
    Core,
    Machine,
    Local,
    Parameter(Direction),
    Handler,
}

/// An unresolved name in a program: the demand of the program is unknown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) enum NameProblem<'db> {
    /// An error.
    Error(Fact<'db>),
    /// An error that another fact reports.
    Reported(CoreReason),
    /// A name whose declaration another error may hide.
    Hidden(CoreReason),
}

/// Returns the signature with these parameters and result, written in `of`.
pub(crate) fn signature<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    parameters: &[Parameter],
    result: Option<&TypeRef>,
) -> Signature {
    let ty = |ty: Option<&TypeRef>| type_of(db, project, of, ty);
    let parameter = |it: &Parameter| (it.direction, it.name.name.clone(), ty(it.ty.as_ref()));
    Signature { parameters: parameters.iter().map(parameter).collect(), result: ty(result) }
}

/// The variables that all bodies of a core share.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct SharedVariables<'db> {
    /// The variables and handlers of the core, then the variables of its state machines.
    variables: Vec<VariableOf>,
    names: SharedNames,
    /// The errors of handlers.
    facts: Vec<Fact<'db>>,
}

/// Returns the shared variables of a core with several groups; [`Inference`] holds those of a core with one group.
#[salsa::tracked(returns(ref))]
fn shared_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> SharedVariables<'db> {
    core_scope(db, of).as_ref().map_or_else(SharedVariables::default, |scope| shared(db, project, of, scope))
}

fn shared<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &CoreScope,
) -> SharedVariables<'db> {
    let mut shared = SharedVariables::default();
    let declare = |it: &SharedVariable, kind| VariableOf {
        name: it.name.clone(),
        kind,
        ty: type_of_value(db, project, of, it.ty.as_ref()),
        written: it.ty.clone(),
        value: it.value,
    };
    shared.variables.extend(scope.variables.iter().map(|it| declare(it, VariableKind::Core)));
    let shell = resolve_type(db, project, of, Kind::Shell, scope.shell.as_ref()).ok();
    for handler in &scope.handlers {
        let found = shell.zip(handler.operation.as_ref());
        let found = found.map(|(shell, operation)| handler_type(db, project, of, shell, operation));
        let (ty, fact) = found.unwrap_or((Type::Unknown, None));
        shared.facts.extend(fact);
        shared.variables.push(VariableOf {
            name: handler.name.clone(),
            kind: VariableKind::Handler,
            ty,
            written: handler.operation.clone(),
            value: InitialValue::Plain,
        });
    }
    shared.variables.extend(scope.machine_variables.iter().map(|it| declare(it, VariableKind::Machine)));
    shared.variables.shrink_to_fit();
    for (index, variable) in shared.variables.iter().enumerate() {
        let id = VariableId { group: None, index: index as u32 };
        let names = match variable.kind {
            VariableKind::Machine => &mut shared.names.machine,
            _ => &mut shared.names.core,
        };
        names.insert(variable.name.name.clone(), id);
    }
    for (index, operation) in scope.operations.iter().enumerate() {
        shared.names.operations.entry(operation.name.name.clone()).or_insert(index);
    }
    for (index, handler) in scope.handlers.iter().enumerate() {
        shared.names.handlers.entry(handler.name.name.clone()).or_insert(index);
    }
    shared
}

/// Returns the type of a handler for `operation`, and the error if it is unknown, unless another fact reports the error.
fn handler_type<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    shell: Decl<'db>,
    operation: &TypeRef,
) -> (Type, Option<Fact<'db>>) {
    let features = features_of(db, project, shell);
    let unresolved = |name: Name, near| {
        let kind = FactKind::UnresolvedOperation { name, shell: shell.name(db).clone(), near };
        (Type::Unknown, Some(Fact::new(Location::Source(of, operation.id), kind)))
    };
    let is_required = |it: &FeatureOf<'db>| it.kind == FeatureKind::Required;
    match operation.path.as_slice() {
        // Even if the shell has an error elsewhere.
        [name] if features.get(name).is_some_and(is_required) => (Type::Handle(name.clone()), None),
        _ if features.completeness.is_incomplete() => (Type::Unknown, None),
        [name] if name.is_empty() => (Type::Unknown, None),
        [name] => {
            let required = features.by_name.iter().filter(|(_, found)| found.iter().any(is_required));
            unresolved(name.clone(), similar(name, required.map(|(name, _)| name)))
        }
        _ => unresolved(operation.to_string().into(), None),
    }
}

/// Resolves the names and infers the types of a group of bodies.
#[salsa::tracked(returns(ref))]
pub(crate) fn inference_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> Inference<'db> {
    infer(db, project, of, group, None)
}

/// Returns the types of the expressions of a group of bodies, by source. A query of its own, because only refactorings
/// need all types.
#[salsa::tracked(returns(ref))]
pub(crate) fn expression_types<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> FxHashMap<SourceId, Type> {
    let mut types = FxHashMap::default();
    infer(db, project, of, group, Some(&mut types));
    types
}

fn infer<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
    types: Option<&mut FxHashMap<SourceId, Type>>,
) -> Inference<'db> {
    let Some(scope) = core_scope(db, of) else { return Inference::default() };
    let shell = resolve_type(db, project, of, Kind::Shell, scope.shell.as_ref()).ok();
    let features = shell.map_or_else(Features::unknown, |shell| features_of(db, project, shell));
    let own = (scope.groups().len() == 1).then(|| Box::new(shared(db, project, of, scope)));
    let shared = own.as_deref().unwrap_or_else(|| shared_of(db, project, of));
    let resolver = Resolver {
        db,
        of,
        project,
        codels: RefCell::default(),
        features,
        core: scope,
        shared: &shared.names,
        scope: LocalScope::default(),
        is_in_machine: false,
        variables: scope.completeness,
    };
    let mut context = InferenceContext {
        db,
        project,
        of,
        group,
        body: BodyId::CoreValues,
        shared: &shared.variables,
        resolver,
        completeness: Completeness::Complete,
        program: ProgramIn::Whole,
        program_name: ProgramName::Effect,
        result: Type::Void,
        bindings: FxHashMap::default(),
        callees: FxHashMap::default(),
        found: Inference::default(),
        types,
    };
    for (id, body) in bodies_of(db, of, scope, group).iter() {
        context.resolver.scope.truncate(0);
        context.resolver.is_in_machine = matches!(id, BodyId::MachineValues | BodyId::State(..));
        context.body = *id;
        context.infer(body);
    }
    let InferenceContext { bindings, callees, mut found, .. } = context;
    found.variables.shrink_to_fit();
    let uses = Uses {
        completeness: bodies_of(db, of, scope, group).iter().map(|(_, body)| body.completeness()).collect(),
        codels: callees.values().filter_map(Callee::codel).collect(),
        features: bindings.values().filter_map(Binding::feature).collect(),
    };
    Inference { shared: own, bindings: sorted(bindings), callees: sorted(callees), uses, ..found }
}

fn sorted<T>(by_id: FxHashMap<SourceId, T>) -> Box<[(SourceId, T)]> {
    let mut sorted: Box<[(SourceId, T)]> = by_id.into_iter().collect();
    sorted.sort_unstable_by_key(|(id, _)| *id);
    sorted
}

fn get<T: Copy>(sorted: &[(SourceId, T)], id: SourceId) -> Option<T> {
    let index = sorted.binary_search_by_key(&id, |(id, _)| *id).ok()?;
    sorted.get(index).map(|(_, found)| *found)
}

impl<'db> Inference<'db> {
    pub(crate) fn binding(&self, id: SourceId) -> Option<Binding<'db>> {
        get(&self.bindings, id)
    }

    /// Returns the parameter or local variable of this group that is declared at a source.
    pub(crate) fn local(&self, group: u32, declared: SourceId) -> VariableId {
        let index = self.variables.partition_point(|it| it.name.id < declared);
        VariableId { group: Some(group), index: index as u32 }
    }

    pub(crate) fn bindings(&self) -> impl Iterator<Item = (SourceId, Binding<'db>)> {
        self.bindings.iter().copied()
    }

    pub(crate) fn callee(&self, id: SourceId) -> Option<Callee<'db>> {
        get(&self.callees, id)
    }
}

struct InferenceContext<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
    body: BodyId,
    shared: &'a [VariableOf],
    resolver: Resolver<'a, 'db>,
    /// Whether the current program has no syntax error.
    completeness: Completeness,
    program: ProgramIn,
    /// The name of the current program, for its `return` statements.
    program_name: ProgramName,
    /// The type that the current program must return.
    result: Type,
    bindings: FxHashMap<SourceId, Binding<'db>>,
    callees: FxHashMap<SourceId, Callee<'db>>,
    found: Inference<'db>,
    /// The types of all expressions, if requested.
    types: Option<&'a mut FxHashMap<SourceId, Type>>,
}

/// Returns whether every path ends with a `return`.
pub fn returns(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Return(..) => true,
        Statement::Block(inner) => returns(inner),
        Statement::If { then, otherwise, .. } => {
            returns(then) && otherwise.as_ref().is_some_and(|it| returns(it))
        }
        _ => false,
    })
}

/// Returns the variables that all bodies of a core share: its own and its handlers, then those of its state machines.
pub(crate) fn shared_variables<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> &'db [VariableOf] {
    &shared_in(db, project, of).variables
}

fn shared_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> &'db SharedVariables<'db> {
    let has_one_group = groups_of(db, of).len() == 1;
    let own = has_one_group.then(|| inference_of(db, project, of, 0).shared.as_deref()).flatten();
    own.unwrap_or_else(|| shared_of(db, project, of))
}

/// The bindings, callees and types of all bodies of a core.
pub struct CoreInference<'db> {
    scope: Option<&'db CoreScope>,
    shared: &'db SharedVariables<'db>,
    /// The groups of bodies, each with the number of variables in the shared variables and the previous groups.
    groups: Vec<(&'db Inference<'db>, usize)>,
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    /// For several groups: the first source of each body except initial values, with its group. Most users need only facts.
    by_source: OnceCell<Vec<(SourceId, u32)>>,
}

/// Resolves the names and infers the types of all bodies of a core.
pub fn inference_of_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> CoreInference<'db> {
    let scope = core_scope(db, of).as_ref();
    let shared = shared_in(db, project, of);
    let mut found = CoreInference { scope, shared, groups: Vec::new(), db, of, by_source: OnceCell::new() };
    let mut variables = shared.variables.len();
    for group in scope.map_or(0..0, CoreScope::groups) {
        let inference = inference_of(db, project, of, group);
        found.groups.push((inference, variables));
        variables += inference.variables.len();
    }
    found
}

impl<'db> CoreInference<'db> {
    /// Returns the names that all programs share.
    pub(crate) fn shared_names(&self) -> &'db SharedNames {
        &self.shared.names
    }

    /// Returns all variables, parameters and handlers: the shared ones, then those of each group.
    pub fn variables(&self) -> impl Iterator<Item = (VariableId, &'db VariableOf)> {
        let shared = [(None, &self.shared.variables)].into_iter();
        let groups = self.groups.iter().zip(0..).map(|((it, _), group)| (Some(group), &it.variables));
        shared.chain(groups).flat_map(|(group, all)| {
            let with_id = move |(index, it)| (VariableId { group, index: index as u32 }, it);
            all.iter().enumerate().map(with_id)
        })
    }

    /// Returns a variable.
    pub fn variable(&self, id: VariableId) -> Option<&'db VariableOf> {
        let all = match id.group {
            None => &self.shared.variables,
            Some(group) => &self.groups.get(group as usize)?.0.variables,
        };
        all.get(id.index as usize)
    }

    /// Returns the index of a variable in [`CoreInference::variables`].
    pub fn number(&self, id: VariableId) -> usize {
        let before =
            id.group.and_then(|group| self.groups.get(group as usize)).map_or(0, |(_, before)| *before);
        before + id.index as usize
    }

    /// Returns the binding of the name of a value, by its source.
    pub fn binding(&self, id: SourceId) -> Option<Binding<'db>> {
        self.at(id).find_map(|it| it.binding(id))
    }

    /// Returns the variable that a name refers to, by its source.
    pub fn variable_at(&self, id: SourceId) -> Option<VariableId> {
        match self.binding(id)? {
            Binding::Variable(id) => Some(id),
            Binding::Feature(_) => None,
        }
    }

    /// Returns the callee of a call, by the source of its name.
    pub fn callee(&self, id: SourceId) -> Option<Callee<'db>> {
        self.at(id).find_map(|it| it.callee(id))
    }

    /// Returns the groups that may contain a source.
    pub(crate) fn groups_at(&self, id: SourceId) -> impl Iterator<Item = u32> + use<> {
        let by_source = self.by_source.get_or_init(|| self.by_source());
        let before = by_source.partition_point(|(first, _)| *first <= id);
        let own = before.checked_sub(1).and_then(|index| by_source.get(index)).map(|(_, group)| *group);
        // The sources of initial values are between those of other bodies.
        let values = self.scope.and_then(|scope| scope.group(BodyId::MachineValues)).unwrap_or_default();
        own.into_iter().chain([0, values])
    }

    fn by_source(&self) -> Vec<(SourceId, u32)> {
        if self.groups.len() <= 1 {
            return Vec::new();
        }
        let (Some(core), Some(scope)) = (core(self.db, self.of), self.scope) else { return Vec::new() };
        let first = |id| Some((core.first_id(id)?, scope.group(id)?));
        let mut by_source: Vec<(SourceId, u32)> = core.bodies().filter_map(first).collect();
        by_source.sort_unstable();
        by_source
    }

    fn at(&self, id: SourceId) -> impl Iterator<Item = &'db Inference<'db>> {
        self.groups_at(id).filter_map(|group| self.groups.get(group as usize)).map(|(it, _)| *it)
    }

    /// Returns the bindings of all names of values, with their sources.
    pub fn bindings(&self) -> impl Iterator<Item = (SourceId, Binding<'db>)> {
        self.groups.iter().flat_map(|(it, _)| it.bindings())
    }

    /// Returns the callees of all calls.
    pub fn callees(&self) -> impl Iterator<Item = Callee<'db>> {
        self.groups.iter().flat_map(|(it, _)| it.callees.iter().map(|(_, callee)| *callee))
    }

    /// Returns whether the name of a value or of a callee is unresolved.
    pub fn is_unresolved(&self) -> bool {
        self.groups.iter().any(|(it, _)| it.unresolved)
    }

    /// Returns the type errors.
    pub fn facts(&self) -> impl Iterator<Item = &'db Fact<'db>> {
        self.shared.facts.iter().chain(self.groups.iter().flat_map(|(it, _)| &it.facts))
    }

    /// Returns the direction of each of the `count` arguments of a call.
    pub fn directions(&self, db: &'db dyn ModelDb, callee: Callee<'db>, count: usize) -> Vec<Direction> {
        self.scope.map_or_else(Vec::new, |scope| directions_of(db, scope, callee, count))
    }
}

/// Returns the direction of each of the `count` arguments of a call in a core.
pub(crate) fn directions_of<'db>(
    db: &'db dyn ModelDb,
    core: &CoreScope,
    callee: Callee<'db>,
    count: usize,
) -> Vec<Direction> {
    let own = |parameters: &[Parameter], completeness: Completeness| match completeness {
        Completeness::Complete => parameters.iter().map(|it| it.direction).collect(),
        Completeness::Incomplete => vec![UNKNOWN_DIRECTION; count],
    };
    let mut directions: Vec<Direction> = match callee {
        Callee::Codel(of) => codel(db, of).map_or_else(Vec::new, |it| own(&it.parameters, it.completeness)),
        Callee::Operation(index) => {
            core.operations.get(index).map_or_else(Vec::new, |it| own(&it.parameters, it.completeness))
        }
        Callee::Builtin(Builtin::Read) => vec![Direction::In, Direction::Out],
        Callee::Builtin(Builtin::Collect) => {
            std::iter::once(Direction::In).chain(std::iter::repeat_n(Direction::Out, count)).collect()
        }
        Callee::Builtin(Builtin::Write | Builtin::Status | Builtin::Send) => Vec::new(),
    };
    directions.resize(count, Direction::In);
    directions
}

/// The direction of an argument whose parameter is unknown: the callee may read and assign it.
pub(crate) const UNKNOWN_DIRECTION: Direction = Direction::InOut;

/// The definitions of other declarations that the programs of a core use.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Uses<'db> {
    /// Whether all uses are known: an incomplete program or an unresolved name may use any definition.
    pub completeness: Completeness,
    /// The codels that they call.
    pub codels: FxHashSet<Decl<'db>>,
    /// The features of shells that they name.
    pub features: FxHashSet<FeatureOf<'db>>,
}

/// Returns the definitions that the programs of a core use.
#[salsa::tracked(returns(ref))]
pub fn uses_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Uses<'db> {
    let mut uses = Uses { completeness: total_completeness(db, project, of), ..Uses::default() };
    for group in groups_of(db, of) {
        let inference = inference_of(db, project, of, group);
        uses.completeness &= Completeness::of(!inference.unresolved);
        uses.codels.extend(&inference.uses.codels);
        uses.features.extend(&inference.uses.features);
    }
    uses
}

/// Returns whether a core, its state machines and its programs are complete.
pub(crate) fn total_completeness<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Completeness {
    let own = structure_of(db, of).map_or(Completeness::Complete, |core| {
        core.completeness & core.machines.iter().map(|it| it.completeness).collect()
    });
    own & groups_of(db, of).map(|group| inference_of(db, project, of, group).uses.completeness).collect()
}
