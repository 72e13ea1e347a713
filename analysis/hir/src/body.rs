//! The bodies of a core: what is read, checked and priced apart from the rest of it. An edit of one body leaves the
//! others as they are.

use std::borrow::Cow;
use std::sync::Arc;

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::item_tree::{
    Core, Expr, Guard, Handler, Hook, Name, NameRef, Operation, Parameter, Program, SourceId, State,
    Statement, TypeRef, Variable,
};
use crate::source::{Decl, core};

/// A body of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub enum BodyId {
    /// The initial values of the variables of the core.
    CoreValues,
    /// The operation of that number.
    Operation(u32),
    /// The hook of that number.
    Hook(u32),
    /// The initial values of the variables of its state machines.
    MachineValues,
    /// A state, by the number of its machine and its own.
    State(u32, u32),
}

/// A body, with what stands in it.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Body {
    /// See [`BodyId::CoreValues`] and [`BodyId::MachineValues`].
    InitialValues(InitialValues),
    /// See [`BodyId::Operation`].
    Operation(Arc<Operation>),
    /// See [`BodyId::Hook`].
    Hook(Arc<Hook>),
    /// See [`BodyId::State`].
    State(Arc<State>),
}

/// Variables with their initial values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InitialValues {
    /// Those of the core, or those of its state machines.
    pub variables: Vec<Variable>,
    /// Whether all items of the core are known.
    pub completeness: Completeness,
}

/// A program in a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub enum ProgramIn {
    /// All initial values, or the program of an operation or of a hook.
    Whole,
    /// The method of that number.
    Method(u32),
    /// The guard of the transition of that number.
    Guard(u32),
    /// The program of the transition of that number.
    Effect(u32),
}

/// Code with a scope of its own: a program, or the condition of a guard.
#[derive(Debug, Clone, Copy)]
pub enum Code<'a> {
    /// A program.
    Program(&'a Program),
    /// A guard.
    Guard(&'a Guard),
}

impl Core {
    /// Its bodies, in the order in which they are checked.
    pub fn bodies(&self) -> impl Iterator<Item = BodyId> {
        let operations = (0..self.operations.len() as u32).map(BodyId::Operation);
        let hooks = (0..self.hooks.len() as u32).map(BodyId::Hook);
        let states = self.machines.iter().enumerate().flat_map(|(machine, it)| {
            (0..it.states.len() as u32).map(move |state| BodyId::State(machine as u32, state))
        });
        let values = [BodyId::CoreValues].into_iter();
        values.chain(operations).chain(hooks).chain([BodyId::MachineValues]).chain(states)
    }

    /// Where a body begins: each of its parts has a greater number, and each part of the next body too. Nothing for the
    /// initial values, which stand between the others.
    pub(crate) fn first_id(&self, body: BodyId) -> Option<SourceId> {
        match body {
            BodyId::CoreValues | BodyId::MachineValues => None,
            BodyId::Operation(index) => self.operations.get(index as usize).map(|it| it.name.id),
            BodyId::Hook(index) => self.hooks.get(index as usize).map(|it| it.id),
            BodyId::State(machine, state) => {
                Some(self.machines.get(machine as usize)?.states.get(state as usize)?.start)
            }
        }
    }
}

impl Body {
    /// Its programs and guards, in the order of the text; none of the initial values.
    pub fn code(&self) -> Vec<(ProgramIn, Code<'_>)> {
        match self {
            Body::InitialValues(_) => Vec::new(),
            Body::Operation(operation) => vec![(ProgramIn::Whole, Code::Program(&operation.program))],
            Body::Hook(hook) => vec![(ProgramIn::Whole, Code::Program(&hook.program))],
            Body::State(state) => state.code(),
        }
    }
}

impl State {
    /// Its programs and guards: the methods, then those of each transition.
    pub fn code(&self) -> Vec<(ProgramIn, Code<'_>)> {
        let methods = self.methods.iter().enumerate();
        let methods =
            methods.map(|(index, it)| (ProgramIn::Method(index as u32), Code::Program(&it.program)));
        let transitions = self.transitions.iter().enumerate().flat_map(|(index, it)| {
            let guard = it.guard.as_ref().map(|it| (ProgramIn::Guard(index as u32), Code::Guard(it)));
            let effect = it.effect.as_ref().map(|it| (ProgramIn::Effect(index as u32), Code::Program(it)));
            guard.into_iter().chain(effect)
        });
        methods.chain(transitions).collect()
    }
}

/// What the bodies of a core see of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoreScope {
    /// The shell that it is for.
    pub shell: Option<TypeRef>,
    /// Its variables.
    pub variables: Vec<SharedVariable>,
    /// Its handlers.
    pub handlers: Vec<Handler>,
    /// The operations that it defines, without their programs.
    pub operations: Vec<OperationHead>,
    /// The variables of its state machines.
    pub machine_variables: Vec<SharedVariable>,
    /// How many hooks it has.
    pub hooks: u32,
    /// How many states each of its state machines has.
    pub states: Vec<u32>,
    /// Whether all its items are known, and all variables and states of its state machines.
    pub completeness: Completeness,
}

/// A variable of a core or of a state machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedVariable {
    /// Its name.
    pub name: NameRef,
    /// Its type.
    pub ty: Option<TypeRef>,
    /// Whether it has an initial value.
    pub has_value: bool,
}

/// What callers see of an operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperationHead {
    /// Its name.
    pub name: NameRef,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What it gives back.
    pub result: Option<TypeRef>,
}

/// What the bodies of a core see of it: no program stands in it.
#[salsa::tracked(returns(ref))]
pub(crate) fn core_scope<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Option<CoreScope> {
    let core = core(db, of)?;
    let variable = |it: &Variable| SharedVariable {
        name: it.name.clone(),
        ty: it.ty.clone(),
        has_value: it.value.is_some(),
    };
    let operation = |it: &Arc<Operation>| OperationHead {
        name: it.name.clone(),
        parameters: it.parameters.clone(),
        result: it.result.clone(),
    };
    Some(CoreScope {
        shell: core.shell.clone(),
        variables: core.variables.iter().map(variable).collect(),
        handlers: core.handlers.clone(),
        operations: core.operations.iter().map(operation).collect(),
        machine_variables: core.machines.iter().flat_map(|it| &it.variables).map(variable).collect(),
        hooks: core.hooks.len() as u32,
        states: core.machines.iter().map(|machine| machine.states.len() as u32).collect(),
        completeness: core.completeness & core.machines.iter().map(|it| it.completeness).collect(),
    })
}

/// So many bodies are read by one query: a query for each would cost more than it saves.
const GROUP: usize = 32;

impl CoreScope {
    /// The group that a body is read in; nothing where the core does not have it.
    pub(crate) fn group(&self, body: BodyId) -> Option<u32> {
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
        (number < end).then_some((number / GROUP) as u32)
    }

    /// The groups of its bodies.
    pub(crate) fn groups(&self) -> std::ops::Range<u32> {
        let states: u32 = self.states.iter().sum();
        let bodies = 2 + self.operations.len() + self.hooks as usize + states as usize;
        0..bodies.div_ceil(GROUP) as u32
    }
}

/// The bodies of a group, in the order in which they are checked.
pub(crate) fn bodies_of<'db>(
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    scope: &CoreScope,
    group: u32,
) -> Cow<'db, [(BodyId, Body)]> {
    match scope.groups().len() {
        // Whatever changes in the core changes in this group.
        1 => Cow::Owned(core(db, of).map_or_else(Vec::new, |core| bodies_in(core, group))),
        _ => Cow::Borrowed(bodies_of_group(db, of, group)),
    }
}

/// The bodies of one of several groups: an edit of another one does not change them.
#[salsa::tracked(returns(ref))]
fn bodies_of_group<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Vec<(BodyId, Body)> {
    core(db, of).map_or_else(Vec::new, |core| bodies_in(core, group))
}

fn bodies_in(core: &Core, group: u32) -> Vec<(BodyId, Body)> {
    let values =
        |variables| Body::InitialValues(InitialValues { variables, completeness: core.completeness });
    let body = |id: BodyId| {
        Some((
            id,
            match id {
                BodyId::CoreValues => values(core.variables.clone()),
                BodyId::MachineValues => {
                    values(core.machines.iter().flat_map(|machine| &machine.variables).cloned().collect())
                }
                BodyId::Operation(index) => Body::Operation(core.operations.get(index as usize)?.clone()),
                BodyId::Hook(index) => Body::Hook(core.hooks.get(index as usize)?.clone()),
                BodyId::State(machine, state) => {
                    Body::State(core.machines.get(machine as usize)?.states.get(state as usize)?.clone())
                }
            },
        ))
    };
    core.bodies().skip(group as usize * GROUP).take(GROUP).filter_map(body).collect()
}

/// Visits statements and all within them, in the order of the text.
pub fn statements(statements: &[Statement]) -> impl Iterator<Item = &Statement> {
    let mut open: Vec<&Statement> = statements.iter().rev().collect();
    std::iter::from_fn(move || {
        let next = open.pop()?;
        open.extend(next.blocks().into_iter().flatten().rev());
        Some(next)
    })
}

impl Statement {
    /// Returns its blocks: those of an `if`, or its own; empty where it has none.
    fn blocks(&self) -> [&[Statement]; 2] {
        match self {
            Statement::If { then, otherwise, .. } => [then, otherwise.as_deref().unwrap_or_default()],
            Statement::Block(inner) => [inner, &[]],
            _ => [&[], &[]],
        }
    }

    /// Returns the variable that it declares.
    pub fn variable(&self) -> Option<&Variable> {
        match self {
            Statement::Variable(variable) => Some(variable),
            _ => None,
        }
    }

    /// The expression right in it: a value or a condition.
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
    /// The expression and all within it: a call before its arguments, the left operand before the right one.
    pub fn descendants(&self) -> impl Iterator<Item = &Expr> {
        let mut open = vec![self];
        std::iter::from_fn(move || {
            let next = open.pop()?;
            match next {
                Expr::Missing | Expr::Literal(..) | Expr::Name(_) => {}
                Expr::Incomplete(inner) | Expr::Unary(_, inner, _) => open.push(inner),
                Expr::Binary(_, lhs, rhs, _) => open.extend([rhs.as_ref(), lhs.as_ref()]),
                Expr::Call { arguments, .. } => open.extend(arguments.iter().rev()),
            }
            Some(next)
        })
    }

    /// Returns the names of values in it, those in the arguments of calls aside.
    pub fn names(&self) -> Vec<&Name> {
        let (mut names, mut open) = (Vec::new(), vec![self]);
        while let Some(expr) = open.pop() {
            match expr {
                Expr::Name(name) => names.push(&name.name),
                Expr::Incomplete(inner) | Expr::Unary(_, inner, _) => open.push(inner),
                Expr::Binary(_, lhs, rhs, _) => open.extend([lhs.as_ref(), rhs.as_ref()]),
                Expr::Missing | Expr::Literal(..) | Expr::Call { .. } => {}
            }
        }
        names
    }

    /// Returns whether it may call something: an incomplete expression may.
    pub(crate) fn may_call(&self) -> bool {
        self.descendants().any(|it| matches!(it, Expr::Missing | Expr::Incomplete(_) | Expr::Call { .. }))
    }
}

impl Core {
    /// Returns every block of its programs: each program, and the blocks in it.
    pub fn blocks(&self) -> impl Iterator<Item = &[Statement]> {
        self.programs().into_iter().flat_map(|program| {
            let all = program.statements.as_slice();
            std::iter::once(all).chain(statements(all).flat_map(Statement::blocks))
        })
    }

    /// Every statement of its programs.
    pub fn statements(&self) -> impl Iterator<Item = &Statement> {
        self.programs().into_iter().flat_map(|program| statements(&program.statements))
    }

    /// Every expression in it: the initial values, those of its programs and its guards, without what stands in them.
    pub fn expressions(&self) -> impl Iterator<Item = &Expr> {
        let machines = self.machines.iter().flat_map(|machine| &machine.variables);
        let values = self.variables.iter().chain(machines).filter_map(|variable| variable.value.as_ref());
        let states = self.machines.iter().flat_map(|machine| &machine.states);
        let transitions = states.flat_map(|state| &state.transitions);
        let guards = transitions.filter_map(|transition| Some(&transition.guard.as_ref()?.condition));
        values.chain(self.statements().filter_map(Statement::expression)).chain(guards)
    }
}
