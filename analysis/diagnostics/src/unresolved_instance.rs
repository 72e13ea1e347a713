//! # unresolved-instance
//!
//! An activity, a connection or a value names an instance that the architecture does not have.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 }
//!   activity frnot { priority = 2 period = 10 }   // error
//! }
//! ```
//!
//! If an activity names an unknown instance, the deployment is not analysed on any CPU, since the execution time of the
//! activity is unknown.
//!
//! The same holds for the instances in `[clocks]` and `[chains]` of `mauve.toml`, which a deployment of the workspace must have:
//!
//! ```mauve
//! shell S { output port scan: int }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser }
//! deployment D { architecture A  activity front { priority = 1 period = 10 } }
//! //- /mauve.toml
//! [clocks]
//! synchronised = ["front", "frnot"]   # error
//! [chains.seeing]
//! from = "frnt.scan"   # error
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str, architecture: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no instance `{name}` in `{architecture}`");
    let found = Diagnostic::new(&UNRESOLVED_INSTANCE, at, message).did_you_mean(near);
    found.caused_by(Some(Cause::NoInstance(architecture.into(), name.into())))
}

/// Reports a name in `mauve.toml`.
pub(super) fn not_deployed<'db>(at: Location<'db>, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no deployment has an instance `{name}`");
    Diagnostic::new(&UNRESOLVED_INSTANCE, at, message).did_you_mean(near)
}

/// Reports a name in a chain of `mauve.toml`.
pub(super) fn no_end<'db>(at: Location<'db>, name: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no codel or instance `{name}`");
    Diagnostic::new(&UNRESOLVED_INSTANCE, at, message).did_you_mean(near)
}

/// Reports a name under `[deployment.NAME]` in `mauve.toml`.
pub(super) fn not_in_deployment<'db>(
    at: Location<'db>,
    deployment: &str,
    instance: &str,
    near: Option<Name>,
) -> Diagnostic<'db> {
    let message = format!("deployment `{deployment}` has no instance `{instance}`");
    Diagnostic::new(&UNRESOLVED_INSTANCE, at, message).did_you_mean(near)
}
