//! `mauve check - --stdin-path FILE`: a text on standard input in place of a file, as linters in editors give it.
//!
//! ```sh
//! mauve check - --stdin-path robot/base.mal --format json < unsaved.mal
//! ```
//!
//! The diagnostics are those of the file's project with this text in it. The file need not exist.

use std::path::{Path, PathBuf};

use mauve_hir::{Database, Workspace};
use mauve_projects::disk::{LONGEST, at_most, text_in};
use mauve_projects::load::{load, load_with};

/// Returns the workspaces that `paths` name; if they are `-`, those of the file that standard input replaces.
///
/// # Errors
///
/// Those of [`load`]; one of `-` and the file is given without the other.
pub(super) fn load_or_read(
    db: &mut Database,
    paths: &[PathBuf],
    replaced: Option<&Path>,
    allows_outside: bool,
) -> Result<Vec<Workspace>, String> {
    let is_input = |path: &PathBuf| path.as_os_str() == "-";
    match (paths, replaced) {
        ([path], Some(file)) if is_input(path) => {
            let (text, problem) = text_in(at_most(LONGEST, std::io::stdin().lock()));
            load_with(db, file, &text, problem, allows_outside)
        }
        (_, Some(_)) => Err("`--stdin-path` names the file that standard input replaces: it needs `-` as PATH, which cannot be \
             combined with other paths"
            .to_owned()),
        _ if paths.iter().any(is_input) => {
            Err("`-` is standard input: name the file of a project that it replaces, with `--stdin-path FILE`".to_owned())
        }
        _ => load(db, paths, allows_outside),
    }
}
