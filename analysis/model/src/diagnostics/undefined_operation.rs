//! # undefined-operation
//!
//! A program calls an operation that the shell provides, and the core does not define.
//!
//! ```mauve
//! shell S { provide reset(): void  provide stop(): void }
//! core C(S) {
//!   provide reset() = { }
//!   update = {
//!     reset();
//!     stop();   // error
//!   }
//! }
//! ```

use super::*;

code!(UNDEFINED_OPERATION, Error, "undefined-operation");

pub(crate) fn report<'db>(at: Place<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("the core does not define `{name}`: write `provide {name}(…) = {{ … }}`");
    Diagnostic::new(&UNDEFINED_OPERATION, at, message)
}
