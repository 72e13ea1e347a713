//! # deadline-exceeds-period
//!
//! A deadline later than the next release: D ≤ T (Hypothesis 1 of the paper). Until one of the two is mended, the period
//! counts as the deadline.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 50 deadline = 80 }   // error
//!   activity back { priority = 2 period = 80 deadline = 80 }
//! }
//! ```
//!
//! Fix: make the deadline the period, which changes no response time. What the deadline gives as a period is worked out where
//! that is offered, in an editor.

use super::*;

code!(DEADLINE_EXCEEDS_PERIOD, Error, "deadline-exceeds-period");

pub(super) fn report<'db>(
    at: Location<'db>,
    deadline: Time,
    (period, written, period_at): (Time, &str, &Location<'db>),
) -> Diagnostic<'db> {
    let message = format!("deadline {deadline} is later than period {period}");
    Diagnostic::new(&DEADLINE_EXCEEDS_PERIOD, at.clone(), message)
        .related(period_at, "the period")
        .fix("Set the deadline to the period, which counts already", at, written.to_owned())
}
