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

code!(BLOCKING_CALL, Error, "blocking-call");

/// A call whose result nobody takes: the handler for it, all of the call, its first argument.
pub(crate) type Statement<'a> = (&'a str, Part, Option<Part>);

pub(crate) fn report<'db>(
    of: Decl<'db>,
    NameRef { name, part }: &NameRef,
    statement: Option<Statement<'_>>,
) -> Diagnostic<'db> {
    let at = Place::Part(of, *part);
    let message =
        format!("`{name}` is required of another component, and calling it would wait: use `send` and `collect`");
    let found = Diagnostic::new(&BLOCKING_CALL, at.clone(), message);
    let Some((handler, call, first)) = statement else { return found };
    let edits = match first {
        Some(first) => vec![(at, format!("{handler} = send")), (Place::Before(of, first), format!("{name}, "))],
        None => vec![(Place::Part(of, call), format!("{handler} = send({name})"))],
    };
    Diagnostic { fixes: vec![Fix { title: format!("Start it with `{handler} = send({name}…)`"), edits }], ..found }
}
