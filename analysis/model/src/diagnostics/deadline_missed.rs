//! # deadline-missed
//!
//! The worst-case response time of an activity is later than its deadline, or has no bound, at the significance level
//! of `mauve.toml` (1e-4 unless it says otherwise).
//!
//! ```mauve
//! codel work(): int
//! shell S { }
//! core C(S) { update = { work(); } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 2 period = 10 }
//!   activity back { priority = 1 period = 10 deadline = 9 }   // error
//! }
//! //- /mauve.toml
//! [assume]
//! codel = "5 ms"
//! ```
//!
//! The bound is safe, not exact: that the deadline is really missed is not proved. Make the activity more urgent, give
//! what delays it a longer period, move one of them to another CPU, or shorten a codel: `mauve wcrt --explain INSTANCE`
//! shows where the time goes.

use super::*;

code!(DEADLINE_MISSED, Error, "deadline-missed");

pub(super) fn report<'db>(activity: &ActivityReport<'db>) -> Diagnostic<'db> {
    let name = &activity.row.instance;
    let deadline = activity.row.deadline.unwrap_or_default();
    let message = match activity.response {
        Some(response) => {
            // Of a job that waits for others of its own, the window is longer than the response.
            let late = activity.window.as_ref().filter(|window| window.job > 1);
            let of_what = late.map_or_else(
                || "of it".to_owned(),
                |window| format!("of the {} up to the end of job {}", window.length, window.job),
            );
            let heaviest = activity.interference.iter().max_by_key(|it| it.time);
            let heaviest = heaviest.map_or_else(String::new, |it| {
                let jobs = if it.jobs == 1 { "job" } else { "jobs" };
                format!(" — {} {of_what} is {} ({} {jobs})", it.time, it.instance, it.jobs)
            });
            format!("{name}: R {response} > D {deadline}{heaviest}")
        }
        None => {
            let reasons: Vec<&str> = activity.reasons.iter().map(|reason| reason.message.as_str()).collect();
            format!("{name}: no bound below D {deadline}: {}", reasons.join("; "))
        }
    };
    Diagnostic::new(&DEADLINE_MISSED, activity.row.at.clone(), message)
}
