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

/// The fix changes the field to `near`.
pub(super) fn report<'db>(at: Location<'db>, name: &str, near: Option<ActivityField>) -> Diagnostic<'db> {
    let found = Diagnostic::new(&UNKNOWN_FIELD, at.clone(), message(name));
    match near {
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
