//! # wrong-shell
//!
//! A component is a shell and a core *for that shell*, or for one that it extends.
//!
//! ```mauve
//! shell LaserShell { }
//! shell PilotShell { }
//! core PilotCore(PilotShell) { update = { } }
//! component Laser(LaserShell, PilotCore)   // error
//! component Pilot(PilotShell, PilotCore)
//! ```

use super::*;

code!(WRONG_SHELL, Error, "wrong-shell");

pub(super) fn report<'db>(at: Location<'db>, core: &str, shell: &str) -> Diagnostic<'db> {
    Diagnostic::new(&WRONG_SHELL, at, format!("core {core} is for another shell than {shell}"))
}
