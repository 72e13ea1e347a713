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
//!
//! Fix: write one, with a priority and a period to be changed.

use super::*;

code!(MISSING_ACTIVITY, Error, "missing-activity");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    of: Decl<'db>,
    instance: &str,
) -> Diagnostic<'db> {
    let deployment = of.name(db);
    let message = format!("instance `{instance}` has no activity in {deployment}: write `activity {instance} {{ … }}`");
    // The lowest real-time priority: the new activity delays only activities of the same priority.
    let activity = format!("activity {instance} {{ priority = 1 period = 100 }}");
    Diagnostic::new(&MISSING_ACTIVITY, at, message).add_item(
        db,
        of,
        format!("Write an activity for `{instance}`"),
        &activity,
    )
}
