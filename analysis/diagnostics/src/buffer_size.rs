//! # buffer-size
//!
//! The size of a connection's buffer is not between 1 and 2147483647. A connection without a buffer keeps the newest value
//! only; a connection with `[n]` keeps the last *n* values.
//!
//! ```mauve
//! shell S { output port way: int  input port goal: int }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A {
//!   instance a: K
//!   instance b: K
//!   connection a.way -> [0] b.goal   // error
//!   connection b.way -> [4] a.goal
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, size: &str) -> Diagnostic<'db> {
    let message = format!("buffer size {size} is invalid: use a size from 1 to 2147483647");
    let nearest = if size.trim_matches('0').is_empty() { 1 } else { i32::MAX };
    Diagnostic::new(&BUFFER_SIZE, at.clone(), message).fix(format!("Change to `{nearest}`"), at, nearest.to_string())
}
