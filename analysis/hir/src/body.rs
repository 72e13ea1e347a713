//! The bodies of a core: the units of inference, checks and costs. An edit of one body does not invalidate the others.

use std::borrow::Cow;
use std::sync::Arc;

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::item_tree::{
    Core, Expr, Guard, Handler, Hook, Name, NameRef, Operation, Parameter, Program, SourceId, State,
    Statement, TypeRef, Variable,
};
use crate::source::{Decl, core};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub(crate) enum BodyId {
    /// The initial values of the variables of the core.
    CoreValues,
    /// The operation with that index.
    Operation(u32),
    /// The hook with that index.
    Hook(u32),
    /// The initial values of the variables of its state machines.
    MachineValues,
    /// A state, by the index of its machine and its index there.
    State(u32, u32),
}

impl BodyId {
    /// Returns whether it has the initial values of variables.
    pub(crate) fn is_of_values(self) -> bool {
        matches!(self, BodyId::CoreValues | BodyId::MachineValues)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) enum Body {
    InitialValues(InitialValues),
    Operation(Arc<Operation>),
    Hook(Arc<Hook>),
    State(Arc<State>),
}

/// Variables with their initial values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InitialValues {
    /// The variables of the core, or those of its state machines.
    pub(crate) variables: Vec<Variable>,
    /// Whether no error hides an item of the core.
    pub(crate) completeness: Completeness,
}

/// A program in a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub enum ProgramIn {
    /// All initial values, or the program of an operation or a hook.
    Whole,
    /// The method with that index.
    Method(u32),
    /// The guard of the transition with that index.
    Guard(u32),
    /// The effect of the transition with that index.
    Effect(u32),
}

/// Where a program of a core is.
pub(crate) type Place = (BodyId, ProgramIn);

/// Code with its own scope: a program, or the condition of a guard.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub enum ScopedCode<'a> {
    Program(&'a Program),
    Guard(&'a Guard),
}

impl Core {
    /// Returns its bodies, in the order of the checks.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = BodyId> {
        let operations = (0..self.operations.len() as u32).map(BodyId::Operation);
        let hooks = (0..self.hooks.len() as u32).map(BodyId::Hook);
        let states = self.machines.iter().enumerate().flat_map(|(machine, it)| {
            (0..it.states.len() as u32).map(move |state| BodyId::State(machine as u32, state))
        });
        let values = [BodyId::CoreValues].into_iter();
        values.chain(operations).chain(hooks).chain([BodyId::MachineValues]).chain(states)
    }

    /// Returns the first source of a body: the other sources of the body, and those of the next body, are greater. `None`
    /// for initial values, whose sources are between those of other bodies.
    pub(crate) fn first_id(&self, body: BodyId) -> Option<SourceId> {
        match body {
            BodyId::CoreValues | BodyId::MachineValues => None,
            BodyId::Operation(index) => self.operations.get(index as usize).map(|it| it.name.id),
            BodyId::Hook(index) => self.hooks.get(index as usize).map(|it| it.id),
            BodyId::State(machine, state) => self.state_at(machine, state).map(|it| it.start),
        }
    }

    fn state_at(&self, machine: u32, state: u32) -> Option<&Arc<State>> {
        self.machines.get(machine as usize)?.states.get(state as usize)
    }
}

impl Body {
    /// Returns its programs and guards, in the order of the text; empty for initial values.
    pub(crate) fn code(&self) -> Vec<(ProgramIn, ScopedCode<'_>)> {
        match self {
            Body::InitialValues(_) => Vec::new(),
            Body::Operation(operation) => vec![(ProgramIn::Whole, ScopedCode::Program(&operation.program))],
            Body::Hook(hook) => vec![(ProgramIn::Whole, ScopedCode::Program(&hook.program))],
            Body::State(state) => state.code(),
        }
    }

    /// Returns whether its programs, guards and transitions are complete.
    pub(crate) fn completeness(&self) -> Completeness {
        let items = match self {
            Body::State(state) => {
                state.completeness & state.transitions.iter().map(|it| it.completeness).collect()
            }
            _ => Completeness::Complete,
        };
        let code = self.code().into_iter().map(|(_, code)| match code {
            ScopedCode::Program(program) => program.completeness,
            ScopedCode::Guard(guard) => guard.completeness,
        });
        items & code.collect()
    }
}

impl State {
    /// Returns its programs and guards: the methods, then the guard and the effect of each transition.
    pub fn code(&self) -> Vec<(ProgramIn, ScopedCode<'_>)> {
        let methods = self.methods.iter().enumerate();
        let methods =
            methods.map(|(index, it)| (ProgramIn::Method(index as u32), ScopedCode::Program(&it.program)));
        let transitions = self.transitions.iter().enumerate().flat_map(|(index, it)| {
            let guard = it.guard.as_ref().map(|it| (ProgramIn::Guard(index as u32), ScopedCode::Guard(it)));
            let effect =
                it.effect.as_ref().map(|it| (ProgramIn::Effect(index as u32), ScopedCode::Program(it)));
            guard.into_iter().chain(effect)
        });
        methods.chain(transitions).collect()
    }
}

/// The data of a core that its bodies read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CoreScope {
    pub(crate) shell: Option<TypeRef>,
    pub(crate) variables: Vec<SharedVariable>,
    pub(crate) handlers: Vec<Handler>,
    pub(crate) operations: Vec<OperationHead>,
    pub(crate) machine_variables: Vec<SharedVariable>,
    /// The number of its hooks.
    pub(crate) hooks: u32,
    /// The number of states of each of its state machines.
    pub(crate) states: Vec<u32>,
    /// Whether no error hides an item of the core or of its state machines, or the name of a variable.
    pub(crate) completeness: Completeness,
}

/// A variable of a core or of a state machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SharedVariable {
    pub(crate) name: NameRef,
    pub(crate) ty: Option<TypeRef>,
    pub(crate) value: InitialValue,
}

/// What a variable holds when it begins to exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialValue {
    /// No known value.
    None,
    /// A value from a caller, or without a call.
    Plain,
    /// A value that a call may give.
    Calls,
}

/// The signature of an operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OperationHead {
    pub(crate) name: NameRef,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) result: Option<TypeRef>,
    pub(crate) completeness: Completeness,
}

/// Returns the [`CoreScope`] of a core: without programs, so that an edit of a program does not change it.
#[salsa::tracked(returns(ref))]
pub(crate) fn core_scope<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Option<CoreScope> {
    let core = core(db, of)?;
    let variable = |it: &Variable| SharedVariable {
        name: it.name.clone(),
        ty: it.ty.clone(),
        value: it.initial_value(),
    };
    let operation = |it: &Arc<Operation>| OperationHead {
        name: it.name.clone(),
        parameters: it.parameters.clone(),
        result: it.result.clone(),
        completeness: it.signature_completeness,
    };
    let are_named = core.shared_variables().all(|it| !it.name.name.is_empty());
    Some(CoreScope {
        shell: core.shell.clone(),
        variables: core.variables.iter().map(variable).collect(),
        handlers: core.handlers.clone(),
        operations: core.operations.iter().map(operation).collect(),
        machine_variables: core.machines.iter().flat_map(|it| &it.variables).map(variable).collect(),
        hooks: core.hooks.len() as u32,
        states: core.machines.iter().map(|machine| machine.states.len() as u32).collect(),
        completeness: core.completeness
            & core.machines.iter().map(|it| it.completeness).collect()
            & Completeness::of(are_named),
    })
}

/// The number of bodies per query: a query for each body would cost more time than it saves.
const GROUP_SIZE: usize = 32;

impl CoreScope {
    /// Returns the group that contains a body; `None` if the core does not have the body.
    pub(crate) fn group(&self, body: BodyId) -> Option<u32> {
        self.place(body).map(|(group, _)| group as u32)
    }

    /// Returns the group that contains a body, and the index of the body there.
    pub(crate) fn place(&self, body: BodyId) -> Option<(usize, usize)> {
        let hooks = 1 + self.operations.len();
        let values = hooks + self.hooks as usize;
        let states = values + 1;
        let (number, end) = match body {
            BodyId::CoreValues => (0, 1),
            BodyId::Operation(index) => (1 + index as usize, hooks),
            BodyId::Hook(index) => (hooks + index as usize, values),
            BodyId::MachineValues => (values, states),
            BodyId::State(machine, state) => {
                let before: u32 = self.states.iter().take(machine as usize).sum();
                let first = states + before as usize;
                (first + state as usize, first + self.states.get(machine as usize).copied()? as usize)
            }
        };
        (number < end).then_some((number / GROUP_SIZE, number % GROUP_SIZE))
    }

    /// Returns the bodies of a group, in the order of the checks.
    pub(crate) fn bodies_in(&self, group: u32) -> impl Iterator<Item = BodyId> {
        let operations = (0..self.operations.len() as u32).map(BodyId::Operation);
        let hooks = (0..self.hooks).map(BodyId::Hook);
        let states = (0..).zip(&self.states);
        let states =
            states.flat_map(|(machine, count)| (0..*count).map(move |state| BodyId::State(machine, state)));
        let values = std::iter::once(BodyId::CoreValues).chain(operations).chain(hooks);
        let all = values.chain([BodyId::MachineValues]).chain(states);
        all.skip(group as usize * GROUP_SIZE).take(GROUP_SIZE)
    }

    /// Returns the groups of its bodies.
    pub(crate) fn groups(&self) -> std::ops::Range<u32> {
        let states: u32 = self.states.iter().sum();
        let bodies = 2 + self.operations.len() + self.hooks as usize + states as usize;
        0..bodies.div_ceil(GROUP_SIZE) as u32
    }
}

/// Returns the groups of the bodies of a core.
pub(crate) fn groups_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> std::ops::Range<u32> {
    core_scope(db, of).as_ref().map_or(0..0, CoreScope::groups)
}

/// Returns a value for each group of the bodies of a core: the result of `query`, or of `only` for the only group, since a
/// query for that one would be recomputed with each change of the core.
pub(crate) fn by_group<'db, T: Clone>(
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    only: impl FnOnce() -> T,
    query: impl Fn(u32) -> &'db T,
) -> Vec<Cow<'db, T>> {
    let groups = groups_of(db, of);
    match groups.len() {
        1 => vec![Cow::Owned(only())],
        _ => groups.map(|group| Cow::Borrowed(query(group))).collect(),
    }
}

/// Returns the bodies of a group, in the order of the checks.
pub(crate) fn bodies_of<'db>(
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    scope: &CoreScope,
    group: u32,
) -> Cow<'db, [(BodyId, Body)]> {
    match scope.groups().len() {
        // A query for the only group would be recomputed with each change of the core.
        1 => Cow::Owned(core(db, of).map_or_else(Vec::new, |core| bodies_in(core, group))),
        _ => Cow::Borrowed(bodies_of_group(db, of, group)),
    }
}

/// Returns the bodies of one of several groups: an edit of another group does not change the result.
#[salsa::tracked(returns(ref))]
fn bodies_of_group<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Vec<(BodyId, Body)> {
    core(db, of).map_or_else(Vec::new, |core| bodies_in(core, group))
}

fn bodies_in(core: &Core, group: u32) -> Vec<(BodyId, Body)> {
    let values =
        |variables| Body::InitialValues(InitialValues { variables, completeness: core.completeness });
    let body = |id: BodyId| {
        let body = match id {
            BodyId::CoreValues => values(core.variables.clone()),
            BodyId::MachineValues => {
                values(core.machines.iter().flat_map(|machine| &machine.variables).cloned().collect())
            }
            BodyId::Operation(index) => Body::Operation(core.operations.get(index as usize)?.clone()),
            BodyId::Hook(index) => Body::Hook(core.hooks.get(index as usize)?.clone()),
            BodyId::State(machine, state) => Body::State(core.state_at(machine, state)?.clone()),
        };
        Some((id, body))
    };
    core.bodies().skip(group as usize * GROUP_SIZE).take(GROUP_SIZE).filter_map(body).collect()
}

/// A value for each program of each body of a group; those of a body are sorted.
pub(crate) type ByProgram<T> = Vec<Box<[(ProgramIn, T)]>>;

/// Returns the value of a program of the body with that index.
pub(crate) fn of_program<T>(all: &ByProgram<T>, body: usize, program: ProgramIn) -> Option<&T> {
    let of_body = all.get(body)?;
    let index = of_body.binary_search_by_key(&program, |(program, _)| *program).ok()?;
    of_body.get(index).map(|(_, value)| value)
}

/// Returns the statements and the statements nested in them, in the order of the text.
pub fn statements(statements: &[Statement]) -> impl Iterator<Item = &Statement> {
    let mut stack: Vec<&Statement> = statements.iter().rev().collect();
    std::iter::from_fn(move || {
        let next = stack.pop()?;
        stack.extend(next.blocks().into_iter().flatten().rev());
        Some(next)
    })
}

impl Statement {
    /// Returns the blocks of an `if` or of a block; empty for other statements.
    fn blocks(&self) -> [&[Statement]; 2] {
        match self {
            Statement::If { then, otherwise, .. } => [then, otherwise.as_deref().unwrap_or_default()],
            Statement::Block(inner) => [inner, &[]],
            _ => [&[], &[]],
        }
    }

    /// Returns whether any of `all`, or a statement nested in them, declares a variable.
    pub(crate) fn declare(all: &[Statement]) -> bool {
        statements(all).any(|statement| statement.variable().is_some())
    }

    /// Returns the variable that the statement declares.
    pub fn variable(&self) -> Option<&Variable> {
        match self {
            Statement::Variable(variable) => Some(variable),
            _ => None,
        }
    }

    /// Returns its value or condition.
    pub fn expression(&self) -> Option<&Expr> {
        match self {
            Statement::Variable(variable) => variable.value.as_ref(),
            Statement::If { condition, .. } => Some(condition),
            Statement::Return(_, value) => value.as_ref(),
            Statement::Assign(_, value) | Statement::Expr(value) => Some(value),
            Statement::Block(_) => None,
        }
    }
}

impl Expr {
    /// Returns the expression and those nested in it: a call before its arguments, the left operand before the right one.
    pub fn descendants(&self) -> impl Iterator<Item = &Expr> {
        self.walk(true)
    }

    /// Returns the names of values in the expression, without those in arguments of calls.
    pub fn names(&self) -> Vec<&Name> {
        let all = self.walk(false);
        all.filter_map(|expr| if let Expr::Name(name) = expr { Some(&name.name) } else { None }).collect()
    }

    fn walk(&self, with_arguments: bool) -> impl Iterator<Item = &Expr> {
        let mut stack = vec![self];
        std::iter::from_fn(move || {
            let next = stack.pop()?;
            match next {
                Expr::Incomplete(inner) | Expr::Unary(_, inner, _) => stack.push(inner),
                Expr::Binary(_, lhs, rhs, _) => stack.extend([rhs.as_ref(), lhs.as_ref()]),
                Expr::Call { arguments, .. } if with_arguments => stack.extend(arguments.iter().rev()),
                Expr::Missing | Expr::Literal(..) | Expr::Name(_) | Expr::Call { .. } => {}
            }
            Some(next)
        })
    }

    /// Returns whether the expression may contain a call: an incomplete expression may.
    pub(crate) fn may_call(&self) -> bool {
        self.descendants().any(|it| matches!(it, Expr::Missing | Expr::Incomplete(_) | Expr::Call { .. }))
    }
}

impl Variable {
    pub(crate) fn initial_value(&self) -> InitialValue {
        match &self.value {
            None => InitialValue::None,
            Some(value) if value.may_call() => InitialValue::Calls,
            Some(_) => InitialValue::Plain,
        }
    }
}

impl Program {
    /// Returns its blocks: all its statements, and the nested blocks.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = &[Statement]> {
        let all = &*self.statements;
        std::iter::once(all).chain(statements(all).flat_map(Statement::blocks))
    }
}

impl Core {
    /// Returns all variables, including those of its programs.
    pub fn all_variables(&self) -> impl Iterator<Item = &Variable> {
        let programs = self.programs().into_iter().filter(|program| program.declares);
        let statements = programs.flat_map(|program| statements(&program.statements));
        self.shared_variables().chain(statements.filter_map(Statement::variable))
    }

    /// Returns the blocks of its programs.
    pub fn blocks(&self) -> impl Iterator<Item = &[Statement]> {
        self.programs().into_iter().flat_map(Program::blocks)
    }

    /// Returns the statements of its programs, with nested ones.
    pub fn statements(&self) -> impl Iterator<Item = &Statement> {
        self.programs().into_iter().flat_map(|program| statements(&program.statements))
    }

    /// Returns its outermost expressions: initial values, expressions of statements, and guards.
    pub fn expressions(&self) -> impl Iterator<Item = &Expr> {
        let values = self.shared_variables().filter_map(|variable| variable.value.as_ref());
        let transitions = self.states().flat_map(|state| &state.transitions);
        let guards = transitions.filter_map(|transition| Some(&transition.guard.as_ref()?.condition));
        values.chain(self.statements().filter_map(Statement::expression)).chain(guards)
    }
}
