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
use mauve_wcrt::DeadlineAndPriority;

code!(PRIORITY_INVERSION, Warning, "priority-inversion");

pub(super) fn report<'db>(
    at: Location<'db>,
    late: &DeadlineAndPriority,
    early: &DeadlineAndPriority,
    early_at: &Location<'db>,
) -> Diagnostic<'db> {
    let message = format!(
        "{} must end within {}, {} within {}, and {} is more urgent: {} > {}",
        late.instance,
        late.deadline,
        early.instance,
        early.deadline,
        early.instance,
        early.priority,
        late.priority
    );
    let found = Diagnostic::new(&PRIORITY_INVERSION, at, message);
    found.related(early_at, format!("the priority of {}", early.instance))
}
