//! # port-direction
//!
//! A program reads an output port or writes an input port. `read` and `status` need an input port, `write` needs an output
//! port.
//!
//! ```mauve
//! shell S { input port scan: int  output port way: int }
//! core C(S) {
//!   var n: int = 0
//!   update = {
//!     read(way, n);   // error
//!     read(scan, n);
//!     write(scan, n);   // error
//!     write(way, n);
//!   }
//! }
//! ```

use super::*;
use mauve_hir::Builtin;

pub(super) fn report<'db>(at: Location<'db>, function: Builtin, port: &str, is: FeatureKind) -> Diagnostic<'db> {
    let message = match is {
        FeatureKind::Output => format!("`{port}` is an output port, but `{function}` needs an input port"),
        _ => format!("`{port}` is an input port, but `{function}` needs an output port"),
    };
    Diagnostic::new(&PORT_DIRECTION, at, message)
}
