//! # operation-definition
//!
//! The core defines an operation otherwise than its shell declares it: other parameters, or another result. (The names of
//! parameters may differ.)
//!
//! ```mauve
//! shell S { provide near(in far: double): bool  provide stop(): void }
//! core C(S) {
//!   provide near(in far: int): bool = { return far < 2; }   // error
//!   provide stop() = { }
//!   update = { }
//! }
//! ```

use super::*;

code!(OPERATION_DEFINITION, Error, "operation-definition");

pub(crate) fn report<'db>(at: Place<'db>, declared: &str, defined: &str, declared_at: Place<'db>) -> Diagnostic<'db> {
    let message = format!("this is `{defined}`, and the shell declares `{declared}`");
    Diagnostic::new(&OPERATION_DEFINITION, at, message).related(declared_at, "declared here")
}
