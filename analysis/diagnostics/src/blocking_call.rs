//! # blocking-call
//!
//! A program calls a required operation like a function. Such a call would wait for another component, and components never
//! wait for one another: a response time would depend on the other component's. Start the call with `send`, and fetch its
//! result with `collect`, in this period or a later one.
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
//!
//! Fix, where the result is not used and the core has a handler for the operation: start the call with `send`.

use super::*;
use mauve_hir::fact::SendInstead;

pub(super) fn report<'db>(at: Location<'db>, name: &str, send: Option<&SendInstead>) -> Diagnostic<'db> {
    let message =
        format!("`{name}` is an operation of another component, and a direct call would wait for it: use `send` and `collect`");
    let found = Diagnostic::new(&BLOCKING_CALL, at.clone(), message);
    let (Some(SendInstead { handler, call, first }), &Location::Source(of, _)) = (send, &at) else { return found };
    let edits = match *first {
        Some(first) => vec![(at, format!("{handler} = send")), (Location::Before(of, first), format!("{name}, "))],
        None => vec![(Location::Source(of, *call), format!("{handler} = send({name})"))],
    };
    Diagnostic { fixes: vec![Fix { title: format!("Start the call with `{handler} = send({name}…)`"), edits }], ..found }
}
