//! # two-writers
//!
//! Two connections lead to one input port: its reader would see the values of both, each as new. Let a component choose, as a
//! switch does.
//!
//! ```mauve
//! shell S { output port way: int  input port goal: int }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A {
//!   instance a: K
//!   instance b: K
//!   instance c: K
//!   connection a.way -> c.goal
//!   connection b.way -> c.goal   // error
//!   connection b.way -> a.goal
//! }
//! ```

use super::*;

code!(TWO_WRITERS, Error, "two-writers");

pub(crate) fn report<'db>(at: Place<'db>, instance: &str, port: &str, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("a second connection to `{instance}.{port}`: an input port has one writer");
    Diagnostic::new(&TWO_WRITERS, at, message).related(first, "the first is here")
}
