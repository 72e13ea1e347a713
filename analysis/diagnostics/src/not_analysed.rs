//! # not-analysed
//!
//! An activity that the analysis does not cover, with the reason. What it may delay is not analysed either. Nothing is
//! left out silently: a bound that did not count it could be too low.
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
    Diagnostic::new(&NOT_ANALYSED, at, format!("{instance} is not analysed: {}", reasons.join("; ")))
}

pub(super) fn chain<'db>(at: Location<'db>, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&NOT_ANALYSED, at, format!("the chain `{name}` is not analysed yet"))
}
