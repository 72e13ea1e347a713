//! # no-effect
//!
//! A statement that calls nothing and assigns nothing does nothing. It may be a call that lost its name or its brackets,
//! and with it the time that it takes: the program is not analysed.
//!
//! ```mauve
//! codel plan(in speed: int): int
//! shell S { }
//! core C(S) {
//!   var speed: int = 0
//!   update = {
//!     (speed);   // error
//!     speed == 3;   // error
//!     plan(speed);
//!   }
//! }
//! ```

use super::*;

code!(NO_EFFECT, Error, "no-effect");

pub(super) fn report<'db>(at: Location<'db>) -> Diagnostic<'db> {
    let message = "this statement does nothing: call a codel, or assign a variable";
    Diagnostic::new(&NO_EFFECT, at, message)
}
