//! # return-type
//!
//! A program returns a value of a wrong type. `configure` and `start` return a `bool`, and `true` without a `return`; `stop`,
//! `cleanup`, `update` and the programs of a state return no value; an operation returns a value of the type in its shell, on
//! every path.
//!
//! ```mauve
//! shell S { provide near(in far: double): bool  provide stop(): void }
//! core C(S) {
//!   provide near(in far: double): bool = {   // error
//!     if far < 2 then { return true; } else { }
//!   }
//!   provide stop() = { return; }
//!   configure = { return 1; }   // error
//!   start = { }
//!   update = { return true; }   // error
//! }
//! ```

use super::*;
use mauve_hir::fact::ProgramName;

pub(super) fn report<'db>(at: Location<'db>, of: &ProgramName, expected: &Type, found: &Type) -> Diagnostic<'db> {
    let what = match of {
        ProgramName::Hook(kind) => format!("`{}`", kind.keyword()),
        ProgramName::Method(kind) => format!("`{}`", kind.keyword()),
        ProgramName::Effect => "the program of a transition".to_owned(),
        ProgramName::Operation(name) => format!("`{name}`"),
    };
    let expectation = match expected {
        Type::Void => format!("{what} returns no value"),
        expected => format!("{what} returns {}", type_name(expected)),
    };
    let found = match found {
        Type::Void => "this has no value".to_owned(),
        found => format!("this is {}", type_name(found)),
    };
    Diagnostic::new(&RETURN_TYPE, at, format!("{expectation}, and {found}"))
}

/// Reports an operation that may end without a `return`.
pub(super) fn missing<'db>(at: Location<'db>, name: &str, expected: &Type) -> Diagnostic<'db> {
    let expected = type_name(expected);
    let message = format!("`{name}` returns {expected}, and not every path of it ends with a `return`");
    Diagnostic::new(&RETURN_TYPE, at, message)
}
