//! # buffer-size
//!
//! The circular buffer of a connection has room for one value or more. Without any, a connection keeps the newest value.
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

code!(BUFFER_SIZE, Error, "buffer-size");

pub(super) fn report<'db>(at: Location<'db>, size: &str) -> Diagnostic<'db> {
    let message = format!("a buffer of {size}: it has room for 1 to 2147483647 values");
    let nearest = if size.trim_matches('0').is_empty() { 1 } else { i32::MAX };
    Diagnostic::new(&BUFFER_SIZE, at.clone(), message).fix(format!("Set it to {nearest}"), at, nearest.to_string())
}
