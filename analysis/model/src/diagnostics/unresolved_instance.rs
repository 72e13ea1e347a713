//! # unresolved-instance
//!
//! An activity, a connection or a value is for an instance that the architecture does not have.
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
//! Where an activity names an unknown instance, the architecture may have lost it, and another instance may have its
//! component: nothing on any CPU is analysed.

use super::*;

code!(UNRESOLVED_INSTANCE, Error, "unresolved-instance");

pub(crate) fn report<'db>(at: Place<'db>, name: &str, architecture: &str, near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no instance `{name}` in {architecture}");
    Diagnostic::new(&UNRESOLVED_INSTANCE, at.clone(), message).did_you_mean(at, near)
}
