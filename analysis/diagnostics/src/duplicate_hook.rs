//! # duplicate-hook
//!
//! A core has two programs for one hook (`configure`, `start`, `update`, `stop`, `cleanup`), or a state has two for one
//! method (`entry`, `run`, `handle`, `exit`). Merge them into one program.
//!
//! ```mauve
//! shell S { }
//! core C(S) {
//!   start = { }
//!   start = { }   // error
//!   update = { }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, keyword: &str) -> Diagnostic<'db> {
    Diagnostic::new(&DUPLICATE_HOOK, at, format!("a second `{keyword}`: merge the two programs"))
}
