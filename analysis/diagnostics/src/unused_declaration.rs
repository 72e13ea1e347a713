//! # unused-declaration
//!
//! The project has deployments, but none of them uses this shell, core, component or architecture.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! core Old(S) { update = { } }   // hint
//! component K(S, C)
//! architecture A { instance a: K }
//! deployment D { architecture A  activity a { priority = 1 period = 10 } }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, kind: Kind, name: &str) -> Diagnostic<'db> {
    Diagnostic::new(&UNUSED_DECLARATION, at, format!("no deployment uses {kind} `{name}`"))
}
