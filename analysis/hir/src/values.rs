//! Constant values: what an expression without variables gives, computed as the generated C++ would.

use std::fmt;

use crate::item_tree::{BinaryOperator, Literal, UnaryOperator};

/// A constant.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub enum Value {
    Bool(bool),
    /// 32 bits, as in C++.
    Int(i32),
    Double(f64),
    String(String),
}

// Bits rather than numbers, so that a value that is no number equals itself.
impl PartialEq for Value {
    fn eq(&self, other: &Value) -> bool {
        match (self, other) {
            (Value::Bool(a), Value::Bool(b)) => a == b,
            (Value::Int(a), Value::Int(b)) => a == b,
            (Value::Double(a), Value::Double(b)) => a.to_bits() == b.to_bits(),
            (Value::String(a), Value::String(b)) => a == b,
            _ => false,
        }
    }
}

impl Eq for Value {}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(value) => write!(f, "{value}"),
            Value::Int(value) => write!(f, "{value}"),
            Value::Double(value) => write!(f, "{value}"),
            Value::String(value) => write!(f, "{value:?}"),
        }
    }
}

/// In bytes.
const LONGEST_TEXT: usize = 1 << 16;

/// Why a constant expression has no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum NoValue {
    DivisionByZero,
    TooLarge,
    /// An integer that is greater than the greatest.
    GreaterThanGreatest,
    /// A literal that is too large for a double.
    DoubleLiteralTooLarge,
    DoubleTooLarge,
    StringTooLong,
}

impl Value {
    /// As a number.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Int(value) => Some(f64::from(*value)),
            Value::Double(value) => Some(*value),
            Value::Bool(_) | Value::String(_) => None,
        }
    }

    /// The value of a literal; nothing for a status.
    ///
    /// # Errors
    ///
    /// It is a number that is too great.
    pub fn of_literal(literal: &Literal) -> Result<Option<Value>, NoValue> {
        Ok(Some(match literal {
            Literal::Bool(value) => Value::Bool(*value),
            Literal::String(value) => Value::String(value.to_string()),
            Literal::Int(text) => Value::Int(whole_number(text).ok_or(NoValue::GreaterThanGreatest)?),
            Literal::Float(text) => match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Value::Double(value),
                _ => return Err(NoValue::DoubleLiteralTooLarge),
            },
            Literal::PortStatus(_) | Literal::CallStatus(_) => return Ok(None),
        }))
    }

    /// What a unary operator gives; nothing where it does not take this.
    ///
    /// # Errors
    ///
    /// It has no value.
    pub fn unary(&self, operator: UnaryOperator) -> Result<Option<Value>, NoValue> {
        Ok(match (operator, self) {
            (UnaryOperator::Not, Value::Bool(value)) => Some(Value::Bool(!value)),
            (UnaryOperator::Minus, Value::Int(value)) => {
                Some(Value::Int(value.checked_neg().ok_or(NoValue::GreaterThanGreatest)?))
            }
            (UnaryOperator::Minus, Value::Double(value)) => Some(Value::Double(-value)),
            _ => None,
        })
    }

    /// What a binary operator gives; nothing where it does not take these.
    ///
    /// # Errors
    ///
    /// It has no value.
    pub fn binary(&self, operator: BinaryOperator, other: &Value) -> Result<Option<Value>, NoValue> {
        use BinaryOperator as Op;
        Ok(Some(match (self, other) {
            (Value::Bool(a), Value::Bool(b)) => Value::Bool(match operator {
                Op::Or => *a || *b,
                Op::And => *a && *b,
                Op::Equal => a == b,
                Op::NotEqual => a != b,
                _ => return Ok(None),
            }),
            (Value::String(a), Value::String(b)) => match operator {
                // One that is joined with itself again and again has no end.
                Op::Add if a.len() + b.len() > LONGEST_TEXT => return Err(NoValue::StringTooLong),
                Op::Add => Value::String(format!("{a}{b}")),
                Op::Equal => Value::Bool(a == b),
                Op::NotEqual => Value::Bool(a != b),
                _ => return Ok(None),
            },
            (Value::Int(a), Value::Int(b)) => match operator {
                Op::Divide | Op::Remainder if *b == 0 => return Err(NoValue::DivisionByZero),
                Op::Add => Value::Int(a.checked_add(*b).ok_or(NoValue::TooLarge)?),
                Op::Subtract => Value::Int(a.checked_sub(*b).ok_or(NoValue::TooLarge)?),
                Op::Multiply => Value::Int(a.checked_mul(*b).ok_or(NoValue::TooLarge)?),
                Op::Divide => Value::Int(a.checked_div(*b).ok_or(NoValue::TooLarge)?),
                Op::Remainder => Value::Int(a.checked_rem(*b).ok_or(NoValue::TooLarge)?),
                _ => return Ok(compared(operator, f64::from(*a), f64::from(*b))),
            },
            _ => {
                let (Some(a), Some(b)) = (self.number(), other.number()) else { return Ok(None) };
                let value = match operator {
                    Op::Divide if b == 0.0 => return Err(NoValue::DivisionByZero),
                    Op::Add => a + b,
                    Op::Subtract => a - b,
                    Op::Multiply => a * b,
                    Op::Divide => a / b,
                    _ => return Ok(compared(operator, a, b)),
                };
                if !value.is_finite() {
                    return Err(NoValue::DoubleTooLarge);
                }
                Value::Double(value)
            }
        }))
    }
}

impl Value {
    /// As it is written in a model.
    pub fn text(&self) -> String {
        match self {
            Value::Double(value) => format!("{value:?}"),
            other => other.to_string(),
        }
    }
}

fn compared(operator: BinaryOperator, a: f64, b: f64) -> Option<Value> {
    Some(Value::Bool(match operator {
        BinaryOperator::Equal => a == b,
        BinaryOperator::NotEqual => a != b,
        BinaryOperator::Less => a < b,
        BinaryOperator::LessOrEqual => a <= b,
        BinaryOperator::Greater => a > b,
        BinaryOperator::GreaterOrEqual => a >= b,
        _ => return None,
    }))
}

/// INT, decimal or `0x…`, of 32 bits.
pub fn whole_number(text: &str) -> Option<i32> {
    let number = match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => i64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    i32::try_from(number.ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use BinaryOperator as Op;

    #[test]
    fn whole_numbers_are_those_of_cpp() {
        let int = Value::Int;
        assert_eq!(int(7).binary(Op::Divide, &int(-2)), Ok(Some(int(-3))));
        assert_eq!(int(7).binary(Op::Remainder, &int(-2)), Ok(Some(int(1))));
        assert_eq!(int(i32::MAX).binary(Op::Add, &int(1)), Err(NoValue::TooLarge));
        assert_eq!(int(i32::MIN).binary(Op::Divide, &int(-1)), Err(NoValue::TooLarge));
        assert_eq!(int(1).binary(Op::Divide, &int(0)), Err(NoValue::DivisionByZero));
        assert_eq!(int(1).binary(Op::Divide, &Value::Double(0.0)), Err(NoValue::DivisionByZero));
        assert_eq!(int(1).binary(Op::Divide, &Value::Double(2.0)), Ok(Some(Value::Double(0.5))));
        assert_eq!(whole_number("0x7fffffff"), Some(i32::MAX));
        assert_eq!(whole_number("2147483648"), None);
        assert_eq!(whole_number("010"), Some(10));
    }

    #[test]
    fn texts_are_joined_up_to_a_limit() {
        let text = |text: &str| Value::String(text.to_owned());
        assert_eq!(text("/dev").binary(Op::Add, &text("/tty0")), Ok(Some(text("/dev/tty0"))));
        let half = text(&"a".repeat(LONGEST_TEXT / 2));
        let whole = half.binary(Op::Add, &half).unwrap().unwrap();
        assert_eq!(whole.binary(Op::Add, &text("a")), Err(NoValue::StringTooLong));
    }
}
