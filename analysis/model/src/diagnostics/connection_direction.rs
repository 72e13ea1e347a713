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

type End<'a> = (FeatureKind, &'a NameRef, &'a NameRef);

/// The ends are ports both, or operations both, as `what` says.
pub(crate) fn report<'db>(
    what: &str,
    of: Decl<'db>,
    (from, source_instance, source): End<'_>,
    (to, target_instance, target): End<'_>,
) -> Option<Diagnostic<'db>> {
    let place = |name: &NameRef| Place::Part(of, name.part);
    let new = |at, message| Some(Diagnostic::new(&CONNECTION_DIRECTION, place(at), message));
    let starts = matches!(from, FeatureKind::Output | FeatureKind::Provided);
    let ends = matches!(to, FeatureKind::Input | FeatureKind::Required);
    let (first, last) = match what {
        "port" => ("an output port", "an input port"),
        _ => ("a provided operation", "a required one"),
    };
    match (starts, ends) {
        (true, true) => None,
        (false, false) => {
            let message = format!("this goes from {last} to {first}: swap the two ends");
            let swapped = [(source_instance, target_instance), (source, target)];
            let swapped = swapped.into_iter().flat_map(|(one, other)| [(one, other), (other, one)]);
            let edits = swapped.map(|(at, text)| (place(at), text.name.to_string())).collect();
            let fix = Fix { title: "Swap the two ends".to_owned(), edits };
            new(source, message).map(|found| Diagnostic { fixes: vec![fix], ..found })
        }
        (false, true) => {
            new(source, format!("`{}` of {} is {last}: a connection starts at {first}", source.name, source_instance.name))
        }
        (true, false) => {
            new(target, format!("`{}` of {} is {first}: a connection ends at {last}", target.name, target_instance.name))
        }
    }
}
