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
//! If a file that is not included declares it, the fix includes the file:
//!
//! ```mauve
//! core Reading(SonarShell) { update = { } }   // error
//! //- /sonar/shell.mal
//! shell SonarShell { }
//! //- /mauve.toml
//! project.root = "model.mal"
//! ```
//!
//! A name is looked up in its own library, then in the libraries that this library uses (`use nav`). Declarations outside
//! libraries see all libraries.

use super::*;
use mauve_hir::component;

/// Reports `component C(core, shell)`.
pub(super) fn swapped<'db>(db: &'db dyn ModelDb, at: Location<'db>, first: &TypeRef) -> Diagnostic<'db> {
    let message = format!("`{first}` is a core: the shell comes first, then the core");
    let found = Diagnostic::new(&UNRESOLVED_SHELL, at.clone(), message);
    let Location::Source(of, _) = at else { return found };
    let Some(data) = component(db, of) else { return found };
    let (Some(one), Some(other)) = (&data.shell, &data.core) else { return found };
    let edits = vec![(beside(&at, one.id), other.to_string()), (beside(&at, other.id), one.to_string())];
    Diagnostic { fixes: vec![Fix { title: "Swap the shell and the core".to_owned(), edits }], ..found }
}
