//! # condition-type
//!
//! The condition of an `if`, or the guard of a transition, is neither true nor false.
//!
//! ```mauve
//! shell S { input port scan: int }
//! core C(S) {
//!   var n: int = 0
//!   statemachine {
//!     initial state A {
//!       run = {
//!         if n then { } else { }   // error
//!         if n > 0 then { n = 0; } else { }
//!       }
//!       transition t if read(scan, n) to A   // error
//!       transition u if read(scan, n) == new_data to A
//!     }
//!   }
//! }
//! ```

use super::*;

code!(CONDITION_TYPE, Error, "condition-type");

pub(crate) fn report<'db>(at: Place<'db>, found: &Type) -> Diagnostic<'db> {
    let hint = match found {
        Type::PortStatus => ": compare it, as in `== new_data`",
        Type::CallStatus => ": compare it, as in `== success`",
        found if found.is_number() => ": compare it, as in `> 0`",
        _ => "",
    };
    let found = match found {
        Type::Void => "this gives nothing".to_owned(),
        found => format!("this is {found}"),
    };
    Diagnostic::new(&CONDITION_TYPE, at, format!("a condition is true or false, and {found}{hint}"))
}
