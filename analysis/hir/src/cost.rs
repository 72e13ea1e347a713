//! What the programs of a body cost along their worst path: their codels and operations, without times.
//!
//! Paths end at a `return`, and a condition that is constant takes one branch. Any other condition is free.

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::{Body, BodyId, Code, CoreScope, ProgramIn, bodies_of, core_scope};
use crate::completeness::Completeness;
use crate::fact::{Fact, FactKind, Unreachable};
use crate::infer::{Inference, inference_of};
use crate::item_tree::{BinaryOperator, Expr, Literal, Program, Statement};
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::{Decl, Location};
use crate::values::Value;

/// The cost of a program along its worst path, by codels.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Cost<'db> {
    /// One execution of a codel.
    Codel(Decl<'db>),
    /// One execution of an operation that the core itself provides: an index into [`crate::Behaviour::operations`].
    Operation(usize),
    /// All of these.
    Sum(Vec<Cost<'db>>),
    /// The greatest of these.
    Greatest(Vec<Cost<'db>>),
}

impl Default for Cost<'_> {
    fn default() -> Self {
        Cost::Sum(Vec::new())
    }
}

/// The operations that a cost counts, by their numbers in [`crate::Behaviour::operations`].
pub fn operations_in(cost: &Cost<'_>) -> Vec<usize> {
    match cost {
        Cost::Codel(_) => Vec::new(),
        Cost::Operation(index) => vec![*index],
        Cost::Sum(costs) | Cost::Greatest(costs) => costs.iter().flat_map(operations_in).collect(),
    }
}

/// What one program or guard of a body costs.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct ProgramCost<'db> {
    /// Which.
    pub(crate) program: ProgramIn,
    /// Whether it is complete.
    pub(crate) completeness: Completeness,
    /// Its cost along its worst path.
    pub(crate) cost: Arc<Cost<'db>>,
    /// Of a guard that is constant: its value.
    pub(crate) decided: Option<bool>,
    /// Branches that no path takes.
    pub(crate) facts: Vec<Fact<'db>>,
}

/// What the programs of a group of bodies cost; nothing of the initial values, which no period computes.
pub(crate) type Costs<'db> = FxHashMap<BodyId, Vec<ProgramCost<'db>>>;

/// What the programs of a core cost, by group of bodies.
pub(crate) fn costs_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Cow<'db, Costs<'db>>> {
    let groups = core_scope(db, of).as_ref().map_or(0..0, CoreScope::groups);
    match groups.len() {
        // Whatever changes in the core changes in this group.
        1 => vec![Cow::Owned(costs_in(db, project, of, 0))],
        _ => groups.map(|group| Cow::Borrowed(costs_of_group(db, project, of, group))).collect(),
    }
}

/// What the programs of one of several groups of bodies cost.
#[salsa::tracked(returns(ref))]
fn costs_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> FxHashMap<BodyId, Vec<ProgramCost<'db>>> {
    costs_in(db, project, of, group)
}

fn costs_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> Costs<'db> {
    let Some(scope) = core_scope(db, of) else { return Costs::default() };
    let inference = inference_of(db, project, of, group);
    let bodies = bodies_of(db, of, scope, group);
    bodies.iter().map(|(id, body)| (*id, costs(of, body, inference))).collect()
}

fn costs<'db>(of: Decl<'db>, body: &Body, inference: &'db Inference<'db>) -> Vec<ProgramCost<'db>> {
    let cost = |(program, code): (ProgramIn, Code<'_>)| {
        let mut pricing = Pricing { of, inference, facts: Vec::new() };
        let (completeness, cost, decided) = match code {
            Code::Program(code) => (code.completeness, pricing.program(code), None),
            Code::Guard(guard) => {
                let mut costs = Vec::new();
                let decided = match pricing.expr(&guard.condition, &mut costs) {
                    Some(Value::Bool(value)) => Some(value),
                    _ => None,
                };
                (guard.completeness, Cost::Sum(costs), decided)
            }
        };
        ProgramCost { program, completeness, cost: Arc::new(cost), decided, facts: pricing.facts }
    };
    body.code().into_iter().map(cost).collect()
}

/// The costs of a piece of a program along its worst paths, by where they end.
struct Paths<'db> {
    /// Of the paths that return; `None` where none does.
    returned: Option<Cost<'db>>,
    /// Of the paths that reach the end of the piece; `None` where every path returns.
    finished: Option<Cost<'db>>,
}

impl<'db> Paths<'db> {
    /// The paths of either piece.
    fn either(self, other: Paths<'db>) -> Paths<'db> {
        Paths {
            returned: greatest(self.returned, other.returned),
            finished: greatest(self.finished, other.finished),
        }
    }

    /// The paths that begin with `costs`.
    fn after(self, costs: &[Cost<'db>]) -> Paths<'db> {
        let after = |cost: Cost<'db>| Cost::Sum(costs.iter().cloned().chain([cost]).collect());
        Paths { returned: self.returned.map(after), finished: self.finished.map(after) }
    }

    /// The worst of all.
    fn worst(self) -> Cost<'db> {
        greatest(self.returned, self.finished).unwrap_or(Cost::Sum(Vec::new()))
    }

    /// The paths through pieces that follow one another. At most `splits` times, what comes behind a piece is left out
    /// where that piece returns; counting it is safe, and keeps costs flat.
    fn in_order(pieces: Vec<Paths<'db>>, splits: &mut u32) -> Paths<'db> {
        // From the last piece on; both lists are in that order.
        let (mut returned, mut finished) = (None::<Vec<Cost<'db>>>, Some(Vec::new()));
        let sum = |costs: Vec<Cost<'db>>| Cost::Sum(costs.into_iter().rev().collect());
        for mut piece in pieces.into_iter().rev() {
            if piece.returned.is_some() && piece.finished.is_some() {
                match splits.checked_sub(1) {
                    Some(left) => *splits = left,
                    None => piece = Paths { returned: None, finished: Some(piece.worst()) },
                }
            }
            match piece.finished {
                None => (returned, finished) = (None, None),
                Some(cost) => returned.iter_mut().chain(&mut finished).for_each(|it| it.push(cost.clone())),
            }
            if let Some(now) = piece.returned {
                returned = greatest(Some(now), returned.map(sum)).map(|cost| vec![cost]);
            }
        }
        Paths { returned: returned.map(sum), finished: finished.map(sum) }
    }
}

/// The greater of two costs, where there are two.
fn greatest<'db>(one: Option<Cost<'db>>, other: Option<Cost<'db>>) -> Option<Cost<'db>> {
    match (one, other) {
        (Some(one), Some(other)) => Some(Cost::Greatest(vec![one, other])),
        (one, other) => one.or(other),
    }
}

/// The number of statements of a program for which the paths that return are kept apart from those that go on, the last ones
/// first. Before these, a path that returns counts what follows as well, which is safe.
const MOST_SPLITS: u32 = 64;

struct Pricing<'db> {
    of: Decl<'db>,
    inference: &'db Inference<'db>,
    facts: Vec<Fact<'db>>,
}

impl<'db> Pricing<'db> {
    /// The cost of a program along its worst path.
    fn program(&mut self, program: &Program) -> Cost<'db> {
        let mut splits = MOST_SPLITS;
        self.block(&program.statements, &mut splits).worst()
    }

    fn block(&mut self, statements: &[Statement], splits: &mut u32) -> Paths<'db> {
        // All are read, whether they are reached or not.
        let pieces = statements.iter().map(|statement| self.statement(statement, splits)).collect();
        Paths::in_order(pieces, splits)
    }

    fn statement(&mut self, statement: &Statement, splits: &mut u32) -> Paths<'db> {
        let mut own = Vec::new();
        match statement {
            Statement::If { condition, then, otherwise, .. } => {
                let value = self.expr(condition, &mut own);
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
                return paths.after(&own);
            }
            Statement::Block(statements) => return self.block(statements, splits),
            Statement::Return(_, value) => {
                if let Some(value) = value {
                    self.expr(value, &mut own);
                }
                return Paths { returned: Some(Cost::Sum(own)), finished: None };
            }
            Statement::Variable(_) | Statement::Assign(..) | Statement::Expr(_) => {
                if let Some(value) = statement.expression() {
                    self.expr(value, &mut own);
                }
            }
        }
        Paths { returned: None, finished: Some(Cost::Sum(own)) }
    }

    /// Adds what an expression costs, and returns its value where that is the same on every path. Names, calls and numbers of
    /// type double, which compilers may round differently, have none. Both sides of `&&` and `||` count, unless the first
    /// decides: the worst path evaluates them.
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
                // Sums are left-deep: the loop keeps the recursion to the right.
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
            Expr::Call { callee, arguments, .. } => {
                arguments.iter().for_each(|argument| _ = self.expr(argument, costs));
                costs.extend(match self.inference.callee(callee.id) {
                    Some(Callee::Codel(codel)) => Some(Cost::Codel(codel)),
                    Some(Callee::Operation(index)) => Some(Cost::Operation(index)),
                    // Ports are lock-free (paper, Property 2): these cost nothing.
                    Some(Callee::Builtin(_)) | None => None,
                });
                None
            }
        }
    }

    /// Adds what the right operand of an operator costs; the left one has the value `left`.
    fn operand(
        &mut self,
        operator: BinaryOperator,
        left: Option<Value>,
        rhs: &Expr,
        costs: &mut Vec<Cost<'db>>,
    ) -> Option<Value> {
        let decided = match operator {
            BinaryOperator::And => Some(Value::Bool(false)),
            BinaryOperator::Or => Some(Value::Bool(true)),
            _ => None,
        };
        let before = costs.len();
        let right = self.expr(rhs, costs);
        if decided.is_some() && left == decided {
            costs.truncate(before);
            return left;
        }
        if decided.is_some() && right == decided {
            return decided;
        }
        left.zip(right).and_then(|(left, right)| left.binary(operator, &right).ok().flatten())
    }
}
