//! What a program costs along its worst path, and which names in it mean nothing.
//!
//! Paths end at a `return`, and a condition that is constant takes one branch. Any other condition is free.

use rustc_hash::FxHashMap;

use super::{Cost, Reader};
use crate::builtin::{Builtin, Operand};
use crate::fact::{CorePart, CoreReason, FactKind, Hidden, NotCallable, SendInstead, Unreachable};
use crate::item_tree::{
    BinaryOperator, Expr, FeatureKind, Kind, Literal, Name, NameRef, Part, Program, Statement, Variable,
};
use crate::names::{Unresolved, similar};
use crate::source::{Decl, Place};
use crate::values::Value;

/// The variables in scope, innermost last.
#[derive(Default)]
pub(super) struct Scope {
    pub(super) names: Vec<Name>,
    /// How many of each name there are.
    counts: FxHashMap<Name, usize>,
}

impl Scope {
    pub(super) fn push(&mut self, name: &Name) {
        self.names.push(name.clone());
        *self.counts.entry(name.clone()).or_default() += 1;
    }

    pub(super) fn truncate(&mut self, depth: usize) {
        for name in self.names.drain(depth..) {
            if let Some(count) = self.counts.get_mut(&name) {
                *count -= 1;
            }
        }
    }

    fn contains(&self, name: &Name) -> bool {
        self.counts.get(name).is_some_and(|count| *count > 0)
    }
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

impl<'db> Reader<'_, 'db> {
    /// The cost of a program along its worst path.
    pub(super) fn program(&mut self, program: &Program) -> Cost<'db> {
        if !program.whole {
            self.refuse_here(CoreReason::SyntaxError(CorePart::Program));
        }
        let variables_lost = self.variables_lost;
        self.variables_lost |= !program.whole;
        self.program_whole = program.whole;
        let mut splits = MOST_SPLITS;
        let paths = self.block(&program.statements, &mut splits);
        self.variables_lost = variables_lost;
        paths.worst()
    }

    fn block(&mut self, statements: &[Statement], splits: &mut u32) -> Paths<'db> {
        let depth = self.scope.names.len();
        // All are read, whether they are reached or not.
        let pieces = statements.iter().map(|statement| self.statement(statement, splits)).collect();
        self.scope.truncate(depth);
        Paths::in_order(pieces, splits)
    }

    fn statement(&mut self, statement: &Statement, splits: &mut u32) -> Paths<'db> {
        let mut own = Vec::new();
        let costs = &mut own;
        match statement {
            Statement::Variable(Variable { name, value, .. }) => {
                if let Some(value) = value {
                    self.expr(value, costs);
                }
                self.scope.push(&name.name);
            }
            Statement::If { condition, then, otherwise, .. } => {
                let value = self.expr(condition, costs);
                let otherwise = otherwise.as_deref().unwrap_or_default();
                let (if_true, if_false) = (self.block(then, splits), self.block(otherwise, splits));
                let (paths, never) = match value {
                    Some(Value::Bool(true)) => (if_true, Some((true, otherwise))),
                    Some(Value::Bool(false)) => (if_false, Some((false, then.as_slice()))),
                    _ => (if_true.either(if_false), None),
                };
                if let Some((value, never)) = never
                    && let Some(part) = never.first().and_then(Statement::part)
                {
                    let at = self.at(part);
                    self.report(at, FactKind::UnreachableCode(Unreachable::Branch(value)));
                }
                return paths.after(&own);
            }
            Statement::Block(statements) => return self.block(statements, splits),
            Statement::Return(_, value) => {
                if let Some(value) = value {
                    self.expr(value, costs);
                }
                return Paths { returned: Some(Cost::Sum(own)), finished: None };
            }
            Statement::Assign(target, value) => {
                self.name(target);
                self.expr(value, costs);
            }
            Statement::Expr(value) => {
                if let Expr::Call { callee, arguments, part } = value {
                    let first = arguments.first().and_then(Expr::part);
                    self.statement = Some((callee.part, *part, first));
                }
                let refusals = self.found.refusals.len();
                self.expr(value, costs);
                // A call of which the name or the brackets were lost. (If it names a codel, that is said already.)
                let is_new = refusals == self.found.refusals.len() && self.program_whole;
                if let Some(part) = of_no_call(value).filter(|_| is_new) {
                    self.refuse(self.at(part), FactKind::NoEffect);
                }
            }
        }
        Paths { returned: None, finished: Some(Cost::Sum(own)) }
    }

    /// Adds what an expression costs, and returns its value where that is the same on every path. Names, calls and numbers of
    /// type double, which compilers may round differently, have none. Both sides of `&&` and `||` count, unless the first
    /// decides: the worst path evaluates them.
    pub(super) fn expr(&mut self, expr: &Expr, costs: &mut Vec<Cost<'db>>) -> Option<Value> {
        match expr {
            Expr::Missing => None,
            Expr::Literal(literal @ (Literal::Bool(_) | Literal::Int(_)), _) => {
                Value::of_literal(literal).ok().flatten()
            }
            Expr::Literal(..) => None,
            Expr::Name(name) => {
                self.name(name);
                None
            }
            Expr::Lost(inner) => {
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
                let mut value = self.expr(left, costs);
                for (operator, rhs) in spine.into_iter().rev() {
                    let decided = match operator {
                        BinaryOperator::And => Some(Value::Bool(false)),
                        BinaryOperator::Or => Some(Value::Bool(true)),
                        _ => None,
                    };
                    let before = costs.len();
                    let right = self.expr(rhs, costs);
                    if decided.is_some() && value == decided {
                        costs.truncate(before);
                    } else if decided.is_some() && right == decided {
                        value = decided;
                    } else {
                        value = value.zip(right).and_then(|(a, b)| a.binary(operator, &b).ok().flatten());
                    }
                }
                value
            }
            Expr::Call { callee, arguments, .. } => {
                // The port, operation or handler of a built-in function is no value.
                let built_in = self.is_built_in_call(callee, arguments);
                if !built_in && self.misspelt_operand(callee, arguments) {
                    for argument in arguments.iter().skip(1) {
                        self.expr(argument, costs);
                    }
                    return None;
                }
                for argument in arguments.iter().skip(usize::from(built_in)) {
                    self.expr(argument, costs);
                }
                costs.extend(self.call(callee, built_in));
                None
            }
        }
    }

    /// Is this `read(port, …)`, `write(port, …)`, `status(port)`, `send(operation, …)` or `collect(handler, …)`? These
    /// cost nothing: ports are lock-free (paper, Property 2). What they are called with tells them from a codel of that
    /// name, which may be missing.
    fn is_built_in_call(&self, callee: &NameRef, arguments: &[Expr]) -> bool {
        let Some(Expr::Name(first)) = arguments.first() else { return false };
        let Some(builtin) = Builtin::of_name(&callee.name) else { return false };
        if builtin == Builtin::Collect {
            return self.core.handlers.iter().any(|handler| handler.name.name == first.name);
        }
        // Ports and operations are no values: a variable of the same name is not meant, unless a codel may be missing.
        if self.scope.contains(&first.name) && self.names.is_in_doubt() {
            return false;
        }
        self.features.get(&first.name).is_some_and(|feature| builtin.takes(feature.kind))
    }

    /// Reports a port, operation or handler of a built-in function that is none, nor anything else.
    fn misspelt_operand(&mut self, callee: &NameRef, arguments: &[Expr]) -> bool {
        let Some(function) = Builtin::of_name(&callee.name) else { return false };
        let Some(Expr::Name(first)) = arguments.first() else { return false };
        let hidden = self.scope.contains(&callee.name) || self.features.get(&callee.name).is_some();
        let is_known = self.scope.contains(&first.name)
            || self.features.get(&first.name).is_some()
            || !matches!(self.codel(&first.name), Err(Unresolved::Unknown));
        if hidden
            || is_known
            || self.features.lost
            || self.variables_lost
            || !matches!(self.codel(&callee.name), Err(Unresolved::Unknown))
        {
            return false;
        }
        let features = self.features.by_name.iter();
        let fitting = features.filter(|(_, found)| found.iter().any(|it| function.takes(it.kind)));
        let takes_handler = function.operand() == Operand::Handler;
        let handlers = self.core.handlers.iter().map(|it| &it.name.name).filter(|_| takes_handler);
        let near = similar(&first.name, fitting.map(|(name, _)| name).chain(handlers));
        let name = first.name.clone();
        self.refuse(self.at(first.part), FactKind::UnresolvedOperand { function, name, near });
        true
    }

    /// A name that stands for a value, or is assigned one. One that means something else may be a call that lost its
    /// brackets.
    fn name(&mut self, name: &NameRef) {
        let NameRef { name, part } = name;
        // Variables of the machine are seen in its programs only; elsewhere they cost nothing either.
        let mut of_machines = self.core.machines.iter().flat_map(|machine| &machine.variables);
        if name.is_empty()
            || self.scope.contains(name)
            || of_machines.any(|variable| variable.name.name == *name)
        {
            return;
        }
        let at = self.at(*part);
        if let Some(feature) = self.features.get(name) {
            if feature.kind.is_operation() {
                self.refuse(at, FactKind::NotCalled { name: name.clone(), is_operation: true });
            }
            return;
        }
        match self.codel(name) {
            Ok(_) | Err(Unresolved::Ambiguous | Unresolved::Repeated) => {
                self.refuse(at, FactKind::NotCalled { name: name.clone(), is_operation: false });
            }
            // One mistake: the error that may hide its declaration is reported.
            Err(_) if self.features.lost || self.variables_lost => {
                self.refuse_in_doubt(CoreReason::MayBeDeclared(name.clone()));
            }
            Err(_) => {
                let known = self.scope.names.iter().chain(self.features.by_name.keys());
                let near = similar(name, known);
                self.refuse(at, FactKind::UnresolvedVariable { name: name.clone(), near });
            }
        }
    }

    /// The codel of that name, as it is seen from the core.
    fn codel(&self, name: &Name) -> Result<Decl<'db>, Unresolved> {
        let library = self.of.library(self.db).as_ref();
        self.names.resolve(self.db, library, Kind::Codel, std::slice::from_ref(name))
    }

    /// Something that hides the codel, or the built-in function, of its name.
    fn not_callable(&mut self, at: Place<'db>, name: &Name, is: NotCallable) {
        let hides = match self.codel(name) {
            Err(Unresolved::Unknown) => Builtin::of_name(name).map(|_| Hidden::Builtin),
            _ => Some(Hidden::Codel),
        };
        self.refuse(at, FactKind::NotCallable { name: name.clone(), is, hides });
    }

    /// What a call costs: a codel, an operation of one's own, or nothing.
    fn call(&mut self, callee: &NameRef, built_in: bool) -> Option<Cost<'db>> {
        let name = &callee.name;
        let at = self.at(callee.part);
        if built_in {
            // A port that is called like the function does not hide it; a codel or an own operation does.
            let codel = self.codel(name);
            let feature = self.features.get(name);
            let is_own = feature.is_some_and(|feature| feature.kind == FeatureKind::Provided);
            if matches!(codel, Err(Unresolved::Unknown | Unresolved::Lost)) && !is_own {
                return None;
            }
        }
        if self.scope.contains(name) {
            self.not_callable(at, name, NotCallable::Variable);
            return None;
        }
        if let Some(feature) = self.features.get(name) {
            match feature.kind {
                FeatureKind::Provided => {
                    let defined =
                        self.core.operations.iter().position(|operation| operation.name.name == *name);
                    if defined.is_none() {
                        self.refuse_here(CoreReason::UndefinedOperation(name.clone()));
                    }
                    return defined.map(Cost::Operation);
                }
                FeatureKind::Required => {
                    let handler = self.core.handlers.iter().find(|handler| {
                        handler.operation.as_ref().and_then(|it| it.path.last()) == Some(name)
                    });
                    let statement = self.statement.filter(|(of, ..)| *of == callee.part);
                    let send = handler.zip(statement).map(|(it, (_, call, first))| SendInstead {
                        handler: it.name.name.clone(),
                        call,
                        first,
                    });
                    self.refuse(at, FactKind::BlockingCall { name: name.clone(), send });
                }
                FeatureKind::Input | FeatureKind::Output => self.not_callable(at, name, NotCallable::Port),
                FeatureKind::Constant | FeatureKind::Property => {
                    self.not_callable(at, name, NotCallable::Property)
                }
            }
            return None;
        }
        match self.codel(name) {
            Ok(codel) => return Some(Cost::Codel(codel)),
            Err(Unresolved::Ambiguous) => {
                self.refuse(at, FactKind::AmbiguousName { kind: Kind::Codel, name: name.clone() });
            }
            Err(Unresolved::Repeated) => self.refuse_here(CoreReason::RepeatedCodel(name.clone())),
            Err(Unresolved::Lost) => {
                self.refuse_in_doubt(CoreReason::CodelNotFound(name.clone(), self.names.may_hide()));
            }
            // One mistake: the shell that may declare it is reported.
            Err(_) if self.features.lost => {
                self.refuse_in_doubt(CoreReason::MayBeOperation(name.clone()));
            }
            Err(_) => {
                let unresolved = FactKind::UnresolvedCodel { core: self.of, name: name.clone() };
                self.refuse(at, Builtin::of_name(name).map_or(unresolved, FactKind::NotBuiltin));
            }
        }
        None
    }
}

/// Where an expression without any call stands. (One that is missing is a syntax error.)
fn of_no_call(expr: &Expr) -> Option<Part> {
    match expr {
        Expr::Missing | Expr::Lost(_) | Expr::Call { .. } => None,
        Expr::Literal(_, part) => Some(*part),
        Expr::Name(name) => Some(name.part),
        Expr::Unary(_, inner, _) => of_no_call(inner),
        Expr::Binary(_, lhs, rhs, _) => of_no_call(rhs).and(of_no_call(lhs)),
    }
}
