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

pub(crate) fn report<'db>(of: Decl<'db>, second: Option<Place<'db>>) -> Diagnostic<'db> {
    let (at, message) = match second {
        Some(second) => (second, "a second `architecture`: a deployment deploys one"),
        None => (Place::name_of(of), "this deployment does not say what it deploys: write `architecture NAME`"),
    };
    Diagnostic::new(&DEPLOYMENT_TARGET, at, message.to_owned())
}
