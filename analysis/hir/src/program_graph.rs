//! The program graph: each program and guard, lowered once to nodes in the order of execution. Costs, values of variables and
//! passages of data are computed from it; nothing else knows what `&&`, a call or a `return` does.
//!
//! ```text
//! if count == 0 && ready() { plan(); } else { count = count - 1; }
//!
//! 0  branch count == 0, else 4
//! 1  %1 = ready()
//! 2  branch %1, else 4
//! 3  %2 = plan()                5
//! 4  count = count - 1
//! 5  return
//! ```
//!
//! MAUVE has no loops: each node is before its successors. Short circuits and conditions in values are branches; the operands of an
//! operator and the arguments of a call are evaluated from left to right. Equal programs have equal graphs, so that an edit of a
//! comment, or of a number that no counter depends on, ends here.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::{
    Body, BodyId, ByProgram, CoreScope, InitialValues, ProgramIn, ScopedCode, bodies_of, core_scope,
    of_program,
};
use crate::completeness::Completeness;
use crate::fact::Unreachable;
use crate::infer::{Inference, UNKNOWN_DIRECTION, directions_of, inference_of};
use crate::item_tree::{
    BinaryOperator, CallStatus, Direction, Expr, Literal, Name, NameRef, PortStatus, SourceId, Statement,
    UnaryOperator, Variable, is_logic, spine,
};
use crate::project::Project;
use crate::resolve::{Binding, Callee, VariableId};
use crate::source::Decl;
use crate::values::{Value, whole_number};

/// A program, a guard or the initial values of variables.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(crate) struct ProgramGraph<'db> {
    /// Each is before its successors.
    pub(crate) nodes: Box<[Node<'db>]>,
    /// The first node of all executions. Those before it are never reached.
    pub(crate) start: u32,
    /// The values that nodes compute; each refers to earlier ones only.
    pub(crate) terms: Box<[Term]>,
    /// What nodes assign and terms read.
    pub(crate) registers: Box<[Register]>,
    /// The value of a constant guard.
    pub(crate) constant: Option<bool>,
    /// The first statements that no execution comes to.
    pub(crate) unreachable: Vec<(Unreachable, SourceId)>,
    /// The greatest product of the literals of an expression, without 0: `60 * 10` is 600.
    pub(crate) greatest_number: i32,
    pub(crate) completeness: Completeness,
}

/// What a program does at one point.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct Node<'db> {
    pub(crate) action: Action<'db>,
    /// The source: of a condition, an assigned name, a call or a `return`.
    pub(crate) at: SourceId,
    /// The node after it; of a branch, where the condition holds. A `return` has none.
    pub(crate) next: u32,
}

#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) enum Action<'db> {
    /// The beginning of statements that no execution reaches.
    Nothing,
    Branch {
        condition: u32,
        /// The node after it where the condition does not hold.
        fails: u32,
        /// Whether only a value depends on it: no call, and no statement.
        is_value: bool,
    },
    /// The value is unknown for a variable that is declared without one.
    Assign {
        to: u32,
        value: Option<u32>,
    },
    Call(Box<Call<'db>>),
    /// A guard returns whether it holds.
    Return(Option<u32>),
}

/// A call of a codel, an operation of the core or a built-in function.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct Call<'db> {
    /// The source of the name.
    pub(crate) name: SourceId,
    /// `None` where the name is unresolved.
    pub(crate) callee: Option<Callee<'db>>,
    /// The first argument of a built-in function: a port, an operation or a handler.
    pub(crate) operand: Name,
    pub(crate) arguments: Box<[Argument]>,
    /// The register of the result.
    pub(crate) result: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Argument {
    pub(crate) value: u32,
    pub(crate) direction: Direction,
    /// The variable that it names.
    pub(crate) variable: Option<u32>,
}

/// A value, as in the generated C++.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Term {
    /// A value that is missing, or an unresolved name.
    Missing,
    Bool(bool),
    Int(i32),
    /// A status: `no_data` and `failure` are 0.
    Status(u8),
    /// A floating-point number, a string, or a number that is too large.
    Other,
    /// A constant or property of the shell.
    Feature,
    Register(u32, SourceId),
    /// An expression with a missing operand: its names count, its value is unknown.
    Incomplete(u32),
    Unary(UnaryOperator, u32),
    /// No `&&` or `||`, except in [`Term::Decided`].
    Binary(BinaryOperator, u32, u32),
    /// The result of branches on the operands of this term.
    Decided(bool, u32),
}

/// A variable of a program, or the result of a call or of a short circuit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Register {
    /// `None` for a result.
    pub(crate) variable: Option<VariableId>,
    /// The number of parameters, local variables and results that exist when it begins to. It ends with the next one that has as
    /// few.
    pub(crate) depth: u32,
}

/// The graphs of the programs of a group of bodies; that of initial values is the graph of [`ProgramIn::Whole`].
pub(crate) type Graphs<'db> = ByProgram<Arc<ProgramGraph<'db>>>;

/// Returns the graph of a program.
pub(crate) fn graph_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    body: BodyId,
    program: ProgramIn,
) -> Option<&'db Arc<ProgramGraph<'db>>> {
    let (group, index) = core_scope(db, of).as_ref()?.place(body)?;
    of_program(graphs_of_group(db, project, of, group as u32), index, program)
}

/// Returns the graphs of a group of bodies.
#[salsa::tracked(returns(ref))]
pub(crate) fn graphs_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> Graphs<'db> {
    let Some(scope) = core_scope(db, of) else { return Graphs::default() };
    let inference = inference_of(db, project, of, group);
    let lowering = || Lowering::new(db, scope, inference, group);
    let of_body = |(id, body): &(BodyId, Body)| {
        let mut all: Vec<(ProgramIn, Arc<ProgramGraph<'db>>)> = match body {
            Body::InitialValues(values) => {
                vec![(ProgramIn::Whole, Arc::new(lowering().initial_values(*id, values)))]
            }
            _ => {
                let code = body.code().into_iter();
                code.map(|(program, code)| (program, Arc::new(lowering().code(code)))).collect()
            }
        };
        all.sort_unstable_by_key(|(program, _)| *program);
        all.into()
    };
    let found: Graphs<'db> = bodies_of(db, of, scope, group).iter().map(of_body).collect();
    db.note_nodes(found.iter().flatten().map(|(_, graph)| graph.nodes.len()).sum());
    found
}

impl Call<'_> {
    /// Returns the index of the operation of the core that it calls.
    pub(crate) fn operation(&self) -> Option<usize> {
        self.callee?.operation()
    }
}

impl Action<'_> {
    pub(crate) fn is_return(&self) -> bool {
        matches!(self, Action::Return(_))
    }
}

impl Node<'_> {
    /// Returns the nodes after it; of a branch, where its condition holds, and where it does not.
    pub(crate) fn successors(&self) -> [Option<u32>; 2] {
        match self.action {
            Action::Return(_) => [None, None],
            Action::Branch { fails, .. } => [Some(self.next), Some(fails)],
            _ => [Some(self.next), None],
        }
    }
}

impl<'db> ProgramGraph<'db> {
    /// Returns, for each node, whether some execution may come to it.
    pub(crate) fn reached(&self) -> Vec<bool> {
        let mut reached = vec![false; self.nodes.len()];
        reached.get_mut(self.start as usize).into_iter().for_each(|it| *it = true);
        for (index, node) in self.nodes.iter().enumerate() {
            if reached.get(index) == Some(&true) {
                let next = node.successors().into_iter().flatten();
                next.for_each(|next| reached.get_mut(next as usize).into_iter().for_each(|it| *it = true));
            }
        }
        reached
    }

    pub(crate) fn term(&self, index: u32) -> Term {
        self.terms.get(index as usize).copied().unwrap_or(Term::Missing)
    }

    /// Returns the first operand of a term, and its operators with their right operands, in their order: a long sum is no deep
    /// recursion.
    pub(crate) fn spine(&self, term: u32) -> (u32, Vec<(BinaryOperator, u32)>) {
        let (mut first, mut operators) = (term, Vec::new());
        while let Term::Binary(operator, left, right) = self.term(first) {
            operators.push((operator, right));
            first = left;
        }
        operators.reverse();
        (first, operators)
    }

    pub(crate) fn variable(&self, register: u32) -> Option<VariableId> {
        self.registers.get(register as usize)?.variable
    }

    pub(crate) fn calls(&self) -> impl Iterator<Item = &Call<'db>> {
        self.nodes
            .iter()
            .filter_map(|node| if let Action::Call(call) = &node.action { Some(&**call) } else { None })
    }

    /// Returns the variables that the program reads, or whose values a call needs as output arguments.
    pub(crate) fn used(&self) -> impl Iterator<Item = VariableId> {
        let registers = self
            .terms
            .iter()
            .filter_map(|term| if let Term::Register(it, _) = term { Some(*it) } else { None });
        registers.filter_map(|it| self.variable(it))
    }
}

/// Returns the registers that a term reads itself, not through the results of branches, with their sources.
pub(crate) fn registers(terms: &[Term], term: u32) -> Vec<(u32, SourceId)> {
    let (mut found, mut open) = (Vec::new(), vec![term]);
    while let Some(term) = open.pop() {
        match terms.get(term as usize) {
            Some(Term::Register(register, id)) => found.push((*register, *id)),
            Some(Term::Incomplete(inner) | Term::Unary(_, inner)) => open.push(*inner),
            Some(Term::Binary(_, one, other)) => open.extend([one, other]),
            _ => {}
        }
    }
    found
}

/// Nodes that end without a successor yet, each with whether it is that of a condition that does not hold.
type Exits = Vec<(u32, bool)>;

/// The exit before the first node.
const START: u32 = u32::MAX;

/// Where a condition holds, where it does not, and its value if it is constant.
struct Decision {
    holds: Exits,
    fails: Exits,
    constant: Option<bool>,
}

struct Lowering<'a, 'db> {
    db: &'db dyn ModelDb,
    scope: &'a CoreScope,
    inference: &'a Inference<'db>,
    group: u32,
    nodes: Vec<Node<'db>>,
    start: u32,
    terms: Vec<Term>,
    registers: Vec<Register>,
    /// The registers of variables.
    numbers: FxHashMap<VariableId, u32>,
    depth: u32,
    open: Exits,
    unreachable: Vec<(Unreachable, SourceId)>,
    /// The product of the literals of the current expression.
    number: i32,
    greatest_number: i32,
}

impl<'a, 'db> Lowering<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        scope: &'a CoreScope,
        inference: &'a Inference<'db>,
        group: u32,
    ) -> Lowering<'a, 'db> {
        Lowering {
            db,
            scope,
            inference,
            group,
            nodes: Vec::new(),
            start: 0,
            terms: Vec::new(),
            registers: Vec::new(),
            numbers: FxHashMap::default(),
            depth: 0,
            open: vec![(START, false)],
            unreachable: Vec::new(),
            number: 1,
            greatest_number: 1,
        }
    }

    fn code(mut self, code: ScopedCode<'_>) -> ProgramGraph<'db> {
        let (completeness, constant) = match code {
            ScopedCode::Program(program) => {
                self.block(&program.statements);
                if !self.open.is_empty() {
                    self.push(Action::Return(None), SourceId::default());
                }
                (program.completeness, None)
            }
            ScopedCode::Guard(guard) => {
                let decision = self.outermost(|this| this.condition(&guard.condition, false));
                let constant = decision.constant;
                for (value, exits) in [(true, decision.holds), (false, decision.fails)] {
                    self.open = exits;
                    let value = self.term(Term::Bool(value));
                    self.push(Action::Return(Some(value)), SourceId::default());
                }
                (guard.completeness, constant)
            }
        };
        self.finished(completeness, constant)
    }

    /// Without an initial value, a variable may keep what it had or be reset.
    fn initial_values(mut self, body: BodyId, values: &InitialValues) -> ProgramGraph<'db> {
        let first = if body == BodyId::CoreValues {
            0
        } else {
            self.scope.variables.len() + self.scope.handlers.len()
        };
        for (variable, index) in values.variables.iter().zip(first as u32..) {
            let to = self.register(VariableId { group: None, index });
            self.declared(variable, to);
        }
        self.push(Action::Return(None), SourceId::default());
        self.finished(values.completeness, None)
    }

    fn finished(self, completeness: Completeness, constant: Option<bool>) -> ProgramGraph<'db> {
        ProgramGraph {
            nodes: self.nodes.into(),
            start: self.start,
            terms: self.terms.into(),
            registers: self.registers.into(),
            constant,
            unreachable: self.unreachable,
            greatest_number: self.greatest_number,
            completeness,
        }
    }

    /// Adds a node after the open ones, and leaves it open.
    fn push(&mut self, action: Action<'db>, at: SourceId) {
        let exits = std::mem::take(&mut self.open);
        if exits.is_empty() {
            self.nodes.push(Node { action: Action::Nothing, at, next: self.nodes.len() as u32 + 1 });
        }
        let id = self.nodes.len() as u32;
        for (node, of_branch) in exits {
            if node == START {
                self.start = id;
            }
            let Some(node) = self.nodes.get_mut(node as usize) else { continue };
            match &mut node.action {
                Action::Branch { fails, .. } if of_branch => *fails = id,
                _ => node.next = id,
            }
        }
        if !matches!(action, Action::Return(_)) {
            self.open = vec![(id, false)];
        }
        self.nodes.push(Node { action, at, next: id });
    }

    fn term(&mut self, term: Term) -> u32 {
        self.terms.push(term);
        self.terms.len() as u32 - 1
    }

    fn kind(&self, term: u32) -> Term {
        self.terms.get(term as usize).copied().unwrap_or(Term::Missing)
    }

    fn register(&mut self, variable: VariableId) -> u32 {
        let next = self.registers.len() as u32;
        let number = *self.numbers.entry(variable).or_insert(next);
        if number == next {
            let depth = if variable.group.is_none() { 0 } else { self.depth };
            self.depth += u32::from(variable.group.is_some());
            self.registers.push(Register { variable: Some(variable), depth });
        }
        number
    }

    fn result(&mut self) -> u32 {
        self.registers.push(Register { variable: None, depth: self.depth });
        self.depth += 1;
        self.registers.len() as u32 - 1
    }

    /// Lowers a whole expression: a statement's, or a guard's. The registers of its results are free afterwards.
    fn outermost<T>(&mut self, lower: impl FnOnce(&mut Self) -> T) -> T {
        let depth = self.depth;
        self.number = 1;
        let found = lower(self);
        self.greatest_number = self.greatest_number.max(self.number);
        self.depth = depth;
        found
    }

    fn block(&mut self, statements: &[Statement]) {
        let depth = self.depth;
        let mut is_open = !self.open.is_empty();
        for statement in statements {
            if is_open && self.open.is_empty() {
                is_open = false;
                let id = statement.id();
                self.unreachable.extend(id.map(|id| (Unreachable::BehindReturn, id)));
            }
            self.statement(statement);
        }
        self.depth = depth;
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::If { condition, then, otherwise, .. } => {
                let decision = self.outermost(|this| this.condition(condition, false));
                let otherwise = otherwise.as_deref().unwrap_or_default();
                if let Some(value) = decision.constant {
                    let never = if value { otherwise } else { then };
                    let id = never.first().and_then(Statement::id);
                    self.unreachable.extend(id.map(|id| (Unreachable::Branch(value), id)));
                }
                let mut after = Vec::new();
                for (block, exits) in [(&**then, decision.holds), (otherwise, decision.fails)] {
                    self.open = exits;
                    self.block(block);
                    after.append(&mut self.open);
                }
                self.open = after;
            }
            Statement::Block(inner) => self.block(inner),
            Statement::Variable(variable) => {
                let to = self.register(self.inference.local(self.group, variable.name.id));
                self.declared(variable, to);
            }
            Statement::Assign(target, value) => {
                let value = self.outermost(|this| this.value(value));
                match self.variable(target.id) {
                    Some(to) => self.push(Action::Assign { to, value: Some(value) }, target.id),
                    // The name is unresolved, or that of a feature: an error.
                    None => self.push(Action::Nothing, target.id),
                }
            }
            Statement::Return(id, value) => {
                let value = value.as_ref().map(|value| self.outermost(|this| this.value(value)));
                self.push(Action::Return(value), *id);
            }
            Statement::Expr(value) => self.outermost(|this| {
                let unused = this.value(value);
                this.captured(unused, value.id().unwrap_or_default());
            }),
        }
    }

    fn declared(&mut self, variable: &Variable, to: u32) {
        let value = variable.value.as_ref().map(|value| self.outermost(|this| this.value(value)));
        self.push(Action::Assign { to, value }, variable.name.id);
    }

    /// Returns the register of the variable that a name refers to.
    fn variable(&mut self, name: SourceId) -> Option<u32> {
        match self.inference.binding(name)? {
            Binding::Variable(id) => Some(self.register(id)),
            Binding::Feature(_) => None,
        }
    }

    /// Both operands of `&&` and `||` are conditions; the right one is evaluated unless the left one decides.
    fn condition(&mut self, expr: &Expr, is_value: bool) -> Decision {
        match expr {
            Expr::Unary(UnaryOperator::Not, inner, _) => {
                let Decision { holds, fails, constant } = self.condition(inner, is_value);
                Decision { holds: fails, fails: holds, constant: constant.map(|it| !it) }
            }
            Expr::Binary(operator, ..) if is_logic(*operator) => {
                let (first, operands) = spine(expr, is_logic);
                let mut calls: Vec<bool> = operands.iter().map(|(_, right, _)| right.may_call()).collect();
                let is_value = |calls: &mut Vec<bool>| is_value && !calls.contains(&true);
                let mut left = self.condition(first, is_value(&mut calls));
                for (operator, right, _) in operands.into_iter().rev() {
                    calls.pop();
                    let deciding = operator == BinaryOperator::Or;
                    let left_constant = left.constant;
                    let (open, mut decided) =
                        if deciding { (left.fails, left.holds) } else { (left.holds, left.fails) };
                    self.open = open;
                    let mut right = self.condition(right, is_value(&mut calls));
                    if deciding { &mut right.holds } else { &mut right.fails }.append(&mut decided);
                    right.constant = match (left_constant, right.constant) {
                        (Some(one), Some(other)) => Some(if deciding { one || other } else { one && other }),
                        (one, other) => one.or(other).filter(|it| *it == deciding),
                    };
                    left = right;
                }
                left
            }
            _ => {
                let value = self.value(expr);
                if let Term::Bool(constant) = self.kind(value) {
                    let open = std::mem::take(&mut self.open);
                    let (holds, fails) = if constant { (open, Vec::new()) } else { (Vec::new(), open) };
                    return Decision { holds, fails, constant: Some(constant) };
                }
                let at = expr.id().unwrap_or_default();
                self.push(Action::Branch { condition: value, fails: 0, is_value }, at);
                let holds = std::mem::take(&mut self.open);
                let fails = holds.iter().map(|(node, _)| (*node, true)).collect();
                Decision { holds, fails, constant: None }
            }
        }
    }

    fn value(&mut self, expr: &Expr) -> u32 {
        match expr {
            Expr::Missing => self.term(Term::Missing),
            Expr::Incomplete(inner) => {
                let inner = self.value(inner);
                self.term(Term::Incomplete(inner))
            }
            Expr::Literal(literal, _) => {
                let term = of_literal(literal);
                if let Term::Int(number) = term {
                    self.number = self.number.saturating_mul(number.saturating_abs().max(1));
                }
                self.term(term)
            }
            Expr::Name(name) => {
                let term = match (self.inference.binding(name.id), self.variable(name.id)) {
                    (_, Some(register)) => Term::Register(register, name.id),
                    (Some(_), None) => Term::Feature,
                    (None, None) => Term::Missing,
                };
                self.term(term)
            }
            Expr::Call { callee, arguments, id } => self.call(callee, arguments, *id),
            Expr::Unary(operator, inner, _) => {
                let inner = self.value(inner);
                let constant = self.constant(inner).and_then(|it| it.unary(*operator).ok().flatten());
                self.constant_or(constant, Term::Unary(*operator, inner))
            }
            Expr::Binary(operator, _, _, at) if is_logic(*operator) => self.logic(expr, *at),
            Expr::Binary(..) => {
                let (first, operands) = spine(expr, |operator| !is_logic(operator));
                let mut left = self.value(first);
                for (operator, right, _) in operands.into_iter().rev() {
                    if right.may_call() {
                        left = self.captured(left, right.id().unwrap_or_default());
                    }
                    let right = self.value(right);
                    let constants = self.constant(left).zip(self.constant(right));
                    let constant =
                        constants.and_then(|(one, other)| one.binary(operator, &other).ok().flatten());
                    left = self.constant_or(constant, Term::Binary(operator, left, right));
                }
                left
            }
        }
    }

    /// Returns the value of a constant term. Floating-point numbers, which compilers may round differently, are not constant.
    fn constant(&self, term: u32) -> Option<Value> {
        match self.kind(term) {
            Term::Bool(value) => Some(Value::Bool(value)),
            Term::Int(value) => Some(Value::Int(value)),
            _ => None,
        }
    }

    fn constant_or(&mut self, constant: Option<Value>, term: Term) -> u32 {
        self.term(match constant {
            Some(Value::Bool(value)) => Term::Bool(value),
            Some(Value::Int(value)) => Term::Int(value),
            _ => term,
        })
    }

    /// Assigns the value of `&&` or `||` where its operands decide it.
    fn logic(&mut self, expr: &Expr, at: SourceId) -> u32 {
        let first = self.nodes.len() as u32;
        let decision = self.condition(expr, true);
        if let Some(constant) = decision.constant {
            self.open = [decision.holds, decision.fails].concat();
            return self.term(Term::Bool(constant));
        }
        let to = self.result();
        let exits = decision.holds.into_iter().map(|exit| (exit, true));
        let mut exits: Vec<_> = exits.chain(decision.fails.into_iter().map(|exit| (exit, false))).collect();
        exits.sort_unstable();
        let (mut after, mut evaluated, mut next) = (Vec::new(), None, first);
        for (exit, holds) in exits {
            // The operands so far.
            for node in (next..self.nodes.len() as u32).take_while(|node| *node <= exit.0) {
                if let Some(Node { action: Action::Branch { condition, .. }, .. }) =
                    self.nodes.get(node as usize)
                {
                    let condition = *condition;
                    evaluated = Some(match evaluated {
                        Some(before) => self.term(Term::Binary(BinaryOperator::And, before, condition)),
                        None => condition,
                    });
                }
            }
            next = next.max(exit.0.saturating_add(1));
            self.open = vec![exit];
            let by = evaluated.unwrap_or_else(|| self.term(Term::Missing));
            let value = self.term(Term::Decided(holds, by));
            self.push(Action::Assign { to, value: Some(value) }, at);
            after.append(&mut self.open);
        }
        self.open = after;
        self.term(Term::Register(to, at))
    }

    /// Keeps a value that a later call may change.
    fn captured(&mut self, term: u32, at: SourceId) -> u32 {
        let is_variable =
            |register: u32| self.registers.get(register as usize).is_some_and(|it| it.variable.is_some());
        if !registers(&self.terms, term).into_iter().any(|(it, _)| is_variable(it)) {
            return term;
        }
        let to = self.result();
        self.push(Action::Assign { to, value: Some(term) }, at);
        self.term(Term::Register(to, at))
    }

    fn call(&mut self, callee: &NameRef, arguments: &[Expr], at: SourceId) -> u32 {
        let found = self.inference.callee(callee.id);
        let count = arguments.len();
        let directions = match found {
            Some(found) => directions_of(self.db, self.scope, found, count),
            None => vec![UNKNOWN_DIRECTION; count],
        };
        let last_call = arguments.iter().rposition(Expr::may_call).unwrap_or_default();
        let mut lowered = Vec::with_capacity(count);
        for (index, (argument, direction)) in arguments.iter().zip(directions).enumerate() {
            let variable = argument.as_name().and_then(|name| self.variable(name.id));
            let mut value = self.value(argument);
            if index < last_call && direction == Direction::In {
                value = self.captured(value, argument.id().unwrap_or_default());
            }
            lowered.push(Argument { value, direction, variable });
        }
        let operand = match found {
            Some(Callee::Builtin(_)) => arguments.first().and_then(Expr::as_name).map(|it| it.name.clone()),
            _ => None,
        };
        let result = self.result();
        let (operand, arguments) = (operand.unwrap_or_default(), lowered.into());
        let call = Call { name: callee.id, callee: found, operand, arguments, result };
        self.push(Action::Call(Box::new(call)), at);
        self.term(Term::Register(result, at))
    }
}

fn of_literal(literal: &Literal) -> Term {
    match literal {
        Literal::Bool(value) => Term::Bool(*value),
        Literal::Int(text) => whole_number(text).map_or(Term::Other, Term::Int),
        Literal::PortStatus(PortStatus::NoData) | Literal::CallStatus(CallStatus::Failure) => Term::Status(0),
        Literal::PortStatus(PortStatus::OldData) | Literal::CallStatus(CallStatus::NotReady) => {
            Term::Status(1)
        }
        Literal::PortStatus(PortStatus::NewData) | Literal::CallStatus(CallStatus::Success) => {
            Term::Status(2)
        }
        Literal::Float(_) | Literal::String(_) => Term::Other,
    }
}
