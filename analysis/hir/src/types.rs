//! Types: what a name of one means, what operators take and give, and which value fits where.

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
    /// A number without decimals.
    Integer(Integer),
    /// A number with decimals, of 32 bits.
    Float,
    /// A number with decimals, of 64 bits.
    Double,
    /// A text.
    String,
    /// No value at all: what a codel gives that gives nothing.
    Void,
    /// `no_data`, `old_data`, `new_data`.
    PortStatus,
    /// `failure`, `not_ready`, `success`.
    CallStatus,
    /// A call of an operation that is under way: what `send` gives and a handler holds.
    Handle(Name),
    /// A message of a ROS package: the package, and its name there.
    Message(Name, Name),
    /// A type that `mauve.toml` declares.
    External(Name),
    /// Nobody knows it, or why it is wrong is reported already: it fits everywhere.
    Unknown,
}

/// A kind of whole number.
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
    /// Returns its least and its greatest value.
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

    /// Returns whether it has every value of `other`.
    pub fn has_all_of(self, other: Integer) -> bool {
        let ((low, high), (least, greatest)) = (self.ends(), other.ends());
        low <= least && greatest <= high
    }

    /// What a calculation with two kinds gives: the one that has the values of both, `int` or wider.
    fn beside(self, other: Integer) -> Integer {
        let wider = [Integer::Int, Integer::Int64, self, other];
        let fits = wider.into_iter().find(|it| it.has_all_of(self) && it.has_all_of(other));
        fits.unwrap_or(Integer::Uint64)
    }

    /// Does it have this value?
    fn holds(self, value: i32) -> bool {
        let (low, high) = self.ends();
        (low..=high).contains(&value.into())
    }
}

/// What a codel or an operation takes and gives back.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Signature {
    /// Its parameters.
    pub parameters: Vec<(Direction, Name, Type)>,
    /// The type of its result.
    pub result: Type,
}

impl Signature {
    /// Whether both take and give back the same.
    pub(crate) fn is(&self, other: &Signature) -> bool {
        let same = |((one, _, a), (two, _, b)): (&(Direction, Name, Type), &(Direction, Name, Type))| {
            one == two && a.is(b)
        };
        self.parameters.len() == other.parameters.len()
            && self.parameters.iter().zip(&other.parameters).all(same)
            && self.result.is(&other.result)
    }
}

/// The type that every model knows by this name: those of the language, and the scalars of C (`ctypes`).
///
/// ```
/// use mauve_hir::{Type, built_in_type};
/// assert_eq!(built_in_type("double"), Some(Type::Double));
/// assert_eq!(built_in_type("uint8_t"), built_in_type("uint8"));
/// assert_eq!(built_in_type("Pose"), None);
/// ```
pub fn built_in_type(name: &str) -> Option<Type> {
    let mut all = LANGUAGE_TYPES.iter().chain(&C_TYPES);
    all.find(|(known, _)| *known == name).map(|(_, ty)| ty.clone())
}

/// The names of [`built_in_type`] that are the language's own, and what they mean.
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

/// The others: the scalars of C.
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

    /// Returns how a model writes the type; none where it has no name there.
    pub fn written(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Type::Bool => "bool",
            Type::Integer(integer) => match integer {
                Integer::Int => "int",
                Integer::Char => "char",
                Integer::Short => "short",
                Integer::Long => "long",
                Integer::Int8 => "int8",
                Integer::Int64 => "int64",
                Integer::Uint8 => "uint8",
                Integer::Uint16 => "uint16",
                Integer::Uint32 => "uint32",
                Integer::Uint64 => "uint64",
                Integer::Size => "size_t",
            },
            Type::Float => "float",
            Type::Double => "double",
            Type::String => "string",
            Type::Void => "void",
            Type::Message(package, name) => return Some(Cow::Owned(format!("{package}.{name}"))),
            Type::External(name) => name,
            Type::PortStatus => "port_status",
            Type::CallStatus => "call_status",
            Type::Handle(_) | Type::Unknown => return None,
        }))
    }

    /// Is it a number?
    pub fn is_number(&self) -> bool {
        matches!(self, Type::Integer(_) | Type::Float | Type::Double)
    }

    /// Returns whether it is what no operator takes: a call that is under way, or no value at all.
    pub fn is_no_operand(&self) -> bool {
        matches!(self, Type::Handle(_) | Type::Void)
    }

    /// Are the two the same, as far as anybody knows?
    pub fn is(&self, other: &Type) -> bool {
        self == other || matches!(self, Type::Unknown) || matches!(other, Type::Unknown)
    }

    /// Does a value of this type, which is `constant` where that is known, fit where `wanted` is asked for? `int` becomes
    /// decimal, and a number becomes one of a type that has all of its values; nothing else changes silently, but for
    /// constants that the other type has as well.
    pub fn fits(&self, constant: Option<&Value>, wanted: &Type) -> bool {
        match (self, wanted, constant) {
            (&Type::INT, Type::Double | Type::Float, _) | (Type::Float, Type::Double, _) => true,
            (Type::Integer(one), Type::Integer(other), _) if other.has_all_of(*one) => true,
            (Type::Double, Type::Float, Some(_)) => true,
            (&Type::INT, Type::Integer(integer), Some(Value::Int(value))) => integer.holds(*value),
            _ => self.is(wanted),
        }
    }

    /// What a binary operator gives; none where it does not take these.
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
            Op::Remainder => are(|it| matches!(it, Type::Integer(_))).then(|| self.joined(other)),
            _ => are(Type::is_number).then(|| self.joined(other)),
        }
    }

    /// What a calculation with two kinds of number gives.
    fn joined(&self, other: &Type) -> Type {
        match (self, other) {
            (Type::Unknown, _) | (_, Type::Unknown) => Type::Unknown,
            (Type::Double, _) | (_, Type::Double) => Type::Double,
            (Type::Float, _) | (_, Type::Float) => Type::Float,
            (one, two) if one == two => one.clone(),
            (Type::Integer(one), Type::Integer(two)) => Type::Integer(one.beside(*two)),
            _ => Type::INT,
        }
    }

    /// What a unary operator gives; none where it does not take this.
    pub fn unary(&self, operator: UnaryOperator) -> Option<Type> {
        match (operator, self) {
            (UnaryOperator::Not, Type::Bool | Type::Unknown) => Some(Type::Bool),
            (UnaryOperator::Minus, it) if it.is_number() || *it == Type::Unknown => Some(it.clone()),
            _ => None,
        }
    }
}

/// The type of an expression, and its value where that is constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Typed {
    pub(crate) ty: Type,
    pub(crate) value: Option<Value>,
}

/// Why an operation gives nothing.
pub(crate) enum Wrong {
    /// The operator does not take the operand.
    Unary(UnaryOperator, Type),
    /// The operator does not take the operands.
    Binary(BinaryOperator, [Type; 2]),
    /// It has no value.
    NoValue(NoValue),
}

impl Typed {
    pub(crate) const UNKNOWN: Typed = Typed { ty: Type::Unknown, value: None };

    pub(crate) fn of(ty: Type) -> Typed {
        Typed { ty, value: None }
    }

    /// A literal.
    pub(crate) fn literal(literal: &Literal) -> Result<Typed, Wrong> {
        let value = Value::of_literal(literal).map_err(Wrong::NoValue)?;
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

    /// The least whole number, which has one digit more than the greatest: `operator` before `inner`, if it is that.
    pub(crate) fn least(operator: UnaryOperator, inner: &Expr) -> Option<Typed> {
        match (operator, inner) {
            (UnaryOperator::Minus, Expr::Literal(Literal::Int(text), _)) if *text == "2147483648" => {
                Some(Typed { ty: Type::INT, value: Some(Value::Int(i32::MIN)) })
            }
            _ => None,
        }
    }

    /// What a unary operator gives.
    pub(crate) fn unary(&self, operator: UnaryOperator) -> Result<Typed, Wrong> {
        let ty = self.ty.unary(operator).ok_or_else(|| Wrong::Unary(operator, self.ty.clone()))?;
        let value =
            self.value.as_ref().map(|value| value.unary(operator)).transpose().map_err(Wrong::NoValue)?;
        Ok(Typed { ty, value: value.flatten() })
    }

    /// What a binary operator gives.
    pub(crate) fn binary(&self, operator: BinaryOperator, other: &Typed) -> Result<Typed, Wrong> {
        let ty = self.beside(other).binary(operator, &other.beside(self));
        let ty = ty.ok_or_else(|| Wrong::Binary(operator, [self.ty.clone(), other.ty.clone()]))?;
        let divides = matches!(operator, BinaryOperator::Divide | BinaryOperator::Remainder);
        let value = match (&self.value, &other.value) {
            (Some(left), Some(right)) => left.binary(operator, right).map_err(Wrong::NoValue)?,
            (None, Some(Value::Int(0))) if divides => return Err(Wrong::NoValue(NoValue::DivisionByZero)),
            _ => None,
        };
        Ok(Typed { ty, value })
    }

    /// A constant beside a variable that it fits is of that variable's type: `0.5 * x` is as exact as `x`.
    fn beside(&self, other: &Typed) -> Type {
        let is_constant = self.value.is_some() && other.value.is_none() && other.ty.is_number();
        if is_constant && self.ty.fits(self.value.as_ref(), &other.ty) {
            other.ty.clone()
        } else {
            self.ty.clone()
        }
    }
}

/// What the name of a type, written in `of`, means.
pub fn type_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ty: Option<&TypeRef>,
) -> Type {
    let Some(ty) = ty else { return Type::Unknown };
    resolved(db, project, of.library(db).as_ref(), &ty.path).unwrap_or(Type::Unknown)
}

/// [`type_of`] for what holds a value. That none is of type `void` is reported where it is declared.
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

/// What the name of a type means in a library; nothing, where nobody knows it.
pub(crate) fn resolved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: Option<&Name>,
    path: &[Name],
) -> Option<Type> {
    let workspace = project.workspace(db);
    if let [name] = path {
        if let Some(external) = external_types(db, workspace).get(name) {
            // A type that is a number in C++ is that number here too.
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

/// Is this the name of a library of the project, of a message package, or `ctypes`?
pub(crate) fn is_known_package<'db>(db: &'db dyn ModelDb, project: Project<'db>, name: &Name) -> bool {
    name.is_empty()
        || name == "ctypes"
        || names_of(db, project).has_library(name)
        || crate::messages::package(db, project.workspace(db), name).is_some()
}
