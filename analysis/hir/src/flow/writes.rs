//! The writes to ports that a later write of the same period overwrites.

use rustc_hash::FxHashSet;

use crate::body::{BodyId, ProgramIn, statements};
use crate::builtin::Builtin;
use crate::infer::Inference;
use crate::item_tree::{Expr, HookKind, MethodKind, Name, NameRef, SourceId, Statement};
use crate::resolve::Callee;
use crate::structure::{StateStructure, Structure};

use super::operations::Effects;
use super::programs::{ProgramFlow, Programs};

/// A write: its source and its port.
pub(super) type Write = (SourceId, Name);

/// The writes of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Writes {
    /// The ports that every path writes, sorted.
    ports: Box<[Name]>,
    /// The writes that every path overwrites before the program ends.
    lost: Box<[Write]>,
    /// The other writes: they are lost if every execution after the program writes their ports.
    last: Box<[Write]>,
}

impl Writes {
    /// Returns the writes of a program.
    pub(super) fn of(statements: &[Statement], inference: &Inference<'_>, effects: &[Effects]) -> Writes {
        let mut writer = Writer { inference, effects, lost: Vec::new(), last: Vec::new() };
        let mut ports: Box<[Name]> =
            writer.block(statements, Ports::default()).into_iter().cloned().collect();
        ports.sort_unstable();
        Writes { ports, lost: writer.lost.into(), last: writer.last.into() }
    }

    fn include(&self, port: &Name) -> bool {
        self.ports.binary_search(port).is_ok()
    }
}

type Ports<'a> = FxHashSet<&'a Name>;

struct Writer<'a, 'db> {
    inference: &'a Inference<'db>,
    effects: &'a [Effects],
    lost: Vec<Write>,
    last: Vec<Write>,
}

impl<'a> Writer<'a, '_> {
    /// Returns the ports that every path from the start of `statements` writes; `after`: those that every path writes after
    /// them. A `return` ends the program.
    fn block(&mut self, statements: &'a [Statement], mut after: Ports<'a>) -> Ports<'a> {
        for statement in statements.iter().rev() {
            match statement {
                Statement::Block(inner) => after = self.block(inner, after),
                Statement::If { then, otherwise, .. } => {
                    let otherwise = otherwise.as_deref().unwrap_or_default();
                    let other = self.block(otherwise, after.clone());
                    after = self.block(then, after);
                    after.retain(|port| other.contains(port));
                }
                Statement::Return(..) => after.clear(),
                Statement::Variable(_) | Statement::Assign(..) | Statement::Expr(_) => {
                    self.call_writes(statement.expression(), &mut after);
                }
            }
        }
        after
    }

    /// Adds the ports that `value` writes if it is a call; nested calls are ignored, because they may not be executed.
    fn call_writes(&mut self, value: Option<&'a Expr>, after: &mut Ports<'a>) {
        let Some(Expr::Call { callee, arguments, .. }) = value else { return };
        if let Some(port) = written_port(self.inference, callee, arguments) {
            let is_last = after.insert(port);
            let writes = if is_last { &mut self.last } else { &mut self.lost };
            writes.push((callee.id, port.clone()));
        }
        // The callees of the operation are ignored: an operation may be recursive, which is an error.
        if let Some(Callee::Operation(index)) = self.inference.callee(callee.id) {
            after.extend(self.effects.get(index).into_iter().flat_map(|effects| &effects.writes));
        }
    }
}

/// Returns the ports that the outermost statements of a program write, up to the first `return`.
pub(super) fn top_level_writes(statements: &[Statement], inference: &Inference<'_>) -> Box<[Name]> {
    let mut ports = Ports::default();
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
fn written_port<'a>(inference: &Inference<'_>, callee: &NameRef, arguments: &'a [Expr]) -> Option<&'a Name> {
    match (inference.callee(callee.id), arguments.first()) {
        (Some(Callee::Builtin(Builtin::Write)), Some(Expr::Name(port))) => Some(&port.name),
        _ => None,
    }
}

fn has_return(statement: &Statement) -> bool {
    statements(std::slice::from_ref(statement)).any(|statement| matches!(statement, Statement::Return(..)))
}

/// Returns the writes of a core that every path overwrites in the same period.
pub(super) fn lost_writes<'a, 'db>(core: &'db Structure, programs: &Programs<'a, 'db>) -> Vec<&'a Write> {
    let operations = (0..core.operations.len()).map(|index| BodyId::Operation(index as u32));
    let bodies = operations.chain(core.hook(HookKind::Update));
    let mut lost: Vec<&Write> =
        bodies.flat_map(|body| lost_in(programs.get(body, ProgramIn::Whole))).collect();
    for (index, state) in programs.states().iter().enumerate() {
        lost_in_state(index, state, programs, &mut lost);
    }
    lost.sort();
    lost.dedup();
    lost
}

fn lost_in(program: Option<&ProgramFlow>) -> impl Iterator<Item = &Write> {
    program.into_iter().flat_map(|program| &program.writes.lost)
}

/// Returns the last writes of a program to the ports for which `is_written` holds: those that are written after it.
fn lost_after(
    program: Option<&ProgramFlow>,
    is_written: impl Fn(&Name) -> bool,
) -> impl Iterator<Item = &Write> {
    let last = program.into_iter().flat_map(|program| &program.writes.last);
    last.filter(move |(_, port)| is_written(port))
}

/// Adds the writes in a state that the programs after them overwrite. The programs of a period are `run`, then `exit`, an effect
/// and `entry`, or `handle`.
fn lost_in_state<'a, 'db>(
    index: usize,
    state: &StateStructure,
    programs: &Programs<'a, 'db>,
    lost: &mut Vec<&'a Write>,
) {
    let method = |kind| programs.method(index, kind);
    let [entry, run, handle, exit] =
        [MethodKind::Entry, MethodKind::Run, MethodKind::Handle, MethodKind::Exit].map(method);
    let effect = |number| programs.of_state(index, ProgramIn::Effect(number as u32));
    let next_entry = |number: usize| -> Option<&'a ProgramFlow> {
        programs.method(programs.target(state.transitions.get(number)?)?, MethodKind::Entry)
    };
    // The transitions that may fire.
    let always = state.transitions.iter().position(|transition| !transition.has_guard);
    let fire = 0..always.map_or(state.transitions.len(), |always| always + 1);
    let writes = |program: Option<&ProgramFlow>, port: &Name| {
        program.is_some_and(|program| program.writes.include(port))
    };
    let after_exit = |port: &Name| {
        let fires = |number| writes(effect(number), port) || writes(next_entry(number), port);
        !fire.is_empty() && fire.clone().all(fires)
    };
    let after_run = |port: &Name| {
        let leaves = fire.is_empty() || writes(exit, port) || after_exit(port);
        leaves && (always.is_some() || writes(handle, port))
    };
    [entry, run, handle, exit].into_iter().for_each(|program| lost.extend(lost_in(program)));
    lost.extend(lost_after(run, after_run));
    lost.extend(lost_after(exit, after_exit));
    for number in fire.clone() {
        let effect = effect(number);
        lost.extend(lost_in(effect));
        lost.extend(lost_after(effect, |port| writes(next_entry(number), port)));
    }
}
