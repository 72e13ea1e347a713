//! # unresolved-variable
//!
//! A name in a program is no variable of the block, the operation, the state machine or the core, and no feature of the
//! shell. Or it is a codel or an operation that is not called: then time may be missing in the program, and it is not
//! analysed.
//!
//! ```mauve
//! codel plan(in speed: int): int
//! shell S { property fast: int }
//! core C(S) {
//!   var speed: int = 0
//!   update = {
//!     speed = fsat;   // error
//!     speed = plan;   // error
//!     { var local: int = plan(fast); }
//!     speed = local;   // error
//!     speed = plan(fast);
//!   }
//! }
//! ```

use super::*;
use mauve_hir::{Builtin, Operand};

code!(UNRESOLVED_VARIABLE, Error, "unresolved-variable");

pub(super) fn report<'db>(at: Location<'db>, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    if let Some((message, written)) = foreign_syntax::value(name) {
        return Diagnostic::new(&UNRESOLVED_VARIABLE, at, message).writing(written);
    }
    let message = format!("no variable or property `{name}`");
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, message).did_you_mean(near)
}

/// Reports the first argument of `read`, `send` or `collect`.
pub(super) fn operand<'db>(at: Location<'db>, function: Builtin, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    let what = match function.operand() {
        Operand::Port(_) => "port",
        Operand::Operation => "required operation",
        Operand::Handler => "handler",
    };
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, format!("no {what} `{name}`")).did_you_mean(near)
}

/// Reports a port that is used as a value.
pub(super) fn port<'db>(at: Location<'db>, name: &str, kind: FeatureKind) -> Diagnostic<'db> {
    let message = match kind {
        FeatureKind::Input => format!("`{name}` is a port: `read({name}, variable)` takes its value"),
        _ => format!("`{name}` is an output port, which has no value to take"),
    };
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, message)
}

/// Reports a codel or an operation that is used as a value.
pub(super) fn not_called<'db>(at: Location<'db>, name: &str, is_operation: bool) -> Diagnostic<'db> {
    let what = if is_operation { "an operation" } else { "a codel" };
    let message = format!("`{name}` is {what}: call it, as in `{name}(…)`");
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, message)
}
