//! # syntax-error
//!
//! Text that the grammar does not allow. The message says what was expected there.
//!
//! ```mauve
//! codel plan(in goal Pose): Path   // error
//! codel land(): bool
//! ```
//!
//! A half-typed line costs that line and nothing else: the declarations around it mean what they say. But nothing is
//! analysed that rests on what was lost. A program with a syntax error has no time, so its component has none; a
//! deployment with one may lack an activity, so none of it is analysed. A half-typed declaration may be one whose name a
//! program uses: a name that its own library lacks is not looked for in others meanwhile.

use super::*;

code!(SYNTAX_ERROR, Error, "syntax-error");

pub(super) fn report<'db>(at: Place<'db>, message: String) -> Diagnostic<'db> {
    Diagnostic::new(&SYNTAX_ERROR, at, message)
}
