//! # empty-interval
//!
//! The lower end of an interval is greater than its upper end: no value lies in it.
//!
//! ```mauve
//! shell S {
//!   property speed: double [2; 0.5]   // error
//!   property rate: int [1; 1] = 1
//! }
//! ```

use super::*;
use mauve_hir::Value;

code!(EMPTY_INTERVAL, Error, "empty-interval");

pub(super) fn report<'db>(at: Location<'db>, [low, high]: &[Value; 2]) -> Diagnostic<'db> {
    let message = format!("no value lies in this interval: {low} is greater than {high}");
    let swapped = format!("[{}; {}]", high.text(), low.text());
    Diagnostic::new(&EMPTY_INTERVAL, at.clone(), message).fix(format!("Change to `{swapped}`"), at, swapped)
}
