//! # outdated-measurement
//!
//! A measured time is older than what it was measured from: runs were imported into its sample files, or the source of the codel
//! has changed. `mauve pwcet` records the size of the files, and a digest of the source.
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
//! executions = 5000
//! greatest = 7.5
//! times = 9
//! method = "generalised Pareto, 95 % upper confidence bound"
//! date = 2026-11-23
//! samples = "c53e0b1d6f4a9a11"
//! files = ["run.samples"]
//! bytes = 4
//! //- /run.samples
//! a file with more than 4 bytes
//! ```
//!
//! The response times still use the time of the table. Measure again: record the changed codel, import the trace, and run
//! `mauve pwcet` with the same table. A file that does not exist here is not checked.

use super::*;
use mauve_wcrt::ChangedOrigin;

pub(super) fn report<'db>(at: Location<'db>, key: &str, changed: &ChangedOrigin) -> Diagnostic<'db> {
    let message = match changed {
        ChangedOrigin::Samples(files) => format!(
            "the time of `{key}` is older than its executions in `{}`: estimate it again with `mauve pwcet`",
            files.join("`, `")
        ),
        ChangedOrigin::Source(path) => {
            format!("`{path}` has changed since `{key}` was measured: record and import a new trace")
        }
    };
    Diagnostic::new(&OUTDATED_MEASUREMENT, at, message)
}
