//! # waiting-codel
//!
//! A recording showed that a codel waited: it spent time off the CPU by its own will, for a device, another thread or a sleep. No
//! response time counts that, so that nothing that executes the codel is proved until the timing table has the wait.
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
//! grab = 0.1   # error
//! //- /robot.observed.toml
//! [codel.grab]
//! executions = 3000
//! greatest = 0.06
//! wait = 8.06
//! ```
//!
//! A wait of 5 µs or less that no table has is the warning `brief-wait`.
//!
//! With `[wait]` and `grab = 8.1` in the table, the response time of `camera` counts the wait. With
//! `grab = { time = 8.1, waits = 2 }`, one execution waits twice at most: to wait more often is this error, too. A recording of an earlier version, or
//! of another tool, does not tell a wait from preemption by something that it does not have: record again, with `mauve run --trace`
//! or with packages of this version.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    codel: &str,
    (wait, written): (Time, Option<Time>),
    is_known: bool,
    file: &str,
) -> Diagnostic<'db> {
    let written = written.map_or_else(String::new, |written| format!(", longer than the written {written}"));
    let what = match is_known {
        true => format!("codel `{codel}` waited for {wait}{written} ({file})"),
        false => format!(
            "codel `{codel}` was off the CPU for {wait}{written}, and nothing in the recording explains it ({file}): it waited, or \
             something that was not recorded preempted it"
        ),
    };
    let line = format!("`\"{codel}\" = …` under `[wait]`, in the unit of the table");
    Diagnostic::new(&WAITING_CODEL, at, format!("{what}; no response time counts that: write {line}, at least {wait}"))
}

pub(super) fn more_often<'db>(at: Location<'db>, codel: &str, times: u64, written: u64, file: &str) -> Diagnostic<'db> {
    let message = format!(
        "codel `{codel}` waited {times} times in one execution, {written} written ({file}): write `waits = {times}`, or more, under \
         `[wait]`"
    );
    Diagnostic::new(&WAITING_CODEL, at, message)
}
