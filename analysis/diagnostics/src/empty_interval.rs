//! # empty-interval
//!
//! The lower bound of an interval is greater than its upper bound, so the interval contains no value.
//!
//! ```mauve
//! shell S {
//!   property speed: double [2; 0.5]   // error
//!   property rate: int [1; 1] = 1
//! }
//! ```
//!
//! Fix: swap the bounds.

use super::*;
use mauve_hir::Value;

pub(super) fn report<'db>(at: Location<'db>, [low, high]: &[Value; 2]) -> Diagnostic<'db> {
    let message = format!("empty interval: the lower bound {low} is greater than the upper bound {high}");
    let swapped = format!("[{}; {}]", high.text(), low.text());
    Diagnostic::new(&EMPTY_INTERVAL, at.clone(), message).fix(format!("Change to `{swapped}`"), at, swapped)
}
