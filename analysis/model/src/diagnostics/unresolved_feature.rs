//! # unresolved-feature
//!
//! A connection, an operation or a value names a port, operation, property or constant that the shell of the instance
//! does not have.
//!
//! ```mauve
//! shell S { output port scan: int  input port mark: int  property rate: int }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A {
//!   instance front: Laser
//!   instance back: Laser
//!   connection front.scna -> back.mark   // error
//!   connection front.scan -> back.mark
//!   property front.scan = 3   // error
//!   property front.rate = 3
//! }
//! ```
//!
//! So is a port that a chain in `mauve.toml` names. Ports are connected by `connection`, operations by `operation`; values are given by `property` and `constant`.

use super::*;

code!(UNRESOLVED_FEATURE, Error, "unresolved-feature");

pub(crate) fn report<'db>(
    at: Place<'db>,
    what: &str,
    name: &str,
    instance: &str,
    shell: &str,
    near: Option<Name>,
) -> Diagnostic<'db> {
    let message = format!("no {what} `{name}` in {shell}, the shell of {instance}");
    Diagnostic::new(&UNRESOLVED_FEATURE, at.clone(), message).did_you_mean(at, near)
}

/// A connection to an operation, say.
pub(crate) fn another_kind<'db>(
    at: Place<'db>,
    what: &str,
    name: &str,
    instance: &str,
    (kind, shell): (FeatureKind, &str),
) -> Diagnostic<'db> {
    let (is, write) = match kind {
        FeatureKind::Input => ("an input port", "`connection a.output -> b.input`"),
        FeatureKind::Output => ("an output port", "`connection a.output -> b.input`"),
        FeatureKind::Required => ("a required operation", "`operation a.provided -> b.required`"),
        FeatureKind::Provided => ("a provided operation", "`operation a.provided -> b.required`"),
        FeatureKind::Constant => ("a constant", "`constant a.name = value`"),
        FeatureKind::Property => ("a property", "`property a.name = value`"),
    };
    let article = if what == "operation" { "an" } else { "a" };
    let message = format!("`{name}` is {is} of {shell}, the shell of {instance}, not {article} {what}: write {write}");
    Diagnostic::new(&UNRESOLVED_FEATURE, at, message)
}
