//! # unresolved-include
//!
//! An `include` names a file that does not exist. The file is searched in the folder of the including file, then in the
//! folders of the environment variable `MAUVE_MODELS`, which are separated by colons. Names that the missing file may declare
//! are not reported.
//!
//! ```mauve
//! include "lasr.mal"   // error
//! include "laser.mal"
//! //- /laser.mal
//! codel scan(): int
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, path: &str, candidates: &[String], near: Option<Name>) -> Diagnostic<'db> {
    let message = format!("no file `{path}`: looked for {}", candidates.join(", "));
    let diagnostic = Diagnostic::new(&UNRESOLVED_INCLUDE, at, message);
    diagnostic.did_you_mean(near.map(|near| format!("\"{near}\"").into()))
}

/// Reports an `include` of a folder with these models.
pub(super) fn folder<'db>(at: Location<'db>, path: &str, models: &[String]) -> Diagnostic<'db> {
    let message = format!("`{path}` is a folder: include each of its files");
    let found = Diagnostic::new(&UNRESOLVED_INCLUDE, at.clone(), message);
    if models.iter().any(|it| it.contains(['"', '\\'])) {
        return found;
    }
    let title = match models {
        [one] => format!("Include `{one}`"),
        several => format!("Include its {} files", several.len()),
    };
    let paths: Vec<String> = models.iter().map(|it| format!("\"{it}\"")).collect();
    found.fix(title, at, paths.join("\ninclude "))
}
