//! An expression in C++: its text, how tight it binds, its type and its value.

use mauve_hir::item_tree::BinaryOperator;
use mauve_hir::{Integer, Type, Value};

use crate::cpp_type::integer_type;
use crate::escape::cpp_string;

/// How tight an expression binds, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Precedence {
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
pub(super) struct CppCode {
    pub(super) text: String,
    pub(super) level: Precedence,
    pub(super) ty: Type,
    /// Its value, where that is constant.
    pub(super) value: Option<Value>,
    /// Whether it is a literal, perhaps with a sign.
    pub(super) is_literal: bool,
    /// Of a comparison with a constant.
    pub(super) compared: Option<ConstantComparison>,
}

impl CppCode {
    pub(super) fn new(text: impl Into<String>, level: Precedence, ty: Type) -> CppCode {
        CppCode { text: text.into(), level, ty, value: None, is_literal: false, compared: None }
    }

    pub(super) fn primary(text: impl Into<String>, ty: Type) -> CppCode {
        CppCode::new(text, Precedence::Primary, ty)
    }

    pub(super) fn unknown() -> CppCode {
        CppCode::primary("{}", Type::Unknown)
    }

    pub(super) fn literal(value: Value, ty: Type) -> CppCode {
        let text = literal_text(&value, &ty);
        let level = if text.starts_with('-') { Precedence::Unary } else { Precedence::Primary };
        CppCode { text, level, ty, value: Some(value), is_literal: true, compared: None }
    }

    /// In parentheses, unless it binds at least as tight.
    pub(super) fn at_least(&self, level: Precedence) -> String {
        if self.level < level { format!("({})", self.text) } else { self.text.clone() }
    }

    /// As a `std::string`: two literals are joined and compared as arrays otherwise.
    pub(super) fn into_string(self) -> CppCode {
        if self.is_literal { CppCode::primary(format!("std::string({})", self.text), self.ty) } else { self }
    }

    /// As an operand of a comparison.
    pub(super) fn operand(&self) -> String {
        self.at_least(Precedence::Sum)
    }

    /// As a value of another type, which it fits.
    pub(super) fn converted(self, to: &Type) -> CppCode {
        if !self.ty.is_number() || !to.is_number() {
            return self;
        }
        self.with_type(to, loses_nothing)
    }

    /// As a number of another type, with a cast unless the conversion of a value `is_implicit`.
    pub(super) fn with_type(self, to: &Type, is_implicit: fn(&Type, &Type) -> bool) -> CppCode {
        match self.value.clone().filter(|_| self.is_literal) {
            _ if self.ty == *to => self,
            Some(value) => CppCode::literal(value, to.clone()),
            None if is_implicit(&self.ty, to) => CppCode { ty: to.clone(), ..self },
            None => self.cast(to),
        }
    }

    pub(super) fn cast(self, to: &Type) -> CppCode {
        let text = format!("static_cast<{}>({})", number_type(to), self.text);
        CppCode { value: self.value, ..CppCode::primary(text, to.clone()) }
    }
}

/// Returns whether C++ converts each value of the one type to the same value of the other.
fn loses_nothing(from: &Type, to: &Type) -> bool {
    match (from, to) {
        (Type::Integer(from), Type::Double) => from.ends().1 <= u32::MAX.into(),
        (Type::Float, Type::Double) => true,
        (Type::Integer(from), Type::Integer(to)) => to.has_all_of(*from),
        _ => from == to,
    }
}

fn number_type(ty: &Type) -> &'static str {
    match ty {
        Type::Double => "double",
        Type::Float => "float",
        Type::Integer(integer) => integer_type(*integer),
        _ => "bool",
    }
}

/// Returns whether the type is narrower than `int`: C++ calculates with such values as `int`.
pub(super) fn is_narrow(ty: &Type) -> bool {
    matches!(ty, Type::Integer(integer) if integer.ends().1 < i32::MAX.into())
}

pub(super) fn is_unsigned_64(ty: &Type) -> bool {
    matches!(ty, Type::Integer(Integer::Uint64 | Integer::Size))
}

pub(super) fn is_unsigned(ty: &Type) -> bool {
    matches!(ty, Type::Integer(integer) if integer.ends().0 == 0)
}

/// The type in which C++ itself would calculate with these two.
pub(super) fn usual(one: &Type, other: &Type) -> Type {
    let promoted = |ty: &Type| if is_narrow(ty) { Type::INT } else { ty.clone() };
    let (one, other) = (promoted(one), promoted(other));
    let rank = |ty: &Type| match ty {
        Type::Double => i128::MAX,
        Type::Float => i128::MAX - 1,
        Type::Integer(integer) => integer.ends().1,
        _ => 0,
    };
    if rank(&one) >= rank(&other) { one } else { other }
}

/// Returns whether C++ has one type for both.
pub(super) fn is_same_in_cpp(one: &Type, other: &Type) -> bool {
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

/// The expression that is compared, the operator, and the constant.
pub(super) type ConstantComparison = (String, BinaryOperator, f64);
