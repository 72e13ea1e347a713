//! # unresolved-variable
//!
//! A name in a program is neither a variable of the block, the operation, the state machine or the core, nor a property or
//! constant of the shell. Or it is a codel or an operation without a call: the program may lack execution time, and is not
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
use mauve_syntax::keywords::LITERALS;

pub(super) fn report<'db>(at: Location<'db>, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    // `True`, and `NewData` of Orocos.
    let letters = |name: &str| name.replace('_', "").to_lowercase();
    let literal = LITERALS.into_iter().find(|it| letters(it) == letters(name));
    let message = format!("no variable or property `{name}`");
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, message).did_you_mean(literal.map(Name::from).or(near))
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

/// Reports a port that is used as a value; `is_status`: beside a port status.
pub(super) fn port<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    name: &str,
    kind: FeatureKind,
    is_status: bool,
) -> Diagnostic<'db> {
    let new = |message: String| Diagnostic::new(&UNRESOLVED_VARIABLE, at.clone(), message);
    if kind != FeatureKind::Input {
        return new(format!("`{name}` is an output port, which has no value to read"));
    }
    if is_status {
        let found = new(format!("`{name}` is an input port: write `status({name})` for its status"));
        return found.fix(format!("Write `status({name})`"), at.clone(), format!("status({name})"));
    }
    let found =
        new(format!("`{name}` is an input port, not a value: `read({name}, variable)` copies its value"));
    match statement::assignment_at(db, &at).filter(|it| it.value == name) {
        Some(assignment) => assignment.replaced(found, format!("read({name}, {})", assignment.target)),
        None => found,
    }
}

/// Reports a codel or an operation that is used as a value; `takes_nothing`: a codel without parameters.
pub(super) fn not_called<'db>(
    at: Location<'db>,
    name: &str,
    is_operation: bool,
    takes_nothing: bool,
) -> Diagnostic<'db> {
    let what = if is_operation { "an operation" } else { "a codel" };
    if takes_nothing {
        let message = format!("`{name}` is {what}: call it as `{name}()`");
        let found = Diagnostic::new(&UNRESOLVED_VARIABLE, at.clone(), message);
        return found.fix(format!("Write `{name}()`"), at, format!("{name}()"));
    }
    let message = format!("`{name}` is {what}: call it, as in `{name}(…)`");
    Diagnostic::new(&UNRESOLVED_VARIABLE, at, message)
}
