//! # missing-activity
//!
//! Every instance of the deployed architecture has an activity. How urgent the instance would be, and how often it
//! would run, is unknown without: nothing that it may delay is analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {   // error
//!   architecture A
//!   activity front { priority = 1 period = 10 }
//! }
//! ```

use super::*;

code!(MISSING_ACTIVITY, Error, "missing-activity");

pub(crate) fn report<'db>(at: Place<'db>, instance: &str, deployment: &str) -> Diagnostic<'db> {
    let message = format!("instance `{instance}` has no activity in {deployment}: write `activity {instance} {{ … }}`");
    Diagnostic::new(&MISSING_ACTIVITY, at, message)
}
