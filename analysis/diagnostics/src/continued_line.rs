//! # continued-line
//!
//! A line that begins with `(` or `-` goes on with the value of the variable before it, which has no `;` at its end.
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

code!(CONTINUED_LINE, Hint, "continued-line");

/// `white`: the white space before the line, unless there is a comment.
pub(super) fn report<'db>(at: Location<'db>, white: Option<SourceId>, name: &str) -> Diagnostic<'db> {
    let message = format!("this line is part of the value of `{name}`: end that with `;` if it is not meant to be");
    let join = white.map(|white| beside(&at, white));
    let found = Diagnostic::new(&CONTINUED_LINE, at, message);
    match join {
        Some(white) => found.fix("Join the lines", white, " ".to_owned()),
        None => found,
    }
}
