//! # invalid-type
//!
//! `void` is the result type of a codel or an operation without a result, and no variable, parameter, port or property has
//! this type. Only numbers have an interval.
//!
//! ```mauve
//! codel stop(in now: void): void   // error
//! shell S {
//!   property name: string ["a"; "b"] = "a"   // error
//!   property speed: double [0; 2] = 1
//!   input port nothing: void   // error
//! }
//! core C(S) { var n: void  update = { } }   // error
//! ```

use super::*;

pub(super) fn void<'db>(at: Location<'db>) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_TYPE, at, "`void` is only a result type: a value needs another type")
}

pub(super) fn interval<'db>(at: Location<'db>, found: &Type) -> Diagnostic<'db> {
    let message = format!("an interval is for numbers, and this is {}", type_name(found));
    Diagnostic::new(&INVALID_TYPE, at, message)
}
