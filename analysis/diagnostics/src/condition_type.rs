//! # condition-type
//!
//! The condition of an `if`, or the guard of a transition, is not of type `bool`.
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
//!
//! Fix: compare a number with 0, a status with `new_data` or `success`.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, found: &Type) -> Diagnostic<'db> {
    let comparison = match found {
        Type::PortStatus => Some("== new_data"),
        Type::CallStatus => Some("== success"),
        found if found.is_number() => Some("!= 0"),
        _ => None,
    };
    let is = types::found(found);
    let advice = comparison.map_or_else(String::new, |it| format!(": compare it, as in `{it}`"));
    let message = format!("a condition is true or false, and {is}{advice}");
    let report = Diagnostic::new(&CONDITION_TYPE, at.clone(), message);
    // Operators with a number or a status as result bind closer than a comparison.
    match (comparison, at) {
        (Some(comparison), Location::Source(of, id)) => {
            report.fix(format!("Write `{comparison}`"), Location::Behind(of, id), format!(" {comparison}"))
        }
        _ => report,
    }
}
