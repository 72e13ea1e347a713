//! # unknown-field
//!
//! The fields of an activity are `affinity`, `priority`, `period` and `deadline`. Another may be a misspelt one, so
//! the activity is not analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 deadlin = 5 }   // error
//!   activity back { priority = 2 period = 10 deadline = 5 }
//! }
//! ```

use super::*;

code!(UNKNOWN_FIELD, Error, "unknown-field");

pub(crate) fn report<'db>(at: Place<'db>, name: &str) -> Diagnostic<'db> {
    let message = format!("no field `{name}` in an activity: expected affinity, priority, period or deadline");
    let near = mauve_syntax::similar(name, ["affinity", "priority", "period", "deadline"]).map(Name::from);
    Diagnostic::new(&UNKNOWN_FIELD, at.clone(), message).did_you_mean(at, near)
}
