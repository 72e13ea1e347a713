//! # connection-direction
//!
//! A connection goes from an output port to an input port, an `operation` from the instance that provides it to the one
//! that requires it.
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
//! Until an operation is connected the right way, nobody knows who serves it: what provides operations is not analysed.

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
    let message = format!("this goes from {last} to {first}: swap the two ends");
    let swapped = source.iter().zip(target).flat_map(|(one, other)| [(one, other), (other, one)]);
    let edits = swapped.map(|(replaced, by)| (beside(&at, replaced.id), by.name.to_string())).collect();
    let fix = Fix { title: "Swap the two ends".to_owned(), edits };
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
        true => format!("`{name}` of {instance} is {last}: a connection starts at {first}"),
        false => format!("`{name}` of {instance} is {first}: a connection ends at {last}"),
    };
    Diagnostic::new(&CONNECTION_DIRECTION, at, message)
}

/// Returns the expected source and target of a connection.
fn ends(kind: EndKind) -> [&'static str; 2] {
    match kind {
        EndKind::Port => ["an output port", "an input port"],
        _ => ["a provided operation", "a required one"],
    }
}
