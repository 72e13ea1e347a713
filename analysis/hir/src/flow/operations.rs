//! What a call of an operation assigns and writes.

use std::borrow::Cow;

use rustc_hash::FxHashSet;

use crate::ModelDb;
use crate::body::{BodyId, CoreScope, ProgramIn, core_scope, statements};
use crate::builtin::Builtin;
use crate::graph::topological_order;
use crate::infer::{Inference, inference_of};
use crate::item_tree::{Expr, Name, NameRef, Statement};
use crate::program_graph::{Action, ProgramGraph, graph_of};
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::{Decl, core};

use super::indices::Indices;

/// The effects of a call of an operation.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Effects {
    /// The shared variables that it may assign, directly or through its callees.
    pub(super) assigns: Indices,
    /// The ports that it writes on every path, without those that its callees write.
    pub(super) writes: Box<[Name]>,
}

/// Returns the effects of each operation of a core.
pub(super) fn effects_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &CoreScope,
) -> Cow<'db, [Effects]> {
    match (scope.operations.is_empty(), scope.groups().len()) {
        (true, _) => Cow::Borrowed(&[]),
        // A query for the only group would be recomputed with each change of the core.
        (false, 1) => Cow::Owned(effects(db, project, of, scope)),
        (false, _) => Cow::Borrowed(effects_of_groups(db, project, of)),
    }
}

/// Returns the effects of the operations of a core with several groups: few edits change them.
#[salsa::tracked(returns(ref))]
fn effects_of_groups<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Effects> {
    let scope = core_scope(db, of).as_ref();
    scope.map_or_else(Vec::new, |scope| effects(db, project, of, scope))
}

fn effects<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &CoreScope,
) -> Vec<Effects> {
    let Some(core) = core(db, of) else { return Vec::new() };
    let (mut calls, mut effects) = (Vec::new(), Vec::new());
    for (index, operation) in core.operations.iter().enumerate() {
        let body = BodyId::Operation(index as u32);
        let graph = graph_of(db, project, of, body, ProgramIn::Whole);
        let Some((graph, group)) = graph.zip(scope.group(body)) else { continue };
        let (called, assigns) = calls_and_assigns(graph);
        let inference = inference_of(db, project, of, group);
        let writes = top_level_writes(&operation.program.statements, inference);
        calls.push(called);
        effects.push(Effects { assigns, writes });
    }
    for index in topological_order(&calls).0 {
        let callees = calls.get(index).into_iter().flatten();
        let callees: Vec<Indices> =
            callees.filter_map(|callee| Some(effects.get(*callee)?.assigns.clone())).collect();
        if let Some(own) = effects.get_mut(index) {
            callees.iter().for_each(|callee| own.assigns.add(callee));
        }
    }
    effects
}

fn calls_and_assigns(graph: &ProgramGraph<'_>) -> (Vec<usize>, Indices) {
    let (mut called, mut assigned) = (Vec::new(), Indices::default());
    let mut assign = |register: u32| {
        let shared = graph.variable(register).filter(|it| it.group.is_none());
        shared.into_iter().for_each(|it| assigned.insert(it.index as usize));
    };
    for node in &graph.nodes {
        match &node.action {
            Action::Assign { to, .. } => assign(*to),
            Action::Call(call) => {
                // Each argument may be an output argument.
                call.arguments.iter().filter_map(|it| it.variable).for_each(&mut assign);
                if let Some(Callee::Operation(index)) = call.callee {
                    called.push(index);
                }
            }
            _ => {}
        }
    }
    (called, assigned)
}

/// Returns the ports that the outermost statements of a program write, up to the first `return`.
fn top_level_writes(statements: &[Statement], inference: &Inference<'_>) -> Box<[Name]> {
    let mut ports = FxHashSet::default();
    for statement in statements {
        match statement {
            Statement::Expr(Expr::Call { callee, arguments, .. }) => {
                ports.extend(written_port(inference, callee, arguments));
            }
            // A branch may return.
            statement if has_return(statement) => break,
            _ => {}
        }
    }
    ports.into_iter().cloned().collect()
}

/// Returns the port that a call writes.
pub(super) fn written_port<'a>(
    inference: &Inference<'_>,
    callee: &NameRef,
    arguments: &'a [Expr],
) -> Option<&'a Name> {
    match (inference.callee(callee.id), arguments.first()) {
        (Some(Callee::Builtin(Builtin::Write)), Some(Expr::Name(port))) => Some(&port.name),
        _ => None,
    }
}

fn has_return(statement: &Statement) -> bool {
    statements(std::slice::from_ref(statement)).any(|statement| matches!(statement, Statement::Return(..)))
}
