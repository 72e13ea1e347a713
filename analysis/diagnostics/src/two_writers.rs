//! # two-writers
//!
//! An input port has two connections. Its reader would receive the values of both writers, and could not tell them apart. Add a
//! component that selects one of them, such as a switch.
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
//!
//! Fixes: remove either connection.

use super::*;
use mauve_hir::Link;

/// `of` or its imports contain `second`.
pub(super) fn report<'db>(at: Location<'db>, of: Decl<'db>, first: &Link<'db>, second: &Link<'db>) -> Diagnostic<'db> {
    let (instance, port) = &second.target;
    let message =
        format!("`{instance}.{port}` has two connections: an input port has one writer, remove one of them");
    let mut found = Diagnostic::new(&TWO_WRITERS, at, message).related(&first.at, "first connection");
    if !second.is_in(of) {
        found = found.related(&second.at, "second connection");
    }
    for link in [first, second] {
        // Other architectures may import a connection that is not in `of`.
        if let (true, Location::Source(of, id)) = (link.is_in(of), &link.at) {
            let (instance, port) = &link.source;
            found = found.remove(format!("Remove the connection from `{instance}.{port}`"), *of, *id);
        }
    }
    found
}
