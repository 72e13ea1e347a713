//! # duplicate-definition
//!
//! Two things of one kind have one name in one place: in a library (over all its files), a shell, a core, a state
//! machine, a state or an architecture; or one block or list of parameters. Which one is meant is unknown, so nothing that uses the name is analysed.
//!
//! ```mauve
//! codel plan(): int
//! codel plan(): bool   // error
//! shell S { property a: int  input port a: int }   // error
//! core C(S) {
//!   statemachine {
//!     initial state Waiting { transition go to Moving  transition go to Waiting }   // error
//!     state Moving { transition go to Waiting }
//!   }
//! }
//! ```

use super::*;

code!(DUPLICATE_DEFINITION, Error, "duplicate-definition");

pub(crate) fn report<'db>(at: Place<'db>, what: &str, name: &str, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("a second {what} `{name}`: rename one of them");
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "the first is here")
}

/// A second value for one property or constant in one place.
pub(crate) fn value<'db>(at: Place<'db>, name: &str, first: Place<'db>) -> Diagnostic<'db> {
    let message = format!("a second value of `{name}`: remove one of them");
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "the first is here")
}

/// The names of `things` that come a second time in `of`.
pub(crate) fn among<'db, 'a>(
    of: Decl<'db>,
    things: impl Iterator<Item = (&'a NameRef, &'a str)>,
) -> Vec<Diagnostic<'db>> {
    let mut seen: FxHashMap<&Name, &NameRef> = FxHashMap::default();
    let mut found = Vec::new();
    for (name, what) in things.filter(|(name, _)| !name.name.is_empty()) {
        match seen.get(&name.name) {
            Some(first) => {
                let (at, first) = (Place::Part(of, name.part), Place::Part(of, first.part));
                found.push(report(at, what, &name.name, first));
            }
            None => {
                seen.insert(&name.name, name);
            }
        }
    }
    found
}
