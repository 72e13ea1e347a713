//! # argument-type
//!
//! An argument has another type than the parameter that it is for. Only `int` becomes `double` or `float` by itself, and for
//! `out` and `inout` parameters not even that.
//!
//! ```mauve
//! codel drive(in speed: double, out done: bool): void
//! shell S { }
//! core C(S) {
//!   var n: int = 0
//!   var done: bool
//!   update = {
//!     drive("fast", done);   // error
//!     drive(2, n);   // error
//!     drive(2, done);
//!   }
//! }
//! ```

use super::*;

code!(ARGUMENT_TYPE, Error, "argument-type");

pub(crate) fn report<'db>(at: Place<'db>, of: &str, parameter: &str, expected: &Type, found: &Type) -> Diagnostic<'db> {
    let message = format!("`{parameter}` of `{of}` is of type {expected}, and this is {found}");
    Diagnostic::new(&ARGUMENT_TYPE, at, message)
}
