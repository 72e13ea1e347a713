//! # deployment-target
//!
//! A deployment names no architecture, or more than one. A deployment names exactly one, with `architecture NAME`.
//!
//! ```mauve
//! architecture A { }
//! deployment None { }   // error
//! deployment Good { architecture A }
//! ```

use super::*;

pub(super) fn none(at: Location<'_>) -> Diagnostic<'_> {
    let message = "the deployment names no architecture: add `architecture NAME`";
    Diagnostic::new(&DEPLOYMENT_TARGET, at, message)
}

pub(super) fn second(at: Location<'_>) -> Diagnostic<'_> {
    let message = "the deployment names two architectures: remove one of them";
    Diagnostic::new(&DEPLOYMENT_TARGET, at, message)
}
