//! # outside-interval
//!
//! The value of a property or constant is outside its interval. Both bounds belong to the interval.
//!
//! ```mauve
//! shell S { property speed: double [0; 2] = 2  property rate: int [1; 50] = 100 }   // error
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A {
//!   instance k: K
//!   property k.speed = 0.5 * 5   // error
//!   property k.rate = 1
//! }
//! ```
//!
//! Fix: change the value to the nearest bound.

use super::*;
use mauve_hir::Value;

pub(super) fn report<'db>(at: Location<'db>, name: &str, value: &Value, [low, high]: &[Value; 2], declared: Option<&Location<'db>>) -> Diagnostic<'db> {
    let message = format!("{value} is outside the interval [{low}; {high}] of `{name}`");
    let is_low = value.number() < low.number();
    let nearest = if is_low { low } else { high };
    let found = Diagnostic::new(&OUTSIDE_INTERVAL, at.clone(), message)
        .fix(format!("Change to `{}`", nearest.text()), at, nearest.text());
    match declared {
        Some(declared) => found.related(declared, "interval declared here"),
        None => found,
    }
}
