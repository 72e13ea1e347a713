//! Which variables of a core are followed: those that a condition depends on, and that programs set to known values.
//!
//! ```text
//! if count == 0 { plan(); count = 9; } else { count = count - 1; }     count is followed
//! ready = measure(); if ready { … }                                    ready is not: a codel may return anything
//! ```

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{Body, BodyId, Code, bodies_of, by_group, core_scope, statements};
use crate::graph::closure;
use crate::infer::{Inference, VariableOf, directions_of, inference_of, shared_variables};
use crate::item_tree::{BinaryOperator, Direction, Expr, Literal, Statement, UnaryOperator, is_logic, spine};
use crate::project::Project;
use crate::resolve::{Binding, Callee, VariableId};
use crate::source::Decl;
use crate::structure::structure_of;
use crate::types::Type;
use crate::values::whole_number;

/// The variables that are followed.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Followed {
    pub(super) variables: Vec<VariableId>,
    /// Those that operations assign, which clients may call between two jobs.
    pub(super) by_operations: Vec<VariableId>,
    /// Numbers that are farther from 0 count as any value, so that a counter without a limit has few others.
    pub(super) farthest: i32,
}

/// How the programs of a group of bodies use variables of few values.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Uses {
    /// The variables of each comparison or other operand of a condition, whose value may be known if all of them are.
    deciding: Vec<Vec<VariableId>>,
    /// The target and the source of an assignment: the value of the first one depends on the second one.
    sources: Vec<(VariableId, VariableId)>,
    /// Those that programs assign, and whether the value may be known.
    assigned: Vec<(VariableId, bool)>,
    by_operations: Vec<VariableId>,
    /// The greatest of [`greatest_number`] of their expressions.
    greatest: i32,
}

/// Returns whether a variable of this type is one of few values.
pub(super) fn is_small(ty: &Type) -> bool {
    matches!(ty, Type::Bool | Type::PortStatus | Type::CallStatus) || *ty == Type::INT
}

/// Returns the followed variables of a core. An edit of a program computes the uses of its group, and seldom changes the result.
#[salsa::tracked(returns(ref))]
pub(super) fn followed_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Followed {
    let in_group = |group| uses_in_group(db, project, of, group);
    let all = by_group(db, of, || uses_in(db, project, of, 0), in_group);
    let mut sources: FxHashMap<VariableId, Vec<VariableId>> = FxHashMap::default();
    for &(target, source) in all.iter().flat_map(|uses| &uses.sources) {
        sources.entry(target).or_default().push(source);
    }
    let assigned = || all.iter().flat_map(|uses| &uses.assigned);
    let mut variables: FxHashSet<VariableId> =
        assigned().filter(|(_, is_known)| *is_known).map(|(variable, _)| *variable).collect();
    // A variable that no program assigns keeps its initial value.
    let is_assigned: FxHashSet<VariableId> = assigned().map(|(variable, _)| *variable).collect();
    let declared = || structure_of(db, of).into_iter().flat_map(|it| it.shared_variables());
    let initial: FxHashSet<_> =
        declared().filter(|it| it.value.is_some() && !it.calls_in_value()).map(|it| it.name.id).collect();
    for (variable, it) in shared(shared_variables(db, project, of)) {
        if initial.contains(&it.name.id) && !is_assigned.contains(&variable) {
            variables.insert(variable);
        }
    }
    // A condition with a variable that is never known decides nothing: a counter up to it would only have many values.
    let deciding = all.iter().flat_map(|uses| &uses.deciding);
    let deciding = deciding.filter(|it| it.iter().all(|it| variables.contains(it))).flatten().copied();
    let deciding = closure(deciding, |it| sources.get(&it).into_iter().flatten().copied());
    let deciding: FxHashSet<VariableId> = deciding.into_iter().collect();
    let mut variables: Vec<VariableId> = variables.intersection(&deciding).copied().collect();
    if variables.is_empty() {
        return Followed::default();
    }
    variables.sort_unstable();
    let mut by_operations: Vec<VariableId> =
        all.iter().flat_map(|uses| &uses.by_operations).copied().collect();
    by_operations.sort_unstable();
    by_operations.dedup();
    let initial = declared().filter_map(|it| it.value.as_ref()).map(greatest_number);
    let greatest = all.iter().map(|uses| uses.greatest).chain(initial).max().unwrap_or_default();
    Followed { variables, by_operations, farthest: greatest.saturating_mul(2).saturating_add(4) }
}

/// Returns the shared variables with their identities.
pub(super) fn shared(all: &[VariableOf]) -> impl Iterator<Item = (VariableId, &VariableOf)> {
    (0..).zip(all).map(|(index, it)| (VariableId { group: None, index }, it))
}

#[salsa::tracked(returns(ref))]
fn uses_in_group<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> Uses {
    uses_in(db, project, of, group)
}

fn uses_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, group: u32) -> Uses {
    let Some(scope) = core_scope(db, of) else { return Uses::default() };
    let inference = inference_of(db, project, of, group);
    let shared = shared_variables(db, project, of);
    let mut reader = Reader { inference, shared, group, found: Uses::default() };
    for (id, body) in bodies_of(db, of, scope, group).iter() {
        let first = reader.found.assigned.len();
        for (_, code) in body.code() {
            reader.code(code, matches!(body, Body::Operation(_)));
            for expression in expressions(code) {
                reader.found.greatest = reader.found.greatest.max(greatest_number(expression));
                for call in expression.descendants() {
                    reader.call(call, &|callee, count| directions_of(db, scope, callee, count));
                }
            }
        }
        if matches!(id, BodyId::Operation(_)) {
            let of_operation = reader.found.assigned.iter().skip(first).map(|(variable, _)| *variable);
            reader.found.by_operations.extend(of_operation.filter(|it| it.group.is_none()));
        }
    }
    let Uses { deciding, sources, assigned, .. } = &mut reader.found;
    deciding.sort_unstable();
    deciding.dedup();
    sources.sort_unstable();
    sources.dedup();
    assigned.sort_unstable();
    assigned.dedup();
    reader.found
}

/// Returns the outermost expressions of a program or guard.
fn expressions(code: Code<'_>) -> impl Iterator<Item = &Expr> {
    let (program, guard) = match code {
        Code::Program(program) => (program.statements.as_slice(), None),
        Code::Guard(guard) => (&[][..], Some(&guard.condition)),
    };
    statements(program).filter_map(Statement::expression).chain(guard)
}

/// Returns the product of the literals of an expression, without those that are 0: `60 * 10` is 600.
fn greatest_number(expression: &Expr) -> i32 {
    let numbers = expression.descendants().filter_map(|it| match it {
        Expr::Literal(Literal::Int(text), _) => whole_number(text),
        _ => None,
    });
    numbers.fold(1, |product, number| product.saturating_mul(number.saturating_abs().max(1)))
}

struct Reader<'a, 'db> {
    inference: &'a Inference<'db>,
    shared: &'a [VariableOf],
    group: u32,
    found: Uses,
}

impl<'db> Reader<'_, 'db> {
    fn code(&mut self, code: Code<'_>, is_operation: bool) {
        let program = match code {
            Code::Guard(guard) => return self.decides(&guard.condition),
            Code::Program(program) => program,
        };
        for statement in statements(&program.statements) {
            match statement {
                Statement::If { condition, .. } => self.decides(condition),
                Statement::Return(_, Some(value)) if is_operation => self.passes(value),
                Statement::Assign(target, value) => {
                    let target = self.inference.binding(target.id);
                    self.assign(target.and_then(|it| self.small(it)), value);
                }
                Statement::Variable(variable) => {
                    let index = self.inference.variables.partition_point(|it| it.name.id < variable.name.id);
                    let id = VariableId { group: Some(self.group), index: index as u32 };
                    if let Some(value) = &variable.value {
                        self.assign(self.small(Binding::Variable(id)), value);
                    }
                }
                Statement::Return(..) | Statement::Expr(_) | Statement::Block(_) => {}
            }
        }
    }

    /// Returns the variable of a binding, if it has few values.
    fn small(&self, binding: Binding<'db>) -> Option<VariableId> {
        let Binding::Variable(id) = binding else { return None };
        let all = if id.group.is_none() { self.shared } else { &self.inference.variables };
        all.get(id.index as usize).is_some_and(|it| is_small(&it.ty)).then_some(id)
    }

    fn name(&self, expr: &Expr) -> Option<VariableId> {
        let Expr::Name(name) = expr else { return None };
        self.inference.binding(name.id).and_then(|it| self.small(it))
    }

    /// Notes the variables of each operand of a condition whose value may be known.
    fn decides(&mut self, condition: &Expr) {
        match condition {
            Expr::Unary(UnaryOperator::Not, inner, _) => self.decides(inner),
            Expr::Binary(BinaryOperator::And | BinaryOperator::Or, ..) => {
                let (first, operands) = spine(condition, is_logic);
                self.decides(first);
                operands.into_iter().for_each(|(_, operand, _)| self.decides(operand));
            }
            _ if self.may_be_known(condition) => {
                let variables = condition.descendants().filter_map(|it| self.name(it)).collect();
                self.found.deciding.push(variables);
            }
            _ => {}
        }
    }

    /// Notes the variables of a value that an operation gets or returns: its caller, or its own conditions, may depend on each.
    fn passes(&mut self, value: &Expr) {
        let variables = value.descendants().filter_map(|it| Some(vec![self.name(it)?])).collect::<Vec<_>>();
        self.found.deciding.extend(variables);
    }

    /// Whether the value of an expression is known if those of its variables are.
    fn may_be_known(&self, value: &Expr) -> bool {
        value.descendants().all(|it| match it {
            Expr::Name(_) => self.name(it).is_some(),
            Expr::Call { callee, .. } => {
                matches!(self.inference.callee(callee.id), Some(Callee::Operation(_)))
            }
            it => !matches!(it, Expr::Missing | Expr::Incomplete(_)),
        })
    }

    fn assign(&mut self, target: Option<VariableId>, value: &Expr) {
        let Some(target) = target else { return };
        let sources = value.descendants().filter_map(|it| self.name(it)).map(|source| (target, source));
        self.found.sources.extend(sources.collect::<Vec<_>>());
        let is_known = self.may_be_known(value);
        self.found.assigned.push((target, is_known));
    }

    /// Notes what a call assigns, and the conditions in an expression that decide about a call.
    fn call(&mut self, expr: &Expr, directions: &dyn Fn(Callee<'db>, usize) -> Vec<Direction>) {
        match expr {
            Expr::Binary(BinaryOperator::And | BinaryOperator::Or, left, right, _) if right.may_call() => {
                self.decides(left);
            }
            Expr::Call { callee, arguments, .. } => {
                let Some(callee) = self.inference.callee(callee.id) else { return };
                let is_own = matches!(callee, Callee::Operation(_));
                for (argument, direction) in arguments.iter().zip(directions(callee, arguments.len())) {
                    if direction != Direction::In
                        && let Some(target) = self.name(argument)
                    {
                        // An operation may assign a known value.
                        self.found.assigned.push((target, is_own));
                    }
                    if is_own {
                        self.passes(argument);
                    }
                }
            }
            _ => {}
        }
    }
}
