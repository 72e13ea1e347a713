//! # unused-codel
//!
//! No program of the project calls this codel.
//!
//! ```mauve
//! codel plan(): int   // hint
//! codel drive(): int
//! shell S { }
//! core C(S) { update = { drive(); } }
//! ```
//!
//! Fix: remove the codel, with the comment above it.

use super::*;

pub(super) fn report<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Diagnostic<'db> {
    let name = of.name(db);
    let found = Diagnostic::new(&UNUSED_CODEL, Location::name_of(of), format!("codel `{name}` is never called"));
    found.remove(format!("Remove the unused codel `{name}`"), of, SourceId(0))
}
