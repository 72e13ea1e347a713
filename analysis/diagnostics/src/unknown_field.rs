//! # unknown-field
//!
//! An activity has a field that does not exist. It may be a misspelt one, and the activity is not analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 1 period = 10 deadlin = 5 }   // error
//!   activity back { priority = 2 period = 10 deadline = 5 }
//! }
//! ```

use super::*;
use crate::lists::alternatives;
use mauve_hir::similar_field;
use mauve_wcrt::ActivityField;

/// With the similar field, the activity would have it twice where it is set.
pub(super) fn report<'db>(at: Location<'db>, name: &str, is_similar_set: bool) -> Diagnostic<'db> {
    let found = Diagnostic::new(&UNKNOWN_FIELD, at.clone(), message(name));
    match similar_field(name).filter(|_| !is_similar_set) {
        Some(near) => {
            found.fix(format!("Change to `{}`", near.keyword()), at, near.keyword().to_owned())
        }
        None => found,
    }
}

pub(super) fn message(name: &str) -> String {
    match similar_field(name) {
        Some(near) => format!("unknown field `{name}`; did you mean `{}`?", near.keyword()),
        None => format!("unknown field `{name}`: expected {}", alternatives(&ActivityField::KEYWORDS)),
    }
}
