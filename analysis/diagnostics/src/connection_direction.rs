//! # connection-direction
//!
//! The ends of a connection are in the wrong order, or one end has the wrong kind. A `connection` goes from an output port to
//! an input port; an `operation` goes from the instance that provides the operation to the instance that requires it.
//!
//! ```mauve
//! shell S { output port scan: int  input port map: int }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A {
//!   instance front: Laser
//!   instance back: Laser
//!   connection front.map -> back.scan   // error
//!   connection front.scan -> back.map
//! }
//! ```
//!
//! While such an `operation` is wrong, its provider is unknown, so the instances that provide operations are not analysed.
//!
//! Fix, where both ends are in the wrong order: swap them.

use super::*;
use mauve_hir::fact::EndKind;

code!(CONNECTION_DIRECTION, Error, "connection-direction");

pub(super) fn swapped<'db>(
    at: Location<'db>,
    kind: EndKind,
    source: &[NameRef; 2],
    target: &[NameRef; 2],
) -> Diagnostic<'db> {
    let [first, last] = ends(kind);
    let message = format!("the connection goes from {last} to {first}: swap its ends");
    let swapped = source.iter().zip(target).flat_map(|(one, other)| [(one, other), (other, one)]);
    let edits = swapped.map(|(replaced, by)| (beside(&at, replaced.id), by.name.to_string())).collect();
    let fix = Fix { title: "Swap the ends".to_owned(), edits };
    Diagnostic { fixes: vec![fix], ..Diagnostic::new(&CONNECTION_DIRECTION, at, message) }
}

/// Reports a connection with one wrong endpoint.
pub(super) fn one_end<'db>(
    at: Location<'db>,
    kind: EndKind,
    is_source: bool,
    instance: &str,
    name: &str,
) -> Diagnostic<'db> {
    let [first, last] = ends(kind);
    let message = match is_source {
        true => format!("`{instance}.{name}` is {last}, but the source of a connection is {first}"),
        false => format!("`{instance}.{name}` is {first}, but the target of a connection is {last}"),
    };
    Diagnostic::new(&CONNECTION_DIRECTION, at, message)
}

/// Returns the expected source and target of a connection.
fn ends(kind: EndKind) -> [&'static str; 2] {
    match kind {
        EndKind::Port => ["an output port", "an input port"],
        _ => ["a provided operation", "a required operation"],
    }
}
