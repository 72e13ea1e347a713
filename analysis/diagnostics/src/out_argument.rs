//! # out-argument
//!
//! The argument for an `out` or `inout` parameter is not a variable. `read` and `collect` also need variables for their values.
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

pub(super) fn report<'db>(at: Location<'db>, of: &str, parameter: &ParameterName) -> Diagnostic<'db> {
    let parameter = argument_type::shown(parameter);
    let message = format!("`{of}` returns a value in `{parameter}`, so its argument must be a variable");
    Diagnostic::new(&OUT_ARGUMENT, at, message)
}
