//! # continued-line
//!
//! A line begins with `(` or `-`, and the variable before it has no `;` at its end: so the line continues the value of that
//! variable. If the line is a statement of its own, end the variable with `;`. Otherwise join the lines.
//!
//! ```mauve
//! codel f(in n: int): int
//! shell S { }
//! core C(S) {
//!   var a: int = 1
//!     - 2   // hint
//!   var b: int = 1
//!     + 2
//!   update = { a = f(a + b); }
//! }
//! ```
//!
//! Fix: join the two lines.

use super::*;

/// `white`: the white space before the line, unless there is a comment.
pub(super) fn report<'db>(at: Location<'db>, white: Option<SourceId>, name: &str) -> Diagnostic<'db> {
    let message = format!("this line continues the value of `{name}`: if it is a statement of its own, end `{name}` with `;`");
    let join = white.map(|white| beside(&at, white));
    let found = Diagnostic::new(&CONTINUED_LINE, at, message);
    match join {
        Some(white) => found.fix("Join the lines", white, " ".to_owned()),
        None => found,
    }
}
