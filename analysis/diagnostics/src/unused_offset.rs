//! # unused-offset
//!
//! An activity has an offset that the analysis ignores: its clock is not synchronised with others, so the phase of its releases
//! is unknown; its period is not a whole number of nanoseconds, as that of 30 Hz; or it is a background activity.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 2 period = 10 offset = 2 }   // warning
//!   activity back { priority = 1 period = 10 offset = 5 }
//! }
//! //- /mauve.toml
//! [clocks]
//! synchronised = ["back"]
//! ```
//!
//! Fix: remove the offset. If the activities share a clock, name their instances in `[clocks] synchronised` or
//! `[clocks.NAME] instances` of `mauve.toml`.

use super::*;

/// Without `instance`, the activity is released at fractions of a nanosecond.
pub(super) fn not_synchronised<'db>(
    of: Decl<'db>,
    id: SourceId,
    activity: &str,
    instance: Option<&str>,
) -> Diagnostic<'db> {
    let why = match instance {
        Some(instance) => format!(
            "its clock is not synchronised; add `{instance}` to `[clocks] synchronised` in mauve.toml, or remove the offset"
        ),
        None => "its period and its offset are not whole numbers of nanoseconds; remove the offset".to_owned(),
    };
    let message = format!("the analysis ignores the offset of `{activity}`: {why}");
    let found = Diagnostic::new(&UNUSED_OFFSET, Location::Source(of, id), message);
    found.remove("Remove the offset".to_owned(), of, id)
}
