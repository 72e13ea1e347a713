//! # outside-interval
//!
//! A value lies outside the interval of its property or constant. Both ends belong to an interval.
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

use super::*;
use mauve_hir::Value;

code!(OUTSIDE_INTERVAL, Error, "outside-interval");

pub(super) fn report<'db>(at: Location<'db>, name: &str, value: &Value, [low, high]: &[Value; 2], declared: Option<&Location<'db>>) -> Diagnostic<'db> {
    let message = format!("{value} is outside of [{low}; {high}], the interval of `{name}`");
    let is_low = value.number() < low.number();
    let nearest = if is_low { low } else { high };
    let found = Diagnostic::new(&OUTSIDE_INTERVAL, at.clone(), message)
        .fix(format!("Set it to {nearest}"), at, nearest.text());
    match declared {
        Some(declared) => found.related(declared, "the interval"),
        None => found,
    }
}
