//! The data flow through one program: what it reads before an assignment, what it assigns, and which of its writes to ports a later
//! write of the program overwrites.
//!
//! A program is a function of the variables that are assigned before it and of the ports that are written after it: this describes
//! the function.

use crate::builtin::Builtin;
use crate::item_tree::{Direction, Name, SourceId};
use crate::program_graph::{Action, Argument, Call, Node, ProgramGraph, registers};
use crate::resolve::Callee;

use super::indices::Indices;

/// The data flow through a program, a guard or initial values. A variable is a number: first the shared variables, then those of
/// the group, which only its own program sees.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct ProgramFlow {
    /// The first reads of variables that no path may have assigned before, in the order of the variables.
    pub(super) reads: Box<[Read]>,
    /// The variables that it may assign.
    pub(super) assigns: Indices,
    pub(super) writes: Writes,
}

/// The first read of a variable. The order is that of the variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Read {
    pub(super) variable: usize,
    /// Whether some path does not come to it: a condition may know of an assignment in an earlier period.
    pub(super) is_conditional: bool,
    pub(super) id: SourceId,
}

impl ProgramFlow {
    /// Returns the data flow through a program. `shared`: the number of shared variables; `is_conditional`: whether the program
    /// itself depends on a condition.
    pub(super) fn of(
        graph: &ProgramGraph<'_>,
        shared: usize,
        effects: &[OperationEffects],
        is_conditional: bool,
    ) -> ProgramFlow {
        let number = |register| graph.variable(register).map(|it| it.number(shared));
        let (mut reads, mut assigns) = (Vec::new(), Indices::default());
        // What may be assigned before each node.
        let mut before: Vec<Option<Indices>> = vec![None; graph.nodes.len()];
        before.get_mut(graph.start as usize).into_iter().for_each(|it| *it = Some(Indices::default()));
        // The last node that some path so far continues with: all paths come to it, but not to those before it.
        let mut farthest = graph.start;
        for (index, node) in (0..).zip(&graph.nodes) {
            // Where no path comes to a node, all that the text assigns before it counts.
            let mut assigned =
                before.get_mut(index as usize).and_then(Option::take).unwrap_or_else(|| assigns.clone());
            let is_conditional = is_conditional || farthest > index;
            let mut read = |term, assigned: &Indices| {
                for (register, id) in registers(&graph.terms, term) {
                    let variable = number(register).filter(|it| !assigned.contains(*it));
                    reads.extend(variable.map(|variable| Read { variable, is_conditional, id }));
                }
            };
            match &node.action {
                Action::Nothing | Action::Return(None) | Action::Assign { value: None, .. } => {}
                Action::Branch { condition: value, .. } | Action::Return(Some(value)) => {
                    read(*value, &assigned)
                }
                Action::Assign { to, value: Some(value) } => {
                    read(*value, &assigned);
                    number(*to).into_iter().for_each(|it| assigned.insert(it));
                }
                Action::Call(call) => {
                    let is_output = |it: &&Argument| it.direction != Direction::In && it.variable.is_some();
                    let inputs = call.arguments.iter().filter(|it| !is_output(it));
                    inputs.for_each(|it| read(it.value, &assigned));
                    let outputs = call.arguments.iter().filter(is_output);
                    outputs.filter_map(|it| number(it.variable?)).for_each(|it| assigned.insert(it));
                    if let Some(effects) = call.operation().and_then(|index| effects.get(index)) {
                        assigned.add(&effects.assigns);
                    }
                }
            }
            assigns.add(&assigned);
            if node.action.is_return() {
                farthest = u32::MAX;
            }
            for next in node.successors().into_iter().flatten() {
                farthest = farthest.max(next);
                match before.get_mut(next as usize) {
                    Some(Some(other)) => other.add(&assigned),
                    Some(other) => *other = Some(assigned.clone()),
                    None => {}
                }
            }
        }
        reads.sort_unstable();
        reads.dedup_by_key(|read: &mut Read| (read.variable, read.is_conditional));
        ProgramFlow { reads: reads.into(), assigns, writes: Writes::of(graph, effects) }
    }
}

/// The effects of a call of an operation.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct OperationEffects {
    /// The shared variables that it may assign, directly or through its callees.
    pub(super) assigns: Indices,
    /// The ports that it writes on every path, sorted.
    pub(super) writes: Box<[Name]>,
}

/// A write: its source and its port.
pub(super) type Write = (SourceId, Name);

/// The writes of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Writes {
    /// The ports that every path writes, sorted.
    pub(super) ports: Box<[Name]>,
    /// The writes that every path overwrites before the program ends.
    pub(super) lost: Box<[Write]>,
    /// The other writes: they are lost if every execution after the program writes their ports.
    pub(super) last: Box<[Write]>,
}

impl Writes {
    /// Returns the writes of a program whose operations have these effects.
    pub(super) fn of<'a>(graph: &'a ProgramGraph<'_>, effects: &'a [OperationEffects]) -> Writes {
        let is_write = |call: &Call<'_>| {
            call.callee == Some(Callee::Builtin(Builtin::Write)) && !call.operand.is_empty()
        };
        let written = |node: &'a Node<'_>| match &node.action {
            Action::Call(call) if is_write(call) => std::slice::from_ref(&call.operand),
            Action::Call(call) => {
                let effects = call.operation().and_then(|index| effects.get(index));
                effects.map_or(&[][..], |effects| &effects.writes)
            }
            _ => &[],
        };
        let mut ports: Vec<&Name> = graph.nodes.iter().flat_map(written).collect();
        if ports.is_empty() {
            return Writes::default();
        }
        ports.sort_unstable();
        ports.dedup();
        let reached = graph.reached();
        let (mut lost, mut last) = (Vec::new(), Vec::new());
        // The ports that every path writes from each node on.
        let mut from = vec![Indices::default(); graph.nodes.len()];
        for (index, node) in graph.nodes.iter().enumerate().rev() {
            let mut next = node.successors().into_iter().flatten().filter_map(|it| from.get(it as usize));
            let mut after = next.next().cloned().unwrap_or_default();
            next.for_each(|other| after.intersect(other));
            for port in written(node) {
                let Ok(number) = ports.binary_search(&port) else { continue };
                if let Action::Call(call) = &node.action
                    && is_write(call)
                    && reached.get(index) == Some(&true)
                {
                    let writes = if after.contains(number) { &mut lost } else { &mut last };
                    writes.push((call.name, port.clone()));
                }
                after.insert(number);
            }
            if let Some(from) = from.get_mut(index) {
                *from = after;
            }
        }
        let always = from.get(graph.start as usize);
        let always = (0..).zip(ports).filter(|(number, _)| always.is_some_and(|it| it.contains(*number)));
        let ports = always.map(|(_, port)| port.clone()).collect();
        Writes { ports, lost: lost.into(), last: last.into() }
    }

    pub(super) fn include(&self, port: &Name) -> bool {
        self.ports.binary_search(port).is_ok()
    }
}
