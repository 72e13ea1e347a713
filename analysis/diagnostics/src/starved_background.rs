//! # starved-background
//!
//! Real-time work may take all time of the CPUs of a background activity, without throttling: the activity may never execute. No
//! deadline shows that, since background activities have none.
//!
//! ```mauve
//! codel poll(): int
//! codel show(): int
//! shell S { }
//! core Polling(S) { update = { poll(); } }
//! core Showing(S) { update = { show(); } }
//! component Keys(S, Polling)
//! component Screen(S, Showing)
//! architecture A { instance keys: Keys  instance screen: Screen }
//! deployment D {
//!   architecture A
//!   activity keys { priority = 9  period = 1  cpus = [1] }
//!   activity screen { priority = background  period = 100  cpus = [1] }   // warning
//! }
//! //- /mauve.toml
//! [timing]
//! tables = ["times.toml"]
//! [platform]
//! rt_throttling = false
//! //- /times.toml
//! [codel]
//! poll = 1
//! show = 20
//! ```
//!
//! Lengthen periods there, or give the activity a CPU with time left. With throttling (`[platform] rt_throttling = true`), Linux
//! keeps 50 ms of each second for the background, at the expense of the real-time activities.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, instance: &str, cpus: &str) -> Diagnostic<'db> {
    let message = format!(
        "`{instance}` may never execute: real-time work may take all time of {cpus}, and throttling leaves none; lengthen periods there, \
         or give `{instance}` another CPU"
    );
    Diagnostic::new(&STARVED_BACKGROUND, at, message)
}
