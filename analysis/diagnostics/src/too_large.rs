//! # too-large
//!
//! The project exceeds half a million features, instances and activities with this declaration, and is not analysed. A
//! shell counts with the features of all shells that it extends, an architecture with everything that it imports, and a
//! deployment with one activity for each instance.
//!
//! Divide the project: list several root files in `[project] roots` of `mauve.toml`. Each is analysed separately.

use super::*;

pub(super) fn report<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Diagnostic<'db> {
    let message = format!(
        "{} `{}` makes the project too large to analyse: divide it with `[project] roots` in `mauve.toml`",
        of.kind(db),
        of.name(db)
    );
    Diagnostic::new(&TOO_LARGE, Location::name_of(of), message)
}
