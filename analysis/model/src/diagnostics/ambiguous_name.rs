//! # ambiguous-name
//!
//! A name that several declarations have, where the text does not say which is meant. Write `library.name`, or give
//! one of them another name.
//!
//! ```mauve
//! library near { shell S { } }
//! library far { shell S { } }
//! core A(S) { update = { } }   // error
//! core B(near.S) { update = { } }
//! ```

use super::*;

code!(AMBIGUOUS_NAME, Error, "ambiguous-name");

pub(crate) fn report<'db>(at: Place<'db>, kind: Kind, name: &str) -> Diagnostic<'db> {
    let message = format!("several {kind}s are called `{name}`: write the library before it, or rename one");
    Diagnostic::new(&AMBIGUOUS_NAME, at, message)
}
