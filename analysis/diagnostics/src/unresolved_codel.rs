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
use mauve_hir::Builtin;
use mauve_hir::fact::Hidden;

code!(UNRESOLVED_CODEL, Error, "unresolved-codel");

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    at: Location<'db>,
    name: &Name,
) -> Diagnostic<'db> {
    let diagnostic = Diagnostic::new(&UNRESOLVED_CODEL, at, format!("no codel or operation `{name}`"));
    if let near @ Some(_) = similar(name, &Builtin::names()) {
        return diagnostic.did_you_mean(near);
    }
    diagnostic.look_elsewhere(db, project, of, Kind::Codel, std::slice::from_ref(name))
}

pub(super) fn built_in<'db>(at: Location<'db>, function: Builtin) -> Diagnostic<'db> {
    let form = match function {
        Builtin::Read => "read(port, variable)",
        Builtin::Write => "write(port, value)",
        Builtin::Status => "status(port)",
        Builtin::Send => "send(operation, …)",
        Builtin::Collect => "collect(handler, …)",
    };
    let message = format!("no codel of this name, and it is not the built-in function `{form}`");
    Diagnostic::new(&UNRESOLVED_CODEL, at, message)
}

pub(super) fn not_callable<'db>(
    at: Location<'db>,
    name: &str,
    is: Option<FeatureKind>,
    hides: Option<Hidden>,
) -> Diagnostic<'db> {
    let what = match is {
        None => "a variable",
        Some(kind) if kind.is_port() => "a port",
        Some(_) => "a property",
    };
    let hidden = hides.map(|hidden| match hidden {
        Hidden::Codel => "codel",
        Hidden::Builtin => "built-in function",
    });
    let message = match hidden {
        Some(hidden) => format!("`{name}` is {what} here, which hides the {hidden} of that name: rename one of them"),
        None => format!("`{name}` is {what}: only codels and operations are called"),
    };
    Diagnostic::new(&UNRESOLVED_CODEL, at, message)
}
