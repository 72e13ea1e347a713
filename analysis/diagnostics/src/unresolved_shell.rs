//! # unresolved-shell
//!
//! A core, a component or another shell names a shell that is not declared.
//!
//! ```mauve
//! shell LaserShell { }
//! core LaserCore(LasrShell) { update = { } }   // error
//! core Good(LaserShell) { update = { } }
//! ```
//!
//! Where a file declares it that is not included, the fix includes it:
//!
//! ```mauve
//! core Reading(SonarShell) { update = { } }   // error
//! //- /sonar/shell.mal
//! shell SonarShell { }
//! //- /mauve.toml
//! project.root = "model.mal"
//! ```
//!
//! A name is looked up in its own library, then in the libraries that it uses (`use nav`). What stands outside any
//! library sees everything.

use super::*;

code!(UNRESOLVED_SHELL, Error, "unresolved-shell");

/// Reports `component C(core, shell)`.
pub(super) fn swapped<'db>(at: Location<'db>, first: &TypeRef) -> Diagnostic<'db> {
    let message = format!("`{first}` is a core: the shell comes first, then the core");
    Diagnostic::new(&UNRESOLVED_SHELL, at, message)
}
