//! The calls of required operations that are pending at most: `send`, `collect` until the call has ended, `send` again.
//!
//! ```text
//! Asking ──h = send(plan)──→ Planning ──collect(h) == success──→ Asking        at most one call
//! Asking ──h = send(plan)──→ Planning ──late()─────────────────→ Asking        any number
//! ```
//!
//! A call has ended once `collect` gives `success` or `failure`. The programs of the jobs are followed from each state on, once for each
//! handler: whether its call may be pending, and which variables have a status that `collect` gave since the last `send`.

use std::collections::BTreeSet;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, behaviour_of};
use crate::body::{Place, core_scope};
use crate::builtin::Builtin;
use crate::infer::{VariableKind, shared_variables};
use crate::item_tree::{BinaryOperator, Direction, Name};
use crate::program_graph::{Action, Call, ProgramGraph, Term, graph_of, graphs_of_group};
use crate::project::Project;
use crate::resolve::{Callee, VariableId};
use crate::source::Decl;
use crate::structure::structure_of;

/// The status of a call that is pending.
const NOT_READY: u8 = 1;

/// Returns the greatest number of calls to each required operation that are pending at any instant between a start and a stop of a
/// component. It has a bound where the programs send with each handler only after the last call of this handler has ended: the number
/// of the handlers.
#[salsa::tracked(returns(ref))]
pub fn pending_calls_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> FxHashMap<Name, u64> {
    let behaviour = behaviour_of(db, project, of);
    let (Some(scope), Some(structure)) = (core_scope(db, of), structure_of(db, of)) else {
        return FxHashMap::default();
    };
    let shared = (0..).zip(shared_variables(db, project, of));
    let handlers = shared.filter(|(_, it)| it.kind == VariableKind::Handler);
    let handlers: BTreeSet<VariableId> =
        handlers.map(|(index, _)| VariableId { group: None, index }).collect();
    let entry = structure.initial_entry();
    let in_jobs: FxHashSet<Place> = behaviour.programs.iter().map(|it| it.place).chain(entry).collect();
    let mut by_operation: FxHashMap<&Name, BTreeSet<VariableId>> = FxHashMap::default();
    // Those that are sent without a handler, or not by a job; and the handlers that get another's call.
    let (mut unbounded, mut copies) = (FxHashSet::default(), FxHashSet::default());
    for group in scope.groups() {
        for (body, programs) in scope.bodies_in(group).zip(graphs_of_group(db, project, of, group)) {
            for (program, graph) in programs {
                for (index, node) in graph.nodes.iter().enumerate() {
                    match &node.action {
                        Action::Call(call) if is_call(call, Builtin::Send) => {
                            let handler = handler_of(graph, index, call);
                            match handler.filter(|_| in_jobs.contains(&(body, *program))) {
                                Some(handler) => {
                                    by_operation.entry(&call.operand).or_default().insert(handler);
                                }
                                None => _ = unbounded.insert(&call.operand),
                            }
                        }
                        Action::Assign { to, .. } => {
                            let handler = graph.variable(*to).filter(|it| handlers.contains(it));
                            let sent = index.checked_sub(1).and_then(|before| sent_at(graph, before));
                            copies.extend(handler.filter(|it| sent != Some(*it)));
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    let graph = |(body, program): Place| Some(&**graph_of(db, project, of, body, program)?);
    let graphs: Vec<_> = behaviour.programs.iter().map(|it| graph(it.place)).collect();
    let waits = |handler: &VariableId| {
        let following = FollowedCall { behaviour, graphs: &graphs, handler: *handler };
        !copies.contains(handler) && following.ends_before_next(entry.and_then(graph)).is_some()
    };
    let bounded = by_operation
        .into_iter()
        .filter(|(name, handlers)| !unbounded.contains(name) && handlers.iter().all(waits));
    bounded.map(|(name, handlers)| (name.clone(), handlers.len() as u64)).collect()
}

fn is_call(call: &Call<'_>, builtin: Builtin) -> bool {
    call.callee == Some(Callee::Builtin(builtin))
}

/// Returns the handler of a `send`.
fn handler_of(graph: &ProgramGraph<'_>, index: usize, call: &Call<'_>) -> Option<VariableId> {
    let Action::Assign { to, value } = graph.nodes.get(index + 1)?.action else { return None };
    matches!(graph.term(value?), Term::Register(it, _) if it == call.result).then(|| graph.variable(to))?
}

/// Returns the handler of the `send` at a node.
fn sent_at(graph: &ProgramGraph<'_>, index: usize) -> Option<VariableId> {
    match &graph.nodes.get(index)?.action {
        Action::Call(call) if is_call(call, Builtin::Send) => handler_of(graph, index, call),
        _ => None,
    }
}

/// The jobs of a component, and a handler.
struct FollowedCall<'a, 'db> {
    behaviour: &'a Behaviour<'db>,
    /// By program of the behaviour.
    graphs: &'a [Option<&'db ProgramGraph<'db>>],
    handler: VariableId,
}

/// Whether the call may be pending; none where no execution comes.
type MayBePending = Option<bool>;

impl FollowedCall<'_, '_> {
    /// Returns `None` if a job may send with the handler while its last call is pending. `entry` is executed before the first job.
    fn ends_before_next(&self, entry: Option<&ProgramGraph<'_>>) -> Option<()> {
        let first = match entry {
            Some(entry) => self.after(entry, Some(false))?.into_iter().max()?,
            None => Some(false),
        };
        let fired = self.behaviour.fired();
        let mut before: Vec<MayBePending> = vec![None; fired.len()];
        *before.get_mut(self.behaviour.initial)? = first;
        let mut open = vec![self.behaviour.initial];
        while let Some(state) = open.pop() {
            let mut now = *before.get(state)?;
            let mut finish = |edge: usize, mut now: MayBePending| {
                let edge = self.behaviour.edges.all.get(edge)?;
                for &program in &edge.then {
                    now = self.after_program(program, now)?.into_iter().max()?;
                }
                let target = before.get_mut(edge.target)?;
                if now > *target {
                    *target = now;
                    open.push(edge.target);
                }
                Some(())
            };
            let of_state = fired.get(state)?;
            for (&program, edge) in self.behaviour.edges.first.get(state)?.iter().zip(&of_state.by_guards) {
                let [holds, others] = self.after_program(program, now)?;
                edge.map_or(Some(()), |edge| finish(edge, holds))?;
                now = others;
            }
            of_state.otherwise.map_or(Some(()), |edge| finish(edge, now))?;
        }
        Some(())
    }

    fn after_program(&self, program: usize, before: MayBePending) -> Option<[MayBePending; 2]> {
        match self.graphs.get(program)? {
            Some(graph) => self.after(graph, before),
            None => Some([None, before]),
        }
    }

    /// Returns whether the call may be pending after a program: where that is a guard that holds, and elsewhere. `None` if it sends
    /// while the call may be.
    fn after(&self, graph: &ProgramGraph<'_>, before: MayBePending) -> Option<[MayBePending; 2]> {
        let mut ends = [None, None];
        // With the registers that have a status of the call.
        let mut all: Vec<Option<(bool, BTreeSet<u32>)>> = vec![None; graph.nodes.len()];
        *all.get_mut(graph.start as usize)? = before.map(|before| (before, BTreeSet::new()));
        for (index, node) in graph.nodes.iter().enumerate() {
            let Some((mut pending, mut statuses)) = all.get_mut(index)?.take() else { continue };
            let mut pending_where = None;
            match &node.action {
                Action::Call(call) => {
                    let outputs = call.arguments.iter().filter(|it| it.direction != Direction::In);
                    outputs.filter_map(|it| it.variable).for_each(|it| _ = statuses.remove(&it));
                    let collected = call.arguments.first().and_then(|it| graph.variable(it.variable?));
                    if is_call(call, Builtin::Collect) && collected == Some(self.handler) {
                        statuses.insert(call.result);
                    } else if sent_at(graph, index) == Some(self.handler) {
                        if pending {
                            return None;
                        }
                        pending = true;
                        statuses.clear();
                    }
                }
                Action::Assign { to, value } => {
                    let is_status = value.is_some_and(
                        |it| matches!(graph.term(it), Term::Register(it, _) if statuses.contains(&it)),
                    );
                    if is_status {
                        statuses.insert(*to)
                    } else {
                        statuses.remove(to)
                    };
                }
                Action::Branch { condition, .. } => {
                    let ended_where = ended_where(graph, *condition, &statuses);
                    pending_where = ended_where.map(|holds| [pending && !holds, pending && holds]);
                }
                Action::Return(value) => {
                    let holds = value.is_some_and(|it| graph.term(it) == Term::Bool(true));
                    let end = &mut ends[usize::from(!holds)];
                    *end = (*end).max(Some(pending));
                }
                Action::Nothing => {}
            }
            let pending = pending_where.unwrap_or([pending, pending]);
            for (next, pending) in node.successors().into_iter().zip(pending) {
                let Some(next) = next else { continue };
                let next = all.get_mut(next as usize)?;
                *next = Some(match next.take() {
                    Some((known, of_known)) => (known || pending, &of_known & &statuses),
                    None => (pending, statuses.clone()),
                });
            }
        }
        Some(ends)
    }
}

/// Returns whether a call has ended where a comparison of its status holds, or where it does not hold; none of another condition.
fn ended_where(graph: &ProgramGraph<'_>, condition: u32, statuses: &BTreeSet<u32>) -> Option<bool> {
    let Term::Binary(operator, left, right) = graph.term(condition) else { return None };
    let (register, status) = match (graph.term(left), graph.term(right)) {
        (Term::Register(register, _), Term::Status(status)) => (register, status),
        (Term::Status(status), Term::Register(register, _)) => (register, status),
        _ => return None,
    };
    let is_equal = match operator {
        BinaryOperator::Equal => true,
        BinaryOperator::NotEqual => false,
        _ => return None,
    };
    statuses.contains(&register).then_some(is_equal == (status != NOT_READY))
}
