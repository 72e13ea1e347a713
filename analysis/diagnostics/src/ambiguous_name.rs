//! # ambiguous-name
//!
//! A name that several declarations have, where the text does not say which is meant. Write `library.name`, or give
//! one of them another name. A program cannot write the library of a codel: use one of the libraries only.
//!
//! ```mauve
//! library near { shell S { } }
//! library far { shell S { } }
//! core A(S) { update = { } }   // error
//! core B(near.S) { update = { } }
//! ```

use super::*;

code!(AMBIGUOUS_NAME, Error, "ambiguous-name");

pub(super) fn report<'db>(at: Location<'db>, kind: Kind, name: &str) -> Diagnostic<'db> {
    let advice = match kind {
        // Programs have no qualified names.
        Kind::Codel => "rename one, or `use` the library of the one that is meant alone",
        _ => "write the library before it, or rename one",
    };
    let message = format!("several {kind}s are called `{name}`: {advice}");
    Diagnostic::new(&AMBIGUOUS_NAME, at, message)
}
