//! # priority-inversion
//!
//! Of two activities on one CPU, the one that must end earlier is the less urgent one. Where deadlines are not later than
//! periods, priorities in the order of deadlines are the best there are (Leung and Whitehead, 1982).
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A { instance a: K  instance b: K  instance c: K }
//! deployment D {
//!   architecture A
//!   activity a { priority = 9 period = 100 affinity = 1 }
//!   activity b { priority = 8 period = 10 affinity = 1 }   // warning
//!   activity c { priority = 7 period = 10 affinity = 2 }
//! }
//! ```
//!
//! What other priorities give is worked out where they are offered, in an editor: two that are swapped may make a third
//! activity late.

use super::*;

code!(PRIORITY_INVERSION, Warning, "priority-inversion");

/// An activity: its name, its priority and where that stands, its deadline.
pub(crate) type Urgency<'a, 'db> = (&'a str, (u32, Place<'db>), Time);

pub(crate) fn report<'db>(late: Urgency<'_, 'db>, early: Urgency<'_, 'db>) -> Diagnostic<'db> {
    let ((one, (low, at), short), (other, (high, other_at), long)) = (late, early);
    let message = format!(
        "{one} must end within {short}, {other} within {long}, and {other} is more urgent: {high} > {low}"
    );
    Diagnostic::new(&PRIORITY_INVERSION, at, message).related(other_at, format!("the priority of {other}"))
}
