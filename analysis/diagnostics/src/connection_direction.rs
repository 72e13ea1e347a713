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
//! Fix, where both ends are in the wrong order: swap them, unless another connection has this target already.

use super::*;
use mauve_hir::fact::EndKind;
use mauve_syntax::SyntaxKind;

pub(super) fn swapped<'db>(
    db: &'db dyn ModelDb,
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
    let [instance, feature] = source;
    let is_connected = is_target(db, &at, &format!("{}.{}", instance.name, feature.name));
    let fixes = if is_connected { Vec::new() } else { vec![fix] };
    Diagnostic { fixes, ..Diagnostic::new(&CONNECTION_DIRECTION, at, message) }
}

/// Returns whether a connection of the same architecture already has the target `endpoint`: swapped ends would connect it
/// twice.
fn is_target(db: &dyn ModelDb, at: &Location<'_>, endpoint: &str) -> bool {
    let Some(architecture) = statement::ancestor(db, at, SyntaxKind::ARCHITECTURE) else { return false };
    architecture.children().any(|connection| {
        let ends = connection.children().filter(|it| it.kind() == SyntaxKind::ENDPOINT);
        let is_connection =
            matches!(connection.kind(), SyntaxKind::CONNECTION | SyntaxKind::OPERATION_CONNECTION);
        is_connection
            && ends.skip(1).any(|end| end.text() == endpoint)
    })
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
