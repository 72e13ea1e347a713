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
use mauve_wcrt::Missed;

code!(DEADLINE_MISSED, Error, "deadline-missed");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    name: &str,
    deadline: Time,
    missed: &Missed<'db>,
) -> Diagnostic<'db> {
    let message = match missed {
        Missed::Late { response, heaviest, window } => {
            let of_what = window.map_or_else(
                || "of it".to_owned(),
                |(job, end)| format!("of the {end} up to the end of job {job}"),
            );
            let heaviest = heaviest.as_ref().map_or_else(String::new, |it| {
                let jobs = if it.jobs == 1 { "job" } else { "jobs" };
                format!(" — {} {of_what} is {} ({} {jobs})", it.time, it.instance, it.jobs)
            });
            format!("{name}: R {response} > D {deadline}{heaviest}")
        }
        Missed::NoBound(reasons) => {
            let reasons: Vec<String> = reasons.iter().map(|it| timing_reason(db, &it.reason)).collect();
            format!("{name}: no bound below D {deadline}: {}", reasons.join("; "))
        }
    };
    Diagnostic::new(&DEADLINE_MISSED, at, message)
}
