//! # doubtful-measurement
//!
//! A time was measured with warnings: there are few executions, or they do not fit the assumptions of the estimate. Each warning has a
//! page, such as `mauve explain few-executions`; the report of `mauve pwcet` shows details.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) { update = { plan(); } }
//! component Pilot(S, C)
//! architecture A { instance pilot: Pilot }
//! deployment D { architecture A  activity pilot { priority = 1  period = 100 } }
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! plan = 9
//! [measured.plan]   # hint
//! executions = 300
//! greatest = 7.5
//! times = 9
//! method = "generalised Pareto, 95 % upper confidence bound"
//! date = 2026-11-23
//! samples = "c53e0b1d6f4a9a11"
//! files = []
//! bytes = 0
//! warnings = ["few-executions"]
//! ```
//!
//! Measure again as the warning says. If you have verified the time in another way, write it by hand and remove its section
//! `[measured]`.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, key: &str, warnings: &[String]) -> Diagnostic<'db> {
    Diagnostic::new(&DOUBTFUL_MEASUREMENT, at, format!("the measured time of `{key}` has warnings: {}", warnings.join(", ")))
}
