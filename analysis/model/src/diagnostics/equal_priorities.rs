//! # equal-priorities
//!
//! Two activities on one CPU have one priority: which of them runs first is left to chance, and each may delay the other.
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

code!(EQUAL_PRIORITIES, Warning, "equal-priorities");

pub(crate) fn report<'db>(at: Place<'db>, [one, other]: [&str; 2], priority: u32, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("{one} and {other} have priority {priority} on one CPU: each may delay the other");
    Diagnostic::new(&EQUAL_PRIORITIES, at, message).related(first, format!("the one of {other}"))
}
