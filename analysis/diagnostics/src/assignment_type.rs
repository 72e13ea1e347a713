//! # assignment-type
//!
//! The type of a value differs from that of its variable, property, constant or port. Only an `int` converts to `double` or
//! `float` implicitly.
//!
//! ```mauve
//! codel stop(): void
//! shell S {
//!   property speed: double = 1
//!   property name: string = 1   // error
//!   output port way: int
//! }
//! core C(S) {
//!   var near: bool = 1   // error
//!   var far: double = 1
//!   update = {
//!     near = far < 2;
//!     near = stop();   // error
//!     far = "far";   // error
//!   }
//! }
//! component K(S, C)
//! architecture A {
//!   instance k: K
//!   property k.speed = true   // error
//!   property k.name = "k"
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, name: &str, expected: &Type, found: &Type) -> Diagnostic<'db> {
    let found = types::found(found);
    let expected = type_name(expected);
    Diagnostic::new(&ASSIGNMENT_TYPE, at, format!("`{name}` is of type {expected}, and {found}"))
}
