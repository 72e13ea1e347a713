//! # no-effect
//!
//! A statement without a call and without an assignment has no effect. It may be a call without its name or its
//! parentheses, whose execution time is missing: the program is not analysed.
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

pub(super) fn report<'db>(db: &'db dyn ModelDb, at: Location<'db>) -> Diagnostic<'db> {
    let message = "this statement has no effect: call a codel, or assign a variable";
    let found = Diagnostic::new(&NO_EFFECT, at.clone(), message);
    match statement::comparison_at(db, &at) {
        Some(equals) => {
            let message = "this comparison has no effect; did you mean `=`?".to_owned();
            Diagnostic { message, ..found }.fix("Change to `=`", equals, "=".to_owned())
        }
        None => found,
    }
}
