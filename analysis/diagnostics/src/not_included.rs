//! # not-included
//!
//! A model in the folder that no root of `mauve.toml` includes, directly or over others. Nothing in it is checked, and no
//! deployment in it is analysed. Include it, or name it as a root too (`roots = ["robot.mal", "bench.mal"]`).
//!
//! ```mauve
//! codel plan(): int
//! //- /bench.mal
//! codel land(): int   // warning
//! //- /mauve.toml
//! project.root = "model.mal"
//! ```

use super::*;

code!(NOT_INCLUDED, Warning, "not-included");

pub(super) fn report<'db>(file: File) -> Diagnostic<'db> {
    let message = "no root includes this file: nothing in it is checked";
    Diagnostic::new(&NOT_INCLUDED, Location::Range(file, 0, 0), message.to_owned())
}
