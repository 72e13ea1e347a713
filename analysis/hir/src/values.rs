//! Constant values, evaluated with the semantics of the generated C++.

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

// Compares bits, so that NaN equals itself.
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

/// Shows a double with at most 15 significant digits, without the rounding errors of a computation: `0.38 + 2.0 * 0.1` is `0.58`.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(value) => write!(f, "{value}"),
            Value::Int(value) => write!(f, "{value}"),
            Value::Double(value) => write!(f, "{}", rounded(*value)),
            Value::String(value) => write!(f, "{value:?}"),
        }
    }
}

/// The maximum length of a constant string, in bytes.
const MAX_STRING: usize = 1 << 16;

/// Why a constant expression has no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum NoValue {
    DivisionByZero,
    TooLarge,
    /// An integer above the maximum of `int`.
    GreaterThanGreatest,
    /// A literal that is too large for a double.
    DoubleLiteralTooLarge,
    DoubleTooLarge,
    StringTooLong,
}

impl Value {
    /// Returns the value as a number; `None` for other types.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Int(value) => Some(f64::from(*value)),
            Value::Double(value) => Some(*value),
            Value::Bool(_) | Value::String(_) => None,
        }
    }

    /// Returns the value of a literal; `None` for a status.
    ///
    /// # Errors
    ///
    /// The number is out of range.
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

    /// Returns the result of a unary operator; `None` if the operator does not take the type.
    ///
    /// # Errors
    ///
    /// The result is undefined or out of range.
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

    /// Returns the result of a binary operator; `None` if the operator does not take the types.
    ///
    /// # Errors
    ///
    /// The result is undefined or out of range.
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
                // Repeated concatenation grows exponentially.
                Op::Add if a.len() + b.len() > MAX_STRING => return Err(NoValue::StringTooLong),
                Op::Add => Value::String(format!("{a}{b}")),
                Op::Equal => Value::Bool(a == b),
                Op::NotEqual => Value::Bool(a != b),
                _ => return Ok(None),
            },
            (Value::Int(a), Value::Int(b)) => {
                let value = match operator {
                    Op::Divide | Op::Remainder if *b == 0 => return Err(NoValue::DivisionByZero),
                    Op::Add => a.checked_add(*b),
                    Op::Subtract => a.checked_sub(*b),
                    Op::Multiply => a.checked_mul(*b),
                    Op::Divide => a.checked_div(*b),
                    Op::Remainder => a.checked_rem(*b),
                    _ => return Ok(compared(operator, f64::from(*a), f64::from(*b))),
                };
                Value::Int(value.ok_or(NoValue::TooLarge)?)
            }
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

    /// Returns the value as written in a model.
    ///
    /// A double is exact, except where it is at most 4 rounding errors from a number with 15 digits: the computation has lost as
    /// much before.
    ///
    /// ```
    /// use mauve_hir::Value;
    /// assert_eq!(Value::Double(0.38 + 2.0 * 0.1).text(), "0.58");
    /// assert_eq!(Value::Double(2.0 / 3.0).text(), "0.6666666666666666");
    /// ```
    pub fn text(&self) -> String {
        match self {
            Value::Double(value) => {
                let short = rounded(*value);
                let is_as_good = (short - value).abs() <= 2.0 * f64::EPSILON * value.abs();
                format!("{:?}", if is_as_good { short } else { *value })
            }
            other => other.to_string(),
        }
    }
}

/// Returns a double rounded to 15 significant digits: each decimal number of that many digits is a double of its own.
fn rounded(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
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

/// Parses an integer, decimal or `0x…`; `None` if it exceeds 32 bits.
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
    fn integers_have_the_semantics_of_cpp() {
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
    fn a_computed_double_has_no_digits_of_rounding_errors() {
        let (shown, written) =
            (|value: f64| Value::Double(value).to_string(), |it: f64| Value::Double(it).text());
        assert_eq!([shown(0.38 + 2.0 * 0.1), shown(0.1 + 0.2), shown(1.1 * 3.0)], ["0.58", "0.3", "3.3"]);
        assert_eq!(
            [written(0.38 + 2.0 * 0.1), written(0.1 + 0.2), written(1.1 * 3.0)],
            ["0.58", "0.3", "3.3"]
        );
        assert_eq!(
            [shown(1.0 / 3.0), shown(1e300), shown(0.0)],
            ["0.333333333333333", &format!("1{}", "0".repeat(300)), "0"]
        );
        // A literal stays what the author wrote.
        for literal in ["0.58", "-2.09", "123456789.012345", "1e-300", "0.3333333333333333", "4.0"] {
            let value: f64 = literal.parse().unwrap();
            assert_eq!(written(value).parse::<f64>().unwrap().to_bits(), value.to_bits(), "{literal}");
        }
    }

    #[test]
    fn strings_are_concatenated_up_to_a_limit() {
        let text = |text: &str| Value::String(text.to_owned());
        assert_eq!(text("/dev").binary(Op::Add, &text("/tty0")), Ok(Some(text("/dev/tty0"))));
        let half = text(&"a".repeat(MAX_STRING / 2));
        let longest = half.binary(Op::Add, &half).unwrap().unwrap();
        assert_eq!(longest.binary(Op::Add, &text("a")), Err(NoValue::StringTooLong));
    }
}
