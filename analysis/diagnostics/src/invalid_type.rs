//! # invalid-type
//!
//! `void` is what a codel or an operation gives that gives nothing: nothing else can have that type. An interval is for
//! numbers.
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

code!(INVALID_TYPE, Error, "invalid-type");

pub(super) fn void<'db>(at: Location<'db>) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_TYPE, at, "nothing is of type `void`: it is for what gives no result")
}

pub(super) fn interval<'db>(at: Location<'db>, found: &Type) -> Diagnostic<'db> {
    let message = format!("an interval is for numbers, and this is {}", type_name(found));
    Diagnostic::new(&INVALID_TYPE, at, message)
}
