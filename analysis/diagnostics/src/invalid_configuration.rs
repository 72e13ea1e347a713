//! # invalid-configuration
//!
//! `mauve.toml` is not TOML, or has an unknown section, an unknown key or an invalid value. A misspelt key may be one that makes
//! response times longer, and a string over several lines may contain one: nothing is analysed until the error is corrected.
//! (A root that does not exist is left out, and the others are analysed.)
//!
//! ```mauve
//! codel plan(): int
//! //- /mauve.toml
//! [platfrom]   # error
//! rt_throttling = true
//! [timing]
//! significanse = 1e-4   # error
//! ```
//!
//! `[timing] required` is an error too if the timing tables have no level that is rare enough for it: the rarest one is analysed.
//!
//! Fix: replace a misspelt section or key by the similar one.

use mauve_hir::required_of;
use mauve_wcrt::LackingLevel;

use super::*;

pub(crate) fn report<'db>(at: Location<'db>, message: String) -> Diagnostic<'db> {
    Diagnostic::new(&INVALID_CONFIGURATION, at, message)
}

/// The tables of a deployment have no level that is rare enough for `required`.
pub(super) fn lacking_level<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    deployment: Decl<'db>,
    LackingLevel { needed, executions, table }: &LackingLevel,
) -> Diagnostic<'db> {
    let required = required_of(db, project, deployment).map_or("", |it| &it.written);
    let path = table.table.path(db);
    let path = path.strip_prefix(project.workspace(db).folder(db)).unwrap_or(path).display();
    let levels: Vec<String> = table.levels.iter().chain([needed]).map(ToString::to_string).collect();
    let message = format!(
        "`required` is {required}, and the times of {executions} executions in that time depend on the level: {} needs times at \
         {needed}; {}; measure them: `mauve pwcet SAMPLES -o {path} --levels {}`",
        deployment.name(db),
        table_reasons::table_levels(db, table),
        levels.join(",")
    );
    report(at, message)
}
