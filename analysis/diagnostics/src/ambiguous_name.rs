//! # ambiguous-name
//!
//! Several visible declarations have the name. Write `library.name`, or rename one of them. A program cannot write the
//! library of a codel: use only one of the libraries.
//!
//! ```mauve
//! library near { shell S { } }
//! library far { shell S { } }
//! core A(S) { update = { } }   // error
//! core B(near.S) { update = { } }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, kind: Kind, name: &str) -> Diagnostic<'db> {
    let advice = match kind {
        // Programs have no qualified names.
        Kind::Codel => "rename one, or use only one of their libraries",
        _ => "write the library before it, or rename one",
    };
    let message = format!("several {kind}s are called `{name}`: {advice}");
    Diagnostic::new(&AMBIGUOUS_NAME, at, message)
}
