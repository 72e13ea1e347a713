//! Type hierarchy: the shells that a shell extends, and those that extend it.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, bases_of, names_of};
use mauve_syntax::TextSize;

use crate::hierarchy::{HierarchyItem, declaration_of, item_of};
use crate::occurrences::{each_once, names_at};

/// Returns the shell at `offset`.
pub fn type_items(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Vec<HierarchyItem> {
    let names = names_at(db, project, file, offset);
    items(db, names.iter().filter_map(|name| name.definition.declaration(db, Kind::Shell)))
}

/// Returns the shells that an item's shell extends.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "shell Sensor { } shell Laser extends Sensor { }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let laser = &mauve_ide::type_items(&db, projects(&db, workspace)[0], file, 23.into())[0];
/// let sensor = &mauve_ide::supertypes(&db, projects(&db, workspace)[0], file, &laser.id)[0];
/// assert_eq!((laser.name.as_str(), sensor.name.as_str()), ("Laser", "Sensor"));
/// assert_eq!(mauve_ide::subtypes(&db, projects(&db, workspace)[0], file, &sensor.id), [laser.clone()]);
/// ```
pub fn supertypes(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<HierarchyItem> {
    let Some((of, _)) = declaration_of(db, file, id) else { return Vec::new() };
    items(db, bases_of(db, project, of).into_iter())
}

/// Returns the shells that extend an item's shell.
pub fn subtypes(db: &dyn ModelDb, project: Project<'_>, file: File, id: &str) -> Vec<HierarchyItem> {
    let Some((of, _)) = declaration_of(db, file, id) else { return Vec::new() };
    let all = names_of(db, project).of_kind(db, Kind::Shell);
    items(db, all.filter(|&decl| bases_of(db, project, decl).contains(&of)))
}

fn items<'db>(db: &'db dyn ModelDb, shells: impl Iterator<Item = Decl<'db>>) -> Vec<HierarchyItem> {
    each_once(shells.filter_map(|decl| item_of(db, decl)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of, with_cursor};
    use crate::project::projects_with;
    use expect_test::{Expect, expect};

    /// The shell at the cursor, those above it, and those below; of several projects, with their roots.
    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let mut shown = String::new();
        let projects = projects_with(&db, &[workspace], file);
        let items = projects.iter().flat_map(|&project| {
            type_items(&db, project, file, offset).into_iter().map(move |item| (project, item))
        });
        for (project, item) in items {
            let root = project.root(&db).path(&db).display();
            shown += &if projects.len() > 1 {
                format!("{} in {root}\n", item.name)
            } else {
                format!("{}\n", item.name)
            };
            for (arrow, all) in [
                ("<", supertypes(&db, project, item.file, &item.id)),
                (">", subtypes(&db, project, item.file, &item.id)),
            ] {
                for item in all {
                    let (path, name) = (item.file.path(&db).display(), &item.file.text(&db)[item.name_range]);
                    assert_eq!(name, item.name);
                    shown += &format!("{arrow} {name} | {path} {}\n", item.detail);
                }
            }
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn above_and_below_over_files() {
        const SHELLS: &str =
            "\n//- /base.mal\nlibrary base { shell Device { } shell Sensor extends Device { } }\n";
        let robots = format!(
            "//- /a.mal\ninclude \"base.mal\"\n/* 🦀 */ shell Laser extends base.Sensor, base.Device {{ }}{SHELLS}\
             //- /b.mal\ninclude \"base.mal\"\nshell Sonar extends base.Sensor {{ }}\n"
        );
        check(
            &with_cursor(&robots, "Laser extends base.Sen$0sor"),
            expect![[r#"
                Sensor
                < Device | /base.mal library base
                > Laser | /a.mal 
            "#]],
        );
        check(
            &with_cursor(&robots, "shell Sen$0sor"),
            expect![[r#"
                Sensor in /a.mal
                < Device | /base.mal library base
                > Laser | /a.mal 
                Sensor in /b.mal
                < Device | /base.mal library base
                > Sonar | /b.mal 
            "#]],
        );
        check(
            &format!("shell $0Laser extends base.Sensor, base.Device {{ }}{SHELLS}"),
            expect![[r#"
            Laser
        "#]],
        );
        check(
            "shell $0A extends B { } shell B extends A { }",
            expect![[r#"
            A
            < B | /model.mal 
            > B | /model.mal 
        "#]],
        );
        check(
            "shell A { } core C($0A) { } component P(A, C)",
            expect![[r#"
            A
        "#]],
        );
    }

    #[test]
    fn an_item_of_another_text() {
        let Fixture { db, workspace, file, .. } = Fixture::new("shell A { } shell B extends A { }");
        let found = supertypes(&db, project_of(&db, workspace, file), file, "shell - B 0");
        assert_eq!(found.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["A"]);
        for id in
            ["shell - C 0", "shell l B 0", "codel - B 0", "shell - B 1", "shell - B", "", "shell - B x y"]
        {
            assert_eq!(supertypes(&db, project_of(&db, workspace, file), file, id), [], "{id}");
        }
    }
}
