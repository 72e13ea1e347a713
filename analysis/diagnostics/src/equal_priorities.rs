//! # equal-priorities
//!
//! Two activities on one CPU have the same priority: which of them runs first is not determined, and each may delay the other.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A { instance a: K  instance b: K  instance c: K }
//! deployment D {
//!   architecture A
//!   activity a { priority = 9 period = 10 affinity = 1 }
//!   activity b { priority = 9 period = 10 affinity = 1 }   // warning
//!   activity c { priority = 9 period = 10 affinity = 2 }
//! }
//! ```

use super::*;

/// One diagnostic for all activities with the priority.
pub(super) fn report<'db>(
    at: Location<'db>,
    instance: &str,
    priority: u32,
    others: &[(Name, Location<'db>)],
) -> Diagnostic<'db> {
    let names = others.iter().map(|(name, _)| name.as_str()).chain([instance]);
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    let message =
        format!("{} have the same priority {priority} on one CPU: each may delay the others", enumerated(&names));
    let found = Diagnostic::new(&EQUAL_PRIORITIES, at, message);
    others.iter().fold(found, |found, (name, at)| found.related(at, format!("the priority of `{name}`")))
}
