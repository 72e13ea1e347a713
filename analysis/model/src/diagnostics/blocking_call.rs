//! # blocking-call
//!
//! A required operation called like a function would wait for its result, and components never wait for one another
//! (Property 2 of the paper). Start it with `send`, and ask for its result with `collect`.
//!
//! ```mauve
//! shell S { require plan(): int }
//! core C(S) {
//!   handler h: plan
//!   var way: int
//!   update = {
//!     way = plan();   // error
//!     h = send(plan);
//!     collect(h, way);
//!   }
//! }
//! ```

use super::*;

code!(BLOCKING_CALL, Error, "blocking-call");

pub(crate) fn report<'db>(at: Place<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("`{name}` is required of another component, and calling it would wait: use `send` and `collect`");
    Diagnostic::new(&BLOCKING_CALL, at, message)
}
