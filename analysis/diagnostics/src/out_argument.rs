//! # out-argument
//!
//! What comes back through an `out` or `inout` parameter needs a variable to go to: so does what `read` and `collect` give.
//!
//! ```mauve
//! codel measure(out distance: double): bool
//! shell S { property least: double = 0.5  input port scan: int }
//! core C(S) {
//!   var distance: double
//!   update = {
//!     measure(0.5);   // error
//!     measure(least);   // error
//!     measure(distance);
//!     read(scan, 3);   // error
//!   }
//! }
//! ```

use super::*;
use mauve_hir::fact::ParameterName;

code!(OUT_ARGUMENT, Error, "out-argument");

pub(super) fn report<'db>(at: Location<'db>, of: &str, parameter: &ParameterName) -> Diagnostic<'db> {
    let parameter = argument_type::shown(parameter);
    let message = format!("`{of}` gives back `{parameter}`: this must be a variable");
    Diagnostic::new(&OUT_ARGUMENT, at, message)
}
