//! The costs of programs along their worst path: calls of codels and operations, and accesses to ports, without times.
//!
//! A path ends at a `return`. A constant condition selects one branch; with any other condition, both branches are possible.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use crate::ModelDb;
use crate::body::{ByProgram, Code, bodies_of, by_group, by_program, core_scope};
use crate::builtin::Builtin;
use crate::completeness::Completeness;
use crate::fact::{Fact, FactKind, Unreachable};
use crate::infer::{Inference, inference_of};
use crate::item_tree::{BinaryOperator, Expr, Literal, Name, Program, SourceId, Statement};
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::{Decl, Location};
use crate::values::Value;

/// The cost of a program along its worst path, as executions of codels.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Cost<'db> {
    /// One execution of a codel.
    Codel(Decl<'db>),
    /// One execution of an operation that the core defines: an index into [`crate::Behaviour::operations`].
    Operation(usize),
    /// One call sent to this required operation. It takes no time of the sender.
    Send(Name),
    /// One read or write of this port, which copies a value.
    Access(Name),
    /// The sum of costs.
    Sum(Vec<Cost<'db>>),
    /// The maximum of costs.
    Greatest(Vec<Cost<'db>>),
}

impl Default for Cost<'_> {
    fn default() -> Self {
        Cost::Sum(Vec::new())
    }
}

impl<'db> Cost<'db> {
    /// Returns the parts of sums and maxima, in their order, with repetitions.
    pub fn leaves(&self) -> Vec<&Cost<'db>> {
        match self {
            Cost::Sum(costs) | Cost::Greatest(costs) => costs.iter().flat_map(Cost::leaves).collect(),
            leaf => vec![leaf],
        }
    }
}

/// Returns the codels in a cost, with repetitions.
pub fn codels_in<'db>(cost: &Cost<'db>) -> Vec<Decl<'db>> {
    let codel = |it: &Cost<'db>| if let Cost::Codel(codel) = it { Some(*codel) } else { None };
    cost.leaves().into_iter().filter_map(codel).collect()
}

/// Returns the operations in a cost, as indices into [`crate::Behaviour::operations`].
pub fn operations_in(cost: &Cost<'_>) -> Vec<usize> {
    let index = |it: &Cost<'_>| if let Cost::Operation(index) = it { Some(*index) } else { None };
    cost.leaves().into_iter().filter_map(index).collect()
}

/// Returns the required operations that a cost sends calls to, each once, without those of the operations that it executes.
pub fn sends_in<'a>(cost: &'a Cost<'_>) -> BTreeSet<&'a Name> {
    let name = |it: &'a Cost<'_>| if let Cost::Send(name) = it { Some(name) } else { None };
    cost.leaves().into_iter().filter_map(name).collect()
}

/// The cost of a program or guard of a body.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct ProgramCost<'db> {
    pub(crate) completeness: Completeness,
    pub(crate) cost: Arc<Cost<'db>>,
    /// The value of a constant guard.
    pub(crate) constant: Option<bool>,
    /// The unreachable branches.
    pub(crate) facts: Vec<Fact<'db>>,
}

/// The costs of the programs of a group of bodies, without initial values, which no period evaluates.
pub(crate) type Costs<'db> = ByProgram<ProgramCost<'db>>;

/// Returns the costs of the programs of a core, by group of bodies.
pub(crate) fn costs_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Cow<'db, Costs<'db>>> {
    let of_group = |group| costs_of_group(db, project, of, group);
    by_group(db, of, || costs_in(db, project, of, 0), of_group)
}

/// Returns the costs of the programs of one of several groups of bodies.
#[salsa::tracked(returns(ref))]
fn costs_of_group<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> Costs<'db> {
    costs_in(db, project, of, group)
}

fn costs_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> Costs<'db> {
    let Some(scope) = core_scope(db, of) else { return Costs::default() };
    let inference = inference_of(db, project, of, group);
    by_program(&bodies_of(db, of, scope, group), |_, _, code| program_cost(of, code, inference))
}

fn program_cost<'db>(of: Decl<'db>, code: Code<'_>, inference: &'db Inference<'db>) -> ProgramCost<'db> {
    let mut context = CostContext { of, inference, facts: Vec::new(), until: &[], reached: None };
    let (completeness, cost, constant) = match code {
        Code::Program(code) => (code.completeness, context.program(code), None),
        Code::Guard(guard) => {
            let mut costs = Vec::new();
            let constant = match context.expr(&guard.condition, &mut costs) {
                Some(Value::Bool(value)) => Some(value),
                _ => None,
            };
            (guard.completeness, Cost::Sum(costs), constant)
        }
    };
    ProgramCost { completeness, cost: Arc::new(cost), constant, facts: context.facts }
}

/// Returns the cost of a program up to the end of the last of these calls, along the worst path to it.
pub(crate) fn cost_until<'db>(
    of: Decl<'db>,
    code: Code<'_>,
    inference: &'db Inference<'db>,
    until: &[SourceId],
) -> Cost<'db> {
    let mut context = CostContext { of, inference, facts: Vec::new(), until, reached: None };
    let reached = match code {
        Code::Program(program) => context.block(&program.statements, &mut { MAX_SPLITS }).reached,
        Code::Guard(guard) => {
            context.expr(&guard.condition, &mut Vec::new());
            context.reached
        }
    };
    reached.unwrap_or_default()
}

/// The costs of statements along their worst paths, by the end of the path.
struct Paths<'db> {
    /// The cost of the paths that return; `None` if there are none.
    returned: Option<Cost<'db>>,
    /// The cost of the paths that reach the end of the statements; `None` if every path returns.
    finished: Option<Cost<'db>>,
    /// The cost up to the end of the last of [`CostContext::until`]; `None` if there is none of them.
    reached: Option<Cost<'db>>,
}

impl<'db> Paths<'db> {
    fn either(self, other: Paths<'db>) -> Paths<'db> {
        Paths {
            returned: greatest(self.returned, other.returned),
            finished: greatest(self.finished, other.finished),
            reached: greatest(self.reached, other.reached),
        }
    }

    /// Adds `costs` to the beginning of each path.
    fn after(self, costs: &[Cost<'db>]) -> Paths<'db> {
        let after = |cost: Cost<'db>| Cost::Sum(costs.iter().cloned().chain([cost]).collect());
        Paths {
            returned: self.returned.map(after),
            finished: self.finished.map(after),
            reached: self.reached.map(after),
        }
    }

    fn worst(self) -> Cost<'db> {
        greatest(self.returned, self.finished).unwrap_or(Cost::Sum(Vec::new()))
    }

    /// Returns the paths through a sequence of statements. For at most `splits` statements, the paths that return exclude
    /// the statements after them; for the others they include those, which is safe and keeps the cost flat.
    fn sequence(statements: Vec<Paths<'db>>, splits: &mut u32) -> Paths<'db> {
        // All lists are in reverse order.
        let (mut returned, mut finished) = (None::<Vec<Cost<'db>>>, Some(Vec::new()));
        let mut reached = None::<Vec<Cost<'db>>>;
        let sum = |costs: Vec<Cost<'db>>| Cost::Sum(costs.into_iter().rev().collect());
        for mut statement in statements.into_iter().rev() {
            if statement.returned.is_some() && statement.finished.is_some() {
                match splits.checked_sub(1) {
                    Some(remaining) => *splits = remaining,
                    None => {
                        let reached = statement.reached.take();
                        statement = Paths { returned: None, finished: Some(statement.worst()), reached };
                    }
                }
            }
            match statement.finished {
                None => (returned, finished, reached) = (None, None, None),
                Some(cost) => {
                    let all = returned.iter_mut().chain(&mut finished).chain(&mut reached);
                    all.for_each(|it| it.push(cost.clone()));
                }
            }
            if let Some(cost) = statement.reached {
                reached = greatest(Some(cost), reached.map(sum)).map(|cost| vec![cost]);
            }
            if let Some(cost) = statement.returned {
                returned = greatest(Some(cost), returned.map(sum)).map(|cost| vec![cost]);
            }
        }
        Paths { returned: returned.map(sum), finished: finished.map(sum), reached: reached.map(sum) }
    }
}

fn greatest<'db>(one: Option<Cost<'db>>, other: Option<Cost<'db>>) -> Option<Cost<'db>> {
    match (one, other) {
        (Some(one), Some(other)) => Some(Cost::Greatest(vec![one, other])),
        (one, other) => one.or(other),
    }
}

/// The number of statements of a program, counted from the end, whose returning paths are distinguished from those that
/// continue. For earlier statements, a returning path includes the statements after it, which is safe.
const MAX_SPLITS: u32 = 64;

struct CostContext<'a, 'db> {
    of: Decl<'db>,
    inference: &'db Inference<'db>,
    facts: Vec<Fact<'db>>,
    /// The calls that [`cost_until`] looks for, and the cost of the current statement up to the last of them.
    until: &'a [SourceId],
    reached: Option<Cost<'db>>,
}

impl<'db> CostContext<'_, 'db> {
    fn program(&mut self, program: &Program) -> Cost<'db> {
        let mut splits = MAX_SPLITS;
        self.block(&program.statements, &mut splits).worst()
    }

    fn block(&mut self, statements: &[Statement], splits: &mut u32) -> Paths<'db> {
        // Includes unreachable statements, whose facts are reported too.
        let statements = statements.iter().map(|statement| self.statement(statement, splits)).collect();
        Paths::sequence(statements, splits)
    }

    fn statement(&mut self, statement: &Statement, splits: &mut u32) -> Paths<'db> {
        let mut own = Vec::new();
        match statement {
            Statement::If { condition, then, otherwise, .. } => {
                let value = self.expr(condition, &mut own);
                let reached = self.reached.take();
                let otherwise = otherwise.as_deref().unwrap_or_default();
                let (if_true, if_false) = (self.block(then, splits), self.block(otherwise, splits));
                let (paths, never) = match value {
                    Some(Value::Bool(true)) => (if_true, Some((true, otherwise))),
                    Some(Value::Bool(false)) => (if_false, Some((false, then.as_slice()))),
                    _ => (if_true.either(if_false), None),
                };
                if let Some((value, never)) = never
                    && let Some(id) = never.first().and_then(Statement::id)
                {
                    let kind = FactKind::UnreachableCode(Unreachable::Branch(value));
                    self.facts.push(Fact::new(Location::Source(self.of, id), kind));
                }
                let mut paths = paths.after(&own);
                paths.reached = greatest(reached, paths.reached);
                return paths;
            }
            Statement::Block(statements) => return self.block(statements, splits),
            Statement::Variable(_) | Statement::Return(..) | Statement::Assign(..) | Statement::Expr(_) => {
                if let Some(value) = statement.expression() {
                    self.expr(value, &mut own);
                }
            }
        }
        let (cost, reached) = (Some(Cost::Sum(own)), self.reached.take());
        match statement {
            Statement::Return(..) => Paths { returned: cost, finished: None, reached },
            _ => Paths { returned: None, finished: cost, reached },
        }
    }

    /// Adds the cost of an expression, and returns its value if it is constant. Names, calls and floating-point numbers, which
    /// compilers may round differently, are not constant. Both operands of `&&` and `||` count, because the worst path
    /// evaluates both, unless the left operand is a constant that decides.
    fn expr(&mut self, expr: &Expr, costs: &mut Vec<Cost<'db>>) -> Option<Value> {
        match expr {
            Expr::Literal(literal @ (Literal::Bool(_) | Literal::Int(_)), _) => {
                Value::of_literal(literal).ok().flatten()
            }
            Expr::Missing | Expr::Literal(..) | Expr::Name(_) => None,
            Expr::Incomplete(inner) => {
                self.expr(inner, costs);
                None
            }
            Expr::Unary(operator, inner, _) => self.expr(inner, costs)?.unary(*operator).ok().flatten(),
            Expr::Binary(operator, lhs, rhs, _) => {
                // Sums are left-deep: the loop limits the recursion to right operands.
                let mut spine = vec![(*operator, rhs)];
                let mut left = lhs;
                while let Expr::Binary(operator, lhs, rhs, _) = left.as_ref() {
                    spine.push((*operator, rhs));
                    left = lhs;
                }
                let value = self.expr(left, costs);
                let operands = spine.into_iter().rev();
                operands.fold(value, |value, (operator, rhs)| self.operand(operator, value, rhs, costs))
            }
            Expr::Call { callee, arguments, id } => {
                arguments.iter().for_each(|argument| _ = self.expr(argument, costs));
                costs.extend(match self.inference.callee(callee.id) {
                    Some(Callee::Codel(codel)) => Some(Cost::Codel(codel)),
                    Some(Callee::Operation(index)) => Some(Cost::Operation(index)),
                    Some(Callee::Builtin(Builtin::Send)) => match arguments.first() {
                        Some(Expr::Name(operation)) => Some(Cost::Send(operation.name.clone())),
                        _ => None,
                    },
                    // Ports are lock-free (paper, Property 2), but copy values.
                    Some(Callee::Builtin(Builtin::Read | Builtin::Write)) => match arguments.first() {
                        Some(Expr::Name(port)) => Some(Cost::Access(port.name.clone())),
                        _ => None,
                    },
                    Some(Callee::Builtin(_)) | None => None,
                });
                if self.until.contains(id) {
                    self.reached = Some(Cost::Sum(costs.clone()));
                }
                None
            }
        }
    }

    /// Adds the cost of the right operand of an operator, and returns the operator's value; `left` is the value of the left
    /// operand.
    fn operand(
        &mut self,
        operator: BinaryOperator,
        left: Option<Value>,
        rhs: &Expr,
        costs: &mut Vec<Cost<'db>>,
    ) -> Option<Value> {
        let deciding = match operator {
            BinaryOperator::And => Some(Value::Bool(false)),
            BinaryOperator::Or => Some(Value::Bool(true)),
            _ => None,
        };
        let before = costs.len();
        let right = self.expr(rhs, costs);
        if deciding.is_some() && left == deciding {
            costs.truncate(before);
            return left;
        }
        if deciding.is_some() && right == deciding {
            return deciding;
        }
        left.zip(right).and_then(|(left, right)| left.binary(operator, &right).ok().flatten())
    }
}
