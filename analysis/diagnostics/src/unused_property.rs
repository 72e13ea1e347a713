//! # unused-property
//!
//! No core of this shell, or of a shell that extends it, reads this property or constant.
//!
//! ```mauve
//! codel drive(in speed: int): void
//! shell S {
//!   property speed: int = 1
//!   property rate: int = 1   // hint
//! }
//! core C(S) { update = { drive(speed); } }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, kind: FeatureKind, name: &str) -> Diagnostic<'db> {
    let what = if kind == FeatureKind::Constant { "constant" } else { "property" };
    Diagnostic::new(&UNUSED_PROPERTY, at, format!("{what} `{name}` is never read"))
}
