//! The types of everything in a core's programs, and what each name in them stands for.
//!
//! A name that means nothing is reported by `behaviour.rs`, which the analysis rests on; here it fits everywhere, so that one
//! mistake is one diagnostic.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::builtin::{Builtin, Operand};
use crate::fact::{Defined, Fact, FactKind, NotAssignable, ParameterName, ProgramName, Takes, repeated};
use crate::item_tree::{
    Core, Direction, Expr, FeatureKind, HookKind, Kind, Name, NameRef, Operation, Parameter, Part, Program,
    State, Statement, TypeRef, Variable,
};
use crate::names::{Features, feature, features_of, names_of, similar};
use crate::project::Project;
use crate::source::{Decl, Place, codel, core};
use crate::types::{Type, Typed, Wrong, type_of, type_of_value};

/// What is known of a core's programs.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Typing<'db> {
    /// The variables, parameters and handlers, in the order in which they are met.
    pub variables: Vec<VariableOf>,
    /// What names of values stand for, by where they stand.
    pub values: FxHashMap<Part, Meaning<'db>>,
    /// What is called, by where its name stands.
    pub callees: FxHashMap<Part, Callee<'db>>,
    /// Is there a name of a value or of what is called that means nothing?
    pub unresolved: bool,
    /// What is wrong.
    pub facts: Vec<Fact<'db>>,
}

/// Something that a program may assign to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableOf {
    /// Its name.
    pub name: NameRef,
    /// What it is.
    pub kind: VariableKind,
    /// What it holds.
    pub ty: Type,
    /// Has it a first value, or one from a caller?
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

/// What the name of a value stands for.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Meaning<'db> {
    /// An index into [`Typing::variables`].
    Variable(usize),
    /// A feature of a shell, by its number there.
    Feature(Decl<'db>, usize),
}

/// What a call calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Callee<'db> {
    Codel(Decl<'db>),
    /// One's own operation, by its number in the core.
    Operation(usize),
    Read,
    Write,
    Status,
    Send,
    Collect,
}

/// What a codel or an operation takes and gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Signature {
    pub(crate) parameters: Vec<(Direction, Name, Type)>,
    pub(crate) result: Type,
}

impl Signature {
    /// `f(in a: int): bool`
    pub(crate) fn show(&self, name: &str) -> String {
        let word = |direction| match direction {
            Direction::In => "",
            Direction::Out => "out ",
            Direction::InOut => "inout ",
        };
        let parameters = self.parameters.iter();
        let parameters: Vec<String> =
            parameters.map(|(direction, name, ty)| format!("{}{name}: {ty}", word(*direction))).collect();
        let result = if self.result == Type::Void { "void".to_owned() } else { self.result.to_string() };
        format!("{name}({}): {result}", parameters.join(", "))
    }

    /// Do both take and give the same?
    pub(crate) fn is(&self, other: &Signature) -> bool {
        let same = |((one, _, a), (two, _, b)): (&(Direction, Name, Type), &(Direction, Name, Type))| {
            one == two && a.is(b)
        };
        self.parameters.len() == other.parameters.len()
            && self.parameters.iter().zip(&other.parameters).all(same)
            && self.result.is(&other.result)
    }
}

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

/// The types of a core.
#[salsa::tracked(returns(ref))]
pub fn typing_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Typing<'db> {
    typed(db, project, of, false).0
}

/// What the expressions of a core give, by where they stand: for whoever asks, which no check does.
#[salsa::tracked(returns(ref))]
pub fn expression_types<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> FxHashMap<Part, Type> {
    typed(db, project, of, true).1.unwrap_or_default()
}

fn typed<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    all_types: bool,
) -> (Typing<'db>, Option<FxHashMap<Part, Type>>) {
    let Some(data) = core(db, of) else { return Default::default() };
    let shell = names_of(db, project).resolve_type(db, of, Kind::Shell, data.shell.as_ref()).ok();
    let none = Features { lost: true, ..Features::default() };
    let features = shell.map_or(&none, |shell| features_of(db, project, shell));
    let mut typer = Typer {
        db,
        project,
        of,
        core: data,
        shell,
        features,
        scope: Scope::default(),
        machine: Scope::default(),
        whole: true,
        found: Typing::default(),
        types: all_types.then(FxHashMap::default),
    };
    typer.core();
    (typer.found, typer.types)
}

/// What others ask of a core's programs: whether a change in them matters to anybody else.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(crate) struct Uses<'db> {
    /// May its programs use anything, since something in them was lost, or means nothing?
    pub(crate) lost: bool,
    pub(crate) codels: FxHashSet<Decl<'db>>,
    pub(crate) features: FxHashSet<(Decl<'db>, usize)>,
}

#[salsa::tracked(returns(ref))]
pub(crate) fn uses_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Uses<'db> {
    let typing = typing_of(db, project, of);
    let codel = |callee: &Callee<'db>| match callee {
        Callee::Codel(codel) => Some(*codel),
        _ => None,
    };
    let feature = |meaning: &Meaning<'db>| match meaning {
        Meaning::Feature(shell, index) => Some((*shell, *index)),
        Meaning::Variable(_) => None,
    };
    Uses {
        lost: typing.unresolved || core(db, of).is_some_and(|data| !is_whole(data)),
        codels: typing.callees.values().filter_map(codel).collect(),
        features: typing.values.values().filter_map(feature).collect(),
    }
}

/// Was nothing lost in a core?
pub(crate) fn is_whole(core: &Core) -> bool {
    let machines = || core.machines.iter();
    let states = || machines().flat_map(|machine| &machine.states);
    let is_whole = |state: &Arc<State>| {
        state.whole
            && state
                .transitions
                .iter()
                .all(|it| it.whole && it.guard.as_ref().is_none_or(|guard| guard.whole))
    };
    core.whole
        && machines().all(|machine| machine.whole)
        && states().all(is_whole)
        && core.programs().into_iter().all(|program| program.whole)
}

/// What a program gives.
enum Gives {
    Nothing,
    /// A bool, and true without any `return`.
    Bool,
    Value(Type),
}

/// Indices of variables, innermost last.
#[derive(Default)]
struct Scope {
    all: Vec<(Name, usize)>,
    by_name: FxHashMap<Name, Vec<usize>>,
}

impl Scope {
    fn push(&mut self, name: &Name, index: usize) {
        self.all.push((name.clone(), index));
        self.by_name.entry(name.clone()).or_default().push(index);
    }

    fn truncate(&mut self, depth: usize) {
        for (name, _) in self.all.drain(depth.min(self.all.len())..) {
            if let Some(all) = self.by_name.get_mut(&name) {
                all.pop();
            }
        }
    }
}

struct Typer<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    core: &'db Core,
    shell: Option<Decl<'db>>,
    features: &'a Features<'db>,
    /// The variables in scope.
    scope: Scope,
    /// Those of the state machine, which are seen in all programs.
    machine: Scope,
    /// Was nothing lost in the program that is being read?
    whole: bool,
    found: Typing<'db>,
    /// What expressions give, where that is asked for.
    types: Option<FxHashMap<Part, Type>>,
}

impl<'db> Typer<'_, 'db> {
    fn at(&self, part: Part) -> Place<'db> {
        Place::Part(self.of, part)
    }

    fn report(&mut self, part: Part, kind: FactKind<'db>) {
        self.found.facts.push(Fact::new(self.at(part), kind));
    }

    fn ty_of_value(&self, ty: Option<&TypeRef>) -> Type {
        type_of_value(self.db, self.project, self.of, ty)
    }

    fn declare(&mut self, name: &NameRef, kind: VariableKind, ty: Type, has_value: bool) -> usize {
        let index = self.found.variables.len();
        self.found.variables.push(VariableOf { name: name.clone(), kind, ty, has_value });
        index
    }

    fn declare_variable(&mut self, variable: &Variable, kind: VariableKind) -> usize {
        let ty = self.ty_of_value(variable.ty.as_ref());
        self.declare(&variable.name, kind, ty, variable.value.is_some())
    }

    fn core(&mut self) {
        for variable in &self.core.variables {
            let index = self.declare_variable(variable, VariableKind::Core);
            self.scope.push(&variable.name.name, index);
        }
        for handler in &self.core.handlers {
            let ty = self.handler(handler.operation.as_ref());
            let index = self.declare(&handler.name, VariableKind::Handler, ty, true);
            self.scope.push(&handler.name.name, index);
        }
        for machine in &self.core.machines {
            for variable in &machine.variables {
                let index = self.declare_variable(variable, VariableKind::Machine);
                self.machine.push(&variable.name.name, index);
            }
        }
        self.core.variables.iter().for_each(|variable| self.initial_value(variable));
        for operation in &self.core.operations {
            self.operation(operation);
        }
        for hook in &self.core.hooks {
            let gives = match hook.kind {
                HookKind::Configure | HookKind::Start => Gives::Bool,
                HookKind::Update | HookKind::Stop | HookKind::Cleanup => Gives::Nothing,
            };
            self.program(&hook.program, &ProgramName::Hook(hook.kind), &gives);
        }
        let depth = self.scope.all.len();
        for (name, index) in &self.machine.all {
            self.scope.push(name, *index);
        }
        for machine in &self.core.machines {
            machine.variables.iter().for_each(|variable| self.initial_value(variable));
            for state in &machine.states {
                for method in &state.methods {
                    self.program(&method.program, &ProgramName::Method(method.kind), &Gives::Nothing);
                }
                for transition in &state.transitions {
                    if let Some(guard) = &transition.guard {
                        self.whole = guard.whole;
                        self.condition(&guard.condition);
                    }
                    if let Some(effect) = &transition.effect {
                        self.program(effect, &ProgramName::Effect, &Gives::Nothing);
                    }
                }
            }
        }
        self.scope.truncate(depth);
    }

    /// The type of a handler, by the operation that it is for.
    fn handler(&mut self, operation: Option<&TypeRef>) -> Type {
        let (Some(operation), Some(shell), false) = (operation, self.shell, self.features.lost) else {
            return Type::Unknown;
        };
        let [name] = operation.path.as_slice() else {
            let (name, shell) = (operation.to_string().into(), shell.name(self.db).clone());
            self.report(operation.part, FactKind::UnresolvedOperation { name, shell, near: None });
            return Type::Unknown;
        };
        if name.is_empty() {
            return Type::Unknown;
        }
        if self.features.get(name).is_some_and(|it| it.kind == FeatureKind::Required) {
            return Type::Handle(name.clone());
        }
        let required = self
            .features
            .by_name
            .iter()
            .filter(|(_, found)| found.iter().any(|it| it.kind == FeatureKind::Required));
        let near = similar(name, required.map(|(name, _)| name));
        let (name, shell) = (name.clone(), shell.name(self.db).clone());
        self.report(operation.part, FactKind::UnresolvedOperation { name, shell, near });
        Type::Unknown
    }

    fn initial_value(&mut self, variable: &Variable) {
        if let Some(value) = &variable.value {
            self.whole = self.core.whole;
            let expected = self.ty_of_value(variable.ty.as_ref());
            self.assigned(&variable.name.name, &expected, value);
        }
    }

    fn operation(&mut self, operation: &'db Operation) {
        let name = &operation.name.name;
        let own = signature(self.db, self.project, self.of, &operation.parameters, operation.result.as_ref());
        let declared = self.declared(name, FeatureKind::Provided);
        let result = match (&operation.result, &declared) {
            (Some(_), _) => own.result.clone(),
            (None, Some((declared, _))) => declared.result.clone(),
            // That it is not declared is reported; what it gives nobody knows.
            (None, None) => Type::Unknown,
        };
        if let Some((declared, at)) = declared
            && operation.program.whole
        {
            let defined = Signature { result: result.clone(), ..own.clone() };
            if !defined.is(&declared) {
                let kind = FactKind::OperationDefinition {
                    declared: declared.show(name),
                    defined: defined.show(name),
                    declared_at: at,
                    fixed: self.as_declared(operation).map(|text| (operation.signature, text)),
                };
                self.report(operation.name.part, kind);
            }
        }
        let depth = self.scope.all.len();
        for (parameter, (direction, _, ty)) in operation.parameters.iter().zip(own.parameters) {
            let kind = VariableKind::Parameter(direction);
            let index = self.declare(&parameter.name, kind, ty, direction != Direction::Out);
            self.scope.push(&parameter.name.name, index);
        }
        let must = result != Type::Void && result != Type::Unknown;
        if must && operation.program.whole && !returns(&operation.program.statements) {
            let (name, expected) = (name.clone(), result.clone());
            self.report(operation.name.part, FactKind::MissingReturn { name, expected });
        }
        let gives = if result == Type::Void { Gives::Nothing } else { Gives::Value(result) };
        self.program(&operation.program, &ProgramName::Operation(name.clone()), &gives);
        self.scope.truncate(depth);
    }

    /// `(in far: double): bool`, as the shell declares it, where it means the same in this core; its own parameters keep
    /// their names, which its program has.
    fn as_declared(&self, operation: &Operation) -> Option<String> {
        let feature = self.features.get(&operation.name.name)?;
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
        let is_repeated = |(index, name): (usize, &&Name)| names.iter().take(index).any(|it| it == name);
        if names.iter().enumerate().any(is_repeated) {
            return None;
        }
        let parameters = data.parameters.iter().zip(names).map(|(declared, name)| {
            let direction = match declared.direction {
                Direction::In => "in",
                Direction::Out => "out",
                Direction::InOut => "inout",
            };
            Some(format!("{direction} {name}: {}", declared.ty.as_ref()?))
        });
        let parameters: Option<Vec<String>> = parameters.collect();
        Some(format!("({}): {}", parameters?.join(", "), data.ty.as_ref()?))
    }

    /// What the shell declares of an operation, and where.
    fn declared(&self, name: &str, kind: FeatureKind) -> Option<(Signature, Place<'db>)> {
        let feature = self.features.get(name).filter(|feature| feature.kind == kind)?;
        let data = feature.data(self.db)?;
        let signature = signature(self.db, self.project, feature.shell, &data.parameters, data.ty.as_ref());
        Some((signature, Place::Part(feature.shell, data.name.part)))
    }

    fn program(&mut self, program: &Program, of: &ProgramName, gives: &Gives) {
        self.whole = program.whole;
        self.block(&program.statements, of, gives);
    }

    fn block(&mut self, statements: &[Statement], of: &ProgramName, gives: &Gives) {
        let depth = self.scope.all.len();
        for statement in statements {
            self.statement(statement, of, gives);
        }
        let own: Vec<usize> = self.scope.all.iter().skip(depth).map(|(_, index)| *index).collect();
        self.scope.truncate(depth);
        if own.len() > 1 {
            let own: Vec<NameRef> =
                own.iter().filter_map(|index| Some(self.found.variables.get(*index)?.name.clone())).collect();
            let own = own.iter().map(|it| (it, Defined::Variable));
            self.found.facts.extend(repeated(self.of, own));
        }
    }

    fn statement(&mut self, statement: &Statement, of: &ProgramName, gives: &Gives) {
        match statement {
            Statement::Variable(variable) => {
                if let Some(value) = &variable.value {
                    let expected = self.ty_of_value(variable.ty.as_ref());
                    self.assigned(&variable.name.name, &expected, value);
                }
                let index = self.declare_variable(variable, VariableKind::Local);
                self.scope.push(&variable.name.name, index);
            }
            Statement::If { part, condition, then, end, otherwise } => {
                self.condition(condition);
                self.block(then, of, gives);
                match otherwise {
                    Some(otherwise) => self.block(otherwise, of, gives),
                    None if self.whole => self.report(*part, FactKind::MissingElse { end: *end }),
                    None => {}
                }
            }
            Statement::Block(statements) => self.block(statements, of, gives),
            Statement::Return(part, value) => self.returned(*part, value.as_ref(), of, gives),
            Statement::Assign(target, value) => {
                let expected = self.target(target);
                self.assigned(&target.name, &expected, value);
            }
            Statement::Expr(value) => {
                self.expr(value);
            }
        }
    }

    fn condition(&mut self, condition: &Expr) {
        let found = self.expr(condition).ty;
        if !found.is(&Type::Bool)
            && let Some(part) = condition.part()
        {
            self.report(part, FactKind::ConditionType { found });
        }
    }

    fn returned(&mut self, keyword: Part, value: Option<&Expr>, of: &ProgramName, gives: &Gives) {
        let expected = match gives {
            Gives::Nothing => &Type::Void,
            Gives::Bool => &Type::Bool,
            Gives::Value(ty) => ty,
        };
        let (found, at) = match value {
            Some(value) => (self.expr(value), value.part().unwrap_or(keyword)),
            None => (Typed::of(Type::Void), keyword),
        };
        let fits = match (value, gives) {
            // A value of no type is one all the same.
            (Some(_), Gives::Nothing) => found.ty == Type::Unknown,
            _ => found.ty.fits(found.value.as_ref(), expected),
        };
        if !fits && self.whole {
            let kind = FactKind::ReturnType { of: of.clone(), expected: expected.clone(), found: found.ty };
            self.report(at, kind);
        }
    }

    /// The type of what is assigned to.
    fn target(&mut self, target: &NameRef) -> Type {
        let Some(meaning) = self.value(target) else { return Type::Unknown };
        let is = match meaning {
            Meaning::Variable(index) => {
                let Some(variable) = self.found.variables.get(index) else { return Type::Unknown };
                if variable.kind != VariableKind::Parameter(Direction::In) {
                    return variable.ty.clone();
                }
                NotAssignable::InParameter
            }
            Meaning::Feature(of, index) => match feature(self.db, of, index).map(|it| it.kind) {
                Some(FeatureKind::Property) => NotAssignable::Property,
                Some(FeatureKind::Constant) => NotAssignable::Constant,
                Some(FeatureKind::Output) => NotAssignable::OutputPort,
                Some(FeatureKind::Input) => NotAssignable::InputPort,
                // An operation is reported as one that is not called.
                _ => return Type::Unknown,
            },
        };
        self.report(target.part, FactKind::NotAssignable { name: target.name.clone(), is });
        Type::Unknown
    }

    fn assigned(&mut self, name: &Name, expected: &Type, value: &Expr) {
        let found = self.expr(value);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(part) = value.part()
        {
            let (name, expected) = (name.clone(), expected.clone());
            self.report(part, FactKind::AssignmentType { name, expected, found: found.ty });
        }
    }

    /// What a name of a value stands for, innermost first.
    fn lookup(&self, name: &Name) -> Option<Meaning<'db>> {
        let innermost = |scope: &Scope| scope.by_name.get(name).and_then(|all| all.last()).copied();
        if let Some(index) = innermost(&self.scope).or_else(|| innermost(&self.machine)) {
            return Some(Meaning::Variable(index));
        }
        self.features.get(name).map(|feature| Meaning::Feature(feature.shell, feature.index))
    }

    fn value(&mut self, name: &NameRef) -> Option<Meaning<'db>> {
        let meaning = self.lookup(&name.name).filter(|_| !name.name.is_empty());
        match &meaning {
            Some(meaning) => {
                self.found.values.insert(name.part, meaning.clone());
            }
            None => self.found.unresolved = true,
        }
        meaning
    }

    fn name(&mut self, name: &NameRef) -> Type {
        match self.value(name) {
            Some(Meaning::Variable(index)) => {
                self.found.variables.get(index).map_or(Type::Unknown, |variable| variable.ty.clone())
            }
            Some(Meaning::Feature(of, index)) => {
                let data = feature(self.db, of, index);
                // A port is read with `read`, an operation is called.
                let Some(data) = data.filter(|it| !it.kind.is_operation()) else { return Type::Unknown };
                if data.kind.is_port() {
                    let kind = FactKind::PortAsValue { name: name.name.clone(), kind: data.kind };
                    self.report(name.part, kind);
                    return Type::Unknown;
                }
                type_of(self.db, self.project, of, data.ty.as_ref())
            }
            None => Type::Unknown,
        }
    }

    fn expr(&mut self, expr: &Expr) -> Typed {
        let typed = self.typed(expr);
        if let (Some(types), Some(part)) = (&mut self.types, expr.part()) {
            types.insert(part, typed.ty.clone());
        }
        typed
    }

    fn typed(&mut self, expr: &Expr) -> Typed {
        match expr {
            Expr::Missing => Typed::UNKNOWN,
            // That something is wrong in it is said.
            Expr::Lost(inner) => {
                let said = self.found.facts.len();
                self.expr(inner);
                self.found.facts.truncate(said);
                Typed::UNKNOWN
            }
            Expr::Literal(literal, part) => self.given(Typed::literal(literal), *part),
            Expr::Name(name) => Typed::of(self.name(name)),
            Expr::Unary(operator, inner, part) => Typed::least(*operator, inner).unwrap_or_else(|| {
                let inner = self.expr(inner);
                self.given(inner.unary(*operator), *part)
            }),
            Expr::Binary(operator, lhs, rhs, part) => {
                let (lhs, rhs) = (self.expr(lhs), self.expr(rhs));
                self.given(lhs.binary(*operator, &rhs), *part)
            }
            Expr::Call { callee, arguments, .. } => Typed::of(self.call(callee, arguments)),
        }
    }

    fn given(&mut self, given: Result<Typed, Wrong>, part: Part) -> Typed {
        given.unwrap_or_else(|wrong| {
            self.report(part, wrong.into());
            Typed::UNKNOWN
        })
    }

    /// What a call gives.
    fn call(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some(found) = self.callee(callee, arguments) else {
            self.found.unresolved = true;
            for argument in arguments {
                // A port is right where `read` is misspelt.
                match argument {
                    Expr::Name(name) => drop(self.value(name)),
                    argument => drop(self.expr(argument)),
                }
            }
            return Type::Unknown;
        };
        self.found.callees.insert(callee.part, found);
        let name = callee.name.as_str();
        match found {
            Callee::Codel(of) => {
                let Some(data) = codel(self.db, of) else { return Type::Unknown };
                let signature = signature(self.db, self.project, of, &data.parameters, data.result.as_ref());
                self.arguments(callee, &signature.parameters, arguments);
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
                self.arguments(callee, &own.parameters, arguments);
                match (&operation.result, self.declared(name, FeatureKind::Provided)) {
                    (None, Some((declared, _))) => declared.result,
                    (None, None) => Type::Void,
                    (Some(_), _) => own.result,
                }
            }
            Callee::Read => self.port(Builtin::Read, callee, arguments),
            Callee::Write => self.port(Builtin::Write, callee, arguments),
            Callee::Status => self.port(Builtin::Status, callee, arguments),
            Callee::Send => self.send(callee, arguments),
            Callee::Collect => self.collect(callee, arguments),
        }
    }

    /// What a name that is called means; nothing where that is reported elsewhere.
    fn callee(&self, callee: &NameRef, arguments: &[Expr]) -> Option<Callee<'db>> {
        let name = &callee.name;
        let feature = self.features.get(name);
        if feature.is_some_and(|feature| feature.kind == FeatureKind::Provided) {
            let defined = self.core.operations.iter().position(|operation| operation.name.name == *name);
            return defined.map(Callee::Operation);
        }
        let library = self.of.library(self.db).as_ref();
        let found = names_of(self.db, self.project).resolve(
            self.db,
            library,
            Kind::Codel,
            std::slice::from_ref(name),
        );
        if let Ok(found) = found {
            // A variable of the state machine hides it in the machine's own programs only, as for what they cost.
            let is_variable = self.scope.by_name.get(name).is_some_and(|all| !all.is_empty());
            let is_hidden = is_variable || feature.is_some();
            return (!is_hidden).then_some(Callee::Codel(found));
        }
        let Some(Expr::Name(first)) = arguments.first() else { return None };
        let builtin = Builtin::of_name(name)?;
        if builtin == Builtin::Collect {
            let handler = self.core.handlers.iter().any(|handler| handler.name.name == first.name);
            return handler.then_some(Callee::Collect);
        }
        let operand = self.features.get(&first.name)?.kind;
        builtin.takes(operand).then_some(match builtin {
            Builtin::Read => Callee::Read,
            Builtin::Write => Callee::Write,
            Builtin::Status => Callee::Status,
            Builtin::Send => Callee::Send,
            Builtin::Collect => Callee::Collect,
        })
    }

    /// Says how many arguments there should be, where there are not as many.
    fn count(&mut self, callee: &NameRef, takes: Takes, is_right: bool, found: usize) -> bool {
        if !is_right && self.whole {
            let callee_name = callee.name.clone();
            self.report(callee.part, FactKind::ArgumentCount { callee: callee_name, takes, found });
        }
        is_right
    }

    fn arguments(&mut self, callee: &NameRef, parameters: &[(Direction, Name, Type)], arguments: &[Expr]) {
        let takes = Takes::Arguments(parameters.len());
        let is_right = self.count(callee, takes, parameters.len() == arguments.len(), arguments.len());
        for (index, argument) in arguments.iter().enumerate() {
            match parameters.get(index).filter(|_| is_right) {
                Some((Direction::In, name, ty)) => self.input(&callee.name, name, ty, argument),
                Some((_, name, ty)) => {
                    self.output(&callee.name, &ParameterName::Named(name.clone()), ty, argument);
                }
                None => {
                    self.expr(argument);
                }
            }
        }
    }

    /// An argument that goes in.
    fn input(&mut self, of: &Name, parameter: &Name, expected: &Type, argument: &Expr) {
        let found = self.expr(argument);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(part) = argument.part()
        {
            let parameter = ParameterName::Named(parameter.clone());
            self.report(part, argument_type(of, &parameter, expected, &found.ty));
        }
    }

    /// An argument that something comes back to.
    fn output(&mut self, of: &Name, parameter: &ParameterName, expected: &Type, argument: &Expr) {
        let Some(part) = argument.part() else { return };
        let Expr::Name(name) = argument else {
            self.expr(argument);
            self.report(part, out_argument(of, parameter));
            return;
        };
        match self.value(name) {
            Some(Meaning::Variable(index)) => {
                let Some(variable) = self.found.variables.get(index) else { return };
                if matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In)) {
                    self.report(part, out_argument(of, parameter));
                } else if !variable.ty.is(expected) {
                    let kind = argument_type(of, parameter, expected, &variable.ty);
                    self.report(part, kind);
                }
            }
            Some(Meaning::Feature(shell_of, index)) => {
                let kind = feature(self.db, shell_of, index).map(|it| it.kind);
                // An operation is reported as one that is not called.
                if kind.is_some_and(|kind| !kind.is_operation()) {
                    self.report(part, out_argument(of, parameter));
                }
            }
            None => {}
        }
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some(Expr::Name(port)) = arguments.first() else { return Type::Unknown };
        let mut ty = Type::Unknown;
        if let Some(feature) = self.features.get(&port.name) {
            self.found.values.insert(port.part, Meaning::Feature(feature.shell, feature.index));
            let data = feature.data(self.db);
            ty = data.map_or(Type::Unknown, |data| {
                type_of(self.db, self.project, feature.shell, data.ty.as_ref())
            });
            if function.operand() != Operand::Port(feature.kind) {
                let (port_name, is) = (port.name.clone(), feature.kind);
                self.report(port.part, FactKind::PortDirection { function, port: port_name, is });
            }
        }
        let count = if function == Builtin::Status { 1 } else { 2 };
        let is_right = self.count(callee, Takes::Port(function), arguments.len() == count, arguments.len());
        for argument in arguments.iter().skip(1) {
            match function {
                Builtin::Read if is_right => {
                    self.output(&callee.name, &ParameterName::Named(port.name.clone()), &ty, argument);
                }
                Builtin::Write if is_right => self.assigned(&port.name, &ty, argument),
                _ => {
                    self.expr(argument);
                }
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
        if let Some(feature) = self.features.get(&operation.name) {
            self.found.values.insert(operation.part, Meaning::Feature(feature.shell, feature.index));
        }
        let inputs: Vec<_> =
            signature.parameters.iter().filter(|(direction, ..)| *direction != Direction::Out).collect();
        let takes = Takes::Send { operation: operation.name.clone(), values: inputs.len() };
        let is_right = self.count(callee, takes, rest.len() == inputs.len(), rest.len());
        for (index, argument) in rest.iter().enumerate() {
            match inputs.get(index).filter(|_| is_right) {
                Some((_, name, ty)) => self.input(&operation.name, name, ty, argument),
                None => {
                    self.expr(argument);
                }
            }
        }
        Type::Handle(operation.name.clone())
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(handler), rest)) = arguments.split_first() else { return Type::Unknown };
        self.value(handler);
        let of = self.core.handlers.iter().find(|it| it.name.name == handler.name);
        let operation = of.and_then(|it| it.operation.as_ref()?.path.last());
        let declared = operation.and_then(|name| self.declared(name, FeatureKind::Required));
        let Some((signature, _)) = declared else {
            rest.iter().for_each(|argument| {
                self.expr(argument);
            });
            return Type::CallStatus;
        };
        let result =
            (signature.result != Type::Void).then(|| (ParameterName::Result, signature.result.clone()));
        let outputs = signature.parameters.iter().filter(|(direction, ..)| *direction != Direction::In);
        let outputs = outputs.map(|(_, name, ty)| (ParameterName::Named(name.clone()), ty.clone()));
        let outputs: Vec<(ParameterName, Type)> = result.into_iter().chain(outputs).collect();
        let takes = Takes::Collect { values: outputs.len() };
        let is_right = rest.is_empty() || rest.len() == outputs.len();
        let is_right = self.count(callee, takes, is_right, rest.len());
        for (index, argument) in rest.iter().enumerate() {
            match outputs.get(index).filter(|_| is_right) {
                Some((name, ty)) => self.output(&callee.name, name, ty, argument),
                None => {
                    self.expr(argument);
                }
            }
        }
        Type::CallStatus
    }
}

fn argument_type<'db>(
    callee: &Name,
    parameter: &ParameterName,
    expected: &Type,
    found: &Type,
) -> FactKind<'db> {
    let (callee, parameter) = (callee.clone(), parameter.clone());
    FactKind::ArgumentType { callee, parameter, expected: expected.clone(), found: found.clone() }
}

fn out_argument<'db>(callee: &Name, parameter: &ParameterName) -> FactKind<'db> {
    FactKind::OutArgument { callee: callee.clone(), parameter: parameter.clone() }
}

/// Does every path end with a `return`?
pub(crate) fn returns(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Return(..) => true,
        Statement::Block(inner) => returns(inner),
        Statement::If { then, otherwise, .. } => {
            returns(then) && otherwise.as_ref().is_some_and(|it| returns(it))
        }
        _ => false,
    })
}
