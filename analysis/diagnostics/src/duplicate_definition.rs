//! # duplicate-definition
//!
//! A name is defined twice in one scope: in a library (in all its files together), a shell, a core, a state machine, a state,
//! an architecture, a block or a list of parameters. The analysis does not know which definition is right, so nothing that uses
//! the name is analysed. Rename or remove one of them.
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

pub(super) fn report<'db>(at: Location<'db>, what: Defined, name: &str, first: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("{} `{name}` is defined twice: rename or remove one of them", shown(what));
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "first definition")
}

/// Reports a second value for a property or constant in a declaration.
pub(super) fn value<'db>(at: Location<'db>, instance: &str, name: &str, first: &Location<'db>) -> Diagnostic<'db> {
    let message = format!("`{instance}.{name}` is set twice: remove one of the values");
    Diagnostic::new(&DUPLICATE_DEFINITION, at, message).related(first, "first value")
}

fn shown(what: Defined) -> String {
    let what = match what {
        Defined::Variable => "variable",
        Defined::Handler => "handler",
        Defined::Operation => "operation",
        Defined::State => "state",
        Defined::Transition => "transition",
        Defined::Feature => "feature",
        Defined::Parameter => "parameter",
        Defined::Instance => "instance",
        Defined::Declaration(kind) => return kind.to_string(),
    };
    what.to_owned()
}
