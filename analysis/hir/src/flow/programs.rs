//! The data flow through each program, for each group of bodies: an edit of one group does not invalidate the others.
//!
//! A program is a function of the variables that are assigned before it and of the ports that are written after it. What it
//! reads, assigns and writes describes this function: no other module reads its statements. Local variables and the
//! statements after a `return` concern no other program: their facts are here.

use std::borrow::Cow;
use std::cell::{LazyCell, OnceCell};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{
    Body, BodyId, ByProgram, Code, CoreScope, InitialValues, ProgramIn, bodies_of, by_group, by_program,
    core_scope, of_program, statements,
};
use crate::fact::{Defined, Fact, FactKind, Unreachable, repeated};
use crate::infer::{
    Inference, UNKNOWN_DIRECTION, VariableKind, VariableOf, directions_of, inference_of, returns,
    shared_names, shared_variables,
};
use crate::item_tree::{
    BinaryOperator, Direction, Expr, HookKind, MethodKind, Name, NameRef, Program, SourceId, Statement,
};
use crate::project::Project;
use crate::resolve::{Binding, Callee};
use crate::source::{Decl, Location};
use crate::structure::{StateStructure, Structure, TransitionStructure, indices_of};
use crate::types::Type;

use super::indices::Indices;
use super::operations::{Effects, effects_of};
use super::writes::Writes;

/// The data flow through the programs of a group of bodies.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct GroupFlow<'db> {
    /// The statements after a `return`.
    pub(super) unreachable: Vec<Fact<'db>>,
    /// The facts about parameters and local variables.
    pub(super) local: Vec<Fact<'db>>,
    /// The shared variables that a program reads, or whose values a call needs as output arguments.
    pub(super) used: Indices,
    /// The initial values of shared variables, in the order of the text, each with its variable.
    pub(super) initial_values: Vec<(usize, ProgramFlow)>,
    programs: ByProgram<ProgramFlow>,
}

/// The data flow through a program, a guard or an initial value, as far as other programs see it.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct ProgramFlow {
    /// The reads of shared variables that it may not have assigned before.
    pub(super) reads: Box<[Read]>,
    /// The shared variables that it may assign.
    pub(super) assigns: Indices,
    pub(super) writes: Writes,
}

/// The first read of a variable. The order is that of the variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Read {
    pub(super) variable: usize,
    /// Whether the read depends on a condition, which may know of an assignment in an earlier period.
    pub(super) is_conditional: bool,
    pub(super) id: SourceId,
}

/// The data flow through all programs of a core.
pub(super) struct Programs<'a, 'db> {
    scope: &'db CoreScope,
    groups: &'a [Cow<'db, GroupFlow<'db>>],
    /// The states of its only state machine.
    states: Vec<&'db StateStructure>,
    indices: OnceCell<FxHashMap<&'db Name, usize>>,
}

impl<'a, 'db> Programs<'a, 'db> {
    pub(super) fn new(
        core: &'db Structure,
        scope: &'db CoreScope,
        groups: &'a [Cow<'db, GroupFlow<'db>>],
    ) -> Programs<'a, 'db> {
        let states = core.machine().map_or_else(Vec::new, |(_, states)| states);
        Programs { scope, groups, states, indices: OnceCell::new() }
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = &'a GroupFlow<'db>> {
        self.groups.iter().map(Cow::as_ref)
    }

    pub(super) fn get(&self, body: BodyId, program: ProgramIn) -> Option<&'a ProgramFlow> {
        let (group, index) = self.scope.place(body)?;
        of_program(&self.groups.get(group)?.programs, index, program)
    }

    /// Returns a program of a state of the only state machine of the core.
    pub(super) fn of_state(&self, index: usize, program: ProgramIn) -> Option<&'a ProgramFlow> {
        self.get(BodyId::State(0, index as u32), program)
    }

    /// Returns the method of a state of the only state machine of the core.
    pub(super) fn method(&self, index: usize, kind: MethodKind) -> Option<&'a ProgramFlow> {
        self.of_state(index, self.states.get(index)?.method(kind)?)
    }

    /// Returns all programs and guards.
    pub(super) fn all(&self) -> impl Iterator<Item = &'a (ProgramIn, ProgramFlow)> {
        self.groups().flat_map(|group| &group.programs).flatten()
    }

    /// Returns the states of the only state machine of the core.
    pub(super) fn states(&self) -> &[&'db StateStructure] {
        &self.states
    }

    /// Returns the index of the first state of each name.
    pub(super) fn indices(&self) -> &FxHashMap<&'db Name, usize> {
        self.indices.get_or_init(|| indices_of(&self.states))
    }

    /// Returns the index of the state that a transition leads to.
    pub(super) fn target(&self, transition: &TransitionStructure) -> Option<usize> {
        self.indices().get(&transition.target.as_ref()?.name).copied()
    }
}

/// Returns the data flow of each group of bodies of a core.
pub(super) fn groups_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &'db CoreScope,
    effects: &[Effects],
) -> Vec<Cow<'db, GroupFlow<'db>>> {
    let of_group = |group| flow_of_group(db, project, of, group);
    by_group(db, of, || flow_in(db, project, of, scope, effects, 0), of_group)
}

/// Returns the data flow of one of several groups of bodies.
#[salsa::tracked(returns(ref))]
fn flow_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> GroupFlow<'db> {
    let Some(scope) = core_scope(db, of) else { return GroupFlow::default() };
    flow_in(db, project, of, scope, &effects_of(db, project, of, scope), group)
}

fn flow_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &'db CoreScope,
    effects: &[Effects],
    group: u32,
) -> GroupFlow<'db> {
    let bodies = bodies_of(db, of, scope, group);
    let mut flow = Flow {
        db,
        project,
        of,
        scope,
        inference: inference_of(db, project, of, group),
        shared: shared_variables(db, project, of),
        effects,
        previous: FxHashMap::default(),
        conditions: 0,
        used: Indices::default(),
        reads: Vec::new(),
        found: GroupFlow::default(),
    };
    flow.previous = flow.repeated_variables(&bodies);
    for (id, body) in bodies.iter() {
        if let Body::InitialValues(values) = body {
            flow.initial_values(*id, values);
        }
    }
    flow.found.programs = by_program(&bodies, |body, program, code| flow.program(body, program, code));
    flow.unused_variables(&bodies);
    flow.found.used = flow.used.below(flow.shared.len());
    flow.found.initial_values.shrink_to_fit();
    flow.found
}

/// Walks through the programs of a group. A variable is a number: first the shared variables, then those of the group.
struct Flow<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &'db CoreScope,
    inference: &'db Inference<'db>,
    shared: &'db [VariableOf],
    effects: &'a [Effects],
    /// For each variable of the group that repeats a name of its scope, the previous variable of that name.
    previous: FxHashMap<usize, usize>,
    /// The number of conditions around the current statement.
    conditions: usize,
    /// The variables that a program reads, or whose values a call needs as output arguments.
    used: Indices,
    /// The reads of the current program before an assignment.
    reads: Vec<Read>,
    found: GroupFlow<'db>,
}

impl<'db> Flow<'_, 'db> {
    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    /// Returns, for each variable that repeats a name of its scope, the previous variable of that name. Another fact reports
    /// the repetition, and does not say which of them a reference should use.
    fn repeated_variables(&self, bodies: &[(BodyId, Body)]) -> FxHashMap<usize, usize> {
        let parameters = bodies.iter().flat_map(|(_, body)| match body {
            Body::Operation(operation) => {
                let names = operation.parameters.iter().map(|it| (&it.name, Defined::Parameter));
                repeated(self.of, names)
            }
            _ => Vec::new(),
        });
        let parameters: Vec<Fact<'db>> = parameters.collect();
        let pairs =
            self.inference.facts.iter().chain(&parameters).filter_map(|fact| match (&fact.at, &fact.kind) {
                (
                    Location::Source(_, id),
                    FactKind::DuplicateDefinition { first: Location::Source(_, first), .. },
                ) => Some((*first, *id)),
                _ => None,
            });
        let numbers = LazyCell::new(|| {
            let numbers = self.inference.variables.iter().zip(self.shared.len()..);
            numbers
                .map(|(variable, number)| (variable.name.id, number))
                .collect::<FxHashMap<SourceId, usize>>()
        });
        let (mut previous, mut last) = (FxHashMap::default(), FxHashMap::default());
        for (first, id) in pairs {
            let (Some(&first), Some(&number)) = (numbers.get(&first), numbers.get(&id)) else { continue };
            previous.insert(number, last.insert(first, number).unwrap_or(first));
        }
        previous
    }

    fn variable_of(&self, number: usize) -> Option<&'db VariableOf> {
        match number.checked_sub(self.shared.len()) {
            Some(own) => self.inference.variables.get(own),
            None => self.shared.get(number),
        }
    }

    /// Returns the variable that a name refers to.
    fn variable(&self, id: SourceId) -> Option<usize> {
        match self.inference.binding(id)? {
            Binding::Variable(id) if id.group.is_some() => Some(self.shared.len() + id.index as usize),
            Binding::Variable(id) => Some(id.index as usize),
            Binding::Feature(_) => None,
        }
    }

    fn initial_values(&mut self, body: BodyId, values: &InitialValues) {
        let names = shared_names(self.db, self.project, self.of);
        let names = if body == BodyId::MachineValues { &names.machine } else { &names.core };
        for variable in &values.variables {
            let number = names.get(&variable.name.name).map(|id| id.index as usize);
            if let Some((value, number)) = variable.value.as_ref().zip(number) {
                let found = self.read_and_assigned(|this, assigned| this.expr(value, assigned));
                self.found.initial_values.push((number, found));
            }
        }
    }

    fn program(&mut self, body: &Body, id: ProgramIn, code: Code<'_>) -> ProgramFlow {
        let program = match code {
            Code::Program(program) => program,
            Code::Guard(guard) => {
                return self.read_and_assigned(|this, assigned| this.expr(&guard.condition, assigned));
            }
        };
        self.unreachable_code(program);
        self.conditions = match (body, id) {
            (Body::State(state), ProgramIn::Effect(number)) => {
                let transition = state.transitions.get(number as usize);
                usize::from(transition.is_some_and(|transition| transition.guard.is_some()))
            }
            _ => 0,
        };
        let found = self.read_and_assigned(|this, assigned| this.block(&program.statements, assigned));
        self.conditions = 0;
        // Only the ports that a period writes matter.
        let is_in_period = !matches!(body, Body::Hook(hook) if hook.kind != HookKind::Update);
        let writes = match is_in_period {
            true => Writes::of(&program.statements, self.inference, self.effects),
            false => Writes::default(),
        };
        ProgramFlow { writes, ..found }
    }

    fn unreachable_code(&mut self, program: &Program) {
        for block in program.blocks() {
            let end = block.iter().position(|it| returns(std::slice::from_ref(it)));
            if let Some(id) = end.and_then(|end| block.get(end + 1)?.id()) {
                let kind = FactKind::UnreachableCode(Unreachable::BehindReturn);
                self.found.unreachable.push(Fact::new(self.at(id), kind));
            }
        }
    }

    /// Returns what `walk` reads and assigns, and reports the reads of local variables that are not assigned.
    fn read_and_assigned(&mut self, walk: impl FnOnce(&mut Self, &mut Indices)) -> ProgramFlow {
        let mut assigned = Indices::default();
        walk(self, &mut assigned);
        let mut reads = std::mem::take(&mut self.reads);
        reads.sort_unstable();
        reads.dedup_by_key(|read| (read.variable, read.is_conditional));
        let local = reads.split_off(reads.partition_point(|read| read.variable < self.shared.len()));
        for of_variable in local.chunk_by(|one, other| one.variable == other.variable) {
            let is_unassigned = |read: &&Read| {
                let mut all = with_repeated(&self.previous, read.variable);
                !read.is_conditional || !all.any(|it| assigned.contains(it))
            };
            let first = of_variable.iter().filter(is_unassigned).map(|read| (read.id, read.variable)).min();
            let Some((id, variable)) = first else { continue };
            let Some(NameRef { name, id: declared }) = self.variable_of(variable).map(|it| &it.name) else {
                continue;
            };
            let kind = FactKind::ReadBeforeAssignment { name: name.clone(), declared: self.at(*declared) };
            self.found.local.push(Fact::new(self.at(id), kind));
        }
        ProgramFlow {
            reads: reads.into(),
            assigns: assigned.below(self.shared.len()),
            writes: Writes::default(),
        }
    }

    fn block(&mut self, statements: &[Statement], assigned: &mut Indices) {
        for statement in statements {
            match statement {
                Statement::If { condition, then, otherwise, .. } => {
                    self.expr(condition, assigned);
                    // Both branches start with the same variables; after them, the variables that either assigns count.
                    let mut other = assigned.clone();
                    self.conditions += 1;
                    self.block(then, assigned);
                    self.block(otherwise.as_deref().unwrap_or_default(), &mut other);
                    self.conditions -= 1;
                    assigned.add(&other);
                }
                Statement::Block(inner) => self.block(inner, assigned),
                Statement::Assign(target, value) => {
                    self.expr(value, assigned);
                    self.variable(target.id).into_iter().for_each(|number| assigned.insert(number));
                }
                Statement::Variable(_) | Statement::Return(..) | Statement::Expr(_) => {
                    statement.expression().into_iter().for_each(|value| self.expr(value, assigned));
                }
            }
        }
    }

    fn expr(&mut self, expr: &Expr, assigned: &mut Indices) {
        match expr {
            Expr::Missing | Expr::Literal(..) => {}
            Expr::Name(name) => self.read(name.id, assigned),
            Expr::Incomplete(inner) | Expr::Unary(_, inner, _) => self.expr(inner, assigned),
            Expr::Binary(operator, lhs, rhs, _) => {
                self.expr(lhs, assigned);
                let is_condition = matches!(operator, BinaryOperator::And | BinaryOperator::Or);
                self.conditions += usize::from(is_condition);
                self.expr(rhs, assigned);
                self.conditions -= usize::from(is_condition);
            }
            Expr::Call { callee, arguments, .. } => self.call(callee.id, arguments, assigned),
        }
    }

    fn read(&mut self, id: SourceId, assigned: &Indices) {
        let Some(variable) = self.variable(id) else { return };
        self.use_variable(variable);
        let has_value =
            |it: usize| it >= self.shared.len() && self.variable_of(it).is_some_and(|it| it.has_value);
        // Whether an unknown type, such as a pointer, has an initial value is unknown.
        let ty = self.variable_of(variable).map(|it| &it.ty);
        if !matches!(ty, None | Some(Type::External(_) | Type::Unknown))
            && !with_repeated(&self.previous, variable).any(|it| assigned.contains(it) || has_value(it))
        {
            self.reads.push(Read { variable, is_conditional: self.conditions > 0, id });
        }
    }

    fn use_variable(&mut self, number: usize) {
        with_repeated(&self.previous, number).for_each(|it| self.used.insert(it));
    }

    fn call(&mut self, callee: SourceId, arguments: &[Expr], assigned: &mut Indices) {
        let callee = self.inference.callee(callee);
        let count = arguments.len();
        let directions = match callee {
            Some(callee) => directions_of(self.db, self.scope, callee, count),
            None => vec![UNKNOWN_DIRECTION; count],
        };
        let mut outputs = Vec::new();
        for (argument, direction) in arguments.iter().zip(directions) {
            match (direction, argument) {
                (Direction::Out | Direction::InOut, Expr::Name(name)) => {
                    outputs.extend(self.variable(name.id))
                }
                (_, argument) => self.expr(argument, assigned),
            }
        }
        for output in outputs {
            self.use_variable(output);
            assigned.insert(output);
        }
        if let Some(Callee::Operation(index)) = callee
            && let Some(effects) = self.effects.get(index)
        {
            assigned.add(&effects.assigns);
        }
    }

    fn unused_variables(&mut self, bodies: &[(BodyId, Body)]) {
        let first = self.shared.len();
        // Lazy, because most cores have no unused variables.
        let named = LazyCell::new(|| {
            let names = self.inference.bindings().map(|(id, _)| id);
            names.filter_map(|id| self.variable(id)).collect::<FxHashSet<usize>>()
        });
        let calls = LazyCell::new(|| {
            let code = bodies.iter().flat_map(|(_, body)| body.code());
            let programs = code.filter_map(|(_, code)| match code {
                Code::Program(program) => Some(program),
                Code::Guard(_) => None,
            });
            let all = programs.flat_map(|program| statements(&program.statements));
            let with_call = all.filter_map(Statement::variable).filter(|it| it.calls_in_value());
            with_call.map(|variable| variable.name.id).collect::<FxHashSet<SourceId>>()
        });
        let mut found = Vec::new();
        for (variable, number) in self.inference.variables.iter().zip(first..) {
            let is_parameter = matches!(variable.kind, VariableKind::Parameter(_));
            if !is_parameter && !self.used.contains(number) {
                let NameRef { id, .. } = variable.name;
                let is_removable = !named.contains(&number) && !calls.contains(&id);
                found.extend(unused(self.of, variable, is_removable));
            }
        }
        self.found.local.extend(found);
    }
}

/// Returns a variable and, if it repeats a name of its scope, the variables of that name before it.
fn with_repeated(previous: &FxHashMap<usize, usize>, number: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(number), |later| previous.get(later).copied())
}

/// Returns the fact about a variable that no program uses; `None` if its name is missing.
pub(super) fn unused<'db>(of: Decl<'db>, variable: &VariableOf, is_removable: bool) -> Option<Fact<'db>> {
    let NameRef { name, id } = &variable.name;
    let is_handler = variable.kind == VariableKind::Handler;
    let kind = FactKind::UnusedVariable { is_handler, name: name.clone(), is_removable };
    (!name.is_empty()).then(|| Fact::new(Location::Source(of, *id), kind))
}
