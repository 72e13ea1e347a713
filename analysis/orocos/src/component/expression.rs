//! Expressions in C++, evaluated as MAUVE says: from left to right, and no further than `&&` and `||` need.
//!
//! C++ leaves the order of most operands and arguments open. What could tell is computed before, in the order of the model,
//! and a call among the arguments of a codel always is:
//!
//! ```text
//! ramp(pursue(ahead, reach), step, velocity)
//!     → const auto pursue_result = MAUVE_TRACE_CODEL(getName(), "motion.pursue", ::motion::pursue(ahead, reach));
//!       MAUVE_TRACE_CODEL(getName(), "motion.ramp", ::motion::ramp(pursue_result, step, velocity))
//! ```

use mauve_hir::item_tree::{
    BinaryOperator, CallStatus, Direction, Expr, Literal, NameRef, PortStatus, SourceId, TypeRef,
    UnaryOperator,
};
use mauve_hir::{
    Binding, Builtin, Callee, Decl, Integer, ProgramId, Type, Value, VariableId, VariableKind, codel, type_of,
};
use rustc_hash::{FxHashMap, FxHashSet};

use super::obvious::{Comparison, are_obvious, comparison, is_obvious};
use super::{Class, LastCall, Member};
use crate::cpp_name::{CppNames, as_identifier};
use crate::escape::cpp_string;

/// How tight an expression binds, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Assignment,
    Or,
    And,
    Equality,
    Relation,
    Sum,
    Product,
    Unary,
    Primary,
}

/// An expression in C++.
#[derive(Debug, Clone)]
pub(super) struct Code {
    pub(super) text: String,
    pub(super) level: Level,
    /// What it gives, here and there.
    pub(super) ty: Type,
    /// What it is, where that is known beforehand.
    pub(super) value: Option<Value>,
    /// Is it nothing but a literal, perhaps with a sign?
    is_literal: bool,
    /// Of a comparison with what is known beforehand: what is compared, how, and with what.
    pub(super) compared: Option<Comparison>,
}

impl Code {
    fn new(text: impl Into<String>, level: Level, ty: Type) -> Code {
        Code { text: text.into(), level, ty, value: None, is_literal: false, compared: None }
    }

    fn primary(text: impl Into<String>, ty: Type) -> Code {
        Code::new(text, Level::Primary, ty)
    }

    fn literal(value: Value, ty: Type) -> Code {
        let text = literal_text(&value, &ty);
        let level = if text.starts_with('-') { Level::Unary } else { Level::Primary };
        Code { text, level, ty, value: Some(value), is_literal: true, compared: None }
    }

    /// In parentheses, unless it binds at least as tight.
    fn at_least(&self, level: Level) -> String {
        if self.level < level { format!("({})", self.text) } else { self.text.clone() }
    }

    /// As a `std::string`: two literals are joined and compared as arrays otherwise.
    fn into_string(self) -> Code {
        if self.is_literal { Code::primary(format!("std::string({})", self.text), self.ty) } else { self }
    }

    /// Is it known beforehand?
    pub(super) fn is_constant(&self) -> bool {
        self.value.is_some()
    }

    /// The whole number that it is, where that is known.
    pub(super) fn whole(&self) -> Option<i128> {
        match self.value {
            Some(Value::Int(value)) => Some(value.into()),
            _ => None,
        }
    }

    /// As an operand of a comparison.
    pub(super) fn operand(&self) -> String {
        self.at_least(Level::Sum)
    }

    /// As a value of another type, which it fits.
    pub(super) fn converted(self, to: &Type) -> Code {
        if self.ty == *to || !self.ty.is_number() || !to.is_number() {
            return self;
        }
        match self.value.clone().filter(|_| self.is_literal) {
            Some(value) => Code::literal(value, to.clone()),
            None if loses_nothing(&self.ty, to) => Code { ty: to.clone(), ..self },
            None => self.cast(to),
        }
    }

    fn cast(self, to: &Type) -> Code {
        let text = format!("static_cast<{}>({})", number_type(to), self.text);
        Code { value: self.value, ..Code::primary(text, to.clone()) }
    }
}

/// Does C++ turn each value of the one type into the same one of the other?
fn loses_nothing(from: &Type, to: &Type) -> bool {
    match (from, to) {
        (Type::Integer(Integer::Int64 | Integer::Uint64 | Integer::Long | Integer::Size), Type::Double) => {
            false
        }
        (Type::Integer(_) | Type::Float, Type::Double) => true,
        (Type::Integer(from), Type::Integer(to)) => to.has_all_of(*from),
        _ => from == to,
    }
}

fn number_type(ty: &Type) -> &'static str {
    match ty {
        Type::Double => "double",
        Type::Float => "float",
        Type::Integer(integer) => crate::cpp_type::integer_type(*integer),
        _ => "bool",
    }
}

/// Narrower than `int`: C++ calculates with them as `int`.
fn is_narrow(ty: &Type) -> bool {
    use Integer::{Char, Int8, Short, Uint8, Uint16};
    matches!(ty, Type::Integer(Char | Int8 | Short | Uint8 | Uint16))
}

fn is_unsigned_64(ty: &Type) -> bool {
    matches!(ty, Type::Integer(Integer::Uint64 | Integer::Size))
}

fn is_unsigned(ty: &Type) -> bool {
    matches!(ty, Type::Integer(Integer::Uint8 | Integer::Uint16 | Integer::Uint32)) || is_unsigned_64(ty)
}

/// The type in which C++ itself would calculate with these two.
fn usual(one: &Type, other: &Type) -> Type {
    let promoted = |ty: &Type| if is_narrow(ty) { Type::INT } else { ty.clone() };
    let (one, other) = (promoted(one), promoted(other));
    let rank = |ty: &Type| match ty {
        Type::Double => 6,
        Type::Float => 5,
        Type::Integer(Integer::Uint64 | Integer::Size) => 4,
        Type::Integer(Integer::Int64 | Integer::Long) => 3,
        Type::Integer(Integer::Uint32) => 2,
        _ => 1,
    };
    if rank(&one) >= rank(&other) { one } else { other }
}

/// Are both the same to C++?
fn is_same_in_cpp(one: &Type, other: &Type) -> bool {
    let kind = |ty: &Type| match ty {
        Type::Integer(Integer::Long) => Type::Integer(Integer::Int64),
        Type::Integer(Integer::Size) => Type::Integer(Integer::Uint64),
        ty => ty.clone(),
    };
    kind(one) == kind(other)
}

/// A value of a model as a literal of that type.
pub(super) fn literal_text(value: &Value, ty: &Type) -> String {
    let decimal = |value: f64| match ty {
        Type::Float if (value as f32).is_infinite() => {
            format!("{}std::numeric_limits<float>::infinity()", if value < 0.0 { "-" } else { "" })
        }
        Type::Float => format!("{:?}f", value as f32),
        _ => format!("{value:?}"),
    };
    match value {
        Value::Bool(value) => value.to_string(),
        Value::String(text) if text.contains('\0') => {
            format!("std::string({}, {})", cpp_string(text), text.len())
        }
        Value::String(text) => cpp_string(text),
        Value::Double(value) => decimal(*value),
        Value::Int(value) if matches!(ty, Type::Double | Type::Float) => decimal(f64::from(*value)),
        // Its digits alone are no `int`.
        Value::Int(i32::MIN) => "std::numeric_limits<int>::min()".to_owned(),
        Value::Int(value) if matches!(ty, Type::Integer(Integer::Uint32)) || is_unsigned_64(ty) => {
            format!("{value}u")
        }
        Value::Int(value) => value.to_string(),
    }
}

/// A line of a program, and how deep it stands.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) depth: usize,
    pub(super) text: String,
    /// Does it only make place for something?
    is_place: bool,
}

impl Line {
    pub(super) fn new(depth: usize, text: impl Into<String>) -> Line {
        Line { depth, text: text.into(), is_place: false }
    }
}

/// What an expression may do beside giving a value.
#[derive(Debug, Clone, Default)]
struct Effects<'db> {
    calls: bool,
    /// Any variable of the core may change.
    all: bool,
    variables: Vec<VariableId>,
    statuses: Vec<(Decl<'db>, usize)>,
}

impl<'db> Effects<'db> {
    fn add(&mut self, other: &Effects<'db>) {
        self.calls |= other.calls;
        self.all |= other.all;
        self.variables.extend(&other.variables);
        self.statuses.extend(&other.statuses);
    }
}

/// What is declared in a block.
#[derive(Clone, Default)]
pub(super) struct Scope {
    pub(super) names: CppNames,
    /// Names of values that never change.
    kept: FxHashSet<String>,
    /// Variables for the values of `&&` and `||`, which the next operator of the chain goes on with.
    chained: FxHashMap<String, BinaryOperator>,
    /// For each name of a temporary, what the next one ends with.
    numbers: FxHashMap<String, usize>,
}

/// Writes a program.
pub(super) struct Writer<'c, 'a, 'db> {
    pub(super) class: &'c Class<'a, 'db>,
    /// What is declared in the block that is being written, and in those around it.
    pub(super) scope: Scope,
    /// Local variables and parameters.
    pub(super) locals: FxHashMap<VariableId, String>,
    pub(super) lines: Vec<Line>,
    pub(super) depth: usize,
    /// Does it write values of a shell, which name its properties?
    of_shell: bool,
}

impl<'c, 'a, 'db> Writer<'c, 'a, 'db> {
    pub(super) fn new(class: &'c Class<'a, 'db>) -> Writer<'c, 'a, 'db> {
        let scope = Scope { names: class.names.clone(), ..Scope::default() };
        let locals = FxHashMap::default();
        Writer { class, scope, locals, lines: Vec::new(), depth: 1, of_shell: false }
    }

    /// For what stands in a shell.
    pub(super) fn of_shell(class: &'c Class<'a, 'db>) -> Writer<'c, 'a, 'db> {
        Writer { of_shell: true, ..Writer::new(class) }
    }

    pub(super) fn line(&mut self, text: impl Into<String>) {
        self.lines.push(Line::new(self.depth, text));
    }

    /// An expression, as it stands in `ty`'s place. What has to be computed before is written.
    pub(super) fn value(&mut self, expr: &'db Expr, ty: &Type) -> Code {
        self.expr(expr).converted(ty)
    }

    pub(super) fn expr(&mut self, expr: &'db Expr) -> Code {
        match expr {
            Expr::Missing => Code::primary("{}", Type::Unknown),
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
                    _ => Code::primary("{}", Type::Unknown),
                }
            }
            Expr::Call { callee, arguments, .. } => self.call(callee, arguments),
        }
    }

    fn literal(&self, literal: &Literal) -> Code {
        let status = match literal {
            Literal::PortStatus(PortStatus::NoData) => Some(("RTT::NoData", Type::PortStatus)),
            Literal::PortStatus(PortStatus::OldData) => Some(("RTT::OldData", Type::PortStatus)),
            Literal::PortStatus(PortStatus::NewData) => Some(("RTT::NewData", Type::PortStatus)),
            Literal::CallStatus(CallStatus::Failure) => Some(("RTT::SendFailure", Type::CallStatus)),
            Literal::CallStatus(CallStatus::NotReady) => Some(("RTT::SendNotReady", Type::CallStatus)),
            Literal::CallStatus(CallStatus::Success) => Some(("RTT::SendSuccess", Type::CallStatus)),
            Literal::Int(_) | Literal::Float(_) | Literal::String(_) | Literal::Bool(_) => None,
        };
        if let Some((text, ty)) = status {
            return Code { is_literal: true, ..Code::primary(text, ty) };
        }
        let value = Value::of_literal(literal).ok().flatten().unwrap_or(Value::Bool(false));
        let ty = match &value {
            Value::Bool(_) => Type::Bool,
            Value::Int(_) => Type::INT,
            Value::Double(_) => Type::Double,
            Value::String(_) => Type::String,
        };
        Code::literal(value, ty)
    }

    fn member(&self, id: SourceId) -> Option<&'c Member<'db>> {
        match self.class.inference.binding(id)? {
            Binding::Feature(shell, index) => self.class.member(shell, index),
            Binding::Variable(_) => None,
        }
    }

    /// The variable that a name stands for.
    pub(super) fn variable(&self, id: SourceId) -> Option<VariableId> {
        self.class.inference.variable_at(id)
    }

    /// What a variable is called.
    pub(super) fn variable_name(&self, id: VariableId) -> String {
        let name = self.locals.get(&id).or_else(|| self.class.variables.get(&id));
        name.cloned().unwrap_or_default()
    }

    fn name(&self, name: &NameRef) -> Code {
        if self.of_shell {
            let member = self.class.members().find(|member| member.data.name.name == name.name);
            return member.map_or_else(
                || Code::primary("{}", Type::Unknown),
                |member| {
                    let name = member.property.as_ref().unwrap_or(&member.name);
                    Code::primary(name, member.ty.clone())
                },
            );
        }
        match (self.variable(name.id), self.member(name.id)) {
            (Some(index), _) => Code::primary(self.variable_name(index), self.class.type_of_variable(index)),
            (None, Some(member)) => Code::primary(&member.name, member.ty.clone()),
            (None, None) => Code::primary("{}", Type::Unknown),
        }
    }

    fn unary(&mut self, operator: UnaryOperator, inner: &'db Expr) -> Code {
        if let (UnaryOperator::Minus, Expr::Literal(Literal::Int(text), _)) = (operator, inner)
            && *text == "2147483648"
        {
            return Code::literal(Value::Int(i32::MIN), Type::INT);
        }
        let inner = self.expr(inner);
        let value = inner.value.as_ref().and_then(|value| value.unary(operator).ok().flatten());
        if let (UnaryOperator::Minus, Some(value), true) = (operator, &value, inner.is_literal)
            && inner.level == Level::Primary
        {
            return Code::literal(value.clone(), inner.ty);
        }
        let text = match operator {
            UnaryOperator::Not => format!("!{}", inner.at_least(Level::Unary)),
            // `--` is another operator.
            UnaryOperator::Minus => format!("-{}", inner.at_least(Level::Primary)),
        };
        let code = Code { value, ..Code::new(text, Level::Unary, inner.ty) };
        if is_narrow(&code.ty) { code.clone().cast(&code.ty) } else { code }
    }

    fn binary(&mut self, operator: BinaryOperator, lhs: Code, rhs: Code) -> Code {
        use BinaryOperator as Op;
        let value = match (&lhs.value, &rhs.value) {
            (Some(lhs), Some(rhs)) => lhs.binary(operator, rhs).ok().flatten(),
            _ => None,
        };
        let level = match operator {
            Op::Or => Level::Or,
            Op::And => Level::And,
            Op::Equal | Op::NotEqual => Level::Equality,
            Op::Less | Op::LessOrEqual | Op::Greater | Op::GreaterOrEqual => Level::Relation,
            Op::Add | Op::Subtract => Level::Sum,
            Op::Multiply | Op::Divide | Op::Remainder => Level::Product,
        };
        let is_comparison = matches!(level, Level::Equality | Level::Relation);
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
            return Code { value, compared, ..joined(operator, level, &lhs, &rhs, ty) };
        }
        // A constant beside a variable that it fits is of that variable's type.
        let beside = |one: &Code, other: &Code| {
            let is_constant = one.value.is_some() && other.value.is_none() && !self.of_shell;
            let fits = is_constant && one.ty.fits(one.value.as_ref(), &other.ty);
            if fits { other.ty.clone() } else { one.ty.clone() }
        };
        let (left, right) = (beside(&lhs, &rhs), beside(&rhs, &lhs));
        let ty = left.binary(Op::Add, &right).unwrap_or(Type::Unknown);
        if is_comparison && is_unsigned_64(&ty) && is_unsigned(&left) != is_unsigned(&right) {
            return self.compare_unsigned(operator, lhs, rhs, &ty);
        }
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
            return Code { value, compared, ..joined(operator, level, &lhs, &rhs, Type::Bool) };
        }
        let code = Code { value, ..joined(operator, level, &lhs, &rhs, ty.clone()) };
        if is_narrow(&ty) { code.cast(&ty) } else { code }
    }

    /// A call that fails in either way has failed.
    fn compare_calls(&mut self, operator: BinaryOperator, lhs: Code, rhs: Code) -> Code {
        let (lhs, rhs) = if lhs.is_literal { (rhs, lhs) } else { (lhs, rhs) };
        if rhs.is_literal && rhs.text == "RTT::SendFailure" && !lhs.is_literal {
            let (sign, level) = match operator {
                BinaryOperator::Equal => ("<=", Level::Relation),
                _ => (">", Level::Relation),
            };
            let text = format!("{} {sign} {}", lhs.at_least(Level::Sum), rhs.text);
            return Code::new(text, level, Type::Bool);
        }
        let failed = |code: Code| {
            if code.is_literal || rhs.is_literal {
                return code;
            }
            Code::primary(format!("std::max({}, RTT::SendFailure)", code.text), code.ty)
        };
        let (lhs, rhs) = (failed(lhs), failed(rhs.clone()));
        joined(operator, Level::Equality, &lhs, &rhs, Type::Bool)
    }

    /// A number below zero is less than any without a sign, which C++ denies.
    fn compare_unsigned(&mut self, operator: BinaryOperator, lhs: Code, rhs: Code, ty: &Type) -> Code {
        use BinaryOperator as Op;
        let is_left = !is_unsigned(&lhs.ty);
        // One of them is asked twice.
        let is_name = |code: &Code| code.text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let lhs = if is_name(&lhs) && is_name(&rhs) { lhs } else { self.keep(lhs, "left") };
        let rhs = if is_name(&rhs) { rhs } else { self.keep(rhs, "right") };
        let signed = if is_left { lhs.text.clone() } else { rhs.text.clone() };
        let (lhs, rhs) = if is_left { (lhs.cast(ty), rhs) } else { (lhs, rhs.cast(ty)) };
        let compared = format!("{} {} {}", lhs.text, operator.text(), rhs.text);
        let (text, level) = match (operator, is_left) {
            (Op::Equal, _)
            | (Op::Greater | Op::GreaterOrEqual, true)
            | (Op::Less | Op::LessOrEqual, false) => (format!("{signed} >= 0 && {compared}"), Level::And),
            _ => (format!("{signed} < 0 || {compared}"), Level::Or),
        };
        Code::new(text, level, Type::Bool)
    }

    /// `&&` and `||`: what the second operand needs is computed only where the first one leaves it open.
    fn logical(&mut self, operator: BinaryOperator, lhs: &'db Expr, rhs: &'db Expr) -> Code {
        let is_and = operator == BinaryOperator::And;
        let (level, name) = if is_and { (Level::And, "both") } else { (Level::Or, "either") };
        let lhs = self.expr(lhs);
        let before = std::mem::take(&mut self.lines);
        self.depth += 1;
        let right = self.expr(rhs);
        self.depth -= 1;
        let mut inner = std::mem::replace(&mut self.lines, before);
        if inner.iter().all(|line| line.is_place) {
            inner.iter_mut().for_each(|line| line.depth -= 1);
            self.lines.extend(inner);
            self.class.note(are_obvious(operator, &lhs, &right));
            let value = match (&lhs.value, &right.value) {
                (Some(lhs), Some(rhs)) => lhs.binary(operator, rhs).ok().flatten(),
                _ => None,
            };
            return Code { value, ..joined(operator, level, &lhs, &right, Type::Bool) };
        }
        let name = if self.scope.chained.get(&lhs.text) == Some(&operator) {
            lhs.text
        } else {
            let name = self.temporary(name);
            self.line(format!("bool {name} = {};", lhs.text));
            self.scope.chained.insert(name.clone(), operator);
            name
        };
        self.line(format!("if ({}{name}) {{", if is_and { "" } else { "!" }));
        self.lines.extend(inner);
        self.depth += 1;
        self.line(format!("{name} = {};", right.text));
        self.depth -= 1;
        self.line("}");
        self.scope.kept.insert(name.clone());
        Code::primary(name, Type::Bool)
    }

    /// Operands or arguments, each evaluated after those before it. With `all_calls`, calls among them are computed before.
    fn operands(&mut self, all: &[&'db Expr], all_calls: bool) -> Vec<Code> {
        let effects: Vec<Effects<'db>> = all.iter().map(|expr| self.effects(expr)).collect();
        let mut found = Vec::new();
        for (index, expr) in all.iter().enumerate() {
            let mut later = Effects::default();
            effects.iter().skip(index + 1).for_each(|it| later.add(it));
            let must = match effects.get(index).filter(|own| own.calls) {
                Some(own) => {
                    let mut rest = all.iter().skip(index + 1);
                    all_calls || later.calls || rest.any(|expr| self.may_change(expr, own))
                }
                None => later.calls && self.may_change(expr, &later),
            };
            let code = self.expr(expr);
            found.push(if must { self.keep(code, &base_of(expr)) } else { code });
        }
        found
    }

    /// Keeps a value as it is now.
    fn keep(&mut self, code: Code, name: &str) -> Code {
        if code.is_literal || self.scope.kept.contains(&code.text) {
            return code;
        }
        let name = self.temporary(name);
        self.line(format!("const auto {name} = {};", code.at_least(Level::Or)));
        self.scope.kept.insert(name.clone());
        Code { text: name, level: Level::Primary, ..code }
    }

    /// A name that is new: `name`, `name_2`, …
    fn temporary(&mut self, name: &str) -> String {
        // As it can be in C++, or no number would make a name of it that can.
        let name = as_identifier(name);
        let name = name.trim_end_matches('_');
        let numbers = self.scope.numbers.get(name).copied().unwrap_or(1)..;
        for number in numbers {
            let wanted = if number == 1 { name.to_owned() } else { format!("{name}_{number}") };
            let found = self.scope.names.declare(&wanted);
            if found == wanted {
                self.scope.numbers.insert(name.to_owned(), number + 1);
                return found;
            }
        }
        self.scope.names.declare(name)
    }

    fn effects(&self, expr: &Expr) -> Effects<'db> {
        let mut effects = Effects::default();
        for expr in expr.descendants() {
            let Expr::Call { callee, arguments, .. } = expr else { continue };
            let found = self.class.inference.callee(callee.id);
            match found {
                Some(Callee::Builtin(Builtin::Status)) => continue,
                Some(Callee::Builtin(Builtin::Read)) => {
                    let port = arguments.first().and_then(Expr::id).and_then(|id| self.member(id));
                    effects.statuses.extend(port.map(|port| (port.shell, port.index)));
                }
                Some(Callee::Operation(_)) => effects.all = true,
                _ => {}
            }
            effects.calls = true;
            let changed = self.changed_arguments(found, arguments);
            effects.variables.extend(changed.into_iter().filter_map(|id| self.variable(id)));
        }
        effects
    }

    /// The arguments that a call may change.
    fn changed_arguments(&self, callee: Option<Callee<'db>>, arguments: &[Expr]) -> Vec<SourceId> {
        let Some(callee) = callee else { return Vec::new() };
        let (db, core) = (self.class.model.db, self.class.data);
        let directions = self.class.inference.directions(db, core, callee, arguments.len());
        let changed = arguments.iter().zip(directions).filter(|(_, it)| *it != Direction::In);
        changed.filter_map(|(argument, _)| argument.id()).collect()
    }

    /// May an expression that calls nothing give another value after these effects?
    fn may_change(&self, expr: &Expr, effects: &Effects<'db>) -> bool {
        let changes = |id: VariableId| effects.variables.contains(&id) || effects.all && self.is_shared(id);
        expr.descendants().any(|expr| match expr {
            // The argument of `status` is a port, no variable.
            Expr::Name(name) => self.variable(name.id).is_some_and(changes),
            Expr::Call { callee, arguments, .. } => {
                let port = arguments.first().and_then(Expr::id).and_then(|id| self.member(id));
                let changes = |port: &Member<'db>| effects.statuses.contains(&(port.shell, port.index));
                self.class.inference.callee(callee.id) == Some(Callee::Builtin(Builtin::Status))
                    && (effects.all || port.is_some_and(changes))
            }
            _ => false,
        })
    }

    /// May one's own operations change a variable? A parameter of theirs may be one of the core.
    fn is_shared(&self, id: VariableId) -> bool {
        let kind = self.class.inference.variable(id).map(|variable| variable.kind);
        matches!(
            kind,
            Some(
                VariableKind::Core
                    | VariableKind::Machine
                    | VariableKind::Parameter(Direction::Out | Direction::InOut)
            )
        )
    }

    // Calls.

    fn call(&mut self, callee: &NameRef, arguments: &'db [Expr]) -> Code {
        let Some(found) = self.class.inference.callee(callee.id) else {
            return Code::primary("{}", Type::Unknown);
        };
        let db = self.class.model.db;
        match found {
            Callee::Codel(of) => {
                let Some(data) = codel(db, of) else { return Code::primary("{}", Type::Unknown) };
                let ty = |ty: Option<&TypeRef>| type_of(db, self.class.model.project, of, ty);
                let parameters = data.parameters.iter();
                let parameters: Vec<(Direction, Type)> =
                    parameters.map(|it| (it.direction, ty(it.ty.as_ref()))).collect();
                let result = ty(data.result.as_ref());
                let arguments = self.arguments(found, &parameters, arguments);
                let function = self.class.model.libraries.qualified(of).unwrap_or_default();
                let call = format!("{function}({})", arguments.join(", "));
                let key = cpp_string(&of.qualified(db));
                Code::primary(format!("MAUVE_TRACE_CODEL(getName(), {key}, {call})"), result)
            }
            Callee::Operation(index) => {
                let operation = self.class.data.operations.get(index);
                let id = operation.map(|it| ProgramId::Operation(it.name.name.clone()));
                let routine = id.and_then(|id| self.class.program(&id));
                let Some(routine) = routine else { return Code::primary("{}", Type::Unknown) };
                let (db, project, core) = (db, self.class.model.project, self.class.core);
                let parameters = routine.parameters.iter();
                let parameters: Vec<(Direction, Type)> =
                    parameters.map(|it| (it.direction, type_of(db, project, core, it.ty.as_ref()))).collect();
                let arguments = self.arguments(found, &parameters, arguments);
                let text = format!("{}({})", routine.function, arguments.join(", "));
                Code::primary(text, routine.gives.clone())
            }
            Callee::Builtin(function @ (Builtin::Read | Builtin::Write | Builtin::Status)) => {
                self.port(function, arguments)
            }
            // It is a statement, or the value of one.
            Callee::Builtin(Builtin::Send) => Code::primary("{}", Type::Unknown),
            Callee::Builtin(Builtin::Collect) => self.collect(arguments),
        }
    }

    /// The arguments of a codel, or of one's own operation.
    fn arguments(
        &mut self,
        callee: Callee<'db>,
        parameters: &[(Direction, Type)],
        arguments: &'db [Expr],
    ) -> Vec<String> {
        let is_input = |(_, (direction, _)): &(&Expr, &(Direction, Type))| *direction == Direction::In;
        let inputs: Vec<&'db Expr> =
            arguments.iter().zip(parameters).filter(is_input).map(|(argument, _)| argument).collect();
        let mut effects = Effects { all: matches!(callee, Callee::Operation(_)), ..Effects::default() };
        let changed = self.changed_arguments(Some(callee), arguments);
        effects.variables.extend(changed.into_iter().filter_map(|id| self.variable(id)));
        let mut values = self.operands(&inputs, true).into_iter();
        let mut found = Vec::new();
        for (argument, (direction, ty)) in arguments.iter().zip(parameters) {
            if *direction != Direction::In {
                found.push(self.expr(argument).text);
                continue;
            }
            let Some(value) = values.next() else { continue };
            // What goes in is a value: what the call changes meanwhile is another variable.
            let is_reference = matches!(ty, Type::String | Type::Message(..) | Type::External(_));
            let is_copied =
                is_reference && matches!(argument, Expr::Name(_)) && self.may_change(argument, &effects);
            let value = if is_copied { self.keep(value, &base_of(argument)) } else { value };
            found.push(value.converted(ty).text);
        }
        found
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, arguments: &'db [Expr]) -> Code {
        let port = arguments.first().and_then(Expr::id).and_then(|id| self.member(id));
        let Some(port) = port else { return Code::primary("{}", Type::Unknown) };
        match (function, arguments.get(1)) {
            (Builtin::Write, Some(value)) => {
                let value = self.value(value, &port.ty);
                Code::primary(format!("{}.write({})", port.name, value.text), Type::Void)
            }
            (Builtin::Read, Some(variable)) => {
                let read = format!("{}.read({})", port.name, self.expr(variable).text);
                match &port.status {
                    Some(status) => {
                        Code::new(format!("{status} = {read}"), Level::Assignment, Type::PortStatus)
                    }
                    None => Code::primary(read, Type::PortStatus),
                }
            }
            _ => Code::primary(port.status.clone().unwrap_or_default(), Type::PortStatus),
        }
    }

    /// `handler = send(operation, in and inout arguments…);`, or without a handler.
    pub(super) fn send(&mut self, handler: Option<VariableId>, arguments: &'db [Expr]) {
        let operation = arguments.first().and_then(Expr::id).and_then(|id| self.member(id));
        let Some(operation) = operation else { return };
        let last = self.class.last_calls.iter().find(|last| {
            (last.handler, last.shell, last.index) == (handler, operation.shell, operation.index)
        });
        let given: Vec<&'db Expr> = arguments.iter().skip(1).collect();
        // They are evaluated also where nothing is sent.
        let mut given = self.operands(&given, last.is_some()).into_iter();
        if let Some(last) = last {
            self.line(format!("if (!{}()) {{", last.is_under_way));
            self.depth += 1;
        }
        let mut texts = Vec::new();
        for (number, (direction, ty)) in operation.parameters.iter().enumerate() {
            let value = match direction {
                Direction::Out => None,
                Direction::In | Direction::InOut => given.next().map(|value| value.converted(ty)),
            };
            if *direction == Direction::In {
                let value =
                    value.map(|value| if value.ty == Type::String { value.into_string() } else { value });
                texts.extend(value.map(|value| value.text));
                continue;
            }
            let slot = self.class.slots.iter().find(|slot| {
                let of = (slot.handler, slot.shell, slot.index, slot.parameter);
                of == (handler, operation.shell, operation.index, number)
            });
            let Some(slot) = slot else { continue };
            if let Some(value) = value {
                self.line(format!("{} = {};", slot.name, value.text));
            }
            texts.push(slot.name.clone());
        }
        let handles = last.map(|last| last.name.clone()).into_iter();
        let handles = handles.chain(handler.map(|handler| self.variable_name(handler)));
        let targets: String = handles.map(|name| format!("{name} = ")).collect();
        texts.insert(0, operation.name.clone());
        self.line(format!("{targets}mauve_send({});", texts.join(", ")));
        if last.is_some() {
            self.depth -= 1;
            self.line("}");
        }
    }

    /// The body of the function that tells whether a call is under way.
    pub(super) fn ask_for_last_call(mut self, call: &LastCall<'db>, operation: &Member<'db>) -> Vec<Line> {
        let mut given = vec![call.name.clone()];
        given.extend(self.nowhere(operation));
        self.line(format!("return mauve_collect({}) == RTT::SendNotReady;", given.join(", ")));
        self.lines
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, arguments: &'db [Expr]) -> Code {
        let handler = arguments.first().and_then(Expr::id).and_then(|id| self.variable(id));
        let Some(handler) = handler else { return Code::primary("{}", Type::Unknown) };
        let mut texts: Vec<String> =
            arguments.iter().skip(1).map(|argument| self.expr(argument).text).collect();
        if texts.is_empty()
            && let Type::Handle(operation) = self.class.type_of_variable(handler)
            && let Some(member) = self.class.members().find(|it| it.data.name.name == operation)
        {
            texts = self.nowhere(member);
        }
        texts.insert(0, self.variable_name(handler));
        Code::primary(format!("mauve_collect({})", texts.join(", ")), Type::CallStatus)
    }

    /// Variables for what a call gives and nobody wants.
    fn nowhere(&mut self, member: &Member<'db>) -> Vec<String> {
        let result = (member.ty != Type::Void).then_some(&member.ty);
        let back = member.parameters.iter().filter(|(direction, _)| *direction != Direction::In);
        let types: Vec<&Type> = result.into_iter().chain(back.map(|(_, ty)| ty)).collect();
        let mut texts = Vec::new();
        for ty in types {
            let name = self.temporary("dropped");
            let text = format!("{} {name}{{}};", self.class.cpp(ty));
            self.lines.push(Line { depth: self.depth, text, is_place: true });
            texts.push(name);
        }
        texts
    }
}

/// The name of a value that is kept.
fn base_of(expr: &Expr) -> String {
    match expr {
        Expr::Call { callee, .. } => format!("{}_result", callee.name),
        Expr::Name(name) => format!("{}_before", name.name),
        _ => "value".to_owned(),
    }
}

/// In this type, and cast where C++ would take it for another one.
fn in_type(code: Code, ty: &Type) -> Code {
    match &code.value {
        _ if code.ty == *ty => code,
        Some(value) if code.is_literal => Code::literal(value.clone(), ty.clone()),
        _ if is_same_in_cpp(&code.ty, ty) => Code { ty: ty.clone(), ..code },
        _ => code.cast(ty),
    }
}

/// Two operands, with the parentheses that they need, and those that compilers ask for.
fn joined(operator: BinaryOperator, level: Level, lhs: &Code, rhs: &Code, ty: Type) -> Code {
    let (left, right) = match level {
        // `a && b || c`, `a == b == c`, `a < b == c` and `!a == b` are right, and look wrong.
        Level::Or => (Level::Or, Level::Equality),
        Level::And => (Level::And, Level::Equality),
        Level::Equality | Level::Relation => (Level::Sum, Level::Sum),
        Level::Sum => (Level::Sum, Level::Product),
        _ => (Level::Product, Level::Unary),
    };
    let side = |code: &Code, least: Level| {
        let hides = level == Level::Or && code.level == Level::And;
        let negated = level == Level::Equality && code.text.starts_with('!');
        if hides || negated { format!("({})", code.text) } else { code.at_least(least) }
    };
    Code::new(format!("{} {} {}", side(lhs, left), operator.text(), side(rhs, right)), level, ty)
}
