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
//!
//! Fix, where nothing takes the result and there is a handler: start it with `send`.

use super::*;
use mauve_hir::fact::SendInstead;

code!(BLOCKING_CALL, Error, "blocking-call");

pub(super) fn report<'db>(at: Location<'db>, name: &str, send: Option<&SendInstead>) -> Diagnostic<'db> {
    let message =
        format!("`{name}` is required of another component, and calling it would wait: use `send` and `collect`");
    let found = Diagnostic::new(&BLOCKING_CALL, at.clone(), message);
    let (Some(SendInstead { handler, call, first }), &Location::Source(of, _)) = (send, &at) else { return found };
    let edits = match *first {
        Some(first) => vec![(at, format!("{handler} = send")), (Location::Before(of, first), format!("{name}, "))],
        None => vec![(Location::Source(of, *call), format!("{handler} = send({name})"))],
    };
    Diagnostic { fixes: vec![Fix { title: format!("Start it with `{handler} = send({name}…)`"), edits }], ..found }
}
