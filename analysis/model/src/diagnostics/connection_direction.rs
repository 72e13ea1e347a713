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

code!(CONNECTION_DIRECTION, Error, "connection-direction");

type End<'a, 'db> = (FeatureKind, Place<'db>, &'a str, &'a str);

/// The ends are ports both, or operations both, as `what` says.
pub(crate) fn report<'db>(
    what: &str,
    (from, source, source_name, source_instance): End<'_, 'db>,
    (to, target, target_name, target_instance): End<'_, 'db>,
) -> Option<Diagnostic<'db>> {
    let new = |at, message| Some(Diagnostic::new(&CONNECTION_DIRECTION, at, message));
    let starts = matches!(from, FeatureKind::Output | FeatureKind::Provided);
    let ends = matches!(to, FeatureKind::Input | FeatureKind::Required);
    let (first, last) = match what {
        "port" => ("an output port", "an input port"),
        _ => ("a provided operation", "a required one"),
    };
    match (starts, ends) {
        (true, true) => None,
        (false, false) => new(source, format!("this goes from {last} to {first}: swap the two ends")),
        (false, true) => {
            new(source, format!("`{source_name}` of {source_instance} is {last}: a connection starts at {first}"))
        }
        (true, false) => {
            new(target, format!("`{target_name}` of {target_instance} is {first}: a connection ends at {last}"))
        }
    }
}
