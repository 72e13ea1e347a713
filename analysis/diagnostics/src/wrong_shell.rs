//! # wrong-shell
//!
//! The core of a component implements another shell. A component consists of a shell and a core for this shell, or for a
//! shell that it extends.
//!
//! ```mauve
//! shell LaserShell { }
//! shell PilotShell { }
//! core PilotCore(PilotShell) { update = { } }
//! component Laser(LaserShell, PilotCore)   // error
//! component Pilot(PilotShell, PilotCore)
//! ```
//!
//! Fix: name the shell of the core.

use super::*;
use mauve_hir::{component, shell_of};

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    core: Decl<'db>,
    shell: Decl<'db>,
) -> Diagnostic<'db> {
    let (name, wrong) = (core.name(db), shell.name(db));
    let own = shell_of(db, project, core);
    let implements = own.map_or_else(|| "another shell".to_owned(), |own| format!("`{}`", own.name(db)));
    let message = format!("core `{name}` implements {implements}, not `{wrong}`");
    let found = Diagnostic::new(&WRONG_SHELL, at.clone(), message);
    let Location::Source(of, _) = at else { return found };
    let written = component(db, of).and_then(|it| it.shell.as_ref());
    match written.zip(own.and_then(|own| Scope { db, project, of }.written_in(own))) {
        Some((written, own)) => {
            let title = format!("Change the shell to `{own}`");
            found.fix(title, Location::Source(of, written.id), own.to_string())
        }
        None => found,
    }
}
