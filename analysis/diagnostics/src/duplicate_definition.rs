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
use mauve_hir::fact::Defined;

code!(DUPLICATE_DEFINITION, Error, "duplicate-definition");

pub(super) fn report<'db>(at: Location<'db>, what: Defined, name: &str, first: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("a second {} `{name}`: rename one of them", shown(what));
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "the first is here")
}

/// Reports a second value for a property or constant in a declaration.
pub(super) fn value<'db>(at: Location<'db>, instance: &str, name: &str, first: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("a second value of `{instance}.{name}`: remove one of them");
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "the first is here")
}

fn shown(what: Defined) -> String {
    let what = match what {
        Defined::Variable => "variable",
        Defined::Handler => "handler",
        Defined::Operation => "definition of the operation",
        Defined::State => "state",
        Defined::Transition => "transition",
        Defined::Feature => "feature",
        Defined::Parameter => "parameter",
        Defined::Instance => "instance",
        Defined::Declaration(kind) => return kind.to_string(),
    };
    what.to_owned()
}
