//! # not-included
//!
//! A model in the folder is not included by any root of `mauve.toml`, directly or indirectly. It is not checked, and its
//! deployments are not analysed. Include it, or name it as a root too (`roots = ["robot.mal", "bench.mal"]`).
//!
//! ```mauve
//! codel plan(): int
//! //- /bench.mal
//! codel land(): int   // warning
//! //- /mauve.toml
//! project.root = "model.mal"
//! ```

use super::*;

pub(super) fn report<'db>(file: File) -> Diagnostic<'db> {
    let message = "no root includes this file, so it is not checked";
    Diagnostic::new(&NOT_INCLUDED, Location::Range(file, 0, 0), message.to_owned())
}
