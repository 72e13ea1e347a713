//! Expressions in C++ with MAUVE's order of evaluation: from left to right, and with short-circuiting `&&` and `||`.
//!
//! C++ leaves the order of most operands and arguments unspecified. Operands whose order is observable are computed
//! before, in the order of the model, and so is each call among the arguments of a codel:
//!
//! ```text
//! ramp(pursue(ahead, reach), step, velocity)
//!     → const auto pursue_result = MAUVE_TRACE_CODEL(getName(), "motion.pursue", ::motion::pursue(ahead, reach));
//!       MAUVE_TRACE_CODEL(getName(), "motion.ramp", ::motion::ramp(pursue_result, step, velocity))
//! ```

use mauve_hir::item_tree::{
    BinaryOperator, CallStatus, Direction, Expr, Literal, NameRef, PortStatus, SourceId, UnaryOperator,
};
use mauve_hir::{
    Binding, Builtin, Callee, FeatureOf, Integer, ProgramId, Type, Value, VariableId, VariableKind, codel,
};
use rustc_hash::{FxHashMap, FxHashSet};

use super::code::{CppCode, Precedence, is_narrow, is_same_in_cpp, is_unsigned, is_unsigned_64, usual};
use super::obvious::{are_obvious, comparison, is_obvious};
use super::{Class, ClassMember, LastCall};
use crate::cpp_name::{CppNames, as_identifier};
use crate::cpp_type::is_large;
use crate::trace::{codel_key, port_key};

/// A line of a program.
#[derive(Debug, Clone)]
pub(super) struct CodeLine {
    pub(super) depth: usize,
    pub(super) text: String,
    is_declaration: bool,
}

/// The side effects of an expression.
#[derive(Debug, Clone, Default)]
struct ExpressionEffects<'db> {
    calls: bool,
    /// Any variable of the core may change.
    all: bool,
    variables: FxHashSet<VariableId>,
    statuses: FxHashSet<FeatureOf<'db>>,
}

impl<'db> ExpressionEffects<'db> {
    fn add(&mut self, other: &ExpressionEffects<'db>) {
        self.calls |= other.calls;
        self.all |= other.all;
        self.variables.extend(&other.variables);
        self.statuses.extend(&other.statuses);
    }
}

/// What is declared in a block.
#[derive(Default)]
struct CodeBlock {
    names: Vec<String>,
    /// Names of values that never change.
    kept: FxHashSet<String>,
    /// Variables for the values of `&&` and `||`, which the next operator of the chain uses again.
    chained: FxHashMap<String, BinaryOperator>,
    /// The next number for each name of a temporary.
    numbers: FxHashMap<String, usize>,
}

/// The names that are declared in a block and in those around it.
#[derive(Default)]
pub(super) struct CodeScope<'c> {
    pub(super) names: CppNames<'c>,
    block: CodeBlock,
    /// The blocks around it, the innermost last.
    outer: Vec<CodeBlock>,
}

impl CodeScope<'_> {
    /// Declares a name: see [`CppNames::declare`].
    pub(super) fn declare(&mut self, name: &str) -> String {
        let name = self.names.declare(name);
        self.block.names.push(name.clone());
        name
    }

    /// Returns the blocks, the innermost first.
    fn blocks(&self) -> impl Iterator<Item = &CodeBlock> {
        std::iter::once(&self.block).chain(self.outer.iter().rev())
    }

    pub(super) fn begin_block(&mut self) {
        self.outer.push(std::mem::take(&mut self.block));
    }

    /// Forgets what was declared since the beginning of the block.
    pub(super) fn end_block(&mut self) {
        let block = std::mem::replace(&mut self.block, self.outer.pop().unwrap_or_default());
        block.names.iter().for_each(|name| self.names.free(name));
    }
}

pub(super) struct ExpressionWriter<'c, 'a, 'db> {
    pub(super) class: &'c Class<'a, 'db>,
    /// Includes the names of the enclosing blocks.
    pub(super) scope: CodeScope<'c>,
    pub(super) locals: FxHashMap<VariableId, String>,
    pub(super) lines: Vec<CodeLine>,
    pub(super) depth: usize,
    /// Whether names are those of properties of the shell.
    of_shell: bool,
}

impl<'c, 'a, 'db> ExpressionWriter<'c, 'a, 'db> {
    pub(super) fn new(class: &'c Class<'a, 'db>) -> ExpressionWriter<'c, 'a, 'db> {
        let scope = CodeScope { names: class.names.inner(), ..CodeScope::default() };
        let locals = FxHashMap::default();
        ExpressionWriter { class, scope, locals, lines: Vec::new(), depth: 1, of_shell: false }
    }

    pub(super) fn of_shell(class: &'c Class<'a, 'db>) -> ExpressionWriter<'c, 'a, 'db> {
        ExpressionWriter { of_shell: true, ..ExpressionWriter::new(class) }
    }

    pub(super) fn line(&mut self, text: impl Into<String>) {
        self.lines.push(CodeLine { depth: self.depth, text: text.into(), is_declaration: false });
    }

    /// Returns an expression where a value of type `ty` is expected, and writes the statements that it needs.
    pub(super) fn value(&mut self, expr: &'db Expr, ty: &Type) -> CppCode {
        self.expr(expr).converted(ty)
    }

    pub(super) fn expr(&mut self, expr: &'db Expr) -> CppCode {
        match expr {
            Expr::Missing => CppCode::unknown(),
            Expr::Incomplete(inner) => self.expr(inner),
            Expr::Literal(literal, _) => self.literal(literal),
            Expr::Name(name) => self.name(name),
            Expr::Unary(operator, inner, _) => self.unary(*operator, inner),
            Expr::Binary(operator @ (BinaryOperator::And | BinaryOperator::Or), lhs, rhs, _) => {
                self.logical(*operator, lhs, rhs)
            }
            Expr::Binary(operator, lhs, rhs, _) => {
                let mut operands = self.operands(&[lhs, rhs], false).into_iter();
                match (operands.next(), operands.next()) {
                    (Some(lhs), Some(rhs)) => self.binary(*operator, lhs, rhs),
                    _ => CppCode::unknown(),
                }
            }
            Expr::Call { callee, arguments, .. } => {
                self.call(callee, arguments).unwrap_or_else(CppCode::unknown)
            }
        }
    }

    /// Returns an expression, and the statements that it needs, one level deeper than the current block.
    pub(super) fn expr_apart(&mut self, expr: &'db Expr) -> (CppCode, Vec<CodeLine>) {
        let before = std::mem::take(&mut self.lines);
        self.depth += 1;
        let code = self.expr(expr);
        self.depth -= 1;
        (code, std::mem::replace(&mut self.lines, before))
    }

    fn literal(&self, literal: &Literal) -> CppCode {
        let (text, ty) = match literal {
            Literal::PortStatus(PortStatus::NoData) => ("RTT::NoData", Type::PortStatus),
            Literal::PortStatus(PortStatus::OldData) => ("RTT::OldData", Type::PortStatus),
            Literal::PortStatus(PortStatus::NewData) => ("RTT::NewData", Type::PortStatus),
            Literal::CallStatus(CallStatus::Failure) => ("RTT::SendFailure", Type::CallStatus),
            Literal::CallStatus(CallStatus::NotReady) => ("RTT::SendNotReady", Type::CallStatus),
            Literal::CallStatus(CallStatus::Success) => ("RTT::SendSuccess", Type::CallStatus),
            Literal::Int(_) | Literal::Float(_) | Literal::String(_) | Literal::Bool(_) => {
                let value = Value::of_literal(literal).ok().flatten().unwrap_or(Value::Bool(false));
                let ty = match &value {
                    Value::Bool(_) => Type::Bool,
                    Value::Int(_) => Type::INT,
                    Value::Double(_) => Type::Double,
                    Value::String(_) => Type::String,
                };
                return CppCode::literal(value, ty);
            }
        };
        CppCode { is_literal: true, ..CppCode::primary(text, ty) }
    }

    pub(super) fn variable(&self, id: SourceId) -> Option<VariableId> {
        self.class.inference.variable_at(id)
    }

    pub(super) fn variable_name(&self, id: VariableId) -> String {
        let name = self.locals.get(&id).or_else(|| self.class.variables.get(&id));
        name.cloned().unwrap_or_default()
    }

    fn name(&self, name: &NameRef) -> CppCode {
        if self.of_shell {
            let member = self.class.named_member(&name.name);
            return member.map_or_else(CppCode::unknown, |it| CppCode::primary(it.property(), it.ty.clone()));
        }
        match self.class.inference.binding(name.id) {
            Some(Binding::Variable(id)) => {
                CppCode::primary(self.variable_name(id), self.class.type_of_variable(id))
            }
            Some(Binding::Feature(feature)) => {
                let member = self.class.member(feature);
                member.map_or_else(CppCode::unknown, |it| CppCode::primary(&it.name, it.ty.clone()))
            }
            None => CppCode::unknown(),
        }
    }

    fn unary(&mut self, operator: UnaryOperator, inner: &'db Expr) -> CppCode {
        if let (UnaryOperator::Minus, Expr::Literal(Literal::Int(text), _)) = (operator, inner)
            && *text == "2147483648"
        {
            return CppCode::literal(Value::Int(i32::MIN), Type::INT);
        }
        let inner = self.expr(inner);
        let value = inner.value.as_ref().and_then(|value| value.unary(operator).ok().flatten());
        if let (UnaryOperator::Minus, Some(value), true) = (operator, &value, inner.is_literal)
            && inner.level == Precedence::Primary
        {
            return CppCode::literal(value.clone(), inner.ty);
        }
        let text = match operator {
            UnaryOperator::Not => format!("!{}", inner.at_least(Precedence::Unary)),
            // `--` is another operator.
            UnaryOperator::Minus => format!("-{}", inner.at_least(Precedence::Primary)),
        };
        let code = CppCode { value, ..CppCode::new(text, Precedence::Unary, inner.ty) };
        if is_narrow(&code.ty) { code.clone().cast(&code.ty) } else { code }
    }

    fn binary(&mut self, operator: BinaryOperator, lhs: CppCode, rhs: CppCode) -> CppCode {
        use BinaryOperator as Op;
        let value = constant(operator, &lhs, &rhs);
        let level = match operator {
            Op::Or => Precedence::Or,
            Op::And => Precedence::And,
            Op::Equal | Op::NotEqual => Precedence::Equality,
            Op::Less | Op::LessOrEqual | Op::Greater | Op::GreaterOrEqual => Precedence::Relation,
            Op::Add | Op::Subtract => Precedence::Sum,
            Op::Multiply | Op::Divide | Op::Remainder => Precedence::Product,
        };
        let is_comparison = matches!(level, Precedence::Equality | Precedence::Relation);
        if is_comparison {
            self.class.note(is_obvious(operator, &lhs, &rhs));
        }
        let compared = comparison(operator, &lhs, &rhs).filter(|_| is_comparison);
        if lhs.ty == Type::CallStatus && is_comparison {
            return self.compare_calls(operator, lhs, rhs);
        }
        if !lhs.ty.is_number() || !rhs.ty.is_number() {
            let both = lhs.is_literal && rhs.is_literal && lhs.ty == Type::String;
            let lhs = if both || operator == Op::Add { lhs.into_string() } else { lhs };
            let ty = if is_comparison { Type::Bool } else { lhs.ty.clone() };
            return CppCode { value, compared, ..joined(operator, level, &lhs, &rhs, ty) };
        }
        // A constant beside a variable that it fits is of that variable's type.
        let beside = |one: &CppCode, other: &CppCode| {
            let is_constant = one.value.is_some() && other.value.is_none() && !self.of_shell;
            let fits = is_constant && one.ty.fits(one.value.as_ref(), &other.ty);
            if fits { other.ty.clone() } else { one.ty.clone() }
        };
        let (left, right) = (beside(&lhs, &rhs), beside(&rhs, &lhs));
        let ty = left.binary(Op::Add, &right).unwrap_or(Type::Unknown);
        if is_comparison && is_unsigned_64(&ty) && is_unsigned(&left) != is_unsigned(&right) {
            return self.compare_unsigned(operator, lhs, rhs, &ty);
        }
        let in_type = |code: CppCode, ty: &Type| code.with_type(ty, is_same_in_cpp);
        let (mut lhs, mut rhs) = (in_type(lhs, &left), in_type(rhs, &right));
        // C++ has other ideas about some pairs of types.
        if !is_same_in_cpp(&usual(&lhs.ty, &rhs.ty), &usual(&ty, &ty)) {
            (lhs, rhs) = (in_type(lhs, &ty), in_type(rhs, &ty));
        }
        // As `int`, the product of two of them may be too great.
        if operator == Op::Multiply && ty == Type::Integer(Integer::Uint16) {
            let wide = Type::Integer(Integer::Uint32);
            (lhs, rhs) = (in_type(lhs, &wide), in_type(rhs, &wide));
        }
        if is_comparison {
            return CppCode { value, compared, ..joined(operator, level, &lhs, &rhs, Type::Bool) };
        }
        let code = CppCode { value, ..joined(operator, level, &lhs, &rhs, ty.clone()) };
        if is_narrow(&ty) { code.cast(&ty) } else { code }
    }

    /// Compares statuses of calls: RTT has two of calls that failed, and MAUVE has one.
    fn compare_calls(&mut self, operator: BinaryOperator, lhs: CppCode, rhs: CppCode) -> CppCode {
        let (lhs, rhs) = if lhs.is_literal { (rhs, lhs) } else { (lhs, rhs) };
        if rhs.is_literal && rhs.text == "RTT::SendFailure" && !lhs.is_literal {
            let sign = if operator == BinaryOperator::Equal { "<=" } else { ">" };
            let text = format!("{} {sign} {}", lhs.at_least(Precedence::Sum), rhs.text);
            return CppCode::new(text, Precedence::Relation, Type::Bool);
        }
        let failed = |code: CppCode| {
            if code.is_literal || rhs.is_literal {
                return code;
            }
            CppCode::primary(format!("std::max({}, RTT::SendFailure)", code.text), code.ty)
        };
        let (lhs, rhs) = (failed(lhs), failed(rhs.clone()));
        joined(operator, Precedence::Equality, &lhs, &rhs, Type::Bool)
    }

    /// A number below zero is less than any without a sign, which C++ denies.
    fn compare_unsigned(
        &mut self,
        operator: BinaryOperator,
        lhs: CppCode,
        rhs: CppCode,
        ty: &Type,
    ) -> CppCode {
        use BinaryOperator as Op;
        let is_left = !is_unsigned(&lhs.ty);
        // The signed operand occurs twice in the result.
        let is_name = |code: &CppCode| code.text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let lhs = if is_name(&lhs) && is_name(&rhs) { lhs } else { self.keep(lhs, "left") };
        let rhs = if is_name(&rhs) { rhs } else { self.keep(rhs, "right") };
        let signed = if is_left { lhs.text.clone() } else { rhs.text.clone() };
        let (lhs, rhs) = if is_left { (lhs.cast(ty), rhs) } else { (lhs, rhs.cast(ty)) };
        let compared = format!("{} {} {}", lhs.text, operator.text(), rhs.text);
        let (text, level) = match (operator, is_left) {
            (Op::Equal, _)
            | (Op::Greater | Op::GreaterOrEqual, true)
            | (Op::Less | Op::LessOrEqual, false) => {
                (format!("{signed} >= 0 && {compared}"), Precedence::And)
            }
            _ => (format!("{signed} < 0 || {compared}"), Precedence::Or),
        };
        CppCode::new(text, level, Type::Bool)
    }

    /// `&&` and `||`: the statements that the second operand needs are executed only where the first one does not decide.
    fn logical(&mut self, operator: BinaryOperator, lhs: &'db Expr, rhs: &'db Expr) -> CppCode {
        let is_and = operator == BinaryOperator::And;
        let (level, name) = if is_and { (Precedence::And, "both") } else { (Precedence::Or, "either") };
        let lhs = self.expr(lhs);
        let (right, inner) = self.expr_apart(rhs);
        if inner.iter().all(|line| line.is_declaration) {
            self.lines.extend(inner.into_iter().map(|line| CodeLine { depth: self.depth, ..line }));
            self.class.note(are_obvious(operator, &lhs, &right));
            let value = constant(operator, &lhs, &right);
            return CppCode { value, ..joined(operator, level, &lhs, &right, Type::Bool) };
        }
        let chained = self.scope.blocks().find_map(|block| block.chained.get(&lhs.text));
        let name = if chained == Some(&operator) {
            lhs.text
        } else {
            let name = self.temporary(name);
            self.line(format!("bool {name} = {};", lhs.text));
            self.scope.block.chained.insert(name.clone(), operator);
            name
        };
        self.line(format!("if ({}{name}) {{", if is_and { "" } else { "!" }));
        self.lines.extend(inner);
        self.depth += 1;
        self.line(format!("{name} = {};", right.text));
        self.depth -= 1;
        self.line("}");
        self.scope.block.kept.insert(name.clone());
        CppCode::primary(name, Type::Bool)
    }

    /// Returns operands or arguments, each evaluated after those before it. With `all_calls`, calls among them are computed
    /// before.
    fn operands(&mut self, all: &[&'db Expr], all_calls: bool) -> Vec<CppCode> {
        // From the last one back to the first, with the effects of those behind it.
        let mut later = ExpressionEffects::default();
        let mut kept = Vec::with_capacity(all.len());
        for (index, expr) in all.iter().enumerate().rev() {
            let own = self.effects(expr);
            let mut rest = all.iter().skip(index + 1);
            kept.push(match own.calls {
                true => all_calls || later.calls || rest.any(|expr| self.may_change(expr, &own)),
                false => later.calls && self.may_change(expr, &later),
            });
            later.add(&own);
        }
        let code = |(expr, kept): (&&'db Expr, bool)| {
            let code = self.expr(expr);
            if kept { self.keep(code, &base_of(expr)) } else { code }
        };
        all.iter().zip(kept.into_iter().rev()).map(code).collect()
    }

    /// Stores a value in a constant.
    fn keep(&mut self, code: CppCode, name: &str) -> CppCode {
        if code.is_literal || self.scope.blocks().any(|block| block.kept.contains(&code.text)) {
            return code;
        }
        let name = self.temporary(name);
        self.line(format!("const auto {name} = {};", code.at_least(Precedence::Or)));
        self.scope.block.kept.insert(name.clone());
        CppCode { text: name, level: Precedence::Primary, ..code }
    }

    /// Declares a new name: `name`, `name_2`, …
    fn temporary(&mut self, name: &str) -> String {
        // A number is appended before the name is checked: a reserved name with a number is valid.
        let name = as_identifier(name);
        let name = name.trim_end_matches('_');
        let next = self.scope.blocks().find_map(|block| block.numbers.get(name)).copied();
        let numbers = next.unwrap_or(1)..;
        for number in numbers {
            let wanted = if number == 1 { name.to_owned() } else { format!("{name}_{number}") };
            let found = self.scope.declare(&wanted);
            if found == wanted {
                self.scope.block.numbers.insert(name.to_owned(), number + 1);
                return found;
            }
        }
        self.scope.declare(name)
    }

    fn effects(&self, expr: &Expr) -> ExpressionEffects<'db> {
        let mut effects = ExpressionEffects::default();
        for expr in expr.descendants() {
            let Expr::Call { callee, arguments, .. } = expr else { continue };
            let found = self.class.inference.callee(callee.id);
            match found {
                Some(Callee::Builtin(Builtin::Status)) => continue,
                Some(Callee::Builtin(Builtin::Read)) => {
                    effects.statuses.extend(self.class.feature_in(arguments));
                }
                Some(Callee::Operation(_)) => effects.all = true,
                _ => {}
            }
            effects.calls = true;
            if let Some(callee) = found {
                effects.variables.extend(self.changed_arguments(callee, arguments));
            }
        }
        effects
    }

    /// Returns the variables that a call may change through its parameters.
    fn changed_arguments(&self, callee: Callee<'db>, arguments: &[Expr]) -> FxHashSet<VariableId> {
        let db = self.class.model.db;
        let directions = self.class.inference.directions(db, callee, arguments.len());
        let changed = arguments.iter().zip(directions).filter(|(_, it)| *it != Direction::In);
        changed.filter_map(|(argument, _)| self.variable(argument.id()?)).collect()
    }

    /// Returns whether these effects may change the value of an expression without calls.
    fn may_change(&self, expr: &Expr, effects: &ExpressionEffects<'db>) -> bool {
        let changes = |id: VariableId| effects.variables.contains(&id) || effects.all && self.is_shared(id);
        expr.descendants().any(|expr| match expr {
            // The argument of `status` is a port, no variable.
            Expr::Name(name) => self.variable(name.id).is_some_and(changes),
            Expr::Call { callee, arguments, .. } => {
                let mut port = self.class.feature_in(arguments).into_iter();
                self.class.inference.callee(callee.id) == Some(Callee::Builtin(Builtin::Status))
                    && (effects.all || port.any(|port| effects.statuses.contains(&port)))
            }
            _ => false,
        })
    }

    /// Returns whether operations of this component may change a variable. A parameter may refer to a variable of the core.
    fn is_shared(&self, id: VariableId) -> bool {
        use VariableKind::{Core, Machine, Parameter};
        let variable = self.class.inference.variable(id);
        variable.is_some_and(|it| {
            matches!(it.kind, Core | Machine | Parameter(Direction::Out | Direction::InOut))
        })
    }

    fn call(&mut self, callee: &NameRef, arguments: &'db [Expr]) -> Option<CppCode> {
        let class = self.class;
        let found = class.inference.callee(callee.id)?;
        match found {
            Callee::Codel(of) => {
                let data = codel(class.model.db, of)?;
                let parameters = class.model.parameters(of, &data.parameters);
                let arguments = self.arguments(found, &parameters, arguments);
                let function = class.model.libraries.qualified(of).unwrap_or_default();
                let call = format!("{function}({})", arguments.join(", "));
                let key = codel_key(class.model.db, of);
                let result = class.model.type_of(of, data.result.as_ref());
                Some(CppCode::primary(format!("MAUVE_TRACE_CODEL(getName(), {key}, {call})"), result))
            }
            Callee::Operation(index) => {
                let name = class.data.operations.get(index)?.name.name.clone();
                let routine = class.program(&ProgramId::Operation(name))?;
                let parameters = class.model.parameters(class.core, routine.parameters);
                let arguments = self.arguments(found, &parameters, arguments);
                let text = format!("{}({})", routine.function, arguments.join(", "));
                Some(CppCode::primary(text, routine.result.clone()))
            }
            Callee::Builtin(function @ (Builtin::Read | Builtin::Write | Builtin::Status)) => {
                self.port(function, arguments)
            }
            // It is a statement, or the value of one.
            Callee::Builtin(Builtin::Send) => None,
            Callee::Builtin(Builtin::Collect) => self.collect(arguments),
        }
    }

    /// Returns the arguments of a codel, or of an operation of this component.
    fn arguments(
        &mut self,
        callee: Callee<'db>,
        parameters: &[(Direction, Type)],
        arguments: &'db [Expr],
    ) -> Vec<String> {
        let is_input = |(_, (direction, _)): &(&Expr, &(Direction, Type))| *direction == Direction::In;
        let inputs: Vec<&'db Expr> =
            arguments.iter().zip(parameters).filter(is_input).map(|(argument, _)| argument).collect();
        let mut effects =
            ExpressionEffects { all: matches!(callee, Callee::Operation(_)), ..ExpressionEffects::default() };
        effects.variables = self.changed_arguments(callee, arguments);
        let mut values = self.operands(&inputs, true).into_iter();
        let mut found = Vec::new();
        for (argument, (direction, ty)) in arguments.iter().zip(parameters) {
            if *direction != Direction::In {
                found.push(self.expr(argument).text);
                continue;
            }
            let Some(value) = values.next() else { continue };
            // In C++, such an argument is a reference. The call must not see its own changes of the variable.
            let is_copied =
                is_large(ty) && matches!(argument, Expr::Name(_)) && self.may_change(argument, &effects);
            let value = if is_copied { self.keep(value, &base_of(argument)) } else { value };
            found.push(value.converted(ty).text);
        }
        found
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, arguments: &'db [Expr]) -> Option<CppCode> {
        let class = self.class;
        let port = class.member_in(arguments)?;
        Some(match (function, arguments.get(1)) {
            (Builtin::Write, Some(value)) => {
                let value = self.value(value, &port.ty);
                let key = port_key(class.model.db, class.component, &port.data.name.name);
                let write = format!("MAUVE_TRACE_WRITE(getName(), {key}, {}, {})", port.name, value.text);
                CppCode::primary(write, Type::Void)
            }
            (Builtin::Read, Some(variable)) => {
                let key = port_key(class.model.db, class.component, &port.data.name.name);
                let variable = self.expr(variable).text;
                let read = format!("MAUVE_TRACE_READ(getName(), {key}, {}, {variable})", port.name);
                match &port.status {
                    Some(status) => {
                        CppCode::new(format!("{status} = {read}"), Precedence::Assignment, Type::PortStatus)
                    }
                    None => CppCode::primary(read, Type::PortStatus),
                }
            }
            _ => CppCode::primary(port.status.clone().unwrap_or_default(), Type::PortStatus),
        })
    }

    /// `handler = send(operation, in and inout arguments…);`, or without a handler.
    pub(super) fn send(&mut self, handler: Option<VariableId>, arguments: &'db [Expr]) {
        let class = self.class;
        let Some(operation) = class.member_in(arguments) else { return };
        let sent = class.sent_by(handler, operation);
        let last = sent.and_then(|sent| sent.last_call.as_ref());
        let given: Vec<&'db Expr> = arguments.iter().skip(1).collect();
        // Arguments are evaluated even if no call is sent.
        let mut given = self.operands(&given, last.is_some()).into_iter();
        if let Some(last) = last {
            self.line(format!("if (!{}()) {{", last.is_under_way));
            self.depth += 1;
        }
        let mut texts = vec![operation.name.clone()];
        for (number, (direction, ty)) in operation.parameters.iter().enumerate() {
            let value = if *direction == Direction::Out { None } else { given.next() };
            let value = value.map(|value| value.converted(ty));
            if *direction == Direction::In {
                let value = value.map(|it| if it.ty == Type::String { it.into_string() } else { it });
                texts.extend(value.map(|value| value.text));
                continue;
            }
            let mut slots = sent.into_iter().flat_map(|sent| &sent.slots);
            let Some((_, _, slot)) = slots.find(|(parameter, ..)| *parameter == number) else { continue };
            if let Some(value) = value {
                self.line(format!("{slot} = {};", value.text));
            }
            texts.push(slot.clone());
        }
        let handles = last.map(|last| last.handle.clone()).into_iter();
        let handles = handles.chain(handler.map(|handler| self.variable_name(handler)));
        let targets: String = handles.map(|name| format!("{name} = ")).collect();
        self.line(format!("{targets}mauve_send({});", texts.join(", ")));
        if last.is_some() {
            self.depth -= 1;
            self.line("}");
        }
    }

    /// Returns the body of the function that checks whether a call is running.
    pub(super) fn ask_for_last_call(
        mut self,
        call: &LastCall,
        operation: &ClassMember<'db>,
    ) -> Vec<CodeLine> {
        let mut given = vec![call.handle.clone()];
        given.extend(self.dropped_results(operation));
        self.line(format!("return mauve_collect({}) == RTT::SendNotReady;", given.join(", ")));
        self.lines
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, arguments: &'db [Expr]) -> Option<CppCode> {
        let (handler, results) = arguments.split_first()?;
        let handler = self.variable(handler.id()?)?;
        let mut texts = vec![self.variable_name(handler)];
        if results.is_empty() {
            let operation = self.class.member_of_handle(&self.class.type_of_variable(handler));
            texts.extend(operation.into_iter().flat_map(|it| self.dropped_results(it)));
        }
        texts.extend(results.iter().map(|result| self.expr(result).text));
        Some(CppCode::primary(format!("mauve_collect({})", texts.join(", ")), Type::CallStatus))
    }

    /// Declares variables for results of a call that no program uses.
    fn dropped_results(&mut self, member: &ClassMember<'db>) -> Vec<String> {
        let result = (member.ty != Type::Void).then_some(&member.ty);
        let back = member.parameters.iter().filter(|(direction, _)| *direction != Direction::In);
        let types = result.into_iter().chain(back.map(|(_, ty)| ty));
        let declare = |ty: &Type| {
            let name = self.temporary("dropped");
            let text = format!("{} {name}{{}};", self.class.cpp(ty));
            self.lines.push(CodeLine { depth: self.depth, text, is_declaration: true });
            name
        };
        types.map(declare).collect()
    }
}

/// Returns the value of an operation on two constants.
fn constant(operator: BinaryOperator, lhs: &CppCode, rhs: &CppCode) -> Option<Value> {
    lhs.value.as_ref()?.binary(operator, rhs.value.as_ref()?).ok().flatten()
}

/// Returns a name for the value of an expression.
fn base_of(expr: &Expr) -> String {
    match expr {
        Expr::Call { callee, .. } => format!("{}_result", callee.name),
        Expr::Name(name) => format!("{}_before", name.name),
        _ => "value".to_owned(),
    }
}

/// Joins two operands, with the parentheses that they need, and those that compilers ask for.
fn joined(operator: BinaryOperator, level: Precedence, lhs: &CppCode, rhs: &CppCode, ty: Type) -> CppCode {
    let (left, right) = match level {
        // Compilers warn of `a && b || c`, `a == b == c`, `a < b == c` and `!a == b`.
        Precedence::Or => (Precedence::Or, Precedence::Equality),
        Precedence::And => (Precedence::And, Precedence::Equality),
        Precedence::Equality | Precedence::Relation => (Precedence::Sum, Precedence::Sum),
        Precedence::Sum => (Precedence::Sum, Precedence::Product),
        _ => (Precedence::Product, Precedence::Unary),
    };
    let side = |code: &CppCode, least: Precedence| {
        let hides = level == Precedence::Or && code.level == Precedence::And;
        let negated = level == Precedence::Equality && code.text.starts_with('!');
        if hides || negated { format!("({})", code.text) } else { code.at_least(least) }
    };
    CppCode::new(format!("{} {} {}", side(lhs, left), operator.text(), side(rhs, right)), level, ty)
}
