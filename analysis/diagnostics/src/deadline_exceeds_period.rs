//! # deadline-exceeds-period
//!
//! A deadline exceeds the period. The analysis requires D ≤ T (Hypothesis 1 of the paper), and takes the period as the deadline
//! until one of the two is corrected.
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
//! Fix: set the deadline to the period, which changes no response time. An editor also offers to set the period to the
//! deadline, with the response times that result.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    deadline: Time,
    (period, written, period_at): (Time, &str, &Location<'db>),
) -> Diagnostic<'db> {
    let message = format!("deadline {deadline} exceeds the period of {period}");
    Diagnostic::new(&DEADLINE_EXCEEDS_PERIOD, at.clone(), message)
        .related(period_at, "the period")
        .fix("Set the deadline to the period", at, written.to_owned())
}
