//! # constant-expression
//!
//! The value of a property, a constant, an interval or a setting is no constant: it names something that has no value before
//! the robot runs, divides by zero, or is greater than a number can be. A shell's values may name its constants.
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

code!(CONSTANT_EXPRESSION, Error, "constant-expression");

pub(super) fn no_value<'db>(at: Location<'db>, why: NoValue) -> Diagnostic<'db> {
    let message = match why {
        NoValue::DivisionByZero => "this divides by zero",
        NoValue::TooLarge => "this is too great for a whole number: they have 32 bits",
        NoValue::GreaterThanGreatest => "whole numbers end at 2147483647",
        NoValue::DoubleLiteralTooLarge => "this number is too great for a double",
        NoValue::DoubleTooLarge => "this is too great for a double",
        NoValue::StringTooLong => "this text is longer than 65536 bytes",
    };
    Diagnostic::new(&CONSTANT_EXPRESSION, at, message)
}

pub(super) fn not_constant<'db>(at: Location<'db>, why: &NotConstant) -> Diagnostic<'db> {
    let message = match why {
        NotConstant::Call(name) => format!("`{name}` is called when the robot runs: this value is there before"),
        NotConstant::NotNameable(name) => {
            format!("`{name}` has no value here: write a number, a text, true or false")
        }
        NotConstant::Cycle(name) => format!("the value of `{name}` rests on itself"),
        NotConstant::NotOfShell(name) => format!("`{name}` is no constant of this shell"),
    };
    Diagnostic::new(&CONSTANT_EXPRESSION, at, message)
}
