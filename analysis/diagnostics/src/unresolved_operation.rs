//! # unresolved-operation
//!
//! A handler names an operation that the shell of its core does not require.
//!
//! ```mauve
//! shell S { require plan(): int  provide stop(): void }
//! core C(S) {
//!   handler a: paln   // error
//!   handler b: stop   // error
//!   handler c: plan
//!   provide stop() = { }
//!   update = { }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str, shell: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no required operation `{name}` in {shell}: a handler is for one");
    Diagnostic::new(&UNRESOLVED_OPERATION, at, message).did_you_mean(near)
}
