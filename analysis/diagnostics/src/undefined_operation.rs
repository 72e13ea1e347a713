//! # undefined-operation
//!
//! The shell provides an operation that the core does not define. If a program calls it, the core is not analysed.
//!
//! ```mauve
//! shell S { provide reset(): void  provide stop(): void }
//! core C(S) {   // error
//!   provide reset() = { }
//!   update = { reset(); }
//! }
//! core D(S) {
//!   provide reset() = { }
//!   provide stop() = { reset(); }
//!   update = { stop(); }
//! }
//! ```
//!
//! Fix: define it with an empty program, or one that only returns a value.

use super::*;
use mauve_hir::operation_skeleton;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    core: Decl<'db>,
    name: &str,
    declared: &FeatureOf<'db>,
) -> Diagnostic<'db> {
    let message = format!("the operation `{name}` is not defined: write `provide {name}(…) = {{ … }}`");
    let found = Diagnostic::new(&UNDEFINED_OPERATION, at, message);
    let Some(data) = declared.data(db) else { return found };
    let found = found.related(&Location::Source(declared.shell, data.name.id), "declared here");
    match operation_skeleton(name, data) {
        Some(skeleton) => found.add_item(db, core, format!("Define `{name}`"), &skeleton),
        None => found,
    }
}
