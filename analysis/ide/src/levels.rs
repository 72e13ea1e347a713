//! The significance levels of the timing tables.

use mauve_hir::{ModelDb, Workspace, projects};
use mauve_timing::Level;
use mauve_wcrt::levels_of_tables;

/// Returns the levels of all tables in descending order of probability; empty if no time depends on a level, so that any level can
/// be selected.
///
/// ```
/// use mauve_hir::{Database, Workspace};
///
/// let db = Database::default();
/// let files = [
///     ("/robot.mal".into(), "codel plan(): int".to_owned()),
///     ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
///     ("/times.toml".into(), "levels = [1e-3, 1e-4]\ncodel.plan = [60, 70]".to_owned()),
/// ];
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let levels = mauve_ide::known_levels(&db, &[workspace]);
/// assert_eq!(levels.iter().map(ToString::to_string).collect::<Vec<_>>(), ["1e-3", "1e-4"]);
/// ```
pub fn known_levels(db: &dyn ModelDb, workspaces: &[Workspace]) -> Vec<Level> {
    let projects = workspaces.iter().flat_map(|&workspace| projects(db, workspace));
    let mut levels: Vec<Level> = Vec::new();
    for &project in projects {
        levels.extend(levels_of_tables(db, project));
    }
    levels.sort_unstable_by(|a, b| b.cmp(a));
    levels.dedup();
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;

    #[test]
    fn times_that_hold_at_every_level_have_none() {
        let Fixture { db, workspace, .. } = Fixture::new(
            "codel plan(): int\n//- /mauve.toml\ntiming.tables = [\"t.toml\"]\n//- /t.toml\ncodel.plan = 1\n",
        );
        assert_eq!(known_levels(&db, &[workspace]), []);
    }
}
