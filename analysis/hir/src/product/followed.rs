//! Which variables of a core are followed: those that a condition depends on, and that programs set to known values.
//!
//! ```text
//! if count == 0 { plan(); count = 9; } else { count = count - 1; }     count is followed
//! ready = measure(); if ready { … }                                    ready is not: a codel may return anything
//! ```

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{BodyId, InitialValue, by_group, core_scope};
use crate::graph::closure;
use crate::infer::{Inference, VariableOf, inference_of, shared_variables};
use crate::item_tree::Direction;
use crate::program_graph::{Action, Call, ProgramGraph, Term, graphs_of_group};
use crate::project::Project;
use crate::resolve::VariableId;
use crate::source::Decl;
use crate::types::Type;

/// The variables that are followed.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct FollowedVariables {
    pub(super) variables: Vec<VariableId>,
    /// Those that operations assign, which clients may call between two jobs.
    pub(super) by_operations: Vec<VariableId>,
    /// Numbers that are farther from 0 count as any value, so that a counter without a limit has few others.
    pub(super) farthest: i32,
}

/// How the programs of a group of bodies use variables of few values.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct VariableUses {
    /// The variables of each comparison or other operand of a condition, whose value may be known if all of them are.
    deciding: Vec<Vec<VariableId>>,
    /// The target and the source of an assignment: the value of the first one depends on the second one.
    sources: Vec<(VariableId, VariableId)>,
    /// Those that programs assign, and whether the value may be known.
    assigned: Vec<(VariableId, bool)>,
    by_operations: Vec<VariableId>,
    /// See [`ProgramGraph::greatest_number`].
    greatest: i32,
}

/// Returns whether a variable of this type is one of few values.
pub(super) fn is_small(ty: &Type) -> bool {
    matches!(ty, Type::Bool | Type::PortStatus | Type::CallStatus) || *ty == Type::INT
}

/// Returns the followed variables of a core. An edit of a program computes the uses of its group, and seldom changes the result.
#[salsa::tracked(returns(ref))]
pub(super) fn followed_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> FollowedVariables {
    let in_group = |group| uses_in_group(db, project, of, group);
    let all = by_group(db, of, || uses_in(db, project, of, 0), in_group);
    let mut sources: FxHashMap<VariableId, Vec<VariableId>> = FxHashMap::default();
    for &(target, source) in all.iter().flat_map(|uses| &uses.sources) {
        sources.entry(target).or_default().push(source);
    }
    let assigned = || all.iter().flat_map(|uses| &uses.assigned);
    let mut variables: FxHashSet<VariableId> =
        assigned().filter(|(_, is_known)| *is_known).map(|(variable, _)| *variable).collect();
    // A variable that no program assigns keeps its initial value.
    let is_assigned: FxHashSet<VariableId> = assigned().map(|(variable, _)| *variable).collect();
    let initial = shared(shared_variables(db, project, of)).filter(|(_, it)| it.value == InitialValue::Plain);
    variables.extend(initial.map(|(variable, _)| variable).filter(|it| !is_assigned.contains(it)));
    // A condition with a variable that is never known decides nothing: a counter up to it would only have many values.
    let deciding = all.iter().flat_map(|uses| &uses.deciding);
    let deciding = deciding.filter(|it| it.iter().all(|it| variables.contains(it))).flatten().copied();
    let deciding = closure(deciding, |it| sources.get(&it).into_iter().flatten().copied());
    let deciding: FxHashSet<VariableId> = deciding.into_iter().collect();
    let mut variables: Vec<VariableId> = variables.intersection(&deciding).copied().collect();
    if variables.is_empty() {
        return FollowedVariables::default();
    }
    variables.sort_unstable();
    let mut by_operations: Vec<VariableId> =
        all.iter().flat_map(|uses| &uses.by_operations).copied().collect();
    by_operations.sort_unstable();
    by_operations.dedup();
    let greatest = all.iter().map(|uses| uses.greatest).max().unwrap_or_default();
    FollowedVariables { variables, by_operations, farthest: greatest.saturating_mul(2).saturating_add(4) }
}

/// Returns the shared variables with their identities.
pub(super) fn shared(all: &[VariableOf]) -> impl Iterator<Item = (VariableId, &VariableOf)> {
    (0..).zip(all).map(|(index, it)| (VariableId { group: None, index }, it))
}

#[salsa::tracked(returns(ref))]
fn uses_in_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> VariableUses {
    uses_in(db, project, of, group)
}

fn uses_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> VariableUses {
    let Some(scope) = core_scope(db, of) else { return VariableUses::default() };
    let inference = inference_of(db, project, of, group);
    let shared = shared_variables(db, project, of);
    let mut found = VariableUses::default();
    let bodies = scope.bodies_in(group).zip(graphs_of_group(db, project, of, group));
    for (id, programs) in bodies {
        let is_operation = matches!(id, BodyId::Operation(_));
        for (_, graph) in programs {
            found.greatest = found.greatest.max(graph.greatest_number);
            if id.is_of_values() {
                continue;
            }
            let first = found.assigned.len();
            let results = FxHashMap::default();
            DependenceReader { inference, shared, graph, found: &mut found, results }.program(is_operation);
            if is_operation {
                let of_operation = found.assigned.iter().skip(first).map(|(variable, _)| *variable);
                found.by_operations.extend(of_operation.filter(|it| it.group.is_none()));
            }
        }
    }
    let VariableUses { deciding, sources, assigned, .. } = &mut found;
    deciding.sort_unstable();
    deciding.dedup();
    sources.sort_unstable();
    sources.dedup();
    assigned.sort_unstable();
    assigned.dedup();
    found
}

/// The variables that a value depends on, and whether the value is known if theirs are.
#[derive(Debug, Clone, Default)]
struct ValueDependence {
    variables: Vec<VariableId>,
    is_unknown: bool,
}

impl ValueDependence {
    fn and(mut self, other: ValueDependence) -> ValueDependence {
        self.variables.extend(other.variables);
        self.is_unknown |= other.is_unknown;
        self
    }

    fn unknown(self) -> ValueDependence {
        ValueDependence { is_unknown: true, ..self }
    }
}

struct DependenceReader<'a, 'db> {
    inference: &'a Inference<'db>,
    shared: &'a [VariableOf],
    graph: &'a ProgramGraph<'db>,
    found: &'a mut VariableUses,
    /// What the registers of results depend on.
    results: FxHashMap<u32, ValueDependence>,
}

impl<'db> DependenceReader<'_, 'db> {
    fn program(&mut self, is_operation: bool) {
        for node in &self.graph.nodes {
            match &node.action {
                // `&&` in a value may be known, but decides nothing.
                Action::Branch { condition, is_value: false, .. } => {
                    let condition = self.dependence(*condition);
                    if !condition.is_unknown {
                        self.found.deciding.push(condition.variables);
                    }
                }
                Action::Assign { to, value: Some(value) } => self.assign(*to, *value),
                Action::Call(call) => self.call(call),
                Action::Return(Some(value)) if is_operation => self.passes(*value),
                Action::Nothing | Action::Branch { .. } | Action::Assign { .. } | Action::Return(_) => {}
            }
        }
    }

    /// Returns the variable of a register, if it has few values.
    fn small(&self, register: u32) -> Option<VariableId> {
        let id = self.graph.variable(register)?;
        let all = if id.group.is_none() { self.shared } else { &self.inference.variables };
        all.get(id.index as usize).is_some_and(|it| is_small(&it.ty)).then_some(id)
    }

    fn dependence(&self, term: u32) -> ValueDependence {
        match self.graph.term(term) {
            Term::Bool(_) | Term::Int(_) | Term::Status(_) | Term::Other => ValueDependence::default(),
            Term::Missing | Term::Feature => ValueDependence::default().unknown(),
            Term::Register(register, _) => match (self.results.get(&register), self.small(register)) {
                (Some(of_result), _) => of_result.clone(),
                (None, Some(variable)) => ValueDependence { variables: vec![variable], is_unknown: false },
                (None, None) => ValueDependence::default().unknown(),
            },
            Term::Incomplete(inner) => self.dependence(inner).unknown(),
            Term::Unary(_, inner) | Term::Decided(_, inner) => self.dependence(inner),
            Term::Binary(..) => {
                let (first, operands) = self.graph.spine(term);
                operands
                    .into_iter()
                    .fold(self.dependence(first), |all, (_, right)| all.and(self.dependence(right)))
            }
        }
    }

    /// Notes the variables of a value that an operation gets or returns: its caller, or its own conditions, may depend on each.
    fn passes(&mut self, value: u32) {
        let variables = self.dependence(value).variables;
        self.found.deciding.extend(variables.into_iter().map(|it| vec![it]));
    }

    fn assign(&mut self, to: u32, value: u32) {
        let value = self.dependence(value);
        if self.graph.variable(to).is_none() {
            let known = self.results.entry(to).or_default();
            *known = std::mem::take(known).and(value);
        } else if let Some(target) = self.small(to) {
            self.found.assigned.push((target, !value.is_unknown));
            self.found.sources.extend(value.variables.into_iter().map(|source| (target, source)));
        }
    }

    /// Notes what a call assigns.
    fn call(&mut self, call: &Call<'db>) {
        let is_own = call.operation().is_some();
        let mut result = ValueDependence { is_unknown: !is_own, ..ValueDependence::default() };
        for argument in &call.arguments {
            result = result.and(self.dependence(argument.value));
            if argument.direction != Direction::In
                && let Some(target) = argument.variable.and_then(|it| self.small(it))
                && call.callee.is_some()
            {
                // An operation may assign a known value.
                self.found.assigned.push((target, is_own));
            }
            if is_own {
                self.passes(argument.value);
            }
        }
        self.results.insert(call.result, result);
    }
}
