//! What each name in a core's programs refers to, what each call calls, and the types of all expressions: body by body, so
//! that an edit of one body reads no other again.
//!
//! A name or a call that refers to nothing keeps the core from being analysed: that is a [`NameProblem`], which `behaviour.rs`
//! turns into a refusal. Such a name is of unknown type, which fits everywhere, so that one mistake is one diagnostic.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{
    Body, BodyId, Code, CoreScope, InitialValues, ProgramIn, SharedVariable, bodies_of, core_scope,
};
use crate::builtin::{Builtin, Operand};
use crate::completeness::Completeness;
use crate::fact::{
    CoreReason, Defined, Fact, FactKind, Hidden, NotAssignable, NotCallable, ParameterName, ProgramName,
    SendInstead, Takes, repeated,
};
use crate::features::{Features, feature, features_of};
use crate::item_tree::{
    Core, Direction, Expr, FeatureKind, HookKind, Kind, Name, NameRef, Operation, Parameter, SourceId, State,
    Statement, TypeRef, Variable,
};
use crate::names::{Unresolved, names_of, similar};
use crate::project::Project;
use crate::resolve::{Binding, CallError, Callee, Resolver, Scope, VariableId};
use crate::source::{Decl, Location, codel, core};
use crate::types::{Signature, Type, Typed, Wrong, type_of, type_of_value};

/// What is known of a group of bodies.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Inference<'db> {
    /// The parameters and local variables, in the order in which they are met.
    pub variables: Vec<VariableOf>,
    /// What names of values refer to, sorted by their ids: half the memory of a hash map.
    bindings: Box<[(SourceId, Binding<'db>)]>,
    /// What is called, sorted by the id of its name.
    callees: Box<[(SourceId, Callee<'db>)]>,
    /// Whether the name of a value or of a callee is unresolved.
    pub unresolved: bool,
    /// What keeps the core from being analysed, by program, in the order of execution.
    pub problems: FxHashMap<(BodyId, ProgramIn), Vec<NameProblem<'db>>>,
    /// What is wrong with types.
    pub facts: Vec<Fact<'db>>,
    /// Of the only group of a core: what its bodies share.
    shared: Option<Box<Shared<'db>>>,
}

/// Something that a program may assign to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableOf {
    /// Its name.
    pub name: NameRef,
    /// What it is.
    pub kind: VariableKind,
    /// The type of what it holds.
    pub ty: Type,
    /// Its type as it is written; of a handler, its operation.
    pub written: Option<TypeRef>,
    /// Whether it has an initial value, or one from a caller.
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

/// An unresolved name in a program, so that what the program executes is unknown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum NameProblem<'db> {
    /// An error.
    Error(Fact<'db>),
    /// An error that is reported elsewhere.
    Reported(CoreReason),
    /// A name whose declaration an error elsewhere may hide.
    Hidden(CoreReason),
}

/// The signature that is written in `of`.
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

/// What all bodies of a core share.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Shared<'db> {
    /// The variables and handlers of the core, then the variables of its state machines.
    pub variables: Vec<VariableOf>,
    /// What is wrong with them.
    pub facts: Vec<Fact<'db>>,
}

/// The variables that all bodies of a core of several groups share; those of a core of one group are in its inference.
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
    let shell = names_of(db, project).resolve_type(db, of, Kind::Shell, scope.shell.as_ref()).ok();
    for handler in &scope.handlers {
        let ty = shell.zip(handler.operation.as_ref()).map(|(shell, operation)| {
            handled(db, project, of, shell, operation).unwrap_or_else(|fact| {
                shared.facts.extend(fact.map(|fact| *fact));
                Type::Unknown
            })
        });
        shared.variables.push(VariableOf {
            name: handler.name.clone(),
            kind: VariableKind::Handler,
            ty: ty.unwrap_or(Type::Unknown),
            written: handler.operation.clone(),
            has_value: true,
        });
    }
    shared.variables.extend(scope.machine_variables.iter().map(|it| declare(it, VariableKind::Machine)));
    shared
}

/// Returns the type of a handler for `operation`; otherwise the error, unless it is reported elsewhere.
fn handled<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    shell: Decl<'db>,
    operation: &TypeRef,
) -> Result<Type, Option<Box<Fact<'db>>>> {
    let features = features_of(db, project, shell);
    if features.completeness.is_incomplete() {
        return Err(None);
    }
    let unresolved = |name: Name, near| {
        let kind = FactKind::UnresolvedOperation { name, shell: shell.name(db).clone(), near };
        Err(Some(Box::new(Fact::new(Location::Source(of, operation.id), kind))))
    };
    let [name] = operation.path.as_slice() else { return unresolved(operation.to_string().into(), None) };
    if name.is_empty() {
        return Err(None);
    }
    if features.get(name).is_some_and(|it| it.kind == FeatureKind::Required) {
        return Ok(Type::Handle(name.clone()));
    }
    let required =
        features.by_name.iter().filter(|(_, found)| found.iter().any(|it| it.kind == FeatureKind::Required));
    unresolved(name.clone(), similar(name, required.map(|(name, _)| name)))
}

/// Resolves and types a group of bodies.
#[salsa::tracked(returns(ref))]
pub(crate) fn inference_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> Inference<'db> {
    inferred(db, project, of, group, None)
}

/// The types of the expressions of a group of bodies, by their locations: only refactorings ask for all of them.
#[salsa::tracked(returns(ref))]
pub(crate) fn expression_types<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> FxHashMap<SourceId, Type> {
    let mut types = FxHashMap::default();
    inferred(db, project, of, group, Some(&mut types));
    types
}

fn inferred<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
    types: Option<&mut FxHashMap<SourceId, Type>>,
) -> Inference<'db> {
    let Some(scope) = core_scope(db, of) else { return Inference::default() };
    let shell = names_of(db, project).resolve_type(db, of, Kind::Shell, scope.shell.as_ref()).ok();
    // What an unknown shell provides may be called.
    let none = Features { completeness: Completeness::Incomplete, ..Features::default() };
    let features = shell.map_or(&none, |shell| features_of(db, project, shell));
    let own = (scope.groups().len() == 1).then(|| Box::new(shared(db, project, of, scope)));
    let shared = &own.as_deref().unwrap_or_else(|| shared_of(db, project, of)).variables;
    let mut resolver = Resolver {
        db,
        of,
        names: names_of(db, project),
        features,
        core: scope,
        scope: Scope::default(),
        machine: Scope::default(),
        variables: scope.completeness,
    };
    for (index, variable) in shared.iter().enumerate() {
        let id = VariableId { group: None, index: index as u32 };
        let scope = match variable.kind {
            VariableKind::Machine => &mut resolver.machine,
            _ => &mut resolver.scope,
        };
        scope.push(&variable.name.name, id);
    }
    let depth = resolver.scope.len();
    let mut context = InferenceContext {
        db,
        project,
        of,
        group,
        body: BodyId::CoreValues,
        core: scope,
        shared,
        resolver,
        completeness: Completeness::Complete,
        program: ProgramIn::Whole,
        bindings: FxHashMap::default(),
        callees: FxHashMap::default(),
        found: Inference::default(),
        types,
    };
    for (id, body) in bodies_of(db, of, scope, group).iter() {
        context.resolver.scope.truncate(depth);
        context.body = *id;
        context.read(body);
    }
    let InferenceContext { bindings, callees, found, .. } = context;
    Inference { shared: own, bindings: sorted(bindings), callees: sorted(callees), ..found }
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
    /// What a call calls, by the id of its name.
    pub(crate) fn callee(&self, id: SourceId) -> Option<Callee<'db>> {
        get(&self.callees, id)
    }
}

/// What a program gives back.
enum Gives {
    Nothing,
    /// A bool, and true without any `return`.
    Bool,
    Value(Type),
}

struct InferenceContext<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
    /// The body that is read.
    body: BodyId,
    core: &'db CoreScope,
    /// The variables that all bodies share.
    shared: &'a [VariableOf],
    resolver: Resolver<'a, 'db>,
    /// Whether nothing was lost in the program that is read.
    completeness: Completeness,
    /// The program that is read.
    program: ProgramIn,
    bindings: FxHashMap<SourceId, Binding<'db>>,
    callees: FxHashMap<SourceId, Callee<'db>>,
    found: Inference<'db>,
    /// The types of expressions, where they are asked for.
    types: Option<&'a mut FxHashMap<SourceId, Type>>,
}

impl<'db> InferenceContext<'_, 'db> {
    fn read(&mut self, body: &Body) {
        match body {
            Body::InitialValues(values) => self.initial_values(values),
            Body::Operation(operation) => self.operation(operation),
            Body::Hook(hook) => {
                let gives = match hook.kind {
                    HookKind::Configure | HookKind::Start => Gives::Bool,
                    HookKind::Update | HookKind::Stop | HookKind::Cleanup => Gives::Nothing,
                };
                let (code, name) = (Code::Program(&hook.program), ProgramName::Hook(hook.kind));
                self.code(ProgramIn::Whole, code, &name, &gives);
            }
            Body::State(state) => self.state(state),
        }
    }

    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        let at = self.at(id);
        self.found.facts.push(Fact::new(at, kind));
    }

    fn problem(&mut self, problem: NameProblem<'db>) {
        self.found.problems.entry((self.body, self.program)).or_default().push(problem);
    }

    fn error(&mut self, id: SourceId, kind: FactKind<'db>) {
        let at = self.at(id);
        self.problem(NameProblem::Error(Fact::new(at, kind)));
    }

    /// The number of errors in the program so far, without names that an error elsewhere may hide.
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

    /// Programs of the state machine see its variables before those of the core, and call nothing that these hide.
    fn enter_machine(&mut self) {
        self.resolver.enter_machine();
    }

    fn initial_values(&mut self, values: &InitialValues) {
        self.completeness = values.completeness;
        self.program = ProgramIn::Whole;
        if self.body == BodyId::MachineValues {
            self.enter_machine();
        }
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
        let own = signature(self.db, self.project, self.of, &operation.parameters, operation.result.as_ref());
        let declared = self.declared(name, FeatureKind::Provided);
        let result = match (&operation.result, &declared) {
            (Some(_), _) => own.result.clone(),
            (None, Some((declared, _))) => declared.result.clone(),
            // That it is not declared is reported; the type of its result is unknown.
            (None, None) => Type::Unknown,
        };
        if let Some((declared, declared_at)) = declared
            && operation.program.completeness.is_complete()
        {
            let defined = Signature { result: result.clone(), ..own.clone() };
            if !defined.is(&declared) {
                let fixed = self.as_declared(operation).map(|text| (operation.signature, text));
                let kind = FactKind::OperationDefinition {
                    name: name.clone(),
                    declared,
                    defined,
                    declared_at,
                    fixed,
                };
                self.report(operation.name.id, kind);
            }
        }
        for (parameter, (direction, _, ty)) in operation.parameters.iter().zip(own.parameters) {
            self.declare(VariableOf {
                name: parameter.name.clone(),
                kind: VariableKind::Parameter(direction),
                ty,
                written: parameter.ty.clone(),
                has_value: direction != Direction::Out,
            });
        }
        let must = result != Type::Void && result != Type::Unknown;
        if must && operation.program.completeness.is_complete() && !returns(&operation.program.statements) {
            let kind = FactKind::MissingReturn { name: name.clone(), expected: result.clone() };
            self.report(operation.name.id, kind);
        }
        let gives = if result == Type::Void { Gives::Nothing } else { Gives::Value(result) };
        let of = ProgramName::Operation(name.clone());
        self.code(ProgramIn::Whole, Code::Program(&operation.program), &of, &gives);
    }

    fn state(&mut self, state: &State) {
        self.enter_machine();
        for (program, code) in state.code() {
            let name = match program {
                ProgramIn::Method(index) => {
                    state.methods.get(index as usize).map(|it| ProgramName::Method(it.kind))
                }
                _ => None,
            };
            self.code(program, code, &name.unwrap_or(ProgramName::Effect), &Gives::Nothing);
        }
    }

    fn code(&mut self, program: ProgramIn, code: Code<'_>, name: &ProgramName, gives: &Gives) {
        self.program = program;
        match code {
            Code::Program(code) => {
                self.completeness = code.completeness;
                let variables = self.resolver.variables;
                self.resolver.variables &= code.completeness;
                self.block(&code.statements, name, gives);
                self.resolver.variables = variables;
            }
            Code::Guard(guard) => {
                self.completeness = guard.completeness;
                self.condition(&guard.condition);
            }
        }
    }

    /// `(in far: double): bool`, as the shell declares it, where it means the same in this core; its own parameters keep
    /// their names, which its program has.
    fn as_declared(&self, operation: &Operation) -> Option<String> {
        let feature = self.resolver.features.get(&operation.name.name)?;
        let data = feature.data(self.db)?;
        let of = |decl| signature(self.db, self.project, decl, &data.parameters, data.ty.as_ref());
        let missing = data.parameters.len().checked_sub(operation.parameters.len())?;
        if !of(self.of).is(&of(feature.shell))
            || operation.parameters.iter().any(|it| it.name.name.is_empty())
        {
            return None;
        }
        let own = operation.parameters.iter().map(|it| &it.name.name);
        let more = data.parameters.iter().skip(data.parameters.len() - missing).map(|it| &it.name.name);
        let names: Vec<&Name> = own.chain(more).collect();
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

    /// What the shell declares of an operation, and where.
    fn declared(&self, name: &str, kind: FeatureKind) -> Option<(Signature, Location<'db>)> {
        let feature = self.resolver.features.get(name).filter(|feature| feature.kind == kind)?;
        let data = feature.data(self.db)?;
        let signature = signature(self.db, self.project, feature.shell, &data.parameters, data.ty.as_ref());
        Some((signature, Location::Source(feature.shell, data.name.id)))
    }

    fn block(&mut self, statements: &[Statement], of: &ProgramName, gives: &Gives) {
        let depth = self.resolver.scope.len();
        for statement in statements {
            self.statement(statement, of, gives);
        }
        let own: Vec<NameRef> =
            self.resolver.scope.from(depth).filter_map(|id| Some(self.variable(id)?.name.clone())).collect();
        self.resolver.scope.truncate(depth);
        self.found.facts.extend(repeated(self.of, own.iter().map(|name| (name, Defined::Variable))));
    }

    fn statement(&mut self, statement: &Statement, of: &ProgramName, gives: &Gives) {
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
                self.block(then, of, gives);
                match otherwise {
                    Some(otherwise) => self.block(otherwise, of, gives),
                    None if self.completeness.is_complete() => {
                        self.report(*id, FactKind::MissingElse { end: *end })
                    }
                    None => {}
                }
            }
            Statement::Block(statements) => self.block(statements, of, gives),
            Statement::Return(id, value) => self.returned(*id, value.as_ref(), of, gives),
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
                let call = SendableCall { id: *id, first: arguments.first().and_then(Expr::id) };
                let ty = self.call(callee, arguments, Some(call));
                if let Some(types) = &mut self.types {
                    types.insert(*id, ty);
                }
            }
            value => _ = self.expr(value),
        }
        // A call without a name or without brackets. (The name of a codel is reported already.)
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

    fn returned(&mut self, keyword: SourceId, value: Option<&Expr>, of: &ProgramName, gives: &Gives) {
        let expected = match gives {
            Gives::Nothing => &Type::Void,
            Gives::Bool => &Type::Bool,
            Gives::Value(ty) => ty,
        };
        let (found, id) = match value {
            Some(value) => (self.expr(value), value.id().unwrap_or(keyword)),
            None => (Typed::of(Type::Void), keyword),
        };
        let fits = match (value, gives) {
            // A value of no type is one all the same.
            (Some(_), Gives::Nothing) => found.ty == Type::Unknown,
            _ => found.ty.fits(found.value.as_ref(), expected),
        };
        if !fits && self.completeness.is_complete() {
            let (of, expected) = (of.clone(), expected.clone());
            self.report(id, FactKind::ReturnType { of, expected, found: found.ty });
        }
    }

    /// The type of what is assigned to.
    fn target(&mut self, target: &NameRef) -> Type {
        let is = match self.value(target) {
            Some(Binding::Variable(id)) => {
                let Some(variable) = self.variable(id) else { return Type::Unknown };
                if variable.kind != VariableKind::Parameter(Direction::In) {
                    return variable.ty.clone();
                }
                NotAssignable::InParameter
            }
            Some(Binding::Feature(of, index)) => match feature(self.db, of, index).map(|it| it.kind) {
                Some(FeatureKind::Property) => NotAssignable::Property,
                Some(FeatureKind::Constant) => NotAssignable::Constant,
                Some(FeatureKind::Output) => NotAssignable::OutputPort,
                Some(FeatureKind::Input) => NotAssignable::InputPort,
                // An operation is reported as one that is not called.
                _ => return Type::Unknown,
            },
            None => return Type::Unknown,
        };
        self.report(target.id, FactKind::NotAssignable { name: target.name.clone(), is });
        Type::Unknown
    }

    fn assigned(&mut self, name: &Name, expected: &Type, value: &Expr) {
        let found = self.expr(value);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(id) = value.id()
        {
            let (name, expected) = (name.clone(), expected.clone());
            self.report(id, FactKind::AssignmentType { name, expected, found: found.ty });
        }
    }

    /// What the name of a value refers to. A name that is no value may be a call without brackets.
    fn value(&mut self, name: &NameRef) -> Option<Binding<'db>> {
        let binding = self.bind(name);
        if name.name.is_empty() {
            return binding;
        }
        match binding {
            Some(Binding::Variable(_)) => {}
            Some(Binding::Feature(of, index)) => {
                if feature(self.db, of, index).is_some_and(|it| it.kind.is_operation()) {
                    let kind = FactKind::NotCalled { name: name.name.clone(), is_operation: true };
                    self.error(name.id, kind);
                }
            }
            None => self.unresolved_value(name),
        }
        binding
    }

    fn unresolved_value(&mut self, NameRef { name, id }: &NameRef) {
        match self.resolver.resolve_codel(name) {
            Ok(_) | Err(Unresolved::Ambiguous | Unresolved::Repeated) => {
                self.error(*id, FactKind::NotCalled { name: name.clone(), is_operation: false });
            }
            // One mistake: the error that may hide its declaration is reported.
            Err(_) if (self.resolver.features.completeness & self.resolver.variables).is_incomplete() => {
                self.problem(NameProblem::Hidden(CoreReason::MayBeDeclared(name.clone())));
            }
            Err(_) => {
                let known = self.resolver.scope.names().chain(self.resolver.features.by_name.keys());
                let near = similar(name, known);
                self.error(*id, FactKind::UnresolvedVariable { name: name.clone(), near });
            }
        }
    }

    /// Notes what a name refers to, whether a value is meant or not.
    fn bind(&mut self, name: &NameRef) -> Option<Binding<'db>> {
        let binding = self.resolver.resolve_name(&name.name);
        match binding {
            Some(binding) => _ = self.bindings.insert(name.id, binding),
            None => self.found.unresolved = true,
        }
        binding
    }

    fn name(&mut self, name: &NameRef) -> Type {
        match self.value(name) {
            Some(Binding::Variable(id)) => {
                self.variable(id).map_or(Type::Unknown, |variable| variable.ty.clone())
            }
            Some(Binding::Feature(of, index)) => {
                // A port is read with `read`, an operation is called.
                let data = feature(self.db, of, index).filter(|it| !it.kind.is_operation());
                let Some(data) = data else { return Type::Unknown };
                if data.kind.is_port() {
                    let kind = FactKind::PortAsValue { name: name.name.clone(), kind: data.kind };
                    self.report(name.id, kind);
                    return Type::Unknown;
                }
                type_of(self.db, self.project, of, data.ty.as_ref())
            }
            None => Type::Unknown,
        }
    }

    fn expr(&mut self, expr: &Expr) -> Typed {
        let typed = self.typed(expr);
        if let (Some(types), Some(id)) = (&mut self.types, expr.id()) {
            types.insert(id, typed.ty.clone());
        }
        typed
    }

    fn typed(&mut self, expr: &Expr) -> Typed {
        match expr {
            Expr::Missing => Typed::UNKNOWN,
            // That something is wrong in it is reported.
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
                let (lhs, rhs) = (self.expr(lhs), self.expr(rhs));
                self.computed(lhs.binary(*operator, &rhs), *id)
            }
            Expr::Call { callee, arguments, .. } => Typed::of(self.call(callee, arguments, None)),
        }
    }

    /// Returns the result; where there is none, the reason is reported.
    fn computed(&mut self, found: Result<Typed, Wrong>, id: SourceId) -> Typed {
        found.unwrap_or_else(|wrong| {
            self.report(id, wrong.into());
            Typed::UNKNOWN
        })
    }

    /// Resolves and checks a call; gives the type of its result. `statement` where it is a statement, whose result is dropped.
    fn call(&mut self, callee: &NameRef, arguments: &[Expr], statement: Option<SendableCall>) -> Type {
        let first = match arguments.first() {
            Some(Expr::Name(first)) => Some(first),
            _ => None,
        };
        let resolved = self.resolver.resolve_call(&callee.name, first.map(|it| &it.name));
        match resolved.callee {
            Ok(found) => {
                self.callees.insert(callee.id, found);
                self.resolved_call(found, callee, arguments, resolved.has_operand)
            }
            Err(error) => {
                self.found.unresolved = true;
                for (index, argument) in arguments.iter().enumerate() {
                    match argument {
                        Expr::Name(name) if index == 0 && resolved.has_operand => _ = self.bind(name),
                        // A port is right where `read` is misspelt.
                        Expr::Name(name) => _ = self.value(name),
                        argument => _ = self.expr(argument),
                    }
                }
                self.unresolved_call(error, callee, first, statement);
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
                let Some(data) = codel(self.db, of) else { return Type::Unknown };
                let signature = signature(self.db, self.project, of, &data.parameters, data.result.as_ref());
                self.arguments(callee, &signature.parameters, arguments, has_operand);
                signature.result
            }
            Callee::Operation(index) => {
                let Some(operation) = self.core.operations.get(index) else { return Type::Unknown };
                let own = signature(
                    self.db,
                    self.project,
                    self.of,
                    &operation.parameters,
                    operation.result.as_ref(),
                );
                self.arguments(callee, &own.parameters, arguments, has_operand);
                match (&operation.result, self.declared(&callee.name, FeatureKind::Provided)) {
                    (None, Some((declared, _))) => declared.result,
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
        first: Option<&NameRef>,
        statement: Option<SendableCall>,
    ) {
        let NameRef { name, id } = callee;
        let kind = match error {
            CallError::Undefined => {
                let undefined = CoreReason::UndefinedOperation(name.clone());
                return self.problem(NameProblem::Reported(undefined));
            }
            CallError::Required => {
                let handlers = &self.core.handlers;
                let handler = handlers
                    .iter()
                    .find(|handler| handler.operation.as_ref().and_then(|it| it.path.last()) == Some(name));
                let send = handler.zip(statement).map(|(handler, SendableCall { id: call, first })| {
                    SendInstead { handler: handler.name.name.clone(), call, first }
                });
                FactKind::BlockingCall { name: name.clone(), send }
            }
            CallError::NotCallable(is) => {
                if is == NotCallable::Variable {
                    self.bind(callee);
                }
                FactKind::NotCallable { name: name.clone(), is, hides: self.hidden_by(name) }
            }
            CallError::UnresolvedOperand(function) => return self.unresolved_operand(function, first),
            CallError::Unresolved(Unresolved::Ambiguous) => {
                FactKind::AmbiguousName { kind: Kind::Codel, name: name.clone() }
            }
            CallError::Unresolved(Unresolved::Repeated) => {
                return self.problem(NameProblem::Reported(CoreReason::RepeatedCodel(name.clone())));
            }
            CallError::Unresolved(Unresolved::Incomplete) => {
                let not_found = CoreReason::CodelNotFound(name.clone(), self.resolver.names.may_hide());
                return self.problem(NameProblem::Hidden(not_found));
            }
            // One mistake: the shell that may declare it is reported.
            CallError::Unresolved(_) if self.resolver.features.completeness.is_incomplete() => {
                return self.problem(NameProblem::Hidden(CoreReason::MayBeOperation(name.clone())));
            }
            CallError::Unresolved(_) => match Builtin::of_name(name) {
                Some(builtin) => FactKind::NotBuiltin(builtin),
                None => FactKind::UnresolvedCodel { core: self.of, name: name.clone() },
            },
        };
        self.error(*id, kind);
    }

    /// What has the name of something that cannot be called.
    fn hidden_by(&self, name: &Name) -> Option<Hidden> {
        match self.resolver.resolve_codel(name) {
            Err(Unresolved::Unknown) => Builtin::of_name(name).map(|_| Hidden::Builtin),
            _ => Some(Hidden::Codel),
        }
    }

    /// The first argument of a built-in function is no port, operation or handler, nor anything else.
    fn unresolved_operand(&mut self, function: Builtin, first: Option<&NameRef>) {
        let Some(NameRef { name, id }) = first else { return };
        let features = self.resolver.features.by_name.iter();
        let fitting = features.filter(|(_, found)| found.iter().any(|it| function.takes(it.kind)));
        let is_handler = function.operand() == Operand::Handler;
        let handlers = self.core.handlers.iter().map(|it| &it.name.name).filter(|_| is_handler);
        let near = similar(name, fitting.map(|(name, _)| name).chain(handlers));
        self.error(*id, FactKind::UnresolvedOperand { function, name: name.clone(), near });
    }

    /// Reports a wrong number of arguments.
    fn count(&mut self, callee: &NameRef, takes: Takes, is_right: bool, found: usize) -> bool {
        if !is_right && self.completeness.is_complete() {
            let kind = FactKind::ArgumentCount { callee: callee.name.clone(), takes, found };
            self.report(callee.id, kind);
        }
        is_right
    }

    fn arguments(
        &mut self,
        callee: &NameRef,
        parameters: &[(Direction, Name, Type)],
        arguments: &[Expr],
        has_operand: bool,
    ) {
        let takes = Takes::Arguments(parameters.len());
        let is_right = self.count(callee, takes, parameters.len() == arguments.len(), arguments.len());
        for (index, argument) in arguments.iter().enumerate() {
            let problems = self.found.problems.get(&(self.body, self.program)).map_or(0, Vec::len);
            match parameters.get(index).filter(|_| is_right) {
                Some((Direction::In, name, ty)) => {
                    self.input(&callee.name, ParameterName::Named(name.clone()), ty, argument);
                }
                Some((_, name, ty)) => {
                    self.output(&callee.name, ParameterName::Named(name.clone()), ty, argument);
                }
                None => _ = self.expr(argument),
            }
            // What a built-in function would take is no value that lacks its brackets.
            if index == 0
                && has_operand
                && let Some(all) = self.found.problems.get_mut(&(self.body, self.program))
            {
                all.truncate(problems);
            }
        }
    }

    /// An argument that goes in.
    fn input(&mut self, callee: &Name, parameter: ParameterName, expected: &Type, argument: &Expr) {
        let found = self.expr(argument);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(id) = argument.id()
        {
            let (callee, expected) = (callee.clone(), expected.clone());
            self.report(id, FactKind::ArgumentType { callee, parameter, expected, found: found.ty });
        }
    }

    /// An argument that something comes back to.
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
        match self.value(name) {
            Some(Binding::Variable(variable)) => {
                let Some(variable) = self.variable(variable) else { return };
                if matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In)) {
                    self.report(id, no_variable);
                } else if !variable.ty.is(expected) {
                    let (callee, expected, found) = (callee.clone(), expected.clone(), variable.ty.clone());
                    self.report(id, FactKind::ArgumentType { callee, parameter, expected, found });
                }
            }
            Some(Binding::Feature(of, index)) => {
                let kind = feature(self.db, of, index).map(|it| it.kind);
                // An operation is reported as one that is not called.
                if kind.is_some_and(|kind| !kind.is_operation()) {
                    self.report(id, no_variable);
                }
            }
            None => {}
        }
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some(Expr::Name(port)) = arguments.first() else { return Type::Unknown };
        let mut ty = Type::Unknown;
        if let Some(feature) = self.resolver.features.get(&port.name) {
            self.bindings.insert(port.id, Binding::Feature(feature.shell, feature.index));
            let data = feature.data(self.db);
            ty = data.map_or(Type::Unknown, |data| {
                type_of(self.db, self.project, feature.shell, data.ty.as_ref())
            });
            if function.operand() != Operand::Port(feature.kind) {
                let kind = FactKind::PortDirection { function, port: port.name.clone(), is: feature.kind };
                self.report(port.id, kind);
            }
        }
        let count = if function == Builtin::Status { 1 } else { 2 };
        let is_right = self.count(callee, Takes::Port(function), arguments.len() == count, arguments.len());
        for argument in arguments.iter().skip(1) {
            match function {
                Builtin::Read if is_right => {
                    self.output(&callee.name, ParameterName::Named(port.name.clone()), &ty, argument);
                }
                Builtin::Write if is_right => self.assigned(&port.name, &ty, argument),
                _ => _ = self.expr(argument),
            }
        }
        if function == Builtin::Write { Type::Void } else { Type::PortStatus }
    }

    /// `send(operation, in and inout arguments…)`
    fn send(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(operation), rest)) = arguments.split_first() else { return Type::Unknown };
        let Some((signature, _)) = self.declared(&operation.name, FeatureKind::Required) else {
            return Type::Unknown;
        };
        if let Some(feature) = self.resolver.features.get(&operation.name) {
            self.bindings.insert(operation.id, Binding::Feature(feature.shell, feature.index));
        }
        let inputs: Vec<_> =
            signature.parameters.iter().filter(|(direction, ..)| *direction != Direction::Out).collect();
        let takes = Takes::Send { operation: operation.name.clone(), values: inputs.len() };
        let is_right = self.count(callee, takes, rest.len() == inputs.len(), rest.len());
        for (index, argument) in rest.iter().enumerate() {
            match inputs.get(index).filter(|_| is_right) {
                Some((_, name, ty)) => {
                    self.input(&operation.name, ParameterName::Named(name.clone()), ty, argument);
                }
                None => _ = self.expr(argument),
            }
        }
        Type::Handle(operation.name.clone())
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(handler), rest)) = arguments.split_first() else { return Type::Unknown };
        self.bind(handler);
        let of = self.core.handlers.iter().find(|it| it.name.name == handler.name);
        let operation = of.and_then(|it| it.operation.as_ref()?.path.last());
        let declared = operation.and_then(|name| self.declared(name, FeatureKind::Required));
        let Some((signature, _)) = declared else {
            rest.iter().for_each(|argument| _ = self.expr(argument));
            return Type::CallStatus;
        };
        let result =
            (signature.result != Type::Void).then(|| (ParameterName::Result, signature.result.clone()));
        let outputs = signature.parameters.iter().filter(|(direction, ..)| *direction != Direction::In);
        let outputs = outputs.map(|(_, name, ty)| (ParameterName::Named(name.clone()), ty.clone()));
        let outputs: Vec<(ParameterName, Type)> = result.into_iter().chain(outputs).collect();
        let is_right = rest.is_empty() || rest.len() == outputs.len();
        let is_right = self.count(callee, Takes::Collect { values: outputs.len() }, is_right, rest.len());
        for (index, argument) in rest.iter().enumerate() {
            match outputs.get(index).filter(|_| is_right) {
                Some((name, ty)) => self.output(&callee.name, name.clone(), ty, argument),
                None => _ = self.expr(argument),
            }
        }
        Type::CallStatus
    }
}

/// A call that is a statement.
#[derive(Clone, Copy)]
struct SendableCall {
    /// All of it.
    id: SourceId,
    /// Its first argument.
    first: Option<SourceId>,
}

/// Returns the location of the first value in an expression without any call. (A missing one is a syntax error.)
fn without_call(expr: &Expr) -> Option<SourceId> {
    let mut values = expr.descendants().filter(|it| matches!(it, Expr::Literal(..) | Expr::Name(_)));
    if expr.may_call() { None } else { values.next()?.id() }
}

/// Whether every path ends with a `return`.
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

/// What is known of all bodies of a core.
pub struct CoreInference<'db> {
    shared: &'db Shared<'db>,
    /// The groups of bodies, each with how many variables come before its own.
    groups: Vec<(&'db Inference<'db>, usize)>,
    /// Where there are several groups: the first parts of the bodies that stand apart, with their groups.
    by_source: Vec<(SourceId, u32)>,
    /// The groups of the initial values, which stand between the other bodies.
    values: [u32; 2],
}

/// Resolves and types all bodies of a core.
pub fn inference_of_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> CoreInference<'db> {
    let scope = core_scope(db, of).as_ref();
    let own = scope.filter(|scope| scope.groups().len() == 1);
    let own = own.and_then(|_| inference_of(db, project, of, 0).shared.as_deref());
    let shared = own.unwrap_or_else(|| shared_of(db, project, of));
    let mut found = CoreInference { shared, groups: Vec::new(), by_source: Vec::new(), values: [0, 0] };
    let (Some(core), Some(scope)) = (core(db, of), scope) else { return found };
    let mut variables = shared.variables.len();
    for group in scope.groups() {
        let inference = inference_of(db, project, of, group);
        found.groups.push((inference, variables));
        variables += inference.variables.len();
    }
    if found.groups.len() > 1 {
        let first = |id| Some((core.first_id(id)?, scope.group(id)?));
        found.by_source = core.bodies().filter_map(first).collect();
        found.by_source.sort_unstable();
        found.values[1] = scope.group(BodyId::MachineValues).unwrap_or_default();
    }
    found
}

impl<'db> CoreInference<'db> {
    /// Every variable, parameter and handler: those that all bodies share, then body by body.
    pub fn variables(&self) -> impl Iterator<Item = (VariableId, &'db VariableOf)> {
        let shared = [(None, &self.shared.variables)].into_iter();
        let groups = self.groups.iter().zip(0..).map(|((it, _), group)| (Some(group), &it.variables));
        shared.chain(groups).flat_map(|(group, all)| {
            let number = move |(index, it)| (VariableId { group, index: index as u32 }, it);
            all.iter().enumerate().map(number)
        })
    }

    /// A variable.
    pub fn variable(&self, id: VariableId) -> Option<&'db VariableOf> {
        let all = match id.group {
            None => &self.shared.variables,
            Some(group) => &self.groups.get(group as usize)?.0.variables,
        };
        all.get(id.index as usize)
    }

    /// The number of a variable among [`CoreInference::variables`].
    pub fn number(&self, id: VariableId) -> usize {
        let before =
            id.group.and_then(|group| self.groups.get(group as usize)).map_or(0, |(_, before)| *before);
        before + id.index as usize
    }

    /// What the name of a value refers to, by its location.
    pub fn binding(&self, id: SourceId) -> Option<Binding<'db>> {
        self.at(id).find_map(|it| get(&it.bindings, id))
    }

    /// The variable that a name refers to, by its location.
    pub fn variable_at(&self, id: SourceId) -> Option<VariableId> {
        match self.binding(id)? {
            Binding::Variable(id) => Some(id),
            Binding::Feature(..) => None,
        }
    }

    /// What a call calls, by the location of its name.
    pub fn callee(&self, id: SourceId) -> Option<Callee<'db>> {
        self.at(id).find_map(|it| it.callee(id))
    }

    /// The groups that a part may stand in.
    pub(crate) fn groups_at(&self, id: SourceId) -> impl Iterator<Item = u32> + use<> {
        let before = self.by_source.partition_point(|(first, _)| *first <= id);
        let own = before.checked_sub(1).and_then(|index| self.by_source.get(index)).map(|(_, group)| *group);
        own.into_iter().chain(self.values)
    }

    fn at(&self, id: SourceId) -> impl Iterator<Item = &'db Inference<'db>> {
        self.groups_at(id).filter_map(|group| self.groups.get(group as usize)).map(|(it, _)| *it)
    }

    /// What every name of a value refers to, with its location.
    pub fn bindings(&self) -> impl Iterator<Item = (SourceId, Binding<'db>)> {
        self.groups.iter().flat_map(|(it, _)| it.bindings.iter().copied())
    }

    /// What every call calls.
    pub fn callees(&self) -> impl Iterator<Item = Callee<'db>> {
        self.groups.iter().flat_map(|(it, _)| it.callees.iter().map(|(_, callee)| *callee))
    }

    /// Whether some name of a value or of a callee is unresolved.
    pub fn is_unresolved(&self) -> bool {
        self.groups.iter().any(|(it, _)| it.unresolved)
    }

    /// What is wrong with types.
    pub fn facts(&self) -> impl Iterator<Item = &'db Fact<'db>> {
        self.shared.facts.iter().chain(self.groups.iter().flat_map(|(it, _)| &it.facts))
    }

    /// What a call does with each of so many arguments: what goes in, what comes back.
    pub fn directions(
        &self,
        db: &'db dyn ModelDb,
        core: &Core,
        callee: Callee<'db>,
        count: usize,
    ) -> Vec<Direction> {
        let own = |parameters: &[Parameter]| parameters.iter().map(|it| it.direction).collect();
        let mut directions: Vec<Direction> = match callee {
            Callee::Codel(of) => codel(db, of).map_or_else(Vec::new, |it| own(&it.parameters)),
            Callee::Operation(index) => {
                core.operations.get(index).map_or_else(Vec::new, |it| own(&it.parameters))
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
}

/// What the programs of a core use of other declarations: only a change in it affects those.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Uses<'db> {
    /// Whether all uses are known: an incomplete program or an unresolved name may use anything.
    pub completeness: Completeness,
    /// The codels that they call.
    pub codels: FxHashSet<Decl<'db>>,
    /// The features of shells that they name, by shell and number.
    pub features: FxHashSet<(Decl<'db>, usize)>,
}

/// What the programs of a core use.
#[salsa::tracked(returns(ref))]
pub fn uses_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Uses<'db> {
    let inference = inference_of_core(db, project, of);
    let codel = |callee: Callee<'db>| match callee {
        Callee::Codel(codel) => Some(codel),
        _ => None,
    };
    let feature = |(_, binding): (SourceId, Binding<'db>)| match binding {
        Binding::Feature(shell, index) => Some((shell, index)),
        Binding::Variable(_) => None,
    };
    Uses {
        completeness: Completeness::of(!inference.is_unresolved())
            & core(db, of).map_or(Completeness::Complete, Core::total_completeness),
        codels: inference.callees().filter_map(codel).collect(),
        features: inference.bindings().filter_map(feature).collect(),
    }
}
