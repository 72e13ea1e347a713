//! # missing-value
//!
//! A property or constant of a deployed instance has no value. Give it one in the shell, in the architecture or in the
//! deployment.
//!
//! ```mauve
//! shell S { property device: string  property rate: int = 10 }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser  property back.device = "/dev/ttyS0" }
//! deployment D {
//!   architecture A
//!   activity front { priority = 2 period = 10 }   // error
//!   activity back { priority = 1 period = 10 }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, instance: &str, kind: FeatureKind, name: &str, declared: &Location<'db>) -> Diagnostic<'db> {
    let what = if kind == FeatureKind::Constant { "constant" } else { "property" };
    let message = format!("{what} `{name}` of `{instance}` has no value: add `{what} {instance}.{name} = …`");
    Diagnostic::new(&MISSING_VALUE, at, message).related(declared, "declared here")
}
