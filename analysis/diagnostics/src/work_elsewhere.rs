//! # work-elsewhere
//!
//! A recording showed that threads which are not instances, such as a pool of threads that a codel starts, used CPU time. No response
//! time counts their work, so that no deployment is proved until it is declared.
//!
//! ```mauve
//! codel plan(): int
//! //- /mauve.toml
//! [timing]
//! observed = ["robot.observed.toml"]
//! //- /robot.observed.toml
//! [work.pool]   # error
//! per_second = 45
//! ```
//!
//! Declare it as other real-time work, by the name of the thread, with its priority and CPUs, the least time between two pieces of
//! work, and the greatest time of one; or let the codel do its work itself.
//!
//! ```toml
//! [[platform.other]]
//! name = "pool"
//! priority = 5
//! period = "20 ms"
//! time = "1 ms"
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, thread: &str, per_second: Time) -> Diagnostic<'db> {
    let message = format!(
        "threads named `{thread}`, which are not instances, used {per_second} of CPU time in each second, and no response time counts \
         that: declare them as `[[platform.other]]` with `name = \"{thread}\"`"
    );
    Diagnostic::new(&WORK_ELSEWHERE, at, message)
}
