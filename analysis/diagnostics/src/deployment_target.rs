//! # deployment-target
//!
//! A deployment deploys one architecture.
//!
//! ```mauve
//! architecture A { }
//! deployment None { }   // error
//! deployment Good { architecture A }
//! ```

use super::*;

code!(DEPLOYMENT_TARGET, Error, "deployment-target");

pub(super) fn none(at: Location<'_>) -> Diagnostic<'_> {
    let message = "this deployment does not say what it deploys: write `architecture NAME`";
    Diagnostic::new(&DEPLOYMENT_TARGET, at, message)
}

pub(super) fn second(at: Location<'_>) -> Diagnostic<'_> {
    let message = "a second `architecture`: a deployment deploys one";
    Diagnostic::new(&DEPLOYMENT_TARGET, at, message)
}
