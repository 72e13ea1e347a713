//! Types: resolution of their names, types of operators, and assignability.

use std::borrow::Cow;

use crate::ModelDb;
use crate::item_tree::{BinaryOperator, Direction, Expr, Literal, Name, TypeRef, UnaryOperator};
use crate::messages::message_of;
use crate::names::names_of;
use crate::project::{Project, external_types};
use crate::source::Decl;
use crate::values::{NoValue, Value};

/// A type of values.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Type {
    /// `true` and `false`.
    Bool,
    /// An integer.
    Integer(Integer),
    /// A floating-point number of 32 bits.
    Float,
    /// A floating-point number of 64 bits.
    Double,
    /// A string.
    String,
    /// No value: the result of a codel without a result.
    Void,
    /// `no_data`, `old_data`, `new_data`.
    PortStatus,
    /// `failure`, `not_ready`, `success`.
    CallStatus,
    /// A call of an operation that was sent: the result of `send` and the value of a handler.
    Handle(Name),
    /// A message of a ROS package: the names of the package and the message.
    Message(Name, Name),
    /// A type that `mauve.toml` declares.
    External(Name),
    /// An unknown type, or one with a reported error: compatible with all types.
    Unknown,
}

/// The kinds of integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Integer {
    Int,
    Char,
    Short,
    Long,
    Int8,
    Int64,
    Uint8,
    Uint16,
    Uint32,
    Uint64,
    Size,
}

impl Integer {
    /// Returns its minimum and its maximum.
    pub fn ends(self) -> (i128, i128) {
        match self {
            Integer::Char | Integer::Int8 => (i8::MIN.into(), i8::MAX.into()),
            Integer::Short => (i16::MIN.into(), i16::MAX.into()),
            Integer::Int => (i32::MIN.into(), i32::MAX.into()),
            Integer::Long | Integer::Int64 => (i64::MIN.into(), i64::MAX.into()),
            Integer::Uint8 => (0, u8::MAX.into()),
            Integer::Uint16 => (0, u16::MAX.into()),
            Integer::Uint32 => (0, u32::MAX.into()),
            Integer::Uint64 | Integer::Size => (0, u64::MAX.into()),
        }
    }

    /// Returns whether it can represent every value of `other`.
    pub fn has_all_of(self, other: Integer) -> bool {
        let ((low, high), (least, greatest)) = (self.ends(), other.ends());
        low <= least && greatest <= high
    }

    /// Returns the type of an arithmetic operation on both: the type that can represent the values of both, at least `int`.
    fn common(self, other: Integer) -> Integer {
        let wider = [Integer::Int, Integer::Int64, self, other];
        let fits = wider.into_iter().find(|it| it.has_all_of(self) && it.has_all_of(other));
        fits.unwrap_or(Integer::Uint64)
    }

    fn can_represent(self, value: i32) -> bool {
        let (low, high) = self.ends();
        (low..=high).contains(&value.into())
    }
}

/// The signature of a codel or an operation.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Signature {
    /// Its parameters.
    pub parameters: Vec<(Direction, Name, Type)>,
    /// The type of its result.
    pub result: Type,
}

impl Signature {
    /// Returns whether both have the same directions and types; names do not count, and unknown types equal all types.
    pub(crate) fn is(&self, other: &Signature) -> bool {
        let same = |((one, _, a), (two, _, b)): (&(Direction, Name, Type), &(Direction, Name, Type))| {
            one == two && a.is(b)
        };
        self.parameters.len() == other.parameters.len()
            && self.parameters.iter().zip(&other.parameters).all(same)
            && self.result.is(&other.result)
    }
}

/// Returns the built-in type of this name: a type of the language, or a scalar of C (`ctypes`).
///
/// ```
/// use mauve_hir::{Type, built_in_type};
/// assert_eq!(built_in_type("double"), Some(Type::Double));
/// assert_eq!(built_in_type("uint8_t"), built_in_type("uint8"));
/// assert_eq!(built_in_type("Pose"), None);
/// ```
pub fn built_in_type(name: &str) -> Option<Type> {
    let mut all = LANGUAGE_TYPES.iter().chain(&C_TYPES);
    all.find(|(built_in, _)| *built_in == name).map(|(_, ty)| ty.clone())
}

/// The built-in types of the language, by name.
pub static LANGUAGE_TYPES: [(&str, Type); 8] = [
    ("bool", Type::Bool),
    ("int", Type::INT),
    ("double", Type::Double),
    ("float", Type::Float),
    ("string", Type::String),
    ("void", Type::Void),
    ("port_status", Type::PortStatus),
    ("call_status", Type::CallStatus),
];

/// The built-in scalars of C, by name.
pub static C_TYPES: [(&str, Type); 28] = [
    ("int8", Type::Integer(Integer::Int8)),
    ("int16", Type::Integer(Integer::Short)),
    ("int32", Type::INT),
    ("int64", Type::Integer(Integer::Int64)),
    ("uint8", Type::Integer(Integer::Uint8)),
    ("uint16", Type::Integer(Integer::Uint16)),
    ("uint32", Type::Integer(Integer::Uint32)),
    ("uint64", Type::Integer(Integer::Uint64)),
    ("float32", Type::Float),
    ("float64", Type::Double),
    ("char", Type::Integer(Integer::Char)),
    ("short", Type::Integer(Integer::Short)),
    ("long", Type::Integer(Integer::Long)),
    ("byte", Type::Integer(Integer::Uint8)),
    ("size_t", Type::Integer(Integer::Size)),
    ("int8_t", Type::Integer(Integer::Int8)),
    ("int16_t", Type::Integer(Integer::Short)),
    ("int32_t", Type::INT),
    ("int64_t", Type::Integer(Integer::Int64)),
    ("uint8_t", Type::Integer(Integer::Uint8)),
    ("uint16_t", Type::Integer(Integer::Uint16)),
    ("uint32_t", Type::Integer(Integer::Uint32)),
    ("uint64_t", Type::Integer(Integer::Uint64)),
    ("uint", Type::Integer(Integer::Uint32)),
    ("uchar", Type::Integer(Integer::Uint8)),
    ("ushort", Type::Integer(Integer::Uint16)),
    ("ulong", Type::Integer(Integer::Uint64)),
    ("boolean", Type::Bool),
];

impl Type {
    /// `int`
    pub const INT: Type = Type::Integer(Integer::Int);

    /// Returns the name of the type in a model; `None` for a type without a name.
    pub fn written(&self) -> Option<Cow<'_, str>> {
        match self {
            Type::Message(package, name) => Some(Cow::Owned(format!("{package}.{name}"))),
            Type::External(name) => Some(Cow::Borrowed(name)),
            // Its first name in the table is `int16`.
            Type::Integer(Integer::Short) => Some(Cow::Borrowed("short")),
            _ => {
                let mut all = LANGUAGE_TYPES.iter().chain(&C_TYPES);
                all.find(|(_, ty)| ty == self).map(|(name, _)| Cow::Borrowed(*name))
            }
        }
    }

    /// Returns whether it is a numeric type.
    pub fn is_number(&self) -> bool {
        matches!(self, Type::Integer(_) | Type::Float | Type::Double)
    }

    /// Returns whether no operator takes the type: a handle, or `void`.
    pub fn is_no_operand(&self) -> bool {
        matches!(self, Type::Handle(_) | Type::Void)
    }

    /// Returns whether both types are equal; an unknown type equals all types.
    pub fn is(&self, other: &Type) -> bool {
        self == other || matches!(self, Type::Unknown) || matches!(other, Type::Unknown)
    }

    /// Returns whether a value of this type, with the value `constant` if that is known, is assignable to `expected`. The
    /// implicit conversions are: `int` to a floating-point type, a number to a type that can represent all its values, and a
    /// constant to a type that can represent it.
    pub fn fits(&self, constant: Option<&Value>, expected: &Type) -> bool {
        match (self, expected, constant) {
            (&Type::INT, Type::Double | Type::Float, _) | (Type::Float, Type::Double, _) => true,
            (Type::Integer(one), Type::Integer(other), _) if other.has_all_of(*one) => true,
            (Type::Double, Type::Float, Some(_)) => true,
            (&Type::INT, Type::Integer(integer), Some(Value::Int(value))) => integer.can_represent(*value),
            _ => self.is(expected),
        }
    }

    /// Returns the type of a binary operation; `None` if the operator does not take the types.
    pub fn binary(&self, operator: BinaryOperator, other: &Type) -> Option<Type> {
        use BinaryOperator as Op;
        let unknown = [self, other].contains(&&Type::Unknown);
        let are = |ok: fn(&Type) -> bool| [self, other].into_iter().all(|it| ok(it) || *it == Type::Unknown);
        match operator {
            Op::Or | Op::And => are(|it| *it == Type::Bool).then_some(Type::Bool),
            Op::Equal | Op::NotEqual => {
                let handles = Type::is_no_operand;
                let same = self.is(other) || are(Type::is_number);
                (same && !handles(self) && !handles(other)).then_some(Type::Bool)
            }
            Op::Less | Op::LessOrEqual | Op::Greater | Op::GreaterOrEqual => {
                are(Type::is_number).then_some(Type::Bool)
            }
            Op::Add if are(|it| *it == Type::String) => {
                Some(if unknown { Type::Unknown } else { Type::String })
            }
            Op::Remainder => are(|it| matches!(it, Type::Integer(_))).then(|| self.common(other)),
            _ => are(Type::is_number).then(|| self.common(other)),
        }
    }

    /// Returns the type of an arithmetic operation on two numeric types.
    fn common(&self, other: &Type) -> Type {
        match (self, other) {
            (Type::Unknown, _) | (_, Type::Unknown) => Type::Unknown,
            (Type::Double, _) | (_, Type::Double) => Type::Double,
            (Type::Float, _) | (_, Type::Float) => Type::Float,
            (one, two) if one == two => one.clone(),
            (Type::Integer(one), Type::Integer(two)) => Type::Integer(one.common(*two)),
            _ => Type::INT,
        }
    }

    /// Returns the type of a unary operation; `None` if the operator does not take the type.
    pub fn unary(&self, operator: UnaryOperator) -> Option<Type> {
        match (operator, self) {
            (UnaryOperator::Not, Type::Bool | Type::Unknown) => Some(Type::Bool),
            (UnaryOperator::Minus, it) if it.is_number() || *it == Type::Unknown => Some(it.clone()),
            _ => None,
        }
    }
}

/// The type of an expression, and its value if it is constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Typed {
    pub(crate) ty: Type,
    pub(crate) value: Option<Value>,
}

/// Why an operation has no type or no value.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum OperatorError {
    /// The operator does not take the operand.
    Unary(UnaryOperator, Type),
    /// The operator does not take the operands.
    Binary(BinaryOperator, [Type; 2]),
    /// The constant result is undefined.
    NoValue(NoValue),
}

impl Typed {
    pub(crate) const UNKNOWN: Typed = Typed { ty: Type::Unknown, value: None };

    pub(crate) fn of(ty: Type) -> Typed {
        Typed { ty, value: None }
    }

    pub(crate) fn literal(literal: &Literal) -> Result<Typed, OperatorError> {
        let value = Value::of_literal(literal).map_err(OperatorError::NoValue)?;
        let ty = match literal {
            Literal::Int(_) => Type::INT,
            Literal::Float(_) => Type::Double,
            Literal::String(_) => Type::String,
            Literal::Bool(_) => Type::Bool,
            Literal::PortStatus(_) => Type::PortStatus,
            Literal::CallStatus(_) => Type::CallStatus,
        };
        Ok(Typed { ty, value })
    }

    /// Returns the minimum of `int` for `-2147483648`, whose operand exceeds the maximum of `int`.
    pub(crate) fn least(operator: UnaryOperator, inner: &Expr) -> Option<Typed> {
        match (operator, inner) {
            (UnaryOperator::Minus, Expr::Literal(Literal::Int(text), _)) if *text == "2147483648" => {
                Some(Typed { ty: Type::INT, value: Some(Value::Int(i32::MIN)) })
            }
            _ => None,
        }
    }

    pub(crate) fn unary(&self, operator: UnaryOperator) -> Result<Typed, OperatorError> {
        let ty = self.ty.unary(operator).ok_or_else(|| OperatorError::Unary(operator, self.ty.clone()))?;
        let value = self
            .value
            .as_ref()
            .map(|value| value.unary(operator))
            .transpose()
            .map_err(OperatorError::NoValue)?;
        Ok(Typed { ty, value: value.flatten() })
    }

    pub(crate) fn binary(&self, operator: BinaryOperator, other: &Typed) -> Result<Typed, OperatorError> {
        let ty = self.converted_to(other).binary(operator, &other.converted_to(self));
        let ty = ty.ok_or_else(|| OperatorError::Binary(operator, [self.ty.clone(), other.ty.clone()]))?;
        let divides = matches!(operator, BinaryOperator::Divide | BinaryOperator::Remainder);
        let value = match (&self.value, &other.value) {
            (Some(left), Some(right)) => left.binary(operator, right).map_err(OperatorError::NoValue)?,
            (None, Some(Value::Int(0))) if divides => {
                return Err(OperatorError::NoValue(NoValue::DivisionByZero));
            }
            _ => None,
        };
        Ok(Typed { ty, value })
    }

    /// Returns the type of `self` as an operand beside `other`. A constant beside a variable has the variable's type, if that
    /// can represent it: the result of `0.5 * x` has the precision of `x`.
    fn converted_to(&self, other: &Typed) -> Type {
        let is_constant = self.value.is_some() && other.value.is_none() && other.ty.is_number();
        if is_constant && self.ty.fits(self.value.as_ref(), &other.ty) {
            other.ty.clone()
        } else {
            self.ty.clone()
        }
    }
}

/// Resolves the name of a type, written in `of`; unknown if missing or unresolved.
pub fn type_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ty: Option<&TypeRef>,
) -> Type {
    let Some(ty) = ty else { return Type::Unknown };
    resolved(db, project, of.library(db).as_ref(), &ty.path).unwrap_or(Type::Unknown)
}

/// Resolves the type of a variable or parameter like [`type_of`]. `void` gives the unknown type; another fact reports it.
pub(crate) fn type_of_value<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ty: Option<&TypeRef>,
) -> Type {
    match type_of(db, project, of, ty) {
        Type::Void => Type::Unknown,
        ty => ty,
    }
}

/// Resolves the name of a type in a library.
pub(crate) fn resolved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: Option<&Name>,
    path: &[Name],
) -> Option<Type> {
    let workspace = project.workspace(db);
    if let [name] = path {
        if let Some(external) = external_types(db, workspace).get(name) {
            // An external type that is a C++ scalar is the built-in type.
            let scalar =
                built_in_type(external.cpp.trim_start_matches("std::")).filter(|ty| *ty != Type::Void);
            return Some(scalar.unwrap_or_else(|| Type::External(name.clone())));
        }
        if let Some(built_in) = built_in_type(name) {
            return Some(built_in);
        }
    }
    if let [package, name] = path
        && package == "ctypes"
    {
        return built_in_type(name);
    }
    let (package, _) = message_of(db, project, library, path)?;
    Some(Type::Message(package.name.clone(), path.last()?.clone()))
}

/// Returns whether `name` is a library of the project, a message package, or `ctypes`.
pub(crate) fn is_known_package<'db>(db: &'db dyn ModelDb, project: Project<'db>, name: &Name) -> bool {
    name.is_empty()
        || name == "ctypes"
        || names_of(db, project).has_library(name)
        || crate::messages::package(db, project.workspace(db), name).is_some()
}
