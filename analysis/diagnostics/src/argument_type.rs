//! # argument-type
//!
//! The type of an argument differs from that of its parameter. Only an `int` converts to `double` or `float` implicitly, and
//! only for `in` parameters.
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
use mauve_hir::fact::ParameterName;

pub(super) fn report<'db>(at: Location<'db>, of: &str, parameter: &ParameterName, expected: &Type, found: &Type) -> Diagnostic<'db> {
    let (parameter, expected, found) = (shown(parameter), type_name(expected), type_name(found));
    let message = format!("`{parameter}` of `{of}` is of type {expected}, and this is {found}");
    Diagnostic::new(&ARGUMENT_TYPE, at, message)
}

/// Returns the name of a parameter in messages.
pub(super) fn shown(parameter: &ParameterName) -> &str {
    match parameter {
        ParameterName::Named(name) => name,
        ParameterName::Result => "the result",
    }
}
