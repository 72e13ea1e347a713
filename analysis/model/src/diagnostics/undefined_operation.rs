//! # undefined-operation
//!
//! The shell provides an operation, and the core does not define it. Where a program calls it, the core is not analysed.
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

use super::*;

code!(UNDEFINED_OPERATION, Error, "undefined-operation");

pub(crate) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Place<'db>,
    name: &str,
    declared: &FeatureOf<'db>,
) -> Diagnostic<'db> {
    let message = format!("the operation `{name}` is not defined: write `provide {name}(…) = {{ … }}`");
    let found = Diagnostic::new(&UNDEFINED_OPERATION, at, message);
    match declared.data(db) {
        Some(data) => found.related(Place::Part(declared.shell, data.name.part), "declared here"),
        None => found,
    }
}
