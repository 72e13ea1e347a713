//! # unresolved-codel
//!
//! A program calls something that is no codel, no operation of its own component and no built-in function (`read`,
//! `write`, `status`, `send`, `collect`).
//!
//! ```mauve
//! codel plan(): int
//! shell S { input port goal: int }
//! core C(S) {
//!   var here: int
//!   update = {
//!     plna();   // error
//!     goal();   // error
//!     status(here);   // error
//!     plan();
//!   }
//! }
//! ```

use super::*;
use crate::typing::BUILT_IN_FUNCTIONS;

code!(UNRESOLVED_CODEL, Error, "unresolved-codel");

pub(crate) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    at: Place<'db>,
    name: &Name,
) -> Diagnostic<'db> {
    let diagnostic = Diagnostic::new(&UNRESOLVED_CODEL, at.clone(), format!("no codel or operation `{name}`"));
    let built_in = BUILT_IN_FUNCTIONS.map(Name::from);
    if let near @ Some(_) = similar(name, &built_in) {
        return diagnostic.did_you_mean(at, near);
    }
    diagnostic.look_elsewhere(db, project, of, Kind::Codel, std::slice::from_ref(name))
}

pub(crate) fn built_in<'db>(at: Place<'db>, form: &str) -> Diagnostic<'db> {
    let message = format!("no codel of this name, and it is not the built-in function `{form}`");
    Diagnostic::new(&UNRESOLVED_CODEL, at, message)
}

pub(crate) fn not_callable<'db>(at: Place<'db>, name: &str, what: &str, hides: Option<&str>) -> Diagnostic<'db> {
    let message = match hides {
        Some(hidden) => format!("`{name}` is {what} here, which hides the {hidden} of that name: rename one of them"),
        None => format!("`{name}` is {what}: only codels and operations are called"),
    };
    Diagnostic::new(&UNRESOLVED_CODEL, at, message)
}
