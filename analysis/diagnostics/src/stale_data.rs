//! # stale-data
//!
//! Two activities on one CPU have the same period, and the reader of a port has a higher priority than its writer: the reader
//! runs first, and its data is one period old. That may be intended, for a driver with little jitter, for example.
//!
//! ```mauve
//! shell S { output port way: int  input port goal: int }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A { instance a: K  instance b: K  instance c: K  connection a.way -> b.goal  connection b.way -> c.goal }
//! deployment D {
//!   architecture A
//!   activity a { priority = 8 period = 10 affinity = 1 }
//!   activity b { priority = 9 period = 10 affinity = 1 }   // hint
//!   activity c { priority = 7 period = 10 affinity = 1 }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, [reader, writer]: [&Name; 2], port: &str, other: &Location<'db>) -> Diagnostic<'db> {
    let message =
        format!("`{reader}` reads `{port}` before `{writer}` writes it in each period: the data is one period old");
    Diagnostic::new(&STALE_DATA, at, message).related(other, format!("`{writer}` has a lower priority"))
}
