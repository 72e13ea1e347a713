//! # deadline-exceeds-period
//!
//! A deadline exceeds the period: the next job may be released before it. Jobs are not dropped; a late job delays the next ones of
//! its activity, and the response times count that.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 50 deadline = 80 }   // hint
//!   activity back { priority = 2 period = 80 deadline = 80 }
//! }
//! ```
//!
//! Fix: set the deadline to the period, if no job may wait for the one before it.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    deadline: Time,
    (period, written, period_at): (Time, &str, &Location<'db>),
) -> Diagnostic<'db> {
    let message = format!(
        "deadline {deadline} exceeds the period of {period}: jobs may overlap with the next release, and late jobs queue"
    );
    Diagnostic::new(&DEADLINE_EXCEEDS_PERIOD, at.clone(), message)
        .related(period_at, "the period")
        .fix("Set the deadline to the period", at, written.to_owned())
}
