//! # not-assignable
//!
//! A program assigns to variables. Properties and constants get their values from architectures and deployments, ports are
//! written with `write`, and what comes in through an `in` parameter belongs to the caller.
//!
//! ```mauve
//! shell S { property speed: int = 1  output port way: int  provide set(in to: int): void }
//! core C(S) {
//!   var n: int = 0
//!   provide set(in to: int) = {
//!     to = 2;   // error
//!     n = to;
//!   }
//!   update = {
//!     speed = 2;   // error
//!     way = 2;   // error
//!     write(way, n);
//!   }
//! }
//! ```

use super::*;

code!(NOT_ASSIGNABLE, Error, "not-assignable");

pub(super) fn report<'db>(at: Location<'db>, name: &str, is: Option<FeatureKind>) -> Diagnostic<'db> {
    let is = match is {
        None => "an `in` parameter: its value belongs to the caller",
        Some(FeatureKind::Property) => "a property: architectures and deployments give it its value",
        Some(FeatureKind::Constant) => "a constant",
        Some(FeatureKind::Output) => "a port: write to it with `write(port, value)`",
        Some(_) => "an input port: nothing is assigned to it",
    };
    Diagnostic::new(&NOT_ASSIGNABLE, at, format!("`{name}` is {is}"))
}
