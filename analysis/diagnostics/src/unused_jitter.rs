//! # unused-jitter
//!
//! A background activity has a release jitter. The analysis ignores it: a background activity runs when no real-time activity
//! does, and has no response time.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Log(S, C)
//! architecture A { instance log: Log }
//! deployment D {
//!   architecture A
//!   activity log { priority = background  jitter = 0.5 }   // warning
//! }
//! ```
//!
//! Fix: remove the jitter. If the activity is real-time, give it a priority from 1 to 99 and a period.

use super::*;

pub(super) fn report<'db>(of: Decl<'db>, id: SourceId, instance: &str) -> Diagnostic<'db> {
    let message = format!(
        "the analysis ignores the jitter of `{instance}`: its priority is `background`; for a real-time activity, write a \
         priority from 1 to 99"
    );
    let found = Diagnostic::new(&UNUSED_JITTER, Location::Source(of, id), message);
    found.remove("Remove the jitter".to_owned(), of, id)
}
