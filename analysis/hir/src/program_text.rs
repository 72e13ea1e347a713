//! The program graphs of a core as text, to look at them: `mauve analysis-stats --graph`.

use std::fmt::{self, Write as _};

use crate::ModelDb;
use crate::behaviour::{TimedProgram, behaviour_of};
use crate::body::core_scope;
use crate::infer::{VariableOf, inference_of, shared_variables};
use crate::program_graph::{Action, Call, ProgramGraph, Term, graph_of};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::Decl;

/// Returns the graphs of the programs of a core, as the beginning of `program_graph.rs` has them.
pub fn graphs_as_text<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<(ProgramId, String)> {
    let behaviour = behaviour_of(db, project, of);
    let text = |program: &TimedProgram<'db>| {
        let (body, place) = program.place;
        let graph = graph_of(db, project, of, body, place)?;
        let group = core_scope(db, of).as_ref()?.group(body)?;
        let names = [shared_variables(db, project, of), &inference_of(db, project, of, group).variables];
        Some((program.id.clone(), ShownGraph { db, graph, names }.to_string()))
    };
    behaviour.programs.iter().chain(&behaviour.operations).filter_map(text).collect()
}

/// A graph with the names of the shared variables, and of those of its group of bodies.
struct ShownGraph<'a, 'db> {
    db: &'db dyn ModelDb,
    graph: &'a ProgramGraph<'db>,
    names: [&'a [VariableOf]; 2],
}

impl ShownGraph<'_, '_> {
    fn register(&self, register: u32) -> String {
        let variable = self.graph.variable(register);
        let named = variable.and_then(|id| {
            let [shared, own] = self.names;
            if id.group.is_none() { shared } else { own }.get(id.index as usize)
        });
        named.map_or_else(|| format!("%{register}"), |it| it.name.name.to_string())
    }

    fn term(&self, term: u32) -> String {
        match self.graph.term(term) {
            Term::Missing => "?".to_owned(),
            Term::Bool(value) | Term::Decided(value, _) => value.to_string(),
            Term::Int(value) => value.to_string(),
            Term::Status(value) => format!("status {value}"),
            Term::Other => "…".to_owned(),
            Term::Feature => "feature".to_owned(),
            Term::Register(register, _) => self.register(register),
            Term::Incomplete(inner) => format!("{} ?", self.term(inner)),
            Term::Unary(operator, inner) => format!("{}{}", operator.text(), self.term(inner)),
            Term::Binary(..) => {
                let (first, operands) = self.graph.spine(term);
                let mut text = "(".repeat(operands.len()) + &self.term(first);
                for (operator, right) in operands {
                    let _ = write!(text, " {} {})", operator.text(), self.term(right));
                }
                text
            }
        }
    }

    fn call(&self, call: &Call<'_>) -> String {
        let callee = match call.callee {
            Some(Callee::Codel(codel)) => codel.qualified(self.db),
            Some(Callee::Operation(index)) => format!("operation {index}"),
            Some(Callee::Builtin(builtin)) => format!("{} {}", builtin.name(), call.operand),
            None => "?".to_owned(),
        };
        let arguments: Vec<String> = call.arguments.iter().map(|it| self.term(it.value)).collect();
        format!("{} = {callee}({})", self.register(call.result), arguments.join(", "))
    }
}

impl fmt::Display for ShownGraph<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reached = self.graph.reached();
        for (number, (node, _)) in self.graph.nodes.iter().zip(&reached).enumerate().filter(|(_, it)| *it.1) {
            let text = match &node.action {
                Action::Nothing => "nothing".to_owned(),
                Action::Branch { condition, fails, .. } => {
                    format!("branch {}, else {fails}", self.term(*condition))
                }
                Action::Assign { to, value } => {
                    let value = value.map_or_else(|| "?".to_owned(), |value| self.term(value));
                    format!("{} = {value}", self.register(*to))
                }
                Action::Call(call) => self.call(call),
                Action::Return(None) => "return".to_owned(),
                Action::Return(Some(value)) => format!("return {}", self.term(*value)),
            };
            let is_jump = !node.action.is_return() && node.next as usize != number + 1;
            let next = if is_jump { format!(" → {}", node.next) } else { String::new() };
            writeln!(f, "{number:4}  {text}{next}")?;
        }
        Ok(())
    }
}
