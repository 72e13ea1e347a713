//! The writes of a program to ports, and those of them that a later write of the program overwrites.

use crate::builtin::Builtin;
use crate::item_tree::{Name, SourceId};
use crate::program_graph::{Action, Call, Node, ProgramGraph};
use crate::resolve::Callee;

use super::indices::Indices;
use super::operations::Effects;

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
    pub(super) fn of<'a>(graph: &'a ProgramGraph<'_>, effects: &'a [Effects]) -> Writes {
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
                let is_own = matches!(&node.action, Action::Call(call) if is_write(call));
                if is_own && reached.get(index) == Some(&true) {
                    let writes = if after.contains(number) { &mut lost } else { &mut last };
                    writes.push((node.at, port.clone()));
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
