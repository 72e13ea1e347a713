//! # constant-expression
//!
//! The value of a property, a constant, an interval or a field of an activity cannot be computed before the robot runs. The
//! expression calls a function, names something other than a constant, divides by zero, or is out of range. Write
//! literals and operators; in a shell, the names of the shell's constants are allowed as well.
//!
//! ```mauve
//! codel now(): int
//! shell S {
//!   constant wheels: int = 2
//!   property motors: int = wheels * 2
//!   property speed: int = 10 / (2 - wheels)   // error
//!   property start: int = now()   // error
//!   property great: int = 0x80000000   // error
//!   property greatest: int = 2147483647
//! }
//! ```

use super::*;
use mauve_hir::fact::{NoValue, NotConstant};

pub(super) fn no_value<'db>(at: Location<'db>, why: NoValue) -> Diagnostic<'db> {
    let message = match why {
        NoValue::DivisionByZero => "division by zero",
        NoValue::TooLarge => "the result is out of range: an int is between -2147483648 and 2147483647",
        NoValue::GreaterThanGreatest => "this number is out of range: the greatest int is 2147483647",
        NoValue::DoubleLiteralTooLarge => "this number is out of range for a double",
        NoValue::DoubleTooLarge => "the result is out of range for a double",
        NoValue::StringTooLong => "this string is longer than 65536 bytes",
    };
    Diagnostic::new(&CONSTANT_EXPRESSION, at, message)
}

pub(super) fn not_constant<'db>(at: Location<'db>, why: &NotConstant) -> Diagnostic<'db> {
    let message = match why {
        NotConstant::Call(name) => {
            format!("`{name}` cannot be called here: this value is computed before the robot runs")
        }
        NotConstant::NotNameable(name) => {
            format!("`{name}` has no value here: write a number, a string, `true` or `false`")
        }
        NotConstant::Cycle(name) => format!("the value of `{name}` depends on itself"),
        NotConstant::NotOfShell(name) => format!("`{name}` is not a constant of this shell"),
    };
    Diagnostic::new(&CONSTANT_EXPRESSION, at, message)
}
