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
//! The same holds for the ports in `[chains]` of `mauve.toml`. `connection` connects ports, `operation` connects operations,
//! `property` and `constant` set values.

use super::*;
use mauve_hir::fact::EndKind;

pub(super) fn report<'db>(
    at: Location<'db>,
    expected: EndKind,
    name: &str,
    instance: &str,
    shell: &str,
    near: Option<Name>,
) -> Diagnostic<'db> {
    let message = format!("no {} `{name}` in {shell}, the shell of {instance}", shown(expected));
    Diagnostic::new(&UNRESOLVED_FEATURE, at, message).did_you_mean(near)
}

/// Reports a feature of a wrong kind, such as an operation in a connection of ports.
pub(super) fn another_kind<'db>(
    at: Location<'db>,
    expected: EndKind,
    name: &str,
    instance: &str,
    (found, shell): (FeatureKind, &str),
) -> Diagnostic<'db> {
    let is = types::feature_kind(found);
    let write = match found {
        FeatureKind::Input | FeatureKind::Output => "`connection a.output -> b.input`",
        FeatureKind::Required | FeatureKind::Provided => "`operation a.provided -> b.required`",
        FeatureKind::Constant => "`constant a.name = value`",
        FeatureKind::Property => "`property a.name = value`",
    };
    let article = if expected == EndKind::Operation { "an" } else { "a" };
    let what = shown(expected);
    let message = format!("`{name}` is {is} of {shell}, the shell of {instance}, not {article} {what}: write {write}");
    Diagnostic::new(&UNRESOLVED_FEATURE, at, message)
}

fn shown(expected: EndKind) -> &'static str {
    match expected {
        EndKind::Port => "port",
        EndKind::Operation => "operation",
        EndKind::Value => "property or constant",
    }
}
