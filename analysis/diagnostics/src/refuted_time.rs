//! # refuted-time
//!
//! A recording showed a longer execution time than a timing table has. Nothing that uses the time is proved until it is corrected.
//!
//! ```mauve
//! codel work(): void
//! shell S { }
//! core C(S) { update = { work(); } }
//! component K(S, C)
//! architecture Robot { instance k: K }
//! deployment Run { architecture Robot  activity k { priority = 20  period = 1 } }
//! //- /mauve.toml
//! [timing]
//! tables = ["times.toml"]
//! observed = ["robot.observed.toml"]
//! //- /times.toml
//! unit = "us"
//! [codel]
//! work = 120   # error
//! //- /robot.observed.toml
//! unit = "us"
//! [codel.work]
//! executions = 3000
//! greatest = 283
//! ```
//!
//! `mauve trace import` writes the file with what was observed, and `[timing] observed` in `mauve.toml` names it. A time for every
//! level is refuted by one longer execution; a time of a level, by an execution that is improbable at that level. So are a port that
//! `[access]` has no time for, if a read or write of it took more than 50 µs, and a time that `[assume]` gives.
//!
//! Estimate the time again with `mauve pwcet`, or write a longer one. If the codel has changed since, record it again, and remove its
//! old entry from the file with what was observed.

use super::*;
use mauve_wcrt::Timed;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    of: &Timed<'db>,
    observed: Time,
    written: Time,
    file: &str,
) -> Diagnostic<'db> {
    let of_what = table_reasons::timed(db, of);
    let message = match (of, written) {
        (Timed::Access(component, port), Time::ZERO) => format!(
            "an access to {of_what} took {observed} ({file}), and no table has a time for it: write `[access]` \
             `\"{}.{port}\" = …`, or estimate it with `mauve pwcet`",
            component.qualified(db)
        ),
        _ => format!(
            "{of_what} took {observed} ({file}), longer than the written {written}: estimate the time again with `mauve pwcet`, \
             or write a longer one"
        ),
    };
    Diagnostic::new(&REFUTED_TIME, at, message)
}
