//! # not-analysed
//!
//! The analysis does not cover an activity, for the reason in the message. Activities that it may preempt are not analysed
//! either: a bound without its interference could be too low.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 affinity = 3 }   // warning
//!   activity back { priority = 2 period = 10 affinity = 1 }
//! }
//! ```

use super::*;
use mauve_wcrt::Refusal;

code!(NOT_ANALYSED, Warning, "not-analysed");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    instance: &str,
    reasons: &[Refusal<'db>],
) -> Diagnostic<'db> {
    let reasons: Vec<String> = reasons.iter().map(|it| timing_reason(db, &it.reason)).collect();
    Diagnostic::new(&NOT_ANALYSED, at, format!("`{instance}` is not analysed: {}", reasons.join("; ")))
}

pub(super) fn chain<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&NOT_ANALYSED, at, format!("chain `{name}` is not analysed: the analysis does not cover chains yet"))
}
