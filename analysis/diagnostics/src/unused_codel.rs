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

pub(super) fn report<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Diagnostic<'db> {
    let name = of.name(db);
    let found = Diagnostic::new(&UNUSED_CODEL, Location::name_of(of), format!("codel `{name}` is never called"));
    // A lock would name no codel any more.
    let locks = &config_of(db, project.workspace(db)).locks;
    let mut keys = locks.iter().flat_map(|lock| &lock.codels);
    match keys.any(|(key, _)| of.is_called(db, key)) {
        true => found,
        false => found.remove(format!("Remove the unused codel `{name}`"), of, SourceId(0)),
    }
}
