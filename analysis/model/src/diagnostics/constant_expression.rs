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

code!(CONSTANT_EXPRESSION, Error, "constant-expression");

pub(crate) fn report<'db>(at: Place<'db>, why: impl Into<String>) -> Diagnostic<'db> {
    Diagnostic::new(&CONSTANT_EXPRESSION, at, why.into())
}
