//! Resolves the names and calls in the programs of a core, and infers the types of all expressions, for each group of
//! bodies: an edit of one group does not invalidate the others.
//!
//! A core with an unresolved name or call is not analysed: `behaviour.rs` turns its [`NameProblem`] into a refusal. An
//! unresolved name has the unknown type, which is compatible with all types, so that a mistake gives one diagnostic.

use std::cell::{OnceCell, RefCell};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{
    Body, BodyId, Code, CoreScope, InitialValues, ProgramIn, SharedVariable, bodies_of, core_scope, groups_of,
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
use crate::resolve::{Binding, CallError, Callee, Resolver, Scope, SharedNames, VariableId};
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
    shared: Option<Box<Shared<'db>>>,
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
    /// Whether it has an initial value, or a value from a caller.
    pub has_value: bool,
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
struct Shared<'db> {
    /// The variables and handlers of the core, then the variables of its state machines.
    variables: Vec<VariableOf>,
    names: SharedNames,
    /// The errors of handlers.
    facts: Vec<Fact<'db>>,
}

/// Returns the shared variables of a core with several groups; [`Inference`] holds those of a core with one group.
#[salsa::tracked(returns(ref))]
fn shared_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Shared<'db> {
    core_scope(db, of).as_ref().map_or_else(Shared::default, |scope| shared(db, project, of, scope))
}

fn shared<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, scope: &CoreScope) -> Shared<'db> {
    let mut shared = Shared::default();
    let declare = |it: &SharedVariable, kind| VariableOf {
        name: it.name.clone(),
        kind,
        ty: type_of_value(db, project, of, it.ty.as_ref()),
        written: it.ty.clone(),
        has_value: it.has_value,
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
            has_value: true,
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
        scope: Scope::default(),
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

impl<'db> InferenceContext<'_, 'db> {
    fn infer(&mut self, body: &Body) {
        match body {
            Body::InitialValues(values) => self.initial_values(values),
            Body::Operation(operation) => self.operation(operation),
            Body::Hook(hook) => {
                let result = match hook.kind {
                    HookKind::Configure | HookKind::Start => Type::Bool,
                    HookKind::Update | HookKind::Stop | HookKind::Cleanup => Type::Void,
                };
                let (code, name) = (Code::Program(&hook.program), ProgramName::Hook(hook.kind));
                self.code(ProgramIn::Whole, code, name, result);
            }
            Body::State(state) => self.state(state),
        }
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.facts.push(Fact::new(Location::Source(self.of, id), kind));
    }

    fn problem(&mut self, problem: NameProblem<'db>) {
        self.found.problems.entry((self.body, self.program)).or_default().push(problem);
    }

    fn error(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.problem(NameProblem::Error(Fact::new(Location::Source(self.of, id), kind)));
    }

    /// Returns the number of errors in the program so far, without names that another error may hide.
    fn errors(&self) -> usize {
        let problems = self.found.problems.get(&(self.body, self.program)).into_iter().flatten();
        problems.filter(|problem| !matches!(problem, NameProblem::Hidden(_))).count()
    }

    fn type_of_value(&self, ty: Option<&TypeRef>) -> Type {
        type_of_value(self.db, self.project, self.of, ty)
    }

    fn declare(&mut self, variable: VariableOf) {
        let id = VariableId { group: Some(self.group), index: self.found.variables.len() as u32 };
        self.resolver.scope.push(&variable.name.name, id);
        self.found.variables.push(variable);
    }

    fn variable(&self, id: VariableId) -> Option<&VariableOf> {
        let all = if id.group.is_some() { &self.found.variables } else { self.shared };
        all.get(id.index as usize)
    }

    fn signature(&self, of: Decl<'db>, parameters: &[Parameter], result: Option<&TypeRef>) -> Signature {
        signature(self.db, self.project, of, parameters, result)
    }

    fn initial_values(&mut self, values: &InitialValues) {
        self.completeness = values.completeness;
        self.program = ProgramIn::Whole;
        values.variables.iter().for_each(|variable| self.initial_value(variable));
    }

    fn initial_value(&mut self, variable: &Variable) {
        if let Some(value) = &variable.value {
            let expected = self.type_of_value(variable.ty.as_ref());
            self.assigned(&variable.name.name, &expected, value);
        }
    }

    fn operation(&mut self, operation: &Operation) {
        let name = &operation.name.name;
        let own = self.signature(self.of, &operation.parameters, operation.result.as_ref());
        let declared = self.declared(name, FeatureKind::Provided);
        let result = match (&operation.result, &declared) {
            (Some(_), _) => own.result.clone(),
            (None, Some((declared, _))) => declared.result.clone(),
            // Another fact reports the missing declaration.
            (None, None) => Type::Unknown,
        };
        let defined = Signature { result: result.clone(), ..own };
        if let Some((declared, declared_at)) = declared
            && operation.program.completeness.is_complete()
            && !defined.is(&declared)
        {
            let fixed = self.as_declared(operation).map(|text| (operation.signature, text));
            let (name, defined) = (name.clone(), defined.clone());
            let kind = FactKind::OperationDefinition { name, declared, defined, declared_at, fixed };
            self.report(operation.name.id, kind);
        }
        for (parameter, (direction, _, ty)) in operation.parameters.iter().zip(defined.parameters) {
            self.declare(VariableOf {
                name: parameter.name.clone(),
                kind: VariableKind::Parameter(direction),
                ty,
                written: parameter.ty.clone(),
                has_value: direction != Direction::Out,
            });
        }
        let needs_return = result != Type::Void && result != Type::Unknown;
        if needs_return
            && operation.program.completeness.is_complete()
            && !returns(&operation.program.statements)
        {
            let kind = FactKind::MissingReturn { name: name.clone(), expected: result.clone() };
            self.report(operation.name.id, kind);
        }
        let of = ProgramName::Operation(name.clone());
        self.code(ProgramIn::Whole, Code::Program(&operation.program), of, result);
    }

    fn state(&mut self, state: &State) {
        for (program, code) in state.code() {
            let name = match program {
                ProgramIn::Method(index) => {
                    state.methods.get(index as usize).map(|it| ProgramName::Method(it.kind))
                }
                _ => None,
            };
            self.code(program, code, name.unwrap_or(ProgramName::Effect), Type::Void);
        }
    }

    fn code(&mut self, program: ProgramIn, code: Code<'_>, name: ProgramName, result: Type) {
        (self.program, self.program_name, self.result) = (program, name, result);
        match code {
            Code::Program(code) => {
                self.completeness = code.completeness;
                let variables = self.resolver.variables;
                self.resolver.variables &= code.completeness;
                self.block(&code.statements);
                self.resolver.variables = variables;
            }
            Code::Guard(guard) => {
                self.completeness = guard.completeness;
                self.condition(&guard.condition);
            }
        }
    }

    /// Returns the signature that the shell declares, such as `(in far: double): bool`, if its types resolve to the same
    /// types in this core. The parameters keep the names of `operation`, which its program uses.
    fn as_declared(&self, operation: &Operation) -> Option<String> {
        let feature = self.resolver.features.get(&operation.name.name)?;
        let data = feature.data(self.db)?;
        let of = |decl| self.signature(decl, &data.parameters, data.ty.as_ref());
        let missing = data.parameters.len().checked_sub(operation.parameters.len())?;
        if !of(self.of).is(&of(feature.shell))
            || operation.parameters.iter().any(|it| it.name.name.is_empty())
        {
            return None;
        }
        let own = operation.parameters.iter().map(|it| &it.name.name);
        let added = data.parameters.iter().skip(data.parameters.len() - missing).map(|it| &it.name.name);
        let names: Vec<&Name> = own.chain(added).collect();
        let mut seen = FxHashSet::default();
        if !names.iter().all(|name| seen.insert(*name)) {
            return None;
        }
        let parameters = data.parameters.iter().zip(names).map(|(declared, name)| {
            Some(format!("{} {name}: {}", declared.direction.keyword(), declared.ty.as_ref()?))
        });
        let parameters: Option<Vec<String>> = parameters.collect();
        Some(format!("({}): {}", parameters?.join(", "), data.ty.as_ref()?))
    }

    /// Returns the signature that the shell declares for an operation, and the location of the declaration, if the signature
    /// is complete.
    fn declared(&self, name: &str, kind: FeatureKind) -> Option<(Signature, Location<'db>)> {
        let feature = self.resolver.features.get(name).filter(|feature| feature.kind == kind)?;
        let data = feature.data(self.db).filter(|it| it.completeness.is_complete())?;
        let signature = self.signature(feature.shell, &data.parameters, data.ty.as_ref());
        Some((signature, Location::Source(feature.shell, data.name.id)))
    }

    fn block(&mut self, statements: &[Statement]) {
        let depth = self.resolver.scope.len();
        for statement in statements {
            self.statement(statement);
        }
        self.resolver.scope.truncate(depth);
        let own = statements.iter().filter_map(Statement::variable);
        self.found.facts.extend(repeated(self.of, own.map(|it| (&it.name, Defined::Variable))));
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Variable(variable) => {
                self.initial_value(variable);
                self.declare(VariableOf {
                    name: variable.name.clone(),
                    kind: VariableKind::Local,
                    ty: self.type_of_value(variable.ty.as_ref()),
                    written: variable.ty.clone(),
                    has_value: variable.value.is_some(),
                });
            }
            Statement::If { id, condition, then, end, otherwise } => {
                self.condition(condition);
                self.block(then);
                match otherwise {
                    Some(otherwise) => self.block(otherwise),
                    None if self.completeness.is_complete() => {
                        self.report(*id, FactKind::MissingElse { end: *end })
                    }
                    None => {}
                }
            }
            Statement::Block(statements) => self.block(statements),
            Statement::Return(id, value) => self.return_statement(*id, value.as_ref()),
            Statement::Assign(target, value) => {
                let expected = self.target(target);
                self.assigned(&target.name, &expected, value);
            }
            Statement::Expr(value) => self.expression_statement(value),
        }
    }

    fn expression_statement(&mut self, value: &Expr) {
        let errors = self.errors();
        match value {
            Expr::Call { callee, arguments, id } => {
                let ty = self.call(callee, arguments, Some(*id));
                if let Some(types) = &mut self.types {
                    types.insert(*id, ty);
                }
            }
            value => _ = self.expr(value),
        }
        // A call without a name or without parentheses. (Another fact reports the name of a codel.)
        if let Some(id) =
            without_call(value).filter(|_| self.errors() == errors && self.completeness.is_complete())
        {
            self.error(id, FactKind::NoEffect);
        }
    }

    fn condition(&mut self, condition: &Expr) {
        let found = self.expr(condition).ty;
        if !found.is(&Type::Bool)
            && let Some(id) = condition.id()
        {
            self.report(id, FactKind::ConditionType { found });
        }
    }

    fn return_statement(&mut self, keyword: SourceId, value: Option<&Expr>) {
        let (found, id) = match value {
            Some(value) => (self.expr(value), value.id().unwrap_or(keyword)),
            None => (Typed::of(Type::Void), keyword),
        };
        let fits = match (value, &self.result) {
            // A call without a result is not allowed either.
            (Some(_), Type::Void) => found.ty == Type::Unknown,
            (_, expected) => found.ty.fits(found.value.as_ref(), expected),
        };
        if !fits && self.completeness.is_complete() {
            let (of, expected) = (self.program_name.clone(), self.result.clone());
            self.report(id, FactKind::ReturnType { of, expected, found: found.ty });
        }
    }

    fn target(&mut self, target: &NameRef) -> Type {
        let is = match self.value(target, Role::Target) {
            Some(Binding::Variable(id)) => {
                let Some(variable) = self.variable(id) else { return Type::Unknown };
                if variable.kind != VariableKind::Parameter(Direction::In) {
                    return variable.ty.clone();
                }
                None
            }
            Some(Binding::Feature(feature)) if !feature.kind.is_operation() => Some(feature.kind),
            // Another fact reports that the operation is not called.
            Some(Binding::Feature(_)) | None => return Type::Unknown,
        };
        self.report(target.id, FactKind::NotAssignable { name: target.name.clone(), is });
        Type::Unknown
    }

    fn assigned(&mut self, name: &Name, expected: &Type, value: &Expr) {
        self.check(value, expected, |expected, found| FactKind::AssignmentType {
            name: name.clone(),
            expected,
            found,
        });
    }

    /// Infers the type of `value`, and reports `mismatch`, of the expected and the actual type, unless the value fits.
    fn check(&mut self, value: &Expr, expected: &Type, mismatch: impl FnOnce(Type, Type) -> FactKind<'db>) {
        let found = self.expr(value);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(id) = value.id()
        {
            self.report(id, mismatch(expected.clone(), found.ty));
        }
    }

    /// Resolves the name of a value. Reports an unresolved name, and a call without parentheses.
    fn value(&mut self, name: &NameRef, role: Role) -> Option<Binding<'db>> {
        let binding = self.bind(name);
        if name.name.is_empty() {
            return binding;
        }
        match binding {
            Some(Binding::Feature(feature)) if feature.kind.is_operation() => {
                let name_of = name.name.clone();
                let kind = FactKind::NotCalled { name: name_of, is_operation: true, takes_nothing: false };
                self.error(name.id, kind);
            }
            Some(_) => {}
            None => self.unresolved_value(name, role),
        }
        binding
    }

    fn unresolved_value(&mut self, NameRef { name, id }: &NameRef, role: Role) {
        match self.resolver.resolve_codel(name) {
            found @ (Ok(_) | Err(Unresolved::Ambiguous | Unresolved::Repeated)) => {
                let data = found.ok().and_then(|of| codel(self.db, of));
                let takes_nothing = data.is_some_and(|it| it.parameters.is_empty());
                let kind = FactKind::NotCalled { name: name.clone(), is_operation: false, takes_nothing };
                self.error(*id, kind);
            }
            // Another fact reports the error that may hide the declaration.
            Err(_)
                if (self.resolver.features.name_completeness() & self.resolver.variables).is_incomplete() =>
            {
                self.problem(NameProblem::Hidden(CoreReason::MayBeDeclared(name.clone())));
            }
            Err(_) => {
                let near = self.similar_value(name, role);
                self.error(*id, FactKind::UnresolvedVariable { name: name.clone(), near });
            }
        }
    }

    /// Returns the name in scope that `name` is most likely a misspelling of, and that may stand in its place.
    fn similar_value(&self, name: &Name, role: Role) -> Option<Name> {
        let is_variable = |name: &&Name| match self.resolver.resolve_name(name) {
            Some(Binding::Variable(id)) => self.variable(id).is_some_and(|it| role.takes(it.kind)),
            _ => false,
        };
        let of_core = |it: &&VariableOf| it.kind != VariableKind::Machine;
        let of_machine = |it: &&VariableOf| !of_core(it) && self.resolver.is_in_machine;
        let shared = self.shared.iter().filter(of_core).chain(self.shared.iter().filter(of_machine));
        let names = shared.map(|it| &it.name.name).chain(self.resolver.scope.names());
        let variables = names.filter(is_variable);
        let features = self.resolver.features.by_name.iter().filter(|_| role == Role::Value);
        let values = features.filter(|(_, found)| found.iter().any(|it| it.kind.is_value()));
        similar(name, variables.chain(values.map(|(name, _)| name)))
    }

    /// Resolves a name and records its binding, without reports.
    fn bind(&mut self, name: &NameRef) -> Option<Binding<'db>> {
        let binding = self.resolver.resolve_name(&name.name);
        match binding {
            Some(binding) => _ = self.bindings.insert(name.id, binding),
            None => self.found.unresolved = true,
        }
        binding
    }

    fn name(&mut self, name: &NameRef) -> Type {
        match self.value(name, Role::Value) {
            Some(Binding::Variable(id)) => {
                self.variable(id).map_or(Type::Unknown, |variable| variable.ty.clone())
            }
            Some(Binding::Feature(feature)) if feature.kind.is_value() => feature.ty(self.db, self.project),
            Some(Binding::Feature(feature)) if feature.kind.is_port() => {
                let (name_of, is_status) = (name.name.clone(), false);
                let kind = FactKind::PortAsValue { name: name_of, kind: feature.kind, is_status };
                self.report(name.id, kind);
                Type::Unknown
            }
            // Another fact reports that an operation is not called.
            Some(Binding::Feature(_)) | None => Type::Unknown,
        }
    }

    fn expr(&mut self, expr: &Expr) -> Typed {
        let typed = self.infer_expr(expr);
        if let (Some(types), Some(id)) = (&mut self.types, expr.id()) {
            types.insert(id, typed.ty.clone());
        }
        typed
    }

    fn infer_expr(&mut self, expr: &Expr) -> Typed {
        match expr {
            Expr::Missing => Typed::UNKNOWN,
            // The syntax error is reported; type errors may follow from it.
            Expr::Incomplete(inner) => {
                let reported = self.found.facts.len();
                self.expr(inner);
                self.found.facts.truncate(reported);
                Typed::UNKNOWN
            }
            Expr::Literal(literal, id) => self.computed(Typed::literal(literal), *id),
            Expr::Name(name) => Typed::of(self.name(name)),
            Expr::Unary(operator, inner, id) => Typed::least(*operator, inner).unwrap_or_else(|| {
                let inner = self.expr(inner);
                self.computed(inner.unary(*operator), *id)
            }),
            Expr::Binary(operator, lhs, rhs, id) => {
                let reported = self.found.facts.len();
                let (left, right) = (self.expr(lhs), self.expr(rhs));
                if [&left.ty, &right.ty].contains(&&Type::PortStatus) {
                    self.compared_with_status(reported, [lhs, rhs]);
                }
                self.computed(left.binary(*operator, &right), *id)
            }
            Expr::Call { callee, arguments, .. } => Typed::of(self.call(callee, arguments, None)),
        }
    }

    /// Notes that a port beside an operand of type port status, reported as a value, is one whose status is needed.
    fn compared_with_status(&mut self, reported: usize, operands: [&Expr; 2]) {
        let at = |id| Location::Source(self.of, id);
        let operands = operands.map(|it| it.id().map(at));
        for fact in self.found.facts.iter_mut().skip(reported) {
            if let FactKind::PortAsValue { is_status, .. } = &mut fact.kind {
                *is_status |= operands.contains(&Some(fact.at.clone()));
            }
        }
    }

    fn computed(&mut self, found: Result<Typed, OperatorError>, id: SourceId) -> Typed {
        found.unwrap_or_else(|error| {
            self.report(id, FactKind::Operation(error));
            Typed::UNKNOWN
        })
    }

    /// Resolves and checks a call, and returns the type of its result. `statement`: the call, if it is a statement, whose
    /// result is ignored.
    fn call(&mut self, callee: &NameRef, arguments: &[Expr], statement: Option<SourceId>) -> Type {
        let first = first_name(arguments).map(|first| &first.name);
        let resolved = self.resolver.resolve_call(&callee.name, first);
        match resolved.callee {
            Ok(found) => {
                self.callees.insert(callee.id, found);
                self.resolved_call(found, callee, arguments, resolved.has_operand)
            }
            Err(error) => {
                self.found.unresolved = true;
                for (index, argument) in arguments.iter().enumerate() {
                    match argument {
                        Expr::Name(name)
                            if index == 0
                                && (resolved.has_operand || self.is_wrong_operand(callee, &error, name)) =>
                        {
                            _ = self.bind(name);
                        }
                        // If `read` is misspelt, a port is correct here.
                        Expr::Name(name) => _ = self.value(name, Role::Value),
                        argument => _ = self.expr(argument),
                    }
                }
                self.unresolved_call(error, callee, arguments, statement);
                Type::Unknown
            }
        }
    }

    fn resolved_call(
        &mut self,
        found: Callee<'db>,
        callee: &NameRef,
        arguments: &[Expr],
        has_operand: bool,
    ) -> Type {
        match found {
            Callee::Codel(of) => {
                let data = codel(self.db, of).filter(|it| it.completeness.is_complete());
                let signature = data.map(|it| self.signature(of, &it.parameters, it.result.as_ref()));
                let (parameters, result) = signature.map(|it| (it.parameters, it.result)).unzip();
                self.call_arguments(callee, parameters, arguments, has_operand);
                result.unwrap_or(Type::Unknown)
            }
            Callee::Operation(index) => {
                let Some(operation) = self.resolver.core.operations.get(index) else { return Type::Unknown };
                let own = self.signature(self.of, &operation.parameters, operation.result.as_ref());
                let is_complete = operation.completeness.is_complete();
                self.call_arguments(callee, is_complete.then_some(own.parameters), arguments, has_operand);
                match (&operation.result, self.declared(&callee.name, FeatureKind::Provided)) {
                    _ if !is_complete => Type::Unknown,
                    (None, Some((declared, _))) => declared.result,
                    (None, None) if self.resolver.features.completeness.is_incomplete() => Type::Unknown,
                    (None, None) => Type::Void,
                    (Some(_), _) => own.result,
                }
            }
            Callee::Builtin(builtin @ (Builtin::Read | Builtin::Write | Builtin::Status)) => {
                self.port(builtin, callee, arguments)
            }
            Callee::Builtin(Builtin::Send) => self.send(callee, arguments),
            Callee::Builtin(Builtin::Collect) => self.collect(callee, arguments),
        }
    }

    fn unresolved_call(
        &mut self,
        error: CallError,
        callee: &NameRef,
        arguments: &[Expr],
        statement: Option<SourceId>,
    ) {
        let NameRef { name, id } = callee;
        let kind = match error {
            CallError::Undefined => {
                let undefined = CoreReason::UndefinedOperation(name.clone());
                return self.problem(NameProblem::Reported(undefined));
            }
            CallError::Required => {
                let handlers = &self.resolver.core.handlers;
                let handler = handlers
                    .iter()
                    .find(|handler| handler.operation.as_ref().and_then(|it| it.path.last()) == Some(name));
                let send = handler.zip(statement).map(|(handler, call)| SendInstead {
                    handler: handler.name.name.clone(),
                    call,
                    first: arguments.first().and_then(Expr::id),
                });
                FactKind::BlockingCall { name: name.clone(), send }
            }
            CallError::NotCallable(is) => {
                if is.is_none() {
                    self.bind(callee);
                }
                FactKind::NotCallable { name: name.clone(), is, hides: self.hidden_by(name) }
            }
            CallError::UnresolvedOperand(function) => {
                return self.unresolved_operand(function, first_name(arguments));
            }
            CallError::Unresolved(Unresolved::Ambiguous) => {
                FactKind::AmbiguousName { kind: Kind::Codel, name: name.clone() }
            }
            CallError::Unresolved(Unresolved::Repeated) => {
                return self.problem(NameProblem::Reported(CoreReason::RepeatedCodel(name.clone())));
            }
            CallError::Unresolved(Unresolved::Incomplete) => {
                let not_found =
                    CoreReason::CodelNotFound(name.clone(), names_of(self.db, self.project).may_hide());
                return self.problem(NameProblem::Hidden(not_found));
            }
            // Another fact reports the shell that may declare the operation.
            CallError::Unresolved(_) if self.resolver.features.completeness.is_incomplete() => {
                return self.problem(NameProblem::Hidden(CoreReason::MayBeOperation(name.clone())));
            }
            // So is a port without a name, which may be the operand.
            CallError::Unresolved(_)
                if Builtin::of_name(name).is_some()
                    && self.resolver.features.value_completeness.is_incomplete() =>
            {
                return self.problem(NameProblem::Hidden(CoreReason::MayBeOperation(name.clone())));
            }
            CallError::Unresolved(_) => match Builtin::of_name(name) {
                Some(builtin) => self.not_builtin(builtin, arguments),
                None => FactKind::UnresolvedCodel {
                    core: self.of,
                    name: name.clone(),
                    arguments: arguments.len(),
                    builtin: self.misspelt_builtin(name, first_name(arguments)),
                },
            },
        };
        self.error(*id, kind);
    }

    /// Returns whether `first` is the wrong first argument of a built-in function, which is reported at the function.
    fn is_wrong_operand(&self, callee: &NameRef, error: &CallError, first: &NameRef) -> bool {
        matches!(error, CallError::Unresolved(Unresolved::Unknown))
            && self.resolver.features.completeness.is_complete()
            && Builtin::of_name(&callee.name).is_some()
            && self.resolver.resolve_name(&first.name).is_some()
    }

    /// Returns the fact for a call of a built-in function with a wrong first argument.
    fn not_builtin(&self, function: Builtin, arguments: &[Expr]) -> FactKind<'db> {
        let Some(name) = first_name(arguments) else {
            return FactKind::NotBuiltin { function, first: None, swapped: None, instead: None };
        };
        let first = self.resolver.resolve_name(&name.name).map(|binding| match binding {
            Binding::Variable(_) => (name.name.clone(), None),
            Binding::Feature(feature) => (name.name.clone(), Some(feature.kind)),
        });
        let swapped = match arguments {
            [_, Expr::Name(second)] if self.resolver.is_operand(function, &second.name) => {
                Some([name.clone(), second.clone()])
            }
            _ => None,
        };
        let handlers = &self.resolver.core.handlers;
        let operation = |handler: &Handler| Some(handler.operation.as_ref()?.path.last()?.clone());
        let instead = match function.operand() {
            Operand::Handler => {
                let mut of_it = handlers.iter().filter(|it| operation(it).as_ref() == Some(&name.name));
                of_it.next().filter(|_| of_it.next().is_none()).map(|it| it.name.name.clone())
            }
            Operand::Operation => handlers.iter().find(|it| it.name.name == name.name).and_then(operation),
            Operand::Port(_) => None,
        };
        let instead = instead.map(|instead| NameRef { name: instead, id: name.id });
        FactKind::NotBuiltin { function, first, swapped, instead }
    }

    /// Returns the built-in function that `name` may be a misspelling of, and that takes the argument `first`.
    fn misspelt_builtin(&self, name: &Name, first: Option<&NameRef>) -> Option<Builtin> {
        let takes = |it: &Builtin| first.is_some_and(|first| self.resolver.is_operand(*it, &first.name));
        let fitting: Vec<Name> = Builtin::ALL.into_iter().filter(takes).map(|it| it.name().into()).collect();
        Builtin::of_name(&similar(name, &fitting)?)
    }

    /// Returns the definition that a name shadows although the name cannot be called.
    fn hidden_by(&self, name: &Name) -> Option<Hidden> {
        match self.resolver.resolve_codel(name) {
            Err(Unresolved::Unknown) => Builtin::of_name(name).map(|_| Hidden::Builtin),
            _ => Some(Hidden::Codel),
        }
    }

    fn unresolved_operand(&mut self, function: Builtin, first: Option<&NameRef>) {
        let Some(NameRef { name, id }) = first else { return };
        let features = self.resolver.features.by_name.iter();
        let fitting = features.filter(|(_, found)| found.iter().any(|it| function.takes(it.kind)));
        let is_handler = function.operand() == Operand::Handler;
        let handlers = self.resolver.core.handlers.iter().map(|it| &it.name.name).filter(|_| is_handler);
        let near = similar(name, fitting.map(|(name, _)| name).chain(handlers));
        self.error(*id, FactKind::UnresolvedOperand { function, name: name.clone(), near });
    }

    /// Reports a wrong number of arguments; returns `is_correct`.
    fn check_count(&mut self, callee: &NameRef, takes: Takes, is_correct: bool, found: usize) -> bool {
        if !is_correct && self.completeness.is_complete() {
            let kind = FactKind::ArgumentCount { callee: callee.name.clone(), takes, found };
            self.report(callee.id, kind);
        }
        is_correct
    }

    /// Checks the arguments of a call of a codel or an operation, whose `parameters` are unknown if its signature has an error.
    fn call_arguments(
        &mut self,
        callee: &NameRef,
        parameters: Option<Vec<(Direction, Name, Type)>>,
        arguments: &[Expr],
        has_operand: bool,
    ) {
        let parameters = parameters.filter(|all| {
            let takes = Takes::Arguments(all.len());
            self.check_count(callee, takes, all.len() == arguments.len(), arguments.len())
        });
        let parameters = parameters.into_iter().flatten();
        let parameters: Vec<ParameterOf> =
            parameters.map(|(direction, name, ty)| (direction, ParameterName::Named(name), ty)).collect();
        let operands = usize::from(has_operand).min(arguments.len());
        let (operand, arguments) = arguments.split_at(operands);
        let (of_operand, parameters) = parameters.split_at(operands.min(parameters.len()));
        // The operand of a built-in function is not a call without parentheses.
        let program = (self.body, self.program);
        let problems = self.found.problems.get(&program).map_or(0, Vec::len);
        self.arguments(&callee.name, of_operand, operand);
        if let Some(all) = self.found.problems.get_mut(&program) {
            all.truncate(problems);
        }
        self.arguments(&callee.name, parameters, arguments);
    }

    /// Checks arguments against the parameters, as far as these are known.
    fn arguments(&mut self, callee: &Name, parameters: &[ParameterOf], arguments: &[Expr]) {
        for (index, argument) in arguments.iter().enumerate() {
            match parameters.get(index) {
                Some((Direction::In, name, ty)) => {
                    self.check(argument, ty, |expected, found| FactKind::ArgumentType {
                        callee: callee.clone(),
                        parameter: name.clone(),
                        expected,
                        found,
                    })
                }
                Some((_, name, ty)) => self.output(callee, name.clone(), ty, argument),
                None => _ = self.expr(argument),
            }
        }
    }

    fn output(&mut self, callee: &Name, parameter: ParameterName, expected: &Type, argument: &Expr) {
        let Some(id) = argument.id() else {
            _ = self.expr(argument);
            return;
        };
        let no_variable = FactKind::OutArgument { callee: callee.clone(), parameter: parameter.clone() };
        let Expr::Name(name) = argument else {
            self.expr(argument);
            self.report(id, no_variable);
            return;
        };
        match self.value(name, Role::Target) {
            Some(Binding::Variable(variable)) => {
                let Some(variable) = self.variable(variable) else { return };
                if matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In)) {
                    self.report(id, no_variable);
                } else if !variable.ty.is(expected) {
                    let (callee, expected, found) = (callee.clone(), expected.clone(), variable.ty.clone());
                    self.report(id, FactKind::ArgumentType { callee, parameter, expected, found });
                }
            }
            Some(Binding::Feature(feature)) if !feature.kind.is_operation() => self.report(id, no_variable),
            // Another fact reports that the operation is not called.
            Some(Binding::Feature(_)) | None => {}
        }
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some(Expr::Name(port)) = arguments.first() else { return Type::Unknown };
        let mut ty = Type::Unknown;
        if let Some(&feature) = self.resolver.features.get(&port.name) {
            self.bindings.insert(port.id, Binding::Feature(feature));
            ty = feature.ty(self.db, self.project);
            if function.operand() != Operand::Port(feature.kind) {
                let kind = FactKind::PortDirection { function, port: port.name.clone(), is: feature.kind };
                self.report(port.id, kind);
            }
        }
        let count = if function == Builtin::Status { 1 } else { 2 };
        let is_correct =
            self.check_count(callee, Takes::Port(function), arguments.len() == count, arguments.len());
        for argument in arguments.iter().skip(1) {
            match function {
                Builtin::Read if is_correct => {
                    self.output(&callee.name, ParameterName::Named(port.name.clone()), &ty, argument);
                }
                Builtin::Write if is_correct => self.assigned(&port.name, &ty, argument),
                _ => _ = self.expr(argument),
            }
        }
        match function {
            Builtin::Write => Type::Void,
            // One mistake gives one diagnostic.
            _ if !is_correct => Type::Unknown,
            _ => Type::PortStatus,
        }
    }

    /// `send(operation, in and inout arguments…)`
    fn send(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(operation), rest)) = arguments.split_first() else { return Type::Unknown };
        let Some((signature, _)) = self.declared(&operation.name, FeatureKind::Required) else {
            self.arguments(&operation.name, &[], rest);
            return Type::Unknown;
        };
        if let Some(&feature) = self.resolver.features.get(&operation.name) {
            self.bindings.insert(operation.id, Binding::Feature(feature));
        }
        let inputs = signature.parameters.into_iter().filter(|(direction, ..)| *direction != Direction::Out);
        let inputs: Vec<ParameterOf> =
            inputs.map(|(_, name, ty)| (Direction::In, ParameterName::Named(name), ty)).collect();
        let takes = Takes::Send { operation: operation.name.clone(), values: inputs.len() };
        let is_correct = self.check_count(callee, takes, rest.len() == inputs.len(), rest.len());
        self.arguments(&operation.name, if is_correct { &inputs } else { &[] }, rest);
        Type::Handle(operation.name.clone())
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(handler), rest)) = arguments.split_first() else { return Type::Unknown };
        self.bind(handler);
        let index = self.resolver.shared.handlers.get(&handler.name);
        let of = index.and_then(|&index| self.resolver.core.handlers.get(index));
        let operation = of.and_then(|it| it.operation.as_ref()?.path.last());
        let declared = operation.and_then(|name| self.declared(name, FeatureKind::Required));
        let Some((signature, _)) = declared else {
            self.arguments(&callee.name, &[], rest);
            return Type::CallStatus;
        };
        let result = Some(signature.result).filter(|result| *result != Type::Void);
        let result = result.map(|ty| (Direction::Out, ParameterName::Result, ty));
        let outputs = signature.parameters.into_iter().filter(|(direction, ..)| *direction != Direction::In);
        let outputs = outputs.map(|(_, name, ty)| (Direction::Out, ParameterName::Named(name), ty));
        let outputs: Vec<ParameterOf> = result.into_iter().chain(outputs).collect();
        let takes = Takes::Collect { values: outputs.len() };
        let is_correct = rest.is_empty() || rest.len() == outputs.len();
        let is_correct = self.check_count(callee, takes, is_correct, rest.len());
        self.arguments(&callee.name, if is_correct { &outputs } else { &[] }, rest);
        Type::CallStatus
    }
}

/// The role of a name in a program.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// It is read.
    Value,
    /// It is assigned.
    Target,
}

impl Role {
    /// Returns whether a variable of this kind may have the role.
    fn takes(self, kind: VariableKind) -> bool {
        match self {
            Role::Value => kind != VariableKind::Handler,
            Role::Target => kind != VariableKind::Parameter(Direction::In),
        }
    }
}

/// The direction in which an argument is passed, its parameter, and the type of the parameter.
type ParameterOf = (Direction, ParameterName, Type);

/// Returns the first argument if it is a name.
fn first_name(arguments: &[Expr]) -> Option<&NameRef> {
    match arguments.first() {
        Some(Expr::Name(name)) => Some(name),
        _ => None,
    }
}

/// Returns the source of the first value in an expression without calls. (A missing expression is a syntax error.)
fn without_call(expr: &Expr) -> Option<SourceId> {
    let mut values = expr.descendants().filter(|it| matches!(it, Expr::Literal(..) | Expr::Name(_)));
    if expr.may_call() { None } else { values.next()?.id() }
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

/// Returns the names that all bodies of a core share.
pub(crate) fn shared_names<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> &'db SharedNames {
    &shared_in(db, project, of).names
}

fn shared_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> &'db Shared<'db> {
    let has_one_group = groups_of(db, of).len() == 1;
    let own = has_one_group.then(|| inference_of(db, project, of, 0).shared.as_deref()).flatten();
    own.unwrap_or_else(|| shared_of(db, project, of))
}

/// The bindings, callees and types of all bodies of a core.
pub struct CoreInference<'db> {
    scope: Option<&'db CoreScope>,
    shared: &'db Shared<'db>,
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
