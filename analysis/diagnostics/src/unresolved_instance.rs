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
pub(super) fn in_config<'db>(at: Location<'db>, message: String, near: Option<Name>) -> Diagnostic<'db> {
    Diagnostic::new(&UNRESOLVED_INSTANCE, at, message).did_you_mean(near)
}
