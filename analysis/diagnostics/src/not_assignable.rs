//! # not-assignable
//!
//! A program assigns only to variables. Architectures and deployments set properties and constants, `write` writes ports, and
//! the value of an `in` parameter belongs to the caller.
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

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    name: &str,
    is: Option<FeatureKind>,
) -> Diagnostic<'db> {
    let is = match is {
        None => "an `in` parameter: its value belongs to the caller".to_owned(),
        Some(FeatureKind::Property) => "a property: an architecture or a deployment sets its value".to_owned(),
        Some(FeatureKind::Constant) => "a constant: an architecture or a deployment sets its value".to_owned(),
        Some(FeatureKind::Output) => {
            let message = format!("`{name}` is an output port: `write({name}, value)` writes it");
            let found = Diagnostic::new(&NOT_ASSIGNABLE, at.clone(), message);
            return match statement::assignment_at(db, &at) {
                Some(assignment) => assignment.replaced(found, format!("write({name}, {})", assignment.value)),
                None => found,
            };
        }
        Some(_) => "an input port: a program only reads it".to_owned(),
    };
    Diagnostic::new(&NOT_ASSIGNABLE, at, format!("`{name}` is {is}"))
}
