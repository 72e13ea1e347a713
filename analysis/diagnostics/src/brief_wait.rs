//! # brief-wait
//!
//! A recording showed that a codel gave up the CPU by its own will, for no longer than 5 µs. No response time counts that. To wait for a
//! device, another thread or a sleep takes longer, so that it may be no such wait; a longer one is the error `waiting-codel`.
//!
//! ```mauve
//! codel grab(): int
//! shell S { }
//! core C(S) { update = { grab(); } }
//! component Camera(S, C)
//! architecture Robot { instance camera: Camera }
//! deployment Run { architecture Robot  activity camera { priority = 20  period = 20 } }
//! //- /mauve.toml
//! [timing]
//! tables = ["times.toml"]
//! observed = ["robot.observed.toml"]
//! //- /times.toml
//! [codel]
//! grab = 0.1   # warning
//! //- /robot.observed.toml
//! [codel.grab]
//! executions = 800
//! greatest = 0.06
//! wait = 0.0019
//! ```
//!
//! Find what the codel calls that may wait: a lock, an allocation, output. If it may wait for longer than was recorded, write the longest
//! time under `[wait]` in the timing table. With `grab = 0.005` there, response times count it, and this warning ends.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, codel: &str, wait: Time, executions: u64, file: &str) -> Diagnostic<'db> {
    let message = format!(
        "codel `{codel}` gave up the CPU for up to {wait} ({file}, {executions} executions), and no response time counts that: if it may wait \
         for longer, write `\"{codel}\" = …` under `[wait]`, in the unit of the table"
    );
    Diagnostic::new(&BRIEF_WAIT, at, message)
}
