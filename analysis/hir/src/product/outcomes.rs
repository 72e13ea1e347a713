//! What a program does to the followed variables, and what it costs then: for each valuation of those that it uses, its outcomes.
//!
//! ```text
//! if count == 0 { plan(); count = 9; } else { count = count - 1; }
//!     count = 0: count = 9, plan()        count = 4: count = 3        count = any: both
//! ```
//!
//! A program is reduced to what followed variables depend on, so that an edit of anything else leaves it equal. Outcomes are
//! remembered with it: after an edit, only those of programs that changed are computed.

use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::body::ProgramIn;
use crate::cost::{Cost, CostOf, Costs, NOTHING};
use crate::item_tree::{BinaryOperator, Direction, SourceId, UnaryOperator};
use crate::program_graph::{Action, Call, ProgramGraph, Term};
use crate::resolve::VariableId;
use crate::values::Value;

/// A value that may be any. No variable is followed as far.
pub(super) const ANY: i32 = i32::MIN;

/// The values of some variables.
pub(super) type Valuation = Box<[i32]>;

/// The most nodes of a program with the operations that it calls, and the most paths to one of them.
const MAX_NODES: usize = 1 << 14;
const MAX_PATHS: usize = 512;
/// The most valuations whose outcomes a program remembers.
const MOST_KNOWN: usize = 4096;
/// The most operations that call each other.
const MAX_CALLS: usize = 64;

/// Sets of registers are bits of this: those beyond are not followed.
type Registers = u128;
const MAX_REGISTERS: usize = 128;

/// What programs are reduced to.
pub(super) struct Reduction<'a, 'db> {
    /// The followed variables.
    pub(super) followed: &'a FxHashSet<VariableId>,
    /// Numbers that are farther from 0 count as any value.
    pub(super) farthest: i32,
    /// The graph of each operation, and which of its parameters have few values, and whether its result has.
    pub(super) operations: &'a [ReducedOperation<'db>],
}

/// An operation, as its callers see it.
#[derive(Debug, PartialEq, Eq, salsa::SalsaValue)]
pub(super) struct ReducedOperation<'db> {
    pub(super) graph: Arc<ProgramGraph<'db>>,
    /// The variable of each parameter, if it has few values.
    pub(super) parameters: Vec<(VariableId, bool)>,
    pub(super) is_result_small: bool,
}

/// A program, reduced to what the followed variables depend on.
#[derive(Debug, salsa::SalsaValue)]
pub(super) struct ReducedProgram<'db> {
    reduced: Reduced<'db>,
    /// The outcomes so far.
    known: Mutex<KnownOutcomes>,
}

/// Outcomes by valuation, for each set of variables that are widened.
type KnownOutcomes = Vec<(Vec<VariableId>, FxHashMap<Valuation, Arc<Outcomes>>)>;

/// The only path of a program from a valuation, whose conditions are all known.
#[derive(Debug, Default)]
pub(super) struct OnlyPath {
    /// The values of registers; the first ones are those of [`ReducedProgram::variables`].
    pub(super) registers: Vec<i32>,
    /// The calls, in their order: see [`ReducedProgram::cost_of`].
    pub(super) calls: Vec<u32>,
    /// The values that variables get.
    pub(super) seen: Vec<(VariableId, i32)>,
    /// The number of steps that were executed, of all programs so far.
    pub(super) steps: usize,
}

impl PartialEq for ReducedProgram<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.reduced == other.reduced
    }
}

impl Eq for ReducedProgram<'_> {}

/// What a program may do from a valuation.
#[derive(Debug, Default)]
pub(super) struct Outcomes {
    /// At most one for each end with the same values.
    pub(super) all: Vec<ProgramOutcome>,
    /// The parts of their costs; each refers to earlier ones only. An execution is that of a call: see [`ReducedProgram::cost_of`].
    pub(super) costs: Vec<CostOf<u32>>,
    /// The values that variables get.
    pub(super) seen: Vec<(VariableId, i32)>,
    /// Whether each condition holds; none where it may, and may not.
    pub(super) decided: Vec<(SourceId, Option<bool>)>,
    /// There are more paths than are followed.
    pub(super) is_too_large: bool,
    /// The number of steps of all paths.
    steps: usize,
}

#[derive(Debug)]
pub(super) struct ProgramOutcome {
    /// Whether a guard holds; false for other programs.
    pub(super) holds: bool,
    /// Those of [`ReducedProgram::variables`].
    pub(super) values: Valuation,
    /// An index in [`Outcomes::costs`].
    pub(super) cost: u32,
}

#[derive(Debug, PartialEq, Eq, salsa::SalsaValue)]
struct Reduced<'db> {
    steps: Vec<OutcomeStep<'db>>,
    values: Vec<ReducedOperand>,
    /// The shared variables that it uses: the first registers.
    variables: Vec<VariableId>,
    /// The number of registers.
    width: usize,
    farthest: i32,
    has_conditions: bool,
    /// There are more steps than are followed.
    is_too_large: bool,
}

#[derive(Debug, PartialEq, Eq, salsa::SalsaValue)]
struct OutcomeStep<'db> {
    kind: StepKind<'db>,
    next: u32,
    /// The registers whose values matter before it.
    live: Registers,
    /// The places, in the order of all paths, of those to the next step, and of those where a condition does not hold.
    order: [u32; 2],
}

#[derive(Debug, PartialEq, Eq, salsa::SalsaValue)]
enum StepKind<'db> {
    Nothing,
    Branch {
        condition: u32,
        fails: u32,
        at: SourceId,
    },
    /// The variable is none for a parameter or a result.
    Assign {
        to: u32,
        value: u32,
        variable: Option<VariableId>,
    },
    /// A call. The registers may have any value afterwards.
    Call {
        cost: Cost<'db>,
        changes: Box<[(u32, Option<VariableId>)]>,
    },
    /// The call of an operation, whose steps are the next ones up to this one.
    Operation {
        index: usize,
        end: u32,
    },
    Return(Option<u32>),
}

/// A value that is reduced to what followed variables depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ReducedOperand {
    Any,
    Known(i32),
    /// A register, and its variable, whose value conditions tell; none for a parameter or a result.
    Register(u32, Option<VariableId>),
    Unary(UnaryOperator, u32),
    Binary(BinaryOperator, u32, u32),
}

const UNKNOWN: u32 = 0;

impl<'db> ReducedProgram<'db> {
    pub(super) fn new(
        place: ProgramIn,
        graph: &ProgramGraph<'db>,
        reduction: &Reduction<'_, 'db>,
    ) -> ReducedProgram<'db> {
        let mut reducer = Reducer {
            reduction,
            found: Reduced {
                steps: Vec::new(),
                values: vec![ReducedOperand::Any],
                variables: Vec::new(),
                width: 0,
                farthest: reduction.farthest,
                has_conditions: false,
                is_too_large: false,
            },
            shared: FxHashMap::default(),
            registers: Vec::new(),
            is_guard: matches!(place, ProgramIn::Guard(_)),
            calls: 0,
        };
        reducer.shared_variables(graph);
        reducer.graph(graph, FxHashMap::default(), None);
        reducer.found.find_live();
        reducer.found.find_order();
        ReducedProgram { reduced: reducer.found, known: Mutex::default() }
    }

    /// The followed variables that it uses.
    pub(super) fn variables(&self) -> &[VariableId] {
        &self.reduced.variables
    }

    /// Returns whether conditions decide what it does.
    pub(super) fn has_conditions(&self) -> bool {
        self.reduced.has_conditions
    }

    /// Returns the cost of a call.
    pub(super) fn cost_of(&self, step: u32) -> Cost<'db> {
        match self.reduced.steps.get(step as usize).map(|it| &it.kind) {
            Some(StepKind::Call { cost, .. }) => cost.clone(),
            _ => Cost::Nothing,
        }
    }

    /// Executes it with these values of its variables: the first registers of `path`. Returns whether a guard holds; none if it has
    /// several paths, executes operations, or is too large. `widened` variables have any value.
    pub(super) fn only_path(&self, widened: &[VariableId], path: &mut OnlyPath) -> Option<bool> {
        let program = &self.reduced;
        if program.is_too_large {
            return None;
        }
        path.registers.resize(program.width, ANY);
        path.calls.clear();
        path.seen.clear();
        let mut next = 0;
        for _ in 0..MAX_NODES {
            let step = program.steps.get(next as usize)?;
            path.steps += 1;
            next = match &step.kind {
                StepKind::Nothing => step.next,
                StepKind::Branch { condition, fails, .. } => match program.value(*condition, &path.registers)
                {
                    ANY => return None,
                    0 => *fails,
                    _ => step.next,
                },
                StepKind::Assign { .. } | StepKind::Call { .. } => {
                    let calls = program.change(step, widened, &mut path.registers, &mut path.seen);
                    path.calls.extend(calls.then_some(next));
                    step.next
                }
                StepKind::Operation { .. } => return None,
                StepKind::Return(value) => match value.map_or(0, |it| program.value(it, &path.registers)) {
                    ANY => return None,
                    value => return Some(value != 0),
                },
            };
        }
        None
    }

    /// Returns what it may do with these values of its variables. `widened` variables have any value. Adds what it executes to `steps`:
    /// nothing if the outcomes are known.
    pub(super) fn outcomes(
        &self,
        widened: &[VariableId],
        values: &[i32],
        steps: &mut usize,
    ) -> Arc<Outcomes> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let place = known.iter().position(|(it, _)| it == widened).unwrap_or_else(|| {
            known.push((widened.to_vec(), FxHashMap::default()));
            known.len() - 1
        });
        let Some((_, known)) = known.get_mut(place) else { return Arc::default() };
        if let Some(found) = known.get(values) {
            return found.clone();
        }
        let found = Arc::new(self.reduced.outcomes(widened, values));
        *steps += found.steps;
        // An editor's session may come to many valuations.
        if known.len() >= MOST_KNOWN {
            known.clear();
        }
        known.insert(values.into(), found.clone());
        found
    }
}

struct Reducer<'a, 'db> {
    reduction: &'a Reduction<'a, 'db>,
    found: Reduced<'db>,
    /// The registers of shared variables.
    shared: FxHashMap<VariableId, u32>,
    /// The registers so far, each with its variable; none for a parameter or a result.
    registers: Vec<Option<VariableId>>,
    is_guard: bool,
    /// The number of operations that it is in.
    calls: usize,
}

/// The registers of a graph; none where nothing is followed.
type FollowedRegisters = FxHashMap<u32, Option<u32>>;

/// The call of an operation: the register of its result, and whether it has few values.
type Called = (Option<u32>, bool);

impl<'db> Reducer<'_, 'db> {
    /// Notes the followed shared variables that a program and the operations that it calls use.
    fn shared_variables(&mut self, graph: &ProgramGraph<'db>) {
        let (mut open, mut seen, mut all) = (vec![graph], FxHashSet::default(), FxHashSet::default());
        while let Some(graph) = open.pop() {
            all.extend(graph.registers.iter().filter_map(|it| it.variable).filter(|it| it.group.is_none()));
            for index in graph.calls().filter_map(Call::operation).filter(|index| seen.insert(*index)) {
                open.extend(self.reduction.operations.get(index).map(|it| &*it.graph));
            }
        }
        let mut all: Vec<VariableId> =
            all.into_iter().filter(|it| self.reduction.followed.contains(it)).collect();
        all.sort_unstable();
        // Without a register, the value of a variable would be what it was before.
        self.found.is_too_large |= all.len() > MAX_REGISTERS;
        all.truncate(MAX_REGISTERS);
        for &variable in &all {
            let register = self.register(Some(variable));
            self.shared.extend(register.map(|register| (variable, register)));
        }
        self.found.variables = all;
    }

    fn register(&mut self, variable: Option<VariableId>) -> Option<u32> {
        let next = self.registers.len();
        (next < MAX_REGISTERS).then(|| {
            self.registers.push(variable);
            self.found.width = self.found.width.max(next + 1);
            next as u32
        })
    }

    fn value(&mut self, operand: ReducedOperand) -> u32 {
        if operand == ReducedOperand::Any {
            return UNKNOWN;
        }
        self.found.values.push(operand);
        self.found.values.len() as u32 - 1
    }

    fn push(&mut self, kind: StepKind<'db>) -> u32 {
        let next = self.found.steps.len() as u32 + 1;
        self.found.steps.push(OutcomeStep { kind, next, live: 0, order: [0; 2] });
        next - 1
    }

    /// Adds the steps of a graph. Its registers are those of `bound`, or own ones. The returns of an operation assign its result.
    fn graph(&mut self, graph: &ProgramGraph<'db>, mut bound: FollowedRegisters, called: Option<Called>) {
        if self.found.steps.len() + graph.nodes.len() > MAX_NODES || self.calls > MAX_CALLS {
            self.found.is_too_large = true;
            return;
        }
        // What codels and built-in functions return is any value.
        let unknown = graph.calls().filter(|call| call.operation().is_none());
        bound.extend(unknown.map(|call| (call.result, None)));
        for (number, register) in (0..).zip(&graph.registers) {
            if bound.contains_key(&number) {
                continue;
            }
            let own = match register.variable {
                Some(it) if it.group.is_none() => self.shared.get(&it).copied(),
                Some(it) if !self.reduction.followed.contains(&it) => None,
                variable => self.register(variable),
            };
            bound.insert(number, own);
        }
        let reached = graph.reached();
        // The first step of each node, and what leads to a node.
        let mut first: Vec<u32> = Vec::with_capacity(graph.nodes.len());
        let mut open: Vec<(u32, bool, u32)> = Vec::new();
        let mut ends = Vec::new();
        for (node, reached) in graph.nodes.iter().zip(reached) {
            first.push(self.found.steps.len() as u32);
            if !reached {
                continue;
            }
            let last = match &node.action {
                Action::Nothing => self.push(StepKind::Nothing),
                Action::Branch { condition, fails, .. } => {
                    let condition = self.term(graph, *condition, &bound);
                    self.found.has_conditions = true;
                    let step = self.push(StepKind::Branch { condition, fails: 0, at: node.at });
                    open.push((step, true, *fails));
                    step
                }
                Action::Assign { to, value } => match bound.get(to).copied().flatten() {
                    Some(own) => {
                        // A parameter may be a variable of the caller.
                        let variable = self.registers.get(own as usize).copied().flatten();
                        let variable = variable.or(graph.variable(*to));
                        let is_followed = variable.is_none_or(|it| self.reduction.followed.contains(&it));
                        let value = value.filter(|_| is_followed);
                        let value = value.map_or(UNKNOWN, |value| self.term(graph, value, &bound));
                        self.push(StepKind::Assign { to: own, value, variable })
                    }
                    None => self.push(StepKind::Nothing),
                },
                Action::Call(call) => self.call(graph, call, &bound),
                Action::Return(value) => {
                    let value = value.map(|value| self.term(graph, value, &bound));
                    match called {
                        None => _ = self.push(StepKind::Return(value.filter(|_| self.is_guard))),
                        Some((None, _)) => ends.push(self.push(StepKind::Nothing)),
                        Some((Some(to), is_small)) => {
                            let value = value.filter(|_| is_small).unwrap_or(UNKNOWN);
                            ends.push(self.push(StepKind::Assign { to, value, variable: None }));
                        }
                    }
                    continue;
                }
            };
            open.push((last, false, node.next));
            if self.found.is_too_large {
                return;
            }
        }
        let end = self.found.steps.len() as u32;
        let targets =
            open.into_iter().map(|(step, fails, node)| (step, fails, first.get(node as usize).copied()));
        let targets = targets.chain(ends.into_iter().map(|step| (step, false, Some(end))));
        for (step, of_branch, target) in targets.collect::<Vec<_>>() {
            let (Some(step), Some(target)) = (self.found.steps.get_mut(step as usize), target) else {
                continue;
            };
            match &mut step.kind {
                StepKind::Branch { fails, .. } if of_branch => *fails = target,
                _ => step.next = target,
            }
        }
    }

    /// Adds the steps of a call; returns the last one.
    fn call(&mut self, graph: &ProgramGraph<'db>, call: &Call<'db>, bound: &FollowedRegisters) -> u32 {
        let register = |number: u32| bound.get(&number).copied().flatten();
        let operations = self.reduction.operations;
        let called = call.operation().and_then(|index| Some((index, operations.get(index)?)));
        let Some((index, operation)) = called else {
            let changed = call.arguments.iter().filter(|it| it.direction != Direction::In);
            let changed = changed.filter_map(|it| it.variable).filter_map(register);
            let variable = |register: u32| self.registers.get(register as usize).copied().flatten();
            let changes = changed.map(|register| (register, variable(register))).collect();
            return self.push(StepKind::Call { cost: call.cost(), changes });
        };
        // Parameters that it changes are the variables of the caller.
        let mut parameters = FxHashMap::default();
        let outer = self.registers.len();
        for (&(parameter, is_small), argument) in operation.parameters.iter().zip(&call.arguments) {
            let number = operation.graph.registers.iter().position(|it| it.variable == Some(parameter));
            let Some(number) = number else { continue };
            let own = match argument.variable.filter(|_| argument.direction != Direction::In) {
                Some(variable) => register(variable),
                None => {
                    let own = if is_small { self.register(None) } else { None };
                    if let Some(to) = own {
                        let is_value = argument.direction == Direction::In;
                        let value = if is_value { self.term(graph, argument.value, bound) } else { UNKNOWN };
                        self.push(StepKind::Assign { to, value, variable: None });
                    }
                    own
                }
            };
            parameters.insert(number as u32, own);
        }
        let enter = self.push(StepKind::Operation { index, end: 0 });
        let result = register(call.result);
        self.calls += 1;
        self.graph(&operation.graph, parameters, Some((result, operation.is_result_small)));
        self.calls -= 1;
        // The registers of an operation end with it.
        self.registers.truncate(outer);
        let last = self.push(StepKind::Nothing);
        if let Some(OutcomeStep { kind: StepKind::Operation { end, .. }, .. }) =
            self.found.steps.get_mut(enter as usize)
        {
            *end = last;
        }
        last
    }

    fn term(&mut self, graph: &ProgramGraph<'db>, term: u32, bound: &FollowedRegisters) -> u32 {
        let operand = match graph.term(term) {
            Term::Bool(value) | Term::Decided(value, _) => ReducedOperand::Known(value.into()),
            Term::Int(value) => ReducedOperand::Known(value),
            Term::Status(value) => ReducedOperand::Known(value.into()),
            Term::Missing | Term::Other | Term::Feature | Term::Incomplete(_) => ReducedOperand::Any,
            Term::Register(register, _) => match bound.get(&register).copied().flatten() {
                Some(register) => ReducedOperand::Register(
                    register,
                    self.registers.get(register as usize).copied().flatten(),
                ),
                None => ReducedOperand::Any,
            },
            Term::Unary(operator, inner) => match self.term(graph, inner, bound) {
                UNKNOWN => ReducedOperand::Any,
                inner => ReducedOperand::Unary(operator, inner),
            },
            Term::Binary(..) => return self.binary(graph, term, bound),
        };
        self.value(operand)
    }

    fn binary(&mut self, graph: &ProgramGraph<'db>, term: u32, bound: &FollowedRegisters) -> u32 {
        let (first, operands) = graph.spine(term);
        let mut value = self.term(graph, first, bound);
        for (operator, right) in operands {
            let right = self.term(graph, right, bound);
            value = match (value, right) {
                (UNKNOWN, _) | (_, UNKNOWN) => UNKNOWN,
                _ => self.value(ReducedOperand::Binary(operator, value, right)),
            };
        }
        value
    }
}

fn bit(register: u32) -> Registers {
    1_u128.checked_shl(register).unwrap_or_default()
}

/// A path: the values of the registers, and the cost so far.
type RegisterPath = (Valuation, u32);

impl<'db> Reduced<'db> {
    fn operand(&self, value: u32) -> ReducedOperand {
        self.values.get(value as usize).copied().unwrap_or(ReducedOperand::Any)
    }

    /// Finds the registers whose values matter. At the end, those of shared variables do.
    fn find_live(&mut self) {
        let shared = (0..self.variables.len() as u32).fold(0, |all, register| all | bit(register));
        for index in (0..self.steps.len()).rev() {
            let Some(step) = self.steps.get(index) else { continue };
            let after = |next: u32| self.steps.get(next as usize).map_or(shared, |it| it.live);
            let live = match &step.kind {
                StepKind::Nothing | StepKind::Operation { .. } => after(step.next),
                StepKind::Branch { condition, fails, .. } => {
                    after(step.next) | after(*fails) | self.used(*condition)
                }
                StepKind::Assign { to, value, .. } => after(step.next) & !bit(*to) | self.used(*value),
                StepKind::Call { changes, .. } => {
                    changes.iter().fold(after(step.next), |live, (register, _)| live & !bit(*register))
                }
                StepKind::Return(value) => shared | value.map_or(0, |value| self.used(value)),
            };
            if let Some(step) = self.steps.get_mut(index) {
                step.live = live;
            }
        }
    }

    /// Finds the order of paths: at each branch, those where the condition holds are before the others.
    fn find_order(&mut self) {
        let (mut open, mut seen, mut next) = (vec![(0, 1), (0, 0)], vec![false; self.steps.len()], 0);
        // The second way exists for branches only.
        while let Some((index, which)) = open.pop() {
            let Some(step) = self.steps.get_mut(index as usize) else { continue };
            let target = match (&step.kind, which) {
                (StepKind::Branch { fails, .. }, 1) => *fails,
                (_, 1) => continue,
                (StepKind::Return(_), _) => u32::MAX,
                _ => step.next,
            };
            next += 1;
            step.order.get_mut(which).into_iter().for_each(|it| *it = next);
            if let Some(seen) = seen.get_mut(target as usize).filter(|seen| !**seen) {
                *seen = true;
                open.extend([(target, 1), (target, 0)]);
            }
        }
    }

    fn used(&self, value: u32) -> Registers {
        let (mut open, mut used) = (vec![value], 0);
        while let Some(value) = open.pop() {
            match self.operand(value) {
                ReducedOperand::Any | ReducedOperand::Known(_) => {}
                ReducedOperand::Register(register, _) => used |= bit(register),
                ReducedOperand::Unary(_, inner) => open.push(inner),
                ReducedOperand::Binary(_, one, other) => open.extend([one, other]),
            }
        }
        used
    }

    fn value(&self, value: u32, registers: &[i32]) -> i32 {
        match self.operand(value) {
            ReducedOperand::Any => ANY,
            ReducedOperand::Known(value) => value,
            ReducedOperand::Register(register, _) => registers.get(register as usize).copied().unwrap_or(ANY),
            ReducedOperand::Unary(operator, inner) => match (operator, self.value(inner, registers)) {
                (_, ANY) => ANY,
                (UnaryOperator::Not, value) => i32::from(value == 0),
                (UnaryOperator::Minus, value) => value.checked_neg().unwrap_or(ANY),
            },
            ReducedOperand::Binary(operator, left, right) => {
                // A long sum is no deep recursion.
                let (mut first, mut operands) = (left, vec![(operator, right)]);
                while let ReducedOperand::Binary(operator, left, right) = self.operand(first) {
                    operands.push((operator, right));
                    first = left;
                }
                let first = self.value(first, registers);
                operands.into_iter().rev().fold(first, |left, (operator, right)| {
                    match (left, self.value(right, registers)) {
                        (ANY, _) | (_, ANY) => ANY,
                        (left, right) => binary(operator, left, right),
                    }
                })
            }
        }
    }

    /// Executes an assignment, or a call; returns whether it is a call that costs something. Adds the values that variables get: any
    /// if they are far from 0.
    fn change(
        &self,
        step: &OutcomeStep<'db>,
        widened: &[VariableId],
        registers: &mut [i32],
        seen: &mut Vec<(VariableId, i32)>,
    ) -> bool {
        let mut set = |registers: &mut [i32], register: u32, variable: Option<VariableId>, value: i32| {
            registers.get_mut(register as usize).into_iter().for_each(|it| *it = value);
            seen.extend(variable.map(|it| (it, value)));
        };
        match &step.kind {
            StepKind::Assign { to, value, variable } => {
                let value = self.value(*value, registers);
                let is_near = value.unsigned_abs() <= self.farthest.unsigned_abs();
                let is_followed = |it: VariableId| is_near && !widened.contains(&it);
                set(registers, *to, *variable, if variable.is_none_or(is_followed) { value } else { ANY });
                false
            }
            StepKind::Call { cost, changes } => {
                changes.iter().for_each(|(register, variable)| set(registers, *register, *variable, ANY));
                *cost != Cost::Nothing
            }
            _ => false,
        }
    }

    fn outcomes(&self, widened: &[VariableId], values: &[i32]) -> Outcomes {
        let mut registers = vec![ANY; self.width];
        registers.iter_mut().zip(values).for_each(|(register, value)| *register = *value);
        let (costs, found) = (Costs::new(), Outcomes::default());
        let mut run = ProgramRun { program: self, widened, costs, found, ends: Vec::new() };
        run.found.is_too_large = self.is_too_large;
        if !self.is_too_large {
            run.run(0, self.steps.len() as u32, registers.into());
        }
        let ProgramRun { mut costs, mut found, mut ends, .. } = run;
        ends.sort_by_key(|(order, _)| *order);
        for (_, end) in ends {
            match found.all.iter_mut().find(|it| it.holds == end.holds && it.values == end.values) {
                Some(known) => known.cost = costs.greatest(known.cost, end.cost),
                None => found.all.push(end),
            }
        }
        found.is_too_large |= found.all.len() > MAX_PATHS;
        found.costs = costs.parts;
        found.seen.sort_unstable();
        found.seen.dedup();
        found
    }
}

/// The execution of a program from one valuation, along all paths.
struct ProgramRun<'a, 'db> {
    program: &'a Reduced<'db>,
    widened: &'a [VariableId],
    costs: Costs<u32>,
    found: Outcomes,
    /// What paths end with, each with its place in their order.
    ends: Vec<(u32, ProgramOutcome)>,
}

impl ProgramRun<'_, '_> {
    /// Executes the steps from one on up to another. Returns the paths that come to the latter.
    fn run(&mut self, from: u32, to: u32, registers: Valuation) -> Vec<RegisterPath> {
        let mut at: Vec<Vec<(u32, RegisterPath)>> = vec![Vec::new(); (to - from) as usize];
        at.insert(0, vec![(0, (registers, NOTHING))]);
        for index in from..=to {
            let paths = at.get_mut((index - from) as usize).map(std::mem::take).unwrap_or_default();
            let paths = self.merged(index, paths);
            if index == to {
                return paths;
            }
            self.found.steps += paths.len();
            for path in paths {
                self.step(index, path, &mut |next, order, path| {
                    at.get_mut((next - from) as usize)
                        .into_iter()
                        .for_each(|it| it.push((order, path.clone())));
                });
            }
        }
        Vec::new()
    }

    /// Joins the paths that come to a step. Of those with the same values, the greatest cost counts.
    fn merged(&mut self, step: u32, mut paths: Vec<(u32, RegisterPath)>) -> Vec<RegisterPath> {
        paths.sort_by_key(|(order, _)| *order);
        let live = self.program.steps.get(step as usize).map_or(Registers::MAX, |it| it.live);
        let mut found: Vec<RegisterPath> = Vec::with_capacity(paths.len());
        for (_, (mut registers, cost)) in paths {
            let dead = (0..).zip(&mut registers).filter(|(register, _)| live & bit(*register) == 0);
            dead.for_each(|(_, value)| *value = ANY);
            match found.iter_mut().find(|(it, _)| *it == registers) {
                Some((_, greatest)) => *greatest = self.costs.greatest(*greatest, cost),
                None => found.push((registers, cost)),
            }
        }
        self.found.is_too_large |= found.len() > MAX_PATHS;
        found.truncate(MAX_PATHS);
        found
    }

    /// Executes a step. Calls `add` with each step after it, the place in the order of paths, and the path.
    fn step(
        &mut self,
        index: u32,
        (mut registers, cost): RegisterPath,
        add: &mut dyn FnMut(u32, u32, RegisterPath),
    ) {
        let program = self.program;
        let Some(step) = program.steps.get(index as usize) else { return };
        let OutcomeStep { kind, next, order: [first, second], .. } = step;
        match kind {
            StepKind::Nothing => add(*next, *first, (registers, cost)),
            StepKind::Branch { condition, fails, at } => {
                let value = program.value(*condition, &registers);
                let holds = if value == ANY { None } else { Some(value != 0) };
                self.decide(*at, holds);
                for (branch, next, order) in [(true, *next, *first), (false, *fails, *second)] {
                    if holds.is_none_or(|holds| holds == branch) {
                        let mut registers = registers.clone();
                        if holds.is_none() {
                            self.narrow(*condition, branch, &mut registers);
                        }
                        add(next, order, (registers, cost));
                    }
                }
            }
            StepKind::Assign { .. } | StepKind::Call { .. } => {
                let calls = program.change(step, self.widened, &mut registers, &mut self.found.seen);
                let own = if calls { self.costs.add(CostOf::One(index)) } else { NOTHING };
                let cost = self.costs.sum(cost, own);
                add(*next, *first, (registers, cost));
            }
            StepKind::Operation { index: operation, end } => {
                for (registers, inner) in self.run(*next, *end, registers) {
                    let inner = self.costs.add(CostOf::Operation(*operation, inner));
                    let cost = self.costs.sum(cost, inner);
                    add(*end, *first, (registers, cost));
                }
            }
            StepKind::Return(value) => {
                let holds = value.map_or(0, |value| program.value(value, &registers));
                let ends = if holds == ANY { vec![true, false] } else { vec![holds != 0] };
                let values: Valuation = registers.iter().take(program.variables.len()).copied().collect();
                let end = |holds| (*first, ProgramOutcome { holds, values: values.clone(), cost });
                self.ends.extend(ends.into_iter().map(end));
            }
        }
    }

    fn decide(&mut self, at: SourceId, holds: Option<bool>) {
        match self.found.decided.iter_mut().find(|(it, _)| *it == at) {
            Some((_, known)) => *known = known.filter(|it| holds == Some(*it)),
            None => self.found.decided.push((at, holds)),
        }
    }

    /// Notes what follows from a condition whose value was not known, where it holds or does not.
    fn narrow(&self, condition: u32, holds: bool, registers: &mut [i32]) {
        let program = self.program;
        let (register, variable, value) = match program.operand(condition) {
            ReducedOperand::Register(register, Some(variable)) => (register, variable, i32::from(holds)),
            ReducedOperand::Binary(
                operator @ (BinaryOperator::Equal | BinaryOperator::NotEqual),
                left,
                right,
            ) if holds == (operator == BinaryOperator::Equal) => {
                let ReducedOperand::Register(register, Some(variable)) = program.operand(left) else {
                    return;
                };
                let value = match program.operand(right) {
                    ReducedOperand::Known(value) => value,
                    ReducedOperand::Register(right, _) => {
                        registers.get(right as usize).copied().unwrap_or(ANY)
                    }
                    _ => return,
                };
                (register, variable, value)
            }
            _ => return,
        };
        let is_known = value != ANY && !self.widened.contains(&variable);
        if let Some(known) = registers.get_mut(register as usize).filter(|_| is_known) {
            *known = value;
        }
    }
}

/// Returns the result of an operator that is not logical; any if it is undefined in C++.
fn binary(operator: BinaryOperator, left: i32, right: i32) -> i32 {
    match Value::Int(left).binary(operator, &Value::Int(right)) {
        Ok(Some(Value::Int(value))) => value,
        Ok(Some(Value::Bool(value))) => value.into(),
        _ => ANY,
    }
}
