//! # undeclared-lock
//!
//! A recording showed that a codel takes a lock, and `mauve.toml` does not declare that, or declares a shorter time. What executes the
//! codel is not analysed: activities of lower priority that hold the lock delay it.
//!
//! ```mauve
//! codel plan(): int
//! shell S { }
//! core C(S) { update = { plan(); } }
//! component Planner(S, C)
//! architecture Robot { instance planner: Planner }
//! deployment Run { architecture Robot  activity planner { priority = 20  period = 20 } }
//! //- /mauve.toml
//! [timing]
//! tables = ["times.toml"]
//! observed = ["robot.observed.toml"]
//! //- /times.toml
//! [codel]
//! plan = 2
//! //- /robot.observed.toml
//! [lock.map.plan]   # error
//! executions = 3000
//! held = 0.5
//! ```
//!
//! Declare the lock, with all codels that take it:
//!
//! ```toml
//! [locks.map]
//! codels = ["plan"]
//! protocol = "inheritance"
//! held = "0.6 ms"
//! ```

use super::*;
use mauve_hir::toml_key;

pub(super) fn report<'db>(
    at: Location<'db>,
    lock: &str,
    codel: &str,
    held: Time,
    declared: Option<Time>,
) -> Diagnostic<'db> {
    let section = format!("[locks.{}]", toml_key(lock));
    let message = match declared {
        Some(declared) => format!(
            "codel `{codel}` held the lock `{lock}` for {held}, longer than the {declared} of `{section}`: write a longer `held`"
        ),
        None => format!(
            "codel `{codel}` takes the lock `{lock}`, and held it for {held}: declare `{section}` in mauve.toml, with `\"{codel}\"` \
             in its `codels`"
        ),
    };
    Diagnostic::new(&UNDECLARED_LOCK, at, message)
}
