//! The writes of a program to ports, and those of them that a later write of the program overwrites.

use rustc_hash::FxHashSet;

use crate::infer::Inference;
use crate::item_tree::{Expr, Name, SourceId, Statement};
use crate::resolve::Callee;

use super::operations::{Effects, written_port};

/// A write: its source and its port.
pub(super) type Write = (SourceId, Name);

/// The writes of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Writes {
    /// The ports that every path writes, sorted.
    ports: Box<[Name]>,
    /// The writes that every path overwrites before the program ends.
    pub(super) lost: Box<[Write]>,
    /// The other writes: they are lost if every execution after the program writes their ports.
    pub(super) last: Box<[Write]>,
}

impl Writes {
    /// Returns the writes of a program.
    pub(super) fn of(statements: &[Statement], inference: &Inference<'_>, effects: &[Effects]) -> Writes {
        let mut writer = WriteFinder { inference, effects, lost: Vec::new(), last: Vec::new() };
        let mut ports: Box<[Name]> =
            writer.block(statements, Ports::default()).into_iter().cloned().collect();
        ports.sort_unstable();
        Writes { ports, lost: writer.lost.into(), last: writer.last.into() }
    }

    pub(super) fn include(&self, port: &Name) -> bool {
        self.ports.binary_search(port).is_ok()
    }
}

type Ports<'a> = FxHashSet<&'a Name>;

struct WriteFinder<'a, 'db> {
    inference: &'a Inference<'db>,
    effects: &'a [Effects],
    lost: Vec<Write>,
    last: Vec<Write>,
}

impl<'a> WriteFinder<'a, '_> {
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
